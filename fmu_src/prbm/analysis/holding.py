"""A mechanism held at displacements: force, stiffness, how straight it moves, frequency.

The released body is held at its centre of mass, along the direction of the release.  With
u that direction, z(d) the shape held at the displacement d and F(d) the force,

    stiffness = dF/dd,    across = Im(conj(u) (z - z_straight)),

the second being what a straight-line guide should not do.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.errors import EquilibriumError
from ..base.progress import Progress
from ..base.unit_text import length_unit
from ..drawing.style import IMPACT, PAST, REST, own_style
from ..mechanics.arrays import Real
from ..mechanics.modal import modes
from ..mechanics.statics import Equilibrium, equilibrium, free_displacement, held_by_loops
from ..mechanics.system import System, unit
from ..plots.scene import plain
from .equilibria import Rest, holding_force, rests, snap

ROUNDING = 1e-9  # of its scale: what a computation leaves of zero
DIFFERENCE = 1e-5  # of the size of the mechanism: step of the stiffness, whose error is its square


@dataclass(frozen=True)
class Held:
    """A shape that a force holds.

    Parameters
    ----------
    displacement : float
        Of the released body along the direction of the release, from the drawn shape [m].
    force : float
        On the body along that direction [N]; 0 if it rests there by itself.
    stiffness : float
        Change of the force with the displacement [N/m]; NaN where the loops let the body move
        no further along that direction.
    across : float
        Displacement of the body to the left of that direction [m].
    angle : float
        Its rotation, counter-clockwise [rad].
    frequency : float
        Fundamental frequency about the shape, body and force let go of [Hz]; negative where that
        is unstable.
    """

    displacement: float
    force: float
    stiffness: float
    across: float
    angle: float
    frequency: float


def _described(system: System, displacement: float, shape: Equilibrium) -> Held:
    """Return what there is to know about a shape."""
    release = system.mechanism.release
    frame, e = system.bodies[release.body], system.directions(shape.q)
    moved = unit(release.direction).conjugate() * complex(frame.c + frame.A @ e - frame.drawn)
    return Held(
        displacement, shape.force, _stiffness(system, displacement), moved.imag,
        float(shape.q[frame.j]), float(modes(system, shape).frequency[0]),
    )  # fmt: skip


def _stiffness(system: System, displacement: float) -> float:
    """Return the change of the holding force with the displacement [N/m]."""
    step = DIFFERENCE * system.length
    try:
        behind, ahead = (holding_force(system, displacement + k * step) for k in (-1, 1))
    except EquilibriumError:
        if not held_by_loops(system):
            raise
        return math.nan
    return (ahead - behind) / (2 * step)


def held(system: System, displacement: float) -> Held:
    """Return the shape in which the released body is held at a displacement.

    Raises
    ------
    EquilibriumError
        If there is no such shape.
    """
    return _described(system, displacement, equilibrium(system, displacement))


def free(system: System) -> Held:
    """Return the shape in which it rests by itself, loaded slowly by gravity, without stops.

    Raises
    ------
    EquilibriumError
        If there is none.
    """
    return _described(system, free_displacement(system), equilibrium(system))


@dataclass(frozen=True)
class Curve:
    """The holding force over a range of displacements.

    Parameters
    ----------
    points : tuple of Held
        In order.
    rests : tuple of Rest
        Where the body rests without a force.
    snaps : tuple of (float, float)
        Displacement and force between neighbouring places of rest at which the force is largest:
        there the mechanism snaps through under a force [m], [N].
    """

    points: tuple[Held, ...]
    rests: tuple[Rest, ...]
    snaps: tuple[tuple[float, float], ...]


def curve(
    system: System, displacements: Sequence[float] | Real, progress: Progress | None = None
) -> Curve:
    """Return the holding force at displacements, the places of rest between them, the snaps.

    Parameters
    ----------
    system : System
        The mechanism.
    displacements : (k,)
        Increasing [m], so close together that the force changes its sign at most once between two.
    progress : callable or None
        Told the fraction that is done, from 0 to 1.

    Raises
    ------
    EquilibriumError
        If there is no shape with one of the displacements.
    """
    points = []
    for x in displacements:
        points.append(held(system, float(x)))
        if progress is not None:
            progress(len(points) / len(displacements))
    found = rests(system, displacements, np.array([point.force for point in points]))
    between = (snap(system, a.displacement, b.displacement) for a, b in pairwise(found))
    return Curve(tuple(points), tuple(found), tuple(between))


@own_style()
def figure(curve: Curve, title: str) -> Figure:
    """Draw force, motion across and fundamental frequency over the displacement.

    Places of rest are filled where they are stable and open where they are not; diamonds are
    where a force makes the mechanism snap.
    """
    x = np.array([point.displacement for point in curve.points])
    factor, name = length_unit(float(np.abs(x).max()) or 1.0)
    drawn = Figure((8.0, 6.6), dpi=120, layout="constrained")
    every: list[Axes] = list(
        drawn.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": [2, 1, 1]})
    )
    force, across, frequency = every
    scale, newton = _force_unit(max(abs(point.force) for point in curve.points))
    force.plot(factor * x, [scale * p.force for p in curve.points], color=PAST, linewidth=1.4)
    force.axhline(0.0, color="#808080", linewidth=0.8)
    for stable, words in ((True, "stable rest"), (False, "unstable rest")):
        places = [factor * rest.displacement for rest in curve.rests if rest.stable is stable]
        if places:
            force.plot(
                places, np.zeros(len(places)), "o", color=REST, markersize=7,
                markerfacecolor=REST if stable else "white", label=words,
            )  # fmt: skip
    if curve.snaps:
        snaps = np.array(curve.snaps) * (factor, scale)
        force.plot(*snaps.T, "D", color=IMPACT, markersize=5, label="snaps through")
    if curve.rests:
        force.legend(fontsize=9, frameon=False)
    force.set_ylabel(f"holding force [{newton}]")
    force.set_title(title, fontsize=11, loc="left")
    y = np.array([p.across for p in curve.points])
    y = np.where(np.abs(y) > ROUNDING * np.abs(x).max(), y, 0.0)
    aside, small = length_unit(float(np.abs(y).max()) or 1e-4)
    across.plot(factor * x, aside * y, color=PAST, linewidth=1.2)
    across.set_ylabel(f"across [{small}]")
    hertz = np.array([point.frequency for point in curve.points])
    frequency.plot(factor * x, np.where(hertz > 0.0, hertz, np.nan), color=PAST, linewidth=1.2)
    if (hertz <= 0.0).any():
        for axes in every:
            axes.fill_between(
                factor * x, 0.0, 1.0, where=hertz <= 0.0, color=IMPACT, alpha=0.08, linewidth=0,
                transform=axes.get_xaxis_transform(),
            )  # fmt: skip
        frequency.annotate(
            "shaded: unstable when let go", (0.5, 0.06), xycoords="axes fraction", ha="center",
            fontsize=9, color=IMPACT,
        )  # fmt: skip
    frequency.set_ylim(0.0, 1.15 * max(float(hertz.max()), 0.0) or 1.0)
    frequency.set_ylabel("fundamental [Hz]")
    frequency.set_xlabel(f"displacement [{name}]")
    for axes in every:
        plain(axes)
    drawn.align_ylabels(every)
    return drawn


def _force_unit(largest: float) -> tuple[float, str]:
    """Return a unit in which a force has a handy number, as its factor and name.

    Examples
    --------
    >>> _force_unit(3.0), _force_unit(0.2)
    ((1.0, 'N'), (1000.0, 'mN'))
    """
    for factor, name in ((1.0, "N"), (1e3, "mN")):
        if largest * factor >= 1.0:
            return factor, name
    return 1e6, "µN"
