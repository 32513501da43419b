"""The plan of a study: which simulations it has, checked before the first one."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..base.errors import ParameterError
from ..base.names import proposal
from ..files.settings import in_unit
from ..mechanics.arrays import Real
from ..mechanism.parameters import Tolerance
from ..runs.inputs import Source, placeholders
from .design import SENSITIVITY, distribution, drawn, grid
from .journal import Point
from .mechanism import MechanismModel
from .optimum import Constraint
from .outputs import parse_output
from .table import check_separator, numbers, read_table

if TYPE_CHECKING:
    import pandas as pd

    from .fmu_model import FmuModel

RUNS_MAX = 100_000  # More simulations are a mistake in the number of samples.
CONDITION = re.compile(r"(.*[^<>=])(<=|>=|<|>)([^<>=()]*)", re.DOTALL)  # "fundamental > 40 Hz".
Vary: TypeAlias = "Mapping[str, Any] | pd.DataFrame | str | Path | None"
Outputs = Sequence[str] | Mapping[str, str]
Model: TypeAlias = "MechanismModel | FmuModel"


@dataclass(frozen=True)
class Plan:
    """A checked study: a simulation and rows of parameters.

    Parameters
    ----------
    job : MechanismJob or Job
        The simulation.
    identity : mapping
        What identifies the mechanism or the FMU.
    varied : mapping
        Samples or distributions of the parameters.
    points : (n, p)
        The points.
    goal : (str, float) or None
        Output to be optimised, and 1 to minimise it or -1 to maximise it.
    constraints : tuple of Constraint
        Conditions on outputs.
    design : (bool, str, int)
        Whether the points are a grid, the method and the seed.
    units : mapping
        Units of the parameters and outputs.
    spread : mapping
        Tolerances around an optimum.
    beside : mapping
        Values of the parameters with a tolerance that are not varied.
    """

    job: Any
    identity: Mapping[str, str]
    varied: Mapping[str, Any]
    points: Real
    goal: tuple[str, float] | None
    constraints: tuple[Constraint, ...]
    design: tuple[bool, str, int]
    units: Mapping[str, str]
    spread: Mapping[str, Tolerance] = field(default_factory=dict)
    beside: Mapping[str, float] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of the varied parameters."""
        return [*self.varied]

    @property
    def columns(self) -> list[str]:
        """Names of the varied parameters, and of those beside them."""
        return [*self.varied, *self.beside]

    def rows(self, points: Real) -> list[Point]:
        """Return the values of all columns at points (n, p)."""
        beside = tuple(self.beside.values())
        return [(*point, *beside) for point in points.tolist()]

    @property
    def texts(self) -> list[str]:
        """Columns of the outputs."""
        return [output.column for output in self.job.outputs]

    @property
    def settings(self) -> dict[str, Any]:
        """All that the outputs depend on, except for the varied parameters, for the journal."""
        job = self.job
        return {
            **self.identity,
            "parameters": self.columns,
            "outputs": {o.column: list(astuple(o)[1:]) for o in job.outputs},
            "values": dict(job.values),
            "inputs": {name: _described(source) for name, source in job.inputs.items()},
            **job.settings,
        }


def _described(source: Source) -> str:
    """Return a text that identifies an input over time."""
    return str(source) if isinstance(source, str | float | int) else repr(source)


def planned(
    model: Model,
    vary: Vary,
    outputs: Outputs,
    runs: int | None = None,
    drawing: tuple[str, int] = ("", 0),
    goal: tuple[str, float] | None = None,
    subject_to: Sequence[str] = (),
    values: Mapping[str, float | str] | None = None,
    inputs: Mapping[str, Source] | None = None,
    options: tuple[Any, Any, Any, Any] = (None,) * 4,
) -> Plan:
    """Return the checked study of a model.

    Parameters
    ----------
    model : MechanismModel or FmuModel
        What is simulated.
    vary, outputs, runs, subject_to, values, inputs
        As for :func:`study`; the keys of a mapping of outputs are the names of their columns.
    drawing, goal, options : tuple
        Method and seed; the output to be optimised and 1 to minimise it or -1 to maximise it; stop
        time, step, tolerance and engine.

    Raises
    ------
    ParameterError, UserMistake
        As :func:`study`.
    """
    conditions = [_condition(text) for text in subject_to]
    texts = [outputs] if isinstance(outputs, str) else outputs
    named = dict(texts) if isinstance(texts, Mapping) else {text: text for text in texts}
    further = [*([goal[0]] if goal else []), *(output for _, output, _, _ in conditions)]
    named |= {text: text for text in further if text not in named}
    if not named:
        raise ParameterError("no output is selected; name one, for instance settling")
    model = model.needing(named.values())
    known = model.units
    kept = tuple(parse_output(text, known, column) for column, text in named.items())
    for output in kept:
        model.check_output(output)
    sources = dict(inputs or {})
    given = model.fixed(values)
    columns = _columns(vary, runs, model)
    listed = not (vary is None or isinstance(vary, Mapping))
    _check_names(model, columns, placeholders(sources), given)
    varied, points = _points(columns, listed, runs, drawing, known, {**model.values, **given})
    for name, x in zip(varied, points.T, strict=True):
        model.check_column(name, x)
    shown = {n: known.get(n, "") for n in varied} | {o.column: o.unit(known) for o in kept}
    constraints = tuple(
        Constraint(text, name, relation, in_unit(f"constraint {name}", bound, shown[name]))
        for text, name, relation, bound in conditions
    )
    first = dict(zip(varied, points[0].tolist(), strict=True))
    job = model.job(kept, given, sources, first, options)
    whole = runs is None and not listed
    return Plan(job, model.identity, varied, points, goal, constraints, (whole, *drawing), shown)


def _columns(vary: Vary, runs: int | None, model: Model) -> Mapping[str, Any]:
    """Return what is given for each varied parameter: of a table its cells and their unit."""
    if vary is None:
        if runs is None or not model.tolerances:
            raise ParameterError(
                "no parameter is varied; give vary, or runs for a mechanism with tolerances"
            )
        return model.tolerances
    if isinstance(vary, Mapping):
        return vary
    if runs is not None:
        raise ParameterError("runs are drawn from ranges, not from a table; omit one of them")
    return read_table(vary, model.units)


def _points(
    vary: Mapping[str, Any],
    listed: bool,
    runs: int | None,
    drawing: tuple[str, int],
    known: Mapping[str, str],
    base: Mapping[str, float],
) -> tuple[dict[str, Any], Real]:
    """Return samples or distributions, and the points of a table, of a grid, or drawn ones."""
    if listed:
        varied = {
            n: numbers(n, x, in_unit(n, f"1 {unit}", known.get(n, "")) if unit else 1.0)
            for n, (x, unit) in vary.items()
        }
        return varied, np.column_stack([*varied.values()])
    if runs is None:
        varied = {n: _samples(n, x, known) for n, x in vary.items()}
        count = math.prod(map(len, varied.values()))
    else:
        varied = {n: _distribution(n, x, known, base) for n, x in vary.items()}
        count = runs * (len(varied) + 2 if drawing[0] == SENSITIVITY else 1)
    if count > RUNS_MAX:
        raise ParameterError(f"the study has {count} simulations; reduce them to {RUNS_MAX}")
    return varied, grid(varied) if runs is None else drawn(varied, runs, drawing[1], drawing[0])


def _check_names(
    model: Model, vary: Mapping[str, Any], within: set[str], given: Mapping[str, float]
) -> None:
    """Reject unknown names, names with two values, and placeholders without one."""
    if not vary:
        raise ParameterError("0 parameters are varied; vary at least one")
    for name in vary:
        if name not in model.values and name not in within:
            check_separator(name)
            raise ParameterError(model.refusal(name))
        if name in model.values and name in within:
            raise ParameterError(
                f"{{{name}}} in an input is also a parameter; choose another name in braces"
            )
        if name in given:
            raise ParameterError(f"{name} is varied and has a fixed value; remove one of them")
    for name in sorted(within - vary.keys()):
        raise ParameterError(
            f"{{{name}}} in an input has no value; vary {name}, or add a column {name}"
        )


def _samples(name: str, sequence: Any, known: Mapping[str, str]) -> Real:
    """Return increasing samples of a parameter, (k,)."""
    given = np.array(sequence, object).ravel()
    x = np.array([in_unit(name, sample, known.get(name, "")) for sample in given])
    if len(x) < 2 or not (np.isfinite(x).all() and (np.diff(x) > 0.0).all()):
        raise ParameterError(
            f"{name}: at least two samples are needed, finite and increasing"
            + (f", in {known[name]}" if known.get(name) else "")
        )
    return x


def _distribution(
    name: str, given: Any, known: Mapping[str, str], base: Mapping[str, float]
) -> Any:
    """Return the distribution of a parameter, from a pair, a tolerance or a distribution."""
    unit = known.get(name, "")
    if isinstance(given, str):
        from ..files.settings import is_tolerance, tolerance  # imported here: pint

        if not is_tolerance(given):
            raise ParameterError(
                f'{name} = {given}: write a tolerance, for instance "0.1 mm +- 2 %"'
            )
        nominal, given = tolerance(given, unit, f"{name} =")
        if nominal is not None:
            base = {name: nominal}
    if isinstance(given, Tolerance):
        if not math.isfinite(base.get(name, math.nan)):
            raise ParameterError(f"{name} has a tolerance, but no value; write it before +-")
        return _law(name, base[name], given)
    if hasattr(given, "ppf"):
        return given
    ends = _samples(name, given, known)
    if len(ends) != 2:
        raise ParameterError(f"{name}: with runs, give a range (low, high) or a distribution")
    return float(ends[0]), float(ends[1])


def with_spread(plan: Plan, model: Model, given: Mapping[str, str | Tolerance]) -> Plan:
    """Return the plan with the checked tolerances around an optimum under constraints.

    Raises
    ------
    ParameterError, UserMistake
        If one is invalid, or there is no optimum under constraints.
    """
    from ..files.settings import tolerance  # imported here: pint

    if not (plan.goal and plan.constraints):
        if given:
            raise ParameterError(
                "tolerances give the yield around an optimum; give an output to optimise and "
                "constraints, or vary the parameters within their tolerances"
            )
        return plan
    values = {**model.values, **plan.job.values}
    found = dict(model.tolerances)
    for name, text in given.items():
        if name not in values and name not in plan.varied:
            every = dict.fromkeys([*plan.varied, *values])
            raise ParameterError(f"the tolerance of {name}: {proposal(name, every)}")
        unit = model.units.get(name, "")
        found[name] = tolerance(text, unit, f"{name} =")[1] if isinstance(text, str) else text
    beside = {name: values[name] for name in found if name not in plan.varied}
    for name, value in beside.items():
        _law(name, value, found[name])  # Report mistakes.
    return replace(plan, spread=found, beside=beside)


def _law(name: str, value: float, tolerance: Tolerance) -> Any:
    """Return the distribution of a parameter with a tolerance."""
    try:
        return distribution(value, tolerance)
    except ParameterError as error:
        raise ParameterError(f"{name}: {error}") from None


def _condition(text: str) -> tuple[str, str, str, str]:
    """Return the text, output, relation and bound of a text such as ``fundamental > 40 Hz``."""
    found = CONDITION.fullmatch(text)
    if found is None:
        raise ParameterError(f'constraint {text}: write it as in "fundamental > 40 Hz"')
    return text.strip(), found[1].strip(), found[2], found[3].strip()
