"""Simulations of a mechanism without an FMU, for studies."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any

from ..analysis.static_shape import equilibrium
from ..base.errors import PrbmError
from ..mechanism.description import Mechanism
from ..runs.engine import PYTHON
from ..runs.inputs import Source, filled, placeholders
from ..runs.result import names as column_names
from ..runs.run import sampled, simulate
from .outputs import FAILED, OK, Outcome, Output, evaluate


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
    stop_time, step : float
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
    stop_time: float
    step: float
    tolerance: float | None
    engine: str | None
    names: tuple[str, ...]

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
                self.mechanism, given, inputs=inputs, stop_time=self.stop_time, step=self.step,
                **options,
            )  # fmt: skip
            return {
                name: result.columns[name] for name in column_names(result.columns)
            }, result.impacts
        needed = {name for o in self.outputs if not o.static for name in o.variables(self.names)}
        history = any(output.history for output in self.outputs)
        step = self.step if history else self.stop_time
        at_impacts = any(output.at_impacts for output in self.outputs)
        return sampled(
            self.mechanism, given, sorted(needed), stop_time=self.stop_time, step=step,
            at_impacts=at_impacts, **options,
        )  # fmt: skip
