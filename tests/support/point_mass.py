"""A point mass on parallel flexures that are almost weightless and, by default, without stiffness.

The mass moves along x, on an arc of 40 mm.  Its stop is compliant, at the straight shape.
"""

from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Release, Stop

LENGTH = 0.04  # m
MASS = 1e-3  # kg


def point_mass(
    *, mass=MASS, young=1.0, length=LENGTH, displacement=-1e-4, velocity=0.1, **stop
) -> Mechanism:
    """Return the mechanism; other arguments are keys of the stop."""
    keys = {"law": "compliant", "stiffness": 1e6, "restitution": 0.6, **stop}
    half = length / 2
    points = {"left": (-half, length), "right": (half, length)}
    return Mechanism(
        name="PointMass",
        title="Point mass at a compliant stop",
        ground={"left": (-half, 0.0), "right": (half, 0.0)},
        bodies=(Body("mass", mass, 0.01 * mass * length**2, (0.0, length), points),),
        flexure_types=(FlexureType("leaf", "1R", length / 400, length / 4, young, 1.0),),
        flexures=(
            Flexure("a", "leaf", "ground.left", "mass.left"),
            Flexure("b", "leaf", "ground.right", "mass.right"),
        ),
        release=Release("mass", displacement=displacement, velocity=velocity),
        stops=(Stop("stop", "mass", (0.0, length), **keys),),
        forces=(Force("push", "mass"),),
    )
