"""Designs of studies: which parameters the simulations have, and what many of them say together.

A grid, a list of rows, or points drawn from distributions: pseudo-random, a Latin hypercube or the
sequence of Sobol.  Drawn points give the share of good runs with its confidence interval; those of
Saltelli's design give first-order and total sensitivity indices.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest, norm, qmc

from ..base.counts import check_count
from ..base.errors import ParameterError
from ..mechanics.arrays import Real
from ..mechanism.parameters import Tolerance

METHODS = ("random", "latin", "sobol")
SENSITIVITY = "sensitivity"  # Method of Saltelli's design.
PROBABILITY_MIN = 2.0**-53  # Distance of probabilities from 0 and 1, where quantiles are infinite.
SIGMAS = 3.0  # Standard deviations in the half-width of a tolerance.
CONFIDENCE = 0.95
CONSTANT_RTOL = 1e-12  # Values that differ by less than this share of the largest are equal.
RESAMPLES = 999  # Of the bootstrap that gives the confidence intervals of indices.


def drawn(distributions: Mapping[str, Any], n: int, seed: int, method: str) -> Real:
    """Draw points (m, p) as :func:`prbm.sweeps.sweep.samples`.

    A column is x = F^-1(u) with the distribution F and a sequence u in (0, 1): pseudo-random, a
    Latin hypercube or the scrambled sequence of Sobol.  The columns are independent of each other.
    The method ``sensitivity`` gives n (p + 2) points: the rows of A, of B, and for each parameter
    those of A with the column of B.

    Raises
    ------
    ParameterError
        If n is zero, the seed negative, there are no parameters, or a distribution or a method is
        invalid.
    """
    n, seed, d = check_count("n", n, 1), check_count("seed", seed, 0), len(distributions)
    if not distributions:
        raise ParameterError(f"{n} rows without parameters: name at least one")
    unit = np.clip(_unit(n, d, seed, method), PROBABILITY_MIN, 1.0 - PROBABILITY_MIN)
    columns = [_quantiles(*item, u) for item, u in zip(distributions.items(), unit.T, strict=True)]
    return np.column_stack(columns)


def _unit(n: int, d: int, seed: int, method: str) -> Real:
    """Return probabilities, shape (n, d), or those of Saltelli's design, (n (d + 2), d)."""
    if method == "random":
        return np.random.default_rng(seed).random((n, d))
    if method == "latin":
        return np.asarray(qmc.LatinHypercube(d, seed=seed).random(n))
    if method not in ("sobol", SENSITIVITY):
        every = ", ".join((*METHODS, SENSITIVITY))
        raise ParameterError(f"unknown method {method!r}; methods are {every}")
    if n & (n - 1):
        near = 2 ** round(math.log2(n))
        other = ", or the method latin" * (method == "sobol")
        raise ParameterError(
            f"{n} rows: Sobol's sequence needs a power of two, such as {near}{other}"
        )
    if method == "sobol":
        return np.asarray(qmc.Sobol(d, seed=seed).random(n))
    if d < 2:
        raise ParameterError(
            "the method sensitivity needs two parameters: a single one has the whole variance"
        )
    a, b = np.hsplit(qmc.Sobol(2 * d, seed=seed).random(n), 2)
    return np.vstack([a, b, *(np.where(np.arange(d) == k, b, a) for k in range(d))])


def _quantiles(name: str, distribution: Any, u: Real) -> Real:
    if isinstance(distribution, tuple):
        low, high = distribution
        x = np.asarray(low + (high - low) * u, dtype=float)
    elif hasattr(distribution, "ppf"):
        x = np.asarray(distribution.ppf(u), dtype=float)
    else:
        raise ParameterError(
            f"{name}: {distribution!r} must be a distribution of scipy.stats, such as "
            "norm(0.0, 1e-3), or a pair (low, high)"
        )
    if x.shape != u.shape or not np.isfinite(x).all():
        raise ParameterError(f"{name}: the quantiles of the distribution must be finite numbers")
    return x


def distribution(name: str, value: float, tolerance: Tolerance) -> Any:
    """Return the distribution of a parameter with a tolerance, for :func:`drawn`.

    It is normal, and the half-width of the tolerance is three standard deviations: 0.27 % of the
    parts are outside.  Or it is uniform between the limits of the tolerance.

    Raises
    ------
    ParameterError
        If the half-width is a share of the value zero.

    Examples
    --------
    >>> distribution("length", 2.0, Tolerance(0.5, uniform=True))
    (1.5, 2.5)
    """
    half = tolerance.at(value)
    if half == 0.0:
        raise ParameterError(
            f"{name}: a tolerance in % of the value 0 has no width; give it in its unit"
        )
    return (value - half, value + half) if tolerance.uniform else norm(value, half / SIGMAS)


@dataclass(frozen=True)
class Yield:
    """The share of good runs among independent ones.

    Parameters
    ----------
    good, runs : int
        Numbers of runs that satisfy all constraints, and of all runs; a failed run is not good.
    share : float
        good / runs.
    low, high : float
        95 % confidence interval of the probability of a good run, by Wilson.

    Examples
    --------
    >>> found = yield_of(np.array([True] * 95 + [False] * 5))
    >>> found.share, round(found.low, 3), round(found.high, 3)
    (0.95, 0.888, 0.978)
    """

    good: int
    runs: int
    share: float
    low: float
    high: float


def yield_of(good: Any) -> Yield:
    """Return the share of true values and its confidence interval."""
    count, runs = int(np.sum(good)), len(good)
    interval = binomtest(count, runs).proportion_ci(CONFIDENCE, method="wilson")
    return Yield(count, runs, count / runs, float(interval.low), float(interval.high))


@dataclass(frozen=True)
class Sensitivity:
    """Sobol's indices of an output: shares of its variance.

    Parameters
    ----------
    names : tuple of str
        The parameters.
    first, total : (p,)
        Share of the variance by the parameter alone, and with all its interactions.
    first_interval, total_interval : (p, 2)
        95 % confidence intervals, by bootstrap; without width for a parameter without effect.
    """

    names: tuple[str, ...]
    first: Real
    total: Real
    first_interval: Real
    total_interval: Real


def sensitivity(names: Sequence[str], values: Real, seed: int = 0) -> Sensitivity | None:
    """Return the indices of an output at the points of Saltelli's design.

    Parameters
    ----------
    names : sequence of str
        The p parameters.
    values : (n (p + 2),)
        The output at the points of :func:`drawn` with the method ``sensitivity``.
    seed : int
        Seed of the bootstrap, which draws n rows of the design with replacement.

    Returns
    -------
    Sensitivity or None
        None if a simulation has failed or the output is constant but for round-off.
    """
    runs = np.reshape(values, (len(names) + 2, -1))  # A, B, and A with each column of B.
    if not np.isfinite(runs).all() or constant(runs[:2]):
        return None
    rng, n = np.random.default_rng(seed), runs.shape[1]
    resampled = [_indices(runs[:, rng.integers(n, size=n)]) for _ in range(RESAMPLES)]
    tail = 0.5 * (1.0 - CONFIDENCE)
    ends = np.nanquantile(resampled, (tail, 1.0 - tail), axis=0)
    first, total = _indices(runs)
    return Sensitivity(tuple(names), first, total, ends[:, 0].T, ends[:, 1].T)


def _indices(runs: Real) -> Real:
    """Return first-order and total indices, (2, p), from runs (p + 2, n) of Saltelli's design.

    Estimators are those of Saltelli (2010), as in ``scipy.stats.sobol_indices``; NaN if A and B
    have a single value.
    """
    a, b, mixed = runs[0], runs[1], runs[2:]
    if constant(runs[:2]):
        return np.full((2, len(mixed)), math.nan)
    alone = np.mean((b - runs[:2].mean()) * (mixed - a), axis=1)
    total = 0.5 * np.mean((mixed - a) ** 2, axis=1)
    indices: Real = np.stack([alone, total]) / runs[:2].var()
    return indices


def constant(x: Real) -> bool:
    """Return whether values are equal but for round-off."""
    return bool(np.ptp(x) <= CONSTANT_RTOL * np.abs(x).max())
