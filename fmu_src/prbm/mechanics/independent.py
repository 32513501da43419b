r"""Independent coordinates, which the importer's solver integrates in model exchange.

The n coordinates q satisfy the r loop equations Phi(q) = Re(B E) + c = 0.  These determine r of the
coordinates, q_d, from the other n - r, q_i.  A solver that does not support constraints can
therefore integrate the independent coordinates q_i and their rates v_i:

    Phi(q_i, q_d) = 0,      v_d = -(dPhi/dq_d)^-1 (dPhi/dq_i) v_i.

The choice of q_i is valid as long as dPhi/dq_d is not close to singular.  It is made once, for
shapes between the straight shape and the release.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from ..mechanism.description import Mechanism
from .arrays import Real
from .assembly import assemble
from .start import start_shape
from .system import System

SHAPES = (0.0, 0.5, 1.0)  # Fractions of the displacement, angle or amplitude of the release.


def independent(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the independent coordinates, in ascending order.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism, of which the default parameters are used.

    Returns
    -------
    tuple of int
        n - r coordinates.

    Raises
    ------
    EquilibriumError
        If the shape of the release cannot be reached.
    """
    values = mechanism.values()
    system = assemble(mechanism, values)
    if not len(system.loops):
        return tuple(range(system.n))
    rows = list(_jacobians(system, values))
    choices = [_pivots(jacobian) for jacobian in rows]
    best = max(choices, key=lambda dependent: min(conditioning(J, dependent) for J in rows))
    return tuple(j for j in range(system.n) if j not in best)


def _jacobians(system: System, values: Mapping[str, float]) -> Iterator[Real]:
    """Yield the Jacobian of the loops at the straight shape and towards the release."""
    loops = system.loop_rows
    yield loops.jacobian(system.directions(system.q0))
    # The released shape comes first, so that an error message has its value.
    shapes = [start_shape(system, values, fraction) for fraction in reversed(SHAPES)]
    for q in reversed(shapes):
        yield loops.jacobian(system.directions(q))


def _pivots(jacobian: Real) -> tuple[int, ...]:
    """Return as many columns as there are rows, chosen by QR with column pivoting."""
    from scipy.linalg import qr  # Imported here: it takes 0.3 s.

    _, _, order = qr(jacobian, mode="economic", pivoting=True)
    return tuple(int(j) for j in order[: len(jacobian)])


def conditioning(jacobian: Real, dependent: tuple[int, ...]) -> float:
    """Return the least singular value of the dependent columns, divided by the largest of all.

    Examples
    --------
    >>> conditioning(np.array([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), (0, 1))
    0.5
    """
    size = np.linalg.svd(jacobian[:, dependent], compute_uv=False)
    return float(size[-1] / np.linalg.svd(jacobian, compute_uv=False)[0])
