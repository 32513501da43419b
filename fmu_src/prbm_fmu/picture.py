"""Pictures of a mechanism, from its description alone."""

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from prbm import Body, Flexure, Mechanism, Stop
from prbm.mechanism import GROUND, Point, affine, body_of
from prbm_tools.figures import png
from prbm_tools.scene import own_style

from .variables import Number, extent

STEEL, BODY, WALL, GHOST = "#1f4e79", "#9dc3e6", "#595959", "#d0d0d0"
PIXELS = 256
DPI = 128
CURVE = 40  # points along a flexure
BEND = 0.35  # of the length, as the handle of the curve at each clamp

Pose = tuple[complex, complex, complex]  # centre as drawn, displacement, turn exp(i angle)


@own_style()
def icon(mechanism: Mechanism, sample: Mapping[str, Number]) -> bytes:
    """Return the icon as PNG: the straight shape in grey, the shape at release in colour.

    Parameters
    ----------
    mechanism : Mechanism
        What is drawn.
    sample : mapping
        Outputs that give the places of the bodies.
    """
    figure = Figure(figsize=(PIXELS / DPI, PIXELS / DPI), dpi=DPI)
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
    axes.set_aspect("equal")
    axes.axis("off")
    straight = dict.fromkeys(sample, 0.0)
    draw(axes, mechanism, straight, faint=True)
    draw(axes, mechanism, sample)
    axes.margins(0.04)
    return png(figure)


def draw(
    axes: Axes, mechanism: Mechanism, sample: Mapping[str, Number], *, faint: bool = False
) -> None:
    """Draw flexures, bodies, ground and walls where the outputs say that they are."""
    values = mechanism.values()
    poses = {body.name: _pose(body, values, sample) for body in mechanism.bodies}
    span = extent(mechanism)
    for body in mechanism.bodies:
        _draw_body(axes, body, values, poses[body.name], faint)
    for flexure in mechanism.flexures:
        curve = _curve(mechanism, flexure, values, poses)
        axes.plot(
            curve.real,
            curve.imag,
            color=GHOST if faint else STEEL,
            linewidth=1.0 if faint else 2.2,
            solid_capstyle="butt",
            zorder=0 if faint else 3,
        )
    if not faint:
        for place in mechanism.ground.values():
            _hatch(axes, _number(place, values), -1j, 0.07 * span)
        for stop in mechanism.stops:
            _draw_wall(axes, stop, values, span)


def _number(point: Point, values: Mapping[str, float]) -> complex:
    return complex(affine(point[0])(values), affine(point[1])(values))


def _pose(body: Body, values: Mapping[str, float], sample: Mapping[str, Number]) -> Pose:
    moved = complex(sample[f"{body.name}.x"], sample[f"{body.name}.y"])
    turn = complex(np.exp(1j * sample[f"{body.name}.angle"]))
    return _number(body.centre, values), moved, turn


def _moved(z: complex, pose: Pose) -> complex:
    centre, displacement, turn = pose
    return centre + displacement + turn * (z - centre)


def _curve(
    mechanism: Mechanism, flexure: Flexure, values: Mapping[str, float], poses: Mapping[str, Pose]
) -> NDArray[np.complex128]:
    """Return a smooth curve that leaves its clamps at the angles at which they stand."""
    still: Pose = (0j, 0j, 1 + 0j)
    ends = []
    for reference in (flexure.start, flexure.end):
        owner = body_of(reference)
        pose = still if owner == GROUND else poses[owner]
        ends.append((_number(mechanism.point(reference, flexure.name), values), pose))
    (a, pose_a), (b, pose_b) = ends
    along = BEND * (b - a)
    p0, p3 = _moved(a, pose_a), _moved(b, pose_b)
    p1, p2 = p0 + pose_a[2] * along, p3 - pose_b[2] * along
    s = np.linspace(0.0, 1.0, CURVE)
    r = 1.0 - s
    curve: NDArray[np.complex128] = r**3 * p0 + 3 * r**2 * s * p1 + 3 * r * s**2 * p2 + s**3 * p3
    return curve


def _draw_body(
    axes: Axes, body: Body, values: Mapping[str, float], pose: Pose, faint: bool
) -> None:
    """Draw a body as the smallest shape around its points and its centre of mass, mirrored."""
    centre = _number(body.centre, values)
    points = [_number(point, values) for point in body.points.values()]
    corners = _outline([*points, *(2 * centre - z for z in points)])
    corners = [_moved(z, pose) for z in corners]
    axes.add_patch(
        Polygon(
            [(z.real, z.imag) for z in corners],
            facecolor="none" if faint else BODY,
            edgecolor=GHOST if faint else STEEL,
            linewidth=1.0,
            joinstyle="round",
            zorder=0 if faint else 2,
        )
    )
    if not faint:
        z = _moved(centre, pose)
        axes.plot(z.real, z.imag, "o", color=STEEL, markersize=3.5, zorder=4)


def _outline(points: list[complex]) -> list[complex]:
    """Return the corners of the box around the points, along their mean direction x, y."""
    x = [z.real for z in points]
    y = [z.imag for z in points]
    return [
        complex(min(x), min(y)), complex(max(x), min(y)),
        complex(max(x), max(y)), complex(min(x), max(y)),
    ]  # fmt: skip


def _draw_wall(axes: Axes, stop: Stop, values: Mapping[str, float], span: float) -> None:
    direction = complex(np.exp(1j * math.radians(stop.direction)))
    named = values.get(f"{stop.name}.position")
    position = affine(stop.position)(values) if named is None else named
    shift = values.get(f"{stop.name}.offset", 0.0)
    touched = _number(stop.point, values) + direction * (position + 1j * shift)
    _hatch(axes, touched, direction, 0.22 * span)


def _hatch(axes: Axes, place: complex, into: complex, size: float) -> None:
    """Draw a fixed line through a place, hatched on the side of what it is fixed to."""
    along = 1j * into
    ends = [place - along * size / 2, place + along * size / 2]
    axes.plot([z.real for z in ends], [z.imag for z in ends], color=WALL, linewidth=2.0)
    spacing = size / 5
    for k in range(6):
        z = ends[0] + along * spacing * k
        tip = z + (into - along) * spacing * 0.7
        axes.plot([z.real, tip.real], [z.imag, tip.imag], color=WALL, linewidth=0.8)
