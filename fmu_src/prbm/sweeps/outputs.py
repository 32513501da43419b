"""Outputs of a run: one number each, from the trajectories of variables or a named quantity.

The module imports NumPy only, and so starts quickly.
"""

import re
from collections.abc import Callable, Collection, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.errors import ParameterError
from ..base.names import proposal
from ..hybrid.records import Impact
from ..runs.quantities import QUANTITIES

Real = NDArray[np.float64]
OK, ENDED, FAILED, CRASHED, TIMEOUT = "ok", "ended", "failed", "crashed", "timeout"
"""Status of a run: complete; ended early by the FMU; error; crash of the process; time limit."""
GOOD = OK, ENDED

QUANTITY = "quantity"  # Reduction of a named quantity.
MODE, REST = "mode", "rest"  # Reductions of outputs without a simulation.
FUNDAMENTAL = "fundamental"  # Name of the first frequency at rest.
SMOOTH = ("x", "y", "angle", "vx", "vy", "omega", "gap", "gap_rate")
"""Ends of names of outputs that are smooth between impacts, so that a parabola finds extremes."""
CLOSE = 1e-3  # Points with less than this share of the usual distance belong to an impact.
PULSES = {
    "force": "peak_force", "stress": "peak_stress", "stress_start": "peak_stress",
    "stress_end": "peak_stress",
}  # fmt: skip
"""Ends of the names of outputs with pulses shorter than a step, and the quantity that sees them."""
OF_IMPACTS = (
    "approach_speed", "rebound_speed", "impulse", "energy_lost", "modal_restitution", "peak_force",
    "indentation", "contact_duration",
)  # fmt: skip
"""Outputs of stops that each impact replaces."""

EXTREMES = ("max", "min")  # Reductions.
TIMES = ("first", "since")  # Reductions whose value is a time.
PLACES = {"x": "m", "y": "m", "angle": "rad"}  # Outputs of a rest position, and their units.
NAMES_LISTED_MAX = 12  # Messages about unknown variables do not list more names.


# --- outputs ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Output:
    """One number computed from the trajectory of a variable.

    Parameters
    ----------
    column : str
        Name of the column of the results.
    variable : str
        Name of the variable of the FMU.
    reduction : str
        ``final``, ``max``, ``min``, ``mean``, ``first``, ``since``, or ``quantity`` for a named
        quantity (:data:`prbm.runs.quantities.QUANTITIES`).
    relation, bound : str, float
        Condition of ``first`` and ``since``: ``>``, ``>=``, ``<`` or ``<=``, and a number.
    absolute : bool
        Whether the absolute value of the variable is reduced.
    """

    column: str
    variable: str
    reduction: str = "final"
    relation: str = ">"
    bound: float = 0.0
    absolute: bool = False

    @property
    def static(self) -> bool:
        """Whether the output is that of a rest position, without a simulation."""
        return self.reduction in (MODE, REST)

    @property
    def last(self) -> str:
        """Last word of the variable."""
        return self.variable.rpartition(".")[2]

    @property
    def history(self) -> bool:
        """Whether all communication points are needed, not only the last one and the impacts."""
        if self.reduction == QUANTITY:
            return QUANTITIES[self.variable].history
        extreme = self.reduction in EXTREMES and self.last not in OF_IMPACTS
        return extreme or self.reduction in ("mean", *TIMES)

    def unit(self, units: Mapping[str, str]) -> str:
        """Return the unit of the value, from those of the variables."""
        if self.reduction == QUANTITY:
            return QUANTITIES[self.variable].unit
        if self.reduction == MODE:
            return "Hz"
        if self.reduction == REST:
            return PLACES[self.last]
        return "s" if self.reduction in TIMES else units[self.variable]

    def at_rest(self, shape: Any) -> float:
        """Return the value of a static output for a static shape.

        Raises
        ------
        ParameterError
            If the mechanism has fewer modes.
        """
        if self.reduction == REST:
            body = self.variable.rpartition(".")[0]
            return float(getattr(shape.positions[body], self.last))
        if self.variable == FUNDAMENTAL:
            return float(shape.fundamental)
        found, k = shape.modes.frequency, int(self.variable)
        if k > len(found):
            raise ParameterError(f"{self.column}: the mechanism has {len(found)} modes only")
        return float(found[k - 1])

    def variables(self, names: Iterable[str]) -> list[str]:
        """Return the variables among names that are needed."""
        if self.reduction == QUANTITY:
            return QUANTITIES[self.variable].variables(names)
        return [self.variable]

    def check(self, names: Collection[str], owner: str) -> None:
        """Reject an output that cannot be computed from the variables of an owner, ``the FMU``.

        Raises
        ------
        ParameterError
            If a variable is unknown; or if samples can miss the extreme, that of the force of a
            compliant stop or of a stress, and the peak is a variable.
        """
        part = self.variable.rpartition(".")[0]
        if self.reduction == REST and (self.last not in PLACES or self.variable not in names):
            raise self._error("write rest(BODY.x), rest(BODY.y) or rest(BODY.angle)")
        if self.static:
            return
        peak = PULSES.get(self.last, "") if part else ""
        if self.reduction in EXTREMES and peak and f"{part}.{peak}" in names:
            raise self._error(
                f"{self.variable} is a pulse that may pass between two samples; use {peak}, the "
                f"largest of the whole motion, or max({part}.{peak})"
            )
        if self.reduction == QUANTITY:
            quantity = QUANTITIES[self.variable]
            if lacking := quantity.lacking(names):
                remedy = f"; {quantity.remedy}" * bool(quantity.remedy)
                raise self._error(
                    f"{owner} has no variable {lacking}, from which it is computed{remedy}"
                )
        elif self.variable not in names:
            hint = proposal(self.variable, dict.fromkeys([*names, *QUANTITIES]))
            if hint.startswith("known") and len(names) > NAMES_LISTED_MAX:
                hint = f"named quantities are {', '.join(QUANTITIES)}"
            raise self._error(f"{owner} has no variable {self.variable!r}; {hint}")

    def _error(self, reason: str) -> ParameterError:
        return ParameterError(f"output {self.column}: {reason}")


RELATIONS: dict[str, Callable[[Real, float], NDArray[np.bool_]]] = {
    ">": np.greater, ">=": np.greater_equal, "<": np.less, "<=": np.less_equal,
}  # fmt: skip


@dataclass(frozen=True)
class Constraint:
    """A condition on an output: its text as it was given, and its parts with the bound in SI."""

    text: str
    output: str
    relation: str
    bound: float

    def holds(self, values: Real) -> Any:
        """Return whether values satisfy the condition; NaN does not."""
        return RELATIONS[self.relation](values, self.bound)

    def excess(self, value: float) -> float:
        """Return by how much a value satisfies the condition, relative to the bound; >= 0: it does.

        Examples
        --------
        >>> Constraint("f > 40 Hz", "f", ">", 40.0).excess(50.0)
        0.25
        """
        sign = 1.0 if self.relation[0] == ">" else -1.0
        return sign * (value - self.bound) / (abs(self.bound) or 1.0)


_REDUCTION = re.compile(r"(final|max|min|mean|first|since)\((.*)\)", re.DOTALL)
_STATIC = re.compile(r"(mode)\(\s*([1-9]\d{0,3})\s*\)|(rest)\((.*)\)")
_ABSOLUTE = re.compile(r"abs\((.*)\)", re.DOTALL)
CONDITION = re.compile(r"(.*[^<>=])(<=|>=|<|>)([^<>=()]*)", re.DOTALL)  # "shuttle.x > 0.001".


def parse_output(text: str, known: Container[str], column: str | None = None) -> Output:
    """Parse an output such as ``max(abs(shuttle.x))``, ``since(stop.contact)`` or ``settling``.

    A variable takes precedence over a named quantity and over a reduction.

    Raises
    ------
    ParameterError
        If the bound of a condition is not a number.

    Examples
    --------
    >>> parse_output("since(stop.contact)", {"stop.contact"}).reduction
    'since'
    >>> parse_output("first(shuttle.x < -1e-3)", {"shuttle.x"}, "there").bound
    -0.001
    >>> parse_output("max(abs(shuttle.x))", {"shuttle.x"}).absolute
    True
    """
    name, text = text if column is None else column, text if text in known else text.strip()
    if text in known:
        return Output(name, text)
    if text == FUNDAMENTAL:
        return Output(name, FUNDAMENTAL, MODE)
    if static := _STATIC.fullmatch(text):
        return Output(name, (static[2] or static[4]).strip(), static[1] or static[3])
    if text in QUANTITIES:
        return Output(name, text, QUANTITY)
    call = _REDUCTION.fullmatch(text)
    reduction, variable = (call[1], call[2].strip()) if call else ("final", text)
    relation, bound = ">", 0.0
    condition = CONDITION.fullmatch(variable)
    if condition and reduction in TIMES and variable not in known:
        variable, relation = condition[1].rstrip(), condition[2]
        try:
            bound = float(condition[3])
        except ValueError:
            raise ParameterError(
                f"output {text}: bound {condition[3].strip()!r} must be a number, as in "
                "first(shuttle.x > 0.001)"
            ) from None
    inner = None if variable in known else _ABSOLUTE.fullmatch(variable)
    variable = inner[1].strip() if inner else variable
    return Output(name, variable, reduction, relation, bound, inner is not None)


def evaluate(
    output: Output,
    columns: Mapping[str, NDArray[Any]],
    impacts: Sequence[Impact] | None = None,
) -> float:
    """Return the value of an output from the columns ``time`` and its variables.

    Only the last value is needed for ``final``.  If the engine has recorded all impacts, named
    quantities and extremes see each of them, also of several between two communication points, and
    extremes of positions and velocities are those of parabolas through the points.

    Examples
    --------
    >>> columns = {"time": np.array([0.0, 1.0]), "x": np.array([-3.0, 2.0])}
    >>> evaluate(parse_output("max(abs(x))", columns), columns)
    3.0
    """
    if output.reduction == QUANTITY:
        return QUANTITIES[output.variable].value(columns, impacts or ())
    x = np.asarray(columns[output.variable], np.float64)
    if output.reduction in EXTREMES:
        between = np.empty(0)
        if impacts is not None:
            between = _between(output, columns["time"], x, [impact.time for impact in impacts])
        x = np.concatenate((x, _at_impacts(output.variable, impacts or ()), between))
    return reduce(output, columns["time"], np.abs(x) if output.absolute else x)


def _between(output: Output, t: Real, x: Real, hits: Sequence[float]) -> Real:
    """Return the extremes between samples of a smooth output, (k,).

    An extreme is that of the parabola through a sample and its neighbours, if there is no impact
    after the first and until the last of the three times.

    Examples
    --------
    >>> t = np.array([0.0, 1.0, 3.0, 4.0])
    >>> found = _between(Output("y", "b.y", "max"), t, 7.0 - (t - 1.5) ** 2, [])
    >>> found.tolist(), _between(Output("y", "b.y", "max"), t, t * (3.0 - t), [1.2]).tolist()
    ([7.0], [])
    """
    if output.last not in SMOOTH or len(t) < 3:
        return np.empty(0)
    h, slope = np.diff(t), np.diff(x) / np.diff(t)
    before, after = slope[:-1], slope[1:]
    count = np.searchsorted(np.sort(hits), t, side="right")  # Impacts until each time.
    k = np.flatnonzero(
        (before * after < 0.0)
        & (count[2:] == count[:-2])
        & (np.minimum(h[:-1], h[1:]) > CLOSE * np.median(h))
    )
    curve = (after[k] - before[k]) / (h[k] + h[k + 1])
    # x = x_k + s (t - t_k) + curve (t - t_k)^2 with s the slope of the parabola at t_k.
    s = before[k] + curve * h[k]
    return np.asarray(x[k + 1] - s**2 / (4.0 * curve))


def _at_impacts(variable: str, impacts: Sequence[Impact]) -> list[float]:
    """Return the values of an output of a stop at its impacts.

    Other outputs have none.  The gap at an impact is 0, or the negative largest indentation of a
    compliant stop.
    """
    stop, _, name = variable.rpartition(".")
    own = [impact.latched for impact in impacts if impact.stop == stop]
    if name == "gap":
        return [-latched.indentation for latched in own]
    return [getattr(latched, name) for latched in own] if name in OF_IMPACTS else []


def reduce(output: Output, t: Real, x: Real) -> float:
    """Return the value of an output for the values x of its variable at times t [s], (m,).

    ``final``, ``max``, ``min``: in the unit of the variable.  ``mean``: average over time by the
    trapezoidal rule.  ``first``: the first of the times at which the condition holds [s];
    ``since``: the first one from which on it holds to the end [s]; NaN if none qualifies.

    Examples
    --------
    >>> t, x = np.array([0.0, 1.0, 2.0, 4.0]), np.array([0.0, 2.0, 0.0, 2.0])
    >>> [reduce(Output("", "x", how), t, x) for how in ("final", "max", "mean", "first", "since")]
    [2.0, 2.0, 1.0, 1.0, 4.0]
    """
    match output.reduction:
        case "final":
            return float(x[-1])
        case "max":
            return float(x.max())
        case "min":
            return float(x.min())
        case "mean":
            span = float(t[-1] - t[0])
            return float(np.diff(t) @ (x[1:] + x[:-1])) / (2 * span) if span > 0.0 else float(x[0])
    holds = RELATIONS[output.relation](x, output.bound)
    if output.reduction == "first":
        return float(t[holds.argmax()]) if holds.any() else nan
    broken = np.flatnonzero(~holds)
    begin = int(broken[-1]) + 1 if len(broken) else 0
    return float(t[begin]) if begin < len(t) else nan


@dataclass(frozen=True)
class Outcome:
    """The result of a run.

    ``values`` are the outputs in the order of the job, empty for a failed run.  ``spent``: the
    process must not be used for further runs.
    """

    status: str
    message: str = ""
    values: tuple[float, ...] = ()
    spent: bool = False
