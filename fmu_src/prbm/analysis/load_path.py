r"""Paths of equilibria under a load that varies, through limit points, with their stability.

The loads are w(s) = w_0 + s w_1 with a share s.  The shapes q, with the multipliers of the loops,
are a curve, which is followed by prediction along its tangent and correction by Newton's method in
the plane across it [1, 2].  Its length is measured in (q, s), angles in radians.  The curve passes
limit points, where s turns back.

If the load is the force along the release, the same curve consists of the shapes that are held at
displacements of the released body; it passes the shapes where the displacement turns back.

Stability is that under dead loads, and that of the held body: at a limit point one direction
becomes unstable or stable, and s has an extremum.  At a bifurcation a direction becomes unstable
where s has none; the mechanism then buckles to another shape.  Such a branch is found at a small
distance along the modes that become unstable, and followed in the same way.

Sources
-------
.. [1] H. B. Keller, in: Applications of Bifurcation Theory, Academic Press (1977) 359.
.. [2] E. L. Allgower, K. Georg, Numerical Continuation Methods, Springer (1990).
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..base.errors import EquilibriumError, SimulationError
from ..mechanics.elements import Elements
from ..mechanics.statics import Equilibrium, equilibrium
from ..mechanics.system import System
from .equilibrium_curve import RATE_RTOL, EquilibriumCurve, LoadPath, PathPoint, state_of
from .path_branches import branches_of
from .path_following import REST, REST_SHARE, STEP_MAX, Range, between, followed, share_of

RANGE_STEPS = 8  # Least number of steps over a range, as fast as the displacement first changes.
FORCE_SCALE_MIN = 1e-3  # Least unit of a holding force, of the softest spring over the size.


def load_path(
    system: System, first: Mapping[str, float], last: Mapping[str, float], branches: int = 0,
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
    curve, begin = EquilibriumCurve.between(system, first, last), equilibrium(system, None, first)
    state = np.concatenate([begin.q, begin.lam, [0.0]])
    along = np.zeros(len(state))
    along[-1] = 1.0
    try:
        start = curve.first(state, along)
    except SimulationError:
        raise EquilibriumError(
            "the shape under the first loads does not determine the path: a motion has no "
            "stiffness there; begin with other loads, or clamp a flexure that is pinned"
        ) from None
    path = followed(curve, start, Range(share_of, -math.inf, 1.0), step)
    within = Range(share_of, -1.0, 1.0)
    return (
        replace(path, branches=branches_of(curve, path, within, step, branches))
        if branches
        else path
    )


@dataclass(frozen=True, eq=False)
class HeldPath:
    """The shapes in which the released body is held, over a range of displacements.

    Parameters
    ----------
    path : LoadPath
        The path from the low end to the high end, if both are reached.
    unit : float
        Holding force of the share 1 [N], [N m].
    curve : EquilibriumCurve
        Its equations.
    """

    path: LoadPath
    unit: float
    curve: EquilibriumCurve

    def amount(self, point: PathPoint) -> float:
        """Return the displacement [m] or rotation [rad] of a point."""
        return self.curve.amount(point)

    def force(self, point: PathPoint) -> float:
        """Return the holding force [N] or moment [N m] of a point."""
        return self.unit * point.share

    def shape(self, point: PathPoint) -> Equilibrium:
        """Return the shape of a point, with the load as its holding force."""
        loads = self.curve.loads[0]
        return replace(point.shape, force=self.unit * point.share, load=loads)

    def shapes(self, amounts: Iterable[float]) -> list[tuple[float, float, Equilibrium]]:
        """Return places on the path, displacements [m], [rad], and the shapes at these.

        A place is the number of the point before it, and the part of the way to the next one.
        There are several shapes at a displacement if the path turns back, and none if the path does
        not reach it.
        """
        points = self.path.points
        places = np.array([self.curve.amount(point) for point in points])
        wanted, found = np.unique(np.fromiter(amounts, float)), []
        for end in wanted[[0, -1]]:  # The path reaches the ends of its range within round-off.
            places[np.abs(places - end) <= RATE_RTOL * np.abs(wanted).max()] = end
        for k, (start, end) in enumerate(pairwise(places)):
            inner = wanted[(wanted >= min(start, end)) & (wanted <= max(start, end))]
            for x in inner if start < end else inner[::-1]:
                if k and x == start:
                    continue  # The end of the last interval.
                at = between(self.curve, points[k], points[k + 1], float(x))
                if at is not None:
                    state, _ = at
                    shape = self.curve.shape(state)
                    force = self.unit * float(state[-1])
                    held = replace(shape, force=force, load=self.curve.loads[0])
                    part = float((x - start) / (end - start)) if end != start else 0.0
                    found.append((k + part, float(x), held))
        return found


def held_path(
    system: System, low: float, high: float, branches: int = 0, step: float = STEP_MAX
) -> HeldPath:
    """Follow the shapes in which the released body is held, over a range of displacements.

    The path begins at the displacement of the range next to the straight shape, and is followed to
    both ends of the range.  It may turn back there.

    Parameters
    ----------
    system : System
        The mechanism.
    low, high : float
        Ends of the range [m], or rotations [rad] if the release is by an angle.
    branches : int
        Branches to follow, see :func:`load_path`.
    step : float
        Longest step, in radians or shares.

    Raises
    ------
    EquilibriumError
        If no shape at the first displacement is found, or a motion of it has no stiffness.
    """
    begin = equilibrium(system, min(max(0.0, low), high))
    curve, unit, start = _held_start(system, begin)
    within = Range(curve.amount, low, high)
    rate = abs(float(curve.amount_row(state_of(start)) @ start.tangent))
    step = min(step, (high - low) / (RANGE_STEPS * rate)) if high > low else step
    back = followed(curve, replace(start, tangent=-start.tangent), within, step)
    path = _joined(back, followed(curve, start, within, step))
    if branches:
        path = replace(path, branches=branches_of(curve, path, within, step, branches))
    return HeldPath(path, unit, curve)


def _held_start(system: System, begin: Equilibrium) -> tuple[EquilibriumCurve, float, PathPoint]:
    """Return the curve of the holding force, its unit, and the first point.

    A small change of the displacement changes the share as much as the coordinates.
    """
    n, springs = system.n, Elements(system).drawn.diagonal()
    acting = springs[springs > 0.0]
    softest = float(acting.min()) if len(acting) else float(np.abs(begin.load).max(initial=0.0))
    unit = (softest or 1.0) / system.length
    state = np.concatenate([begin.q, begin.lam, [begin.force / unit]])
    curve = EquilibriumCurve.held(system, unit)
    try:
        kkt, column, residual = curve.equations(state)
        row = curve.amount_row(state)
        t = curve.solve(kkt, column, row, np.append(np.zeros_like(residual), 1.0))
        unit *= max(FORCE_SCALE_MIN, abs(float(t[-1])) / float(np.linalg.norm(t[:n])))
        state[-1] = begin.force / unit
        curve = EquilibriumCurve.held(system, unit)
        return curve, unit, curve.first(state, row)
    except SimulationError:
        raise EquilibriumError(
            "the first shape does not determine the path: a motion has no stiffness there; clamp "
            "a flexure that is pinned, or add gravity"
        ) from None


def _joined(back: LoadPath, ahead: LoadPath) -> LoadPath:
    """Return the path along one path backward, and then along another one from the same point."""
    turned = {id(p): replace(p, tangent=-p.tangent) for p in back.points[1:]}
    turned[id(back.points[0])] = begin = ahead.points[0]
    events = [(kind, turned[id(p)]) for kind, p in back.events][::-1]
    if abs(begin.share) <= REST_SHARE:
        events.append((REST, begin))
    points = tuple(turned[id(p)] for p in back.points[::-1])
    ended = dict.fromkeys(x for x in (back.ended, ahead.ended) if x)
    return LoadPath(
        (*points, *ahead.points[1:]), (*events, *ahead.events), "; ".join(ended) or None
    )
