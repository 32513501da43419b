"""Force over displacement of a held body, and its equilibria without a force.

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

REST_RTOL = 1e-12  # Tolerance of an equilibrium's displacement, relative to the size.


@dataclass(frozen=True)
class Rest:
    """An equilibrium of the released body without a holding force.

    Parameters
    ----------
    displacement : float
        Displacement along the direction of the release, from the drawn shape [m].
    stable : bool
        Whether the equilibrium is stable.
    shape : Equilibrium
        Shape at the equilibrium.
    """

    displacement: float
    stable: bool
    shape: Equilibrium


def holding_force(system: System, displacement: float) -> float:
    """Return the force on the released body that holds it at a displacement [N].

    Force and displacement are along the direction of the release; gravity acts.

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
    """Return the equilibria within a range of displacements, in order.

    Parameters
    ----------
    system : System
        The mechanism.
    displacements : (k,)
        Increasing displacements [m], with at most one change of sign of the force between two of
        them, and a force other than zero at the first and the last.
    forces : (k,) or None
        Holding forces, if known [N].

    Raises
    ------
    EquilibriumError
        If there is no shape with one of the displacements, or an equilibrium is not found.
    """
    if forces is None:
        forces = force_curve(system, displacements)
    found = []
    for (a, b), (low, high) in zip(pairwise(displacements), pairwise(forces), strict=True):
        if (low > 0.0) != (high > 0.0):
            place, search = brentq(
                lambda d: holding_force(system, d), a, b, xtol=REST_RTOL * system.length,
                rtol=1e-15, full_output=True, disp=False,
            )  # fmt: skip
            if not search.converged:
                raise EquilibriumError(
                    f"the equilibrium between {a:g} and {b:g} m was not found in "
                    f"{search.iterations} iterations, because the holding force jumps; narrow the "
                    "range of displacements"
                )
            shape = equilibrium(system, place)
            found.append(Rest(float(place), bool(modes(system, shape).frequency[0] > 0.0), shape))
    return found


def snap(system: System, low: float, high: float) -> tuple[float, float]:
    """Return the holding force of largest magnitude between two equilibria.

    Parameters
    ----------
    system : System
        The mechanism.
    low, high : float
        Displacements of neighbouring equilibria [m].

    Returns
    -------
    displacement, force : float
        Displacement [m] and force [N] at which the mechanism snaps through under a force.

    Raises
    ------
    EquilibriumError
        If there is no shape with one of the displacements, or the search does not converge.
    """
    found = minimize_scalar(
        lambda d: -abs(holding_force(system, d)), bounds=(low, high), method="bounded",
        options={"xatol": 1e-9 * system.length},
    )  # fmt: skip
    if not found.success:
        raise EquilibriumError(
            f"the largest holding force between {low:g} and {high:g} m was not found: "
            f"{found.message} Give equilibria that are closer to each other"
        )
    return float(found.x), holding_force(system, float(found.x))
