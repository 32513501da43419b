"""The walls of a plate: its sides, with the material on their left, and chords across it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from ..mechanics.arrays import Complex, Real

ANTIPARALLEL_MAX = -0.5  # Largest scalar product of the normals of two opposite walls.
SIDES_MAX = 1000  # Sides that are searched without a tree.
SAMPLES_PER_SIZE = 60  # Samples of walls along the diagonal of the plate.


@dataclass(frozen=True)
class Hit:
    """Where a ray meets a wall.

    Parameters
    ----------
    distance : float
        Distance from the start of the ray [m].
    side : int
        Index of the side.
    place : float
        Position along the ring of the side [m].
    """

    distance: float
    side: int
    place: float


class Walls:
    """The sides of all rings of a plate.

    Parameters
    ----------
    shape : MultiPolygon
        The material, with exteriors counter-clockwise and holes clockwise [m].
    """

    def __init__(self, shape: shapely.MultiPolygon) -> None:
        rings = [ring for part in shape.geoms for ring in (part.exterior, *part.interiors)]
        corners = [np.array(ring.coords)[:, 0] + 1j * np.array(ring.coords)[:, 1] for ring in rings]
        corners = [z[np.append(True, np.abs(np.diff(z)) > 0.0)] for z in corners]
        self.rings = corners
        self.a = np.concatenate([z[:-1] for z in corners])
        self.b = np.concatenate([z[1:] for z in corners])
        self.ring = np.concatenate([np.full(len(z) - 1, i) for i, z in enumerate(corners)])
        lengths = [np.abs(np.diff(z)) for z in corners]
        self.start = np.concatenate([np.cumsum(x) - x for x in lengths])
        self.perimeter = np.array([x.sum() for x in lengths])
        self.length = np.abs(self.b - self.a)
        self.normal: Complex = 1j * (self.b - self.a) / self.length
        low, high = (complex(*shape.bounds[k : k + 2]) for k in (0, 2))
        self.size = abs(high - low)

    @cached_property
    def _tree(self) -> shapely.STRtree:
        """The sides by their places."""
        lines: Any = shapely.linestrings(np.stack([_pairs(self.a), _pairs(self.b)], axis=1))
        return shapely.STRtree(lines)

    def hit(self, z: complex, direction: complex, reach: float) -> Hit | None:
        """Return the first wall that a ray from inside the material meets; None from outside.

        Parameters
        ----------
        z, direction : complex
            Start of the ray [m] and its unit vector.
        reach : float
            A length in which a wall is expected [m]; other walls are found later.
        """
        if len(self.a) <= SIDES_MAX:
            return self._first(z, direction, np.arange(len(self.a)))
        for length in (reach, 2.0 * self.size):
            end = z + length * direction
            box = shapely.box(
                min(z.real, end.real), min(z.imag, end.imag),
                max(z.real, end.real), max(z.imag, end.imag),
            )  # fmt: skip
            found = self._first(z, direction, np.sort(self._tree.query(box)))
            if found is not None and found.distance <= length:
                return found
        return None

    def _first(self, z: complex, direction: complex, sides: NDArray[np.int64]) -> Hit | None:
        """Return the first of some sides that a ray meets; None from outside the material."""
        a, step = self.a[sides], self.b[sides] - self.a[sides]
        across = (np.conj(direction) * step).imag
        with np.errstate(divide="ignore", invalid="ignore"):
            before = a - z
            t = (np.conj(before) * step).imag / across
            share = (np.conj(before) * direction).imag / across
        valid = (t > 0.0) & (share >= 0.0) & (share <= 1.0)
        if not valid.any():
            return None
        i = int(np.argmin(np.where(valid, t, np.inf)))
        k = int(sides[i])
        if (np.conj(direction) * self.normal[k]).real >= 0.0:  # From outside the material.
            return None
        return Hit(float(t[i]), k, float(self.start[k] + share[i] * self.length[k]))

    def advance(self, before: Hit, after: Hit) -> float:
        """Return the distance along a wall from one hit to another [m], infinite between rings."""
        ring = self.ring[before.side]
        if self.ring[after.side] != ring:
            return np.inf
        whole = float(self.perimeter[ring])
        return float((after.place - before.place + whole / 2) % whole - whole / 2)

    def chords(self, longest: float) -> "Chords":
        """Return the chords across the material from the middles of sides, the shortest first.

        Parameters
        ----------
        longest : float
            Length of the longest chord [m].
        """
        counts = np.maximum(np.ceil(self.length * SAMPLES_PER_SIZE / self.size), 1).astype(int)
        side = np.repeat(np.arange(len(self.a)), counts)
        first = np.repeat(np.cumsum(counts) - counts, counts)
        share = (np.arange(len(side)) - first + 0.5) / counts[side]
        z = self.a[side] + share * (self.b[side] - self.a[side])
        normal = self.normal[side]
        rays = shapely.linestrings(np.stack([_pairs(z), _pairs(z + longest * normal)], axis=1))
        ray, other = self._tree.query(rays, predicate="intersects")
        apart = other != side[ray]
        ray, other = ray[apart], other[apart]
        step = self.b[other] - self.a[other]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (np.conj(self.a[other] - z[ray]) * step).imag / (np.conj(normal[ray]) * step).imag
        t = np.where(np.isfinite(t) & (t > 1e-9 * self.size), t, np.inf)
        nearest = np.full(len(z), np.inf)
        np.minimum.at(nearest, ray, t)
        facing = (np.conj(normal[ray]) * self.normal[other]).real < ANTIPARALLEL_MAX
        chosen = np.flatnonzero((t == nearest[ray]) & facing & np.isfinite(t))
        chosen = chosen[np.argsort(t[chosen], kind="stable")]
        k = ray[chosen]
        place = self.start[side[k]] + share[k] * self.length[side[k]]
        return Chords(z[k], normal[k], t[chosen], self.ring[side[k]], place)


@dataclass(frozen=True)
class Chords:
    """Chords across the material, from points of walls along their normals.

    Parameters
    ----------
    z, normal : (n,) complex
        Start [m] and direction of each chord.
    length : (n,)
        Length [m].
    ring, place : (n,)
        Ring of the start, and position along it [m].
    """

    z: Complex
    normal: Complex
    length: Real
    ring: Real
    place: Real


def _pairs(z: Complex) -> Real:
    return np.column_stack([z.real, z.imag])
