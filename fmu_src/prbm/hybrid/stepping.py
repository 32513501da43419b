"""Steps of the integration, their errors and their sizes.

Sources
-------
.. [1] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.4.
.. [2] E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.2 (memory).
.. [3] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.10 (two
   estimates of the error).
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..base.errors import SimulationError
from ..base.tolerances import (
    CONTACT_ERROR_FACTOR,
    FIRST_STEP_EXPONENT,
    FIRST_STEP_FACTOR,
    FIRST_STEP_MIN_RTOL,
    INDENTATION_MIN_RTOL,
    LATE_TIME_RTOL,
    PROJECTION_FACTOR,
    STEP_ERROR_FACTOR,
    STEP_ERROR_MIN,
    STEP_GROWTH_MAX,
    STEP_MEMORY_EXPONENT,
    STEP_MIN_RTOL,
    STEP_ROUNDING_FACTOR,
    STEP_SAFETY_FACTOR,
    STEP_SHRINK_MIN,
    STEP_TREND_FACTOR,
)
from ..mechanics.arrays import Real
from ..mechanics.compliant_stops import CompliantState
from ..mechanics.dynamics import Equations, Evaluation
from .configuration import Configuration, Scales
from .front import Front
from .runge_kutta import TSITOURAS_PAPAKOSTAS as PAIR
from .runge_kutta import stages
from .stability import FastestMode
from .walls import step_limit

REJECTED_EXPONENT = 1.0 / PAIR.step_order
ACCEPTED_EXPONENT = REJECTED_EXPONENT - STEP_TREND_FACTOR * STEP_MEMORY_EXPONENT


@dataclass(frozen=True)
class StepSizeController:
    """The size of the next step, from the errors of the steps so far.

    Parameters
    ----------
    h : float
        Size of the next step [s]; 0: not chosen yet.
    last_error : float
        Error of the last accepted step, divided by the allowed error.
    growth : float
        Largest factor by which the next step may change the size; 1 after a rejected step.

    Examples
    --------
    >>> controller = StepSizeController(h=1.0)
    >>> controller.next(error=2.0**8).h  # 0.425, rounded
    0.4375
    """

    h: float = 0.0
    last_error: float = STEP_ERROR_MIN
    growth: float = STEP_GROWTH_MAX

    def next(self, error: float) -> "StepSizeController":
        """Return the controller after a step with an error relative to the allowed error.

        A step with an error above 1 must be repeated with the smaller size; the size does not grow
        after the repeated step.
        """
        if not error <= 1.0:
            optimal = (
                STEP_SAFETY_FACTOR * error**-REJECTED_EXPONENT if math.isfinite(error) else 0.0
            )
            h = rounded_step(self.h * max(STEP_SHRINK_MIN, optimal))
            return replace(self, h=h, growth=1.0)
        error = max(error, STEP_ERROR_MIN)
        optimal = STEP_SAFETY_FACTOR * error**-ACCEPTED_EXPONENT
        ratio = min(self.growth, optimal * self.last_error**STEP_MEMORY_EXPONENT)
        return StepSizeController(rounded_step(self.h * max(STEP_SHRINK_MIN, ratio)), error)


def rounded_step(h: float) -> float:
    """Return a step size rounded to four binary digits.

    Without rounding, round-off in the errors would grow, because a step size affects the next
    error.  With it, round-off rarely changes a step size.

    Examples
    --------
    >>> rounded_step(1.06), rounded_step(1.07)
    (1.0, 1.125)
    """
    shifted = STEP_ROUNDING_FACTOR * h
    return shifted - (shifted - h)


class Step(NamedTuple):
    """A computed step, not yet accepted.

    Parameters
    ----------
    h : float
        Size [s].
    k : (stages, 2 n + 2)
        Rates of the stages.
    y : (2 n + 2,)
        State at the end.
    error : float
        Error divided by the allowed error.
    forces : (stages - 1, r)
        Constraint forces of all stages but the first [N].
    last : Evaluation
        Evaluation at the end, before the projection.
    """

    h: float
    k: Real
    y: Real
    error: float
    forces: Real
    last: Evaluation


def take_step(
    configuration: Configuration,
    front: Front,
    k1: Real,
    controller: StepSizeController,
    fastest: FastestMode,
) -> tuple[Step, StepSizeController]:
    """Return a projected step within the tolerance, and the controller of the next.

    Parameters
    ----------
    configuration : Configuration
        Scales, tolerance and the fixed step, if there is one.
    front : Front
        State at the start.
    k1 : (2 n + 2,)
        Rates at the start.
    controller : StepSizeController
        Controller with the size of this step.
    fastest : FastestMode
        The mode that limits the step.

    Raises
    ------
    SimulationError
        If the step size vanishes, or a fixed step is far too long.
    """
    t, y, equations = front.time, front.y, front.equations
    if configuration.step:
        return fixed_step(configuration, front, k1), controller
    longest = min(configuration.scales.step_max, fastest.longest_step(equations))
    wanted = rounded_step(min(controller.h or first_step(configuration, y, k1), longest))
    h = min(wanted, step_limit(front.inputs.walls, t))
    controller = StepSizeController(h, controller.last_error)
    while True:
        check_size(configuration.scales, t, controller.h)
        try:
            step = compute_step(configuration, equations, t, y, controller.h, k1)
            if step.error <= 1.0:
                step = projected(configuration, equations, t, step)
        except SimulationError:  # A stage or the projection fails: the step is far too long.
            controller = controller.next(math.inf)
            continue
        controller = controller.next(step.error)
        if step.error <= 1.0:
            # A step that was shortened by a wall does not shorten the next one.
            if step.h == h < wanted and controller.h < wanted:
                controller = replace(controller, h=wanted)
            return step, controller


def fixed_step(configuration: Configuration, front: Front, k1: Real) -> Step:
    """Return a step of the fixed size.

    Raises
    ------
    SimulationError
        If the error is larger than the state, or a stage or the projection fails.
    """
    t = front.time
    h = min(configuration.step or 0.0, step_limit(front.inputs.walls, t))
    check_size(configuration.scales, t, h)
    step = compute_step(configuration, front.equations, t, front.y, h, k1)
    if not step.error * STEP_ERROR_FACTOR * configuration.tolerance <= 1.0:
        raise SimulationError(
            f"the fixed step of {h:g} s is too long at t = {t:.9g} s: its error is larger than "
            "the state; shorten it"
        )
    return projected(configuration, front.equations, t, step)


def check_size(scales: Scales, t: float, h: float) -> None:
    """Reject a step size h [s] that is too small at a time t [s].

    Raises
    ------
    SimulationError
        If it is below ``STEP_MIN_RTOL`` of the period, or smaller than the round-off of t.
    """
    late = math.ulp(t) > LATE_TIME_RTOL * scales.time
    if not late and (t + h == t or h < STEP_MIN_RTOL * scales.time):
        raise SimulationError(
            f"the step size fell to {h:.3g} s at t = {t:.9g} s: the motion is too "
            "fast for the model, or links of a loop form a straight line, beyond which they cannot "
            "move; check the inputs and parameters, or add damping.beta"
        )
    if t + h == t:
        raise SimulationError(
            f"at t = {t:.9g} s a step of {h:.3g} s is smaller than the rounding error of the time: "
            "start the simulation at a time nearer to zero"
        )


def first_step(configuration: Configuration, y: Real, k1: Real) -> float:
    """Return a first step size from the size of the rates [1, II.4] [s]."""
    core = 2 * configuration.system.n + 2
    rate = k1[:core] / configuration.scales.of_state(y[:core])
    size = math.sqrt(float(rate @ rate) / len(rate))
    accuracy = math.pow(configuration.tolerance, FIRST_STEP_EXPONENT)
    scales, change = configuration.scales, FIRST_STEP_FACTOR * accuracy
    if change >= size * scales.step_max:
        return scales.step_max
    return max(change / size, FIRST_STEP_MIN_RTOL * scales.time)


def compute_step(
    configuration: Configuration, equations: Equations, t: float, y: Real, h: float, k1: Real
) -> Step:
    """Return the step of size h from the state y with the rates k1 at time t.

    Raises
    ------
    SimulationError
        If the equations are singular at one of its stages.
    """
    evaluations: list[Evaluation] = []

    def rate(t: float, y: Real) -> Real:
        result, evaluation = equations.rate_and_evaluation(t, y)
        evaluations.append(evaluation)
        return result

    with np.errstate(over="ignore", invalid="ignore"):
        k, y1 = stages(PAIR, rate, t, y, h, k1)
        core = 2 * equations.n + 2
        error = step_error(configuration.scales, h, k[:, :core], y[:core], y1[:core])
        if equations.pressed:
            contacts = contact_error(configuration.scales, equations, h, k, y, y1)
            error = max(error, contacts / CONTACT_ERROR_FACTOR)
    error /= STEP_ERROR_FACTOR * configuration.tolerance
    forces = np.array([evaluation.lam for evaluation in evaluations])
    return Step(h, k, y1, error, forces, evaluations[-1])


def projected(configuration: Configuration, equations: Equations, t: float, step: Step) -> Step:
    """Return a step from time t [s] with its end projected onto the constraints.

    Raises
    ------
    SimulationError
        If the loops cannot be closed, or as :func:`check_projection`.
    """
    y = equations.project_near(t + step.h, step.y, step.last.factors)
    check_projection(configuration, t + step.h, step.y, y)
    return step._replace(y=y)


def check_projection(configuration: Configuration, t: float, y: Real, projected: Real) -> None:
    """Reject a projection at time t [s] that changes a state y (2 n + 2,) too much.

    Near a shape in which the loops do not determine the motion, the projection turns small errors
    into large changes of the velocities.  The kinetic energy changes by the square of their
    relative change, which the limit keeps below the tolerance.  Fixed steps have no limit.

    Raises
    ------
    SimulationError
        If the change relative to the state is too large.
    """
    core = 2 * configuration.system.n + 2
    change = error_norm(configuration.scales, (projected - y)[:core], y[:core], projected[:core])
    largest = PROJECTION_FACTOR * math.sqrt(configuration.tolerance)
    if not (change <= largest or configuration.step):
        raise SimulationError(
            f"at t = {t:.9g} s closing the loops would change the motion by {change:.3g} of its "
            f"size, more than {largest:.3g}: links of a loop form a straight line, where the "
            "motion is not unique; change the inputs, the stops or the release so that the "
            "mechanism does not pass this shape"
        )


def closed(configuration: Configuration, equations: Equations, t: float, y: Real) -> Real:
    """Return a state y (2 n + 2,) at time t [s], projected onto the constraints.

    Raises
    ------
    SimulationError
        As :func:`check_projection`.
    """
    projected = equations.project(t, y)
    check_projection(configuration, t, y, projected)
    return projected


def step_error(scales: Scales, h: float, k: Real, y: Real, y1: Real) -> float:
    """Return the error of a step of size h from y to y1 with the stages k, in units of the scales.

    The differences to solutions of orders 5 and 3, here fine and coarse, fall with h^6 and h^4.
    The estimate fine^2/sqrt(fine^2 + coarse^2) falls with h^8, as the error of the solution of
    order 7 does [3].  On linear oscillations it is 0.35 to 1.8 times that error, up to the limit of
    stability.
    """
    scale = scales.of_state(np.maximum(np.abs(y), np.abs(y1)))
    fine = root_mean_square(h * PAIR.error.dot(k) / scale)
    coarse = root_mean_square(h * PAIR.coarse_error.dot(k) / scale)
    size = math.sqrt(fine * fine + coarse * coarse)
    return fine * fine / size if size > 0.0 else size


def contact_error(
    scales: Scales, equations: Equations, h: float, k: Real, y: Real, y1: Real
) -> float:
    """Return the error of the indentations of pressed stops and of their rates, as `step_error`.

    The scales are the reference speed of the contact and the largest of the indentation, the
    distance at this speed in the step, and a fraction of the size of the mechanism.
    """
    n, own, largest = equations.n, equations.compliant, 0.0
    e = equations.system.directions(y[:n])
    rows = equations.system.gap_rows.jacobian(e)
    fine, coarse = h * (PAIR.error @ k), h * (PAIR.coarse_error @ k)
    for i in equations.pressed:
        touching = equations.contacts.touching[i]
        assert touching is not None
        speed = touching.reference_speed
        recoil = 2 * n + 2 + own.index(i, CompliantState.RECOIL)
        depth = max(
            abs(float(rows[i] @ (y1[:n] - y[:n]))), speed * h, INDENTATION_MIN_RTOL * scales.length
        )
        sizes = []
        for difference in (fine, coarse):
            d = (rows[i] @ difference[:n] + difference[recoil]) / depth
            rate = (rows[i] @ difference[n : 2 * n] + difference[recoil + 1]) / speed
            sizes.append(math.hypot(float(d), float(rate)))
        size = math.hypot(*sizes)
        largest = max(largest, sizes[0] ** 2 / size if size > 0.0 else size)
    return largest


def error_norm(scales: Scales, difference: Real, y: Real, y1: Real) -> float:
    """Return the root mean square of an error (2 n + 2,), relative to the larger state."""
    return root_mean_square(difference / scales.of_state(np.maximum(np.abs(y), np.abs(y1))))


def root_mean_square(x: Real) -> float:
    """Return the root of the mean square of the elements of an array."""
    return math.sqrt(float(x.dot(x)) / len(x))
