"""The parts of a small drawing of a mechanism, and its icon as PNG and as SVG."""

from collections.abc import Callable, Iterator, Mapping, Sequence
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
from .style import GROUND_COLOUR, area, own_style, png

STEEL, BODY, WALL, GHOST = "#1f4e79", "#9dc3e6", "#595959", "#d0d0d0"
BACKGROUND = "#ffffff"  # As of the PNG: lines are dark and would vanish in tools with a dark theme.
PIXELS = 256
DPI = 128
POINTS = 72.0 * PIXELS / DPI  # Width and height of the icon [pt], the unit of lines and dots.
FRAME = 0.02  # Empty border on each side, as a share of the icon.
MARGIN = 0.04  # Margin on each side, as a share of the drawing.
THIN_LINES_MIN = 5  # Mechanisms with at least this many flexures are drawn with thin lines.
SVG = "http://www.w3.org/2000/svg"


@dataclass(frozen=True)
class Style:
    """Colours, width of lines [pt], diameter of dots [pt] and order of a part of the icon.

    Parts of higher order are drawn over the others.  Without ``fill`` the part is not filled.
    """

    order: float
    stroke: str
    width: float = 1.0
    fill: str | None = None
    diameter: float = 0.0


STYLES = {
    "straight": Style(0.0, GHOST),
    "leaf": Style(3.0, STEEL, 2.2),
    "leaf thin": Style(3.0, STEEL, 1.5),
    "spring": Style(3.1, STEEL, 0.9),
    "profile": Style(1.0, STEEL, fill=BODY),
    "body": Style(2.0, STEEL, fill=BODY),
    "fixed": Style(-1.0, WALL, 0.7, fill=GROUND_COLOUR),
    "centre": Style(4.0, STEEL, fill=STEEL, diameter=3.5),
    "pin": Style(5.0, STEEL, fill="#ffffff", diameter=4.5),
    "ground": Style(3.2, WALL),
    "wall": Style(3.5, WALL, 1.5),
}
"""The style of each kind of part."""


@dataclass(frozen=True)
class Line:
    """A line through points z [m], in pieces that NaN separates."""

    kind: str
    z: Complex


@dataclass(frozen=True)
class Area:
    """An area: the corners of its outline and of its holes [m]."""

    kind: str
    rings: Sequence[Complex]


@dataclass(frozen=True)
class Dots:
    """Dots at points z [m]."""

    kind: str
    z: Complex


Part = Line | Area | Dots


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
        paint(part, STYLES[part.kind], axes)
    axes.margins(MARGIN)
    return png(figure)


def vector_icon(mechanism: Mechanism, sample: Mapping[str, float]) -> bytes:
    """Return the icon as SVG, with the background and the parts of the PNG.

    Equal arguments give equal bytes.  The arguments are those of :func:`icon`.
    """
    drawn = parts(mechanism, sample)
    place = placement(drawn, POINTS, POINTS, (1.0 - 2.0 * FRAME) / (1.0 + 2.0 * MARGIN))
    box = {"viewBox": f"0 0 {POINTS:g} {POINTS:g}", "width": str(PIXELS), "height": str(PIXELS)}
    root = Element("svg", {"xmlns": SVG, **box, "role": "img", "fill": "none"})
    SubElement(root, "title").text = printable(mechanism.title)
    SubElement(root, "rect", {"width": "100%", "height": "100%", "fill": BACKGROUND})
    for part in drawn:
        for tag, attributes in elements(part, place):
            SubElement(root, tag, attributes | _presentation(part))
    indent(root)
    text: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def shape(system: System, sample: Mapping[str, float]) -> Real:
    """Return the coordinates of a sample of outputs; the stretches close the loops."""
    q = np.array(system.q0)
    for name, j in angles(system).items():
        q[j] = sample[name] / system.units[j]
    displacements = {
        name: np.array([complex(sample[f"{name}.x"], sample[f"{name}.y"])])
        for name in system.bodies
    }
    return closed(system, stretched(system, q[None], displacements)[0])


# --- parts --------------------------------------------------------------------------------------


def parts(mechanism: Mechanism, sample: Mapping[str, float]) -> list[Part]:
    """Return the parts of a drawing, the lowest first; the arguments are those of :func:`icon`."""
    system = assemble(mechanism, mechanism.values())
    shapes = Shapes(system)
    released = shapes.arms(shape(system, sample))
    found = [*_faint_parts(shapes), *_parts(shapes, released), *_fixed_parts(shapes, released)]
    return sorted(found, key=lambda part: STYLES[part.kind].order)


def _faint_parts(shapes: Shapes) -> Iterator[Part]:
    """Yield flexures and bodies in the straight shape."""
    for line in shapes.flexures:
        yield Line("straight", line.drawn(shapes.straight))
    for name in shapes.bodies:
        yield Area("straight", shapes.areas(name, shapes.straight))


def _parts(shapes: Shapes, E: Complex) -> Iterator[Part]:
    """Yield flexures, springs, guides, bodies and pins in a shape."""
    leaf = "leaf thin" if len(shapes.flexures) >= THIN_LINES_MIN else "leaf"
    for line in shapes.flexures:
        if line.shaped:
            yield Area("profile", [line.edge(E)])
        else:
            yield Line(leaf, line.centre_line(E))
    for drawn in (*shapes.springs(E), *shapes.slots(E)):
        yield Line("spring", drawn)
    for name in shapes.bodies:
        yield Area("body", shapes.areas(name, E))
        yield Dots("centre", np.array([shapes.centre(name, E)]))
    yield Dots("pin", shapes.pins(E))


def _fixed_parts(shapes: Shapes, E: Complex) -> Iterator[Part]:
    """Yield the ground and the walls."""
    for rings in shapes.ground_areas:
        yield Area("fixed", rings)
    for ground in shapes.ground():
        yield Line("ground", ground)
    for i, stop in enumerate(shapes.system.mechanism.stops):
        yield Line("wall", shapes.wall(i, value(stop, "position", shapes.system.values), E))


# --- PNG ----------------------------------------------------------------------------------------


@singledispatch
def paint(part: Part, style: Style, axes: Axes) -> None:
    """Draw a part of the icon with Matplotlib."""
    raise TypeError(f"{part!r} is not a part of an icon")


@paint.register
def _(part: Line, style: Style, axes: Axes) -> None:
    axes.plot(
        part.z.real, part.z.imag, color=style.stroke, linewidth=style.width,
        solid_capstyle="butt", zorder=style.order,
    )  # fmt: skip


@paint.register
def _(part: Area, style: Style, axes: Axes) -> None:
    axes.add_patch(
        PathPatch(
            area(part.rings), facecolor=style.fill or "none", edgecolor=style.stroke,
            linewidth=style.width, joinstyle="round", zorder=style.order,
        )
    )  # fmt: skip


@paint.register
def _(part: Dots, style: Style, axes: Axes) -> None:
    axes.plot(
        part.z.real, part.z.imag, "o", color=style.stroke, markersize=style.diameter,
        markerfacecolor=style.fill, zorder=style.order,
    )  # fmt: skip


# --- SVG ----------------------------------------------------------------------------------------


Placement = Callable[[Complex], Complex]


def placement(drawn: Sequence[Part], width: float, height: float, share: float) -> Placement:
    """Return the function from positions [m] to those in a picture, from its upper left corner.

    Parameters
    ----------
    drawn : sequence of parts
        The parts, which fill the picture in one direction.
    width, height : float
        Size of the picture.
    share : float
        Share of the picture for the parts, the rest is its margin.
    """
    low, high = extent(drawn)
    size = high - low
    scale = share / max(size.real / width, size.imag / height)

    def place(z: Complex) -> Complex:
        """Return positions in the picture."""
        placed: Complex = np.conj(scale * (z - (low + high) / 2.0)) + complex(width, height) / 2.0
        return placed

    return place


def extent(drawn: Sequence[Part]) -> tuple[complex, complex]:
    """Return the lower left and the upper right corner of parts [m]."""
    every = np.concatenate([z for part in drawn for z in _lines(part)])
    return (
        complex(np.nanmin(every.real), np.nanmin(every.imag)),
        complex(np.nanmax(every.real), np.nanmax(every.imag)),
    )


def elements(part: Part, place: Placement) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield the SVG elements of a part at their places in the picture, without colours."""
    if isinstance(part, Dots):
        radius = f"{STYLES[part.kind].diameter / 2.0:g}"
        for z in place(part.z):
            yield "circle", {"cx": f"{z.real:.2f}", "cy": f"{z.imag:.2f}", "r": radius}
    else:
        close = "Z" if isinstance(part, Area) else ""
        yield "path", {"d": " ".join(f"{_path(place(z))}{close}" for z in _lines(part))}


def _presentation(part: Part) -> dict[str, str]:
    """Return the colours and the width of the lines of a part as attributes in SVG."""
    style = STYLES[part.kind]
    fill = {} if style.fill is None else {"fill": style.fill}
    return fill | {
        "stroke": style.stroke, "stroke-width": f"{style.width:g}", "stroke-linejoin": "round"
    }  # fmt: skip


def _lines(part: Part) -> Sequence[Complex]:
    """Return the lines of points of a part [m]."""
    return part.rings if isinstance(part, Area) else [part.z]


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
