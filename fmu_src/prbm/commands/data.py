"""Records that a command is given: read, the columns found, cut, calibrated, checked."""

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
    """Read a record, with the names and units that were given.

    Raises
    ------
    RecordError
        If it cannot be read.
    """
    units = dict(pair(text, "--unit") for text in options.unit)
    return read_record(Path(path), columns=options.columns or None, units=units)


def only(found: Record, unit: str, what: str, option: str, but: Sequence[str] = ()) -> str:
    """Return the name of the one column that measures what a unit does.

    Parameters
    ----------
    found : Record
        Where it is.
    unit : str
        For instance ``m``; empty: whatever is not the time.
    what, option : str
        What it is, and the option that names it, for messages.
    but : sequence of str
        Names of columns that it is not.

    Raises
    ------
    UserMistake
        If there is none, or several.
    """
    time = {c.name for c in found.channels if unit == "" and c.unit == "s"}
    fits = [
        c.name
        for c in found.channels
        if c.name not in but and c.name not in time and (unit == "" or _measures(c, unit))
    ]
    if len(fits) == 1:
        return fits[0]
    heads = ", ".join(f"{c.name} [{c.written or '?'}]" for c in found.channels)
    if fits:
        raise UserMistake(
            f"{found.source}: {', '.join(fits)} can all be the {what}: say which, {option} NAME"
        )
    needed = f" in {unit} or a multiple of it" if unit else ""
    raise UserMistake(
        f"{found.source}: no column{needed} can be the {what}; columns are {heads}: name it, "
        f'{option} NAME, and give its unit if it has none, --unit "NAME={unit or "mm"}"'
    )


def _measures(channel: Channel, unit: str) -> bool:
    return channel.unit is not None and same_dimension(channel.written, unit)


def series(path: str, options: argparse.Namespace, unit: str) -> Series:
    """Return the signal of a record over time, cut and counted as the options say.

    Parameters
    ----------
    unit : str
        What it must measure; empty: anything.

    Raises
    ------
    RecordError, UserMistake, EvaluationError
        If there is no such signal, or it cannot be evaluated.
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
                f"{found.source}: {name}, calibrated by {sensor}, is in {signal.unit}, but {unit} "
                "was expected"
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
    """Return the calibration in a record, its quantities and its readings.

    Raises
    ------
    RecordError, UserMistake, EvaluationError
        If there is none.
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
        found.column(channel.name, channel.unit or "m")  # says what is wrong if there is no unit
    sensor = calibrate(one.values, other.values, str(one.unit), str(other.unit))
    return sensor, one.values, other.values


def _sensor(path: str, unit: str) -> Calibration:
    """Return the calibration of a sensor whose readings have a unit."""
    found = read_record(Path(path))
    readings = [c.name for c in found.channels if _measures(c, unit)]
    lengths = [c.name for c in found.channels if _measures(c, "m") and c.name not in readings]
    if len(readings) != 1 or len(lengths) != 1:
        heads = ", ".join(f"{c.name} [{c.written or '?'}]" for c in found.channels)
        raise UserMistake(
            f"--calibration {path}: it needs one column in {unit}, as the signal is, and one "
            f"length beside it; columns are {heads}: leave it out if the signal is a length already"
        )
    return _calibrated(found, lengths[0], readings[0])[0]


def output_unit(name: str, channel: str = "") -> str:
    """Return the unit of an output by its name; empty if it is not known.

    Examples
    --------
    >>> output_unit("shuttle.x"), output_unit("displacement"), output_unit("energy.kinetic")
    ('m', 'm', '')
    """
    return OUTPUT_UNITS.get(name.rpartition(".")[2], channel)


def check_size(found: Real, mechanism: Mechanism, where: str) -> None:
    """Refuse displacements that are larger than the mechanism: their unit is wrong.

    Raises
    ------
    UserMistake
        If one is.
    """
    size = assemble(mechanism, mechanism.values()).length
    largest = float(abs(found).max())
    if largest > size:
        raise UserMistake(
            f"{where} reaches {largest:.4g} m, more than the whole {mechanism.name}, {size:.4g} m: "
            "check the unit of the column"
        )
