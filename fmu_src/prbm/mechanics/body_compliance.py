r"""Compliance and stiffness matrices of a body in a static shape.

Small loads f = (F_x, F_y, moment) on a point of a body displace it and turn the body by C f, while
all other bodies follow freely.  With the gradients L of the point's position and the body's angle
and the tangent stiffness K_t,

    C = L Z (Z^T K_t Z)^-1 Z^T L^T,

where Z spans the motions that keep the loops closed and, if the released body is held, its
displacement.
"""

import numpy as np

from ..base.errors import EquilibriumError, SimulationError
from ..base.tolerances import RIGID_RTOL
from . import constraints
from .arrays import Real
from .forces import load_rows
from .places import BodyFrame
from .statics import Equilibrium, balance_matrix
from .system import System


def compliance_matrix(
    system: System, shape: Equilibrium, frame: BodyFrame, held: bool = False
) -> Real:
    """Return the compliance matrix C of a body at a point.

    Parameters
    ----------
    system : System
        The mechanism.
    shape : Equilibrium
        Static shape; its loads and its holding force are dead loads.
    frame : BodyFrame
        The point of the body, as in ``system.bodies`` or ``system.probes``.
    held : bool
        Whether the displacement of the released body is held.

    Returns
    -------
    (3, 3)
        Symmetric: displacements along x and y [m] and rotation, counter-clockwise [rad], by forces
        along x and y [N] and moment [N m].  A direction in which the body is rigid has a row of
        round-off.

    Raises
    ------
    EquilibriumError
        If a motion of the mechanism has no stiffness.
    """
    n, kkt = system.n, balance_matrix(system, shape, held)
    L = load_rows(system, frame, system.directions(shape.q))
    right = np.zeros((len(kkt), 3))
    right[:n] = L.T
    try:
        found = constraints.solve(kkt, right, n, system.length)
    except SimulationError:
        raise EquilibriumError(
            f"the compliance of {frame.name} is infinite: a motion of the mechanism has no "
            "stiffness in this shape; hold the released body, or clamp a flexure that is pinned"
        ) from None
    C: Real = L @ found[:n]
    return 0.5 * (C + C.T)


def stiffness_matrix(C: Real, length: float) -> Real | None:
    """Return the inverse of a compliance matrix; None if the body is rigid in a direction.

    Parameters
    ----------
    C : (3, 3)
        Compliance matrix [m/N], [rad/N], [rad/(N m)].
    length : float
        Size of the mechanism, the lever of the moments [m].

    Returns
    -------
    (3, 3) or None
        Forces [N] and moment [N m] by displacements [m] and rotation [rad].

    Examples
    --------
    >>> stiffness_matrix(np.diag([0.5, 0.25, 2.0]), 1.0).diagonal()
    array([2. , 4. , 0.5])
    >>> stiffness_matrix(np.diag([0.5, 0.0, 2.0]), 1.0) is None
    True
    """
    scale = np.array([1.0, 1.0, length])
    scaled = scale[:, None] * C * scale
    values, vectors = np.linalg.eigh(scaled)
    if not values.min() > RIGID_RTOL * values.max():
        return None
    K: Real = scale[:, None] * ((vectors / values) @ vectors.T) * scale
    return K
