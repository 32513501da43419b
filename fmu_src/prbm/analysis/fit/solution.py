"""The solution of a fit: parameters, covariance, and directions that the data do not determine."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...base.progress import Progress
from ...data.series import Series
from ...data.uncertainty import Estimate, EvaluationError, serial_correlation, widening
from ...data.vibration import impacts
from ...mechanics.arrays import Real
from ...mechanism.description import Mechanism
from .problem import STEPS_MAX, Free, Problem, stated_problem
from .searches import SEARCHES, Minimum, distinct, searched
from .targets import RECORD_UNITS, Response, Target, of_mechanism

UNCERTAINTY_MAX = 0.5  # Largest relative uncertainty of a direction that counts as determined.
SINGULAR_RTOL = 1e-6  # Singular values below this fraction of the largest are round-off.
SHARE_MIN = 0.1  # Least share of a direction at which a parameter takes part in it.
REDUCED_MAX = 3.0  # Largest ratio of residuals to stated uncertainties without a note.
STARTS = {1: 9, 2: 5}  # Starts along each of k parameters of a response with several valleys.
STARTS_MAX = 400
CORRELATION_MIN = 0.9  # Smallest correlation of two parameters that is printed.
START_PROGRESS = 0.5  # Share of the starts in the reported progress.


@dataclass(frozen=True)
class Direction:
    """A direction among the parameters that the data do not determine.

    Parameters
    ----------
    shares : dict
        Relative change of each parameter, a vector of length 1 [-].
    uncertainty : float
        Relative standard uncertainty along the direction [-]; infinite without any information.
    """

    shares: dict[str, float]
    uncertainty: float

    def __str__(self) -> str:
        part = {name: x for name, x in self.shares.items() if abs(x) >= SHARE_MIN}
        if len(part) == 1:
            return f"these data cannot determine {next(iter(part))}"
        lead = next(iter(part))
        moves = [f"{name} by {x / part[lead]:+.3g} %" for name, x in part.items()]
        effect = "has no effect" if math.isinf(self.uncertainty) else (
            f"has less effect than the uncertainty of the data (relative uncertainty "
            f"{self.uncertainty:.2g})"
        )  # fmt: skip
        return (
            f"these data cannot separate {' and '.join(part)}: changing {', '.join(moves)} {effect}"
        )


@dataclass(frozen=True)
class Fit:
    """The best parameters, their covariance, and the directions that remain unknown.

    Parameters
    ----------
    problem : Problem
        The problem.
    p : (k,)
        Parameters in the order of ``problem.names``.
    covariance : (k, k)
        Covariance of the parameters.  For a parameter that the data do not determine, or that ended
        at a given bound, it is infinite on the diagonal and not a number elsewhere.
    singular : (k,)
        Singular values of the Jacobian scaled by the sizes of the parameters [-].
    directions : (k, k)
        Directions of the singular values, in rows.
    valleys : tuple of Direction
        Directions that the data do not determine.
    model : (m,)
        Values of the model for the data.
    evaluations : int
        Number of evaluations of the model.
    converged : bool
        Whether the minimiser converged.
    minima : tuple of Minimum
        The different minima in which the searches from several starts ended, the best one first.
    """

    problem: Problem
    p: Real
    covariance: Real
    singular: Real
    directions: Real
    valleys: tuple[Direction, ...]
    model: Real
    evaluations: int
    converged: bool
    minima: tuple[Minimum, ...] = ()

    @property
    def estimates(self) -> dict[str, Estimate]:
        """The parameters with their standard uncertainties."""
        units = {x.name: x.unit for x in self.problem.mechanism.parameters} | RECORD_UNITS
        u = np.sqrt(np.diag(self.covariance))
        freedom = math.inf if self.problem.known else float(self.freedom)
        return {
            name: Estimate(float(x), float(ux), units[name], freedom)
            for name, x, ux in zip(self.problem.names, self.p, u, strict=True)
        }

    def __getitem__(self, name: str) -> Estimate:
        return self.estimates[name]

    @property
    def values(self) -> dict[str, float]:
        """Fitted and fixed parameters of the mechanism, for :func:`prbm.Simulation`."""
        return of_mechanism(self.problem.values(self.p))

    @property
    def identifiable(self) -> bool:
        """Whether the data determine all parameters."""
        return bool(np.isfinite(np.diag(self.covariance)).all())

    @property
    def freedom(self) -> int:
        """Number of data less number of parameters."""
        return len(self.model) - len(self.p)

    @property
    def reduced(self) -> float:
        """Residuals relative to their uncertainties [-]: sqrt(sum ((model - data)/u)^2/freedom)."""
        rest = (self.model - self.problem.data) / self.problem.uncertainty
        return math.sqrt(float(rest @ rest) / self.freedom) if self.freedom > 0 else 0.0

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square of model - data for each target, in its unit."""
        rest, result = self.model - self.problem.data, {}
        for i, target in enumerate(self.problem.targets, start=1):
            part, rest = rest[: len(target.data)], rest[len(target.data) :]
            name = target.label if target.label not in result else f"{target.label} ({i})"
            result[name] = math.sqrt(float(np.mean(part**2)))
        return result

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Parameters that ended at a bound."""
        return self._selected(self.problem.at_bounds(self.p))

    def _selected(self, which: NDArray[np.bool_]) -> tuple[str, ...]:
        return tuple(name for name, chosen in zip(self.problem.names, which, strict=True) if chosen)

    @property
    def correlation(self) -> Real:
        """Correlation of the parameters, (k, k) [-]; NaN for those that are not determined."""
        u = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore"):
            result: Real = self.covariance / np.outer(u, u)
        return result

    @property
    def strongest(self) -> tuple[str, str, float] | None:
        """Names of the two parameters with the largest correlation, and it; None for one."""
        r = np.abs(np.triu(np.nan_to_num(self.correlation), 1))
        i, j = np.unravel_index(int(r.argmax()), r.shape)
        names = self.problem.names
        return (names[i], names[j], float(self.correlation[i, j])) if r[i, j] else None

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings about the numbers: valleys, bounds, convergence, errors of the model."""
        notes = [str(valley) for valley in self.valleys]
        if not self.converged:
            notes.append(
                f"no convergence in {STEPS_MAX} steps: the model does not fit these data, or starts"
                " too far from the solution; give narrower bounds, or inspect the figure"
            )
        ends = self._selected(self.problem.at_ends(self.p))
        for name in self.at_bounds:
            limit = self.problem.values(self.p)[name]
            if name in ends:
                notes.append(f"{name} ended at {limit:g}, the end of its range")
            else:
                notes.append(f"{name} ended at its bound {limit:.6g}: widen the bounds")
        if self.problem.known and self.reduced > REDUCED_MAX:
            notes.append(
                f"the residuals are {self.reduced:.3g} times the stated uncertainty: the error of "
                "the model exceeds that of the data; uncertainties are multiplied by that factor "
                "and are valid for this model only"
            )
        return tuple(notes)

    def __str__(self) -> str:
        rows = [f"{name} = {_with_interval(x)}" for name, x in self.estimates.items()]
        if any(math.isfinite(x.uncertainty) for x in self.estimates.values()):
            rows.append("  ±: one standard uncertainty")
        units = [target.unit for target in self.problem.targets]
        rows += [
            f"  rms of {label}: {rms:.4g} {unit_}"
            for (label, rms), unit_ in zip(self.rms.items(), units, strict=True)
        ]
        if len(self.p) > 1:
            known = ", ".join(f"{s:.3g}" for s in self.singular)
            rows.append(f"  singular values {known} (1/relative uncertainty)")
        if (pair := self.strongest) and abs(pair[2]) > CORRELATION_MIN:
            rows.append(
                f"  largest correlation: {pair[2]:.3f} between {pair[0]} and {pair[1]}; the data "
                "determine a combination of them better than each"
            )
        rows += self._searches()
        return "\n".join([*rows, *(f"  note: {note}" for note in self.notes)])

    def _searches(self) -> list[str]:
        """Return the lines about the minima in which several searches ended."""
        count = sum(one.searches for one in self.minima)
        if count < 2:
            return []
        best, *others = self.minima
        if not others:
            end = "have this misfit" if self.valleys else "ended in this minimum"
            return [f"  searches: all {count} that converged, from different starts, {end}"]
        lines = [f"  searches: {best.searches} of {count} that converged, from different starts, "
                 f"ended in this minimum; distinct minima: {len(self.minima)}"]  # fmt: skip
        for one in others:
            where = ", ".join(
                f"{name} = {x:.6g}" for name, x in zip(self.problem.names, one.p, strict=True)
            )
            size = math.sqrt(one.misfit / best.misfit) if best.misfit > 0.0 else math.inf
            lines.append(f"  another minimum: {where}; residuals {size:.3g} times as large")
        return lines


def _with_interval(x: Estimate) -> str:
    """Return an estimate with its 95 % confidence interval.

    Examples
    --------
    >>> print(_with_interval(Estimate(2.4753, 0.076)))
    2.475 ± 0.076 (95 %: 2.326 to 2.624)
    """
    if not 0.0 < x.uncertainty < math.inf:
        return str(x)
    low, high = x.interval()
    size = max(abs(low), abs(high))
    digits = max(2, 2 + math.floor(math.log10(size)) - math.floor(math.log10(x.uncertainty)))
    return f"{x} (95 %: {low:.{digits}g} to {high:.{digits}g})"


def fit(
    mechanism: Mechanism,
    free: Sequence[Free | str],
    targets: Sequence[Target] | Target,
    values: Mapping[str, float] | None = None,
    *,
    starts: int | None = None,
    searches: int | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Fit named parameters of a mechanism to data.

    The sum of squares of several parameters may have several minima.  Further searches begin at
    the best points of a Latin hypercube within the bounds, which is the same for each fit.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    free : sequence of Free or str
        Parameters to fit.
    targets : Target or sequence of Target
        Any of the classes in :mod:`prbm.analysis.fit.targets`, mixed as needed.
    values : mapping
        Other parameters that differ from those of the mechanism.
    starts : int or None
        Number of starts along each parameter; None: several if there is a response, whose misfit
        has several valleys, else one.
    searches : int or None
        Number of searches from different starts; None: 1 for one parameter, 4 for several.
    progress : callable or None
        Called with the completed fraction, from 0 to 1: of the starts, then of the minimisation.

    Raises
    ------
    EvaluationError
        If there is nothing to fit, bounds are invalid, uncertainties are known for some targets
        only, or there is no motion or shape within the bounds.
    ParameterError
        If a name is unknown.

    Examples
    --------
    >>> from prbm.analysis.fit import Frequency
    >>> from prbm.files.mechanism_file import load
    >>> guide = load("PRBDM")
    >>> found = fit(guide, ["flexure.K_theta"], Frequency(Estimate(4.82, 0.06)))
    >>> print(found["flexure.K_theta"])
    2.475 ± 0.076
    """
    several = (targets,) if not isinstance(targets, Sequence) else tuple(targets)
    problem = stated_problem(mechanism, free, several, values or {})
    report = progress or _no_report
    best = _best_start(problem, several, starts, lambda done: report(START_PROGRESS * done))
    rest = 1.0 - START_PROGRESS
    count = searches if searches is not None else SEARCHES if len(best) > 1 else 1
    ends = searched(problem, best, count, lambda done: report(START_PROGRESS + rest * done))
    found = _assessed(problem, ends.p, ends.evaluations, ends.converged)
    minima = distinct(problem, ends.minima, bool(found.valleys))
    report(1.0)
    return replace(found, minima=minima)


def _no_report(done: float) -> None:
    pass


def _assessed(problem: Problem, p: Real, evaluations: int, converged: bool) -> Fit:
    """Return a fit with the covariance and the unknown directions of its parameters."""
    model = problem.model(p)
    rest = (model - problem.data) / problem.uncertainty
    size = problem.size(p)
    J = problem.jacobian(p, size, np.arange(len(p)))
    m, k = J.shape
    _, s, V = np.linalg.svd(J, full_matrices=True)
    s = np.concatenate([s, np.zeros(k - len(s))])
    noise = math.sqrt(float(rest @ rest) / (m - k)) if m > k else 1.0
    if problem.known:
        noise = max(1.0, noise) if m > k else 1.0
    elif m <= k:
        raise EvaluationError(
            f"{m} data cannot determine {k} parameters and their own scatter: give an uncertainty"
        )
    noise *= widening(serial_correlation(rest), m) if m > k else 1.0
    least = problem.round_off
    s = s / max(noise, least, 1e-300)
    s[s <= SINGULAR_RTOL * s.max(initial=0.0)] = 0.0
    valleys = []
    for row, known in zip(V, s, strict=True):
        if known * UNCERTAINTY_MAX < 1.0:
            row = row * np.sign(row[np.argmax(np.abs(row))])
            shares = dict(zip(problem.names, map(float, row), strict=True))
            valleys.append(Direction(shares, 1.0 / known if known > 0.0 else math.inf))
    held = problem.at_bounds(p) & ~problem.at_ends(p)
    covariance = _covariance(s, V, size, held)
    return Fit(problem, p, covariance, s, V, tuple(valleys), model, evaluations, converged)


def _covariance(s: Real, V: Real, size: Real, held: NDArray[np.bool_]) -> Real:
    """Return diag(size) V^T diag(1/s^2) V diag(size).

    It is infinite for parameters in unknown directions and for parameters at given bounds.
    """
    kept = s * UNCERTAINTY_MAX >= 1.0
    W = V[kept] / s[kept, None]
    result: Real = (W.T @ W) * np.outer(size, size)
    lost = held | np.any(np.abs(V[~kept]) >= SHARE_MIN, axis=0)
    result[lost] = result[:, lost] = math.nan
    result[lost, lost] = math.inf
    return result


def _best_start(
    problem: Problem, targets: tuple[Target, ...], starts: int | None, progress: Progress
) -> Real:
    """Return the best start: the given one, or a point of a grid within the bounds."""
    k = len(problem.names)
    if starts is None:
        responds = any(isinstance(target, Response) for target in targets)
        starts = STARTS.get(k, 1) if responds else 1
    if starts**k > STARTS_MAX:
        raise EvaluationError(
            f"starts = {starts} along {k} parameters are {starts**k}: choose fewer, at most "
            f"{STARTS_MAX} in all"
        )
    if starts <= 1:
        return problem.start
    axes = [
        low + (high - low) * (np.arange(starts) + 0.5) / starts
        for low, high in zip(problem.lower, problem.upper, strict=True)
    ]
    grid = [problem.start, *(np.array(point) for point in product(*axes))]
    costs, failure = [], None
    for i, point in enumerate(grid):
        try:
            costs.append(float(np.sum(problem.residuals(point) ** 2)))
        except EvaluationError as error:  # There may be no motion in a corner of the bounds.
            costs.append(math.inf)
            failure = error
        progress((i + 1) / len(grid))
    best = int(np.argmin(costs))
    if failure is not None and math.isinf(costs[best]):
        raise failure
    return grid[best]


def fitted_restitution(
    mechanism: Mechanism,
    series: Series,
    values: Mapping[str, float] | None = None,
    *,
    output: str = "shuttle.x",
    stop: str = "stop",
    uncertainty: float | None = None,
    free: Sequence[Free | str] = (),
    progress: Progress | None = None,
) -> Fit:
    """Fit the restitution of a stop to a bouncing response.

    The 1R guide has only the fundamental mode, so that its fitted restitution estimates the modal
    restitution, as in the thesis.  The fitted number applies to all impacts of the record.  If an
    impact leaves much energy in other modes, the following impacts depend on these modes, and the
    fitted number differs from the modal restitution of the first impact
    (:func:`prbm.mechanics.modal.modal_restitution`).

    Parameters
    ----------
    mechanism : Mechanism
        The 1R guide, or another mechanism with a stop.
    series : Series
        The record, with times since the release.
    values : mapping
        Parameters that differ from those of the mechanism: release, position of the stop,
        stiffness.
    output : str
        Name of the recorded output; as for :class:`Response`.
    stop : str
        Name of the stop.
    uncertainty : float or None
        Standard uncertainty of a sample; None: estimated from the residuals.
    free : sequence of Free or str
        Further parameters, for instance ``Free("stop.position", -1e-3, 1e-3)``,
        ``Free("record.shift", -5e-3, 5e-3)``.
    progress : callable or None
        As for :func:`fit`.

    Raises
    ------
    EvaluationError
        If there is no impact in the record, or :func:`fit` raises it.
    """
    impacts(series)
    name = f"{stop}.restitution"
    wanted = [Free(name, 0.0, 1.0), *free]
    target = Response(series, output, uncertainty)
    return fit(mechanism, wanted, target, values, progress=progress)
