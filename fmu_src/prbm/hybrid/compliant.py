"""Contacts at compliant stops: first touch, phases, freezing, separation, and their outputs.

The force is that of :mod:`prbm.mechanics.compliance`.  Its reference speed is the largest closing
speed of the contact so far.  A contact ends when its gap opens, not when its force vanishes.  A
contact that has become calm freezes: its indentation is then constant, until the force of the
constraint differs from the elastic force.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..base.tolerances import (
    FIRST_RISE_MAX,
    FREEZING_FACTOR,
    FROZEN_FORCE_RTOL,
    IMPACT_COUNT_MAX,
    TOUCH_STEP_CURVED_FACTOR,
    TOUCH_STEP_FACTOR,
)
from ..mechanics.arrays import Real
from ..mechanics.compliant_stops import CompliantState
from ..mechanics.contact_state import ContactPhase, Phase
from ..mechanics.inputs import Wall
from ..mechanics.kinetics import kinetic_energy
from ..mechanics.modal import fundamental_at, modal_ratio
from . import contact_modes
from .arc import Arc
from .configuration import Configuration
from .contact_peaks import check_depth, latched_until
from .front import ContactStart, Front, Latched
from .guards import StepView, fall_time, indentation
from .records import Impact
from .stepping import StepSizeController, rounded_step

# --- resets -----------------------------------------------------------------------------------


def begin_contact(configuration: Configuration, front: Front, stop: int) -> Front:
    """Return the front after the first touch of a compliant stop."""
    _, rates = front.gaps_and_rates()
    speed = float(-rates[stop])
    counted = speed >= configuration.stop_value(stop, "rest_speed")
    front = _touching(configuration, front, stop, speed, counted=counted)
    if counted:
        old = front.latched[stop]
        latched = Latched(
            impact_count=min(old.impact_count + 1, IMPACT_COUNT_MAX),
            impact_time=front.time,
            approach_speed=speed,
        )
        front = front.with_latched(stop, latched)
    return contact_modes.choose_modes(configuration, rephased(_raised(front, stop)))


def _raised(front: Front, stop: int) -> Front:
    """Return the front after first touch with the reference speed that the contact will reach.

    Forces that push the body into the stop raise its speed from v until the force of the contact
    equals them.  With a constant acceleration A, the inverse mass W and a rising contact, that is
    at the indentation d with A = W k d^n (1 + a), and v0^2 = v^2 + 2 A d n/(n + 1).  A larger rise
    is integrated, see :func:`switch`.
    """
    touching = front.contacts.touching[stop]
    assert touching is not None
    _, rates = front.gaps_and_rates()
    law, speed = front.equations.compliant.laws[stop], touching.reference_speed
    acceleration = _acceleration(front, stop) if float(-rates[stop]) >= speed else 0.0
    if acceleration <= 0.0:
        return front
    depth = law.depth(acceleration / (point_mobility(front, stop) * (1.0 + law.damping)))
    rise = acceleration * depth * law.exponent / ((law.exponent + 1.0) * speed * speed)
    if rise > FIRST_RISE_MAX:
        return front
    raised = ContactPhase(Phase.PRESSED, speed * math.sqrt(1.0 + 2.0 * rise))
    return front.with_contacts(front.contacts.with_touching(stop, raised))


def preloaded(configuration: Configuration, front: Front, stop: int) -> Front:
    """Return the front in which a compliant stop that is penetrated at the start is pressed.

    Raises
    ------
    SimulationError
        If the indentation is larger than the mechanism.
    """
    gaps, _ = front.gaps_and_rates()
    check_depth(configuration, stop, float(-gaps[stop]), front.time)
    return _touching(configuration, front, stop, 0.0, counted=False)


def _touching(
    configuration: Configuration, front: Front, stop: int, speed: float, *, counted: bool
) -> Front:
    """Return the front at the begin of a contact with a closing speed [m/s]."""
    least = max(configuration.stop_value(stop, "rest_speed"), configuration.scales.zero_speed)
    begun = ContactPhase(Phase.PRESSED, max(speed, least))
    momentum: tuple[float, ...] = ()
    if counted:
        phi, M = fundamental_at(configuration.system, front.q)
        momentum = tuple((M @ phi).tolist())
    own, extras = front.equations.compliant, front.extras
    front = front.with_contacts(front.contacts.with_touching(stop, begun))
    return front.with_start(
        stop,
        ContactStart(
            front.time,
            counted,
            float(extras[own.index(stop, CompliantState.IMPULSE)]),
            float(extras[own.index(stop, CompliantState.LOSS)]),
            tuple(front.q.tolist()),
            tuple(front.v.tolist()),
            momentum,
        ),
    )


def switch(configuration: Configuration, front: Front, stop: int) -> Front:
    """Return the front after the phase of the contact at a compliant stop has changed."""
    touching = front.contacts.touching[stop]
    assert touching is not None
    _, rates = front.gaps_and_rates()
    rate = float(-rates[stop])
    if touching.phase is Phase.PRESSED and rate > 0.0:
        front = rephased(front)
        if front.contacts.touching[stop] == touching:
            # The rate is below the reference speed only up to the error of the time of the event.
            rising = replace(touching, phase=Phase.RISING)
            front = front.with_contacts(front.contacts.with_touching(stop, rising))
    else:
        # At the end of a phase, the rate is that of the other phase only up to round-off.
        phase = Phase.FREE if touching.phase is Phase.PRESSED else Phase.PRESSED
        rises = touching.phase is Phase.RISING
        speed = max(touching.reference_speed, rate) if rises else touching.reference_speed
        front = front.with_contacts(front.contacts.with_touching(stop, ContactPhase(phase, speed)))
    return contact_modes.choose_modes(configuration, front)


def separate(configuration: Configuration, front: Front, stop: int) -> tuple[Front, list[Impact]]:
    """Return the front after the end of the contact at a compliant stop, and its record."""
    front, impacts = _finished(configuration, front, stop)
    front = front.with_contacts(front.contacts.with_touching(stop, None)).with_start(stop, None)
    return contact_modes.choose_modes(configuration, front), impacts


def rephased(front: Front) -> Front:
    """Return the front with the phases of all contacts for the present rates.

    The reference speed of a contact is raised to the closing speed at once if that has jumped, by
    an impulse or by the wall.
    """
    _, rates = front.gaps_and_rates()
    for i in front.contacts.pressed:
        touching, rate = front.contacts.touching[i], float(-rates[i])
        assert touching is not None
        speed, phase = max(touching.reference_speed, rate), Phase.PRESSED
        begun = ContactPhase(phase, speed)
        if rate >= touching.reference_speed:
            rising = front.contacts.with_touching(i, ContactPhase(Phase.RISING, speed))
            if _acceleration(front.with_contacts(rising), i) > 0.0:
                begun = ContactPhase(Phase.RISING, speed)
        elif front.equations.compliant.laws[i].damping_ratio(begun, rate) < 0.0:
            begun = ContactPhase(Phase.FREE, speed)
        front = front.with_contacts(front.contacts.with_touching(i, begun))
    return front


def _acceleration(front: Front, stop: int) -> float:
    """Return the second derivative of the indentation of a stop [m/s^2]."""
    equations, at = front.equations, front.evaluate()
    accelerations = equations.gap_accelerations(front.time, front.e, front.v, at.a, at.pressure)
    return -float(accelerations[stop])


def unfrozen(front: Front) -> Front:
    """Return the front in which frozen stops are pressed, before impulses act."""
    contacts = front.contacts
    for i in contacts.held:
        contacts = contacts.released(i) if contacts.touching[i] else contacts
    return front.with_contacts(contacts)


# --- freezing ---------------------------------------------------------------------------------


class Rest(NamedTuple):
    """A pressed contact that vibrates slowly, and the constraint that would hold it.

    Parameters
    ----------
    front : Front
        The front with the constraint at the present indentation, not projected.
    force : float
        Force of the constraint [N].
    elastic : float
        Elastic force of the contact [N].
    time : float
        Contact time, half the period of small vibrations [s].
    """

    front: Front
    force: float
    elastic: float
    time: float

    @property
    def balanced(self) -> bool:
        """Whether the contact can freeze: the constraint is released at twice this difference."""
        limit = FREEZING_FACTOR * FROZEN_FORCE_RTOL * self.elastic
        return abs(self.force - self.elastic) <= limit


def frozen(
    configuration: Configuration, front: Front, arc: Arc | None
) -> tuple[Front, list[Impact], dict[int, float]]:
    """Return the front in which contacts that have been calm for a contact time are frozen.

    Its outputs have the maxima up to the end of the step that leads to it.  The mapping has the
    indentations [m] at which the other calm contacts would be in balance: a step ends there.
    """
    impacts: list[Impact] = []
    balances: dict[int, float] = {}
    front = latched_until(configuration, front, arc, front.time)
    for i in front.contacts.pressed:
        touch, rest = front.touches[i], _calm(configuration, front, i)
        assert touch is not None
        since = (front.time if touch.calm_since is None else touch.calm_since) if rest else None
        if since != touch.calm_since:
            front = front.with_start(i, replace(touch, calm_since=since))
        if rest is None or since is None or front.time - since < rest.time:
            continue
        if rest.balanced:
            front, found = _settled(configuration, front, i, rest)
            impacts += found
        else:
            balances[i] = front.equations.compliant.laws[i].depth(rest.force)
    return front, impacts, balances


def _calm(configuration: Configuration, front: Front, stop: int) -> Rest | None:
    """Return the rest of a contact that vibrates more slowly than ``rest_speed``, else None.

    The speed is that at which the contact would pass its balance.  A contact that is stuck does not
    move: it stays a force.
    """
    touching = front.contacts.touching[stop]
    gaps, rates = front.gaps_and_rates()
    assert touching is not None
    depth, rate = float(-gaps[stop]), float(-rates[stop])
    least = configuration.stop_value(stop, "rest_speed")
    if touching.phase is Phase.FREE or depth <= 0.0 or abs(rate) >= least or _stuck(front, stop):
        return None
    held = replace(touching, phase=Phase.FROZEN, depth=depth)
    # The displacement of the wall by the contact becomes part of its motion.
    folded, walls = fold_recoils(front, (stop,))
    rest = folded.with_walls(walls).with_contacts(front.contacts.with_touching(stop, held))
    law, inverse_mass = front.equations.compliant.laws[stop], point_mobility(front, stop)
    force, elastic = _stop_force(rest, stop), law.elastic_force(depth)
    stiffness = law.tangent(depth)
    speed = math.hypot(rate, (force - elastic) * math.sqrt(inverse_mass / stiffness))
    if force <= 0.0 or speed >= least:
        return None
    return Rest(rest, force, elastic, math.pi / math.sqrt(stiffness * inverse_mass))


def _stop_force(front: Front, stop: int) -> float:
    """Return the force of a stop that is a constraint [N]."""
    return float(front.equations.stop_forces(front.evaluate().lam)[stop])


def point_mobility(front: Front, stop: int) -> float:
    """Return the inverse effective mass of a hit point, with that of its wall [1/kg]."""
    return front.at.mobility(front.at.gaps[[stop]]) + front.inputs.mobilities[stop]


def _stuck(front: Front, stop: int) -> bool:
    """Return whether other constraints, such as its own friction, hold a hit point at rest."""
    held = front.equations.rows.jacobian(front.e)
    return not front.at.independent(held, front.at.gaps[[stop]])


def _settled(
    configuration: Configuration, front: Front, stop: int, rest: Rest
) -> tuple[Front, list[Impact]]:
    """Return the front in which a contact is frozen; its kinetic energy is a loss."""
    slow = rest.front.projected()
    loss = kinetic_energy(front.at.M, rest.front.v) - kinetic_energy(front.at.M, slow.v)
    y = slow.y.copy()
    y[2 * front.equations.n] += loss
    lost = front.equations.compliant.index(stop, CompliantState.LOSS)
    y[2 * front.equations.n + 2 + lost] += loss
    slow, impacts = _finished(configuration, replace(slow, y=y), stop)
    touch = slow.touches[stop]
    assert touch is not None
    slow = slow.with_start(stop, replace(touch, calm_since=None))
    return contact_modes.choose_modes(configuration, slow), impacts


def balance_time(view: StepView, balances: Mapping[int, float]) -> float | None:
    """Return when a contact first passes the indentation of its balance [m] in a step, or None."""
    start, end = view.arc.start, view.arc.start + view.arc.h
    times = []
    for stop, depth in balances.items():
        inside = view.along(indentation, stop)
        sign = 1.0 if inside(start) > depth else -1.0
        if sign * (inside(end) - depth) < 0.0:
            margin = _margin(inside, sign, depth)
            times.append(fall_time(margin, start, end, view.event_time))
    return min(times, default=None)


def _margin(value: Callable[[float], float], sign: float, level: float) -> Callable[[float], float]:
    """Return the distance of a function from a level, on the side of a sign."""
    return lambda t: sign * (value(t) - level)


def present_walls(front: Front, state: Callable[[], Real]) -> tuple[Wall, ...]:
    """Return the walls with displacements by forces of compliant stops in their motion.

    Parameters
    ----------
    front : Front
        The front at the present time.
    state : callable
        Returns the present state.
    """
    stops = front.equations.compliant.stops
    if not any(front.inputs.mobilities[i] for i in stops):
        return front.inputs.walls
    return fold_recoils(replace(front, y=state()), stops)[1]


def fold_recoils(front: Front, stops: Sequence[int]) -> tuple[Front, tuple[Wall, ...]]:
    """Return the front without displacements of walls by contact forces, and the moved walls."""
    own, n, y = front.equations.compliant, front.equations.n, front.y.copy()
    walls = list(front.inputs.walls)
    for i in stops:
        at = 2 * n + 2 + own.index(i, CompliantState.RECOIL)
        rate = 2 * n + 2 + own.index(i, CompliantState.RECOIL_RATE)
        walls[i] = walls[i].displaced(float(y[at])).pushed(front.time, float(y[rate]))
        y[at] = y[rate] = 0.0
    return replace(front, y=y), tuple(walls)


# --- outputs ----------------------------------------------------------------------------------


def _finished(configuration: Configuration, front: Front, stop: int) -> tuple[Front, list[Impact]]:
    """Return the front with the outputs of an impact that ends, and its record."""
    touch, own, old = front.touches[stop], front.equations.compliant, front.latched[stop]
    assert touch is not None
    if not touch.counted:
        return front, []
    _, rates = front.gaps_and_rates()
    extras, v = front.extras, front.v
    latched = replace(
        old,
        rebound_speed=float(rates[stop]),
        impulse=float(extras[own.index(stop, CompliantState.IMPULSE)]) - touch.impulse,
        energy_lost=float(extras[own.index(stop, CompliantState.LOSS)]) - touch.loss,
        contact_duration=front.time - touch.time,
        modal_restitution=_modal_restitution(front, touch),
    )
    front = front.with_latched(stop, latched).with_start(stop, replace(touch, counted=False))
    name, q, before = configuration.mechanism.stops[stop].name, touch.q, touch.v
    record = Impact(name, touch.time, np.array(q), np.array(before), v, latched.impulse, latched)
    return front, [record]


def _modal_restitution(front: Front, touch: ContactStart) -> float:
    """Return minus the ratio of the velocities of the fundamental mode after and before [-].

    The mode and the mass matrix are those of the shape at first touch.  At separation, flexures
    that stretch can vibrate along their length, and the modes about that shape differ.
    """
    momentum = np.array(touch.momentum)
    return modal_ratio(momentum, np.array(touch.v), momentum, front.v)


# --- steps ------------------------------------------------------------------------------------


def shortened(
    controller: StepSizeController, front: Front, stop: int
) -> tuple[StepSizeController, Front]:
    """Return the controller of the first step of a contact, if a stop has been touched.

    This step is a fraction of the depth of a free hit divided by its speed.  The front keeps the
    step size so far.
    """
    touching, touch = front.contacts.touching[stop], front.touches[stop]
    if touching is None or touch is None:
        return controller, front
    law = front.equations.compliant.laws[stop]
    speed, power = touching.reference_speed, law.exponent + 1.0
    work = 0.5 * power * speed**2 / (law.stiffness * point_mobility(front, stop))
    factor = TOUCH_STEP_FACTOR if law.exponent == 1.0 else TOUCH_STEP_CURVED_FACTOR
    h = rounded_step(factor * math.pow(work, 1.0 / power) / speed)
    front = front.with_start(stop, replace(touch, step=controller.h))
    return replace(controller, h=min(h, controller.h)), front


def lengthened(controller: StepSizeController, touch: ContactStart | None) -> StepSizeController:
    """Return the controller of the first step after a contact: the contact does not shorten it."""
    return replace(controller, h=max(controller.h, touch.step)) if touch else controller
