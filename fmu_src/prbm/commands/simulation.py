"""``prbm simulate``: the motion after the release, and spectra after impacts."""

import argparse
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.adequacy import Impact, Shape, Vibration, notes
from ..analysis.fastest import fastest
from ..base.progress import reporter
from ..base.unit_text import frequency_text
from ..files.mechanism_file import file_of, load
from ..files.settings import UserMistake, quantity
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble
from ..mechanism.description import Mechanism
from ..runs.headline import headline
from ..runs.hits import hits
from ..runs.impact_table import heads, impact_table
from ..runs.inputs import files_of
from ..runs.modal_note import modal_notes
from ..runs.result import Result, names
from ..runs.run import communication_points, simulate
from .duration import given_inputs, span
from .output import Output
from .parameters import given_values
from .record import Record
from .systems import ZERO_RTOL

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SLOW = 5.0  # Computing time from which on a note says what sets the step [s].
PEAKS_MAX = 6  # Printed peaks per signal.
SPECTRUM_END = 1.5  # Upper end of a drawn spectrum, in multiples of its highest marked mode.


def run_simulation(options: argparse.Namespace) -> None:
    """Simulate the motion after the release and print a summary."""
    mechanism = load(options.mechanism)
    values = given_values(mechanism, options)
    output = Output(options.out)
    stop_time, step = span(mechanism, values, options.stop_time, options.step, options.engine)
    duration = quantity(options.spectrum_time, "s", "--spectrum-time")
    communication_points(stop_time, step)
    record = Record(options.out, f"{mechanism.name}-run.json", file_of(options.mechanism))
    if options.input and options.spectrum == "first":
        raise UserMistake(
            "--spectrum first: the motion after the first impact is simulated without inputs over "
            "time; use --spectrum last"
        )
    tolerance, inputs = _tolerance(options.tolerance), given_inputs(options)
    begin = time.perf_counter()
    result = simulate(
        mechanism, values, inputs=inputs, stop_time=stop_time, step=step, tolerance=tolerance,
        progress=reporter(), engine=options.engine,
    )  # fmt: skip
    spent = time.perf_counter() - begin
    print(f"simulated            {stop_time:g} s in {spent:.2f} s")
    for line in headline(result, mechanism, result.start_values):
        print(line)
    for line in hits(result) if len(result.impacts) > 1 else ():
        print(line)
    for line in modal_notes(result):
        print(line)
    columns = names(result.columns)
    output.table(f"{mechanism.name}.csv", columns, (list(row) for row in result.columns.tolist()))
    units, rows = impact_table(mechanism, result.impacts)
    output.table(f"{mechanism.name}-impacts.csv", heads(units), rows)
    output.figure(f"{mechanism.name}.png", lambda: _figure(result))
    arguments = _arguments(result, values, inputs, step, tolerance)
    output.text(record.name, record.text(mechanism.name, arguments, files_of(inputs)))
    output.write()
    for sentence in [*record.notes(), *_notes(result.mechanism, values)]:
        print(sentence)
    if spent > SLOW:
        print(_slow(result.mechanism, values))
    if options.spectrum is not None:
        _spectrum(options, result, values, duration)


def _arguments(
    result: Result,
    values: Mapping[str, float],
    inputs: Mapping[str, str],
    step: float,
    tolerance: float | None,
) -> dict[str, object]:
    """Return the arguments of :func:`prbm.simulate` that repeat a simulation."""
    return {
        "changes": values, "inputs": inputs, "stop_time": float(result["time"][-1]), "step": step,
        "tolerance": tolerance or result.start_values["solver.tolerance"], "engine": result.engine,
    }  # fmt: skip


def _slow(mechanism: Mechanism, values: Mapping[str, float]) -> str:
    """Return a note on the mode that sets the step of the integration."""
    parameters = {p.name for p in mechanism.parameters}
    found = fastest(mechanism, {n: x for n, x in values.items() if n in parameters})
    if found is None:
        return (
            "note: the run is slow; prbm modes --count 99 prints the frequencies that it resolves"
        )
    mode = f"note: the run is slow: its steps resolve a mode of {frequency_text(found.frequency)}"
    return f"{mode}; {found.parameter} changes this frequency most" if found.parameter else mode


def _tolerance(text: str | None) -> float | None:
    """Return the relative tolerance; None if it is not given."""
    if text is None:
        return None
    tolerance = quantity(text, "", "--tolerance")
    if not 0.0 < tolerance < 1.0:
        raise UserMistake(f"--tolerance {text}: must lie between 0 and 1, for instance 1e-8")
    return tolerance


def _notes(mechanism: Mechanism, values: Mapping[str, float]) -> list[str]:
    """Return notes on the flexure model, at rest and in impacts."""
    parameters = {p.name for p in mechanism.parameters}
    shapes: list[Shape] = [Vibration(), *map(Impact, range(len(mechanism.stops)))]
    return notes(mechanism, {n: x for n, x in values.items() if n in parameters}, shapes)


def _figure(result: Result) -> "Figure":
    from ..plots.figures import response  # imported here: it takes a second

    return response(result)


def _spectrum(
    options: argparse.Namespace, result: Result, values: dict[str, float], duration: float
) -> None:
    """Print the frequencies of the vibration after an impact; write its spectrum."""
    from ..analysis import spectrum  # imported here: slow
    from ..plots.spectrum import spectrum_figure

    mechanism, output = result.mechanism, Output(options.out)
    if not result.impacts:
        raise UserMistake(
            f"--spectrum: no impact in {result.columns['time'][-1]:g} s; simulate longer with "
            "--stop-time, or move the stop with --set"
        )
    if options.spectrum == "first":
        stop = next(i for i, s in enumerate(mechanism.stops) if s.name == result.impacts[0].stop)
        vibration = spectrum.after_impact(
            mechanism, values, duration, stop=stop, engine=options.engine
        )
    else:
        vibration = spectrum.after_last_impact(result)
    lines = {
        name: spectrum.spectrum(vibration.time, getattr(vibration, name))
        for name in spectrum.SIGNALS
    }
    grid, modes = lines["along"][0], spectrum.numbered(vibration.modes)
    print(
        f"after the {options.spectrum} impact, at t = {vibration.impact.time:.5f} s, "
        f"{1e3 * (vibration.time[-1] - vibration.time[0]):.4g} ms"
        + (" without the wall" if options.spectrum == "first" else "")
        + f", resolution {grid[1]:.3g} Hz"
    )
    print("modes at that shape  " + ", ".join(f"{i}: {frequency_text(f)}" for i, f in modes))
    _print_peaks(lines, assemble(mechanism, mechanism.values()).length)
    output.table(
        f"{mechanism.name}-spectrum.csv",
        ["frequency [Hz]", "along [m/s]", "across [m/s]", "turning [rad/s]"],
        np.column_stack([grid, *(amplitude for _, amplitude in lines.values())]).tolist(),
    )
    highest = min(SPECTRUM_END * max([f for _, f in modes], default=grid[-1]), float(grid[-1]))
    output.figure(
        f"{mechanism.name}-spectrum.png", lambda: spectrum_figure(vibration, highest=highest)
    )
    output.write()


def _print_peaks(lines: Mapping[str, tuple[Real, Real]], size: float) -> None:
    """Print the peaks of each signal above round-off."""
    from ..analysis.spectrum import peaks  # imported here: it takes two seconds

    largest = float(lines["along"][1].max())
    for name, (frequency, amplitude) in lines.items():
        speed = float(amplitude.max()) * (size if name == "turning" else 1.0)
        significant = speed > ZERO_RTOL * largest
        found = peaks(frequency, amplitude)[:PEAKS_MAX].tolist() if significant else []
        print(f"peaks {name:14} {', '.join(map(frequency_text, found)) or 'none'}")
