"""Forces of all contacts at rest together: a complementarity problem for their accelerations.

Each stop that touches is pressed or opens; each contact without a sliding velocity sticks or begins
to slip.  Such forces exist if no contact slides and no walls close in on the mechanism.  The
friction of sliding contacts may exclude them (Painleve's paradox).
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..base.tolerances import COMPLEMENTARITY_RTOL, LIMIT_RTOL
from ..mechanics.arrays import Real
from ..mechanics.complementarity import TwoSided, coulomb, limits
from ..mechanics.constraints import solve_saddle
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
    W : (k + m, k + m)
        Accelerations of the gaps, and of sliding, by unit forces [1/kg].
    sides : (g,)
        Normal forces of the guides among the contacts, positive to the left of their lines [N].
    """

    normal: Real
    friction: Real
    limit: Real
    slide: Real
    W: Real
    sides: Real = field(default_factory=lambda: np.zeros(0))

    @property
    def mobility(self) -> Real:
        """Accelerations of sliding by unit friction forces, (m,) [1/kg]."""
        return self.W.diagonal()[len(self.normal) :]

    def at_limit(self, zero: float) -> NDArray[np.bool_]:
        """Return whether the friction forces reach their limits up to a round-off [m/s^2], (m,)."""
        reached: NDArray[np.bool_] = np.abs(self.friction) >= self.limit - zero / self.mobility
        return reached


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
        Contacts with friction that do not slide: those of ``stops``, friction points and guides.
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
    unit_forces = np.vstack([pushes.T, np.zeros((len(equations.rows), len(rows)))])
    response = solve_saddle(evaluation.factors, unit_forces)
    W = at.inverse_mass(rows, response[:n])
    slide = [equations.slip_acceleration(c, e, v, a) for c in at_rest]
    opening = equations.gap_accelerations(t, e, v, a, evaluation.pressure)
    u = np.concatenate([opening[list(stops)], slide])
    guides = [c for c in at_rest if equations.is_guide(c)]
    carrying = [equations.normal_row(c) for c in guides]
    carried = TwoSided(-response[n:][carrying], evaluation.lam[carrying])
    normals = [*stops, *guides]
    normal = np.array([normals.index(c) if c in normals else -1 for c in at_rest], int)
    friction = np.where(normal < 0, 0.0, [equations.friction_coefficient(c) for c in at_rest])
    fixed = np.array([
        equations.friction_limit(c, e, evaluation.pressure) if c not in normals else 0.0
        for c in at_rest
    ])  # fmt: skip
    pulls = limits(np.zeros(len(u)), friction, fixed, normal, carried) * W.diagonal()[k:]
    tolerance = max(
        COMPLEMENTARITY_RTOL * float(np.abs(u).max(initial=0.0)),
        LIMIT_RTOL * float(pulls.max(initial=0.0)),
        scales.zero_acceleration / 2,
    )
    P = coulomb(W, u, friction, fixed, normal, tolerance, carried)
    if P is None:
        return None
    limit = limits(P, friction, fixed, normal, carried)
    sliding = (W @ P + u)[k:]
    sliding[np.abs(sliding) <= tolerance] = 0.0  # Round-off of the forces at the contacts.
    alone = P[:k] * W.diagonal()[:k]
    own = normal[:, None] == np.arange(k)  # Friction of a stop.
    together = alone + ((W[:k, k:].T * P[k:, None]) * own).sum(axis=0)
    pressing = np.where(P[:k] > 0.0, np.maximum(alone, np.abs(together)), 0.0)
    return RestForces(pressing, P[k:], limit, sliding, W, carried.of(P))


def sticking(
    found: RestForces,
    holding: Sequence[int],
    candidates: Sequence[int],
    slipped: Collection[int],
    zero: float,
) -> tuple[list[int], Real]:
    """Return the contacts at rest that stick, independent of each other, and the friction forces.

    A contact is dependent if its friction cannot accelerate it by more than round-off while stops
    hold and contacts stick that came before: the split of the load among them is arbitrary.  Its
    force is then passed on to them, until it is zero or one of them reaches its limit; that one
    gives its place to the contact.  Contacts at their limits keep their forces.

    Parameters
    ----------
    found : RestForces
        Forces.
    holding : sequence of int
        Indices of the normal forces of stops that hold.
    candidates : sequence of int
        Indices of the friction forces of contacts that may stick, in the order of preference.
    slipped : collection of int
        Those which slip if they are at their limits.  If they are independent, they take the place
        of a sticking contact nevertheless.
    zero : float
        Acceleration that is round-off [m/s^2].

    Examples
    --------
    Two points on one block share the load of 3 N.  The limit of the first is reached; the second
    takes its place, and the rest of the load.

    >>> share = RestForces(np.zeros(0), np.array([1.0, 2.0]), np.array([1.5, 4.0]), np.zeros(2),
    ...                    np.ones((2, 2)))
    >>> sticks, forces = sticking(share, [], [0, 1], [], 1e-9)
    >>> sticks, forces.tolist()
    ([1], [1.5, 1.5])
    """
    k, A, force = len(found.normal), found.W.copy(), found.friction.copy()
    sticks: list[int] = []
    at_limit = found.at_limit(zero)
    for i in holding:
        _sweep(A, i)
    for j in candidates:
        if A[k + j, k + j] * found.limit[j] > zero:
            _sweep(A, k + j)
            sticks += [] if at_limit[j] and j in slipped else [j]
        elif sticks and not at_limit[j]:
            full = _pass_on(A[k:, k + j], force, found.limit, j, sticks)
            if full is not None:
                _sweep(A, k + full)
                _sweep(A, k + j)
                sticks[sticks.index(full)] = j
    return sticks, force


def _pass_on(shares: Real, force: Real, limit: Real, j: int, sticks: Sequence[int]) -> int | None:
    """Pass on the force of contact j to sticking contacts, until it is zero or one is at its limit.

    Return that contact, or None.  ``shares`` are the forces at the others by a unit force at j.
    """
    rooms = []
    for other in sticks:
        grows = shares[other] * force[j]
        room = limit[other] - np.sign(grows) * force[other]
        rooms.append(max(room, 0.0) / abs(grows) if grows else np.inf)
    first = int(np.argmin(rooms))
    part = min(1.0, rooms[first])
    passed = part * force[j]
    for other in sticks:
        force[other] += shares[other] * passed
    force[j] -= passed
    return sticks[first] if part < 1.0 else None


def _sweep(A: Real, p: int) -> None:
    """Exchange force and acceleration p as given and unknown; twice is the identity."""
    pivot, row, column = A[p, p], A[p].copy(), A[:, p].copy()
    A -= np.outer(column, row / pivot)
    A[p], A[:, p], A[p, p] = row / pivot, -column / pivot, 1.0 / pivot
