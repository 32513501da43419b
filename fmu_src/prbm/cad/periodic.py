"""Equal flexures in a row or on a circle, between the same bodies."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .recognition import Found, Recognised
from .symmetry import ENDS_RTOL, alike

COUNT_MIN = 3  # Fewer flexures are written one by one.


@dataclass(frozen=True)
class Row:
    """Equal flexures.

    Parameters
    ----------
    members : tuple of int
        Indices of the flexures in order.
    step : complex
        Displacement from one to the next [m]; 0 on a circle.
    angle : float
        Rotation from one to the next, counter-clockwise [deg].
    about : complex
        Centre of the rotation [m].
    """

    members: tuple[int, ...]
    step: complex = 0.0
    angle: float = 0.0
    about: complex = 0.0


def rows(found: Recognised) -> list[Row]:
    """Return rows and circles of equal flexures; each flexure is in one at most."""
    result = []
    left = [*range(len(found.flexures))]
    while left:
        first = found.flexures[left[0]]
        equal = [k for k in left if _equal(found, first, found.flexures[k])]
        left = [k for k in left if k not in equal]
        if len(equal) >= COUNT_MIN:
            row = _row(found, equal) or _circle(found, equal)
            if row is not None:
                result.append(row)
    return result


def _equal(found: Recognised, one: Found, other: Found) -> bool:
    """Return whether two flexures have one shape and join the same bodies, of ground any."""
    bodies = (
        tuple(-1 if body in found.ground else body for body in flexure.bodies)
        for flexure in (one, other)
    )
    a, b = one.shape.dimensions, other.shape.dimensions
    same = alike(one, other, found.noise) and all(a[key] * b[key] > 0.0 for key in a)
    return same and len({*bodies}) == 1


def _ends(found: Recognised, k: int) -> tuple[complex, complex]:
    shape = found.flexures[k].shape
    return shape.start, shape.end


def _near(found: Recognised, pairs: Sequence[tuple[complex, complex]], k: int) -> bool:
    """Return whether points are the same, within the accuracy of the ends of a flexure."""
    limit = ENDS_RTOL * found.flexures[k].shape.thickness + 4.0 * found.noise
    return all(abs(a - b) <= limit for a, b in pairs)


def _row(found: Recognised, equal: Sequence[int]) -> Row | None:
    """Return equal flexures as a row; None if their distances differ."""
    starts = np.array([_ends(found, k)[0] for k in equal])
    along = starts[int(np.argmax(np.abs(starts - starts[0])))] - starts[0]
    order = [equal[int(i)] for i in np.argsort((starts * np.conj(along)).real)]
    z0, end0 = _ends(found, order[0])
    if z0.real + 1e-3 * z0.imag > _ends(found, order[-1])[0].real + 1e-3 * (
        _ends(found, order[-1])[0].imag
    ):
        order.reverse()
        z0, end0 = _ends(found, order[0])
    step = (_ends(found, order[-1])[0] - z0) / (len(order) - 1)
    for i, k in enumerate(order):
        start, end = _ends(found, k)
        if not _near(found, [(start, z0 + i * step), (end, end0 + i * step)], k):
            return None
    return Row(tuple(order), step=step)


def _circle(found: Recognised, equal: Sequence[int]) -> Row | None:
    """Return equal flexures around a centre; None if their angles differ."""
    starts = np.array([_ends(found, k)[0] for k in equal])
    centre = complex(starts.mean())
    angles = np.angle(starts - centre) % (2.0 * np.pi)
    order = [equal[int(i)] for i in np.argsort(angles)]
    turn = np.exp(2j * np.pi / len(order))
    z0, end0 = (z - centre for z in _ends(found, order[0]))
    for i, k in enumerate(order):
        start, end = (z - centre for z in _ends(found, k))
        if not _near(found, [(start, z0 * turn**i), (end, end0 * turn**i)], k):
            return None
    return Row(tuple(order), angle=360.0 / len(order), about=centre)
