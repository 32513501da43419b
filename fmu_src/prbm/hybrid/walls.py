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
from math import inf, ulp

from ..base.tolerances import (
    EVENT_TIME_RTOL,
    EVENT_TIME_ULPS,
    WALL_FADING_FACTOR,
    WALL_LONGEST_RTOL,
    WALL_PATH_RTOL,
    WALL_STEP_RTOL,
)
from ..mechanics.arrays import Real
from ..mechanics.inputs import Wall
from ..mechanics.system import System
from .configuration import Configuration
from .front import Front


@dataclass(frozen=True)
class StepHistory:
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
) -> tuple[StepHistory, tuple[Wall, ...]]:
    """Return the walls at a start time [s]: each has position and velocity of its reference."""
    walls = tuple(
        _given_reference(configuration, given, i, time)
        for i in range(len(configuration.mechanism.stops))
    )
    return StepHistory(time, 0.0, tuple(wall.rate != 0.0 for wall in walls)), walls


def _given_reference(
    configuration: Configuration, given: Mapping[str, float], stop: int, time: float
) -> Wall:
    """Return the reference that the inputs of a stop define at a time [s]."""
    name = configuration.mechanism.stops[stop].name
    position = configuration.stop_value(stop, "position") + given[f"{name}.displacement"]
    return Wall(position, given[f"{name}.velocity"], time)


def join(
    acting: Configuration,
    configuration: Configuration,
    given: Mapping[str, float],
    history: StepHistory,
    walls: tuple[Wall, ...],
    now: float,
    time: float,
) -> tuple[StepHistory, tuple[Wall, ...]]:
    """Return the walls from a communication point on.

    A wall whose reference has not changed moves on as before.  Before the first step, the velocity
    of a wall is that of its reference.  A wall whose hit point moves by a change of ``stop.offset``
    joins its reference anew, see :func:`keeping_gaps`.

    Parameters
    ----------
    acting, configuration : Configuration
        Configurations with the parameter values up to now, and from now on.
    given : mapping
        Values of all inputs.
    history : StepHistory
        Past communication steps.
    walls : (s,) tuple of Wall
        Motions of the walls up to now.
    now, time : float
        This communication point and the next [s].
    """
    last, following = now - history.point, time - now
    recent = max(last or following, history.longest - WALL_FADING_FACTOR * last)
    longest = min(recent, WALL_LONGEST_RTOL * configuration.scales.time)
    span, round_off = 2.0 * longest, WALL_PATH_RTOL * configuration.system.length
    joined, driven = list(walls), list(history.driven)
    for i, wall in enumerate(walls):
        line = _given_reference(configuration, given, i, now)
        off = line.position - wall.reference(now)
        driven[i] = driven[i] or line.rate != 0.0
        if not driven[i]:
            shift = configuration.stop_value(i, "position") - acting.stop_value(i, "position")
            rate = _mean_rate(wall.rate, off - shift if last else 0.0, recent, following)
            line = replace(line, rate=rate)
        same = abs(off) + abs(line.rate - wall.rate) * span <= round_off
        if not same or configuration.stop_value(i, "offset") != acting.stop_value(i, "offset"):
            velocity = float(wall.motion(now)[1]) if last else line.rate
            joined[i] = wall.joining(line, velocity, span)
    return StepHistory(now, longest, tuple(driven)), tuple(joined)


def keeping_gaps(old: System, new: System, y: Real, walls: tuple[Wall, ...]) -> tuple[Wall, ...]:
    """Return walls that take up the jumps of the gaps after a change of parameters.

    The gaps and their rates do not jump: the walls move with the hit points.

    Parameters
    ----------
    old, new : System
        Constant arrays up to now, and from now on.
    y : (2 n + 2,)
        The present state.
    walls : (s,) tuple of Wall
        Motions of the walls, which join their references from now on if their gaps jump.
    """
    e, v, before, after = (
        new.directions(y[: new.n]),
        y[new.n : 2 * new.n],
        old.gap_rows,
        new.gap_rows,
    )
    jumps = after.values(e) - before.values(e)
    turns = after.rates(e, v) - before.rates(e, v)
    return tuple(
        replace(wall, offset=wall.offset - float(jump), excess=wall.excess - float(turn))
        if wall.span
        else wall
        for wall, jump, turn in zip(walls, jumps, turns, strict=True)
    )


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
    t, round_off = front.time, EVENT_TIME_ULPS * ulp(front.time)

    def ended(wall: Wall) -> bool:
        return wall.span > 0.0 and wall.end - t <= EVENT_TIME_RTOL * wall.span + round_off

    walls = tuple(wall.arrived() if ended(wall) else wall for wall in front.inputs.walls)
    return front if walls == front.inputs.walls else front.with_walls(walls)
