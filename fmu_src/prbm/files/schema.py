"""Tables and keys of a mechanism file, and their conversion to a mechanism.

A file allows more forms than :mod:`prbm.mechanism.description`: a flexure may have a section and a
material instead of a type, several types may share a material, points may be given by name, and
quantities may have units.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Annotated, Any

from pydantic import (
    ConfigDict,
    Field,
    StrictBool,
    StrictInt,
    StrictStr,
)

from ..base.errors import MechanismError, PrbmError
from ..base.names import unknown
from ..hybrid.rest_speed import with_rest_speeds
from ..mechanism import parameters, parts
from ..mechanism.description import RESERVED, Mechanism
from ..mechanism.expressions import Quantity
from ..mechanism.fields import FIELDS
from ..mechanism.flexure import (
    CLAMP,
    HINGE_ORDER_DEFAULT,
    LEAF,
    LINKS_MAX,
    NODES_MAX,
    NOTCH_NODES,
    ORDER_DEFAULT,
    ORDER_MAX,
)
from ..mechanism.parameters import Tolerance
from ..mechanism.parts import LENGTH_MAX, LENGTH_MIN
from .attachments import (
    ForceTable,
    FrictionTable,
    ProbeTable,
    ReleaseTable,
    StopTable,
    force_of,
    friction_of,
    release_of,
    stop_of,
)
from .connections import (
    GuideTable,
    JointTable,
    SpringTable,
    guide_of,
    joint_of,
    mirror_key,
    repeat_key,
    spring_of,
)
from .copies import (
    Copied,
    Drawing,
    check_names,
    copied_bodies,
    explained,
    mirrored_types,
    origins,
)
from .drawn import check_drawing
from .outlines import CORNERS_MIN, mean, plate
from .settings import has_unit, is_tolerance, tolerance
from .tables import STRENGTHS, MaterialTable, Named, ParameterTable, RepeatTable, Table
from .units import check_coherent
from .values import (
    NAME_LENGTH_MAX,
    Acceleration,
    Corner,
    EndOrEnds,
    LineOrLines,
    Measured,
    Model,
    Point,
    PointName,
    Profile,
    Reference,
    measured,
)

GIVEN = ("mass", "inertia", "centre")
PLATE = ("thickness", "material", "density", "payload")
PAYLOAD = Measured("Mass added at the plate's centre of mass", "kg", 0.0, 1e6)
MATERIAL = ("youngs_modulus", "density")
SECTION = ("thickness", "width")
PROFILE = (
    "profile", "end_thickness", "end_width", "notch_radius", "notch_depth", "waist_length",
    "curvature", "rise",
)  # fmt: skip
IDENTIFIER = "^[A-Za-z_][A-Za-z0-9_]*$"


# --- tables -----------------------------------------------------------------------------------


class Section(Named):
    """Section, material and model of flexures."""

    model: Model | None = Field(None, description="Model")
    n: Annotated[StrictInt, Field(ge=1, json_schema_extra={"maximum": LINKS_MAX})] | None = Field(
        None, description="Number of links, for the model nR only"
    )
    order: (
        Annotated[StrictInt, Field(json_schema_extra={"minimum": 1, "maximum": ORDER_MAX})] | None
    ) = Field(
        None,
        description="Order of the polynomial of the bending moment, for the model beam only "
        f"(default: {ORDER_DEFAULT}; {HINGE_ORDER_DEFAULT} for a notch without a waist)",
    )
    nodes: (
        Annotated[StrictInt, Field(json_schema_extra={"minimum": 3, "maximum": NODES_MAX})] | None
    ) = Field(
        None,
        description="Number of nodes, or of those in a notch or waist, for the model beam only "
        f"(default: order + 3; at least {NOTCH_NODES} in a notch without a waist)",
    )
    thickness: Annotated[Quantity, measured(parts.FlexureType, "thickness")] | None = None
    width: Annotated[Quantity, measured(parts.FlexureType, "width")] | None = None
    material: StrictStr | None = Field(
        None, description="Name of a material, in place of youngs_modulus and density"
    )
    youngs_modulus: Annotated[Quantity, measured(parts.FlexureType, "youngs_modulus")] | None = None
    density: Annotated[Quantity, measured(parts.FlexureType, "density")] | None = None
    axial: StrictBool = Field(False, description="Whether the flexures can stretch")
    profile: Profile = Field(LEAF, description="Section along a beam")
    end_thickness: Annotated[Quantity, measured(parts.FlexureType, "end_thickness")] | None = None
    end_width: Annotated[Quantity, measured(parts.FlexureType, "end_width")] | None = None
    notch_radius: Annotated[Quantity, measured(parts.FlexureType, "notch_radius")] | None = None
    notch_depth: Annotated[Quantity, measured(parts.FlexureType, "notch_depth")] | None = None
    waist_length: Annotated[Quantity, measured(parts.FlexureType, "waist_length")] | None = None
    curvature: Annotated[Quantity, measured(parts.FlexureType, "curvature")] | None = None
    rise: Annotated[Quantity, measured(parts.FlexureType, "rise")] | None = None
    initial_strain: Annotated[Quantity, measured(parts.FlexureType, "initial_strain")] | None = None
    stress: StrictBool = Field(
        False, description="Whether the stress of the flexures, and its peak, are outputs"
    )
    coefficients: dict[StrictStr, Annotated[Quantity, Measured("Coefficient", "")]] = Field(
        {}, description="Values that replace the published coefficients of the model"
    )


_OWN = (
    "model", "n", "order", "nodes", *SECTION, "material", *MATERIAL, "axial",
    "initial_strain", "stress", "coefficients", *PROFILE,
)  # fmt: skip
_NO_MATERIAL_TWICE: list[Any] = [{"not": {"required": ["material", key]}} for key in MATERIAL]
_MADE_OF: Any = {"anyOf": [{"required": ["material"]}, {"required": [*MATERIAL]}]}
_OF_A_TYPE: Any = {"required": ["type"]}
_OF_ITS_OWN: Any = {"allOf": [{"required": ["model", *SECTION]}, _MADE_OF]}
_NOT_BOTH: list[Any] = [{"not": {"required": ["type", key]}} for key in _OWN]


class FlexureTypeTable(Section):
    """Section, material and model that several flexures share."""

    model_config = ConfigDict(json_schema_extra={"allOf": [_MADE_OF, *_NO_MATERIAL_TWICE]})

    model: Model = Field(description="Model")
    thickness: Annotated[Quantity, measured(parts.FlexureType, "thickness")]
    width: Annotated[Quantity, measured(parts.FlexureType, "width")]


class FlexureTable(Section):
    """A flexure between two points, with a type or with its own section."""

    model_config = ConfigDict(
        json_schema_extra={
            "allOf": [{"anyOf": [_OF_A_TYPE, _OF_ITS_OWN]}, *_NOT_BOTH, *_NO_MATERIAL_TWICE]
        }
    )

    type: StrictStr | None = Field(
        None, description="Name of a flexure type, in place of model, section and material"
    )
    start: Reference = Field(description="Start point, body.point or ground.point")
    end: Reference = Field(description="End point, body.point or ground.point")
    ends: EndOrEnds = Field(
        (CLAMP, CLAMP),
        description="Type of both ends, or a pair for start and end; the other end of a free one "
        "must be a clamp",
    )
    mirror: LineOrLines = mirror_key()
    repeat: RepeatTable | None = repeat_key()


_GIVEN: Any = {"required": [*GIVEN]}
_OF_SOMETHING: Any = {"anyOf": [{"required": ["material"]}, {"required": ["density"]}]}
_CUT: Any = {"allOf": [{"required": ["outline", "thickness"]}, _OF_SOMETHING]}
_NOT_GIVEN_TWICE: list[Any] = [
    {"not": {"required": pair}}
    for pair in (*([one, other] for one in GIVEN for other in PLATE), ["material", "density"])
]


class GroundPartTable(Table):
    """A fixed part, for pictures and drawings only."""

    outline: tuple[Point, ...] = Field(description="Corners in order as drawn [m]")
    holes: tuple[tuple[Point, ...], ...] = Field(
        (), description="Corners of each hole in the outline [m]"
    )


class BodyTable(Named):
    """A rigid body, with mass, inertia and centre, or cut from a plate."""

    model_config = ConfigDict(
        json_schema_extra={"allOf": [{"anyOf": [_GIVEN, _CUT]}, *_NOT_GIVEN_TWICE]}
    )

    mass: Annotated[Quantity, measured(parts.Body, "mass")] | None = None
    inertia: Annotated[Quantity, measured(parts.Body, "inertia")] | None = None
    centre: Point | None = Field(None, description="Centre of mass as drawn [m]")
    points: dict[PointName, Point] = Field({}, description="Points as drawn, by name [m]")
    outline: tuple[Corner, ...] = Field(
        (), description="Corners in order, coordinates as drawn or names of points [m]"
    )
    holes: tuple[tuple[Corner, ...], ...] = Field(
        (), description="Corners of each hole in the outline [m]"
    )
    thickness: (
        Annotated[
            float,
            Measured("Thickness of the plate, across the plane of motion", "m", LENGTH_MIN,
                     LENGTH_MAX, expression=False),
        ]
        | None
    ) = None  # fmt: skip
    material: StrictStr | None = Field(
        None, description="Name of the material of the plate, in place of density"
    )
    density: Annotated[Quantity, measured(parts.FlexureType, "density")] | None = None
    payload: Annotated[Quantity, PAYLOAD] | None = None
    start_angle: Annotated[Quantity, measured(parts.Body, "start_angle")] | None = None
    start_x: Annotated[Quantity, measured(parts.Body, "start_x")] | None = None
    start_y: Annotated[Quantity, measured(parts.Body, "start_y")] | None = None
    start_omega: Annotated[Quantity, measured(parts.Body, "start_omega")] | None = None
    start_vx: Annotated[Quantity, measured(parts.Body, "start_vx")] | None = None
    start_vy: Annotated[Quantity, measured(parts.Body, "start_vy")] | None = None
    mirror: LineOrLines = mirror_key()
    repeat: RepeatTable | None = repeat_key()


class MechanismTable(Table):
    """A planar compliant mechanism."""

    name: Annotated[
        StrictStr, Field(max_length=NAME_LENGTH_MAX, json_schema_extra={"pattern": IDENTIFIER})
    ] = Field(description="Name of the FMU, of letters a to z, digits and _")
    title: StrictStr = Field(description="Title of one line")
    description: StrictStr = Field("", description="Description of one paragraph")
    states: tuple[StrictStr, ...] = Field(
        (),
        description="Coordinates that are states in model exchange, for example crank.angle, "
        "before others",
    )
    gravity: tuple[Acceleration, Acceleration] = Field(
        (0.0, 0.0), description="Acceleration of gravity along x and y [m/s2]"
    )
    damping_zeta: Annotated[
        float, Measured("Damping ratio of the fundamental mode", "", 0.0, 10.0, expression=False)
    ] = 0.0
    damping_beta: Annotated[
        float,
        Measured("Time constant of stiffness-proportional damping", "s", 0.0, 1e-2,
                 expression=False),
    ] = 0.0  # fmt: skip
    ground: dict[PointName, Point] = Field(
        default_factory=dict, description="Fixed points, by name [m]"
    )
    geometry: tuple[ParameterTable, ...] = Field(
        (), description="Parameters for points and other quantities"
    )
    materials: tuple[MaterialTable, ...] = Field((), description="Materials")
    ground_parts: tuple[GroundPartTable, ...] = Field(
        (), description="Outlines of fixed parts, for pictures and drawings only"
    )
    bodies: tuple[BodyTable, ...] = Field(description="Rigid bodies")
    flexure_types: tuple[FlexureTypeTable, ...] = Field(
        (), description="Sections, materials and models that several flexures share"
    )
    flexures: tuple[FlexureTable, ...] = Field((), description="Flexures")
    joints: tuple[JointTable, ...] = Field((), description="Pins")
    springs: tuple[SpringTable, ...] = Field((), description="Springs and dampers")
    guides: tuple[GuideTable, ...] = Field((), description="Lines that points of bodies stay on")
    stops: tuple[StopTable, ...] = Field((), description="Walls")
    frictions: tuple[FrictionTable, ...] = Field((), description="Coulomb friction")
    forces: tuple[ForceTable, ...] = Field((), description="Forces that are inputs of the FMU")
    probes: tuple[ProbeTable, ...] = Field(
        (), description="Points whose motion is an output of the FMU"
    )
    release: ReleaseTable = Field(description="Start of the motion")
    tolerances: dict[str, Any] = Field(
        default_factory=dict, description='Tolerances of parameters, "2 %" or "0.1 mm uniform"'
    )


# --- conversion to a mechanism ----------------------------------------------------------------


def mechanism(file: MechanismTable, drawing: str = "") -> Mechanism:
    """Return the mechanism that a file describes.

    Raises
    ------
    MechanismError
        If the file is inconsistent or has an undefined reference.
    ParameterError
        If a default is outside its bounds.
    """
    _check_names(file)
    for part in file.ground_parts:
        if min(map(len, (part.outline, *part.holes))) < CORNERS_MIN:
            raise MechanismError(f"ground_parts: write at least {CORNERS_MIN} corners, [x, y] each")
    materials = _materials(file)
    misshapen: list[MechanismError] = []
    bodies = copied_bodies(file.bodies, [_body(t, materials, misshapen) for t in file.bodies])
    drawn = Drawing(file.ground, bodies)
    flexures = tuple(drawn.connections(file.flexures, [*map(_flexure, file.flexures)]))
    own = (flexure for flexure in file.flexures if flexure.type is None)
    types = [_type(table, materials) for table in (*file.flexure_types, *own)]
    others: dict[str, Any] = {
        "joints": tuple(drawn.connections(file.joints, [*map(joint_of, file.joints)])),
        "springs": tuple(drawn.connections(file.springs, [*map(spring_of, file.springs)])),
        "guides": tuple(drawn.connections(file.guides, [*map(guide_of, file.guides)])),
        "probes": tuple(
            drawn.connections(file.probes, [parts.Probe(t.name, t.point) for t in file.probes])
        ),
    }
    connected = mirrored_types(file.flexures, flexures, types)
    try:
        result = _assembled(file, drawn, connected, others, drawing)
        result = replace(result, tolerances=_tolerances(file.tolerances, result))
        if misshapen:  # Raised after an undefined name in an outline, which may be its cause.
            raise misshapen[0]
        check_drawing(result)
    except PrbmError as error:
        made_by = origins(_with_copies(file)) | drawn.made_by
        raise type(error)(explained(str(error), made_by)) from None
    unset = [stop for stop in file.stops if stop.rest_speed is None]
    return with_rest_speeds(result, {*(stop.name for stop in unset), *origins(unset)})


def _assembled(
    file: MechanismTable,
    drawn: Drawing,
    connected: tuple[tuple[parts.Flexure, ...], tuple[parts.FlexureType, ...]],
    others: Mapping[str, Any],
    drawing: str,
) -> Mechanism:
    """Return the mechanism of a file, whose bodies and connections include the copies."""
    points = {body.name: body.points for body in drawn.bodies}
    same = ("name", "title", "description", "states", "gravity", "damping_zeta", "damping_beta")
    return Mechanism(
        **{key: getattr(file, key) for key in same},
        ground=drawn.ground,
        bodies=drawn.bodies,
        flexures=connected[0],
        flexure_types=connected[1],
        **others,
        stops=tuple(drawn.attached(file.stops, [stop_of(t, points) for t in file.stops])),
        frictions=tuple(
            drawn.attached(file.frictions, [friction_of(t, points) for t in file.frictions])
        ),
        forces=tuple(drawn.attached(file.forces, [force_of(t, points) for t in file.forces])),
        release=release_of(file.release, points),
        geometry=tuple(_parameters(file)),
        drawing=drawing,
        ground_parts=tuple(parts.GroundPart(t.outline, t.holes) for t in file.ground_parts),
    )


def _parameters(file: MechanismTable) -> Iterator[parameters.Parameter]:
    """Yield the parameters of the file and of its materials."""
    for table in file.geometry:
        try:
            check_coherent(table.unit)
        except MechanismError as error:
            raise MechanismError(f"{table.name} has the unit {table.unit!r}: {error}") from None
        yield parameters.Parameter(**{k: v for k, v in dict(table).items() if v is not None})
    owned: list[tuple[Named, str]] = [(m, key) for m in file.materials for key in MATERIAL]
    for owner, key in (*owned, *((body, "density") for body in file.bodies)):
        given = getattr(owner, key)
        if isinstance(given, float):
            unit, description, least, most, nominal, _ = FIELDS[parts.FlexureType][key]
            about = f"{description} of {owner.name}"
            name = f"{owner.name}.{key}"
            yield parameters.Parameter(name, given, unit, about, least, most, nominal)


def _tolerances(table: Mapping[str, Any], mechanism: Mechanism) -> dict[str, Tolerance]:
    """Return the tolerances of parameters, whose names may be nested tables."""
    units = {parameter.name: parameter.unit for parameter in mechanism.parameters}
    found = {}
    for name, text in _leaves(table, ""):
        key = f"tolerances.{name}"
        if name not in units:
            raise MechanismError(f"{key}: {unknown(name, units)}")
        half = text.strip().removesuffix("uniform") if isinstance(text, str) else ""
        bare = bool(units[name]) and not has_unit(half) and not half.strip().endswith("%")
        if not isinstance(text, str) or is_tolerance(text) or bare:
            raise MechanismError(
                f"{key} = {text!r}: write the distance of the limits from the value, "
                'for instance "2 %"' + f' or "1 {units[name]}"' * bool(units[name])
            )
        found[name] = tolerance(text, units[name], f"{key} =")[1]
    return found


def _leaves(table: Mapping[str, Any], before: str) -> Iterator[tuple[str, Any]]:
    """Yield the values of nested tables, with their dotted names."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{before}{key}.")
        else:
            yield before + key, value


def _materials(file: MechanismTable) -> dict[str, dict[str, Any]]:
    """Return Young's modulus, density and strengths of each material, as types refer to them."""
    return {
        m.name: {key: _referred(m, key) for key in MATERIAL}
        | {key: getattr(m, key) for key in STRENGTHS}
        for m in file.materials
    }


def _check_names(file: MechanismTable) -> None:
    """Reject a name of two parts of one kind, or of a material and any other part."""
    parts: tuple[tuple[Named, ...], ...] = (file.bodies, file.flexure_types, file.flexures)
    parts = (*parts, file.joints, file.springs, file.guides, file.stops, file.frictions)
    parts = (*parts, file.forces, file.probes)
    reserved = {*RESERVED}
    for kind in (file.materials, *parts):
        seen = set(reserved)
        for name in (part.name for part in kind):
            if name in seen:
                raise MechanismError(
                    f"the name {name!r} is used twice or reserved: give each part its own name"
                )
            seen.add(name)
        reserved |= {material.name for material in file.materials}
    others = {part.name for kind in (file.materials, *parts) for part in kind}
    check_names(_with_copies(file), {*RESERVED, *others}, NAME_LENGTH_MAX)


def _with_copies(file: MechanismTable) -> tuple[Copied, ...]:
    """Return the tables of parts that may have copies."""
    every: tuple[Copied, ...] = (*file.bodies, *file.flexures, *file.joints, *file.springs)
    every = (*every, *file.guides, *file.probes)
    return (*every, *file.stops, *file.frictions, *file.forces)


def _referred(material: MaterialTable, key: str) -> Quantity:
    """Return the expression of a material's quantity, or the name of its parameter."""
    given: Quantity = getattr(material, key)
    return given if isinstance(given, str) else f"{material.name}.{key}"


def _type(table: Section, materials: Mapping[str, dict[str, Any]]) -> parts.FlexureType:
    """Return the flexure type of a table; the type of a flexure's own section has its name."""
    for key in ("model", *SECTION):
        if getattr(table, key) is None:
            raise MechanismError(
                f"{table.name}.{key} is missing: add the key, or the type of the flexure"
            )
    keys = (key for key in _OWN if key not in ("n", "material", *MATERIAL))
    given: dict[str, Any] = {key: getattr(table, key) for key in ("name", *keys)}
    return parts.FlexureType(**given | _material(table, materials), n=table.n or 0)


def _material(table: Section, materials: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    """Return Young's modulus, density and strengths of a type or flexure."""
    own = {key: getattr(table, key) for key in MATERIAL if key in table.model_fields_set}
    if table.material is None:
        if len(own) < len(MATERIAL):
            raise MechanismError(
                f"{table.name} has no material: add material with the name of one, or "
                f"{' and '.join(key for key in MATERIAL if key not in own)}"
            )
        return own
    if own:
        raise MechanismError(
            f"{table.name} has material as well as {' and '.join(own)}: remove one of them"
        )
    return _named_material(table.name, table.material, materials)


def _named_material(
    user: str, name: str, materials: Mapping[str, dict[str, Quantity]]
) -> dict[str, Quantity]:
    """Return Young's modulus and density of a material that a part refers to."""
    if name not in materials:
        known = f"materials are {', '.join(materials)}" if materials else "add it to [[materials]]"
        raise MechanismError(f"{user}.material = {name!r} is not defined; {known}")
    return materials[name]


def _body(
    table: BodyTable,
    materials: Mapping[str, dict[str, Quantity]],
    misshapen: list[MechanismError],
) -> parts.Body:
    """Return the body of a table; mass, inertia and centre are given, or those of a plate.

    The error of a plate without a valid shape is added to a list.
    """
    outline = tuple(_corner(table, corner) for corner in table.outline)
    holes = tuple(tuple(_corner(table, corner) for corner in hole) for hole in table.holes)
    shape: dict[str, Any] = {"points": table.points, "outline": outline, "holes": holes}
    shape |= {key: getattr(table, key) for key in (*parts.POSITIONS, *parts.VELOCITIES)}
    given = {key: getattr(table, key) for key in GIVEN if getattr(table, key) is not None}
    cut = [key for key in PLATE if getattr(table, key) is not None]
    if given and cut:
        raise MechanismError(
            f"{table.name} has {' and '.join(given)} as well as {' and '.join(cut)}: give mass, "
            "inertia and centre, or outline, thickness and material (or density); what a plate "
            "carries is its payload"
        )
    if not cut:
        for key in GIVEN:
            if key not in given:
                raise MechanismError(
                    f"{table.name}.{key} is missing: add the key, or outline, thickness and "
                    "material (or density)"
                )
        if holes and not outline:
            raise MechanismError(f"{table.name}.holes needs an outline: add the key outline")
        return parts.Body(table.name, **given, **shape)
    if not table.outline or table.thickness is None:
        missing = "outline" if not table.outline else "thickness"
        raise MechanismError(
            f"{table.name}.{missing} is missing: add the key, or give mass, inertia and centre in "
            f"place of {' and '.join(cut)}"
        )
    parameters.Parameter(
        f"{table.name}.thickness", table.thickness, "m", "", LENGTH_MIN, LENGTH_MAX
    )
    density = _density(table, materials)
    payload = 0.0 if table.payload is None else table.payload
    if not isinstance(payload, str) and payload < 0.0:
        raise MechanismError(f"{table.name}.payload = {payload:g} kg must not be negative")
    try:
        computed: Any = plate(table.name, outline, holes, table.thickness, density, payload)
    except MechanismError as error:
        misshapen.append(error)
        computed = {"mass": "1", "inertia": "1", "centre": mean(outline)}
    return parts.Body(table.name, **computed, **shape)


def _corner(table: BodyTable, corner: Point | str) -> parts.Point:
    """Return a corner of an outline; a point of the body given by name by its coordinates."""
    if not isinstance(corner, str):
        return corner
    if corner not in table.points:
        listed = f"its points are {', '.join(table.points)}" if table.points else "add [x, y]"
        raise MechanismError(
            f"{table.name}.outline: {corner!r} is not a point of the body {table.name}; {listed}"
        )
    return table.points[corner]


def _density(table: BodyTable, materials: Mapping[str, dict[str, Quantity]]) -> Quantity:
    """Return the density of a plate as an expression: that of its material, or its own."""
    if table.material is None:
        if table.density is None:
            raise MechanismError(
                f"{table.name} has no material: add material with the name of one, or density"
            )
        return table.density if isinstance(table.density, str) else f"{table.name}.density"
    if table.density is not None:
        raise MechanismError(f"{table.name} has material as well as density: remove one of them")
    return _named_material(table.name, table.material, materials)["density"]


def _flexure(table: FlexureTable) -> parts.Flexure:
    """Return the flexure of a table; without a type, its type has the name of the flexure."""
    own = [key for key in _OWN if key in table.model_fields_set]
    if table.type is not None and own:
        raise MechanismError(
            f"{table.name} has type as well as {' and '.join(own)}: remove one of them"
        )
    ends = (table.ends, table.ends) if isinstance(table.ends, str) else table.ends
    kind = table.name if table.type is None else table.type
    return parts.Flexure(table.name, kind, table.start, table.end, ends)
