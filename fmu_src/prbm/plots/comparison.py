"""Figure of a mechanism beside finite elements and measurements."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.comparison import Comparison, Row
from ..drawing.style import IMPACT, LINK, REST, own_style
from .scene import plain


@own_style()
def comparison_figure(comparison: Comparison) -> Figure:
    """Draw model and measurement relative to the finite elements [%]; ratios in 0.01."""
    rows = [r for r in comparison.rows if r.elements and math.isfinite(r.elements)][::-1]
    figure = Figure((7.0, 1.1 + 0.36 * len(rows)), dpi=110, layout="constrained")
    axes = figure.subplots()
    places = np.arange(len(rows))
    axes.axvline(0.0, color=LINK, linewidth=1.2, label="finite elements")
    axes.plot(
        [100 * r.error / r.scale for r in rows], places, "o", color=IMPACT, markersize=6,
        label="model",
    )  # fmt: skip
    _draw_measured(axes, rows)
    axes.set_yticks(places, [r.name if r.unit else f"{r.name} [0.01]" for r in rows], fontsize=9)
    axes.set_ylim(-0.7, len(rows) - 0.3)
    ratios = "" if all(r.unit for r in rows) else ", or 0.01"
    axes.set_xlabel(f"difference from finite elements [%{ratios}]")
    axes.set_title(comparison.title, fontsize=11, loc="left")
    plain(axes)
    axes.legend(fontsize=9, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def _draw_measured(axes: Axes, rows: list[Row]) -> None:
    """Draw the measured values with their standard uncertainties."""
    known = [(y, r, r.measured) for y, r in enumerate(rows) if r.measured is not None]
    if not known:
        return
    off = [100 * (m.value - r.elements) / r.scale for _, r, m in known]
    bars = [100 * m.uncertainty / r.scale for _, r, m in known]
    axes.errorbar(
        off, [y for y, *_ in known], xerr=bars, fmt="s", color=REST, capsize=3, markersize=4,
        label="measured",
    )  # fmt: skip
