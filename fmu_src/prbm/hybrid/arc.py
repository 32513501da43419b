"""A step of the integration as a function of time.

There are two interpolations.  Events use the cheap dense output of the pair.  Outputs and restarts
need the accuracy of the method, which the polynomial of degree eight through positions, rates and
accelerations at three times has: at both ends of the step, and at the start of the previous step.
If the motion is not smooth there, a step to half the time computes the third state.
"""

from dataclasses import dataclass

import numpy as np

from ..base.tolerances import GUARD_INTERVALS, NODE_RATIO_MIN
from ..mechanics.arrays import Real
from .runge_kutta import (
    TSITOURAS_PAPAKOSTAS,
    Rate,
    hermite_weights,
    interpolate,
    powers,
    stages,
)

FRACTIONS = np.linspace(0.0, 1.0, GUARD_INTERVALS + 1)
GRID = powers(TSITOURAS_PAPAKOSTAS, FRACTIONS)


@dataclass(frozen=True)
class Node:
    """A state of the motion through which an interpolation passes.

    Parameters
    ----------
    time : float
        Time [s].
    y : (2 n + 2 + 4 c,)
        State.
    rates : (2 n + 2 + 4 c,)
        Rates of the state.
    """

    time: float
    y: Real
    rates: Real


@dataclass(frozen=True)
class Arc:
    """The dense output of a step, y(t) for start <= t <= end.

    Parameters
    ----------
    start : float
        Time at the start of the step [s].
    h : float
        Size of the whole step [s].
    end : float
        End of the step, or the time of the event that ends it, which may be slightly later [s].
    y : (2 n + 2 + 4 c,)
        State at the start.
    k : (stages, 2 n + 2 + 4 c)
        Rates of the stages.
    n : int
        Number of coordinates.
    before : Node or None
        The start of the previous step, if the motion is smooth from there.
    """

    start: float
    h: float
    end: float
    y: Real
    k: Real
    n: int
    before: Node | None = None

    def start_before(self, h: float) -> Node | None:
        """Return the start of this step for the next step of size h [s], unless it is too near."""
        return Node(self.start, self.y, self.k[0]) if self.h >= NODE_RATIO_MIN * h else None

    @property
    def embedded_error(self) -> Real:
        """Difference of the solution of lower order at the end of the step, (2 n + 2 + 4 c,)."""
        result: Real = self.h * (TSITOURAS_PAPAKOSTAS.error @ self.k)
        return result

    def middle(self, rate: Rate) -> Node:
        """Return the state at half the time of the step, by a step of that size."""
        half, y = self.cut(rate, self.start + 0.5 * self.h)
        return Node(half.end, y, half.k[-1])

    def through(self, third: Node, t: float) -> Real:
        """Return the state at time t by the polynomial through a third node, not projected.

        The energies are those of :meth:`at`.
        """
        y, n = self.at(t), self.n
        end = self.y + self.h * (TSITOURAS_PAPAKOSTAS.weights @ self.k)
        nodes = (Node(self.start, self.y, self.k[0]), Node(self.start + self.h, end, self.k[-1]))
        data = np.array([[x.y[:n], x.y[n : 2 * n], x.rates[n : 2 * n]] for x in (*nodes, third)])
        value, rate = hermite_weights(
            [x.time - self.start for x in (*nodes, third)], t - self.start
        )
        y[:n] = np.tensordot(value, data, 2)
        y[n : 2 * n] = np.tensordot(rate, data, 2)
        return y

    def at(self, t: float) -> Real:
        """Return the state at time t, not projected."""
        return interpolate(TSITOURAS_PAPAKOSTAS, self.y, self.k, self.h, (t - self.start) / self.h)

    def cut(self, rate: Rate, t: float) -> tuple["Arc", Real]:
        """Return the step from the same start to time t, and the state at its end.

        The state is not projected.  Its order of accuracy is that of the method, which is higher
        than that of the dense output.

        Parameters
        ----------
        rate : callable
            Right-hand side of the equations.
        t : float
            A time after the start [s].
        """
        h = t - self.start
        k, y = stages(TSITOURAS_PAPAKOSTAS, rate, self.start, self.y, h, self.k[0])
        return Arc(self.start, h, t, self.y, k, self.n, self.before), y

    def samples(self) -> tuple[Real, Real]:
        """Return the times at which guards are evaluated, and the states there.

        Returns
        -------
        times : (w + 1,)
            Ends of w intervals [s].
        states : (w + 1, 2 n + 2 + 4 c)
            States at these times, not projected.
        """
        return self.start + self.h * FRACTIONS, self.y + self.h * (GRID @ self.k)
