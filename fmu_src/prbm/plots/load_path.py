"""Figure of the displacement under a load that varies, with its stability."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..analysis.equilibrium_curve import LoadPath
from ..drawing.style import IMPACT, PAST, REST, own_style
from ..mechanics.arrays import Real
from .holding import amount_axis
from .scene import plain


@own_style()
def load_path_figure(
    paths: Sequence[LoadPath], curves: Sequence[tuple[Real, Real]], label: str, title: str,
    turns: bool = False,
) -> Figure:  # fmt: skip
    """Draw a load over the displacement of the released body.

    Unstable shapes are dashed, limit points are diamonds and bifurcations circles.

    Parameters
    ----------
    paths : sequence of LoadPath
        The path, and its branches.
    curves : sequence of ((k,), (k,))
        Displacements [m], rotations [rad] with ``turns``, and loads of their points.
    label, title : str
        Label of the load, title.
    turns : bool
        Whether the amounts are rotations.
    """
    factor, along = amount_axis(np.concatenate([amounts for amounts, _ in curves]), turns)
    drawn = Figure((8.0, 4.6), dpi=120, layout="constrained")
    axes = drawn.subplots()
    for number, (path, (amounts, loads)) in enumerate(zip(paths, curves, strict=True)):
        color, name = (REST, "branch, ") if number else (PAST, "")
        names = (f"{name}unstable", f"{name}stable") if number < 2 else (None, None)
        stable = np.array([point.unstable == 0 for point in path.points])
        axes.plot(factor * amounts, loads, "--", color=color, linewidth=1.0, label=names[0])
        if stable[1:].any():
            shown = np.where(stable, loads, np.nan)
            axes.plot(factor * amounts, shown, color=color, linewidth=2.0, label=names[1])
    for kind, marker, color in (("limit point", "D", IMPACT), ("bifurcation", "o", REST)):
        at = [
            (factor * x, load)
            for path, curve in zip(paths, curves, strict=True)
            for x, load, point in zip(*curve, path.points, strict=True)
            if any(one is point and kind == what for what, one in path.events)
        ]
        if at:
            axes.plot(*zip(*at, strict=True), marker, color=color, ls="", label=kind)
    axes.axhline(0.0, color="#808080", linewidth=0.8)
    axes.set_xlabel(along)
    axes.set_ylabel(label)
    axes.set_title(title, fontsize=11, loc="left")
    axes.legend(fontsize=9, frameon=False)
    plain(axes)
    return drawn
