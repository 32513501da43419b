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

from ..base.errors import EquilibriumError
from ..base.progress import Progress
from ..mechanics.arrays import Real
from ..mechanics.modal import modes
from ..mechanics.statics import Equilibrium, equilibrium, free_displacement, held_by_loops
from ..mechanics.system import System, unit
from .equilibria import Rest, holding_force, rests, snap

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
