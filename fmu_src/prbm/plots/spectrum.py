"""Figure of the spectra after an impact, with the modes at the impact shape."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..analysis.spectrum import SIGNALS, AfterImpact, numbered, spectrum
from ..base.unit_text import frequency_unit, time_unit
from ..drawing.style import IMPACT, PAST, own_style
from .scene import plain

LABEL_GAP = 0.035  # Least distance between labels of modes, as a share of the frequency axis.


@own_style()
def spectrum_figure(
    response: AfterImpact,
    signals: Sequence[str] = ("along", "across", "turning"),
    highest: float | None = None,
) -> Figure:
    """Draw the spectra of signals, with the modes at the impact shape marked.

    Parameters
    ----------
    response : AfterImpact
        Recorded motion after an impact.
    signals : sequence of {"along", "across", "turning"}
        One panel per signal.
    highest : float or None
        Upper end of the frequency axis [Hz]; None: half of the sampling rate.
    """
    drawn = Figure((8.0, 0.9 + 2.0 * len(signals)), dpi=120, layout="constrained")
    every = np.atleast_1d(drawn.subplots(len(signals), 1, sharex=True))
    shown = numbered(response.modes)
    sampled = 0.5 * (len(response.time) - 1) / float(np.ptp(response.time))
    factor, unit = frequency_unit(highest or sampled)
    for axes, name in zip(every, signals, strict=True):
        frequency, amplitude = spectrum(response.time, getattr(response, name))
        end = highest or float(frequency[-1])
        inside = (frequency <= end) & (frequency > 0.0)
        axes.semilogy(factor * frequency[inside], amplitude[inside], color=PAST, linewidth=1.1)
        for _, f in shown:
            if f < end:
                axes.axvline(factor * f, color=IMPACT, linewidth=1.0, linestyle="--")
        top = float(amplitude[inside].max())
        axes.set_ylim(max(1e-6 * top, 0.3 * float(amplitude[inside].min())), 3.0 * top)
        axes.set_xlim(0.0, factor * end)
        axes.set_ylabel(SIGNALS[name].replace(" [", "\n["), fontsize=9)
        plain(axes)
    last = -np.inf
    for i, f in shown:
        if f < end and f - last > LABEL_GAP * end:
            every[0].annotate(
                f"{i}", (factor * f, 1.0), (0, 3), xycoords=("data", "axes fraction"),
                textcoords="offset points", ha="center", color=IMPACT, fontsize=9,
            )  # fmt: skip
            last = f
    by_time, time_name = time_unit(response.impact.time)
    t = f"{by_time * response.impact.time:.4g} {time_name}"
    every[0].set_title(
        f"{response.title}\nafter the impact at {t}; dashed: modes at the impact shape",
        fontsize=10, loc="left", pad=16,
    )  # fmt: skip
    every[-1].set_xlabel(f"frequency [{unit}]")
    drawn.align_ylabels(list(every))
    return drawn
