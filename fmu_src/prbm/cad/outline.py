"""The outline of a mechanism as one plate: bodies, flexures, and pads where they meet."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.errors import MechanismError
from ..drawing.shapes import FlexureLine, Shapes, corners
from ..files.outlines import CORNERS_MIN
from ..mechanics.arrays import Complex, Real
from ..mechanics.assembly import assemble
from ..mechanics.beam import Beam
from ..mechanics.collection import Collection
from ..mechanics.flexures import beam_of
from ..mechanics.profile import Straight
from ..mechanics.system import FIXED, unit
from ..mechanism.description import Mechanism
from ..mechanism.flexure import PIN
from ..mechanism.parts import GROUND, body_of, value

PAD_SHARE = 0.05  # Size of the pads of the ground and of bodies without an outline.
PAD_THICKNESSES = 1.5  # Least size of a pad over the thickness of the flexure there.
SLOT_THICKNESSES = 1.0  # Width of the slots beside flexures over their thickness,
SLOT_SHARE = 0.02  # at most this share of the size.
OVERLAP_RTOL = 1e-6  # Overlap of parts that are joined, as a share of the size.
AREA_RTOL = 1e-6  # Overlap of parts that are apart, as a share of the square of the size.
STOP_SHARE = 0.05  # Length of the line of a stop.
CURVE_POINTS = 161  # Points of an arc of a notch, or of a curved flexure.
SAME_RTOL = 1e-9  # Points nearer than this share of the length coincide.
CONTACT_MIN = 0.99  # Share of the end of a flexure that lies on its body.


@dataclass
class Outline:
    """A mechanism as a plate.

    Parameters
    ----------
    plate : MultiPolygon
        The material [m].
    bodies : dict
        The material of each body without its flexures [m].
    ground : list of complex
        A point in each part of the ground [m].
    stops : list of complex arrays
        Lines of the walls [m].
    notes : list of str
        What the drawing cannot say.
    """

    plate: shapely.MultiPolygon
    bodies: dict[str, BaseGeometry]
    ground: list[complex] = field(default_factory=list)
    stops: list[Complex] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def outline(mechanism: Mechanism, values: Mapping[str, float] | None = None) -> Outline:
    """Return the outline of a mechanism, as drawn.

    Slots beside the flexures let them end where they are clamped.  Bodies without an outline are
    drawn as in pictures, with pads at their flexures.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping or None
        Parameters that differ from their defaults.

    Raises
    ------
    MechanismError
        If it has pins, or its parts overlap: it cannot be cut from one plate.
    """
    _check_pins(mechanism)
    return _Plate(mechanism, values).outline()


def _check_pins(mechanism: Mechanism) -> None:
    """Reject pins."""
    pinned = [f.name for f in mechanism.flexures if PIN in f.ends]
    pinned += [joint.name for joint in mechanism.joints]
    if pinned:
        raise MechanismError(
            f"{mechanism.name} has pins ({', '.join(pinned)}): it cannot be cut from one plate; "
            "choose clamps"
        )


@dataclass(frozen=True)
class _Strip:
    """A flexure: its centre line, directions along it and thickness [m]."""

    line: FlexureLine
    z: Complex
    along: Complex
    thickness: Real

    def band(self, beside: float = 0.0, beyond: float = 0.0) -> shapely.Polygon:
        """Return its material, wider on each side and longer at each end [m]."""
        half = 0.5 * self.thickness + beside
        z, along = self.z, self.along
        if beyond:
            z = np.concatenate([[z[0] - beyond * along[0]], z, [z[-1] + beyond * along[-1]]])
            along = np.concatenate([along[:1], along, along[-1:]])
            half = np.concatenate([half[:1], half, half[-1:]])
        left, right = z + 1j * half * along, z - 1j * half * along
        return _polygon(np.concatenate([left, right[::-1]]))

    def ends(self) -> Iterator[tuple[str, complex, complex, float]]:
        """Yield body, position, direction out of the flexure and thickness of both ends."""
        flexure = self.line.flexure
        for end, k, sign in ((flexure.start, 0, -1.0), (flexure.end, -1, 1.0)):
            z, along = complex(self.z[k]), complex(self.along[k])
            yield body_of(end), z, sign * along, float(self.thickness[k])


class _Plate:
    """Joins the parts of a mechanism to a plate."""

    def __init__(self, mechanism: Mechanism, values: Mapping[str, float] | None) -> None:
        self.mechanism = mechanism
        self.system = assemble(mechanism, mechanism.values(values))
        self.shapes = Shapes(self.system)
        self.size = self.shapes.size
        self.strips = [self._strip(line) for line in self.shapes.flexures]

    def _strip(self, line: FlexureLine) -> _Strip:
        """Return the strip of a flexure; one with pivots is straight."""
        flexure = line.flexure
        kind = self.mechanism.type_of(flexure)
        if line.jointed:
            z = corners(line.outline, self.shapes.straight)[[0, -1]]
            thickness = np.full(2, value(kind, "thickness", self.system.values))
            along = np.full(2, (z[1] - z[0]) / abs(z[1] - z[0]))
            return _Strip(line, z, along, thickness)
        parts = Collection(self.mechanism, self.system.values)
        original = next(f for f in self.mechanism.flexures if f.name == flexure.name)
        beam = beam_of(parts, original, kind)
        v, thickness = _sections(beam)
        start, end = parts.end(original, original.start), parts.end(original, original.end)
        local, along = beam.line.position(v), beam.line.tangent(v)
        turn = (end - start) / complex(beam.line.position(np.array([beam.line.length]))[0])
        along = along * turn / np.abs(along * turn)
        z = start + local * turn
        strip = _Strip(line, z, along, thickness)
        if original.start == flexure.start:
            return strip
        return _Strip(line, z[::-1], -along[::-1], thickness[::-1])

    def outline(self) -> Outline:
        """Return the plate with its marks."""
        parts = self._bodies()
        slots = shapely.unary_union([s.band(beside=self._slot(s)) for s in self.strips])
        cut = {name: part.difference(slots) for name, part in parts.items()}
        for name, part in cut.items():
            if name != GROUND:
                cut[name] = self._whole(name, part)
        self._check_apart(cut)
        bands = [s.band(beyond=OVERLAP_RTOL * self.size) for s in self.strips]
        for one, other in combinations(range(len(bands)), 2):
            if bands[one].intersection(bands[other]).area > AREA_RTOL * self.size**2:
                names = [self.strips[k].line.flexure.name for k in (one, other)]
                raise MechanismError(
                    f"the flexures {names[0]} and {names[1]} cross: they cannot be cut from one "
                    "plate"
                )
        plate = shapely.unary_union([*cut.values(), *bands])
        pieces = [p for p in shapely.get_parts(plate) if isinstance(p, shapely.Polygon)]
        result = Outline(shapely.MultiPolygon(pieces), dict(cut))
        ground = result.bodies.pop(GROUND)
        for part in shapely.get_parts(ground):
            point = part.representative_point()
            result.ground.append(complex(point.x, point.y))
        self._stops(result)
        return result

    def _slot(self, strip: _Strip) -> float:
        """Return the width of the slots beside a flexure [m]."""
        return min(SLOT_THICKNESSES * float(strip.thickness.max()), SLOT_SHARE * self.size)

    def _bodies(self) -> dict[str, BaseGeometry]:
        """Return the bodies and the ground, with pads where their outlines end."""
        parts: dict[str, list[BaseGeometry]] = {
            GROUND: [_area(GROUND, rings) for rings in self.shapes.ground_areas]
        }
        for body in self.mechanism.bodies:
            rings = self.shapes.areas(body.name, self.shapes.straight)
            parts[body.name] = [_area(body.name, rings)]
        drawn = {body.name: bool(body.outline) for body in self.mechanism.bodies}
        drawn[GROUND] = bool(self.shapes.ground_areas)
        for strip in self.strips:
            for owner, z, out, thickness in strip.ends():
                half = 0.5j * thickness * out
                edge = shapely.LineString(_pairs(np.array([z - half, z + half])))
                known = shapely.unary_union(parts[owner]).buffer(OVERLAP_RTOL * self.size)
                inside = edge.intersection(known).length >= CONTACT_MIN * edge.length
                if not (drawn[owner] and inside):
                    size = max(PAD_SHARE * self.size, PAD_THICKNESSES * thickness)
                    size = max(size, thickness + 2.0 * self._slot(strip))
                    if owner != GROUND:
                        size = min(size, thickness + 2.0 * self._slot(strip))
                    parts[owner].append(_pad(z, out, size))
        return {name: shapely.unary_union(shapes) for name, shapes in parts.items()}

    def _whole(self, name: str, part: BaseGeometry) -> shapely.Polygon:
        """Return the piece of a body that holds all its flexures; reject a body in pieces."""
        reach = 10.0 * OVERLAP_RTOL * self.size
        ends = [
            shapely.Point((z + reach * out).real, (z + reach * out).imag)
            for strip in self.strips
            for owner, z, out, _ in strip.ends()
            if owner == name
        ]
        for piece in shapely.get_parts(part):
            if isinstance(piece, shapely.Polygon) and all(piece.covers(end) for end in ends):
                return piece
        raise MechanismError(f"a flexure crosses the body {name}: it cannot be cut from one plate")

    def _check_apart(self, parts: Mapping[str, BaseGeometry]) -> None:
        """Reject bodies that overlap."""
        for (one, a), (other, b) in combinations(parts.items(), 2):
            shared = a.intersection(b)
            if shared.area > AREA_RTOL * self.size**2 or a.touches(b):
                z = shared.representative_point()
                raise MechanismError(
                    f"{one} and {other} overlap at ({1e3 * z.x:.4g}, {1e3 * z.y:.4g}) mm: the "
                    "mechanism cannot be cut from one plate"
                )

    def _stops(self, result: Outline) -> None:
        """Add the lines of the walls."""
        for i, stop in enumerate(self.mechanism.stops):
            position = value(stop, "position", self.system.values)
            if position < 0.0 or self.system.on[i] != FIXED:
                result.notes.append(
                    f"the stop {stop.name} is not drawn: it is on a body, or behind the hit point"
                )
                continue
            into = unit(stop.direction)
            wall = self.shapes.hits[i] + position * into
            along = 0.5j * STOP_SHARE * self.size * into
            result.stops.append(np.array([wall - along, wall + along]))


def _sections(beam: Beam) -> tuple[Real, Real]:
    """Return positions along a beam, dense where it is curved, and the thickness there [m]."""
    straight = not (beam.line.curvature or beam.line.rise)
    v, thickness = [], []
    for panel in beam.panels:
        points = 2 if straight and isinstance(panel, Straight) else CURVE_POINTS
        sections = panel.at(np.linspace(-1.0, 1.0, points))
        v.append(sections.v)
        thickness.append(sections.thickness)
    every = np.concatenate(v)
    kept = np.append(True, np.diff(every) > SAME_RTOL * every[-1])
    return every[kept], np.concatenate(thickness)[kept]


def _pad(z: complex, out: complex, size: float) -> shapely.Polygon:
    """Return a square that begins at the end of a flexure."""
    across = 0.5j * size * out
    return _polygon(
        np.array([z - across, z + across, z + across + size * out, z - across + size * out])
    )


def _area(owner: str, rings: Sequence[Complex]) -> shapely.Polygon:
    """Return the area of a part; reject an outline without an area."""
    if min(map(len, rings)) >= CORNERS_MIN:
        area = shapely.Polygon(_pairs(rings[0]), [_pairs(hole) for hole in rings[1:]])
        if area.is_valid:
            return area
    raise MechanismError(
        f"the outline of {owner} crosses or touches itself, or has fewer than {CORNERS_MIN} "
        "corners, or a hole is not inside it: it cannot be cut from a plate; correct the outline"
    )


def _polygon(z: Complex) -> shapely.Polygon:
    return shapely.Polygon(_pairs(z))


def _pairs(z: Complex) -> Real:
    return np.column_stack([z.real, z.imag])
