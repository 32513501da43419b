"""Walls in motion: the inputs of the stops as uniform motions up to the next communication point.

A wall that is off its target arrives there within the communication step.  A wall whose velocity
is an input does not hurry in a step that is shorter than one before: it takes as long as that
step, or moves by the change of its velocity, or by half of ``rest_speed``.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ..base.tolerances import WALL_PATH_RTOL
from ..mechanics.inputs import Wall
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from .configuration import Configuration


@dataclass(frozen=True)
class WallSchedule:
    """The times and velocities of the last communication step.

    Parameters
    ----------
    planned : float
        Communication point at which the walls were last set in motion [s].
    due : float
        Time at which they arrive at their targets [s].
    velocities : (s,) tuple of float
        The inputs ``stop.velocity`` then [m/s].
    driven : (s,) tuple of bool
        Whether this input of a wall has ever been non-zero.
    """

    planned: float
    due: float
    velocities: tuple[float, ...]
    driven: tuple[bool, ...]

    @classmethod
    def starting(cls, time: float, velocities: tuple[float, ...]) -> "WallSchedule":
        """Return the schedule at the start [s]."""
        return cls(time, time, velocities, (False,) * len(velocities))


def targets(
    mechanism: Mechanism, values: Mapping[str, float], given: Mapping[str, float]
) -> tuple[float, ...]:
    """Return the positions of the walls that parameters and inputs ask for [m]."""
    return tuple(
        value(stop, "position", values) + given[f"{stop.name}.displacement"]
        for stop in mechanism.stops
    )


def velocities(mechanism: Mechanism, given: Mapping[str, float]) -> tuple[float, ...]:
    """Return the inputs ``stop.velocity`` [m/s]."""
    return tuple(given[f"{stop.name}.velocity"] for stop in mechanism.stops)


def move(
    configuration: Configuration,
    given: Mapping[str, float],
    schedule: WallSchedule,
    walls: tuple[Wall, ...],
    now: float,
    time: float,
) -> tuple[WallSchedule, tuple[Wall, ...]]:
    """Return the schedule and the motions of the walls from now to a later time.

    Parameters
    ----------
    configuration : Configuration
        With the present values of the parameters.
    given : mapping
        Values of all inputs.
    schedule : WallSchedule
        Of the step before.
    walls : (s,) tuple of Wall
        Their motions up to now.
    now, time : float
        Communication points [s].
    """
    mechanism, span = configuration.mechanism, time - now
    due = max(schedule.due, 2 * now - schedule.planned)
    goals, rates = targets(mechanism, configuration.values, given), velocities(mechanism, given)
    moved = list(walls)
    for i, (wall, velocity) in enumerate(zip(walls, rates, strict=True)):
        here = wall.at(now)
        off = goals[i] - here
        correction = off / span
        if (velocity or schedule.driven[i]) and due > time:
            fastest = max(
                abs(off) / (due - now),
                abs(velocity - schedule.velocities[i]),
                0.5 * configuration.stop_value(i, "rest_speed"),
            )
            correction = min(max(correction, -fastest), fastest)
        change = wall.at(time) - here - (velocity + correction) * span
        if abs(change) > WALL_PATH_RTOL * configuration.system.length:
            moved[i] = Wall(here, velocity + correction, now)
    driven = tuple(
        before or velocity != 0.0 for before, velocity in zip(schedule.driven, rates, strict=True)
    )
    return WallSchedule(now, due, rates, driven), tuple(moved)
