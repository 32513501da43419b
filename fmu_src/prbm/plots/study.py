"""Figures of studies: outputs over one parameter, maps over two, scatter over more, behaviour."""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ..base.unit_text import prefixed_unit
from ..drawing.style import BODY, IMPACT, PAST, own_style
from ..mechanics.arrays import Real
from .figures import panels
from .impact_map import edges
from .scene import plain

PANEL_HEIGHT, WIDTH = 2.2, 7.0  # Of an output over one parameter [inch].
MAP = (4.6, 3.6)  # Width and height of a map [inch].
MAP_COLUMNS = 2
SCATTER = (2.6, 2.2)  # Width and height of a panel [inch].
VIOLATED = "violated condition"
LETTERS = 11.0  # Of a title in an inch, at most.
WAYS: tuple[dict[str, Any], ...] = (
    {"color": BODY, "marker": ".", "markersize": 2.5, "zorder": 3},
    {
        "color": IMPACT,
        "marker": "o",
        "markersize": 4.5,
        "markerfacecolor": "none",
        "markeredgewidth": 0.4,
    },
)  # Of ways of a map of behaviour, which differ in black and white, too.


class Scaled:
    """A quantity in its display unit.

    Parameters
    ----------
    name, unit : str
        Name and SI unit.
    x : array
        Values in SI; NaN for missing ones.
    """

    def __init__(self, name: str, unit: str, x: Real) -> None:
        known = np.abs(x[np.isfinite(x)])
        largest = float(known.max()) if len(known) else 0.0
        self.factor, shown = prefixed_unit(largest, unit)
        self.label, self.x = f"{name} [{shown or '-'}]", self.factor * x
        self.label_in_two_lines = f"{name}\n[{shown or '-'}]"


@own_style()
def curves(
    title: str,
    varied: tuple[str, Real],
    outputs: Mapping[str, Real],
    units: Mapping[str, str],
    good: Sequence[bool] | Real,
    further: Mapping[str, tuple[Real, Real]],
    optimum: tuple[str, float, float, tuple[float, float]] | None,
) -> Figure:
    """Draw outputs over one parameter.

    Parameters
    ----------
    title : str
        Title of the figure.
    varied : (str, (n,))
        Name and samples of the parameter.
    outputs : mapping
        Values (n,) of each output; failed simulations (NaN) are gaps.
    units : mapping
        SI units of the parameter and the outputs.
    good : (n,)
        Whether each simulation satisfies all constraints; the others are open dots.
    further : mapping
        Parameter and values (m,) of the simulations that refine an output.
    optimum : (str, float, float, (float, float)) or None
        Output, parameter and value of the optimum, and the range in which it is flat.
    """
    name, samples = varied
    x = Scaled(name, units[name], samples)
    figure, every = panels(len(outputs), 1, (WIDTH, 0.6 + PANEL_HEIGHT * len(outputs)))
    violated = ~np.asarray(good, bool)
    for axes, (output, values) in zip(every, outputs.items(), strict=True):
        y = Scaled(output, units[output], values)
        axes.plot(x.x, y.x, "o-", color=PAST, markersize=3.5, linewidth=1.0, label="samples")
        if violated.any():
            axes.plot(x.x[violated], y.x[violated], "o", color=PAST, markersize=3.5,
                      markerfacecolor="white", label=VIOLATED)  # fmt: skip
        if output in further:
            at, found = further[output]
            axes.plot(x.factor * at, y.factor * found, ".", color=BODY, label="refinement")
        if optimum is not None and optimum[0] == output:
            _, best, value, (low, high) = optimum
            axes.axvspan(x.factor * low, x.factor * high, color=IMPACT, alpha=0.15, linewidth=0,
                         label="within 5 %")  # fmt: skip
            axes.plot(x.factor * best, y.factor * value, "v", color=IMPACT, label="optimum")
        if violated.any() or (optimum is not None and optimum[0] == output):
            axes.legend(loc="best", fontsize=9, frameon=False)
        axes.set_xlim(*_with_margin(x.x))
        axes.set_ylabel(y.label_in_two_lines)
    every[0].set_title(fill(title, int(WIDTH * LETTERS)), fontsize=11, loc="left")
    every[-1].set_xlabel(x.label)
    figure.align_ylabels(every)
    return figure


def _with_margin(x: Real) -> tuple[float, float]:
    """Return limits of an axis around all samples, failed ones too."""
    low, high = float(np.min(x)), float(np.max(x))
    return low - 0.05 * (high - low), high + 0.05 * (high - low)


@own_style()
def maps(
    title: str,
    varied: Mapping[str, Real],
    outputs: Mapping[str, Real],
    units: Mapping[str, str],
    good: Sequence[bool] | Real,
    optimum: tuple[str, Sequence[float], float] | None,
) -> Figure:
    """Draw outputs over two parameters as maps of colours.

    Parameters
    ----------
    title : str
        Title of the figure.
    varied : mapping
        Samples of both parameters.
    outputs : mapping
        Values (n,) of each output on the grid, the second parameter varying fastest.
    units : mapping
        SI units of the parameters and the outputs.
    good : (n,)
        Whether each simulation satisfies all constraints; the others have a cross.
    optimum : (str, (float, float), float) or None
        Output, parameters and value of the optimum.
    """
    columns = min(MAP_COLUMNS, len(outputs))
    rows = -(-len(outputs) // columns)
    figure = Figure((MAP[0] * columns, 0.4 + MAP[1] * rows), dpi=120, layout="constrained")
    every: list[Axes] = [*np.atleast_1d(figure.subplots(rows, columns)).flat]
    x, y = (Scaled(name, units[name], samples) for name, samples in varied.items())
    violated = ~np.asarray(good, bool)
    crosses = [at.ravel()[violated] for at in np.meshgrid(x.x, y.x, indexing="ij")]
    for axes, (output, values) in zip(every, outputs.items(), strict=False):
        z = Scaled(output, units[output], values)
        grid = np.ma.masked_invalid(z.x.reshape(len(x.x), len(y.x)).T)
        mesh = axes.pcolormesh(edges(x.x), edges(y.x), grid, cmap="viridis")
        figure.colorbar(mesh, ax=axes, pad=0.02).set_label(z.label)
        if violated.any():
            axes.plot(*crosses, "x", color=PAST, markersize=4.0, label=VIOLATED,
                      path_effects=[withStroke(linewidth=2.5, foreground="white")])  # fmt: skip
        if optimum is not None and optimum[0] == output:
            a, b = optimum[1]
            axes.plot(x.factor * a, y.factor * b, "v", color=IMPACT, label="optimum")
        axes.set_xlabel(x.label)
        axes.set_ylabel(y.label)
        plain(axes)
    for axes in every[len(outputs) :]:
        axes.set_visible(False)
    shown: dict[str, Any] = {}
    for axes in every:
        handles, labels = axes.get_legend_handles_labels()
        shown |= dict(zip(labels, handles, strict=True))
    if shown:
        _legend_below(figure, shown)
    figure.suptitle(fill(title, int(figure.get_figwidth() * LETTERS)), fontsize=11)
    return figure


def _legend_below(figure: Figure, shown: Mapping[str, Any]) -> None:
    """Place a legend of artists by label below all panels."""
    figure.legend(
        [*shown.values()], [*shown], loc="outside lower center", ncols=3, frameon=False, fontsize=9
    )


@own_style()
def scatter(
    title: str,
    parameters: Mapping[str, Real],
    outputs: Mapping[str, Real],
    units: Mapping[str, str],
    good: Sequence[bool] | Real,
    best: tuple[Mapping[str, float], Mapping[str, float]] | None,
) -> Figure:
    """Draw each output over each parameter as dots: filled if all constraints hold, else open.

    Parameters
    ----------
    title : str
        Title of the figure.
    parameters, outputs : mapping
        Values (n,) by name; NaN for failed simulations.
    units : mapping
        SI units of both.
    good : (n,)
        Whether each simulation satisfies all constraints.
    best : (mapping, mapping) or None
        Parameters and outputs of the optimum.
    """
    rows, columns = len(outputs), len(parameters)
    size = (1.0 + SCATTER[0] * columns, 0.9 + SCATTER[1] * rows)
    figure = Figure(size, dpi=120, layout="constrained")
    table = figure.subplots(rows, columns, squeeze=False, sharex="col", sharey="row")
    held = np.broadcast_to(np.asarray(good, bool), len(next(iter(outputs.values()))))
    across = {name: Scaled(name, units[name], samples) for name, samples in parameters.items()}
    for i, (output, values) in enumerate(outputs.items()):
        y = Scaled(output, units[output], values)
        for j, (name, x) in enumerate(across.items()):
            axes = table[i, j]
            if not held.all():
                axes.plot(x.x[~held], y.x[~held], "o", markerfacecolor="none", color=BODY,
                          markersize=3.5, label=VIOLATED)  # fmt: skip
            axes.plot(x.x[held], y.x[held], "o", color=PAST, markersize=3.0, label="simulations")
            if best is not None:
                axes.plot(x.factor * best[0][name], y.factor * best[1][output], "v", color=IMPACT,
                          markersize=7.0, label="optimum")  # fmt: skip
            plain(axes)
            if j == 0:
                axes.set_ylabel(y.label_in_two_lines)
            if i == rows - 1:
                axes.set_xlabel(x.label)
    if best is not None or not held.all():
        handles, labels = table[0, 0].get_legend_handles_labels()
        _legend_below(figure, dict(zip(labels, handles, strict=True)))
    lines = fill(title, int(size[0] * LETTERS))
    figure.suptitle(lines, fontsize=11, x=0.01, ha="left")
    return figure


@own_style()
def behaviour_map(
    title: str,
    varied: tuple[str, str],
    output: tuple[str, str],
    ways: Mapping[str, tuple[Real, Real, Real]],
) -> Figure:
    """Draw a map of behaviour: an output once per driving period, and the impacts per period.

    Parameters
    ----------
    title : str
        Title of the figure.
    varied, output : (str, str)
        Name and SI unit of the varied number and of the output.
    ways : mapping
        For each way of the number, ``"upwards"``, its values (n,), and at each value the output
        (n, m) and the number of impacts (n, m) in m driving periods.
    """
    every = [np.concatenate([np.ravel(way[k]) for way in ways.values()]) for k in (0, 1)]
    x, y = Scaled(*varied, every[0]), Scaled(*output, every[1])
    figure, (upper, lower) = panels(2, 1, (WIDTH, 0.6 + 2.0 * PANEL_HEIGHT))
    for (label, (values, strobe, impacts)), style in zip(ways.items(), WAYS, strict=False):
        at = np.repeat(x.factor * values, strobe.shape[1])
        upper.plot(at, y.factor * strobe.ravel(), **style, linestyle="none", label=label)
        lower.plot(x.factor * values, impacts.mean(axis=1), **style, linewidth=0.8)
    upper.set_title(fill(title, int(WIDTH * LETTERS)), fontsize=11, loc="left")
    upper.set_ylabel(y.label_in_two_lines)
    lower.set_ylabel("impacts\nper period")
    lower.set_xlabel(x.label)
    if len(ways) > 1:
        upper.legend(loc="best", fontsize=9, frameon=False)
    figure.align_ylabels([upper, lower])
    return figure
