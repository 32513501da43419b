"""Valleys of a fit: the best fit for each of several values of one parameter."""

from dataclasses import dataclass

import numpy as np

from ...base.progress import Progress
from ...data.uncertainty import EvaluationError
from ...mechanics.arrays import Real
from .solution import Fit


@dataclass(frozen=True)
class Valley:
    """The best fit for each of several values of one parameter.

    Parameters
    ----------
    names : tuple of str
        Names of the parameters.
    along : str
        Name of the parameter with given values.
    points : (n, k)
        Parameters of the best fits, one row per given value.
    misfit : (n,)
        Sum of ((model - data)/u)^2 [-]; if the uncertainties u are unknown, of (model - data)^2 in
        the squared unit of the data.
    best : (k,)
        Parameters of the fit with no value given.
    """

    names: tuple[str, ...]
    along: str
    points: Real
    misfit: Real
    best: Real

    def __str__(self) -> str:
        widths = [max(22, 2 + len(name)) for name in self.names]
        head = "".join(f"{name:>{w}}" for name, w in zip(self.names, widths, strict=True))
        head += f"{'misfit':>14}"
        rows = [
            "".join(f"{x:>{w}.6g}" for x, w in zip(point, widths, strict=True)) + f"{misfit:>14.4g}"
            for point, misfit in zip(self.points, self.misfit, strict=True)
        ]
        return "\n".join([head, *rows])


def valley(
    found: Fit,
    along: str | None = None,
    span: tuple[float, float] | None = None,
    points: int = 11,
    progress: Progress | None = None,
) -> Valley:
    """Return the best fits for several values of one parameter; the others are fitted again.

    Parameters
    ----------
    found : Fit
        A fit of two parameters or more.
    along : str or None
        Name of the parameter.  By default it is the one with the largest share in the direction
        that the data determine worst.
    span : pair of float or None
        Range of its values, within the bounds (default: half to twice the best value).
    points : int
        Number of values.
    progress : callable or None
        Called with the completed fraction of the values, from 0 to 1.

    Raises
    ------
    EvaluationError
        If there is only one parameter, ``along`` was not fitted, or a fit does not converge.
    """
    problem = found.problem
    if len(problem.names) < 2:
        raise EvaluationError(
            f"a valley of {len(problem.names)} parameter: fit two parameters or more"
        )
    if along is None:
        along = problem.names[int(np.argmax(np.abs(found.directions[-1])))]
    if along not in problem.names:
        raise EvaluationError(
            f"{along} was not fitted; the fitted parameters are {', '.join(problem.names)}"
        )
    i = problem.names.index(along)
    best = float(found.p[i])
    low, high = span or (min(best / 2, best * 2), max(best / 2, best * 2))
    low, high = max(low, float(problem.lower[i])), min(high, float(problem.upper[i]))
    if not low < high or points < 2:
        raise EvaluationError(
            f"span = {span}, points = {points}: give a span (low, high) with low < high within the "
            "bounds, and at least 2 points"
        )
    values = np.unique(np.append(np.linspace(low, high, points), np.clip(best, low, high)))
    centre = int(np.argmin(np.abs(values - best)))
    others = np.delete(np.arange(len(found.p)), i)
    rows: dict[int, Real] = {}
    for order in (range(centre, len(values)), range(centre - 1, -1, -1)):
        near = found.p
        for j in order:
            near, evaluations, converged = problem.minimised(_replaced(near, i, values[j]), others)
            if not converged:
                raise EvaluationError(
                    f"the fit with {along} = {values[j]:g} did not converge in {evaluations} model "
                    "evaluations: narrow the span, or the bounds of the other parameters"
                )
            rows[j] = near
            if progress is not None:
                progress(len(rows) / len(values))
    ordered = np.array([rows[j] for j in sorted(rows)])
    misfit = np.array([float(np.sum(problem.residuals(p) ** 2)) for p in ordered])
    return Valley(problem.names, along, ordered, misfit, found.p)


def _replaced(p: Real, i: int, value: float) -> Real:
    changed = p.copy()
    changed[i] = value
    return changed
