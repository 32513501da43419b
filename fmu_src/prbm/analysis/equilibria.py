"""Force over displacement of a held body, and where it would rest if it were let go.

The body is held at a displacement, not by a given force: so one follows the curve through the
extrema of the force, where a mechanism under a given load snaps.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from ..mechanics.arrays import Real
from ..mechanics.modal import modes
from ..mechanics.statics import Equilibrium, equilibrium
from ..mechanics.system import System

RESTS = 1e-12  # of the size of the mechanism: how well a place of rest is located


@dataclass(frozen=True)
class Rest:
    """A place where the released body rests without a holding force.

    Parameters
    ----------
    displacement : float
        Along the direction of the release, from the drawn shape [m].
    stable : bool
        Whether it stays there when it is touched.
    shape : Equilibrium
        The shape.
    """

    displacement: float
    stable: bool
    shape: Equilibrium


def holding_force(system: System, displacement: float) -> float:
    """Return the force on the released body that holds it at a displacement [N].

    Both are along the direction of the release, gravity acts.

    Raises
    ------
    EquilibriumError
        If there is no such shape.
    """
    return equilibrium(system, displacement).force


def force_curve(system: System, displacements: Sequence[float] | Real) -> Real:
    """Return the holding forces at displacements, (k,) [N]; see :func:`holding_force`."""
    return np.array([holding_force(system, float(d)) for d in displacements])


def rests(
    system: System, displacements: Sequence[float] | Real, forces: Real | None = None
) -> list[Rest]:
    """Return the places of rest within displacements, in order.

    Parameters
    ----------
    system : System
        The mechanism.
    displacements : (k,)
        Increasing [m], so close together that the force changes its sign at most once between two.
        At the first and the last it may not be zero.
    forces : (k,) or None
        The holding forces there, if they are known [N].

    Raises
    ------
    EquilibriumError
        If there is no shape with one of the displacements.
    """
    if forces is None:
        forces = force_curve(system, displacements)
    found = []
    for (a, b), (low, high) in zip(pairwise(displacements), pairwise(forces), strict=True):
        if (low > 0.0) != (high > 0.0):
            place = brentq(
                lambda d: holding_force(system, d), a, b, xtol=RESTS * system.length, rtol=1e-15
            )
            shape = equilibrium(system, place)
            found.append(Rest(float(place), bool(modes(system, shape).frequency[0] > 0.0), shape))
    return found


def snap(system: System, low: float, high: float) -> tuple[float, float]:
    """Return where the holding force is largest in magnitude between two places of rest.

    Parameters
    ----------
    system : System
        The mechanism.
    low, high : float
        Displacements of neighbouring places of rest [m].

    Returns
    -------
    displacement, force : float
        There the mechanism snaps when it is loaded by a force [m], [N].
    """
    found = minimize_scalar(
        lambda d: -abs(holding_force(system, d)), bounds=(low, high), method="bounded",
        options={"xatol": 1e-9 * system.length},
    )  # fmt: skip
    return float(found.x), holding_force(system, float(found.x))
