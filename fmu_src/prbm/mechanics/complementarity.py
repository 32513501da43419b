r"""Complementarity problems of unilateral contacts: Lemke's method, and Coulomb's law in the plane.

A linear complementarity problem is the search for z with

    z >= 0,    w = M z + q >= 0,    z . w = 0.

Lemke's method follows a path of pivots that begins at a ray, which the covering vector defines.
The path ends in a solution or in another ray.  It ends in a solution if the rates without forces
are those of a possible motion [2].  There may be no solution if walls close in on the mechanism or,
for accelerations, if contacts slide (Painleve's paradox).  In these cases a path may also end in a
ray although a solution exists.  Therefore the problem is rejected as unsolvable only after the
paths of other covering vectors have failed, too.  With constraints that act in both directions, all
combinations of modes are then tried, unless there are too many of them.

Sources
-------
.. [1] R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem, Academic Press,
   1992, 4.4 (Lemke's method), 4.9 (lexicographic order of equal ratios).
.. [2] M. Anitescu, F. A. Potra, Nonlinear Dynamics 14 (1997) 231 (solutions with friction).
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.tolerances import (
    COVER_FACTOR,
    MODES_TRIED_MAX,
    PIVOT_RTOL,
    PIVOTS_FACTOR,
    RATIO_RTOL,
)
from .arrays import Real

Integers = NDArray[np.int_]


def lemke(M: Real, q: Real, cover: Real) -> Real | None:
    """Return a solution z of a linear complementarity problem; None if the path ends in a ray.

    Parameters
    ----------
    M : (m, m)
        Matrix, with entries near one in magnitude.
    q : (m,)
        Constant part.
    cover : (m,)
        Covering vector, positive.

    Examples
    --------
    >>> ones = np.ones(2)
    >>> lemke(np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-4.0, 1.0]), ones).tolist()
    [2.0, 0.0]
    >>> lemke(np.array([[0.0]]), np.array([-1.0]), ones[:1]) is None
    True
    """
    m, size = len(q), math.ldexp(1.0, math.frexp(float(np.abs(q).max(initial=0.0)))[1])
    if not m or q.min() >= 0.0:
        return np.zeros(m)
    # The columns belong to w (m), z (m), the covering variable and the constants.
    table = np.hstack([np.eye(m), -M, -cover[:, None], (q / size)[:, None]])
    basis = list(range(m))
    row, entering = _first_row(q / size / cover), 2 * m
    for _ in range(PIVOTS_FACTOR * m):
        leaving = basis[row]
        _exchange(table, row, entering)
        basis[row] = entering
        if leaving == 2 * m:
            return size * _values(table, basis)
        entering = leaving + m if leaving < m else leaving - m
        found = _leaving_row(table, basis, entering)
        if found is None:
            return None
        row = found
    return None


def _first_row(values: Real) -> int:
    """Return the row with the least value; of equal ones the last, in lexicographic order."""
    return int(len(values) - 1 - np.argmin(values[::-1]))


def _exchange(table: Real, row: int, column: int) -> None:
    """Pivot on a row and a column, so that the column becomes a unit vector."""
    table[row] /= table[row, column]
    factors = table[:, column].copy()
    factors[row] = 0.0
    table -= factors[:, None] * table[row]
    table[:, column] = 0.0
    table[row, column] = 1.0


def _leaving_row(table: Real, basis: list[int], entering: int) -> int | None:
    """Return the row whose variable falls to zero first; None if none falls.

    Among rows with equal ratios, the row of the covering variable comes first, then the
    lexicographically least row.  No basis occurs twice.
    """
    m, column = len(basis), table[:, entering]
    least = PIVOT_RTOL * max(1.0, float(np.abs(column).max()))
    rows = np.flatnonzero(column > least)
    for k in range(-1, m):
        if len(rows) < 2:
            break
        ratios = table[rows, k] / column[rows]
        ratios = np.maximum(ratios, 0.0) if k < 0 else ratios
        low = float(ratios.min())
        rows = rows[ratios <= low + RATIO_RTOL * max(1.0, abs(low))]
        covering = [int(row) for row in rows if basis[row] == 2 * m]
        if k < 0 and covering:
            return covering[0]
    return int(rows[0]) if len(rows) else None


def _values(table: Real, basis: list[int]) -> Real:
    """Return the values of z in a basis."""
    m = len(basis)
    z = np.zeros(2 * m + 1)
    z[basis] = np.maximum(table[:, -1], 0.0)
    return z[m : 2 * m]


class TwoSided(NamedTuple):
    """Normal forces that act in both directions, and depend on the forces of other contacts.

    The normal force of the g-th of them is b + (L P)_g [N] at forces P, and limits a tangent by its
    magnitude.

    Parameters
    ----------
    L : (g, k + m)
        Changes of the normal forces by unit forces [-].
    b : (g,)
        Normal forces without the forces of contacts [N].
    """

    L: Real
    b: Real

    def of(self, P: Real) -> Real:
        """Return the normal forces, (g,) [N]."""
        result: Real = self.b + self.L @ P
        return result


def limits(
    P: Real, friction: Real, fixed: Real, normal: Integers, carried: TwoSided | None = None
) -> Real:
    """Return the limits of the tangential forces at forces P, see :func:`coulomb`, (m,) [N]."""
    every = [P[: len(P) - len(fixed)], [0.0] if carried is None else np.abs(carried.of(P)), [0.0]]
    result: Real = fixed + friction * np.concatenate(every)[normal]
    return result


def coulomb(
    W: Real,
    u: Real,
    friction: Real,
    fixed: Real,
    normal: Integers,
    tolerance: float,
    carried: TwoSided | None = None,
) -> Real | None:
    r"""Return normal and tangential forces (or impulses) of contacts; None without a solution.

    The rates are W P + u.  For normal forces P >= 0, rate >= 0, and one of both is zero.  For
    tangential forces abs(P) <= limit, and P = -limit sign(rate) where the rate is not zero.  The
    limit is fixed + friction P_n, with the normal force P_n of the contact.  P_n may be the
    magnitude of a force of constraints that act in both directions, abs(b + L P): a further unknown
    z is its negative part, z >= 0, b + L P + z >= 0, and one of both is zero.  The force counts as
    positive to the side of b: with z = 0 at first, the path also finds contacts that stick there.

    The solution need not be unique: friction can jam contacts that would also slide or separate.
    Contacts that do not close without forces are therefore left out at first.  They take part only
    if the forces of the others close them.

    Round-off on the path of pivots may lead to forces that violate the laws by more than the
    tolerance.  They are discarded, and the path of the next covering vector is followed.  Rates up
    to half of the tolerance are round-off, which would choose the path; they count as zero.  If
    there is no solution, the normal rates are increased by half of the tolerance.

    Parameters
    ----------
    W : (k + m, k + m)
        Inverse mass in contact space, k normals, then m tangents [1/kg].
    u : (k + m,)
        Rates without the forces.
    friction, fixed : (m,)
        Coefficients mu [-], and the constant parts of the limits [N].
    normal : (m,) int
        Index of the normal force on which the limit of each tangent depends; -1 if on none.  The
        forces of ``carried`` have the indices from k on.
    tolerance : float
        Largest violation of the laws that is accepted as round-off, as a rate.
    carried : TwoSided or None
        Normal forces that act in both directions.

    Examples
    --------
    A block of 1 kg is pressed by 10 N and pushed by 3 N at mu = 0.5: it sticks.

    >>> W, none = np.eye(2), np.zeros(1)
    >>> coulomb(W, np.array([-10.0, 3.0]), none + 0.5, none, np.array([0]), 1e-9).tolist()
    [10.0, -3.0]

    A contact that jams (forces 1 and -1.5 are a second solution) separates instead.

    >>> W = np.array([[1.0, 1.4], [1.4, 2.0]])
    >>> coulomb(W, np.array([1.1, 1.6]), none + 2.0, none, np.array([0]), 1e-9).tolist()
    [0.0, 0.0]

    A slider whose guide carries a load of 10 N, reduced by 0.2 of its friction, pushed by 3 N.

    >>> carried = TwoSided(np.array([[0.2]]), np.array([-10.0]))
    >>> u, zero = np.array([3.0]), np.array([0])
    >>> coulomb(np.eye(1), u, none + 0.25, none, zero, 1e-9, carried).round(9)
    array([-2.63157895])
    """
    m = len(fixed)
    k = len(u) - m
    scale = _force_scales(W)
    M, spread, constants = _coulomb_problem(scale, W, friction, fixed, normal, carried)
    size = k + 2 * m
    given, u = u, np.where(np.abs(u) <= tolerance / 2, 0.0, u)
    # Guides that lock each other may need a path from another unknown than a normal force.
    heaviest = k if carried is None or not len(carried.b) else len(M)
    attempts = [(M, u), (M, u + tolerance / 2 * (np.arange(k + m) < k))]
    unloaded = np.flatnonzero(u[:k] >= -tolerance)
    if len(unloaded):
        reduced = M.copy()
        reduced[unloaded], reduced[:, unloaded] = 0.0, 0.0
        rates = u.copy()
        rates[unloaded] = np.maximum(rates[unloaded], 0.0)
        attempts.insert(0, (reduced, rates))
    for matrix, rates in attempts:
        q = np.concatenate([spread.T @ (scale * rates), constants])
        for heavy in range(-1, heaviest):
            cover = np.ones(len(q))
            cover[np.arange(len(q)) == heavy] = COVER_FACTOR
            z = lemke(matrix, q, cover)
            if z is None:
                continue
            P = scale * (spread @ z[:size])
            limit = limits(P, friction, fixed, normal, carried)
            if violation(W, given, P, limit) <= tolerance:
                return P
    if carried is None or not len(carried.b):
        return None
    return in_any_modes(W, given, friction, fixed, normal, tolerance, carried)


def in_any_modes(
    W: Real,
    u: Real,
    friction: Real,
    fixed: Real,
    normal: Integers,
    tolerance: float,
    carried: TwoSided,
) -> Real | None:
    """Return forces as :func:`coulomb`, from all combinations of modes; None without a solution.

    A normal is open or closed, a tangent sticks or has a friction force of either sign.  Forces
    that act in both directions need no further modes: their side times the direction of sliding is
    the sign of the friction force.  The limits by these forces have no constant parts.  Modes with
    dependent equations are left out, and nothing is tried if there are more than
    ``MODES_TRIED_MAX`` combinations.
    """
    m = len(fixed)
    k = len(u) - m
    if 2.0**k * 3.0**m > MODES_TRIED_MAX:
        return None
    scale = _force_scales(W)
    rates, still = scale[:, None] * W * scale, -scale * u
    loads, constants = _normal_forces(scale, friction, fixed, normal, carried)
    for modes in _all_modes(k, m):
        A, right = np.eye(k + m), np.zeros(k + m)
        for i, mode in enumerate(modes):
            if mode == (1 if i < k else 0):
                A[i], right[i] = rates[i], still[i]
            elif i >= k:
                sign = 3 - 2 * mode  # 1 or -1.
                A[i] += sign * loads[i - k]
                right[i] = -sign * constants[i - k]
        try:
            P: Real = scale * np.linalg.solve(A, right)
        except np.linalg.LinAlgError:
            continue
        if not np.isfinite(P).all():
            continue
        if violation(W, u, P, limits(P, friction, fixed, normal, carried)) <= tolerance:
            return P
    return None


def _force_scales(W: Real) -> Real:
    """Return scales of the forces by their own mobilities, with which W has a unit diagonal."""
    mobility = np.abs(np.diag(W))
    scale: Real = 1.0 / np.sqrt(np.where(mobility > 0.0, mobility, 1.0))
    return scale


def _all_modes(k: int, m: int) -> Iterator[list[int]]:
    """Yield all modes of k normals (0: open, 1: closed) and m tangents (0: stick, 1, 2: slip).

    The first one changes fastest.
    """
    sizes = [2] * k + [3] * m
    for number in range(2**k * 3**m):
        modes, rest = [], number
        for size in sizes:
            rest, mode = divmod(rest, size)
            modes.append(mode)
        yield modes


def _normal_forces(
    scale: Real, friction: Real, fixed: Real, normal: Integers, carried: TwoSided
) -> tuple[Real, Real]:
    """Return the limits of scaled tangents as A p + c of scaled forces p, with signs of normals."""
    m = len(fixed)
    k = len(scale) - m
    A, constants = np.zeros((m, k + m)), fixed / scale[k:]
    for j in range(m):
        share = friction[j] / scale[k + j]
        if 0 <= normal[j] < k:
            A[j, normal[j]] = share * scale[normal[j]]
        elif normal[j] >= k:
            A[j] = share * carried.L[normal[j] - k] * scale
            constants[j] += share * carried.b[normal[j] - k]
    return A, constants


def _coulomb_problem(
    scale: Real, W: Real, friction: Real, fixed: Real, normal: Integers, carried: TwoSided | None
) -> tuple[Real, Real, Real]:
    """Return the matrix of :func:`coulomb`, the map of its forces, and its constants.

    The unknowns z are (P_n, P_t+, P_t-, sliding speeds, negative parts of two-sided normal forces),
    with P_t = P_t+ - P_t-, all of them scaled.
    """
    m = len(fixed)
    k, sides = len(W) - m, 0 if carried is None else len(carried.b)
    S = scale[:, None] * W * scale
    spread = np.zeros((k + m, k + 2 * m))
    spread[:k, :k] = np.eye(k)
    spread[k:, k:] = np.hstack([np.eye(m), -np.eye(m)])
    size = k + 2 * m
    M = np.zeros((size + m + sides, size + m + sides))
    M[:size, :size] = spread.T @ S @ spread
    M[k:size, size : size + m] = np.vstack([np.eye(m), np.eye(m)])
    M[size : size + m, k:size] = -np.hstack([np.eye(m), np.eye(m)])
    constants = np.concatenate([fixed / scale[k:], np.zeros(sides)])
    for j in range(m):
        g, row = normal[j] - k, size + j
        if 0 <= normal[j] < k:
            M[row, normal[j]] = friction[j] * scale[normal[j]] / scale[k + j]
        elif carried is not None and g >= 0:
            side, unit = size + m + g, math.copysign(1.0 / scale[k + j], carried.b[g])
            M[side, :size] = (carried.L[g] * scale * unit) @ spread
            M[side, side], constants[m + g] = 1.0, carried.b[g] * unit
            M[row] += friction[j] * M[side]
            M[row, side] += friction[j]
            constants[j] += friction[j] * constants[m + g]
    return M, spread, constants


def impulses(W: Real, u: Real, friction: Real, least: Real, tolerance: float) -> Real | None:
    r"""Return impulses of an impact by :func:`coulomb`; None without a solution.

    There are k normals and, with friction, k tangents.

    Parameters
    ----------
    W, u : (k, k) or (2 k, 2 k), (k,) or (2 k,)
        As in :func:`coulomb`.
    friction : (m,)
        mu [-].
    least : (k,)
        Least normal impulses [N s].
    tolerance : float
        Largest violation of the laws that is accepted as round-off [m/s].
    """
    k, m = len(least), len(friction)
    given = u + W[:, :k] @ least
    P = coulomb(W, given, friction, friction * least[:m], np.arange(m), tolerance)
    if P is not None:
        P[:k] += least
    return P


def violation(W: Real, u: Real, P: Real, limit: Real) -> float:
    """Return the largest violation of the laws of :func:`coulomb`, as a rate.

    Parameters
    ----------
    W, u, P : (k + m, k + m), (k + m,), (k + m,)
        As in :func:`coulomb`, and its result.
    limit : (m,)
        Limits of the tangential forces.
    """
    k = len(u) - len(limit)
    rates, share = W @ P + u, P * np.diag(W)
    normal = np.abs(np.minimum(rates[:k], share[:k]))
    excess = np.abs(share[k:]) - limit * np.diag(W)[k:]
    # A contact that slides needs friction at the limit, opposite to the velocity.
    missing = limit * np.diag(W)[k:] + np.sign(rates[k:]) * share[k:]
    sliding = np.minimum(np.abs(rates[k:]), np.abs(missing))
    return float(max(x.max(initial=0.0) for x in (normal, excess, sliding)))
