"""Holding force over the displacement of a held body, and its rest positions.

The displacement is given, not the force.  The curve then continues beyond the shapes at which a
mechanism under a given load snaps.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import bisect, brentq

from ..base.errors import EquilibriumError
from ..mechanics.arrays import Real
from ..mechanics.modal import modes
from ..mechanics.statics import Equilibrium, equilibrium
from ..mechanics.system import System

DISPLACEMENT_RTOL = 1e-12  # Of the size: tolerance of the displacement of a rest position.
SNAP_INTERVALS = 32  # Between rest positions, in which the loss of stability is searched.
SNAP_RTOL = 1e-8  # Of the size: tolerance of the displacement of a snap-through.
ZERO_FORCE_RTOL = 1e-10  # Of the largest force: a smaller one is round-off at a rest position.
REST_FORCE_RTOL = 1e-6  # Of the forces at the ends of the interval: accepted as zero.


@dataclass(frozen=True)
class RestPosition:
    """A static shape of the mechanism without a holding force.

    Parameters
    ----------
    displacement : float
        Displacement of the released body along the direction of the release, from the straight
        shape [m]; its rotation [rad] if the release is by an angle.
    stable : bool
        Whether the shape is stable.
    shape : Equilibrium
        The shape.
    """

    displacement: float
    stable: bool
    shape: Equilibrium


def holding_force(system: System, displacement: float) -> float:
    """Return the force on the released body that holds it at a displacement [N].

    Force and displacement are along the direction of the release; gravity acts.  If the release is
    by an angle, the displacement is a rotation [rad], held by a moment [N m].

    Raises
    ------
    EquilibriumError
        If no static shape with this displacement is found.
    """
    return equilibrium(system, displacement).force


def force_curve(system: System, displacements: Sequence[float] | Real) -> Real:
    """Return the holding forces at displacements, (k,) [N]; see :func:`holding_force`."""
    return np.array([holding_force(system, float(d)) for d in displacements])


def rest_positions(
    system: System, displacements: Sequence[float] | Real, forces: Real | None = None
) -> list[RestPosition]:
    """Return the rest positions within a range of displacements, in order.

    Parameters
    ----------
    system : System
        The mechanism.
    displacements : (k,)
        Increasing displacements [m].  Between neighbouring displacements the force changes its
        sign at most once.
    forces : (k,) or None
        Holding forces at the displacements [N]; None: they are computed.

    Raises
    ------
    EquilibriumError
        If no static shape with one of the displacements is found, the search does not converge, or
        the force changes its sign in a jump, without a zero.
    """
    if forces is None:
        forces = force_curve(system, displacements)
    zero = ZERO_FORCE_RTOL * float(np.abs(forces).max(initial=0.0))
    signs = [0 if abs(force) <= zero else int(np.sign(force)) for force in forces]
    places = [float(d) for d, sign in zip(displacements, signs, strict=True) if sign == 0]
    for k, (first, last) in enumerate(pairwise(signs)):
        if first * last < 0:
            largest = max(abs(float(forces[k])), abs(float(forces[k + 1])))
            ends = float(displacements[k]), float(displacements[k + 1])
            places.append(_zero_force(system, *ends, largest))
    shapes = [(place, equilibrium(system, place)) for place in sorted(places)]
    return [
        RestPosition(place, bool(modes(system, shape).frequency[0] > 0.0), shape)
        for place, shape in shapes
    ]


def _zero_force(system: System, low: float, high: float, largest: float) -> float:
    """Return the displacement between two displacements at which the holding force is zero.

    ``largest`` is the larger magnitude of the forces at the two displacements.
    """
    unit = "rad" if system.mechanism.release.turns else "m"
    place, search = brentq(
        lambda d: holding_force(system, d), low, high, xtol=DISPLACEMENT_RTOL * system.length,
        rtol=1e-15, full_output=True, disp=False,
    )  # fmt: skip
    if not search.converged:
        raise EquilibriumError(
            f"the rest position between {low:g} and {high:g} {unit} was not found in "
            f"{search.iterations} iterations; narrow the range of displacements"
        )
    if abs(holding_force(system, place)) > REST_FORCE_RTOL * largest:
        raise EquilibriumError(
            f"the holding force changes its sign in a jump at {place:.9g} {unit}, where the "
            "mechanism has no rest position; choose a range without this displacement"
        )
    return float(place)


def snap(system: System, start: float, end: float) -> tuple[float, float] | None:
    """Return where a mechanism that a growing force moves from a stable rest position snaps.

    The holding force is replaced by a dead load of the same size.  The mechanism snaps where the
    shape becomes unstable under this load: at an extremum of the force, or before it where the
    mechanism buckles out of the shapes that are followed.

    Parameters
    ----------
    system : System
        The mechanism.
    start : float
        Displacement of a stable rest position [m], or its rotation [rad].
    end : float
        Displacement of the next rest position, on either side.

    Returns
    -------
    (displacement, force) or None
        Displacement [m] and force [N], or rotation [rad] and moment [N m]; None if all shapes
        between the rest positions are stable.

    Raises
    ------
    EquilibriumError
        If no static shape with one of the displacements is found.
    """
    before = start
    for after in np.linspace(start, end, SNAP_INTERVALS + 1)[1:]:
        if _stability(system, float(after)) < 0.0:
            break
        before = float(after)
    else:
        return None
    # Bisection hardly comes near the root itself, where the equations of the shape are singular.
    place = float(
        bisect(
            lambda d: _stability(system, d), before, float(after), xtol=SNAP_RTOL * system.length
        )
    )
    return place, holding_force(system, place)


def _stability(system: System, displacement: float) -> float:
    """Return the lowest f |f| of a held shape under its force as a dead load [Hz^2]."""
    lowest = float(modes(system, equilibrium(system, displacement)).frequency[0])
    return lowest * abs(lowest)
