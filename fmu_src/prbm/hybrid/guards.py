"""Guards: scalars whose fall through zero is an event, and the location of their zeros in a step.

A guard z(equations, contact, t, y) is positive before its event.  Each detection function looks
at a step and returns the time at which the guard of one contact falls through zero, or None.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..base.errors import SimulationError
from ..base.tolerances import (
    CONSTRAINT_RTOL,
    EVENT_CORRECTION_RTOL,
    EVENT_CORRECTIONS_MAX,
    EVENT_TIME_RTOL,
    FRICTION_EXCESS_RTOL,
    FROZEN_FORCE_RTOL,
    GUARD_INTERVALS,
    LOCATION_ITERATIONS_MAX,
    PHASE_RTOL,
    REFERENCE_SPEED_RTOL,
    RELEASE_WATCH_FACTOR,
)
from ..mechanics.arrays import Complex, Real
from ..mechanics.contact_state import Phase
from ..mechanics.dynamics import Equations, Evaluation
from .arc import Arc
from .configuration import Scales

Guard = Callable[[Equations, int, float, Real], float]
Scalar = Callable[[float], float]


# --- guards -----------------------------------------------------------------------------------


def gap(equations: Equations, stop: int, t: float, y: Real) -> float:
    """Return the gap of a stop [m]."""
    n = equations.n
    e = equations.system.directions(y[:n])
    return float(equations.gaps(t, e, y[2 * n + 2 :])[stop])


def indentation(equations: Equations, stop: int, t: float, y: Real) -> float:
    """Return the indentation of a stop [m]."""
    return -gap(equations, stop, t, y)


def switching(equations: Equations, stop: int, t: float, y: Real) -> float:
    """Return the margin of the phase of a pressed stop, relative to its law [-].

    A pressed contact begins to rise when its rate exceeds the reference speed, or becomes free when
    its damping exceeds the elastic force.
    """
    touching = equations.contacts.touching[stop]
    assert touching is not None
    rate = -_gap_rate(equations, stop, t, y)
    if touching.phase is Phase.RISING:
        e, n = equations.system.directions(y[: equations.n]), equations.n
        at = equations.at(t, y)
        return -float(equations.gap_accelerations(t, e, y[n : 2 * n], at.a, at.pressure)[stop])
    return switching_margin(equations, stop, rate)


def switching_margin(equations: Equations, stop: int, rate: float) -> float:
    """Return the margin of a pressed or free contact for the rate of its indentation [m/s]."""
    touching = equations.contacts.touching[stop]
    assert touching is not None
    ratio = equations.compliant.laws[stop].damping_ratio(touching, rate)
    if touching.phase is Phase.FREE:
        return PHASE_RTOL - ratio
    return min(PHASE_RTOL + ratio, 1.0 + REFERENCE_SPEED_RTOL - rate / touching.reference_speed)


def strain(equations: Equations, spring: int, t: float, y: Real) -> float:
    """Return the elongation of a spring to the side on which it acts [m]."""
    k = spring - len(equations.contacts.modes)
    springs = equations.elements.springs
    assert springs is not None
    lengths = springs.lengths(equations.system.directions(y[: equations.n]))[1]
    return springs.laws[k].side * (float(lengths[k]) - springs.laws[k].free_length)


def slackness(equations: Equations, spring: int, t: float, y: Real) -> float:
    """Return the distance of a slack spring from its free length [m]."""
    return -strain(equations, spring, t, y)


def strain_rate(equations: Equations, spring: int, t: float, y: Real) -> float:
    """Return the rate of the elongation of a spring to the side on which it acts [m/s]."""
    n, k, springs = equations.n, spring - len(equations.contacts.modes), equations.elements.springs
    assert springs is not None
    rates = springs.length_rates(equations.system.directions(y[:n]), y[n : 2 * n])
    return springs.laws[k].side * float(rates[k])


def stop_force(equations: Equations, stop: int, t: float, y: Real) -> float:
    """Return the normal force of a held stop [N]."""
    return _stop_force(equations, stop, equations.at(t, y))


def friction_margin(equations: Equations, contact: int, t: float, y: Real) -> float:
    """Return the limit of friction minus the friction force of a sticking contact [N]."""
    e = equations.system.directions(y[: equations.n])
    return _friction_margin(equations, contact, e, equations.at(t, y))


def guide_force(equations: Equations, contact: int, t: float, y: Real) -> float:
    """Return the force of a slipping guide to its side [N]."""
    return equations.side_force(contact, equations.at(t, y).lam)


def slip_speed(equations: Equations, contact: int, t: float, y: Real) -> float:
    """Return the speed of a slipping contact in its direction [m/s]."""
    n = equations.n
    e = equations.system.directions(y[:n])
    return equations.contacts.modes[contact].slip * equations.slip_rate(contact, e, y[n : 2 * n])


def _stop_force(equations: Equations, stop: int, evaluation: Evaluation) -> float:
    force = equations.side_force(stop, evaluation.lam)
    depth = equations.contacts.depth(stop)
    if not depth:
        return force
    elastic = equations.compliant.laws[stop].elastic_force(depth)
    return FROZEN_FORCE_RTOL * elastic - abs(force - elastic)


def _friction_margin(
    equations: Equations, contact: int, e: Complex, evaluation: Evaluation
) -> float:
    friction, limit = equations.friction(contact, e, evaluation.lam, evaluation.pressure)
    return (1.0 + FRICTION_EXCESS_RTOL) * limit - abs(friction)


# --- a step as the guards see it --------------------------------------------------------------


@dataclass(frozen=True)
class StepView:
    """The quantities that guards evaluate in a step, each computed once and on demand.

    Parameters
    ----------
    scales : Scales
        Scales of the mechanism.
    equations : Equations
        Equations of motion in the step.
    arc : Arc
        The step.
    forces : (stages, r)
        Constraint forces of all stages but the first [N].
    cuts : dict
        The step that ends close to the impact that was located last, by the index of its stop.
    """

    scales: Scales
    equations: Equations
    arc: Arc
    forces: Real
    cuts: dict[int, Arc] = field(default_factory=dict)

    def located(self, stop: int, t: float) -> Arc:
        """Return the step to a time close to an impact, and keep it for this impact."""
        self.cuts.clear()
        return self.cuts.setdefault(stop, self.arc.cut(self.equations.rate, t)[0])

    def cut(self, stop: int, t: float) -> Arc:
        """Return the step that was kept for an impact, or else the step to its time."""
        return self.cuts.get(stop) or self.arc.cut(self.equations.rate, t)[0]

    @cached_property
    def samples(self) -> tuple[Real, Complex, Real, Real]:
        """Times (w + 1,), directions, rates (w + 1, n) and extra states at samples of the step."""
        n, (times, y) = self.equations.n, self.arc.samples()
        e = self.equations.system.directions(y[:, :n])
        return times, e, y[:, n : 2 * n], y[:, 2 * n + 2 :]

    @cached_property
    def gaps_and_rates(self) -> tuple[Real, Real]:
        """Gaps and their rates at the samples, (w + 1, s) [m], [m/s]."""
        times, e, v, extras = self.samples
        equations = self.equations
        return equations.gaps(times, e, extras), equations.gap_rates(times, e, v, extras)

    @cached_property
    def evaluations(self) -> list[tuple[float, Complex, Evaluation]]:
        """Times, directions and evaluations at start, middle and end of the step."""
        n, arc = self.equations.n, self.arc
        result = []
        for t in (arc.start, arc.start + arc.h / 2, arc.start + arc.h):
            y = arc.at(t)
            evaluation = self.equations.at(t, y)
            result.append((t, self.equations.system.directions(y[:n]), evaluation))
        return result

    def closing(self, guard: Guard, stop: int) -> tuple[Real, Real]:
        """Return a gap, an indentation or a strain at the samples, and its rate there."""
        if guard in (strain, slackness):
            times, y = self.arc.samples()
            at = [(self.equations, stop, t, row) for t, row in zip(times, y, strict=True)]
            return np.array([guard(*x) for x in at]), np.array([RATES[guard](*x) for x in at])
        gaps, rates = self.gaps_and_rates
        sign = 1.0 if guard is gap else -1.0
        return sign * gaps[:, stop], sign * rates[:, stop]

    @property
    def event_time(self) -> float:
        """Tolerance of the search for the time of an event [s]."""
        return EVENT_TIME_RTOL * self.arc.h

    def along(self, guard: Guard, contact: int, sign: float = 1.0) -> Scalar:
        """Return a guard of a contact, times a sign, as a function of time."""
        return lambda t: sign * guard(self.equations, contact, t, self.arc.at(t))


def open_stops(view: StepView) -> Sequence[int]:
    """Return the contacts that are watched for impacts."""
    return view.equations.contacts.open_stops


def pressed_stops(view: StepView) -> Sequence[int]:
    """Return the compliant stops that are watched for the end and the phases of their contacts."""
    return view.equations.pressed


def slipping_contacts(view: StepView) -> Sequence[int]:
    """Return the contacts that are watched for reversals."""
    return view.equations.slipping_points + view.equations.slipping_rows


def slipping_guides(view: StepView) -> Sequence[int]:
    """Return the guides that are watched for changes of their side."""
    return view.equations.slipping_guides


def sticking_contacts(view: StepView) -> Sequence[int]:
    """Return the contacts that are watched for slip."""
    return view.equations.sticking


def releasing_stops(view: StepView) -> Sequence[int]:
    """Return the held stops if a force comes close to zero at a stage of the step, else none."""
    equations = view.equations
    frozen = any(map(equations.contacts.depth, equations.held))
    if not equations.held or equations.sticking or frozen:
        return equations.held
    held = view.forces[:, equations.first_hold :]
    near = held.min(axis=0) <= RELEASE_WATCH_FACTOR * held.max(axis=0)
    return equations.held if bool(near.any()) else ()


# --- detection --------------------------------------------------------------------------------


def closing_time(view: StepView, guard: Guard, stop: int) -> float | None:
    """Return when a gap or, at the end of a contact, an indentation closes: z > 0 -> z <= 0.

    Springs that act on one side have strains for gaps.

    A gap that is opening at the start of an interval can close only after its apex.  Therefore the
    last impact, after which the gap is round-off of either sign, is not found again.  A gap that
    dips below zero within an interval is found by the signs of its rates.
    """
    gaps, rates = view.closing(guard, stop)
    for j in range(GUARD_INTERVALS):
        if gaps[j + 1] > 0.0 and not rates[j] < 0.0 < rates[j + 1]:
            continue
        t = _closing_time_between(view, guard, stop, j)
        if t is not None:
            return t
    return None


def _closing_time_between(view: StepView, guard: Guard, stop: int, j: int) -> float | None:
    """Return when a gap closes in an interval at whose end, or within which, it is not positive."""
    z, depth = view.along(guard, stop), view.scales.touching
    a, b = view.samples[0][j : j + 2].tolist()
    (gap_a, gap_b), (rate_a, rate_b) = (x[j : j + 2] for x in view.closing(guard, stop))
    closing_rate = RATES[guard]
    if abs(rate_a) <= view.scales.zero_speed and gap_a <= _round_off(view):
        # The stop was released too early, and is pressed again.
        pressed = gap_b < min(gap_a - _round_off(view), -depth)
        return _deep_time(view, z, a, b) if pressed else None
    if rate_a > 0.0:
        if rate_b >= 0.0:
            return None  # The gap opens throughout the interval.
        a = fall_time(view.along(closing_rate, stop), a, b, view.event_time)
        if z(a) <= 0.0:
            return a  # The flight is lower than the resolution of a position.
    elif gap_a <= 0.0:
        # This is an impact only if the penetration increases, at once or over several intervals.
        if gap_b < gap_a - depth:
            return float(a)
        return _deep_time(view, z, a, b) if gap_b < min(gap_a, -depth) else None
    if rate_a < 0.0 < rate_b:
        b = fall_time(view.along(closing_rate, stop, sign=-1.0), a, b, view.event_time)
        if z(b) > 0.0:
            return None
    t = fall_time(z, a, b, view.event_time)
    return _corrected_time(view, guard, stop, t, earliest=a)


def _deep_time(view: StepView, z: Scalar, a: float, b: float) -> float:
    """Return when a penetration -z shows that a stop is pressed, between two times."""
    return fall_time(lambda t: z(t) + view.scales.touching, a, b, view.event_time)


def _round_off(view: StepView) -> float:
    """Return the largest residual gap of a closed stop after a projection [m]."""
    return CONSTRAINT_RTOL * view.scales.length


def _gap_rate(equations: Equations, stop: int, t: float, y: Real) -> float:
    """Return the rate of the gap of a stop [m/s]."""
    n = equations.n
    e = equations.system.directions(y[:n])
    return float(equations.gap_rates(t, e, y[n : 2 * n], y[2 * n + 2 :])[stop])


def indentation_rate(equations: Equations, stop: int, t: float, y: Real) -> float:
    """Return the rate of the indentation of a stop [m/s]."""
    return -_gap_rate(equations, stop, t, y)


def slackness_rate(equations: Equations, spring: int, t: float, y: Real) -> float:
    """Return the rate of the distance of a slack spring from its free length [m/s]."""
    return -strain_rate(equations, spring, t, y)


RATES: dict[Guard, Guard] = {
    gap: _gap_rate, indentation: indentation_rate, strain: strain_rate, slackness: slackness_rate,
}  # fmt: skip
"""Rates of the guards whose zeros :func:`closing_time` finds."""


def _corrected_time(view: StepView, guard: Guard, stop: int, t: float, earliest: float) -> float:
    """Return the time at which a gap closes, from the approximate time t by the dense output.

    The gap is that of a step that ends close to this time, see :meth:`prbm.hybrid.arc.Arc.cut`.
    The time is never before the apex: the gap is opening there, so that the impact would have no
    effect and be located again and again.
    """
    equations = view.equations
    closing_rate = RATES[guard]
    if t <= view.arc.start:
        return t
    cut = view.located(stop, t)
    for _ in range(EVENT_CORRECTIONS_MAX):
        y = equations.project(t, cut.at(t))
        size, rate = guard(equations, stop, t, y), closing_rate(equations, stop, t, y)
        if rate >= 0.0 or abs(size) <= EVENT_TIME_RTOL * cut.h * abs(rate):
            break
        change = -size / rate
        if abs(change) > EVENT_CORRECTION_RTOL * cut.h:
            break  # At grazing, the time by the dense output is better.
        t = max(earliest, t + change)
    return t


def reversal_time(view: StepView, guard: Guard, contact: int) -> float | None:
    """Return when the sliding velocity of a contact falls through zero.

    When slip begins, and while contacts that stick hold this one, the velocity is round-off of
    either sign.  Then it counts only if it exceeds that at the start and what an acceleration of
    round-off adds within the step: as soon as it is no round-off, or else after the first interval.
    """
    equations, (times, e, v, _) = view.equations, view.samples
    rows, i = equations.slip_rows(contact)
    speeds = equations.contacts.modes[contact].slip * rows.rates(e, v)[:, i]
    zero = view.scales.zero_speed
    begins = bool(speeds[0] <= zero)
    residual = min(abs(float(speeds[0])), zero)  # Until the end of the step is projected.
    noise = residual + view.scales.zero_acceleration * view.arc.h if begins else 0.0
    z = view.along(guard, contact)
    for j in range(int(begins), GUARD_INTERVALS):
        if speeds[j] > noise and speeds[j + 1] <= 0.0:
            return fall_time(z, times[j], times[j + 1], view.event_time)
    if not begins or speeds[-1] >= -noise:
        return None
    if speeds[0] < -zero:
        return float(times[1])
    return fall_time(lambda t: z(t) + 2.0 * zero, times[0], times[1], view.event_time)


def switching_time(view: StepView, guard: Guard, stop: int) -> float | None:
    """Return when the phase of a pressed stop changes."""
    z, arc = view.along(guard, stop), view.arc
    times = (arc.start, arc.start + arc.h / 2, arc.start + arc.h)
    return _first_fall(view, z, [(t, z(t)) for t in times])


def release_time(view: StepView, guard: Guard, stop: int) -> float | None:
    """Return when the force of a held stop falls to zero."""
    seen = [(t, _stop_force(view.equations, stop, at)) for t, _, at in view.evaluations]
    return _first_fall(view, view.along(guard, stop), seen)


def side_time(view: StepView, guard: Guard, contact: int) -> float | None:
    """Return when the force of a slipping guide changes its side by more than round-off.

    Directly after a change it may be round-off of either sign, which counts only if it persists.
    """
    equations, slack = view.equations, view.scales.zero_force
    seen = [(t, equations.side_force(contact, at.lam) + slack) for t, _, at in view.evaluations]
    if seen[0][1] <= 0.0:
        seen = seen[1:]
        if seen[0][1] <= 0.0:
            return seen[0][0]
    z = view.along(guard, contact)
    return _first_fall(view, lambda t: z(t) + slack, seen)


def slip_time(view: StepView, guard: Guard, contact: int) -> float | None:
    """Return when a sticking contact reaches the limit of friction."""
    equations = view.equations
    seen = [(t, _friction_margin(equations, contact, e, at)) for t, e, at in view.evaluations]
    return _first_fall(view, view.along(guard, contact), seen)


# --- location ---------------------------------------------------------------------------------


def _first_fall(view: StepView, z: Scalar, seen: Sequence[tuple[float, float]]) -> float | None:
    """Return when z first falls to zero, from pairs of a time and the value of z there."""
    for (a, before), (b, after) in pairwise(seen):
        if after <= 0.0:
            return fall_time(z, a, b, view.event_time) if before > 0.0 else a
    return None


def fall_time(z: Scalar, a: float, b: float, tolerance: float) -> float:
    """Return when z falls to zero between a, where it is positive, and b, where it is not.

    If round-off has changed the sign at one end of the interval, the result is that end.  The error
    is at most the tolerance, in the unit of the arguments of z, or their round-off.

    Raises
    ------
    SimulationError
        If the search does not converge.

    Examples
    --------
    >>> round(fall_time(lambda t: 1.0 - t**2, 0.0, 4.0, 1e-13), 12)
    1.0
    """
    if z(a) <= 0.0:
        return float(a)
    if z(b) > 0.0:
        return float(b)
    from scipy.optimize import brentq  # imported here: it takes 0.15 s

    try:
        return float(brentq(z, a, b, xtol=tolerance, maxiter=LOCATION_ITERATIONS_MAX))
    except SimulationError:
        raise
    except (RuntimeError, ValueError):
        raise SimulationError(
            "the search did not converge; check the inputs and parameters"
        ) from None
