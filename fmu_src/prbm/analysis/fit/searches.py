"""Searches of the best parameters from several starts, and the minima in which they end."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from ...base.progress import Progress
from ...data.uncertainty import EvaluationError
from ...mechanics.arrays import Real
from .problem import DEFAULT_RATIO, Problem

SEARCHES = 4  # Searches of several parameters.
SEARCHES_MAX = 1000
DRAWN = 4  # Points that are drawn for each further search, which begins at the best of them.
SEED = 1  # Of the Latin hypercube, so that a fit can be repeated.
FURTHER_STEPS_MAX = 15  # Steps of a further search, which bound its cost.
SAME_RTOL = 0.01  # Distance of points of one minimum, as a share of the ranges of the parameters.
SAME_MISFIT_RTOL = 1e-3  # Difference of sums of squares that are equal.


@dataclass(frozen=True)
class Minimum:
    """A minimum of the sum of squares.

    Parameters
    ----------
    p : (k,)
        The parameters.
    misfit : float
        Sum of ((model - data)/u)^2 [-]; if the uncertainties u are unknown, of (model - data)^2 in
        the squared unit of the data.
    searches : int
        Number of searches that ended there.
    """

    p: Real
    misfit: float
    searches: int = 1


@dataclass(frozen=True)
class Ends:
    """The ends of all searches.

    Parameters
    ----------
    p : (k,)
        The best parameters.
    converged : bool
        Whether the search of them converged.
    evaluations : int
        Number of evaluations of the model by all searches.
    minima : tuple of Minimum
        The ends of all searches that converged.
    """

    p: Real
    converged: bool
    evaluations: int
    minima: tuple[Minimum, ...]


def searched(problem: Problem, start: Real, count: int, progress: Progress) -> Ends:
    """Search from a start, and from the best points of a Latin hypercube within the bounds.

    A further search has fewer steps than the first one; the best one is continued.

    Parameters
    ----------
    problem : Problem
        The problem.
    start : (k,)
        Parameters at the start of the first search.
    count : int
        Number of searches.
    progress : callable
        Called with the completed fraction, from 0 to 1.

    Raises
    ------
    EvaluationError
        If there is no motion or shape at the start, or the number of searches is wrong.
    """
    if not 1 <= count <= SEARCHES_MAX:
        raise EvaluationError(f"searches = {count} must lie between 1 and {SEARCHES_MAX}")
    every = np.arange(len(start))
    p, evaluations, converged = problem.minimised(start, every, lambda done: progress(done / count))
    found = [(p, _misfit(problem, p), converged)]
    starts, drawn = _further_starts(problem, count - 1)
    evaluations += drawn
    for k, further in enumerate(starts, start=1):
        try:
            p, own, converged = problem.minimised(further, every, steps=FURTHER_STEPS_MAX)
        except EvaluationError:  # There is no motion on the way.
            continue
        evaluations += own
        found.append((p, _misfit(problem, p), converged))
        progress((k + 1) / count)
    best = min(range(len(found)), key=lambda k: found[k][1])
    if _equal(problem, found[0][1], found[best][1]):
        best = 0
    else:
        p, own, converged = problem.minimised(found[best][0], every)
        evaluations += own
        found[best] = p, _misfit(problem, p), converged
    minima = tuple(Minimum(p, misfit) for p, misfit, converged in found if converged)
    return Ends(found[best][0], found[best][2], evaluations, minima)


def distinct(problem: Problem, ends: Sequence[Minimum], valleys: bool) -> tuple[Minimum, ...]:
    """Return the minima that differ from each other, the best one first.

    Parameters
    ----------
    problem : Problem
        The problem.
    ends : sequence of Minimum
        The ends of the searches.
    valleys : bool
        Whether the data do not determine all directions; then points of equal misfit are one.
    """
    found: list[Minimum] = []
    span = problem.upper - problem.lower
    for end in sorted(ends, key=lambda one: one.misfit):
        for k, one in enumerate(found):
            near = bool(np.all(np.abs(end.p - one.p) <= SAME_RTOL * span))
            if near or (valleys and _equal(problem, end.misfit, one.misfit)):
                found[k] = replace(one, searches=one.searches + 1)
                break
        else:
            found.append(end)
    return tuple(found)


def _further_starts(problem: Problem, count: int) -> tuple[list[Real], int]:
    """Return the best points of a Latin hypercube, and the number of its points.

    Positive parameters with bounds of different magnitudes have equal numbers of points in each
    power of ten.
    """
    if count < 1:
        return [], 0
    unit = np.asarray(qmc.LatinHypercube(len(problem.names), seed=SEED).random(DRAWN * count))
    columns = [
        low * (high / low) ** u if 0.0 < DEFAULT_RATIO * low <= high else low + (high - low) * u
        for low, high, u in zip(problem.lower, problem.upper, unit.T, strict=True)
    ]
    points = np.column_stack(columns)
    costs = np.array([_cost(problem, point) for point in points])
    order = np.argsort(costs, kind="stable")[:count]
    return [points[k] for k in order if math.isfinite(costs[k])], len(points)


def _equal(problem: Problem, misfit: float, least: float) -> bool:
    """Return whether a misfit exceeds a smaller one by less than the tolerance of the search."""
    met = len(problem.data) * problem.round_off**2
    return misfit - least <= SAME_MISFIT_RTOL * least + met


def _misfit(problem: Problem, p: Real) -> float:
    return float(np.sum(problem.residuals(p) ** 2))


def _cost(problem: Problem, p: Real) -> float:
    """Return the misfit; infinite if there is no motion in a corner of the bounds."""
    try:
        return _misfit(problem, p)
    except EvaluationError:
        return math.inf
