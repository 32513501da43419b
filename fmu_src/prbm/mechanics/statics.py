r"""Static equilibrium under gravity, loads and a holding force, and the tangent stiffness there.

At rest the torques balance,

    P(q) + Phi^T Re(w e) + Q + J^T lam + r^T F = 0,

with the forces P of flexures, joints and springs (:mod:`prbm.mechanics.elements`), the row w of
gravity and the forces, the moments Q, the Jacobian J of the loops and their forces lam, the
Jacobian r of the held displacement and the holding force F.  Second derivatives by the directions
couple at most the angle and the stretch of one arm, because every position is linear in the arms.

Bodies that nothing connects to the ground are placed: no balance determines their displacements and
rotations.  They are as drawn, or at the displacement or rotation of the release.  Bodies that only
springs and guides connect to it may have motions without stiffness and load, which do not occur.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..base.errors import EquilibriumError, SimulationError
from ..base.tolerances import (
    RELEASE_LEVER_RTOL,
    ROW_RTOL,
    SPRING_IDLE_RTOL,
    STATICS_CLOSE_SHARE,
    STATICS_CONSTRAINT_RTOL,
    STATICS_FORCE_RTOL,
    STATICS_GROWTH_MAX,
    STATICS_HINT_SHARE,
    STATICS_ITERATIONS_MAX,
    STATICS_LIMP_RATIO,
    STATICS_LOAD_STEP_MIN,
    STATICS_LOAD_STEPS_MAX,
    STATICS_ROUNDING_RTOL,
    STATICS_SHRINK,
    STATICS_SHRINK_MIN,
    STATICS_STEP_ATOL,
    STATICS_TURN_AIM,
    STATICS_TURN_MAX,
    STATICS_TURN_MIN,
    STIFFNESS_ROUNDING_RTOL,
)
from . import constraints
from .arrays import Complex, Real, Whole
from .elements import Elements, geometric_stiffness
from .forces import field_row, force_row
from .inputs import checked_loads
from .system import Rows, System
from .system import unit as unit_vector


class Held(NamedTuple):
    """Bodies that are held at given positions, instead of the released one.

    Parameters
    ----------
    rows : Rows
        The loops and guides, then a row for each position that forces and moments hold.
    places : (p,)
        The coordinates that are placed.
    angles : tuple of (int, float)
        Coordinates that are held at angles [rad].
    """

    rows: Rows
    places: Real
    angles: tuple[tuple[int, float], ...]


class _Given(NamedTuple):
    """What is given: displacement, row and moments of the loads, share of strains, pretension.

    Positions, if there are any, take the place of the displacement.
    """

    held: float | None
    w: Complex
    moment: Real
    share: float
    positions: Held | None = None


@dataclass(frozen=True)
class Equilibrium:
    """A static shape.

    Parameters
    ----------
    q : (n,)
        Angles [rad].
    lam : (r,)
        Multipliers of the loops: forces at their closures [N].
    force : float
        Holding force on the released body along the direction of the release [N], or its holding
        moment [N m] if the release is by an angle; 0 if free.
    load : (d,) complex
        Row w of gravity and the forces that act, Q = Phi^T Re(w e) [N m].
    """

    q: Real
    lam: Real
    force: float
    load: Complex


def tangent_stiffness(K: Real, w: Complex, rows: Rows, lam: Real, e: Complex) -> Real:
    r"""Stiffness about a shape, K + Phi^T D Phi with D = diag(Im(w e) + Re(lam^T B e)) [N m/rad].

    An arm with g = Im(w e) + Re(lam^T B e) and h = Im(lam^T B e) - Re(w e) has the diagonal entries
    g for its angle and -g for its stretch, and h couples both.  Displacements have none.  Rows that
    bodies carry add :meth:`prbm.mechanics.system.Rows.carrier_stiffness` to D.

    Parameters
    ----------
    K : (n, n)
        Tangent stiffness of the elements [N m/rad].
    w : (d,) complex
        Row of the dead loads, Q = Phi^T Re(w e) [N m].
    rows, lam : Rows, (r,)
        Constraints and their multipliers [N].
    e : (d,) complex
        Directions.
    """
    system = rows.system
    pull = rows.pull(lam, e) - 1j * w * e
    K_t: Real = K + geometric_stiffness(pull, system.arm, system.Phi)
    if len(rows.carried):
        K_t += system.Phi.congruence(rows.carrier_stiffness(lam, e))
    return K_t


def equilibrium(
    system: System,
    displacement: float | None = None,
    loads: Mapping[str, float] | None = None,
    near: Equilibrium | None = None,
) -> Equilibrium:
    """Return the shape under gravity and loads, free or with the released body held.

    Gravity, loads and displacement are raised together from the straight, unloaded shape, and the
    shape is followed.  It is the one that the mechanism reaches when it is loaded slowly.  If it
    buckles to either side of a shape that stays in equilibrium, this unstable shape is followed.
    If it snaps, the result is an equilibrium beyond the snap, stable or not, if one is found.

    Parameters
    ----------
    system : System
        The mechanism.
    displacement : float or None
        Displacement of the released point along the direction of the release [m], held by a force
        along that direction; the rotation of the body [rad], held by a moment, if the release is
        by an angle.  None: no holding force.
    loads : mapping or None
        Forces and moments by the names of the inputs, ``force.x`` and ``force.y`` [N],
        ``force.moment`` [N m] for a :class:`prbm.mechanism.parts.Force` of the name
        ``force``.  They keep their directions; those that are not given are zero.
    near : Equilibrium or None
        Shape held under the same loads, from which the displacement is changed slowly.  None, or
        if the displacement is not reached from there: the straight, unloaded shape.

    Raises
    ------
    ParameterError
        If a load is unknown, or not a finite number.
    EquilibriumError
        If slow loading reaches no static shape with this displacement and these loads, or the body
        turns about the point that is to be displaced.
    """
    w, moment = load_row(system, loads or {})
    drawn = system.directions(system.q0)
    loaded = bool(displacement) or np.any(w) or np.any(moment)
    loaded = loaded or np.any(Elements(system).force(system.q0, drawn))
    open_by = system.loop_rows.values(drawn)
    closed = np.abs(open_by).max(initial=0.0) <= STATICS_CONSTRAINT_RTOL * system.length
    if closed and near is None and not loaded:
        return Equilibrium(system.q0, np.zeros(len(system.loops)), 0.0, w)
    holding = displacement is not None and not system.released_free
    if holding and displacement is not None:
        if held_by_loops(system):  # The matrix of the balance would be singular.
            raise EquilibriumError(f"{_release_text(system, displacement)}: {immobile(system)}")
        if displacement != 0.0 and turns_about_point(system):
            raise EquilibriumError(
                f"{_release_text(system, displacement)}: {_turning_message(system)}"
            )
    n, r = system.n, len(system.loops)
    unit = _holding_unit(system)

    def from_straight(share: float) -> _Given:
        held = None if displacement is None else share * displacement
        return _Given(held, share * w, share * moment, share)

    done = 0.0
    if near is not None and displacement is not None and holding:
        begin = system.amount(near.q)
        change = displacement - begin
        state = np.concatenate([near.q, near.lam, [near.force / unit]])
        state, done = _follow(
            system, lambda share: _Given(begin + share * change, w, moment, 1.0), state
        )
    if done < 1.0:
        straight = np.concatenate([system.q0, np.zeros(r + holding)])
        state, done = _load_fully(system, from_straight, straight)
    if done < 1.0:
        reason = _unreachable(system, displacement, bool(loads), done)
        one_sided = any(spring.side for spring in system.mechanism.springs)
        raise EquilibriumError(reason + (_SLACK if one_sided else ""))
    force = unit * float(state[n + r]) if holding else 0.0
    return Equilibrium(state[:n], state[n : n + r], force, w)


def held_slowly(system: System, positions: Callable[[float], Held]) -> tuple[Real, float]:
    """Return the shape under gravity with bodies held at positions, as :func:`equilibrium`.

    Parameters
    ----------
    system : System
        The mechanism.
    positions : callable
        The positions at a share of the load.

    Returns
    -------
    q : (n,)
        Coordinates.
    done : float
        Share that is reached; below 1 if no equilibrium was found beyond it.
    """
    w, moment = load_row(system, {})

    def given(share: float) -> _Given:
        return _Given(None, share * w, share * moment, share, positions(share))

    straight = np.concatenate([system.q0, np.zeros(len(positions(0.0).rows))])
    state, done = _load_fully(system, given, straight)
    return state[: system.n], done


def sprung(system: System) -> Whole:
    """Return the coordinates of the bodies that only springs connect to the ground, (3 k,)."""
    found: Whole = np.setdiff1d(system.floating, system.placed)
    return found


def with_bodies_placed(system: System) -> System:
    """Return a system in which bodies without flexures and joints are placed, springs or not.

    They are as drawn, or at the displacement or rotation of the release, where a motion begins.
    The rows of guides between them alone are left out.
    """
    if not len(sprung(system)):
        return system
    loops = system.loop_rows.first(system.tied)
    return replace(
        system, placed=system.floating, loops=loops.B, loops_c=loops.c, loops_z=loops.every_z,
        loops_on=loops.every_on,
    )  # fmt: skip


def resting(system: System) -> tuple[Equilibrium, bool]:
    """Return the shape under gravity, and whether it is an equilibrium.

    If slow loading reaches none, bodies that only springs and guides connect to the ground are as
    drawn.

    Raises
    ------
    EquilibriumError
        If there is no equilibrium, and there are no such bodies.
    """
    try:
        return equilibrium(system), True
    except EquilibriumError:
        if not len(sprung(system)):
            raise
        found = equilibrium(with_bodies_placed(system))
        missing = len(system.loops) - len(found.lam)  # Of guides between placed bodies.
        return replace(found, lam=np.append(found.lam, np.zeros(missing))), False


def _load_fully(
    system: System, given: Callable[[float], _Given], straight: Real
) -> tuple[Real, float]:
    """Load the mechanism slowly from the straight shape; the arguments are those of _follow.

    If a direction has become unstable, the search may have jumped, and the path is followed
    closely; if that does not reach the load, the mechanism snaps.
    """
    state, done = _follow(system, given, straight)
    if done == 1.0:
        ends = (given(0.0), straight), (given(1.0), state)
        before, after = (_determinant_sign(system, *end) for end in ends)
        if before * after < 0:
            closely, reached = _follow(system, given, straight, closely=True)
            state = closely if reached == 1.0 else state
    return state, done


def _follow(
    system: System, given: Callable[[float], _Given], state: Real, closely: bool = False
) -> tuple[Real, float]:
    """Change what is given from a share of 0, with the state there, slowly towards a share of 1.

    The turn in a step determines the size of the next one, which does not grow after a rejected
    step.  A long step may jump to an unstable branch beside the path.  Closely, the steps turn
    little, and only the smallest of them may change the sign of the determinant.

    Returns
    -------
    state : (n + r,) or (n + r + 1,)
        Coordinates, multipliers of the loops and, if held, that of the holding force.
    done : float
        Share that is reached; below 1 if no equilibrium was found beyond it.
    """
    stiffness = Elements(system).drawn
    # Only bodies without a spring, for instance on a pin, may turn far in one load step.  If
    # another coordinate jumps, slow loading does not reach the shape.
    bent = sorted({*system.links, *np.flatnonzero(np.diag(stiffness) > 0.0).tolist()})
    done, step, growth = 0.0, 1.0, STATICS_GROWTH_MAX
    part = STATICS_CLOSE_SHARE if closely else 1.0
    sign = _determinant_sign(system, given(0.0), state) if closely else 0
    for _ in range(STATICS_LOAD_STEPS_MAX):
        if done == 1.0:
            break
        target = min(1.0, done + step)
        # The difference of target and done may be rounded to more than the smallest step.
        step, turn, ratio = min(step, 1.0 - done), math.inf, STATICS_SHRINK
        smallest, crossed = step <= STATICS_LOAD_STEP_MIN, 0
        now = given(target)
        trial = _newton(system, now, state)
        if trial is not None and _holds(system, now, trial):
            crossed = _determinant_sign(system, now, trial) if closely else 0
            if smallest or sign * crossed >= 0:
                turn = float(np.abs((trial - state)[bent]).max(initial=0.0))
                ratio = part * STATICS_TURN_AIM / max(turn, STATICS_TURN_MIN)
        if trial is not None and turn <= part * STATICS_TURN_MAX:
            state, done, sign = trial, target, crossed
            ratio, growth = min(growth, ratio), STATICS_GROWTH_MAX
        elif smallest:
            break
        else:
            ratio, growth = max(STATICS_SHRINK_MIN, ratio), 1.0
        step = max(STATICS_LOAD_STEP_MIN, ratio * step)
    return state, done


def _determinant_sign(system: System, given: _Given, state: Real) -> int:
    """Return the sign of the determinant of the balance in a state; 0 if it is singular."""
    rows = _holding_rows(system, given)
    kkt = _linear_balance(
        system, state[: system.n], (given.w, given.share), rows, state[system.n :]
    )
    return constraints.determinant_sign(kkt, system.n, system.length)


def _linear_balance(
    system: System, q: Real, given: tuple[Complex, float], rows: Rows, lam: Real
) -> Real:
    """Return [[K_t, rows^T], [rows, 0]] for loads and constraints with multipliers.

    What is given is the row w of the loads, and the share of strains and pretension.
    """
    w, share = given
    e = system.directions(q)
    G = rows.jacobian(e)
    K_t = tangent_stiffness(Elements(system).tangent(e, share), w, rows, lam, e)
    return _placed(system, constraints.saddle(K_t, G, G))


def _holding_rows(system: System, given: _Given) -> Rows:
    """Return the loops and the rows of what forces hold: the released body, or positions."""
    held = given.held
    if given.positions is not None:
        return given.positions.rows
    if held is None or system.released_free:
        return system.loop_rows
    return held_rows(system, held)


def held_rows(system: System, amount: float) -> Rows:
    """Return the loops and guides, and the row that holds the released body at an amount."""
    row, constant = system.holding(amount)
    return system.loop_rows.beside(Rows(system, row[None], np.array([constant])))


def _places(system: System, amount: float) -> Real:
    """Return the coordinates that are placed, at a displacement [m] or rotation [rad].

    The released body is displaced or turned, if it is among them; the others are as drawn.
    """
    q, release = system.q0.copy(), system.mechanism.release
    if system.released_free and release.turns:
        q[system.released.j] += amount
    elif system.released_free:
        k = system.placed.tolist().index(system.released.j)
        shift = amount * unit_vector(release.direction) / system.length
        q[system.placed[k - 2 : k]] += shift.real, shift.imag
    return q[system.placed]


def _placed(system: System, kkt: Real) -> Real:
    """Return the balance without the coordinates that are placed: their changes are zero."""
    placed = system.placed
    if len(placed):
        scale = float(np.abs(kkt[: system.n, : system.n]).max()) or 1.0
        kkt[placed], kkt[:, placed] = 0.0, 0.0
        kkt[placed, placed] = scale
    return kkt


def _holding_unit(system: System) -> float:
    """Return the holding force or moment of the multiplier one: an angle's row has the size."""
    return system.length if system.mechanism.release.turns else 1.0


def load_row(system: System, loads: Mapping[str, float]) -> tuple[Complex, Real]:
    """Return the row w of gravity and the given forces, repeated, and the moments [N m]."""
    given = checked_loads(system.mechanism, loads)
    w, moment = field_row(system.S, system.gravity), np.zeros(system.n)
    for force, frame in zip(system.mechanism.forces, system.pushed, strict=True):
        x, y, turning = (given[f"{force.name}.{what}"] for what in ("x", "y", "moment"))
        w = w + force_row(frame.A, complex(x, y))
        moment[frame.j] += turning
    return system.repeat_columns(w), moment


def free_displacement(system: System) -> float:
    """Return the rest position of the released body under gravity, without stops.

    It is the displacement of the released point from the straight shape along the release [m], or
    the rotation of the body [rad] if the release is by an angle.
    """
    return system.amount(resting(system)[0].q)


def _newton(system: System, given: _Given, start: Real) -> Real | None:
    """Find the equilibrium with what is given; None without convergence."""
    n, elements = system.n, Elements(system)
    held, w, moment, share, positions = given
    rows = _holding_rows(system, given)
    stiffest = float(np.abs(elements.drawn).max())
    springs_scale = STATICS_FORCE_RTOL * stiffest
    idle = sprung(system)
    least = SPRING_IDLE_RTOL * (stiffest or float(np.abs(w).max()) or 1.0)
    state, turn = start.copy(), math.inf
    places = _places(system, held or 0.0) if positions is None else positions.places
    state[system.placed] = places
    for _ in range(STATICS_ITERATIONS_MAX):
        q, lam = state[:n], state[n:]
        e = system.directions(q)
        G = rows.jacobian(e)
        loads = system.Phi.to_coordinates((w * e).real) + moment
        torque = elements.force(q, e, share) + loads + lam @ G
        torque[system.placed] = 0.0
        open_by = rows.values(e)
        closed = (
            not len(open_by) or np.abs(open_by).max() <= STATICS_CONSTRAINT_RTOL * system.length
        )
        # Torques of springs, and the torques that are added here: these are rounded.
        added = float(np.abs(w).max() + np.abs(lam) @ np.abs(rows.B).max(axis=1, initial=0.0))
        scale = max(springs_scale, STATICS_ROUNDING_RTOL * added)
        balanced = closed and np.abs(torque).max() <= scale
        if balanced and turn <= STATICS_STEP_ATOL:
            return state
        K_t = tangent_stiffness(elements.tangent(e, share), w, rows, lam, e)
        K_t[idle, idle] += least
        kkt = _placed(system, constraints.saddle(K_t, G, G))
        try:
            right = np.concatenate([torque, -open_by])
            change = constraints.solve(kkt, right, n, system.length)
        except SimulationError:
            return state if balanced else None
        change[n:] *= -1.0
        turn = float(np.abs(change[:n]).max())
        if not math.isfinite(turn):
            return None
        state = state + change * min(1.0, STATICS_TURN_MAX / max(turn, STATICS_TURN_MIN))
    return None


def _holds(system: System, given: _Given, state: Real) -> bool:
    """Return whether a shape is held at what is given, and not half a turn or more away.

    The sine that holds a rotation vanishes there, too.
    """
    if given.positions is not None:
        return all(abs(state[j] - at) < STATICS_TURN_MAX for j, at in given.positions.angles)
    held = given.held
    if held is None or not system.mechanism.release.turns or system.released_free:
        return True
    return abs(system.amount(state[: system.n]) - held) < STATICS_TURN_MAX


_SLACK = "; springs that act on one side carry no load while they are slack"


def _unreachable(system: System, displacement: float | None, loaded: bool, done: float) -> str:
    weight = "gravity and " if system.gravity else ""
    if loaded:
        return (
            f"no static equilibrium was found beyond {100 * done:.3g} % of {weight}the loads, "
            "raised in proportion: reduce the loads, or stiffen the flexures"
        )
    if displacement is None:
        return (
            "no static equilibrium under gravity was found: the flexures are too weak for this "
            "load; reduce gravity or the masses, or stiffen the flexures"
        )
    where = (
        f"{_release_text(system, displacement)} cannot be reached: no equilibrium was found beyond "
        f"{done * displacement + 0.0:.4g} {_unit(system)}"
    )
    if not system.gravity:  # The shape does not depend on the size of the stiffness.
        pins = (
            ""
            if done > STATICS_HINT_SHARE
            else (
                "; if a body or a flexure turns freely on pins, nothing holds it without gravity: "
                "clamp an end of it, or add gravity"
            )
        )
        return f"{where}; release closer to the straight shape{pins}"
    limp = abs(system.gravity) * float(np.abs(system.S).max()) > STATICS_LIMP_RATIO * float(
        np.abs(Elements(system).drawn).max()
    )
    units = "; or check the units of youngs_modulus and thickness" if limp else ""
    return (
        f"{where} (gravity raised in proportion); release closer to the straight shape, or reduce "
        f"gravity across the motion{units}"
    )


def _unit(system: System) -> str:
    return "rad" if system.mechanism.release.turns else "m"


def _release_text(system: System, amount: float) -> str:
    """Return the start of the release with a value, the beginning of a message."""
    name = "angle" if system.mechanism.release.turns else "displacement"
    return f"release.{name} = {amount:g} {_unit(system)}"


def held_by_loops(system: System) -> bool:
    """Return whether the loops keep the released body, as drawn, from moving along the release."""
    e = system.directions(system.q0)
    along = system.gradient(system.holding_row(system.q0)[None], e)
    return _left_by_loops(system, e, along) <= ROW_RTOL * system.length


def turns_about_point(system: System) -> bool:
    """Return whether a small force on the released point, as drawn, turns the body about it.

    The displacement of the point is then below :data:`RELEASE_LEVER_RTOL` times the size times the
    rotation, so that a displacement of the point determines the shape badly.
    """
    if system.mechanism.release.turns:
        return False
    e = system.directions(system.q0)
    row = system.gradient(system.release, e)
    row[system.placed] = 0.0
    loops = system.loop_rows.jacobian(e)
    try:
        kkt = _placed(system, constraints.saddle(Elements(system).drawn, loops, loops))
        right = np.append(row, np.zeros(len(loops)))
        response = constraints.solve(kkt, right, system.n, system.length)[: system.n]
    except SimulationError:  # A body without a spring, for instance on a pin.
        return False
    turn = abs(float(response[system.released.j]))
    return abs(float(row @ response)) < RELEASE_LEVER_RTOL * system.length * turn


def _turning_message(system: System) -> str:
    """Return why a displacement of the released point is rejected, and a remedy."""
    release = system.mechanism.release
    point = "centre of mass" if release.point is None else "released point"
    return (
        f"a force along the direction of the release turns the body {release.body} about its "
        f"{point}, and hardly displaces that point; give release.angle instead, or another "
        "release.point or direction"
    )


def immobile(system: System) -> str:
    """Return why the released body, as drawn, has no stiffness, and a remedy."""
    if system.released_free:
        return (
            f"the body {system.mechanism.release.body} flies freely, and is placed without a force"
        )
    if not held_by_loops(system):
        return (
            "a motion of the mechanism, with the released body held, deforms no element and lifts "
            "no weight; add springs or gravity"
        )
    if system.mechanism.release.turns:
        return (
            f"the body {system.mechanism.release.body} cannot turn; give release.displacement "
            "instead, or let flexures stretch (axial = true)"
        )
    return immovable(system, "give release.angle, another release.point, or release another body")


def immovable(system: System, remedy: str) -> str:
    """Return why the released point, as drawn, cannot move along the release, and a remedy."""
    name = system.mechanism.release.body
    if _on_pivot(system, name):
        point = "centre of mass" if system.mechanism.release.point is None else "released point"
        return (
            f"the {point} of the body {name} cannot move, because it lies on the pivot that the "
            f"body turns about; {remedy}"
        )
    return (
        f"the body {name} cannot move along the direction of the release; choose another "
        "direction or body, or let flexures stretch (axial = true)"
    )


def _on_pivot(system: System, name: str) -> bool:
    """Return whether a body, as drawn, can turn while its centre of mass is fixed."""
    e, frame = system.directions(system.q0), system.bodies[name]
    both = system.gradient(np.vstack([system.release, -1j * system.release]), e)
    turn = np.eye(system.n)[[frame.j]]
    return _left_by_loops(system, e, both) <= ROW_RTOL * system.length and (
        _left_by_loops(system, e, turn) > ROW_RTOL
    )


def holding_stiffness(system: System, shape: Equilibrium) -> float:
    """Return the derivative of the holding force by the displacement at a shape.

    Parameters
    ----------
    system : System
        The mechanism.
    shape : Equilibrium
        Shape with this holding force.

    Returns
    -------
    float
        Stiffness [N/m]; [N m/rad] if the release is by an angle; NaN where the loops or a body
        without stiffness leave it undetermined.
    """
    unit = _holding_unit(system)
    kkt = balance_matrix(system, shape, held=True)
    pin_idle(system, kkt)
    right = np.zeros(len(kkt))
    right[-1] = unit
    try:
        change = constraints.solve(kkt, right, system.n, system.length)
    except SimulationError:
        return math.nan
    return -unit * float(change[-1])


def balance_matrix(system: System, shape: Equilibrium, held: bool) -> Real:
    """Return the linear balance [[K_t, rows^T], [rows, 0]] of small loads on a static shape.

    The rows are those of the loops and, if the released body is held, that of its displacement.
    """
    rows = held_rows(system, system.amount(shape.q))
    lam = np.append(shape.lam, shape.force / _holding_unit(system))
    kkt = _linear_balance(system, shape.q, (shape.load, 1.0), rows, lam)
    K_t = kkt[: system.n, : system.n]  # Round-off would be the scale of a motion without stiffness.
    K_t[np.abs(K_t) < STIFFNESS_ROUNDING_RTOL * np.abs(K_t).max(initial=0.0)] = 0.0
    return kkt if held else kkt[:-1, :-1]


def pin_idle(system: System, kkt: Real) -> None:
    """Let bodies that springs hold keep coordinates of which no element and constraint depends.

    Parameters
    ----------
    kkt : (n + r, n + r)
        Linear balance, which is changed.
    """
    n = system.n
    largest = float(np.abs(kkt[:n, :n]).max())
    for j in sprung(system):
        acting = np.abs(kkt[j])
        if acting[:n].max() <= SPRING_IDLE_RTOL * largest and not np.any(acting[n:]):
            kkt[j], kkt[:, j] = 0.0, 0.0
            kkt[j, j] = largest


def _left_by_loops(system: System, e: Complex, rows: Real) -> float:
    """Return the largest entry of rows (k, n) without their components along the loops' rows."""
    loops = system.loop_rows.jacobian(e)
    left = rows - (loops.T @ np.linalg.lstsq(loops.T, rows.T, rcond=None)[0]).T
    return float(np.abs(left).max())
