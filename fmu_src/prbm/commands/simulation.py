"""``prbm simulate``: the motion after the release."""

import argparse
import time
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.stretching import notes
from ..base.progress import reporter
from ..files.mechanism_file import load
from ..files.settings import UserMistake, quantity, settings
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble
from ..mechanism.description import Mechanism
from ..runs.headline import headline
from ..runs.result import Result, names
from ..runs.run import communication_points, simulate
from .duration import span
from .output import Output
from .systems import ROUNDING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

IMPACT_HEAD = (
    "number", "stop", "time [s]", "approach speed [m/s]", "rebound speed [m/s]", "impulse [N.s]",
    "energy lost [J]", "modal restitution [-]",
)  # fmt: skip
PEAKS_TOLD = 6
SHOWN = 1.5  # times the highest mode that is marked: as far as a spectrum is drawn


def simulated(options: argparse.Namespace) -> None:
    """Print what happens after the release."""
    mechanism = load(options.mechanism)
    values = settings(mechanism, options.set)
    output = Output(options.out)
    stop_time, step = span(mechanism, values, options.stop_time, options.step)
    duration = quantity(options.spectrum_time, "s", "--spectrum-time")
    communication_points(stop_time, step)
    begin = time.perf_counter()
    result = simulate(
        mechanism, values, stop_time=stop_time, step=step,
        tolerance=_tolerance(options.tolerance), progress=reporter(),
    )  # fmt: skip
    print(f"simulated            {stop_time:g} s in {time.perf_counter() - begin:.2f} s")
    for line in headline(result.columns, mechanism, result.values):
        print(line)
    columns = names(result.columns)
    output.table(f"{mechanism.name}.csv", columns, (list(row) for row in result.columns.tolist()))
    output.table(f"{mechanism.name}-impacts.csv", IMPACT_HEAD, _impacts(result))
    output.figure(f"{mechanism.name}.png", lambda: _figure(result))
    output.write()
    for sentence in _notes(mechanism, values):
        print(sentence)
    if options.spectrum is not None:
        _spectrum(options, result, values, duration)


def _tolerance(text: str | None) -> float | None:
    if text is None:
        return None
    tolerance = quantity(text, "", "--tolerance")
    if not 0.0 < tolerance < 1.0:
        raise UserMistake(f"--tolerance {text}: choose a number between 0 and 1, as 1e-8")
    return tolerance


def _notes(mechanism: Mechanism, values: Mapping[str, float]) -> list[str]:
    """Return what flexures that do not stretch hide of the impacts."""
    own = {p.name for p in mechanism.parameters}
    return notes(mechanism, {name: x for name, x in values.items() if name in own})


def _impacts(result: Result) -> Iterator[list[object]]:
    for number, impact in enumerate(result.impacts, start=1):
        last = impact.latched
        yield [
            number, impact.stop, impact.time, last.approach_speed, last.rebound_speed,
            last.impulse, last.energy_lost, last.modal_restitution,
        ]  # fmt: skip


def _figure(result: Result) -> "Figure":
    from ..plots.figures import response  # here, because it takes a second

    return response(result)


def _spectrum(
    options: argparse.Namespace, result: Result, values: dict[str, float], duration: float
) -> None:
    """Tell which frequencies are heard after an impact."""
    from ..analysis import spectrum  # here for the start-up time
    from ..plots.spectrum import spectrum_figure

    mechanism, output = result.mechanism, Output(options.out)
    if not result.impacts:
        raise UserMistake(
            f"--spectrum: there is no impact in {result.columns['time'][-1]:g} s; simulate longer "
            "(--stop-time), or move the stop (--set)"
        )
    if options.spectrum == "first":
        stop = next(i for i, s in enumerate(mechanism.stops) if s.name == result.impacts[0].stop)
        heard = spectrum.after_impact(mechanism, values, duration, stop=stop)
    else:
        heard = spectrum.after_last_impact(result)
    lines = {name: spectrum.spectrum(heard.time, getattr(heard, name)) for name in spectrum.SIGNALS}
    grid, modes = lines["along"][0], spectrum.numbered(heard.modes)
    print(
        f"after the {options.spectrum} impact, at t = {heard.impact.time:.5f} s, "
        f"{1e3 * (heard.time[-1] - heard.time[0]):.4g} ms"
        + (" without the wall" if options.spectrum == "first" else "")
        + f", lines {grid[1]:.3g} Hz apart"
    )
    print("modes at its shape   " + ", ".join(f"{i}: {f:.4g} Hz" for i, f in modes))
    _tell_peaks(lines, assemble(mechanism, mechanism.values()).length)
    output.table(
        f"{mechanism.name}-spectrum.csv",
        ["frequency [Hz]", "along [m/s]", "across [m/s]", "turning [rad/s]"],
        np.column_stack([grid, *(amplitude for _, amplitude in lines.values())]).tolist(),
    )
    highest = min(SHOWN * max([f for _, f in modes], default=grid[-1]), float(grid[-1]))
    output.figure(f"{mechanism.name}-spectrum.png", lambda: spectrum_figure(heard, highest=highest))
    output.write()


def _tell_peaks(lines: Mapping[str, tuple[Real, Real]], size: float) -> None:
    """Print the peaks of every signal that is more than rounding."""
    from ..analysis.spectrum import peaks  # here, because it takes two seconds

    loudest = float(lines["along"][1].max())
    for name, (frequency, amplitude) in lines.items():
        speed = float(amplitude.max()) * (size if name == "turning" else 1.0)
        loud = speed > ROUNDING * loudest
        found = peaks(frequency, amplitude)[:PEAKS_TOLD].tolist() if loud else []
        print(f"peaks {name:14} {', '.join(f'{f:.4g} Hz' for f in found) or 'none'}")
