"""The problem of a fit: parameters with bounds, targets, residuals and their derivatives."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ...base.errors import ParameterError, PrbmError
from ...base.names import unknown
from ...base.progress import Progress
from ...data.uncertainty import EvaluationError
from ...mechanics.arrays import Real, Whole
from ...mechanism.description import Mechanism
from .targets import RECORD_UNITS, Target, check_shape, of_mechanism

DIFFERENCE_STEP = 1e-4  # Step of central differences, as a share of a parameter's size.
BOUND_RTOL = 1e-6  # A parameter nearer to a bound than this share of the range is at the bound.
DEFAULT_RATIO = 10.0  # Default bounds are a tenth and ten times the start.
RANGE_SHARE = 0.1  # Size of a parameter near zero, as a share of the range of its bounds.
MODEL_RTOL = 1e-9  # Computation error of a model, relative to the data.
STEPS_MAX = 50  # Steps of the minimiser.
MISFIT_RTOL = 1e-9  # Change of S(p) that ends the minimiser, as a share of S(p).
PARAMETER_RTOL, GRADIENT_TOL = 1e-10, 1e-12  # Other conditions that end the minimiser.
PROGRESS_STEPS = 4.0  # Minimiser steps after which the remaining part of the progress is halved.


@dataclass(frozen=True)
class Free:
    """A parameter to fit.

    Parameters
    ----------
    name : str
        Name in the mechanism; or ``record.shift``, the time of the model at the time zero of a
        response [s]; or ``record.zero``, the reading of the sensor at zero output of the model.
    lower, upper : float or None
        Bounds; None: a tenth and ten times the start, within the mechanism's bounds, or these
        bounds of a dimensionless ratio, from 0 to 1.
    start : float or None
        Start value; None: the value of the mechanism.
    """

    name: str
    lower: float | None = None
    upper: float | None = None
    start: float | None = None


@dataclass(frozen=True)
class Problem:
    """Parameters p with bounds, targets, and all other values of a fit."""

    mechanism: Mechanism
    names: tuple[str, ...]
    start: Real
    lower: Real
    upper: Real
    targets: tuple[Target, ...]
    fixed: Mapping[str, float]

    @property
    def data(self) -> Real:
        """The concatenated data of all targets."""
        return np.concatenate([target.data for target in self.targets])

    @property
    def uncertainty(self) -> Real:
        """Standard uncertainties of the data; ones if they are to be estimated."""
        parts = [np.full(len(t.data), t.uncertainty or 1.0) for t in self.targets]
        return np.concatenate(parts)

    @property
    def known(self) -> bool:
        """Whether the uncertainty of the data is given."""
        return self.targets[0].uncertainty is not None

    @property
    def round_off(self) -> float:
        """Error of a value of the model by its computation, over its uncertainty."""
        return MODEL_RTOL * float(np.abs(self.data / self.uncertainty).max())

    def values(self, p: Real) -> dict[str, float]:
        """Return all values that differ from those of the mechanism."""
        return {**self.fixed, **dict(zip(self.names, map(float, p), strict=True))}

    def model(self, p: Real) -> Real:
        """Return the values of the model for all data.

        Raises
        ------
        EvaluationError
            If a motion or shape does not exist (the message names the parameters), or if the model
            of a target returns a wrong number of values.
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
            check_shape(target, part)
        return np.concatenate(parts)

    def residuals(self, p: Real) -> Real:
        """Return (model - data)/uncertainty."""
        result: Real = (self.model(p) - self.data) / self.uncertainty
        return result

    def size(self, p: Real) -> Real:
        """Return the size of each parameter: its value, or a share of its range near zero."""
        result: Real = np.maximum(np.abs(p), RANGE_SHARE * (self.upper - self.lower))
        return result

    def at_bounds(self, p: Real) -> NDArray[np.bool_]:
        """Return which parameters are at a bound, (k,)."""
        return self._near(p, np.column_stack([self.lower, self.upper]))

    def at_ends(self, p: Real) -> NDArray[np.bool_]:
        """Return which parameters are at a bound of the mechanism itself, (k,)."""
        ends = [_own_bounds(self.mechanism, name) for name in self.names]
        return self._near(p, np.array(ends))

    def _near(self, p: Real, places: Real) -> NDArray[np.bool_]:
        near = BOUND_RTOL * (self.upper - self.lower)[:, None]
        result: NDArray[np.bool_] = np.any(np.abs(p[:, None] - places) <= near, axis=1)
        return result

    def jacobian(self, p: Real, scale: Real, moved: Whole) -> Real:
        """Return central differences of the residuals by p/scale of the moved p, (m, j)."""
        columns = []
        for i in moved:
            ahead, behind = p.copy(), p.copy()
            ahead[i] = min(p[i] + DIFFERENCE_STEP * scale[i], self.upper[i])
            behind[i] = max(p[i] - DIFFERENCE_STEP * scale[i], self.lower[i])
            change = self.residuals(ahead) - self.residuals(behind)
            columns.append(change * scale[i] / (ahead[i] - behind[i]))
        return np.column_stack(columns)

    def minimised(
        self,
        start: Real,
        moved: Whole,
        progress: Progress | None = None,
        *,
        steps: int | None = None,
    ) -> tuple[Real, int, bool]:
        """Return the best parameters, the number of model evaluations, and whether it converged.

        Parameters
        ----------
        start : (k,)
            All parameters.
        moved : (j,) int
            Indices of the fitted parameters; the others are constant.
        progress : callable or None
            Called with a fraction that approaches 1: the number of steps is unknown.
        steps : int or None
            Largest number of steps; None: that of a fit.
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
                done = evaluations / (2 * len(moved) + 1)
                progress(1.0 - 0.5 ** (done / PROGRESS_STEPS))
            return self.residuals(all_of(z))

        def derivatives(z: Real) -> Real:
            nonlocal evaluations
            evaluations += 2 * len(moved)
            return self.jacobian(all_of(z), scale, moved)

        bounds = (self.lower[moved] / scale[moved], self.upper[moved] / scale[moved])
        found = least_squares(
            residuals, start[moved] / scale[moved], derivatives, bounds,
            xtol=PARAMETER_RTOL, ftol=MISFIT_RTOL, gtol=GRADIENT_TOL, max_nfev=steps or STEPS_MAX,
        )  # fmt: skip
        return all_of(found.x), evaluations, found.status > 0


def stated_problem(
    mechanism: Mechanism,
    free: Sequence[Free | str],
    targets: tuple[Target, ...],
    values: Mapping[str, float],
) -> Problem:
    """Return the checked problem of a fit.

    Raises
    ------
    EvaluationError
        If there is nothing to fit, bounds are invalid, a parameter is named twice, or only some
        uncertainties are known.
    ParameterError
        If a name is unknown.
    """
    if not free or not targets:
        raise EvaluationError("there is nothing to fit: give a parameter and a target")
    for target in targets:
        if not hasattr(target, "model"):
            raise EvaluationError(
                f"{target!r} must be a target: Frequency, Response, ForceDeflection, or an object "
                "with the attributes and methods of Target"
            )
    if len({target.uncertainty is None for target in targets}) > 1:
        raise EvaluationError(
            "the uncertainty is given for some targets only, and their weights are unknown: give "
            "it for all"
        )
    defaults = mechanism.values(of_mechanism(values))
    defaults |= {name: values.get(name, 0.0) for name in RECORD_UNITS}
    wanted = [one if isinstance(one, Free) else Free(one) for one in free]
    names = tuple(one.name for one in wanted)
    for name in names:
        if name not in defaults:
            raise ParameterError(unknown(name, defaults))
        if names.count(name) > 1:
            raise EvaluationError(f"{name} is listed twice among the parameters to fit")
    limits = np.array([_bounds(mechanism, one, defaults[one.name]) for one in wanted])
    start = [defaults[one.name] if one.start is None else one.start for one in wanted]
    lower, upper = limits.T
    return Problem(
        mechanism, names, np.clip(np.array(start, float), lower, upper), lower, upper, targets,
        {name: x for name, x in values.items() if name not in names},
    )  # fmt: skip


def _own_bounds(mechanism: Mechanism, name: str) -> tuple[float, float]:
    """Return the bounds of a parameter in its mechanism."""
    for parameter in mechanism.parameters:
        if parameter.name == name:
            return parameter.minimum, parameter.maximum
    return -math.inf, math.inf


def _bounds(mechanism: Mechanism, one: Free, default: float) -> tuple[float, float]:
    """Return the bounds of a parameter in a fit."""
    least, most = _own_bounds(mechanism, one.name)
    units = {parameter.name: parameter.unit for parameter in mechanism.parameters}
    start = default if one.start is None else one.start
    wide = sorted((start / DEFAULT_RATIO, start * DEFAULT_RATIO))
    if least >= 0.0 and most <= 1.0 and not units.get(one.name):  # The parameter is a ratio.
        wide = [least, most]
    lower = max(least, wide[0] if one.lower is None else one.lower)
    upper = min(most, wide[1] if one.upper is None else one.upper)
    if not (math.isfinite(lower) and math.isfinite(upper) and lower < upper):
        raise EvaluationError(
            f"{one.name}: the bounds {lower:g} to {upper:g} are not an interval; give "
            f"Free({one.name!r}, lower, upper)"
        )
    return lower, upper
