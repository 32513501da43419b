"""The icon of a mechanism."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from ..mechanics.arrays import Complex, Real
from ..mechanics.assembly import assemble
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from .motion import angles, closed, stretched
from .shapes import Shapes, corners, curve
from .style import CURVED_PIVOTS_MAX, area, own_style, png

STEEL, BODY, WALL, GHOST = "#1f4e79", "#9dc3e6", "#595959", "#d0d0d0"
PIXELS = 256
DPI = 128
THIN_LINES_MIN = 5  # Mechanisms with at least this many flexures are drawn with thin lines.


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
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
    axes.set_aspect("equal")
    axes.axis("off")
    system = assemble(mechanism, mechanism.values())
    shapes = Shapes(system)
    draw(axes, shapes, shapes.straight, faint=True)
    draw(axes, shapes, shapes.arms(shape(system, sample)))
    axes.margins(0.04)
    return png(figure)


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


def draw(axes: Axes, shapes: Shapes, E: Complex, *, faint: bool = False) -> None:
    """Draw flexures, bodies, pins, ground and walls in a shape."""
    thin = len(shapes.flexures) >= THIN_LINES_MIN
    for line in shapes.flexures:
        z = corners(line.outline, E)
        z = z if len(z) - 2 > CURVED_PIVOTS_MAX else curve(z, line.guided)
        width = 1.0 if faint else 1.5 if thin else 2.2
        _line(axes, z, GHOST if faint else STEEL, width, 0.0 if faint else 3.0)
    for name in shapes.bodies:
        _body(axes, shapes, name, E, faint)
    if not faint:
        z = shapes.pins(E)
        axes.plot(
            z.real, z.imag, "o", color=STEEL, markersize=4.5, markerfacecolor="white", zorder=5
        )
        for ground in shapes.ground():
            _line(axes, ground, WALL, 1.0, 3.2)
        for i, stop in enumerate(shapes.system.mechanism.stops):
            wall = shapes.wall(i, value(stop, "position", shapes.system.values), E)
            _line(axes, wall, WALL, 1.5, 3.5)


def _line(axes: Axes, z: Complex, color: str, width: float, zorder: float) -> None:
    axes.plot(z.real, z.imag, color=color, linewidth=width, solid_capstyle="butt", zorder=zorder)


def _body(axes: Axes, shapes: Shapes, name: str, E: Complex, faint: bool) -> None:
    axes.add_patch(
        PathPatch(
            area(shapes.areas(name, E)),
            facecolor="none" if faint else BODY,
            edgecolor=GHOST if faint else STEEL,
            linewidth=1.0,
            joinstyle="round",
            zorder=0 if faint else 2,
        )
    )
    if not faint:
        centre = shapes.centre(name, E)
        axes.plot(centre.real, centre.imag, "o", color=STEEL, markersize=3.5, zorder=4)
