"""The figure of a shock: acceleration of the base, displacement, stress."""

import numpy as np
from matplotlib.figure import Figure

from ..analysis.shock import GRAVITY, Shock, displacement
from ..base.unit_text import length_unit, time_unit
from ..drawing.style import IMPACT, own_style
from ..mechanics.assembly import assemble
from .figures import PANEL_HEIGHT, WIDTH
from .scene import plain


@own_style()
def shock_figure(found: Shock, axis: str) -> Figure:
    """Return a figure of a shock along an axis; lines mark the impacts."""
    result, mechanism = found.result, found.result.mechanism
    columns = result.columns
    seconds = np.asarray(columns["time"], float)
    factor, unit = time_unit(float(seconds[-1]))
    size = assemble(mechanism, mechanism.values()).length
    scale, shown = (180 / np.pi, "deg") if mechanism.release.turns else length_unit(size)
    figure = Figure((WIDTH, 0.7 + 3 * PANEL_HEIGHT), dpi=120, layout="constrained")
    base, moved, stress = figure.subplots(3, 1, sharex=True)
    base.plot(factor * seconds, columns[f"base.acceleration.{axis}"] / GRAVITY)
    base.set_ylabel("base [g]")
    moved.plot(factor * seconds, scale * displacement(result))
    moved.set_ylabel(f"{mechanism.release.body} [{shown}]")
    for one in found.loadings:
        stress.plot(factor * seconds, 1e-6 * columns[f"{one.flexure}.stress"], label=one.flexure)
    stress.set_ylabel("stress [MPa]")
    stress.legend(fontsize=8)
    stress.set_xlabel(f"time [{unit}]")
    stress.set_xlim(0.0, factor * float(seconds[-1]))
    for axes in (base, moved, stress):
        for impact in result.impacts:
            axes.axvline(factor * impact.time, color=IMPACT, linewidth=0.5, alpha=0.4)
        plain(axes)
    base.set_title(mechanism.title, fontsize=11, loc="left")
    figure.align_ylabels([base, moved, stress])
    return figure
