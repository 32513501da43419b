"""Measured records of a command line: reading, selection of columns, calibration, checks."""

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..analysis.fit import DISPLACEMENT
from ..data.measurement import Calibration, calibrate
from ..data.records import Channel, Record, read_record
from ..data.series import Series
from ..files.record_units import same_dimension
from ..files.settings import UserMistake, quantity
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble
from ..mechanism.description import Mechanism
from .words import pair

OUTPUT_UNITS = {
    DISPLACEMENT: "m", "x": "m", "y": "m", "angle": "rad", "vx": "m/s", "vy": "m/s",
    "omega": "rad/s", "gap": "m", "gap_rate": "m/s", "force": "N",
}  # fmt: skip


def record(path: str, options: argparse.Namespace) -> Record:
    """Read a record with the names and units of ``--columns`` and ``--unit``.

    Raises
    ------
    RecordError
        If the file cannot be read.
    """
    units = dict(pair(text, "--unit") for text in options.unit)
    return read_record(Path(path), columns=options.columns or None, units=units)


def only(found: Record, unit: str, role: str, option: str, excluded: Sequence[str] = ()) -> str:
    """Return the name of the only column with a unit of the same dimension.

    Parameters
    ----------
    found : Record
        The record.
    unit : str
        For instance ``m``; empty: any column but the time.
    role, option : str
        Role of the column and the option that names it, for messages.
    excluded : sequence of str
        Names of columns to ignore.

    Raises
    ------
    UserMistake
        If there is no such column, or more than one.
    """
    time = {c.name for c in found.channels if unit == "" and c.unit == "s"}
    fits = [
        c.name
        for c in found.channels
        if c.name not in excluded and c.name not in time and (unit == "" or _measures(c, unit))
    ]
    if len(fits) == 1:
        return fits[0]
    heads = ", ".join(f"{c.name} [{c.written or '?'}]" for c in found.channels)
    if fits:
        raise UserMistake(
            f"{found.source}: the {role} can be {' or '.join(fits)}; name it with {option} NAME"
        )
    needed = f" in {unit} or a multiple of it" if unit else ""
    raise UserMistake(
        f"{found.source}: no column{needed} for the {role}; columns are {heads}; name it with "
        f'{option} NAME, and give a missing unit with --unit "NAME={unit or "mm"}"'
    )


def _measures(channel: Channel, unit: str) -> bool:
    return channel.unit is not None and same_dimension(channel.written, unit)


def series(path: str, options: argparse.Namespace, unit: str) -> Series:
    """Return the signal of a record over time, in the time span and by the calibration of options.

    Parameters
    ----------
    unit : str
        Required unit; empty: any.

    Raises
    ------
    RecordError, UserMistake, EvaluationError
        If the record has no such signal, or it cannot be evaluated.
    """
    found = record(path, options)
    sensor = getattr(options, "calibration", None)
    wanted = "" if sensor else unit
    name = options.column or only(found, wanted, "signal", "--column")
    channel = found.channel(name)
    if wanted:
        signal = found.series(name, wanted)
    else:
        kind = channel.unit or "1"
        signal = Series(
            found.time.values, channel.values, channel.name, kind, found.source, found.lines
        )
    if sensor:
        signal = _sensor(sensor, signal.unit).applied(signal)
        if unit and signal.unit != unit:
            raise UserMistake(
                f"{found.source}: {name}, converted by {sensor}, is in {signal.unit}; expected "
                f"{unit}"
            )
    low, high = (
        limit if text is None else quantity(text, "s", option)
        for text, option, limit in (
            (options.start, "--from", -math.inf),
            (options.end, "--to", math.inf),
        )
    )
    signal = signal.between(low, high)
    if getattr(options, "release", None) is not None:
        signal = replace(signal, time=signal.time - quantity(options.release, "s", "--release"))
    return signal


def calibration(path: str, options: argparse.Namespace) -> tuple[Calibration, Real, Real]:
    """Return the calibration by a record, the values of the reference and the readings.

    Raises
    ------
    RecordError, UserMistake, EvaluationError
        If a column is missing or the data cannot be evaluated.
    """
    found, reading = record(path, options), options.reading
    name = options.quantity
    if name is None:
        name = only(found, "m", "quantity", "--quantity", [reading] if reading else [])
    if reading is None:
        reading = only(found, "", "reading", "--reading", [name])
    return _calibrated(found, name, reading)


def _calibrated(found: Record, name: str, reading: str) -> tuple[Calibration, Real, Real]:
    one, other = found.channel(name), found.channel(reading)
    for channel in (one, other):
        found.column(channel.name, channel.unit or "m")  # Raise if there is no unit.
    sensor = calibrate(one.values, other.values, str(one.unit), str(other.unit))
    return sensor, one.values, other.values


def _sensor(path: str, unit: str) -> Calibration:
    """Return the calibration of a sensor with readings in a unit."""
    found = read_record(Path(path))
    readings = [c.name for c in found.channels if _measures(c, unit)]
    lengths = [c.name for c in found.channels if _measures(c, "m") and c.name not in readings]
    if len(readings) != 1 or len(lengths) != 1:
        heads = ", ".join(f"{c.name} [{c.written or '?'}]" for c in found.channels)
        raise UserMistake(
            f"--calibration {path}: it must have one column in {unit}, the unit of the signal, and "
            f"one length; columns are {heads}; omit --calibration if the signal is a length already"
        )
    return _calibrated(found, lengths[0], readings[0])[0]


def output_unit(name: str, default: str = "") -> str:
    """Return the unit of an output by its name; the default for an unknown name.

    Examples
    --------
    >>> output_unit("shuttle.x"), output_unit("displacement"), output_unit("energy.kinetic")
    ('m', 'm', '')
    """
    return OUTPUT_UNITS.get(name.rpartition(".")[2], default)


def check_size(displacements: Real, mechanism: Mechanism, column: str) -> None:
    """Reject displacements [m] larger than the mechanism, whose unit must be wrong.

    Raises
    ------
    UserMistake
        If a displacement is larger than the size of the mechanism.
    """
    size = assemble(mechanism, mechanism.values()).length
    largest = float(abs(displacements).max())
    if largest > size:
        raise UserMistake(
            f"{column} reaches {largest:.4g} m, but the size of {mechanism.name} is {size:.4g} m; "
            "check the unit of the column"
        )
