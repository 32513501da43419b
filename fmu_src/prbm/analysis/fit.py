r"""Parameters of a mechanism fitted to frequencies, responses and force-deflection curves.

Whatever a mechanism names can be fitted: stiffness coefficients of its flexures, the restitution
and position of a stop, damping, a mass.  The sum of squares

    S(p) = sum ((model(p) - data)/u)^2

is minimised within bounds; the covariance is (J^T J)^-1, with J the derivatives of the residuals.
With the columns of J scaled by the sizes of the parameters, its singular values s_k are what the
data know: along the k-th direction the parameters are known to the relative standard uncertainty
1/s_k.  Where that is no knowledge, the fit says so and names the direction of the valley.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..base.errors import ParameterError, PrbmError
from ..base.names import unknown
from ..data.series import Series
from ..data.uncertainty import Estimate, EvaluationError, serial_correlation, widening
from ..data.vibration import impacts
from ..hybrid.simulation import Simulation
from ..mechanics.arrays import Real, Whole
from ..mechanics.assembly import assemble
from ..mechanics.modal import modes
from ..mechanics.statics import equilibrium
from ..mechanics.system import unit
from ..mechanism.description import Mechanism

STEP = 1e-4  # of a parameter's size, of the central differences: the integration's noise is 1e-8
LOOSE = 0.5  # relative standard uncertainty; twice that includes zero: the data know nothing
EXACT = 1e-9  # of the data: a model that is nearer to them is as near as it is computed
NOISE = 1e-6  # of the largest singular value: what rounding leaves of none
PART = 0.1  # share of a direction in which a parameter takes part
AT_BOUND = 1e-6  # of the range
WIDE = 10.0  # default bounds: value/10 to value times 10
SHARE = 0.1  # of the range of the bounds: the size of a parameter near zero
DOUBTFUL = 3.0  # residual over stated uncertainty: then the model is what is wrong
SCAN = {1: 9, 2: 5}  # starts along each parameter of a response, whose misfit has several valleys
MOST_STARTS = 400
MOST_STEPS = 50  # of the minimiser
HALF_WAY = 4.0  # steps of the minimiser, for the progress told
SEARCH = 0.5  # of the progress told: the starts
NEAR_LEAST = 1e-9  # of the misfit: with m data, sqrt(m/1e9) of a standard uncertainty away
RECORD_SHIFT, RECORD_ZERO = "record.shift", "record.zero"
OWN = (RECORD_SHIFT, RECORD_ZERO)  # parameters of a record, not of the mechanism
OWN_UNITS = {RECORD_SHIFT: "s", RECORD_ZERO: "m"}
DISPLACEMENT = "displacement"  # of the released body along the direction of its release

Progress = Callable[[float], object]


@dataclass(frozen=True)
class Free:
    """A parameter that is fitted.

    Parameters
    ----------
    name : str
        As in the mechanism; or ``record.shift``, the time of the model at the time zero of a
        response [s], or ``record.zero``, the reading of its sensor where the model has zero.
    lower, upper : float or None
        Bounds; None: a tenth and ten times the start, within the mechanism's bounds.
    start : float or None
        None: the value of the mechanism.
    """

    name: str
    lower: float | None = None
    upper: float | None = None
    start: float | None = None


class Target(Protocol):
    """What a fit is to: data with an uncertainty, and what a model says in their place.

    ``uncertainty`` is None if it is to be estimated from the residuals.
    """

    @property
    def label(self) -> str:
        """What it is, in words."""

    @property
    def unit(self) -> str:
        """Unit of the data."""

    @property
    def data(self) -> Real:
        """The data, (m,)."""

    @property
    def uncertainty(self) -> float | None:
        """Standard uncertainty of each of the data."""

    def model(self, mechanism: Mechanism, values: Mapping[str, float]) -> Real:
        """Return what a mechanism with these values has in place of the data, (m,)."""


@dataclass(frozen=True)
class Frequency:
    """A natural frequency, measured or of finite elements.

    Parameters
    ----------
    frequency : Estimate
        With a standard uncertainty above zero [Hz].
    mode : int
        Its number, 1 for the fundamental.
    displacement : float or None
        Of the released body, held there by a force [m]; None: the equilibrium under gravity.
    """

    frequency: Estimate
    mode: int = 1
    displacement: float | None = None
    unit: str = field(default="Hz", init=False)

    def __post_init__(self) -> None:
        if not isinstance(self.frequency, Estimate):
            raise EvaluationError(
                f"frequency = {self.frequency!r} comes without its uncertainty, by which targets "
                "are weighed: give Frequency(Estimate(value, standard uncertainty)), both in Hz"
            )
        if not 0.0 < self.frequency.uncertainty < math.inf or self.frequency.value <= 0.0:
            raise EvaluationError(
                f"frequency {self.frequency}: give a positive value and its standard uncertainty; "
                "for a computed one half of its last digit"
            )
        if self.mode < 1:
            raise EvaluationError(f"mode = {self.mode}: the fundamental is 1")

    @property
    def label(self) -> str:
        """What it is, in words."""
        where = "rest" if self.displacement is None else f"{1e3 * self.displacement:g} mm"
        return f"frequency {self.mode} at {where}"

    @property
    def data(self) -> Real:
        """The frequency, (1,)."""
        return np.array([self.frequency.value])

    @property
    def uncertainty(self) -> float | None:
        """Standard uncertainty [Hz]."""
        return self.frequency.uncertainty

    def model(self, mechanism: Mechanism, values: Mapping[str, float]) -> Real:
        """Return the frequency of the mechanism, (1,) [Hz]."""
        system = assemble(mechanism, mechanism.values(_of_mechanism(values)))
        found = modes(system, equilibrium(system, self.displacement)).frequency
        if self.mode > len(found):
            raise EvaluationError(
                f"{self.label}: {mechanism.name} has {len(found)} modes; choose a model with more"
            )
        return found[self.mode - 1 : self.mode]


@dataclass(frozen=True)
class Response:
    """An output over time, from the release at t = 0.

    Parameters
    ----------
    series : Series
        The record; its times are counted from the release.
    output : str
        Name of the output, for instance ``shuttle.x``; or ``displacement``, that of the released
        body along the direction of its release.
    uncertainty : float or None
        Standard uncertainty of a sample; None: estimated from the residuals.
    tolerance : float or None
        Of the integration; None: ``solver.tolerance``.
    """

    series: Series
    output: str = "shuttle.x"
    uncertainty: float | None = None
    tolerance: float | None = None

    def __post_init__(self) -> None:
        if self.uncertainty is not None and not 0.0 < self.uncertainty < math.inf:
            raise EvaluationError(
                f"uncertainty = {self.uncertainty:g} of {self.output}: it must be positive; give "
                "None to have it estimated"
            )

    @property
    def label(self) -> str:
        """What it is, in words."""
        return f"{self.output} over time"

    @property
    def unit(self) -> str:
        """Unit of the signal."""
        return self.series.unit

    @property
    def data(self) -> Real:
        """The samples, (m,)."""
        return self.series.values

    def model(self, mechanism: Mechanism, values: Mapping[str, float]) -> Real:
        """Return the output of the mechanism at the times of the record, (m,)."""
        times = self.series.time + values.get(RECORD_SHIFT, 0.0)
        simulation = Simulation(mechanism, _of_mechanism(values), tolerance=self.tolerance)
        result = np.empty(len(times))
        for i, t in enumerate(times):
            if t > simulation.time:
                simulation.advance(float(t))
            result[i] = _output(simulation, self.output)
        return result + values.get(RECORD_ZERO, 0.0)


def _output(simulation: Simulation, name: str) -> float:
    """Return an output by its name, or the displacement of the released body [m]."""
    motions = simulation.motions()
    if name == DISPLACEMENT:
        release = simulation.mechanism.release
        x, y = (motions[f"{release.body}.{axis}"] for axis in "xy")
        u = unit(release.direction)
        return float(u.real * x + u.imag * y)
    outputs = motions if name in motions else simulation.outputs()
    if name not in outputs:
        raise EvaluationError(unknown(name, {DISPLACEMENT: 0.0, **outputs}))
    return float(outputs[name])


@dataclass(frozen=True)
class ForceDeflection:
    """The force that holds the released body displaced along the direction of the release.

    Parameters
    ----------
    displacement, force : (m,)
        From the straight shape [m]; positive in the direction of the displacement [N].
    uncertainty : float or None
        Standard uncertainty of a force [N]; None: estimated from the residuals.
    """

    displacement: Real
    force: Real
    uncertainty: float | None = None
    label: str = field(default="force over deflection", init=False)
    unit: str = field(default="N", init=False)

    def __post_init__(self) -> None:
        if len(self.displacement) != len(self.force) or not len(self.force):
            raise EvaluationError(
                f"{len(self.displacement)} displacements for {len(self.force)} forces: give pairs"
            )
        if self.uncertainty is not None and not 0.0 < self.uncertainty < math.inf:
            raise EvaluationError(f"uncertainty = {self.uncertainty:g} N must be positive, or None")

    @property
    def data(self) -> Real:
        """The forces, (m,)."""
        return self.force

    def model(self, mechanism: Mechanism, values: Mapping[str, float]) -> Real:
        """Return the forces of the mechanism, (m,) [N]."""
        system = assemble(mechanism, mechanism.values(_of_mechanism(values)))
        forces = [equilibrium(system, float(x)).force for x in self.displacement]
        return np.array(forces) + values.get(RECORD_ZERO, 0.0)


def _of_mechanism(values: Mapping[str, float]) -> dict[str, float]:
    return {name: x for name, x in values.items() if name not in OWN}


def _check_shape(target: Target, found: Real) -> None:
    """Refuse what would be stretched to the data rather than compared with them."""
    if np.shape(found) != np.shape(target.data):
        raise EvaluationError(
            f"{target.label}: its model returns {_counted(found)}, its data are "
            f"{_counted(target.data)}: return one value for each of the data"
        )


def _counted(x: Real) -> str:
    shape = np.shape(x)
    return f"an array of length {shape[0]}" if len(shape) == 1 else f"an array of shape {shape}"


@dataclass(frozen=True)
class Problem:
    """A fit before it is made: parameters p with bounds, targets, and all other values."""

    mechanism: Mechanism
    names: tuple[str, ...]
    start: Real
    lower: Real
    upper: Real
    targets: tuple[Target, ...]
    fixed: Mapping[str, float]

    @property
    def data(self) -> Real:
        """The data of all targets, one after the other."""
        return np.concatenate([target.data for target in self.targets])

    @property
    def uncertainty(self) -> Real:
        """Their standard uncertainties; ones where they are to be estimated."""
        parts = [np.full(len(t.data), t.uncertainty or 1.0) for t in self.targets]
        return np.concatenate(parts)

    @property
    def known(self) -> bool:
        """Whether the uncertainty of the data is given."""
        return self.targets[0].uncertainty is not None

    def values(self, p: Real) -> dict[str, float]:
        """Return all values that differ from the mechanism's."""
        return {**self.fixed, **dict(zip(self.names, map(float, p), strict=True))}

    def model(self, p: Real) -> Real:
        """Return what the model says in place of the data.

        Raises
        ------
        EvaluationError
            If there is no such motion or shape; it names the parameters.  Or if a target's model
            gives another number of values than it has data.
        """
        values = self.values(p)
        try:
            parts = [t.model(self.mechanism, values) for t in self.targets]
        except PrbmError as error:
            if isinstance(error, EvaluationError):
                raise
            tried = ", ".join(f"{name} = {x:.6g}" for name, x in zip(self.names, p, strict=True))
            raise EvaluationError(f"{error} (tried {tried}; narrow the bounds)") from None
        for target, part in zip(self.targets, parts, strict=True):
            _check_shape(target, part)
        return np.concatenate(parts)

    def residuals(self, p: Real) -> Real:
        """Return (model - data)/uncertainty."""
        result: Real = (self.model(p) - self.data) / self.uncertainty
        return result

    def size(self, p: Real) -> Real:
        """Return the size of each parameter: its value, or a share of its range near zero."""
        result: Real = np.maximum(np.abs(p), SHARE * (self.upper - self.lower))
        return result

    def at_bounds(self, p: Real) -> NDArray[np.bool_]:
        """Return which parameters are at a bound, (k,)."""
        return self._near(p, np.column_stack([self.lower, self.upper]))

    def at_ends(self, p: Real) -> NDArray[np.bool_]:
        """Return which parameters are where what is possible ends, (k,)."""
        ends = [_own_bounds(self.mechanism, name) for name in self.names]
        return self._near(p, np.array(ends))

    def _near(self, p: Real, places: Real) -> NDArray[np.bool_]:
        near = AT_BOUND * (self.upper - self.lower)[:, None]
        result: NDArray[np.bool_] = np.any(np.abs(p[:, None] - places) <= near, axis=1)
        return result

    def jacobian(self, p: Real, scale: Real, moved: Whole) -> Real:
        """Return the derivatives of the residuals by some p/scale, (m, j), central differences."""
        columns = []
        for i in moved:
            ahead, behind = p.copy(), p.copy()
            ahead[i] = min(p[i] + STEP * scale[i], self.upper[i])
            behind[i] = max(p[i] - STEP * scale[i], self.lower[i])
            change = self.residuals(ahead) - self.residuals(behind)
            columns.append(change * scale[i] / (ahead[i] - behind[i]))
        return np.column_stack(columns)

    def minimised(
        self, start: Real, moved: Whole, progress: Progress | None = None
    ) -> tuple[Real, int, bool]:
        """Return the parameters of least misfit, model evaluations, whether it converged.

        Parameters
        ----------
        start : (k,)
            All parameters.
        moved : (j,) int
            Those that are fitted; the others stay.
        progress : callable or None
            Told a fraction that comes nearer to 1, how many steps there will be is not known.
        """
        scale, evaluations = self.size(start), 0

        def all_of(z: Real) -> Real:
            p = start.copy()
            p[moved] = np.clip(z * scale[moved], self.lower[moved], self.upper[moved])
            return p

        def residuals(z: Real) -> Real:
            nonlocal evaluations
            evaluations += 1
            if progress is not None:
                steps = evaluations / (2 * len(moved) + 1)
                progress(1.0 - 0.5 ** (steps / HALF_WAY))
            return self.residuals(all_of(z))

        def derivatives(z: Real) -> Real:
            nonlocal evaluations
            evaluations += 2 * len(moved)
            return self.jacobian(all_of(z), scale, moved)

        bounds = (self.lower[moved] / scale[moved], self.upper[moved] / scale[moved])
        found = least_squares(
            residuals, start[moved] / scale[moved], derivatives, bounds,
            xtol=1e-10, ftol=NEAR_LEAST, gtol=1e-12, max_nfev=MOST_STEPS,
        )  # fmt: skip
        return all_of(found.x), evaluations, found.status > 0


@dataclass(frozen=True)
class Direction:
    """A direction among the parameters that the data know little of, or nothing.

    Parameters
    ----------
    shares : dict
        Relative change of each parameter, of length 1 together [-].
    uncertainty : float
        Relative standard uncertainty along it [-]; infinite: none is known.
    """

    shares: dict[str, float]
    uncertainty: float

    def __str__(self) -> str:
        part = {name: x for name, x in self.shares.items() if abs(x) >= PART}
        if len(part) == 1:
            return f"{next(iter(part))} cannot be determined by these data"
        lead = next(iter(part))
        moves = [f"{name} by {x / part[lead]:+.3g} %" for name, x in part.items()]
        known = "nothing" if math.isinf(self.uncertainty) else (
            f"less than the uncertainty of the data allows to see (relative {self.uncertainty:.2g})"
        )  # fmt: skip
        return (
            f"{' and '.join(part)} cannot be told apart by these data: changing "
            f"{', '.join(moves)} changes {known}"
        )


@dataclass(frozen=True)
class Fit:
    """The parameters that fit best, what is known of them, and what is not.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    p : (k,)
        Parameters in the order of ``problem.names``.
    covariance : (k, k)
        Of the parameters; infinite on the diagonal, else not a number, where the data do not
        determine them, or a bound that was given holds them back.
    singular : (k,)
        Singular values of the Jacobian scaled by the sizes of the parameters [-].
    directions : (k, k)
        Rows: the directions that belong to them.
    valleys : tuple of Direction
        Those along which the data know nothing.
    model : (m,)
        What the model says in place of the data.
    evaluations : int
        How often the model was evaluated.
    converged : bool
        Whether the misfit is the least near there.
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

    @property
    def estimates(self) -> dict[str, Estimate]:
        """The parameters with their standard uncertainties."""
        units = {x.name: x.unit for x in self.problem.mechanism.parameters} | OWN_UNITS
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
        """Parameters of the mechanism, fitted and fixed, as :class:`prbm.Simulation` takes them."""
        return _of_mechanism(self.problem.values(self.p))

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
        """Root mean square of (model - data)/uncertainty with the degrees of freedom [-]."""
        rest = (self.model - self.problem.data) / self.problem.uncertainty
        return math.sqrt(float(rest @ rest) / self.freedom) if self.freedom > 0 else 0.0

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square of model - data of each target, in its unit.

        That of a response is the RMSE over time.
        """
        rest, result = self.model - self.problem.data, {}
        for i, target in enumerate(self.problem.targets, start=1):
            part, rest = rest[: len(target.data)], rest[len(target.data) :]
            name = target.label if target.label not in result else f"{target.label} ({i})"
            result[name] = math.sqrt(float(np.mean(part**2)))
        return result

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Parameters that ended at a bound."""
        return self._those(self.problem.at_bounds(self.p))

    def _those(self, which: NDArray[np.bool_]) -> tuple[str, ...]:
        return tuple(name for name, it in zip(self.problem.names, which, strict=True) if it)

    @property
    def correlation(self) -> Real:
        """Correlation of the parameters, (k, k) [-]; not a number where not determined."""
        u = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore"):
            result: Real = self.covariance / np.outer(u, u)
        return result

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of the numbers must know."""
        notes = [str(valley) for valley in self.valleys]
        if not self.converged:
            notes.append(
                f"{MOST_STEPS} steps did not lead to a least misfit: the model cannot follow these "
                "data, or starts too far away; give bounds near the values, or look at the figure"
            )
        ends = self._those(self.problem.at_ends(self.p))
        for name in self.at_bounds:
            limit = self.problem.values(self.p)[name]
            if name in ends:
                notes.append(f"{name} ended at {limit:g}, the end of what is possible")
            else:
                notes.append(f"{name} ended at its bound {limit:.6g}: widen the bounds")
        if self.problem.known and self.reduced > DOUBTFUL:
            notes.append(
                f"the residuals are {self.reduced:.3g} times the stated uncertainty: the model "
                "errs more than the data; uncertainties were widened by that factor and hold "
                "within this model only"
            )
        return tuple(notes)

    def __str__(self) -> str:
        rows = [f"{name} = {estimate}" for name, estimate in self.estimates.items()]
        units = [target.unit for target in self.problem.targets]
        rows += [
            f"  rms of {label}: {rms:.4g} {unit_}"
            for (label, rms), unit_ in zip(self.rms.items(), units, strict=True)
        ]
        if len(self.p) > 1:
            known = ", ".join(f"{s:.3g}" for s in self.singular)
            rows.append(f"  singular values {known} (1/relative uncertainty)")
        return "\n".join([*rows, *(f"  note: {note}" for note in self.notes)])


def fit(
    mechanism: Mechanism,
    free: Sequence[Free | str],
    targets: Sequence[Target] | Target,
    values: Mapping[str, float] | None = None,
    *,
    starts: int | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Fit named parameters of a mechanism to data.

    Parameters
    ----------
    mechanism : Mechanism
        What is fitted.
    free : sequence of Free or str
        The parameters.
    targets : Target or sequence of Target
        :class:`Frequency`, :class:`Response`, :class:`ForceDeflection`; any mixture.
    values : mapping
        Other parameters that differ from the mechanism's.
    starts : int or None
        Number of starts along each parameter; None: several if there is a response, whose misfit
        has several valleys, else one.
    progress : callable or None
        Told the fraction that is done, from 0 to 1: of the starts, then of the fit from the best.

    Raises
    ------
    EvaluationError
        If there is nothing to fit, bounds make no sense, uncertainties are known of some targets
        only, or there is no motion or shape within the bounds.
    ParameterError
        If a name is unknown.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load, shipped
    >>> guide = load(shipped()["PRBDM"])
    >>> found = fit(guide, ["flexure.K_theta"], Frequency(Estimate(4.82, 0.06)))
    >>> print(found["flexure.K_theta"])
    2.475 ± 0.076
    """
    several = (targets,) if not isinstance(targets, Sequence) else tuple(targets)
    problem = _problem(mechanism, free, several, values or {})
    told = progress or _unheard
    best = _best_start(problem, several, starts, lambda done: told(SEARCH * done))
    p, evaluations, converged = problem.minimised(
        best, np.arange(len(best)), lambda done: told(SEARCH + (1.0 - SEARCH) * done)
    )
    found = _assessed(problem, p, evaluations, converged)
    told(1.0)
    return found


def _unheard(done: float) -> None:
    pass


def _assessed(problem: Problem, p: Real, evaluations: int, converged: bool) -> Fit:
    """Return a fit with what the data know about its parameters."""
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
            f"{m} data cannot give {k} parameters and their own scatter: give their uncertainty"
        )
    noise *= widening(serial_correlation(rest), m) if m > k else 1.0
    least = EXACT * float(np.abs(problem.data / problem.uncertainty).max())
    s = s / max(noise, least, 1e-300)
    s[s <= NOISE * s.max(initial=0.0)] = 0.0
    valleys = []
    for row, known in zip(V, s, strict=True):
        if known * LOOSE < 1.0:
            row = row * np.sign(row[np.argmax(np.abs(row))])
            shares = dict(zip(problem.names, map(float, row), strict=True))
            valleys.append(Direction(shares, 1.0 / known if known > 0.0 else math.inf))
    held = problem.at_bounds(p) & ~problem.at_ends(p)
    covariance = _covariance(s, V, size, held)
    return Fit(problem, p, covariance, s, V, tuple(valleys), model, evaluations, converged)


def _covariance(s: Real, V: Real, size: Real, held: NDArray[np.bool_]) -> Real:
    """Return diag(size) V^T diag(1/s^2) V diag(size), infinite where a direction is lost.

    And where a parameter is held at a bound that was given.
    """
    kept = s * LOOSE >= 1.0
    W = V[kept] / s[kept, None]
    result: Real = (W.T @ W) * np.outer(size, size)
    lost = held | np.any(np.abs(V[~kept]) >= PART, axis=0)
    result[lost] = result[:, lost] = math.nan
    result[lost, lost] = math.inf
    return result


def _problem(
    mechanism: Mechanism,
    free: Sequence[Free | str],
    targets: tuple[Target, ...],
    values: Mapping[str, float],
) -> Problem:
    if not free or not targets:
        raise EvaluationError("there is nothing to fit: give a parameter and a target")
    for target in targets:
        if not hasattr(target, "model"):
            raise EvaluationError(
                f"{target!r} is no target: give Frequency, Response, ForceDeflection, or what has "
                "the attributes and methods of Target"
            )
    if len({target.uncertainty is None for target in targets}) > 1:
        raise EvaluationError(
            "the uncertainty is given for some targets only, so that they cannot be weighed: give "
            "it for all"
        )
    defaults = mechanism.values(_of_mechanism(values))
    defaults |= {name: values.get(name, 0.0) for name in OWN}
    wanted = [one if isinstance(one, Free) else Free(one) for one in free]
    names = tuple(one.name for one in wanted)
    for name in names:
        if name not in defaults:
            raise ParameterError(unknown(name, defaults))
        if names.count(name) > 1:
            raise EvaluationError(f"{name} is to be fitted twice")
    limits = np.array([_bounds(mechanism, one, defaults[one.name]) for one in wanted])
    start = [defaults[one.name] if one.start is None else one.start for one in wanted]
    lower, upper = limits.T
    return Problem(
        mechanism, names, np.clip(np.array(start, float), lower, upper), lower, upper, targets,
        {name: x for name, x in values.items() if name not in names},
    )  # fmt: skip


def _own_bounds(mechanism: Mechanism, name: str) -> tuple[float, float]:
    """Return the bounds within which a parameter makes sense."""
    for parameter in mechanism.parameters:
        if parameter.name == name:
            return parameter.minimum, parameter.maximum
    return -math.inf, math.inf


def _bounds(mechanism: Mechanism, one: Free, default: float) -> tuple[float, float]:
    """Return the bounds of a parameter."""
    least, most = _own_bounds(mechanism, one.name)
    start = default if one.start is None else one.start
    wide = sorted((start / WIDE, start * WIDE))
    if least >= 0.0 and most <= 1.0:  # a ratio
        wide = [least, most]
    lower = max(least, wide[0] if one.lower is None else one.lower)
    upper = min(most, wide[1] if one.upper is None else one.upper)
    if not (math.isfinite(lower) and math.isfinite(upper) and lower < upper):
        raise EvaluationError(
            f"{one.name}: the bounds {lower:g} to {upper:g} leave nothing to fit; give "
            f"Free({one.name!r}, lower, upper)"
        )
    return lower, upper


def _best_start(
    problem: Problem, targets: tuple[Target, ...], starts: int | None, progress: Progress
) -> Real:
    """Return the best of the starts on a grid within the bounds, the given one among them."""
    k = len(problem.names)
    if starts is None:
        responds = any(isinstance(target, Response) for target in targets)
        starts = SCAN.get(k, 1) if responds else 1
    if starts**k > MOST_STARTS:
        raise EvaluationError(
            f"starts = {starts} along {k} parameters are {starts**k}: choose fewer, at most "
            f"{MOST_STARTS} in all"
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
        except EvaluationError as error:  # a corner where there is no motion
            costs.append(math.inf)
            failure = error
        progress((i + 1) / len(grid))
    best = int(np.argmin(costs))
    if failure is not None and math.isinf(costs[best]):
        raise failure
    return grid[best]


# --- valleys ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Valley:
    """The best fit for each of several values of one parameter.

    Parameters
    ----------
    names : tuple of str
        The parameters.
    along : str
        The one that was given.
    points : (n, k)
        Parameters.
    misfit : (n,)
        Sum of ((model - data)/u)^2 [-]; u is 1 where it is not given.
    best : (k,)
        The fit that the valley belongs to.
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
    """Return the profile of a fit along one of its parameters, all others fitted again.

    Parameters
    ----------
    found : Fit
        Of two parameters or more.
    along : str or None
        Name of the parameter; None: the one with the largest part in the worst direction.
    span : pair of float or None
        Its values; None: a factor of two to both sides, within the bounds.
    points : int
        Number of values.
    progress : callable or None
        Told the fraction of the values that is done, from 0 to 1.

    Raises
    ------
    EvaluationError
        If there is one parameter only, or ``along`` is not fitted.
    """
    problem = found.problem
    if len(problem.names) < 2:
        raise EvaluationError("a valley needs two parameters or more")
    if along is None:
        along = problem.names[int(np.argmax(np.abs(found.directions[-1])))]
    if along not in problem.names:
        raise EvaluationError(f"{along} was not fitted; fitted were {', '.join(problem.names)}")
    i = problem.names.index(along)
    best = float(found.p[i])
    low, high = span or (min(best / 2, best * 2), max(best / 2, best * 2))
    low, high = max(low, float(problem.lower[i])), min(high, float(problem.upper[i]))
    if not low < high or points < 2:
        raise EvaluationError(f"span = {span}, points = {points}: give two values and two points")
    values = np.unique(np.append(np.linspace(low, high, points), np.clip(best, low, high)))
    centre = int(np.argmin(np.abs(values - best)))
    others = np.delete(np.arange(len(found.p)), i)
    rows: dict[int, Real] = {}
    for order in (range(centre, len(values)), range(centre - 1, -1, -1)):
        near = found.p
        for j in order:
            rows[j] = near = problem.minimised(_replaced(near, i, values[j]), others)[0]
            if progress is not None:
                progress(len(rows) / len(values))
    ordered = np.array([rows[j] for j in sorted(rows)])
    misfit = np.array([float(np.sum(problem.residuals(p) ** 2)) for p in ordered])
    return Valley(problem.names, along, ordered, misfit, found.p)


def _replaced(p: Real, i: int, value: float) -> Real:
    changed = p.copy()
    changed[i] = value
    return changed


# --- restitution --------------------------------------------------------------------------------


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

    With the 1R guide, which has no other mode, it is the restitution in the fundamental mode of
    the source, whatever the mechanism that was measured.  It is one number for all impacts of the
    record: where an impact leaves much in other modes, the next ones find it there, and the
    number is not that of the first (:func:`prbm.mechanics.modal.modal_restitution`).

    Parameters
    ----------
    mechanism : Mechanism
        The 1R guide, or any other with a stop.
    series : Series
        The record, from the release at t = 0.
    values : mapping
        Parameters that differ from the mechanism's: release, position of the stop, stiffness.
    output : str
        What was recorded; as :class:`Response` has it.
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
        If there is no impact in the record, or as :func:`fit` does.
    """
    impacts(series)
    name = f"{stop}.restitution"
    wanted = [Free(name, 0.0, 1.0), *free]
    target = Response(series, output, uncertainty)
    return fit(mechanism, wanted, target, values, progress=progress)
