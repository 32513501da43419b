"""Inputs of a mechanism: their names and units, and their values as the equations use them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from ..base.errors import ParameterError
from ..base.names import unknown
from ..base.tolerances import WALL_MOBILITY_MAX
from ..mechanism.description import Mechanism
from ..mechanism.parameters import finite
from .arrays import Real

LOADS = {"x": "N", "y": "N", "moment": "N.m"}
"""Components of a force and their units; times s, those of an impulse."""
MOBILITY = "mobility"
"""The input of a stop that is the inverse mass of its wall."""

T = TypeVar("T", float, Real, float | Real)


@dataclass(frozen=True)
class Wall:
    """A wall in uniform motion along the direction of its stop.

    Parameters
    ----------
    position : float
        At the time ``since`` [m].
    rate : float
        Velocity [m/s].
    since : float
        [s].

    Examples
    --------
    >>> Wall(0.1, rate=2.0, since=1.0).at(1.5)
    1.1
    """

    position: float
    rate: float = 0.0
    since: float = 0.0

    def at(self, t: T) -> T:
        """Return the position at time t [m]."""
        return self.position + self.rate * (t - self.since)


@dataclass(frozen=True)
class Inputs:
    """Inputs of the mechanism, constant from one change to the next.

    Parameters
    ----------
    forces : (b,) tuple of complex
        Forces on points of bodies, in the order of ``mechanism.forces`` [N].
    moments : (b,) tuple of float
        Moments on these bodies, positive counter-clockwise [N m].
    base : complex
        Acceleration of the base [m/s^2].
    walls : (s,) tuple of Wall
        The walls of the stops.
    mobilities : (s,) tuple of float
        Their inverse effective masses, by which impacts move them; 0: immovable [1/kg].
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
    units = {f"{f.name}.{axis}": unit for f in mechanism.forces for axis, unit in LOADS.items()}
    for stop in mechanism.stops:
        units |= {f"{stop.name}.displacement": "m", f"{stop.name}.velocity": "m/s"}
    units |= _impulse_units(mechanism)
    units |= {f"{stop.name}.{MOBILITY}": "1/kg" for stop in mechanism.stops}
    return units | {f"base.acceleration.{axis}": "m/s2" for axis in "xy"}


def input_names(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of the inputs in the order of the interface."""
    return tuple(input_units(mechanism))


def impulse_names(mechanism: Mechanism) -> list[str]:
    """Return the names of the inputs that are impulses: an increase acts at once."""
    return list(_impulse_units(mechanism))


def _impulse_units(mechanism: Mechanism) -> dict[str, str]:
    return {
        f"{force.name}.impulse.{axis}": f"{unit}.s"
        for force in mechanism.forces
        for axis, unit in LOADS.items()
    }


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
