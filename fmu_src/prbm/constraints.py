r"""Scalars s = Re(B e) + c of the position: values, rates, convective terms, projection.

Loop closures, gaps and displacements are all of this form (see :mod:`prbm.assembly`), so that
with e = exp(i q)

    s = Re(B e) + c,    ds/dq = -Im(B e),    s'' = (ds/dq) a - Re(B e) v^2.

Sources
-------
.. [1] E. Eich, SIAM J. Numer. Anal. 30 (1993) 1467 (coordinate projection).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv, dgetrs

from .assembly import Complex, Real
from .errors import SimulationError
from .kinetics import inertia

Factors = tuple[Real, NDArray[np.int32]]

CLOSED = 1e-14  # of the size of the mechanism: a few roundings of its coordinates
BARELY_CLOSED = 1e-12  # of that size: accepted if the iteration can do no better
ITERATIONS = 20  # Gauss-Newton converges quadratically: three are usual, twenty are hopeless


def values(B: Complex, c: Real, e: Complex) -> Real:
    """Return s = Re(B e) + c [m], for rows B."""
    result: Real = (B @ e).real + c
    return result


def jacobian(B: Complex, e: Complex) -> Real:
    """Return ds/dq = -Im(B e) [m/rad], one row per row of B."""
    return -(B * e).imag


def convective(B: Complex, e: Complex, v: Real) -> Real:
    """Return -(d/dt ds/dq) v = Re(B e) v^2, the right side of (ds/dq) a = ... for s'' = 0."""
    result: Real = (B * e).real @ (v * v)
    return result


def saddle(M: Real, columns: Real, rows: Real) -> Real:
    """Stack the matrix [[M, columns^T], [rows, 0]] of a constrained motion."""
    n, r = len(M), len(rows)
    kkt = np.zeros((n + r, n + r), order="F")
    kkt[:n, :n] = M
    kkt[:n, n:] = columns.T
    kkt[n:, :n] = rows
    return kkt


def solve(kkt: Real, right: Real) -> Real:
    """Solve a saddle-point system; ``right`` may have several columns.

    Raises
    ------
    SimulationError
        If the matrix is singular: two constraints contradict or repeat each other, or a motion
        has no mass.
    """
    return factor_and_solve(kkt, right)[0]


def factor_and_solve(kkt: Real, right: Real) -> tuple[Real, Factors]:
    """Solve a saddle-point system and return its factors too, for :func:`solve_again`.

    Raises
    ------
    SimulationError
        As :func:`solve`.
    """
    lu, pivots, x, info = dgesv(kkt, right)
    if info != 0:
        raise SimulationError(
            "the equations of motion are singular here: two constraints repeat each other, or a "
            "part that can move has no mass"
        )
    return x, (lu, pivots)


def solve_again(factors: Factors, right: Real) -> Real:
    """Solve with the factors of :func:`factor_and_solve` and another right side."""
    x: Real = dgetrs(*factors, right)[0]
    return x


def project_positions(
    H: Complex, J: Real, B: Complex, c: Real, q: Real, length: float
) -> tuple[Real, Complex]:
    """Move q onto Re(B e) + c = 0 by the least mass-weighted change (Gauss-Newton).

    Parameters
    ----------
    H, J : (n, n)
        As in :func:`prbm.kinetics.inertia`.
    B, c : (r, n) complex, (r,)
        Constraints [m].
    q : (n,)
        Angles near the constraints [rad].
    length : float
        Size of the mechanism [m].

    Returns
    -------
    q : (n,)
        On the constraints, to :data:`CLOSED` times the length where rounding allows.
    e : (n,) complex
        exp(i q).

    Raises
    ------
    SimulationError
        If the iteration does not converge.
    """
    n = len(q)
    best = np.inf
    for _ in range(ITERATIONS):
        e = np.exp(1j * q)
        s = (B @ e).real + c
        error = float(np.abs(s).max()) if len(s) else 0.0
        if error <= CLOSED * length or BARELY_CLOSED * length >= best <= error:
            return q, e
        best = min(best, error)
        rows = jacobian(B, e)
        right = np.zeros(n + len(c))
        right[n:] = -s
        q = q + solve(saddle(inertia(H, J, e)[0], rows, rows), right)[:n]
    raise SimulationError(
        f"the loops of the mechanism cannot be closed here (by {best:.3g} m): the parts do not "
        "reach each other"
    )


def project_velocities(M: Real, rows: Real, rates: Real, v: Real) -> Real:
    """Move v onto rows v + rates = 0 by the change of least kinetic energy.

    Parameters
    ----------
    M : (n, n)
        Mass matrix [kg m^2].
    rows : (r, n)
        Constraint Jacobian [m/rad].
    rates : (r,)
        Prescribed part of the rate: of a moving wall, or zero [m/s].
    v : (n,)
        Angular velocities [rad/s].
    """
    n = len(v)
    right = np.zeros(n + len(rows))
    right[n:] = -(rows @ v + rates)
    return v + solve(saddle(M, rows, rows), right)[:n]
