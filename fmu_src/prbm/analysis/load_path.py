r"""Paths of equilibria under a load that varies, through limit points, with their stability.

The loads are w(s) = w_0 + s w_1 with a share s.  The shapes q, with the multipliers of the loops,
are a curve, which is followed by prediction along its tangent and correction by Newton's method in
the plane across it [1, 2].  Its length is measured in (q, s), angles in radians.  The curve passes
limit points, where s turns back.

Stability is that under dead loads: at a limit point one direction becomes unstable or stable, and s
has an extremum.  At a bifurcation a direction becomes unstable where s has none; the mechanism
then buckles to another shape.  Such a branch is found at a small distance along the mode that
becomes unstable, and followed in the same way.

Sources
-------
.. [1] H. B. Keller, in: Applications of Bifurcation Theory, Academic Press (1977) 359.
.. [2] E. L. Allgower, K. Georg, Numerical Continuation Methods, Springer (1990).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import EquilibriumError, SimulationError
from ..base.tolerances import STATICS_CONSTRAINT_RTOL
from ..mechanics import constraints
from ..mechanics.arrays import Real
from ..mechanics.forces import elastic_energy, springs
from ..mechanics.modal import modes
from ..mechanics.statics import Equilibrium, balance_matrix, equilibrium, load_row
from ..mechanics.system import System

STEP_FIRST = 0.02  # Length of the first step, in radians or shares.
STEP_MAX = 0.1  # Longest step.
STEP_MIN = 1e-7  # A shorter step ends the path.
BEND_MAX = 0.2  # rad between the tangents of neighbouring points.
NEWTON_MAX = 8  # Iterations of a correction.
CORRECTION_ATOL = 1e-10  # rad: last correction of a point.
CLOSED = "the path is closed: it has returned to its begin"
ROUND_OFF_RTOL = 1e-15  # Of the largest stiffness: smaller ones are round-off.
POINTS_MAX = 2000  # Of a path.
BRANCH_DISTANCE = 0.02  # rad: of the first point of a branch from its bifurcation.
MIRROR_RTOL = 1e-6  # Of load and energy of mirror images.
MEETING_RTOL = (
    3e-3  # The same for the bifurcation where branches meet, which is located by bisection.
)
BRANCHES_MAX = 8
CLOSED_POINTS_MIN = 10  # Points of a closed path.
EVENT_RTOL = 1e-3  # Of a step: distance of the points between which an event is interpolated.
EVENT_BISECTIONS = 30  # Of the step in which an event is located.


@dataclass(frozen=True, eq=False)
class PathPoint:
    """An equilibrium on the path.

    Parameters
    ----------
    share : float
        Share s of the change of the loads [-].
    shape : Equilibrium
        The shape.
    unstable : int
        Number of unstable directions under dead loads.
    tangent : (n + r + 1,)
        Derivatives of coordinates, multipliers and share by the length of the path.
    """

    share: float
    shape: Equilibrium
    unstable: int
    tangent: Real


@dataclass(frozen=True)
class LoadPath:
    """Equilibria under loads that vary.

    Parameters
    ----------
    points : tuple of PathPoint
        Points in the order of the path, limit points and bifurcations included.
    events : tuple of (str, PathPoint)
        ``"limit point"``, ``"bifurcation"`` or ``"rest"``, where the first loads act again, with
        its place.
    ended : str or None
        Why the path ends before the last load; None: it does not.
    branches : tuple of LoadPath
        The branches at the bifurcations, from there on, if they have been followed.
    """

    points: tuple[PathPoint, ...]
    events: tuple[tuple[str, PathPoint], ...]
    ended: str | None
    branches: tuple["LoadPath", ...] = ()


class _Curve:
    """The equations of the shapes at the loads w(s)."""

    def __init__(self, system: System, first: Mapping[str, float], last: Mapping[str, float]):
        self.system = system
        w, moment = load_row(system, first)
        w_last, moment_last = load_row(system, last)
        self.loads, self.moments = (w, w_last - w), (moment, moment_last - moment)

    def shape(self, state: Real) -> Equilibrium:
        n = self.system.n
        return Equilibrium(state[:n], state[n:-1], 0.0, self.loads[0] + state[-1] * self.loads[1])

    def equations(self, state: Real) -> tuple[Real, Real, Real]:
        """Return the matrix of small changes, the column of the share, and the residual.

        The residual has the torques [N m] and the negative open distances of the loops [m].
        """
        system, shape = self.system, self.shape(state)
        n, e = system.n, system.directions(shape.q)
        kkt = balance_matrix(system, shape, held=False)
        stiff = kkt[:n, :n]  # Round-off would determine the scale of a motion without springs.
        stiff[np.abs(stiff) < ROUND_OFF_RTOL * np.abs(stiff).max()] = 0.0
        loads, by_share = (
            system.Phi.pull((w * e).real) + moment
            for w, moment in (
                (shape.load, self.moments[0] + state[-1] * self.moments[1]),
                (self.loads[1], self.moments[1]),
            )
        )
        torque = springs(system.K, shape.q - system.q0) + loads + shape.lam @ kkt[n:, :n]
        open_by = system.loop_rows.values(e)
        column = np.concatenate([-by_share, np.zeros(len(open_by))])
        return kkt, column, np.concatenate([torque, -open_by])

    def solve(self, kkt: Real, column: Real, normal: Real, right: Real) -> Real:
        """Solve the linear equations for the change of a state, whose last row is ``normal``."""
        n = self.system.n
        x = constraints.solve_bordered(kkt, column, normal, right, n, self.system.length)
        x[n:-1] *= -1.0
        return x

    def correct(self, guess: Real, normal: Real) -> Real | None:
        """Return the equilibrium in the plane through a guess; None without convergence."""
        state, size = guess.copy(), math.inf
        for _ in range(NEWTON_MAX):
            kkt, column, residual = self.equations(state)
            right = np.append(residual, normal @ (guess - state))
            try:
                change = self.solve(kkt, column, normal, right)
            except SimulationError:
                return None
            last, size = size, float(np.abs(change[: self.system.n]).max())
            if not size < 2.0 * last:
                return None
            state = state + change
            if size <= CORRECTION_ATOL and self.closed(state):
                return state
        return None

    def closed(self, state: Real) -> bool:
        open_by = self.system.loop_rows.values(self.system.directions(state[: self.system.n]))
        limit = 10.0 * STATICS_CONSTRAINT_RTOL * self.system.length
        return float(np.abs(open_by).max(initial=0.0)) <= limit

    def point(self, state: Real, along: Real) -> PathPoint:
        """Return a point with its tangent in the sense of another one."""
        kkt, column, residual = self.equations(state)
        right = np.append(np.zeros_like(residual), 1.0)
        t = self.solve(kkt, column, self.weighted(along), right)
        t = t / math.sqrt(float(self.weighted(t) @ t))
        shape = self.shape(state)
        unstable = int(np.count_nonzero(modes(self.system, shape).frequency < 0.0))
        return PathPoint(float(state[-1]), shape, unstable, t)

    def weighted(self, t: Real) -> Real:
        """Return the row of the scalar product with a tangent: multipliers have no weight."""
        result = t.copy()
        result[self.system.n : -1] = 0.0
        return result

    def step(self, start: PathPoint, length: float) -> PathPoint | None:
        """Return the point at a length along the tangent of another one."""
        guess = _state(start) + length * start.tangent
        state = self.correct(guess, self.weighted(start.tangent))
        try:
            return None if state is None else self.point(state, start.tangent)
        except SimulationError:
            return None


def _state(point: PathPoint) -> Real:
    return np.concatenate([point.shape.q, point.shape.lam, [point.share]])


def load_path(
    system: System, first: Mapping[str, float], last: Mapping[str, float], branches: bool = False,
    step: float = STEP_MAX,
) -> LoadPath:  # fmt: skip
    """Follow the equilibria while the loads change from the first to the last ones.

    Parameters
    ----------
    system : System
        The mechanism.
    first, last : mapping
        Forces [N] and moments [N m] by name; those that are not given are zero.
    branches : bool
        Whether to follow the branches that begin at the bifurcations, too, until their share is 1
        or -1.  Of branches that are mirror images of each other, one is followed.
    step : float
        Longest step, in radians or shares.  The path of a nearly symmetric mechanism turns sharply
        near a bifurcation of the symmetric one, which a long step may jump over.

    Raises
    ------
    EquilibriumError
        If no shape under the first loads is found, or a motion of it has no stiffness.
    ParameterError
        If a load is unknown, or not a finite number.
    """
    curve, begin = _Curve(system, first, last), equilibrium(system, None, first)
    state = np.concatenate([begin.q, begin.lam, [0.0]])
    along = np.zeros(len(state))
    along[-1] = 1.0
    try:
        start = curve.point(state, along)
    except SimulationError:
        raise EquilibriumError(
            "the shape under the first loads does not determine the path: a motion has no "
            "stiffness there; begin with other loads, or clamp a flexure that is pinned"
        ) from None
    path = _followed(curve, start, -math.inf, step)
    return replace(path, branches=_branches(curve, path, step)) if branches else path


def _branches(curve: _Curve, path: LoadPath, step: float) -> tuple[LoadPath, ...]:
    """Return the branches at the bifurcations of a path, without mirror images."""
    found: list[LoadPath] = []
    for event in (point for kind, point in path.events if kind == "bifurcation"):
        first: list[PathPoint] = []
        for point in _switched(curve, event):
            if not any(_alike(curve, point, other) for other in first):
                first.append(point)
                branch = _followed(curve, point, -1.0, step)
                found.append(replace(branch, points=(event, *branch.points)))
    return tuple(found)


def _followed(curve: _Curve, begin: PathPoint, share_min: float, step: float) -> LoadPath:
    """Follow the path from a point until the share is 1 or the least one."""
    points, events = [begin], list[tuple[str, PathPoint]]()
    length, ended = min(STEP_FIRST, step), None
    while share_min < points[-1].share < 1.0 and ended is None:
        start = points[-1]
        found = curve.step(start, length)
        bend = math.inf if found is None else _bend(curve, start, found)
        if found is None or bend > BEND_MAX:
            length *= 0.5
            ended = f"no equilibrium was found beyond a step of {STEP_MIN:g}"
            ended = ended if length < STEP_MIN else None
            continue
        if found.share >= 1.0:
            found = _at_share(curve, start, found, 1.0)
        for event in _events(curve, start, found, length):
            events.append(event)
            points.append(event[1])
        points.append(found)
        length = min(step, length * min(2.0, 0.7 * BEND_MAX / max(bend, 1e-9)))
        if len(points) > CLOSED_POINTS_MIN and _returned(curve, begin, found):
            ended = CLOSED
        if len(points) >= POINTS_MAX:
            ended = f"the path has {POINTS_MAX} points without reaching the last loads"
    return LoadPath(tuple(points), tuple(events), ended)


def _returned(curve: _Curve, begin: PathPoint, end: PathPoint) -> bool:
    """Return whether a point is within a step of the first one, on the same curve."""
    apart = curve.weighted(_state(end) - _state(begin))
    along = float(apart @ begin.tangent)
    across = float(np.linalg.norm(apart - along * curve.weighted(begin.tangent)))
    same = float(curve.weighted(begin.tangent) @ end.tangent) > math.cos(2.0 * BEND_MAX)
    return same and abs(along) <= STEP_MAX and across <= BEND_MAX * STEP_MAX


def _switched(curve: _Curve, event: PathPoint) -> list[PathPoint]:
    """Return the first points of the branch that crosses the path at a bifurcation, on both sides.

    The equations of small changes have two independent solutions there: the tangent of the path,
    and one across it, along which the points are searched.
    """
    across = _across(curve, event)
    result = []
    for side in (1.0, -1.0):
        state = curve.correct(_state(event) + side * BRANCH_DISTANCE * across, across)
        try:
            if state is not None:
                result.append(curve.point(state, side * across))
        except SimulationError:
            continue
    return result


def _across(curve: _Curve, event: PathPoint) -> Real:
    """Return the direction of the branch across the path, without multipliers, of length 1."""
    system = curve.system
    kkt, column, _ = curve.equations(_state(event))
    n, r = system.n, len(kkt) - system.n
    stiff, size = float(np.abs(kkt[:n, :n]).max()), system.length
    rows = np.append(np.full(n, 1.0 / stiff), np.full(r, 1.0 / size))
    columns = np.concatenate([np.ones(n), np.full(r, stiff / size), [1.0]])
    signed = np.hstack([kkt, column[:, None]])
    signed[:, n:-1] *= -1.0
    # The last row is zero: with it, the last right singular vectors span all solutions.
    scaled = np.vstack([rows[:, None] * signed * columns, np.zeros(len(columns))])
    solutions = np.linalg.svd(scaled)[2][-2:]
    first, second = (curve.weighted(columns * x) for x in solutions)
    along = curve.weighted(event.tangent)
    # Both have a component along the path; the difference without it is the other direction.
    result = first * float(second @ along) - second * float(first @ along)
    result -= float(result @ along) * along
    return np.asarray(result / np.linalg.norm(result), float)


def _alike(curve: _Curve, point: PathPoint, other: PathPoint) -> bool:
    """Return whether two points have the same load and elastic energy, as mirror images have."""
    first, second = (
        elastic_energy(curve.system.K, x.shape.q - curve.system.rest) for x in (point, other)
    )
    same = math.isclose(first, second, rel_tol=MIRROR_RTOL)
    return same and math.isclose(point.share, other.share, rel_tol=MIRROR_RTOL)


def _bend(curve: _Curve, start: PathPoint, end: PathPoint) -> float:
    """Return the angle between the tangents of two points [rad]."""
    cosine = float(curve.weighted(start.tangent) @ end.tangent)
    return math.acos(min(1.0, max(-1.0, cosine)))


def _at_share(curve: _Curve, start: PathPoint, end: PathPoint, share: float) -> PathPoint:
    """Return the point at a share between two points, or the last one if it is not found."""
    part = (share - start.share) / (end.share - start.share)
    guess = _state(start) + part * (_state(end) - _state(start))
    guess[-1] = share
    normal = np.zeros(len(guess))
    normal[-1] = 1.0
    state = curve.correct(guess, normal)
    return end if state is None else curve.point(state, start.tangent)


def _events(
    curve: _Curve, start: PathPoint, end: PathPoint, length: float
) -> list[tuple[str, PathPoint]]:
    """Return the limit point, the bifurcations and the rest position within a step."""
    turned = start.tangent[-1] * end.tangent[-1] < 0.0
    found = []
    if turned:
        first_sign = start.tangent[-1] > 0.0
        place = _located(curve, start, length, lambda p: (p.tangent[-1] > 0.0) == first_sign)
        found.append(("limit point", place or end))
    if abs(end.unstable - start.unstable) != int(turned):
        found.append(("bifurcation", _bifurcation(curve, start, end, length)))
    if start.share * end.share < 0.0:
        found.append(("rest", _at_share(curve, start, end, 0.0)))
    return found


def _located(
    curve: _Curve, start: PathPoint, length: float, before: Callable[[PathPoint], bool]
) -> PathPoint | None:
    """Return the last point of a step before an event, by bisection of the step."""
    low, high, place = 0.0, length, None
    for _ in range(EVENT_BISECTIONS):
        middle = 0.5 * (low + high)
        point = curve.step(start, middle)
        if point is None:
            break
        if before(point):
            low, place = middle, point
        else:
            high = middle
    return place


def _bifurcation(curve: _Curve, start: PathPoint, end: PathPoint, length: float) -> PathPoint:
    """Return the place in a step where a direction becomes unstable or stable.

    The equations are singular there: the place is interpolated between points on both sides, by
    the squared frequency of the direction.
    """
    k = min(start.unstable, end.unstable)

    def critical(point: PathPoint) -> float:
        frequency = float(modes(curve.system, point.shape).frequency[k])
        return frequency * abs(frequency)

    sides = [(0.0, critical(start), start), (length, critical(end), end)]
    for _ in range(EVENT_BISECTIONS):
        (low, first, _), (high, last, _) = sides
        if high - low < EVENT_RTOL * length or first * last > 0.0:
            break
        part = min(0.75, max(0.25, first / (first - last)))
        point = curve.step(start, low + part * (high - low))
        if point is None or not math.isfinite(value := critical(point)):
            break
        sides[int(value * first <= 0.0)] = (low + part * (high - low), value, point)
    (_, first, before), (_, last, after) = sides
    part = first / (first - last) if first * last < 0.0 else 1.0
    state = _state(before) + part * (_state(after) - _state(before))
    return PathPoint(float(state[-1]), curve.shape(state), start.unstable, before.tangent)
