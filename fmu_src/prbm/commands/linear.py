"""``prbm linearize``: linear models and frequency responses."""

import argparse
import math

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
from .systems import assembled, rounded

PAIRS_SHOWN = 24


def linear_model(options: argparse.Namespace) -> None:
    """Print modes and measures of the responses; write the model, its responses and a figure."""
    mechanism, values, system = assembled(options)
    output = Output(options.out)
    loads = given_loads(mechanism, options.load)
    known = {name for name in input_units(system) if name.endswith((".x", ".y"))}
    model = linearize(
        mechanism, values, loads=loads, resting=options.resting or (),
        inputs=options.inputs or sorted(known),
        outputs=options.outputs
        or [f"{mechanism.release.body}.{what}" for what in ("x", "y", "angle")],
    )  # fmt: skip
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
    _print_measures(model, frequencies, response)
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
        ratio = -pole.real / abs(pole) if abs(pole) > 0.0 else math.nan
        frequency = float(abs(pole)) / (2 * math.pi) * (1.0 if pole.real <= 0.0 else -1.0)
        rows.append([str(k + 1), mode_text(frequency, found.rounding, 5), f"{ratio:.3g}"])
    print(aligned(["pole", "frequency", "damping ratio"], rows))


def _print_measures(model: LinearModel, frequencies: Real, response: Complex) -> None:
    """Print the static value, the peak and the bandwidth of each response."""
    measures = list(model.measures(frequencies, response).items())
    rows = [
        [
            f"{output} by {given}", f"{one.static:.5g}", f"{one.peak:.5g}",
            f"{one.peak_frequency:.5g}",
            "-" if one.bandwidth is None else f"{one.bandwidth:.5g}",
        ]
        for (output, given), one in measures[:PAIRS_SHOWN]
    ]  # fmt: skip
    print(aligned(["response", "static", "peak", "at [Hz]", "bandwidth [Hz]"], rows))
    if len(measures) > PAIRS_SHOWN:
        print(f"{PAIRS_SHOWN} of {len(measures)} responses; write all with --out DIR")
