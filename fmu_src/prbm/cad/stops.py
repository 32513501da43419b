"""The stops of a plate, from walls in its drawing.

A wall is a straight line, or several joined lines: a block, a pin, a bent line.  A body meets the
side of the wall that is square to the shortest way between both, or the tangent of the wall there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.geometry.base import BaseGeometry

from ..mechanics.arrays import Complex, Real
from .curves import STOPS, Curves
from .recognition import Recognised

NEAR_SHARE = 0.25  # Largest distance of a stop from a body, as a share of the diagonal.
JOINED_SHARE = 1e-3  # Largest distance of lines that form one wall.
TOUCHING_SHARE = 1e-5  # Largest distance of parts that touch, at least twice the accuracy.
SQUARE_MAX = 1e-3  # Largest inclination of a side to the shortest way between wall and body [rad].
TURN_MAX = 0.1  # Largest angle between sides that separate a wall and a body [rad].
AROUND = 100.0  # Radius around a contact, over the distance of parts that touch.
NEAR_NOTHING = "a line on the layer stops is near no moving body"
OVERLAPPING = "a wall on the layer stops overlaps a moving body: draw it beside the body"
AT_A_CORNER = "a wall on the layer stops touches a body at corners only: draw it with a gap"


@dataclass(frozen=True)
class FoundStop:
    """A wall near a body.

    Parameters
    ----------
    body, on : int
        Indices of the body that hits it and of the one that carries it; -1: the ground.
    point : complex
        Hit point of the body [m].
    direction : complex
        Unit vector from the body to the wall.
    gap : float
        Distance of the wall [m].
    """

    body: int
    on: int
    point: complex
    direction: complex
    gap: float


@dataclass(frozen=True)
class _Side:
    """A side of a wall, or a tangent: its start, its direction and its length [m]."""

    start: complex
    along: complex
    length: float

    def line(self) -> shapely.LineString:
        """Return the side as a geometry."""
        return _line(np.array([self.start, self.start + self.length * self.along]))

    def heights(self, z: Complex) -> Real:
        """Return the distances of points to the left of the side [m]."""
        result: Real = ((z - self.start) * np.conj(self.along)).imag
        return result


def find_stops(found: Recognised, curves: Curves) -> list[FoundStop]:
    """Return the stops: walls on the layer ``stops``, each near a body.

    Walls without a stop are added to the doubts.
    """
    stops, lines = [], []
    for curve in curves.on(STOPS):
        if np.ptp(np.abs(curve.z - curve.z[0])) > 0.0:
            lines.append(curve.z)
        else:
            found.doubts.append((complex(curve.z[0]), "a point on the layer stops is no wall"))
    for joined in _joined(lines, JOINED_SHARE * found.size):
        stop = _stop(found, joined)
        if isinstance(stop, str):
            found.doubts.append((complex(joined[0].mean()), stop))
        else:
            stops.append(stop)
    return stops


def _joined(lines: Sequence[Complex], near: float) -> list[list[Complex]]:
    """Return lines in groups of those that touch."""
    if not lines:
        return []
    shapes = [_line(z) for z in lines]
    pairs = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=near)
    graph = coo_array((np.ones(pairs.shape[1]), pairs), shape=(len(lines), len(lines)))
    count, group = connected_components(graph, directed=False)
    return [[z for z, own in zip(lines, group, strict=True) if own == g] for g in range(count)]


def _line(z: Complex) -> shapely.LineString:
    return shapely.LineString(np.column_stack([z.real, z.imag]))


def _points(shape: BaseGeometry) -> Complex:
    """Return the corners of a geometry."""
    pairs = shapely.get_coordinates(shape)
    result: Complex = pairs[:, 0] + 1j * pairs[:, 1]
    return result


def _stop(found: Recognised, lines: Sequence[Complex]) -> FoundStop | str:
    """Return the stop of a wall, which the nearest moving body hits; else the reason."""
    touch = max(TOUCHING_SHARE * found.size, 2.0 * found.noise)
    wall = shapely.unary_union([_line(z) for z in lines])
    hit = _bodies(found, wall, touch)
    if hit is None:
        return NEAR_NOTHING
    body = found.bodies[hit[0]]
    if body.buffer(-touch).intersects(wall):
        return OVERLAPPING
    near, far = _points(shapely.shortest_line(body, wall))
    met = _met(body, wall, complex(near), complex(far), touch)
    if met is None:
        return AT_A_CORNER
    side, gap = met
    around = body.intersection(_disc(complex(near), AROUND * touch)).representative_point()
    height = float(side.heights(np.array([complex(around.x, around.y)]))[0])
    away = 1j * side.along * (1.0 if height > 0.0 else -1.0)  # From the wall to the body.
    point = complex(near) if side.length == 0.0 else _place(body, side, gap * away, touch)
    return FoundStop(*hit, point, -away, gap)


def _bodies(found: Recognised, wall: BaseGeometry, touch: float) -> tuple[int, int] | None:
    """Return the body that hits a wall and the one that carries it, -1: the ground."""
    used = {k for one in found.flexures for k in one.bodies}
    distances = shapely.distance(found.bodies, wall)
    order = [int(k) for k in np.argsort(distances, kind="stable") if int(k) in used]
    moving = [k for k in order if k not in found.ground]
    carried = [k for k in moving if distances[k] <= touch]
    if any(distances[k] <= touch for k in found.ground):
        carried = []
    near = [k for k in moving if distances[k] <= NEAR_SHARE * found.size and k not in carried[:1]]
    if near:
        return near[0], carried[0] if carried else -1
    return (carried[0], -1) if carried else None  # It touches the body that hits it: no gap.


def _met(
    body: BaseGeometry, wall: BaseGeometry, near: complex, far: complex, touch: float
) -> tuple[_Side, float] | None:
    """Return the side of a wall that a body meets and its distance; None: it is not unique.

    ``near`` and ``far`` are the nearest points of the body and the wall.
    """
    sides, gap = _sides(wall, 0.25 * touch), abs(far - near)
    if gap <= touch:
        side = _touched(body, wall, sides, near, touch)
        return None if side is None else (side, 0.0)
    towards = (far - near) / gap
    square = [
        side
        for side in sides
        if abs((side.along * towards.conjugate()).real) <= SQUARE_MAX
        and side.line().distance(body) <= gap + touch
    ]
    if square:
        return max(square, key=lambda side: side.length), gap
    if len(sides) == 1:
        heights = sides[0].heights(_points(body))
        if heights.min() > 0.0 or heights.max() < 0.0:  # A line beside the body.
            return sides[0], float(np.abs(heights).min())
    return _Side(far, 1j * towards, 0.0), gap


def _sides(wall: BaseGeometry, tolerance: float) -> list[_Side]:
    """Return the sides of a wall: those of its closed shapes together, and other lines."""
    faces, cuts, dangles, _ = shapely.polygonize_full([wall])
    area = shapely.unary_union(list(faces.geoms))
    edges = shapely.unary_union([area.boundary, cuts, dangles])
    merged = shapely.line_merge(edges) if edges.geom_type == "MultiLineString" else edges
    found = []
    for line in shapely.get_parts(merged):
        z = _points(line)
        if z[0] == z[-1]:
            first = int(np.argmax(np.abs(z - z.mean())))  # A corner of the hull.
            z = np.append(np.roll(z[:-1], -first), z[first])
        z = _points(shapely.simplify(_line(z), tolerance))
        found += [
            _Side(complex(a), complex((b - a) / abs(b - a)), float(abs(b - a)))
            for a, b in pairwise(z)
            if a != b
        ]
    return found


def _touched(
    body: BaseGeometry, wall: BaseGeometry, sides: Sequence[_Side], at: complex, touch: float
) -> _Side | None:
    """Return the side of a wall at which a body touches it; None: there are several.

    It separates both.  At a corner or a round part of the wall it is the side of the body.
    """
    disc, here = _disc(at, AROUND * touch), shapely.Point(at.real, at.imag)
    own, others = _points(body.intersection(disc)), _points(wall.intersection(disc))
    edges = _sides(body.boundary.intersection(disc), 0.25 * touch)
    near = [side for side in sides if side.line().distance(here) <= touch]
    found: list[tuple[float, _Side]] = []
    for side in (*edges, *near):
        heights, beyond = side.heights(own), side.heights(others)
        above = max(-heights.min(), beyond.max())
        below = max(heights.max(), -beyond.min())
        found.append((min(above, below), side))
    least, best = min(found, key=lambda one: one[0])
    fitting = [side for violation, side in found if violation <= 2.0 * touch]
    if least > 2.0 * touch or any(_turned(side, best) > TURN_MAX for side in fitting):
        return None
    parallel = [side for side in near if _turned(side, best) <= SQUARE_MAX]
    longest = max(parallel, key=lambda side: side.length, default=None)
    return longest or _Side(at, best.along, 0.0)


def _turned(one: _Side, other: _Side) -> float:
    """Return the sine of the angle between two sides."""
    return abs((one.along * other.along.conjugate()).imag)


def _disc(z: complex, radius: float) -> shapely.Polygon:
    return shapely.Point(z.real, z.imag).buffer(radius)


def _place(body: BaseGeometry, side: _Side, apart: complex, touch: float) -> complex:
    """Return the hit point: in front of the middle of the side, or of its part beside the body.

    ``apart`` is the vector from the side to the body [m].
    """
    ends = side.start + apart + np.array([0.0, side.length]) * side.along
    band = _line(ends).buffer(touch, cap_style="square").intersection(body.boundary)
    z = _points(band)
    if not len(z):  # The side is beside the body.
        corners = _points(body)
        z = corners[np.abs(side.heights(corners) - side.heights(ends)[0]) <= touch]
    places = ((z - side.start) / side.along).real
    low, middle, high = float(places.min()), 0.5 * side.length, float(places.max())
    if not low - touch <= middle <= high + touch and low < side.length and high > 0.0:
        middle = 0.5 * (max(low, 0.0) + min(high, side.length))
    return complex(side.start + apart + min(max(middle, low), high) * side.along)
