"""Bodies and flexures of a plate.

Thin parts are flexures if both ends open into something thicker, or if they are slender and not
thicker than such flexures.  What remains of the plate without the flexures are the bodies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from ..mechanics.arrays import Complex
from ..mechanism.flexure import NOTCH
from .curves import DrawingError
from .plates import Plate
from .profiles import Shape, shape_of
from .tracing import STEPS_TOTAL_MAX, End, Trace, Tracer
from .walls import Walls

LONGEST_SHARE = 0.25  # Largest thickness of a flexure, as a share of the diagonal.
SLENDER_MIN = 4.0  # Least length of a leaf over its thickness.
OPENING_MIN = 1.6  # Least width behind an end over the thickness of the flexure,
JUNCTION_MIN = 8.0  # unless the flexure is at least so slender,
JUNCTION_THICKNESS = 1.2  # and at most so much thicker than the others.
NOTCH_OPENING_MIN = 1.5  # Least thickness beside a notch over that of its waist.
COMPLIANCE_MIN = 1e-4  # Least compliance of a flexure over that of the most compliant one.
DEPTHS = np.linspace(0.2, 4.0, 20)  # Where the width behind an end is measured, over thickness.
CUT_RTOL = 1e-6  # Overlap of a cut with the bodies, as a share of the size.
DUST_SHARE = 0.02  # Pieces with a smaller area over the square of the thickness are no bodies.


@dataclass(frozen=True)
class Found:
    """A flexure in a plate.

    Parameters
    ----------
    shape : Shape
        Its kind and dimensions.
    trace : Trace
        The part of the plate.
    band : Polygon
        Its material [m].
    bodies : pair of int
        Indices of the bodies at its start and its end.
    """

    shape: Shape
    trace: Trace
    band: shapely.Polygon
    bodies: tuple[int, int] = (-1, -1)


@dataclass
class Recognised:
    """Bodies and flexures of a plate.

    Parameters
    ----------
    plate : Plate
        The plate.
    bodies : list of Polygon or MultiPolygon
        The bodies, among them the ground [m]; a body of several plates has several polygons.
    flexures : list of Found
        The flexures between them.
    ground : set of int
        Indices of the bodies that are fixed.
    doubts : list of (complex, str)
        What was not understood, with its place [m].
    noise : float
        Accuracy of the coordinates [m].
    """

    plate: Plate
    bodies: list[shapely.Polygon | shapely.MultiPolygon]
    flexures: list[Found]
    ground: set[int] = field(default_factory=set)
    doubts: list[tuple[complex, str]] = field(default_factory=list)
    noise: float = 0.0

    @property
    def size(self) -> float:
        """Diagonal of the plate [m]."""
        low, high = (complex(*self.plate.shape.bounds[k : k + 2]) for k in (0, 2))
        return abs(high - low)


def recognised(plate: Plate, noise: float, thickest: float | None = None) -> Recognised:
    """Return the bodies and the flexures of a plate.

    Parameters
    ----------
    plate : Plate
        The plate.
    noise : float
        Accuracy of the coordinates [m].
    thickest : float or None
        Largest thickness of a flexure [m]; None: what is thin beside the bodies.

    Raises
    ------
    DrawingError
        If there is no flexure.
    """
    walls = Walls(plate.shape)
    doubts: list[tuple[complex, str]] = []
    candidates = _candidates(walls, noise, thickest, doubts)
    chosen = _chosen(walls, plate.shape, candidates, thickest, doubts)
    if not chosen:
        raise DrawingError(
            "no flexures were found: no part is thin between two thicker ones; check the unit of "
            "the drawing, or give --flexures-below"
        )
    bodies, flexures = _divided(walls, plate.shape, chosen, doubts)
    return Recognised(plate, [*bodies], flexures, doubts=doubts, noise=noise)


def _candidates(
    walls: Walls, noise: float, thickest: float | None, doubts: list[tuple[complex, str]]
) -> list[Found]:
    """Return the thin parts with their shapes, the thinnest first."""
    longest = LONGEST_SHARE * walls.size if thickest is None else thickest
    found: list[Found] = []
    tracer = Tracer(walls)
    for trace in tracer.parts(longest):
        if any(end not in (End.CORNER, End.THICK) for end in trace.ends):
            continue
        if trace.length < 0.5 * trace.thinnest:
            continue
        shape = shape_of(walls, trace, noise)
        if shape is None:
            continue
        long = trace.length >= SLENDER_MIN * trace.thinnest
        if long or _is_notch(shape, trace):
            left, right = trace.edges(walls)
            band = shapely.Polygon([(z.real, z.imag) for z in (*left, *right[::-1])])
            found.append(Found(shape, trace, band))
    if tracer.steps > STEPS_TOTAL_MAX:
        doubts.append((complex(walls.a[0]), "an intricate outline: thick parts were not examined"))
    return found


def _is_notch(shape: Shape, trace: Trace) -> bool:
    return shape.profile == NOTCH and bool(
        min(trace.width[0], trace.width[-1]) >= NOTCH_OPENING_MIN * trace.thinnest
    )


def _chosen(
    walls: Walls,
    shape: shapely.MultiPolygon,
    candidates: Sequence[Found],
    thickest: float | None,
    doubts: list[tuple[complex, str]],
) -> list[Found]:
    """Return the candidates that are flexures."""
    if thickest is not None:
        return list(candidates)
    shapely.prepare(shape)
    boundary = shape.boundary
    openings = [_openings(shape, boundary, one.trace) for one in candidates]
    strong = [min(o) >= OPENING_MIN for o in openings]
    sure = [one.trace for one, s in zip(candidates, strong, strict=True) if s]
    if not sure:
        return []
    most = max(trace.compliance for trace in sure)
    thick = max(trace.thinnest for trace in sure if trace.compliance >= COMPLIANCE_MIN * most)
    chosen = []
    for one, s in zip(candidates, strong, strict=True):
        trace = one.trace
        slender = trace.length >= JUNCTION_MIN * trace.thinnest
        weak = slender and trace.thinnest <= JUNCTION_THICKNESS * thick
        if (s or weak) and trace.compliance >= COMPLIANCE_MIN * most:
            chosen.append(one)
        elif s:
            doubts.append(
                (
                    complex(trace.z[len(trace.z) // 2]),
                    f"{1e3 * trace.thinnest:.3g} mm thick: part of a body, because other "
                    f"flexures are more than {1 / COMPLIANCE_MIN:g} times as compliant",
                )
            )
    return chosen


def _openings(
    shape: shapely.MultiPolygon, boundary: shapely.Geometry, trace: Trace
) -> tuple[float, float]:
    """Return the widths of the material behind both ends over the thickness."""
    thickness = trace.thinnest
    ratios = []
    for k, tangent in zip((0, -1), trace.tangents, strict=True):
        z = trace.z[k] + DEPTHS * thickness * tangent
        points = shapely.points(z.real, z.imag)
        outside = ~shapely.contains(shape, points)
        inside = points[: int(np.argmax(outside))] if outside.any() else points
        widths = 2.0 * shapely.distance(inside, boundary)
        ratios.append(float(widths.max()) / thickness if len(widths) else 0.0)
    return ratios[0], ratios[1]


def _divided(
    walls: Walls,
    shape: shapely.MultiPolygon,
    chosen: list[Found],
    doubts: list[tuple[complex, str]],
) -> tuple[list[shapely.Polygon], list[Found]]:
    """Return the bodies and the flexures with their bodies; loops at one body belong to it."""
    while True:
        eps = CUT_RTOL * walls.size
        bands = [one.band.buffer(eps, join_style="mitre") for one in chosen]
        rest = shapely.difference(shape, shapely.unary_union(bands))
        dust = DUST_SHARE * min(one.trace.thinnest for one in chosen) ** 2
        pieces = [part for part in shapely.get_parts(rest) if part.area > dust]
        if not pieces:
            raise DrawingError("no bodies were found: the whole plate is thin")
        tree = shapely.STRtree(pieces)
        joined = [replace(one, bodies=_ends(tree, one, eps)) for one in chosen]
        loops = [one for one in joined if one.bodies[0] == one.bodies[1]]
        for one in loops:
            middle = complex(one.trace.z[len(one.trace.z) // 2])
            doubts.append((middle, "a thin part with both ends at the same body: part of it"))
        kept = [k for k, one in enumerate(joined) if one.bodies[0] != one.bodies[1]]
        if not kept:
            raise DrawingError("no flexures were found: no thin part joins two bodies")
        if not loops:
            return pieces, joined
        chosen = [chosen[k] for k in kept]


def _ends(tree: shapely.STRtree, one: Found, eps: float) -> tuple[int, int]:
    """Return the indices of the pieces behind both ends of a flexure."""
    trace = one.trace
    behind: list[Complex] = []
    for k, tangent in zip((0, -1), trace.tangents, strict=True):
        behind.append(trace.z[k] + max(5.0 * eps, 0.05 * trace.thinnest) * tangent)
    points = shapely.points(np.real(behind), np.imag(behind))
    start, end = (int(i) for i in np.atleast_1d(tree.nearest(points)))
    first = np.abs(one.shape.start - trace.z[0]) <= np.abs(one.shape.start - trace.z[-1])
    return (start, end) if first else (end, start)
