"""A mechanism as the model of a study: simulations without an FMU."""

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
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
from ..mechanics.stress import with_stress
from ..mechanism.description import Mechanism
from ..mechanism.parameters import Tolerance
from ..runs.engine import PYTHON, check_engine, kernel_available
from ..runs.experiment import experiment
from ..runs.inputs import Source, filled, signals
from ..runs.run import communication_points, sampled
from .children import Job, Row
from .outputs import FAILED, OK, Outcome, Output, evaluate, parse_output

STEPS = 4000  # Communication steps of a simulation, which resolve the vibration after impacts.


class MechanismModel:
    """A mechanism, a :class:`prbm.sweeps.plan.Model`."""

    outputs: tuple[str, ...] = ()
    types: Mapping[str, str] = {}  # Of variables that are no floating-point numbers.

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

    def check(self, output: Output) -> None:
        """Reject an output that cannot be computed."""
        output.check(self.units, "the mechanism")

    def refusal(self, name: str) -> str:
        """Return why a variable cannot be set: it is unknown."""
        return unknown(name, self.values)

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
        row: Mapping[str, float],
        stop_time: Any = None,
        step: Any = None,
        tolerance: Any = None,
        engine: str | None = None,
        **given: Any,
    ) -> "MechanismJob":
        """Return the simulations with given values, inputs and outputs.

        Raises
        ------
        ParameterError, UserMistake
            If a value or an option is invalid, so that every simulation would fail, or the signals
            with the numbers of the first row.
        """
        check_engine(engine)
        if engine is None and not kernel_available():  # Compiled and reported here, not by workers.
            engine = PYTHON
        values = given["values"]
        signals(self.mechanism, filled(given["inputs"], row), {**values, **row})
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
            0.0, stop, spacing, tolerance, **given, mechanism=self.mechanism, engine=engine,
            names=tuple(self.units),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class MechanismJob(Job):
    """Simulations of a mechanism, whose variables have the names."""

    mechanism: Mechanism
    engine: str | None
    names: tuple[str, ...]

    @property
    def settings(self) -> dict[str, Any]:
        """Times, tolerance and engine, for the journal."""
        return {**super().settings, "engine": self.engine}

    @property
    def threads(self) -> float:
        """One thread if the engine is Python, any number if it lets them work in parallel."""
        return 1 if self.engine == PYTHON else math.inf

    def run(self, row: Row) -> Outcome:
        """Simulate once; errors of the simulation are returned as outcomes."""
        try:
            return Outcome(OK, values=self._values(row))
        except PrbmError as error:
            return Outcome(FAILED, str(error))

    def _values(self, row: Row) -> tuple[float, ...]:
        """Return the outputs."""
        given, inputs = self.driven(row)
        static = [output for output in self.outputs if output.static]
        own = {p.name: given[p.name] for p in self.mechanism.parameters if p.name in given}
        shape = equilibrium(self.mechanism, own) if static else None  # Without inputs.
        columns, impacts = {}, ()  # type: ignore[var-annotated]
        if len(static) < len(self.outputs):
            columns, impacts = self._motion(given, inputs)
        return tuple(
            output.at_rest(shape) if output.static else evaluate(output, columns, impacts)
            for output in self.outputs
        )

    def _motion(self, given: Mapping[str, float], inputs: Mapping[str, Source]) -> tuple[Any, Any]:
        """Return the columns that the outputs need, and the impacts."""
        needed = {name for o in self.outputs if not o.static for name in o.variables(self.names)}
        history = any(output.history for output in self.outputs)
        return sampled(
            self.mechanism, given, sorted(needed), inputs=inputs, stop_time=self.stop,
            step=self.step if history or inputs else self.stop, tolerance=self.tolerance,
            engine=self.engine, at_events=history,
        )  # fmt: skip
