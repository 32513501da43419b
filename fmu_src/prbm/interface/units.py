"""SI units of the interface: base units, display units and the quantities measured in them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Unit:
    """A unit of the interface.

    Parameters
    ----------
    base : mapping of str to int
        Exponents of the base units.
    display : mapping of str to float
        Display units, with the factor in ``displayed value = factor * value``.
    """

    base: Mapping[str, int]
    display: Mapping[str, float] = field(default_factory=dict)


UNITS = {
    "1": Unit({}),
    "m": Unit({"m": 1}, {"mm": 1e3, "um": 1e6}),
    "m/s": Unit({"m": 1, "s": -1}, {"mm/s": 1e3}),
    "m/s2": Unit({"m": 1, "s": -2}),
    "rad": Unit({"rad": 1}, {"deg": 180 / math.pi}),
    "rad/s": Unit({"rad": 1, "s": -1}, {"deg/s": 180 / math.pi}),
    "rad/s2": Unit({"rad": 1, "s": -2}, {"deg/s2": 180 / math.pi}),
    "1/s": Unit({"s": -1}),
    "1/s2": Unit({"s": -2}),
    "s": Unit({"s": 1}, {"ms": 1e3, "us": 1e6}),
    "Hz": Unit({"s": -1}, {"kHz": 1e-3}),
    "kg": Unit({"kg": 1}, {"g": 1e3}),
    "kg.m2": Unit({"kg": 1, "m": 2}, {"g.mm2": 1e9}),
    "kg/m3": Unit({"kg": 1, "m": -3}, {"g/cm3": 1e-3}),
    "Pa": Unit({"kg": 1, "m": -1, "s": -2}, {"GPa": 1e-9, "MPa": 1e-6}),
    "N": Unit({"kg": 1, "m": 1, "s": -2}, {"mN": 1e3}),
    "N/m": Unit({"kg": 1, "s": -2}, {"N/mm": 1e-3}),
    "N.m": Unit({"kg": 1, "m": 2, "s": -2}, {"mN.m": 1e3}),
    "N.m/rad": Unit({"kg": 1, "m": 2, "s": -2, "rad": -1}, {"mN.m/deg": 1e3 * math.pi / 180}),
    "N/m3": Unit({"kg": 1, "m": -2, "s": -2}),
    "N.s/m": Unit({"kg": 1, "s": -1}),
    "N.m.s/rad": Unit({"kg": 1, "m": 2, "s": -1, "rad": -1}),
    "N.s": Unit({"kg": 1, "m": 1, "s": -1}, {"mN.s": 1e3}),
    "N.m.s": Unit({"kg": 1, "m": 2, "s": -1}, {"mN.m.s": 1e3}),
    "1/kg": Unit({"kg": -1}),
    "1/m": Unit({"m": -1}, {"1/mm": 1e-3}),
    "J": Unit({"kg": 1, "m": 2, "s": -2}, {"mJ": 1e3}),
    "W": Unit({"kg": 1, "m": 2, "s": -3}, {"mW": 1e3}),
}


@dataclass(frozen=True)
class Quantity:
    """A physical quantity, its SI unit, and its display unit (None: the SI unit)."""

    name: str
    unit: str
    display: str | None = None


QUANTITIES = {
    quantity.unit: quantity
    for quantity in (
        Quantity("Ratio", "1"),
        Quantity("Length", "m", "mm"),
        Quantity("Velocity", "m/s", "mm/s"),
        Quantity("Acceleration", "m/s2"),
        Quantity("Angle", "rad", "deg"),
        Quantity("AngularVelocity", "rad/s", "deg/s"),
        Quantity("AngularAcceleration", "rad/s2", "deg/s2"),
        Quantity("StrainRate", "1/s"),
        Quantity("StrainAcceleration", "1/s2"),
        Quantity("Time", "s", "ms"),
        Quantity("Frequency", "Hz"),
        Quantity("Mass", "kg", "g"),
        Quantity("MomentOfInertia", "kg.m2", "g.mm2"),
        Quantity("Density", "kg/m3", "g/cm3"),
        Quantity("Stress", "Pa", "GPa"),
        Quantity("Force", "N"),
        Quantity("Stiffness", "N/m"),
        Quantity("Torque", "N.m", "mN.m"),
        Quantity("TorsionalStiffness", "N.m/rad"),
        Quantity("CubicStiffness", "N/m3"),
        Quantity("ViscousDamping", "N.s/m"),
        Quantity("TorsionalDamping", "N.m.s/rad"),
        Quantity("Impulse", "N.s", "mN.s"),
        Quantity("AngularImpulse", "N.m.s", "mN.m.s"),
        Quantity("Mobility", "1/kg"),
        Quantity("Curvature", "1/m"),
        Quantity("Energy", "J", "mJ"),
        Quantity("Power", "W", "mW"),
    )
}
