"""Figures of shocks: the motion under one shock, and the effect over the peak of the pulse."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.shock import Shock, displacement, displacement_unit
from ..base.unit_text import GRAVITY, time_unit
from ..drawing.style import IMPACT, PAST, REST, WALL, own_style
from ..mechanics.arrays import Real
from ..mechanics.system import unit
from ..mechanism.parts import GROUND
from ..runs.released import released_label
from .figures import PANEL_HEIGHT, PARALLEL_ATOL, WALL_MARGIN, WIDTH, stop_forces
from .scene import plain


@own_style()
def shock_figure(found: Shock, axis: str) -> Figure:
    """Return a figure of a shock along an axis; lines mark the impacts.

    The panels show the acceleration of the base, the displacement with the walls, the stress, and
    the forces of the stops.  Times at which a stop holds are shaded.
    """
    result, mechanism = found.result, found.result.mechanism
    columns = result.columns
    seconds = np.asarray(columns["time"], float)
    factor, shown = time_unit(float(seconds[-1]))
    time = factor * seconds
    rows = 3 + bool(mechanism.stops)
    figure = Figure((WIDTH, 0.7 + rows * PANEL_HEIGHT), dpi=120, layout="constrained")
    panels = list(figure.subplots(rows, 1, sharex=True))
    panels[0].plot(time, columns[f"base.acceleration.{axis}"] / GRAVITY, color=PAST)
    panels[0].set_ylabel("base [g]")
    _draw_displacement(panels[1], found, time)
    for one in found.loadings:
        panels[2].plot(time, 1e-6 * columns[f"{one.flexure}.stress"], label=one.flexure)
    panels[2].set_ylabel("stress [MPa]")
    panels[2].legend(fontsize=9, frameon=False)
    if mechanism.stops:
        hits = [(x.stop, factor * x.time, x.latched.peak_force) for x in result.impacts]
        stop_forces(panels[3], time, columns, mechanism.stops, hits)
    panels[-1].set_xlabel(f"time [{shown}]")
    panels[-1].set_xlim(0.0, float(time[-1]))
    for axes in panels:
        for impact in result.impacts:
            axes.axvline(factor * impact.time, color=IMPACT, linewidth=0.5, alpha=0.4)
        for stop in mechanism.stops:
            axes.fill_between(
                time, 0.0, 1.0, where=columns[f"{stop.name}.contact"] != 0,
                transform=axes.get_xaxis_transform(), color=REST, alpha=0.13, linewidth=0,
            )  # fmt: skip
        plain(axes)
    panels[0].set_title(mechanism.title, fontsize=11, loc="left")
    figure.align_ylabels(panels)
    return figure


def _draw_displacement(axes: Axes, found: Shock, time: Real) -> None:
    """Draw the displacement from the equilibrium, and the walls that limit it."""
    factor, shown = displacement_unit(found.result.mechanism)
    moved, release = factor * displacement(found.result), found.result.mechanism.release
    axes.plot(time, moved, color=PAST)
    axes.set_ylabel(f"{released_label(release)} [{shown}]")
    if release.turns:
        return
    reach = (1.0 + WALL_MARGIN) * float(np.abs(moved).max())
    for stop in found.result.mechanism.stops:
        turn = unit(stop.direction) / unit(release.direction)
        if stop.body != release.body or stop.on != GROUND or abs(turn.imag) > PARALLEL_ATOL:
            continue
        wall = moved + turn.real * factor * found.result.columns[f"{stop.name}.gap"]
        if np.abs(wall).min() <= reach:
            axes.plot(time, wall, color=WALL, linewidth=1.6, label=stop.name)


@own_style()
def fragility_figure(peaks: Sequence[float], found: Sequence[Shock], level: float) -> Figure:
    """Return a figure of shocks over the peaks of their pulses.

    The panels show the largest displacement, the number of impacts, and the stress with the yield
    strength of the flexure that yields first.  A line marks the level at which it yields.

    Parameters
    ----------
    peaks : sequence of float
        Peaks [m/s^2], in ascending order.
    found : sequence of Shock
        A shock for each peak.
    level : float
        Least peak at which a flexure yields [m/s^2]; NaN if there is none.
    """
    factor, shown = displacement_unit(found[0].result.mechanism)
    figure = Figure((WIDTH, 0.7 + 3 * PANEL_HEIGHT), dpi=120, layout="constrained")
    panels = list(figure.subplots(3, 1, sharex=True))
    x = np.array(peaks) / GRAVITY
    panels[0].plot(x, [factor * abs(one.displacement) for one in found], "o-", color=PAST)
    panels[0].set_ylabel(f"{released_label(found[0].result.mechanism.release)} [{shown}]")
    hits = [sum(hits.count for hits in one.hits) for one in found]
    panels[1].plot(x, hits, "o-", color=PAST)
    panels[1].set_ylabel("impacts")
    panels[1].yaxis.get_major_locator().set_params(integer=True)
    panels[2].plot(x, [1e-6 * one.peak_stress for one in found], "o-", color=PAST)
    panels[2].set_ylabel("stress [MPa]")
    strengths = {x.safety * x.peak for one in found for x in one.loadings if x.safety is not None}
    if strengths:
        panels[2].axhline(1e-6 * min(strengths), color=IMPACT, linestyle="--", label="yield")
        panels[2].legend(fontsize=9, frameon=False)
    panels[-1].set_xlabel("peak [g]")
    for axes in panels:
        if np.isfinite(level):
            axes.axvline(level / GRAVITY, color=IMPACT, linewidth=1.0)
        axes.set_xscale("log")
        plain(axes)
    panels[0].set_title(found[0].result.mechanism.title, fontsize=11, loc="left")
    figure.align_ylabels(panels)
    return figure
