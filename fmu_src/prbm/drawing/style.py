"""Colours and style of all drawings: the icon here, figures and films in ``prbm.plots``.

A body, a flexure or a wall has the same colour in all drawings.  This module is in
``prbm.drawing`` because that is the lowest package that draws.
"""

import io
from collections.abc import Sequence
from functools import partial

import matplotlib.style
import numpy as np
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.rcsetup import cycler

from ..mechanics.arrays import Complex

LINK, FLEXURE, BODY, WALL = "#1f4e79", "#8fb4d8", "#9dc3e6", "#595959"
GROUND_COLOUR = "#dedede"
STRAIGHT, GRID, PROBE = "#b4bcc6", "#eeeeee", "#cc79a7"
PAST, FUTURE, IMPACT, REST = "#1f4e79", "#c8ced6", "#d55e00", "#009e73"

CYCLE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Colours of curves beside each other, which colour-blind readers can distinguish (Okabe, Ito)."""

# Independent of the user's matplotlibrc.
own_style = partial(matplotlib.style.context, ["default", {"axes.prop_cycle": cycler(color=CYCLE)}])


def area(rings: Sequence[Complex], scale: float = 1.0) -> Path:
    """Return the path of an area: an outline, and holes with the opposite sense of rotation."""
    closed = (np.append(ring, ring[0]) * scale for ring in rings)
    return Path.make_compound_path(
        *(Path(np.column_stack([z.real, z.imag]), closed=True) for z in closed)
    )


@own_style()
def png(figure: Figure, dpi: float | None = None) -> bytes:
    """Return a figure as a PNG file; equal figures give equal bytes.

    ``dpi`` is the resolution [1/inch] (default: that of the figure).
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi or "figure", metadata={"Software": None})
    return buffer.getvalue()
