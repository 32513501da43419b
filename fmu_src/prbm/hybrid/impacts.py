"""Rigid impacts: the stops that take part, their impulses, and the state after the impact."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import SimulationError
from ..base.tolerances import IMPACT_COUNT_MAX, REACTION_RANK_RTOL, VANISHED_BOUNCE_RTOL
from ..mechanics import contact, forces
from ..mechanics.arrays import Real
from ..mechanics.modal import fundamental_at, simulated_restitution
from . import compliant
from .configuration import Configuration, contact_names
from .contact_modes import choose_modes, equations_holding, find_holding_stops
from .front import Front, Latched
from .records import Impact


@dataclass(frozen=True)
class Impulses:
    """The impulses of an impact by stop [N s], and the rates after it, (n,) [rad/s]."""

    after: Real
    normal: Mapping[int, float]
    tangential: Mapping[int, float]


def impact(configuration: Configuration, front: Front, hit: int) -> tuple[Front, list[Impact]]:
    """Resolve the impact of a stop, and of all other stops whose gaps close at the same time.

    Parameters
    ----------
    configuration : Configuration
        Mechanism and scales.
    front : Front
        State before the impact.
    hit : int
        The stop whose gap has closed.

    Returns
    -------
    front : Front
        State after the impact, with the contact modes chosen anew.
    impacts : list of Impact
        One for each stop that was struck, except for captures.

    Raises
    ------
    SimulationError
        If no impulses satisfy the laws of contact.
    """
    stops = configuration.mechanism.stops
    if stops[hit].compliant:
        return compliant.begin_contact(configuration, front, hit), []
    gaps, rates = front.gaps_and_rates()
    near, zero = configuration.scales.touching, configuration.scales.zero_speed
    struck = [
        i
        for i in front.contacts.open_stops
        if rates[i] < 0.0 and (i == hit or gaps[i] <= near) and not stops[i].compliant
        if _can_be_struck(front, i)
    ]
    if not struck:
        resting = [hit] if rates[hit] <= zero else []
        return choose_modes(configuration, front, resting=resting), []
    front = compliant.unfrozen(front)
    held = list(front.contacts.held)
    soft = [i for i in struck if _captured(configuration, front, i, held, float(-rates[i]))]
    restitution = np.array(
        [0.0 if i in soft else configuration.stop_value(i, "restitution") for i in struck]
    )
    held += _joined(configuration, front, struck, restitution)
    impulses = _impulses(configuration, front, struck, held, restitution)
    counted = [i for i in struck if i not in soft]
    front, impacts = _after_impact(configuration, front, counted, impulses)
    _, rates = front.gaps_and_rates()
    resting = [i for i in (*struck, *held) if rates[i] <= zero]
    front = compliant.rephased(front.with_contacts(front.contacts.opened()))
    return choose_modes(configuration, front, resting=resting), impacts


def _joined(
    configuration: Configuration, front: Front, struck: Sequence[int], restitution: Real
) -> list[int]:
    """Return the open stops that touch at rest and take part in an impact like held stops.

    Without restitution, bodies that touch each other move on together.  Impacts one after the other
    would reach this motion only in the limit of infinitely many.  Impacts with restitution do
    follow each other, unless the speed is round-off.
    """
    if restitution.any():
        return []
    gaps, rates = front.gaps_and_rates()
    near, zero = configuration.scales.touching, configuration.scales.zero_speed
    slow = bool(np.all(rates[struck] >= -zero))
    stops = configuration.mechanism.stops
    return [
        i
        for i in front.contacts.open_stops
        if i not in struck and not stops[i].compliant and gaps[i] <= near and rates[i] <= zero
        if slow or configuration.stop_value(i, "restitution") == 0.0
        if _can_be_struck(front, i)
    ]


def _can_be_struck(front: Front, stop: int) -> bool:
    """Return whether the gap of a stop can have a rate that is not round-off.

    It cannot where the body moves along a wall at rest and no motion across it is possible, as at
    the dead centre of a guide.
    """
    wall = front.inputs.walls[stop].motion(front.time)[1]
    return bool(wall != 0.0) or front.at.moves(front.at.gaps[[stop]])


def receive(front: Front, impulses: Real) -> Front:
    """Return the front after impulses from outside at the points of the forces.

    The work of a component P is P (u- + u+)/2, with the rate u along it before and after.  Loops
    transmit the impulses; impacts at stops follow later, in :func:`.contact_modes.release_moving`.
    Friction is finite and has no impulse: sticking contacts become free to slip or stick again.

    Parameters
    ----------
    front : Front
        State before.
    impulses : (3 b,)
        Impulses of each force along x and y [N s] and about its point [N m s].
    """
    system = front.equations.system
    rows = np.vstack([forces.load_rows(system, frame, front.e) for frame in system.pushed])
    after = front.v + front.at.response(rows) @ impulses
    work = float(impulses @ (rows @ (front.v + after))) / 2
    front = front.with_velocities(after, work=work)
    return front.with_contacts(front.contacts.without_friction())


def _captured(
    configuration: Configuration, front: Front, stop: int, held: list[int], speed: float
) -> bool:
    """Return whether a stop that is struck slowly comes to rest.

    A stop comes to rest if it would be pressed after an impact without restitution, and its speed
    is below ``rest_speed`` or the next bounce would be lower than ``VANISHED_BOUNCE_RTOL`` of the
    size.  A stop whose speed is round-off always comes to rest.
    """
    scales = configuration.scales
    if speed <= scales.zero_speed:
        return True
    after = _impulses(configuration, front, [stop], held, np.zeros(1)).after
    landed = front.with_velocities(after)
    holding = find_holding_stops(configuration, landed, [stop, *held])
    if holding is None or stop not in holding:
        return False
    if speed < configuration.stop_value(stop, "rest_speed"):
        return True
    equations = equations_holding(scales, landed, holding)
    evaluation = equations.at(front.time, landed.y)
    force = float(equations.stop_forces(evaluation.lam)[stop])
    pressing = force * landed.at.mobility(landed.at.gaps[[stop]])
    return speed**2 < 2.0 * pressing * VANISHED_BOUNCE_RTOL * scales.length


# --- impulses ---------------------------------------------------------------------------------


def _impulses(
    configuration: Configuration,
    front: Front,
    struck: list[int],
    held: list[int],
    restitution: Real,
) -> Impulses:
    """Return the impulses of an impact.

    If the struck stops have no friction, the impulses of held stops are unknowns of the same
    complementarity problem.  Otherwise held stops are constraints, which are removed if they would
    pull.  The friction of held stops and of friction points is finite and has no impulse.
    """
    mu = np.array([configuration.stop_value(i, "friction") for i in struck])
    try:
        if mu.any():
            return _impulses_with_friction(configuration, front, struck, held, mu, restitution)
        return _impulses_without_friction(configuration, front, struck, held, restitution)
    except (SimulationError, np.linalg.LinAlgError) as error:
        names = contact_names(configuration.mechanism, [*struck, *held])
        raise SimulationError(f"impact at t = {front.time:.9g} s ({names}): {error}") from None


def _impulses_without_friction(
    configuration: Configuration,
    front: Front,
    struck: list[int],
    held: list[int],
    restitution: Real,
) -> Impulses:
    """Return the impulses of an impact without friction at the stops that are struck."""
    at, partners = front.at, struck + held
    mobilities = np.array(front.inputs.mobilities)
    G = at.gaps[partners]
    X = at.response(G)
    W = at.inverse_mass(G, X) + np.diag(mobilities[partners])
    u = front.gaps_and_rates()[1][partners]
    restitutions = np.concatenate([restitution, np.zeros(len(held))])
    P = contact.newton(W, np.minimum(u, 0.0), restitutions, configuration.scales.speed)
    return Impulses(front.v + X @ P, dict(zip(partners, P.tolist(), strict=True)), {})


def _impulses_with_friction(
    configuration: Configuration,
    front: Front,
    struck: list[int],
    held: list[int],
    mu: Real,
    restitution: Real,
) -> Impulses:
    """Return the impulses of an impact with friction at the stops that are struck.

    If a held stop that was removed would close, all held stops are treated as struck, without
    restitution and friction.
    """
    v, k, kept, speed = front.v, len(struck), list(held), configuration.scales.speed
    at, u = front.at, front.equations.gap_rates(front.time, front.e, v)
    mobilities = np.array(front.inputs.mobilities)[struck]
    T = at.slides[struck]
    both = np.vstack([at.gaps[struck], T])
    rates = np.concatenate([u[struck], T @ v])
    while True:
        rows = np.vstack([at.loops, at.gaps[kept]])
        X = at.response_beside(rows, both)
        W = at.inverse_mass(both, X)
        W[range(k), range(k)] += mobilities
        if k == 1:
            P = np.array(contact.stronge(W, rates, float(mu[0]), float(restitution[0]), speed))
        else:
            P = contact.several(W, rates, mu, restitution, speed)
        after = v + X @ P
        left = at.M @ (after - v) - both.T @ P
        solution = np.linalg.lstsq(rows.T, left, rcond=REACTION_RANK_RTOL)[0]
        reaction = dict(zip(kept, solution[len(at.loops) :].tolist(), strict=True))
        pulling = [i for i, p in reaction.items() if p < 0.0]
        if not pulling:
            break
        kept = [i for i in kept if i not in pulling]
    released = [i for i in held if i not in kept]
    closing = front.equations.gap_rates(front.time, at.e, after)[released]
    if closing.min(initial=0.0) < -configuration.scales.zero_speed:
        none = np.zeros(len(held))
        return _impulses_with_friction(
            configuration, front, struck + held, [], np.append(mu, none),
            np.append(restitution, none),
        )  # fmt: skip
    normal = dict(zip(struck, P[:k].tolist(), strict=True)) | reaction
    return Impulses(after, normal, dict(zip(struck, P[k:].tolist(), strict=True)))


# --- the state after an impact ----------------------------------------------------------------


def _after_impact(
    configuration: Configuration, front: Front, counted: Sequence[int], impulses: Impulses
) -> tuple[Front, list[Impact]]:
    """Return the front after an impact, with energies and latched outputs, and the record.

    A normal impulse P dissipates -P (u- + u+)/2, with the rate u of the gap before and after the
    impact.  For a tangential impulse, u is the sliding velocity.  The wall does the work
    -P (w- + w+)/2; its velocity w changes by its mobility times P.
    """
    e, v, after, normal = front.e, front.v, impulses.after, impulses.normal
    before = front
    u = front.equations.gap_rates(front.time, e, v)
    front = _with_pushed_walls(front, normal)
    u_after = front.equations.gap_rates(front.time, e, after)
    lost = {i: -P * float(u[i] + u_after[i]) / 2 for i, P in normal.items()}
    for i, P in impulses.tangential.items():
        lost[i] -= P * float(front.at.slides[i] @ (v + after)) / 2
    old, new = (
        {i: float(one.inputs.walls[i].motion(front.time)[1]) for i in normal}
        for one in (before, front)
    )
    work = -sum(P * (old[i] + new[i]) / 2 for i, P in normal.items())
    front = front.with_velocities(after, sum(lost.values()), work)
    latched = list(front.latched)
    for i, P in normal.items():
        latched[i] = replace(latched[i], impulse_sum=latched[i].impulse_sum + P)
    if counted:
        phi, M = fundamental_at(configuration.system, front.q)
        modal = simulated_restitution(phi, M, v, after)
        for i in counted:
            latched[i] = Latched(
                impact_count=min(latched[i].impact_count + 1, IMPACT_COUNT_MAX),
                impact_time=front.time,
                approach_speed=float(-u[i]),
                rebound_speed=float(u_after[i]),
                impulse=normal[i],
                energy_lost=lost[i],
                modal_restitution=modal,
                impulse_sum=latched[i].impulse_sum,
            )
    stops = configuration.mechanism.stops
    impacts = [
        Impact(stops[i].name, front.time, before.q, v, after, normal[i], latched[i])
        for i in counted
    ]
    return replace(front, latched=tuple(latched)), impacts


def _with_pushed_walls(front: Front, normal: Mapping[int, float]) -> Front:
    """Return the front in which impulses have changed the velocities of walls and references."""
    t, walls = front.time, list(front.inputs.walls)
    for i, P in normal.items():
        change = front.inputs.mobilities[i] * P
        if change:
            walls[i] = walls[i].pushed(t, change)
    return front if tuple(walls) == front.inputs.walls else front.with_walls(tuple(walls))
