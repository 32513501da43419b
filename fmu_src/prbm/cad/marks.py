"""The ground of a plate, from marks in its drawing and from given points."""

from collections.abc import Sequence

import numpy as np
import shapely

from .curves import GROUND, Curve, Curves, DrawingError
from .recognition import Recognised

TOUCHING_SHARE = 1e-3  # Largest distance of a point from the body that it names.


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
    if distances[k] > TOUCHING_SHARE * found.size:
        body = found.bodies[k].representative_point()
        raise DrawingError(
            f"{user}: the point ({1e3 * z.real:g}, {1e3 * z.imag:g}) mm is on no body; the "
            f"nearest body is at ({1e3 * body.x:.4g}, {1e3 * body.y:.4g}) mm"
        )
    near = distances <= max(float(distances[k]), 1e-9 * found.size)
    return {int(i) for i in np.flatnonzero(near)}


def _marked(found: Recognised, curve: Curve) -> set[int]:
    """Return the bodies that a mark on the layer ground meets."""
    closed = len(curve.z) > 3 and abs(curve.z[0] - curve.z[-1]) < 1e-9 * found.size
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
