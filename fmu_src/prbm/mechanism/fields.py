"""The fields of parts that become parameters: units, descriptions, bounds."""

import math
from typing import NamedTuple

from .parts import (
    ANGLE_MAX,
    LENGTH_MAX,
    LENGTH_MIN,
    MASS_MIN,
    RESTITUTION_MIN,
    Body,
    FlexureType,
    Friction,
    Guide,
    Joint,
    Part,
    Release,
    Spring,
    Stop,
    field_of,
)


class Meta(NamedTuple):
    """Arguments of :class:`Parameter` after its name and value."""

    unit: str
    description: str
    minimum: float = -math.inf
    maximum: float = math.inf
    nominal: float | None = None
    tunable: bool = False


FIELDS: dict[type, dict[str, Meta]] = {
    FlexureType: {
        "thickness": Meta("m", "Thickness in the plane of motion", LENGTH_MIN, 1.0, 1e-4),
        "width": Meta("m", "Width across the plane of motion", LENGTH_MIN, LENGTH_MAX, 1e-2),
        "youngs_modulus": Meta("Pa", "Young's modulus", 1.0, 1e13, 1e11),
        "density": Meta("kg/m3", "Density", 1.0, 1e5, 1e4),
        "end_thickness": Meta(
            "m", "Thickness at the end of a taper, or outside a notch", LENGTH_MIN, LENGTH_MAX, 1e-3
        ),
        "end_width": Meta("m", "Width at the end of a taper", LENGTH_MIN, LENGTH_MAX, 1e-2),
        "notch_radius": Meta(
            "m", "Radius of a notch or its fillets, or half axis along the flexure",
            LENGTH_MIN, LENGTH_MAX, 1e-3,
        ),
        "notch_depth": Meta(
            "m", "Half axis of an elliptic notch or its fillets across the flexure",
            LENGTH_MIN, LENGTH_MAX, 1e-3,
        ),
        "waist_length": Meta(
            "m", "Length of the waist between the fillets of a notch", LENGTH_MIN, LENGTH_MAX, 1e-2
        ),
        "curvature": Meta(
            "1/m", "Curvature as drawn, positive if it turns left from the start to the end",
            -1e9, 1e9, 10.0,
        ),
        "rise": Meta(
            "m", "Distance of the parallel tangents at both ends as drawn, positive to the left",
            -LENGTH_MAX, LENGTH_MAX, 1e-3,
        ),
        "initial_strain": Meta(
            "", "Strain without a force, positive if longer than drawn", -0.1, 0.1, 1e-3
        ),
    },
    Body: {
        "mass": Meta("kg", "Mass", MASS_MIN, 1e6, 0.1),
        "inertia": Meta(
            "kg.m2", "Moment of inertia about the centre of mass", 1e-30, 1e9, 1e-4
        ),
        "start_angle": Meta("rad", "Rotation at the start", -ANGLE_MAX, ANGLE_MAX, 0.1),
        "start_x": Meta("m", "Displacement along x at the start", -LENGTH_MAX, LENGTH_MAX, 1e-2),
        "start_y": Meta("m", "Displacement along y at the start", -LENGTH_MAX, LENGTH_MAX, 1e-2),
        "start_omega": Meta("rad/s", "Angular velocity at the start", -1e6, 1e6, 1.0),
        "start_vx": Meta("m/s", "Velocity along x at the start", -1e4, 1e4, 1.0),
        "start_vy": Meta("m/s", "Velocity along y at the start", -1e4, 1e4, 1.0),
    },
    Joint: {
        "stiffness": Meta(
            "N.m/rad", "Torsional stiffness", 0.0, 1e12, 1.0
        ),
        "free_angle": Meta(
            "rad", "Rotation of the end's body relative to the start's without a moment, from the "
            "drawn shape",
            -ANGLE_MAX, ANGLE_MAX, 0.1,
        ),
        "damping": Meta(
            "N.m.s/rad", "Coefficient of viscous damping of the rotation", 0.0, 1e12, 1e-3
        ),
    },
    Spring: {
        "stiffness": Meta("N/m", "Stiffness", 0.0, 1e15, 1e3),
        "free_length": Meta("m", "Length without a force", 0.0, LENGTH_MAX, 1e-2),
        "cubic_stiffness": Meta(
            "N/m3", "Coefficient of the cube of the elongation in the force", -1e18, 1e18, 1e6
        ),
        "damping": Meta("N.s/m", "Coefficient of viscous damping", 0.0, 1e12, 1.0),
    },
    Guide: {
        "friction": Meta("", "Coefficient of friction along the guide", 0.0, 100.0, tunable=True),
    },
    Stop: {
        "position": Meta(
            "m", "Displacement of the hit point at contact, from the straight shape",
            -LENGTH_MAX, LENGTH_MAX, 1e-2, tunable=True,
        ),
        "offset": Meta(
            "m", "Shift of the hit point along the wall",
            -LENGTH_MAX, LENGTH_MAX, 1e-2, tunable=True,
        ),
        "restitution": Meta(
            "", "Coefficient of restitution (energetic when there is friction)", 0.0, 1.0,
            tunable=True,
        ),
        "friction": Meta("", "Coefficient of friction at the stop", 0.0, 100.0, tunable=True),
        "rest_speed": Meta(
            "m/s", "Closing speed below which an impact ends in rest, if the body is then "
            "pressed against the wall",
            0.0, 1e3, 1e-3, tunable=True,
        ),
        "stiffness": Meta(
            "N/m", "Contact stiffness: force over indentation^exponent", 1e-6, 1e18, 1e6,
        ),
        "exponent": Meta("", "Exponent of the contact force", 1.0, 10.0),
    },
    Friction: {
        "coefficient": Meta("", "Coefficient of Coulomb friction", 0.0, 100.0, tunable=True),
        "normal_force": Meta(
            "N", "Normal force at the straight shape", -1e9, 1e9, tunable=True
        ),
        "normal_stiffness": Meta(
            "N/m", "Change of the normal force with the transverse displacement",
            -1e12, 1e12, 1e2, tunable=True,
        ),
    },
    Release: {
        "displacement": Meta(
            "m", "Displacement from the straight shape at which the body is released",
            -LENGTH_MAX, LENGTH_MAX, 1e-2,
        ),
        "angle": Meta(
            "rad", "Rotation from the straight shape at which the body is released",
            -ANGLE_MAX, ANGLE_MAX, 0.1,
        ),
        "amplitude": Meta(
            "m", "Displacement along a mode, from the rest position, at which the body is released",
            -LENGTH_MAX, LENGTH_MAX, 1e-2,
        ),
        "velocity": Meta("m/s", "Velocity at release", -1e4, 1e4),
    },
}  # fmt: skip


def fields_of(part: Part) -> dict[str, Meta]:
    """Return the fields of a part that are given, with the arguments of their parameters.

    Examples
    --------
    >>> [*fields_of(Release("lever", angle=0.1))]
    ['angle', 'velocity']
    """
    fields = {n: meta for n, meta in FIELDS[type(part)].items() if field_of(part, n) is not None}
    if isinstance(part, Stop) and part.compliant:
        fields |= _compliant_fields(part)
    if isinstance(part, Spring) and part.side:  # A softening spring would push where it must pull.
        fields["cubic_stiffness"] = fields["cubic_stiffness"]._replace(minimum=0.0)
    return fields


def _compliant_fields(stop: Stop) -> dict[str, Meta]:
    """Return the fields of a compliant stop that differ from those of a rigid stop."""
    restitution, stiffness = FIELDS[Stop]["restitution"], FIELDS[Stop]["stiffness"]
    about = "Coefficient of restitution of a point mass"
    found = {"restitution": restitution._replace(minimum=RESTITUTION_MIN, description=about)}
    if stop.exponent != 1.0:
        about = f"{stiffness.description} [N/m^exponent]"
        found["stiffness"] = stiffness._replace(unit="", description=about)
    return found
