"""Forces of all contacts at rest together: a complementarity problem for their accelerations.

Each stop that touches is pressed or opens; each contact without a sliding velocity sticks or begins
to slip.  Such forces exist if no contact slides and no walls close in on the mechanism.  The
friction of sliding contacts may exclude them (Painleve's paradox).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.tolerances import COMPLEMENTARITY_RTOL, LIMIT_RTOL
from ..mechanics.arrays import Real
from ..mechanics.complementarity import coulomb
from ..mechanics.dynamics import Equations
from .configuration import Scales
from .front import Front


@dataclass(frozen=True)
class RestForces:
    """Forces and accelerations of contacts at rest.

    Parameters
    ----------
    normal : (k,)
        Acceleration of each gap by its normal force, alone or together with its friction: the
        larger one, in magnitude [m/s^2].  A wedge moves a gap mainly by its friction.
    friction, limit : (m,)
        Friction forces and their limits [N].
    slide : (m,)
        Accelerations of sliding [m/s^2].
    mobility : (m,)
        Accelerations of sliding by unit friction forces [1/kg].
    """

    normal: Real
    friction: Real
    limit: Real
    slide: Real
    mobility: Real


def rest_forces(
    scales: Scales,
    front: Front,
    equations: Equations,
    stops: Sequence[int],
    slips: Sequence[int],
    at_rest: Sequence[int],
) -> RestForces | None:
    """Return the forces that satisfy the laws of all contacts; None without a solution.

    The laws may be violated by half of the acceleration that is round-off in the choice of modes,
    and by the round-off of the forces of friction.  These do not vanish with the accelerations, as
    in a mechanism at rest, where the limits of friction may still be large.

    Parameters
    ----------
    scales : Scales
        Scales of the mechanism.
    front : Front
        State, and time at which the accelerations of the walls are taken.
    equations : Equations
        Equations in which all stops are open, and friction points at rest have no friction.
    stops : sequence of int
        Stops that touch.
    slips : sequence of int
        Signs of the sliding velocities of these stops; 0: at rest.
    at_rest : sequence of int
        Contacts with friction that do not slide: those of ``stops`` and of the friction points.
    """
    n, k, at, t, v = equations.n, len(stops), front.at, front.time, front.v
    e, evaluation = at.e, equations.at(t, front.y)
    a = evaluation.a
    G = at.gaps[list(stops)]
    T = np.reshape([equations.slip_row(c, e) for c in at_rest], (-1, n))
    # The normal force of a stop that slides acts together with its friction.
    rubs = [
        equations.stop_friction[i] * sign * equations.slip_row(i, e)
        for i, sign in zip(stops, slips, strict=True)
    ]
    rows, pushes = np.vstack([G, T]), np.vstack([G - np.reshape(rubs, (-1, n)), T])
    W = at.inverse_mass(rows, at.response(pushes))
    slide = [equations.slip_acceleration(c, e, v, a) for c in at_rest]
    opening = equations.gap_accelerations(t, e, v, a, evaluation.pressure)
    u = np.concatenate([opening[list(stops)], slide])
    friction = np.array([equations.stop_friction[c] if c in stops else 0.0 for c in at_rest])
    fixed = np.array([
        0.0 if c in stops else equations.friction_limit(c, e, evaluation.pressure) for c in at_rest
    ])  # fmt: skip
    normal = np.array([list(stops).index(c) if c in stops else -1 for c in at_rest], int)
    pulls = fixed * W.diagonal()[k:]
    tolerance = max(
        COMPLEMENTARITY_RTOL * float(np.abs(u).max(initial=0.0)),
        LIMIT_RTOL * float(pulls.max(initial=0.0)),
        scales.zero_acceleration / 2,
    )
    P = coulomb(W, u, friction, fixed, normal, tolerance)
    if P is None:
        return None
    limit = fixed + friction * np.append(P[:k], 0.0)[normal]
    sliding = (W @ P + u)[k:]
    sliding[np.abs(sliding) <= tolerance] = 0.0  # Round-off of the forces at the contacts.
    alone = P[:k] * W.diagonal()[:k]
    own = normal[:, None] == np.arange(k)  # Friction of a stop.
    together = alone + ((W[:k, k:].T * P[k:, None]) * own).sum(axis=0)
    pressing = np.where(P[:k] > 0.0, np.maximum(alone, np.abs(together)), 0.0)
    return RestForces(pressing, P[k:], limit, sliding, W.diagonal()[k:])
