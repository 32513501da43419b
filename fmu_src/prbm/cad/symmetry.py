"""Mirror lines of the flexures and bodies of a plate."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import affinity

from .recognition import Found, Recognised

AREA_RTOL = 2e-3  # Difference of the areas of two bodies that are mirror images.
ENDS_RTOL = 0.02  # Distance of an end from the image of another one, over the thickness.
DIMENSION_RTOL = 5e-3  # Difference of the dimensions of equal flexures.


@dataclass(frozen=True)
class Mirror:
    """A line of symmetry, x = at or y = at.

    Parameters
    ----------
    axis : str
        x or y.
    at : float
        Its coordinate [m].
    flexures, bodies : dict
        Index of the image of each flexure and body.
    """

    axis: str
    at: float
    flexures: dict[int, int]
    bodies: dict[int, int]

    def image(self, z: complex) -> complex:
        """Return the image of a point [m]."""
        if self.axis == "x":
            return complex(2.0 * self.at - z.real, z.imag)
        return complex(z.real, 2.0 * self.at - z.imag)


def mirrors(found: Recognised) -> list[Mirror]:
    """Return the lines of symmetry parallel to the axes, of all flexures and their bodies."""
    result = []
    for axis in ("x", "y"):
        for at in _candidates(found.flexures, axis):
            mirror = _mirror(found, axis, at)
            if mirror is not None:
                result.append(mirror)
                break
    return result


def alike(one: Found, other: Found, noise: float) -> bool:
    """Return whether two flexures have the same shape, or mirrored ones."""
    a, b = one.shape.dimensions, other.shape.dimensions
    if one.shape.profile != other.shape.profile or a.keys() != b.keys():
        return False
    return all(
        abs(abs(a[key]) - abs(b[key]))
        <= DIMENSION_RTOL * abs(a[key]) + (0.0 if key == "curvature" else 4.0 * noise)
        for key in a
    )


def _candidates(flexures: Sequence[Found], axis: str) -> list[float]:
    """Return the lines between pairs of flexures, those of most pairs first."""
    z = np.array([0.5 * (one.shape.start + one.shape.end) for one in flexures])
    x = z.real if axis == "x" else z.imag
    extreme = 0.5 * (float(x.min()) + float(x.max()))  # A symmetric set is symmetric about this.
    return [extreme]


def _mirror(found: Recognised, axis: str, at: float) -> Mirror | None:
    """Return the symmetry about a line; None without one."""
    draft = Mirror(axis, at, {}, {})
    for i, one in enumerate(found.flexures):
        j = _image(found, draft, one)
        if j is None:
            return None
        draft.flexures[i] = j
        if not _map_bodies(found, draft, one, found.flexures[j]):
            return None
    if all(i == j for i, j in draft.flexures.items()):
        return None
    pairs = [(i, j) for i, j in draft.bodies.items() if i != j]
    if not all(_same_area(found, draft, i, j) for i, j in pairs):
        return None
    return draft


def _image(found: Recognised, mirror: Mirror, one: Found) -> int | None:
    """Return the index of the flexure at the image of another one."""
    near = ENDS_RTOL * one.shape.thickness + 4.0 * found.noise
    ends = {mirror.image(one.shape.start), mirror.image(one.shape.end)}
    for j, other in enumerate(found.flexures):
        pair = (other.shape.start, other.shape.end)
        if all(min(abs(z - end) for end in pair) <= near for z in ends):
            mirrored = alike(one, other, found.noise) and _curved_as_image(mirror, one, other)
            return j if mirrored else None
    return None


def _curved_as_image(mirror: Mirror, one: Found, other: Found) -> bool:
    """Return whether a flexure is curved as the mirror image of another one is."""
    start = mirror.image(one.shape.start)
    turned = abs(start - other.shape.start) > abs(start - other.shape.end)
    signs = {"curvature": 1.0 if turned else -1.0, "rise": -1.0}  # A rise has no direction.
    a, b = one.shape.dimensions, other.shape.dimensions
    return all(sign * a[key] * b[key] > 0.0 for key, sign in signs.items() if key in a)


def _map_bodies(found: Recognised, mirror: Mirror, one: Found, other: Found) -> bool:
    """Record the images of the bodies of a flexure; return whether they are consistent."""
    start = mirror.image(one.shape.start)
    straight = abs(start - other.shape.start) <= abs(start - other.shape.end)
    images = other.bodies if straight else other.bodies[::-1]
    for body, image in zip(one.bodies, images, strict=True):
        if (body in found.ground) != (image in found.ground):
            return False
        if mirror.bodies.setdefault(body, image) != image:
            return body in found.ground
    return True


def _same_area(found: Recognised, mirror: Mirror, i: int, j: int) -> bool:
    """Return whether a body is the mirror image of another one; ground need not be."""
    if i in found.ground:
        return True
    sx, sy = (-1.0, 1.0) if mirror.axis == "x" else (1.0, -1.0)
    image = affinity.scale(found.bodies[i], sx, sy, origin=(mirror.at, mirror.at))
    difference = shapely.symmetric_difference(image, found.bodies[j]).area
    return bool(difference <= AREA_RTOL * found.bodies[i].area)
