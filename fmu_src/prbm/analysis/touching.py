"""The index of a stop by its name, and held shapes in which a stop touches its wall."""

from collections.abc import Callable
from typing import TypeVar

from ..base.errors import EquilibriumError, ParameterError
from ..mechanics.statics import Equilibrium, equilibrium
from ..mechanics.system import System, unit
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.parts import value

GAP_CLOSED_RTOL = 1e-9  # Largest gap of a shape that touches the wall, over the size.
SLOPE_MIN = 1e-9  # Change of the gap over the displacement of the released body; less is round-off.
SECANT_STEPS_MAX = 20

S = TypeVar("S")


def stop_index(mechanism: Mechanism, name: str | None) -> int:
    """Return the index of a stop; None: the first.

    Raises
    ------
    ParameterError
        If the mechanism has no stop, or no stop with that name.
    """
    names = [stop.name for stop in mechanism.stops]
    if not names or (name is not None and name not in names):
        known = f"; it has {', '.join(names)}" if names else ": describe one in [[stops]]"
        raise ParameterError(f"{mechanism.name} has no stop {name or 'to hit'}{known}")
    return 0 if name is None else names.index(name)


def touching_shape(
    hold: Callable[[float, S | None], S],
    gap: Callable[[S], float],
    wall: float,
    size: float,
    near: S | None = None,
) -> S:
    """Return the held shape in which a stop touches its wall.

    A force holds the released body; its displacement is found by the secant method.

    Parameters
    ----------
    hold : callable
        Returns the shape held at a displacement [m], near a given shape.
    gap : callable
        Returns the gap of the stop in a shape [m].
    wall : float
        Position of the wall [m].
    size : float
        Size of the mechanism [m].
    near : shape or None
        Shape near which the first shape is computed.

    Raises
    ------
    EquilibriumError
        If no shape that touches the wall is found in :data:`SECANT_STEPS_MAX` steps, or the gap
        does not depend on the displacement of the released body.
    """
    x, shape = wall, hold(wall, near)
    g = gap(shape)
    slope = -1.0
    for _ in range(SECANT_STEPS_MAX):
        if abs(g) <= GAP_CLOSED_RTOL * size:
            return shape
        if abs(slope) <= SLOPE_MIN:
            raise EquilibriumError(
                f"the gap to the wall at {wall:g} m does not change when the released body moves: "
                "release the body that hits the stop"
            )
        step = -g / slope
        shape = hold(x + step, shape)
        last_g, g = g, gap(shape)
        x, slope = x + step, (g - last_g) / step
    raise EquilibriumError(
        f"no shape that touches the wall at {wall:g} m was found: a force on the released body "
        "holds the shapes; choose a wall position nearer to the straight shape"
    )


def impact_shape(system: System, stop: int, wall: float) -> Equilibrium:
    """Return the shape in which a stop touches its wall, held by a force on the released body.

    Parameters
    ----------
    system : System
        The mechanism.
    stop : int
        Index of the stop.
    wall : float
        Position of the wall [m].

    Raises
    ------
    EquilibriumError
        As :func:`touching_shape`.
    """
    rows = system.gap_rows

    def gap(shape: Equilibrium) -> float:
        return float(rows.values(system.directions(shape.q))[stop]) + wall

    # The search is in metres.  A rotation is converted to the arc at a radius of system.length.
    per_metre = 1.0 / system.length if system.mechanism.release.turns else 1.0

    def hold(x: float, near: Equilibrium | None) -> Equilibrium:
        return equilibrium(system, per_metre * x, near=near)

    return touching_shape(hold, gap, wall, system.length)


def lever(system: System, stop: int) -> float:
    """Return the signed distance from the centre of mass of a body to the line of an impact [m].

    It is the distance in the straight shape, positive to the left of the direction of the stop.
    """
    s = system.mechanism.stops[stop]
    point = complex(*(affine(coordinate)(system.values) for coordinate in s.point))
    across = unit(s.direction).conjugate() * (point - system.bodies[s.body].drawn)
    return float(across.imag) + value(s, "offset", system.values)
