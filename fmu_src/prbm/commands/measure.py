"""``prbm measure``: quantities evaluated from measured data, with their uncertainties."""

import argparse
from collections.abc import Sequence

from ..analysis.fit import fitted_restitution
from ..analysis.touching import stop_index
from ..base.progress import reporter
from ..data.measurement import Beam, YoungsModulus, beam_table, youngs_modulus
from ..data.uncertainty import Estimate
from ..data.vibration import free_vibration
from ..files.mechanism_file import load
from ..files.settings import UserMistake, settings
from ..plots import measurement as figures
from . import data, fitting
from .output import Output
from .words import estimate, free, stem

ESTIMATE_HEAD = ("quantity", "value", "standard uncertainty", "unit")


def modulus(options: argparse.Namespace) -> None:
    """Print Young's modulus of one beam, or of several with their mean."""
    output = Output(options.out)
    sizes = [
        _one_each(getattr(options, size), f"--{size}", len(options.files))
        for size in ("length", "width", "thickness")
    ]
    names = [stem(path) for path in options.files]
    if len(set(names)) < len(names):
        raise UserMistake(
            "two files have the same name; beams are named after their files: rename one"
        )
    found = []
    for path, name, size in zip(options.files, names, zip(*sizes, strict=True), strict=True):
        found.append(_modulus(options, path, Beam(name, *size)))
        print(found[-1])
    rows = [[one.beam.name, *_row(one)] for one in found]
    if len(found) > 1:
        table = beam_table(found)
        print(table)
        rows.append(["mean", table.mean.value, table.mean.uncertainty, "", "", "", "", ""])
    output.table(
        "youngs-modulus.csv",
        ["beam", "E [Pa]", "standard uncertainty [Pa]", "stiffness [N/m]",
         "uncertainty of stiffness [N/m]", "residual [N]", "loss per cycle [-]", "points"],
        rows,
    )  # fmt: skip
    for one in found:
        output.figure(f"{one.beam.name}-bending.png", _bending(one))
    output.write()


def _bending(one: YoungsModulus):  # type: ignore[no-untyped-def]
    return lambda: figures.bending_figure(one)


def _row(one: YoungsModulus) -> list[object]:
    return [
        one.modulus.value, one.modulus.uncertainty, one.stiffness.value, one.stiffness.uncertainty,
        one.fit.residual, one.loss, one.fit.n,
    ]  # fmt: skip


def _one_each(texts: Sequence[str], option: str, count: int) -> list[Estimate]:
    """Return a dimension of every beam; a single value is that of all beams."""
    if len(texts) not in (1, count):
        raise UserMistake(
            f"{option} is given {len(texts)} times for {count} files; give it once for all files, "
            "or once per file in the same order"
        )
    sizes = [estimate(text, "m", option) for text in texts]
    return sizes * (count if len(sizes) == 1 else 1)


def _modulus(options: argparse.Namespace, path: str, beam: Beam) -> YoungsModulus:
    found = data.record(path, options)
    deflection = options.deflection or data.only(found, "m", "deflection", "--deflection")
    force = options.force or data.only(found, "N", "force", "--force")
    low, high = options.fit_range
    return youngs_modulus(
        found.column(deflection, "m"), found.column(force, "N"), beam,
        fit_range=(low, high), window=options.window,
        sensor_angle=estimate(options.sensor_angle, "deg", "--sensor-angle"),
        force_gain=estimate(options.force_gain, "", "--force-gain"),
    )  # fmt: skip


def calibration(options: argparse.Namespace) -> None:
    """Print the sensitivity of a sensor."""
    output = Output(options.out)
    sensor, quantity, reading = data.calibration(options.file, options)
    print(f"sensitivity {sensor.sensitivity}")
    print(sensor)
    name = stem(options.file)
    output.table(
        f"{name}-calibration.csv",
        ESTIMATE_HEAD,
        [_estimate("gain", sensor.gain), _estimate("sensitivity", sensor.sensitivity)],
    )
    output.figure(
        f"{name}-calibration.png",
        lambda: figures.calibration_figure(sensor, quantity, reading),
    )
    output.write()


def _estimate(name: str, x: Estimate) -> list[object]:
    return [name, x.value, x.uncertainty, x.unit]


def frequency(options: argparse.Namespace) -> None:
    """Print frequency and damping of a free vibration."""
    output = Output(options.out)
    signal = data.series(options.file, options, "")
    found = free_vibration(signal)
    print(found)
    name = stem(options.file)
    known = {
        "frequency": found.frequency,
        "damped frequency": found.damped_frequency,
        "damping ratio": found.zeta,
        "logarithmic decrement": found.decrement,
        "damping ratio by the decrement": found.decrement_zeta,
        "frequency by the spectrum": found.peak.frequency,
    }
    output.table(
        f"{name}-frequency.csv",
        ESTIMATE_HEAD,
        [_estimate(key, x) for key, x in known.items() if x is not None],
    )
    output.figure(f"{name}-frequency.png", lambda: figures.vibration_figure(signal, found))
    output.write()


def restitution(options: argparse.Namespace) -> None:
    """Print the restitution of a stop, fitted to a bouncing response."""
    mechanism = load(options.mechanism)
    values = settings(mechanism, options.set)
    further = [free(mechanism, text) for text in options.free]
    output = Output(options.out)
    target = fitting.response(options, options.file, mechanism)
    stop = mechanism.stops[stop_index(mechanism, options.stop or None)].name
    found = fitted_restitution(
        mechanism, target.series, values, output=target.output, stop=stop,
        uncertainty=target.uncertainty, free=further, progress=reporter(),
    )  # fmt: skip
    fitting.report(found, output, stem(options.file))
    output.write()
