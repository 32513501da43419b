"""Figure of frequency responses."""

import numpy as np
from matplotlib.figure import Figure

from ..analysis.linear_model import LinearModel
from ..drawing.style import own_style
from ..mechanics.arrays import Complex, Real
from ..mechanics.linear import input_units, output_units
from .scene import plain


@own_style()
def response_figure(model: LinearModel, frequencies: Real, response: Complex, title: str) -> Figure:
    """Draw amplitude and phase over the frequency, a column for each output.

    Parameters
    ----------
    model : LinearModel
        The model.
    frequencies, response : (f,), (f, p, m) complex
        The response at ascending frequencies [Hz].
    title : str
        Title.
    """
    outputs, inputs = output_units(model.system), input_units(model.system)
    count = len(model.outputs)
    drawn = Figure((1.0 + 5.5 * count, 5.6), dpi=120, layout="constrained")
    axes = drawn.subplots(2, count, sharex=True, squeeze=False, height_ratios=(2, 1))
    for i, output in enumerate(model.outputs):
        for j, given in enumerate(model.inputs):
            one = response[:, i, j]
            amplitude = np.where(np.abs(one) > 0.0, np.abs(one), np.nan)
            label = f"by {given} [{inputs[given].replace('.', ' ')}]"
            axes[0, i].loglog(frequencies, amplitude, linewidth=1.4, label=label)
            axes[1, i].semilogx(frequencies, _phase(one), linewidth=1.4)
        axes[0, i].set_ylabel(f"{output} [{outputs[output].replace('.', ' ')}] by unit input")
        axes[0, i].legend(fontsize=9, frameon=False)
        axes[1, i].set_ylabel("phase [deg]")
        axes[1, i].set_yticks([-180, -90, 0, 90, 180])
        axes[1, i].set_xlabel("frequency [Hz]")
        for row in (0, 1):
            plain(axes[row, i])
    axes[0, 0].set_title(title, fontsize=11, loc="left")
    return drawn


def _phase(response: Complex) -> Real:
    """Return the phase [deg]; NaN where it jumps by a turn, which interrupts the line."""
    phase: Real = np.degrees(np.angle(response))
    phase[1:][np.abs(np.diff(phase)) > 180.0] = np.nan
    return phase
