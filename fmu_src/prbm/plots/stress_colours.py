"""Flexures in the colours of their stress, the larger one of both faces, with a colour bar."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from ..drawing.shapes import FlexureLine, Shapes
from ..mechanics.arrays import Complex, Real

COLOURS_OF_STRESS = "YlOrRd"
STRESS_WIDTH = 5.0  # Width of the lines [points].
UNIT = "stress [MPa]"
FACTOR = 1e-6  # MPa per Pa.


def norm(largest: float) -> Normalize:
    """Return the range of the colours for a largest stress [Pa], in the unit of the bar."""
    return Normalize(0.0, FACTOR * largest or 1.0)


def stress_bar(figure: Figure, axes: Axes, colours: Normalize) -> None:
    """Draw the colour bar of the stress in given axes."""
    bar = figure.colorbar(ScalarMappable(colours, COLOURS_OF_STRESS), cax=axes)
    bar.set_label(UNIT, fontsize=9)
    bar.ax.tick_params(labelsize=8)


def stress_line(colours: Normalize, zorder: float = 2.5) -> LineCollection:
    """Return a line in the colours of the stress, without points yet."""
    return LineCollection(
        [], cmap=COLOURS_OF_STRESS, norm=colours, linewidths=STRESS_WIDTH, zorder=zorder
    )


def set_stress(
    line: LineCollection, z: Complex, position: Real, faces: Real, factor: float
) -> None:
    """Set the points and the colours of a line.

    Parameters
    ----------
    line : LineCollection
        The line.
    z : (p,)
        Points from the start to the end of the flexure [m].
    position : (m,)
        Positions of sections from the start [m].
    faces : (2, m)
        Stress of both faces there [Pa]; the larger magnitude is drawn.
    factor : float
        Unit of the axes [1/m].
    """
    lengths = np.abs(np.diff(z))
    place = (np.cumsum(lengths) - 0.5 * lengths) / lengths.sum() * (position[-1] - position[0])
    points = np.column_stack([z.real, z.imag]) * factor
    line.set_segments(list(np.stack([points[:-1], points[1:]], axis=1)))
    between = [np.interp(position[0] + place, position, face) for face in faces]
    line.set_array(FACTOR * np.abs(between).max(axis=0))


def drawn_line(line: FlexureLine, E: Complex, forwards: bool) -> Complex:
    """Return the drawn points of a flexure from its start to its end [m].

    Parameters
    ----------
    line : FlexureLine
        The flexure.  The outline of links begins at their near end, that of a beam at its start.
    E : (n,)
        Arms of the shape.
    forwards : bool
        Whether the near end is the start.
    """
    z = line.centre_line(E)
    return z if forwards or not line.jointed else z[::-1]


def directions_of(shapes: Shapes) -> dict[str, bool]:
    """Return whether the near end of each flexure is its start, by name."""
    connections = shapes.system.connections
    return {c.flexure.name: c.flexure.forwards for c in connections if c.flexure}
