"""Line numbers of tables and keys of a TOML text, which :mod:`tomllib` does not report.

The pieces of a text are found without backtracking, in linear time.  An unterminated string in an
invalid text is one piece.
"""

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence

Path = tuple[str | int, ...]

_STRING = (
    r'"""(?:[^"\\]|\\.?|"(?!""))*+"{0,5}+'
    r"|'''(?:[^']|'(?!''))*+'{0,5}+"
    r'|"(?:[^"\\\n]|\\.?)*+"?+'
    r"|'[^'\n]*+'?+"
)
_PIECE = re.compile(
    rf"{_STRING}|\#[^\n]*+|[\w \t-]++|.",  # a string, a comment, words, or another character
    re.DOTALL,
)
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def lines(text: str) -> dict[Path, int]:
    r"""Return the lines, counted from 1, of all tables and keys of a valid TOML text.

    Tables of an array are counted from 0; the line of the array is that of its first table.
    Values, elements of lists and keys of inline tables are not listed.

    Examples
    --------
    >>> lines("a = 1\n[[b]]\nc = 2\n[[b]]\n")
    {('a',): 1, ('b',): 2, ('b', 0): 2, ('b', 0, 'c'): 3, ('b', 1): 4}
    """
    result: dict[Path, int] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    for line, statement in _statements(text):
        if statement.startswith("["):
            table = _opened(_keys(statement), counts, array=statement.startswith("[["))
            result.setdefault(table[:1], line)
            result[table] = line
        else:
            path = (*table, *_keys(f"{statement} = 0"))
            result.setdefault(path[: len(table) + 1], line)
            result[path] = line
    return result


def key_length(text: str, limit: int) -> int:
    """Return the number of parts of the longest dotted key, counted up to a limit.

    It is an upper bound, because words and strings joined by dots count outside keys, too.

    Examples
    --------
    >>> key_length("a.'b.c'.d = 1.5", 100)
    3
    """
    longest = parts = 1
    for piece in _PIECE.finditer(text):
        token = piece[0]
        if token == ".":
            parts += 1
            longest = max(longest, parts)
            if longest >= limit:
                break
        elif token[0] not in "\"'" and not _is_words(token):
            parts = 1
    return longest


def line_of(path: Sequence[str | int], known: Mapping[Path, int]) -> int | None:
    """Return the line of a key, or of the innermost enclosing table that is listed, or None."""
    for length in range(len(path), 0, -1):
        if tuple(path[:length]) in known:
            return known[tuple(path[:length])]
    return None


def _is_words(token: str) -> bool:
    """Return whether a piece of a text consists of the characters of bare keys and blanks."""
    return token[0] in " \t-" or token[0].isalnum() or token[0] == "_"


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the text of each header, and of each key without its value."""
    line, first, begin, depth, key = 1, 1, 0, 0, ""
    for piece in _PIECE.finditer(text + "\n"):
        token = piece[0]
        line += token.count("\n")
        if token == "=" and not depth and not key:
            key = text[begin : piece.start()].strip()
        depth += (token in "[{") - (token in "]}")
        if token == "\n" and not depth:
            statement = key or text[begin : piece.start()].strip()
            if key or statement.startswith("["):
                yield first, statement
            first, begin, key = line, piece.end(), ""


def _keys(statement: str) -> list[str]:
    """Return the parts of the dotted key in a header, or in ``key = 0``."""
    bare = statement.removesuffix(" = 0")
    if _BARE.fullmatch(bare):
        return [bare]
    keys = []
    data = tomllib.loads(statement)
    while isinstance(data, dict) and data:
        key, data = next(iter(data.items()))
        keys.append(key)
        data = data[0] if isinstance(data, list) else data
    return keys


def _opened(keys: Sequence[str], counts: dict[Path, int], array: bool) -> Path:
    """Return the path of the table that a header opens."""
    path: Path = ()
    for key in keys[:-1]:
        path = _last((*path, key), counts)
    path = (*path, keys[-1])
    if array:
        counts[path] = counts.get(path, 0) + 1
    return _last(path, counts)


def _last(path: Path, counts: Mapping[Path, int]) -> Path:
    """Return the path of the last table of an array, or the path itself if it is no array."""
    return (*path, counts[path] - 1) if path in counts else path
