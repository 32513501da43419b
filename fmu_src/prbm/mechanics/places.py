"""Points of a mechanism, rows of its guides, and lines to draw."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from .arrays import Complex, Real


@dataclass(frozen=True)
class Place:
    """A point of the mechanism, z = c + A E.

    Parameters
    ----------
    c : complex
        Fixed part [m].
    A : dict of int to complex
        Vectors that turn, and stretch, with the arms [m].
    """

    c: complex = 0j
    A: Mapping[int, complex] = field(default_factory=dict)

    def plus(self, j: int | None, vector: complex) -> "Place":
        """Return the place at the end of a vector fixed to direction j (None: the ground)."""
        if j is None:
            return Place(self.c + vector, self.A)
        return Place(self.c, {**self.A, j: self.A.get(j, 0j) + vector})

    def minus(self, other: "Place") -> "Place":
        """Return the vector from another place to this one."""
        A = dict(self.A)
        for j, vector in other.A.items():
            A[j] = A.get(j, 0j) - vector
        return Place(self.c - other.c, A)

    def row(self, d: int) -> Complex:
        """Return A as a row of d columns."""
        row = np.zeros(d, complex)
        for j, vector in self.A.items():
            row[j] = vector
        return row


@dataclass(frozen=True)
class BodyFrame:
    """A point of a body, for instance its centre of mass.

    Parameters
    ----------
    name : str
        Name of the body, the force or the probe.
    j : int
        The body's coordinate; :data:`prbm.mechanics.system.FIXED`: the ground.
    arm : int
        The body's direction, the index of its arm; :data:`prbm.mechanics.system.FIXED`: the ground.
    c, A : complex, (d,) complex
        Position z = c + A E of the point [m].
    drawn : complex
        Position of the point in the straight shape [m].
    """

    name: str
    j: int
    arm: int
    c: complex
    A: Complex
    drawn: complex


@dataclass(frozen=True)
class GuideRows:
    """The rows of a guide among those of the loops.

    Parameters
    ----------
    across : int
        Row of the displacement of the point to the left of the line [m].
    turn : int or None
        Row of the rotation relative to the carrier, the sine of the angle times the size [m]; None:
        the body may turn.
    normal : complex
        Unit vector to the left of the line as drawn.
    """

    across: int
    turn: int | None
    normal: complex


@dataclass(frozen=True)
class Outline:
    """A line to draw.

    Parameters
    ----------
    name, kind : str
        Name of the part; ``"flexure"``, ``"joint"``, ``"spring"``, ``"guide"`` or ``"body"``.
    c, A : (p,) complex, (p, d) complex
        The places of its corners, z = c + A E [m].
    thickness : (p,)
        Thickness of a beam at the corners [m]; empty for other parts.
    """

    name: str
    kind: str
    c: Complex
    A: Complex
    thickness: Real


NO_THICKNESS: Real = np.zeros(0)  # Thickness of outlines that are not beams.
