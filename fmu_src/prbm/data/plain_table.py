"""Tables of measured data in plain text: detection of separator, decimal sign and head."""

import re
from collections.abc import Sequence

from ..files.record_units import is_unit
from .cells import Table, cells_of, is_data, name_and_unit
from .series import RecordError

SAMPLE_LINES = 400  # Number of lines from which the separator is detected.
COMMENT = re.compile(r"\s*(#|%|!|//)\s*")
CHARACTERS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}
FORMATS = [("\t", "."), ("\t", ","), (";", "."), (";", ","), (",", "."), (",", ","), (" ", "."),
           (" ", ",")]  # fmt: skip


def recognized(
    source: str, lines: list[str], delimiter: str | None, decimal: str | None
) -> tuple[str, str]:
    """Return the delimiter and decimal sign for which most lines have two numbers or more."""
    kept = [line for line in lines if line.strip() and not COMMENT.match(line)]
    sample = kept[:: max(1, len(kept) // SAMPLE_LINES)][-SAMPLE_LINES:]
    best, found = 0, None
    for option in FORMATS:
        if delimiter not in (None, option[0]) or decimal not in (None, option[1]):
            continue
        rows = [cells_of(line, option[0]) for line in sample]
        score = sum(len(row) > 1 and is_data(row, option[1]) for row in rows)
        if score > best:
            best, found = score, option
    if found is None:
        known = ", ".join(CHARACTERS.values())
        raise RecordError(
            f"{source}: not a table: no line has two numbers or more separated by {known}; export "
            "a time and a signal as columns"
        )
    return found


def plain_table(
    source: str,
    lines: list[str],
    columns: Sequence[str] | None,
    delimiter: str | None,
    decimal: str | None,
) -> Table:
    """Return the table in a file of plain text."""
    between, sign = recognized(source, lines, delimiter, decimal)
    first = _first_row(lines, between, sign)
    numbers, rows = [], []
    for number, line in enumerate(lines[first:], start=first + 1):
        if line.strip() and not COMMENT.match(line):
            numbers.append(number)
            rows.append(cells_of(line, between))
    above = [line for line in lines[:first] if line.strip()]
    comments = tuple(COMMENT.sub("", line, count=1).strip() for line in above)
    width = max(len(row) for row in rows[:2])
    heads = [] if columns is not None else _heads(source, above, between, width)
    return Table(heads, numbers, rows, sign, comments)


def _first_row(lines: list[str], delimiter: str, decimal: str) -> int:
    """Return the index of the first line of numbers that precedes another one or ends the file."""
    kept = [i for i, line in enumerate(lines) if line.strip() and not COMMENT.match(line)]
    data = []
    for i in kept:
        cells = cells_of(lines[i], delimiter)
        data.append(len(cells) > 1 and is_data(cells, decimal))
    for k, numbers in enumerate(data):
        if numbers and (k + 1 == len(kept) or data[k + 1]):
            return kept[k]
    return kept[data.index(True)]


def _heads(source: str, above: list[str], delimiter: str, width: int) -> list[tuple[str, str]]:
    """Return names and units of the columns from the lines above the table."""
    plain = [line for line in above if not COMMENT.match(line)]
    if not plain:
        plain = [COMMENT.sub("", line, count=1) for line in above]
    if delimiter == " ":  # "x [mm]" is one cell
        plain = [re.sub(r"(?<=[^\])\s])\s+(?=[\[(])", "", line) for line in plain]
    rows = [_padded(cells_of(line, delimiter), width) for line in plain]
    if not rows or len(rows[-1]) != width:
        seen = f"{len(cells_of(plain[-1], delimiter))} names" if rows else "no names"
        raise RecordError(
            f"{source}: there are {seen} above {width} columns of numbers separated by "
            f"{CHARACTERS[delimiter]}: write a head, or give its names, for instance "
            f'columns=["t [s]", "x [mm]"]'
        )
    last = [_bare(cell) for cell in rows[-1]]
    has_units = (
        len(rows) > 1
        and len(rows[-2]) == width
        and all(is_unit(cell) for cell in last)
        and any(cell not in ("", "-", "1") for cell in last)
    )
    if has_units:
        return list(zip(rows[-2], last, strict=True))
    return _axes_units([name_and_unit(cell) for cell in rows[-1]], plain[:-1], delimiter)


def _padded(cells: list[str], width: int) -> list[str]:
    """Return cells, with an empty one added if the last one is missing."""
    return [*cells, ""] if len(cells) == width - 1 else cells


def _bare(cell: str) -> str:
    """Return a unit without its brackets."""
    return cell[1:-1].strip() if re.fullmatch(r"\[.*\]|\(.*\)", cell) else cell


def _axes_units(
    heads: list[tuple[str, str]], above: list[str], delimiter: str
) -> list[tuple[str, str]]:
    """Add units from the lines ``Horizontal Units`` and ``Vertical Units`` to heads without one."""
    rows = (cells_of(line, delimiter) for line in above)
    tags = {cells[0].lower(): cells[1:] for cells in rows if cells}
    across, up = tags.get("horizontal units", []), tags.get("vertical units", [])
    if not across or not up:
        return heads
    given = [across[0], *up]
    given += [given[-1]] * (len(heads) - len(given)) if len(up) == 1 else []
    return [
        (name, unit or (given[i] if i < len(given) else "")) for i, (name, unit) in enumerate(heads)
    ]
