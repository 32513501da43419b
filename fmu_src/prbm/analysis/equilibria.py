"""Holding force over the displacement of a held body, and its rest positions.

The displacement is given, not the force.  The curve then continues through the extrema of the
force, where a mechanism under a given load snaps through.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from ..base.errors import EquilibriumError
from ..mechanics.arrays import Real
from ..mechanics.modal import modes
from ..mechanics.statics import Equilibrium, equilibrium
from ..mechanics.system import System

DISPLACEMENT_RTOL = 1e-12  # Of the size: tolerance of the displacement of a rest position.
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
        sign at most once.  At the first and the last displacement it is not zero.
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
    found = []
    for (a, b), (low, high) in zip(pairwise(displacements), pairwise(forces), strict=True):
        if (low > 0.0) != (high > 0.0):
            place = _zero_force(system, float(a), float(b), max(abs(low), abs(high)))
            shape = equilibrium(system, place)
            stable = bool(modes(system, shape).frequency[0] > 0.0)
            found.append(RestPosition(place, stable, shape))
    return found


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


def snap(system: System, low: float, high: float) -> tuple[float, float]:
    """Return the holding force of largest magnitude between two rest positions.

    Under a growing load, the mechanism snaps through when the load reaches this force.

    Parameters
    ----------
    system : System
        The mechanism.
    low, high : float
        Displacements of neighbouring rest positions [m], or rotations [rad].

    Returns
    -------
    displacement, force : float
        Displacement [m] and holding force [N], or rotation [rad] and holding moment [N m].

    Raises
    ------
    EquilibriumError
        If no static shape with one of the displacements is found, or the search does not converge.
    """
    found = minimize_scalar(
        lambda d: -abs(holding_force(system, d)), bounds=(low, high), method="bounded",
        options={"xatol": 1e-9 * system.length},
    )  # fmt: skip
    if not found.success:
        unit = "rad" if system.mechanism.release.turns else "m"
        raise EquilibriumError(
            f"the largest holding force between {low:g} and {high:g} {unit} was not found: "
            f"{found.message} Narrow the range of displacements"
        )
    return float(found.x), holding_force(system, float(found.x))
