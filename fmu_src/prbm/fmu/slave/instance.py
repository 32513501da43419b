"""One instance of a mechanism: its values, its simulation, and the errors that reject a step."""

import copy
import math
import traceback
from collections.abc import Mapping
from typing import Any

from ...base.errors import ParameterError, PrbmError
from ...base.tolerances import STEP_SUM_RTOL, TIME_SUM_RTOL
from ...hybrid.configuration import replaced_tolerance
from ...hybrid.simulation import Simulation
from .messages import Messages
from .resolved import EMPTY, Model

START, EXPERIMENT = "the start", "setupExperiment"  # Keys of ``refused`` besides variable names.
RESET = "reset the instance to start again"
SAVED = (
    "given",
    "waiting",
    "refused",
    "counted",
    "failure",
    "running",
    "start_time",
    "tolerance",
    "clock",
)


class Instance:
    """The values and the simulation of an instance.

    A rejected value, or any other error, is logged at once.  Every step is rejected until the
    error is corrected.

    Parameters
    ----------
    model : Model
        The mechanism and its variables.
    identity : str
        Name of the model and its content; a saved state with another identity is rejected.
    messages : Messages
        The log.

    Attributes
    ----------
    given : dict of str to float
        Parameters and inputs.
    waiting : dict of str to float
        Parameters and inputs that were set since the last step.
    refused : dict of str to str
        The error message of each rejected value; a valid value removes it.
    failure : str or None
        The reason why no step is possible any more.
    running : bool
        Whether initialization is over.
    clock : float
        The end of the last step [s].
    table : dict or None
        All values at the present time; None if they have not been computed.
    """

    def __init__(self, model: Model, identity: str, messages: Messages) -> None:
        self.model = model
        self.identity = identity
        self.messages = messages
        self.given = dict(model.given)
        self.waiting: dict[str, float] = {}
        self.refused: dict[str, str] = {}
        self.failure: str | None = None
        self.running = False
        self.start_time = 0.0
        self.tolerance: float | None = None
        self.clock = 0.0
        self.simulation: Any = None
        self.table: dict[str, float | int | bool] | None = None
        self.counted = {f"{stop.name}.impact_count": 0 for stop in model.mechanism.stops}

    # -- initialization --

    def setup(self, start_time: float, tolerance: float | None) -> None:
        """Set the time at which the simulation starts, and its relative tolerance."""
        self._forget()
        self.refused.pop(EXPERIMENT, None)
        if not math.isfinite(start_time):
            self._refuse(EXPERIMENT, f"startTime = {start_time} s must be a finite number; {RESET}")
            return
        if tolerance is not None:
            try:
                tolerance = self.model.parameters["solver.tolerance"].check(tolerance)
            except ParameterError as error:
                self._refuse(EXPERIMENT, f"the importer's relative tolerance: {error}; {RESET}")
                return
        self.start_time = self.clock = start_time
        self.tolerance = tolerance

    def begin(self) -> None:
        """End the initialization and start the simulation.  A failure is logged."""
        self.table = None
        try:
            self._start()
        finally:
            self.running = True

    def _start(self) -> None:
        """Create the simulation from the present values, unless it exists."""
        if self.simulation is not None or self.failure or self.refused:
            return
        try:
            simulation = Simulation(
                self.model.mechanism,
                self.given,
                start_time=self.start_time,
                tolerance=self.tolerance,
            )
            simulation.check_effort(self.model.step)
            unstable = simulation.instability()
        except PrbmError as error:
            self._refuse(START, str(error))
            return
        self.simulation = simulation
        for sentence in unstable.sentences:
            self.messages.warning(sentence)
        given = self.given["solver.tolerance"]
        replaced = replaced_tolerance(given if self.tolerance is None else self.tolerance)
        if replaced:
            self.messages.warning(replaced)

    def _forget(self) -> None:
        """Drop the simulation, because a value at its start has changed."""
        self.simulation, self.table = None, None
        self.refused.pop(START, None)

    # -- steps --

    def step(self, time: float, size: float) -> bool:
        """Continue to the next communication point; log the reason if that is not possible."""
        if self.running:
            self._start()  # An earlier failure to start may have been corrected.
        problem = self._problem(time, size) or self._apply()
        if problem is None:
            try:
                self.simulation.advance(time + size)
            except PrbmError as error:
                problem = self.failure = f"{error}; {RESET}, or restore a saved state"
        if problem is not None:
            self.messages.discard(problem)
            return False
        self.clock = time + size
        self.table = None
        return True

    def _problem(self, time: float, size: float) -> str | None:
        """Return the reason to reject a step, or None."""
        if self.failure:
            return self.failure
        if not self.running:
            return "doStep was called before exitInitializationMode: initialize the instance first"
        if self.refused:
            return "; ".join(self.refused.values())
        if not (math.isfinite(time) and math.isfinite(size)):
            return (
                f"currentCommunicationPoint = {time} s and communicationStepSize = {size} s must "
                "be finite numbers"
            )
        if size <= 0.0:
            return f"communicationStepSize = {size:.9g} s must be positive"
        slack = STEP_SUM_RTOL * size + TIME_SUM_RTOL * abs(self.clock)
        if abs(time - self.clock) > slack:
            return (
                f"the step begins at t = {time:.12g} s, but the last step ended at "
                f"t = {self.clock:.12g} s: continue there, or restore a saved state"
            )
        return None

    def _apply(self) -> str | None:
        """Set the values that are waiting; return the reason if the simulation rejects them."""
        if self.waiting:
            try:
                self.simulation.set(self.waiting)
            except PrbmError as error:
                return str(error)
            self.waiting = {}
        return None

    def fail(self, error: BaseException) -> str:
        """Reject all further steps because of an unexpected exception; return the message."""
        if isinstance(error, KeyboardInterrupt):
            self.failure = f"the simulation was interrupted; {RESET}"
            return self.failure
        place = traceback.extract_tb(error.__traceback__)[-1]
        self.failure = (
            f"unexpected {type(error).__name__} in {place.name} (line {place.lineno} of "
            f"{place.filename}): {error}; please report it, and {RESET}"
        )
        return self.failure

    # -- values --

    def set_real(self, references: list[int], values: list[float]) -> None:
        """Set parameters and inputs; an invalid value rejects steps until it is corrected."""
        for reference, value in zip(references, values, strict=True):
            name = self._settable(reference, "Real")
            if name is None:
                continue
            try:
                self._set(name, value)
            except ParameterError as error:
                self._refuse(name, str(error))

    def refuse_all(self, references: list[int], kind: str) -> None:
        """Reject values of a type that no parameter and no input has."""
        for reference in references:
            self._settable(reference, kind)

    def _settable(self, reference: int, kind: str) -> str | None:
        """Return the name of a parameter or input of a type; reject all other references."""
        name = self.model.names.get(reference)
        if name is None:
            self._refuse(str(reference), f"{_unknown(reference)}: it cannot be set; {RESET}")
        elif name not in self.given:
            self._refuse(name, f"{name} is not a parameter or input: it cannot be set; {RESET}")
        elif self.model.types[name] != kind:
            actual = self.model.types[name]
            self._refuse(name, f"{name} is of type {actual}: set it with fmi2Set{actual}")
        else:
            return name
        return None

    def _set(self, name: str, value: float) -> None:
        parameter = self.model.parameters.get(name)
        if parameter is not None:
            parameter.check(value)
        elif not math.isfinite(value):
            raise ParameterError(f"{name} = {value} must be a finite number")
        before = self.given[name]
        started = self.running and self.simulation is not None
        if started and value != before and parameter is not None and not parameter.tunable:
            unit = parameter.unit and f" {parameter.unit}"
            raise ParameterError(
                f"{name} = {value:.10g}{unit} rejected: the parameter is fixed once the simulation "
                f"has started; set it back to {before:.10g}{unit}, or reset the instance and set "
                "it before initialization"
            )
        if self.refused.pop(name, None):
            self.table = None
        if value == before:
            return
        self.given[name] = value
        if started:
            self.waiting[name] = value
            if self.table is not None:
                self.table[name] = value
        else:
            self._forget()

    def _refuse(self, name: str, sentence: str) -> None:
        self.refused[name] = sentence
        self.messages.error(sentence)
        self.table = None

    def get(self, references: list[int], kind: str) -> list[Any]:
        """Return values of a type; NaN, 0 or False for a reference of another type."""
        table = self.table or self._values()
        names, types = self.model.names, self.model.types
        result = []
        for reference in references:
            name = names.get(reference)
            if name is None:
                self.messages.error_once(f"{_unknown(reference)}: it has no value")
            elif types[name] != kind:
                actual = types[name]
                self.messages.error_once(f"{name} is of type {actual}: get it with fmi2Get{actual}")
            else:
                result.append(table[name])
                continue
            result.append(EMPTY[kind])
        return result

    def _values(self) -> Mapping[str, float | int | bool]:
        """Return all values by name, computed once for the present time.

        Without a simulation, computed variables are NaN, 0 or False.
        """
        self._start()
        self.table = {**self.model.computed, **self.given}
        if self.simulation is not None and not self.failure and (self.running or not self.refused):
            self.table.update(self.simulation.outputs())
            self._log_impacts(self.table)
        return self.table

    def _log_impacts(self, table: Mapping[str, Any]) -> None:
        """Log the last impact at each stop that had impacts since the last call."""
        for counter, before in self.counted.items():
            count = table[counter]
            if count == before:
                continue
            self.counted[counter] = count
            stop = counter.removesuffix(".impact_count")
            self.messages.event(
                f"impact {count} at {stop}, t = {table[f'{stop}.impact_time']:.9g} s: closing at "
                f"{table[f'{stop}.approach_speed']:.6g} m/s, opening at "
                f"{table[f'{stop}.rebound_speed']:.6g} m/s, "
                f"{table[f'{stop}.energy_lost']:.6g} J lost"
            )

    # -- saved states --

    def saved(self) -> dict[str, Any]:
        """Return the complete state as values that JSON keeps exactly."""
        state = {key: getattr(self, key) for key in SAVED}
        state = {key: dict(v) if isinstance(v, dict) else v for key, v in state.items()}
        state["model"] = self.identity
        state["snapshot"] = self.simulation and self.simulation.snapshot()
        return state

    def restore(self, state: Mapping[str, Any]) -> None:
        """Return to a saved state; log an error and reject further steps if that fails."""
        if state.get("model") != self.identity:
            self._lost("was not saved by this version of this FMU")
            return
        try:
            saved = {key: state[key] for key in SAVED}
            simulation = self._restored(state["snapshot"])
        except (PrbmError, LookupError, TypeError, ValueError) as error:
            self._lost(f"is damaged ({type(error).__name__}: {error})")
            return
        for key, value in saved.items():
            setattr(self, key, dict(value) if isinstance(value, dict) else value)
        self.simulation, self.table = simulation, None

    def _restored(self, snapshot: Mapping[str, Any] | None) -> Any:
        """Return a new simulation in a saved state, None if there was no simulation."""
        if snapshot is None:
            return None
        if self.simulation is None:
            simulation = Simulation(self.model.mechanism, self.model.given)
        else:
            simulation = copy.copy(self.simulation)
        simulation.restore(snapshot)
        return simulation

    def _lost(self, why: str) -> None:
        """Reject further steps: the importer assumes that it has restored a state."""
        self.failure = f"the state to restore {why}; restore another one, or {RESET}"
        self.messages.error(self.failure)


def _unknown(reference: int) -> str:
    return f"value reference {reference} is not in modelDescription.xml"
