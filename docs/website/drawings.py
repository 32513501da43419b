"""Drawings of mechanisms as SVG, whose colours the style sheet of the site sets."""

from xml.sax.saxutils import escape, quoteattr

import numpy as np

from prbm.drawing.icon import Part, Placement, elements, extent, parts, placement
from prbm.mechanism.description import Mechanism
from prbm.runs.engine import simulation
from prbm.runs.experiment import experiment

WIDTH = 320.0  # Width of a drawing [px]; lines keep their widths at any size.
SHARE = 0.9  # Share of the drawing that the parts fill.
PERIODS, FRAMES = 1.6, 30  # Fundamental periods of a moving drawing, and its shapes.
SECONDS = 4.0  # Duration of a moving drawing.
ASPECT_MIN, ASPECT_MAX = 0.62, 1.0  # Height over width of a drawing.


def drawing(mechanism: Mechanism) -> str:
    """Return a moving drawing of a mechanism from its release on, before its straight shape.

    It repeats the motion of the first periods, with their impacts.  Without animation, it is the
    shape at release.

    The class of an element is the kind of its part, see :data:`prbm.drawing.icon.STYLES`.
    """
    shapes = _shapes(mechanism)
    low, high = extent([part for shape in shapes for part in shape])
    aspect = (high - low).imag / (high - low).real
    height = WIDTH * min(max(aspect, ASPECT_MIN), ASPECT_MAX)
    place = placement([part for shape in shapes for part in shape], WIDTH, height, SHARE)
    moving = zip(*(_elements(shape, place) for shape in shapes), strict=True)
    lines = "\n".join(_element(frames) for frames in moving)
    title = f"Drawing of {mechanism.name}"
    return (
        f'<svg class="mechanism" viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img" '
        f"aria-label={quoteattr(title)}>\n<title>{escape(title)}</title>\n{lines}\n</svg>"
    )


def _shapes(mechanism: Mechanism) -> list[list[Part]]:
    """Return the parts of a drawing at equal times from the release on."""
    motion, span = simulation(mechanism), experiment(mechanism)
    frequency = motion.outputs().get("solver.frequency", 0.0)
    end = min(PERIODS / frequency, span.stop_time) if frequency else span.stop_time
    result = []
    for time in np.linspace(0.0, end, FRAMES):
        if time:
            motion.advance(float(time))
        found = parts(mechanism, motion.outputs())
        result.append([part for part in found if part.kind != "centre"])
    return result


def _elements(shape: list[Part], place: Placement) -> list[tuple[str, str, dict[str, str]]]:
    """Return kind, tag and attributes of the elements of a shape."""
    return [(part.kind, *element) for part in shape for element in elements(part, place)]


def _element(frames: tuple[tuple[str, str, dict[str, str]], ...]) -> str:
    """Return an element whose attributes follow those of its frames."""
    kind, tag, attributes = frames[0]
    moves = []
    for name in attributes:
        values = [frame[2][name] for frame in frames]
        if len(set(values)) > 1:
            moves.append(
                f'<animate attributeName="{name}" dur="{SECONDS:g}s" repeatCount="indefinite" '
                f"values={quoteattr(';'.join(values))}/>"
            )
    head = f'<{tag} class="{kind}" {_text(attributes)}'
    return f"{head}>{''.join(moves)}</{tag}>" if moves else f"{head}/>"


def _text(attributes: dict[str, str]) -> str:
    return " ".join(f"{name}={quoteattr(value)}" for name, value in attributes.items())
