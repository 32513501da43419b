"""A mechanism as a co-simulation slave of FMI 2.0, inside the wrapper library pythonfmu.

What the wrapper (0.7.0) does and what follows from it:

* An exception out of any method becomes ``fmi2Fatal``, and the wrapper then releases its
  references a second time when the instance is freed, which ends the process.  So nothing is
  raised once an instance exists: :func:`_never_raises`.
* Only ``doStep`` has a milder status: False becomes ``fmi2Discard``.  ``fmi2Error`` is out of
  reach.  So whatever is wrong is logged when it is found and makes every ``doStep`` answer
  False until it is put right, or for good: then the sentence says so.
* A get cannot be refused either, and a value of another type than asked for leaves an exception
  behind that strikes the host later.  So a wrong get is logged and answered with NaN, 0, False.
* FMPy ends a simulation at ``fmi2Discard`` without a word, and the wrapper logs nothing unless
  the importer asked for logging.  So the reason goes to the standard error stream too.
* When the process ends, its library frees a part of itself twice.  So it is asked to let go of
  that part earlier: :func:`_let_go`.
* Log messages reach the importer as formats of C's printf: a ``%`` must be doubled.
* ``reset`` makes a new Python object of the same class: nothing needs to be undone.
"""

import atexit
import copy
import ctypes
import functools
import json
import math
import os
import sys
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

from pythonfmu import Fmi2Slave  # type: ignore[import-untyped]
from pythonfmu.enums import Fmi2Status  # type: ignore[import-untyped]

from ...base.errors import ParameterError, PrbmError
from ...hybrid.simulation import Simulation
from .resolved import EMPTY, Model, read

EVENTS = "logEvents"
START, EXPERIMENT = "the start", "setupExperiment"  # what may be refused besides a variable
RESET = "reset the instance to start again"
TIME_SLACK = 1e-6  # of a communication step: round-off that importers gather in their time
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


def _never_raises(fallback: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Turn whatever a method raises, Ctrl-C included, into a failure of the instance."""

    def decorate(method: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(method)
        def guarded(self: "MechanismSlave", *args: Any, **kwargs: Any) -> Any:
            try:
                return method(self, *args, **kwargs)
            except BaseException as error:
                self.failure = _unexpected(error)
                self._discard(self.failure)
                return fallback

        return guarded

    return decorate


def _unexpected(error: BaseException) -> str:
    """Return a sentence about an exception that nobody foresaw."""
    if isinstance(error, KeyboardInterrupt):
        return f"the simulation was interrupted; {RESET}"
    place = traceback.extract_tb(error.__traceback__)[-1]
    return (
        f"unexpected {type(error).__name__} in {place.name} (line {place.lineno} of "
        f"{place.filename}): {error}; please report it, and {RESET}"
    )


def _unknown(vr: int) -> str:
    return f"value reference {vr} is not in modelDescription.xml"


_libraries: set[str] = set()


def _note_library(resources: str, name: str) -> None:
    """Remember the shared library that an FMU was loaded from."""
    if sys.platform == "linux":
        _libraries.add(str(Path(resources).parent / "binaries" / "linux64" / f"{name}.so"))


@atexit.register
def _let_go() -> None:
    """Have the libraries that are still loaded give up what they would free twice.

    Their state is a static object; its destructor runs before their own final function, which
    assigns to it once more and so writes to memory that is not theirs any longer.
    """
    for library in _libraries:
        try:
            loaded = ctypes.CDLL(library, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
            loaded.finalizePythonInterpreter()
        except (OSError, AttributeError):
            continue  # unloaded already, or a version that works differently


class MechanismSlave(Fmi2Slave):  # type: ignore[misc]
    """One instance of a mechanism.

    The module that pythonfmu loads derives from this class, out of the FMU's own copy of the
    package ``prbm``.
    """

    model: ClassVar[Model | None] = None
    log_categories: ClassVar[dict[str, str]] = {
        EVENTS: "Impacts, with their time, speeds and loss of energy.",
        "logStatusWarning": "What the importer should know though the simulation goes on.",
        "logStatusDiscard": "Why a communication step was refused or could not be finished.",
        "logStatusError": "Values that were refused, with their bounds and a remedy.",
    }

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        kind = type(self)
        _note_library(self.resources, kind.__name__)
        if kind.model is None:
            kind.model = read(self.resources)
        self.m: Model = kind.model
        self.given = dict(self.m.given)
        self.waiting: dict[str, float] = {}
        self.refused: dict[str, str] = {}
        self.failure: str | None = None
        self.running = False
        self.start_time = 0.0
        self.tolerance: float | None = None
        self.clock = 0.0
        self.simulation: Any = None
        self.table: dict[str, float | int | bool] | None = None
        self.counted = {f"{stop.name}.impact_count": 0 for stop in self.m.mechanism.stops}
        self.told: set[str] = set()

    # -- initialization --

    @_never_raises(None)
    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        """Note where time starts and how exact the importer wants it."""
        self._forget()
        self.refused.pop(EXPERIMENT, None)
        if not math.isfinite(start_time):
            self._refuse(EXPERIMENT, f"startTime = {start_time} s must be a finite number; {RESET}")
            return
        if tolerance is not None:
            try:
                tolerance = self.m.parameters["solver.tolerance"].check(tolerance)
            except ParameterError as error:
                self._refuse(EXPERIMENT, f"the importer's relative tolerance: {error}; {RESET}")
                return
        self.start_time = self.clock = start_time
        self.tolerance = tolerance

    @_never_raises(None)
    def enter_initialization_mode(self) -> None:
        """Do nothing: the simulation is made when a value of it is asked for."""

    @_never_raises(None)
    def exit_initialization_mode(self) -> None:
        """Start the motion; what stands against it was logged and is refused by doStep."""
        self.table = None
        try:
            self._start()
        finally:
            self.running = True

    def _start(self) -> None:
        """Make the simulation from the present values, once."""
        if self.simulation is not None or self.failure or self.refused:
            return
        try:
            self.simulation = Simulation(
                self.m.mechanism,
                self.given,
                start_time=self.start_time,
                tolerance=self.tolerance,
            )
        except PrbmError as error:
            self._refuse(START, str(error))

    def _forget(self) -> None:
        """Drop the simulation: it is to start from other values."""
        self.simulation, self.table = None, None
        self.refused.pop(START, None)

    # -- steps --

    @_never_raises(False)
    def do_step(self, current_time: float, step_size: float) -> bool:
        """Continue to the next communication point, or say why not."""
        if self.running:
            self._start()  # what was wrong until now may have been put right
        problem = self._problem(current_time, step_size) or self._apply()
        if problem is None:
            try:
                self.simulation.advance(current_time + step_size)
            except PrbmError as error:
                problem = self.failure = f"{error}; {RESET}, or restore a saved state"
        if problem is not None:
            self._discard(problem)
            return False
        self.clock = current_time + step_size
        self.table = None
        return True

    def _problem(self, current_time: float, step_size: float) -> str | None:
        """Return what stands against a step."""
        if self.failure:
            return self.failure
        if not self.running:
            return "doStep came before exitInitializationMode: initialize the instance first"
        if self.refused:
            return "; ".join(self.refused.values())
        if not (math.isfinite(current_time) and math.isfinite(step_size)):
            return f"cannot step from t = {current_time} s by {step_size} s: not finite numbers"
        if step_size <= 0.0:
            return f"communicationStepSize = {step_size:.9g} s must be positive; time only runs on"
        slack = TIME_SLACK * step_size + 1e-12 * abs(self.clock)
        if abs(current_time - self.clock) > slack:
            return (
                f"the step begins at t = {current_time:.12g} s, but the last one ended at "
                f"t = {self.clock:.12g} s: continue there, or restore a saved state"
            )
        return None

    def _apply(self) -> str | None:
        """Hand over what was set since the last step; return what the engine has against it."""
        if self.waiting:
            try:
                self.simulation.set(self.waiting)
            except PrbmError as error:
                return str(error)
            self.waiting = {}
        return None

    # -- values --

    @_never_raises(None)
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set parameters and inputs; what is refused is logged and keeps doStep from going on."""
        for vr, value in zip(vrs, values, strict=True):
            name = self._settable(vr, "Real")
            if name is None:
                continue
            try:
                self._set(name, value)
            except ParameterError as error:
                self._refuse(name, str(error))

    def _settable(self, vr: int, kind: str) -> str | None:
        """Return the name of a parameter or input of a type, or refuse what is none."""
        name = self.m.names.get(vr)
        if name is None:
            self._refuse(str(vr), f"{_unknown(vr)}: it cannot be set; {RESET}")
        elif name not in self.given:
            self._refuse(name, f"{name} is no parameter or input: it cannot be set; {RESET}")
        elif self.m.types[name] != kind:
            actual = self.m.types[name]
            self._refuse(name, f"{name} is of type {actual}: set it with fmi2Set{actual}")
        else:
            return name
        return None

    def _set(self, name: str, value: float) -> None:
        parameter = self.m.parameters.get(name)
        if parameter is not None:
            parameter.check(value)
        elif not math.isfinite(value):
            raise ParameterError(f"{name} = {value} must be a finite number")
        before = self.given[name]
        started = self.running and self.simulation is not None
        if started and value != before and parameter is not None and not parameter.tunable:
            unit = parameter.unit and f" {parameter.unit}"
            raise ParameterError(
                f"{name} = {value:.10g}{unit} refused: it is fixed once the simulation has "
                f"started; set it back to {before:.10g}{unit}, or reset the instance and set it "
                "before"
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

    @_never_raises(None)
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Refuse: no Integer can be set."""
        self._refuse_all(vrs, "Integer")

    @_never_raises(None)
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Refuse: no Boolean can be set."""
        self._refuse_all(vrs, "Boolean")

    @_never_raises(None)
    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Refuse: there is no String."""
        self._refuse_all(vrs, "String")

    def _refuse_all(self, vrs: list[int], kind: str) -> None:
        for vr in vrs:
            self._settable(vr, kind)

    def get_real(self, vrs: list[int]) -> list[float]:
        """Return values of Real variables, NaN where there is none."""
        return self._get(vrs, "Real")

    def get_integer(self, vrs: list[int]) -> list[int]:
        """Return values of Integer variables, 0 where there is none."""
        return self._get(vrs, "Integer")

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Return values of Boolean variables, False where there is none."""
        return self._get(vrs, "Boolean")

    def get_string(self, vrs: list[int]) -> list[str]:
        """Return empty strings: there is no String."""
        return self._get(vrs, "String")

    def _get(self, vrs: list[int], kind: str) -> list[Any]:
        """Return values of a type, and of what is not of that type none."""
        try:
            table = self.table or self._values()
            names, types = self.m.names, self.m.types
            result = []
            for vr in vrs:
                name = names.get(vr)
                if name is None:
                    self._complain(f"{_unknown(vr)}: it has no value")
                elif types[name] != kind:
                    actual = types[name]
                    self._complain(f"{name} is of type {actual}: get it with fmi2Get{actual}")
                else:
                    result.append(table[name])
                    continue
                result.append(EMPTY[kind])
            return result
        except BaseException as error:
            self.failure = _unexpected(error)
            self.log(self.failure, Fmi2Status.error)
        return [EMPTY[kind]] * len(vrs)

    def _values(self) -> Mapping[str, float | int | bool]:
        """Return all values by name, those of the present time computed once.

        Where there is no simulation to compute them from, they are NaN, 0 and False.
        """
        self._start()
        self.table = {**self.m.computed, **self.given}
        if self.simulation is not None and not self.failure and (self.running or not self.refused):
            self.table.update(self.simulation.outputs())
            self._tell_impacts(self.table)
        return self.table

    def _tell_impacts(self, table: Mapping[str, Any]) -> None:
        """Log the last impact at each stop where there was one since the last call."""
        for counter, before in self.counted.items():
            count = table[counter]
            if count == before:
                continue
            self.counted[counter] = count
            stop = counter.removesuffix(".impact_count")
            self.log(
                f"impact {count} at {stop}, t = {table[f'{stop}.impact_time']:.9g} s: closing at "
                f"{table[f'{stop}.approach_speed']:.6g} m/s, opening at "
                f"{table[f'{stop}.rebound_speed']:.6g} m/s, "
                f"{table[f'{stop}.energy_lost']:.6g} J lost",
                category=EVENTS,
            )

    # -- state --

    @_never_raises({})
    def _get_fmu_state(self) -> dict[str, Any]:
        state = {key: getattr(self, key) for key in SAVED}
        state = {key: dict(v) if isinstance(v, dict) else v for key, v in state.items()}
        state["model"] = type(self).__name__ + "." + type(self).__module__
        state["snapshot"] = self.simulation and self.simulation.snapshot()
        return state

    @_never_raises(None)
    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        if state.get("model") != type(self).__name__ + "." + type(self).__module__:
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
        """Return a simulation in a saved state; the present one stays as it is."""
        if snapshot is None:
            return None
        if self.simulation is None:
            simulation = Simulation(self.m.mechanism, self.m.given)
        else:
            simulation = copy.copy(self.simulation)
        simulation.restore(snapshot)
        return simulation

    def _lost(self, why: str) -> None:
        """Go no further: the importer believes that it has restored a state."""
        self.failure = f"the state to restore {why}; restore another one, or {RESET}"
        self.log(self.failure, Fmi2Status.error)

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        return json.dumps(state).encode()

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        try:
            data = json.loads(state)
        except ValueError:
            return {}
        return data if isinstance(data, dict) else {}

    # -- messages --

    def log(
        self,
        msg: str,
        status: Fmi2Status = Fmi2Status.ok,
        category: str | None = None,
        debug: bool | None = None,
    ) -> None:
        """Log a sentence to the importer."""
        text = msg.encode(errors="replace").decode().replace("%", "%%")
        super().log(text, status, category, debug)

    def _refuse(self, name: str, sentence: str) -> None:
        self.refused[name] = sentence
        self.log(sentence, Fmi2Status.error)
        self.table = None

    def _complain(self, sentence: str) -> None:
        """Tell once what is wrong but harms nothing in here."""
        if sentence not in self.told:
            self.log(sentence, Fmi2Status.error)
            self._print(sentence)

    def _discard(self, sentence: str) -> None:
        """Tell why a step is refused: to the importer, and once to the standard error stream."""
        self.log(sentence, Fmi2Status.discard)
        self._print(sentence)

    def _print(self, sentence: str) -> None:
        if sentence not in self.told and sys.stderr is not None:
            print(f"{self.instance_name}: {sentence}", file=sys.stderr, flush=True)
        self.told.add(sentence)
