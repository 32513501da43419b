"""Results of simulations, computed or read from files: columns by name, and impacts."""

import csv
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base import reading
from ..base.errors import PrbmError
from ..base.names import proposal
from ..base.version import __version__
from ..hybrid.records import Impact
from ..interface.variables import variables
from ..mechanics.arrays import Real
from ..mechanism.description import Mechanism
from .impact_table import impact_table
from .quantities import FREQUENCY, QUANTITIES

if TYPE_CHECKING:
    import pandas as pd
    import xarray

Columns = NDArray[Any]
ZERO_MOTION_RTOL = 1e-9  # Smaller motions, relative to the size of the mechanism, are round-off.
FILE_SIZE_MAX = 1 << 30  # bytes; 100,000 rows of 500 columns have 900 MB.
BOOLEANS = {"true": 1.0, "false": 0.0}  # Texts that some tools write for Booleans.


class ResultError(PrbmError, ValueError):
    """A result lacks a column, cannot be read, or belongs to another mechanism."""


class UnknownColumnError(ResultError, KeyError):
    """A result has no column of this name; the message proposes similar names."""

    __str__ = Exception.__str__  # The one of KeyError would show the message in quotes.


@dataclass(frozen=True, repr=False, eq=False)
class Result(Mapping[str, Columns]):
    """The result of a simulation: a mapping from names to columns.

    ``result["shuttle.x"]`` is the column ``shuttle.x``; ``time`` is a column, too.  Two results are
    equal if they are the same object.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism that was simulated.
    start_values : mapping
        All parameters at the start, and the inputs that were given at the start.
    columns : (m,) structured array
        ``time`` and the variables by name, in SI units, one row per communication point.
    impacts : tuple of Impact
        All impacts in order, with the states before and after each; empty for results of FMPy.
    engine : str
        The engine, ``"kernel"`` or ``"python"``; empty for results of FMPy.
    """

    mechanism: Mechanism
    start_values: Mapping[str, float]
    columns: Columns
    impacts: tuple[Impact, ...] = field(default=())
    engine: str = ""

    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __getitem__(self, name: str) -> Columns:
        """Return a column by name.

        Raises
        ------
        UnknownColumnError
            If the result has no column of that name.
        """
        if name in self.start_values and name not in self:
            raise UnknownColumnError(
                f"{name} has no column, because it was not changed; its value is "
                f"result.start_values[{name!r}]"
            )
        return column(self.columns, name)

    def __contains__(self, name: object) -> bool:
        return name in names(self.columns)

    def __iter__(self) -> Iterator[str]:
        return iter(names(self.columns))

    def __len__(self) -> int:
        return len(names(self.columns))

    def __repr__(self) -> str:
        rows, end = len(self.columns), float(self.columns["time"][-1])
        return (
            f"<Result of {self.mechanism.name}: {end:g} s in {rows} rows, "
            f"{len(names(self.columns))} columns, impacts: {len(self.impacts)}>"
        )

    def quantity(self, name: str) -> float:
        """Return a named quantity: ``settling``, ``impacts``, ``peak_speed`` and the like.

        Raises
        ------
        ResultError
            If the name is unknown, or a needed column is missing.
        """
        if name not in QUANTITIES:
            raise ResultError(f"unknown quantity {name!r}; {proposal(name, QUANTITIES)}")
        lacking = QUANTITIES[name].lacking(names(self.columns))
        if lacking:
            remedy = QUANTITIES[name].remedy or "record it"
            raise ResultError(f"{name}: the result has no column {lacking}; {remedy}")
        return QUANTITIES[name].value(self.columns, self.impacts)

    def to_pandas(self) -> "pd.DataFrame":
        """Return the columns as a pandas DataFrame over the time.

        ``attrs["units"]`` has the SI units by column, empty for integers and Booleans.  The others
        say how the result was made: ``mechanism``, its name; ``version`` of the package;
        ``engine``; ``changes``, the parameters and inputs at the start that differ from their
        defaults.

        Raises
        ------
        ResultError
            If pandas is not installed.
        """
        pandas = _extra("pandas")
        frame: pd.DataFrame = pandas.DataFrame.from_records(self.columns, index="time")
        frame.attrs.update(self._made(), units=self.units())
        return frame

    def impacts_to_pandas(self) -> "pd.DataFrame":
        """Return the impacts as a pandas DataFrame, a row for each, over their numbers from 1.

        The columns are those of the table ``NAME-impacts.csv`` of ``prbm simulate --out``: stop,
        time, speeds, impulse, lost energy and modal restitution, and those of compliant stops, NaN
        for an impact at a rigid one.  ``attrs`` is that of :meth:`to_pandas`.

        Raises
        ------
        ResultError
            If pandas is not installed.
        """
        pandas = _extra("pandas")
        units, rows = impact_table(self.mechanism, self.impacts)
        kinds = {name: "int64" if name == "number" else "float64" for name in units}
        table = pandas.DataFrame(rows, columns=[*units]).astype(kinds | {"stop": object})
        frame: pd.DataFrame = table.set_index("number")
        frame.attrs.update(self._made(), units=units)
        return frame

    def to_xarray(self) -> "xarray.Dataset":
        """Return the columns as an xarray Dataset over the dimension ``time``.

        ``attrs["units"]`` of each column has its SI unit, empty for integers and Booleans.  Those
        of the data set are the others of :meth:`to_pandas`; ``changes`` is a text in JSON, because
        files of data sets have numbers and texts as attributes.

        Raises
        ------
        ResultError
            If xarray is not installed.
        """
        package = _extra("xarray")
        found = {name: ("time", self[name], {"units": unit}) for name, unit in self.units().items()}
        made = self._made()
        data: xarray.Dataset = package.Dataset(
            found, attrs=made | {"changes": json.dumps(made["changes"])}
        )
        return data

    def _made(self) -> dict[str, Any]:
        """Return how the result was made: mechanism, version, engine, changed values."""
        defaults = self.mechanism.values()
        return {
            "mechanism": self.mechanism.name,
            "version": __version__,
            "engine": self.engine,
            "changes": {n: x for n, x in self.start_values.items() if x != defaults.get(n, 0.0)},
        }

    def units(self) -> dict[str, str]:
        """Return the SI units by column, empty for integers and Booleans.

        Raises
        ------
        MechanismError
            If a column is no variable of the mechanism.
        """
        first = {name: float(x[0]) for name, x in self.items() if name != "time"}
        first = {FREQUENCY: 0.0} | first
        known = {v.name: v.unit for v in variables(self.mechanism, first)}
        return {name: "s" if name == "time" else known[name] for name in self}


def _extra(name: str) -> Any:
    """Import a package of the extra ``notebook``, which takes half a second.

    Raises
    ------
    ResultError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError:
        raise ResultError(
            f"{name} is not installed; install it with: python -m pip install "
            '"prbm-impact[notebook]"'
        ) from None


def column(columns: Columns, name: str) -> Columns:
    """Return a column of a result.

    Raises
    ------
    UnknownColumnError
        If the result has no column of that name.
    """
    known = names(columns)
    if name not in known:
        raise UnknownColumnError(
            f"the result has no column {name!r}; {proposal(str(name), dict.fromkeys(known))} "
            "FMPy records the columns in simulate_fmu(..., output=[...])"
        )
    found: Columns = columns[name]
    return found


def names(columns: Columns) -> tuple[str, ...]:
    """Return the names of the columns of a result."""
    return columns.dtype.names or ()


def structured(rows: Iterable[Mapping[str, float | int | bool | str | bytes]]) -> Columns:
    """Return rows of values by name as a structured array with FMPy's types.

    Integers have 64 bits if a value of their column needs them; texts and bytes are objects.

    Examples
    --------
    >>> structured([{"time": 0.0, "stop.contact": True}])["stop.contact"]
    array([ True])
    """
    table = list(rows)
    columns = {name: [row[name] for row in table] for name in table[0]}
    return np.array([tuple(row.values()) for row in table], _table_type(columns))


def _table_type(columns: Mapping[str, list[Any]]) -> np.dtype[Any]:
    return np.dtype([(name, _column_type(values)) for name, values in columns.items()])


def _column_type(values: list[Any]) -> Any:
    """Return the type of a column, which is that of its first value."""
    kind = type(values[0])
    if kind in (str, bytes):
        return object
    if kind is not int:
        return np.bool_ if kind is bool else np.float64
    fitting = (
        x for x in (np.int32, np.int64)
        if np.iinfo(x).min <= min(values) and max(values) <= np.iinfo(x).max
    )  # fmt: skip
    return next(fitting, np.uint64)


def row_type(row: Mapping[str, float | int | bool]) -> np.dtype[Any]:
    """Return the type of a row of values by name, with FMPy's types."""
    return _table_type({name: [x] for name, x in row.items()})


def read_csv(path: str | Path) -> Columns:
    """Read a result from a CSV file as FMPy writes it: names, then one row per time.

    Raises
    ------
    ResultError
        If the file cannot be read or has another layout; the message names the line.
    """
    path = Path(path)
    try:
        text = reading.text(path, FILE_SIZE_MAX, ResultError)
        lines = [line for line in csv.reader(text) if line]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ResultError(f"{path}: not a CSV file ({error})") from None
    if len(lines) < 3 or lines[0][0].strip() != "time":
        raise ResultError(
            f"{path}: not a result; the first line must name the columns, the first of them time, "
            "and at least two rows must follow"
        )
    header = [name.strip() for name in lines[0]]
    repeated = [name for name, count in Counter(header).items() if count > 1]
    if repeated:
        raise ResultError(f"{path}: two columns are named {repeated[0]!r}")
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(header):
            raise ResultError(
                f"{path}: row {number} has {len(line)} values for {len(header)} columns"
            )
        try:
            rows.append(tuple(_number(x) for x in line))
        except ValueError:
            raise ResultError(f"{path}: row {number} has a cell that is not a number") from None
    return np.array(rows, [(name, np.float64) for name in header])


def _number(cell: str) -> float:
    """Return the number in a cell; 1 or 0 for a Boolean."""
    return BOOLEANS[cell.lower()] if cell.lower() in BOOLEANS else float(cell)


def body_motions(columns: Columns, mechanism: Mechanism, size: float) -> list[Real]:
    """Return the recorded displacements and rotations of the bodies, rotations times the size [m].

    Parameters
    ----------
    columns : structured array
        The result.
    mechanism : Mechanism
        The mechanism that was simulated.
    size : float
        Size of the mechanism [m].
    """
    scales = {"x": 1.0, "y": 1.0, "angle": size}
    return [
        scale * columns[f"{body.name}.{name}"]
        for body in mechanism.bodies
        for name, scale in scales.items()
        if f"{body.name}.{name}" in names(columns)
    ]


def moves(columns: Columns, mechanism: Mechanism, size: float) -> bool:
    """Return whether a body moves by more than round-off; true if no motion was recorded.

    Parameters as for :func:`body_motions`.
    """
    motions = body_motions(columns, mechanism, size)
    return not motions or any(float(np.ptp(x)) > ZERO_MOTION_RTOL * size for x in motions)


def rest_time(columns: Columns, stop: str = "stop") -> float | None:
    """Return the first recorded time of the last hold at a stop [s].

    Without a hold at the end, it returns None.

    Examples
    --------
    >>> rows = [{"time": 0.0, "stop.contact": False}, {"time": 0.5, "stop.contact": True}]
    >>> rest_time(structured(rows))
    0.5
    """
    open_rows = np.flatnonzero(column(columns, f"{stop}.contact") == 0)
    first = int(open_rows[-1]) + 1 if len(open_rows) else 0
    return float(columns["time"][first]) if first < len(columns) else None
