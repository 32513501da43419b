r"""Independent coordinates, which the importer's solver integrates in model exchange.

The n coordinates q satisfy the r loop equations Phi(q) = Re(B E) + c = 0.  These determine r of the
coordinates, q_d, from the other n - r, q_i.  A solver that does not support constraints can
therefore integrate the independent coordinates q_i and their rates v_i:

    Phi(q_i, q_d) = 0,      v_d = -(dPhi/dq_d)^-1 (dPhi/dq_i) v_i.

The choice of q_i is valid as long as dPhi/dq_d is not close to singular.  It is made once, for
shapes between the straight shape and the release.  Coordinates that the mechanism names as its
``states`` are chosen before others.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress

import numpy as np

from ..base.errors import EquilibriumError, MechanismError
from ..base.names import unknown
from ..base.tolerances import DEPENDENT_PIVOT_RTOL
from ..mechanism.description import Mechanism
from .arrays import Real
from .assembly import assemble
from .start import start_shape
from .system import System

SHAPES = (0.0, 0.5)  # Fractions of the displacement, angle or amplitude before the release.


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
    MechanismError
        If a state is no coordinate, or the states do not determine the other coordinates.
    """
    values = mechanism.values()
    system = assemble(mechanism, values)
    states = named_states(system)
    if not len(system.loops):
        return tuple(range(system.n))
    rows = list(_jacobians(system, values))
    free = [j for j in range(system.n) if j not in states]
    choices = [_pivots(jacobian, free) for jacobian in rows]
    best = max(choices, key=lambda dependent: min(conditioning(J, dependent) for J in rows))
    if states and not min(conditioning(J, best) for J in rows) > DEPENDENT_PIVOT_RTOL:
        raise MechanismError(
            f"states = {list(mechanism.states)}: these coordinates do not determine the others in "
            "the drawn or the released shape; name coordinates that can be chosen freely there, at "
            f"most {system.n - len(system.loops)}"
        )
    return tuple(j for j in range(system.n) if j not in best)


def named_states(system: System) -> list[int]:
    """Return the coordinates that a mechanism names as its states.

    Raises
    ------
    MechanismError
        If a name is not that of a coordinate, or is given twice.
    """
    known = {name: j for j, (name, _) in enumerate(system.variables)}
    given = system.mechanism.states
    for name in given:
        if name not in known:
            raise MechanismError(f"states: {unknown(name, known)}")
        if given.count(name) > 1:
            raise MechanismError(f"states: {name} is named twice; remove one")
    return [known[name] for name in given]


def _jacobians(system: System, values: Mapping[str, float]) -> Iterator[Real]:
    """Yield the Jacobian of the loops at the straight shape and towards the release.

    The motion begins in the released shape, which therefore has to exist.  A shape on the way to it
    that is not found is left out.
    """
    loops = system.loop_rows
    yield loops.jacobian(system.directions(system.q0))
    # The released shape comes first, so that an error message has its value.
    shapes = [start_shape(system, values)]
    for fraction in reversed(SHAPES):
        with suppress(EquilibriumError):
            shapes.append(start_shape(system, values, fraction))
    for q in reversed(shapes):
        yield loops.jacobian(system.directions(q))


def _pivots(jacobian: Real, free: Sequence[int]) -> tuple[int, ...]:
    """Return as many of the free columns as there are rows, by QR with column pivoting."""
    from scipy.linalg import qr  # Imported here: it takes 0.3 s.

    _, _, order = qr(jacobian[:, free], mode="economic", pivoting=True)
    return tuple(free[j] for j in order[: len(jacobian)])


def conditioning(jacobian: Real, dependent: tuple[int, ...]) -> float:
    """Return the least singular value of the dependent columns, divided by the largest of all.

    Examples
    --------
    >>> conditioning(np.array([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), (0, 1))
    0.5
    """
    if len(dependent) < len(jacobian):
        return 0.0
    size = np.linalg.svd(jacobian[:, dependent], compute_uv=False)
    return float(size[-1] / np.linalg.svd(jacobian, compute_uv=False)[0])
