"""The picture to check an imported drawing: recognised parts on the drawing, doubts in red."""

import cmath
import math
from collections.abc import Mapping
from textwrap import fill

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.patheffects import withStroke

from ..base.unit_text import length_unit
from ..cad.draft import Draft
from ..cad.importing import Imported
from ..cad.recognition import Found
from ..drawing.style import BODY, LINK, STRAIGHT, WALL, area, own_style, png
from ..mechanics.arrays import Complex

WIDTH, HEIGHT_MIN, HEIGHT_MAX = 9.0, 3.0, 9.0  # inch
DPI = 130
FLEXURE, DOUBT, FIXED = "#1f77b4", "#d62728", "#d9d9d9"
STOP_LENGTH = 0.06  # Length of the line of a stop over the size of the drawing.
NAME_OFFSET = 8.0  # Distance of a name from its flexure [points].
LISTED_MAX = 8  # Doubts below the picture.


@own_style()
def check_picture(result: Imported) -> bytes:
    """Return the picture of an imported drawing as PNG.

    Parameters
    ----------
    result : Imported
        The recognised parts.
    """
    draft = result.draft
    bounds = draft.found.plate.shape.bounds
    wide, high = bounds[2] - bounds[0], bounds[3] - bounds[1]
    height = min(max(WIDTH * high / wide, HEIGHT_MIN), HEIGHT_MAX)
    notes = min(len(draft.found.doubts), LISTED_MAX)
    figure = Figure((WIDTH, height + 0.7 + 0.2 * notes), layout="constrained")
    axes = figure.add_subplot()
    picture = _Picture(axes, draft, *length_unit(math.hypot(wide, high)))
    picture.bodies()
    picture.flexures()
    picture.stops()
    picture.doubts()
    axes.set_title(result.mechanism.title, fontsize=10, loc="left")
    return png(figure, DPI)


class _Picture:
    """Draws the recognised parts on axes."""

    def __init__(self, axes: Axes, draft: Draft, factor: float, unit: str) -> None:
        self.axes, self.draft, self.factor, self.unit = axes, draft, factor, unit
        axes.set_aspect("equal")
        axes.set_xlabel(f"x in {unit}")
        axes.set_ylabel(f"y in {unit}")
        bounds = draft.found.plate.shape.bounds
        self.size = math.hypot(bounds[2] - bounds[0], bounds[3] - bounds[1])

    def patch(self, polygon: shapely.Polygon, color: str, zorder: float) -> None:
        """Draw a filled polygon."""
        rings = [_complex(ring) for ring in (polygon.exterior, *polygon.interiors)]
        self.axes.add_patch(
            PathPatch(
                area(rings, self.factor), facecolor=color, edgecolor=STRAIGHT, linewidth=0.6,
                zorder=zorder,
            )
        )  # fmt: skip

    def line(self, z: Complex, color: str, width: float, style: str = "-") -> None:
        """Draw a line."""
        z = z * self.factor
        self.axes.plot(
            z.real, z.imag, style, color=color, linewidth=width, zorder=3,
            solid_capstyle="butt",
        )  # fmt: skip

    def text(self, z: complex, words: str, color: str, size: float = 8.0) -> None:
        """Write words at a point."""
        self.axes.annotate(
            words, (z.real * self.factor, z.imag * self.factor), color=color, fontsize=size,
            ha="center", va="center", zorder=9,
            path_effects=[withStroke(linewidth=2.2, foreground="white")],
        )  # fmt: skip

    def bodies(self) -> None:
        """Draw the bodies: the ground grey, moving bodies coloured with their names."""
        found = self.draft.found
        for part in shapely.get_parts(found.plate.shape):
            if isinstance(part, shapely.Polygon):
                self.patch(part, "#f2f2f2", 0.5)
        for k, body in enumerate(found.bodies):
            parts = [p for p in shapely.get_parts(body) if isinstance(p, shapely.Polygon)]
            if k in found.ground or k in self.draft.names:
                name = "ground" if k in found.ground else self.draft.names[k]
                for part in parts:
                    self.patch(part, FIXED if k in found.ground else BODY, 1.0)
                place = _inside(max(parts, key=lambda part: part.area))
                self.text(place, name, WALL if k in found.ground else LINK)
        self.axes.autoscale_view()

    def flexures(self) -> None:
        """Draw the centre lines of flexures with names and thicknesses."""
        found, names = self.draft.found, flexure_names(self.draft)
        for k, one in enumerate(found.flexures):
            color = DOUBT if one.shape.equivalent else FLEXURE
            self.patch(one.band, color, 2.0)
            self.line(one.trace.z, color, 1.4)
            ends = np.array([one.shape.start, one.shape.end])
            self.axes.plot(
                ends.real * self.factor, ends.imag * self.factor, "|", color=color, markersize=0
            )
            self._name(one, names.get(k, "?"))

    def _name(self, one: Found, name: str) -> None:
        """Write the name of a flexure with its thickness along it."""
        z = one.trace.z
        degrees = (math.degrees(cmath.phase(z[-1] - z[0])) + 89.0) % 180.0 - 89.0
        away = cmath.rect(NAME_OFFSET, math.radians(degrees + 90.0))
        beside = cmath.rect(0.5 * float(one.trace.width.max()), math.radians(degrees + 90.0))
        middle = complex(z[np.argmin(np.abs(z - 0.5 * (z[0] + z[-1])))])
        place = (middle + beside) * self.factor
        self.axes.annotate(
            f"{name} {self.factor * one.shape.thickness:.3g}", (place.real, place.imag),
            (away.real, away.imag), textcoords="offset points", rotation=degrees, ha="center",
            va="center", fontsize=6.5, zorder=9, color="#303030",
            path_effects=[withStroke(linewidth=2.0, foreground="white")],
        )  # fmt: skip

    def stops(self) -> None:
        """Draw the stops: the gap as a dotted line, the wall across it."""
        for stop in self.draft.stops:
            wall = stop.point + stop.gap * stop.direction
            along = 0.5j * STOP_LENGTH * self.size * stop.direction
            self.line(np.array([wall - along, wall + along]), WALL, 2.0)
            self.line(np.array([stop.point, wall]), WALL, 1.0, ":")
            self.text(
                wall + 0.03 * self.size * stop.direction, f"gap {self.factor * stop.gap:.3g}",
                WALL, 7.0,
            )  # fmt: skip

    def doubts(self) -> None:
        """Mark what was not understood in red, with numbers, and list it below the picture."""
        lines = []
        for k, (z, text) in enumerate(self.draft.found.doubts):
            self.axes.plot(
                z.real * self.factor, z.imag * self.factor, "o", markersize=11, color=DOUBT,
                markerfacecolor="none", zorder=8,
            )  # fmt: skip
            self.text(z, str(k + 1), DOUBT, 7.0)
            lines.append(
                f"{k + 1}: ({z.real * self.factor:.4g}, {z.imag * self.factor:.4g}) {text}"
            )
        if len(lines) > LISTED_MAX:
            lines[LISTED_MAX:] = [f"and {len(lines) - LISTED_MAX} more"]
        if lines:
            words = "\n".join(fill(line, 120) for line in lines)
            self.axes.set_xlabel(f"x in {self.unit}\n{words}", color=DOUBT, fontsize=7)


def flexure_names(draft: Draft) -> Mapping[int, str]:
    """Return the names of the flexures, those of copies with the name of the original."""
    names: dict[int, str] = {}
    for one in draft.flexures:
        for k in draft.orbit(one):
            names[k] = draft.copy_name(one, k)
    return names


def _complex(ring: shapely.LinearRing) -> Complex:
    result: Complex = np.array(ring.coords)[:-1] @ np.array([1.0, 1j])
    return result


def _inside(polygon: shapely.Polygon) -> complex:
    """Return a point well inside a polygon."""
    point = shapely.maximum_inscribed_circle(polygon, tolerance=0.02 * math.sqrt(polygon.area))
    first = shapely.get_point(point, 0)
    return complex(first.x, first.y)
