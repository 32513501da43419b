"""A planar compliant mechanism as frozen data that refuses to be inconsistent.

Bodies, flexures, stops, friction, forces and the release are described as they are drawn: all
points are global coordinates of the straight, unloaded shape.  A number in the description of a
part becomes a parameter ``part.field``; a text is an expression in parameters, linear in them::

    Body("shuttle", mass=0.05, ..., points={"right": ("shuttle.width", "flexure.length")})

so that the same data serve one simulation, an FMU whose parameters are set by an importer, and a
picture.  Nothing here knows of files or of FMI.
"""

import ast
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from keyword import iskeyword
from typing import ClassVar

from .errors import MechanismError, ParameterError
from .flexure import CLAMP, ENDS, FREE, MODELS, MOST_LINKS, FlexureModel

Quantity = float | str
Point = tuple[Quantity, Quantity]

GROUND = "ground"
RESERVED = (GROUND, "base", "damping", "energy", "gravity", "link", "mode", "release", "solver")
NAME = re.compile(r"[A-Za-z_]\w*(\[\d+\])?(\.[A-Za-z_]\w*(\[\d+\])?)*")


# --- values -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Affine:
    """A linear expression in parameters, constant + sum(factor * parameter)."""

    constant: float = 0.0
    terms: Mapping[str, float] = field(default_factory=dict)

    def __call__(self, values: Mapping[str, float]) -> float:
        """Evaluate the expression for the given parameters."""
        return self.constant + sum(c * values[name] for name, c in self.terms.items())

    def scaled(self, factor: float) -> "Affine":
        """Return the expression times a number."""
        terms = {name: factor * c for name, c in self.terms.items()}
        return Affine(factor * self.constant, terms)

    def plus(self, other: "Affine") -> "Affine":
        """Return the sum of two expressions."""
        terms = dict(self.terms)
        for name, c in other.terms.items():
            terms[name] = terms.get(name, 0.0) + c
        return Affine(self.constant + other.constant, terms)


def affine(quantity: Quantity) -> Affine:
    """Read a number or an expression that is linear in parameters.

    Parameters
    ----------
    quantity : float or str
        Numbers, names of parameters, ``+ - * /`` and parentheses.

    Raises
    ------
    MechanismError
        If the text is anything else, or not linear in the parameters.

    Examples
    --------
    >>> affine("flexure.length + shuttle.width/2")({"flexure.length": 2, "shuttle.width": 1})
    2.5
    """
    try:
        if not isinstance(quantity, str):
            result = Affine(float(quantity))
        else:
            result = _affine(ast.parse(quantity.strip(), mode="eval").body)
    except (
        TypeError,
        SyntaxError,
        ValueError,
        ArithmeticError,
        RecursionError,
        MemoryError,
    ) as why:
        reason = why.msg if isinstance(why, SyntaxError) else why
        raise MechanismError(
            f"cannot read the expression {str(quantity)[:80]!r}: write numbers and parameter names "
            f"joined by + - * /, linear in the parameters ({reason})"
        ) from None
    if not all(map(math.isfinite, (result.constant, *result.terms.values()))):
        raise MechanismError(f"cannot read the expression {quantity!r}: its numbers are not finite")
    return result


def _affine(node: ast.expr) -> Affine:
    match node:
        case ast.Constant(value=int() | float() as number):
            return Affine(float(number))
        case ast.Name() | ast.Attribute() | ast.Subscript():
            return Affine(0.0, {ast.unparse(node): 1.0})
        case ast.UnaryOp(op=ast.USub(), operand=a):
            return _affine(a).scaled(-1.0)
        case ast.UnaryOp(op=ast.UAdd(), operand=a):
            return _affine(a)
        case ast.BinOp(left=a, op=ast.Add(), right=b):
            return _affine(a).plus(_affine(b))
        case ast.BinOp(left=a, op=ast.Sub(), right=b):
            return _affine(a).plus(_affine(b).scaled(-1.0))
        case ast.BinOp(left=a, op=ast.Mult(), right=b):
            x, y = _affine(a), _affine(b)
            if x.terms and y.terms:
                raise ValueError("a product of two parameters")
            return y.scaled(x.constant) if y.terms else x.scaled(y.constant)
        case ast.BinOp(left=a, op=ast.Div(), right=b):
            x, y = _affine(a), _affine(b)
            if y.terms:
                raise ValueError("a division by a parameter")
            return x.scaled(1.0 / y.constant)
    raise ValueError(f"{ast.unparse(node)!r} is not allowed")


@dataclass(frozen=True)
class Parameter:
    """A named value with its unit, its meaning and the bounds within which it makes sense.

    Parameters
    ----------
    name : str
        Structured name, for instance ``flexure.length``.
    value : float
        Default, in the unit.
    unit : str
        SI unit, products with dots and powers as in ``kg.m2``; empty if dimensionless.
    description : str
        One sentence for a person who knows the mechanism but not the model.
    minimum, maximum : float
        Inclusive bounds.
    nominal : float or None
        Typical magnitude, where it differs much from 1.
    tunable : bool
        Whether it may change while the simulation runs.
    """

    name: str
    value: float
    unit: str = ""
    description: str = ""
    minimum: float = -math.inf
    maximum: float = math.inf
    nominal: float | None = None
    tunable: bool = False

    def __post_init__(self) -> None:
        if not NAME.fullmatch(self.name):
            raise MechanismError(
                f"{self.name!r} is no name: use letters, digits and _, joined by dots"
            )
        self.check(self.value)

    def check(self, value: float) -> float:
        """Return the value as a float if it is allowed.

        Raises
        ------
        ParameterError
            If it is not a finite number within the bounds.
        """
        number = finite(self.name, value, self.unit)
        unit = f" {self.unit}" if self.unit else ""
        if number < self.minimum:
            raise ParameterError(
                f"{self.name} = {number:.10g}{unit} must be at least {self.minimum:g}{unit}"
            )
        if number > self.maximum:
            raise ParameterError(
                f"{self.name} = {number:.10g}{unit} must be at most {self.maximum:g}{unit}"
            )
        return number


def finite(name: str, value: float, unit: str = "") -> float:
    """Return a finite number as a float.

    Raises
    ------
    ParameterError
        If it is anything else.
    """
    unit = f" {unit}" if unit else ""
    if isinstance(value, bool | str | bytes) or not hasattr(value, "__float__"):
        raise ParameterError(f"{name} = {value!r} must be a number{unit and ' in'}{unit}")
    number = float(value)
    if not math.isfinite(number):
        raise ParameterError(f"{name} = {number}{unit} must be a finite number")
    return number


# --- parts ------------------------------------------------------------------------------------


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
    """Section and material that several flexures share, and the model that stands for them.

    Parameters
    ----------
    name : str
        Prefix of the parameters, for instance ``flexure``.
    model : {"1R", "2R", "3R", "nR"}
        Pseudo-rigid-body model.
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
    shape along that direction, as seen from what the wall is fixed to.  ``offset`` [m] shifts
    the point along the wall, positive to the left of the direction.
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

TINY_LENGTH = 1e-9  # m; below this a dimension of a mechanism is a mistake, not a nanostructure
TINY_MASS = 1e-15  # kg; a cubic micrometre of silicon has 2e-15 kg
LARGE = 1e3  # m, and other magnitudes that no mechanism of this kind exceeds


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
        "thickness": _meta("m", "Thickness in the plane of motion", TINY_LENGTH, 1.0, 1e-4),
        "width": _meta("m", "Width across the plane of motion", TINY_LENGTH, LARGE, 1e-2),
        "youngs_modulus": _meta("Pa", "Young's modulus", 1.0, 1e13, 1e11),
        "density": _meta("kg/m3", "Density", 1.0, 1e5, 1e4),
    },
    Body: {
        "mass": _meta("kg", "Mass", TINY_MASS, 1e6, 0.1),
        "inertia": _meta(
            "kg.m2", "Moment of inertia about the centre of mass", 1e-30, 1e9, 1e-4
        ),
    },
    Stop: {
        "position": _meta(
            "m",
            "Displacement of the hit point from the straight shape at which it touches",
            -LARGE,
            LARGE,
            1e-2,
            tunable=True,
        ),
        "offset": _meta(
            "m", "Distance of the hit point from the centre of mass along the wall",
            -LARGE, LARGE, 1e-2, tunable=True,
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
            -LARGE, LARGE, 1e-2,
        ),
        "velocity": _meta("m/s", "Velocity at release", -1e4, 1e4),
    },
}  # fmt: skip


@dataclass(frozen=True)
class Mechanism:
    """Everything there is to know about a mechanism before any number is changed.

    Parameters
    ----------
    name, title, description : str
        Identifier of its FMU, one line, a paragraph.
    ground : mapping
        Fixed points by name [m].
    bodies, flexure_types, flexures, joints, stops, frictions, forces, probes : tuples of parts
        The parts.
    release : Release
        How the motion starts.
    geometry : tuple of Parameter
        Parameters that the points refer to.
    gravity : pair of float
        Default acceleration of gravity along x and y [m/s^2].
    damping_zeta, damping_beta : float
        Default damping ratio of the fundamental mode [-] and time constant of the damping in
        proportion to every spring's rate [s].
    drawing : str
        The mechanism in characters.

    Raises
    ------
    MechanismError
        If a name is used twice, a reference leads nowhere or a part cannot be.
    ParameterError
        If a default is out of its own bounds.
    """

    name: str
    title: str
    ground: Mapping[str, Point]
    bodies: tuple[Body, ...]
    flexure_types: tuple[FlexureType, ...]
    flexures: tuple[Flexure, ...]
    release: Release
    joints: tuple[Joint, ...] = ()
    stops: tuple[Stop, ...] = ()
    frictions: tuple[Friction, ...] = ()
    forces: tuple[Force, ...] = ()
    probes: tuple[Probe, ...] = ()
    geometry: tuple[Parameter, ...] = ()
    gravity: tuple[float, float] = (0.0, 0.0)
    damping_zeta: float = 0.0
    damping_beta: float = 0.0
    description: str = ""
    drawing: str = ""

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[A-Za-z_]\w*", self.name, re.ASCII) or iskeyword(self.name):
            raise MechanismError(
                f"mechanism name {self.name!r}: use letters a to z, digits and _, not starting "
                "with a digit, and no word of Python (it becomes a file name and an identifier)"
            )
        if len(self.gravity) != 2:
            raise MechanismError(f"gravity = {self.gravity!r} must have an x and a y component")
        self._check_references()
        self._check_names()
        known = {p.name: p for p in self.parameters}
        given = dict(self._quantities())
        for where, quantity in self._quantities():
            for name in affine(quantity).terms:
                if name not in known and name in given:
                    raise MechanismError(
                        f"{where} refers to {name!r}, which is an expression itself: write it out"
                    )
                if name not in known:
                    raise MechanismError(
                        f"{where} refers to {name!r}, which is no parameter of {self.name}; "
                        f"{proposal(name, known)}"
                    )

    # -- parameters --

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, in the order of the interface."""
        return tuple(self._parameters())

    def _parameters(self) -> Iterator[Parameter]:
        yield from self.geometry
        for kind in self.flexure_types:
            yield from _fields(kind)
            for c in self.model(kind).coefficients:
                value = kind.coefficients.get(c.name, c.value)
                if not isinstance(value, str):
                    yield Parameter(
                        f"{kind.name}.{c.name}", value, "", c.description, c.minimum, c.maximum
                    )
        for body in self.bodies:
            yield from _fields(body)
        for axis, g in zip("xy", self.gravity, strict=True):
            yield Parameter(
                f"gravity.{axis}", g, "m/s2", f"Acceleration of gravity along {axis}",
                -1e6, 1e6, 10.0,
            )  # fmt: skip
        yield from _fields(self.release)
        yield Parameter(
            "solver.tolerance", 1e-8, "",
            "Relative tolerance of the integration, unless the importer gives one", 1e-13, 1e-2,
            1e-8,
        )  # fmt: skip
        yield Parameter(
            "damping.zeta", self.damping_zeta, "",
            "Damping ratio of the fundamental mode, by damping in proportion to mass", 0.0, 10.0,
            tunable=True,
        )  # fmt: skip
        yield Parameter(
            "damping.beta", self.damping_beta, "s",
            "Damping in proportion to the rate of every spring, as a time constant", 0.0, 1e-2,
            1e-5, tunable=True,
        )  # fmt: skip
        tuned: tuple[Part, ...] = (*self.frictions, *self.stops)
        for part in tuned:
            yield from _fields(part)

    def model(self, kind: FlexureType) -> FlexureModel:
        """Return the flexure model of a type."""
        return replace(MODELS[kind.model], links=kind.n)

    def values(self, changes: Mapping[str, float] | None = None) -> dict[str, float]:
        """Return all parameter values, defaults replaced by the given changes.

        Raises
        ------
        ParameterError
            If a name is unknown or a value out of bounds.
        """
        parameters = {p.name: p for p in self.parameters}
        result = {p.name: p.value for p in parameters.values()}
        for name, value in (changes or {}).items():
            if name not in parameters:
                raise ParameterError(unknown(name, parameters))
            result[name] = parameters[name].check(value)
        for part in self._parts():
            for name, meta in FIELDS[type(part)].items():
                quantity = getattr(part, name)
                if isinstance(quantity, str):  # bounds hold for expressions too
                    Parameter(f"{part.name}.{name}", affine(quantity)(result), *meta)
        return result

    def _parts(self) -> tuple[Part, ...]:
        """Return the parts whose fields are parameters or expressions."""
        parts: tuple[Part, ...] = (*self.flexure_types, *self.bodies, *self.frictions)
        return (*parts, *self.stops, self.release)

    # -- checks --

    def _check_names(self) -> None:
        seen = set(RESERVED)
        own = [f.name for f in self.flexures if f.type != f.name]  # else both have one section
        parts: tuple[Part, ...] = (*self.bodies, *self.flexure_types, *self.joints, *self.stops)
        parts = (*parts, *self.frictions, *self.forces, *self.probes)
        for name in (*(part.name for part in parts), *own):
            if name in seen:
                raise MechanismError(
                    f"the name {name!r} is used twice or reserved: give each part its own"
                )
            seen.add(name)
        names = [p.name for p in self.parameters]
        for name in names:
            if names.count(name) > 1:
                raise MechanismError(f"the parameter {name!r} is defined twice")

    def _check_references(self) -> None:
        if not self.bodies or not self.flexures:
            raise MechanismError(f"{self.name} needs at least one body and one flexure")
        for kind in self.flexure_types:
            self._check_type(kind)
        for flexure in self.flexures:
            self._check_flexure(flexure)
        for joint in self.joints:
            self._check_connection("joint", joint)
        bodies = [body.name for body in self.bodies]
        attached: tuple[Stop | Friction | Force, ...] = (*self.stops, *self.frictions, *self.forces)
        for part in attached:
            if part.body not in bodies:
                raise MechanismError(f"{part.name}.body = {part.body!r} is not described")
        for stop in self.stops:
            if stop.on not in (GROUND, *bodies):
                raise MechanismError(f"{stop.name}.on = {stop.on!r} is not described")
            if stop.on == stop.body:
                raise MechanismError(f"the stop {stop.name} is fixed to the body that it stops")
        for probe in self.probes:
            self.point(probe.point, probe.name)
        directed: tuple[Stop | Friction | Release, ...] = (*self.stops, *self.frictions)
        for one in (*directed, self.release):
            if not math.isfinite(one.direction):
                raise MechanismError(f"{one.name}.direction = {one.direction} must be an angle")
        if self.release.body not in bodies:
            raise MechanismError(f"release.body = {self.release.body!r} is not described")

    def _check_type(self, kind: FlexureType) -> None:
        if kind.model not in MODELS:
            raise MechanismError(
                f"{kind.name}.model = {kind.model!r} is unknown: choose one of {', '.join(MODELS)}"
            )
        chain = not MODELS[kind.model].gamma
        if chain and not 1 <= kind.n <= MOST_LINKS:
            raise MechanismError(
                f"{kind.name}.n = {kind.n} must be the number of links of the chain, from 1 to "
                f"{MOST_LINKS}"
            )
        if kind.n and not chain:
            raise MechanismError(
                f"{kind.name}.n = {kind.n}: the {kind.model} model has its own number of links; "
                'leave n out, or choose model = "nR"'
            )
        known = {c.name for c in self.model(kind).coefficients}
        for name in kind.coefficients:
            if name not in known:
                raise MechanismError(
                    f"{kind.name}.{name} is no coefficient of the {kind.model} model, which has "
                    f"{', '.join(sorted(known)) or 'none'}"
                )

    def _check_flexure(self, flexure: Flexure) -> None:
        kind = next((k for k in self.flexure_types if k.name == flexure.type), None)
        if kind is None:
            raise MechanismError(f"{flexure.name}.type = {flexure.type!r} is not described")
        self._check_connection("flexure", flexure)
        ends = flexure.ends
        if len(ends) != 2 or any(end not in ENDS for end in ends):
            raise MechanismError(
                f"{flexure.name}.ends = {ends!r}: each of the two ends is one of {', '.join(ENDS)}"
            )
        if FREE in ends and CLAMP not in ends:
            raise MechanismError(
                f"{flexure.name}.ends = {ends!r}: a free end needs a clamp at the other"
            )
        if kind.axial and FREE in ends and len(MODELS[kind.model].gamma) == 1:
            raise MechanismError(
                f"{flexure.name} has one link, which its free end fixes to the body: it cannot "
                f"stretch; choose another model than {kind.model}, or axial = false"
            )

    def _check_connection(self, what: str, part: Flexure | Joint) -> None:
        for end in (part.start, part.end):
            self.point(end, part.name)
        if body_of(part.start) == body_of(part.end):
            raise MechanismError(f"{what} {part.name} joins {body_of(part.start)} to itself")

    def point(self, reference: str, user: str) -> Point:
        """Return the drawn point that ``body.point`` names.

        Raises
        ------
        MechanismError
            If there is none.
        """
        owner, _, name = reference.rpartition(".")
        points = {GROUND: self.ground} | {b.name: b.points for b in self.bodies}
        if owner not in points or name not in points[owner]:
            every = [f"{o}.{p}" for o, named in points.items() for p in named]
            raise MechanismError(
                f"{user} refers to the point {reference!r}, which is not described; points are "
                f"{', '.join(every)}"
            )
        return points[owner][name]

    def _quantities(self) -> Iterator[tuple[str, Quantity]]:
        for name, point in self.ground.items():
            yield from ((f"{GROUND}.{name}", c) for c in point)
        for body in self.bodies:
            yield from ((f"{body.name}.centre", c) for c in body.centre)
            for name, point in body.points.items():
                yield from ((f"{body.name}.{name}", c) for c in point)
        points: tuple[Stop | Friction | Force, ...] = (*self.stops, *self.frictions, *self.forces)
        for part in points:
            yield from ((f"{part.name}.point", c) for c in part.point or ())
        for kind in self.flexure_types:
            yield from ((f"{kind.name}.{n}", c) for n, c in kind.coefficients.items())
        for one in self._parts():
            yield from ((f"{one.name}.{f}", getattr(one, f)) for f in FIELDS[type(one)])


def _fields(part: Part) -> Iterator[Parameter]:
    """Yield the parameters that a part's numbers are."""
    for name, meta in FIELDS[type(part)].items():
        quantity = getattr(part, name)
        if not isinstance(quantity, str):
            yield Parameter(f"{part.name}.{name}", quantity, *meta)


def value(part: Part, name: str, values: Mapping[str, float]) -> float:
    """Return a field of a part: the parameter ``part.field``, or the expression that it is."""
    quantity = getattr(part, name)
    if isinstance(quantity, str):
        return affine(quantity)(values)
    return values[f"{part.name}.{name}"]


def body_of(reference: str) -> str:
    """Return the body that ``body.point`` belongs to."""
    return reference.rpartition(".")[0]


def unknown(name: str, known: Mapping[str, object]) -> str:
    """Return a sentence about an unknown name that proposes the nearest ones."""
    return f"there is no variable {name!r}; {proposal(name, known)}"


def proposal(name: str, known: Mapping[str, object]) -> str:
    """Return the known names that are nearest to a name, or all, as half a sentence."""
    import difflib

    near = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    return f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(known)}"
