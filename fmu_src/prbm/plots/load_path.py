"""Figure of the displacement under a load that varies, with its stability."""

import numpy as np
from matplotlib.figure import Figure

from ..analysis.load_path import LoadPath
from ..drawing.style import IMPACT, PAST, REST, own_style
from ..mechanics.arrays import Real
from .holding import amount_axis
from .scene import plain


@own_style()
def load_path_figure(
    path: LoadPath, amounts: Real, loads: Real, label: str, title: str, turns: bool = False
) -> Figure:
    """Draw a load over the displacement of the released body.

    Unstable shapes are dashed, limit points are diamonds and bifurcations circles.

    Parameters
    ----------
    path : LoadPath
        The path.
    amounts : (k,)
        Displacements of its points [m]; rotations [rad] with ``turns``.
    loads : (k,)
        Loads of its points, in the unit of the label.
    label, title : str
        Label of the load, title.
    turns : bool
        Whether the amounts are rotations.
    """
    factor, along = amount_axis(amounts, turns)
    drawn = Figure((8.0, 4.6), dpi=120, layout="constrained")
    axes = drawn.subplots()
    stable = np.array([point.unstable == 0 for point in path.points])
    axes.plot(factor * amounts, loads, "--", color=PAST, linewidth=1.0, label="unstable")
    shown = np.where(stable, loads, np.nan)
    axes.plot(factor * amounts, shown, color=PAST, linewidth=2.0, label="stable")
    for kind, marker, color in (("limit point", "D", IMPACT), ("bifurcation", "o", REST)):
        at = [k for k, point in enumerate(path.points) if (kind, point) in path.events]
        if at:
            axes.plot(factor * amounts[at], loads[at], marker, color=color, ls="", label=kind)
    axes.axhline(0.0, color="#808080", linewidth=0.8)
    axes.set_xlabel(along)
    axes.set_ylabel(label)
    axes.set_title(title, fontsize=11, loc="left")
    axes.legend(fontsize=9, frameon=False)
    plain(axes)
    return drawn
