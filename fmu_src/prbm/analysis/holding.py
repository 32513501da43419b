"""A mechanism held at displacements: force, stiffness, deviation from a straight line, frequency.

The released body is held at its centre of mass or at the released point, along the direction u of
the release.  If the release is by an angle, a moment holds the body at a rotation.  At the
displacement d the holding force is F(d) and the position of the point z(d).  Then

    stiffness = dF/dd,    across = Im(conj(u) (z - z_straight)),

where ``across`` is the error of a straight-line guide.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..base.errors import EquilibriumError
from ..base.progress import Progress
from ..mechanics.arrays import Real
from ..mechanics.modal import modes
from ..mechanics.statics import Equilibrium, equilibrium, holding_stiffness
from ..mechanics.system import System, unit
from .equilibria import RestPosition, rest_positions, snap


@dataclass(frozen=True)
class Held:
    """A shape held by a force.

    Parameters
    ----------
    displacement : float
        Displacement of the released point along the direction of the release, from the straight
        shape [m]; the rotation of its body [rad] if the release is by an angle.
    force : float
        Holding force on the body along that direction [N], or moment [N m]; 0 at a rest position.
    stiffness : float
        Derivative of the force by the displacement [N/m], [N m/rad]; NaN where the loops prevent
        a further motion along that direction.
    across : float
        Displacement of the released point to the left of that direction [m].
    angle : float
        Rotation of the body, counter-clockwise [rad].
    frequency : float
        Fundamental frequency of the free body about the shape, with the force as a constant load
        [Hz]; negative if unstable.
    """

    displacement: float
    force: float
    stiffness: float
    across: float
    angle: float
    frequency: float


def described(system: System, displacement: float, shape: Equilibrium) -> Held:
    """Return a held shape with its stiffness and frequency.

    Parameters
    ----------
    system : System
        The mechanism.
    displacement : float
        Displacement of the released point [m], or rotation of its body [rad].
    shape : Equilibrium
        The shape.
    """
    release = system.mechanism.release
    frame, e = system.released, system.directions(shape.q)
    moved = unit(release.direction).conjugate() * complex(frame.c + frame.A @ e - frame.drawn)
    return Held(
        displacement, shape.force, holding_stiffness(system, shape), moved.imag,
        float(shape.q[frame.j]), float(modes(system, shape).frequency[0]),
    )  # fmt: skip


def held(system: System, displacement: float) -> Held:
    """Return the shape in which the released body is held at a displacement.

    Raises
    ------
    EquilibriumError
        If no static shape with this displacement is found.
    """
    return described(system, displacement, equilibrium(system, displacement))


@dataclass(frozen=True)
class Curve:
    """The holding force over a range of displacements.

    Parameters
    ----------
    points : tuple of Held
        Points in the order of the displacements.
    rests : tuple of RestPosition
        Rest positions, in the order of the displacements.
    snaps : tuple of (float, float)
        Displacement [m] and holding force [N] at which a growing load that moves the mechanism
        from a stable rest position towards a neighbouring one makes it snap.
    ended : str or None
        Why the curve ends before the last displacement; None: it does not.
    """

    points: tuple[Held, ...]
    rests: tuple[RestPosition, ...]
    snaps: tuple[tuple[float, float], ...]
    ended: str | None = None


def curve(
    system: System, displacements: Sequence[float] | Real, progress: Progress | None = None
) -> Curve:
    """Return the holding forces at displacements, with rest positions and snap-throughs.

    Parameters
    ----------
    system : System
        The mechanism.
    displacements : (k,)
        Increasing displacements [m], or rotations [rad].  Between neighbouring displacements the
        force changes its sign at most once.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Raises
    ------
    EquilibriumError
        If no static shape with one of the first two displacements is found, or the search for a
        rest position fails.
    """
    points: list[Held] = []
    ended = None
    for x in displacements:
        try:
            points.append(held(system, float(x)))
        except EquilibriumError as error:
            if len(points) < 2:
                raise
            ended = str(error)
            break
        if progress is not None:
            progress(len(points) / len(displacements))
    found = rest_positions(
        system, displacements[: len(points)], np.array([point.force for point in points])
    )
    snaps = [
        snap(system, start.displacement, end.displacement)
        for pair in pairwise(found)
        for start, end in (pair, pair[::-1])
        if start.stable
    ]
    return Curve(tuple(points), tuple(found), tuple(x for x in snaps if x is not None), ended)
