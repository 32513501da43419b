"""Typical magnitudes of the motion of a mechanism, for nominal values."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..mechanics.positions import given_at_start
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.parts import POSITIONS


@dataclass(frozen=True)
class Scales:
    """Typical magnitudes of a mechanism's motion, as powers of ten in SI units."""

    by_unit: Mapping[str, float]

    def __call__(self, unit: str) -> float | None:
        """Return the nominal value for a unit, None if the unit has no typical magnitude."""
        return self.by_unit.get(unit)


def scales(mechanism: Mechanism, sample: Mapping[str, float]) -> Scales:
    """Return typical magnitudes, from the start, the masses and the fundamental frequency."""
    values = mechanism.values()
    span = extent(mechanism) or 1.0
    release = mechanism.release
    amount = abs(_quantity(getattr(release, release.start), f"release.{release.start}", values))
    given = given_at_start(mechanism, values, POSITIONS)
    amounts = [(amount, release.turns), *((abs(one.value), one.turns) for one in given)]
    x = max(span * min(x, 1.0) if turns else x for x, turns in amounts) or span / 10
    omega = 2 * math.pi * float(sample["mode.frequency"]) or 1.0
    mass = sum(_quantity(body.mass, f"{body.name}.mass", values) for body in mechanism.bodies)
    magnitudes = {
        "m": x,
        "m/s": x * omega,
        "rad": x / span,
        "rad/s": x / span * omega,
        "m/s2": x * omega**2,
        "rad/s2": x / span * omega**2,
        "s": 1 / omega,
        "Hz": omega / (2 * math.pi),
        "N": mass * x * omega**2,
        "N.m": mass * x * omega**2 * span,
        "N.s": mass * x * omega,
        "N.m.s": mass * x * omega * span,
        "1/kg": 1 / mass,
        "J": mass * (x * omega) ** 2,
        "W": mass * (x * omega) ** 2 * omega,
    }
    return Scales({unit: nearest_power_of_ten(value) for unit, value in magnitudes.items()})


def extent(mechanism: Mechanism) -> float:
    """Return the larger side of the box around all points of the straight shape [m]."""
    values = mechanism.values()
    points = [*mechanism.ground.values()]
    for body in mechanism.bodies:
        points += [body.centre, *body.points.values()]
    sides = []
    for axis in (0, 1):
        along = [affine(point[axis])(values) for point in points]
        sides.append(max(along) - min(along))
    return max(sides)


def _quantity(quantity: float | str, name: str, values: Mapping[str, float]) -> float:
    return affine(quantity)(values) if isinstance(quantity, str) else values[name]


def nearest_power_of_ten(value: float) -> float:
    """Return the power of ten whose logarithm is nearest to that of a positive value.

    Examples
    --------
    >>> nearest_power_of_ten(3e-3), nearest_power_of_ten(0.4)
    (0.001, 1.0)
    """
    return float(f"1e{round(math.log10(value))}")
