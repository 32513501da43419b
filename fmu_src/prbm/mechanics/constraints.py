r"""Saddle-point systems of constrained motions, and projections onto constraints.

Sources
-------
.. [1] E. Eich, SIAM J. Numer. Anal. 30 (1993) 1467 (coordinate projection).
"""

from functools import cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ..base.errors import SimulationError
from ..base.tolerances import (
    CONSTRAINT_ITERATIONS_MAX,
    CONSTRAINT_RTOL,
    CONSTRAINT_STALLED_RTOL,
)
from .arrays import Complex, Real
from .system import Rows, System

Factors = tuple[Real, NDArray[np.int32]]

SINGULAR = (
    "the equations of motion are singular in this shape: two constraints are linearly dependent, "
    "or a part that can move has no mass"
)


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
    try:
        return np.asarray(np.linalg.solve(kkt, right), float)
    except np.linalg.LinAlgError:
        raise SimulationError(SINGULAR) from None


@cache
def _lapack() -> ModuleType:
    """Return the functions of LAPACK; their import takes 0.3 s, and only this engine needs them."""
    from scipy.linalg import lapack

    return lapack


def factor_and_solve(kkt: Real, right: Real) -> tuple[Real, Factors]:
    """Solve a saddle-point system and return its factors too, for :func:`solve_again`.

    Raises
    ------
    SimulationError
        As :func:`solve`.
    """
    lu, pivots, x, info = _lapack().dgesv(kkt, right)
    if info != 0:
        raise SimulationError(SINGULAR)
    return x, (lu, pivots)


def solve_again(factors: Factors, right: Real) -> Real:
    """Solve with the factors of :func:`factor_and_solve` and another right side."""
    x: Real = _lapack().dgetrs(*factors, right)[0]
    return x


def satisfied(residual: Real, length: float) -> bool:
    """Return whether residuals of constraints [m] are round-off in a mechanism of a length [m]."""
    return not len(residual) or float(np.abs(residual).max()) <= CONSTRAINT_RTOL * length


def project_positions(system: System, rows: Rows, q: Real, c: Real) -> tuple[Real, Complex]:
    """Move q onto the rows by the least mass-weighted change (Gauss-Newton).

    Parameters
    ----------
    system : System
        The mechanism.
    rows : Rows
        Constraints.
    q : (n,)
        Coordinates near the constraints [rad].
    c : (r,)
        Constants of the rows at the present time; they change if walls move [m].

    Returns
    -------
    q : (n,)
        Coordinates on the constraints, with residuals of at most
        :data:`prbm.base.tolerances.CONSTRAINT_RTOL` times the length, unless round-off is larger.
    e : (d,) complex
        Directions of the coordinates.

    Raises
    ------
    SimulationError
        If the iteration does not converge.
    """
    n = len(q)
    best = np.inf
    for _ in range(CONSTRAINT_ITERATIONS_MAX):
        e = system.directions(q)
        s = rows.values(e, c)
        error = float(np.abs(s).max()) if len(s) else 0.0
        stalled = CONSTRAINT_STALLED_RTOL * system.length >= best <= error
        if stalled or error <= CONSTRAINT_RTOL * system.length:
            return q, e
        best = min(best, error)
        G = rows.jacobian(e)
        right = np.zeros(n + len(c))
        right[n:] = -s
        q = q + solve(saddle(system.mass_matrix(e), G, G), right)[:n]
    raise SimulationError(
        "the loops of the mechanism could not be closed near this shape: connected parts remain "
        f"{best:.3g} m apart; release nearer to the straight shape, or check the lengths"
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
        Prescribed parts of the rates: velocities of walls, or zero [m/s].
    v : (n,)
        Angular velocities [rad/s].
    """
    n = len(v)
    right = np.zeros(n + len(rows))
    right[n:] = -(rows @ v + rates)
    return v + solve(saddle(M, rows, rows), right)[:n]
