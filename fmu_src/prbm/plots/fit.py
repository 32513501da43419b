"""Figures of fits: a response, a force over deflection, a valley."""

import numpy as np
from matplotlib.figure import Figure

from ..analysis.fit import Fit, ForceDeflection, Response, Valley
from ..base.unit_text import length_unit, time_unit
from ..data.uncertainty import EvaluationError
from ..drawing.style import IMPACT, LINK, PAST, own_style
from .figures import WIDTH, panels

HEIGHT = 3.6  # Inches.
TITLE_LENGTH = 80  # Characters in a line of a title.


def _title(found: Fit) -> str:
    """Return the fitted parameters in lines of at most :data:`TITLE_LENGTH` characters."""
    lines: list[str] = []
    for word in (f"{name} = {x}" for name, x in found.estimates.items()):
        if lines and len(lines[-1]) + len(word) < TITLE_LENGTH:
            lines[-1] += f", {word}"
        else:
            lines.append(word)
    return "\n".join(lines)


@own_style()
def response_figure(found: Fit) -> Figure:
    """Plot a response with the fitted model, and the residuals below.

    Raises
    ------
    EvaluationError
        If the fit has no response.
    """
    start = 0
    for target in found.problem.targets:
        if isinstance(target, Response):
            break
        start += len(target.data)
    else:
        raise EvaluationError("the fit has no response: there is nothing to plot over time")
    model = found.model[start : start + len(target.data)]
    figure, (upper, lower) = panels(2, 1, (WIDTH, 1.5 * HEIGHT))
    series = target.series
    by_time, time_name = time_unit(float(np.ptp(series.time)))
    factor, unit = length_unit(float(np.abs(series.values).max()) or 1.0)
    if series.unit != "m":
        factor, unit = 1.0, series.unit
    t = by_time * series.time
    upper.plot(t, factor * series.values, ".", color=PAST, markersize=3, label="measured")
    upper.plot(t, factor * model, color=IMPACT, linewidth=1.0, label="model")
    upper.set_ylabel(f"{target.output} [{unit}]")
    upper.set_title(_title(found), fontsize=10, loc="left")
    upper.legend(fontsize=9, frameon=False)
    lower.plot(t, factor * (model - series.values), ".", color=LINK, markersize=3)
    lower.set_ylabel(f"model - measured [{unit}]")
    lower.set_xlabel(f"time [{time_name}]")
    return figure


@own_style()
def force_figure(found: Fit) -> Figure:
    """Plot a measured force over the deflection with the fitted model.

    Raises
    ------
    EvaluationError
        If the fit has no forces over deflections.
    """
    start = 0
    for target in found.problem.targets:
        if isinstance(target, ForceDeflection):
            break
        start += len(target.data)
    else:
        raise EvaluationError("the fit has no forces over deflections: there is nothing to plot")
    model = found.model[start : start + len(target.data)]
    figure, (upper, lower) = panels(2, 1, (WIDTH, 1.5 * HEIGHT))
    factor, unit = length_unit(float(np.abs(target.displacement).max()) or 1.0)
    order = np.argsort(target.displacement)
    x = factor * target.displacement[order]
    upper.plot(x, 1e3 * target.force[order], ".", color=PAST, markersize=4, label="measured")
    upper.plot(x, 1e3 * model[order], color=IMPACT, linewidth=1.2, label="model")
    upper.set_ylabel("holding force [mN]")
    upper.set_title(_title(found), fontsize=10, loc="left")
    upper.legend(fontsize=9, frameon=False)
    lower.plot(x, 1e3 * (model - target.force)[order], ".", color=LINK, markersize=4)
    lower.set_ylabel("model - measured [mN]")
    lower.set_xlabel(f"displacement [{unit}]")
    return figure


@own_style()
def valley_figure(valley: Valley) -> Figure:
    """Plot the other parameters and the misfit along a valley."""
    figure, (left, right) = panels(1, 2, (WIDTH, HEIGHT))
    i = valley.names.index(valley.along)
    x = valley.points[:, i]
    for j, name in enumerate(valley.names):
        if j != i:
            scale = 1.0 if len(valley.names) == 2 else valley.best[j] or 1.0
            left.plot(x, valley.points[:, j] / scale, ".-", linewidth=1.2, label=name)
    others = [name for name in valley.names if name != valley.along]
    left.set_ylabel(others[0] if len(others) == 1 else "other parameters over their best values")
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
