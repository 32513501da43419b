"""The material of a plate from the curves of its outline."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..mechanics.arrays import Complex, Real
from .curves import Curve, DrawingError, diagonal

SAME_RTOL = 1e-7  # Ends of curves that are nearer than this share of the drawing coincide.
GAP_RTOL = 1e-4  # Default of the largest closed gap, as a share of the diagonal.
SLIVER_RTOL = 1e-7  # Areas below this share of the square of the diagonal are round-off.
LIMIT_GROWTH = 3.0  # Growth of the limit below which ends are joined, in steps.
ALIKE_SHARE = 0.05  # Distance of two lines that are the same, over their length.
SAMPLES = 3  # Inner points at which two curves with the same ends are compared.
LISTED_MAX = 5  # Places in a message.


@dataclass
class Plate:
    """The material of a plate.

    Parameters
    ----------
    shape : MultiPolygon
        The material; parts of it may be apart [m].
    notes : list of str
        Gaps that were closed, duplicates that were removed.
    loose : list of complex
        Free ends of curves that are not part of an outline [m].
    """

    shape: shapely.MultiPolygon
    notes: list[str] = field(default_factory=list)
    loose: list[complex] = field(default_factory=list)


def plate(curves: Sequence[Curve], gap: float | None = None) -> Plate:
    """Return the material of a plate.

    An area is material if an even number of outlines surround it: holes are outlines in outlines.

    Parameters
    ----------
    curves : sequence of Curve
        The curves, in any order and direction.
    gap : float or None
        Largest distance of two ends of curves that are joined [m]; None: 1e-4 of the diagonal.

    Raises
    ------
    DrawingError
        If no curves form an outline.
    """
    size = diagonal(curves)
    gap = GAP_RTOL * size if gap is None else gap
    notes: list[str] = []
    lines = _distinct(
        [curve.z for curve in curves if np.ptp(np.abs(curve.z - curve.z[0])) > 0.0],
        max(gap, SAME_RTOL * size),
        notes,
    )
    _join(lines, SAME_RTOL * size, gap, notes)
    noded = shapely.unary_union([shapely.LineString(_pairs(z)) for z in lines])
    faces, cuts, dangles, _ = shapely.polygonize_full([noded])
    found = [
        face
        for face in faces.geoms
        if isinstance(face, shapely.Polygon) and face.area > SLIVER_RTOL * size**2
    ]
    loose = [
        complex(*line.coords[k]) for part in (cuts, dangles) for line in part.geoms for k in (0, -1)
    ]
    if not found:
        raise DrawingError("no curves form a closed outline; " + _open(lines, gap))
    shape = shapely.unary_union(_material(found))
    parts = [
        shapely.orient_polygons(part)
        for part in shapely.get_parts(shape)
        if isinstance(part, shapely.Polygon)
    ]
    return Plate(shapely.MultiPolygon(parts), notes, _far_apart(loose, gap))


def _pairs(z: Complex) -> Real:
    return np.column_stack([z.real, z.imag])


def _distinct(lines: Sequence[Complex], near: float, notes: list[str]) -> list[Complex]:
    """Return lines without those that are drawn twice."""
    kept: list[Complex] = []
    grid: dict[tuple[int, int], list[int]] = defaultdict(list)
    for z in lines:
        middle = _at(z, 0.5)
        cell = round(middle.real / (4 * near)), round(middle.imag / (4 * near))
        nearby = (
            i for dx in (-1, 0, 1) for dy in (-1, 0, 1) for i in grid[cell[0] + dx, cell[1] + dy]
        )
        close = min(near, ALIKE_SHARE * float(np.abs(np.diff(z)).sum()))
        if not any(_alike(z, kept[i], close) for i in nearby):
            grid[cell].append(len(kept))
            kept.append(z.copy())
    if len(kept) < len(lines):
        notes.append(f"{len(lines) - len(kept)} curves are drawn twice: counted once")
    return kept


def _at(z: Complex, share: float) -> complex:
    """Return the point at a share of the length of a line."""
    s = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
    x = share * s[-1]
    return complex(np.interp(x, s, z.real), np.interp(x, s, z.imag))


def _alike(one: Complex, other: Complex, near: float) -> bool:
    """Return whether two lines are the same, in either direction."""
    shares = np.linspace(0.0, 1.0, SAMPLES + 2)
    a = np.array([_at(one, x) for x in shares])
    b = np.array([_at(other, x) for x in shares])
    return any(float(np.abs(a - c).max()) <= near for c in (b, b[::-1]))


def _join(lines: list[Complex], same: float, gap: float, notes: list[str]) -> None:
    """Move ends of lines together: first those that coincide, then those with growing gaps.

    An end that has been joined stays, so that short lines and the corners of thin leaves remain.
    """
    ends = [(i, k) for i, z in enumerate(lines) for k in (0, -1)]
    z = np.array([lines[i][k] for i, k in ends])
    waiting = np.arange(len(z))
    closed: list[tuple[float, complex]] = []
    limit = same
    while len(waiting):
        groups = _groups(z[waiting], limit)
        sizes = np.bincount(groups)
        for g in np.flatnonzero(sizes > 1):
            members = waiting[groups == g]
            spread = float(np.abs(z[members] - z[members].mean()).max())
            if limit > same:
                closed.append((2.0 * spread, complex(z[members].mean())))
            z[members] = z[members].mean()
        waiting = waiting[sizes[groups] == 1]
        if limit >= gap:
            break
        limit = min(LIMIT_GROWTH * limit, gap)
    for (i, k), value in zip(ends, z, strict=True):
        lines[i][k] = value
    if closed:
        widest = sorted(closed, key=lambda one: -one[0])[:LISTED_MAX]
        places = ", ".join(f"({1e3 * at.real:.5g}, {1e3 * at.imag:.5g})" for _, at in widest)
        count = "a gap was" if len(closed) == 1 else f"{len(closed)} gaps were"
        among = ", among others" if len(closed) > LISTED_MAX else ""
        notes.append(f"{count} closed, of at most {1e3 * widest[0][0]:.2g} mm: {places} mm{among}")


def _groups(z: Complex, limit: float) -> NDArray[np.int64]:
    """Return the number of the group of each point; points nearer than a limit form a group."""
    group = np.arange(len(z), dtype=np.int64)
    if len(z) > 1:
        for a, b in cKDTree(_pairs(z)).query_pairs(limit):
            one, other = group[a], group[b]
            if one != other:
                group[group == max(one, other)] = min(one, other)
    return group


def _material(faces: Sequence[shapely.Polygon]) -> list[shapely.Polygon]:
    """Return the faces that an even number of other faces surround."""
    filled = [shapely.Polygon(face.exterior) for face in faces]
    inner = [face.representative_point() for face in faces]
    tree = shapely.STRtree(filled)
    pairs = tree.query(inner, predicate="within")
    depth = np.bincount(pairs[0], minlength=len(faces)) - 1
    return [face for face, d in zip(faces, depth.tolist(), strict=True) if d % 2 == 0]


def _far_apart(points: Sequence[complex], near: float) -> list[complex]:
    """Return points without repetitions."""
    kept: list[complex] = []
    for z in points:
        if all(abs(z - other) > near for other in kept):
            kept.append(z)
    return kept


def open_ends(loose: Sequence[complex]) -> str:
    """Return a sentence with the places of ends of lines that meet nothing; empty without them."""
    if not loose:
        return ""
    places = ", ".join(f"({1e3 * z.real:.5g}, {1e3 * z.imag:.5g})" for z in loose[:LISTED_MAX])
    more = f" and {len(loose) - LISTED_MAX} others" if len(loose) > LISTED_MAX else ""
    return (
        f"lines end at {places}{more} mm without meeting another: the outline is open there; "
        "close it, or join ends that are near with --gap"
    )


def _open(lines: Sequence[Complex], gap: float) -> str:
    """Return the places of open ends with the distance of the next end, and the remedy."""
    z = np.array([line[k] for line in lines for k in (0, -1)])
    if len(z) < 2:
        return "draw the outline of the plate"
    apart = np.asarray(cKDTree(_pairs(z)).query(_pairs(z), 2)[0])[:, 1]
    found = [k for k in np.argsort(-apart) if apart[k] > 0.0][:LISTED_MAX]
    if not found:
        return "draw the outline of the plate"
    places = ", ".join(f"({1e3 * z[k].real:g}, {1e3 * z[k].imag:g})" for k in found)
    return (
        f"there are gaps of up to {1e3 * float(apart[found[0]]):.3g} mm at {places} mm; close "
        f"them, or increase --gap, now {1e3 * gap:.2g} mm"
    )
