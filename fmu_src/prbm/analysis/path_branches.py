"""The branches of a curve of equilibria at its bifurcations."""

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import combinations

import numpy as np

from ..mechanics.arrays import Real
from ..mechanics.elements import Elements
from .equilibrium_curve import EquilibriumCurve, LoadPath, PathPoint, state_of
from .path_following import BIFURCATION, Range, followed

BRANCH_SHARE = 0.2  # Of the longest step: distance of the first point of a branch.
SAME_SIDE_STEPS = 4  # Iterations to the distance of a branch from its bifurcation.
KERNEL_ANGLES = 8  # Directions in the plane of two modes that become unstable together.
PASSING_SHARE = 0.04  # Of the longest step: distance of a point from a path through it.
MIRROR_RTOL = 1e-6  # Of load and energy of mirror images.
MEETING_RTOL = 3e-3  # The same for bifurcations where branches meet, which are interpolated.
BRANCHES_MAX = 24
BRANCH_COSINE_MAX = 0.9  # Of the angle to the path, above which a branch is the path itself.


def branches_of(
    curve: EquilibriumCurve, path: LoadPath, within: Range, step: float, depth: int
) -> tuple[LoadPath, ...]:
    """Return the branches at the bifurcations of a path, and their branches to a depth.

    Mirror images, and bifurcations at which branches meet again, are left out.
    """
    found: list[LoadPath] = []
    known: list[PathPoint] = []
    level = [path]
    for _ in range(depth):
        events = [p for one in level for kind, p in one.events if kind == BIFURCATION]
        level = []
        for event in events:
            if any(_alike(curve, event, other, MEETING_RTOL) for other in known):
                continue
            known.append(event)
            first: list[PathPoint] = []
            for point in _switched(curve, event, BRANCH_SHARE * step):
                followed_already = (path, *found, *level)
                if (
                    len(found) + len(level) >= BRANCHES_MAX
                    or any(_alike(curve, point, other) for other in first)
                    or any(
                        _passes(curve, one, point, PASSING_SHARE * step) for one in followed_already
                    )
                ):
                    continue
                first.append(point)
                branch = followed(curve, point, within, step)
                level.append(replace(branch, points=(event, *branch.points)))
        found += level
    return tuple(found)


def _passes(curve: EquilibriumCurve, path: LoadPath, point: PathPoint, distance: float) -> bool:
    """Return whether a path passes through a point, within the arcs between its own points."""
    places = np.array([curve.weighted(state_of(p)) for p in path.points])
    start, along = places[:-1], np.diff(places, axis=0)
    away = curve.weighted(state_of(point)) - start
    square = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    part = np.clip((away * along).sum(axis=1) / square, 0.0, 1.0)
    apart = np.linalg.norm(away - part[:, None] * along, axis=1)
    return bool(apart.min() < distance)


def _switched(curve: EquilibriumCurve, event: PathPoint, distance: float) -> list[PathPoint]:
    """Return the first points of the branches that cross the path at a bifurcation.

    The equations of small changes have several independent solutions there: the tangent of the
    path, and some across it, among which the points are searched at one distance.
    """
    result, place = [], state_of(event)
    for across in _directions(_across(curve, event)):
        direction, at = across, None
        for _ in range(SAME_SIDE_STEPS if event.critical > 1 else 1):
            at = curve.correct(place + distance * direction, direction)
            if at is None:
                break
            apart = curve.weighted(at[0] - place)
            direction = apart / np.linalg.norm(apart)
        if at is not None and abs(float(direction @ event.tangent)) < BRANCH_COSINE_MAX:
            result.append(curve.point(*at))
    return result


def _directions(across: Real) -> Iterable[Real]:
    """Return directions, with both signs, in the space of the rows across (m, n + r + 1)."""
    if len(across) == 1:
        found = [across[0]]
    elif len(across) == 2:
        angles = np.arange(KERNEL_ANGLES) * math.pi / KERNEL_ANGLES
        found = [math.cos(a) * across[0] + math.sin(a) * across[1] for a in angles]
    else:
        pairs = [x + sign * y for x, y in combinations(across, 2) for sign in (1.0, -1.0)]
        found = [*across, *(x / math.sqrt(2.0) for x in pairs)]
    return [sign * x for x in found for sign in (1.0, -1.0)]


def _across(curve: EquilibriumCurve, event: PathPoint) -> Real:
    """Return the directions of the branches across the path, without multipliers, of length 1.

    They are orthogonal to each other and to the path, (m, n + r + 1) for m critical directions.
    """
    system = curve.system
    kkt, column, _ = curve.equations(state_of(event))
    n, r = system.n, len(kkt) - system.n
    stiff, size = float(np.abs(kkt[:n, :n]).max()), system.length
    rows = np.append(np.full(n, 1.0 / stiff), np.full(r, 1.0 / size))
    columns = np.concatenate([np.ones(n), np.full(r, stiff / size), [1.0]])
    signed = np.hstack([kkt, column[:, None]])
    signed[:, n:-1] *= -1.0
    # The last row is zero: with it, the last right singular vectors span all solutions.
    scaled = np.vstack([rows[:, None] * signed * columns, np.zeros(len(columns))])
    count = max(1, event.critical)
    solutions = np.linalg.svd(scaled)[2][-1 - count :]
    found = np.array([curve.weighted(columns * x) for x in solutions])
    along = curve.weighted(event.tangent)
    along /= np.linalg.norm(along)
    found -= np.outer(found @ along, along)
    return np.asarray(np.linalg.svd(found, full_matrices=False)[2][:count], float)


def _alike(
    curve: EquilibriumCurve, point: PathPoint, other: PathPoint, rtol: float = MIRROR_RTOL
) -> bool:
    """Return whether two points have the same load and elastic energy, as mirror images have."""
    system = curve.system
    first, second = (
        Elements(system).energy(x.shape.q, system.directions(x.shape.q)) for x in (point, other)
    )
    same = math.isclose(first, second, rel_tol=rtol)
    return same and math.isclose(point.share, other.share, rel_tol=rtol)
