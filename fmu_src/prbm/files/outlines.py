"""Mass, moment of inertia and centre of mass of a body that is cut from a plate."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from ..base.errors import MechanismError
from ..mechanics.arrays import Complex, Real
from ..mechanism.expressions import Affine, Quantity, affine
from ..mechanism.parts import Point
from .images import same, written

CORNERS_MIN = 3
CORNERS_MAX = 1000  # Corners of an outline; every pair of its sides is checked.
LENGTH_MIN = 1e-60  # m; the fourth powers of shorter lengths lose digits.
TOUCHING_RTOL = 1e-9  # Sides that are nearer than this share of the size of an outline touch.


@dataclass(frozen=True)
class Area:
    """Area, centroid and polar second moment of an area.

    Parameters
    ----------
    area : float
        Area [m^2]; negative for a hole.
    centre : complex
        Centroid [m].
    moment : float
        Polar second moment about the centroid [m^4]; negative for a hole.
    """

    area: float
    centre: complex
    moment: float

    def plus(self, other: "Area") -> "Area":
        """Return the sum of two areas (parallel axes)."""
        area = self.area + other.area
        centre = (self.area * self.centre + other.area * other.centre) / area
        moment = sum(one.moment + one.area * abs(one.centre - centre) ** 2 for one in (self, other))
        return Area(area, centre, moment)


def polygon(corners: Sequence[complex] | Complex) -> Area:
    """Return area, centroid and polar second moment of a simple polygon (shoelace formulas).

    Parameters
    ----------
    corners : (n,)
        Corners in either sense of rotation [m].

    Examples
    --------
    >>> polygon([0, 4, 4 + 3j, 3j])
    Area(area=12.0, centre=(2+1.5j), moment=25.0)
    """
    z = np.array(corners, complex)
    origin = z.mean()
    z = z - origin
    following = np.roll(z, -1)
    twice = (z.conj() * following).imag  # twice the areas of the triangles with the origin
    area = float(twice.sum()) / 2.0
    offset = complex(((z + following) @ twice) / (6.0 * area))
    squares = np.abs(z) ** 2 + (z.conj() * following).real + np.abs(following) ** 2
    moment = float(twice @ squares) / 12.0 - area * abs(offset) ** 2
    return Area(abs(area), complex(origin) + offset, abs(moment))


def plate(
    name: str,
    outline: Sequence[Point],
    holes: Sequence[Sequence[Point]],
    thickness: float,
    density: Quantity,
    payload: Quantity = 0.0,
) -> dict[str, Quantity | Point]:
    """Return mass, inertia and centre of a body that is cut from a plate.

    Parameters
    ----------
    name : str
        Name of the body.
    outline : sequence of Point
        Corners of the outline [m].
    holes : sequence of sequences of Point
        Corners of the holes [m].
    thickness : float
        Thickness of the plate, across the plane of motion [m].
    density : Quantity
        Density [kg/m^3].
    payload : Quantity
        Mass of a point that is added at the centre of mass [kg].

    Returns
    -------
    dict
        ``mass`` [kg], that of the plate in proportion to the density, ``inertia`` [kg m^2] in
        proportion to it, and ``centre`` [m].

    Raises
    ------
    MechanismError
        If the outline crosses itself, a hole is not inside it, or parameters change its shape.
    """
    corner = outline[0]
    outer = _shape(f"{name}.outline", outline, corner)
    inner = [_shape(f"{name}.holes", hole, corner) for hole in holes]
    for hole in inner:
        if _touching(outer, hole) or not _inside(outer, hole[0]):
            raise MechanismError(
                f"{name}.holes: a hole at {_place(hole[0], corner)} is not inside the outline; "
                "move or remove it"
            )
    for i, hole in enumerate(inner):
        for other in inner[:i]:
            if _touching(hole, other) or _inside(hole, other[0]) or _inside(other, hole[0]):
                raise MechanismError(
                    f"{name}.holes: the holes at {_place(other[0], corner)} and "
                    f"{_place(hole[0], corner)} overlap; move one or join them"
                )
    cut = (polygon(hole) for hole in inner)
    negative = (Area(-one.area, one.centre, -one.moment) for one in cut)
    total = reduce(Area.plus, negative, polygon(outer))
    parts = zip(corner, (total.centre.real, total.centre.imag), strict=True)
    x, y = (written(affine(c).plus(Affine(offset))) for c, offset in parts)
    per_density = affine(density).scaled(thickness)
    return {
        "mass": written(per_density.scaled(total.area).plus(affine(payload))),
        "inertia": written(per_density.scaled(total.moment)),
        "centre": (x, y),
    }


def mean(corners: Sequence[Point]) -> Point:
    """Return the mean of corners, which may depend on parameters [m]."""
    x, y = (
        written(reduce(Affine.plus, map(affine, along)).scaled(1.0 / len(corners)))
        for along in zip(*corners, strict=True)
    )
    return x, y


def _shape(key: str, corners: Sequence[Point], origin: Point) -> Complex:
    """Return the corners of a simple polygon relative to a point [m]; reject other ones."""
    if not CORNERS_MIN <= len(corners) <= CORNERS_MAX:
        raise MechanismError(
            f"{key} has {len(corners)} corners: write {CORNERS_MIN} to {CORNERS_MAX} corners, [x, "
            "y] each"
        )
    relative = []
    for corner in corners:
        x, y = (affine(a).plus(affine(b).scaled(-1.0)) for a, b in zip(corner, origin, strict=True))
        if not same((written(x), written(y)), (x.constant, y.constant)):
            changed = next(name for name, c in {**x.terms, **y.terms}.items() if c)
            raise MechanismError(
                f"{key} changes its shape with {changed}: write its dimensions as numbers, with "
                "at most the same parameters added to all corners; or give mass, inertia and centre"
            )
        relative.append(complex(x.constant, y.constant))
    z = np.array(relative)
    lengths = np.abs(np.roll(z, -1) - z)
    if 0.0 < lengths.max() < LENGTH_MIN:
        raise MechanismError(
            f"{key}: its longest side of {lengths.max():.3g} m is too short for a mass; write "
            "lengths in metres, or with a unit"
        )
    if not lengths.min() > TOUCHING_RTOL * lengths.max():
        twice = _place(z[int(np.argmin(lengths))], origin)
        raise MechanismError(f"{key} has the corner {twice} twice: remove one")
    crossing = _self_touching(z)
    if crossing is not None:
        i, j = crossing
        raise MechanismError(
            f"{key} crosses or touches itself: at its sides that begin at {_place(z[i], origin)} "
            f"and {_place(z[j], origin)}; write its corners in order around the body"
        )
    return z


def _place(z: complex, origin: Point) -> str:
    """Return the coordinates of a point, without its parameters if it has any."""
    x, y = (affine(c).constant for c in origin)
    return f"({x + z.real:g} m, {y + z.imag:g} m)"


def _self_touching(z: Complex) -> tuple[int, int] | None:
    """Return two sides of a polygon that touch outside a common corner, None without such sides."""
    n, limit = len(z), TOUCHING_RTOL * float(np.abs(z - z.mean()).max())
    following = np.roll(z, -1)
    for i in range(n):
        before, after = (i - 1) % n, (i + 1) % n
        near = _nearest(z[i], following[i], following[after])
        if not min(near, _nearest(following[i], following[after], z[i])) > limit:
            return i, after  # The next side returns along this side.
        others = np.array([j for j in range(n) if j not in (before, i, after)], int)
        if len(others):
            meet = _meeting(z[i], following[i], z[others], following[others], limit)
            if meet.any():
                return i, int(others[int(np.argmax(meet))])
    return None


def _touching(one: Complex, other: Complex) -> bool:
    """Return whether the sides of two polygons touch."""
    limit = TOUCHING_RTOL * float(np.abs(one - one.mean()).max())
    sides = zip(one, np.roll(one, -1), strict=True)
    return any(_meeting(a, b, other, np.roll(other, -1), limit).any() for a, b in sides)


def _meeting(a: complex, b: complex, c: Complex, d: Complex, limit: float) -> Real:
    """Return whether the line from a to b meets the lines from c to d, or nearly does."""
    side_c, side_d = (((b - a).conjugate() * (z - a)).imag for z in (c, d))
    side_a, side_b = (((d - c).conj() * (z - c)).imag for z in (a, b))
    crossing = (side_c * side_d < 0.0) & (side_a * side_b < 0.0)
    near = np.minimum.reduce(
        [_distance(a, b, c), _distance(a, b, d), _distance(c, d, a), _distance(c, d, b)]
    )
    result: Real = crossing | (near <= limit)
    return result


def _nearest(a: complex, b: complex, z: complex) -> float:
    """Return the distance of a point from the line between two points."""
    return float(_distance(a, b, np.array([z]))[0])


def _distance(a: complex | Complex, b: complex | Complex, z: complex | Complex) -> Real:
    """Return the distances of points from the lines between two points."""
    along = np.asarray(b - a)
    length = np.maximum(np.abs(along) ** 2, np.finfo(float).tiny)
    share = np.clip((along.conj() * (z - a)).real / length, 0.0, 1.0)
    result: Real = np.abs(z - a - share * along)
    return result


def _inside(corners: Complex, z: complex) -> bool:
    """Return whether a point is inside a polygon: the angles of its sides add up to a turn."""
    reach = corners - z
    turns = float(np.angle(np.roll(reach, -1) / reach).sum()) / (2.0 * math.pi)
    return round(turns) != 0
