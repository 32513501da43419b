"""The number of integration steps of a communication step, and why there are too many.

A motion that needs ``BURST_STEPS_MAX`` steps within ``EVENT_WINDOW_RTOL`` of the period, besides
those of the fastest mode, is rejected: its cost has no bound that a user expects.  Its cause is
named: a compliant stop whose damping is faster than the steps, or the kinetic energy.
"""

from dataclasses import dataclass, replace

from ..base.errors import SimulationError
from ..base.tolerances import (
    BURST_STEPS_MAX,
    EFFORT_MAX,
    EVENT_WINDOW_RTOL,
    FASTEST_STEPS_FACTOR,
)
from ..mechanics.kinetics import kinetic_energy
from .compliant import point_mobility
from .configuration import Configuration
from .front import Front
from .stability import FastestMode


@dataclass(frozen=True)
class Effort:
    """The integration steps of a communication step.

    Parameters
    ----------
    since : float
        Begin of the span of time in which steps are counted [s].
    steps : int
        Number of steps of the communication step.
    before : int
        Number of them before the span.
    """

    since: float
    steps: int = 0
    before: int = 0

    def counting(
        self,
        configuration: Configuration,
        front: Front,
        fastest: FastestMode,
        time: float,
        h: float,
    ) -> "Effort":
        """Return the effort with one more step of the size h [s] to the target time [s].

        Raises
        ------
        SimulationError
            If there are more than ``EFFORT_MAX`` in all, or too many in a span.
        """
        if self.steps >= EFFORT_MAX:
            raise SimulationError(
                f"t = {time:.12g} s is not reached in {EFFORT_MAX} integration steps, which "
                f"end at t = {front.time:.9g} s with steps of {h:.3g} s: "
                "make shorter communication steps, or check units and stiffnesses"
            )
        counted, span = self, EVENT_WINDOW_RTOL * configuration.scales.time
        if front.time - self.since > span:
            counted = Effort(front.time, self.steps, self.steps)
        here = counted.steps - counted.before
        if here >= BURST_STEPS_MAX:
            stable = fastest.longest_step(front.equations)
            if here >= BURST_STEPS_MAX + FASTEST_STEPS_FACTOR * span / stable:
                raise SimulationError(
                    f"{here} integration steps lead from t = {counted.since:.9g} s only to "
                    f"t = {front.time:.9g} s: {_cause(front, h)}"
                )
        return replace(counted, steps=counted.steps + 1)


def damping_rate(front: Front, stop: int) -> float:
    """Return the rate at which the damping of a pressed contact changes its speed [1/s]."""
    touching, law = front.contacts.touching[stop], front.equations.compliant.laws[stop]
    assert touching is not None
    depth = -float(front.gaps_and_rates()[0][stop])
    slope = law.damping * law.elastic_force(depth) / touching.reference_speed
    return slope * point_mobility(front, stop)


def _cause(front: Front, h: float) -> str:
    """Return why steps of the size h [s] are short, and what to do."""
    rates = {i: damping_rate(front, i) for i in front.contacts.pressed}
    stop = max(rates, key=lambda i: rates[i], default=None)
    if stop is not None and rates[stop] * h > 1.0:
        name = front.equations.system.mechanism.stops[stop].name
        depth = -float(front.gaps_and_rates()[0][stop])
        return (
            f"{name} is indented by {depth:.3g} m, and its damping acts within "
            f"{1.0 / rates[stop]:.3g} s: reduce the preload or the stiffness"
        )
    energy = kinetic_energy(front.at.M, front.v)
    return (
        f"the kinetic energy is {energy:.3g} J: reduce impulses, forces and speeds, check units, "
        "or make shorter communication steps"
    )
