"""``prbm linearize``: linear models and frequency responses."""

import argparse
import math
from typing import Any

import numpy as np

from ..analysis.held import held_scale, held_unit
from ..analysis.linear_model import LinearModel, linearize
from ..base.unit_text import mode_text
from ..files.settings import UserMistake, quantity
from ..mechanics.arrays import Complex, Real
from ..mechanics.linear import input_units, output_units
from ..plots.response import response_figure
from .load_paths import given_loads, load_text
from .output import Output, aligned
from .systems import ZERO_RTOL, assembled, rounded

PAIRS_SHOWN = 24
ZERO = "0"


def linear_model(options: argparse.Namespace) -> None:
    """Print modes and measures of the responses; write the model, its responses and a figure."""
    mechanism, values, system = assembled(options)
    output = Output(options.out)
    loads = given_loads(mechanism, options.load)
    known = {name for name in input_units(system) if name.endswith((".x", ".y"))}
    at: dict[str, Any] = {"loads": loads, "resting": options.resting or ()}
    model = linearize(
        mechanism, values, **at, inputs=options.inputs or sorted(known),
        outputs=options.outputs
        or [f"{mechanism.release.body}.{what}" for what in ("x", "y", "angle")],
    )  # fmt: skip
    whole = linearize(
        mechanism, values, **at, inputs=[*input_units(system)], outputs=[*output_units(system)]
    )
    unit = held_unit(mechanism)
    place = rounded(unit.factor * system.amount(model.shape.q), unit.factor * held_scale(system))
    contacts = "".join(f"; {name} {how}" for name, how in model.contacts)
    print(
        f"{mechanism.name}: linear model about {place} {unit.shown} from straight"
        f"{load_text(loads)}{contacts}"
    )
    _print_poles(model)
    frequencies = model.frequencies(*_range(options, model))
    response = model.response(frequencies)
    _print_measures(model, whole, frequencies, response)
    if options.out is not None:
        output.files[options.out / f"{mechanism.name}-linear.npz"] = model.npz()
        output.files[options.out / f"{mechanism.name}-linear.mat"] = model.mat()
    output.table(f"{mechanism.name}-response.csv", *_table(model, frequencies, response))
    output.figure(
        f"{mechanism.name}-response.png",
        lambda: response_figure(model, frequencies, response, mechanism.title),
    )
    output.write()


def _range(options: argparse.Namespace, model: LinearModel) -> tuple[float, float]:
    """Return the range of frequencies [Hz]."""
    if options.frequencies is None:
        return model.default_range()
    first, colon, last = options.frequencies.partition(":")
    if not colon:
        raise UserMistake(
            f"--frequencies {options.frequencies}: give both ends of the range, such as 1:1000Hz"
        )
    low, high = (quantity(text, "Hz", "--frequencies") for text in (first, last))
    if not 0.0 < low < high:
        raise UserMistake(
            f"--frequencies {options.frequencies}: the first must be positive and below the last"
        )
    return low, high


def _table(
    model: LinearModel, frequencies: Real, response: Complex
) -> tuple[list[str], list[list[float]]]:
    """Return the heads and rows of amplitudes and phases."""
    outputs, inputs = output_units(model.system), input_units(model.system)
    heads, columns = ["frequency [Hz]"], [frequencies]
    for i, output in enumerate(model.outputs):
        for j, given in enumerate(model.inputs):
            ratio = f"{outputs[output]}/({inputs[given]})"
            heads += [
                f"amplitude of {output} by {given} [{ratio}]",
                f"phase of {output} by {given} [deg]",
            ]
            columns += [np.abs(response[:, i, j]), np.degrees(np.angle(response[:, i, j]))]
    return heads, np.column_stack(columns).tolist()


def _print_poles(model: LinearModel) -> None:
    """Print the frequencies and damping ratios of the lowest modes."""
    found, poles = model.space.modes, model.poles
    rows = []
    for k, pole in enumerate(poles[poles.imag >= 0.0][:6]):
        ratio = f"{-pole.real / abs(pole):.3g}" if abs(pole) > 0.0 else "-"
        frequency = float(abs(pole)) / (2 * math.pi) * (1.0 if pole.real <= 0.0 else -1.0)
        rows.append([str(k + 1), mode_text(frequency, found.rounding, 5), ratio])
    print(aligned(["pole", "frequency", "damping ratio"], rows))


def _print_measures(
    model: LinearModel, whole: LinearModel, frequencies: Real, response: Complex
) -> None:
    """Print the static value, the peak and the bandwidth of each response.

    Numbers that are round-off beside the responses of all outputs of the same kind, ``whole``, are
    printed as 0.
    """
    measures = list(model.measures(frequencies, response).items())
    largest = _largest(whole, frequencies)
    rows = []
    for (output, given), one in measures[:PAIRS_SHOWN]:
        kind, factor = _kind(model, output, given)
        static, peak = (
            _shown(x, scale / factor)
            for x, scale in zip((one.static, one.peak), largest[kind], strict=True)
        )
        band = None if static == ZERO else one.bandwidth
        rows.append([
            f"{output} by {given}", static, peak,
            "-" if peak == ZERO else f"{one.peak_frequency:.5g}",
            "-" if band is None else f"{band:.5g}",
        ])  # fmt: skip
    print(aligned(["response", "static", "peak", "at [Hz]", "bandwidth [Hz]"], rows))
    if any(ZERO in row[1:3] for row in rows):
        print(
            f"0: less than {ZERO_RTOL:g} of the largest response of its kind in the mechanism, "
            f"where 1 rad counts as {model.system.length:.3g} m"
        )
    if len(measures) > PAIRS_SHOWN:
        print(f"{PAIRS_SHOWN} of {len(measures)} responses; write all with --out DIR")


def _shown(x: float, scale: float) -> str:
    """Return a number of a response as text; static values may be infinite."""
    return rounded(x, scale, ".5g") if math.isfinite(x) else f"{x:g}"


def _largest(whole: LinearModel, frequencies: Real) -> dict[tuple[str, str], tuple[float, float]]:
    """Return the largest static value and the largest amplitude of each kind of responses."""
    static, peak = np.abs(whole.static()), np.abs(whole.response(frequencies)).max(axis=0)
    found: dict[tuple[str, str], tuple[float, float]] = {}
    for i, output in enumerate(whole.outputs):
        for j, given in enumerate(whole.inputs):
            kind, factor = _kind(whole, output, given)
            one, other = found.get(kind, (0.0, 0.0))
            found[kind] = max(one, factor * static[i, j]), max(other, factor * peak[i, j])
    return found


def _kind(model: LinearModel, output: str, given: str) -> tuple[tuple[str, str], float]:
    """Return the kind of a response, and the factor to the unit of this kind.

    A rotation counts as the displacement at the distance of the length of the mechanism, and a
    moment as a force there.
    """
    length, by = model.system.length, {}
    for name, units in ((output, output_units(model.system)), (given, input_units(model.system))):
        unit = units[name]
        if "rad" in unit:
            by[name] = unit.replace("rad", "m"), length
        elif unit == "N.m":
            by[name] = "N", 1.0 / length
        else:
            by[name] = unit, 1.0
    (seen, factor), (pushed, divisor) = by[output], by[given]
    return (seen, pushed), factor / divisor
