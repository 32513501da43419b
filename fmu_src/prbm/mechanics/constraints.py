r"""Scalars s = Re(B E) + c of the position: values, rates, convective terms, projection.

Loop closures, gaps and displacements are all of this form (see :mod:`prbm.mechanics.assembly`).
What is seen from a body that moves itself, a gap to a wall on it, say, is

    s = Re(f (B E + z)) + c,    f = conj(E of that body),

and a row of :class:`Rows` like the others.

Sources
-------
.. [1] E. Eich, SIAM J. Numer. Anal. 30 (1993) 1467 (coordinate projection).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv, dgetrs

from ..base.errors import SimulationError
from .arrays import Complex, Real, Whole
from .kinetics import inertia
from .system import FIXED, System

Factors = tuple[Real, NDArray[np.int32]]

CLOSED = 1e-14  # of the size of the mechanism: a few roundings of its coordinates
BARELY_CLOSED = 1e-12  # of that size: accepted if the iteration can do no better
ITERATIONS = 20  # Gauss-Newton converges quadratically: three are usual, twenty are hopeless


def values(B: Complex, c: Real, e: Complex) -> Real:
    """Return s = Re(B E) + c [m], for rows B."""
    result: Real = (B @ e).real + c
    return result


def jacobian(B: Complex, e: Complex) -> Real:
    """Return ds/dq = -Im(B e) [m/rad], one row per row of B, which is spread over stretches."""
    return -(B * e).imag


def convective(B: Complex, e: Complex, w: Real | Complex) -> Real:
    """Return -(d/dt ds/dq) v = Re(B e w^2), the right side of (ds/dq) a = ... for s'' = 0."""
    result: Real = ((B * e) @ (w * w)).real
    return result


class Rows:
    """Scalars of a mechanism, some of them seen from a body that moves.

    Parameters
    ----------
    system : System
        The mechanism.
    B, c : (r, n) complex, (r,)
        s = Re(f (B E + z)) + c [m].
    z, on : (r,) complex, (r,) int, or None
        The fixed part of what is seen from a body, and its coordinate; :data:`FIXED` or None:
        f = 1, z = 0.
    """

    def __init__(
        self, system: System, B: Complex, c: Real, z: Complex | None = None, on: Whole | None = None
    ) -> None:
        self.system, self.B, self.c = system, B, c
        self.spread = system.spread(B)
        on = np.full(len(B), FIXED) if on is None else on
        self.carried: Whole = np.flatnonzero(on != FIXED)
        self.on: Whole = on[self.carried]
        self.z: Complex = np.zeros(0, complex) if z is None else z[self.carried]

    def __len__(self) -> int:
        return len(self.B)

    def first(self, r: int) -> "Rows":
        """Return the first r rows."""
        if r == len(self):
            return self
        on = np.full(len(self), FIXED)
        z = np.zeros(len(self), complex)
        on[self.carried], z[self.carried] = self.on, self.z
        return Rows(self.system, self.B[:r], self.c[:r], z[:r], on[:r])

    def values(self, e: Complex, c: Real | None = None) -> Real:
        """Return s [m]; e may be a stack (..., n), and c replace the constants."""
        x = e @ self.B.T
        if len(self.carried):
            x[..., self.carried] = self._seen(x, e)
        result: Real = x.real + (self.c if c is None else c)
        return result

    def _seen(self, x: Complex, e: Complex) -> Complex:
        """Return f (B E + z) of the carried rows."""
        result: Complex = e[..., self.on].conj() * (x[..., self.carried] + self.z)
        return result

    def jacobian(self, e: Complex) -> Real:
        """Return ds/dq [m/rad]."""
        result = jacobian(self.spread, e)
        if len(self.carried):
            f = e[self.on].conj()
            result[self.carried] = -(f[:, None] * self.spread[self.carried] * e).imag
            result[self.carried, self.on] += self._seen(self.B @ e, e).imag
        return result

    def rates(self, e: Complex, v: Real) -> Real:
        """Return s' [m/s]; e and v may be stacks (..., n)."""
        y: Complex = (e * self.system.turning(v)) @ self.B.T
        if len(self.carried):
            f = e[..., self.on].conj()
            turned = v[..., self.on] * self._seen(e @ self.B.T, e)
            y[..., self.carried] = f * y[..., self.carried] - turned
        return -y.imag

    def convective(self, e: Complex, v: Real) -> Real:
        """Return -(d/dt ds/dq) v, the right side of (ds/dq) a = ... for s'' = 0 [m/s^2]."""
        w = self.system.turning(v)
        result = convective(self.B, e, w)
        if len(self.carried):
            result[self.carried] = self.carried_convective(e, v, w)
        return result

    def carried_convective(self, e: Complex, v: Real, w: Real | Complex) -> Real:
        """Return the convective terms of the carried rows [m/s^2]."""
        f, turn = e[self.on].conj(), v[self.on]
        B = self.B[self.carried]
        bent = ((w - turn[:, None]) ** 2 * (B * e)).sum(axis=1) + turn**2 * self.z
        result: Real = (f * bent).real
        return result


def gap_rows(system: System) -> Rows:
    """Return the gaps of all stops, without the positions of their walls."""
    return Rows(system, system.gaps, system.gaps_c, system.gaps_z, system.on)


def slide_rows(system: System) -> Rows:
    """Return the displacements of all hit points along their walls, but for a constant."""
    return Rows(system, system.slides, np.zeros(len(system.slides)), system.slides_z, system.on)


def rub_rows(system: System) -> Rows:
    """Return the displacements of all friction points, but for a constant."""
    return Rows(system, system.rubs, np.zeros(len(system.rubs)))


@dataclass(frozen=True)
class Watched:
    """What is watched of a system in all of its discrete states: its gaps, slides and rubs."""

    gaps: Rows
    slides: Rows
    rubs: Rows

    @classmethod
    def of(cls, system: System) -> "Watched":
        """Return the rows of a system."""
        return cls(gap_rows(system), slide_rows(system), rub_rows(system))


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
        The constants of the rows now: walls move [m].

    Returns
    -------
    q : (n,)
        On the constraints, to :data:`CLOSED` times the length where rounding allows.
    e : (n,) complex
        Its directions.

    Raises
    ------
    SimulationError
        If the iteration does not converge.
    """
    n, J = len(q), np.diag(system.J)
    best = np.inf
    for _ in range(ITERATIONS):
        e = system.directions(q)
        s = rows.values(e, c)
        error = float(np.abs(s).max()) if len(s) else 0.0
        if error <= CLOSED * system.length or BARELY_CLOSED * system.length >= best <= error:
            return q, e
        best = min(best, error)
        G = rows.jacobian(e)
        right = np.zeros(n + len(c))
        right[n:] = -s
        q = q + solve(saddle(inertia(system.H, J, e)[0], G, G), right)[:n]
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
