"""The default experiment of a mechanism: its duration and communication step."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..hybrid.simulation import Simulation
from ..mechanism.description import Mechanism

MOST_PERIODS = 1000.0  # of the time scale of a mechanism in the default experiment of one second
PERIODS = 10.0  # in that of a mechanism that is slower than one, or faster than the other
POINTS = 1000  # communication steps of the default experiment


@dataclass(frozen=True)
class Experiment:
    """How long a mechanism is simulated unless one says otherwise.

    Parameters
    ----------
    stop_time : float
        Duration [s].
    """

    stop_time: float = 1.0

    @property
    def step(self) -> float:
        """Distance of the communication points [s]."""
        return float(f"{self.stop_time / POINTS:.12g}")


def experiment(mechanism: Mechanism, values: Mapping[str, float] | None = None) -> Experiment:
    """Return the default experiment of a mechanism: a second, if that shows its motion.

    A second of what has less than one period in it, or more than a thousand, would show too little
    of the motion, or nothing but vibrations: there it is about ten periods, 1, 2 or 5 times a
    power of ten.

    Parameters
    ----------
    mechanism, values
        As :func:`simulate` has them.

    Raises
    ------
    ParameterError, EquilibriumError
        If it cannot start with these values.
    """
    _, rate, _ = Simulation(mechanism, values).magnitudes()
    return Experiment(_span(rate / (2 * math.pi)))


def _span(frequency: float) -> float:
    """Return the duration of the default experiment at a frequency [Hz], [s].

    Examples
    --------
    >>> _span(4.9), _span(0.9), _span(9.2e4)
    (1.0, 10.0, 0.0001)
    """
    if 1.0 <= frequency <= MOST_PERIODS:
        return 1.0
    wanted = math.log10(PERIODS / frequency)
    exponents = range(math.floor(wanted), math.floor(wanted) + 2)
    round_ones = [float(f"{digit}e{k}") for k in exponents for digit in (1, 2, 5)]
    return min(round_ones, key=lambda span: abs(math.log10(span) - wanted))
