"""A mechanism as the model of a study: simulations without an FMU."""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from time import perf_counter
from typing import Any

from ..analysis.static_shape import equilibrium
from ..base.errors import PrbmError
from ..base.names import unknown
from ..base.version import __version__
from ..files.settings import in_si, in_unit
from ..hybrid.configuration import checked_tolerance
from ..hybrid.given import start_values
from ..hybrid.simulation import Simulation
from ..interface.tables import tables
from ..interface.variables import variables
from ..mechanics.arrays import Real
from ..mechanics.stress import with_stress
from ..mechanism.description import Mechanism
from ..mechanism.parameters import Tolerance
from ..runs.engine import PYTHON, check_engine, kernel_available
from ..runs.experiment import experiment
from ..runs.inputs import Source, filled, placeholders, signals
from ..runs.result import names as column_names
from ..runs.run import communication_points, sampled, simulate
from .outputs import FAILED, OK, Outcome, Output, evaluate, parse_output

STEPS = 4000  # Communication steps of a simulation, which resolve the vibration after impacts.


class MechanismModel:
    """A mechanism, a :class:`prbm.sweeps.plan.Model`."""

    owner = "the mechanism"
    outputs = ()

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.name, self.title = mechanism, mechanism.name, mechanism.title
        self.tolerances: Mapping[str, Tolerance] = mechanism.tolerances

    @cached_property
    def units(self) -> dict[str, str]:
        """The units of all variables by name."""
        every = variables(self.mechanism, Simulation(self.mechanism).outputs())
        return {variable.name: variable.unit for variable in every}

    @cached_property
    def values(self) -> dict[str, float]:
        """The values of all parameters and inputs."""
        return {**self.mechanism.values(), **Simulation(self.mechanism).given}

    @property
    def identity(self) -> dict[str, str]:
        """The version of the package, and a hash of the mechanism."""
        described = tables(self.mechanism, (), "", range(0))
        described += repr(self.mechanism.values()).encode()
        return {"version": __version__, "mechanism": hashlib.sha256(described).hexdigest()}

    def needing(self, outputs: Iterable[str]) -> "MechanismModel":
        """Return the mechanism, with the stress outputs of all flexures if outputs need them."""
        stressed = MechanismModel(with_stress(self.mechanism))
        every = stressed.units
        needed = {name for text in outputs for name in parse_output(text, every).variables(every)}
        return stressed if needed & (every.keys() - self.units.keys()) else self

    def refusal(self, name: str) -> str:
        """Return why a variable cannot be set: it is unknown."""
        return unknown(name, self.values)

    def check_output(self, output: Output) -> None:
        """Reject an output that the mechanism does not have.

        Raises
        ------
        ParameterError
            As :meth:`Output.check`.
        """
        output.check(self.units, self.owner)

    def check_column(self, name: str, x: Real) -> None:
        """Accept values (n,): a simulation reports those that are out of bounds."""

    def fixed(self, values: Mapping[str, float | str] | None) -> dict[str, float]:
        """Return values of all simulations in SI.

        Raises
        ------
        ParameterError
            If a name is unknown.
        UserMistake
            If a text is not a quantity of the right dimension.
        """
        return in_si(self.mechanism, values)

    def job(
        self,
        outputs: tuple[Output, ...],
        values: Mapping[str, float],
        inputs: Mapping[str, Source],
        row: Mapping[str, float],
        options: tuple[Any, Any, Any, Any],
    ) -> "MechanismJob":
        """Return the simulations, from stop time, step, tolerance and engine.

        Raises
        ------
        ParameterError, UserMistake
            If a value or an option is invalid, so that every simulation would fail, or the signals
            with the numbers of the first row.
        """
        stop_time, step, tolerance, engine = options
        check_engine(engine)
        if engine is None and not kernel_available():  # Compiled and reported here, not by workers.
            engine = PYTHON
        signals(self.mechanism, filled(inputs, row), {**values, **row})
        start_values(self.mechanism, values, 0.0)
        if stop_time is None:
            stop = experiment(self.mechanism, values, engine).stop_time
        else:
            stop = in_unit("stop_time", stop_time, "s")
        spacing = stop / STEPS if step is None else in_unit("step", step, "s")
        communication_points(stop, spacing)
        if tolerance is not None:
            tolerance = checked_tolerance(in_unit("tolerance", tolerance, ""))
        return MechanismJob(
            self.mechanism, outputs, values, inputs, stop, spacing, tolerance, engine,
            tuple(self.units),
        )  # fmt: skip


@dataclass(frozen=True)
class MechanismJob:
    """Simulations of a mechanism, a :class:`prbm.sweeps.children.Job`.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    outputs : tuple of Output
        The outputs.
    values : mapping
        Parameters and inputs of all simulations, in SI.
    inputs : mapping
        Inputs over time of all simulations.
    stop, step : float
        Duration, and time between samples [s].
    tolerance : float or None
        Relative tolerance; None: ``solver.tolerance``.
    engine : str or None
        As for :func:`prbm.simulate`.
    names : tuple of str
        Names of all variables of the mechanism.
    """

    mechanism: Mechanism
    outputs: tuple[Output, ...]
    values: Mapping[str, float]
    inputs: Mapping[str, Source]
    stop: float
    step: float
    tolerance: float | None
    engine: str | None
    names: tuple[str, ...]

    @property
    def settings(self) -> dict[str, Any]:
        """Times, tolerance and engine, for the journal."""
        return {
            "stop time [s]": self.stop, "step [s]": self.step, "tolerance": self.tolerance,
            "engine": self.engine,
        }  # fmt: skip

    @property
    def parallel(self) -> bool:
        """Whether the engine lets other threads work meanwhile, as the kernel does."""
        return self.engine != PYTHON

    @contextmanager
    def placed(self) -> Iterator[Callable[[], Callable[[Mapping[str, float]], Outcome]]]:
        """Yield a function that returns :meth:`run`: the job has all that it needs."""
        yield partial(getattr, self, "run")

    def run(self, values: Mapping[str, float]) -> Outcome:
        """Simulate once; errors of the simulation are returned as outcomes."""
        begin = perf_counter()
        try:
            found = self._values(values)
        except PrbmError as error:
            return Outcome(FAILED, str(error), perf_counter() - begin)
        return Outcome(OK, "", perf_counter() - begin, found)

    def _values(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """Return the outputs."""
        within = placeholders(self.inputs)
        given = {**self.values, **{n: x for n, x in values.items() if n not in within}}
        static = [output for output in self.outputs if output.static]
        shape = equilibrium(self.mechanism, self._parameters(given)) if static else None
        columns, impacts = {}, ()  # type: ignore[var-annotated]
        if len(static) < len(self.outputs):
            columns, impacts = self._motion(given, filled(self.inputs, values))
        return tuple(
            output.at_rest(shape) if output.static else evaluate(output, columns, impacts)
            for output in self.outputs
        )

    def _parameters(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return the parameters among values; a static shape has no inputs."""
        return {p.name: given[p.name] for p in self.mechanism.parameters if p.name in given}

    def _motion(self, given: Mapping[str, float], inputs: Mapping[str, Source]) -> tuple[Any, Any]:
        """Return the columns that the outputs need, and the impacts."""
        options: Any = {"tolerance": self.tolerance, "engine": self.engine}
        if inputs:
            result = simulate(
                self.mechanism, given, inputs=inputs, stop_time=self.stop, step=self.step,
                **options,
            )  # fmt: skip
            return {
                name: result.columns[name] for name in column_names(result.columns)
            }, result.impacts
        needed = {name for o in self.outputs if not o.static for name in o.variables(self.names)}
        history = any(output.history for output in self.outputs)
        step = self.step if history else self.stop
        at_impacts = any(output.at_impacts for output in self.outputs)
        return sampled(
            self.mechanism, given, sorted(needed), stop_time=self.stop, step=step,
            at_impacts=at_impacts, **options,
        )  # fmt: skip
