"""Tables of parts at points of bodies, such as stops and forces, and their conversion to parts."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, StrictInt, StrictStr, ValidationInfo, field_validator

from ..base.errors import MechanismError
from ..mechanism import parts
from ..mechanism.description import undefined
from ..mechanism.expressions import Quantity
from ..mechanism.parts import GROUND
from .connections import mirror_key, own_fields, repeat_key
from .tables import Named, RepeatTable, Table
from .units import contact_stiffness
from .values import Angle, Law, LineOrLines, PointOrName, Reference, measured


class StopTable(Named):
    """A contact of a point of a body with a wall, which is fixed to the ground or another body."""

    body: StrictStr = Field(description="Body that hits the wall")
    point: PointOrName = Field(description="Hit point, coordinates as drawn or body.point")
    on: StrictStr = Field(GROUND, description="Body that carries the wall, or ground")
    direction: Angle = parts.Stop.direction
    position: Annotated[Quantity, measured(parts.Stop, "position")] = parts.Stop.position
    offset: Annotated[Quantity, measured(parts.Stop, "offset")] = parts.Stop.offset
    restitution: Annotated[Quantity, measured(parts.Stop, "restitution")] = parts.Stop.restitution
    friction: Annotated[Quantity, measured(parts.Stop, "friction")] = parts.Stop.friction
    rest_speed: Annotated[Quantity, measured(parts.Stop, "rest_speed")] | None = None
    law: Law = Field(parts.RIGID, description="Law of impact")
    exponent: Annotated[Quantity, measured(parts.Stop, "exponent")] | None = None
    stiffness: Annotated[Quantity, measured(parts.Stop, "stiffness")] | None = None
    mirror: LineOrLines = mirror_key()
    repeat: RepeatTable | None = repeat_key()

    @field_validator("stiffness", mode="before")
    @classmethod
    def _unit_of_stiffness(cls, written: object, info: ValidationInfo) -> object:
        exponent = info.data.get("exponent")
        exponent = 1.0 if exponent is None else exponent
        invalid = isinstance(exponent, float) and exponent < 1.0  # Reported for the exponent.
        if invalid or not isinstance(written, str):
            return written
        return contact_stiffness(written, exponent)


class FrictionTable(Named):
    """Coulomb friction against the motion of a body along a direction."""

    body: StrictStr = Field(description="Body on which the friction acts")
    point: PointOrName | None = Field(
        None, description="Point, coordinates as drawn or body.point (default: centre of mass)"
    )
    direction: Angle = parts.Friction.direction
    coefficient: Annotated[Quantity, measured(parts.Friction, "coefficient")] = (
        parts.Friction.coefficient
    )
    normal_force: Annotated[Quantity, measured(parts.Friction, "normal_force")] = (
        parts.Friction.normal_force
    )
    normal_stiffness: Annotated[Quantity, measured(parts.Friction, "normal_stiffness")] = (
        parts.Friction.normal_stiffness
    )
    mirror: LineOrLines = mirror_key()
    repeat: RepeatTable | None = repeat_key()


class ForceTable(Named):
    """Inputs name.x, name.y and name.moment: a force and a moment on a body."""

    body: StrictStr = Field(description="Body on which the force acts")
    point: PointOrName | None = Field(
        None, description="Point, coordinates as drawn or body.point (default: centre of mass)"
    )
    mirror: LineOrLines = mirror_key()
    repeat: RepeatTable | None = repeat_key()


class ProbeTable(Named):
    """A point whose displacement name.x, name.y and velocity name.vx, name.vy are outputs."""

    point: Reference = Field(description="Point, body.point")
    mirror: LineOrLines = mirror_key()
    repeat: RepeatTable | None = repeat_key()


class ReleaseTable(Table):
    """Start of the motion: from a shape held at a displacement or angle, or along a mode."""

    body: StrictStr = Field(description="Body that is held and released")
    point: PointOrName | None = Field(
        None,
        description="Released point, coordinates as drawn or body.point (default: centre of mass)",
    )
    direction: Angle = parts.Release.direction
    displacement: Annotated[Quantity, measured(parts.Release, "displacement")] | None = None
    angle: Annotated[Quantity, measured(parts.Release, "angle")] | None = None
    mode: Annotated[StrictInt, Field(ge=1, le=parts.MODE_MAX)] | None = Field(
        None, description="Number of the mode, with amplitude"
    )
    amplitude: Annotated[Quantity, measured(parts.Release, "amplitude")] | None = None
    velocity: Annotated[Quantity, measured(parts.Release, "velocity")] = parts.Release.velocity


def release_of(
    table: ReleaseTable, bodies: Mapping[str, Mapping[str, parts.Point]]
) -> parts.Release:
    """Return the release of a table."""
    return parts.Release(**_attached(table, bodies))


def stop_of(table: StopTable, bodies: Mapping[str, Mapping[str, parts.Point]]) -> parts.Stop:
    """Return the stop of a table; the rest speed is computed later if it has none."""
    given = _attached(table, bodies)
    if table.rest_speed is None:
        del given["rest_speed"]
    return parts.Stop(**given)


def friction_of(
    table: FrictionTable, bodies: Mapping[str, Mapping[str, parts.Point]]
) -> parts.Friction:
    """Return the friction point of a table."""
    return parts.Friction(**_attached(table, bodies))


def force_of(table: ForceTable, bodies: Mapping[str, Mapping[str, parts.Point]]) -> parts.Force:
    """Return the force of a table."""
    return parts.Force(**_attached(table, bodies))


def _attached(
    table: StopTable | FrictionTable | ForceTable | ReleaseTable,
    bodies: Mapping[str, Mapping[str, parts.Point]],
) -> dict[str, Any]:
    """Return the fields of a part; a point given by name is replaced by its coordinates."""
    given = own_fields(table)
    user = "release" if isinstance(table, ReleaseTable) else table.name
    if table.body not in bodies:
        raise MechanismError(undefined(f"{user}.body", table.body, bodies))
    if isinstance(table.point, str):
        body, _, name = table.point.rpartition(".")
        points = bodies[table.body]
        if body != table.body or name not in points:
            listed = ", ".join(f"{table.body}.{p}" for p in points)
            raise MechanismError(
                f"{user}.point = {table.point!r} is not a point of the body {table.body}; "
                + (f"its points are {listed}" if points else "define the points of this body")
            )
        given["point"] = points[name]
    return given
