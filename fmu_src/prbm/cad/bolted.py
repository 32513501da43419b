"""Several plates, whose bodies are bolted together."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import shapely

from .plates import Plate
from .recognition import Recognised

HOLE_RTOL = 0.02  # Difference of the areas of two holes of one bolt.
HOLE_APART = 0.05  # Distance of their centres over their diameter.


def bolted(plates: Sequence[Recognised]) -> Recognised:
    """Return the bodies and flexures of all plates, with bolted bodies as one.

    Bodies of two plates are bolted if both have a hole at the same place.

    Parameters
    ----------
    plates : sequence of Recognised
        The plates.
    """
    if len(plates) == 1:
        return plates[0]
    polygons = [body for one in plates for body in one.bodies]
    plate_of = [k for k, one in enumerate(plates) for _ in one.bodies]
    group = [*range(len(polygons))]
    for i, j in combinations(range(len(polygons)), 2):
        if (
            plate_of[i] != plate_of[j]
            and group[i] != group[j]
            and _joined(polygons[i], polygons[j])
        ):
            old, new = group[j], group[i]
            group = [new if g == old else g for g in group]
    numbers = {g: k for k, g in enumerate(dict.fromkeys(group))}
    parts: list[list[shapely.Polygon]] = [[] for _ in numbers]
    for polygon, g in zip(polygons, group, strict=True):
        parts[numbers[g]] += _polygons(polygon)
    bodies = [one[0] if len(one) == 1 else shapely.MultiPolygon(one) for one in parts]
    flexures, doubts, first = [], [], 0
    for one in plates:
        doubts += one.doubts
        for flexure in one.flexures:
            start, end = (numbers[group[first + k]] for k in flexure.bodies)
            if start == end:
                z = complex(flexure.trace.z[len(flexure.trace.z) // 2])
                doubts.append((z, "a flexure between bodies that are bolted together: left out"))
            else:
                flexures.append(replace(flexure, bodies=(start, end)))
        first += len(one.bodies)
    whole = shapely.MultiPolygon([p for one in plates for p in _polygons(one.plate.shape)])
    notes = [note for one in plates for note in one.plate.notes]
    loose = [z for one in plates for z in one.plate.loose]
    plate = Plate(whole, notes, loose)
    return Recognised(plate, bodies, flexures, doubts=doubts, noise=plates[0].noise)


def _polygons(shape: shapely.Polygon | shapely.MultiPolygon) -> list[shapely.Polygon]:
    return [part for part in shapely.get_parts(shape) if isinstance(part, shapely.Polygon)]


def _joined(
    one: shapely.Polygon | shapely.MultiPolygon, other: shapely.Polygon | shapely.MultiPolygon
) -> bool:
    """Return whether two bodies have a hole at the same place."""
    a, b = (
        [shapely.Polygon(ring) for part in _polygons(body) for ring in part.interiors]
        for body in (one, other)
    )
    return any(
        abs(p.area - q.area) <= HOLE_RTOL * p.area
        and p.centroid.distance(q.centroid) <= HOLE_APART * p.area**0.5
        for p in a
        for q in b
    )
