"""Flexures as links or beams: their coordinates, directions, masses, springs and loops."""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import ParameterError
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.flexure import NOTCH, PIN, TAPER, Segments, segments
from ..mechanism.parts import Flexure, FlexureType, body_of, value
from .arrays import Complex, Real
from .beam import Beam, Material
from .collection import ROD_POINTS, Collection
from .free_body import of_beam, of_links
from .places import NO_THICKNESS, Place
from .profile import Line, Notch, Panel, Straight, notch_panels

CURVE_POINTS = 33  # Points of each panel of a drawn beam.


def add_flexure(parts: Collection, flexure: Flexure) -> None:
    """Add a flexure of which at least one body has been reached.

    It reaches the body at its other end.  If this body has been reached before, it closes a loop;
    a beam is then laid from the body nearer to the ground, so that fewer arms move its masses.

    Raises
    ------
    ParameterError
        If the flexure has no length or is as thick as long, its links or its notch are longer than
        the flexure, its notch vanishes, or its ends are impossible for its curvature or rise.
    """
    kind = parts.mechanism.type_of(flexure)
    check_slender(flexure, kind, parts.length(flexure), parts.values)
    if parts.mechanism.model(kind).order:
        _add_beam(parts, flexure, beam_of(parts, flexure, kind), kind)
    else:
        _add_links(parts, flexure, _segments(parts, flexure, kind))


def check_drawn(parts: Collection, flexure: Flexure, kind: FlexureType) -> None:
    """Reject a flexure as :func:`add_flexure`, without adding it."""
    check_slender(flexure, kind, parts.length(flexure), parts.values)
    model = parts.mechanism.model(kind)
    if model.order:
        _panels(parts, flexure, kind, _line(parts, flexure, kind).length, model.nodes)
    else:
        _segments(parts, flexure, kind)


def check_slender(
    flexure: Flexure, kind: FlexureType, length: float, values: Mapping[str, float]
) -> None:
    """Reject a flexure without length, or as thick as long, which is mostly a mistake of units.

    Parameters
    ----------
    flexure, kind : Flexure, FlexureType
        The flexure and its type.
    length : float
        Distance of its ends as drawn [m].
    values : mapping
        Values of all parameters.

    Raises
    ------
    ParameterError
        If the length is zero, or the thickness is not below the length.
    """
    if not length > 0.0:
        raise ParameterError(
            f"flexure {flexure.name} from {flexure.start} to {flexure.end} has the length "
            f"{length:g} m: move its ends apart"
        )
    for name in ("thickness", "end_thickness") if kind.profile == TAPER else ("thickness",):
        thickness = value(kind, name, values)
        if not thickness < length:
            raise ParameterError(
                f"{kind.name}.{name} = {thickness:g} m is not less than the length of the flexure "
                f"{flexure.name}, {length:g} m: check the units of both"
            )


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


def initial_strain(parts: Collection, kind: FlexureType) -> float:
    """Return the strain without a force [-]."""
    return 0.0 if kind.initial_strain is None else value(kind, "initial_strain", parts.values)


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
    kind = parts.mechanism.type_of(flexure)
    strain = initial_strain(parts, kind) * _section(parts, kind)[1]
    links = [
        _add_link(parts, direction, length, axial, strain)
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
    angles = [parts.angle(j) for j in owners]
    masses, forwards = slice(first, len(parts.masses)), start == flexure.start
    free = of_links(
        flexure.name, forwards, pieces, direction, _strength(parts, kind), owners, angles, masses,
        points.found,
    )  # fmt: skip
    parts.connect(root, far, known, free)
    corners.append(parts.on(far, z_end))
    parts.lines.append((flexure.name, "flexure", corners, NO_THICKNESS))


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


def _add_link(
    parts: Collection, direction: complex, length: float, axial: float, blocked: float
) -> int:
    """Add a link, and its stretch if it has an axial stiffness [N/m]; return its direction.

    ``blocked`` is the pressure of the link that is kept at its drawn length [N].
    """
    parts.link_count += 1
    owner = f"link[{parts.link_count}]"
    j = parts.direction({parts.angle_of_flexure(owner, cmath.phase(direction)): 1.0})
    if axial > 0.0:
        stretch = parts.coordinate(owner)
        parts.direction({stretch: 1.0}, arm=j)
        parts.spring(axial * length**2, None, stretch)
        parts.rest[stretch] = blocked / (axial * length)
    return j


def beam_of(parts: Collection, flexure: Flexure, kind: FlexureType) -> Beam:
    """Return the beam of a flexure."""
    model, line = parts.mechanism.model(kind), _line(parts, flexure, kind)
    panels = _panels(parts, flexure, kind, line.length, model.nodes)
    material = Material(*(value(kind, n, parts.values) for n in ("youngs_modulus", "density")))
    return Beam(model.order, panels, line, material)


def _line(parts: Collection, flexure: Flexure, kind: FlexureType) -> Line:
    """Return the line of a beam as drawn."""
    chord = parts.length(flexure)
    if kind.curvature is not None:
        curvature = value(kind, "curvature", parts.values)
        if not abs(curvature) * chord < 2.0:
            raise ParameterError(
                f"flexure {flexure.name}: {kind.name}.curvature = {curvature:g} 1/m is impossible "
                f"for ends at the distance {chord:g} m: choose one below {2.0 / chord:g} 1/m"
            )
        return Line(chord, curvature=curvature)
    if kind.rise is not None:
        rise = value(kind, "rise", parts.values)
        if not abs(rise) < chord:
            raise ParameterError(
                f"flexure {flexure.name}: {kind.name}.rise = {rise:g} m is impossible for ends at "
                f"the distance {chord:g} m: choose a rise below this distance"
            )
        return Line(chord, rise=rise)
    return Line(chord)


def _panels(
    parts: Collection, flexure: Flexure, kind: FlexureType, L: float, nodes: int
) -> Sequence[Panel]:
    """Return the panels of a beam with the length L [m]."""

    def given(name: str) -> float:
        return value(kind, name, parts.values)

    h, b = given("thickness"), given("width")
    if kind.profile == NOTCH:
        axes = given("notch_radius"), given("notch_depth")
        waist = None if kind.hinge else given("waist_length")
        notch = Notch(h, b, axes, given("end_thickness"), waist)
        return notch_panels(flexure.name, notch, L, nodes)
    if kind.profile == TAPER:
        ends = (h, given("end_thickness")), (b, given("end_width"))
        return (Straight(nodes, 0.0, L, *ends),)
    return (Straight(nodes, 0.0, L, (h, h), (b, b)),)


def _add_beam(parts: Collection, flexure: Flexure, beam: Beam, kind: FlexureType) -> None:
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
    strain = parts.coordinate(flexure.name) if kind.axial else None
    new = next((body for body in bodies if body not in parts.origin), None)
    turned = None if new is None else parts.coordinate(new)
    ends = [
        pin if end == PIN else turned if body == new else parts.angle(parts.index[body])
        for pin, body, end in zip(pins, bodies, flexure.ends, strict=True)
    ]
    nodes = zip(beam.turns, beam.strains, strict=True)
    arms = [_add_node(parts, [*ends, *bends], turns, strain, share) for turns, share in nodes]
    reached = None if turned is None else parts.direction({turned: 1.0})
    _place_beam(parts, flexure, beam, arms, reached, (ends, bends), thick=kind.profile == NOTCH)
    rates = beam.rates.tolist()
    parts.spring(rates[0], *ends)
    for j, rate in zip(bends, rates[1:], strict=True):
        parts.spring(rate, None, j)
    if strain is not None:
        parts.spring(beam.axial_rate, None, strain)
        parts.rest[strain] = initial_strain(parts, kind)


def _add_node(
    parts: Collection, coordinates: list[int | None], turns: Real, strain: int | None, share: float
) -> int:
    """Add the arm of a node, and its stretch, share times the strain; return its direction."""
    changes = zip(coordinates, turns, strict=True)
    arm = parts.direction({j: float(turn) for j, turn in changes if j is not None})
    if strain is not None:
        parts.direction({strain: float(share)}, arm=arm)
    return arm


def _place_beam(
    parts: Collection,
    flexure: Flexure,
    beam: Beam,
    arms: list[int],
    turned: int | None,
    coordinates: tuple[list[int | None], list[int]],
    *,
    thick: bool,
) -> None:
    """Place a beam: its masses, its far end, its free body and its curve.

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
    thick : bool
        Whether the sections have rotary inertia.
    """
    near, far = flexure.start, flexure.end
    chord = parts.end(flexure, far) - parts.end(flexure, near)
    bodies = body_of(near), body_of(far)
    start_depth, end_depth = (parts.depth.get(body, math.inf) for body in bodies)
    forwards = start_depth <= end_depth
    if not forwards:
        near, far = far, near
    z_near, z_far = parts.end(flexure, near), parts.end(flexure, far)
    root, direction = parts.on(body_of(near), z_near), chord / abs(chord)
    laid = _LaidBeam(beam, arms, root, direction, forwards)
    first = len(parts.masses)
    points = _add_masses(parts, laid, thick=thick)
    tip = laid.at(beam.whole if forwards else 0.0 * beam.whole)
    if turned is None:
        parts.close(flexure.name, tip, parts.on(body_of(far), z_far))
    else:
        parts.reach(body_of(far), tip, z_far, turned)
    masses = slice(first, len(parts.masses))
    free = of_beam(flexure.name, forwards, beam, direction, coordinates, arms, masses, points)
    parts.connect(body_of(near), body_of(far), turned is None, free)
    _draw_beam(parts, flexure.name, laid)


@dataclass(frozen=True)
class _LaidBeam:
    """A beam as drawn, laid from the body that has been reached first, at its near end.

    Parameters
    ----------
    beam : Beam
        The beam.
    arms : list of int
        Directions of the nodes.
    root : Place
        Place of the near end.
    direction : complex
        Direction of the chord, from the start to the end.
    forwards : bool
        Whether the near end is the start.
    """

    beam: Beam
    arms: list[int]
    root: Place
    direction: complex
    forwards: bool

    def at(self, lengths: Complex) -> Place:
        """Return the place at lengths along the nodes, (N,) [m], measured from the start."""
        place = self.root
        lengths = lengths if self.forwards else lengths - self.beam.whole
        for arm, length in zip(self.arms, lengths, strict=True):
            place = place.plus(arm, complex(length) * self.direction)
        return place


def _add_masses(parts: Collection, laid: _LaidBeam, *, thick: bool) -> list[tuple[int, float]]:
    """Add the masses of a beam at its nodes.

    Two masses across the flexure have the moment of inertia of a thick section.

    Returns
    -------
    list of (int, float)
        For each mass: the number of its node, and its distance from it to the left [m].
    """
    beam, across = laid.beam, 1j * laid.direction
    places = [laid.at(row) for row in beam.node_positions]
    first, points = len(parts.masses), list[tuple[int, float]]()
    nodes = zip(laid.arms, beam.masses.tolist(), beam.radii.tolist(), places, strict=True)
    for i, (arm, mass, radius, place) in enumerate(nodes):
        for left in (-radius, radius) if thick else (0.0,):
            spot = place.plus(arm, left * across) if thick else place
            parts.mass(spot, mass / 2 if thick else mass)
            if len(parts.masses) - first > len(points):
                points.append((i, left))
    return points


def _draw_beam(parts: Collection, name: str, laid: _LaidBeam) -> None:
    """Add the curve of a beam and its thickness to the lines of the drawing."""
    points = [np.linspace(-1.0, 1.0, CURVE_POINTS)] * len(laid.beam.panels)
    curve = [laid.at(lengths) for lengths in laid.beam.positions(points)]
    parts.lines.append((name, "flexure", curve, laid.beam.thickness(points)))


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
