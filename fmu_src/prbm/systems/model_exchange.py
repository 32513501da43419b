"""An FMU for model exchange and a partner in one solver, the partner being a Python function.

Model exchange provides the derivatives of the states, and indicators whose change of sign is an
event, but no solver.  A coupled system can therefore be integrated at once, without communication
steps, as a reference for its co-simulation.
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

from ..runs.result import Columns, structured
from ..runs.run import communication_points
from .components import MODEL_EXCHANGE, Component, CouplingError, Value, start_value

Real = NDArray[np.float64]
Partner = Callable[[float, Mapping[str, Value], Real], tuple[Mapping[str, float], Sequence[float]]]
LOCATED = 1e-14  # s, to which events are located
UPDATES_MAX = 1000  # Updates of discrete states at one time.
ABSOLUTE = 1e-3  # of the relative tolerance times a nominal value: the absolute tolerance
NAMES2 = {
    "updateDiscreteStates": "newDiscreteStates",
    "getContinuousStateDerivatives": "getDerivatives",
}
"""What FMPy calls differently in FMI 2.0."""


class Model(Component):
    """An FMU for model exchange, its variables by name.

    Parameters
    ----------
    fmu : str or Path
        Of FMI 2.0 or 3.0.
    folder : str or Path
        An empty folder, where it is unpacked.

    Raises
    ------
    CouplingError
        If it has no model exchange, or one of its functions fails.
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
        values = (c_double * count)()
        self.call(getter, values, count)
        return np.array(values)

    def start(self, values: Mapping[str, Value], stop_time: float) -> None:
        """Initialize with start values, at time 0."""
        self.set({name: start_value(name, x, self.variable(name)) for name, x in values.items()})
        if self.version == 2:
            self.call("setupExperiment", startTime=0.0, stopTime=stop_time)
            self.call("enterInitializationMode")
        else:
            self.call("enterInitializationMode", startTime=0.0, stopTime=stop_time)
        self.call("exitInitializationMode")

    def update(self) -> None:
        """Update the discrete states until they stay, and leave event mode.

        Raises
        ------
        CouplingError
            If the model wants ever more updates.
        """
        for _ in range(UPDATES_MAX):
            if not self.call("updateDiscreteStates")[0]:
                break
        else:
            raise CouplingError(
                f"at {self.time:g} s the model wants more than {UPDATES_MAX} updates of its "
                "discrete states: its events do not end; check its parameters"
            )
        self.call("enterContinuousTimeMode")

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
        """Their derivatives."""
        return self._filled("getContinuousStateDerivatives", self.states)

    @property
    def z(self) -> Real:
        """Event indicators."""
        return self._filled("getEventIndicators", self.indicators)

    @property
    def nominals(self) -> Real:
        """Magnitudes of the states."""
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
        Initialized.
    partner : callable
        ``partner(t, outputs, z)`` returns the inputs that it gives to the model, by name, and
        the derivatives of its own states z.  Its inputs must not act on these outputs at once.
    z : sequence of float
        Its states at the start.
    sees : sequence of str
        The outputs that it is shown.
    tolerance, largest : float
        Relative tolerance, and largest step [s]: what begins and ends within a step is not seen.
    """

    def __init__(
        self,
        model: Model,
        partner: Partner,
        z: Sequence[float],
        sees: Sequence[str],
        tolerance: float,
        largest: float,
    ) -> None:
        self.model, self.partner, self.sees = model, partner, tuple(sees)
        self.tolerance, self.largest = tolerance, largest
        self.time, self.happens = 0.0, False
        self.z = np.array(z, float)
        model.update()

    def put(self, time: float, y: Real) -> Sequence[float]:
        """Bring the model and its inputs to a time and all states; return the partner's rates."""
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
        """Go to a time [s], step by step; ``time`` is where one ends.

        Yields the states within the step as a function of time; where it ends with an event,
        which ``happens`` tells, None after the event.
        """
        nominal = np.concatenate([self.model.nominals, np.ones(len(self.z))])
        absolute: Any = ABSOLUTE * self.tolerance * nominal
        while self.time < end:
            y = np.concatenate([self.model.x, self.z])
            sign, self.happens = self.indicators(self.time, y) > 0.0, False
            solver: Any = DOP853(
                self.slope, self.time, y, end, self.largest, self.tolerance, absolute
            )
            while solver.status == "running" and not self.happens:
                message = solver.step()
                if solver.status == "failed":
                    raise CouplingError(f"the solver fails at {self.time:g} s: {message}")
                inside = solver.dense_output()
                y = self._end(inside, sign)
                yield inside
                self.put(self.time, y)
            if self.happens:
                self.model.call("enterEventMode")
                self.model.update()
                yield None

    def _end(self, inside: Any, sign: NDArray[np.bool_]) -> Real:
        """Go to the end of a step, or to the first event in it; return the states there."""
        crossed = (self.indicators(inside.t, inside(inside.t)) > 0.0) != sign
        self.time = self._root(inside, sign, crossed) if crossed.any() else inside.t
        y: Real = inside(self.time)
        self.put(self.time, y)
        self.z = y[self.model.states :]
        asked, _ = self.model.call("completedIntegratorStep")
        self.happens = bool(asked) or bool(crossed.any())
        return y

    def _root(self, inside: Any, sign: NDArray[np.bool_], crossed: NDArray[np.bool_]) -> float:
        """Return the time of the first event of a step, on its far side."""
        roots = []
        for k in map(int, np.flatnonzero(crossed)):

            def indicator(t: float, k: int = k) -> float:
                return float(self.indicators(t, inside(t))[k])

            root = brentq(indicator, inside.t_old, inside.t, xtol=LOCATED)
            beyond = LOCATED
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
    largest: float = 1e-3,
) -> Columns:
    """Simulate a model and a partner in one solver, Dormand and Prince's of order 8.

    Parameters
    ----------
    fmu, partner, z, sees, tolerance, largest
        As of :class:`Model` and :class:`OneSolver`.
    stop_time, step : float
        Duration and distance of the rows of the result [s]; they do not bound a step.
    values : mapping
        Start values of parameters and inputs, by name.
    record : sequence of str
        Variables that the result has.

    Returns
    -------
    structured array
        ``time``, the variables by name, and the partner's states ``z[0]``, ``z[1]``, ...; at an
        event there are two rows, before it and after it.

    Raises
    ------
    CouplingError
        If a name does not fit, or the solver fails.
    ParameterError
        If there is no step to take.
    """
    times = communication_points(stop_time, step)
    rows: list[dict[str, Value]] = []
    with tempfile.TemporaryDirectory(prefix="prbm_model_") as folder, Model(fmu, folder) as model:
        model.start(values or {}, times[-1])
        one = OneSolver(model, partner, z, sees, tolerance, largest)

        def note(time: float, own: Real) -> None:
            states = {f"z[{k}]": float(x) for k, x in enumerate(own)}
            rows.append({"time": time, **model.get(record), **states})

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
            if one.happens:
                one.put(one.time, inside(one.time))
                note(one.time, one.z)
    return structured(rows)
