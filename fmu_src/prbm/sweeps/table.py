"""Tables of parameters: read from files, compared with the variables of an FMU."""

import math
from collections import Counter
from collections.abc import Container, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from fmpy.simulation import (  # type: ignore[import-untyped]
    settable_in_initialization_mode,
    settable_in_instantiated,
)
from numpy.typing import NDArray

from ..base import reading
from ..base.errors import ParameterError
from ..base.names import proposal
from .outputs import Output

Table = pd.DataFrame | str | Path
SEPARATORS = {";": "semicolons", "\t": "tabs"}  # separators of CSV dialects that are rejected
WORDS = {"true": 1.0, "false": 0.0}
FILE_SIZE_MAX = 1 << 30  # bytes of a table in CSV; a million rows of 50 columns have 900 MB.
NAMES_LISTED_MAX = 10  # Messages with more settable variables refer to "fmpy info" instead.
RANGES = {"Int8": 7, "Int16": 15, "Int32": 31, "Integer": 31, "Enumeration": 31, "Int64": 53,
          "UInt8": 8, "UInt16": 16, "UInt32": 32, "UInt64": 53}  # fmt: skip
"""Bits of FMI's integer types; a float represents 53 bits exactly."""


def read_table(table: Table) -> pd.DataFrame:
    """Return a table of parameters, from a CSV or Parquet file if it is a path.

    Raises
    ------
    ParameterError
        If the file cannot be read, or the table has no row or no column.
    """
    where = "the table"
    if not isinstance(table, pd.DataFrame):
        where, table = str(table), _read_file(Path(table))
    if table.shape[0] == 0 or table.shape[1] == 0:
        rows, columns = table.shape
        raise ParameterError(
            f"{where} has {rows} rows and {columns} columns; give a column for each parameter, "
            "headed by its name, and a row for each run"
        )
    names = [str(name).strip() for name in table.columns]
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    if twice:
        raise ParameterError(f"{where} has the column {twice[0]!r} twice; keep one")
    return table.set_axis(names, axis="columns").reset_index(drop=True)


def _read_file(path: Path) -> pd.DataFrame:
    if not path.exists():
        raise ParameterError(
            f"{reading.shown(path)} does not exist; give a CSV or Parquet file of parameters"
        )
    try:
        if path.suffix.lower() in (".parquet", ".pq"):
            if not (path.is_file() or path.is_dir()):
                raise ValueError("a pipe or a device")
            return pd.read_parquet(path)
        text = reading.text(path, FILE_SIZE_MAX, ParameterError)
        table = pd.read_csv(text, dtype=str, keep_default_na=False, skipinitialspace=True)
        labelled = not isinstance(table.index, pd.RangeIndex)  # Pandas takes surplus cells so.
        if labelled and not {*SEPARATORS} & {*"".join(map(str, table.columns))}:
            raise ValueError("its rows have more cells than its head has names; write numbers with "
                             "a decimal point, and commas between them")  # fmt: skip
        return table
    except pd.errors.EmptyDataError:
        return pd.DataFrame()
    except ParameterError:
        raise
    except (OSError, ValueError) as error:  # Errors of pandas and pyarrow are subclasses.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ParameterError(f"{path} cannot be read as a table: {reason}") from None


def checked(
    table: pd.DataFrame, variables: Mapping[str, Any], numbers: Container[str] = ()
) -> pd.DataFrame:
    """Check a table against the variables of an FMU; return it as float64.

    Parameters
    ----------
    table : DataFrame
        From :func:`read_table`.
    variables : mapping
        The variables of the FMU as FMPy describes them, by name.
    numbers : container of str
        Names of columns that are numbers in inputs over time, not variables.

    Raises
    ------
    ParameterError
        If a name is unknown or cannot be set, or a cell is not a finite number of the right type.
    """
    columns = {}
    for name in table.columns:
        if name in numbers and name not in variables:
            columns[name] = _numbers(name, table[name], "Real")
            continue
        _check_separator(name, variables)
        check_settable(name, variables)
        columns[name] = _numbers(name, table[name], variables[name].type)
    return pd.DataFrame(columns)


def _check_separator(name: str, variables: Mapping[str, Any]) -> None:
    for sign, word in SEPARATORS.items():
        if sign in str(name) and name not in variables:
            raise ParameterError(
                f"the table has the column {name!r}: its columns seem to be separated by {word}; "
                "separate them by commas, and write numbers with a decimal point"
            )


def check_settable(name: str, variables: Mapping[str, Any]) -> None:
    """Reject a variable that a table cannot set.

    Raises
    ------
    ParameterError
        If the variable is unknown or cannot be set before a run.
    """
    if name in variables and _settable(variables[name]):
        return
    settable = {key: v for key, v in variables.items() if _settable(v)}
    hint = proposal(name, settable)
    if len(settable) > NAMES_LISTED_MAX and hint.startswith("known"):
        hint = "fmpy info lists the variables"
    if name not in variables:
        raise ParameterError(f"the FMU has no variable {name!r}; {hint}")
    variable = variables[name]
    kind = f"{variable.causality or 'local'} variable of type {variable.type}"
    shape = f" and shape {variable.shape}" if variable.shape else ""
    raise ParameterError(f"{name} ({kind}{shape}) cannot be set by a table; {hint}")


def _settable(variable: Any) -> bool:
    """Return whether FMPy can set a variable to a number before or during initialization."""
    if variable.type in ("String", "Binary", "Clock") or variable.shape:
        return False
    if variable.causality in ("structuralParameter", "calculatedParameter", "independent"):
        return False
    return bool(settable_in_instantiated(variable) or settable_in_initialization_mode(variable))


def _numbers(name: str, column: "pd.Series[Any]", kind: str) -> NDArray[np.float64]:
    x = np.array([_number(name, row, cell) for row, cell in enumerate(column)])
    if kind == "Boolean":
        _reject(name, x, (x != 0.0) & (x != 1.0), "0 or 1 (Boolean)")
    elif kind in RANGES:
        high = 2.0 ** RANGES[kind]
        low = 0.0 if kind[0] == "U" else -high
        _reject(name, x, (x != np.round(x)) | (x < low) | (x >= high), f"a whole number ({kind})")
    return x


def _number(name: str, row: int, cell: Any) -> float:
    """Return a cell as a finite number."""
    try:
        text = cell.strip().lower() if isinstance(cell, str) else None
        x = WORDS[text] if text in WORDS else float(cell)
    except (TypeError, ValueError):
        x = math.nan
    if not math.isfinite(x):
        raise ParameterError(
            f"row {row} of the table: {name} = {cell!s} must be a finite number; correct it "
            "or leave the row out"
        )
    return x


def _reject(name: str, x: NDArray[np.float64], wrong: NDArray[np.bool_], required: str) -> None:
    """Raise an error for the first wrong value."""
    if wrong.any():
        row = int(wrong.argmax())
        raise ParameterError(f"row {row} of the table: {name} = {x[row]:g} must be {required}")


def check_outputs(outputs: Iterable[Output], variables: Mapping[str, Any]) -> None:
    """Reject outputs that cannot be computed from the variables of an FMU.

    Raises
    ------
    ParameterError
        If a variable is unknown, an array, or not a number; or the output is that of a mechanism.
    """
    for output in outputs:
        if output.static:
            raise ParameterError(f"output {output.column}: needs a mechanism; use prbm study")
        output.check(variables, "the FMU")
        for variable in map(variables.__getitem__, output.variables(variables)):
            if variable.type in ("String", "Binary", "Clock") or variable.shape:
                raise ParameterError(
                    f"output {output.column}: {variable.name} is of type {variable.type}"
                    + (f" and shape {variable.shape}" if variable.shape else "")
                    + ", not one number; leave it out"
                )
