"""The optimum of an output of a study under constraints: from samples to a local search by SciPy.

Failed simulations and violated constraints have no value.  An output may jump, for example where
the number of impacts changes; all searches therefore compare values and use no derivatives.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import scipy
from scipy import optimize

from ..base.errors import ParameterError
from ..mechanics.arrays import Real
from .outputs import Constraint
from .plan import Plan

NEIGHBOURS = 5  # Samples of a range whose worst output is compared with that of other ranges.
WINDOWS_MIN = 3  # With fewer samples than this many groups of neighbours, one says little.
FLAT_RTOL = 0.05  # An optimum is flat where the output is within this share of it.
REFINED_RTOL = 1e-3  # Tolerance of the refined parameters, relative to the distance of samples.
ROUNDS_MAX = 4  # Repetitions of the refinement.
REFINEMENTS_MAX = 40  # Simulations that refine an optimum, for each parameter.
REFINEMENTS_EXPECTED = 30  # Usual number of simulations for each parameter, for the progress.
EDGE_RTOL = 0.02  # Tolerance of the ends of the flat range, relative to the distance of samples.
ACTIVE_RTOL = 0.01  # A constraint is active if its output is within this share of its bound.
BEST = 10  # Points of the table of the best ones.
RESTART_RADIUS = 0.1  # Of a repeated search around the best point, in distances of samples.
DISTINCT = 0.1  # Distance of different points in the table of the best ones, likewise.
MARGIN = 1e-4  # The search aims at this relative distance from bounds, so that constraints hold.
STARTS = 3  # Best samples from which a search under constraints begins.

SCIPY = tuple(map(int, scipy.__version__.split(".")[:2]))  # Version.
minimize: Any = optimize.minimize  # Their type hints exclude such functions and options.
minimize_scalar: Any = optimize.minimize_scalar


@dataclass(frozen=True, repr=False)
class Optimum:
    """The refined optimum of an output.

    Parameters
    ----------
    output : str
        The output.
    point : mapping
        Values of the varied parameters.
    value : float
        The output there.
    flat : mapping
        For each varied parameter the range, with the others at the optimum, in which the output is
        within 5 % of the optimum and all constraints hold.
    points : (m, p)
        Parameters of all simulations of the refinement.
    values : (m,)
        The output there; NaN for a failed simulation or a violated constraint.
    robust : (float, float, float) or None
        First and last of the five neighbouring samples of one parameter whose worst output is best,
        and this output.  None with more parameters, with fewer samples, or if all ranges have
        failed simulations.
    constraints : tuple of Constraint
        The conditions, which hold.
    best : (b, p)
        The ten best of all points that differ from each other, the best one first.
    best_values : (b,)
        The output there.
    others : mapping
        Values of all outputs at the optimum.
    spacing : mapping
        Distance of the samples along each parameter.
    ends : mapping
        First and last sample of each parameter, or the ends of its range.
    """

    output: str
    point: Mapping[str, float]
    value: float
    flat: Mapping[str, tuple[float, float]]
    points: Real
    values: Real
    robust: tuple[float, float, float] | None = None
    constraints: Sequence[Constraint] = ()
    best: Real = field(default_factory=lambda: np.empty((0, 0)))
    best_values: Real = field(default_factory=lambda: np.empty(0))
    others: Mapping[str, float] = field(default_factory=dict)
    spacing: Mapping[str, float] = field(default_factory=dict)
    ends: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def bounded(self) -> dict[str, tuple[bool, bool]]:
        """For each parameter whether its flat range ends inside the samples, at both ends."""
        return {
            name: (low > self.ends[name][0], high < self.ends[name][1])
            for name, (low, high) in self.flat.items()
        }

    @property
    def slack(self) -> dict[str, tuple[float, float]]:
        """For each parameter how much less and more of it makes the output 5 % worse.

        The distances are infinite where the flat range reaches the end of the samples.
        """
        found = {}
        for name, (low, high) in self.flat.items():
            x, (below, above) = self.point[name], self.bounded[name]
            found[name] = (x - low if below else math.inf, high - x if above else math.inf)
        return found

    @property
    def narrow(self) -> tuple[str, ...]:
        """Parameters whose flat range is narrower than the distance of the samples."""
        return tuple(
            name
            for name, (low, high) in self.flat.items()
            if all(self.bounded[name]) and high - low < self.spacing[name]
        )

    @property
    def at_ends(self) -> tuple[str, ...]:
        """Parameters that are best at the first or last sample, beyond which may be better ones."""
        return tuple(
            name
            for name, ends in self.ends.items()
            if min(abs(self.point[name] - end) for end in ends) <= EDGE_RTOL * self.spacing[name]
        )

    @property
    def active(self) -> tuple[str, ...]:
        """Texts of the constraints whose output is within 1 % of the bound."""
        return tuple(
            c.text for c in self.constraints if abs(c.excess(self.others[c.output])) < ACTIVE_RTOL
        )

    def __repr__(self) -> str:
        place = ", ".join(f"{name} = {x:.6g}" for name, x in self.point.items())
        return f"<Optimum of {self.output}: {self.value:.6g} at {place}>"


class Search:
    """The search of an optimum around the best samples of a study.

    ``table`` (n, k) has the outputs at its points, NaN for failed simulations.  ``evaluate``
    simulates at points (m, p) and returns all outputs (m, k).
    """

    def __init__(self, plan: Plan, table: Real, evaluate: Callable[[Real], Real]) -> None:
        assert plan.output is not None
        self.evaluate, self.output, self.sign = evaluate, plan.output, plan.sign
        self.names, self.constraints, points = [*plan.varied], plan.constraints, plan.points
        self.index = {name: k for k, name in enumerate(plan.texts)}
        self.bounds = np.column_stack([points.min(axis=0), points.max(axis=0)])
        for k, given in enumerate(plan.varied.values()):
            if isinstance(given, tuple):  # A range from which the points were drawn.
                self.bounds[k] = given
        spaces = [len(points) ** (1 / len(self.names))] * len(self.names)
        if plan.whole_grid:
            spaces = [len(np.unique(x)) - 1 for x in points.T]
        self.sizes = np.ptp(points, axis=0) / np.maximum(spaces, 1)  # Distances of samples.
        self.points, self.found = [*points], [*table]
        self.costs = [self._cost(row) for row in table]
        self.count = len(self.costs)

    def _cost(self, values: Real) -> float:
        """Return the output with its sign; infinite if it has no value or a constraint fails."""
        value = self.sign * float(values[self.index[self.output]])
        allowed = all(c.holds(values[self.index[c.output]]) for c in self.constraints)
        return value if allowed and math.isfinite(value) else math.inf

    @property
    def best(self) -> int:
        """Index of the best point."""
        return int(np.argmin(self.costs))

    @property
    def remedy(self) -> str:
        """What helps if no sample has a value that satisfies the constraints."""
        values = np.array(self.found)[: self.count, self.index[self.output]]
        if self.constraints and np.isfinite(values).any():
            return "loosen them, or vary the parameters further"
        return "simulate longer, or choose another output"

    def _excess(self, values: Real) -> list[float]:
        """Return by how much outputs satisfy the constraints."""
        return [c.excess(values[self.index[c.output]]) for c in self.constraints]

    def _row(self, x: Any) -> Real:
        """Return the outputs at a point (p,), and keep them."""
        point = np.clip(np.atleast_1d(np.asarray(x, float)), *self.bounds.T)
        values: Real = self.evaluate(point[None, :])[0]
        self.points.append(point)
        self.found.append(values)
        self.costs.append(self._cost(values))
        return values

    def value(self, x: Any) -> float:
        """Return the cost at a point (p,)."""
        self._row(x)
        return self.costs[-1]

    def optimum(self) -> Optimum:
        """Refine the best samples and determine the range around the optimum.

        Raises
        ------
        ParameterError
            If no sample has a value of the output and satisfies the constraints.
        """
        if not np.isfinite(self.costs).any() and self.constraints:
            excess = np.array([self._excess(row) for row in self.found])
            excess = np.nan_to_num(excess, nan=-1e3, posinf=-1e3, neginf=-1e3)
            self._descend(int(np.argmax(np.minimum(excess, 0.0).sum(axis=1))))
        if not np.isfinite(self.costs).any():
            which = " that satisfies the constraints" if self.constraints else ""
            raise ParameterError(f"no simulation has a value of {self.output}{which}")
        single = len(self.names) == 1
        if self.constraints and not single:
            self._descend_from_best()
        for _ in range(ROUNDS_MAX):
            if single:
                self._between_neighbours()
            else:
                self._simplex()
            limit = self._limit()
            flat = {
                name: (self._end(j, -1.0, limit), self._end(j, 1.0, limit))
                for j, name in enumerate(self.names)
            }
            if not single or self._limit() == limit:
                break  # Otherwise the output jumps, and the search for the ends met a better point.
        return self._result(flat)

    def _result(self, flat: Mapping[str, tuple[float, float]]) -> Optimum:
        names, points, k, best = self.names, np.array(self.points), self.best, self._distinct()
        costs = np.array(self.costs[self.count :])
        return Optimum(
            self.output,
            dict(zip(names, points[k].tolist(), strict=True)),
            float(self.sign * self.costs[k]),
            flat,
            points[self.count :],
            np.where(np.isfinite(costs), self.sign * costs, math.nan),
            self._robust() if len(names) == 1 else None,
            self.constraints,
            points[best],
            self.sign * np.array(self.costs)[best],
            dict(zip(self.index, map(float, self.found[k]), strict=True)),
            dict(zip(names, self.sizes.tolist(), strict=True)),
            dict(zip(names, map(tuple, self.bounds.tolist()), strict=True)),
        )

    def _distinct(self) -> list[int]:
        """Return the best points that differ by more than :data:`DISTINCT` from better ones."""
        found: list[int] = []
        for j in np.argsort(self.costs, kind="stable"):
            gaps = [np.abs(self.points[j] - self.points[i]) / self.sizes for i in found]
            if math.isfinite(self.costs[j]) and all(gap.max() > DISTINCT for gap in gaps):
                found.append(int(j))
            if len(found) == BEST:
                break
        return found

    def _robust(self) -> tuple[float, float, float] | None:
        """Return the neighbouring samples whose worst output is best, and this output."""
        if self.count < WINDOWS_MIN * NEIGHBOURS:
            return None
        windows = np.lib.stride_tricks.sliding_window_view(self.costs[: self.count], NEIGHBOURS)
        worst = windows.max(axis=1)  # Infinite if a simulation has failed.
        k = int(np.argmin(worst))
        if not math.isfinite(worst[k]):
            return None
        first, last = self.points[k], self.points[k + NEIGHBOURS - 1]
        return float(first[0]), float(last[0]), float(self.sign * worst[k])

    def _limit(self) -> float:
        """Return the cost up to which the output is within 5 % of its optimum."""
        best = min(self.costs)
        return best + FLAT_RTOL * abs(best)

    def _between_neighbours(self) -> None:
        """Refine the best point of one parameter between its neighbours."""
        x, k = np.unique(self.points), float(self.points[self.best][0])
        low, high = max(x[x < k], default=x[0]), min(x[x > k], default=x[-1])
        minimize_scalar(
            self.value, bounds=(low, high), method="bounded",
            options={"xatol": float(REFINED_RTOL * (high - low)), "maxiter": REFINEMENTS_MAX},
        )  # fmt: skip

    def _end(self, j: int, sign: float, limit: float) -> float:
        """Return an end of the range of parameter j in which costs are below a limit.

        The range is that around the best point.  The end is bisected between the last point inside
        and the first one outside; it is the end of the samples if no point is outside.
        """
        points, costs = np.array(self.points), np.array(self.costs)
        point = points[self.best]
        on_line = (np.delete(points, j, 1) == np.delete(point, j)).all(axis=1)
        x, outside = sign * points[on_line, j], ~(costs[on_line] <= limit)
        last = max(sign * self.bounds[j])
        first = min(x[outside & (x > sign * point[j])], default=math.inf)  # Outside.
        inside = max(x[~outside & (x < first)])

        def good(value: float) -> bool:
            point[j] = sign * value
            return self.value(point) <= limit

        while math.isinf(first) and inside < last:
            ahead = min(inside + self.sizes[j], last)
            inside, first = (ahead, first) if good(ahead) else (inside, ahead)
        while math.isfinite(first) and first - inside > EDGE_RTOL * self.sizes[j]:
            middle = 0.5 * (inside + first)
            inside, first = (middle, first) if good(middle) else (inside, middle)
        return float(sign * inside)

    def _simplex(self) -> None:
        """Refine the best point by the simplex of Nelder and Mead, in units of the distances."""
        sizes, start = self.sizes, self.points[self.best]
        inward = np.where(start + 0.5 * sizes <= self.bounds[:, 1], 0.5, -0.5)
        corners = start / sizes + np.vstack([np.zeros(len(sizes)), np.diag(inward)])
        minimize(
            lambda z: min(self.value(z * sizes), 1e300), corners[0], method="Nelder-Mead",
            bounds=self.bounds / sizes[:, None],
            options={"initial_simplex": corners, "maxfev": REFINEMENTS_MAX * len(sizes) // 2,
                     "xatol": REFINED_RTOL, "fatol": 0.0},
        )  # fmt: skip

    def _descend_from_best(self) -> None:
        """Search under constraints from the best samples, and again around the best point."""
        for k in np.argsort(self.costs[: self.count], kind="stable")[:STARTS]:
            self._descend(int(k))
        for _ in range(ROUNDS_MAX):
            before = min(self.costs)
            self._descend(self.best, RESTART_RADIUS)
            if before - min(self.costs) <= REFINED_RTOL * abs(before):
                break

    def _descend(self, k: int, radius: float = 0.5) -> None:
        """Search under constraints from point k by COBYQA, in units of the distances.

        SciPy before 1.14 has its predecessor COBYLA.
        """
        sizes = self.sizes
        scale = max((abs(x) for x in self.costs if math.isfinite(x)), default=1.0) or 1.0
        row = cache(lambda *z: self._row(z * sizes))  # For the cost and for the constraints.

        def cost(z: Real) -> float:
            value = self.sign * float(row(*z)[self.index[self.output]]) / scale
            return value if math.isfinite(value) else 1e3

        def excess(z: Real) -> list[float]:
            found = [x - MARGIN for x in self._excess(row(*z))]
            return [x if math.isfinite(x) else -1e3 for x in found]

        most, last = REFINEMENTS_MAX * len(sizes), 0.1 * REFINED_RTOL
        method, options = "COBYLA", {"maxiter": most, "rhobeg": radius, "tol": last}
        if SCIPY >= (1, 14):
            method, options = "COBYQA", {
                "maxfev": most, "initial_tr_radius": radius, "final_tr_radius": last,
            }  # fmt: skip
        minimize(
            cost, self.points[k] / sizes, method=method, bounds=self.bounds / sizes[:, None],
            constraints={"type": "ineq", "fun": excess}, options=options,
        )  # fmt: skip
