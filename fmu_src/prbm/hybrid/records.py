"""The record of an impact."""

from dataclasses import dataclass

from ..mechanics.arrays import Real
from .front import Latched


@dataclass(frozen=True, repr=False)
class Impact:
    """An impact in a record.

    Parameters
    ----------
    stop : str
        Name of the stop.
    time : float
        Time of the impact, or of the first touch of a compliant stop [s].
    q : (n,)
        Angles [rad].
    before, after : (n,)
        Rates before and after the impact [rad/s].
    impulse : float
        Normal impulse, > 0 pushes [N s].
    latched : Latched
        The outputs of the stop after the impact.
    """

    stop: str
    time: float
    q: Real
    before: Real
    after: Real
    impulse: float
    latched: Latched

    def __repr__(self) -> str:
        closing, opening = self.latched.approach_speed, self.latched.rebound_speed
        return f"<Impact on {self.stop} at {self.time:.6g} s: {closing:.4g} to {opening:.4g} m/s>"
