"""The ground and the stops of a plate, from marks in its drawing and from given points."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from .curves import GROUND, STOPS, Curve, Curves, DrawingError
from .recognition import Recognised

NEAR_SHARE = 0.25  # Largest distance of a stop from a body, as a share of the diagonal.
TOUCHING_SHARE = 1e-3  # Largest distance of a wall from the body that carries it.


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
        found.ground.add(_largest(found))
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
    """Return the stops: lines on the layer ``stops``, each near a body."""
    stops = []
    used = {k for one in found.flexures for k in one.bodies}
    for curve in curves.on(STOPS):
        stop = _stop(found, curve, used) if len(curve.z) > 1 else None
        if stop is None:
            found.doubts.append(
                (complex(curve.z.mean()), "a line on the layer stops is near no moving body")
            )
        else:
            stops.append(stop)
    return stops


def _stop(found: Recognised, curve: Curve, used: set[int]) -> FoundStop | None:
    """Return the stop of a line, the nearest moving body hits it."""
    size = _size(found)
    line = shapely.LineString([(z.real, z.imag) for z in curve.z])
    distances = shapely.distance(found.bodies, line)
    order = [int(k) for k in np.argsort(distances) if int(k) in used]
    touching = [k for k in order if distances[k] <= TOUCHING_SHARE * size]
    on = next((k for k in touching if k not in found.ground), -1) if len(touching) else -1
    moving = [k for k in order if k not in found.ground and (k != on or len(touching) > 1)]
    others = [k for k in moving if k != on]
    if on >= 0 and not others:  # The wall touches the body that hits it: the gap is zero.
        others, on = [on], -1
    if not others or distances[others[0]] > NEAR_SHARE * size:
        return None
    body = others[0]
    along = curve.z[-1] - curve.z[0]
    normal = 1j * along / abs(along)
    outline = shapely.get_coordinates(found.bodies[body])
    corners = outline[:, 0] + 1j * outline[:, 1]
    reach = ((corners - curve.z[0]) * np.conj(normal)).real
    if abs(float(reach.max())) < abs(float(reach.min())):  # The body is on the negative side.
        direction, reach = complex(normal), reach
    else:
        direction, reach = complex(-normal), -reach
    first = float(reach.max())
    flat = corners[reach >= first - TOUCHING_SHARE * size]
    places = ((flat - curve.z[0]) / (along / abs(along))).real
    low, high = np.clip([places.min(), places.max()], 0.0, abs(along))
    spot = curve.z[0] + 0.5 * (low + high) * along / abs(along) + first * direction
    point = complex(spot) if abs(places.max() - places.min()) > 0.0 else complex(flat[0])
    return FoundStop(body, on, point, direction, max(-first, 0.0))
