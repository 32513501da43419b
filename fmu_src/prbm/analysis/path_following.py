"""Points along a curve of equilibria, with the events between them."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..mechanics.arrays import Real
from .equilibrium_curve import RATE_RTOL, EquilibriumCurve, LoadPath, PathPoint, state_of

LIMIT, BIFURCATION, REST = "limit point", "bifurcation", "rest"
TURN = "displacement limit"

STEP_MAX = 0.1  # Longest step, in radians or shares, unless a shorter one is wanted.
FIRST_SHARE = 0.2  # Of the longest step: the first one.
STEP_MIN_SHARE = 1e-6  # Of the longest step: a shorter one ends the path.
BEND_MAX = 0.2  # rad between the tangents of neighbouring points.
CLOSED = "the path is closed: it has returned to its begin"
POLE = "the load grows without bound, as at a dead centre"
REACH = "the displacement has a limit, at which the force grows without bound"
REACH_SHARE = 10.0  # Least share near the limit of a displacement.
REACH_RTOL = 1e-3  # Of the range: change of the displacement by twice the force near its limit.
POINTS_MAX = 2000  # Of a path.
AWAY_STEPS = 3.0  # Steps between the begin of a path and its points before it returns.
RETURN_RTOL = 0.1  # Of a step: distance of the begin from the step that closes the path.
EVENT_RTOL = 1e-4  # Of a step: distance of the points between which an event is interpolated.
EVENT_BISECTIONS = 30  # Of the step in which an event is located.
ROOT_BISECTIONS = 40  # Of an interpolation.
SINGLE_EVENT_SHARE = 0.01  # Of the longest step: a longer one with several changes is divided.
REST_SHARE = 1e-10  # Smaller shares are those of a rest position.


def share_of(point: PathPoint) -> float:
    """Return the share of a point."""
    return point.share


@dataclass(frozen=True)
class Range:
    """A range of the shares or displacements of the points of a path."""

    quantity: Callable[[PathPoint], float]
    low: float
    high: float

    def left(self, start: PathPoint, end: PathPoint) -> float | None:
        """Return the bound that a step passes or reaches, which it may begin at; else None."""
        before, after = self.quantity(start), self.quantity(end)
        if after >= self.high and after > before:
            return self.high
        return self.low if after <= self.low and after < before else None


def followed(curve: EquilibriumCurve, begin: PathPoint, within: Range, step: float) -> LoadPath:
    """Follow the path from a point until it leaves a range."""
    points, events = [begin], list[tuple[str, PathPoint]]()
    length, ended, away = FIRST_SHARE * step, None, False
    least, single = STEP_MIN_SHARE * step, SINGLE_EVENT_SHARE * step
    left = within.left(begin, begin)
    while left is None and ended is None:
        start = points[-1]
        found = curve.step(start, length)
        bend = math.inf if found is None else _bend(curve, start, found)
        if found is None or bend > BEND_MAX:
            length *= 0.5
            ended = f"no equilibrium was found beyond a step of {least:g}"
            ended = ended if length < least else None
            continue
        left = within.left(start, found)
        if left is not None:
            found = _placed(curve, start, found, left, within.quantity is share_of) or found
            length = float(curve.weighted(state_of(found) - state_of(start)) @ start.tangent)
            if length < least:
                break  # The path begins at the end of the range.
        if length > single and _crossings(start, found) > 1:
            length, left = 0.5 * length, None
            continue
        passed = _events(curve, start, found, length)
        if passed is None:
            ended = POLE
            break
        for event in passed:
            events.append(event)
            points.append(event[1])
        points.append(found)
        if away and _returned(curve, begin, start, found):
            ended = CLOSED
        else:
            ended = _ended(curve, points, within)
        away = away or _apart(curve, begin, found) > AWAY_STEPS * length
        length = min(step, length * min(2.0, 0.7 * BEND_MAX / max(bend, 1e-9)))
    return LoadPath(tuple(points), tuple(events), ended)


def _ended(curve: EquilibriumCurve, points: list[PathPoint], within: Range) -> str | None:
    """Return why a path does not reach the end of its range, if so."""
    if within.quantity is not share_of and _stretched(curve, points[-1], within):
        return REACH
    if len(points) >= POINTS_MAX:
        return f"the path has {POINTS_MAX} points without reaching its end"
    return None


def _stretched(curve: EquilibriumCurve, point: PathPoint, within: Range) -> bool:
    """Return whether twice the force would hardly change the displacement beyond a point."""
    growth = point.share * float(point.tangent[-1])  # Half the rate of the squared share.
    change = _rate(curve, point) * point.share**2
    limit = REACH_RTOL * (within.high - within.low) * growth
    return abs(point.share) > REACH_SHARE and abs(change) < limit


def _apart(curve: EquilibriumCurve, point: PathPoint, other: PathPoint) -> float:
    """Return the distance of two points, without multipliers."""
    return float(np.linalg.norm(curve.weighted(state_of(other) - state_of(point))))


def _returned(curve: EquilibriumCurve, begin: PathPoint, start: PathPoint, end: PathPoint) -> bool:
    """Return whether a step passes the first point of the path, in the same sense."""
    step, back = (curve.weighted(state_of(other) - state_of(start)) for other in (end, begin))
    length = float(np.linalg.norm(step))
    part = float(back @ step) / length**2
    across = float(np.linalg.norm(back - min(1.0, max(0.0, part)) * step))
    same = float(curve.weighted(begin.tangent) @ end.tangent) > math.cos(2.0 * BEND_MAX)
    return same and across <= RETURN_RTOL * length


def _bend(curve: EquilibriumCurve, start: PathPoint, end: PathPoint) -> float:
    """Return the angle between the tangents of two points [rad]."""
    cosine = float(curve.weighted(start.tangent) @ end.tangent)
    return math.acos(min(1.0, max(-1.0, cosine)))


def between(
    curve: EquilibriumCurve, start: PathPoint, end: PathPoint, value: float, shared: bool = False
) -> tuple[Real, Real] | None:
    """Return the state at a displacement, or a share, between two points, and a tangent there.

    None: it is not found.

    The guess is on the cubic through both points along their tangents.
    """
    first, last = state_of(start), state_of(end)
    length = float(np.linalg.norm(curve.weighted(last - first)))
    if shared:
        before, after = start.share, end.share
        ahead, behind = start.tangent[-1], end.tangent[-1]
    else:
        before, after = curve.amount(start), curve.amount(end)
        ahead, behind = _rate(curve, start), _rate(curve, end)
    h = _hermite_root(before - value, after - value, length * ahead, length * behind)
    guess = (
        (1 + 2 * h) * (1 - h) ** 2 * first + h * h * (3 - 2 * h) * last
        + length * (h * (1 - h) ** 2 * start.tangent - h * h * (1 - h) * end.tangent)
    )  # fmt: skip
    normal = None
    if shared:
        guess[-1] = value
        normal = np.zeros(len(guess))
        normal[-1] = 1.0
    found = curve.correct(guess, normal, value)
    if found is None or float(np.abs(guess - found[0])[: curve.system.n].max()) > BEND_MAX:
        return None
    return found


def _hermite_root(first: float, last: float, rate: float, rate_last: float) -> float:
    """Return where in [0, 1] the cubic with these values and slopes at its ends is zero."""
    low, high = 0.0, 1.0
    if first * last >= 0.0:
        return 0.0 if abs(first) <= abs(last) else 1.0
    for _ in range(ROOT_BISECTIONS):
        h = 0.5 * (low + high)
        value = (
            (1 + 2 * h) * (1 - h) ** 2 * first + h * h * (3 - 2 * h) * last
            + h * (1 - h) ** 2 * rate - h * h * (1 - h) * rate_last
        )  # fmt: skip
        low, high = (h, high) if value * first > 0.0 else (low, h)
    return 0.5 * (low + high)


def _placed(
    curve: EquilibriumCurve, start: PathPoint, end: PathPoint, value: float, shared: bool = False
) -> PathPoint | None:
    """Return the point at a displacement, or a share, between two points; None if not found."""
    found = between(curve, start, end, value, shared)
    if found is None:
        return None
    state, t = found
    return curve.point(state, math.copysign(1.0, float(curve.weighted(t) @ start.tangent)) * t)


def _turned(start: PathPoint, end: PathPoint) -> bool:
    return bool(start.tangent[-1] * end.tangent[-1] < 0.0)


def _crossings(start: PathPoint, end: PathPoint) -> int:
    """Return the number of limit points and bifurcations in a step, as far as it is known."""
    change, turned = abs(end.unstable - start.unstable), _turned(start, end)
    return change if not turned or change % 2 else change + 1


def _events(
    curve: EquilibriumCurve, start: PathPoint, end: PathPoint, length: float
) -> list[tuple[str, PathPoint]] | None:
    """Return the limit point, the bifurcations and the rest position within a step, in order.

    None: the share changes its sign without a zero, since the step has jumped over a pole.
    """
    turned, found = _turned(start, end), []
    if turned:
        place = _located(curve, start, end, length, lambda p: float(p.tangent[-1]))
        found.append((LIMIT, _critical(place, start, end, 1)))
    crossed = _crossings(start, end) - int(turned)
    if crossed:
        found.append((BIFURCATION, _bifurcation(curve, start, end, length, crossed)))
    if _rate(curve, start) * _rate(curve, end) < 0.0:
        place = _located(curve, start, end, length, lambda p: _rate(curve, p))
        found.append((TURN, place))
    resting = [abs(point.share) <= REST_SHARE for point in (start, end)]
    if resting[1] and not resting[0]:
        found.append((REST, end))
    elif start.share * end.share < 0.0 and not any(resting):
        rest = _rest(curve, start, end, length)
        if rest is None:
            return None
        found.append((REST, rest))
    origin = state_of(start)
    return sorted(
        found, key=lambda one: float(np.linalg.norm(curve.weighted(state_of(one[1]) - origin)))
    )


def _rest(
    curve: EquilibriumCurve, start: PathPoint, end: PathPoint, length: float
) -> PathPoint | None:
    """Return the point of a step at which the share is zero, whose sign changes in it."""
    place = _placed(curve, start, end, 0.0, True)
    if place is None:  # The step is too long for an interpolation.
        (_, _, before), (_, _, after) = _enclosed(curve, start, end, length, share_of, EVENT_RTOL)
        place = _placed(curve, before, after, 0.0, True)
    return place


def _rate(curve: EquilibriumCurve, point: PathPoint) -> float:
    """Return the derivative of the displacement by the length of the path; 0 if round-off."""
    row = curve.amount_row(state_of(point))
    rate = float(row @ point.tangent)
    return rate if abs(rate) > RATE_RTOL * float(np.linalg.norm(row)) else 0.0


def _critical(point: PathPoint, start: PathPoint, end: PathPoint, count: int) -> PathPoint:
    """Return a point at which directions become unstable or stable in the step between two."""
    counts = (min(getattr(start, name), getattr(end, name)) for name in ("unstable", "held"))
    unstable, held = counts
    return replace(point, unstable=unstable, held=held, critical=count)


def _located(
    curve: EquilibriumCurve, start: PathPoint, end: PathPoint, length: float,
    value: Callable[[PathPoint], float],
) -> PathPoint:  # fmt: skip
    """Return the point of a step at which a value is zero that changes its sign in it."""
    sides = _enclosed(curve, start, end, length, value, EVENT_RTOL**2)
    return min((point for _, _, point in sides), key=lambda point: abs(value(point)))


def _enclosed(
    curve: EquilibriumCurve, start: PathPoint, end: PathPoint, length: float,
    value: Callable[[PathPoint], float], rtol: float,
) -> list[tuple[float, float, PathPoint]]:  # fmt: skip
    """Return length, value and point on both sides of the zero of a value in a step.

    The sides approach each other to a fraction of the step, by the rule of false position (Illinois
    method), as far as points are found between them.
    """
    sides = [(0.0, value(start), start), (length, value(end), end)]
    weights = [1.0, 1.0]
    for _ in range(EVENT_BISECTIONS):
        (low, first, _), (high, last, _) = sides
        if abs(high - low) < rtol * length or first * last >= 0.0:
            break
        a, b = weights[0] * first, weights[1] * last
        margin = 0.1 * rtol
        part = min(1.0 - margin, max(margin, a / (a - b)))
        point = curve.step(start, low + part * (high - low))
        if point is None or not math.isfinite(now := value(point)):
            break
        side = int(now * first <= 0.0)
        sides[side] = (low + part * (high - low), now, point)
        weights[side], weights[1 - side] = 1.0, 0.5 * weights[1 - side]
        if now == 0.0:
            break
    return sides


def _bifurcation(
    curve: EquilibriumCurve, start: PathPoint, end: PathPoint, length: float, count: int
) -> PathPoint:
    """Return the place in a step where directions become unstable or stable.

    The equations are singular there: the place is interpolated between points on both sides, by
    the squared frequency of the direction.
    """
    k = min(start.unstable, end.unstable)

    def critical(point: PathPoint) -> float:
        frequency = float(point.frequency[k])
        return frequency * abs(frequency)

    sides = _enclosed(curve, start, end, length, critical, EVENT_RTOL)
    (_, first, before), (_, last, after) = sides
    part = first / (first - last) if first * last < 0.0 else 1.0
    state = state_of(before) + part * (state_of(after) - state_of(before))
    place = PathPoint(float(state[-1]), curve.shape(state), 0, 0, before.tangent, before.frequency)
    return _critical(place, start, end, count)
