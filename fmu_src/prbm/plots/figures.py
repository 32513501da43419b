"""Figures of results for reports, without a window and independent of any matplotlibrc."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..base.atomic import write
from ..base.unit_text import length_unit, prefixed_unit, time_unit
from ..drawing.style import CYCLE, IMPACT, PAST, REST, WALL, own_style, png
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble
from ..mechanics.system import unit
from ..mechanism.description import Mechanism
from ..mechanism.parts import GROUND, Stop
from ..runs.marks import SPEED_RTOL, Mark, marks
from ..runs.released import (
    displacement_outputs,
    released_displacement,
    released_velocity,
    system_of,
    velocity_outputs,
)
from ..runs.result import (
    ZERO_MOTION_RTOL,
    Columns,
    Result,
    ResultError,
    body_motions,
    column,
    moves,
    names,
)
from .scene import plain

ENERGIES = dict(
    zip(("kinetic", "elastic", "gravitational", "dissipated", "work"), CYCLE, strict=False)
)
PANEL_HEIGHT, WIDTH = 1.9, 8.0  # Inches.
SETTLED_RTOL = 5e-3  # Deviation from the final position at which a motion has settled.
SETTLED_MARGIN = 0.15  # Time shown after the settling, as a share of the settling time.
SETTLED_SHARE_MAX = 0.7  # A motion that takes longer is shown up to the end of the result.
WALL_MARGIN = 0.5  # Walls are drawn up to this distance from the motion, as a share of it.
Y_MARGIN = 0.05  # Margin above and below the displacement, as a share of its range.
TOUCH_RTOL = 0.02  # Smaller gaps, as a share of their range, are contacts between two rows.
PARALLEL_ATOL = 1e-6  # Walls are drawn if their sine to the direction of release is smaller.
RATE_ANGLE = 1e-4  # rad: half the turn over which a rate is a central difference.
LOG_RATIO_MIN = 5.0  # Smaller ratios of impact speeds are drawn on a linear axis.
LABELLED_RATIO_MAX = 300.0  # Up to this ratio, 2 and 5 are labelled on a logarithmic axis.

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
        rigid = {stop.name for stop in mechanism.stops if not stop.compliant}
        known = result.impacts if isinstance(result, Result) else ()
        self.impacts = [hit for hit in known if hit.stop in rigid]
        self.system = (
            system_of(result)
            if isinstance(result, Result)
            else assemble(mechanism, mechanism.values())
        )
        self.size = self.system.length
        self.seconds: Real = np.asarray(column(self.columns, "time"), float)
        self.end = self._end()
        self.factor, self.unit = time_unit(self.end)
        self.time: Real = self.factor * self.seconds

    def has(self, *wanted: str) -> bool:
        """Return whether columns were recorded."""
        return all(name in names(self.columns) for name in wanted)

    def _end(self) -> float:
        """Return the last time to show: shortly after the motion has settled [s]."""
        first, last = float(self.seconds[0]), float(self.seconds[-1])
        motions = np.array(body_motions(self.columns, self.mechanism, self.size))
        if not len(motions) or not float(np.ptp(motions, axis=1).max()):
            return last
        limit = SETTLED_RTOL * float(np.ptp(motions, axis=1).max())
        moving = np.flatnonzero((np.abs(motions - motions[:, -1:]) > limit).any(axis=0))
        settled = max([float(self.seconds[moving[-1]]), *(mark.time for mark in self.marks)])
        end = settled + SETTLED_MARGIN * (settled - first)
        return end if first < end < first + SETTLED_SHARE_MAX * (last - first) else last

    def displacement(self) -> Real:
        """Return the displacement of the released point along the direction of the release [m]."""
        return released_displacement(self.system, self.columns)

    def through_impacts(self, x: Real, rate: bool = False) -> tuple[Real, Real]:
        """Return times in the unit of the axis and values with both sides of rigid impacts, (m,).

        ``x`` (n,) is the displacement or rotation of the released body at all rows, or its rate.
        """
        both = [(hit, change) for hit in self.impacts for change in (hit.before, hit.after)]
        times = [hit.time for hit, _ in both]
        values = [
            self._rate(hit.q, change) if rate else self.system.amount(hit.q) for hit, change in both
        ]
        rows = np.searchsorted(self.seconds, times)
        return self.factor * np.insert(self.seconds, rows, times), np.insert(x, rows, values)

    def _rate(self, q: Real, v: Real) -> float:
        """Return the rate of the displacement or rotation, by a central difference along v."""
        h = RATE_ANGLE / (float(np.abs(v).max()) or 1.0)
        return (self.system.amount(q + h * v) - self.system.amount(q - h * v)) / (2.0 * h)

    def draw_impacts(self, axes: Axes, time: Real, x: Real) -> None:
        """Mark the impacts on a curve."""
        if self.marks:
            when = self.factor * np.array([mark.time for mark in self.marks])
            at_hit = np.interp(when, time, x)
            axes.plot(when, at_hit, "v", color=IMPACT, markersize=5, label="impact")

    def at_rest(self) -> bool:
        """Return whether the recorded displacement of the released point is round-off."""
        if not self.has(*displacement_outputs(self.mechanism.release)):
            return False
        return float(np.ptp(self.displacement())) <= ZERO_MOTION_RTOL * self.size


@own_style()
def response(
    result: Result | Columns,
    mechanism: Mechanism | None = None,
    *,
    ax: Axes | Sequence[Axes] | None = None,
) -> Figure:
    """Plot a result over time: motion, speeds of the impacts, energies.

    Parameters
    ----------
    result : Result or structured array
        Result of :func:`prbm.runs.run.simulate`, or of FMPy.
    mechanism : Mechanism or None
        The mechanism; not needed for a :class:`~prbm.runs.result.Result`.
    ax : Axes, sequence of Axes, or None
        Axes of an own figure for the first panels, one each; None: a new figure with all panels.

    Returns
    -------
    Figure
        The figure of the axes.  One panel for each recorded quantity: displacement and velocity of
        the released point along the direction of its release, or rotation and rate of its body for
        a release by an angle; closing and opening speeds of the impacts, forces of compliant stops,
        energies.  The sum of the energies less the work is constant.  Times at which a stop holds
        are shaded.  The time axis ends shortly after the motion has settled.  If no body moves, the
        figure says so.

    Raises
    ------
    ResultError
        If the mechanism is not given, none of these quantities was recorded, or there are more axes
        than panels.
    """
    if isinstance(result, Result):
        mechanism = result.mechanism
    if mechanism is None:
        raise ResultError(
            "the result has no mechanism; give the mechanism: response(result, mechanism)"
        )
    plot = _Plot(result, mechanism)
    given = None if ax is None else [ax] if isinstance(ax, Axes) else [*ax]
    if not moves(plot.columns, mechanism, plot.size):
        return _motionless(plot, given)
    drawn = _panels(plot)
    if given is None:
        figure = Figure((WIDTH, 0.7 + PANEL_HEIGHT * len(drawn)), dpi=120, layout="constrained")
        every = [*np.atleast_1d(figure.subplots(len(drawn), 1, sharex=True))]
    else:
        if not 0 < len(given) <= len(drawn):
            raise ResultError(f"ax has {len(given)} axes for {len(drawn)} panels: give 1 or more")
        every = given
    for axes, panel in zip(every, drawn, strict=False):
        earlier = [*axes.get_ylim(), *axes.get_xlim()] if axes.has_data() else None
        _shade_rest(axes, plot)
        panel(axes, plot)
        plain(axes)
        axes.set_xlim(plot.time[0], plot.factor * plot.end)
        if given is not None:
            _share(axes, earlier)
    every[-1].set_xlabel(f"time [{plot.unit}]")
    if given is not None:
        return _figure_of(every[0])
    above = 20.0 if drawn[0] is _energies else None  # Room for the legend [points].
    every[0].set_title(mechanism.title, fontsize=11, loc="left", pad=above)
    figure.align_ylabels(every)
    return figure


def _share(axes: Axes, earlier: list[float] | None) -> None:
    """Show what was drawn before, too, and list each label once, in a column."""
    if earlier is not None:
        bottom, top, left, right = earlier
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, bottom), max(high, top))
        axes.set_xlim(min(left, axes.get_xlim()[0]), max(right, axes.get_xlim()[1]))
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    if len(once) > 1:
        axes.legend([*once.values()], [*once], loc="best", fontsize=9, frameon=False)


def _figure_of(axes: Axes) -> Figure:
    """Return the figure of axes, that of all subfigures."""
    figure = axes.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def _panels(plot: _Plot) -> list[Panel]:
    """Return the panels of the recorded quantities."""
    release = plot.mechanism.release
    body, turns = release.body, release.turns
    drawn: list[Panel] = []
    if plot.has(f"{body}.angle") if turns else plot.has(*displacement_outputs(release)):
        drawn.append(_rotation if turns else _displacement)
    if plot.has(f"{body}.omega") if turns else plot.has(*velocity_outputs(release)):
        drawn.append(_turning if turns else _velocity)
    if plot.marks:
        drawn.append(_speeds)
    if any(stop.compliant and plot.has(f"{stop.name}.force") for stop in plot.mechanism.stops):
        drawn.append(_forces)
    if plot.has(*(f"energy.{name}" for name in ENERGIES)):
        drawn.append(_energies)
    if not drawn:
        raise ResultError(
            f"the result has nothing to plot: record {body}.x, {body}.y and the like, with FMPy "
            "as in simulate_fmu(...), which records all outputs by itself"
        )
    return drawn


def _motionless(plot: _Plot, given: Sequence[Axes] | None) -> Figure:
    """Return the figure of a result without motion."""
    if given:
        axes = given[0]
    else:
        axes = Figure((WIDTH, PANEL_HEIGHT), dpi=120, layout="constrained").subplots()
        axes.set_title(plot.mechanism.title, fontsize=11, loc="left")
    axes.axis("off")
    axes.text(
        0.5, 0.5, f"nothing moves in {plot.seconds[-1]:g} s", ha="center", va="center",
        transform=axes.transAxes,
    )  # fmt: skip
    return _figure_of(axes)


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
    x = plot.displacement()
    if plot.at_rest():
        x = np.full(len(x), round(float(x[0]) / plot.size, 9) * plot.size)
    factor, unit_name = length_unit(float(np.abs(x).max()) or plot.size)
    body = plot.mechanism.release.body
    time, through = plot.through_impacts(x)
    axes.plot(time, factor * through, color=PAST, linewidth=1.4, label=body)
    plot.draw_impacts(axes, time, factor * through)
    _walls(axes, plot, x, factor)
    if len(axes.lines) > 1:
        axes.legend(loc="best", fontsize=9, frameon=False, ncols=3)
    axes.set_ylabel(f"displacement [{unit_name}]")


def _rotation(axes: Axes, plot: _Plot) -> None:
    body = plot.mechanism.release.body
    angle = plot.columns[f"{body}.angle"]
    time, through = plot.through_impacts(angle)
    axes.plot(time, np.degrees(through), color=PAST, linewidth=1.4, label=body)
    plot.draw_impacts(axes, time, np.degrees(through))
    _touched(axes, plot, np.degrees(angle))
    if len(axes.lines) > 1:
        axes.legend(loc="best", fontsize=9, frameon=False, ncols=3)
    axes.set_ylabel("rotation [deg]")


def _touched(axes: Axes, plot: _Plot, angle: Real) -> None:
    """Draw the rotations at which the body touches walls that are fixed to the ground."""
    for stop in plot.mechanism.stops:
        moving = f"{stop.name}.displacement"
        if stop.body != plot.mechanism.release.body or stop.on != GROUND:
            continue
        if not plot.has(f"{stop.name}.gap") or (plot.has(moving) and np.ptp(plot.columns[moving])):
            continue
        gap = plot.columns[f"{stop.name}.gap"]
        k = int(np.argmin(np.abs(gap)))
        if abs(gap[k]) <= TOUCH_RTOL * np.ptp(gap):
            name = stop.name if len(plot.mechanism.stops) > 1 else "wall"
            axes.axhline(angle[k], color=WALL, linewidth=1.6, zorder=1.5, label=name)


def _turning(axes: Axes, plot: _Plot) -> None:
    omega = plot.columns[f"{plot.mechanism.release.body}.omega"]
    axes.plot(*plot.through_impacts(omega, rate=True), color=PAST, linewidth=1.2)
    axes.set_ylabel("rate [rad/s]")


def _walls(axes: Axes, plot: _Plot, x: Real, factor: float) -> None:
    """Draw the displacements at which the released body touches its walls."""
    release = plot.mechanism.release
    low, high, room = float(x.min()), float(x.max()), WALL_MARGIN * float(np.ptp(x))
    shown = [low, high]
    for stop in plot.mechanism.stops:
        turn = unit(stop.direction) * unit(release.direction).conjugate()
        if stop.body != release.body or abs(turn.imag) > PARALLEL_ATOL:
            continue
        if not plot.has(f"{stop.name}.gap"):
            continue
        gap = plot.columns[f"{stop.name}.gap"]
        wall = x + turn.real * gap
        moving = f"{stop.name}.displacement"
        if stop.on == GROUND and not (plot.has(moving) and np.ptp(plot.columns[moving])):
            wall = np.full(len(x), wall[np.argmin(gap)])  # Rotations of the body shift the others.
        if low - room <= wall.max() and wall.min() <= high + room:
            name = stop.name if len(plot.mechanism.stops) > 1 else "wall"
            axes.plot(plot.time, factor * wall, color=WALL, linewidth=1.6, zorder=1.5, label=name)
            shown += np.clip(wall, low - room, high + room).tolist()
    margin = Y_MARGIN * ((max(shown) - min(shown)) or plot.size)
    axes.set_ylim(factor * (min(shown) - margin), factor * (max(shown) + margin))


def _velocity(axes: Axes, plot: _Plot) -> None:
    at_rest = plot.at_rest()
    v = np.zeros(len(plot.time)) if at_rest else released_velocity(plot.system, plot.columns)
    time, through = plot.through_impacts(v, rate=True)
    factor, unit_name = prefixed_unit(float(np.abs(through).max()), "m/s")
    axes.plot(time, factor * through, color=PAST, linewidth=1.2)
    axes.set_ylabel(f"velocity [{unit_name}]")


def _speeds(axes: Axes, plot: _Plot) -> None:
    """Plot the speeds of the impacts, on a logarithmic axis if they differ much."""
    kinds: dict[str, tuple[str, str, Callable[[Mark], float]]] = {
        "closing": ("v", IMPACT, lambda mark: mark.speed),
        "opening": ("^", PAST, lambda mark: mark.rebound),
    }
    every = [x for *_, speed in kinds.values() for x in map(speed, plot.marks)]
    least = SPEED_RTOL * max(every, default=0.0)
    speeds = [x for x in every if x > least]
    factor, unit_name = prefixed_unit(max(speeds, default=0.0), "m/s")
    for label, (marker, color, speed) in kinds.items():
        seen = [(plot.factor * m.time, factor * speed(m)) for m in plot.marks if speed(m) > least]
        if seen:
            axes.plot(*zip(*seen, strict=True), marker, color=color, markersize=5, label=label)
    if axes.lines:
        _set_scale(axes, max(speeds) / min(speeds))
        axes.legend(loc="best", fontsize=9, frameon=False)
    axes.set_ylabel(f"impact speed [{unit_name}]")


def _forces(axes: Axes, plot: _Plot) -> None:
    peaks = [(mark.stop, plot.factor * mark.time, mark.force) for mark in plot.marks]
    stops = [stop for stop in plot.mechanism.stops if plot.has(f"{stop.name}.force")]
    named = [(plot.mechanism.stops[i].name, time, force) for i, time, force in peaks]
    stop_forces(axes, plot.time, plot.columns, stops, named)


def stop_forces(
    axes: Axes,
    time: Real,
    columns: Columns,
    stops: Sequence[Stop],
    peaks: Sequence[tuple[str, float, float]],
) -> None:
    """Draw the forces of stops.

    Parameters
    ----------
    time : (n,)
        Times of the columns, in the unit of the axes.
    columns : mapping or structured array
        Recorded outputs.
    stops : sequence of Stop
        The stops.
    peaks : sequence of (str, float, float)
        Stop, time and peak force [N] of each hit, which can be shorter than a step of the columns.
        Those with a force get a mark.
    """
    hits = [peak for peak in peaks if peak[2] > 0.0]
    forces = {stop.name: np.asarray(columns[f"{stop.name}.force"], float) for stop in stops}
    sizes = [float(np.abs(force).max()) for force in forces.values()]
    factor, shown = prefixed_unit(max([*sizes, *(force for *_, force in hits)]) or 1.0, "N")
    for stop in stops:
        (line,) = axes.plot(time, factor * forces[stop.name], linewidth=1.2, label=stop.name)
        own = [(at, factor * force) for name, at, force in hits if name == stop.name]
        if own:
            axes.plot(*zip(*own, strict=True), "v", markersize=4, color=line.get_color())
    axes.set_ylabel(f"stop force [{shown}]")
    if len(stops) > 1:
        axes.legend(loc="best", fontsize=9, frameon=False)


def _set_scale(axes: Axes, ratio: float) -> None:
    """Choose a linear or logarithmic axis with several labels for values of a ratio."""
    if ratio < LOG_RATIO_MIN:
        axes.set_ylim(bottom=0.0)
        return
    axes.set_yscale("log")
    if ratio <= LABELLED_RATIO_MAX:
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())


def _energies(axes: Axes, plot: _Plot) -> None:
    total = np.zeros(len(plot.time))
    largest = max(float(np.abs(plot.columns[f"energy.{name}"]).max()) for name in ENERGIES)
    factor, unit_name = prefixed_unit(largest, "J")
    for name, color in ENERGIES.items():
        energy = factor * plot.columns[f"energy.{name}"]
        total += -energy if name == "work" else energy
        if np.any(energy):
            axes.plot(plot.time, energy, color=color, linewidth=1.2, label=name)
    axes.plot(plot.time, total, "--", color="black", linewidth=1.0, label="sum - work")
    axes.set_ylabel(f"energy [{unit_name}]")
    axes.legend(  # Above the panel: there is no room between six curves.
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, fontsize=9, frameon=False,
        borderaxespad=0.0, columnspacing=1.4, handlelength=1.6,
    )  # fmt: skip
