"""Sizes of files, classes and functions, in Python and C.

``python tests/support/sizes.py`` prints the ten largest of each, and the functions of the kernel
that exist only for moving walls.

The body of a Python function begins after its signature and docstring.  The body of a C function
consists of the lines between its braces.  The code of a C function consists of its lines from the
signature to the last brace, without blank lines and comments.
"""

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
FOLDERS = ("fmu_src",)
GENERATED = ("generated.h",)
SHOWN = 10

FILE_MAX = 700  # Lines.
CLASS_MAX = 30  # Methods.
BODY_MAX = 60  # Lines.
PAGE_BODY_MAX = 100  # Lines of a function that writes a page.
PAGES = "fmu_src/prbm/validation/"
WALLS_MAX = 120  # Lines of code of all C functions that exist only for moving walls.

WALLS_FILE = "fmu_src/prbm/kernel/hybrid/walls.c"
WALL_FUNCTIONS = ("wall_motion", "wall_inputs", "walls_changed", "follow_walls")
"""Functions of other C files that exist only for moving walls."""

C_NOISE = re.compile(
    r"""
      /\*.*?\*/ | //[^\n]*                           # comments
    | "(?:\\.|[^"\\\n])*" | '(?:\\.|[^'\\\n])*'      # strings and characters
    | ^[ \t]*\#(?:\\\n|[^\n])*                       # directives of the preprocessor
    """,
    re.DOTALL | re.MULTILINE | re.VERBOSE,
)
C_FUNCTION = re.compile(r"([A-Za-z_]\w*)\s*\([^{}]*\)\s*\Z")


class Size(NamedTuple):
    """The size of a file, class or function, its name and its position in the source."""

    size: int
    name: str
    place: str

    def __str__(self) -> str:
        return f"{self.size:5}  {self.name:40} {self.place}"


class Sizes(NamedTuple):
    """Sizes of files and functions in lines, of classes in methods."""

    files: list[Size]
    classes: list[Size]
    functions: list[Size]


@cache
def _parsed(text: str) -> ast.Module:
    return ast.parse(text)


@cache
def measured(root: Path = ROOT, folders: Iterable[str] = FOLDERS) -> Sizes:
    """Return the sizes of files, classes and functions in the Python and C files of folders."""
    sizes = Sizes([], [], [])
    paths = (path for folder in folders for path in sorted((root / folder).rglob("*")))
    for path in paths:
        if path.suffix not in (".py", ".c", ".h") or path.name in GENERATED:
            continue
        text, place = path.read_text(encoding="utf-8"), path.relative_to(root).as_posix()
        sizes.files.append(Size(len(text.splitlines()), path.name, place))
        if path.suffix == ".py":
            sizes.classes.extend(python_classes(text, place))
            sizes.functions.extend(python_functions(text, place))
        else:
            sizes.functions.extend(c_functions(text, place))
    return sizes


def python_classes(text: str, place: str) -> Iterator[Size]:
    """Yield the classes of a Python file and the number of methods of each."""
    for node in ast.walk(_parsed(text)):
        if isinstance(node, ast.ClassDef):
            count = sum(isinstance(x, ast.FunctionDef | ast.AsyncFunctionDef) for x in node.body)
            yield Size(count, node.name, f"{place}:{node.lineno}")


def python_functions(text: str, place: str) -> Iterator[Size]:
    """Yield the functions and methods of a Python file with the lengths of their bodies."""
    for node in ast.walk(_parsed(text)):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        body = node.body
        if ast.get_docstring(node, clean=False) is not None:
            body = body[1:]
        length = body[-1].end_lineno - body[0].lineno + 1 if body else 0
        yield Size(length, node.name, f"{place}:{node.lineno}")


def c_functions(text: str, place: str) -> Iterator[Size]:
    """Yield the functions of a C file with the lengths of their bodies."""
    for name, plain, begin, end in _c_functions(text):
        length = max(plain.count("\n", begin, end) - 1, 0)
        yield Size(length, name, f"{place}:{plain.count(chr(10), 0, begin) + 1}")


def wall_functions(root: Path = ROOT) -> Iterator[Size]:
    """Yield the C functions that exist only for moving walls with the lengths of their code."""
    for path in sorted((root / "fmu_src/prbm/kernel").rglob("*.c")):
        place = path.relative_to(root).as_posix()
        for name, text, begin, end in _c_functions(path.read_text(encoding="utf-8")):
            if name in WALL_FUNCTIONS or place == WALLS_FILE:
                head = max(text.rfind(mark, 0, text.rfind(name, 0, begin)) for mark in "};")
                lines = text[head + 1 : end + 1].splitlines()
                yield Size(sum(bool(line.strip()) for line in lines), name, place)


def _c_functions(text: str) -> Iterator[tuple[str, str, int, int]]:
    """Yield the functions of a C file.

    Each item consists of the name, the text with blanks for comments and strings, and the places
    of the braces of the function.
    """
    text = C_NOISE.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
    depth, begin, name, since = 0, 0, "", 0
    for found in re.finditer(r"[{};]", text):
        brace, at = found[0], found.start()
        if brace == "{":
            if depth == 0:
                head = C_FUNCTION.search(text[since:at])
                name, begin = head[1] if head else "", at
            depth += 1
        elif brace == "}":
            depth -= 1
            if depth == 0 and name:
                yield name, text, begin, at
        if depth == 0:
            since = at + 1


def violations(sizes: Sizes) -> list[str]:
    """Return a message for each file, class or function above its limit."""
    sentences = [f"{x}: {FILE_MAX} lines at most" for x in sizes.files if x.size > FILE_MAX]
    sentences += [f"{x}: {CLASS_MAX} methods at most" for x in sizes.classes if x.size > CLASS_MAX]
    for x in sizes.functions:
        limit = PAGE_BODY_MAX if x.place.startswith(PAGES) else BODY_MAX
        if x.size > limit:
            sentences.append(f"{x}: {limit} lines at most")
    return sentences


def report(sizes: Sizes, count: int = SHOWN) -> str:
    """Return tables of the largest files, classes and functions."""
    units = {"files": "lines", "classes": "methods", "functions": "lines"}
    lines = []
    for kind, unit in units.items():
        lines.append(f"{kind} [{unit}]")
        lines += map(str, sorted(getattr(sizes, kind), reverse=True)[:count])
    walls = list(wall_functions())
    lines += [f"moving walls in C [lines]: {sum(x.size for x in walls)}", *map(str, walls)]
    return "\n".join(lines)


if __name__ == "__main__":
    print(report(measured()))
