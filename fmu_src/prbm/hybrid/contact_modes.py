"""Which stops hold and which contacts stick or slip: the discrete state that follows an event.

All is chosen from the state at the front alone, by the forces and accelerations that the
candidates have.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations, product
from math import ulp

import numpy as np

from ..base.errors import SimulationError
from ..base.tolerances import (
    DEPENDENT_FRICTION_RTOL,
    DEPENDENT_STOP_RTOL,
    EVENT_TIME_ATOL,
    RELEASE_PENETRATION_ATOL,
    RESTING_SETS_MAX,
    STICKING_SETS_MAX,
)
from ..mechanics import contact
from ..mechanics.arrays import Real
from ..mechanics.contact_state import ContactMode, ContactState
from ..mechanics.dynamics import Equations
from .configuration import Configuration, Scales
from .front import Front

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
        If too many stops rest at once, or the equations are singular.
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
    front = _with_friction(configuration, front.with_contacts(contacts), slipped, slow)
    return front.projected() if holding else front


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

    Contacts that move slip meanwhile.  Of stops that can move only together, one holds: the one
    that keeps the others from closing.

    Raises
    ------
    SimulationError
        If there are more than :data:`prbm.base.tolerances.RESTING_SETS_MAX` candidates.
    """
    every = sorted(set(candidates))
    _check_count(configuration, front, every)
    e, M, loops = front.equations.mass_and_loops(front.q)
    rows = configuration.system.gap_rows
    G, bend = rows.jacobian(e), rows.convective(e, front.v)
    pressed_only: list[int] = []
    for size in range(len(every), 0, -1):
        found: list[tuple[float, list[int]]] = []
        for members in combinations(every, size):
            holding = list(members)
            if not _independent(G[holding], M, loops):
                continue
            equations = equations_holding(configuration.scales, front, holding)
            a, lam, _, _ = equations.evaluate(front.time, front.q, front.v)
            if all(equations.stop_forces(lam)[i] > 0.0 for i in holding):
                others = [
                    float(G[i] @ a - bend[i] + front.inputs.walls[i].motion(front.time)[2])
                    for i in every
                    if i not in holding
                ]
                found.append((min(others, default=0.0), holding))
        if found:
            opens, holding = max(found, key=lambda one: one[0])
            if opens >= -configuration.scales.zero_acceleration:
                return holding
            pressed_only = pressed_only or holding
    return pressed_only


def _check_count(configuration: Configuration, front: Front, stops: Sequence[int]) -> None:
    """Reject more stops at rest than there are subsets to try."""
    if len(stops) <= RESTING_SETS_MAX:
        return
    names = ", ".join(configuration.mechanism.stops[i].name for i in stops)
    raise SimulationError(
        f"{len(stops)} stops rest at once at t = {front.time:.9g} s ({names}), more than the "
        f"{RESTING_SETS_MAX} of which every combination can be tried; replace stops that touch "
        "together by one, or move them apart"
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
    return abs(rate) * (2 * EVENT_TIME_ATOL + 8 * ulp(front.time))


def _with_friction(
    configuration: Configuration, front: Front, slipped: int | None, slow: Mapping[int, float]
) -> Front:
    """Return the front with the modes of all closed contacts with friction.

    The mode of one contact may change that of another: they are chosen one by one until none
    changes, else all at once.
    """
    scales, equations, contacts = configuration.scales, front.equations, front.contacts
    laws = enumerate(equations.friction_laws, start=contacts.stops)
    rubbing = [i for i in contacts.held if equations.stop_friction[i] > 0.0]
    rubbing += [c for c, law in laws if law.coefficient > 0.0]
    for _ in range(len(rubbing) + 1):
        before = front.contacts
        for c in rubbing:
            mode = _friction_mode(scales, front, c, slipped == c, slow.get(c, 0.0))
            front = front.with_contacts(front.contacts.with_mode(c, mode))
        if front.contacts == before:
            return front
    at_rest = [
        c for c in rubbing if _sliding_mode(scales, front, c, slow.get(c, 0.0)) is FRICTIONLESS
    ]
    return joint_modes(front, at_rest, slipped)


def _friction_mode(
    scales: Scales, front: Front, contact: int, slipped: bool, slow: float
) -> ContactMode:
    """Return the mode of a closed contact while all others keep theirs.

    A contact that moves faster than ``slow`` slips.  At rest it is frictionless where the loops
    and the held stops leave it no mobility of its own: the stops carry all of the load.  Else it
    sticks as far as Coulomb's law allows, and beyond slips in the direction in which sliding
    accelerates it.
    """
    moving = _sliding_mode(scales, front, contact, slow)
    if moving is not FRICTIONLESS:
        return moving
    contacts, q, v, e = front.contacts, front.q, front.v, front.e
    if not _mobile(front, contacts, contact):
        return FRICTIONLESS
    equations = front.equations.with_contacts(contacts.with_mode(contact, STICK))
    friction, limit = equations.friction(contact, e, equations.evaluate(front.time, q, v).lam)
    if abs(friction) <= limit and not slipped:
        return STICK
    pushed = ContactMode.slipping(-1 if friction > 0.0 else 1)
    for mode in (pushed, ContactMode.slipping(-pushed.slip)):
        trial = front.equations.with_contacts(contacts.with_mode(contact, mode))
        a = trial.evaluate(front.time, q, v).a
        if mode.slip * trial.slip_acceleration(contact, e, v, a) > 0.0:
            return mode
    return FRICTIONLESS if slipped else STICK


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


def joint_modes(front: Front, at_rest: Sequence[int], slipped: int | None) -> Front:
    """Return the front with the modes of the contacts at rest chosen together.

    They are the first combination in which sticking contacts need no more than their friction,
    slipping contacts are accelerated in their direction, and held stops are pressed.  Without
    one, or with too many contacts at rest, all modes stay as they are.
    """
    alone = front.contacts
    for c in at_rest:
        alone = alone.with_mode(c, FRICTIONLESS)
    free = [c for c in at_rest if _mobile(front, alone, c)]
    if len(free) > STICKING_SETS_MAX:
        return front
    for modes in product(AT_REST, repeat=len(free)):
        chosen = dict(zip(free, modes, strict=True))
        if slipped is not None and chosen.get(slipped) is STICK:
            continue
        together = alone
        for c, mode in chosen.items():
            together = together.with_mode(c, mode)
        if _consistent(front, together, chosen):
            return front.with_contacts(together)
    return front


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
