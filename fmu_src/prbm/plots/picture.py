"""A picture of a mechanism as its file describes it, with the names of its parts, and its modes."""

import cmath
import math
from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.patheffects import withStroke

from ..base.errors import ParameterError, PrbmError
from ..base.tolerances import RELEASE_PENETRATION_RTOL
from ..base.unit_text import length_unit, mode_text
from ..drawing.shapes import SPRING_WIDTH, Shapes, corners
from ..drawing.style import (
    BODY,
    FLEXURE,
    GROUND_COLOUR,
    IMPACT,
    LINK,
    PROBE,
    STRAIGHT,
    WALL,
    area,
    own_style,
)
from ..mechanics.arrays import Complex
from ..mechanics.assembly import assemble
from ..mechanics.modal import Modes, modes
from ..mechanics.positions import given_at_start
from ..mechanics.start import start_shape
from ..mechanics.statics import equilibrium
from ..mechanics.system import FIXED, unit
from ..mechanism.description import Mechanism
from ..mechanism.parts import POSITIONS, value
from .scene import quiet

MODE_AMPLITUDE = 0.12  # Largest displacement in the picture of a mode, as a share of the size.
ARROW_LENGTH = 0.14  # Length of the arrows of forces, as a share of the size.
MODES_MAX = 12  # Largest number of modes in a picture.
COLUMNS = 3  # Modes per row.
THIN_BODY = 0.12  # Height over the size below which the name of a body is above it.
NAME_AT = 0.36  # Position of a name along its flexure, off the middle where flexures may cross.
START = "#7a3fa0"  # Colour of the released shape.
MOVED_RTOL = 1e-6  # Difference over the size below which a released shape is straight.
VISIBLE_RTOL = 2e-3  # Displacement at release over the size below which a part is drawn once.
CAPTION_WIDTH = 125  # Characters of a line of the caption.
NAME, NAME_OFFSET = "#303030", 7.0  # Colour; distance of a flexure from its name [points].
WIDTH, HEIGHT_MIN, HEIGHT_MAX, FRAME = 7.2, 2.4, 6.4, 0.9  # Sizes of the picture [inch].


@own_style()
def picture(
    mechanism: Mechanism,
    values: Mapping[str, float] | None = None,
    shown: int = 0,
    held: float | None = None,
    loads: Mapping[str, float] | None = None,
) -> Figure:
    """Draw the straight shape with the names of its parts, and modes about an equilibrium.

    The released shape is drawn in dashed lines, with its gaps to the walls.  A release that is
    impossible is left out; the picture gives the reason.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping or None
        Parameters that differ from their defaults.
    shown : int
        Number of modes to draw, about the static equilibrium under gravity without stops; a
        mechanism with fewer modes is drawn with all of them.
    held : float or None
        Displacement at which the released body is held [m]; None: the equilibrium without a
        holding force.
    loads : mapping or None
        Dead loads on this equilibrium, by the names of the inputs [N], [N m].

    Returns
    -------
    Figure
        A figure without a window.

    Raises
    ------
    ParameterError
        If ``shown`` is negative or above :data:`MODES_MAX`, or a value is out of bounds.
    EquilibriumError
        If there is no equilibrium.
    """
    shapes = Shapes(assemble(mechanism, mechanism.values(values)))
    if not 0 <= shown <= MODES_MAX:
        raise ParameterError(f"{shown} modes: choose a number from 0 to {MODES_MAX}")
    start, reason = _released(shapes)
    fixed = [*_walls(shapes), *(rings[0] for rings in shapes.ground_areas)]
    z = np.concatenate([*_places(shapes, shapes.straight), *fixed])
    if start is not None:
        z = np.concatenate([z, *_places(shapes, start)])
    vibrating = _vibrating(shapes, held, loads) if shown else None
    if vibrating is not None:
        shown = min(shown, len(vibrating[0].frequency))
    aspect = float(np.ptp(z.imag[np.isfinite(z)]) / np.ptp(z.real[np.isfinite(z)]))
    height = FRAME + min(max(aspect * WIDTH, HEIGHT_MIN), HEIGHT_MAX)
    row = min(max(aspect, 0.5), 1.6) * WIDTH / COLUMNS
    rows = -(-shown // COLUMNS)
    figure = Figure((WIDTH, height + rows * row), dpi=120, layout="constrained")
    grid = figure.add_gridspec(1 + rows, COLUMNS, height_ratios=[height, *[row] * rows])
    axes = figure.add_subplot(grid[0, :])
    drawing = Drawing(axes, shapes)
    drawing.parts()
    if start is not None:
        drawing.released(start)
    elif reason:
        axes.set_xlabel(f"{axes.get_xlabel()}\n{fill(reason, CAPTION_WIDTH)}", fontsize=7)
    axes.set_title(mechanism.title, fontsize=10, loc="left")
    if vibrating is not None:
        places = [grid[1 + k // COLUMNS, k % COLUMNS] for k in range(shown)]
        _draw_modes(figure, places, shapes, *vibrating)
    return figure


def _released(shapes: Shapes) -> tuple[Complex | None, str]:
    """Return the arms of the released shape; None if it is straight, or with a reason."""
    system = shapes.system
    try:
        q = start_shape(system, system.values)
    except PrbmError as error:
        return None, f"the released shape is not drawn: {error}"
    E = shapes.arms(q)
    moved = zip(_places(shapes, E), _places(shapes, shapes.straight), strict=True)
    apart = max(float(np.abs(a - b).max()) for a, b in moved)
    return (E if apart > MOVED_RTOL * shapes.size else None), ""


def _vibrating(
    shapes: Shapes, held: float | None, loads: Mapping[str, float] | None
) -> tuple[Modes, Complex]:
    """Return the modes, and the arms of the shape in equilibrium."""
    rest = equilibrium(shapes.system, held, loads)
    return modes(shapes.system, rest), shapes.arms(rest.q)


def _draw_modes(
    figure: Figure, places: Sequence[object], shapes: Shapes, found: Modes, E: Complex
) -> None:
    for k, place in enumerate(places):
        axes = figure.add_subplot(place)  # type: ignore[call-overload]
        drawing = Drawing(axes, shapes)
        drawing.ghost(E)
        drawing.shape(moved(shapes, E, found, k))
        axes.set_title(mode_text(float(found.frequency[k]), found.rounding), fontsize=9)
        axes.axis("off")


def moved(shapes: Shapes, E: Complex, found: Modes, k: int) -> Complex:
    """Return the arms of a shape displaced along a mode by :data:`MODE_AMPLITUDE` of the size.

    Parameters
    ----------
    shapes : Shapes
        Shapes of the mechanism.
    E : (n,) complex
        Arms of the shape in equilibrium.
    found : Modes
        Modes about this equilibrium.
    k : int
        Index of the mode.
    """
    w = shapes.system.turning(found.shape[:, k])
    along: Complex = E * (1 + 1j * w)
    largest = max(
        float(np.abs(new - old).max())
        for new, old in zip(_places(shapes, along), _places(shapes, E), strict=True)
    )
    amplitude = MODE_AMPLITUDE * shapes.size / largest
    released = shapes.system.mechanism.release.body
    if (shapes.centre(released, along) - shapes.centre(released, E)).real < 0.0:
        amplitude = -amplitude
    result: Complex = E * (1 + 1j * amplitude * w)
    return result


def _walls(shapes: Shapes) -> list[Complex]:
    """Return the walls of the stops as drawn."""
    system, E = shapes.system, shapes.straight
    stops = enumerate(system.mechanism.stops)
    return [shapes.wall(i, value(stop, "position", system.values), E) for i, stop in stops]


def _places(shapes: Shapes, E: Complex) -> list[Complex]:
    lines = [corners(line.outline, E) for line in shapes.flexures]
    lines += [*shapes.springs(E), *shapes.slots(E)]
    return [*lines, *(shapes.body(name, E) for name in shapes.bodies)]


def _aligned(across: float) -> Literal["left", "center", "right"]:
    """Return the horizontal alignment of words on a side of a line."""
    return "center" if abs(across) < 0.5 else "left" if across > 0.0 else "right"


class Drawing:
    """Draws shapes on axes, in a unit suited to their size."""

    def __init__(self, axes: Axes, shapes: Shapes) -> None:
        self.axes, self.shapes = axes, shapes
        self.factor, self.unit = length_unit(shapes.size)
        axes.set_aspect("equal")

    def line(self, z: Complex, color: str, width: float, zorder: float, style: str = "-") -> None:
        """Draw a line through points [m]."""
        z = z * self.factor
        self.axes.plot(
            z.real, z.imag, style, color=color, linewidth=width, zorder=zorder,
            solid_capstyle="butt",
        )  # fmt: skip

    def mark(self, z: Complex, marker: str, color: str, size: float, zorder: float) -> None:
        """Draw markers at points [m]."""
        z = np.atleast_1d(z) * self.factor
        self.axes.plot(
            z.real, z.imag, linestyle="none", marker=marker, markersize=size, color=color,
            markeredgecolor="white", markeredgewidth=0.6, zorder=zorder,
        )  # fmt: skip

    def pivots(self, z: Complex, size: float, zorder: float, width: float = 1.0) -> None:
        """Draw open circles at points [m]."""
        z = z * self.factor
        self.axes.plot(
            z.real, z.imag, "o", color=LINK, markersize=size, markerfacecolor="white",
            markeredgewidth=width, zorder=zorder,
        )  # fmt: skip

    def text(
        self, z: complex, words: str, color: str = NAME, ha: str = "center", va: str = "center"
    ) -> None:
        """Write words at a point [m]."""
        self.axes.annotate(
            words, (z.real * self.factor, z.imag * self.factor), color=color, fontsize=8,
            ha=ha, va=va, zorder=9, path_effects=[withStroke(linewidth=2.2, foreground="white")],
        )  # fmt: skip

    def patch(self, rings: Sequence[Complex], color: str, zorder: float, edge: str = LINK) -> None:
        """Draw an area, see :func:`prbm.drawing.style.area`."""
        self.axes.add_patch(
            PathPatch(
                area(rings, self.factor), facecolor=color, edgecolor=edge, linewidth=1.0,
                alpha=0.9, joinstyle="round", zorder=zorder,
            )
        )  # fmt: skip

    # -- shapes --

    def ghost(self, E: Complex) -> None:
        """Draw a shape in dashed, pale lines."""
        self.ground_areas()
        for ground in self.shapes.ground():
            self.line(ground, WALL, 0.9, 1.0)
        for line in self.shapes.flexures:
            self.line(line.drawn(E), STRAIGHT, 0.9, 0.5, "--")
        for name in self.shapes.bodies:
            z = self.shapes.body(name, E)
            self.line(np.append(z, z[0]), STRAIGHT, 0.9, 0.5, "--")

    def shape(self, E: Complex, pivots: bool = False) -> None:
        """Draw flexures, springs, guides, bodies and pins."""
        for line in self.shapes.flexures:
            if line.shaped:
                self.patch([line.edge(E)], FLEXURE, 2.0)
                continue
            z = corners(line.outline, E)
            self.line(line.centre_line(E), FLEXURE, 3.6, 2.0)
            self.line(z, LINK, 0.9, 2.5)
            if pivots and line.jointed:
                self.pivots(z[1:-1], 3.4 if line.curved else 1.5, 4.0)
        for drawn in (*self.shapes.springs(E), *self.shapes.slots(E)):
            self.line(drawn, LINK, 0.9, 3.2)
        for name in self.shapes.bodies:
            self.patch(self.shapes.areas(name, E), BODY, 3.0)
        self.pivots(self.shapes.pins(E), 6.0, 5.0, 1.5)
        self.axes.autoscale_view()

    def ground_areas(self) -> None:
        """Draw the fixed parts."""
        for rings in self.shapes.ground_areas:
            self.patch(rings, GROUND_COLOUR, 0.2, WALL)

    def parts(self) -> None:
        """Draw the straight shape with all its parts and their names."""
        shapes, E = self.shapes, self.shapes.straight
        self.ground_areas()
        for ground in shapes.ground():
            self.line(ground, WALL, 1.2, 3.2)
        self.shape(E, pivots=True)
        for name in shapes.bodies:
            self.mark(np.array([shapes.centre(name, E)]), "P", LINK, 6.0, 4.0)
        self.mark(shapes.probes(E), "D", PROBE, 5.5, 6.0)
        self.stops(E)
        self.forces(E)
        self.names(E)
        quiet(self.axes)
        self.axes.set_xlabel(f"x [{self.unit}]", fontsize=9)
        self.axes.set_ylabel(f"y [{self.unit}]", fontsize=9)
        self.axes.margins(0.08)

    def stops(self, E: Complex) -> None:
        """Draw walls, hit points and names of the stops."""
        stops = self.shapes.system.mechanism.stops
        for i, (stop, wall) in enumerate(zip(stops, _walls(self.shapes), strict=True)):
            self.line(wall, WALL, 1.6, 3.5)
            self.mark(np.array([self.shapes.hit(i, E)]), "o", IMPACT, 6.0, 7.0)
            end = max(wall[:2], key=lambda z: (round(z.imag / self.shapes.size, 6), z.real))
            self.text(complex(end), stop.name, va="bottom")

    def released(self, E: Complex) -> None:
        """Draw the released shape in dashed lines, and the gaps of its hit points to the walls."""
        shapes, system = self.shapes, self.shapes.system
        for line in shapes.flexures:
            if self.apart(corners(line.outline, E), corners(line.outline, shapes.straight)):
                self.line(line.drawn(E), START, 1.0, 3.6, "--")
        for name in shapes.bodies:
            z = shapes.body(name, E)
            if self.apart(z, shapes.body(name, shapes.straight)):
                self.line(np.append(z, z[0]), START, 1.0, 3.6, "--")
        given = given_at_start(system.mechanism, system.values, POSITIONS)
        name = f"release.{system.mechanism.release.start}"
        label = f"dashed: released shape, {name} = {self.start()}"
        if given:
            label = f"dashed: shape at the start, {', '.join(one.text for one in given)}"
        self.axes.set_xlabel(f"{self.axes.get_xlabel()}\n{label}", fontsize=8)
        gaps = system.gap_rows.values(E)
        for i, stop in enumerate(system.mechanism.stops):
            gap = float(gaps[i]) + value(stop, "position", system.values)
            hit, into = self.shapes.hit(i, E), unit(stop.direction)
            if system.on[i] != FIXED:
                into *= complex(E[system.on[i]])
            self.line(np.array([hit, hit + gap * into]), START, 1.0, 6.5, ":")
            self.mark(np.array([hit]), "o", START, 5.0, 6.6)
            if gap < -RELEASE_PENETRATION_RTOL * system.length:
                words = f"behind {stop.name} by {-gap * self.factor:.3g} {self.unit}"
            else:
                words = f"start gap {gap * self.factor:.3g} {self.unit}"
            self.beside(hit + gap * into / 2, into, words)
        self.axes.autoscale_view()

    def apart(self, a: Complex, b: Complex) -> bool:
        """Return whether two drawings of a part differ visibly."""
        return float(np.abs(a - b).max()) > VISIBLE_RTOL * self.shapes.size

    def start(self) -> str:
        """Return the displacement, angle or amplitude of the release with its unit."""
        system = self.shapes.system
        release = system.mechanism.release
        amount = value(release, release.start, system.values)
        if release.turns:
            return f"{math.degrees(amount):.4g} deg"
        mode = "" if release.mode is None else f" along mode {release.mode}"
        return f"{self.factor * amount:.4g} {self.unit}{mode}"

    def beside(self, place: complex, along: complex, words: str) -> None:
        """Write words beside a line, below it if it is horizontal."""
        away = -1j * along if (1j * along).imag > -0.5 else 1j * along
        self.axes.annotate(
            words, (place.real * self.factor, place.imag * self.factor),
            (NAME_OFFSET * away.real, NAME_OFFSET * away.imag), textcoords="offset points",
            color=START, fontsize=7, ha=_aligned(away.real), va="center", zorder=9,
            path_effects=[withStroke(linewidth=2.2, foreground="white")],
        )  # fmt: skip

    def forces(self, E: Complex) -> None:
        """Draw arrows of the forces that are inputs."""
        length = ARROW_LENGTH * self.shapes.size * self.factor
        forces = self.shapes.system.mechanism.forces
        for force, z in zip(forces, self.shapes.forces(E), strict=True):
            x, y = z.real * self.factor, z.imag * self.factor
            for dx, dy in ((length, 0.0), (0.0, length)):
                self.axes.annotate(
                    "", (x + dx, y + dy), (x, y), zorder=6,
                    arrowprops={"arrowstyle": "-|>", "color": IMPACT, "linewidth": 1.1},
                )  # fmt: skip
            self.text(complex(x + length, y) / self.factor, f" {force.name}", IMPACT, ha="left")

    def along(self, start: complex, end: complex, words: str, thickness: float) -> None:
        """Write words parallel to a line of a thickness [m] and above it, never upside down."""
        degrees = math.degrees(cmath.phase(end - start))
        turned = (degrees + 89.0) % 180.0 - 89.0
        beside = cmath.rect(0.5 * thickness, math.radians(turned + 90.0))
        place = (start + NAME_AT * (end - start) + beside) * self.factor
        away = cmath.rect(NAME_OFFSET, math.radians(turned + 90.0))
        self.axes.annotate(
            words, (place.real, place.imag), (away.real, away.imag), textcoords="offset points",
            rotation=turned, ha="center", va="center", color=NAME, fontsize=7, zorder=9,
            path_effects=[withStroke(linewidth=2.2, foreground="white")],
        )  # fmt: skip

    def names(self, E: Complex) -> None:
        """Write the names of parts and probes without overlaps."""
        shapes = self.shapes
        for name in shapes.bodies:
            z, x = shapes.body(name, E), shapes.centre(name, E).real
            low, high = float(z.imag.min()), float(z.imag.max())
            if high - low < THIN_BODY * shapes.size:
                self.text(complex(x, high), name, LINK, va="bottom")
            else:
                self.text(complex(x, 0.75 * low + 0.25 * high), name, LINK)
        for line in shapes.flexures:
            z = corners(line.outline, E)
            thickness = float(line.outline.thickness.max()) if line.shaped else 0.0
            self.along(complex(z[0]), complex(z[-1]), line.flexure.name, thickness)
        for outline in (*shapes.coils, *shapes.ways):
            start, end = (complex(z) for z in corners(outline, E))
            self.along(start, end, outline.name, SPRING_WIDTH * shapes.size)
        for joint in shapes.joints:
            self.text(complex(corners(joint, E)[0]), f"  {joint.name}", ha="left", va="bottom")
        for probe, z in zip(shapes.system.mechanism.probes, shapes.probes(E), strict=True):
            self.text(z, f"  {probe.name}", PROBE, ha="left", va="top")
