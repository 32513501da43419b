"""A planar compliant mechanism as frozen data, checked for consistency.

All points are given in global coordinates of the straight, unloaded shape, as drawn.  A number in a
part becomes a parameter ``part.field``.  A text is an expression that is affine in parameters::

    Body("shuttle", mass=0.05, ..., points={"right": ("shuttle.width", "flexure.length")})

Simulations, FMUs and pictures are made from the same data.  This package is independent of files
and of FMI.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from keyword import iskeyword

from ..base.errors import MechanismError, ParameterError
from ..base.names import proposal, unknown
from ..base.tolerances import TOLERANCE_MAX, TOLERANCE_MIN, TOLERANCE_USED_MAX
from .expressions import Quantity, affine
from .fields import fields_of
from .flexure import (
    BEAM,
    CHAIN,
    CLAMP,
    ENDS,
    FILLET_NODES,
    FREE,
    HINGE_ORDER_DEFAULT,
    LEAF,
    LINKS_MAX,
    LOCKING_ORDER_MAX,
    MODELS,
    NODES_EXTRA,
    NODES_EXTRA_MIN,
    NODES_MAX,
    NOTCH,
    NOTCH_NODES,
    ORDER_DEFAULT,
    ORDER_MAX,
    PROFILES,
    TAPER,
    THICK_NODES,
    FlexureModel,
)
from .parameters import Parameter, Tolerance, by_name
from .parts import (
    GROUND,
    LAWS,
    MODE_MAX,
    Body,
    Flexure,
    FlexureType,
    Force,
    Friction,
    GroundPart,
    Guide,
    Joint,
    Part,
    Point,
    Probe,
    Release,
    Spring,
    Stop,
    body_of,
    field_of,
)

DIMENSIONS = {
    LEAF: ("curvature", "rise"),
    TAPER: ("end_thickness", "end_width", "curvature", "rise"),
    NOTCH: ("end_thickness", "notch_radius", "notch_depth", "waist_length"),
}
"""Fields of the profiles of beams.  A notch is straight."""
RESERVED = (GROUND, "base", "damping", "energy", "gravity", "link", "mode", "release", "solver")

DEVICE = re.compile(r"con|prn|aux|nul|(com|lpt)\d", re.ASCII | re.IGNORECASE)  # On Windows.


@dataclass(frozen=True, repr=False)
class Mechanism:
    """Description of a mechanism: parts, parameters and their defaults.

    Parameters
    ----------
    name, title, description : str
        Identifier of the FMU, title of one line, description of a paragraph.
    ground : mapping
        Fixed points, by name [m].
    bodies, flexure_types, flexures, joints, springs, guides, stops, frictions, forces, probes
        Parts of each kind, as tuples.
    release : Release
        Start of the motion.
    geometry : tuple of Parameter
        Parameters that points and other quantities refer to.
    gravity : pair of float
        Default acceleration of gravity along x and y [m/s^2].
    damping_zeta, damping_beta : float
        Default damping ratio of the fundamental mode [-], and time constant of damping in
        proportion to stiffness [s].
    drawing : str
        Drawing of the mechanism in characters.
    tolerances : mapping
        Tolerances of parameters by name, which studies draw values from.
    ground_parts : tuple of GroundPart
        Fixed parts that are drawn; no result depends on them.
    states : tuple of str
        Coordinates that are states in model exchange, for instance ``crank.angle``, before others.

    Raises
    ------
    MechanismError
        If a name is used twice, a reference is undefined, or a part is inconsistent.
    ParameterError
        If a default is outside its bounds.
    """

    name: str
    title: str
    ground: Mapping[str, Point]
    bodies: tuple[Body, ...]
    flexure_types: tuple[FlexureType, ...]
    flexures: tuple[Flexure, ...]
    release: Release
    joints: tuple[Joint, ...] = ()
    springs: tuple[Spring, ...] = ()
    guides: tuple[Guide, ...] = ()
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
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict)
    ground_parts: tuple[GroundPart, ...] = ()
    states: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<Mechanism {self.name}: {self.title}>"

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[A-Za-z_]\w*", self.name, re.ASCII) or iskeyword(self.name):
            raise MechanismError(
                f"mechanism name {self.name!r}: use letters a to z, digits and _, not starting "
                "with a digit, and no keyword of Python (it becomes a file name and an identifier)"
            )
        if DEVICE.fullmatch(self.name):
            raise MechanismError(
                f"mechanism name {self.name!r}: Windows has a device of this name, and no file can "
                "have it; choose another"
            )
        if len(self.gravity) != 2:
            raise MechanismError(f"gravity = {self.gravity!r} must have an x and a y component")
        if not isinstance(self.states, tuple) or not all(isinstance(x, str) for x in self.states):
            raise MechanismError(
                f'states = {self.states!r} must be coordinates as texts, such as ("crank.angle",)'
            )
        self._check_references()
        if self.damping_zeta and self.free_bodies:
            raise MechanismError(
                f"damping_zeta = {self.damping_zeta:g}: damping in proportion to mass would slow "
                f"the flight of {', '.join(self.free_bodies)}, which no flexures, joints, "
                "springs or guides connect to the ground; use damping_beta, or connect them"
            )
        self._check_names()
        known = {p.name: p for p in self.parameters}
        given = dict(self._quantities())
        for where, quantity in self._quantities():
            for name in affine(quantity).terms:
                if name not in known and name in given:
                    raise MechanismError(
                        f"{where} refers to {name!r}, which is an expression, not a parameter: "
                        "write out the expression"
                    )
                if name not in known:
                    raise MechanismError(
                        f"{where} refers to {name!r}, which is not a parameter of {self.name}; "
                        f"{proposal(name, known)}"
                    )

    # -- parameters --

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, in the order of the FMU interface."""
        return tuple(self._parameters())

    def _parameters(self) -> Iterator[Parameter]:
        """Yield all parameters."""
        yield from self.geometry
        for kind in self.flexure_types:
            yield from _fields(kind)
            for c in self.model(kind).coefficients:
                value = kind.coefficients.get(c.name, c.value)
                if not isinstance(value, str):
                    yield Parameter(
                        f"{kind.name}.{c.name}", value, "", c.description, c.minimum, c.maximum
                    )
        jointed: tuple[Part, ...] = (*self.bodies, *self.joints, *self.springs)
        for part in jointed:
            yield from _fields(part)
        for axis, g in zip("xy", self.gravity, strict=True):
            yield Parameter(
                f"gravity.{axis}", g, "m/s2", f"Acceleration of gravity along {axis}",
                -1e6, 1e6, 10.0,
            )  # fmt: skip
        yield from _fields(self.release)
        yield Parameter(
            "solver.tolerance", 1e-8, "",
            "Relative tolerance of the integration, unless the importer gives one; "
            f"at most {TOLERANCE_USED_MAX:g} is used",
            TOLERANCE_MIN, TOLERANCE_MAX, 1e-8,
        )  # fmt: skip
        yield Parameter(
            "damping.zeta", self.damping_zeta, "",
            "Damping ratio of the fundamental mode, from mass-proportional damping; 0 with bodies "
            "that fly freely" if self.free_bodies else
            "Damping ratio of the fundamental mode, from mass-proportional damping",
            0.0, 0.0 if self.free_bodies else 10.0, tunable=True,
        )  # fmt: skip
        yield Parameter(
            "damping.beta", self.damping_beta, "s",
            "Time constant of damping in proportion to the stiffness of flexures and torsion",
            0.0, 1e-2, 1e-5, tunable=True,
        )  # fmt: skip
        tuned: tuple[Part, ...] = (*self.frictions, *self.guides, *self.stops)
        for part in tuned:
            yield from _fields(part)

    def type_of(self, flexure: Flexure) -> FlexureType:
        """Return the type of a flexure of the mechanism."""
        return next(kind for kind in self.flexure_types if kind.name == flexure.type)

    def model(self, kind: FlexureType) -> FlexureModel:
        """Return the flexure model of a type."""
        if kind.model != BEAM:
            return replace(MODELS[kind.model], links=kind.n)
        order = HINGE_ORDER_DEFAULT if kind.hinge else ORDER_DEFAULT
        order = order if kind.order is None else kind.order
        nodes = max(order + NODES_EXTRA, NOTCH_NODES if kind.hinge else 0)
        return replace(MODELS[BEAM], order=order, nodes=nodes if kind.nodes is None else kind.nodes)

    def node_count(self, kind: FlexureType) -> int:
        """Return the number of nodes in all panels of a beam: the thick parts and fillets, too."""
        nodes = self.model(kind).nodes
        if kind.profile != NOTCH:
            return nodes
        return nodes + 2 * THICK_NODES + (0 if kind.hinge else 2 * FILLET_NODES)

    def values(self, changes: Mapping[str, float] | None = None) -> dict[str, float]:
        """Return the values of all parameters: the defaults, or the given changes.

        Raises
        ------
        ParameterError
            If a name is unknown, or a value or an expression is out of bounds.
        """
        parameters = {p.name: p for p in self.parameters}
        result = {p.name: p.value for p in parameters.values()}
        for name, value in by_name("changes", changes).items():
            if name not in parameters:
                raise ParameterError(unknown(name, parameters))
            result[name] = parameters[name].check(value)
        for part in self._parts():
            for name, meta in fields_of(part).items():
                quantity = field_of(part, name)
                if isinstance(quantity, str):  # reject expressions out of bounds
                    Parameter(f"{part.name}.{name}", affine(quantity)(result), *meta)
        return result

    def _parts(self) -> tuple[Part, ...]:
        """Return the parts whose fields are parameters or expressions."""
        parts: tuple[Part, ...] = (*self.flexure_types, *self.bodies, *self.joints)
        parts = (*parts, *self.springs, *self.guides)
        return (*parts, *self.frictions, *self.stops, self.release)

    @cached_property
    def rubbing(self) -> tuple[Friction | Guide, ...]:
        """The friction points, then the guides with friction: the contacts beside the stops."""
        return (*self.frictions, *(guide for guide in self.guides if guide.friction is not None))

    @cached_property
    def floating_bodies(self) -> tuple[str, ...]:
        """Names of the bodies that no flexures or joints connect to the ground."""
        return self._apart(self._joined())

    @cached_property
    def free_bodies(self) -> tuple[str, ...]:
        """Names of the bodies that no flexures, joints, springs or guides connect to the ground."""
        springs = [(body_of(spring.start), body_of(spring.end)) for spring in self.springs]
        return self._apart([*self._joined(), *springs, *((g.on, g.body) for g in self.guides)])

    def _joined(self) -> list[tuple[str, str]]:
        """Return the bodies that each flexure and joint connects."""
        parts: tuple[Flexure | Joint, ...] = (*self.flexures, *self.joints)
        return [(body_of(part.start), body_of(part.end)) for part in parts]

    def _apart(self, pairs: list[tuple[str, str]]) -> tuple[str, ...]:
        """Return the names of the bodies that connected pairs do not connect to the ground."""
        neighbours: dict[str, list[str]] = {}
        for ends in pairs:
            for one, other in (ends, ends[::-1]):
                neighbours.setdefault(one, []).append(other)
        held, waiting = {GROUND}, [GROUND]
        while waiting:
            found = {*neighbours.get(waiting.pop(), ())} - held
            held |= found
            waiting += found
        return tuple(body.name for body in self.bodies if body.name not in held)

    # -- checks --

    def _check_names(self) -> None:
        """Reject names that are used twice or reserved."""
        seen = set(RESERVED)
        # A flexure may share its name with its type.
        own = [f.name for f in self.flexures if f.type != f.name]
        parts: tuple[Part, ...] = (*self.bodies, *self.flexure_types, *self.joints, *self.stops)
        parts = (*parts, *self.springs, *self.guides)
        parts = (*parts, *self.frictions, *self.forces, *self.probes)
        for name in (*(part.name for part in parts), *own):
            if name in seen:
                raise MechanismError(
                    f"the name {name!r} is used twice or reserved: give each part its own name"
                )
            seen.add(name)
        defined: set[str] = set()
        for parameter in self.parameters:
            if parameter.name in defined:
                raise MechanismError(
                    f"the parameter {parameter.name!r} is defined twice: rename one"
                )
            defined.add(parameter.name)
        for name in self.tolerances.keys() - defined:
            raise MechanismError(f"tolerances.{name}: {unknown(name, dict.fromkeys(defined))}")

    def _check_references(self) -> None:
        """Reject undefined references and inconsistent parts."""
        if not self.bodies:
            raise MechanismError(f"{self.name} needs at least one body")
        for kind in self.flexure_types:
            self._check_type(kind)
        types = {kind.name: kind for kind in self.flexure_types}
        for flexure in self.flexures:
            self._check_flexure(flexure, types)
        for joint in self.joints:
            self._check_connection("joint", joint)
        for spring in self.springs:
            self._check_connection("spring", spring)
        for guide in self.guides:
            self._check_guide(guide)
        for probe in self.probes:
            self.point(probe.point, probe.name)
        self._check_attached({body.name: body for body in self.bodies})
        directed: tuple[Stop | Friction | Release, ...] = (*self.stops, *self.frictions)
        for one in (*directed, self.release):
            if not math.isfinite(one.direction):
                raise MechanismError(f"{one.name}.direction = {one.direction} must be finite")

    def _check_attached(self, bodies: Mapping[str, Body]) -> None:
        """Reject stops, friction, forces and a release at undefined bodies."""
        attached: tuple[Stop | Friction | Force, ...] = (*self.stops, *self.frictions, *self.forces)
        for part in attached:
            if part.body not in bodies:
                raise MechanismError(undefined(f"{part.name}.body", part.body, bodies))
        for stop in self.stops:
            _check_law(stop)
            if stop.on != GROUND and stop.on not in bodies:
                raise MechanismError(undefined(f"{stop.name}.on", stop.on, (GROUND, *bodies)))
            if stop.on == stop.body:
                raise MechanismError(
                    f"the stop {stop.name} is fixed to the body that it stops: choose another "
                    f"body for {stop.name}.on"
                )
        if self.release.body not in bodies:
            raise MechanismError(undefined("release.body", self.release.body, bodies))
        _check_release(self.release)

    def _check_type(self, kind: FlexureType) -> None:
        """Reject a flexure type with an unknown model, or with options of another model."""
        if kind.model not in MODELS:
            raise MechanismError(
                f"{kind.name}.model = {kind.model!r} is unknown: choose one of "
                f"{', '.join(MODELS)}, or register it in this process (prbm.register_model)"
            )
        self._check_order(kind)
        _check_profile(kind)
        _check_strain(kind)
        chain = kind.model == CHAIN
        if chain and not 1 <= kind.n <= LINKS_MAX:
            raise MechanismError(
                f"{kind.name}.n = {kind.n} must be the number of links of the chain, from 1 to "
                f"{LINKS_MAX}"
            )
        if kind.n and not chain:
            raise MechanismError(
                f"{kind.name}.n = {kind.n}: the {kind.model} model has a fixed number of links; "
                'remove n, or choose model = "nR"'
            )
        known = {c.name for c in self.model(kind).coefficients}
        for name in kind.coefficients:
            if name not in known:
                listed = f"are {', '.join(sorted(known))}" if known else "cannot be changed"
                raise MechanismError(
                    f"{kind.name}.{name} is not a coefficient of the {kind.model} model; its "
                    f"coefficients {listed}"
                )

    def _check_order(self, kind: FlexureType) -> None:
        """Reject an order or a number of nodes that a model does not have, or out of bounds."""
        if kind.model != BEAM:
            for name in ("order", "nodes"):
                if getattr(kind, name) is not None:
                    raise MechanismError(
                        f"{kind.name}.{name} = {getattr(kind, name)}: only the model beam has it; "
                        f'remove {name}, or choose model = "beam"'
                    )
            return
        model = self.model(kind)
        if not 1 <= model.order <= ORDER_MAX:
            raise MechanismError(
                f"{kind.name}.order = {model.order} must lie between 1 and {ORDER_MAX}; 3, 5 and 7 "
                "are useful"
            )
        least = model.order + NODES_EXTRA_MIN
        if not least <= model.nodes <= NODES_MAX:
            raise MechanismError(
                f"{kind.name}.nodes = {model.nodes} must lie between {least} (the order + "
                f"{NODES_EXTRA_MIN}) and {NODES_MAX}"
            )

    def _check_flexure(self, flexure: Flexure, types: Mapping[str, FlexureType]) -> None:
        """Reject a flexure with an undefined type or point, or with inconsistent ends."""
        kind = types.get(flexure.type)
        if kind is None:
            raise MechanismError(undefined(f"{flexure.name}.type", flexure.type, types))
        self._check_connection("flexure", flexure)
        self._check_ends(flexure, kind)

    def _check_ends(self, flexure: Flexure, kind: FlexureType) -> None:
        """Reject types of ends that are unknown, or that a model does not permit."""
        ends = flexure.ends
        if len(ends) != 2 or any(end not in ENDS for end in ends):
            raise MechanismError(
                f"{flexure.name}.ends = {ends!r}: choose each end among {', '.join(ENDS)}"
            )
        if FREE in ends and CLAMP not in ends:
            raise MechanismError(
                f"{flexure.name}.ends = {ends!r}: a free end needs a clamp at the other end"
            )
        if (
            kind.model == BEAM
            and not (kind.axial or kind.hinge)
            and ends == (CLAMP, CLAMP)
            and self.model(kind).order <= LOCKING_ORDER_MAX
        ):
            raise MechanismError(
                f"{kind.name}.order = {self.model(kind).order}: a beam between two clamps that "
                f"does not stretch is too stiff with an order below {LOCKING_ORDER_MAX + 1}; "
                f"choose order = 3, or axial = true, or the end free if {flexure.name} is a "
                "cantilever"
            )
        if kind.axial and FREE in ends and len(MODELS[kind.model].gamma) == 1:
            raise MechanismError(
                f"{flexure.name} has one link, which its free end fixes to the body, so that it "
                f"cannot stretch; choose another model than {kind.model}, or axial = false"
            )

    def _check_connection(self, kind: str, part: Flexure | Joint | Spring) -> None:
        """Reject a flexure, joint or spring between undefined points, or points of one body."""
        for end in (part.start, part.end):
            self.point(end, part.name)
        if body_of(part.start) == body_of(part.end):
            raise MechanismError(
                f"{kind} {part.name} joins {body_of(part.start)} to itself: choose points of two "
                "bodies"
            )

    def _check_guide(self, guide: Guide) -> None:
        """Reject a guide with undefined points, or with a line that no other body carries."""
        for point in (guide.point, guide.start, guide.end):
            self.point(point, guide.name)
        if guide.on != body_of(guide.end):
            raise MechanismError(
                f"guide {guide.name} has a line from {guide.start} to {guide.end}, which are "
                "points of two bodies: choose two points of one body, or of the ground"
            )
        if guide.body == guide.on:
            raise MechanismError(
                f"guide {guide.name} guides {guide.body} along itself: choose a point of another "
                "body"
            )
        if guide.body == GROUND:
            raise MechanismError(
                f"guide {guide.name} guides a point of the ground: choose a point of {guide.on}, "
                "and a line of the ground"
            )

    def point(self, reference: str, user: str) -> Point:
        """Return the coordinates of the point ``body.point`` as drawn [m].

        Raises
        ------
        MechanismError
            If the point is not defined.
        """
        owner, _, name = reference.rpartition(".")
        points = self._points
        if owner not in points or name not in points[owner]:
            every = [f"{o}.{p}" for o, named in points.items() for p in named]
            raise MechanismError(
                f"{user} refers to the point {reference!r}, which is not defined; points are "
                f"{', '.join(every)}"
            )
        return points[owner][name]

    @cached_property
    def _points(self) -> dict[str, Mapping[str, Point]]:
        """Points of the ground and of the bodies, by owner."""
        return {GROUND: self.ground} | {body.name: body.points for body in self.bodies}

    def _quantities(self) -> Iterator[tuple[str, Quantity]]:
        """Yield the names and values of all coordinates, coefficients and fields of parts."""
        for name, point in self.ground.items():
            yield from ((f"{GROUND}.{name}", c) for c in point)
        for fixed in self.ground_parts:
            rings = (fixed.outline, *fixed.holes)
            yield from (("ground_parts", c) for ring in rings for corner in ring for c in corner)
        for body in self.bodies:
            for name, point in body.points.items():
                yield from ((f"{body.name}.{name}", c) for c in point)
            yield from ((f"{body.name}.outline", c) for corner in body.outline for c in corner)
            for hole in body.holes:
                yield from ((f"{body.name}.holes", c) for corner in hole for c in corner)
            # Last, because the centre of a plate has the parameters of its corners.
            yield from ((f"{body.name}.centre", c) for c in body.centre)
        points: tuple[Stop | Friction | Force | Release, ...] = (*self.stops, *self.frictions)
        for part in (*points, *self.forces, self.release):
            yield from ((f"{part.name}.point", c) for c in part.point or ())
        for kind in self.flexure_types:
            yield from ((f"{kind.name}.{n}", c) for n, c in kind.coefficients.items())
        for one in self._parts():
            given = ((f"{one.name}.{f}", field_of(one, f)) for f in fields_of(one))
            yield from ((name, c) for name, c in given if c is not None)


def undefined(key: str, name: str, known: Iterable[str]) -> str:
    """Return the message for a key whose value is not the name of a known part."""
    remedy = f"choose one of {', '.join(known)}" if known else "define it"
    return f"{key} = {name!r} is not defined; {remedy}"


def _check_law(stop: Stop) -> None:
    """Reject an unknown law of impact, and keys that belong to another law."""
    if stop.law not in LAWS:
        raise MechanismError(f"{stop.name}.law = {stop.law!r}: choose one of {', '.join(LAWS)}")
    if stop.compliant:
        if stop.stiffness is None:
            raise MechanismError(
                f"{stop.name}.stiffness is missing: a compliant stop needs the force over "
                "indentation^exponent; add the key, or remove law"
            )
        return
    for name in ("stiffness", "exponent"):
        if getattr(stop, name) is not None:
            raise MechanismError(
                f"{stop.name}.{name} = {getattr(stop, name)}: a rigid stop has no {name}; remove "
                'it, or choose law = "compliant"'
            )


def _check_strain(kind: FlexureType) -> None:
    """Reject an initial strain of flexures that cannot stretch."""
    if kind.initial_strain is not None and not kind.axial:
        raise MechanismError(
            f"{kind.name}.initial_strain: the flexures cannot stretch; set axial = true, or remove "
            "initial_strain"
        )


def _check_profile(kind: FlexureType) -> None:
    """Reject an unknown profile, and dimensions that it lacks or that belong to another one."""
    if kind.profile not in PROFILES:
        raise MechanismError(
            f"{kind.name}.profile = {kind.profile!r} is unknown: choose one of "
            f"{', '.join(PROFILES)}"
        )
    if kind.model != BEAM:
        given = ["profile"] if kind.profile != LEAF else []
        given += [name for name in _dimensions() if getattr(kind, name) is not None]
        if given:
            raise MechanismError(
                f"{kind.name}.{given[0]}: only the model beam has it; remove {given[0]}, or choose "
                'model = "beam"'
            )
        return
    own = DIMENSIONS[kind.profile]
    for name in _dimensions():
        if getattr(kind, name) is not None and name not in own:
            others = [profile for profile in PROFILES if name in DIMENSIONS[profile]]
            raise MechanismError(
                f"{kind.name}.{name} is not a dimension of the profile {kind.profile}; remove it, "
                f"or choose the profile {' or '.join(others)}"
            )
    if kind.profile == NOTCH and kind.notch_radius is None:
        raise MechanismError(
            f"{kind.name}.notch_radius is missing: add the radius of the notch or its fillets"
        )
    if kind.curvature is not None and kind.rise is not None:
        raise MechanismError(f"{kind.name}.curvature excludes {kind.name}.rise: remove one of them")


def _dimensions() -> list[str]:
    """Return the names of all dimensions of profiles."""
    return list(dict.fromkeys(name for names in DIMENSIONS.values() for name in names))


def _check_release(release: Release) -> None:
    """Reject a release from several shapes, or a mode without an amplitude."""
    starts = [n for n in ("displacement", "angle", "amplitude") if getattr(release, n) is not None]
    if len(starts) > 1:
        raise MechanismError(
            f"release.{starts[1]} excludes release.{starts[0]}: give one of displacement, angle, "
            "and mode with amplitude"
        )
    if (release.mode is None) != (release.amplitude is None):
        given, missing = ("mode", "amplitude") if release.mode else ("amplitude", "mode")
        raise MechanismError(f"release.{given} is given without release.{missing}: add the key")
    if release.mode is not None and not 1 <= release.mode <= MODE_MAX:
        raise MechanismError(
            f"release.mode = {release.mode} must be the number of a mode, from 1 to {MODE_MAX}"
        )


def _fields(part: Part) -> Iterator[Parameter]:
    """Yield the parameters of a part: its fields that are numbers."""
    for name, meta in fields_of(part).items():
        quantity = field_of(part, name)
        if quantity is not None and not isinstance(quantity, str):
            yield Parameter(f"{part.name}.{name}", quantity, *meta)
