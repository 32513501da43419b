"""The choice of the contact modes after an event: stops that hold, contacts that stick or slip.

The choice depends only on the state at the front: on the forces and accelerations of the contacts
in the modes that are tried.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from ..base.errors import SimulationError
from ..base.tolerances import (
    FRICTION_EXCESS_RTOL,
    MODE_ITERATIONS_MAX,
    MODES_TRIED_MAX,
    SIDES_TRIED_MAX,
)
from ..mechanics.constraints import solve_saddle
from ..mechanics.contact_state import ContactMode, ContactState
from ..mechanics.dynamics import Equations
from . import spring_phases
from .configuration import Configuration, Scales, contact_names
from .front import Front
from .rest import RestForces, rest_forces, sticking

FRICTIONLESS, STICK = ContactMode.FRICTIONLESS, ContactMode.STICK

JAMMED = (
    "no forces satisfy the laws of contact and friction",
    "friction jams the mechanism; reduce the coefficients of friction",
)
"""Cause and remedy of a choice of modes without a solution."""
UNDECIDED = (
    "the choice of closed contacts does not converge",
    "the forces of the contacts are round-off; separate the stops, or change the load",
)
"""Cause and remedy of modes that change with each projection."""


class JammedError(SimulationError):
    """No forces satisfy the laws of contact and friction on the sides of the guides, or on any."""


# --- resets -----------------------------------------------------------------------------------


def release(configuration: Configuration, front: Front, stop: int) -> Front:
    """Return the front after the force of a held stop has fallen to zero."""
    return choose_modes(configuration, front.with_contacts(front.contacts.released(stop)))


def change_side(configuration: Configuration, front: Front, contact: int) -> Front:
    """Return the front after the force of a guide that slips has changed its side.

    Raises
    ------
    SimulationError
        If friction reverses the effect of the force on the motion across the line, on either side
        (Painleve's paradox): no force satisfies the laws after the change.
    """
    changed = front.contacts.with_side(contact, -front.contacts.side(contact))
    other = front.with_contacts(changed)
    if not all(_resists(one, contact) for one in (front, other)):
        raise _jammed(configuration, front, [contact])
    return choose_modes(configuration, other, turned=contact)


def _resists(front: Front, guide: int) -> bool:
    """Return whether the force of a slipping guide, with its friction, resists to its side."""
    equations = front.equations
    right = np.zeros(equations.n + len(equations.rows))
    row = equations.n + equations.normal_row(guide)
    right[row] = 1.0  # An acceleration of the point to the left of its line.
    return bool(solve_saddle(front.evaluate().factors, right)[row] < 0.0)


def slip(configuration: Configuration, front: Front, contact: int) -> Front:
    """Return the front after a sticking contact has reached the limit of friction."""
    return choose_modes(configuration, front, slipped=contact)


def act(configuration: Configuration, front: Front, spring: int) -> Front:
    """Return the front after a spring has begun or ceased to act."""
    return choose_modes(configuration, spring_phases.switched(front, spring), switched=spring)


def reverse(configuration: Configuration, front: Front, contact: int) -> Front:
    """Return the front after the sliding velocity of a contact has fallen to zero."""
    return choose_modes(configuration, front, reversing=contact)


def choose_modes(
    configuration: Configuration,
    front: Front,
    *,
    resting: Sequence[int] = (),
    slipped: int | None = None,
    reversing: int | None = None,
    turned: int | None = None,
    switched: int | None = None,
) -> Front:
    """Return the front with the modes of all contacts chosen anew.

    Parameters
    ----------
    configuration : Configuration
        Mechanism and scales.
    front : Front
        State, and the modes so far; stops held so far are candidates.
    resting : sequence of int
        Open stops that touch and neither close nor open.
    slipped : int or None
        A contact that has reached the limit of friction: it cannot stick.
    reversing : int or None
        A contact whose sliding velocity has fallen to zero.
    turned : int or None
        A guide that has changed its side: its force is round-off, and does not change it back.
    switched : int or None
        A spring that has begun or ceased to act, likewise.

    The phases of springs follow the rates, which an impact changes.

    Raises
    ------
    SimulationError
        If no forces satisfy the laws of all contacts, or the equations are singular.
    """
    front = spring_phases.rephased(configuration, front, switched)
    turning = {} if reversing is None else {reversing: _slide_acceleration(front, reversing)}
    candidates, before = _candidates(configuration, front, resting), None
    for _ in range(MODE_ITERATIONS_MAX):
        # A compliant stop is a candidate only while it is a constraint.
        candidates = [i for i in candidates if i not in front.contacts.pressed]
        front = _chosen(configuration, front, candidates, slipped, turning, turned)
        if front.contacts == before or not front.contacts.held:
            return front
        # The projection closes gaps of round-off, which changes the forces of stiff flexures.
        front, before = front.projected(), front.contacts
    raise SimulationError(_failure(configuration, front, candidates, UNDECIDED))


def _candidates(configuration: Configuration, front: Front, resting: Sequence[int]) -> list[int]:
    """Return the held stops, and those of ``resting`` whose gaps are closed and do not open."""
    gaps, rates = front.gaps_and_rates()
    near = configuration.scales.touching + configuration.scales.penetration
    zero, held = configuration.scales.zero_speed, list(front.contacts.held)
    closed = [i for i in resting if gaps[i] <= near and rates[i] <= zero]
    return held + [i for i in closed if i not in held]


def _chosen(
    configuration: Configuration,
    front: Front,
    candidates: Sequence[int],
    slipped: int | None,
    turning: Mapping[int, float],
    turned: int | None,
) -> Front:
    """Return the front with the modes that its forces choose; not projected.

    The friction of a guide that slips depends on the side to which the guide pushes.  Changing the
    side of the first wrong one at a time ends, however many guides there are, if forces and sides
    determine each other uniquely (Murty's method for linear complementarity problems).  If it
    fails, all combinations of sides are tried.
    """

    def on_sides(one: Front) -> tuple[Front, int | None]:
        """Return the front with the modes for the sides of its guides, and a guide on the wrong."""
        holding = holding_stops(configuration, one, candidates)
        one = one.with_contacts(one.contacts.holding(holding))
        one = _with_friction(configuration, one, candidates, slipped, turning)
        return one, _guide_on_wrong_side(configuration, one, turned)

    chosen, wrong = front, None
    try:
        for _ in range(MODE_ITERATIONS_MAX):
            chosen, wrong = on_sides(chosen)
            if wrong is None:
                return chosen
            contacts = chosen.contacts.with_side(wrong, -chosen.contacts.side(wrong))
            chosen = chosen.with_contacts(contacts)
        failed = list(candidates) if wrong is None else [*candidates, wrong]
        raise _jammed(configuration, front, failed)
    except JammedError as jam:
        stops, every = front.contacts.stops, len(front.contacts.sides)
        guides = [c for c in range(stops, stops + every) if front.equations.is_guide(c)]
        guides = [c for c in guides if c != turned]
        if 2 ** len(guides) > SIDES_TRIED_MAX:
            raise JammedError(
                f"{jam}; {len(guides)} guides have more than the {SIDES_TRIED_MAX} combinations of "
                "sides that are tried"
            ) from None
        for contacts in _all_sides(front.contacts, guides):
            try:
                chosen, wrong = on_sides(front.with_contacts(contacts))
            except JammedError:
                continue
            if wrong is None:
                return chosen
        raise


def _all_sides(contacts: ContactState, guides: Sequence[int]) -> Iterator[ContactState]:
    """Yield the contacts with all sides of some guides; that of the first one changes fastest."""
    if not guides:
        return
    for number in range(2 ** len(guides)):
        for k, c in enumerate(guides):
            contacts = contacts.with_side(c, -1 if number >> k & 1 else 1)
        yield contacts


def _guide_on_wrong_side(
    configuration: Configuration, front: Front, turned: int | None
) -> int | None:
    """Return the first slipping guide but ``turned`` that pushes to the wrong side of its line."""
    slipping = [c for c in front.equations.slipping_guides if c != turned]
    least = -configuration.scales.zero_force
    lam = front.evaluate().lam if slipping else np.zeros(0)
    return next((c for c in slipping if front.equations.side_force(c, lam) < least), None)


def release_moving(configuration: Configuration, front: Front) -> tuple[Front, int | None]:
    """Release the held stops whose gaps have a rate, and find a stop that is struck.

    Gap rates result from changes of a wall's velocity and from impulses.  If a wall retreats, the
    body leaves it; a force may close the gap again later.  If a wall advances, or an impulse moves
    a body towards a wall that it touches, the stop is struck.

    Returns
    -------
    front : Front
        The front; held stops whose gap has a rate are open.
    struck : int or None
        A stop that is struck.
    """
    gaps, rates = front.gaps_and_rates()
    scales, contacts, struck = configuration.scales, front.contacts, None
    for i in range(contacts.stops):
        closed, compliant = i in front.contacts.held, configuration.mechanism.stops[i].compliant
        if closed and abs(rates[i]) > scales.zero_speed:
            contacts = contacts.released(i)
        elif compliant or closed or gaps[i] > scales.touching:
            continue
        struck = i if rates[i] < -scales.zero_speed and not compliant else struck
    return front.with_contacts(contacts), struck


# --- stops ------------------------------------------------------------------------------------


def holding_stops(
    configuration: Configuration, front: Front, candidates: Sequence[int]
) -> list[int]:
    """Return the stops at rest that stay closed: their forces push, and the other stops open.

    Raises
    ------
    JammedError
        If the friction of sliding contacts excludes all choices.
    """
    holding = find_holding_stops(configuration, front, candidates)
    if holding is None:
        raise _jammed(configuration, front, candidates)
    return holding


def find_holding_stops(
    configuration: Configuration, front: Front, candidates: Sequence[int]
) -> list[int] | None:
    """Return the stops at rest that stay closed: their forces push, and the other stops open.

    In this choice contacts with a sliding velocity slip, and contacts at rest are frictionless.  If
    stops can move only together, a subset with independent rows holds.  The result is None if no
    choice satisfies the laws of contact.
    """
    every, scales = sorted(set(candidates)), configuration.scales
    if not every:
        return []
    sliding = equations_holding(scales, front, every).contacts.modes
    equations = equations_holding(scales, front, ())
    slips = [sliding[i].slip for i in every]
    found = rest_forces(scales, front, equations, every, slips, ())
    if found is None:
        return None
    pressing = zip(every, found.normal, strict=True)
    holding = [i for i, press in pressing if press > _least_pressing(scales, front, i)]
    contacts = equations_holding(scales, front, holding).contacts
    # Only the rows of several stops may be dependent: check these.
    agrees = len(every) == 1 or _agrees(scales, front, contacts, every, {})
    return holding if agrees else None


def _least_pressing(scales: Scales, front: Front, stop: int) -> float:
    """Return the acceleration of a gap by its normal force above which a stop holds [m/s^2].

    A stop that was released because its force was round-off, and then penetrated, was pressed.
    """
    gaps, _ = front.gaps_and_rates()
    penetration = -gaps[stop] - front.contacts.depth(stop)
    return scales.zero_acceleration if penetration < scales.touching / 2 else 0.0


def _failure(
    configuration: Configuration, front: Front, contacts: Iterable[int], failure: tuple[str, str]
) -> str:
    """Return the message of a failure at some contacts, from its cause and its remedy."""
    names, (cause, remedy) = contact_names(configuration.mechanism, contacts), failure
    return f"{cause} at t = {front.time:.9g} s ({names}): {remedy}"


def _jammed(configuration: Configuration, front: Front, contacts: Iterable[int]) -> JammedError:
    """Return the error of contacts without a solution, with the limit of a search that it ended.

    If guides are at rest, all modes of the contacts at rest are tried, unless there are too many.
    """
    every, equations, remark = sorted(set(contacts)), front.equations, ""
    resting = [
        c
        for c in every
        if equations.friction_coefficient(c) > 0.0
        and _sliding_mode(configuration.scales, front, c, 0.0) is FRICTIONLESS
    ]
    stops = [c for c in every if c < front.contacts.stops and c not in front.contacts.pressed]
    if any(map(equations.is_guide, resting)) and (
        2.0 ** len(stops) * 3.0 ** len(resting) > MODES_TRIED_MAX
    ):
        remark = (
            f"; {len({*stops, *resting})} contacts at rest may have more than the "
            f"{MODES_TRIED_MAX} combinations of modes that are tried"
        )
    return JammedError(_failure(configuration, front, every, JAMMED) + remark)


def equations_holding(scales: Scales, front: Front, stops: Sequence[int]) -> Equations:
    """Return the equations in which these stops hold and all contacts with a velocity slip."""
    e, v, system, contacts = front.e, front.v, front.equations.system, front.contacts
    speeds = np.concatenate([system.slide_rows.rates(e, v), system.rub_rows.rates(e, v)])
    contacts = contacts.unloaded()
    for c, speed in enumerate(speeds):
        if c in stops:
            contacts = contacts.held_with(c, slip_mode(scales, float(speed)))
        elif contacts.modes[c].closed:
            contacts = contacts.with_mode(c, slip_mode(scales, float(speed)))
    return front.equations.with_contacts(contacts)


# --- friction ---------------------------------------------------------------------------------


def slip_mode(scales: Scales, speed: float, slow: float = 0.0) -> ContactMode:
    """Return the slip mode of a sliding speed [m/s]; FRICTIONLESS up to ``slow`` or round-off."""
    if abs(speed) <= slow or abs(speed) <= scales.zero_speed:
        return FRICTIONLESS
    return ContactMode.slipping(speed)


def _slide_acceleration(front: Front, contact: int) -> float:
    """Return the sliding acceleration of a contact in its present mode [m/s^2]."""
    a = front.evaluate().a
    return front.equations.slip_acceleration(contact, front.e, front.v, a)


def _with_friction(
    configuration: Configuration,
    front: Front,
    candidates: Sequence[int],
    slipped: int | None,
    turning: Mapping[int, float],
) -> Front:
    """Return the front with the modes of all contacts with friction.

    Parameters
    ----------
    configuration : Configuration
        Mechanism and scales.
    front : Front
        State, with the stops that hold if contacts at rest are frictionless.
    candidates : sequence of int
        Stops that touch, held or not.
    slipped : int or None
        A contact that has reached the limit of friction: it cannot stick.
    turning : mapping
        Sliding acceleration of a contact whose sliding velocity has fallen to zero [m/s^2].

    Raises
    ------
    JammedError
        If no forces satisfy the laws of all contacts.
    """
    held, every = list(front.contacts.held), sorted(set(candidates))
    rubbing = _with_coefficients(front.equations, every)
    chosen = (held, every) if len(held) < len(every) else (held,)
    yielding: tuple[set[int | None], ...] = ({slipped}, {*every, *rubbing})
    # A contact at its limit sticks if it can; the forces of contacts that can hardly move against
    # each other may then exceed their limits, which they do not if it slips.
    for slipping, stops in product(yielding, chosen):
        found = _modes_of(configuration.scales, front, stops, every, slipping, turning)
        if found is not None:
            return front.with_contacts(found)
    raise _jammed(configuration, front, {*every, *rubbing})


def _modes_of(
    scales: Scales,
    front: Front,
    stops: Sequence[int],
    every: Sequence[int],
    slipped: Collection[int | None],
    turning: Mapping[int, float],
) -> ContactState | None:
    """Return the modes that follow from the forces of ``stops`` and the contacts with friction.

    Contacts in ``slipped`` do not stick at the limit of friction.  Return None if no forces satisfy
    their laws, or if another stop that touches would close.
    """
    contacts, rubbing = front.contacts, _with_coefficients(front.equations, stops)
    modes, at_rest = _sliding_modes(scales, front, {*stops, *rubbing}, rubbing, turning)
    for c in rubbing:
        contacts = contacts.with_mode(c, modes[c]) if contacts.modes[c].closed else contacts
    if not at_rest:
        return contacts
    contacts, slips = contacts.unloaded(), [modes[i].slip for i in stops]
    equations = front.equations.with_contacts(contacts)
    found = rest_forces(scales, front, equations, stops, slips, at_rest)
    if found is None:
        return None
    pressed = [
        k for k, i in enumerate(stops) if found.normal[k] > _least_pressing(scales, front, i)
    ]
    for i in (stops[k] for k in pressed):
        contacts = contacts.held_with(i, modes[i] if i in rubbing else FRICTIONLESS)
    contacts = _sticking_or_slipping(scales, contacts, at_rest, found, pressed, slipped)
    guides = [c for c in at_rest if equations.is_guide(c)]
    for c, force in zip(guides, found.sides, strict=True):
        contacts = contacts.with_side(c, -1 if force < 0.0 else 1)
    slack = dict(zip(at_rest, scales.zero_acceleration / found.mobility, strict=True))
    return contacts if _agrees(scales, front, contacts, every, slack) else None


def _sliding_modes(
    scales: Scales,
    front: Front,
    contacts: Collection[int],
    rubbing: Sequence[int],
    turning: Mapping[int, float],
) -> tuple[dict[int, ContactMode], list[int]]:
    """Return the slip modes of contacts, and those with friction that do not slide.

    Contacts that cannot move independently are left out of these: loops and held stops carry their
    load.  They slide if the other parts impose the motion after a reversal, as where the links of a
    loop form a straight line.
    """
    slow = {c: abs(rate) * scales.time_resolution(front.time) for c, rate in turning.items()}
    modes = {c: _sliding_mode(scales, front, c, slow.get(c, 0.0)) for c in contacts}
    resting = [c for c in rubbing if modes[c] is FRICTIONLESS]
    at_rest = [c for c in resting if _mobile(front, front.contacts, c)]
    for c in turning.keys() & (set(resting) - set(at_rest)):
        if abs(rate := turning[c]) > scales.zero_acceleration:
            modes[c] = ContactMode.slipping(rate)
    return modes, at_rest


def _with_coefficients(equations: Equations, stops: Sequence[int]) -> list[int]:
    """Return those of ``stops``, pressed stops, friction points and guides that have friction."""
    contacts = equations.contacts
    pressed = [i for i in contacts.pressed if i not in stops and not contacts.is_free(i)]
    others = range(contacts.stops, len(contacts.modes))
    return [c for c in (*stops, *pressed, *others) if equations.friction_coefficient(c) > 0.0]


def _sliding_mode(scales: Scales, front: Front, contact: int, slow: float) -> ContactMode:
    """Return the slip mode of a contact; FRICTIONLESS if it is not faster than ``slow``."""
    row = front.equations.slip_row(contact, front.e)
    return slip_mode(scales, float(row @ front.v), slow)


def _mobile(front: Front, contacts: ContactState, contact: int) -> bool:
    """Return whether a contact can slide while all other held and sticking contacts rest."""
    row = front.equations.slip_row(contact, front.e)[None]
    if contacts.modes[contact].closed:
        contacts = contacts.with_mode(contact, FRICTIONLESS)
    held = front.equations.with_contacts(contacts).rows.jacobian(front.e)
    return front.at.independent(held, row)


def _sticking_or_slipping(
    scales: Scales,
    contacts: ContactState,
    at_rest: Sequence[int],
    found: RestForces,
    pressed: Sequence[int],
    slipped: Collection[int | None],
) -> ContactState:
    """Return the modes, with those of contacts at rest chosen by their forces.

    If contacts can stick only together, those with friction below its limit stick, because they are
    independent of each other; the others have friction at its limit, or none.  If all of them are
    at their limits and one of them has slipped, they slip together.  A contact without a normal
    force has no friction in either direction of slip, and changes it as soon as it moves.
    """
    zero = scales.zero_acceleration
    slack, at_limit = zero / found.mobility, found.at_limit(zero)
    closed = [contacts.modes[c].closed for c in at_rest]
    moves, small = np.abs(found.slide) > zero, np.abs(found.friction) <= slack
    leaving = [j for j, c in enumerate(at_rest) if c in slipped]
    order = np.where(at_limit, 3, small)
    order[leaving] = np.minimum(order[leaving], 2)
    rests = [j for j in np.argsort(order, kind="stable").tolist() if closed[j] and not moves[j]]
    sticks, force = sticking(found, pressed, rests, leaving, zero)
    for j in np.flatnonzero(closed).tolist():
        if moves[j]:
            mode = ContactMode.slipping(found.slide[j])
        elif j in sticks:
            mode = STICK
        else:
            full = abs(force[j]) >= found.limit[j] - slack[j]
            mode = ContactMode.slipping(-force[j]) if full else FRICTIONLESS
        contacts = contacts.with_mode(at_rest[j], mode)
    return contacts


def _agrees(
    scales: Scales,
    front: Front,
    contacts: ContactState,
    stops: Sequence[int],
    at_rest: Mapping[int, float],
) -> bool:
    """Return whether the modes satisfy the laws of all contacts, up to round-off.

    Parameters
    ----------
    scales : Scales
        Scales of the mechanism.
    front : Front
        State.
    contacts : ContactState
        Modes of all contacts.
    stops : sequence of int
        Stops that touch.
    at_rest : mapping
        For each contact with friction that does not slide: the excess of its friction force over
        the limit that is accepted as round-off [N].
    """
    e, v, equations = front.e, front.v, front.equations.with_contacts(contacts)
    evaluation = equations.at(front.time, front.y)
    a = evaluation.a
    opening = equations.gap_accelerations(front.time, e, v, a, evaluation.pressure)
    forces, zero = (
        equations.stop_forces(evaluation.lam, evaluation.pressure),
        scales.zero_acceleration,
    )
    for i in stops:
        if forces[i] <= 0.0 if i in contacts.held else opening[i] < -zero:
            return False
    for c, slack in at_rest.items():
        mode = contacts.modes[c]
        if mode is STICK:
            force, limit = equations.friction(c, e, evaluation.lam, evaluation.pressure)
            if abs(force) > limit + max(FRICTION_EXCESS_RTOL * limit, slack):
                return False
        elif mode.slip * equations.slip_acceleration(c, e, v, a) < -zero:
            return False
    return True
