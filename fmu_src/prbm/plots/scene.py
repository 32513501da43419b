"""A figure of a mechanism in motion, to scale, above a trace of its gaps."""

import itertools
import math
from collections.abc import Iterable, Iterator
from typing import Any, Literal

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from numpy.typing import NDArray

from ..analysis.stress_field import StressField
from ..base.unit_text import length_unit, time_unit
from ..drawing.shapes import Shapes, corners
from ..drawing.style import (
    BODY,
    FLEXURE,
    FUTURE,
    GRID,
    GROUND_COLOUR,
    IMPACT,
    LINK,
    PAST,
    PROBE,
    REST,
    STRAIGHT,
    WALL,
    area,
    own_style,
)
from ..mechanics.arrays import Complex
from ..runs.released import released_label
from .motion import Film, Motion, pace
from .stress_colours import (
    COLOURS_OF_STRESS,
    directions_of,
    drawn_line,
    norm,
    set_stress,
    stress_bar,
    stress_line,
)

COLOURS = (
    LINK,
    FLEXURE,
    BODY,
    WALL,
    GROUND_COLOUR,
    STRAIGHT,
    GRID,
    FUTURE,
    IMPACT,
    REST,
    PROBE,
    "#ffffff",
    "#000000",
)
MARGIN = 0.06  # Margin around the motion, as a share of the size of the mechanism.
FLASH = 0.28  # Time of the film in which a flash fades [s].
FLASH_MIN, FLASH_MAX = 8.0, 34.0  # Sizes of flashes [points].
PALETTE = 48  # Colours of the stress that a GIF file keeps exactly.
SIZE, DPI = (8.0, 6.4), 100  # Inches; video codecs need even numbers of pixels.


def quiet(axes: Axes) -> None:
    """Draw the frame and the grid of a plot in pale colours."""
    axes.tick_params(labelsize=8, colors="#606060")
    axes.set_axisbelow(True)
    axes.grid(color=GRID, linewidth=0.6)
    for spine in axes.spines.values():
        spine.set_color("#c0c0c0")


def plain(axes: Axes, axis: Literal["both", "x", "y"] = "both") -> None:
    """Draw a grid behind the curves of a plot, and only the frame's left and lower side."""
    axes.grid(axis=axis, color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


class Scene:
    """A figure of the mechanism above a trace of its gaps, one frame at a time.

    Parameters
    ----------
    motion : Motion
        The motion.
    film : Film
        Times of the frames.
    figure : Figure or None
        Figure to draw in; None: a new figure without a window.
    stress : StressField or None
        Stress of the flexures, drawn as their colour; None: all have the same colour.

    Attributes
    ----------
    links, curves, edges, springs, slots, bodies, hits, walls : dict of str to artist
        Moving artists by the names of flexures, springs, guides, bodies and stops, in the unit of
        the axes.
        Flexures with a profile are in ``edges``, all others in ``links``.
    """

    @own_style()
    def __init__(
        self,
        motion: Motion,
        film: Film,
        figure: Figure | None = None,
        stress: StressField | None = None,
    ) -> None:
        self.motion, self.film, self.stress = motion, film, stress
        self.system = motion.system
        self.figure = figure or Figure(SIZE, DPI)
        if figure is None:
            FigureCanvasAgg(self.figure)
        self.factor, self.unit = length_unit(self.system.length)
        grid = self.figure.add_gridspec(
            2, 1, height_ratios=(3.4, 1.0), hspace=0.2,
            left=0.09, right=0.98 if stress is None else 0.88, bottom=0.075, top=0.945,
        )  # fmt: skip
        self.stage: Axes = self.figure.add_subplot(grid[0])
        self.trace: Axes = self.figure.add_subplot(grid[1])
        self.shapes = Shapes(self.system)
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

    # -- fixed parts --

    def _set_stage(self) -> None:
        stage = self.stage
        stage.set_aspect("equal", adjustable="box", anchor="C")
        stage.set_xlabel(f"x [{self.unit}]", fontsize=9, labelpad=1)
        stage.set_ylabel(f"y [{self.unit}]", fontsize=9, labelpad=1)
        quiet(stage)
        for rings in self.shapes.ground_areas:
            stage.add_patch(
                PathPatch(
                    area(rings, self.factor), facecolor=GROUND_COLOUR,
                    edgecolor=WALL, linewidth=1.0, zorder=0.2,
                )
            )  # fmt: skip
        for line in self.shapes.ground():
            self._line(line, WALL, 1.2, zorder=3.2)
        for flexure in self.shapes.flexures:
            z = flexure.drawn(self.shapes.straight)
            self._line(z, STRAIGHT, 1.0, zorder=0.5).set_linestyle("--")
        self._set_flexures()
        self._set_bodies()
        self._set_points()
        self._set_stops()
        self._set_limits()

    def _set_flexures(self) -> None:
        self.curves, self.links = {}, {}
        self.edges: dict[str, PathPatch] = {}
        self.coloured: dict[str, LineCollection] = {}
        self._set_stress()
        for line in self.shapes.flexures:
            name = line.flexure.name
            if line.shaped:
                self.edges[name] = self._moving_area(line.edge(self.shapes.straight), FLEXURE, 2.0)
                continue
            if line.curved and name not in self.coloured:
                self.curves[name] = self._moving_line(FLEXURE, 5.0, zorder=2.0)
            self.links[name] = self._moving_line(
                LINK, 1.3, zorder=4.0, marker="o" if line.jointed else "", markerfacecolor="white",
                markevery=slice(1, -1),
                markersize=4.2 if line.curved else 2.0,
            )  # fmt: skip

    def _set_stress(self) -> None:
        """Add the lines in the colours of the stress, and the colour bar."""
        if self.stress is None:
            return
        self.forwards = directions_of(self.shapes)
        colours = norm(self.stress.largest)
        for name in self.stress.position:
            line = self.coloured[name] = stress_line(colours)
            self.stage.add_collection(line)
            self.moving.append(line)
        left, bottom, width, height = self.stage.get_position().bounds
        axes = self.figure.add_axes((left + width + 0.02, bottom, 0.02, height))
        stress_bar(self.figure, axes, colours)

    @property
    def stress_colours(self) -> list[str]:
        """Some colours of the stress; none without it."""
        if self.stress is None:
            return []
        every = colormaps[COLOURS_OF_STRESS](np.linspace(0.0, 1.0, PALETTE))
        return list(dict.fromkeys(map(to_hex, every)))

    def _colour(self, t: float, E: Complex) -> None:
        """Colour the flexures by their stress at a time [s]."""
        if self.stress is None:
            return
        found = self.stress.at(t)
        for line in self.shapes.flexures:
            name = line.flexure.name
            if name in self.coloured:
                z = drawn_line(line, E, self.forwards[name])
                position = self.stress.position[name]
                set_stress(self.coloured[name], z, position, found[name], self.factor)

    def _set_bodies(self) -> None:
        self.springs = {
            outline.name: self._moving_line(LINK, 1.3, zorder=3.2) for outline in self.shapes.coils
        }
        self.slots = {
            outline.name: self._moving_line(LINK, 0.9, zorder=3.2) for outline in self.shapes.ways
        }
        self.bodies: dict[str, PathPatch] = {}
        self.centres: dict[str, Line2D] = {}
        for name in self.system.bodies:
            self.bodies[name] = self._moving_area(self.shapes.bodies[name], BODY, 3.0)
            self.centres[name] = self._moving_line(
                LINK, 0.0, zorder=4.0, marker="P", markersize=6.0, markeredgecolor="white"
            )

    def _set_points(self) -> None:
        """Draw pins and joints as open circles, probes as diamonds."""
        self.pins = self._moving_line(
            LINK, 0.0, zorder=5.0, marker="o", markersize=7.0, markerfacecolor="white",
            markeredgewidth=1.6,
        )  # fmt: skip
        self.probes = self._moving_line(
            PROBE, 0.0, zorder=5.5, marker="D", markersize=5.0, markeredgecolor="white"
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

    def _moving_area(self, ring: Complex, color: str, zorder: float) -> PathPatch:
        patch = PathPatch(
            area([ring]), facecolor=color, edgecolor=LINK, linewidth=1.2, alpha=0.9,
            joinstyle="round", zorder=zorder,
        )  # fmt: skip
        self.stage.add_patch(patch)
        self.moving.append(patch)
        return patch

    def _set_limits(self) -> None:
        """Set limits of the axes that contain the whole film."""
        rows = np.unique(np.linspace(0, len(self.film.times) - 1, 60).astype(int))
        places = [rings[0] for rings in self.shapes.ground_areas]
        for t in (self.film.times[0], self.film.times[-1], *self.film.times[rows]):
            q, walls = self.motion.shape(float(t))
            E = self.shapes.arms(q)
            places += [line.drawn(E) for line in self.shapes.flexures]
            places += [*self.shapes.springs(E), *self.shapes.slots(E)]
            places += [self.shapes.body(name, E) for name in self.system.bodies]
            places += [self.shapes.wall(i, float(wall), E) for i, wall in enumerate(walls)]
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
        quiet(trace)
        span = (float(film.times[0]), float(film.times[-1]))
        self.time_factor, self.time_unit = time_unit(span[1])
        trace.set_xlabel(f"time [{self.time_unit}]", fontsize=9, labelpad=1)
        stops = self.system.mechanism.stops
        if stops:
            self.traced = motion.gaps
            label = "gap" if len(stops) == 1 else "gaps"
        else:
            row, c = self.system.release, self.system.release_c
            self.traced = ((self.system.directions(motion.q) @ row).real + c)[:, None]
            label = released_label(self.system.mechanism.release)
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
        if len(stops) > 1:
            trace.legend(
                self.past, [stop.name for stop in stops], loc="lower right", ncols=4, fontsize=8,
                bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, frameon=False,
            )  # fmt: skip
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

    # -- moving parts --

    def frame(self, k: int) -> list[Artist]:
        """Draw a frame; return the moving artists, the lowest first."""
        t = float(self.film.times[k])
        q, walls = self.motion.shape(t)
        holding = self.motion.holding(t)
        E = self.shapes.arms(q)
        for line in self.shapes.flexures:
            z, name = corners(line.outline, E), line.flexure.name
            if line.shaped:
                self.edges[name].set_path(area([line.edge(E)], self.factor))
                continue
            self._move(self.links[name], z)
            if name in self.curves:
                self._move(self.curves[name], line.centre_line(E))
        self._colour(t, E)
        for coil, z in zip(self.springs.values(), self.shapes.springs(E), strict=True):
            self._move(coil, z)
        for way, z in zip(self.slots.values(), self.shapes.slots(E), strict=True):
            self._move(way, z)
        for name, patch in self.bodies.items():
            patch.set_path(area(self.shapes.areas(name, E), self.factor))
            self._move(self.centres[name], np.array([self.shapes.centre(name, E)]))
        self._move(self.pins, self.shapes.pins(E))
        self._move(self.probes, self.shapes.probes(E))
        for i, stop in enumerate(self.system.mechanism.stops):
            self._move(self.walls[stop.name], self.shapes.wall(i, float(walls[i]), E))
            place = np.array([self.shapes.hit(i, E)])
            self._move(self.hits[stop.name], place)
            self.hits[stop.name].set_markerfacecolor(REST if holding[i] else LINK)
            self._flash(self.flashes[stop.name], i, k, place)
        self._draw_trace(k, t)
        self.text.set_text(self._caption(t, bool(holding.any())))
        return self.moving

    def _move(self, line: Line2D, z: Complex) -> None:
        z = z * self.factor
        line.set_data(z.real, z.imag)

    def _flash(self, flash: Line2D, stop: int, k: int, place: Complex) -> None:
        """Draw a fading flash after an impact at a stop; faster impacts have larger flashes."""
        fade = max(2, round(FLASH * self.film.fps))
        fastest = max((mark.speed for mark in self.film.hits.values()), default=0.0)
        flash.set_visible(False)
        for age in range(fade):
            mark = self.film.hits.get(k - age)
            if mark is not None and mark.stop == stop:
                strength = math.sqrt(mark.speed / fastest) if fastest else 1.0
                size = FLASH_MIN + (FLASH_MAX - FLASH_MIN) * strength
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
    """Yield all or the given frames of a scene as arrays of shape (height, width, 3)."""
    canvas = scene.figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    for artist in scene.moving:
        artist.set_animated(True)
    with own_style():  # The axes create their ticks here.
        canvas.draw()  # type: ignore[no-untyped-call]
    background = canvas.copy_from_bbox(scene.figure.bbox)  # type: ignore[no-untyped-call]
    for k in range(len(scene.film.times)) if frames is None else frames:
        canvas.restore_region(background)  # type: ignore[no-untyped-call]
        for artist in scene.frame(k):
            scene.figure.draw_artist(artist)
        rgba = canvas.buffer_rgba()  # type: ignore[no-untyped-call]
        yield np.asarray(rgba)[..., :3].copy()
