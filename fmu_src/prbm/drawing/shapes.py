r"""Outlines of flexures, bodies, walls and ground in a shape of a mechanism, as complex numbers.

A shape is given by its arms E = exp(s + i theta) (:mod:`prbm.mechanics.system`).  All positions
are linear in E, so that E (1 + i a w) is the shape displaced by the amplitude a along a mode w.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..mechanics.arrays import Complex, Real
from ..mechanics.places import BodyFrame, Outline
from ..mechanics.system import FIXED, System, unit
from ..mechanism.expressions import affine
from ..mechanism.flexure import BEAM, LEAF, PIN
from ..mechanism.parts import GROUND, Flexure, Guide, Point, Spring, Stop, body_of, value

CURVE_POINTS = 40  # Points of the drawn curve of a flexure with pivots.
CURVED_PIVOTS_MAX = 9  # More pivots are joined by straight lines, not by a curve.
# Shares of the size of the mechanism:
BODY_THICKNESS_MIN = 0.04  # Drawn thickness of a body without height.
WALL_LENGTH, GROUND_LENGTH = 0.36, 0.16
COINCIDENT_RTOL = 1e-9  # Sides of a line below this share of its length have no direction.
INSIDE_RTOL = 1e-9  # A point that is nearer to a side of a hull counts as outside.
GROUND_SHARE_MAX = 0.4  # Longest ground at the end of a flexure, as a share of its length,
GROUND_THICKNESSES_MIN = 1.3  # unless the flexure is thick: shortest ground over its thickness.
STROKES = 6  # Strokes of the hatching.
SPRING_WIDTH = 0.05  # Of the size: width of the zigzag of a spring.
SLOT_WIDTH = 0.04  # Of the size: width of the slot that shows a guide.
COILS = 6  # Corners of this zigzag on each side.
COILED = 0.7  # Share of the length of a spring that is coiled.
INCLINED_AREA_MAX = 0.4  # An inclined box must be smaller than this share of the upright box.


def corners(outline: Outline, E: Complex) -> Complex:
    """Return the corners of an outline in a shape, z = c + A E [m]."""
    z: Complex = outline.c + outline.A @ E
    return z


def curve(z: Complex, guided: tuple[bool, bool]) -> Complex:
    """Return a smooth curve between the ends of a flexure, tangential to its stubs at guided ends.

    The curve is Hermite's cubic, which for small deflections is the elastic line.  At a pin its
    curvature is zero.

    Parameters
    ----------
    z : (p,)
        Corners of the flexure: start, pivots, end [m].
    guided : pair of bool
        Whether the start and the end are guided, not pinned.
    """
    length = float(np.abs(np.diff(z)).sum())
    steps = [d for d in np.diff(z) if abs(d) > 1e-9 * length]
    chord = z[-1] - z[0]
    a, b = (length * d / abs(d) for d in (steps[0], steps[-1]))
    if not any(guided):
        a = b = chord
    elif not guided[0]:
        a = (3.0 * chord - b) / 2.0
    elif not guided[1]:
        b = (3.0 * chord - a) / 2.0
    s = np.linspace(0.0, 1.0, CURVE_POINTS)
    r = 1.0 - s
    result: Complex = (
        z[0] * (1.0 + 2.0 * s) * r**2 + z[-1] * (3.0 - 2.0 * s) * s**2 + r * s * (r * a - s * b)
    )
    return result


def hatched(point: complex, into: complex, size: float) -> Complex:
    """Return a line through a point, hatched on the side of the unit vector ``into``.

    The strokes are separated by NaN.
    """
    along = 1j * into * size
    parts = [point - along / 2, point + along / 2, complex(np.nan, np.nan)]
    for k in range(STROKES):
        z = point + along * ((k + 0.5) / STROKES - 0.5)
        parts += [z, z + (into * size - along) * 0.6 / STROKES, complex(np.nan, np.nan)]
    return np.array(parts)


def zigzag(start: complex, end: complex, width: float) -> Complex:
    """Return the line of a coil spring between two points.

    Examples
    --------
    >>> z = zigzag(0j, 1.0 + 0j, 0.1)
    >>> complex(z[0]), complex(z[-1]), round(float(np.ptp(z.imag)), 3)
    (0j, (1+0j), 0.1)
    """
    along = end - start
    across = 0.5j * width * along / (abs(along) or 1.0)
    shares = 0.5 + COILED * (np.linspace(0.0, 1.0, 2 * COILS + 2) - 0.5)
    sides = np.resize([1.0, -1.0], 2 * COILS + 2)
    sides[[0, -1]] = 0.0
    coils: Complex = start + shares * along + sides * across
    return np.concatenate([[start], coils, [end]])


def slot(start: complex, end: complex, width: float) -> Complex:
    """Return the outline of a slot between two points, which closes.

    Examples
    --------
    >>> slot(0j, 1.0 + 0j, 0.1).tolist()
    [0.05j, (1+0.05j), (1-0.05j), -0.05j, 0.05j]
    """
    across = 0.5j * width * (end - start) / (abs(end - start) or 1.0)
    return np.array([start + across, end + across, end - across, start - across, start + across])


def hull(points: Complex) -> Complex:
    """Return the corners of the convex hull of points, counter-clockwise; empty without an area.

    Examples
    --------
    >>> [complex(z) for z in hull(np.array([0, 2, 2j, 0.5 + 0.5j]))]
    [0j, (2+0j), 2j]
    >>> len(hull(np.array([0, 1, 2 + 0j])))
    0
    """
    try:
        order = ConvexHull(np.column_stack([points.real, points.imag])).vertices
    except (QhullError, ValueError):
        return np.zeros(0, complex)
    first = int(np.argmin(order))
    result: Complex = points[np.roll(order, -first)]
    return result


def box(points: Complex, least: float) -> Complex:
    """Return the smallest box about the origin that contains points.

    An inclined box is returned only if it is much smaller than the upright one.

    Parameters
    ----------
    points : (p,)
        Relative to the centre of the box [m].
    least : float
        Least distance of a side from the centre [m].

    Examples
    --------
    A bar at 45 degrees:

    >>> np.round(box(np.array([-1 - 1j, 1 + 1j]), 0.1) * np.exp(-0.25j * np.pi), 3) + 0
    array([-1.414-0.1j,  1.414-0.1j,  1.414+0.1j, -1.414+0.1j])
    """
    around = hull(np.concatenate([points, -points]))
    sides = np.diff(around, append=around[:1]) if len(around) else points[np.abs(points) > 0.0]
    best: tuple[float, complex, float, float] | None = None
    for side in (1.0 + 0j, *sides):
        turn = complex(side / abs(side))
        turn *= 1j ** -round(float(np.angle(turn)) / (np.pi / 2))  # The least inclination.
        rotated = points * turn.conjugate()
        x, y = (max(least, float(np.abs(part).max())) for part in (rotated.real, rotated.imag))
        if best is None or x * y < best[0]:
            best = (x * y if best else INCLINED_AREA_MAX * x * y), turn, x, y
    assert best is not None
    _, turn, x, y = best
    return turn * np.array([complex(-x, -y), complex(x, -y), complex(x, y), complex(-x, y)])


def _surrounds(around: Complex, distance: float) -> bool:
    """Return whether the origin lies in a hull, farther than a distance from its sides."""
    if not len(around):
        return False
    sides = np.diff(around, append=around[:1])
    return bool(np.all((around.conj() * sides).imag > distance * np.abs(sides)))


def tangents(z: Complex) -> Complex:
    """Return the unit vectors along a line at its corners, of which some may coincide.

    The tangent at a corner is between those of the sides before and after it.

    Examples
    --------
    >>> tangents(np.array([0.0, 1.0, 1.0, 1.0 + 1.0j])).round(12).tolist()[::3]
    [(1+0j), 1j]
    """
    steps = np.diff(z)
    lengths = np.abs(steps)
    long = lengths > COINCIDENT_RTOL * lengths.sum()
    along = steps[long] / lengths[long]
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    middle = (0.5 * (s[1:] + s[:-1]))[long]
    result: Complex = np.interp(s, middle, along.real) + 1j * np.interp(s, middle, along.imag)
    return result / np.abs(result)


@dataclass(frozen=True)
class FlexureLine:
    """A flexure, its outline and its kind.

    Parameters
    ----------
    flexure : Flexure
        The flexure, whose start is the first corner of its outline.
    outline : Outline
        Its line.
    jointed : bool
        Whether it has pivots: it is not a beam.
    shaped : bool
        Whether its thickness varies, and is drawn to scale.
    """

    flexure: Flexure
    outline: Outline
    jointed: bool = True
    shaped: bool = False

    @property
    def guided(self) -> tuple[bool, bool]:
        """Whether the start and the end are not pinned."""
        start, end = self.flexure.ends
        return start != PIN, end != PIN

    @property
    def curved(self) -> bool:
        """Whether the flexure is drawn as a smooth curve: it is a beam or has few pivots."""
        return not self.jointed or len(self.outline.c) - 2 <= CURVED_PIVOTS_MAX

    def centre_line(self, E: Complex) -> Complex:
        """Return the drawn centre line in a shape [m]."""
        z = corners(self.outline, E)
        return curve(z, self.guided) if self.jointed and self.curved else z

    def pins(self, E: Complex) -> Complex:
        """Return the positions of the pinned ends in a shape [m]."""
        z = corners(self.outline, E)
        return np.array([z[k] for k, g in zip((0, -1), self.guided, strict=True) if not g], complex)

    def edge(self, E: Complex) -> Complex:
        """Return the edge of a shaped flexure in a shape, counter-clockwise; else empty [m]."""
        if not self.shaped:
            return np.zeros(0, complex)
        z = corners(self.outline, E)
        left = 0.5j * self.outline.thickness * tangents(z)
        return np.concatenate([z - left, (z + left)[::-1]])

    def drawn(self, E: Complex) -> Complex:
        """Return the centre line in a shape or, of a shaped flexure, its closed edge [m]."""
        if not self.shaped:
            return self.centre_line(E)
        edge = self.edge(E)
        return np.append(edge, edge[0])


class Shapes:
    """The drawn parts of a mechanism, in any of its shapes.

    Parameters
    ----------
    system : System
        The mechanism.

    Attributes
    ----------
    ground_areas : list of list of complex arrays
        Corners of each part of the ground, counter-clockwise, and of its holes, clockwise [m].
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.straight = self.arms(system.q0)
        self.flexures = [self._flexure(o) for o in system.outlines if o.kind == "flexure"]
        self.joints = [o for o in system.outlines if o.kind == "joint"]
        self.coils = [o for o in system.outlines if o.kind == "spring"]
        self.ways = [o for o in system.outlines if o.kind == "guide"]
        self.hits = [self._hit(stop) for stop in system.mechanism.stops]
        self.bodies = {name: self._body(name) for name in system.bodies}
        self.holes = {name: self._holes(name) for name in system.bodies}
        self.ground_areas = [
            [self._ring(part.outline), *(self._ring(hole)[::-1] for hole in part.holes)]
            for part in system.mechanism.ground_parts
        ]

    def arms(self, q: Real) -> Complex:
        """Return the arms E of a shape; entries at stretches are undefined and have no effect."""
        return self.system.directions(q)

    @property
    def size(self) -> float:
        """Size of the mechanism, the scale of the drawing [m]."""
        return self.system.length

    def _number(self, x: float | str) -> float:
        return affine(x)(self.system.values)

    def _point(self, reference: str, user: str) -> complex:
        x, y = self.system.mechanism.point(reference, user)
        return complex(self._number(x), self._number(y))

    def _flexure(self, outline: Outline) -> FlexureLine:
        """Return a flexure, described from the first corner of its outline."""
        mechanism = self.system.mechanism
        flexure = next(f for f in mechanism.flexures if f.name == outline.name)
        kind = mechanism.type_of(flexure)
        first, last = corners(outline, self.straight)[[0, -1]]
        start = self._point(flexure.start, flexure.name)
        if abs(last - start) < abs(first - start):
            flexure = replace(
                flexure, start=flexure.end, end=flexure.start, ends=flexure.ends[::-1]
            )
        return FlexureLine(flexure, outline, kind.model != BEAM, kind.profile != LEAF)

    def _hit(self, stop: Stop) -> complex:
        """Return the hit point of a stop as drawn [m]."""
        offset = value(stop, "offset", self.system.values)
        x, y = stop.point
        return complex(self._number(x), self._number(y)) + 1j * unit(stop.direction) * offset

    def _body(self, name: str) -> Complex:
        """Return the corners of a body about its centre of mass, as drawn [m].

        The corners are those of its outline.  Without an outline they are the hull of its points
        and hit points if it contains the centre of mass, otherwise the smallest box about the
        centre of mass that contains them.
        """
        body = next(b for b in self.system.mechanism.bodies if b.name == name)
        if body.outline:
            return self._reach(name, body.outline)
        drawn = [complex(self._number(x), self._number(y)) for x, y in body.points.values()]
        stops = self.system.mechanism.stops
        drawn += [z for stop, z in zip(stops, self.hits, strict=True) if stop.body == name]
        reach = np.array(drawn) - self.system.bodies[name].drawn
        around = hull(reach)
        if _surrounds(around, INSIDE_RTOL * self.size):
            return around
        return box(reach, BODY_THICKNESS_MIN * self.size / 2)

    def _holes(self, name: str) -> list[Complex]:
        """Return the corners of the holes of a body about its centre of mass, as drawn [m]."""
        body = next(b for b in self.system.mechanism.bodies if b.name == name)
        return [self._reach(name, hole)[::-1] for hole in body.holes]

    def _reach(self, name: str, drawn: Sequence[Point]) -> Complex:
        """Return corners about the centre of mass of a body, counter-clockwise [m]."""
        return self._ring(drawn) - self.system.bodies[name].drawn

    def _ring(self, drawn: Sequence[Point]) -> Complex:
        """Return corners, counter-clockwise [m]."""
        z = np.array([complex(self._number(x), self._number(y)) for x, y in drawn])
        about = z - z[0]
        return z if float((about.conj() * np.roll(about, -1)).imag.sum()) > 0.0 else z[::-1]

    def carried(self, body: str, drawn: complex, E: Complex) -> complex:
        """Return the position in a shape of a drawn point of a body or of the ground [m]."""
        if body == GROUND:
            return drawn
        frame = self.system.bodies[body]
        return complex(frame.c + frame.A @ E + E[frame.arm] * (drawn - frame.drawn))

    def centre(self, name: str, E: Complex) -> complex:
        """Return the centre of mass of a body in a shape [m]."""
        frame = self.system.bodies[name]
        return complex(frame.c + frame.A @ E)

    def body(self, name: str, E: Complex) -> Complex:
        """Return the corners of a body in a shape [m]."""
        frame = self.system.bodies[name]
        result: Complex = self.centre(name, E) + E[frame.arm] * self.bodies[name]
        return result

    def areas(self, name: str, E: Complex) -> list[Complex]:
        """Return the corners of a body, counter-clockwise, and of its holes, clockwise [m]."""
        centre, turn = self.centre(name, E), E[self.system.bodies[name].arm]
        return [centre + turn * z for z in (self.bodies[name], *self.holes[name])]

    def hit(self, i: int, E: Complex) -> complex:
        """Return the hit point of a stop in a shape [m]."""
        return self.carried(self.system.mechanism.stops[i].body, self.hits[i], E)

    def wall(self, i: int, position: float, E: Complex) -> Complex:
        """Return the hatched wall of a stop in a shape.

        Parameters
        ----------
        i : int
            Index of the stop.
        position : float
            Position of the wall along the direction of the stop, from the drawn hit point [m].
        E : (n,)
            Arms of the shape.
        """
        stop, j = self.system.mechanism.stops[i], int(self.system.on[i])
        into = unit(stop.direction)
        point = self.carried(stop.on, self.hits[i] + position * into, E)
        if j != FIXED:
            into *= complex(E[j])
        return hatched(point, into, WALL_LENGTH * self.wall_size(stop))

    def wall_size(self, stop: Stop) -> float:
        """Return the length scale of the wall of a stop [m]."""
        if stop.on == GROUND:
            return self.size
        return min(self.size, 2.0 * float(np.abs(self.bodies[stop.on]).max()))

    def ground(self) -> list[Complex]:
        """Return the hatched lines where parts that connect points are fixed to the ground."""
        lines = []
        for line in self.flexures:
            z = corners(line.outline, self.straight)
            along = tangents(z)
            length = min(GROUND_LENGTH * self.size, GROUND_SHARE_MAX * abs(z[-1] - z[0]))
            if line.shaped:
                length = max(length, GROUND_THICKNESSES_MIN * float(line.outline.thickness.max()))
            ends = (line.flexure.start, z[0], -along[0]), (line.flexure.end, z[-1], along[-1])
            lines += [
                hatched(complex(point), complex(into), length)
                for end, point, into in ends
                if body_of(end) == GROUND
            ]
        grounded = {
            j.name for j in self.system.mechanism.joints if GROUND in map(body_of, (j.start, j.end))
        }
        lines += [
            hatched(complex(corners(o, self.straight)[0]), -1j, GROUND_LENGTH * self.size / 2)
            for o in self.joints
            if o.name in grounded
        ]
        mechanism = self.system.mechanism
        parts: tuple[Spring | Guide, ...] = (*mechanism.springs, *mechanism.guides)
        for part, outline in zip(parts, (*self.coils, *self.ways), strict=True):
            z = corners(outline, self.straight)
            along = (z[1] - z[0]) / abs(z[1] - z[0])
            for end, point, into in ((part.start, z[0], -along), (part.end, z[1], along)):
                if body_of(end) == GROUND:
                    length = GROUND_LENGTH * self.size / 2
                    lines.append(hatched(complex(point), complex(into), length))
        return lines

    def springs(self, E: Complex) -> list[Complex]:
        """Return the lines of the springs in a shape [m]."""
        ends = [corners(outline, E) for outline in self.coils]
        return [zigzag(complex(a), complex(b), SPRING_WIDTH * self.size) for a, b in ends]

    def slots(self, E: Complex) -> list[Complex]:
        """Return the outlines of the slots that show the guides in a shape [m]."""
        ends = [corners(outline, E) for outline in self.ways]
        return [slot(complex(a), complex(b), SLOT_WIDTH * self.size) for a, b in ends]

    def pins(self, E: Complex) -> Complex:
        """Return joints, pinned ends of flexures and guided points in a shape, positions [m]."""
        ends = [line.pins(E) for line in self.flexures]
        guided = _positions(self.system.guided_points, E)
        return np.concatenate([*ends, *(corners(joint, E) for joint in self.joints), guided])

    def probes(self, E: Complex) -> Complex:
        """Return the positions of the probes [m]."""
        return _positions(self.system.probes, E)

    def forces(self, E: Complex) -> Complex:
        """Return the points of application of the forces [m]."""
        return _positions(self.system.pushed, E)


def _positions(frames: Sequence[BodyFrame], E: Complex) -> Complex:
    return np.array([frame.c + frame.A @ E for frame in frames], complex)
