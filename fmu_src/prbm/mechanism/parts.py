"""The parts of a mechanism as frozen data, and the fields that become parameters."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from .expressions import Quantity, affine
from .flexure import CLAMP

Point = tuple[Quantity, Quantity]

GROUND = "ground"


@dataclass(frozen=True)
class Body:
    """A rigid body: mass [kg], inertia about its centre of mass [kg m^2], points as drawn [m]."""

    name: str
    mass: Quantity
    inertia: Quantity
    centre: Point
    points: Mapping[str, Point] = field(default_factory=dict)


@dataclass(frozen=True)
class FlexureType:
    """Section and material that several flexures share, and their pseudo-rigid-body model.

    Parameters
    ----------
    name : str
        Prefix of the parameters, for instance ``flexure``.
    model : str
        Pseudo-rigid-body model, a key of :data:`prbm.mechanism.flexure.MODELS`.
    thickness, width : Quantity
        Section: in the plane of motion, across it [m].
    youngs_modulus : Quantity
        Of the material [Pa].
    density : Quantity
        Of the material [kg/m^3].
    coefficients : mapping
        Values that replace the published coefficients of the model, by name [-].
    n : int
        Number of links, of the chain nR alone.
    axial : bool
        Whether the flexures stretch, too.
    """

    name: str
    model: str
    thickness: Quantity
    width: Quantity
    youngs_modulus: Quantity
    density: Quantity
    coefficients: Mapping[str, Quantity] = field(default_factory=dict)
    n: int = 0
    axial: bool = False


@dataclass(frozen=True)
class Flexure:
    """A straight flexure between two points, each ``body.point``, and how it is held there.

    An end is a ``clamp`` (a spring), a ``pin`` (none), or ``free``: then the body at that end
    is carried by the last link, as the mass at the tip of a cantilever.
    """

    name: str
    type: str
    start: str
    end: str
    ends: tuple[str, str] = (CLAMP, CLAMP)


@dataclass(frozen=True)
class Joint:
    """A pin that joins two points, each ``body.point``, which are drawn at the same place."""

    name: str
    start: str
    end: str


@dataclass(frozen=True)
class Stop:
    """A point of a body against a wall fixed to the ground, or to another body.

    The wall is a line across ``direction`` [deg], the direction in which the body travels
    towards it; it is touched when the point has moved by ``position`` [m] from the straight
    shape along that direction, as seen from the body or ground that the wall is fixed to.
    ``offset`` [m] shifts the point along the wall, positive to the left of the direction.
    """

    name: str
    body: str
    point: Point
    direction: float = 0.0
    position: Quantity = 0.0
    offset: Quantity = 0.0
    restitution: Quantity = 0.6
    friction: Quantity = 0.0
    rest_speed: Quantity = 1e-3
    on: str = GROUND


@dataclass(frozen=True)
class Friction:
    """Coulomb friction against the motion of a body along a direction [deg].

    It acts at a point as drawn, the centre of mass unless given.  The normal force is
    max(0, normal_force + normal_stiffness * s), s the displacement of the point to the left of
    the direction (thesis 3.4.2).
    """

    name: str
    body: str
    direction: float = 0.0
    coefficient: Quantity = 0.0
    normal_force: Quantity = 0.0
    normal_stiffness: Quantity = 0.0
    point: Point | None = None


@dataclass(frozen=True)
class Force:
    """Inputs ``name.x``, ``name.y`` [N], ``name.moment`` [N m] on a body.

    The force acts at a point as drawn, the centre of mass unless given.
    """

    name: str
    body: str
    point: Point | None = None


@dataclass(frozen=True)
class Probe:
    """Outputs ``name.x``, ``name.y``, ``name.vx``, ``name.vy`` of a point ``body.point``.

    The displacement from the straight shape [m] and the velocity [m/s].
    """

    name: str
    point: str


@dataclass(frozen=True)
class Release:
    """How the motion starts: from a shape held by a force on a body along a direction [deg].

    ``displacement`` [m] of the centre of mass along the direction from the straight shape, and
    ``velocity`` [m/s] along it, with the least kinetic energy.
    """

    name: ClassVar[str] = "release"
    body: str
    direction: float = 0.0
    displacement: Quantity = 0.0
    velocity: Quantity = 0.0


Part = Body | FlexureType | Flexure | Joint | Stop | Friction | Force | Probe | Release

LENGTH_MIN = 1e-9  # m; a smaller dimension of a mechanism is a mistake.
MASS_MIN = 1e-15  # kg; a cubic micrometre of silicon has 2e-15 kg.
LENGTH_MAX = 1e3  # m; no mechanism of this kind is larger.


def _meta(
    unit: str,
    description: str,
    minimum: float = -math.inf,
    maximum: float = math.inf,
    nominal: float | None = None,
    *,
    tunable: bool = False,
) -> tuple[str, str, float, float, float | None, bool]:
    return unit, description, minimum, maximum, nominal, tunable


FIELDS: dict[type, dict[str, tuple[str, str, float, float, float | None, bool]]] = {
    FlexureType: {
        "thickness": _meta("m", "Thickness in the plane of motion", LENGTH_MIN, 1.0, 1e-4),
        "width": _meta("m", "Width across the plane of motion", LENGTH_MIN, LENGTH_MAX, 1e-2),
        "youngs_modulus": _meta("Pa", "Young's modulus", 1.0, 1e13, 1e11),
        "density": _meta("kg/m3", "Density", 1.0, 1e5, 1e4),
    },
    Body: {
        "mass": _meta("kg", "Mass", MASS_MIN, 1e6, 0.1),
        "inertia": _meta(
            "kg.m2", "Moment of inertia about the centre of mass", 1e-30, 1e9, 1e-4
        ),
    },
    Stop: {
        "position": _meta(
            "m", "Displacement of the hit point from the straight shape at which it touches",
            -LENGTH_MAX, LENGTH_MAX, 1e-2, tunable=True,
        ),
        "offset": _meta(
            "m", "Distance of the hit point from the centre of mass along the wall",
            -LENGTH_MAX, LENGTH_MAX, 1e-2, tunable=True,
        ),
        "restitution": _meta(
            "", "Coefficient of restitution (energetic when there is friction)", 0.0, 1.0,
            tunable=True,
        ),
        "friction": _meta("", "Coefficient of friction at the stop", 0.0, 100.0, tunable=True),
        "rest_speed": _meta(
            "m/s", "Closing speed below which an impact ends in rest if the stop is pressed",
            0.0, 1e3, 1e-3, tunable=True,
        ),
    },
    Friction: {
        "coefficient": _meta("", "Coefficient of Coulomb friction", 0.0, 100.0, tunable=True),
        "normal_force": _meta(
            "N", "Normal force at the straight shape", -1e9, 1e9, tunable=True
        ),
        "normal_stiffness": _meta(
            "N/m", "Change of the normal force with the transverse displacement",
            -1e12, 1e12, 1e2, tunable=True,
        ),
    },
    Release: {
        "displacement": _meta(
            "m", "Displacement from straight at which the body is held and let go",
            -LENGTH_MAX, LENGTH_MAX, 1e-2,
        ),
        "velocity": _meta("m/s", "Velocity at release", -1e4, 1e4),
    },
}  # fmt: skip


def value(part: Part, name: str, values: Mapping[str, float]) -> float:
    """Return a field of a part: the parameter ``part.field``, or the expression that it is."""
    quantity = getattr(part, name)
    if isinstance(quantity, str):
        return affine(quantity)(values)
    return values[f"{part.name}.{name}"]


def body_of(reference: str) -> str:
    """Return the body that ``body.point`` belongs to."""
    return reference.rpartition(".")[0]
