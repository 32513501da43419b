"""The largest forces and indentations of contacts at compliant stops, as steps go on."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

from ..base.errors import SimulationError
from ..base.tolerances import PEAK_REACH_FACTOR, PEAK_REFINEMENT_FACTOR, PEAK_REFINEMENTS
from ..mechanics.arrays import Real
from ..mechanics.dynamics import Equations
from .arc import Arc
from .configuration import Configuration
from .front import Front


def latched_until(
    configuration: Configuration, front: Front, arc: Arc | None, time: float
) -> Front:
    """Return the front whose outputs have the maxima up to a time of a step.

    Parameters
    ----------
    configuration : Configuration
        Mechanism and scales.
    front : Front
        The end of the step, with the maxima up to its start.
    arc : Arc or None
        The step that leads to the front; None if there is none, as at the start.
    time : float
        A time in the step, or later [s].

    Raises
    ------
    SimulationError
        If an indentation is larger than the mechanism.
    """
    end = min(time, front.time)
    if not front.equations.pressed or (arc is not None and end <= arc.start):
        return front
    latched, equations = list(front.latched), front.equations
    for i in equations.pressed:
        if arc is None:
            depth, force = _contact_at(equations, i, front.time, front.y)
        else:
            contact = _along(equations, arc, i)
            depth, force = (_largest(contact, k, arc.start, end) for k in (0, 1))
        check_depth(configuration, i, depth, end)
        latched[i] = replace(
            latched[i],
            peak_force=max(latched[i].peak_force, force),
            indentation=max(latched[i].indentation, depth),
        )
    return replace(front, latched=tuple(latched))


def check_depth(configuration: Configuration, stop: int, depth: float, time: float) -> None:
    """Reject an indentation [m] at a time [s] that is larger than the mechanism.

    Raises
    ------
    SimulationError
        If it is.
    """
    if not depth <= configuration.scales.length:
        raise SimulationError(
            f"{configuration.mechanism.stops[stop].name} is indented by {depth:.3g} m at t = "
            f"{time:.9g} s, more than the size of the mechanism: raise its stiffness, or move it"
        )


def _along(equations: Equations, arc: Arc, stop: int) -> Callable[[float], tuple[float, float]]:
    """Return indentation and force of a pressed stop as a function of time in a step."""

    @cache
    def contact(t: float) -> tuple[float, float]:
        return _contact_at(equations, stop, t, arc.at(t))

    return contact


def _contact_at(equations: Equations, stop: int, t: float, y: Real) -> tuple[float, float]:
    """Return indentation and force of a pressed stop at a time and a state."""
    n = equations.n
    e, v, extras = equations.system.directions(y[:n]), y[n : 2 * n], y[2 * n + 2 :]
    gap = float(equations.gaps(t, e, extras)[stop])
    rate = float(equations.gap_rates(t, e, v, extras)[stop])
    return -gap, equations.compliant.force(stop, -gap, -rate)


def _largest(
    contact: Callable[[float], tuple[float, float]], which: int, start: float, end: float
) -> float:
    """Return the largest value between two times, by parabolas through ever closer points.

    The value is the indentation (0) or the force (1).

    A step resolves the vibration of a contact.  If the parabola through both ends and the middle
    has no maximum in the step or close to it, the largest value is that of an end.
    """
    t, distance, result = 0.5 * (start + end), 0.5 * (end - start), -math.inf
    for _ in range(PEAK_REFINEMENTS):
        middle = min(max(t, start + distance), end - distance)
        before, at, after = (contact(middle + s * distance)[which] for s in (-1, 0, 1))
        result, bend = max(result, before, at, after), before - 2.0 * at + after
        if not bend < 0.0 or abs(before - after) > -2.0 * PEAK_REACH_FACTOR * bend:
            return result
        t = min(max(middle + 0.5 * distance * (before - after) / bend, start), end)
        distance *= PEAK_REFINEMENT_FACTOR
    return max(result, contact(t)[which])
