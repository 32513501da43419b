r"""Moving walls: each joins the line that its inputs define along a cubic.

At a communication point t0 the inputs define the reference

    r(t) = position + displacement + v (t - t0),

where v is the input ``stop.velocity``.  Until this input has been non-zero, v is the mean rate of
the displacement.  From its position and velocity at t0, the wall joins the reference within T = 2 H
(:class:`prbm.mechanics.inputs.Wall`): both are continuous, and the acceleration is finite.  H is
the recent longest communication step, but at most a tenth of the period.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

from ..base.tolerances import (
    EVENT_TIME_ATOL,
    WALL_FADING_FACTOR,
    WALL_LONGEST_RTOL,
    WALL_PATH_RTOL,
    WALL_STEP_RTOL,
)
from ..mechanics.arrays import Real
from ..mechanics.inputs import Wall
from ..mechanism.parts import value
from .configuration import Configuration
from .front import Front


@dataclass(frozen=True)
class Course:
    """The past communication steps, as far as the walls depend on them.

    Parameters
    ----------
    point : float
        The last communication point [s].
    longest : float
        The recent longest communication step, at most a tenth of the period [s].
    driven : (s,) tuple of bool
        Whether ``stop.velocity`` has ever been non-zero: then it is the velocity of the reference.
    """

    point: float
    longest: float
    driven: tuple[bool, ...]


def start(
    configuration: Configuration, given: Mapping[str, float], time: float
) -> tuple[Course, tuple[Wall, ...]]:
    """Return the walls at a start time [s]: each has position and velocity of its reference."""
    walls = tuple(
        _given_reference(configuration, given, i, time)
        for i in range(len(configuration.mechanism.stops))
    )
    return Course(time, 0.0, tuple(wall.rate != 0.0 for wall in walls)), walls


def _given_reference(
    configuration: Configuration, given: Mapping[str, float], stop: int, time: float
) -> Wall:
    """Return the reference that the inputs of a stop define at a time [s]."""
    name = configuration.mechanism.stops[stop].name
    position = _position(configuration, stop) + given[f"{name}.displacement"]
    return Wall(position, given[f"{name}.velocity"], time)


def _position(configuration: Configuration, stop: int) -> float:
    """Return ``stop.position`` [m]."""
    return value(configuration.mechanism.stops[stop], "position", configuration.values)


def join(
    acting: Configuration,
    configuration: Configuration,
    given: Mapping[str, float],
    course: Course,
    walls: tuple[Wall, ...],
    now: float,
    time: float,
) -> tuple[Course, tuple[Wall, ...]]:
    """Return the walls from a communication point on.

    A wall whose reference has not changed moves on as before.  Before the first step, the velocity
    of a wall is that of its reference.

    Parameters
    ----------
    acting, configuration : Configuration
        Configurations with the parameter values up to now, and from now on.
    given : mapping
        Values of all inputs.
    course : Course
        Past communication steps.
    walls : (s,) tuple of Wall
        Motions of the walls up to now.
    now, time : float
        This communication point and the next [s].
    """
    last, following = now - course.point, time - now
    recent = max(last or following, course.longest - WALL_FADING_FACTOR * last)
    longest = min(recent, WALL_LONGEST_RTOL * configuration.scales.time)
    span, round_off = 2.0 * longest, WALL_PATH_RTOL * configuration.system.length
    joined, driven = list(walls), list(course.driven)
    for i, wall in enumerate(walls):
        line = _given_reference(configuration, given, i, now)
        off = line.position - wall.reference(now)
        driven[i] = driven[i] or line.rate != 0.0
        if not driven[i]:
            moved = off - (_position(configuration, i) - _position(acting, i)) if last else 0.0
            line = replace(line, rate=_mean_rate(wall.rate, moved, recent, following))
        if abs(off) + abs(line.rate - wall.rate) * span > round_off:
            velocity = float(wall.motion(now)[1]) if last else line.rate
            joined[i] = wall.joining(line, velocity, span)
    return Course(now, longest, tuple(driven)), tuple(joined)


def keeping_gaps(
    acting: Configuration,
    configuration: Configuration,
    course: Course,
    walls: tuple[Wall, ...],
    now: float,
    y: Real,
) -> tuple[Wall, ...]:
    """Return walls that have moved with the hit points after a change of ``stop.offset``.

    The gaps and their rates do not jump.  Each wall then joins its reference along a cubic.

    Parameters
    ----------
    acting, configuration : Configuration
        Configurations with the parameter values up to now, and from now on.
    course : Course
        Past communication steps.
    walls : (s,) tuple of Wall
        Motions of the walls.
    now : float
        The present time [s].
    y : (2 n + 2,)
        The present state.
    """
    n, system = configuration.system.n, configuration.system
    e, v = system.directions(y[:n]), y[n : 2 * n]
    old, new = acting.system.gap_rows, system.gap_rows
    jumps = new.values(e) - old.values(e)
    turns = new.rates(e, v) - old.rates(e, v)
    span = 2.0 * (course.longest or WALL_LONGEST_RTOL * configuration.scales.time)
    kept = list(walls)
    for i, (wall, jump, turn) in enumerate(zip(walls, jumps, turns, strict=True)):
        if abs(jump) + abs(turn) * span > WALL_PATH_RTOL * system.length:
            x, velocity, _ = wall.motion(now)
            line = wall.reference(now)
            offset, excess = float(x - jump) - line, float(velocity - turn) - wall.rate
            kept[i] = Wall(line, wall.rate, now, offset, excess, span)
    return tuple(kept)


def _mean_rate(rate: float, off: float, longest: float, following: float) -> float:
    """Return the velocity of a new reference, which starts ``off`` ahead of the old one [m/s].

    It is the mean rate of the displacement over the recent longest step.  It is reduced if the
    following step is longer, so that a jump is not extrapolated beyond its own size.

    Examples
    --------
    >>> _mean_rate(0.0, 1e-6, longest=1e-3, following=1e-3)
    0.001
    >>> _mean_rate(0.0, 1e-6, longest=1e-3, following=2e-3)
    0.00025
    """
    return (rate + off / longest) * min(1.0, longest / following) ** 2


def step_limit(walls: Sequence[Wall], t: float) -> float:
    """Return the longest step from time t [s]: a fraction of each cubic, not beyond its end."""
    limit = inf
    for wall in walls:
        if wall.span:
            limit = min(limit, WALL_STEP_RTOL * wall.span, wall.end - t)
    return limit


def arrived(front: Front) -> Front:
    """Return the front with each wall whose cubic has ended replaced by its reference."""
    walls = tuple(
        wall.arrived() if wall.span and wall.end - front.time <= EVENT_TIME_ATOL else wall
        for wall in front.inputs.walls
    )
    return front if walls == front.inputs.walls else front.with_walls(walls)
