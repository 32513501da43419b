"""A mechanism simulated without an FMU, with the result that FMPy would give for one."""

import csv
import math
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from prbm import Impact, Mechanism, ParameterError, Simulation
from prbm.errors import PrbmError

Columns = NDArray[Any]
Source = Callable[[float], Mapping[str, float]]
Progress = Callable[[float], object]

MOST_PERIODS = 1000.0  # of the time scale of a mechanism in the default experiment of one second
PERIODS = 10.0  # in that of a mechanism that is slower than one, or faster than the other
POINTS = 1000  # communication steps of the default experiment
MOST_ROWS = 10_000_000  # more communication points than this are a mistake in the units of step
ROUND_OFF = 1e-9  # of a communication step: a last step shorter than this is none


class ResultError(PrbmError, ValueError):
    """A result lacks what is asked of it, or is no result of the mechanism."""


@dataclass(frozen=True)
class Result:
    """A mechanism, what it was given, and what it did.

    Parameters
    ----------
    mechanism : Mechanism
        What moved.
    values : mapping
        All its parameters at the start, and the inputs that were given then.
    columns : (m,) structured array
        ``time`` and the variables by name, in SI units, one row a communication point.
    impacts : tuple of Impact
        All impacts in order, with the state around each, as far as they were recorded.
    """

    mechanism: Mechanism
    values: Mapping[str, float]
    columns: Columns
    impacts: tuple[Impact, ...] = field(default=())

    def __getitem__(self, name: str) -> Columns:
        """Return a column by name."""
        return column(self.columns, name)


def column(columns: Columns, name: str) -> Columns:
    """Return a column of a result.

    Raises
    ------
    ResultError
        If there is none of that name.
    """
    if name not in names(columns):
        raise ResultError(
            f"the result has no column {name!r}; record it, with FMPy as in "
            f"simulate_fmu(..., output=[..., {name!r}])"
        )
    found: Columns = columns[name]
    return found


def names(columns: Columns) -> tuple[str, ...]:
    """Return the names of the columns of a result."""
    return columns.dtype.names or ()


@dataclass(frozen=True)
class Experiment:
    """How long a mechanism is simulated unless one says otherwise.

    Parameters
    ----------
    stop_time : float
        Duration [s].
    """

    stop_time: float = 1.0

    @property
    def step(self) -> float:
        """Distance of the communication points [s]."""
        return float(f"{self.stop_time / POINTS:.12g}")


def experiment(mechanism: Mechanism, values: Mapping[str, float] | None = None) -> Experiment:
    """Return the default experiment of a mechanism: a second, if that shows its motion.

    A second of what has less than one period in it, or more than a thousand, would show too little
    of the motion, or nothing but vibrations: there it is about ten periods, 1, 2 or 5 times a
    power of ten.

    Parameters
    ----------
    mechanism, values
        As :func:`simulate` has them.

    Raises
    ------
    ParameterError, EquilibriumError
        If it cannot start with these values.
    """
    _, rate, _ = Simulation(mechanism, values).magnitudes()
    return Experiment(_span(rate / (2 * math.pi)))


def _span(frequency: float) -> float:
    """Return the duration of the default experiment at a frequency [Hz], [s].

    Examples
    --------
    >>> _span(4.9), _span(0.9), _span(9.2e4)
    (1.0, 10.0, 0.0001)
    """
    if 1.0 <= frequency <= MOST_PERIODS:
        return 1.0
    wanted = math.log10(PERIODS / frequency)
    exponents = range(math.floor(wanted), math.floor(wanted) + 2)
    round_ones = [float(f"{digit}e{k}") for k in exponents for digit in (1, 2, 5)]
    return min(round_ones, key=lambda span: abs(math.log10(span) - wanted))


def simulate(
    mechanism: Mechanism,
    values: Mapping[str, float] | None = None,
    stop_time: float = 1.0,
    step: float = 1e-3,
    tolerance: float | None = None,
    source: Source | None = None,
    progress: Progress | None = None,
) -> Result:
    """Simulate a mechanism from its release.

    Parameters
    ----------
    mechanism : Mechanism
        What moves.
    values : mapping
        Parameters and inputs that differ from their defaults.
    stop_time, step : float
        Duration and distance of the communication points [s]; the last step may be shorter.
    tolerance : float or None
        Relative tolerance of the integration; None: ``solver.tolerance``.
    source : callable or None
        Gives inputs and tunable parameters by name for the step that begins at a time [s].
    progress : callable or None
        Told the fraction that is done, from 0 to 1.

    Returns
    -------
    Result
        An input stands in the row at which it begins to act.

    Raises
    ------
    ParameterError
        If a name is unknown, a value out of bounds or there is no step to take.
    EquilibriumError, SimulationError
        As :class:`prbm.Simulation` does.
    """
    times = communication_points(stop_time, step)
    simulation = Simulation(mechanism, values, tolerance=tolerance)
    simulation.record = []
    start = {**simulation.values, **simulation.given}
    rows = []
    for k, t in enumerate(times):
        simulation.advance(t)
        outputs = simulation.outputs()
        if source is not None:
            simulation.set(source(t))
        rows.append({"time": t, **simulation.given, **outputs})
        if progress is not None:
            progress(k / (len(times) - 1))
    return Result(mechanism, start, structured(rows), tuple(simulation.record))


FIRST_WORD, EVERY = 1.0, 2.0  # s; what is done sooner needs no report, and lines are few


def reporter(stream: TextIO | None = None) -> Progress:
    """Return what tells on a stream, standard error by default, how much of a work is done.

    It says nothing in the first second; then it rewrites its line on a terminal, and adds a line
    every other second elsewhere.
    """
    out = sys.stderr if stream is None else stream
    terminal = out.isatty()
    begin = time.monotonic()
    last = -math.inf  # when it said something [s]

    def report(fraction: float) -> None:
        nonlocal last
        now = time.monotonic() - begin
        done = fraction >= 1.0
        if done and terminal and last > 0.0:
            print("\r100%", file=out, flush=True)
            last = -math.inf
        elif not done and now >= FIRST_WORD and now - last >= (0.1 if terminal else EVERY):
            text, end = (f"\r{fraction:4.0%}", "") if terminal else (f"{fraction:4.0%} done", "\n")
            print(text, end=end, file=out, flush=True)
            last = now

    return report


def communication_points(stop_time: float, step: float) -> list[float]:
    """Return 0, step, 2 step, ... up to the stop time [s].

    Raises
    ------
    ParameterError
        If that is not a finite number of steps forwards.

    Examples
    --------
    >>> communication_points(1.0, 0.4)
    [0.0, 0.4, 0.8, 1.0]
    """
    for name, value in (("stop_time", stop_time), ("step", step)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"{name} = {value:g} s must be positive and finite")
    steps = math.ceil(stop_time / step - ROUND_OFF)
    if steps > MOST_ROWS:
        raise ParameterError(
            f"step = {step:g} s makes {steps} steps in {stop_time:g} s: choose a larger one"
        )
    return [*(k * step for k in range(max(steps, 1))), stop_time]


def structured(rows: Iterable[Mapping[str, float | int | bool]]) -> Columns:
    """Return rows of values by name as a structured array with FMPy's types.

    Examples
    --------
    >>> structured([{"time": 0.0, "stop.contact": True}])["stop.contact"]
    array([ True])
    """
    table = list(rows)
    kinds = {bool: np.bool_, int: np.int32}
    dtype = [(name, kinds.get(type(x), np.float64)) for name, x in table[0].items()]
    return np.array([tuple(row.values()) for row in table], dtype)


WORDS = {"true": 1.0, "false": 0.0}


def read_csv(path: str | Path) -> Columns:
    """Read a result from a CSV file as FMPy writes it: names, then a row for every time.

    Raises
    ------
    ResultError
        If the file cannot be read or is no such table; the message names the line.
    """
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = [line for line in csv.reader(file) if line]
    except OSError as error:
        raise ResultError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ResultError(f"{path}: is no CSV file ({error})") from None
    if len(lines) < 3 or lines[0][0].strip() != "time":
        raise ResultError(
            f"{path}: is no result; the first line names the columns, the first of them is "
            "time, and two rows or more follow"
        )
    header = [name.strip() for name in lines[0]]
    if len(set(header)) < len(header):
        raise ResultError(f"{path}: a column stands there twice")
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != len(header):
            raise ResultError(
                f"{path}: row {number} has {len(line)} values for {len(header)} columns"
            )
        try:
            rows.append(tuple(WORDS[x.lower()] if x.lower() in WORDS else float(x) for x in line))
        except ValueError:
            raise ResultError(f"{path}: row {number} holds what is no number") from None
    return np.array(rows, [(name, np.float64) for name in header])


def rest_time(columns: Columns, stop: str = "stop") -> float | None:
    """Return the first recorded time from which on a stop holds to the end of the result [s].

    None if it does not hold at the end.

    Examples
    --------
    >>> rows = [{"time": 0.0, "stop.contact": False}, {"time": 0.5, "stop.contact": True}]
    >>> rest_time(structured(rows))
    0.5
    """
    open_rows = np.flatnonzero(column(columns, f"{stop}.contact") == 0)
    first = int(open_rows[-1]) + 1 if len(open_rows) else 0
    return float(columns["time"][first]) if first < len(columns) else None
