r"""Rigid impacts in contact space: Newton's law without friction, Stronge's law with friction.

An impact with the impulses P changes the rates u of the gaps and of sliding by

    u+ = u- + W P,    W = [G; T] M^-1 [G; T]^T,

with the Jacobians G of the gaps and T of the displacements along the walls, and M^-1 on the tangent
space of the loops.  The rates of the gaps include the velocities of walls.  W is never inverted,
because it has rank one for a mechanism of one degree of freedom.

Sources
-------
.. [1] F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley, 1996.
.. [2] W. J. Stronge, J. Appl. Mech. 58 (1991) 1049; Impact Mechanics, Cambridge, 2000.
.. [3] T. R. Kane, D. A. Levinson, Dynamics: Theory and Applications, 1985 (Newton's law together
   with Coulomb's law can increase the energy).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base.errors import SimulationError
from ..base.tolerances import (
    COMPLEMENTARITY_RTOL,
    IMPULSE_RANK_RTOL,
    REBOUND_RTOL,
    ROW_RTOL,
    SINGULAR_RTOL,
    WEDGED_RTOL,
    ZERO_SPEED_RTOL,
)
from . import constraints
from .arrays import Real
from .complementarity import impulses, violation

CLOSING_IN = (
    "no impulses open all gaps: the walls close in on the mechanism; move them apart, or slow them "
    "down"
)
WEDGED = (
    "the wall pushes the mechanism in a direction that friction locks; reduce the friction of the "
    "stop, or the velocity of the wall"
)
WEDGED_SEVERAL = (
    "the walls push the mechanism in directions that friction locks; reduce the friction of the "
    "stops, or the velocities of the walls"
)


def response(M: Real, held: Real, rows: Real, length: float, scale: Real | None = None) -> Real:
    """Return the changes of velocity by unit impulses along the rows, (n, k) [rad/s per N s].

    Parameters
    ----------
    M : (n, n)
        Mass matrix [kg m^2].
    held : (r, n)
        Rows whose rates do not change: loops, held stops [m/rad].
    rows : (k, n)
        Directions of the impulses [m/rad].
    length : float
        Size of the mechanism [m].
    scale : (n + r,) or None
        As for :func:`prbm.mechanics.constraints.factor_saddle`; None: the scales of the matrix.

    Raises
    ------
    SimulationError
        As :func:`prbm.mechanics.constraints.solve`.

    Examples
    --------
    >>> response(np.diag([2.0]), np.zeros((0, 1)), np.array([[1.0]]), 1.0).item()
    0.5
    """
    n, k = len(M), len(rows)
    right = np.zeros((n + len(held), k), order="F")
    right[:n] = rows.T
    kkt = constraints.saddle(M, held, held)
    known = constraints.scales(kkt, n, length) if scale is None else scale
    factors = constraints.factor_saddle(kkt, n, length, known)
    return constraints.solve_saddle(factors, right)[:n]


def least_mobilities(M: Real, rows: Real, length: float) -> Real:
    """Return the mobilities below which no motion along the rows is possible, (k,) [1/kg].

    They are ``SINGULAR_RTOL`` of the mobilities without constraints, which the diagonal of M
    estimates, and at least those of rows that are round-off.

    Parameters
    ----------
    M : (n, n)
        Mass matrix [kg m^2].
    rows : (k, n)
        Directions [m/rad].
    length : float
        Size of the mechanism [m].

    Examples
    --------
    >>> least_mobilities(np.diag([2.0, 4.0]), np.array([[1.0, 2.0], [0.0, 1e-12]]), 1.0)
    array([1.5e-12, 2.5e-19])
    """
    inertias = M.diagonal()
    free = SINGULAR_RTOL * np.asarray((rows**2 / inertias).sum(axis=1), float)
    return np.maximum(free, (ROW_RTOL * length) ** 2 / float(inertias.max()))


def contact_mobility(M: Real, rows: Real, X: Real, length: float) -> Real:
    """Return the inverse mass in contact space, W = rows X, (k, k) [1/kg].

    Directions in which no motion is possible leave round-off in W, which is removed.

    Parameters
    ----------
    M : (n, n)
        Mass matrix [kg m^2].
    rows : (k, n)
        Directions [m/rad].
    X : (n, k)
        Changes of velocity by unit impulses, as :func:`response` returns them.
    length : float
        Size of the mechanism [m].
    """
    W: Real = rows @ X
    immobile = np.abs(W.diagonal()) <= least_mobilities(M, rows, length)
    W[immobile] = W[:, immobile] = 0.0
    return W


def newton(W: Real, u: Real, restitution: Real, speed: float = 0.0) -> Real:
    r"""Return the impulses of a frictionless, simultaneous impact of several stops.

    Solves P >= 0, W P + u + eps u >= 0, complementary, for closing or resting stops (u <= 0):
    each stop that receives an impulse opens at -eps u.  Energy is never gained.  There is a
    solution unless walls close in on the mechanism.  If several stops can share an impulse in more
    than one way, they share it as evenly as possible (least sum of squares).

    Parameters
    ----------
    W : (k, k)
        Inverse mass in contact space, symmetric positive semidefinite [1/kg].
    u : (k,)
        Rates of the gaps before the impact, none positive [m/s].
    restitution : (k,)
        Coefficients of restitution [-].
    speed : float
        Scale of speeds; violations up to ``COMPLEMENTARITY_RTOL`` times it are round-off [m/s].

    Returns
    -------
    P : (k,)
        Impulses [N s].

    Raises
    ------
    SimulationError
        If there are no such impulses.

    Examples
    --------
    A ball of 2 kg at 3 m/s against a wall, restitution 0.5: P = (1 + 0.5) 2 3.

    >>> newton(np.array([[0.5]]), np.array([-3.0]), np.array([0.5])).item()
    9.0
    """
    b = (1.0 + restitution) * u
    none = np.zeros(0)
    tolerance = COMPLEMENTARITY_RTOL * max(float(np.abs(u).max(initial=0.0)), speed)
    P = impulses(W, b, none, np.zeros(len(b)), tolerance)
    if P is None:
        raise SimulationError(CLOSING_IN)
    shared = _least_norm_impulses(W, b, np.flatnonzero(np.abs(W @ P + b) <= tolerance))
    return shared if violation(W, b, shared, none) <= tolerance else P


def _least_norm_impulses(W: Real, b: Real, members: NDArray[np.int_]) -> Real:
    """Return the impulses with the least sum of squares with which the members open at -eps u.

    Members that would have to pull are removed and receive no impulse.
    """
    P = np.zeros(len(b))
    while len(members):
        inside = W[np.ix_(members, members)]
        P[members] = np.linalg.lstsq(inside, -b[members], rcond=IMPULSE_RANK_RTOL)[0]
        pulls = P[members] < 0.0
        if not pulls.any():
            break
        P[members[pulls]] = 0.0
        members = members[~pulls]
    return P


def stronge(
    W: Real, u: Real, friction: float, restitution: float, speed: float = 0.0
) -> tuple[float, float]:
    r"""Return the normal and tangential impulse of one hit with friction (Routh, Stronge).

    The normal impulse p grows from zero.  At each p the contact slips (dP_t/dp = -mu sign(u_t)),
    sticks, or slips in the other direction, by Coulomb's law.  Compression ends when u_n = 0;
    restitution ends when its work is eps^2 times the work of compression.  Energy is never gained.
    If the contact slips in one direction throughout, the result is that of Newton's law.

    Parameters
    ----------
    W : (2, 2)
        Inverse mass in contact space, normal and tangential; may be singular [1/kg].
    u : (2,)
        Rate of the gap (negative: closing) and sliding velocity before [m/s].
    friction, restitution : float
        mu and eps [-].
    speed : float
        As in :func:`newton`.

    Returns
    -------
    P_n, P_t : float
        Impulses [N s].

    Raises
    ------
    SimulationError
        If a moving wall pushes in a direction that friction locks.

    Examples
    --------
    A point mass of 1 kg at 45 degrees, mu = 0.1, slips throughout: P_t = -mu P_n.

    >>> stronge(np.eye(2), np.array([-1.0, 1.0]), 0.1, 0.5)
    (1.5, -0.15000000000000002)
    """
    hit = _Hit(float(W[0, 0]), float(W[0, 1]), float(W[1, 1]), friction, float(u[0]), float(u[1]))
    work = hit.compress(speed)
    hit.restore(restitution**2 * work)
    return hit.p_n, hit.p_t


@dataclass
class _Hit:
    """A hit with friction in progress.

    It has inverse masses nn, nt, tt, rates u, impulses p, the ratio dP_t/dP_n, and the derivatives
    du_n and du_t of the rates by the normal impulse.
    """

    nn: float
    nt: float
    tt: float
    friction: float
    u_n: float
    u_t: float
    p_n: float = 0.0
    p_t: float = 0.0
    ratio: float = 0.0
    du_n: float = 0.0
    du_t: float = 0.0

    def compress(self, speed: float) -> float:
        """Apply the impulses of compression and return their work [J].

        Raises
        ------
        SimulationError
            If no impulse ends the compression.
        """
        nn, tt, u_n, u_t = self.nn, self.tt, abs(self.u_n), abs(self.u_t)
        small_n = ZERO_SPEED_RTOL * u_n
        small_t = ZERO_SPEED_RTOL * (u_t + u_n * math.sqrt(tt / nn) if nn > 0.0 else u_t)
        work = 0.0
        while self.u_n < 0.0:
            to_stick = self.impulse_to_stick()
            to_open = -self.u_n / self.du_n if self.du_n > WEDGED_RTOL * nn else math.inf
            step = min(to_stick, to_open)
            if step == math.inf:
                break  # The wall is wedged, unless u_n is round-off: checked below.
            work -= self.receive(step)
            self.u_n = 0.0 if step == to_open else self.u_n + self.du_n * step
            self.u_t = 0.0 if step == to_stick else self.u_t + self.du_t * step
        if not self.u_n >= -max(small_n, COMPLEMENTARITY_RTOL * speed):
            raise SimulationError(WEDGED)
        # With one degree of freedom both rates become zero at once, up to round-off.
        self.u_n = self.u_n if self.u_n > small_n else 0.0
        self.u_t = self.u_t if abs(self.u_t) > small_t else 0.0
        return work

    def restore(self, work_left: float) -> None:
        """Apply the impulses of restitution that do the work ``work_left`` [J]."""
        while work_left > 0.0:
            to_stick = self.impulse_to_stick()
            du_n = self.du_n if abs(self.du_n) > WEDGED_RTOL * self.nn else 0.0
            to_end = _impulse_to_end(self.u_n, du_n, work_left)
            step = min(to_stick, to_end)
            if step == math.inf:
                break
            work_left -= self.receive(step)
            if step == to_end:
                break
            self.u_n, self.u_t = max(0.0, self.u_n + self.du_n * step), 0.0

    def impulse_to_stick(self) -> float:
        """Return the normal impulse that stops sliding [N s]; infinity if none does.

        Also set the ratio of the impulses and the derivatives of the rates, which are constant
        until then.
        """
        self.ratio = _friction_ratio(self.nt, self.tt, self.u_t, self.friction)
        self.du_n = self.nn + self.ratio * self.nt
        self.du_t = self.nt + self.ratio * self.tt
        return -self.u_t / self.du_t if self.u_t * self.du_t < 0.0 else math.inf

    def receive(self, step: float) -> float:
        """Add a normal impulse with its friction, and return its work [J]."""
        self.p_n, self.p_t = self.p_n + step, self.p_t + self.ratio * step
        return self.u_n * step + self.du_n * step**2 / 2


def _impulse_to_end(u_n: float, du_n: float, work_left: float) -> float:
    """Return the normal impulse that does the rest of the work of restitution [N s].

    If the gap stops opening before, return the impulse at which this happens.
    """
    root = u_n**2 + 2.0 * du_n * work_left
    if root < 0.0:
        return -u_n / du_n
    total = u_n + math.sqrt(root)
    return 2.0 * work_left / total if total > 0.0 else math.inf


def _friction_ratio(nt: float, tt: float, u_t: float, friction: float) -> float:
    """Return dP_t/dP_n by Coulomb's law for a contact that slips, sticks, or begins to slip."""
    if u_t != 0.0:
        return -friction * math.copysign(1.0, u_t)
    if abs(nt) <= friction * tt:
        return -nt / tt if tt > 0.0 else 0.0
    return -friction * math.copysign(1.0, nt)


def several(W: Real, u: Real, friction: Real, restitution: Real, speed: float = 0.0) -> Real:
    r"""Return the impulses of several simultaneous hits with friction.

    The impulses of compression are the solution of a linear complementarity problem: P_n >= 0,
    u_n >= 0, one of both is zero, and Coulomb's law holds in each contact.  The impulses of
    restitution solve the same problem, but each normal impulse is at least s eps times that of
    compression.  s is the largest number in [0, 1] for which the work of the normal impulses does
    not exceed eps^2 times their work in compression, and energy is not gained.

    Parameters
    ----------
    W : (2 k, 2 k)
        Inverse mass in contact space, the k normals first [1/kg].
    u : (2 k,)
        Rates of the gaps, then the sliding velocities [m/s].
    friction, restitution : (k,)
        mu and eps [-].
    speed : float
        As in :func:`newton`.

    Returns
    -------
    P : (2 k,)
        Impulses, the normal ones first [N s].

    Raises
    ------
    SimulationError
        If no impulses satisfy both laws, because walls close in on the mechanism or because
        friction locks it.
    """
    k = len(friction)
    tolerance = COMPLEMENTARITY_RTOL * max(float(np.abs(u).max()), speed)
    found = impulses(W, u, friction, np.zeros(k), tolerance)
    if found is None:
        opens = impulses(W[:k, :k], u[:k], np.zeros(0), np.zeros(k), tolerance) is not None
        raise SimulationError(WEDGED_SEVERAL if opens else CLOSING_IN)
    P = found
    after = u + W @ P
    lost = float(-(P[:k] * (u + after)[:k] / 2) @ restitution**2)
    wanted = restitution * P[:k]

    # Restitution may return at most the energy that compression has taken.
    taken = -float(P @ (u + after)) / 2 + COMPLEMENTARITY_RTOL * abs(float(P @ u))

    def rebound(s: float) -> tuple[Real, bool]:
        R = impulses(W, after, friction, s * wanted, tolerance)
        if R is None:
            raise SimulationError(WEDGED_SEVERAL)
        work = R * (2 * after + W @ R) / 2
        return R, float(work[:k].sum()) <= lost and float(work.sum()) <= taken

    R, allowed = rebound(1.0)
    low, high = 0.0, 1.0
    while not allowed and high - low > REBOUND_RTOL:
        s = (low + high) / 2
        low, high = (s, high) if rebound(s)[1] else (low, s)
    return P + (R if allowed else rebound(low)[0])
