"""Figures of results for reports, without a window and independent of any matplotlibrc."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.atomic import write
from ..base.unit_text import length_unit, time_unit
from ..drawing.style import IMPACT, PAST, REST, own_style, png
from ..mechanics.arrays import Real
from ..mechanics.system import unit
from ..mechanism.description import Mechanism
from ..runs.marks import Mark, marks
from ..runs.result import Columns, Result, ResultError, column, names
from .scene import plain

ENERGIES = {  # Colours that colour-blind readers can distinguish.
    "kinetic": "#0072b2",
    "elastic": "#d55e00",
    "gravitational": "#009e73",
    "dissipated": "#cc79a7",
    "work": "#e69f00",
}
PANEL_HEIGHT, WIDTH = 1.9, 8.0  # Inches.

Panel = Callable[[Axes, "_Plot"], None]


def panels(
    rows: int, columns: int, size: tuple[float, float], dpi: float = 120
) -> tuple[Figure, list[Axes]]:
    """Return a new figure of a size [inch], and its axes, row by row."""
    figure = Figure(size, dpi=dpi, layout="constrained")
    every = [*np.atleast_1d(figure.subplots(rows, columns)).flat]
    for axes in every:
        plain(axes)
    return figure, every


class _Plot:
    """Data shared by the panels of a figure."""

    def __init__(self, result: Result | Columns, mechanism: Mechanism) -> None:
        self.columns = result.columns if isinstance(result, Result) else result
        self.mechanism = mechanism
        self.marks = marks(result, mechanism)
        span = float(column(self.columns, "time")[-1])
        self.factor, self.unit = time_unit(span)
        self.time: Real = self.factor * self.columns["time"]

    def has(self, *wanted: str) -> bool:
        """Return whether columns were recorded."""
        return all(name in names(self.columns) for name in wanted)

    def along(self, x: str, y: str) -> Real:
        """Return a vector of the released body along the direction of the release."""
        body, u = self.mechanism.release.body, unit(self.mechanism.release.direction)
        result: Real = u.real * self.columns[f"{body}.{x}"] + u.imag * self.columns[f"{body}.{y}"]
        return result


@own_style()
def response(result: Result | Columns, mechanism: Mechanism | None = None) -> Figure:
    """Plot a result over time: motion, speeds of the impacts, energies.

    Parameters
    ----------
    result : Result or structured array
        Result of :func:`prbm.runs.run.simulate`, or of FMPy.
    mechanism : Mechanism or None
        The mechanism; not needed for a :class:`~prbm.runs.result.Result`.

    Returns
    -------
    Figure
        One panel for each recorded quantity: displacement and velocity of the released body along
        the direction of its release, closing and opening speeds of the impacts, energies.  The sum
        of the energies less the work is constant.  Times at which a stop holds are shaded.

    Raises
    ------
    ResultError
        If the mechanism is not given, or none of these quantities was recorded.
    """
    if isinstance(result, Result):
        mechanism = result.mechanism
    if mechanism is None:
        raise ResultError(
            "the result has no mechanism; give the mechanism: response(result, mechanism)"
        )
    plot = _Plot(result, mechanism)
    body = mechanism.release.body
    drawn: list[Panel] = []
    if plot.has(f"{body}.x", f"{body}.y"):
        drawn.append(_displacement)
    if plot.has(f"{body}.vx", f"{body}.vy"):
        drawn.append(_velocity)
    if plot.marks:
        drawn.append(_speeds)
    if plot.has(*(f"energy.{name}" for name in ENERGIES)):
        drawn.append(_energies)
    if not drawn:
        raise ResultError(
            f"the result has nothing to plot: record {body}.x, {body}.y and the like, with FMPy "
            "as in simulate_fmu(...), which records all outputs by itself"
        )
    figure = Figure((WIDTH, 0.7 + PANEL_HEIGHT * len(drawn)), dpi=120, layout="constrained")
    every = np.atleast_1d(figure.subplots(len(drawn), 1, sharex=True))
    for axes, panel in zip(every, drawn, strict=True):
        _shade_rest(axes, plot)
        panel(axes, plot)
        plain(axes)
    above = 20.0 if drawn[0] is _energies else None  # Room for the legend [points].
    every[0].set_title(mechanism.title, fontsize=11, loc="left", pad=above)
    every[-1].set_xlabel(f"time [{plot.unit}]")
    every[-1].set_xlim(plot.time[0], plot.time[-1])
    figure.align_ylabels(list(every))
    return figure


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure to a PNG file, completely or not at all; return its path.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    path = Path(path)
    write(path, png(figure))
    return path


def _shade_rest(axes: Axes, plot: _Plot) -> None:
    """Shade the times at which a stop holds."""
    for stop in plot.mechanism.stops:
        if plot.has(f"{stop.name}.contact"):
            axes.fill_between(
                plot.time, 0.0, 1.0, where=plot.columns[f"{stop.name}.contact"] != 0,
                transform=axes.get_xaxis_transform(), color=REST, alpha=0.13, linewidth=0,
            )  # fmt: skip


def _displacement(axes: Axes, plot: _Plot) -> None:
    x = plot.along("x", "y")
    factor, unit_name = length_unit(float(np.abs(x).max()) or 1.0)
    body = plot.mechanism.release.body
    axes.plot(plot.time, factor * x, color=PAST, linewidth=1.4, label=body)
    if plot.marks:
        when = plot.factor * np.array([mark.time for mark in plot.marks])
        at_hit = np.interp(when, plot.time, factor * x)
        axes.plot(when, at_hit, "v", color=IMPACT, markersize=5, label="impact")
        axes.legend(loc="best", fontsize=9, frameon=False, ncols=2)
    axes.set_ylabel(f"displacement [{unit_name}]")


def _velocity(axes: Axes, plot: _Plot) -> None:
    axes.plot(plot.time, plot.along("vx", "vy"), color=PAST, linewidth=1.2)
    axes.set_ylabel("velocity [m/s]")


def _speeds(axes: Axes, plot: _Plot) -> None:
    """Plot the speeds of the impacts on a logarithmic scale."""
    kinds: dict[str, tuple[str, str, Callable[[Mark], float]]] = {
        "closing": ("v", IMPACT, lambda mark: mark.speed),
        "opening": ("^", PAST, lambda mark: mark.rebound),
    }
    for label, (marker, color, speed) in kinds.items():
        seen = [(plot.factor * m.time, speed(m)) for m in plot.marks if speed(m) > 0.0]
        if seen:
            axes.plot(*zip(*seen, strict=True), marker, color=color, markersize=5, label=label)
    if axes.lines:
        axes.set_yscale("log")
        axes.legend(loc="best", fontsize=9, frameon=False)
    axes.set_ylabel("impact speed [m/s]")


def _energies(axes: Axes, plot: _Plot) -> None:
    total = np.zeros(len(plot.time))
    for name, color in ENERGIES.items():
        energy = 1e3 * plot.columns[f"energy.{name}"]
        total += -energy if name == "work" else energy
        if np.any(energy):
            axes.plot(plot.time, energy, color=color, linewidth=1.2, label=name)
    axes.plot(plot.time, total, "--", color="black", linewidth=1.0, label="sum - work")
    axes.set_ylabel("energy [mJ]")
    axes.legend(  # Above the panel: there is no room between six curves.
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, fontsize=9, frameon=False,
        borderaxespad=0.0, columnspacing=1.4, handlelength=1.6,
    )  # fmt: skip
