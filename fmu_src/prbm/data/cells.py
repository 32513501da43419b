"""Cells of a table of measured data, and the table as text."""

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass

from ..files.record_units import is_unit
from ..files.units import UNIT_LENGTH_MAX

MISSING = frozenset(
    ("", "nan", "inf", "+inf", "-inf", "-", "--", "na", "n/a", "#n/a", "null", "none", "ol",
     "over", "overflow", "∞", "-∞", "1.#qnan", "#div/0!", "#wert!", "#value!")
)  # fmt: skip
NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eEdD][+-]?\d+)?")
OPENING = {"]": "[", ")": "("}


@dataclass(frozen=True)
class Table:
    """A table as text, before its cells are converted to numbers and units are applied.

    Parameters
    ----------
    heads : list of (str, str)
        Name and unit of each column; empty if the names are given by the caller.
    lines : list of int
        Line of each row in the file, from 1.
    rows : list of list of str
        Cells of each row.
    decimal : str
        Decimal sign.
    comments : tuple of str
        Lines above the table, without marks of comments.
    """

    heads: list[tuple[str, str]]
    lines: list[int]
    rows: list[list[str]]
    decimal: str
    comments: tuple[str, ...]


def cells_of(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, without empty cells at its end."""
    if delimiter == " ":
        cells = line.split()
    else:
        cells = _quoted(line, delimiter) if '"' in line else line.split(delimiter)
    cells = [cell.strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _quoted(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line with quoted cells."""
    try:
        return next(csv.reader([line.strip("\r\n")], delimiter=delimiter, skipinitialspace=True))
    except csv.Error:  # a cell longer than the limit of the csv module
        return line.split(delimiter)


def is_number(cell: str, decimal: str) -> bool:
    """Return whether a cell is a number with the decimal sign, or without one.

    Examples
    --------
    >>> is_number("1,5e3", ","), is_number("1.5", ","), is_number("15", ",")
    (True, False, True)
    """
    if decimal == ",":
        if "." in cell:
            return False
        cell = cell.replace(",", ".")
    return NUMBER.fullmatch(cell) is not None


def is_data(cells: list[str], decimal: str) -> bool:
    """Return whether cells are a row of the table: numbers, or marks of missing numbers."""
    numbers = sum(is_number(cell, decimal) for cell in cells)
    return numbers > 0 and all(
        is_number(cell, decimal) or cell.lower() in MISSING for cell in cells
    )


def name_and_unit(head: str) -> tuple[str, str]:
    """Return the name and the unit in the head of a column.

    Examples
    --------
    >>> [name_and_unit(head) for head in ("t [s]", "time (ms)", "Force/N", "v / (m/s)")]
    [('t', 's'), ('time', 'ms'), ('Force', 'N'), ('v', 'm/s')]
    >>> [name_and_unit(head) for head in ("Load, N", "x in mm", "v in m/s", "v/m/s")]
    [('Load', 'N'), ('x', 'mm'), ('v', 'm/s'), ('v', 'm/s')]
    >>> name_and_unit("force (filtered) / mN"), name_and_unit("ratio/total"), name_and_unit("Ch1")
    (('force (filtered)', 'mN'), ('ratio/total', ''), ('Ch1', ''))
    """
    text = head.strip()
    closing = text[-1:]
    if closing in OPENING:
        name, bracket, unit = text[:-1].rpartition(OPENING[closing])
        name = name.rstrip().removesuffix("/").rstrip()
        if bracket and name and closing not in unit:
            return name, unit.strip() or "-"
    splits = ((name, unit) for name, unit in _splits(text) if name and is_unit(unit))
    return next(splits, (head, ""))


def _splits(head: str) -> Iterator[tuple[str, str]]:
    """Yield the possible names and units in a head without brackets, the longest unit first."""
    *before, last = head.rsplit(maxsplit=1) or [""]
    if len(last) > UNIT_LENGTH_MAX:
        return
    name = before[0] if before else ""
    if name.endswith((",", "/")):
        yield name[:-1].rstrip(), last
    elif name.endswith("in") and name[-3:-2].isspace():
        yield name[:-2].rstrip(), last
    for slash in (i for i, c in enumerate(last) if c == "/"):
        yield f"{name} {last[:slash]}".strip(), last[slash + 1 :]
