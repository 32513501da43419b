"""Tables of rows, from which a study takes its parameters: CSV, Parquet or a DataFrame."""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base import reading
from ..base.errors import ParameterError
from ..mechanics.arrays import Real

SEPARATORS = {";": "semicolons", "\t": "tabs"}  # Separators of CSV dialects that are rejected.
WORDS = {"true": 1.0, "false": 0.0}
FILE_SIZE_MAX = 1 << 30  # bytes of a table in CSV; a million rows of 50 columns have 900 MB.
HEAD = re.compile(r"([^\[\]]*)\[([^\[\]]*)\]")  # A name and a unit in brackets.
Cells = Sequence[Any]


def read_table(table: Any) -> dict[str, Cells]:
    """Return the cells of a table by the heads of its columns.

    Parameters
    ----------
    table : DataFrame, str or Path
        The table, or the path of a CSV or Parquet file.

    Raises
    ------
    ParameterError
        If the file cannot be read, or the table has no row, no column or two of one name.
    """
    where = "the table"
    if isinstance(table, str | Path):
        where, table = str(table), Path(table)
        if table.suffix.lower() not in (".parquet", ".pq"):
            heads, *rows = _read_csv(table) or [[]]
            columns = [[row[k] if k < len(row) else "" for row in rows] for k in range(len(heads))]
            return _checked(where, heads, columns, len(rows))
        table = _read_parquet(table)
    return _checked(where, [*table.columns], [x.tolist() for _, x in table.items()], len(table))


def _checked(where: str, heads: Cells, columns: Sequence[Cells], rows: int) -> dict[str, Cells]:
    names = [str(head).strip() for head in heads]
    if not (rows and names and all(names)):
        raise ParameterError(
            f"{where} has {rows} rows and {sum(map(bool, names))} columns; write a column for each "
            "parameter, headed by its name, and a row for each run"
        )
    found = dict(zip(names, columns, strict=True))
    if len(found) < len(names):
        twice = next(name for name in sorted(names) if names.count(name) > 1)
        raise ParameterError(f"{where} has the column {twice!r} twice; keep one")
    return found


def _read_csv(path: Path) -> list[list[str]]:
    if not path.exists():
        raise ParameterError(
            f"{reading.shown(path)} does not exist; give a CSV or Parquet file of parameters"
        )
    try:
        text = reading.text(path, FILE_SIZE_MAX, ParameterError)
        rows = [row for row in csv.reader(text, skipinitialspace=True) if row]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ParameterError(f"{path} cannot be read as a table: {error}") from None
    for k, row in enumerate(rows[1:]):
        if len(row) > len(rows[0]) and not {*SEPARATORS} & {*"".join(rows[0])}:
            raise ParameterError(
                f"{path} cannot be read as a table: row {k} has {len(row)} cells, more than its "
                "head has names; write numbers with a decimal point, and commas between them"
            )
    return rows


def _read_parquet(path: Path) -> Any:
    import pandas as pd  # imported here: an extra

    try:
        if not (path.is_file() or path.is_dir()):
            raise ValueError("it does not exist, or is a pipe or a device")
        return pd.read_parquet(path)
    except (OSError, ValueError) as error:  # Errors of pandas and pyarrow are subclasses.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ParameterError(f"{path} cannot be read as a table: {reason}") from None


def name_and_unit(head: str, known: Mapping[str, str]) -> tuple[str, str]:
    """Return the name and the unit in the head of a column, ``stop.position [mm]``.

    The unit is empty if there is none; a known name may have brackets.

    Examples
    --------
    >>> name_and_unit("x [mm]", {}), name_and_unit("x[1]", {"x[1]": "m"}), name_and_unit("x", {})
    (('x', 'mm'), ('x[1]', ''), ('x', ''))
    """
    found = None if head in known else HEAD.fullmatch(head)
    return (found[1].strip(), found[2].strip().strip("-")) if found else (head, "")


def check_separator(name: str) -> None:
    """Reject an unknown name that looks like several columns.

    Raises
    ------
    ParameterError
        If it has semicolons or tabs.
    """
    for sign, word in SEPARATORS.items():
        if sign in name:
            raise ParameterError(
                f"the table has the column {name!r}: its columns seem to be separated by {word}; "
                "separate them by commas, and write numbers with a decimal point"
            )


def numbers(name: str, cells: Cells) -> Real:
    """Return the cells of a column as numbers, (n,); the words true and false are 1 and 0.

    Raises
    ------
    ParameterError
        If a cell is not a finite number.
    """
    x = np.array([number(cell) for cell in cells])
    if not np.isfinite(x).all():
        row = int(np.isfinite(x).argmin())
        raise ParameterError(
            f"row {row} of the table: {name} = {cells[row]!s} must be a finite number; correct it "
            "or leave the row out"
        )
    return x


def number(cell: Any) -> float:
    """Return a cell as a number; NaN if it is none."""
    try:
        text = cell.strip().lower() if isinstance(cell, str) else None
        return WORDS[text] if text in WORDS else float(cell)
    except (TypeError, ValueError):
        return math.nan
