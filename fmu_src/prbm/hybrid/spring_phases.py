"""Phases of springs that act on one side: their guards, changes and first values.

The law is that of :mod:`prbm.mechanics.elements`.  A slack spring acts from the time at which it
passes its free length.  It ceases to act when its force falls to zero: at the free length or, with
a damper, before; then it lags until it is slack or its force rises again.  With a damper, the force
jumps when the spring begins to act; in all other changes it is continuous.  Rates do not jump, so
that a change never causes the opposite one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.tolerances import CONSTRAINT_RTOL, GUARD_INTERVALS, PHASE_RTOL, ZERO_SPEED_RTOL
from ..mechanics.arrays import Real
from ..mechanics.contact_state import SpringPhase
from ..mechanics.dynamics import Equations
from ..mechanics.elements import spring_tension
from .configuration import Configuration
from .front import Front
from .guards import Guard, StepView, closing_time, fall_time, slackness, strain, strain_rate


def force(equations: Equations, spring: int, t: float, y: Real) -> tuple[float, float]:
    """Return the force s (T + c l') with which a spring would act, and its round-off [N].

    The second value is a fraction of the sum of both parts, and the force by the round-off of the
    length and of its rate.  The length of a spring on parts that cannot move against each other is
    only round-off.
    """
    springs, k = equations.elements.springs, spring - len(equations.contacts.modes)
    assert springs is not None
    law = springs.laws[k]
    elastic = spring_tension(law._replace(side=0), strain(equations, spring, t, y))
    damper = law.damping * strain_rate(equations, spring, t, y)
    near, slow = resolution(equations, y)
    least = law.stiffness * near + law.damping * slow
    return elastic + damper, PHASE_RTOL * (abs(elastic) + abs(damper)) + least


def resolution(equations: Equations, y: Real) -> tuple[float, float]:
    """Return the round-off of the length of a spring [m], and that of its rate [m/s]."""
    n, size = equations.n, equations.system.length
    fastest = float(np.abs(y[n : 2 * n]).max(initial=0.0))
    return CONSTRAINT_RTOL * size, ZERO_SPEED_RTOL * size * fastest


def pull(equations: Equations, spring: int, t: float, y: Real) -> float:
    """Return the force with which a damped spring acts, plus its round-off [N]."""
    return sum(force(equations, spring, t, y))


def delay(equations: Equations, spring: int, t: float, y: Real) -> float:
    """Return minus the force that a lagging spring would have, plus its round-off [N]."""
    acting, rounding = force(equations, spring, t, y)
    return rounding - acting


def guards(equations: Equations, spring: int) -> tuple[Guard, ...]:
    """Return the guards of a spring in its phase: strains, and forces if it has a damper."""
    springs, k = equations.elements.springs, spring - len(equations.contacts.modes)
    assert springs is not None
    phase = equations.contacts.springs[k]
    if phase is SpringPhase.SLACK:
        return (slackness,)
    if phase is SpringPhase.LAGGING:
        return (delay, strain)
    return (pull,) if springs.laws[k].damping else (strain,)


def action(equations: Equations, spring: int, t: float, y: Real) -> float:
    """Return the least of the guards of a spring [m], [N]."""
    return min(guard(equations, spring, t, y) for guard in guards(equations, spring))


def watched(view: StepView) -> Sequence[int]:
    """Return the springs that act on one side, numbered after the contacts."""
    first, springs = len(view.equations.contacts.modes), view.equations.elements.springs
    if springs is None or not springs.one_sided:
        return ()
    return [first + k for k, law in enumerate(springs.laws) if law.side]


def action_time(view: StepView, guard: Guard, spring: int) -> float | None:
    """Return when a spring begins or ceases to act in a step, or is slack after it lagged."""
    times = [
        closing_time(view, one, spring)
        if one in (strain, slackness)
        else _force_time(view, one, spring)
        for one in guards(view.equations, spring)
    ]
    return min((t for t in times if t is not None), default=None)


def _force_time(view: StepView, guard: Guard, spring: int) -> float | None:
    """Return when the guard of a force falls in a step.

    At the start of the phase it may be round-off of either sign, which counts only if it persists.
    A fall between two samples counts on projected states only, as the interpolation changes
    constant lengths.
    """
    times, states = view.arc.samples()
    equations = view.equations
    z = [guard(equations, spring, t, y) for t, y in zip(times, states, strict=True)]
    begins = z[0] <= 0.0
    for j in range(int(begins), GUARD_INTERVALS):
        if z[j + 1] <= 0.0 < z[j]:
            at = times[j + 1]
            z[j + 1] = guard(equations, spring, at, equations.project(at, states[j + 1]))
        if z[j + 1] <= 0.0 < z[j]:
            return fall_time(view.along(guard, spring), times[j], times[j + 1], view.event_time)
    return float(times[1]) if begins and z[-1] < 0.0 else None


# --- changes ----------------------------------------------------------------------------------


def switched(front: Front, spring: int) -> Front:
    """Return the front with the phase of a spring after its guard has fallen.

    The force of a lagging spring is that of the damper where it is slack, and zero where it acts
    again.  The time of the event is not exact: the force that is nearer counts.
    """
    equations, contacts, t, y = front.equations, front.contacts, front.time, front.y
    k, springs = spring - len(contacts.modes), equations.elements.springs
    assert springs is not None
    damper = springs.laws[k].damping * strain_rate(equations, spring, t, y)
    strained, (acting, _) = strain(equations, spring, t, y), force(equations, spring, t, y)
    phase = SpringPhase.ACTING
    if contacts.springs[k] is SpringPhase.ACTING:
        damped = guards(equations, spring) == (pull,)
        phase = SpringPhase.LAGGING if damped and strained > 0.0 else SpringPhase.SLACK
    elif contacts.springs[k] is SpringPhase.LAGGING and acting < 0.5 * damper:
        phase = SpringPhase.SLACK
    return front.with_contacts(contacts.with_spring(k, phase))


def begun(configuration: Configuration, front: Front) -> Front:
    """Return the front with the phases of all springs at the start of a motion.

    A spring at its free length acts unless it moves away from its side, faster than round-off.
    """
    springs = front.equations.elements.springs
    if springs is None or not springs.one_sided:
        return front
    acting = replace(front.contacts, springs=(SpringPhase.ACTING,) * len(springs.laws))
    front = front.with_contacts(acting)
    near, slow = resolution(front.equations, front.y)
    for k, law in enumerate(springs.laws):
        at = (front.equations, len(acting.modes) + k, front.time, front.y)
        x = strain(*at)
        if law.side and (x < -near or (x <= near and strain_rate(*at) < -slow)):
            acting = acting.with_spring(k, SpringPhase.SLACK)
    return rephased(configuration, front.with_contacts(acting))


def rephased(configuration: Configuration, front: Front, switched: int | None = None) -> Front:
    """Return the front with the phases of damped springs for rates that have jumped.

    A spring that has switched keeps its phase: its force is round-off.
    """
    springs, contacts = front.equations.elements.springs, front.contacts
    if springs is None or not contacts.springs:
        return front
    for k in np.flatnonzero(springs.dampers).tolist():
        spring = len(contacts.modes) + k
        acting, rounding = force(front.equations, spring, front.time, front.y)
        changes = springs.laws[k].side and spring != switched
        if changes and contacts.springs[k] is not SpringPhase.SLACK:
            if acting < -rounding:
                contacts = contacts.with_spring(k, SpringPhase.LAGGING)
            elif acting > rounding:
                contacts = contacts.with_spring(k, SpringPhase.ACTING)
    return front.with_contacts(contacts)
