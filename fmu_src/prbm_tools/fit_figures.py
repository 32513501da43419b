"""Figures of evaluated measurements: a bent beam, a fitted response, a valley."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from .figures import WIDTH
from .fit import Fit, Response, Valley
from .measurement import YoungsModulus
from .scene import GRID, IMPACT, LINK, PAST, length_unit, own_style, time_unit
from .uncertainty import EvaluationError

HEIGHT = 3.6  # inches


def _figure(rows: int, columns: int, height: float = HEIGHT) -> tuple[Figure, list[Axes]]:
    figure = Figure((WIDTH, height), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    every = [*np.atleast_1d(figure.subplots(rows, columns)).flat]
    for axes in every:
        axes.grid(color=GRID, linewidth=0.7)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
    return figure, every


@own_style()
def bending_figure(result: YoungsModulus) -> Figure:
    """Plot the averaged force over the deflection with the line that was fitted."""
    figure, (axes,) = _figure(1, 1)
    x, y = result.points
    factor, unit = length_unit(float(np.abs(x).max()) or 1.0)
    ends = np.array(result.fit_range)
    axes.plot(factor * x, 1e3 * y, ".", color=PAST, markersize=3, label=result.beam.name)
    axes.plot(
        factor * ends, [1e3 * result.fit.at(end) for end in ends], color=IMPACT, linewidth=1.6,
        label=f"{1e-3 * result.stiffness.value:.4g} N/mm",
    )  # fmt: skip
    axes.set_xlabel(f"deflection [{unit}]")
    axes.set_ylabel("force [mN]")
    axes.set_title(f"E = {result.modulus}", fontsize=11, loc="left")
    axes.legend(fontsize=9, frameon=False)
    return figure


@own_style()
def response_figure(found: Fit) -> Figure:
    """Plot a response with the model that was fitted, and what is left, below.

    Raises
    ------
    EvaluationError
        If the fit was not to a response.
    """
    start = 0
    for target in found.problem.targets:
        if isinstance(target, Response):
            break
        start += len(target.data)
    else:
        raise EvaluationError("the fit was not to a response: there is nothing to plot over time")
    model = found.model[start : start + len(target.data)]
    figure, (upper, lower) = _figure(2, 1, 1.5 * HEIGHT)
    series = target.series
    by_time, time_name = time_unit(float(np.ptp(series.time)))
    factor, unit = length_unit(float(np.abs(series.values).max()) or 1.0)
    if series.unit != "m":
        factor, unit = 1.0, series.unit
    t = by_time * series.time
    upper.plot(t, factor * series.values, ".", color=PAST, markersize=3, label="measured")
    upper.plot(t, factor * model, color=IMPACT, linewidth=1.0, label="model")
    upper.set_ylabel(f"{target.output} [{unit}]")
    upper.set_title(
        ", ".join(f"{name} = {x}" for name, x in found.estimates.items()), fontsize=10, loc="left"
    )
    upper.legend(fontsize=9, frameon=False)
    lower.plot(t, factor * (model - series.values), ".", color=LINK, markersize=3)
    lower.set_ylabel(f"model - measured [{unit}]")
    lower.set_xlabel(f"time [{time_name}]")
    return figure


@own_style()
def valley_figure(valley: Valley) -> Figure:
    """Plot the other parameters along a valley, and the misfit that is left there."""
    figure, (left, right) = _figure(1, 2)
    i = valley.names.index(valley.along)
    x = valley.points[:, i]
    for j, name in enumerate(valley.names):
        if j != i:
            scale = 1.0 if len(valley.names) == 2 else valley.best[j] or 1.0
            left.plot(x, valley.points[:, j] / scale, ".-", linewidth=1.2, label=name)
    others = [name for name in valley.names if name != valley.along]
    left.set_ylabel(others[0] if len(others) == 1 else "others over their best")
    if len(others) > 1:
        left.legend(fontsize=9, frameon=False)
    right.plot(x, valley.misfit, ".-", color=IMPACT, linewidth=1.2)
    right.set_ylabel("misfit, sum of squares [-]")
    right.set_ylim(bottom=0.0, top=max(4.0, 1.05 * float(valley.misfit.max())))
    right.axhline(float(valley.misfit.min()) + 1.0, color=PAST, linewidth=0.8, linestyle="--")
    for axes in (left, right):
        axes.set_xlabel(valley.along)
        axes.axvline(valley.best[i], color=PAST, linewidth=0.8)
    return figure
