"""Stops by name, and shapes held by a force in which a stop touches its wall."""

import math
from collections.abc import Callable
from typing import TypeVar

from ..base.errors import EquilibriumError, ParameterError
from ..mechanics.statics import Equilibrium, equilibrium
from ..mechanics.system import System, unit
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.parts import value

GAP_CLOSED_RTOL = 1e-9  # Gap at which a held shape touches the wall, relative to the size.
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


def touching(
    hold: Callable[[float, S | None], S],
    gap: Callable[[S], float],
    wall: float,
    size: float,
    near: S | None = None,
) -> S:
    """Return the shape, held by a force on the released body, in which a stop touches its wall.

    The displacement of the released body is found by the secant method.

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
        Start of the search.

    Raises
    ------
    EquilibriumError
        If no shape that touches the wall is found in :data:`SECANT_STEPS_MAX` steps.
    """
    x, shape = wall, hold(wall, near)
    g = gap(shape)
    last_x, last_g = x - g, math.nan
    for _ in range(SECANT_STEPS_MAX):
        if abs(g) <= GAP_CLOSED_RTOL * size:
            return shape
        slope = (g - last_g) / (x - last_x) if math.isfinite(last_g) else -1.0
        last_x, last_g = x, g
        x -= g / slope
        shape = hold(x, shape)
        g = gap(shape)
    raise EquilibriumError(
        f"no shape held by a force on the released body touches the wall at {wall:g} m"
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
        If no shape that touches the wall is found.
    """
    rows = system.gap_rows

    def gap(shape: Equilibrium) -> float:
        return float(rows.values(system.directions(shape.q))[stop]) + wall

    # The search is in metres: a rotation is taken on the radius of the size.
    share = 1.0 / system.length if system.mechanism.release.turns else 1.0
    return touching(lambda x, _: equilibrium(system, share * x), gap, wall, system.length)


def lever(system: System, stop: int) -> float:
    """Return the distance from the centre of mass of a body to the line of an impact, signed [m].

    The distance is taken in the drawn shape, positive to the left of the direction of the stop.
    """
    s = system.mechanism.stops[stop]
    point = complex(*(affine(coordinate)(system.values) for coordinate in s.point))
    across = unit(s.direction).conjugate() * (point - system.bodies[s.body].drawn)
    return float(across.imag) + value(s, "offset", system.values)
