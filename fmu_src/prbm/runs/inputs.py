"""Read signals from texts such as ``half-sine(500 g, 0.5 ms)``, for the inputs of a mechanism."""

import csv
import math
import re
from collections.abc import Callable, Collection, Container, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from ..base import reading
from ..base.errors import ParameterError
from ..base.names import proposal, unknown
from ..base.text import comma_advice
from ..files.settings import quantity
from ..mechanics.inputs import input_units
from ..mechanism.description import Mechanism
from .signals import (
    Function,
    RowError,
    Signal,
    Slope,
    Steps,
    Table,
    Wave,
    sawtooth,
    table,
    trapezoid,
)

Source = str | float | Signal | Callable[[float], float] | Sequence[Any]
"""A text, a number, a signal, a function of time, or a pair of arrays (times, values)."""

SIGNAL = object()  # Stands for the unit of the input.
REQUIRED = None
Arguments = Mapping[str, tuple[Any, float | None]]

SHAPES: dict[str, Arguments] = {  # Arguments with their units and default values.
    "step": {"height": (SIGNAL, REQUIRED), "start": ("s", 0.0)},
    "pulse": {"height": (SIGNAL, REQUIRED), "duration": ("s", REQUIRED), "start": ("s", 0.0)},
    "half-sine": {"height": (SIGNAL, REQUIRED), "duration": ("s", REQUIRED), "start": ("s", 0.0)},
    "sawtooth": {"height": (SIGNAL, REQUIRED), "duration": ("s", REQUIRED), "start": ("s", 0.0)},
    "trapezoid": {"height": (SIGNAL, REQUIRED), "duration": ("s", REQUIRED), "start": ("s", 0.0)},
    "sine": {
        "amplitude": (SIGNAL, REQUIRED), "frequency": ("Hz", REQUIRED), "start": ("s", 0.0),
        "duration": ("s", math.inf), "phase": ("rad", 0.0),
    },
    "chirp": {
        "amplitude": (SIGNAL, REQUIRED), "from": ("Hz", REQUIRED), "to": ("Hz", REQUIRED),
        "duration": ("s", REQUIRED), "start": ("s", 0.0), "phase": ("rad", 0.0),
    },
}  # fmt: skip
FILE = "csv"
FILE_SIZE_MAX = 1 << 28  # bytes of the file of a signal; ten million rows have 250 MB.
DURATION_MIN = 1e-15  # s: a shorter signal is a mistake in a unit.
DECIMAL_COMMA = re.compile(r"(?<![\w.,])[+-]?\d+,\d+(?:[eE][+-]?\d+)?\s*[A-Za-zµμ°%][^,)]*")
PLACEHOLDER = re.compile(r"\{([\w.]+)\}")


def signals(
    mechanism: Mechanism, inputs: Mapping[str, Source], constants: Collection[str] = ()
) -> dict[str, Signal]:
    """Return the signals of inputs by name.

    If a signal is given for the displacement of a wall and none for its velocity, the velocity is
    the derivative of the displacement.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    inputs : mapping
        For each input a text in the form of :func:`read_signal`, a number in SI, a
        :class:`~prbm.runs.signals.Signal`, a function of time [s], or a pair of arrays of times [s]
        and values, which are joined by straight lines.
    constants : collection of str
        Names of inputs with constant values.

    Raises
    ------
    ParameterError
        If an input is unknown or among the constants, a signal is invalid, or the velocity of a
        wall has a signal and its displacement has none.
    UserMistake
        If a quantity has a wrong unit.
    """
    return driving(input_units(mechanism), mechanism.values(), inputs, constants)


def driving(
    units: Mapping[str, str],
    parameters: Container[str],
    inputs: Mapping[str, Source],
    constants: Collection[str] = (),
) -> dict[str, Signal]:
    """Return the signals of inputs by name, as :func:`signals`, of a mechanism or an FMU.

    Parameters
    ----------
    units : mapping
        SI units of all inputs by name.
    parameters : container of str
        Names of variables that have one value per simulation.
    inputs, constants
        As for :func:`signals`.

    Raises
    ------
    ParameterError, UserMistake
        As :func:`signals`.
    """
    found: dict[str, Signal] = {}
    for name, source in inputs.items():
        if name in parameters:
            raise ParameterError(
                f"{name} is a parameter, which has one value per simulation, not an input over "
                f"time; inputs are {', '.join(units)}"
            )
        if name not in units:
            raise ParameterError(unknown(name, units))
        if name in constants:
            raise ParameterError(
                f"{name} is given both as a constant and over time; remove one of them"
            )
        found[name] = _signal(name, source, units[name])
    return with_velocities(found, units, constants)


def with_velocities(
    found: Mapping[str, Signal], inputs: Container[str], constants: Collection[str] = ()
) -> dict[str, Signal]:
    """Return signals together with the velocities of walls whose displacement is a signal.

    Parameters
    ----------
    found : mapping
        Signals by the names of inputs.
    inputs : container of str
        Names of all inputs.
    constants : collection of str
        Names of inputs that have a constant value.

    Raises
    ------
    ParameterError
        If the velocity of a wall has a signal and its displacement has none.
    """
    derived = {}
    for name, signal in found.items():
        stop, _, last = name.rpartition(".")
        velocity = f"{stop}.velocity"
        if last == "velocity":
            check_wall(name, inputs, found)
        elif last == "displacement" and velocity in inputs and velocity not in {*found, *constants}:
            derived[velocity] = Slope(signal)
    return {**found, **derived}


def check_wall(velocity: str, inputs: Container[str], found: Container[str]) -> None:
    """Reject the velocity of a wall whose displacement does not follow it.

    Parameters
    ----------
    velocity : str
        Name of the velocity, which is not 0.
    inputs, found : container of str
        Names of all inputs, and of those with signals.

    Raises
    ------
    ParameterError
        If the displacement is an input without a signal.
    """
    displacement = f"{velocity.removesuffix('velocity')}displacement"
    if displacement in inputs and displacement not in found:
        raise ParameterError(
            f"{velocity} is given and {displacement} is constant, so that the wall would not move; "
            f"give {displacement} over time instead, whose derivative is then the velocity"
        )


def placeholders(inputs: Mapping[str, Source]) -> set[str]:
    """Return the names in braces in the texts of signals, which stand for numbers.

    Examples
    --------
    >>> sorted(placeholders({"force.x": "pulse({height} mN, {width} ms)", "force.y": 1.0}))
    ['height', 'width']
    """
    texts = [source for source in inputs.values() if isinstance(source, str)]
    return {name for text in texts for name in PLACEHOLDER.findall(text)}


def filled(inputs: Mapping[str, Source], numbers: Mapping[str, float]) -> dict[str, Source]:
    """Return inputs with numbers in place of the names in braces.

    Examples
    --------
    >>> filled({"force.x": "pulse({height} mN, 2 ms)"}, {"height": 3.0})
    {'force.x': 'pulse(3.0 mN, 2 ms)'}
    """

    def text(source: str) -> str:
        return PLACEHOLDER.sub(lambda m: repr(float(numbers[m[1]])), source)

    return {name: text(x) if isinstance(x, str) else x for name, x in inputs.items()}


def files_of(inputs: Mapping[str, Source]) -> list[str]:
    """Return the paths of the files in the texts of signals.

    Examples
    --------
    >>> files_of({"force.x": "csv(shock.csv, x)", "force.y": "step(1 N)", "force.moment": 1.0})
    ['shock.csv']
    """
    texts = (source.partition("(") for source in inputs.values() if isinstance(source, str))
    return [
        rest.rstrip().removesuffix(")").split(",")[0].strip()
        for shape, _, rest in texts
        if shape.strip() == FILE
    ]


def _signal(name: str, source: Source, unit: str) -> Signal:
    """Return a signal from one of its forms."""
    if isinstance(source, str):
        return read_signal(name, source, unit)
    if isinstance(source, Signal):
        return source
    if callable(source):
        return Function(source, name, unit)
    if isinstance(source, bool | bytes):
        raise ParameterError(f"{name} = {source!r}: {_forms(unit)}")
    try:
        if hasattr(source, "__float__"):
            return Steps((), (_finite(name, float(source)),))
        times, values = cast(Sequence[Any], source)
        return table(times, values)
    except ParameterError as error:
        raise ParameterError(f"{name}: {error}") from None
    except (TypeError, ValueError):
        raise ParameterError(f"{name} = {source!r}: {_forms(unit)}") from None


def _finite(name: str, x: float) -> float:
    if not math.isfinite(x):
        raise ParameterError(f"{name} = {x:g} must be finite")
    return x


def _forms(unit: str) -> str:
    return (
        f'must be a text such as "half-sine(1 {unit}, 10 ms)", a number in {unit}, a function of '
        "time, or a pair of arrays (times, values)"
    )


def read_signal(name: str, text: str, unit: str) -> Signal:
    """Read a signal.

    Parameters
    ----------
    name : str
        Name of the input, for messages.
    text : str
        A quantity; ``step(height, start)``, ``pulse(height, duration, start)``,
        ``half-sine(height, duration, start)``, ``sawtooth(height, duration, start)``,
        ``trapezoid(height, duration, start)``, ``sine(amplitude, frequency, start, duration,
        phase)``, ``chirp(amplitude, from, to, duration, start, phase)``, where ``start`` is 0 by
        default; or ``csv(FILE, COLUMN)``.  Arguments may be named: ``start=10 ms``.
    unit : str
        SI unit of the input.

    Raises
    ------
    ParameterError
        If the shape or an argument is unknown, missing or out of bounds, or the file is invalid.
    UserMistake
        If a quantity cannot be read or has another dimension.

    Examples
    --------
    >>> read_signal("force.x", "step(3 mN, 20 ms)", "N")
    Steps(breaks=(0.02,), levels=(0.0, 0.003))
    >>> read_signal("force.x", "half-sine(2 N, duration=4 ms)", "N")
    Wave(amplitude=2.0, f=125.0, f1=125.0, start=0.0, end=0.004, phase=0.0)
    """
    shape, bracket, rest = (part.strip() for part in text.partition("("))
    if not (shape and bracket and rest.endswith(")")):
        return Steps((), (quantity(text, unit, f"{name} ="),))
    words = [word.strip() for word in rest[:-1].split(",")]
    where = f"{name} = {text.strip()}"
    if shape == FILE:
        return _from_file(where, words, unit)
    if comma := DECIMAL_COMMA.search(rest):
        raise ParameterError(
            f"{where}: {comma_advice(comma[0])}; or write a blank after the comma if it separates "
            "two arguments"
        )
    if shape not in SHAPES:
        hint = proposal(shape, dict.fromkeys([*SHAPES, FILE]))
        raise ParameterError(f"{where}: unknown shape {shape!r}; {hint}")
    numbers = _numbers(where, shape, words, unit)
    try:
        return _shaped(shape, numbers)
    except ParameterError as error:
        raise ParameterError(f"{where}: {error}") from None


def _numbers(where: str, shape: str, words: Sequence[str], unit: str) -> dict[str, float]:
    """Return the arguments of a shape by name, in SI and within their bounds."""
    known, numbers = SHAPES[shape], {}
    given = _named(where, words, known)
    for key, (dimension, default) in known.items():
        own = unit if dimension is SIGNAL else dimension
        if key in given:
            numbers[key] = quantity(given[key], own, f"{where}: {key} =")
        elif default is REQUIRED:
            raise ParameterError(f"{where}: {key} is missing; write {shape}({', '.join(known)})")
        else:
            numbers[key] = default
    for key in ("duration", "frequency", "from", "to"):
        if key in numbers and not numbers[key] > 0.0:
            own = known[key][0]
            raise ParameterError(f"{where}: {key} = {numbers[key]:g} {own} must be positive")
    if numbers.get("duration", math.inf) < DURATION_MIN:
        raise ParameterError(
            f"{where}: duration = {numbers['duration']:g} s must be at least {DURATION_MIN:g} s"
        )
    return numbers


def _named(where: str, words: Sequence[str], known: Arguments) -> dict[str, str]:
    """Return the arguments of a shape by name."""
    given: dict[str, str] = {}
    order = [*known]
    for position, word in enumerate(words):
        key, equals, value = (part.strip() for part in word.partition("="))
        if not equals:
            if position >= len(order):
                raise ParameterError(
                    f"{where}: {len(words)} arguments are given; at most {len(order)} are known: "
                    f"{', '.join(order)}"
                )
            key, value = order[position], word
        if key not in known:
            raise ParameterError(f"{where}: unknown argument {key!r}; {proposal(key, known)}")
        if key in given:
            raise ParameterError(f"{where}: {key} is given twice; remove one of them")
        if not value:
            raise ParameterError(f"{where}: {key} is empty; write a quantity")
        given[key] = value
    return given


def _shaped(shape: str, x: Mapping[str, float]) -> Signal:
    """Return the signal of a shape with its arguments in SI."""
    start = x["start"]
    if shape == "step":
        return Steps((start,), (0.0, x["height"]))
    end = start + x["duration"]
    if shape == "pulse":
        return Steps((start, end), (0.0, x["height"], 0.0))
    if shape == "half-sine":
        f = 0.5 / x["duration"]
        return Wave(x["height"], f, f, start, end)
    if shape == "sawtooth":
        return sawtooth(x["height"], start, end)
    if shape == "trapezoid":
        return trapezoid(x["height"], start, end)
    if shape == "sine":
        return Wave(x["amplitude"], x["frequency"], x["frequency"], start, end, x["phase"])
    return Wave(x["amplitude"], x["from"], x["to"], start, end, x["phase"])


# --- files ----------------------------------------------------------------------------------------


def _from_file(where: str, words: Sequence[str], unit: str) -> Table:
    """Return the signal in a column of a CSV file: ``csv(FILE, COLUMN)``."""
    if not words[0] or len(words) > 2:
        raise ParameterError(f"{where}: write csv(FILE, COLUMN)")
    head, rows = _rows(where, Path(words[0]))
    names = [_name_and_unit(cell)[0] for cell in head]
    if len(words) == 1 and len(names) != 2:
        raise ParameterError(
            f"{where}: the file has {len(names)} columns; name one of {', '.join(names[1:])}"
        )
    name = words[1] if len(words) == 2 else names[1]
    if name not in names[1:]:
        hint = proposal(name, dict.fromkeys(names[1:]))
        raise ParameterError(f"{where}: the file has no column {name!r}; {hint}")
    k = names.index(name, 1)
    factors = {0: _factor(where, head[0], "s"), k: _factor(where, head[k], unit)}
    for line, row in rows.items():
        if not _numeric(row, (0, k)):
            raise ParameterError(
                f"{where}: line {line} has no number for {names[0]} or {name}; correct it"
            )
    times, values = ([float(row[i]) * f for row in rows.values()] for i, f in factors.items())
    try:
        return Table(tuple(times), tuple(values))
    except RowError as error:
        raise ParameterError(f"{where}: line {[*rows][error.row]}: {error.reason}") from None


def _rows(where: str, path: Path) -> tuple[list[str], dict[int, list[str]]]:
    """Return the head of a CSV file, and the other rows by the numbers of their last lines."""
    try:
        text = reading.text(path, FILE_SIZE_MAX, lambda e: ParameterError(f"{where}: {e}"))
        reader = csv.reader(text)
        rows = dict((reader.line_num, row) for row in reader if row)
    except (UnicodeDecodeError, csv.Error) as error:
        raise ParameterError(f"{where}: {path} is not a CSV file ({error})") from None
    head = rows.pop(min(rows, default=0), [])
    for line, row in rows.items():
        if len(row) > len(head):
            raise ParameterError(
                f"{where}: line {line} of {path} has {len(row)} cells for {len(head)} columns; "
                "write numbers with a decimal point, and commas between them"
            )
    if len(rows) < 2 or len(head) < 2 or _numeric(head, (0,)):
        raise ParameterError(
            f'{where}: {path} must have a head, as in "t [s],a [m/s2]", and at least two rows; '
            "the first column is the time, and the columns are separated by commas"
        )
    return head, rows


def _numeric(row: Sequence[str], columns: Sequence[int]) -> bool:
    """Return whether cells of a row are numbers."""
    try:
        return all(math.isfinite(float(row[k])) for k in columns)
    except (ValueError, IndexError):
        return False


def _name_and_unit(head: str) -> tuple[str, str]:
    """Return the name and the unit in the head of a column; an empty text without a unit.

    Examples
    --------
    >>> _name_and_unit("a [m/s2]"), _name_and_unit("shuttle.x")
    (('a', 'm/s2'), ('shuttle.x', ''))
    """
    name, bracket, rest = (part.strip() for part in head.partition("["))
    return (name, rest[:-1].strip()) if bracket and rest.endswith("]") else (head.strip(), "")


def _factor(where: str, head: str, unit: str) -> float:
    """Return the factor from the unit in the head of a column to SI; 1 without a unit."""
    _, written = _name_and_unit(head)
    if written in ("", "-"):
        return 1.0
    return quantity(f"1 {written}", unit, f"{where}: column {head!r},")
