"""Inputs of a mechanism: their names and units, and their values as the equations use them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

from ..base.errors import ParameterError
from ..base.names import unknown
from ..base.tolerances import WALL_MOBILITY_MAX
from ..mechanism.description import Mechanism
from ..mechanism.parameters import finite
from .arrays import Real

LOADS = {"x": "N", "y": "N", "moment": "N.m"}
"""Components of a force and their units.  The units of an impulse are these times s."""
MOBILITY = "mobility"
"""The input of a stop that is the inverse mass of its wall."""
WALL_INPUTS = {"displacement": "m", "velocity": "m/s"}
"""Inputs of a stop that move its wall, and their units."""
BASE_AXES = "xy"
"""Components of the acceleration of the base."""

INPUT_GROUPS = ("forces", "walls", "impulses", "mobilities", "base")
"""The groups of inputs in the order of the interface."""

T = TypeVar("T", float, Real, float | Real)


@dataclass(frozen=True)
class Wall:
    """A wall that joins its reference, a uniform motion, along a cubic.

    With tau = t - since and s = tau / span, the wall is at

        x = position + rate tau + (1 - s)^2 (offset + (2 offset + excess span) s).

    Parameters
    ----------
    position : float
        Position of the reference at the time ``since`` [m].
    rate : float
        Velocity of the reference [m/s].
    since : float
        Time at which the wall begins to join its reference [s].
    offset : float
        Position of the wall relative to its reference at the time ``since`` [m].
    excess : float
        Velocity of the wall relative to its reference at the time ``since`` [m/s].
    span : float
        Time in which the wall joins its reference [s]; 0 for a wall on its reference.

    Examples
    --------
    >>> Wall(0.1, rate=2.0, since=1.0).motion(1.5)
    (1.1, 2.0, 0.0)
    >>> [float(part) for part in Wall(0.0, offset=1.0, span=2.0).motion(1.0)]
    [0.5, -0.75, 0.0]
    """

    position: float
    rate: float = 0.0
    since: float = 0.0
    offset: float = 0.0
    excess: float = 0.0
    span: float = 0.0

    @property
    def end(self) -> float:
        """Time at which the wall is on its reference [s]."""
        return self.since + self.span

    def reference(self, t: T) -> T:
        """Return the position of the reference at time t [m]."""
        return self.position + self.rate * (t - self.since)

    def motion(self, t: T) -> tuple[T, T, T]:
        """Return position, velocity and acceleration at time t [m], [m/s], [m/s^2].

        The acceleration does not fall to zero at the end of the cubic: :meth:`arrived` must replace
        the wall by its reference there.
        """
        x, zero = self.reference(t), 0.0 * t
        if not self.span:
            return x, self.rate + zero, zero
        s = (t - self.since) / self.span
        left, slope = 1.0 - s, 2.0 * self.offset + self.excess * self.span
        ahead = self.offset + slope * s
        velocity = self.rate + left * (left * slope - 2.0 * ahead) / self.span
        acceleration = (2.0 * ahead - 4.0 * left * slope) / self.span**2
        return x + left * left * ahead, velocity, acceleration

    def joining(self, line: "Wall", velocity: float, span: float) -> "Wall":
        """Return the wall that joins another reference from the time ``line.since`` on.

        Parameters
        ----------
        line : Wall
            The other reference.
        velocity : float
            Velocity of the wall at that time [m/s].
        span : float
            Time in which the wall joins the reference [s].
        """
        x = float(self.motion(line.since)[0])
        return replace(line, offset=x - line.position, excess=velocity - line.rate, span=span)

    def pushed(self, t: float, change: float) -> "Wall":
        """Return the wall after a change of its velocity and that of its reference at time t."""
        position = self.position - change * (t - self.since)
        return replace(self, position=position, rate=self.rate + change)

    def displaced(self, change: float) -> "Wall":
        """Return the wall and its reference, displaced [m]."""
        return replace(self, position=self.position + change)

    def arrived(self) -> "Wall":
        """Return the wall on its reference."""
        return replace(self, offset=0.0, excess=0.0, span=0.0)


@dataclass(frozen=True)
class Inputs:
    """Inputs of the mechanism, constant from one change to the next.

    Parameters
    ----------
    forces : (k,) tuple of complex
        Forces on points of bodies, in the order of ``mechanism.forces`` [N].
    moments : (k,) tuple of float
        Moments on these bodies, positive counter-clockwise [N m].
    base : complex
        Acceleration of the base [m/s^2].
    walls : (s,) tuple of Wall
        The walls of the stops.
    mobilities : (s,) tuple of float
        Inverse effective masses of the walls [1/kg].  An impulse on a wall changes its velocity
        by this factor; 0 for a wall that impacts do not move.
    """

    forces: tuple[complex, ...]
    moments: tuple[float, ...]
    base: complex
    walls: tuple[Wall, ...]
    mobilities: tuple[float, ...]

    @classmethod
    def of(
        cls, mechanism: Mechanism, given: Mapping[str, float], walls: tuple[Wall, ...]
    ) -> "Inputs":
        """Return the inputs with the values given by name."""
        return cls(
            tuple(complex(given[f"{f.name}.x"], given[f"{f.name}.y"]) for f in mechanism.forces),
            tuple(given[f"{f.name}.moment"] for f in mechanism.forces),
            complex(given["base.acceleration.x"], given["base.acceleration.y"]),
            walls,
            tuple(given[f"{stop.name}.{MOBILITY}"] for stop in mechanism.stops),
        )


def input_units(mechanism: Mechanism) -> dict[str, str]:
    """Return the inputs in the order of the interface, with their units."""
    stops = mechanism.stops
    groups = {
        "forces": load_units(mechanism),
        "walls": {f"{s.name}.{k}": unit for s in stops for k, unit in WALL_INPUTS.items()},
        "impulses": _impulse_units(mechanism),
        "mobilities": {f"{s.name}.{MOBILITY}": "1/kg" for s in stops},
        "base": {f"base.acceleration.{axis}": "m/s2" for axis in BASE_AXES},
    }
    return {name: unit for group in INPUT_GROUPS for name, unit in groups[group].items()}


def load_units(mechanism: Mechanism) -> dict[str, str]:
    """Return the names of all forces and moments, with their units."""
    return {f"{f.name}.{k}": unit for f in mechanism.forces for k, unit in LOADS.items()}


def input_names(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of the inputs in the order of the interface."""
    return tuple(input_units(mechanism))


def impulse_names(mechanism: Mechanism) -> list[str]:
    """Return the names of the inputs that are impulses.  An increase acts as a sudden impulse."""
    return list(_impulse_units(mechanism))


def _impulse_units(mechanism: Mechanism) -> dict[str, str]:
    return {
        f"{force.name}.impulse.{axis}": f"{unit}.s"
        for force in mechanism.forces
        for axis, unit in LOADS.items()
    }


def checked_loads(mechanism: Mechanism, loads: Mapping[str, float]) -> dict[str, float]:
    """Return all forces [N] and moments [N m] by name, 0 for those that are not given.

    Raises
    ------
    ParameterError
        If a load is unknown, or not a finite number.
    """
    known = dict.fromkeys(load_units(mechanism), 0.0)
    for name, x in loads.items():
        if name not in known:
            raise ParameterError(unknown(name, known))
        known[name] = finite(name, x)
    return known


def check_input(name: str, number: float, known: Mapping[str, float]) -> float:
    """Return an input as a float.

    Raises
    ------
    ParameterError
        If there is no such input, or the value is not finite or out of bounds.
    """
    if name not in known:
        raise ParameterError(unknown(name, known))
    x = finite(name, number)
    if x > WALL_MOBILITY_MAX and name.endswith(f".{MOBILITY}"):
        raise ParameterError(f"{name} = {x:g} 1/kg must be at most {WALL_MOBILITY_MAX:g} 1/kg")
    if x < 0.0 and name.endswith(f".{MOBILITY}"):
        raise ParameterError(
            f"{name} = {x:g} 1/kg must not be negative: it is the inverse effective mass of the "
            "wall, 0 for a wall that does not move when it is hit"
        )
    return x
