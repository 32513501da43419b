r"""The lines of a mechanism in a shape: flexures, bodies, walls, ground, as complex numbers.

A shape is given by its arms E = exp(s + i theta) (:mod:`prbm.mechanics.assembly`); every place is
linear in them, so that E (1 + i a w) is the shape moved by the amplitude a along a mode w.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..mechanics.arrays import Complex, Real
from ..mechanics.system import FIXED, BodyFrame, Outline, System, unit
from ..mechanism.expressions import affine
from ..mechanism.flexure import PIN
from ..mechanism.parts import GROUND, Flexure, Stop, body_of, value

SMOOTH = 40  # points along a flexure's curve
THINNEST_BODY = 0.04  # of the size of the mechanism: a body without height is drawn this thick
WALL_LENGTH, GROUND_LENGTH = 0.36, 0.16  # of the size of the mechanism
SHARE = 0.4  # of a flexure, which the ground at its end may be long
STROKES = 6  # of the hatching
LEANS = 0.4  # of the upright box: a box that leans must be smaller than this
SURROUNDED = 1e-9  # of the size: a centre of mass nearer to the hull's sides lies outside


def corners(outline: Outline, E: Complex) -> Complex:
    """Return the corners of an outline in a shape, z = c + A E [m]."""
    z: Complex = outline.c + outline.A @ E
    return z


def curve(z: Complex, guided: tuple[bool, bool]) -> Complex:
    """Return a smooth curve between the ends of a flexure, along its stubs where these guide it.

    Hermite's cubic, which for small deflections is the elastic line; at a pin its curvature
    is zero.

    Parameters
    ----------
    z : (p,)
        Corners of the flexure: start, pivots, end [m].
    guided : pair of bool
        Whether the start and the end take the direction of what holds them: all but pins.
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
    s = np.linspace(0.0, 1.0, SMOOTH)
    r = 1.0 - s
    result: Complex = (
        z[0] * (1.0 + 2.0 * s) * r**2 + z[-1] * (3.0 - 2.0 * s) * s**2 + r * s * (r * a - s * b)
    )
    return result


def hatched(place: complex, into: complex, size: float) -> Complex:
    """Return a line through a place, hatched towards ``into``; breaks are not numbers."""
    along = 1j * into * size
    parts = [place - along / 2, place + along / 2, complex(np.nan, np.nan)]
    for k in range(STROKES):
        z = place + along * ((k + 0.5) / STROKES - 0.5)
        parts += [z, z + (into * size - along) * 0.6 / STROKES, complex(np.nan, np.nan)]
    return np.array(parts)


def hull(points: Complex) -> Complex:
    """Return the corners of the convex hull of points, counter-clockwise; none if it has no area.

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
    """Return the smallest box about the origin that holds points, upright unless it is slender.

    Parameters
    ----------
    points : (p,)
        From the centre of the box [m].
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
        turn *= 1j ** -round(float(np.angle(turn)) / (np.pi / 2))  # the box that leans the least
        seen = points * turn.conjugate()
        x, y = (max(least, float(np.abs(part).max())) for part in (seen.real, seen.imag))
        if best is None or x * y < best[0]:
            best = (x * y if best else LEANS * x * y), turn, x, y
    assert best is not None
    _, turn, x, y = best
    return turn * np.array([complex(-x, -y), complex(x, -y), complex(x, y), complex(-x, y)])


def _surrounds(around: Complex, distance: float) -> bool:
    """Tell whether a hull holds the origin, by more than a distance from its sides."""
    if not len(around):
        return False
    sides = np.diff(around, append=around[:1])
    return bool(np.all((around.conj() * sides).imag > distance * np.abs(sides)))


@dataclass(frozen=True)
class FlexureLine:
    """A flexure, its line, and whether its ends are guided."""

    flexure: Flexure
    outline: Outline

    @property
    def guided(self) -> tuple[bool, bool]:
        """Whether the start and the end are not pinned."""
        start, end = self.flexure.ends
        return start != PIN, end != PIN

    def pins(self, E: Complex) -> Complex:
        """Return the places of the ends that are pinned [m]."""
        z = corners(self.outline, E)
        return np.array([z[k] for k, g in zip((0, -1), self.guided, strict=True) if not g], complex)


class Shapes:
    """What there is to draw of a mechanism, in any of its shapes.

    Parameters
    ----------
    system : System
        The mechanism.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.straight = self.arms(system.q0)
        named = {flexure.name: flexure for flexure in system.mechanism.flexures}
        self.flexures = [
            FlexureLine(named[o.name], o) for o in system.outlines if o.kind == "flexure"
        ]
        self.joints = [o for o in system.outlines if o.kind == "joint"]
        self.hits = [self._hit(stop) for stop in system.mechanism.stops]
        self.bodies = {name: self._body(name) for name in system.bodies}

    def arms(self, q: Real) -> Complex:
        """Return E of a shape; at stretches, which no place depends on, anything."""
        return self.system.directions(q)

    @property
    def size(self) -> float:
        """Size of the mechanism, scale of what is drawn [m]."""
        return self.system.length

    def _number(self, x: float | str) -> float:
        return affine(x)(self.system.values)

    def _point(self, reference: str, user: str) -> complex:
        x, y = self.system.mechanism.point(reference, user)
        return complex(self._number(x), self._number(y))

    def _hit(self, stop: Stop) -> complex:
        """Return where the hit point of a stop is drawn [m]."""
        offset = value(stop, "offset", self.system.values)
        x, y = stop.point
        return complex(self._number(x), self._number(y)) + 1j * unit(stop.direction) * offset

    def _body(self, name: str) -> Complex:
        """Return the corners of a body about its centre of mass, as drawn [m].

        The hull of its points and of the points that hit, if they surround the centre of mass;
        else the smallest box about the centre that holds them.
        """
        body = next(b for b in self.system.mechanism.bodies if b.name == name)
        drawn = [complex(self._number(x), self._number(y)) for x, y in body.points.values()]
        stops = self.system.mechanism.stops
        drawn += [z for stop, z in zip(stops, self.hits, strict=True) if stop.body == name]
        reach = np.array(drawn) - self.system.bodies[name].drawn
        around = hull(reach)
        if _surrounds(around, SURROUNDED * self.size):
            return around
        return box(reach, THINNEST_BODY * self.size / 2)

    def carried(self, body: str, drawn: complex, E: Complex) -> complex:
        """Return where a drawn point of a body, or of the ground, is in a shape [m]."""
        if body == GROUND:
            return drawn
        frame = self.system.bodies[body]
        return complex(frame.c + frame.A @ E + E[frame.j] * (drawn - frame.drawn))

    def centre(self, name: str, E: Complex) -> complex:
        """Return where the centre of mass of a body is in a shape [m]."""
        frame = self.system.bodies[name]
        return complex(frame.c + frame.A @ E)

    def body(self, name: str, E: Complex) -> Complex:
        """Return the corners of a body in a shape [m]."""
        frame = self.system.bodies[name]
        result: Complex = self.centre(name, E) + E[frame.j] * self.bodies[name]
        return result

    def hit(self, i: int, E: Complex) -> complex:
        """Return where the hit point of a stop is in a shape [m]."""
        return self.carried(self.system.mechanism.stops[i].body, self.hits[i], E)

    def wall(self, i: int, position: float, E: Complex) -> Complex:
        """Return the hatched wall of a stop in a shape.

        Parameters
        ----------
        i : int
            Which stop.
        position : float
            Of the wall along the stop's direction, from the hit point as drawn [m].
        E : (n,)
            Arms of the shape.
        """
        stop, j = self.system.mechanism.stops[i], int(self.system.on[i])
        into = unit(stop.direction)
        touched = self.carried(stop.on, self.hits[i] + position * into, E)
        if j != FIXED:
            into *= complex(E[j])
        return hatched(touched, into, WALL_LENGTH * self.wall_size(stop))

    def wall_size(self, stop: Stop) -> float:
        """Return the size that a wall's length is in proportion to [m]."""
        if stop.on == GROUND:
            return self.size
        return min(self.size, 2.0 * float(np.abs(self.bodies[stop.on]).max()))

    def ground(self) -> list[Complex]:
        """Return the hatched lines where flexures and joints are fixed to the ground."""
        lines = []
        for line in self.flexures:
            z = corners(line.outline, self.straight)
            length = min(GROUND_LENGTH * self.size, SHARE * abs(z[-1] - z[0]))
            ends = (line.flexure.start, z[0], z[0] - z[-1]), (line.flexure.end, z[-1], z[-1] - z[0])
            lines += [
                hatched(complex(place), complex(into / abs(into)), length)
                for end, place, into in ends
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
        return lines

    def pins(self, E: Complex) -> Complex:
        """Return the places of joints and of the pinned ends of flexures in a shape [m]."""
        ends = [line.pins(E) for line in self.flexures]
        return np.concatenate([*ends, *(corners(joint, E) for joint in self.joints), []])

    def probes(self, E: Complex) -> Complex:
        """Return the places that are watched [m]."""
        return _places(self.system.probes, E)

    def forces(self, E: Complex) -> Complex:
        """Return the places where forces act [m]."""
        return _places(self.system.pushed, E)


def _places(frames: Sequence[BodyFrame], E: Complex) -> Complex:
    return np.array([frame.c + frame.A @ E for frame in frames], complex)
