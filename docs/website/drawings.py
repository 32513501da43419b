"""Drawings of mechanisms as SVG, whose colours the style sheet of the site sets."""

from xml.sax.saxutils import escape, quoteattr

import numpy as np

from prbm.drawing.icon import shape
from prbm.drawing.shapes import Shapes
from prbm.mechanics.arrays import Complex
from prbm.mechanics.assembly import assemble
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import value
from prbm.runs.engine import simulation

WIDTH = 320.0  # Width of a drawing [px]; lines keep their widths at any size.
MARGIN = 0.05  # Of the larger side.
ASPECT_MIN = 0.62  # Height over width of a drawing.


class Drawing:
    """A drawing of lines and areas, given in metres with y upwards."""

    def __init__(self) -> None:
        self.items: list[tuple[str, list[Complex], bool]] = []

    def line(self, kind: str, z: Complex) -> None:
        """Add a line; NaN separates its parts."""
        gaps = np.flatnonzero(np.isnan(z.real))
        parts = [part[~np.isnan(part.real)] for part in np.split(z, gaps)]
        self.items.append((kind, [part for part in parts if len(part) > 1], False))

    def area(self, kind: str, rings: list[Complex]) -> None:
        """Add an area with its holes."""
        self.items.append((kind, rings, True))

    def svg(self, title: str) -> str:
        """Return the drawing as an SVG element."""
        z = np.concatenate([part for _, parts, _ in self.items for part in parts])
        left, right, low, high = z.real.min(), z.real.max(), z.imag.min(), z.imag.max()
        margin = MARGIN * max(right - left, high - low)
        height = max(high - low + 2 * margin, ASPECT_MIN * (right - left + 2 * margin))
        scale = WIDTH / max(right - left + 2 * margin, height / 1.0)
        width_px, height_px = WIDTH, max(scale * height, ASPECT_MIN * WIDTH)
        middle = complex(left + right, low + high) / 2

        def path(part: Complex, closed: bool) -> str:
            p = (part - middle) * scale
            points = " ".join(
                f"{width_px / 2 + w.real:.1f},{height_px / 2 - w.imag:.1f}" for w in p
            )
            return f"M{points}" + ("Z" if closed else "")

        paths = "\n".join(
            f'<path class="{kind}" d="{"".join(path(part, closed) for part in parts)}"/>'
            for kind, parts, closed in self.items
        )
        return (
            f'<svg class="mechanism" viewBox="0 0 {width_px:.0f} {height_px:.0f}" role="img" '
            f"aria-label={quoteattr(title)}>\n<title>{escape(title)}</title>\n{paths}\n</svg>"
        )


def drawing(mechanism: Mechanism) -> str:
    """Return a drawing of a mechanism: its shape at release, and its straight shape behind it."""
    system = assemble(mechanism, mechanism.values())
    shapes = Shapes(system)
    released = shapes.arms(shape(system, simulation(mechanism).outputs()))
    drawn = Drawing()
    _flexures(drawn, "straight", shapes, shapes.straight)
    for name in shapes.bodies:
        drawn.area("straight", shapes.areas(name, shapes.straight))
    for ground in shapes.ground():
        drawn.line("ground", ground)
    for i, stop in enumerate(mechanism.stops):
        drawn.line("wall", shapes.wall(i, value(stop, "position", system.values), released))
    for name in shapes.bodies:
        drawn.area("body", shapes.areas(name, released))
    _flexures(drawn, "flexure", shapes, released)
    for z in shapes.pins(released):
        ring = 0.012 * shapes.size * np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 17))
        drawn.area("pin", [z + ring])
    return drawn.svg(f"Drawing of {mechanism.name}")


def _flexures(drawn: Drawing, kind: str, shapes: Shapes, arms: Complex) -> None:
    for line in shapes.flexures:
        if line.shaped:
            drawn.area(kind, [line.edge(arms)])
        else:
            drawn.line(kind, line.centre_line(arms))
