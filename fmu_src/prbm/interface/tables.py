"""The tables of a mechanism, as the C kernel reads them from ``resources/mechanism.bin``.

Numbers are little-endian.  A text is its length, its bytes in UTF-8 and a zero byte.  An expression
is its constant, the number of its terms, and a parameter index and a factor for each term.  Bodies
are counted from 1; 0 is the ground.  Every value of a simulation has an index, its slot, in one
vector of all values, see :func:`slots`.
"""

import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from ..base.errors import MechanismError
from ..mechanics.assembly import assemble
from ..mechanics.inputs import input_names
from ..mechanics.stress import stressed
from ..mechanism.description import Mechanism
from ..mechanism.expressions import Affine, Quantity, affine
from ..mechanism.fields import FIELDS, fields_of
from ..mechanism.flexure import ENDS, PROFILES
from ..mechanism.parts import (
    GROUND,
    POSITIONS,
    VELOCITIES,
    Flexure,
    FlexureType,
    Force,
    Friction,
    Guide,
    Joint,
    Part,
    Point,
    Release,
    Spring,
    body_of,
    field_of,
)
from .native import counter_of, state_derivatives
from .variables import (
    BASE_OUTPUTS,
    BODY_OUTPUTS,
    CLOCK,
    COMPLIANT_OUTPUTS,
    ENERGIES,
    INDICATORS,
    LATCHED,
    PEAK_OUTPUTS,
    PROBE_OUTPUTS,
    SPRING_OUTPUTS,
    STOP_OUTPUTS,
    STRESS_OUTPUTS,
    Variable,
    guide_outputs,
)

FILE = "mechanism.bin"
MAGIC, VERSION = b"PRBM", 12
HEAD = 16  # Bytes before those that the checksum covers.
DIMENSIONS = (
    "end_thickness", "end_width", "notch_radius", "notch_depth", "waist_length", "curvature",
    "rise", "initial_strain",
)  # fmt: skip
"""Fields of a flexure type that are not always given, in the order of its fields."""
AT_START = (*POSITIONS, *VELOCITIES)
"""Fields of a body that are not always given, in the order of its fields."""
STARTS = ("displacement", "angle", "amplitude")  # The starts of a release.
TYPES = {"Real": 0, "Integer": 1, "Boolean": 2, CLOCK: 3}
COORDINATES_MAX = 512  # The mass matrix then has 2 MB.
DIRECTIONS_MAX = 1024  # The mass matrix of the directions then has 16 MB.
DIRECTION_MAP_MAX = 16384  # Changes of directions with coordinates.
STOPS_MAX = 64  # Largest number of stops, and of friction points and guides with friction.
PLACES_MAX = 1024  # Largest number of forces, of probes, of springs, and of guides.
GROUND_POINTS_MAX = 4096  # The kernel computes the distance of every pair of points.
GROUND_NUMBER = 0  # Bodies are counted from 1.
SLOT_GROUPS = (
    "parameters", "inputs", "bodies", "stops", "springs", "guides", "base", "energies", "latched",
    "compliant", "links", "stretches", "probes", "stresses", "frequency", "calculated",
    "derivatives", "indicators", "time",
)  # fmt: skip
"""The groups of values in the order of the vector of all values."""
FIXED_NAMES = ("gravity.x", "gravity.y", "solver.tolerance", "damping.zeta", "damping.beta")


def tables(
    mechanism: Mechanism,
    variables: Iterable[Variable],
    token: str,
    independent: Sequence[int],
    step: float = 0.0,
) -> bytes:
    """Return the tables of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism to export.
    variables : iterable of Variable
        The variables of the FMU, whose start values replace those of the mechanism.
    token : str
        The guid or instantiation token of the model description.
    independent : sequence of int
        Indices of the independent coordinates, whose values and rates are states in model exchange.
    step : float
        Communication step of the default experiment [s]; 0: not known.

    Raises
    ------
    MechanismError
        If the mechanism has more parts than the C kernel supports.
    """
    check_size(mechanism)
    listed = tuple(variables)
    body = b"".join(_Writer(mechanism, listed, independent).parts(token, step))
    size = struct.pack("<I", HEAD + len(body))
    return MAGIC + _u32(VERSION) + size + _u32(zlib.crc32(body)) + body


def check_size(mechanism: Mechanism) -> None:
    """Check the numbers of parts of a mechanism against the limits of the C kernel.

    Raises
    ------
    MechanismError
        If a number is above its limit.
    """
    m, system = mechanism, assemble(mechanism, mechanism.values())
    for parts, count, limit in (
        ("coordinates", system.n, COORDINATES_MAX),
        ("directions of links, nodes and bodies", system.d, DIRECTIONS_MAX),
        (
            "changes of directions with coordinates",
            np.count_nonzero(system.Phi.Phi),
            DIRECTION_MAP_MAX,
        ),
        ("springs", len(m.springs), PLACES_MAX),
        ("guides", len(m.guides), PLACES_MAX),
        ("stops", len(m.stops), STOPS_MAX),
        ("frictions", len(m.rubbing), STOPS_MAX),
        ("forces", len(m.forces), PLACES_MAX),
        ("probes", len(m.probes), PLACES_MAX),
        ("points of the ground", len(m.ground), GROUND_POINTS_MAX),
    ):
        if count > limit:
            raise MechanismError(
                f"{m.name} has {count} {parts}; a native FMU supports at most {limit}"
            )


def slots(mechanism: Mechanism, independent: Sequence[int]) -> dict[str, int]:
    """Return the slot of every value: its index in the vector of all values, by name."""
    groups = slot_groups(mechanism, independent)
    return {name: k for k, name in enumerate(name for names in groups.values() for name in names)}


def slot_groups(mechanism: Mechanism, independent: Sequence[int]) -> dict[str, tuple[str, ...]]:
    """Return the names of the values of each group, in the order of their slots."""
    groups = _groups(mechanism, independent)
    return {group: tuple(groups[group]) for group in SLOT_GROUPS}


def _groups(mechanism: Mechanism, independent: Sequence[int]) -> dict[str, Iterable[str]]:
    """Return the names of the values in each group."""
    stops = [stop.name for stop in mechanism.stops]
    system = assemble(mechanism, mechanism.values())
    coordinates = system.variables
    links, stretches = (
        [name for j in group for name in coordinates[j]] for group in (system.links, system.strains)
    )
    several = [k.name for k in mechanism.flexure_types if len(mechanism.model(k).gamma) > 1]
    return {
        "parameters": [p.name for p in mechanism.parameters],
        "inputs": input_names(mechanism),
        "bodies": [f"{body.name}.{output}" for body in mechanism.bodies for output in BODY_OUTPUTS],
        "stops": [f"{stop}.{output}" for stop in stops for output in STOP_OUTPUTS],
        "springs": [f"{s.name}.{output}" for s in mechanism.springs for output in SPRING_OUTPUTS],
        "guides": [f"{g.name}.{output}" for g in mechanism.guides for output in guide_outputs(g)],
        "base": BASE_OUTPUTS,
        "energies": ENERGIES,
        "latched": [f"{stop}.{output}" for stop in stops for output in LATCHED],
        "compliant": [
            f"{stop.name}.{output}"
            for stop in mechanism.stops
            if stop.compliant
            for output in COMPLIANT_OUTPUTS
        ],
        "links": links,
        "stretches": stretches,
        "probes": [f"{p.name}.{output}" for p in mechanism.probes for output in PROBE_OUTPUTS],
        "stresses": [
            f"{mechanism.flexures[i].name}.{output}"
            for i in stressed(mechanism)
            for output in (*STRESS_OUTPUTS, *PEAK_OUTPUTS)
        ],
        "frequency": ["mode.frequency"],
        "calculated": [f"{name}.gamma0" for name in several],
        "derivatives": state_derivatives(mechanism, coordinates, independent),
        "indicators": [
            *(f"{stop}.{kind}_indicator" for stop in stops for kind in INDICATORS),
            *(f"{part.name}.slip_indicator" for part in mechanism.rubbing),
            *(f"{g.name}.side_indicator" for g in mechanism.guides if g.friction is not None),
            *(f"{spring.name}.action_indicator" for spring in mechanism.springs if spring.side),
        ],
        "time": ["time"],
    }


def _given(part: Part, name: str) -> Quantity:
    """Return a field that is given, or the expression of its default."""
    quantity = field_of(part, name)
    assert quantity is not None
    return quantity


def _u32(*numbers: int) -> bytes:
    return struct.pack(f"<{len(numbers)}I", *numbers)


def _f64(*numbers: float) -> bytes:
    return struct.pack(f"<{len(numbers)}d", *numbers)


def _text(text: str) -> bytes:
    content = text.replace("\0", " ").encode()
    return _u32(len(content)) + content + b"\0"


class _Writer:
    """Writer of the tables of one mechanism, in the order in which the kernel reads them."""

    def __init__(
        self, mechanism: Mechanism, variables: Sequence[Variable], independent: Sequence[int]
    ) -> None:
        self.mechanism = mechanism
        self.variables = sorted(variables, key=lambda v: v.reference)
        self.independent = independent
        self.starts = {v.name: v.start for v in variables}
        self.parameters = {p.name: i for i, p in enumerate(mechanism.parameters)}
        self.inputs = input_names(mechanism)
        self.body = {b.name: i for i, b in enumerate(mechanism.bodies, start=1)}
        self.body[GROUND] = GROUND_NUMBER
        self.type = {kind.name: i for i, kind in enumerate(mechanism.flexure_types)}
        self.bounds = [*self._bounds()]

    def parts(self, token: str, step: float) -> Iterator[bytes]:
        """Yield everything after the head."""
        m = self.mechanism
        yield _text(token) + _text(m.name)
        yield _u32(*self._counts())
        for p in m.parameters:
            yield _text(p.name) + _text(p.unit)
            yield _f64(self._start(p.name, p.value), p.minimum, p.maximum) + _u32(p.tunable)
        yield _u32(*(self.parameters[name] for name in FIXED_NAMES))
        yield _f64(step)
        for name in self.inputs:
            yield _text(name) + _f64(self._start(name, 0.0))
        yield from self._members()
        yield from self._contacts()
        yield from self._release(m.release)
        yield from map(self._point, m.ground.values())
        yield from self.bounds
        yield _u32(*self.independent)
        yield from self._variables()

    def _members(self) -> Iterator[bytes]:
        """Yield bodies, types of flexures, flexures, joints, springs and guides."""
        m = self.mechanism
        for body in m.bodies:
            given = sum(1 << i for i, n in enumerate(AT_START) if getattr(body, n) is not None)
            yield _text(body.name) + _u32(given) + self._fields(body) + self._point(body.centre)
        for kind in m.flexure_types:
            yield self._type(kind)
        for flexure in m.flexures:
            yield _text(flexure.name) + _u32(self.type[flexure.type]) + self._between(flexure)
            yield _u32(*map(ENDS.index, flexure.ends))
        for joint in m.joints:
            yield _text(joint.name) + self._between(joint)
            flags = (getattr(joint, name) is not None for name in FIELDS[Joint])
            yield _u32(*flags) + self._fields(joint)
        for spring in m.springs:
            yield _text(spring.name) + self._between(spring)
            yield _u32(spring.free_length is not None, 1 + spring.side) + self._fields(spring)
        for guide in m.guides:
            yield _text(guide.name) + self._between(guide, "point", "start")
            yield self._point(m.point(guide.end, guide.name)) + _u32(not guide.turning)
            yield _u32(guide.friction is not None) + self._fields(guide)

    def _contacts(self) -> Iterator[bytes]:
        """Yield stops, friction points, forces and probes."""
        m = self.mechanism
        for stop in m.stops:
            yield _text(stop.name) + _u32(self.body[stop.body], self.body[stop.on])
            yield self._point(stop.point) + _f64(stop.direction)
            yield _u32(stop.compliant) + self._fields(stop)
        for friction in m.frictions:
            yield self._placed(friction) + _f64(friction.direction) + self._fields(friction)
        for force in m.forces:
            yield self._placed(force)
        for probe in m.probes:
            point = self._point(m.point(probe.point, probe.name))
            yield _text(probe.name) + _u32(self.body[body_of(probe.point)]) + point

    def _release(self, release: Release) -> Iterator[bytes]:
        """Yield the release: body, direction, point, the kind of its start, mode and fields."""
        body = self.mechanism.bodies[self.body[release.body] - 1]
        yield _u32(self.body[release.body]) + _f64(release.direction)
        yield self._point(body.centre if release.point is None else release.point)
        yield _u32(STARTS.index(release.start), release.mode or 0) + self._fields(release)

    def _counts(self) -> tuple[int, ...]:
        m = self.mechanism
        parts: tuple[Mapping[str, object] | Sequence[object], ...] = (
            self.parameters, m.bodies, m.flexure_types, m.flexures, m.joints, m.springs, m.guides,
            m.stops, m.frictions, m.forces, m.probes, m.ground, self.bounds, self.variables,
            self.independent, self.inputs,
        )  # fmt: skip
        return tuple(map(len, parts))

    def _start(self, name: str, default: float) -> float:
        start = self.starts.get(name)
        return default if start is None else float(start)

    def _variables(self) -> Iterator[bytes]:
        slot = slots(self.mechanism, self.independent)
        for v in self.variables:
            place = slot[counter_of(v.name) if v.type == CLOCK else v.name]
            yield _u32(v.reference, TYPES[v.type], place) + _text(v.name)

    # -- values --

    def _expression(self, expression: Affine) -> bytes:
        terms = (
            _u32(self.parameters[name]) + _f64(factor) for name, factor in expression.terms.items()
        )
        return _f64(expression.constant) + _u32(len(expression.terms)) + b"".join(terms)

    def _field(self, name: str, quantity: Quantity) -> bytes:
        """Return the expression of a part's field, which is a parameter or an expression."""
        parameter = Affine(0.0, {name: 1.0})
        return self._expression(affine(quantity) if isinstance(quantity, str) else parameter)

    def _fields(self, part: Part) -> bytes:
        names = fields_of(part)
        return b"".join(self._field(f"{part.name}.{n}", _given(part, n)) for n in names)

    def _point(self, point: Point) -> bytes:
        return b"".join(self._expression(affine(coordinate)) for coordinate in point)

    # -- parts --

    def _type(self, kind: FlexureType) -> bytes:
        model = self.mechanism.model(kind)
        coefficients = (
            self._field(f"{kind.name}.{c.name}", kind.coefficients.get(c.name, c.value))
            for c in model.coefficients
        )
        flags = _u32(model.lumped, model.rate_with_gamma, kind.axial, kind.stress)
        numbers = flags + _u32(len(model.gamma), model.links, model.order, model.nodes)
        given = sum(1 << i for i, n in enumerate(DIMENSIONS) if field_of(kind, n) is not None)
        numbers += _u32(PROFILES.index(kind.profile), given)
        return _text(kind.name) + numbers + self._fields(kind) + b"".join(coefficients)

    def _between(self, part: Flexure | Joint | Spring | Guide, *keys: str) -> bytes:
        """Return two points of a part with their bodies; the default are its ends."""
        return b"".join(
            _u32(self.body[body_of(end)]) + self._point(self.mechanism.point(end, part.name))
            for end in (getattr(part, key) for key in keys or ("start", "end"))
        )

    def _placed(self, part: Friction | Force) -> bytes:
        """Return the name, body and point of a part; the default point is the centre of mass."""
        body = self.mechanism.bodies[self.body[part.body] - 1]
        point = self._point(body.centre if part.point is None else part.point)
        return _text(part.name) + _u32(self.body[part.body]) + point

    def _bounds(self) -> Iterator[bytes]:
        """Yield the bounds of the fields that are expressions."""
        m = self.mechanism
        parts: tuple[Part, ...] = (*m.flexure_types, *m.bodies, *m.joints, *m.springs)
        parts = (*parts, *m.guides)
        for part in (*parts, *m.frictions, *m.stops, m.release):
            for name, (unit, _, minimum, maximum, *_) in fields_of(part).items():
                quantity = _given(part, name)
                if isinstance(quantity, str):
                    head = _text(f"{part.name}.{name}") + _text(unit)
                    yield head + self._field(name, quantity) + _f64(minimum, maximum)
