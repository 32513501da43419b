"""Curves of a drawing as polylines, and the limits of drawings, which are untrusted files."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..base.errors import MechanismError
from ..mechanics.arrays import Complex

FILE_SIZE_MAX = 1 << 24  # bytes; a drawing of 10,000 lines has 1 MB.
ENTITIES_MAX = 20_000  # Entities of a drawing, with those of its blocks.
POINTS_MAX = 200_000  # Points of all curves.
NESTING_MAX = 8  # Blocks in blocks, or groups in groups.
COORDINATE_MAX = 1e3  # m; as for points of mechanisms.
COORDINATE_MIN = 1e-30  # m; less is 0, since quotients of products of such numbers overflow.
FLATTENING_RTOL = 1e-5  # Distance of curves from polylines, as a share of the diagonal.
ANGLE_STEP = math.radians(3.0)  # Largest angle between two points of an arc.

GROUND, STOPS, CONSTRUCTION, PLATE = "ground", "stops", "construction", "plate"


class DrawingError(MechanismError):
    """A drawing cannot be read, or is not the outline of a mechanism."""


@dataclass(frozen=True)
class Curve:
    """A curve of a drawing.

    Parameters
    ----------
    layer : str
        Name of its layer, in lower case.
    z : (n,) complex
        Its points in order [m]; one point is a mark.
    """

    layer: str
    z: Complex


@dataclass
class Curves:
    """The curves of a drawing, and what was not read.

    Parameters
    ----------
    source : str
        Path of the file, for messages.
    unit : float
        Length of a unit of the drawing [m].
    notes : list of str
        What a reader should know, for instance a unit that was assumed.
    """

    source: str
    unit: float = 1e-3
    found: list[Curve] = field(default_factory=list)
    skipped: Counter[str] = field(default_factory=Counter)
    notes: list[str] = field(default_factory=list)
    entities: int = 0
    points: int = 0

    def count(self) -> None:
        """Count an entity.

        Raises
        ------
        DrawingError
            If the drawing has too many.
        """
        self.entities += 1
        if self.entities > ENTITIES_MAX:
            raise DrawingError(
                f"{self.source}: more than {ENTITIES_MAX} entities; keep only the outline of the "
                "plate"
            )

    def add(self, layer: str, z: Complex) -> None:
        """Add a curve through points in units of the drawing.

        Raises
        ------
        DrawingError
            If a coordinate is not a number or too large, or the points are too many.
        """
        if not np.all(np.abs(z) <= COORDINATE_MAX / self.unit):  # false for NaN, too
            raise DrawingError(
                f"{self.source}: a coordinate on the layer {layer!r} is not a number or farther "
                f"than {COORDINATE_MAX:g} m from the origin; check the unit, or move the drawing"
            )
        z = np.asarray(z * self.unit, complex)
        for part in (z.real, z.imag):  # views
            part[np.abs(part) < COORDINATE_MIN] = 0.0
        self.points += len(z)
        if self.points > POINTS_MAX:
            raise DrawingError(
                f"{self.source}: its curves need more than {POINTS_MAX} points; keep only the "
                "outline of the plate, or increase the tolerance"
            )
        self.found.append(Curve(layer.strip().lower(), z))

    def on(self, *layers: str) -> list[Curve]:
        """Return the curves on layers."""
        return [curve for curve in self.found if curve.layer in layers]

    def plates(self) -> list[list[Curve]]:
        """Return the curves of each plate: those on the layers ``plate 2`` and so on are apart.

        Construction lines and the marks of ground and stops belong to no plate.
        """
        plates: dict[str, list[Curve]] = {}
        for curve in self.found:
            if curve.layer not in (GROUND, STOPS, CONSTRUCTION, "defpoints") and len(curve.z) > 1:
                name = " ".join(curve.layer.replace("_", " ").split())
                key = name if name.startswith(f"{PLATE} ") and name != f"{PLATE} 1" else ""
                plates.setdefault(key, []).append(curve)
        return [plates[key] for key in sorted(plates)]


def diagonal(curves: Sequence[Curve]) -> float:
    """Return the diagonal of the box around curves [m]."""
    z = np.concatenate([np.zeros(0, complex), *(curve.z for curve in curves)])
    if not len(z):
        return 0.0
    return float(abs(complex(np.ptp(z.real), np.ptp(z.imag))))


def sagitta(radius: float, tolerance: float) -> float:
    """Return the largest distance of an arc from its chords, at most that of 3 degrees.

    The arguments and the result have the same unit.

    Examples
    --------
    >>> round(sagitta(4.0, 0.01), 5), sagitta(4.0, 1e-4)
    (0.00137, 0.0001)
    """
    return min(tolerance, radius * (1.0 - math.cos(ANGLE_STEP / 2.0)))
