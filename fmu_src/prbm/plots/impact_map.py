"""Figures of impact maps: grids of numbers, surfaces, shares of the arriving energy."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.impact_map import ImpactMap, grouped
from ..drawing.style import own_style
from ..mechanics.arrays import Real
from .scene import plain

FUNDAMENTAL, LOST = "#0072b2", "#bbbbbb"
HIGHER = ("#e69f00", "#d55e00", "#cc79a7")
SURFACES = ("#1f4e79", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#000000")


def _edges(x: Real) -> Real:
    """Return the edges of cells around increasing points.

    Examples
    --------
    >>> _edges(np.array([0.0, 2.0, 4.0])), _edges(np.array([5.0]))
    (array([-1.,  1.,  3.,  5.]), array([4.5, 5.5]))
    """
    if len(x) == 1:
        single: Real = x + np.array([-0.5, 0.5])
        return single
    middle = (x[1:] + x[:-1]) / 2
    return np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])


@own_style()
def heat_map(maps: Sequence[ImpactMap], columns: int = 3) -> Figure:
    """Draw maps side by side on one scale of colours, with a number at every point."""
    rows = math.ceil(len(maps) / columns)
    columns = min(columns, len(maps))
    figure = Figure((0.6 + 3.4 * columns, 0.5 + 2.9 * rows), dpi=120, layout="constrained")
    every = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True)).ravel()
    low = min(float(m.restitution.min()) for m in maps)
    high = max(float(m.restitution.max()) for m in maps)
    for axes, one in zip(every, maps, strict=False):
        x, y = 1e3 * one.walls, 1e3 * one.offsets
        mesh = axes.pcolormesh(
            _edges(x), _edges(y), one.restitution, vmin=low, vmax=high, cmap="viridis"
        )
        middle = (low + high) / 2
        for i, j in np.ndindex(*one.restitution.shape):
            c = one.restitution[i, j]
            axes.text(
                x[j], y[i], f"{c:.3f}", ha="center", va="center", fontsize=8,
                color="black" if c > middle else "white",
            )  # fmt: skip
        axes.set_title(one.label, fontsize=10)
        axes.set_xticks(x)
        axes.set_yticks(y)
        axes.tick_params(length=0)
    for axes in every[len(maps) :]:
        axes.set_visible(False)
    figure.supxlabel("position of the wall [mm]", fontsize=10)
    figure.supylabel("offset of the hit [mm]", fontsize=10)
    bar = figure.colorbar(mesh, ax=list(every), shrink=0.9, pad=0.02)
    bar.set_label("modal restitution [-]")
    return figure


@own_style()
def surface(maps: Sequence[ImpactMap]) -> Figure:
    """Draw maps as surfaces over walls and offsets: the first filled, the others as wires."""
    figure = Figure((7.0, 5.4), dpi=120)
    axes: Any = figure.add_axes((0.0, 0.02, 0.9, 0.94), projection="3d")
    for k, one in enumerate(maps):
        X, Y = np.meshgrid(1e3 * one.walls, 1e3 * one.offsets)
        colour = SURFACES[k % len(SURFACES)]
        if k == 0:
            axes.plot_surface(
                X, Y, one.restitution, color=colour, alpha=0.35, edgecolor=colour, linewidth=0.8
            )
            axes.plot([], [], [], color=colour, linewidth=6, alpha=0.35, label=one.label)
        else:
            axes.plot_wireframe(X, Y, one.restitution, color=colour, linewidth=1.2)
            axes.plot([], [], [], color=colour, linewidth=1.2, label=one.label)
    axes.set_xticks(1e3 * maps[0].walls)
    axes.set_yticks(1e3 * maps[0].offsets)
    axes.set_xlabel("position of the wall [mm]", labelpad=8)
    axes.set_ylabel("offset of the hit [mm]", labelpad=8)
    axes.set_zlabel("modal restitution [-]", labelpad=8)
    axes.view_init(elev=24, azim=-58)
    axes.legend(loc="upper left", fontsize=9, frameon=False)
    return figure


@own_style()
def energies(one: ImpactMap) -> Figure:
    """Draw the shares of the arriving energy: modes and contact, one panel per offset."""
    count = len(one.offsets)
    figure = Figure((8.0, 0.8 + 1.45 * count), dpi=120, layout="constrained")
    every = np.atleast_1d(figure.subplots(count, 1, sharex=True, sharey=True))
    names = ["mode 1", "mode 2", "mode 3", "higher modes", "contact"]
    colours = [FUNDAMENTAL, *HIGHER, LOST]
    for i, axes in enumerate(every[::-1]):
        shares_of = np.array([[*grouped(hit.after), hit.lost] for hit in one.hits[i]])
        _bars(axes, 1e3 * one.walls, shares_of, names, colours)
        axes.annotate(
            f"offset\n{1e3 * one.offsets[i]:g} mm", (1.01, 0.5), xycoords="axes fraction",
            va="center", fontsize=9,
        )  # fmt: skip
    every[-1].set_xlabel("position of the wall [mm]")
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
    axes.set_xticks(x)
    plain(axes, axis="y")
