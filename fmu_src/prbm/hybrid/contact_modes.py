"""Which stops hold and which contacts stick or slip: the discrete state that follows an event.

All is chosen from the state at the front alone, by the forces and accelerations that the
candidates have.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations, product
from math import inf, ulp

import numpy as np

from ..base.errors import SimulationError
from ..base.tolerances import (
    DEPENDENT_FRICTION_RTOL,
    DEPENDENT_STOP_RTOL,
    EVENT_TIME_ATOL,
    EVENT_TIME_FACTOR,
    EVENT_TIME_ULPS,
    FRICTION_EXCESS_RTOL,
    RELEASE_PENETRATION_ATOL,
    RESTING_SETS_MAX,
    STICKING_SETS_MAX,
)
from ..mechanics import contact
from ..mechanics.arrays import Real
from ..mechanics.contact_state import ContactMode, ContactState
from ..mechanics.dynamics import Equations
from .configuration import Configuration, Scales, contact_names
from .front import Front
from .rest import RestForces, rest_forces

FRICTIONLESS, STICK = ContactMode.FRICTIONLESS, ContactMode.STICK
AT_REST = (STICK, ContactMode.SLIP_POSITIVE, ContactMode.SLIP_NEGATIVE)
"""Modes of a contact at rest that has a mobility of its own, in the order of trial."""


# --- resets -----------------------------------------------------------------------------------


def release(configuration: Configuration, front: Front, stop: int) -> Front:
    """Return the front after the force of a held stop has fallen to zero."""
    return settle(configuration, front.with_contacts(front.contacts.released(stop)))


def slip(configuration: Configuration, front: Front, contact: int) -> Front:
    """Return the front after a sticking contact has reached the limit of friction."""
    return settle(configuration, front, slipped=contact)


def reverse(configuration: Configuration, front: Front, contact: int) -> Front:
    """Return the front after the sliding velocity of a contact has fallen to zero."""
    return settle(configuration, front, reversing=contact)


def settle(
    configuration: Configuration,
    front: Front,
    *,
    resting: Sequence[int] = (),
    slipped: int | None = None,
    reversing: int | None = None,
) -> Front:
    """Return the front with the modes of all contacts chosen anew.

    Parameters
    ----------
    configuration : Configuration
        Mechanism and scales.
    front : Front
        State, and the modes so far: its held stops are candidates.
    resting : sequence of int
        Open stops that touch and neither close nor open.
    slipped : int or None
        A contact that has reached the limit of friction: it cannot stick.
    reversing : int or None
        A contact whose sliding velocity has fallen to zero.

    Raises
    ------
    SimulationError
        If no forces satisfy the laws of all contacts, or the equations are singular.
    """
    slow = {} if reversing is None else {reversing: _residual_speed(front, reversing)}
    gaps, rates = front.gaps_and_rates()
    near = configuration.scales.touching + RELEASE_PENETRATION_ATOL
    zero, contacts = configuration.scales.zero_speed, front.contacts
    candidates = list(contacts.held)
    candidates += [
        i for i in resting if i not in candidates and gaps[i] <= near and rates[i] <= zero
    ]
    holding = holding_stops(configuration, front, candidates)
    contacts = ContactState.holding(holding, contacts.stops, contacts.points)
    front = front.with_contacts(contacts)
    front = _with_friction(configuration, front, candidates, slipped, slow)
    return front.projected() if front.contacts.held else front


def release_moving(configuration: Configuration, front: Front) -> tuple[Front, int | None]:
    """Release the held stops that move apart or together, and find one that is struck.

    A wall that retreats leaves the body behind; gravity or another force closes the gap again
    and, below ``rest_speed``, captures it.  A wall that advances strikes, and so does a body that
    an impulse throws against a wall that it touches.

    Returns
    -------
    front : Front
        Without the held stops whose gap has a rate.
    struck : int or None
        A stop that closes.
    """
    gaps, rates = front.gaps_and_rates()
    scales, contacts, struck = configuration.scales, front.contacts, None
    for i in range(contacts.stops):
        closed = front.contacts.modes[i].closed
        if closed and abs(rates[i]) > scales.zero_speed:
            contacts = contacts.released(i)
        elif closed or gaps[i] > scales.touching:
            continue
        struck = i if rates[i] < -scales.zero_speed else struck
    return front.with_contacts(contacts), struck


# --- stops ------------------------------------------------------------------------------------


def holding_stops(
    configuration: Configuration, front: Front, candidates: Sequence[int]
) -> list[int]:
    """Return the stops at rest that hold: pressed together, while the others open.

    Raises
    ------
    SimulationError
        If there are none: contacts that slide exclude them by their friction.
    """
    holding = find_holding_stops(configuration, front, candidates)
    if holding is None:
        raise SimulationError(_jammed(configuration, front, candidates))
    return holding


def find_holding_stops(
    configuration: Configuration, front: Front, candidates: Sequence[int]
) -> list[int] | None:
    """Return the stops at rest that hold: pressed together, while the others open.

    Contacts that move slip meanwhile.  Of stops that can move only together, one holds: the one
    that keeps the others from closing.  None if no stops hold in this way.
    """
    every = sorted(set(candidates))
    if not every:
        return []
    tried = range(len(every), -1, -1) if len(every) <= RESTING_SETS_MAX else ()
    e, M, loops = front.equations.mass_and_loops(front.q)
    G = configuration.system.gap_rows.jacobian(e)
    least = -configuration.scales.zero_acceleration
    for size in tried:
        found: list[tuple[float, list[int]]] = []
        for members in combinations(every, size):
            holding = list(members)
            if _independent(G[holding], M, loops):
                found.append((_opening(configuration, front, every, holding), holding))
        opens, holding = max(found, key=lambda one: one[0], default=(-inf, []))
        if opens >= least:
            return holding
    holding = _pressed_stops(configuration, front, every)
    opens = _opening(configuration, front, every, holding)
    return holding if opens >= least else None


def _opening(
    configuration: Configuration, front: Front, stops: Sequence[int], holding: list[int]
) -> float:
    """Return the least acceleration at which stops open while others hold [m/s^2].

    Zero if all of them hold, -inf if one of those that hold would have to pull.
    """
    equations = equations_holding(configuration.scales, front, holding)
    a, lam, _, _ = equations.evaluate(front.time, front.q, front.v)
    if not all(equations.stop_forces(lam)[i] > 0.0 for i in holding):
        return -inf
    opening = equations.gap_accelerations(front.time, front.e, front.v, a)
    return min((float(opening[i]) for i in stops if i not in holding), default=0.0)


def _pressed_stops(configuration: Configuration, front: Front, stops: Sequence[int]) -> list[int]:
    """Return the stops that are pressed where nothing but what slides has friction."""
    scales = configuration.scales
    sliding = equations_holding(scales, front, stops).contacts.modes
    equations = equations_holding(scales, front, ())
    slips = [sliding[i].slip for i in stops]
    found = rest_forces(equations, front.time, front.q, front.v, stops, slips, ())
    if found is None:
        return []
    pressing = zip(stops, found.normal, strict=True)
    return [i for i, press in pressing if press > scales.zero_acceleration]


def _jammed(configuration: Configuration, front: Front, contacts: Iterable[int]) -> str:
    """Return the message that no forces satisfy the laws of contacts."""
    names = contact_names(configuration.mechanism, contacts)
    return (
        f"no forces satisfy the laws of contact and friction at t = {front.time:.9g} s ({names}): "
        "friction jams the mechanism; reduce the coefficients of friction"
    )


def equations_holding(scales: Scales, front: Front, stops: Sequence[int]) -> Equations:
    """Return the equations in which these stops hold and all contacts that move slip."""
    e, v, system, contacts = front.e, front.v, front.equations.system, front.contacts
    speeds = np.concatenate([system.slide_rows.rates(e, v), system.rub_rows.rates(e, v)])
    modes = tuple(
        slip_mode(scales, float(speed))
        if c in stops or not contacts.is_stop(c)
        else ContactMode.OPEN
        for c, speed in enumerate(speeds)
    )
    return front.equations.with_contacts(ContactState(modes, contacts.stops))


def _independent(rows: Real, M: Real, loops: Real) -> bool:
    """Return whether each of the rows has a mobility of its own beside those before it."""
    for k in range(1, len(rows)):
        row = rows[k : k + 1]
        left = mobility(M, np.vstack([loops, rows[:k]]), row)
        if left <= DEPENDENT_STOP_RTOL * mobility(M, loops, row):
            return False
    return True


def mobility(M: Real, held: Real, row: Real) -> float:
    """Return the inverse mass along a row (1, n) while others (r, n) are held [1/kg]."""
    return float((row @ contact.response(M, held, row)).item())


# --- friction ---------------------------------------------------------------------------------


def slip_mode(scales: Scales, speed: float, slow: float = 0.0) -> ContactMode:
    """Return the mode of a contact that slides with a speed [m/s]; FRICTIONLESS if at rest."""
    if abs(speed) <= slow or abs(speed) <= scales.zero_speed:
        return FRICTIONLESS
    return ContactMode.slipping(speed)


def _residual_speed(front: Front, contact: int) -> float:
    """Return the sliding speed that the resolution of time leaves at a reversal [m/s]."""
    a = front.equations.evaluate(front.time, front.q, front.v).a
    rate = front.equations.slip_acceleration(contact, front.e, front.v, a)
    return abs(rate) * time_resolution(front.time)


def time_resolution(time: float) -> float:
    """Return the error of the time of an event [s]."""
    return EVENT_TIME_FACTOR * EVENT_TIME_ATOL + EVENT_TIME_ULPS * ulp(time)


def _with_friction(
    configuration: Configuration,
    front: Front,
    candidates: Sequence[int],
    slipped: int | None,
    slow: Mapping[int, float],
) -> Front:
    """Return the front with the modes of all closed contacts with friction.

    The mode of one contact may change that of another: they are chosen one by one until none
    changes, else all at once.
    """
    scales, equations = configuration.scales, front.equations
    rubbing = _with_coefficients(equations, front.contacts.held)
    for _ in range(len(rubbing) + 1):
        before, fits = front.contacts, True
        for c in rubbing:
            mode, one_fits = _friction_mode(scales, front, c, slipped == c, slow.get(c, 0.0))
            front, fits = front.with_contacts(front.contacts.with_mode(c, mode)), fits and one_fits
        if fits and front.contacts == before:
            return front
    resting = [
        c for c in rubbing if _sliding_mode(scales, front, c, slow.get(c, 0.0)) is FRICTIONLESS
    ]
    together = joint_modes(front, resting, slipped)
    if together is None:
        together = _joint_forces(configuration, front, candidates, slipped, slow)
    return front.with_contacts(together)


def _with_coefficients(equations: Equations, stops: Sequence[int]) -> list[int]:
    """Return the stops of some, and the friction points, that have friction."""
    laws = enumerate(equations.friction_laws, start=equations.contacts.stops)
    rubbing = [i for i in stops if equations.stop_friction[i] > 0.0]
    return rubbing + [c for c, law in laws if law.coefficient > 0.0]


def _friction_mode(
    scales: Scales, front: Front, contact: int, slipped: bool, slow: float
) -> tuple[ContactMode, bool]:
    """Return the mode of a closed contact while all others keep theirs, and whether it fits.

    A contact that moves faster than ``slow`` slips.  At rest it is frictionless where the loops
    and the held stops leave it no mobility of its own: the stops carry all of the load.  Else it
    sticks as far as Coulomb's law allows, and beyond slips in the direction in which sliding
    accelerates it.
    """
    moving = _sliding_mode(scales, front, contact, slow)
    if moving is not FRICTIONLESS:
        return moving, True
    contacts, q, v, e = front.contacts, front.q, front.v, front.e
    if not _mobile(front, contacts, contact):
        return FRICTIONLESS, True
    equations = front.equations.with_contacts(contacts.with_mode(contact, STICK))
    friction, limit = equations.friction(contact, e, equations.evaluate(front.time, q, v).lam)
    if abs(friction) <= limit and not slipped:
        return STICK, True
    pushed, greatest = ContactMode.slipping(-1 if friction > 0.0 else 1), 0.0
    for mode in (pushed, ContactMode.slipping(-pushed.slip)):
        trial = front.equations.with_contacts(contacts.with_mode(contact, mode))
        a = trial.evaluate(front.time, q, v).a
        acceleration = mode.slip * trial.slip_acceleration(contact, e, v, a)
        if acceleration > 0.0:
            return mode, True
        greatest = max(greatest, -acceleration)
    # Where there is as good as no friction, either of these fits.
    return FRICTIONLESS if slipped else STICK, greatest <= scales.zero_acceleration


def _sliding_mode(scales: Scales, front: Front, contact: int, slow: float) -> ContactMode:
    """Return the mode in which a contact slips faster than ``slow``; FRICTIONLESS if at rest."""
    row = front.equations.slip_row(contact, front.e)
    return slip_mode(scales, float(row @ front.v), slow)


def _mobile(front: Front, contacts: ContactState, contact: int) -> bool:
    """Return whether a contact has a mobility of its own beside all that holds and sticks."""
    e, M, loops = front.equations.mass_and_loops(front.q)
    row = front.equations.slip_row(contact, e)[None]
    others = front.equations.with_contacts(contacts.with_mode(contact, FRICTIONLESS))
    left = mobility(M, others.rows.jacobian(e), row)
    return left > DEPENDENT_FRICTION_RTOL * mobility(M, loops, row)


def joint_modes(front: Front, at_rest: Sequence[int], slipped: int | None) -> ContactState | None:
    """Return the modes of all contacts, with those of the contacts at rest chosen together.

    They are the first combination in which sticking contacts need no more than their friction,
    slipping contacts are accelerated in their direction, and held stops are pressed.  None
    without one, or with too many contacts at rest.
    """
    alone = front.contacts
    for c in at_rest:
        alone = alone.with_mode(c, FRICTIONLESS)
    free = [c for c in at_rest if _mobile(front, alone, c)]
    if len(free) > STICKING_SETS_MAX:
        return None
    for modes in product(AT_REST, repeat=len(free)):
        chosen = dict(zip(free, modes, strict=True))
        if slipped is not None and chosen.get(slipped) is STICK:
            continue
        together = alone
        for c, mode in chosen.items():
            together = together.with_mode(c, mode)
        if _consistent(front, together, chosen):
            return together
    return None


def _consistent(front: Front, contacts: ContactState, chosen: Mapping[int, ContactMode]) -> bool:
    """Return whether forces and accelerations are those that the modes stand for."""
    if not all(_mobile(front, contacts, c) for c, mode in chosen.items() if mode is STICK):
        return False
    e, v, equations = front.e, front.v, front.equations.with_contacts(contacts)
    a, lam, _, _ = equations.evaluate(front.time, front.q, v)
    if not all(equations.stop_forces(lam)[i] > 0.0 for i in equations.held):
        return False
    for c, mode in chosen.items():
        if mode is STICK:
            friction, limit = equations.friction(c, e, lam)
            if abs(friction) > limit:
                return False
        elif mode.slip * equations.slip_acceleration(c, e, v, a) <= 0.0:
            return False
    return True


def _joint_forces(
    configuration: Configuration,
    front: Front,
    stops: Sequence[int],
    slipped: int | None,
    slow: Mapping[int, float],
) -> ContactState:
    """Return the modes of all contacts from forces that satisfy all laws at once.

    Parameters
    ----------
    configuration : Configuration
        Mechanism and scales.
    front : Front
        State.
    stops : sequence of int
        Stops that touch, held or not.
    slipped : int or None
        A contact that has reached the limit of friction.
    slow : mapping
        Sliding speeds that are round-off, by contact [m/s].

    Raises
    ------
    SimulationError
        If there are no such forces.
    """
    scales, stops = configuration.scales, sorted(set(stops))
    rubbing = _with_coefficients(front.equations, stops)
    modes = {c: _sliding_mode(scales, front, c, slow.get(c, 0.0)) for c in {*stops, *rubbing}}
    contacts = ContactState.holding((), front.contacts.stops, front.contacts.points)
    for c in rubbing:
        contacts = contacts if contacts.is_stop(c) else contacts.with_mode(c, modes[c])
    at_rest = [c for c in rubbing if modes[c] is FRICTIONLESS]
    slips = [modes[i].slip for i in stops]
    equations = front.equations.with_contacts(contacts)
    found = rest_forces(equations, front.time, front.q, front.v, stops, slips, at_rest)
    if found is not None:
        for i, press in zip(stops, found.normal, strict=True):
            if press > scales.zero_acceleration:
                contacts = contacts.with_mode(i, modes[i])
        contacts = _sticking_or_slipping(scales, front, contacts, at_rest, found, slipped)
        if _agrees(scales, front, contacts, stops, at_rest):
            return contacts
    raise SimulationError(_jammed(configuration, front, {*stops, *rubbing}))


def _sticking_or_slipping(
    scales: Scales,
    front: Front,
    contacts: ContactState,
    at_rest: Sequence[int],
    found: RestForces,
    slipped: int | None,
) -> ContactState:
    """Return the modes with those of contacts at rest chosen by their forces.

    Of contacts that can stick only together, some stick; the others bear the limit of their
    friction, or none.
    """
    at_limit = np.abs(found.friction) >= found.limit
    for j in sorted(range(len(at_rest)), key=lambda j: bool(at_limit[j])):
        c, force = at_rest[j], found.friction[j]
        if not contacts.modes[c].closed:
            continue
        if abs(found.slide[j]) > scales.zero_acceleration:
            mode = ContactMode.slipping(found.slide[j])
        elif not (at_limit[j] and c == slipped) and _mobile(front, contacts, c):
            mode = STICK
        else:
            limited = at_limit[j] and found.limit[j] > 0.0
            mode = ContactMode.slipping(-force) if limited else FRICTIONLESS
        contacts = contacts.with_mode(c, mode)
    return contacts


def _agrees(
    scales: Scales,
    front: Front,
    contacts: ContactState,
    stops: Sequence[int],
    at_rest: Sequence[int],
) -> bool:
    """Return whether the modes satisfy the laws of all contacts, up to round-off."""
    e, v, equations = front.e, front.v, front.equations.with_contacts(contacts)
    a, lam, _, _ = equations.evaluate(front.time, front.q, v)
    opening = equations.gap_accelerations(front.time, e, v, a)
    forces, zero = equations.stop_forces(lam), scales.zero_acceleration
    for i in stops:
        if forces[i] <= 0.0 if contacts.modes[i].closed else opening[i] < -zero:
            return False
    for c in at_rest:
        mode = contacts.modes[c]
        if mode is STICK:
            force, limit = equations.friction(c, e, lam)
            if abs(force) > (1.0 + FRICTION_EXCESS_RTOL) * limit:
                return False
        elif mode.slip * equations.slip_acceleration(c, e, v, a) < -zero:
            return False
    return True
