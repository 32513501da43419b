"""The plan of a study: which simulations it has, checked before the first one."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..base.counts import check_count
from ..base.errors import ParameterError
from ..base.names import proposal
from ..files.settings import in_unit, is_tolerance, tolerance
from ..mechanics.arrays import Real
from ..mechanism.parameters import Tolerance, by_name
from ..runs.inputs import Source, placeholders
from .design import SENSITIVITY, distribution, drawn
from .journal import Point
from .mechanism import MechanismModel
from .outputs import CONDITION, Constraint, parse_output
from .table import check_type, numbers, read_table

if TYPE_CHECKING:
    import pandas as pd

    from .fmu_model import FmuModel

RUNS_MAX = 100_000  # More simulations are a mistake in the number of samples.
Vary: TypeAlias = "Mapping[str, Any] | pd.DataFrame | str | Path | None"
Outputs = Sequence[str] | Mapping[str, str]
Model: TypeAlias = "MechanismModel | FmuModel"


class Plan:
    """A checked study: a simulation and rows of parameters.

    Parameters
    ----------
    model : MechanismModel or FmuModel
        What is simulated.
    vary, outputs, runs, method, seed, minimise, maximise, subject_to, tolerances, values, inputs
        As for :func:`prbm.study`.
    options
        Stop time, step, tolerance and engine, likewise.

    Attributes
    ----------
    job : Job
        The simulation.
    varied : dict
        Samples or distributions of the parameters.
    points : (n, p)
        The points.
    whole_grid : bool
        Whether they are all combinations of samples.
    output, sign : str or None, float
        Output to be optimised, and 1 to minimise it or -1 to maximise it.
    constraints : tuple of Constraint
        Conditions on outputs.
    units : dict
        Units of the parameters and outputs.
    spread, beside : dict
        Tolerances around an optimum, and the values of those parameters that are not varied.

    Raises
    ------
    ParameterError, UserMistake
        As :func:`prbm.study`.
    """

    def __init__(
        self,
        model: Model,
        vary: Vary,
        outputs: Outputs,
        *,
        runs: int | None = None,
        method: str = "",
        seed: int = 0,
        minimise: str | None = None,
        maximise: str | None = None,
        subject_to: Sequence[str] = (),
        tolerances: Mapping[str, str | Tolerance] | None = None,
        values: Mapping[str, float | str] | None = None,
        inputs: Mapping[str, Source] | None = None,
        **options: Any,
    ) -> None:
        if minimise is not None and maximise is not None:
            raise ParameterError("minimise and maximise are both given; omit one of them")
        if runs is None and method == SENSITIVITY:
            raise ParameterError(f"the method {method} draws its simulations; give runs (--runs)")
        self.output, self.sign = (minimise, 1.0) if maximise is None else (maximise, -1.0)
        self.method, self.seed = method, seed
        listed = not (vary is None or isinstance(vary, Mapping))
        self.whole_grid = runs is None and not listed
        texts = [subject_to] if isinstance(subject_to, str) else subject_to
        conditions = [_condition(text) for text in texts]
        named = self._named(outputs, [output for _, output, _, _ in conditions])
        self.model = model = model.needing(named.values())
        known = model.units
        kept = tuple(parse_output(text, known, column) for column, text in named.items())
        for output in kept:
            model.check(output)
        sources, given = dict(by_name("inputs", inputs)), model.fixed(values)
        self.values = {**model.values, **given}
        columns = self._columns(vary, runs)
        self._check_names(columns, placeholders(sources), given)
        self.varied, self.points = self._points(columns, listed, runs)
        for name, x in zip(self.varied, self.points.T, strict=True):
            check_type(name, x, model.types.get(name, ""))
        self.units = {n: known.get(n, "") for n in self.varied}
        self.units |= {output.column: output.unit(known) for output in kept}
        self.constraints = tuple(
            Constraint(text, name, relation, in_unit(f"constraint {name}", bound, self.units[name]))
            for text, name, relation, bound in conditions
        )
        first = dict(zip(self.varied, self.points[0].tolist(), strict=True))
        self.job = model.job(first, **options, values=given, outputs=kept, inputs=sources)
        self.spread = self._spread(tolerances or {})
        self.beside = {n: self.values[n] for n in self.spread if n not in self.varied}
        for name, value in self.beside.items():
            distribution(name, value, self.spread[name])  # Report mistakes.

    @property
    def columns(self) -> list[str]:
        """Names of the varied parameters, and of those beside them."""
        return [*self.varied, *self.beside]

    @property
    def texts(self) -> list[str]:
        """Columns of the outputs."""
        return [output.column for output in self.job.outputs]

    @property
    def settings(self) -> dict[str, Any]:
        """All that the outputs depend on, except for the varied parameters, for the journal."""
        job = self.job
        return {
            **self.model.identity,
            "parameters": self.columns,
            "outputs": {o.column: list(astuple(o)[1:]) for o in job.outputs},
            "values": dict(job.values),
            "inputs": {
                name: str(source) if isinstance(source, str | float | int) else repr(source)
                for name, source in job.inputs.items()
            },
            **job.settings,
        }

    def rows(self, points: Real) -> list[Point]:
        """Return the values of all columns at points (n, p)."""
        beside = tuple(self.beside.values())
        return [(*point, *beside) for point in points.tolist()]

    def satisfied(self, table: Real) -> Any:
        """Return which rows (n, k) of outputs satisfy all constraints."""
        index = {text: k for k, text in enumerate(self.texts)}
        held = [c.holds(table[:, index[c.output]]) for c in self.constraints]
        return np.all([np.full(len(table), True), *held], axis=0)

    def _named(self, outputs: Outputs, further: Sequence[str]) -> dict[str, str]:
        """Return outputs by the names of their columns, with those of the optimum and of others."""
        texts = [outputs] if isinstance(outputs, str) else outputs
        named = dict(texts) if isinstance(texts, Mapping) else {text: text for text in texts}
        goal = [] if self.output is None else [self.output]
        named |= {text: text for text in (*goal, *further) if text not in named}
        if not named:
            raise ParameterError("no output is selected; name one, for instance settling")
        return named

    def _columns(self, vary: Vary, runs: int | None) -> Mapping[str, Any]:
        """Return what is given for each varied parameter: of a table its cells and their unit."""
        if isinstance(vary, Mapping):
            return vary
        if vary is None:
            if runs is None or not self.model.tolerances:
                raise ParameterError(
                    "no parameter is varied; give vary, or runs for a mechanism with tolerances"
                )
            return self.model.tolerances
        if runs is not None:
            raise ParameterError("runs are drawn from ranges, not from a table; omit one of them")
        return read_table(vary, self.model.units)

    def _check_names(
        self, columns: Mapping[str, Any], within: set[str], given: Mapping[str, float]
    ) -> None:
        """Reject unknown names, names with two values, and placeholders without one."""
        if not columns:
            raise ParameterError("0 parameters are varied; vary at least one")
        for name in columns:
            known = name in self.model.values
            if not known and name not in within:
                raise ParameterError(self.model.refusal(name))
            if known and name in within:
                raise ParameterError(
                    f"{{{name}}} in an input is also a parameter; choose another name in braces"
                )
            if name in given:
                raise ParameterError(f"{name} is varied and has a fixed value; remove one of them")
        for name in sorted(within - columns.keys()):
            raise ParameterError(
                f"{{{name}}} in an input has no value; vary {name}, or add a column {name}"
            )

    def _points(
        self, columns: Mapping[str, Any], listed: bool, runs: int | None
    ) -> tuple[dict[str, Any], Real]:
        """Return samples or distributions, and the points of a table, of a grid, or drawn ones."""
        if listed:
            varied = {}
            for name, (cells, unit) in columns.items():
                factor = in_unit(name, f"1 {unit}", self._unit(name)) if unit else 1.0
                varied[name] = numbers(name, cells, factor)
            return varied, np.column_stack([*varied.values()])
        if runs is None:
            varied = {name: self._samples(name, x) for name, x in columns.items()}
            count = math.prod(map(len, varied.values()))
        else:
            varied = {name: self._distribution(name, x) for name, x in columns.items()}
            runs = check_count("runs", runs, 1)
            count = runs * (len(varied) + 2 if self.method == SENSITIVITY else 1)
        if count > RUNS_MAX:
            raise ParameterError(f"the study has {count} simulations; reduce them to {RUNS_MAX}")
        if runs is None:  # The last parameter varies fastest.
            return varied, np.array(list(itertools.product(*varied.values())))
        return varied, drawn(varied, runs, self.seed, self.method)

    def _unit(self, name: str) -> str:
        return self.model.units.get(name, "")

    def _samples(self, name: str, sequence: Any) -> Real:
        """Return increasing samples of a parameter, (k,)."""
        unit, given = self._unit(name), np.array(sequence, object).ravel()
        x = np.array([in_unit(name, sample, unit) for sample in given])
        if len(x) < 2 or not (np.isfinite(x).all() and (np.diff(x) > 0.0).all()):
            raise ParameterError(
                f"{name}: at least two samples are needed, finite and increasing"
                + (f", in {unit}" if unit else "")
            )
        return x

    def _distribution(self, name: str, given: Any) -> Any:
        """Return the distribution of a parameter, from a pair, a tolerance or a distribution."""
        value = self.values.get(name, math.nan)
        if isinstance(given, str):
            if not is_tolerance(given):
                raise ParameterError(
                    f'{name} = {given}: write a tolerance, for instance "0.1 mm +- 2 %"'
                )
            nominal, given = tolerance(given, self._unit(name), f"{name} =")
            value = value if nominal is None else nominal
        if isinstance(given, Tolerance):
            if not math.isfinite(value):
                raise ParameterError(f"{name} has a tolerance, but no value; write it before +-")
            return distribution(name, value, given)
        if hasattr(given, "ppf"):
            return given
        ends = self._samples(name, given)
        if len(ends) != 2:
            raise ParameterError(f"{name}: with runs, give a range (low, high) or a distribution")
        return float(ends[0]), float(ends[1])

    def _spread(self, given: Mapping[str, str | Tolerance]) -> dict[str, Tolerance]:
        """Return the checked tolerances around an optimum under constraints."""
        if self.output is None or not self.constraints:
            if given:
                raise ParameterError(
                    "tolerances give the yield around an optimum; give an output to optimise and "
                    "constraints, or vary the parameters within their tolerances"
                )
            return {}
        found = dict(self.model.tolerances)
        for name, text in given.items():
            every = dict.fromkeys([*self.varied, *self.values])
            if name not in every:
                raise ParameterError(f"the tolerance of {name}: {proposal(name, every)}")
            if isinstance(text, str):
                _, text = tolerance(text, self._unit(name), f"{name} =")
            found[name] = text
        return found


def _condition(text: str) -> tuple[str, str, str, str]:
    """Return the text, output, relation and bound of a text such as ``fundamental > 40 Hz``."""
    found = CONDITION.fullmatch(text)
    if found is None:
        raise ParameterError(f'constraint {text}: write it as in "fundamental > 40 Hz"')
    return text.strip(), found[1].strip(), found[2], found[3].strip()
