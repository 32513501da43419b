r"""Rigid impacts in contact space: Newton's law for all stops at once, Stronge's with friction.

With the rows G (gaps) and T (slides) of the stops and the response of the constrained mechanism
to unit impulses, W = [G; T] M^-1 [G; T]^T (with M^-1 on the tangent of the loops), an impact is

    u+ = u- + W P,

u the rates of the gaps, walls included.  W is never inverted: for a mechanism of one degree of
freedom it has rank one.

Sources
-------
.. [1] F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley, 1996.
.. [2] W. J. Stronge, J. Appl. Mech. 58 (1991) 1049; Impact Mechanics, Cambridge, 2000.
.. [3] T. R. Kane, D. A. Levinson, Dynamics: Theory and Applications, 1985 (the gain of energy
   by Newton's law with Coulomb's).
"""

import math
from itertools import combinations

import numpy as np

from ..base.errors import SimulationError
from . import constraints
from .arrays import Real

FEASIBLE = 1e-10  # of the largest approach: what the complementarity may be violated by
SWEEPS = 2000  # of Gauss-Seidel over several contacts with friction
WEDGED = 1e-10  # of the inverse normal mass: a smaller rate of the approach is a rounding
ROUNDING = 1e-12  # of the rates before: what is left of a rate that has vanished
RELAXATIONS = (1.0, 0.3, 0.05)  # of the sweeps, tried in this order
SETTLED = 1e-14  # change of the impulses at which the sweeps end, relative


def response(M: Real, held: Real, rows: Real) -> Real:
    """Return the changes of velocity by unit impulses along the rows, (n, k) [rad/s per N s].

    Parameters
    ----------
    M : (n, n)
        Mass matrix [kg m^2].
    held : (r, n)
        Rows that keep their rate: loops, held stops [m/rad].
    rows : (k, n)
        Directions of the impulses [m/rad].

    Examples
    --------
    >>> response(np.diag([2.0]), np.zeros((0, 1)), np.array([[1.0]])).item()
    0.5
    """
    n, k = len(M), len(rows)
    right = np.zeros((n + len(held), k), order="F")
    right[:n] = rows.T
    return constraints.solve(constraints.saddle(M, held, held), right)[:n]


def newton(W: Real, u: Real, restitution: Real) -> Real:
    r"""Return the impulses of a frictionless impact of several stops, without an order.

    Solves P >= 0, W P + u + eps u >= 0, complementary, for closing or resting stops (u <= 0):
    each stop that receives an impulse opens at -eps u.  Energy is never gained.

    Parameters
    ----------
    W : (k, k)
        Inverse mass in contact space, symmetric positive semidefinite [1/kg].
    u : (k,)
        Rates of the gaps before, none positive [m/s].
    restitution : (k,)
        Coefficients of restitution [-].

    Returns
    -------
    P : (k,)
        Impulses [N s].

    Examples
    --------
    A ball of 2 kg at 3 m/s against a wall, restitution 0.5: P = (1 + 0.5) 2 3.

    >>> newton(np.array([[0.5]]), np.array([-3.0]), np.array([0.5])).item()
    9.0
    """
    b = (1.0 + restitution) * u
    k = len(u)
    worst, best = math.inf, np.zeros(k)
    # the largest sets first: a stop that closes nearly always receives an impulse
    for size in range(k, -1, -1):
        for members in combinations(range(k), size):
            s = list(members)
            P = np.zeros(k)
            if s:
                P[s] = np.linalg.lstsq(W[np.ix_(s, s)], -b[s], rcond=1e-13)[0]
            violation = max(
                float((-(W @ P + b)).max()),
                float((-P * np.diag(W)).max()),
                float(np.abs(P * np.diag(W) * (W @ P + b)).max()) ** 0.5,
            )
            if violation <= FEASIBLE * float(np.abs(u).max()):
                return np.maximum(P, 0.0)
            if violation < worst:
                worst, best = violation, np.maximum(P, 0.0)
    return best


def stronge(W: Real, u: Real, friction: float, restitution: float) -> tuple[float, float]:
    r"""Return the normal and tangential impulse of one hit with friction (Routh, Stronge).

    The normal impulse p grows; the contact slips (P_t' = -mu sign(u_t)), sticks or slips back
    as Coulomb's law says at each p.  Compression ends when u_n = 0; restitution ends when its
    work is eps^2 times the work of compression.  Energy is never gained, and where the contact
    slips in one direction throughout the result is Newton's.

    Parameters
    ----------
    W : (2, 2)
        Inverse mass in contact space, normal and tangential; may be singular [1/kg].
    u : (2,)
        Rate of the gap (negative: closing) and sliding velocity before [m/s].
    friction, restitution : float
        mu and eps [-].

    Returns
    -------
    P_n, P_t : float
        Impulses [N s].

    Examples
    --------
    A point mass of 1 kg at 45 degrees, mu = 0.1, slips throughout: P_t = -mu P_n.

    >>> stronge(np.eye(2), np.array([-1.0, 1.0]), 0.1, 0.5)
    (1.5, -0.15000000000000002)
    """
    nn, nt, tt = float(W[0, 0]), float(W[0, 1]), float(W[1, 1])
    u_n, u_t = float(u[0]), float(u[1])
    small_n = ROUNDING * abs(u_n)
    small_t = ROUNDING * (abs(u_t) + abs(u_n) * math.sqrt(tt / nn) if nn > 0.0 else abs(u_t))
    p_n = p_t = work = 0.0
    while u_n < 0.0:
        ratio = _friction_ratio(nt, tt, u_t, friction)
        rate_n, rate_t = nn + ratio * nt, nt + ratio * tt
        stops_sliding = -u_t / rate_t if u_t * rate_t < 0.0 else math.inf
        stops_closing = -u_n / rate_n if rate_n > WEDGED * nn else math.inf
        step = min(stops_sliding, stops_closing)
        if step == math.inf:
            break
        work -= u_n * step + rate_n * step**2 / 2
        p_n, p_t = p_n + step, p_t + ratio * step
        u_n = 0.0 if step == stops_closing else u_n + rate_n * step
        u_t = 0.0 if step == stops_sliding else u_t + rate_t * step
    # with one degree of freedom both rates vanish together, up to a rounding
    u_n = u_n if u_n > small_n else 0.0
    u_t = u_t if abs(u_t) > small_t else 0.0
    left = restitution**2 * work
    while left > 0.0:
        ratio = _friction_ratio(nt, tt, u_t, friction)
        rate_n, rate_t = nn + ratio * nt, nt + ratio * tt
        stops_sliding = -u_t / rate_t if u_t * rate_t < 0.0 else math.inf
        spent = _restitution_ends(u_n, rate_n if abs(rate_n) > WEDGED * nn else 0.0, left)
        step = min(stops_sliding, spent)
        if step == math.inf:
            break
        left -= u_n * step + rate_n * step**2 / 2
        p_n, p_t = p_n + step, p_t + ratio * step
        if step == spent:
            break
        u_n, u_t = max(0.0, u_n + rate_n * step), 0.0
    return p_n, p_t


def _restitution_ends(u_n: float, rate_n: float, left: float) -> float:
    """Return the impulse after which the work of restitution is done, or opening stops."""
    root = u_n**2 + 2.0 * rate_n * left
    if root < 0.0:
        return -u_n / rate_n
    total = u_n + math.sqrt(root)
    return 2.0 * left / total if total > 0.0 else math.inf


def _friction_ratio(nt: float, tt: float, u_t: float, friction: float) -> float:
    """Return dP_t/dP_n by Coulomb's law: slipping, sticking, or starting to slip from rest."""
    if u_t != 0.0:
        return -friction * math.copysign(1.0, u_t)
    if abs(nt) <= friction * tt:
        return -nt / tt if tt > 0.0 else 0.0
    return -friction * math.copysign(1.0, nt)


def several(W: Real, u: Real, friction: Real, restitution: Real) -> Real:
    r"""Return the impulses of several hits at once with friction, without an order.

    Compression: P_n >= 0, u_n >= 0, complementary, and Coulomb's law in each contact, solved by
    Gauss-Seidel to a fixed point (where the order no longer matters).  Restitution: at least
    s eps times each normal impulse again, more where a gap would close, with friction; s in
    [0, 1] is the largest for which the work of the normal impulses does not exceed eps^2 times
    that of the compression.

    Parameters
    ----------
    W : (2 k, 2 k)
        Inverse mass in contact space, the k normals first [1/kg].
    u : (2 k,)
        Rates of the gaps, then the sliding velocities [m/s].
    friction, restitution : (k,)
        mu and eps [-].

    Returns
    -------
    P : (2 k,)
        Impulses, the normal ones first [N s].

    Raises
    ------
    SimulationError
        If the sweeps find no impulses that satisfy both laws.
    """
    k = len(friction)
    P = _sweep(W, u, friction, np.zeros(k))
    after = u + W @ P
    lost = float(-(P[:k] * (u + after)[:k] / 2) @ restitution**2)
    wanted = restitution * P[:k]

    def rebound(s: float) -> tuple[Real, float]:
        R = _sweep(W, after, friction, s * wanted)
        return R, float(R[:k] @ (2 * after + W @ R)[:k] / 2)

    R, gain = rebound(1.0)
    low, high = 0.0, 1.0
    while gain > lost and high - low > 1e-12:
        s = (low + high) / 2
        low, high = (s, high) if rebound(s)[1] <= lost else (low, s)
    return P + (R if gain <= lost else rebound(low)[0])


def _sweep(W: Real, u: Real, friction: Real, least: Real) -> Real:
    """Gauss-Seidel over contacts: P_n >= least, u_n >= 0, complementary; Coulomb's law.

    Strongly coupled contacts can make the sweeps run in circles; shorter steps lead out.
    """
    k = len(friction)
    for relaxation in RELAXATIONS:
        P = np.concatenate([least, np.zeros(k)])
        for _ in range(SWEEPS):
            last = P.copy()
            for i in range(k):
                if W[i, i] > 0.0:
                    wanted = P[i] - relaxation * float(u[i] + W[i] @ P) / W[i, i]
                    P[i] = max(least[i], wanted)
                j = k + i
                if W[j, j] > 0.0:
                    limit = friction[i] * P[i]
                    wanted = P[j] - relaxation * float(u[j] + W[j] @ P) / W[j, j]
                    P[j] = min(limit, max(-limit, wanted))
            if np.abs(P - last).max() <= SETTLED * relaxation * np.abs(P).max():
                return P
    raise SimulationError(
        "several stops are hit at once with friction, and no impulses were found that satisfy "
        "Coulomb's law at all of them; reduce the friction of the stops, or move them apart"
    )
