"""The ground and the stops of a plate, from marks in its drawing and from given points."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.geometry.base import BaseGeometry

from ..mechanics.arrays import Complex
from .curves import GROUND, STOPS, Curve, Curves, DrawingError
from .recognition import Recognised

NEAR_SHARE = 0.25  # Largest distance of a stop from a body, as a share of the diagonal.
TOUCHING_SHARE = 1e-3  # Largest distance of a wall from the body that carries it.
SQUARE_MAX = 1e-3  # Largest inclination of a face to the shortest way between wall and body [rad].


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


def find_ground(found: Recognised, curves: Curves, points: Sequence[complex]) -> None:
    """Set the bodies that are fixed, and remove those that nothing connects to them.

    Parameters
    ----------
    found : Recognised
        The bodies and flexures.
    curves : Curves
        The drawing, whose marks on the layer ``ground`` are points or closed lines.
    points : sequence of complex
        Points of bodies that are fixed [m].

    Raises
    ------
    DrawingError
        If a point is outside all bodies, or all bodies are fixed.
    """
    for z in points:
        found.ground |= _bodies_at(found, z, "--ground")
    for curve in curves.on(GROUND):
        found.ground |= _marked(found, curve)
    if not found.ground:
        found.ground.add(largest := _largest(found))
        middle = found.bodies[largest].representative_point()
        found.plate.notes.append(
            "no ground is given: it is the body with the largest box, at "
            f"({1e3 * middle.x:.4g}, {1e3 * middle.y:.4g}) mm; choose another by --ground"
        )
    _drop_islands(found)
    if all({*one.bodies} <= found.ground for one in found.flexures):
        raise DrawingError(
            "all bodies at the flexures are ground: give the point of another body with --ground"
        )


def _bodies_at(found: Recognised, z: complex, user: str) -> set[int]:
    """Return the indices of the bodies at a point, one in each plate."""
    point = shapely.Point(z.real, z.imag)
    distances = shapely.distance(found.bodies, point)
    k = int(np.argmin(distances))
    if distances[k] > TOUCHING_SHARE * _size(found):
        body = found.bodies[k].representative_point()
        raise DrawingError(
            f"{user}: the point ({1e3 * z.real:g}, {1e3 * z.imag:g}) mm is on no body; the "
            f"nearest body is at ({1e3 * body.x:.4g}, {1e3 * body.y:.4g}) mm"
        )
    near = distances <= max(float(distances[k]), 1e-9 * _size(found))
    return {int(i) for i in np.flatnonzero(near)}


def _marked(found: Recognised, curve: Curve) -> set[int]:
    """Return the bodies that a mark on the layer ground meets."""
    closed = len(curve.z) > 3 and abs(curve.z[0] - curve.z[-1]) < 1e-9 * _size(found)
    pairs = [(z.real, z.imag) for z in curve.z]
    mark: shapely.Geometry
    if closed:
        mark = shapely.make_valid(shapely.Polygon(pairs))
    else:
        mark = shapely.LineString(pairs) if len(pairs) > 1 else shapely.Point(pairs[0])
    met = np.flatnonzero(shapely.intersects(found.bodies, mark))
    if not len(met):
        z = complex(curve.z.mean())
        found.doubts.append((z, "a mark on the layer ground meets no body"))
    return {int(k) for k in met}


def _largest(found: Recognised) -> int:
    """Return the index of the body with the largest box."""
    boxes = shapely.bounds(found.bodies)
    areas = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    return int(np.argmax(areas))


def _size(found: Recognised) -> float:
    low, high = (complex(*found.plate.shape.bounds[k : k + 2]) for k in (0, 2))
    return abs(high - low)


def _drop_islands(found: Recognised) -> None:
    """Remove bodies and flexures that nothing connects to the ground; name them."""
    held, waiting = set(found.ground), list(found.ground)
    while waiting:
        body = waiting.pop()
        for one in found.flexures:
            for near, far in (one.bodies, one.bodies[::-1]):
                if near == body and far not in held:
                    held.add(far)
                    waiting.append(far)
    for k, polygon in enumerate(found.bodies):
        if k not in held:
            z = polygon.representative_point()
            found.doubts.append(
                (complex(z.x, z.y), "nothing connects this part to the ground: left out")
            )
    found.flexures[:] = [
        one for one in found.flexures if {*one.bodies} <= held and not {*one.bodies} <= found.ground
    ]


def find_stops(found: Recognised, curves: Curves) -> list[FoundStop]:
    """Return the stops: walls on the layer ``stops``, each near a body.

    A wall is a straight line or, of a bent line, a closed shape or several joined lines, the face
    that is nearest to the body.
    """
    stops = []
    used = {k for one in found.flexures for k in one.bodies}
    for lines in _joined([c.z for c in curves.on(STOPS)], TOUCHING_SHARE * _size(found)):
        stop = _stop(found, lines, used)
        if stop is None:
            found.doubts.append(
                (complex(lines[0].mean()), "a line on the layer stops is near no moving body")
            )
        else:
            stops.append(stop)
    return stops


def _joined(lines: Sequence[Complex], near: float) -> list[list[Complex]]:
    """Return lines in groups of those that touch."""
    if not lines:
        return []
    shapes = [_geometry(z) for z in lines]
    pairs = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=near)
    graph = coo_array((np.ones(pairs.shape[1]), pairs), shape=(len(lines), len(lines)))
    count, group = connected_components(graph, directed=False)
    return [[z for z, own in zip(lines, group, strict=True) if own == g] for g in range(count)]


def _geometry(z: Complex) -> shapely.Geometry:
    pairs = np.column_stack([z.real, z.imag])
    return shapely.LineString(pairs) if np.ptp(np.abs(z - z[0])) > 0.0 else shapely.Point(pairs[0])


def _stop(found: Recognised, lines: Sequence[Complex], used: set[int]) -> FoundStop | None:
    """Return the stop of joined lines, which the nearest moving body hits."""
    size = _size(found)
    wall = shapely.unary_union([_geometry(z) for z in lines])
    distances = shapely.distance(found.bodies, wall)
    order = [int(k) for k in np.argsort(distances) if int(k) in used]
    touching = [k for k in order if distances[k] <= TOUCHING_SHARE * size]
    on = next((k for k in touching if k not in found.ground), -1) if len(touching) else -1
    moving = [k for k in order if k not in found.ground and (k != on or len(touching) > 1)]
    others = [k for k in moving if k != on]
    if on >= 0 and not others:  # The wall touches the body that hits it: the gap is zero.
        others, on = [on], -1
    if not others or distances[others[0]] > NEAR_SHARE * size or not wall.length > 0.0:
        return None
    body = others[0]
    start, along, length = _face(found.bodies[body], wall, lines, TOUCHING_SHARE * size)
    outline = shapely.get_coordinates(found.bodies[body])
    corners = outline[:, 0] + 1j * outline[:, 1]
    direction = -1j * along
    reach = ((corners - start) * np.conj(direction)).real
    if abs(float(reach.min())) < abs(float(reach.max())):  # The body is on the other side.
        direction, reach = -direction, -reach
    first = float(reach.max())
    flat = corners[reach >= first - TOUCHING_SHARE * size]
    places = ((flat - start) / along).real
    low, middle, high = places.min(), 0.5 * length, places.max()
    if not low - TOUCHING_SHARE * size <= middle <= high + TOUCHING_SHARE * size:
        middle = 0.5 * float(np.clip([low, high], 0.0, length).sum())
    spot = start + np.clip(middle, low, high) * along + first * direction
    point = complex(spot) if np.ptp(places) > 0.0 else complex(flat[0])
    return FoundStop(body, on, point, direction, max(-first, 0.0))


def _face(
    body: BaseGeometry, wall: BaseGeometry, lines: Sequence[Complex], near: float
) -> tuple[complex, complex, float]:
    """Return start, direction and length of the side of a wall that a body meets [m].

    It is a side of the wall or, where a round or a sharp part is nearest, the tangent there.
    """
    sides = np.array([(a, b) for z in lines for a, b in pairwise(z) if abs(b - a) > 0.0])
    ends = sides[:, 0], sides[:, 1]
    along = (ends[1] - ends[0]) / np.abs(ends[1] - ends[0])
    k = int(np.argmax(np.abs(ends[1] - ends[0])))
    if np.abs(((sides - ends[0][k]) * np.conj(along[k])).imag).max() > near:
        meeting = shapely.get_coordinates(shapely.shortest_line(body, wall)) @ np.array([1.0, 1j])
        gap = complex(meeting[1] - meeting[0])
        close = shapely.distance([_geometry(side) for side in sides], body) <= abs(gap) + near
        towards = gap / abs(gap) if abs(gap) > near else 0j
        square = np.abs((along * np.conj(towards)).real)  # 0: the side is square to the gap.
        square = np.where(close, square, np.inf)
        k = int(np.lexsort((-np.abs(ends[1] - ends[0]), np.round(square, 6)))[0])
        if square[k] > SQUARE_MAX:
            return complex(meeting[1]), 1j * towards, 0.0
    return complex(ends[0][k]), complex(along[k]), float(abs(ends[1][k] - ends[0][k]))
