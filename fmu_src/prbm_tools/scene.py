"""A figure of a mechanism in motion, to scale, above a trace of its gaps."""

import itertools
import math
from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from prbm import System
from prbm.assembly import Complex, Outline, Real, unit
from prbm.mechanism import GROUND, Flexure, body_of

from .motion import Film, Motion, pace

LINK, FLEXURE, BODY, WALL = "#1f4e79", "#8fb4d8", "#9dc3e6", "#595959"
STRAIGHT, GRID = "#b4bcc6", "#eeeeee"
PAST, FUTURE, IMPACT, REST = "#1f4e79", "#c8ced6", "#d55e00", "#009e73"
COLOURS = (LINK, FLEXURE, BODY, WALL, STRAIGHT, GRID, FUTURE, IMPACT, REST, "#ffffff", "#000000")
own_style = partial(matplotlib.style.context, "default")  # whatever matplotlibrc says
SMOOTH = 40  # points along a flexure's curve
CHAIN = 9  # pivots; a flexure of more is a smooth curve already
THINNEST_BODY = 0.04  # of the size of the mechanism: a body without height is drawn this thick
WALL_LENGTH, GROUND_LENGTH = 0.36, 0.16  # of the size of the mechanism
MARGIN = 0.06  # of the mechanism's size, around the motion
FLASH = 0.28  # s of the film that a flash takes to fade
SMALLEST_FLASH, LARGEST_FLASH = 8.0, 34.0  # points
SIZE, DPI = (8.0, 6.4), 100  # inches; even numbers of pixels, which video codecs want


def corners(outline: Outline, q: Real) -> Complex:
    """Return the corners of an outline in a shape, z = c + A exp(i q) [m]."""
    z: Complex = outline.c + outline.A @ np.exp(1j * q)
    return z


def curve(z: Complex, clamped: tuple[bool, bool]) -> Complex:
    """Return a smooth curve between the ends of a flexure, along the stubs where it is clamped.

    Hermite's cubic, which for small deflections is the elastic line; at a pin its curvature
    is zero.

    Parameters
    ----------
    z : (p,)
        Corners of the flexure: start, pivots, end [m].
    clamped : pair of bool
        Whether the start and the end are clamped.
    """
    length = float(np.abs(np.diff(z)).sum())
    steps = [d for d in np.diff(z) if abs(d) > 1e-9 * length]
    chord = z[-1] - z[0]
    a, b = (length * d / abs(d) for d in (steps[0], steps[-1]))
    if not clamped[0]:
        a = (3.0 * chord - b) / 2.0
    if not clamped[1]:
        b = (3.0 * chord - a) / 2.0
    s = np.linspace(0.0, 1.0, SMOOTH)
    r = 1.0 - s
    result: Complex = (
        z[0] * (1.0 + 2.0 * s) * r**2 + z[-1] * (3.0 - 2.0 * s) * s**2 + r * s * (r * a - s * b)
    )
    return result


def box(system: System, name: str) -> Complex:
    """Return the four corners of a body about its centre of mass, as drawn [m].

    The smallest box about the centre that holds the body's points and the points that hit.
    """
    frame = system.bodies[name]
    points = [c for o in system.outlines if o.name == name for c in corners(o, system.q0)]
    for stop, line in _hit_outlines(system):
        if system.mechanism.stops[stop].body == name:
            points += list(corners(line, system.q0))
    reach = np.array([*points, frame.drawn]) - frame.drawn
    least = THINNEST_BODY * system.length / 2
    x, y = (max(float(np.abs(part).max()), least) for part in (reach.real, reach.imag))
    return np.array([complex(-x, -y), complex(x, -y), complex(x, y), complex(-x, y)])


def _hit_outlines(system: System) -> list[tuple[int, Outline]]:
    lines = {o.name: o for o in system.outlines if o.kind == "stop"}
    return [(i, lines[stop.name]) for i, stop in enumerate(system.mechanism.stops)]


def hatched(place: complex, into: complex, size: float) -> Complex:
    """Return a line through a place, hatched towards ``into``; breaks are not numbers."""
    along = 1j * into * size
    strokes = 6
    parts = [place - along / 2, place + along / 2, complex(np.nan, np.nan)]
    for k in range(strokes):
        z = place + along * ((k + 0.5) / strokes - 0.5)
        parts += [z, z + (into * size - along) * 0.6 / strokes, complex(np.nan, np.nan)]
    return np.array(parts)


def _quiet(axes: Axes) -> None:
    """Keep the frame of a plot in the background."""
    axes.tick_params(labelsize=8, colors="#606060")
    axes.set_axisbelow(True)
    axes.grid(color=GRID, linewidth=0.6)
    for spine in axes.spines.values():
        spine.set_color("#c0c0c0")


def length_unit(size: float) -> tuple[float, str]:
    """Return a unit in which a length has a handy number, as its factor and name.

    Examples
    --------
    >>> length_unit(0.08), length_unit(3e-4)
    ((1000.0, 'mm'), (1000000.0, 'µm'))
    """
    for factor, name in ((1.0, "m"), (1e3, "mm"), (1e6, "µm")):
        if size * factor >= 2.0:
            return factor, name
    return 1e9, "nm"


def time_unit(span: float) -> tuple[float, str]:
    """Return a unit in which a duration has a handy number, as its factor and name.

    Examples
    --------
    >>> time_unit(0.3), time_unit(4.0)
    ((1000.0, 'ms'), (1.0, 's'))
    """
    for factor, name in ((1.0, "s"), (1e3, "ms")):
        if span * factor >= 2.0:
            return factor, name
    return 1e6, "µs"


class Scene:
    """A figure of the mechanism above a trace of its gaps, one frame at a time.

    Parameters
    ----------
    motion : Motion
        What moves.
    film : Film
        Which times are shown.
    figure : Figure or None
        Where to draw; None: a new figure, which belongs to no window.

    Attributes
    ----------
    links, curves, bodies, hits, walls : dict of str to artist
        What moves, by the names of flexures, bodies and stops, in the unit of the axes.
    """

    @own_style()
    def __init__(self, motion: Motion, film: Film, figure: Figure | None = None) -> None:
        self.motion, self.film = motion, film
        self.system = motion.system
        self.figure = figure or Figure(SIZE, DPI)
        if figure is None:
            FigureCanvasAgg(self.figure)
        self.factor, self.unit = length_unit(self.system.length)
        grid = self.figure.add_gridspec(
            2, 1, height_ratios=(3.4, 1.0), hspace=0.2,
            left=0.09, right=0.98, bottom=0.075, top=0.945,
        )  # fmt: skip
        self.stage: Axes = self.figure.add_subplot(grid[0])
        self.trace: Axes = self.figure.add_subplot(grid[1])
        self.flexures = self._flexures()
        self.clamped = {
            f.name: (f.ends[0] == "clamp", f.ends[1] == "clamp") for f, _ in self.flexures
        }
        self.boxes = {name: box(self.system, name) for name in self.system.bodies}
        self.moving: list[Artist] = []
        self._set_stage()
        self._set_trace()
        self.figure.text(
            0.02, 0.985, self.system.mechanism.name, ha="left", va="top",
            fontsize=11, fontweight="bold",
        )  # fmt: skip
        self.text = self.figure.text(
            0.98, 0.985, "", ha="right", va="top", fontsize=11, family="monospace"
        )
        self.moving.append(self.text)
        self.moving.sort(key=lambda artist: artist.get_zorder())

    def _flexures(self) -> list[tuple[Flexure, Outline]]:
        named = {flexure.name: flexure for flexure in self.system.mechanism.flexures}
        return [(named[o.name], o) for o in self.system.outlines if o.kind == "flexure"]

    # -- what stands still --

    def _set_stage(self) -> None:
        stage, size = self.stage, self.system.length
        stage.set_aspect("equal", adjustable="box", anchor="C")
        stage.set_xlabel(f"x [{self.unit}]", fontsize=9, labelpad=1)
        stage.set_ylabel(f"y [{self.unit}]", fontsize=9, labelpad=1)
        _quiet(stage)
        straight = self.system.q0
        for flexure, line in self.flexures:
            z = corners(line, straight)
            for end, place, into in (
                (flexure.start, z[0], z[0] - z[-1]), (flexure.end, z[-1], z[-1] - z[0]),
            ):  # fmt: skip
                if body_of(end) == GROUND:
                    self._line(hatched(place, into / abs(into), GROUND_LENGTH * size), WALL, 1.2)
            self._line(z, STRAIGHT, 1.0, zorder=0.5).set_linestyle("--")
        self._set_flexures()
        self._set_bodies()
        self._set_stops()
        self._set_limits()

    def _set_flexures(self) -> None:
        self.curves, self.links = {}, {}
        for flexure, line in self.flexures:
            pivots = len(line.c) - 2
            if pivots <= CHAIN:
                self.curves[flexure.name] = self._moving_line(FLEXURE, 5.0, zorder=2.0)
            self.links[flexure.name] = self._moving_line(
                LINK, 1.3, zorder=4.0, marker="o", markersize=4.2 if pivots <= CHAIN else 2.0,
                markerfacecolor="white", markevery=slice(1, -1),
            )  # fmt: skip

    def _set_bodies(self) -> None:
        self.bodies: dict[str, Polygon] = {}
        self.centres: dict[str, Line2D] = {}
        for name in self.system.bodies:
            patch = Polygon(
                np.zeros((4, 2)), facecolor=BODY, edgecolor=LINK, linewidth=1.2, alpha=0.9,
                joinstyle="round", zorder=3.0,
            )  # fmt: skip
            self.stage.add_patch(patch)
            self.moving.append(patch)
            self.bodies[name] = patch
            self.centres[name] = self._moving_line(
                LINK, 0.0, zorder=4.0, marker="P", markersize=6.0, markeredgecolor="white"
            )

    def _set_stops(self) -> None:
        self.walls, self.hits, self.flashes = {}, {}, {}
        for stop in self.system.mechanism.stops:
            self.walls[stop.name] = self._moving_line(WALL, 1.8, zorder=3.5)
            self.flashes[stop.name] = self._moving_line(
                IMPACT, 0.0, zorder=6.0, marker=(8, 1, 0), markeredgecolor="white"
            )
            self.hits[stop.name] = self._moving_line(
                LINK, 0.0, zorder=7.0, marker="o", markersize=6.0, markeredgecolor="white"
            )

    def _line(self, z: Complex, color: str, width: float, zorder: float = 1.0) -> Line2D:
        z = z * self.factor
        (line,) = self.stage.plot(
            z.real, z.imag, color=color, linewidth=width, zorder=zorder, solid_capstyle="butt"
        )
        return line

    def _moving_line(self, color: str, width: float, **style: Any) -> Line2D:
        style.setdefault("markerfacecolor", color)
        (line,) = self.stage.plot(
            [], [], color=color, linewidth=width, linestyle="-" if width else "none",
            solid_capstyle="butt", **style,
        )  # fmt: skip
        self.moving.append(line)
        return line

    def _set_limits(self) -> None:
        """Make room for everything that the film shows."""
        rows = np.unique(np.linspace(0, len(self.film.times) - 1, 60).astype(int))
        places = []
        for t in (self.film.times[0], self.film.times[-1], *self.film.times[rows]):
            q, walls = self.motion.shape(float(t))
            places += [corners(line, q) for _, line in self.flexures]
            places += [self._box(name, q) for name in self.boxes]
            places += [self._wall(i, float(wall)) for i, wall in enumerate(walls)]
        places += [
            np.array(line.get_xydata()) @ np.array([1, 1j]) / self.factor
            for line in self.stage.lines
            if np.size(line.get_xydata())
        ]
        z = np.concatenate(places) * self.factor
        margin = MARGIN * self.system.length * self.factor
        self.stage.set_xlim(np.nanmin(z.real) - margin, np.nanmax(z.real) + margin)
        self.stage.set_ylim(np.nanmin(z.imag) - margin, np.nanmax(z.imag) + margin)

    def _set_trace(self) -> None:
        trace, motion, film = self.trace, self.motion, self.film
        _quiet(trace)
        span = (float(film.times[0]), float(film.times[-1]))
        self.time_factor, self.time_unit = time_unit(span[1])
        trace.set_xlabel(f"time [{self.time_unit}]", fontsize=9, labelpad=1)
        stops = self.system.mechanism.stops
        if stops:
            self.traced = motion.gaps
            label = "gap" if len(stops) == 1 else "gaps"
        else:
            row, c = self.system.release, self.system.release_c
            self.traced = ((np.exp(1j * motion.q) @ row).real + c)[:, None]
            label = self.system.mechanism.release.body
        shown = (motion.time >= span[0]) & (motion.time <= span[1])
        factor, name = length_unit(float(np.ptp(self.traced[shown])) or self.system.length)
        trace.set_ylabel(f"{label} [{name}]", fontsize=9, labelpad=1)
        self.traced = self.traced * factor
        self.trace_time = motion.time * self.time_factor
        styles = ("-", "--", ":", "-.")
        self.past: list[Line2D] = []
        for i, style in zip(range(self.traced.shape[1]), itertools.cycle(styles), strict=False):
            trace.plot(self.trace_time, self.traced[:, i], style, color=FUTURE, linewidth=1.0)
            (line,) = trace.plot([], [], style, color=PAST, linewidth=1.5, zorder=3)
            self.past.append(line)
            self.moving.append(line)
        trace.set_xlim(span[0] * self.time_factor, span[1] * self.time_factor)
        low, high = (float(f(self.traced[shown])) for f in (np.min, np.max))
        room = 0.16 * ((high - low) or 1.0)
        trace.set_ylim(low - room, high + 0.5 * room)
        (self.ticks,) = trace.plot(
            [], [], linestyle="none", marker="^", markersize=6.0, color=IMPACT,
            markeredgecolor="white", markeredgewidth=0.4, zorder=5, clip_on=False,
        )  # fmt: skip
        self.cursor = trace.axvline(0.0, color="#808080", linewidth=0.8, zorder=2)
        (self.now,) = trace.plot([], [], "o", markersize=4.5, color=PAST, zorder=6)
        self.moving += [self.cursor, self.ticks, self.now]
        self._shade_rest()

    def _shade_rest(self) -> None:
        """Shade the times at which a stop holds."""
        for i in range(self.motion.holds.shape[1]):
            held = np.concatenate([[0], self.motion.holds[:, i].astype(int), [0]])
            starts, ends = (np.flatnonzero(np.diff(held) == sign) for sign in (1, -1))
            for a, b in zip(starts.tolist(), ends.tolist(), strict=True):
                self.trace.axvspan(
                    self.trace_time[a], self.trace_time[min(b, len(self.trace_time) - 1)],
                    color=REST, alpha=0.13, linewidth=0, zorder=0,
                )  # fmt: skip

    # -- what moves --

    def _box(self, name: str, q: Real) -> Complex:
        frame = self.system.bodies[name]
        centre = frame.c + frame.A @ np.exp(1j * q)
        z: Complex = centre + np.exp(1j * q[frame.j]) * self.boxes[name]
        return z

    def _wall(self, i: int, wall: float) -> Complex:
        stop, line = self.system.mechanism.stops[i], dict(_hit_outlines(self.system))[i]
        into = unit(stop.direction)
        touched = complex(corners(line, self.system.q0)[0]) + wall * into
        return hatched(touched, into, WALL_LENGTH * self.system.length)

    def frame(self, k: int) -> list[Artist]:
        """Draw a frame and return what moves, the lowest first."""
        t = float(self.film.times[k])
        q, walls = self.motion.shape(t)
        holding = self.motion.holding(t)
        for flexure, line in self.flexures:
            z = corners(line, q)
            self._move(self.links[flexure.name], z)
            if flexure.name in self.curves:
                self._move(self.curves[flexure.name], curve(z, self.clamped[flexure.name]))
        for name, patch in self.bodies.items():
            z = self._box(name, q) * self.factor
            patch.set_xy(np.column_stack([z.real, z.imag]))
            self._move(self.centres[name], np.array([z.mean() / self.factor]))
        for i, line in _hit_outlines(self.system):
            name = self.system.mechanism.stops[i].name
            self._move(self.walls[name], self._wall(i, float(walls[i])))
            place = corners(line, q)
            self._move(self.hits[name], place)
            self.hits[name].set_markerfacecolor(REST if holding[i] else LINK)
            self._flash(self.flashes[name], i, k, place)
        self._draw_trace(k, t)
        self.text.set_text(self._caption(t, bool(holding.any())))
        return self.moving

    def _move(self, line: Line2D, z: Complex) -> None:
        z = z * self.factor
        line.set_data(z.real, z.imag)

    def _flash(self, flash: Line2D, stop: int, k: int, place: Complex) -> None:
        """Show the last impact at a stop while it fades, larger if it was fast."""
        fade = max(2, round(FLASH * self.film.fps))
        fastest = max((mark.speed for mark in self.film.hits.values()), default=0.0)
        flash.set_visible(False)
        for age in range(fade):
            mark = self.film.hits.get(k - age)
            if mark is not None and mark.stop == stop:
                strength = math.sqrt(mark.speed / fastest) if fastest else 1.0
                size = SMALLEST_FLASH + (LARGEST_FLASH - SMALLEST_FLASH) * strength
                self._move(flash, place)
                flash.set_markersize(size * (1.0 - 0.5 * age / fade))
                flash.set_alpha(1.0 - age / fade)
                flash.set_visible(True)
                return

    def _draw_trace(self, k: int, t: float) -> None:
        x = t * self.time_factor
        seen = int(np.searchsorted(self.motion.time, t, side="right"))
        values = [float(np.interp(x, self.trace_time, y)) for y in self.traced.T]
        for line, y, present in zip(self.past, self.traced.T, values, strict=True):
            line.set_data([*self.trace_time[:seen], x], [*y[:seen], present])
        self.now.set_data([x] * len(values), values)
        self.cursor.set_xdata([x, x])
        marks = [m.time * self.time_factor for m in self.motion.marks if m.time <= t]
        marks = [m for m in marks if m >= self.film.times[0] * self.time_factor]
        low, high = self.trace.get_ylim()
        self.ticks.set_data(marks, [low + 0.05 * (high - low)] * len(marks))

    def _caption(self, t: float, rests: bool) -> str:
        digits = 3 if self.time_unit == "s" else 1
        clock = f"t = {t * self.time_factor:.{digits}f} {self.time_unit}"
        counts = {mark.stop: mark.count for mark in self.motion.marks if mark.time <= t}
        parts = [clock, pace(self.film.slow)]
        if self.system.mechanism.stops:
            parts.append(f"impacts {sum(counts.values()):2d}")
            parts.append("at rest" if rests else "       ")
        return "   ".join(parts)


def pictures(scene: Scene, frames: Iterable[int] | None = None) -> Iterator[NDArray[np.uint8]]:
    """Yield frames of a scene, all of them or the given ones, as (height, width, 3) arrays."""
    canvas = scene.figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    for artist in scene.moving:
        artist.set_animated(True)
    with own_style():  # here axes make their ticks
        canvas.draw()  # type: ignore[no-untyped-call]
    background = canvas.copy_from_bbox(scene.figure.bbox)  # type: ignore[no-untyped-call]
    for k in range(len(scene.film.times)) if frames is None else frames:
        canvas.restore_region(background)  # type: ignore[no-untyped-call]
        for artist in scene.frame(k):
            scene.figure.draw_artist(artist)
        rgba = canvas.buffer_rgba()  # type: ignore[no-untyped-call]
        yield np.asarray(rgba)[..., :3].copy()
