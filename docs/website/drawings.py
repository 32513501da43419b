"""Drawings of mechanisms as SVG, whose colours the style sheet of the site sets."""

from xml.sax.saxutils import escape, quoteattr

from prbm.drawing.icon import elements, extent, parts, placement
from prbm.mechanism.description import Mechanism
from prbm.runs.engine import simulation

WIDTH = 320.0  # Width of a drawing [px]; lines keep their widths at any size.
SHARE = 0.9  # Share of the drawing that the parts fill.
ASPECT_MIN, ASPECT_MAX = 0.62, 1.0  # Height over width of a drawing.


def drawing(mechanism: Mechanism) -> str:
    """Return a drawing of a mechanism: its shape at release, and its straight shape behind it.

    The class of an element is the kind of its part, see :data:`prbm.drawing.icon.STYLES`.
    """
    drawn = [
        part for part in parts(mechanism, simulation(mechanism).outputs()) if part.kind != "centre"
    ]
    low, high = extent(drawn)
    aspect = (high - low).imag / (high - low).real
    height = WIDTH * min(max(aspect, ASPECT_MIN), ASPECT_MAX)
    place = placement(drawn, WIDTH, height, SHARE)
    lines = "\n".join(
        f'<{tag} class="{part.kind}" {_text(attributes)}/>'
        for part in drawn
        for tag, attributes in elements(part, place)
    )
    title = f"Drawing of {mechanism.name}"
    return (
        f'<svg class="mechanism" viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img" '
        f"aria-label={quoteattr(title)}>\n<title>{escape(title)}</title>\n{lines}\n</svg>"
    )


def _text(attributes: dict[str, str]) -> str:
    return " ".join(f"{name}={quoteattr(value)}" for name, value in attributes.items())
