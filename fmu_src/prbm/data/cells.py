"""Cells of a table of measured data, and the table as text."""

import csv
import re
from dataclasses import dataclass

from ..files.record_units import is_unit

MISSING = frozenset(
    ("", "nan", "inf", "+inf", "-inf", "-", "--", "na", "n/a", "#n/a", "null", "none", "ol",
     "over", "overflow", "∞", "-∞", "1.#qnan", "#div/0!", "#wert!", "#value!")
)  # fmt: skip
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
BRACKETS = re.compile(r"(.*?)\s*/?\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))\s*")
SUFFIX = re.compile(r"(.*\S)\s*(?:/\s*|,\s+|\s+in\s+)(\S+)")


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
    elif '"' in line:
        cells = next(csv.reader([line.strip("\r\n")], delimiter=delimiter, skipinitialspace=True))
    else:
        cells = line.split(delimiter)
    cells = [cell.strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


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
    >>> [name_and_unit(head) for head in ("Load, N", "x in mm")]
    [('Load', 'N'), ('x', 'mm')]
    >>> name_and_unit("force (filtered) / mN"), name_and_unit("ratio/total"), name_and_unit("Ch1")
    (('force (filtered)', 'mN'), ('ratio/total', ''), ('Ch1', ''))
    """
    found = BRACKETS.fullmatch(head)
    if found and found[1]:
        unit = found[2] if found[2] is not None else found[3]
        return found[1].strip(), unit.strip() or "-"
    found = SUFFIX.fullmatch(head)
    if found and is_unit(found[2]):
        return found[1].strip(), found[2]
    return head, ""
