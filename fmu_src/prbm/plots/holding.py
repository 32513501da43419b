"""Figure of a holding force over the displacement, with rest positions and snap-through."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.holding import Curve
from ..base.unit_text import frequency_unit, length_unit
from ..drawing.style import IMPACT, PAST, REST, own_style
from ..mechanics.arrays import Real
from .scene import plain

EVENT_MARKERS = {"limit point": "D", "bifurcation": "s", "displacement limit": "^"}
SIDEWAYS_RTOL = 1e-9  # Sideways motion below this fraction of the displacement is round-off.


@own_style()
def holding_figure(curve: Curve, title: str, turns: bool = False) -> Figure:
    """Draw holding force, sideways motion and fundamental frequency over the displacement.

    With ``turns``, a moment holds the body at rotations.

    Forces under which the shape is unstable, as dead loads, are dashed.  Stable rest positions are
    filled circles, unstable ones are open circles; limit points, bifurcations and displacement
    limits have markers of their own.
    """
    x = np.array([point.displacement for point in curve.points])
    factor, label = amount_axis(x, turns)
    drawn = Figure((8.0, 6.6), dpi=120, layout="constrained")
    every: list[Axes] = list(
        drawn.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": [2, 1, 1]})
    )
    force, across, frequency = every
    _shade_unstable(every, curve, factor)
    _draw_force(force, curve, factor, turns)
    force.set_title(title, fontsize=11, loc="left")
    _draw_across(across, curve, factor)
    _draw_frequency(frequency, curve, factor)
    frequency.set_xlabel(label)
    for axes in every:
        plain(axes)
    drawn.align_ylabels(every)
    return drawn


def amount_axis(amounts: Real, turns: bool) -> tuple[float, str]:
    """Return the factor of displacements [m] or rotations [rad], and the label of their axis."""
    if turns:
        return 180 / math.pi, "rotation [deg]"
    factor, name = length_unit(float(np.abs(amounts).max()) or 1.0)
    return factor, f"displacement [{name}]"


def _draw_force(axes: Axes, curve: Curve, factor: float, turns: bool) -> None:
    """Draw the holding force, the rest positions and the points of snap-through."""
    scale, newton = _force_unit(float(np.abs(curve.forces).max()))
    for path in (*curve.branches, curve):
        x, y = factor * path.displacements, scale * path.forces
        color, width = (PAST, 1.0) if path is curve else (REST, 0.8)
        axes.plot(x, y, "--", color=color, linewidth=width)
        kept = np.where(path.unstable == 0, y, np.nan)
        axes.plot(x, kept, color=color, linewidth=1.8 * width)
    axes.axhline(0.0, color="#808080", linewidth=0.8)
    for stable, label in ((True, "stable rest position"), (False, "unstable rest position")):
        rests = [factor * rest.displacement for rest in curve.rests if rest.stable is stable]
        if rests:
            axes.plot(
                rests, np.zeros(len(rests)), "o", color=REST, markersize=7,
                markerfacecolor=REST if stable else "white", label=label,
            )  # fmt: skip
    for kind, marker in EVENT_MARKERS.items():
        at = [(factor * e.displacement, scale * e.force) for e in curve.events if e.kind == kind]
        if at:
            axes.plot(*zip(*at, strict=True), marker, color=IMPACT, markersize=5, ls="", label=kind)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=9, frameon=False)
    axes.set_ylabel(f"holding moment [{newton} m]" if turns else f"holding force [{newton}]")


def _draw_across(axes: Axes, curve: Curve, factor: float) -> None:
    """Draw the motion across the direction of the release."""
    x = np.array([point.displacement for point in curve.points])
    y = np.array([point.across for point in curve.points])
    y = np.where(np.abs(y) > SIDEWAYS_RTOL * np.abs(x).max(), y, 0.0)
    scale, unit = length_unit(float(np.abs(y).max()) or 1e-4)
    axes.plot(factor * x, scale * y, color=PAST, linewidth=1.2)
    axes.set_ylabel(f"across [{unit}]")


def _draw_frequency(axes: Axes, curve: Curve, factor: float) -> None:
    """Draw the fundamental frequency where the free mechanism is stable."""
    x = np.array([point.displacement for point in curve.points])
    hertz = np.array([point.frequency for point in curve.points])
    scale, unit = frequency_unit(float(hertz.max()))
    shown = np.where(hertz > 0.0, scale * hertz, np.nan)
    axes.plot(factor * x, shown, color=PAST, linewidth=1.2)
    axes.set_ylim(0.0, 1.15 * scale * max(float(hertz.max()), 0.0) or 1.0)
    axes.set_ylabel(f"fundamental [{unit}]")


def _shade_unstable(every: list[Axes], curve: Curve, factor: float) -> None:
    """Shade the displacements at which the released mechanism is unstable."""
    x, unstable = factor * curve.displacements, curve.unstable > 0
    if (np.diff(x) < 0.0).any():
        return  # There are several shapes at a displacement.
    between = np.concatenate([[False], unstable[1:] | unstable[:-1], [False]])
    ends = np.flatnonzero(np.diff(between))
    for label, axes in zip(("unstable when released", None, None), every, strict=True):
        for start, end in zip(x[ends[::2]], x[ends[1::2]], strict=True):
            axes.axvspan(start, end, color=IMPACT, alpha=0.08, linewidth=0, label=label)
            label = None  # One entry of the legend.


def _force_unit(largest: float) -> tuple[float, str]:
    """Return the factor and the name of a unit of force suited to a magnitude.

    Examples
    --------
    >>> _force_unit(3.0), _force_unit(0.2)
    ((1.0, 'N'), (1000.0, 'mN'))
    """
    for factor, name in ((1.0, "N"), (1e3, "mN")):
        if largest * factor >= 1.0:
            return factor, name
    return 1e6, "µN"
