"""Tables of rows, from which a study takes its parameters: CSV, Parquet or a DataFrame."""

import csv
import math
import re
from collections.abc import Container, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base import reading
from ..base.errors import ParameterError
from ..mechanics.arrays import Real

SEPARATORS = {";": "semicolons", "\t": "tabs"}  # Separators of CSV dialects that are rejected.
PARQUET = (".parquet", ".pq")  # Suffixes.
WORDS = {"true": 1.0, "false": 0.0}
FILE_SIZE_MAX = 1 << 30  # bytes of a table in CSV; a million rows of 50 columns have 900 MB.
HEAD = re.compile(r"([^\[\]]*)\[([^\[\]]*)\]")  # A name and a unit in brackets.
BITS = {"Boolean": 1, "Int8": 7, "Int16": 15, "Int32": 31, "Integer": 31, "Enumeration": 31,
        "Int64": 53, "UInt8": 8, "UInt16": 16, "UInt32": 32, "UInt64": 53}  # fmt: skip
"""Bits of FMI's integer types; a float represents 53 bits exactly."""
Cells = Sequence[Any]


def read_table(table: Any, known: Container[str] = ()) -> dict[str, tuple[Cells, str]]:
    """Return for each column of a table or file its cells, and the unit in its head.

    ``known`` are names of variables, which may have brackets.  Other heads may have a unit, which
    is empty otherwise: ``stop.position [mm]``.

    Raises
    ------
    ParameterError
        If the file cannot be read, or the table has no row, no column, two of one name, or one
        that looks like several.
    """
    path = Path(table) if isinstance(table, str | Path) else None
    if path is not None and path.suffix.lower() not in PARQUET:
        columns = _read_csv(path)
    else:
        frame = table if path is None else _read_parquet(path)
        if not hasattr(frame, "items"):
            raise ParameterError(
                f"{frame!r} is no table: give a path, a DataFrame, or a mapping from names to "
                "values"
            )
        columns = [(str(head), column.tolist()) for head, column in frame.items()]
    where, rows = path or "the table", len(columns[0][1]) if columns else 0
    found: dict[str, tuple[Cells, str]] = {}
    for head, cells in columns:
        name, unit = head.strip(), ""
        if name not in known and (parts := HEAD.fullmatch(name)):
            name, unit = parts[1].strip(), parts[2].strip().strip("-")
        for sign, word in SEPARATORS.items():
            if sign in name and name not in known:
                raise ParameterError(
                    f"the table has the column {name!r}: its columns seem to be separated by "
                    f"{word}; separate them by commas, and write numbers with a decimal point"
                )
        if name in found:
            raise ParameterError(f"{where} has the column {name!r} twice; keep one")
        found[name] = cells, unit
    if not rows or "" in found:
        raise ParameterError(
            f"{where} has {rows} rows and {len(columns)} columns; write a column for each "
            "parameter, headed by its name, and a row for each run"
        )
    return found


def _read_csv(path: Path) -> list[tuple[str, Cells]]:
    if not path.exists():
        raise ParameterError(
            f"{reading.shown(path)} does not exist; give a CSV or Parquet file of parameters"
        )
    try:
        text = reading.text(path, FILE_SIZE_MAX, ParameterError)
        heads, *rows = [row for row in csv.reader(text, skipinitialspace=True) if row] or [[]]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ParameterError(f"{path} cannot be read as a table: {error}") from None
    for k, row in enumerate(rows):
        if len(row) > len(heads) and not {*SEPARATORS} & {*"".join(heads)}:
            raise ParameterError(
                f"{path} cannot be read as a table: row {k} has {len(row)} cells, more than its "
                "head has names; write numbers with a decimal point, and commas between them"
            )
    return [(head, [row[k] if k < len(row) else "" for row in rows])
            for k, head in enumerate(heads)]  # fmt: skip


def _read_parquet(path: Path) -> Any:
    import pandas as pd  # imported here: an extra

    try:
        if not (path.is_file() or path.is_dir()):
            raise ValueError("it does not exist, or is a pipe or a device")
        return pd.read_parquet(path)
    except (OSError, ValueError) as error:  # Errors of pandas and pyarrow are subclasses.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ParameterError(f"{path} cannot be read as a table: {reason}") from None


def numbers(name: str, cells: Cells, factor: float = 1.0) -> Real:
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
    return factor * x


def number(cell: Any) -> float:
    """Return a cell as a number; NaN if it is none."""
    try:
        text = cell.strip().lower() if isinstance(cell, str) else None
        return WORDS[text] if text in WORDS else float(cell)
    except (TypeError, ValueError):
        return math.nan


def check_type(name: str, x: Real, kind: str) -> None:
    """Reject values (n,) that are not of a type of FMI.

    Raises
    ------
    ParameterError
        If one of them is not.
    """
    if kind not in BITS:
        return
    high = 2.0 ** BITS[kind]
    low = 0.0 if kind[0] in "UB" else -high
    wrong = (x != np.round(x)) | (x < low) | (x >= high)
    if wrong.any():
        row = int(wrong.argmax())
        required = "0 or 1 (Boolean)" if kind == "Boolean" else f"a whole number ({kind})"
        raise ParameterError(f"row {row} of the table: {name} = {x[row]:g} must be {required}")
