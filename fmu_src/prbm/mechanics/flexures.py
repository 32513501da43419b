"""Flexures as links or beams: their coordinates, directions, masses, springs and loops."""

import cmath
from collections.abc import Mapping

import numpy as np

from ..base.errors import ParameterError
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.flexure import PIN, Segments, segments
from ..mechanism.parts import LENGTH_MIN, Flexure, FlexureType, body_of, value
from .arrays import Real
from .beam import Beam
from .collection import ROD_POINTS, Collection
from .free_body import of_beam, of_links
from .system import Place

CURVE_POINTS = 33  # Points of a drawn beam.


def add_flexure(parts: Collection, flexure: Flexure) -> None:
    """Add a flexure of which at least one body has been reached.

    It reaches the body at its other end.  If this body has been reached before, it closes a loop.

    Raises
    ------
    ParameterError
        If the flexure has no length, or its links are longer than the flexure.
    """
    kind = _type_of(parts, flexure)
    if parts.length(flexure) < LENGTH_MIN:
        raise ParameterError(
            f"flexure {flexure.name} from {flexure.start} to {flexure.end} has the length "
            f"{parts.length(flexure):g} m: move its ends apart"
        )
    if parts.mechanism.model(kind).order:
        _add_beam(parts, flexure, _beam(parts, flexure, kind), kind.axial)
    else:
        _add_links(parts, flexure, _segments(parts, flexure, kind))


def _type_of(parts: Collection, flexure: Flexure) -> FlexureType:
    """Return the type of a flexure."""
    return next(k for k in parts.mechanism.flexure_types if k.name == flexure.type)


def _segments(parts: Collection, flexure: Flexure, kind: FlexureType) -> Segments:
    """Return the segments of a flexure, from its start to its end."""
    L = parts.length(flexure)
    EI, EA, mass = _section(parts, kind)
    gamma, K_theta = coefficients(parts.mechanism, kind, parts.values)
    model = parts.mechanism.model(kind)
    return segments(model, gamma, K_theta, flexure.ends, L, EI, mass * L, EA if kind.axial else 0.0)


def _section(parts: Collection, kind: FlexureType) -> tuple[float, float, float]:
    """Return bending stiffness [N m^2], axial stiffness [N] and mass per length [kg/m]."""
    fields = ("thickness", "width", "youngs_modulus", "density")
    h, b, E, rho = (value(kind, name, parts.values) for name in fields)
    return E * b * h**3 / 12, E * b * h, rho * b * h


def _strength(parts: Collection, kind: FlexureType) -> tuple[float, float]:
    """Return area [m^2] and section modulus [m^3]."""
    h, b = (value(kind, name, parts.values) for name in ("thickness", "width"))
    return b * h, b * h**2 / 6


def _add_links(parts: Collection, flexure: Flexure, pieces: Segments) -> None:
    """Add a flexure of rigid segments."""
    start, end = flexure.start, flexure.end
    if body_of(start) not in parts.origin:
        start, end, pieces = end, start, pieces.reversed()
    root, far = body_of(start), body_of(end)
    z_start, z_end = parts.end(flexure, start), parts.end(flexure, end)
    direction = (z_end - z_start) / abs(z_end - z_start)

    place, owner = parts.on(root, z_start), parts.index[root]
    corners = [place]
    links = [
        _add_link(parts, direction, length, axial)
        for length, axial in zip(pieces.lengths[1:-1], pieces.axial, strict=True)
    ]
    known = far in parts.origin
    owners = [owner, *links, parts.index[far] if known else parts.turn(far)]
    first, points = len(parts.masses), _Points(pieces)
    for i, (length, j) in enumerate(zip(pieces.lengths[:-1], owners[:-1], strict=True)):
        # In the drawing the angle of a body is 0, that of a link its direction.
        vector = length * (1.0 if j in links else direction)
        parts.rod(pieces.rods[i], place, j, vector)
        points.rod(i, len(parts.masses) - first)
        place = place.plus(j, vector)
        corners.append(place)
        parts.mass(place, pieces.lumps[i])
        points.lump(i, len(parts.masses) - first)
        parts.spring(pieces.rates[i], parts.angle(owners[i]), parts.angle(owners[i + 1]))
    last = pieces.lengths[-1] * direction
    if known:
        pivot = parts.on(far, z_end - last)
        parts.close(flexure.name, place, pivot)
        place = pivot  # The last stub is part of the far body.
    else:
        parts.reach(far, place, z_end - last, owners[-1])
    parts.rod(pieces.rods[-1], place, owners[-1], last)
    points.rod(len(links) + 1, len(parts.masses) - first)
    angles, kind = [parts.angle(j) for j in owners], _type_of(parts, flexure)
    masses, forwards = slice(first, len(parts.masses)), start == flexure.start
    free = of_links(
        flexure.name, forwards, pieces, direction, _strength(parts, kind), owners, angles, masses,
        points.found,
    )  # fmt: skip
    parts.connect(root, far, known, free)
    corners.append(parts.on(far, z_end))
    parts.lines.append((flexure.name, "flexure", corners))


class _Points:
    """The mass points of a flexure of links, as :func:`prbm.mechanics.free_body.of_links` needs."""

    def __init__(self, pieces: Segments) -> None:
        self.pieces = pieces
        self.found: list[tuple[int, float, float]] = []

    def rod(self, i: int, count: int) -> None:
        """Add the points of segment i if there are then as many as the given number."""
        first, last = self.pieces.lengths[0], self.pieces.lengths[-1]
        for fraction in ROD_POINTS:
            near = first * (fraction if i == 0 else 1.0)
            far = last * (fraction if i == len(self.pieces.lengths) - 1 else 0.0)
            if len(self.found) < count:
                self.found.append((2 * i, near, far))

    def lump(self, i: int, count: int) -> None:
        """Add the point at pivot i if there are then as many as the given number."""
        if len(self.found) < count:
            self.found.append((2 * i + 1, self.pieces.lengths[0], 0.0))


def _add_link(parts: Collection, direction: complex, length: float, axial: float) -> int:
    """Add a link, and its stretch if it has an axial stiffness [N/m]; return its direction."""
    parts.link_count += 1
    owner = f"link[{parts.link_count}]"
    j = parts.direction({parts.angle_of_flexure(owner, cmath.phase(direction)): 1.0})
    if axial > 0.0:
        stretch = parts.coordinate(owner)
        parts.direction({stretch: 1.0}, arm=j)
        parts.spring(axial * length**2, None, stretch)
    return j


def _beam(parts: Collection, flexure: Flexure, kind: FlexureType) -> Beam:
    """Return the beam of a flexure."""
    L, model = parts.length(flexure), parts.mechanism.model(kind)
    EI, EA, mass = _section(parts, kind)
    return Beam(model.order, model.nodes, L, EI, mass * L, EA if kind.axial else 0.0)


def _add_beam(parts: Collection, flexure: Flexure, beam: Beam, axial: bool) -> None:
    """Add a beam: its coordinates, one arm for each node, masses and springs.

    The rotation of a clamped or free end is that of the body there, that of a pinned end is a
    coordinate.  All other coordinates describe the beam from its start to its end, whichever end
    has been reached before.
    """
    bodies = (body_of(flexure.start), body_of(flexure.end))
    pins = [
        parts.angle_of_flexure(f"{flexure.name}.{name}") if end == PIN else None
        for name, end in zip(("start", "end"), flexure.ends, strict=True)
    ]
    bends = [parts.angle_of_flexure(f"{flexure.name}.bend[{k}]") for k in range(1, beam.order + 1)]
    strain = parts.coordinate(flexure.name) if axial else None
    new = next((body for body in bodies if body not in parts.origin), None)
    turned = None if new is None else parts.coordinate(new)
    ends = [
        pin if end == PIN else turned if body == new else parts.angle(parts.index[body])
        for pin, body, end in zip(pins, bodies, flexure.ends, strict=True)
    ]
    arms = [_add_node(parts, [*ends, *bends], turns, strain) for turns in beam.turns]
    reached = None if turned is None else parts.direction({turned: 1.0})
    _place_beam(parts, flexure, beam, arms, reached, (ends, bends))
    rates = beam.rates.tolist()
    parts.spring(rates[0], *ends)
    for j, rate in zip(bends, rates[1:], strict=True):
        parts.spring(rate, None, j)
    if strain is not None:
        parts.spring(beam.axial_rate, None, strain)


def _add_node(
    parts: Collection, coordinates: list[int | None], turns: Real, strain: int | None
) -> int:
    """Add the arm of a node, and its stretch; return its direction."""
    known = zip(coordinates, turns, strict=True)
    arm = parts.direction({j: float(turn) for j, turn in known if j is not None})
    if strain is not None:
        parts.direction({strain: 1.0}, arm=arm)
    return arm


def _place_beam(
    parts: Collection,
    flexure: Flexure,
    beam: Beam,
    arms: list[int],
    turned: int | None,
    coordinates: tuple[list[int | None], list[int]],
) -> None:
    """Place the masses and the far end of a beam.

    Parameters
    ----------
    parts : Collection
        The parts that have been added.
    flexure : Flexure
        The flexure.
    beam : Beam
        The beam.
    arms : list of int
        Directions of the nodes.
    turned : int or None
        Direction of the body that the beam reaches; None: both bodies have been reached before.
    coordinates : pair of lists
        Coordinates of the rotations of its ends (None: the ground), and of its coefficients.
    """
    z_start, z_end = parts.end(flexure, flexure.start), parts.end(flexure, flexure.end)
    direction = (z_end - z_start) / abs(z_end - z_start)
    whole = beam.positions(np.array([1.0]))[0]
    forwards = body_of(flexure.start) in parts.origin
    near, z_near = (flexure.start, z_start) if forwards else (flexure.end, z_end)
    far, z_far = (flexure.end, z_end) if forwards else (flexure.start, z_start)
    root = parts.on(body_of(near), z_near)

    def at(lengths: Real) -> Place:
        place = root
        for arm, length in zip(arms, lengths if forwards else lengths - whole, strict=True):
            place = place.plus(arm, float(length) * direction)
        return place

    masses = slice(len(parts.masses), len(parts.masses) + beam.nodes)
    for mass, lengths in zip(beam.masses, beam.node_positions, strict=True):
        parts.mass(at(lengths), float(mass))
    tip = at(whole if forwards else 0.0 * whole)
    if turned is None:
        parts.close(flexure.name, tip, parts.on(body_of(far), z_far))
    else:
        parts.reach(body_of(far), tip, z_far, turned)
    section = _strength(parts, _type_of(parts, flexure))
    free = of_beam(flexure.name, forwards, beam, direction, section, coordinates, arms, masses)
    parts.connect(body_of(near), body_of(far), turned is None, free)
    curve = beam.positions(np.linspace(-1.0, 1.0, CURVE_POINTS))
    parts.lines.append((flexure.name, "flexure", [at(lengths) for lengths in curve]))


def coefficients(
    mechanism: Mechanism, kind: FlexureType, values: Mapping[str, float]
) -> tuple[list[float], list[float]]:
    """Return the values of a flexure type's gammas and stiffness coefficients [-]."""
    model = mechanism.model(kind)

    def number(name: str) -> float:
        quantity = kind.coefficients.get(name, 0.0)
        if isinstance(quantity, str):
            return affine(quantity)(values)
        return values[f"{kind.name}.{name}"]

    return [number(c.name) for c in model.gamma], [number(c.name) for c in model.K_theta]
