r"""Moving walls: each joins the line that its inputs define along a cubic.

At a communication point t0 the inputs define the reference

    r(t) = position + displacement + v (t - t0),

v being ``stop.velocity`` once that input has been non-zero, else the difference quotient of the
displacement.  From its position and velocity there the wall joins the reference within T = 2 H
(:class:`prbm.mechanics.inputs.Wall`), H the recent longest communication step, but at most a tenth
of the period.  So position and velocity are continuous, and the acceleration is finite.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

from ..base.tolerances import (
    EVENT_TIME_ATOL,
    WALL_FADING_FACTOR,
    WALL_LONGEST_RTOL,
    WALL_PATH_RTOL,
    WALL_STEP_RTOL,
)
from ..mechanics.inputs import Wall
from ..mechanism.parts import value
from .configuration import Configuration
from .front import Front


@dataclass(frozen=True)
class Sample:
    """The inputs of a wall at the last communication point.

    Parameters
    ----------
    displacement : float
        [m].
    driven : bool
        Whether ``stop.velocity`` has ever been non-zero: then nothing is differenced.
    """

    displacement: float
    driven: bool


@dataclass(frozen=True)
class Course:
    """What the walls remember of earlier communication points.

    Parameters
    ----------
    point : float
        The last communication point [s].
    longest : float
        The recent longest communication step [s].
    samples : (s,) tuple of Sample
        Of the walls.
    """

    point: float
    longest: float
    samples: tuple[Sample, ...]


def start(
    configuration: Configuration, given: Mapping[str, float], time: float
) -> tuple[Course, tuple[Wall, ...]]:
    """Return the walls at the start: on their references, with the velocities of these [s]."""
    walls, samples = [], []
    for stop in configuration.mechanism.stops:
        displacement, velocity = given[f"{stop.name}.displacement"], given[f"{stop.name}.velocity"]
        drawn = value(stop, "position", configuration.values)
        walls.append(Wall(drawn + displacement, velocity, time))
        samples.append(Sample(displacement, velocity != 0.0))
    return Course(time, 0.0, tuple(samples)), tuple(walls)


def join(
    configuration: Configuration,
    given: Mapping[str, float],
    course: Course,
    walls: tuple[Wall, ...],
    now: float,
    time: float,
) -> tuple[Course, tuple[Wall, ...]]:
    """Return the walls from a communication point on.

    A reference that equals the one before changes nothing.  Before any step the velocity of a
    wall is that of its reference.

    Parameters
    ----------
    configuration : Configuration
        With the present values of the parameters.
    given : mapping
        Values of all inputs.
    course : Course
        Of the communication points before.
    walls : (s,) tuple of Wall
        Their motions up to now.
    now, time : float
        This communication point and the next [s].
    """
    last, following = now - course.point, time - now
    longest = max(last or following, course.longest - WALL_FADING_FACTOR * last)
    longest = min(longest, WALL_LONGEST_RTOL * configuration.scales.time)
    round_off = WALL_PATH_RTOL * configuration.system.length
    joined, samples = list(walls), []
    for i, (stop, wall, old) in enumerate(
        zip(configuration.mechanism.stops, walls, course.samples, strict=True)
    ):
        displacement, velocity = given[f"{stop.name}.displacement"], given[f"{stop.name}.velocity"]
        sample = Sample(displacement, old.driven or velocity != 0.0)
        if not sample.driven:
            change = displacement - old.displacement
            velocity = _difference_quotient(wall.rate, change, last, longest, following)
        samples.append(sample)
        here, span = value(stop, "position", configuration.values) + displacement, 2.0 * longest
        off = abs(here - wall.reference(now)) + abs(velocity - wall.rate) * span
        if off > round_off:
            x, rate, _ = (float(part) for part in wall.motion(now))
            excess = rate - velocity if last > 0.0 else 0.0
            joined[i] = Wall(here, velocity, now, x - here, excess, span)
    return Course(now, longest, tuple(samples)), tuple(joined)


def _difference_quotient(
    velocity: float, change: float, last: float, longest: float, following: float
) -> float:
    """Return the velocity of a displacement that has changed in the last step [m/s].

    It is the mean over the recent longest step.  In a step that is longer than that the reference
    goes less far than the displacement did, so that a jump is not extrapolated.

    Examples
    --------
    >>> _difference_quotient(0.0, 1e-6, last=1e-3, longest=1e-3, following=1e-3)
    0.001
    >>> _difference_quotient(0.0, 1e-6, last=1e-3, longest=1e-3, following=2e-3)
    0.00025
    """
    share = min(last / longest, 1.0)
    if share > 0.0:
        velocity += share * (change / last - velocity)
    return velocity * min(1.0, max(longest, last) / following) ** 2


def step_limit(walls: Sequence[Wall], t: float) -> float:
    """Return the longest step from time t [s]: a fraction of a cubic, and none beyond its end."""
    limit = inf
    for wall in walls:
        if wall.span:
            limit = min(limit, WALL_STEP_RTOL * wall.span, wall.end - t)
    return limit


def arrived(front: Front) -> Front:
    """Return the front with the references of the walls whose cubics end there."""
    walls = tuple(
        wall.arrived() if wall.span and wall.end - front.time <= EVENT_TIME_ATOL else wall
        for wall in front.inputs.walls
    )
    return front if walls == front.inputs.walls else front.with_walls(walls)
