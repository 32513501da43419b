"""Figures of impact maps: grids of numbers, shares of the arriving energy."""

import math
import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from ..analysis.impact_map import ImpactMap, grouped
from ..base.unit_text import length_unit
from ..drawing.style import own_style
from ..mechanics.arrays import Real
from .scene import plain

FUNDAMENTAL, LOST = "#0072b2", "#bbbbbb"
HIGHER = ("#e69f00", "#d55e00", "#cc79a7")
RANGE_MIN = 0.02  # Least range of the colours: smaller differences are not visible.
CHARACTERS = 13  # Characters of a title per inch.
PANEL = (3.4, 2.9)  # Width and height of a map [inch].
BARS_WIDTH = 6.5  # Width of the panels of energies [inch].
CELL = (0.42, 0.16)  # Least width and height of a cell with a number [inch].
X_LABEL_WIDTH, Y_LABEL_HEIGHT = 0.55, 0.2  # Room for a label of an axis [inch].


def edges(x: Real) -> Real:
    """Return the edges of cells around increasing points.

    Examples
    --------
    >>> edges(np.array([0.0, 2.0, 4.0])), edges(np.array([5.0]))
    (array([-1.,  1.,  3.,  5.]), array([4.5, 5.5]))
    """
    if len(x) == 1:
        single: Real = x + np.array([-0.5, 0.5])
        return single
    middle = (x[1:] + x[:-1]) / 2
    return np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])


@own_style()
def heat_map(maps: Sequence[ImpactMap], columns: int = 3, title: str = "") -> Figure:
    """Draw maps side by side on one scale of colours, with a number at every point.

    Parameters
    ----------
    maps : sequence of ImpactMap
        Maps over the same walls and offsets.
    columns : int
        Largest number of maps in a row.
    title : str
        Title of the figure, for instance that of the mechanism.
    """
    rows = math.ceil(len(maps) / columns)
    columns = min(columns, len(maps))
    size = (1.4 + PANEL[0] * columns, 0.7 + PANEL[1] * rows)
    figure = Figure(size, dpi=120, layout="constrained")
    every = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True)).ravel()
    low, high = _range(maps)
    factor, unit = _unit(maps[0])
    for axes, one in zip(every, maps, strict=False):
        x, y = factor * one.walls, factor * one.offsets
        mesh = axes.pcolormesh(
            edges(x), edges(y), one.restitution, vmin=low, vmax=high, cmap="viridis"
        )
        _write_numbers(axes, x, y, one.restitution, (low + high) / 2)
        axes.set_title(one.label, fontsize=10)
        _label(axes.xaxis, x, X_LABEL_WIDTH * float(np.ptp(edges(x))) / PANEL[0])
        _label(axes.yaxis, y, Y_LABEL_HEIGHT * float(np.ptp(edges(y))) / PANEL[1])
        axes.tick_params(length=0)
    for axes in every[len(maps) :]:
        axes.set_visible(False)
    figure.suptitle(textwrap.fill(title, int(CHARACTERS * size[0])), fontsize=10)
    figure.supxlabel(f"position of the wall [{unit}]", fontsize=10)
    figure.supylabel(f"offset of the hit point [{unit}]", fontsize=10)
    bar = figure.colorbar(mesh, ax=list(every), shrink=0.9, pad=0.02)
    bar.set_label("modal restitution [-]")
    return figure


def _range(maps: Sequence[ImpactMap]) -> tuple[float, float]:
    """Return the range of colours; a constant restitution is in the middle of a small range."""
    low = min(float(m.restitution.min()) for m in maps)
    high = max(float(m.restitution.max()) for m in maps)
    missing = max(0.0, RANGE_MIN - (high - low))
    return low - missing / 2, high + missing / 2


def _unit(one: ImpactMap) -> tuple[float, str]:
    """Return the factor and the name of the unit of walls and offsets."""
    return length_unit(float(max(np.abs(one.walls).max(), np.abs(one.offsets).max())) or 1.0)


def _label(axis: Axis, x: Real, distance: float) -> None:
    """Label increasing positions on an axis with short numbers, none nearer than a distance."""
    shown = [float(x[0])]
    for place in map(float, x[1:]):
        if place - shown[-1] >= distance:
            shown.append(place)
    axis.set_ticks(shown, [f"{place:.3g}" for place in shown], fontsize=8)


def _write_numbers(axes: Axes, x: Real, y: Real, restitution: Real, middle: float) -> None:
    """Write the restitution in each cell that is large enough for a number."""
    width = PANEL[0] * np.diff(edges(x)) / np.ptp(edges(x))
    height = PANEL[1] * np.diff(edges(y)) / np.ptp(edges(y))
    for i, j in np.ndindex(*restitution.shape):
        if width[j] >= CELL[0] and height[i] >= CELL[1]:
            c = restitution[i, j]
            axes.text(
                float(x[j]), float(y[i]), f"{c:.3f}", ha="center", va="center", fontsize=8,
                color="black" if c > middle else "white",
            )  # fmt: skip


@own_style()
def energies(one: ImpactMap, title: str = "") -> Figure:
    """Draw the shares of the arriving energy: modes and contact, one panel per offset."""
    count = len(one.offsets)
    figure = Figure((8.0, 0.8 + 1.45 * count), dpi=120, layout="constrained")
    every = np.atleast_1d(figure.subplots(count, 1, sharex=True, sharey=True))
    names = ["mode 1", "mode 2", "mode 3", "higher modes", "contact"]
    colours = [FUNDAMENTAL, *HIGHER, LOST]
    factor, unit = _unit(one)
    every[0].set_title(f"{title}\n{one.label}" if title else one.label, fontsize=10, loc="left")
    for i, axes in enumerate(every[::-1]):
        shares_of = np.array([[*grouped(hit.after), hit.lost] for hit in one.hits[i]])
        _bars(axes, factor * one.walls, shares_of, names, colours)
        axes.annotate(
            f"offset\n{factor * one.offsets[i]:.3g} {unit}", (1.01, 0.5), xycoords="axes fraction",
            va="center", fontsize=9,
        )  # fmt: skip
    every[-1].set_xlabel(f"position of the wall [{unit}]")
    figure.supylabel("share of the arriving energy [-]", fontsize=10)
    handles, labels = every[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, fontsize=9, frameon=False)
    return figure


def _bars(axes: Axes, x: Real, parts: Real, names: Sequence[str], colours: Sequence[str]) -> None:
    width = 0.6 * float(np.diff(x).min()) if len(x) > 1 else 1.0
    bottom = np.zeros(len(x))
    for part, name, colour in zip(parts.T, names, colours, strict=True):
        axes.bar(x, part, width, bottom, color=colour, label=name)
        bottom += part
    axes.set_ylim(0.0, 1.05)
    _label(axes.xaxis, x, X_LABEL_WIDTH * float(np.ptp(edges(x))) / BARS_WIDTH)
    plain(axes, axis="y")
