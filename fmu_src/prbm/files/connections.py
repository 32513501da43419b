"""Tables of joints, springs and guides, which connect points, and their conversion to parts."""

from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool

from ..mechanism import parts
from ..mechanism.expressions import Quantity
from .tables import Named, RepeatTable, Table
from .values import LineOrLines, Reference, measured

COPYING = ("mirror", "repeat")  # Keys that are no fields of parts.


# Each field has an object of its own: releases of pydantic before 2.12 change it with its class.
def mirror_key() -> Any:
    """Return the field of the lines of symmetry of a part."""
    return Field((), description='Line of symmetry, "x = ..." or "y = ...", or a list of both')


def repeat_key() -> Any:
    """Return the field of equal parts in a row or on a circle."""
    return Field(None, description="Equal parts in a row or on a circle")


class JointTable(Named):
    """A pin between two points that are drawn at the same position."""

    start: Reference = Field(description="First point, body.point or ground.point")
    end: Reference = Field(description="Second point, body.point or ground.point")
    stiffness: Annotated[Quantity, measured(parts.Joint, "stiffness")] | None = None
    free_angle: Annotated[Quantity, measured(parts.Joint, "free_angle")] | None = None
    damping: Annotated[Quantity, measured(parts.Joint, "damping")] | None = None
    mirror: LineOrLines = mirror_key()
    repeat: RepeatTable | None = repeat_key()


class SpringTable(Named):
    """A coil spring and a damper between two points."""

    start: Reference = Field(description="First end, body.point or ground.point")
    end: Reference = Field(description="Second end, body.point or ground.point")
    stiffness: Annotated[Quantity, measured(parts.Spring, "stiffness")]
    free_length: Annotated[Quantity, measured(parts.Spring, "free_length")] | None = None
    cubic_stiffness: Annotated[Quantity, measured(parts.Spring, "cubic_stiffness")] = (
        parts.Spring.cubic_stiffness
    )
    damping: Annotated[Quantity, measured(parts.Spring, "damping")] = parts.Spring.damping
    acts: Literal["both", "tension", "compression"] = Field(
        "both", description="Side of the free length on which the spring has a force"
    )
    mirror: LineOrLines = mirror_key()
    repeat: RepeatTable | None = repeat_key()


class GuideTable(Named):
    """A straight line that a point of a body stays on: a pin in a slot, or a slider."""

    point: Reference = Field(description="Guided point, body.point")
    start: Reference = Field(description="A point of the line, body.point or ground.point")
    end: Reference = Field(
        description="Another point of the line, on the same body or on the ground; the line is "
        "unlimited"
    )
    turning: StrictBool = Field(
        True,
        description="Whether the guided body may turn; otherwise it keeps its angle relative to "
        "the line",
    )
    friction: Annotated[Quantity, measured(parts.Guide, "friction")] | None = None
    mirror: LineOrLines = mirror_key()
    repeat: RepeatTable | None = repeat_key()


def own_fields(table: Table) -> dict[str, Any]:
    """Return the values of a table by key, without those that make copies."""
    return {key: value for key, value in dict(table).items() if key not in COPYING}


def joint_of(table: JointTable) -> parts.Joint:
    """Return the joint of a table."""
    return parts.Joint(**own_fields(table))


def spring_of(table: SpringTable) -> parts.Spring:
    """Return the spring of a table."""
    return parts.Spring(**own_fields(table))


def guide_of(table: GuideTable) -> parts.Guide:
    """Return the guide of a table."""
    return parts.Guide(**own_fields(table))
