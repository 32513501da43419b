"""The fastest mode, whose rate limits the steps of an explicit method.

A step is stable if its size times the rate of the fastest mode is below 4.4, with any damping of
that mode.  In longer steps round-off grows until the error of the step reaches the tolerance.
The mode is computed with the elements, the mass matrix and the active constraints; the stiffness
from loads, and negative ones, are neglected.  Dampers add the sum of the rates at which each alone
would stop a motion, which is at least the largest rate of all together.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..base.errors import SimulationError
from ..base.tolerances import (
    DEFAULT_EFFORT_MAX,
    FASTEST_ITERATIONS_MAX,
    FASTEST_RATE_RTOL,
    STABLE_STEP_FACTOR,
)
from ..mechanics.arrays import Real
from ..mechanics.constraints import solve_saddle
from ..mechanics.dynamics import Equations, Evaluation


@dataclass(frozen=True)
class FastestMode:
    """An approximation of the mode with the highest frequency.

    Parameters
    ----------
    direction : (n,)
        Changes of the coordinates; the largest magnitude is 1 after an iteration.
    rate : float
        Angular frequency, from below [rad/s]; 0: not known, or there are no springs.
    decay : float
        Rate of the dampers, from above [1/s].
    """

    direction: Real
    rate: float = 0.0
    decay: float = 0.0

    @classmethod
    def at(cls, equations: Equations, t: float, y: Real) -> "FastestMode":
        """Return the fastest mode at a state (2 n + 2,), from an arbitrary direction.

        Raises
        ------
        SimulationError
            If the equations are singular.
        """
        n = equations.n
        evaluation = equations.at(t, y)
        mode = cls(1.0 / np.arange(1.0, n + 1.0))
        for _ in range(FASTEST_ITERATIONS_MAX):
            last, mode = mode.rate, mode.refined(equations, evaluation)
            if not abs(mode.rate - last) > FASTEST_RATE_RTOL * max(mode.rate, last):
                break
        return mode

    def refined(self, equations: Equations, evaluation: Evaluation) -> "FastestMode":
        """Return the mode after one power iteration with the factors of an evaluation.

        The direction w becomes the accelerations by the torques K w, of which the rate is the
        Rayleigh quotient.
        """
        n, elements, factors = equations.n, equations.elements, evaluation.factors
        torques = elements.stiffness(evaluation.e) @ self.direction
        right = np.zeros(len(factors[0]))
        right[:n] = torques
        x = solve_saddle(factors, right)[:n]
        energy, response = float(self.direction @ torques), float(x @ torques)
        rate = math.sqrt(response / energy) if energy > 0.0 and response > 0.0 else 0.0
        longest = float(np.abs(x).max())
        decay, C = 0.0, elements.viscous(evaluation.e)
        if C is not None:
            stopped = solve_saddle(factors, np.vstack([C, np.zeros((len(right) - n, n))]))
            decay = max(float(np.trace(stopped[:n])), 0.0)
        return FastestMode(x / longest if longest > 0.0 else self.direction, rate, decay)

    def longest_step(self, equations: Equations) -> float:
        """Return the longest stable step [s]; infinite without springs.

        The bound is ``STABLE_STEP_FACTOR`` over the magnitude of the larger root of
        s^2 + (beta omega^2 + 2 zeta omega_1 + decay) s + omega^2 = 0.
        """
        rate = self.rate
        damping = equations.beta * (rate * rate) + equations.mass_damping + self.decay
        if damping > 2.0 * rate:
            rate = 0.5 * (damping + math.sqrt(damping * damping - 4.0 * (rate * rate)))
        return STABLE_STEP_FACTOR / rate if rate > 0.0 else math.inf

    def check_effort(self, equations: Equations, step: float) -> None:
        """Reject a communication step of the default experiment that needs too many steps.

        Parameters
        ----------
        equations : Equations
            The equations of motion.
        step : float
            Communication step [s]; 0: not known.

        Raises
        ------
        SimulationError
            If it is longer than ``DEFAULT_EFFORT_MAX`` stable steps.
        """
        needed = step / self.longest_step(equations)
        if needed > DEFAULT_EFFORT_MAX:
            raise SimulationError(
                f"the fastest mode has {self.rate / (2.0 * math.pi):.4g} Hz: a communication step "
                f"of {step:g} s would need {needed:.4g} integration steps, more than "
                f"{DEFAULT_EFFORT_MAX:g}; check the units of lengths, stiffnesses, masses and "
                "damping.beta"
            )
