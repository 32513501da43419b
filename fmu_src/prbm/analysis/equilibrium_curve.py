r"""The curve of the equilibria under loads w(s) = w_0 + s w_1, with its points and their stability.

Unknowns are the coordinates q, the multipliers of the loops and the share s.  A point is corrected
by Newton's method in the plane across a tangent, or at a displacement of the released body.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..base.errors import SimulationError
from ..base.tolerances import STATICS_CONSTRAINT_RTOL
from ..mechanics import constraints
from ..mechanics.arrays import Complex, Real
from ..mechanics.elements import Elements
from ..mechanics.modal import modes, moved_by, unstable_directions
from ..mechanics.statics import Equilibrium, balance_matrix, load_row, pin_idle
from ..mechanics.system import System

NEWTON_MAX = 8  # Iterations of a correction.
CORRECTION_ATOL = 1e-10  # rad: last correction of a point.
RATE_RTOL = 1e-9  # Of the largest change of the displacement: smaller ones are round-off.


@dataclass(frozen=True, eq=False)
class PathPoint:
    """An equilibrium on the path.

    Parameters
    ----------
    share : float
        Share s of the change of the loads [-].
    shape : Equilibrium
        The shape.
    unstable : int
        Number of unstable directions under dead loads, without critical ones.
    held : int
        The same with the released body held at its displacement.
    tangent : (n + r + 1,)
        Derivatives of coordinates, multipliers and share by the length of the path.
    frequency : (k,)
        Frequencies of the modes under dead loads [Hz]; negative if unstable.
    critical : int
        Number of directions that become unstable or stable here: their stiffness is zero, and the
        sign of it round-off.
    """

    share: float
    shape: Equilibrium
    unstable: int
    held: int
    tangent: Real
    frequency: Real
    critical: int = 0


@dataclass(frozen=True)
class LoadPath:
    """Equilibria under loads that vary.

    Parameters
    ----------
    points : tuple of PathPoint
        Points in the order of the path, limit points and bifurcations included.
    events : tuple of (str, PathPoint)
        ``"limit point"``, ``"bifurcation"``, ``"rest"``, where the first loads act again, or
        ``"displacement limit"``, where the displacement turns back, with its place.
    ended : str or None
        Why the path ends before the last load; None: it does not.
    branches : tuple of LoadPath
        The branches at the bifurcations, from there on, if they have been followed.
    """

    points: tuple[PathPoint, ...]
    events: tuple[tuple[str, PathPoint], ...]
    ended: str | None
    branches: tuple["LoadPath", ...] = ()


class EquilibriumCurve:
    """The equations of the shapes at the loads w(s)."""

    def __init__(
        self, system: System, loads: tuple[Complex, Complex], moments: tuple[Real, Real]
    ) -> None:
        self.system, self.loads, self.moments = system, loads, moments

    @classmethod
    def between(
        cls, system: System, first: Mapping[str, float], last: Mapping[str, float]
    ) -> "EquilibriumCurve":
        """Return the curve whose loads change from the first to the last ones."""
        w, moment = load_row(system, first)
        w_last, moment_last = load_row(system, last)
        return cls(system, (w, w_last - w), (moment, moment_last - moment))

    @classmethod
    def held(cls, system: System, unit: float) -> "EquilibriumCurve":
        """Return the curve whose share is the holding force over a unit [N], [N m]."""
        w, moment = load_row(system, {})
        change, turning = np.zeros_like(w), np.zeros_like(moment)  # Of one unit.
        if system.mechanism.release.turns:
            turning[system.released.j] = unit
        else:
            change = system.repeat_columns(1j * unit * system.release)
        return cls(system, (w, change), (moment, turning))

    def shape(self, state: Real) -> Equilibrium:
        """Return the shape of a state (n + r + 1,), with its loads."""
        n = self.system.n
        return Equilibrium(state[:n], state[n:-1], 0.0, self.loads[0] + state[-1] * self.loads[1])

    def equations(self, state: Real) -> tuple[Real, Real, Real]:
        """Return the matrix of small changes, the column of the share, and the residual.

        The residual has the torques [N m] and the negative open distances of the loops [m].
        """
        system, shape = self.system, self.shape(state)
        n, e = system.n, system.directions(shape.q)
        kkt = balance_matrix(system, shape, held=False)
        pin_idle(system, kkt)
        loads, by_share = (
            system.Phi.to_coordinates((w * e).real) + moment
            for w, moment in (
                (shape.load, self.moments[0] + state[-1] * self.moments[1]),
                (self.loads[1], self.moments[1]),
            )
        )
        torque = Elements(system).force(shape.q, e) + loads + shape.lam @ kkt[n:, :n]
        open_by = system.loop_rows.values(e)
        column = np.concatenate([-by_share, np.zeros(len(open_by))])
        return kkt, column, np.concatenate([torque, -open_by])

    def solve(self, kkt: Real, column: Real, normal: Real, right: Real) -> Real:
        """Solve the linear equations for changes of a state, whose last row is ``normal``."""
        n = self.system.n
        x = constraints.solve_bordered(kkt, column, normal, right, n, self.system.length)
        x[n:-1] *= -1.0
        return x

    def amount_row(self, state: Real) -> Real:
        """Return the derivative of the displacement or rotation of the released body."""
        system, q = self.system, state[: self.system.n]
        row = np.zeros(len(state))
        if system.mechanism.release.turns:
            row[system.released.j] = 1.0
        else:
            row[: system.n] = system.gradient(system.release, system.directions(q))
        return row

    def amount(self, point: PathPoint) -> float:
        """Return the displacement [m] or rotation [rad] of the released body."""
        return self.system.amount(point.shape.q)

    def correct(
        self, guess: Real, normal: Real | None = None, amount: float = 0.0
    ) -> tuple[Real, Real] | None:
        """Return the equilibrium in the plane through a guess, and a tangent of the path there.

        Without a normal of the plane it is the one with an amount of displacement.  None: there is
        no convergence.
        """
        state, size, n = guess.copy(), math.inf, self.system.n
        for _ in range(NEWTON_MAX):
            kkt, column, residual = self.equations(state)
            if normal is None:
                row, apart = self.amount_row(state), amount - self.system.amount(state[:n])
            else:
                row, apart = normal, float(normal @ (guess - state))
            right = np.zeros((len(state), 2))
            right[:-1, 0], right[-1] = residual, (apart, 1.0)
            try:
                change, tangent = self.solve(kkt, column, row, right).T
            except SimulationError:
                return None
            last, size = size, float(np.abs(change[:n]).max())
            if not size < max(2.0 * last, CORRECTION_ATOL):
                return None
            state = state + change
            if size <= CORRECTION_ATOL and self.closed(state):
                return state, tangent
        return None

    def closed(self, state: Real) -> bool:
        """Return whether the loops of a state are closed."""
        open_by = self.system.loop_rows.values(self.system.directions(state[: self.system.n]))
        limit = 10.0 * STATICS_CONSTRAINT_RTOL * self.system.length
        return float(np.abs(open_by).max(initial=0.0)) <= limit

    def point(self, state: Real, tangent: Real) -> PathPoint:
        """Return a point with a tangent of any length."""
        t = tangent / math.sqrt(float(self.weighted(tangent) @ tangent))
        shape = self.shape(state)
        found = modes(self.system, shape)
        along, f = moved_by(self.system, shape.q, found.shape), found.frequency
        counts = unstable_directions(f), unstable_directions(f, along)
        return PathPoint(float(state[-1]), shape, *counts, t, f)

    def first(self, state: Real, along: Real) -> PathPoint:
        """Return the point of an equilibrium, with the tangent in the sense of another vector.

        Raises
        ------
        SimulationError
            If the equations, with the vector as the last row, are singular.
        """
        kkt, column, residual = self.equations(state)
        right = np.append(np.zeros_like(residual), 1.0)
        return self.point(state, self.solve(kkt, column, self.weighted(along), right))

    def weighted(self, t: Real) -> Real:
        """Return the row of the scalar product with a tangent: multipliers have no weight."""
        result = t.copy()
        result[self.system.n : -1] = 0.0
        return result

    def step(self, start: PathPoint, length: float) -> PathPoint | None:
        """Return the point at a length along the tangent of another one."""
        guess = state_of(start) + length * start.tangent
        found = self.correct(guess, self.weighted(start.tangent))
        return None if found is None else self.point(*found)


def state_of(point: PathPoint) -> Real:
    """Return coordinates, multipliers and share of a point, (n + r + 1,)."""
    return np.concatenate([point.shape.q, point.shape.lam, [point.share]])
