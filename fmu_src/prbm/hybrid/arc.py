"""A step of the integration as a function of time."""

from dataclasses import dataclass

import numpy as np

from ..base.tolerances import GUARD_INTERVALS
from ..mechanics.arrays import Real
from .runge_kutta import TSITOURAS_PAPAKOSTAS, Rate, interpolate, powers, stages

FRACTIONS = np.linspace(0.0, 1.0, GUARD_INTERVALS + 1)
GRID = powers(TSITOURAS_PAPAKOSTAS, FRACTIONS)


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
        End of the step, or the time of the event that ends it [s].
    y : (2 n + 2,)
        State at the start.
    k : (stages, 2 n + 2)
        Rates of the stages.
    """

    start: float
    h: float
    end: float
    y: Real
    k: Real

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
        return Arc(self.start, h, t, self.y, k), y

    def samples(self) -> tuple[Real, Real]:
        """Return the times at which guards are evaluated, and the states there.

        Returns
        -------
        times : (w + 1,)
            Ends of w intervals [s].
        states : (w + 1, 2 n + 2)
            States at these times, not projected.
        """
        return self.start + self.h * FRACTIONS, self.y + self.h * (GRID @ self.k)
