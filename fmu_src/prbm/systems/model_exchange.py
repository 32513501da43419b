"""An FMU for model exchange and a partner, a Python function, integrated by one solver.

An FMU for model exchange returns the derivatives of its states, and indicators whose change of sign
is an event.  The importer integrates them.  A coupled system can thus be integrated as a whole,
without communication steps, as a reference for its co-simulation.
"""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from ctypes import c_double
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

from ..base.tolerances import EVENT_TIME_RTOL
from ..runs.result import Columns, structured
from ..runs.run import communication_points
from .components import MODEL_EXCHANGE, Component, CouplingError, Value, start_value

Real = NDArray[np.float64]
Partner = Callable[[float, Mapping[str, Value], Real], tuple[Mapping[str, float], Sequence[float]]]
UPDATES_MAX = 1000  # Updates of discrete states at one time.
STATE_ATOL_FACTOR = 1e-3  # Absolute tolerance / (relative tolerance * nominal value).
NAMES2 = {
    "updateDiscreteStates": "newDiscreteStates",
    "getContinuousStateDerivatives": "getDerivatives",
}
"""FMPy's names of functions in FMI 2.0, by those in FMI 3.0."""


class Model(Component):
    """An FMU for model exchange, its variables by name.

    Parameters
    ----------
    fmu : str or Path
        An FMU of FMI 2.0 or 3.0.
    folder : str or Path
        An empty folder into which the FMU is unpacked.

    Raises
    ------
    CouplingError
        If the FMU cannot be read or loaded, has no model exchange, or one of its functions fails.
    """

    def __init__(self, fmu: str | Path, folder: str | Path) -> None:
        super().__init__(Path(fmu).stem, fmu, folder, MODEL_EXCHANGE)
        self.states = self.description.numberOfContinuousStates
        self.indicators = self.description.numberOfEventIndicators
        self.instantiate()

    def call(self, function: str, *arguments: Any, **options: Any) -> Any:
        """Call a function of the FMU by its name in FMI 3.0."""
        own = NAMES2.get(function, function) if self.version == 2 else function
        return super().call(own, *arguments, **options)

    def _filled(self, getter: str, count: int) -> Real:
        """Return the array that a getter of the FMU fills."""
        values = (c_double * count)()
        self.call(getter, values, count)
        return np.array(values)

    def start(self, values: Mapping[str, Value], stop_time: float) -> None:
        """Initialize at time 0, with start values by name."""
        self.set({name: start_value(name, x, self.variable(name)) for name, x in values.items()})
        if self.version == 2:
            self.call("setupExperiment", startTime=0.0, stopTime=stop_time)
            self.call("enterInitializationMode")
        else:
            self.call("enterInitializationMode", startTime=0.0, stopTime=stop_time)
        self.call("exitInitializationMode")

    def update(self) -> None:
        """Update discrete states until no further update is needed; leave event mode.

        Raises
        ------
        CouplingError
            If the model ends the simulation, requests an event at a given time or more than
            ``UPDATES_MAX`` updates.
        """
        for _ in range(UPDATES_MAX):
            more, ended, _, _, scheduled, next_time = self.call("updateDiscreteStates")
            self.check_not_terminated(ended)
            if scheduled:
                raise CouplingError(
                    f"{self.name} requests an event at {next_time:g} s: events at given times are "
                    "not supported here; use co-simulation"
                )
            if not more:
                break
        else:
            raise CouplingError(
                f"at {self.time:g} s the model requests more than {UPDATES_MAX} updates of its "
                "discrete states: its events do not end; check its parameters"
            )
        self.call("enterContinuousTimeMode")

    def check_not_terminated(self, terminated: bool) -> None:
        """Raise a CouplingError if the model has ended the simulation."""
        if terminated:
            raise CouplingError(f"{self.name} terminated the simulation at {self.time:g} s")

    def put(self, time: float, x: Real) -> None:
        """Set time and states."""
        self.time = time
        self.call("setTime", time)
        self.call("setContinuousStates", (c_double * self.states)(*x), self.states)

    @property
    def x(self) -> Real:
        """Continuous states."""
        return self._filled("getContinuousStates", self.states)

    @property
    def rates(self) -> Real:
        """Derivatives of the continuous states."""
        return self._filled("getContinuousStateDerivatives", self.states)

    @property
    def z(self) -> Real:
        """Event indicators."""
        return self._filled("getEventIndicators", self.indicators)

    @property
    def nominals(self) -> Real:
        """Nominal values of the continuous states."""
        return self._filled("getNominalsOfContinuousStates", self.states)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.fmu.freeInstance()


class OneSolver:
    """A model and a partner, integrated together.

    Parameters
    ----------
    model : Model
        The initialized model.
    partner : callable
        ``partner(t, outputs, z)`` returns the inputs of the model by name, and the derivatives of
        the partner's states z.  The outputs must not depend on these inputs at the same time (no
        algebraic loop).
    z : sequence of float
        The partner's states at the start.
    sees : sequence of str
        Names of the outputs that the partner gets.
    tolerance : float
        Relative tolerance.
    max_step : float
        Largest step [s].  A contact that begins and ends within one step is not detected.
    """

    def __init__(
        self,
        model: Model,
        partner: Partner,
        z: Sequence[float],
        sees: Sequence[str],
        tolerance: float,
        max_step: float,
    ) -> None:
        self.model, self.partner, self.sees = model, partner, tuple(sees)
        self.tolerance, self.max_step = tolerance, max_step
        self.time, self.event = 0.0, False
        self.z = np.array(z, float)
        model.update()

    def put(self, time: float, y: Real) -> Sequence[float]:
        """Set time, states and inputs of the model; return the partner's derivatives."""
        n = self.model.states
        self.model.put(time, y[:n])
        inputs, rates = self.partner(time, self.model.get(self.sees), y[n:])
        self.model.set(inputs)
        return rates

    def slope(self, time: float, y: Real) -> Real:
        """Return the derivatives of all states."""
        rates = self.put(time, y)
        return np.concatenate([self.model.rates, rates])

    def indicators(self, time: float, y: Real) -> Real:
        """Return the event indicators."""
        self.put(time, y)
        return self.model.z

    def steps(self, end: float) -> Iterator[Callable[[float], Real] | None]:
        """Integrate to a time [s], step by step; ``time`` is the end of the latest step.

        Yields after each step a function that interpolates the states within it.  If the step
        ended at an event, ``event`` is true, and None is yielded after the event was handled.
        """
        nominal = np.concatenate([self.model.nominals, np.ones(len(self.z))])
        absolute: Any = STATE_ATOL_FACTOR * self.tolerance * nominal
        while self.time < end:
            y = np.concatenate([self.model.x, self.z])
            sign, self.event = self.indicators(self.time, y) > 0.0, False
            solver: Any = DOP853(
                self.slope, self.time, y, end, self.max_step, self.tolerance, absolute
            )
            while solver.status == "running" and not self.event:
                message = solver.step()
                if solver.status == "failed":
                    raise CouplingError(f"the solver failed at {self.time:g} s: {message}")
                inside = solver.dense_output()
                y = self._end(inside, sign)
                yield inside
                self.put(self.time, y)
            if self.event:
                self.model.call("enterEventMode")
                self.model.update()
                yield None

    def _end(self, inside: Any, sign: NDArray[np.bool_]) -> Real:
        """Set the model to the end of a step or to its first event; return the states there."""
        crossed = (self.indicators(inside.t, inside(inside.t)) > 0.0) != sign
        self.time = self._root(inside, sign, crossed) if crossed.any() else inside.t
        y: Real = inside(self.time)
        self.put(self.time, y)
        self.z = y[self.model.states :]
        requested, terminated = self.model.call("completedIntegratorStep")
        self.model.check_not_terminated(terminated)
        self.event = bool(requested) or bool(crossed.any())
        return y

    def _root(self, inside: Any, sign: NDArray[np.bool_], crossed: NDArray[np.bool_]) -> float:
        """Return the time of the first event of a step, just after its indicator has changed."""
        roots = []
        for k in map(int, np.flatnonzero(crossed)):

            def indicator(t: float, k: int = k) -> float:
                return float(self.indicators(t, inside(t))[k])

            beyond = EVENT_TIME_RTOL * (inside.t - inside.t_old)
            root = brentq(indicator, inside.t_old, inside.t, xtol=beyond)
            while (indicator(root) > 0.0) == sign[k]:
                root, beyond = min(root + beyond, inside.t), 2 * beyond
            roots.append(root)
        return float(min(roots))


def simulate(
    fmu: str | Path,
    partner: Partner,
    z: Sequence[float],
    stop_time: float,
    step: float,
    values: Mapping[str, Value] | None = None,
    sees: Sequence[str] = (),
    record: Sequence[str] = (),
    tolerance: float = 1e-10,
    max_step: float = 1e-3,
) -> Columns:
    """Simulate a model and a partner with one solver, Dormand and Prince's method of order 8.

    Parameters
    ----------
    fmu, partner, z, sees, tolerance, max_step
        As for :class:`Model` and :class:`OneSolver`.
    stop_time, step : float
        Duration, and interval between the rows of the result [s].  The solver's steps do not
        depend on the interval.
    values : mapping
        Start values of parameters and inputs, by name.
    record : sequence of str
        Names of the variables in the result.

    Returns
    -------
    structured array
        ``time``, the variables by name, and the partner's states ``z[0]``, ``z[1]``, ...  An event
        has two rows: before it and after it.

    Raises
    ------
    CouplingError
        If a name is unknown, a function of the FMU fails, the solver fails or the FMU ends the
        simulation; ``columns`` of the error are the rows before.
    ParameterError
        If ``stop_time`` or ``step`` is not positive and finite.
    """
    times = communication_points(stop_time, step)
    rows: list[dict[str, Value]] = []
    with tempfile.TemporaryDirectory(prefix="prbm_model_") as folder, Model(fmu, folder) as model:
        model.start(values or {}, times[-1])
        one = OneSolver(model, partner, z, sees, tolerance, max_step)

        def note(time: float, own: Real) -> None:
            states = {f"z[{k}]": float(x) for k, x in enumerate(own)}
            rows.append({"time": time, **model.get(record), **states})

        def follow() -> None:
            note(0.0, one.z)
            due = times[1:]
            for inside in one.steps(times[-1]):
                if inside is None:
                    note(one.time, one.z)
                    continue
                while due and due[0] <= one.time:
                    y = inside(due[0])
                    one.put(due[0], y)
                    note(due.pop(0), y[model.states :])
                if one.event:
                    one.put(one.time, inside(one.time))
                    note(one.time, one.z)

        try:
            follow()
        except CouplingError as error:
            error.columns = structured(rows) if rows else None
            raise
    return structured(rows)
