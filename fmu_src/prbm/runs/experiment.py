"""The default experiment of a mechanism: its duration and communication step."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..mechanism.description import Mechanism
from .engine import Engine, simulation

PERIODS_MAX = 25.0  # Largest number of fundamental periods in one second: 40 steps in each.
PERIODS = 10.0  # Approximate number of periods if one second has fewer than one or too many.
STEPS = 1000  # Communication steps of the default experiment.


@dataclass(frozen=True)
class Experiment:
    """Duration and communication step of a simulation.

    Parameters
    ----------
    stop_time : float
        Duration [s].
    """

    stop_time: float = 1.0

    @property
    def step(self) -> float:
        """Communication step [s]."""
        return float(f"{self.stop_time / STEPS:.12g}")


def experiment(
    mechanism: Mechanism,
    values: Mapping[str, float] | None = None,
    engine: str | None = None,
) -> Experiment:
    """Return the default experiment of a mechanism.

    Its duration is one second if that is between 1 and 25 periods of the fundamental mode.
    Otherwise it is about ten periods, rounded to 1, 2 or 5 times a power of ten.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping or None
        Parameters and inputs that differ from their defaults.
    engine : str or None
        As for :func:`prbm.runs.engine.simulation`.

    Raises
    ------
    ParameterError, EquilibriumError
        If the mechanism cannot start with these values.
    """
    return experiment_of(simulation(mechanism, values, engine=engine))


def experiment_of(motion: Engine) -> Experiment:
    """Return the default experiment for the parameters of a simulation at its start."""
    return Experiment(_duration(1 / motion.configuration.scales.time))


def _duration(frequency: float) -> float:
    """Return the duration of the default experiment [s] at a fundamental frequency [Hz].

    Examples
    --------
    >>> _duration(4.9), _duration(0.9), _duration(9.2e4)
    (1.0, 10.0, 0.0001)
    """
    if 1.0 <= frequency <= PERIODS_MAX:
        return 1.0
    wanted = math.log10(PERIODS / frequency)
    exponents = range(math.floor(wanted), math.floor(wanted) + 2)
    round_numbers = [float(f"{digit}e{k}") for k in exponents for digit in (1, 2, 5)]
    return min(round_numbers, key=lambda x: abs(math.log10(x) - wanted))
