r"""Saddle-point systems of constrained motions, and projections onto constraints.

Sources
-------
.. [1] E. Eich, SIAM J. Numer. Anal. 30 (1993) 1467 (coordinate projection).
.. [2] N. J. Higham, Accuracy and Stability of Numerical Algorithms, SIAM, 2002, section 9.4.
"""

import math
from contextlib import suppress
from functools import cache
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.errors import SimulationError
from ..base.tolerances import (
    CONSTRAINT_ITERATIONS_MAX,
    CONSTRAINT_RTOL,
    CONSTRAINT_STALLED_RTOL,
    ROW_RTOL,
    SINGULAR_RTOL,
)
from .arrays import Complex, Real
from .system import Rows, System

SINGULAR = (
    "the equations of motion are singular in this shape: two constraints are linearly dependent, "
    "or a part that can move has no mass"
)


class Factors(NamedTuple):
    """Factors P D kkt D = L U of a saddle-point matrix with its scales D.

    Parameters
    ----------
    lu : (n + r, n + r)
        L and U, of the scaled matrix.
    pivots : (n + r,) int
        Exchanges of rows P.
    scale : (n + r,)
        Diagonal of D.
    """

    lu: Real
    pivots: NDArray[np.int32]
    scale: Real


def saddle(M: Real, columns: Real, rows: Real) -> Real:
    """Stack the matrix [[M, columns^T], [rows, 0]] of a constrained motion."""
    n, r = len(M), len(rows)
    kkt = np.zeros((n + r, n + r), order="F")
    kkt[:n, :n] = M
    kkt[:n, n:] = columns.T
    kkt[n:, :n] = rows
    return kkt


def scales(kkt: Real, n: int, length: float) -> Real:
    r"""Return the scales D that make a saddle-point matrix independent of the units.

    The scale of a coordinate is 1/sqrt(M_ii), so that D M D has a unit diagonal.  Where M is a
    stiffness with a smaller diagonal element, max_j M_ij^2 / max |M| replaces it.  (It is not
    larger than M_ii if M is positive definite.)  The scale of a row makes its largest element one,
    diagonal elements included.

    Parameters
    ----------
    kkt : (n + r, n + r)
        Saddle-point matrix.
    n : int
        Number of coordinates; they have no unit (angles, logarithmic stretches).
    length : float
        Size of the mechanism [m], against which the rows are measured.

    Returns
    -------
    (n + r,)
        Scales.

    Raises
    ------
    SimulationError
        If all elements of a row are round-off.

    Examples
    --------
    >>> M, row = np.diag([4e-18, 1e-12]), np.array([[0.0, 2e-6]])
    >>> scales(saddle(M, row, row), 2, 1e-5) * [2e-9, 1e-6, 2.0]
    array([1., 1., 1.])
    """
    size = np.abs(kkt)
    block, rows = size[:n, :n], size[n:, :n]
    scale = np.empty(len(kkt))
    most = block.max(initial=0.0) or 1.0
    square = np.maximum(block.diagonal(), block.max(axis=1, initial=0.0) ** 2 / most)
    scale[:n] = 1.0 / np.sqrt(np.where(square > 0.0, square, most))
    if len(rows):
        if not rows.max(axis=1).min() > ROW_RTOL * length:
            raise SimulationError(SINGULAR)
        longest = (rows * scale[:n]).max(axis=1)
        scale[n:] = 1.0 / np.maximum(longest, np.sqrt(size.diagonal()[n:]))
    return scale


@cache
def _lapack() -> ModuleType:
    """Return the functions of LAPACK; their import takes 0.3 s, and only this engine needs them."""
    from scipy.linalg import lapack

    return lapack


def factor_saddle(kkt: Real, n: int, length: float, scale: Real) -> Factors:
    """Factor a saddle-point matrix, or reject it as singular.

    It is singular if a pivot of the matrix with its own :func:`scales`, whose elements are near
    one, is less than ``SINGULAR_RTOL``: its solution would be round-off.

    Parameters
    ----------
    kkt, n, length
        As for :func:`scales`.
    scale : (n + r,)
        Scales that make the elements of matrices of this kind at most near one.  If a pivot is
        round-off with them, the scales of the matrix itself decide.

    Raises
    ------
    SimulationError
        If the matrix is singular: two constraints contradict or repeat each other, a constraint
        does not depend on the position, or a motion has no mass.
    """
    factors = _factored(kkt, scale)
    if not _regular(factors.lu.diagonal()):
        factors = _factored(kkt, scales(kkt, n, length))
        _check_pivots(factors.lu.diagonal())
    return factors


def factor_and_solve(
    scaled: Real, right: Real, n: int, length: float, scale: Real
) -> tuple[Real, Factors]:
    """Solve as :func:`factor_saddle` and :func:`solve_saddle`, in one call of LAPACK.

    The matrix and the right side are scaled already: D kkt D and D right.
    """
    lu, pivots, x, _ = _lapack().dgesv(scaled, right)
    if _regular(lu.diagonal()):
        return scale * x, Factors(lu, pivots, scale)
    factors = factor_saddle(scaled / scale / scale[:, None], n, length, scale)
    return solve_saddle(factors, right / scale), factors


def _factored(kkt: Real, scale: Real) -> Factors:
    """Return the factors of a matrix with scales, regular or not."""
    lu, pivots, _ = _lapack().dgetrf(kkt * scale * scale[:, None], overwrite_a=True)
    return Factors(lu, pivots, scale)


def _regular(diagonal: Real) -> bool:
    """Return whether no pivot of a scaled matrix is round-off."""
    pivots = [*map(abs, diagonal.tolist())]
    return bool(min(pivots) > SINGULAR_RTOL * max(pivots))


def _check_regular(matrix: Real) -> None:
    """Reject a scaled matrix if a pivot of its elimination is round-off.

    For P A = L U with |L_ij| <= 1, the least pivot is at least 1/(n |A^-1|) in the 1-norm, and the
    largest one at most n max |A_ij| unless elements grow exceptionally [2]_.  The elimination
    itself, which is slow in Python, decides where these bounds do not.
    """
    n = len(matrix)
    with suppress(np.linalg.LinAlgError):
        least = 1.0 / (n * np.linalg.norm(np.linalg.inv(matrix), 1))
        if least > SINGULAR_RTOL * n * np.abs(matrix).max():
            return
    _check_pivots(_pivots(matrix))


def _check_pivots(diagonal: Real) -> None:
    """Reject a scaled matrix with these pivots if one of them is round-off."""
    if not _regular(diagonal):
        raise SimulationError(SINGULAR)


def _pivots(matrix: Real) -> Real:
    """Return the magnitudes of the pivots of Gauss' elimination with partial pivoting."""
    A, found = matrix.copy(), np.zeros(len(matrix))
    for k in range(len(A)):
        best = k + int(np.abs(A[k:, k]).argmax())
        A[[k, best]] = A[[best, k]]
        found[k] = abs(A[k, k])
        if not found[k] > 0.0:
            break
        A[k + 1 :, k:] -= A[k + 1 :, k : k + 1] / A[k, k] * A[k, k:]
    return found


def solve_saddle(factors: Factors, right: Real) -> Real:
    """Solve with the factors of :func:`factor_saddle`; ``right`` may have several columns."""
    scale = factors.scale if right.ndim == 1 else factors.scale[:, None]
    x: Real = _lapack().dgetrs(factors.lu, factors.pivots, scale * right)[0]
    return scale * x


def solve(kkt: Real, right: Real, n: int, length: float) -> Real:
    """Solve a saddle-point system with :func:`scales`, without SciPy.

    Raises
    ------
    SimulationError
        As :func:`factor_saddle`, or if all elements of a row are round-off.
    """
    scale = scales(kkt, n, length)
    A = kkt * scale * scale[:, None]
    _check_regular(A)
    spread = scale if right.ndim == 1 else scale[:, None]
    x: Real = spread * np.linalg.solve(A, spread * right)
    return x


def solve_bordered(kkt: Real, column: Real, row: Real, right: Real, n: int, length: float) -> Real:
    """Solve [[kkt, column], [row]] x = right, regular also where a path of solutions turns back.

    Parameters
    ----------
    kkt, n, length
        As for :func:`scales`.
    column : (n + r,)
        Derivative of the equations by the parameter of the path.
    row : (n + r + 1,)
        Row of the step along the path, the parameter last.
    right : (n + r + 1,) or (n + r + 1, k)
        Right sides.

    Raises
    ------
    SimulationError
        If the matrix is singular, as at a bifurcation.
    """
    scale = np.append(scales(kkt, n, length), 1.0)
    A = np.zeros((len(scale), len(scale)))
    A[:-1, :-1], A[:-1, -1], A[-1] = kkt, column, row
    A *= scale * scale[:, None]
    wide, high = np.abs(A[-1]).max() or 1.0, np.abs(A[:-1, -1]).max() or 1.0
    A[-1] /= wide
    A[:, -1] /= high
    lu, pivots, _ = _lapack().dgetrf(A, overwrite_a=True)
    _check_pivots(np.abs(lu.diagonal()))
    spread = scale if right.ndim == 1 else scale[:, None]
    scaled = spread * right
    scaled[-1] /= wide
    x: Real = spread * _lapack().dgetrs(lu, pivots, scaled)[0]
    x[-1] /= high
    return x


def determinant_sign(kkt: Real, n: int, length: float) -> int:
    """Return the sign of the determinant of a saddle-point matrix; 0 if it is singular.

    Along a path of equilibria it changes where an odd number of motions become unstable.

    Parameters
    ----------
    kkt, n, length
        As for :func:`scales`.

    Examples
    --------
    >>> row = np.array([[0.0, 1.0]])
    >>> [determinant_sign(saddle(np.diag([k, 1.0]), row, row), 2, 1.0) for k in (2.0, 0.0, -2.0)]
    [-1, 0, 1]
    """
    try:
        scale = scales(kkt, n, length)
        A = kkt * scale * scale[:, None]
        _check_regular(A)
    except SimulationError:
        return 0
    return int(np.linalg.slogdet(A)[0])


def cholesky(M: Real) -> Real:
    """Return the lower triangle L of a mass matrix M = L L^T, or reject M as singular.

    Raises
    ------
    SimulationError
        If a pivot is less than ``SINGULAR_RTOL`` of its diagonal element: a motion has no mass.
    """
    with suppress(np.linalg.LinAlgError):
        L = np.asarray(np.linalg.cholesky(M), float)
        if np.all(L.diagonal() ** 2 > SINGULAR_RTOL * M.diagonal()):
            return L
    raise SimulationError("the modes cannot be computed: a part that can move has no mass")


def satisfied(residual: Real, length: float) -> bool:
    """Return whether residuals of constraints [m] are round-off in a mechanism of a length [m]."""
    return not len(residual) or float(np.abs(residual).max()) <= CONSTRAINT_RTOL * length


@np.errstate(over="ignore", invalid="ignore")  # Of an iteration that diverges.
def project_positions(
    system: System, rows: Rows, q: Real, c: Real | None = None
) -> tuple[Real, Complex]:
    """Move q onto the rows by the least mass-weighted change (Gauss-Newton).

    Parameters
    ----------
    system : System
        The mechanism.
    rows : Rows
        Constraints.
    q : (n,)
        Coordinates near the constraints [rad].
    c : (r,) or None
        Constants of the rows at the present time; they change if walls move [m].  None: the own
        ones of the rows.

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
        if not math.isfinite(error):
            break
        best = min(best, error)
        G = rows.jacobian(e)
        right = np.zeros(n + len(rows))
        right[n:] = -s
        q = q + solve(saddle(system.mass_matrix(e), G, G), right, n, system.length)[:n]
    raise SimulationError(
        "the loops of the mechanism could not be closed near this shape: connected parts remain "
        f"{best:.3g} m apart; release nearer to the straight shape, or check the lengths"
    )


def project_velocities(M: Real, rows: Real, rates: Real, v: Real, length: float) -> Real:
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
    length : float
        Size of the mechanism [m].

    Raises
    ------
    SimulationError
        As :func:`factor_saddle`.
    """
    n = len(v)
    right = np.zeros(n + len(rows))
    right[n:] = -(rows @ v + rates)
    return v + solve(saddle(M, rows, rows), right, n, length)[:n]
