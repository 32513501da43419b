"""The mechanism file of a recognised plate."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
import shapely

from ..files.outlines import Area, polygon
from ..files.units import number
from ..mechanics.profile import Notch
from ..mechanism.flexure import LEAF, NOTCH
from .draft import Copied, Draft, Kind
from .materials import Material
from .numbers import Unit, plain, roundest
from .periodic import Row
from .recognition import Found
from .stops import FoundStop
from .symmetry import Mirror

OUTLINE_RTOL = 2e-4  # Largest distance of a written outline from the drawn one, over the size.
DIMENSION_RTOL = 5e-4  # Largest rounding of a dimension, as a share of it.
END_RTOL = 1e-3  # Largest rounding of an end, as a share of the thickness.
CORNERS_MAX = 200  # Corners of an outline.
COPLANAR_DEGREES = 0.01  # Rounding of the direction of a stop [deg].
SURE, FAIR = 0.003, 0.03  # Largest deviations of a sure and of a fair recognition.


@dataclass(frozen=True)
class Heading:
    """What a drawing does not say.

    Parameters
    ----------
    name, title, source : str
        Name and title of the mechanism, name of the drawing.
    thickness : float
        Thickness of the plate [m].
    material : Material
        Its material.
    axial : bool
        Whether the flexures can stretch.
    release : str
        The table ``[release]`` without its body.
    """

    name: str
    title: str
    source: str
    thickness: float
    material: Material
    axial: bool = False
    release: str = "displacement = 0"


def file_text(draft: Draft, heading: Heading, notes: Sequence[str]) -> str:
    """Return the text of the mechanism file of a plate.

    Parameters
    ----------
    draft : Draft
        The plate with names.
    heading : Heading
        What the drawing does not say.
    notes : sequence of str
        Sentences for the comment at the top.
    """
    return "\n".join(_Writer(draft, heading).lines(notes)) + "\n"


class _Writer:
    """Writes the tables of a file."""

    def __init__(self, draft: Draft, heading: Heading) -> None:
        self.draft, self.heading = draft, heading
        low, high = (complex(*draft.found.plate.shape.bounds[k : k + 2]) for k in (0, 2))
        self.size = abs(high - low)
        self.unit = Unit(self.size, draft.found.noise)

    def lines(self, notes: Sequence[str]) -> Iterator[str]:
        """Yield the lines of the file."""
        h = self.heading
        yield from (f"# {note}" for note in notes)
        yield ""
        yield f'name = "{h.name}"'
        yield f'title = "{h.title}"'
        yield "# damping_zeta = 0.002  # of the first mode; without damping nothing settles"
        yield ""
        yield "[[materials]]"
        yield f'name = "{h.material.name}"'
        yield f'youngs_modulus = "{h.material.youngs_modulus}"'
        yield f'density = "{h.material.density}"'
        yield '# yield_strength = "... MPa"  # for safety factors'
        for kind in self.draft.kinds:
            yield ""
            yield from self._kind(kind)
        yield ""
        yield "[ground]"
        yield from self._points({*self.draft.found.ground})
        for k in sorted(self.draft.found.ground):
            yield from self._ground_part(k)
        for body in self.draft.bodies:
            yield ""
            yield from self._body(body)
        for flexure in self.draft.flexures:
            yield ""
            yield from self._flexure(flexure)
        for k, stop in enumerate(self.draft.stops):
            yield ""
            yield from self._stop(stop, "stop" if len(self.draft.stops) == 1 else f"stop_{k + 1}")
        stage = self.draft.names[self.draft.stage]
        yield from ("", "[[forces]]", 'name = "force"', f'body = "{stage}"')
        yield from ("", "[release]", f'body = "{stage}"', *h.release.split("\n"))

    # -- flexures --

    def _kind(self, kind: Kind) -> Iterator[str]:
        """Yield a flexure type, with a comment on how well it fits."""
        found = self.draft.found.flexures
        shape = found[kind.members[0]].shape
        worst = max(found[k].shape.deviation for k in kind.members)
        yield "[[flexure_types]]"
        yield f'name = "{kind.name}"'
        yield 'model = "beam"'
        if self.heading.axial or "rise" in kind.dimensions or "curvature" in kind.dimensions:
            yield "axial = true"
        if shape.profile != LEAF:
            yield f'profile = "{shape.profile}"'
        for key, value in self.rounded(kind).items():
            comment = f"  # {certainty(worst, shape.equivalent)}" if key == "thickness" else ""
            yield f"{key} = {self._dimension(key, value)}{comment}"
        yield f"width = {self.unit.text(self.heading.thickness, 0.0)}"
        yield f'material = "{self.heading.material.name}"'

    def rounded(self, kind: Kind) -> dict[str, float]:
        """Return the dimensions of a type as they are written [m, 1/m]."""
        result = {}
        for key, value in kind.dimensions.items():
            limit = DIMENSION_RTOL * abs(value)
            if key != "curvature":
                limit = min(max(limit, self.unit.tolerance), 4.0 * limit)
                result[key] = self.unit.number(value, limit) / self.unit.factor
            else:
                radius = self.unit.number(1.0 / value, DIMENSION_RTOL / abs(value))
                result[key] = self.unit.factor / radius
        return result

    def _dimension(self, key: str, value: float) -> str:
        if key == "curvature":
            return f'"{value:.9g} 1/m"'
        return self.unit.text(value, 1e-9 * abs(value))

    def _flexure(self, copied: Copied) -> Iterator[str]:
        """Yield a flexure."""
        flexure = self.draft.found.flexures[copied.index]
        start, end = (self._reference(body, copied.name) for body in flexure.bodies)
        yield "[[flexures]]"
        yield f'name = "{copied.name}"'
        yield f'type = "{self.draft.kind_of(copied.index).name}"'
        yield f'start = "{start}"'
        yield f'end = "{end}"'
        yield from self._mirror(copied.mirrors)
        if copied.row is not None:
            yield f"repeat = {self._repeat(copied.row)}"

    def _repeat(self, row: Row) -> str:
        """Return equal parts in a row or on a circle."""
        count = f"count = {len(row.members)}"
        if row.step:
            return f"{{ {count}, step = {self.unit.point(row.step)} }}"
        angle = plain(roundest(row.angle, 1e-9))
        return f"{{ {count}, angle = {angle}, about = {self.unit.point(row.about)} }}"

    def _reference(self, body: int, point: str) -> str:
        owner = "ground" if body in self.draft.found.ground else self.draft.names[body]
        return f"{owner}.{point}"

    def _mirror(self, mirrors: Sequence[Mirror]) -> Iterator[str]:
        """Yield the lines of symmetry of a part."""
        written = [f'"{m.axis} = {self._at(m)}"' for m in mirrors]
        if len(written) == 1:
            yield f"mirror = {written[0]}"
        elif written:
            yield f"mirror = [{', '.join(written)}]"

    def _at(self, mirror: Mirror) -> str:
        return self.unit.text(mirror.at).strip('"')

    def ends(self, copied: Copied) -> tuple[str, str]:
        """Return both ends of a flexure as they are written; a notch fits between them."""
        flexure = self.draft.found.flexures[copied.index]
        shape = flexure.shape
        limit = max(self.unit.tolerance, END_RTOL * shape.thickness)
        if shape.profile == NOTCH:
            return self._notch_ends(flexure, self.draft.kind_of(copied.index), limit)
        return self.unit.point(shape.start, limit), self.unit.point(shape.end, limit)

    def _notch_ends(self, flexure: Found, kind: Kind, limit: float) -> tuple[str, str]:
        d, shape = self.rounded(kind), flexure.shape
        a = d["notch_radius"]
        b = d.get("notch_depth", a)
        thick = d.get("end_thickness", d["thickness"] + 2.0 * b)
        waist = d.get("waist_length")
        length = Notch(d["thickness"], 1.0, (a, b), thick, waist).length
        middle = 0.5 * (shape.start + shape.end)
        along = (shape.end - shape.start) / abs(shape.end - shape.start)
        start, end = middle - 0.5 * length * along, middle + 0.5 * length * along
        number = self.unit.number
        rounded = [complex(number(z.real, limit), number(z.imag, limit)) for z in (start, end)]
        if abs(rounded[1] - rounded[0]) / self.unit.factor >= length * (1.0 - 1e-10):
            return self.unit.point(start, limit), self.unit.point(end, limit)
        more = 1e-7 * length * along
        return self.unit.point(start - more, 1e-9 * length), self.unit.point(
            end + more, 1e-9 * length
        )

    def _points(self, bodies: set[int]) -> Iterator[str]:
        """Yield the points at which flexures join bodies."""
        for copied in self.draft.flexures:
            flexure = self.draft.found.flexures[copied.index]
            for body, written in zip(flexure.bodies, self.ends(copied), strict=True):
                if body in bodies:
                    yield f"{copied.name} = {written}"

    # -- bodies --

    def _body(self, copied: Copied) -> Iterator[str]:
        """Yield a body that is cut from the plate."""
        body = self.draft.found.bodies[copied.index]
        parts = [p for p in shapely.get_parts(body) if isinstance(p, shapely.Polygon)]
        yield "[[bodies]]"
        yield f'name = "{copied.name}"'
        if len(parts) > 1:
            yield from self._bolted(parts)
        yield from self._rings(max(parts, key=lambda part: part.area))
        if len(parts) == 1:
            yield f"thickness = {self.unit.text(self.heading.thickness, 0.0)}"
            yield f'material = "{self.heading.material.name}"'
        yield from self._mirror(copied.mirrors)
        points = [*self._points({copied.index})]
        if points:
            yield ""
            yield "[bodies.points]"
            yield from points

    def _ground_part(self, index: int) -> Iterator[str]:
        """Yield the outlines of a fixed body, for pictures and drawings."""
        for part in shapely.get_parts(self.draft.found.bodies[index]):
            yield from ("", "[[ground_parts]]")
            yield from self._rings(part)

    def _rings(self, part: shapely.Polygon) -> Iterator[str]:
        """Yield the outline and the holes of a part."""
        outline, holes = self.rings(part)
        yield from self._ring("outline = ", outline, "")
        if holes:
            yield "holes = ["
            for hole in holes:
                yield from self._ring("    ", hole, ",")
            yield "]"

    def _bolted(self, parts: Sequence[shapely.Polygon]) -> Iterator[str]:
        """Yield mass, inertia and centre of parts of several plates, with their outline drawn."""
        areas = []
        for part in parts:
            rings = [polygon(_corners(ring)) for ring in (part.exterior, *part.interiors)]
            holes = [Area(-hole.area, hole.centre, -hole.moment) for hole in rings[1:]]
            areas.append(reduce(Area.plus, holes, rings[0]))
        total = reduce(Area.plus, areas)
        density = number(self.heading.material.density, "kg/m3")
        per_area = density * self.heading.thickness
        yield f"# {len(parts)} parts of several plates; their largest outline is drawn"
        yield f'mass = "{1e3 * per_area * total.area:.6g} g"'
        yield f'inertia = "{1e9 * per_area * total.moment:.6g} g.mm2"'
        yield f"centre = {self.unit.point(total.centre)}"

    def rings(self, polygon: shapely.Polygon) -> tuple[list[complex], list[list[complex]]]:
        """Return outline and holes of a body with few corners [m]."""
        limit = OUTLINE_RTOL * self.size
        for _ in range(12):
            simple = shapely.simplify(polygon, limit, preserve_topology=True)
            corners = [len(r.coords) for r in (simple.exterior, *simple.interiors)]
            if max(corners) <= CORNERS_MAX:
                break
            limit *= 2.0
        rings = [_corners(ring) for ring in (simple.exterior, *simple.interiors)]
        return rings[0], rings[1:]

    def _ring(self, key: str, corners: Sequence[complex], end: str) -> Iterator[str]:
        """Yield the corners of a ring, one a line."""
        indent = " " * (len(key) - len(key.lstrip()))
        written = list(
            dict.fromkeys(self.unit.point(z, 0.1 * OUTLINE_RTOL * self.size) for z in corners)
        )
        yield f"{key}["
        yield from (f"{indent}    {corner}," for corner in written)
        yield f"{indent}]{end}"

    def _stop(self, stop: FoundStop, name: str) -> Iterator[str]:
        """Yield a stop."""
        degrees = math.degrees(math.atan2(stop.direction.imag, stop.direction.real))
        yield "[[stops]]"
        yield f'name = "{name}"'
        yield f'body = "{self.draft.names[stop.body]}"'
        yield f"point = {self.unit.point(stop.point)}"
        if stop.on >= 0:
            yield f'on = "{self.draft.names[stop.on]}"'
        direction = roundest(degrees, COPLANAR_DEGREES)
        direction = 180.0 if direction == -180.0 else direction
        if direction:
            yield f"direction = {plain(direction)}"
        yield f"position = {self.unit.text(stop.gap)}  # the gap as drawn"


def _corners(ring: shapely.LinearRing) -> list[complex]:
    """Return the corners of a ring, counter-clockwise from the lower left, each once."""
    z = np.array(ring.coords)[:-1] @ np.array([1.0, 1j])
    if not ring.is_ccw:
        z = z[::-1]
    first = int(np.argmin(z.real + z.imag))
    return [complex(corner) for corner in np.roll(z, -first)]


def certainty(deviation: float, equivalent: bool) -> str:
    """Return how well a shape fits, for a comment."""
    if equivalent:
        return (
            "doubtful: a leaf with the bending stiffness of another shape, whose shear stiffness "
            f"differs by {100 * deviation:.2g} %"
        )
    word = "sure" if deviation <= SURE else "fair" if deviation <= FAIR else "doubtful"
    return f"{word}: walls within {max(100 * deviation, 1e-3):.1g} % of the thickness"
