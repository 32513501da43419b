"""Positions and velocities that bodies are given at the start.

A given position is held by a force or a moment, in place of the displacement, angle or amplitude
of the release.  Everything else is in equilibrium under gravity, and free bodies are as drawn.  A
given velocity is that after impulses along the given directions, in place of that of the release.
A value that follows from others by the constraints must be equal to what follows.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..base.errors import EquilibriumError, ParameterError, SimulationError
from ..base.tolerances import START_DEPENDENT_RTOL, START_RTOL
from ..mechanism.description import Mechanism
from ..mechanism.fields import FIELDS
from ..mechanism.parts import VELOCITIES, Body, value
from . import constraints
from .arrays import Complex, Real
from .places import BodyFrame
from .statics import Held, held_slowly, immovable, with_bodies_placed
from .system import Rows, System

AXES = {"x": 1.0 + 0.0j, "y": 1.0j}


class Given(NamedTuple):
    """A position or velocity at the start: body, field and value [rad], [m], [rad/s], [m/s]."""

    body: Body
    name: str
    value: float

    @property
    def unit(self) -> str:
        """Its unit."""
        return FIELDS[Body][self.name][0]

    @property
    def text(self) -> str:
        """The name with value and unit, the beginning of a message."""
        return f"{self.body.name}.{self.name} = {self.value:g} {self.unit}"

    @property
    def turns(self) -> bool:
        """Whether it is a rotation or an angular velocity."""
        return self.name[-1] not in AXES


def given_at_start(
    mechanism: Mechanism, values: Mapping[str, float], names: Sequence[str]
) -> list[Given]:
    """Return the given fields of the names, in the order of the bodies and the names."""
    return [
        Given(body, name, value(body, name, values))
        for body in mechanism.bodies
        for name in names
        if getattr(body, name) is not None
    ]


def start_speed(system: System) -> float:
    """Return the largest velocity at the start, rotations times the size [m/s]."""
    mechanism, values = system.mechanism, system.values
    given = given_at_start(mechanism, values, VELOCITIES)
    speeds = [abs(x.value) * (system.length if x.turns else 1.0) for x in given]
    return max([abs(value(mechanism.release, "velocity", values)), *speeds])


def positioned(system: System, given: Sequence[Given], fraction: float = 1.0) -> Real:
    """Return the coordinates of the shape with bodies at given positions, (n,).

    Parameters
    ----------
    system : System
        The mechanism.
    given : sequence of Given
        Positions.
    fraction : float
        Share of the positions [-].

    Raises
    ------
    EquilibriumError
        If no equilibrium has the positions.
    ParameterError
        If the release gives another shape, the positions contradict the constraints, or the drawn
        shape is a dead centre of one of them.
    """
    release = system.mechanism.release
    _check_alone(system, release.start, given)
    placed = with_bodies_placed(system)
    free = {*placed.placed.tolist()}
    e = system.directions(system.q0)
    moved = [x for x in given if _frame(system, x).j not in free]
    held = [moved[k] for k in _independent(placed, e, [_gradient(system, x, e) for x in moved])]

    def positions(share: float) -> Held:
        rows = placed.loop_rows.beside(_rows(system, held, share * fraction))
        turned = [(_frame(system, x).j, x.value) for x in held if x.turns]
        angles = tuple((j, system.q0[j] + share * fraction * angle) for j, angle in turned)
        return Held(rows, _places(placed, given, share * fraction), angles)

    q, done = held_slowly(placed, positions)
    if done < 1.0:
        first = given[0]
        others = " together with the other positions" if len(given) > 1 else ""
        raise EquilibriumError(
            f"{first.text} cannot be reached{others}: no equilibrium was found beyond "
            f"{done * fraction * first.value + 0.0:.4g} {first.unit}, in proportion; start closer "
            "to the drawn shape, or give the positions of further bodies"
        )
    if fraction == 1.0:
        _check_determined(placed, held, [x for x in moved if x not in held], q)
    e = system.directions(q)
    kept = [given[k] for k in _independent(system, e, [_gradient(system, x, e) for x in given])]
    try:  # Bodies were placed beside the lines of their guides.
        rows = system.loop_rows.beside(_rows(system, kept, fraction))
        q = constraints.project_positions(system, rows, q)[0]
    except SimulationError:
        raise EquilibriumError(
            f"{given[0].text}: the guides do not let the body {given[0].body.name} move there; "
            "reduce it, or give other positions"
        ) from None
    reached = [_reached(system, x, q) for x in given]
    if fraction == 1.0:
        _check_reached(system, given, reached, 1.0)
    return q


def start_velocity(system: System, q: Real, values: Mapping[str, float]) -> Real:
    """Return the velocities at the start, of least kinetic energy with those that are given, (n,).

    Parameters
    ----------
    system : System
        The mechanism.
    q : (n,)
        Coordinates at the start [rad].
    values : mapping
        Values of all parameters.

    Raises
    ------
    ParameterError
        If the constraints do not allow the velocities, or both the release and bodies have some.
    """
    given = given_at_start(system.mechanism, values, VELOCITIES)
    if not given:
        return release_velocity(system, q, value(system.mechanism.release, "velocity", values))
    _check_alone(system, "velocity", given)
    e = system.directions(q)
    gradients = [_gradient(system, x, e) for x in given]
    rows, speeds = np.array(gradients), np.array([x.value for x in given])
    kept = _independent(system, e, gradients)
    held = np.vstack([system.loop_rows.jacobian(e), rows[kept]])
    rates = np.concatenate([np.zeros(len(system.loops)), -speeds[kept]])
    v = constraints.project_velocities(
        system.mass_matrix(e), held, rates, np.zeros(system.n), system.length
    )
    scales = [1.0 if x.turns else system.length for x in given]
    rate = max(float(abs(x.value)) / scale for x, scale in zip(given, scales, strict=True))
    _check_reached(system, given, (rows @ v).tolist(), rate)
    return v


def _check_alone(system: System, name: str, given: Sequence[Given]) -> None:
    """Reject a value of the release beside those of bodies."""
    release = system.mechanism.release
    amount = value(release, name, system.values)
    if amount != 0.0:
        unit, one = FIELDS[type(release)][name][0], given[0]
        raise ParameterError(
            f"release.{name} = {amount:g} {unit}: {one.body.name}.{one.name} gives the start; "
            f"set release.{name} to 0, or remove {one.name}"
        )


def _check_reached(
    system: System, given: Sequence[Given], reached: Sequence[float], scale: float
) -> None:
    """Reject a value that the constraints contradict, by the largest deviation.

    Parameters
    ----------
    system : System
        The mechanism.
    given, reached : sequence
        The values, and those that the constraints allow.
    scale : float
        Angle [rad] or angular velocity [rad/s] of which ``START_RTOL`` may be missing.
    """
    sizes = [1.0 if x.turns else system.length for x in given]
    missing = [
        abs(found - x.value) / size for x, found, size in zip(given, reached, sizes, strict=True)
    ]
    worst = int(np.argmax(missing))
    if missing[worst] > START_RTOL * scale:
        one, found = given[worst], reached[worst]
        found = 0.0 if abs(found) < START_DEPENDENT_RTOL * sizes[worst] * scale else found
        raise ParameterError(
            f"{one.text} deviates by {one.value - found:.6g} {one.unit} from {found:.9g} "
            f"{one.unit}, which the constraints and the other values at the start allow; change "
            "it to that, or leave it out"
        )


def _check_determined(
    system: System, held: Sequence[Given], others: Sequence[Given], q: Real
) -> None:
    """Reject a position that the held ones determine as drawn, but not in their shape q (n,).

    The drawn shape is a dead centre of it.  In the shape, no force holds the position, so that only
    that of the equilibrium is a start.  A force could push the mechanism to it on several ways.
    """
    e = system.directions(q)
    rows = [system.loop_rows.jacobian(e), *(_gradient(system, x, e)[None] for x in held)]
    M, kept = system.mass_matrix(e), np.vstack(rows)
    for one in others:
        row, size = _gradient(system, one, e), 1.0 if one.turns else system.length
        found = _reached(system, one, q)
        freely, left = (_mobility(system, M, rows, row) for rows in (kept[:0], kept))
        if left > START_DEPENDENT_RTOL * freely and abs(found - one.value) > START_RTOL * size:
            raise ParameterError(
                f"{one.text}: in the drawn shape, a dead centre, the other positions determine "
                f"this position, and the equilibrium with these has {found:.9g} {one.unit}; change "
                "it to that, or leave it out"
            )


def _frame(system: System, one: Given) -> BodyFrame:
    return system.bodies[one.body.name]


def _independent(system: System, e: Complex, rows: Sequence[Real]) -> list[int]:
    """Return the rows, gradients (n,) each, that no constraint and no earlier row determines."""
    M, chosen, held = system.mass_matrix(e), [], system.loop_rows.jacobian(e)
    for k, row in enumerate(rows):
        freely, left = (_mobility(system, M, kept, row) for kept in (held[:0], held))
        if left > START_DEPENDENT_RTOL * freely:
            held = np.vstack([held, row])
            chosen.append(k)
    return chosen


def _mobility(system: System, M: Real, held: Real, row: Real) -> float:
    """Return the motion along a row by a unit impulse along it, with other rows held [1/kg].

    It is zero where the held rows determine every motion.
    """
    n, right = system.n, np.concatenate([row, np.zeros(len(held))])
    try:
        x = constraints.solve(constraints.saddle(M, held, held), right, n, system.length)
    except SimulationError:
        return 0.0
    return float(row @ x[:n])


def _gradient(system: System, one: Given, e: Complex) -> Real:
    """Return the derivatives of a rotation or a displacement by the coordinates, (n,)."""
    frame = _frame(system, one)
    if one.turns:
        row = np.zeros(system.n)
        row[frame.j] = 1.0
        return row
    return system.gradient(AXES[one.name[-1]].conjugate() * frame.A, e)


def _rows(system: System, given: Sequence[Given], share: float) -> Rows:
    """Return rows that hold bodies at a share of positions.

    That of a rotation is the sine of the remaining angle times the size, as
    :meth:`System.holding`.
    """
    rows, constants = np.zeros((len(given), system.d), complex), np.zeros(len(given))
    for k, one in enumerate(given):
        frame, amount = _frame(system, one), share * one.value
        if one.turns:
            angle = system.q0[frame.j] + amount
            rows[k, frame.arm] = -1j * system.length * np.exp(-1j * angle)
        else:
            u = AXES[one.name[-1]].conjugate()
            rows[k], constants[k] = u * frame.A, (u * (frame.c - frame.drawn)).real - amount
    return Rows(system, rows, constants)


def _places(system: System, given: Sequence[Given], share: float) -> Real:
    """Return the coordinates that are placed: as drawn, or at a share of given positions."""
    q: Real = system.q0.copy()
    placed = system.placed.tolist()
    for one in given:
        j, amount = _frame(system, one).j, share * one.value
        if j in placed:
            turn = placed.index(j)
            if one.turns:
                q[j] += amount
            else:
                q[placed[turn - 2 + "xy".index(one.name[-1])]] += amount / system.length
    result: Real = q[placed]
    return result


def _reached(system: System, one: Given, q: Real) -> float:
    """Return the rotation [rad] or the displacement [m] of a body in a shape."""
    frame = _frame(system, one)
    if one.turns:
        return float(q[frame.j] - system.q0[frame.j])
    z = complex(frame.A @ system.directions(q)) + frame.c - frame.drawn
    return (AXES[one.name[-1]].conjugate() * z).real


def release_velocity(system: System, q: Real, speed: float) -> Real:
    """Return the velocity of least kinetic energy with a given speed of the released body.

    Parameters
    ----------
    q : (n,)
        Angles at release [rad].
    speed : float
        Speed of the released point along the direction of the release [m/s].

    Returns
    -------
    v : (n,)
        Rates of the coordinates, as after an impulse on the point along that direction [rad/s].

    Raises
    ------
    ParameterError
        If the body cannot move along that direction.
    """
    if speed == 0.0:
        return np.zeros(system.n)
    e = system.directions(q)
    M = system.mass_matrix(e)
    rows = np.vstack([system.loop_rows.jacobian(e), system.gradient(system.release, e)])
    rates = np.zeros(len(rows))
    rates[-1] = -speed
    try:
        return constraints.project_velocities(M, rows, rates, np.zeros(system.n), system.length)
    except SimulationError:
        remedy = "give another release.point, or release another body"
        why = immovable(system, remedy)
        raise ParameterError(f"release.velocity = {speed:g} m/s: {why}") from None
