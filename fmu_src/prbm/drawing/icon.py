"""The icon of a mechanism, as PNG and as SVG from the same parts."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from ..base.text import printable
from ..mechanics.arrays import Complex, Real
from ..mechanics.assembly import assemble
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from .motion import angles, closed, stretched
from .shapes import Shapes
from .style import area, own_style, png

STEEL, BODY, WALL, GHOST = "#1f4e79", "#9dc3e6", "#595959", "#d0d0d0"
PIXELS = 256
DPI = 128
POINTS = 72.0 * PIXELS / DPI  # Width and height of the icon [pt], the unit of lines and dots.
FRAME = 0.02  # Empty border on each side, as a share of the icon.
MARGIN = 0.04  # Margin on each side, as a share of the drawing.
THIN_LINES_MIN = 5  # Mechanisms with at least this many flexures are drawn with thin lines.
SVG = "http://www.w3.org/2000/svg"


@dataclass(frozen=True)
class Line:
    """A line through points z [m], in pieces that NaN separates, with a width [pt]."""

    z: Complex
    color: str
    width: float
    order: float


@dataclass(frozen=True)
class Area:
    """An area: the corners of its outline and of its holes [m], without a fill if it is None."""

    rings: Sequence[Complex]
    fill: str | None
    edge: str
    order: float


@dataclass(frozen=True)
class Dots:
    """Dots at points z [m], with a diameter [pt]."""

    z: Complex
    fill: str
    diameter: float
    order: float


IconPart = Line | Area | Dots  # Parts of higher order are drawn over the others.


@own_style()
def icon(mechanism: Mechanism, sample: Mapping[str, float]) -> bytes:
    """Return the icon as PNG: the straight shape in grey, the shape at release in colour.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    sample : mapping
        Outputs at release: the angles of the links, angles and positions of the bodies.
    """
    figure = Figure(figsize=(PIXELS / DPI, PIXELS / DPI), dpi=DPI)
    axes = figure.add_axes((FRAME, FRAME, 1.0 - 2.0 * FRAME, 1.0 - 2.0 * FRAME))
    axes.set_aspect("equal")
    axes.axis("off")
    for part in parts(mechanism, sample):
        paint(part, axes)
    axes.margins(MARGIN)
    return png(figure)


def vector_icon(mechanism: Mechanism, sample: Mapping[str, float]) -> bytes:
    """Return the icon as SVG, with the parts of the PNG; equal arguments give equal bytes.

    The arguments are those of :func:`icon`.
    """
    drawn = sorted(parts(mechanism, sample), key=lambda part: part.order)
    every = np.concatenate([z for part in drawn for z in points(part)])
    low = complex(np.nanmin(every.real), np.nanmin(every.imag))
    high = complex(np.nanmax(every.real), np.nanmax(every.imag))
    size = high - low
    scale = POINTS * (1.0 - 2.0 * FRAME) / ((1.0 + 2.0 * MARGIN) * max(size.real, size.imag))
    middle = (low + high) / 2.0

    def place(z: Complex) -> Complex:
        """Return positions in the picture [pt], from its upper left corner."""
        turned: Complex = np.conj(scale * (z - middle)) + POINTS / 2.0 * (1.0 + 1.0j)
        return turned

    box = {"viewBox": f"0 0 {POINTS:g} {POINTS:g}", "width": str(PIXELS), "height": str(PIXELS)}
    root = Element("svg", {"xmlns": SVG, **box, "role": "img", "fill": "none"})
    SubElement(root, "title").text = printable(mechanism.title)
    for part in drawn:
        for tag, attributes in elements(part, [place(z) for z in points(part)]):
            SubElement(root, tag, attributes)
    indent(root)
    text: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def shape(system: System, sample: Mapping[str, float]) -> Real:
    """Return the coordinates of a sample of outputs; the stretches close the loops."""
    q = np.array(system.q0)
    for name, j in angles(system).items():
        q[j] = sample[name]
    displacements = {
        name: np.array([complex(sample[f"{name}.x"], sample[f"{name}.y"])])
        for name in system.bodies
    }
    return closed(system, stretched(system, q[None], displacements)[0])


# --- parts --------------------------------------------------------------------------------------


def parts(mechanism: Mechanism, sample: Mapping[str, float]) -> list[IconPart]:
    """Return the parts of an icon; the arguments are those of :func:`icon`."""
    system = assemble(mechanism, mechanism.values())
    shapes = Shapes(system)
    released = shapes.arms(shape(system, sample))
    return [*_faint_parts(shapes), *_parts(shapes, released), *_fixed_parts(shapes, released)]


def _faint_parts(shapes: Shapes) -> Iterator[IconPart]:
    """Yield flexures and bodies in the straight shape."""
    yield from _flexures(shapes, shapes.straight, faint=True)
    for name in shapes.bodies:
        yield Area(shapes.areas(name, shapes.straight), None, GHOST, 0.0)


def _parts(shapes: Shapes, E: Complex) -> Iterator[IconPart]:
    """Yield flexures, bodies and pins in a shape."""
    yield from _flexures(shapes, E)
    for name in shapes.bodies:
        yield Area(shapes.areas(name, E), BODY, STEEL, 2.0)
        yield Dots(np.array([shapes.centre(name, E)]), STEEL, 3.5, 4.0)
    yield Dots(shapes.pins(E), "#ffffff", 4.5, 5.0)


def _fixed_parts(shapes: Shapes, E: Complex) -> Iterator[IconPart]:
    """Yield the ground and the walls."""
    for ground in shapes.ground():
        yield Line(ground, WALL, 1.0, 3.2)
    for i, stop in enumerate(shapes.system.mechanism.stops):
        wall = shapes.wall(i, value(stop, "position", shapes.system.values), E)
        yield Line(wall, WALL, 1.5, 3.5)


def _flexures(shapes: Shapes, E: Complex, *, faint: bool = False) -> Iterator[IconPart]:
    """Yield the flexures in a shape."""
    thin = len(shapes.flexures) >= THIN_LINES_MIN
    for line in shapes.flexures:
        if line.shaped:
            fill, edge = (None, GHOST) if faint else (BODY, STEEL)
            yield Area([line.edge(E)], fill, edge, 0.0 if faint else 1.0)
            continue
        width = 1.0 if faint else 1.5 if thin else 2.2
        yield Line(line.centre_line(E), GHOST if faint else STEEL, width, 0.0 if faint else 3.0)


# --- PNG ----------------------------------------------------------------------------------------


@singledispatch
def paint(part: IconPart, axes: Axes) -> None:
    """Draw a part of the icon with Matplotlib."""
    raise TypeError(f"{part!r} is not a part of an icon")


@paint.register
def _(part: Line, axes: Axes) -> None:
    axes.plot(
        part.z.real, part.z.imag, color=part.color, linewidth=part.width,
        solid_capstyle="butt", zorder=part.order,
    )  # fmt: skip


@paint.register
def _(part: Area, axes: Axes) -> None:
    axes.add_patch(
        PathPatch(
            area(part.rings), facecolor=part.fill or "none", edgecolor=part.edge, linewidth=1.0,
            joinstyle="round", zorder=part.order,
        )
    )  # fmt: skip


@paint.register
def _(part: Dots, axes: Axes) -> None:
    axes.plot(
        part.z.real, part.z.imag, "o", color=STEEL, markersize=part.diameter,
        markerfacecolor=part.fill, zorder=part.order,
    )  # fmt: skip


# --- SVG ----------------------------------------------------------------------------------------


def points(part: IconPart) -> Sequence[Complex]:
    """Return the lines of points of a part [m]."""
    return part.rings if isinstance(part, Area) else [part.z]


def elements(part: IconPart, placed: Sequence[Complex]) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield the SVG elements of a part, with its points in the picture [pt]."""
    if isinstance(part, Dots):
        for z in placed[0]:
            place = {"cx": f"{z.real:.2f}", "cy": f"{z.imag:.2f}"}
            yield "circle", place | {
                "r": f"{part.diameter / 2.0:g}", "fill": part.fill, "stroke": STEEL
            }  # fmt: skip
    elif isinstance(part, Area):
        attributes = {"d": " ".join(f"{_path(z)}Z" for z in placed), "stroke": part.edge}
        fill = {"fill": part.fill} if part.fill else {}
        yield "path", attributes | fill | {"stroke-linejoin": "round"}
    else:
        attributes = {"d": _path(placed[0]), "stroke": part.color}
        yield "path", attributes | {"stroke-width": f"{part.width:g}"}


def _path(z: Complex) -> str:
    """Return the commands of a path through points, which begins anew after each NaN."""
    words, pen = [], "M"
    for point in z:
        if np.isnan(point):
            pen = "M"
        else:
            words.append(f"{pen}{point.real:.2f},{point.imag:.2f}")
            pen = "L"
    return "".join(words)
