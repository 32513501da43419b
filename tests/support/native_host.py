"""An importer of native FMUs for the tests: one interface to FMPy's classes for both versions."""

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from ctypes import byref, c_double
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any, Self

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException, printLogMessage
from fmpy.fmi2 import FMU2Model, FMU2Slave, calloc, fmi2CallbackFunctions, free
from fmpy.fmi2 import fmi2CallbackAllocateMemoryTYPE as Allocate
from fmpy.fmi2 import fmi2CallbackFreeMemoryTYPE as Free
from fmpy.fmi2 import fmi2CallbackLoggerTYPE as Logger
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmpy.logging import addLoggerProxy
from fmpy.model_description import ModelDescription

from prbm.base.atomic import write
from shared import once
from support import built, mechanism

OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3
REAL, INTEGER, BOOLEAN = "Real", "Integer", "Boolean"
KINDS = {"Float64": REAL, "Int32": INTEGER}
TYPES = {REAL: "Float64", INTEGER: "Int32", BOOLEAN: "Boolean"}
INTERFACES = ((2, "cs"), (2, "me"), (3, "cs"), (3, "events"), (3, "me"))
"""Version and interface; events: co-simulation with event mode and early return."""

VERSIONS = {2: (FMU2Slave, FMU2Model), 3: (FMU3Slave, FMU3Model)}
"""FMPy's classes of both versions, for co-simulation and for model exchange."""

_folders: list[TemporaryDirectory[str]] = []
_listeners: dict[int, list[tuple[int, str, str]]] = {}


@cache
def unpacked(fmu: Path) -> tuple[Path, ModelDescription]:
    """Return the folder of an unpacked FMU, kept until the process ends, and the description."""
    folder = TemporaryDirectory(prefix="prbm_native_")
    _folders.append(folder)
    extract(str(fmu), folder.name)
    return Path(folder.name), read_model_description(folder.name)


@cache
def _loaded(version: int, exchanges: bool, folder: Path, identifier: str) -> Any:
    """Return FMPy's object of a library, which stays loaded until the process ends.

    FMPy takes much longer to find the types of all functions than to load the library.
    """
    return VERSIONS[version][exchanges](
        guid=None, unzipDirectory=str(folder), modelIdentifier=identifier
    )


def _log2(listener: int, _: bytes, status: int, category: bytes, text: bytes) -> None:
    """Store a message for its instance; FMPy has one logger for all instances."""
    if listener in _listeners:
        _listeners[listener].append((status, category.decode(), text.decode()))
    else:
        printLogMessage(listener, b"", status, category, text)


_LOGGER, _ALLOCATE, _FREE = Logger(_log2), Allocate(calloc), Free(free)


def callbacks(listener: int | None = None) -> fmi2CallbackFunctions:
    """Return the callback functions for an FMU of FMI 2.0.

    FMPy's proxy, which formats messages, calls the logger that was passed to it last.  It therefore
    gets the same logger every time, which exists until the process ends.
    """
    result = fmi2CallbackFunctions()
    result.logger, result.allocateMemory, result.freeMemory = _LOGGER, _ALLOCATE, _FREE
    result.componentEnvironment = listener
    addLoggerProxy(byref(result))
    return result


@cache
def clocked(model: str) -> Path:
    """Return the FMU with an output clock."""

    def make(folder: Path) -> None:
        write(folder / f"{model}.fmu", built(mechanism(model), fmi=3, clock=True))

    return once(f"clocked-{model}", make) / f"{model}.fmu"


class Instance:
    """An instance of a native FMU, freed at the end of a ``with`` block.

    Parameters
    ----------
    fmu : Path
        The FMU, or the folder that it was unpacked to.
    kind : str
        ``cs``, ``me``, ``events`` (co-simulation with event mode and early return) or ``late``
        (event mode without early return).
    guid : str or None
        Token to pass instead of that of the FMU.
    substep : float
        Step of the integration in model exchange [s].
    options
        Arguments of FMPy's ``instantiate`` in FMI 3.0.
    """

    def __init__(
        self,
        fmu: Path,
        kind: str = "cs",
        name: str = "instance",
        *,
        guid: str | None = None,
        logging: bool = True,
        substep: float = 1e-4,
        **options: Any,
    ) -> None:
        self.folder, self.description = (fmu, read_model_description(str(fmu))) \
            if fmu.is_dir() else unpacked(fmu)  # fmt: skip
        self.kind, self.version = kind, int(self.description.fmiVersion[0])
        self.exchanges = kind == "me"
        self.variables = {v.name: v for v in self.description.modelVariables if v.type != "Clock"}
        self.references = {name: v.valueReference for name, v in self.variables.items()}
        self.log: list[tuple[int, str, str]] = []
        self.time, self.substep = 0.0, substep
        interface = self.description.coSimulation or self.description.modelExchange
        library = _loaded(self.version, self.exchanges, self.folder, interface.modelIdentifier)
        self.fmu = copy(library)
        self.fmu.instanceName = name
        self.fmu.guid = self.description.guid if guid is None else guid
        self.fmu.freeLibrary = lambda: None
        self._instantiate(logging, options)

    def _instantiate(self, logging: bool, options: Mapping[str, Any]) -> None:
        if self.version == 2:
            _listeners[id(self)] = self.log
            self.fmu.instantiate(callbacks=callbacks(id(self)), loggingOn=logging)
            return
        options = {"logMessage": self._log3, "loggingOn": logging, **options}
        if not self.exchanges:
            options["eventModeUsed"] = self.kind in ("events", "late")
            options.setdefault("earlyReturnAllowed", self.kind == "events")
        self.fmu.instantiate(**options)

    def _log3(self, _: Any, status: int, category: bytes, message: bytes) -> None:
        self.log.append((status, category.decode(), message.decode()))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        place: TracebackType | None,
    ) -> None:
        self.free()

    def free(self) -> None:
        self.fmu.freeInstance()
        _listeners.pop(id(self), None)

    # -- calls --

    @property
    def messages(self) -> list[str]:
        """The logged messages, without status and category."""
        return [text for _, _, text in self.log]

    def logged(self, part: str) -> bool:
        """Return whether a logged message contains a text."""
        return any(part in text for text in self.messages)

    def call(self, name: str, *arguments: Any) -> int:
        """Call a function of the standard by its name without the prefix; return its status."""
        return status(getattr(self.fmu, f"fmi{self.version}{name}"), self.fmu.component, *arguments)

    def function(self, two: str, three: str) -> Callable[..., Any]:
        """Return the method of FMPy whose name differs between FMI 2.0 and 3.0."""
        return getattr(self.fmu, two if self.version == 2 else three)  # type: ignore[no-any-return]

    def name_of(self, kind: str) -> str:
        """Return the name of a type in this version of FMI."""
        return kind if self.version == 2 else TYPES[kind]

    # -- values --

    def set(self, values: Mapping[str, float]) -> int:
        """Set Real variables by their names; return the status."""
        references = [self.references[name] for name in values]
        return status(self.function("setReal", "setFloat64"), references, [*values.values()])

    def get(self, *names: str) -> list[float]:
        """Return Real variables by their names."""
        references = [self.references[name] for name in names]
        return self.function("getReal", "getFloat64")(references)  # type: ignore[no-any-return]

    def values(self) -> dict[str, float]:
        """Return all declared variables by name."""
        result = {}
        for kind in TYPES:
            names = [n for n, v in self.variables.items() if KINDS.get(v.type, v.type) == kind]
            getter = getattr(self.fmu, f"get{self.name_of(kind)}")
            read = getter([self.references[name] for name in names])
            result |= dict(zip(names, read, strict=True))
        assert result.keys() == self.variables.keys()
        return result

    def bytes(self) -> bytes:
        """Return the values of all declared variables as bytes."""
        return np.array([*self.values().values()], dtype=float).tobytes()

    # -- initialization and events --

    def enter(
        self, *, start: float = 0.0, tolerance: float | None = None, stop: float | None = None
    ) -> Self:
        """Enter Initialization Mode."""
        self.time = start
        experiment = {"tolerance": tolerance, "startTime": start, "stopTime": stop}
        if self.version == 2:
            self.fmu.setupExperiment(**experiment)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(**experiment)
        return self

    def begin(self) -> Self:
        """Leave Initialization Mode and, if there is one, the first Event Mode."""
        self.fmu.exitInitializationMode()
        if self.kind != "cs":
            self.update()
        return self

    def initialize(
        self,
        *,
        start: float = 0.0,
        tolerance: float | None = None,
        stop: float | None = None,
        values: Mapping[str, float] | None = None,
    ) -> Self:
        """Go through initialization with start values."""
        assert self.set(values or {}) == OK
        return self.enter(start=start, tolerance=tolerance, stop=stop).begin()

    def reset(self) -> None:
        self.fmu.reset()
        self.time = 0.0

    def change(self, values: Mapping[str, float]) -> None:
        """Set inputs and tunable parameters in the mode in which they may be set."""
        if self.kind == "cs":
            assert self.set(values) == OK
        elif values:
            self.fmu.enterEventMode()
            assert self.set(values) == OK
            self.update()

    def update(self) -> list[bool]:
        """Handle the events in Event Mode and leave it; return for each clock whether it ticked."""
        ticks, again = [], True
        clocks = [v.valueReference for v in self.description.modelVariables if v.type == "Clock"]
        while again:
            again = self.function("newDiscreteStates", "updateDiscreteStates")()[0]
            ticks += self.fmu.getClock(clocks) if clocks else []
        leave = self.fmu.enterContinuousTimeMode if self.exchanges else self.fmu.enterStepMode
        leave()
        return ticks

    # -- motion --

    def step(self, time: float, size: float) -> int:
        """Make one step of co-simulation; return the status."""
        return status(self.fmu.doStep, time, size)

    def advance(self, end: float) -> None:
        """Advance to a time through any interface, with all events."""
        if self.exchanges:
            Integrator(self).advance(end)
        elif self.version == 2:
            self.fmu.doStep(self.time, end - self.time)
            self.time = end
        else:
            self._advance3(end)

    def _advance3(self, end: float) -> None:
        while self.time < end:
            event, _, early, self.time = self.fmu.doStep(self.time, end - self.time)
            assert early == (self.time < end)
            if event:
                self.fmu.enterEventMode()
                self.update()

    def run(self, times: Iterable[float]) -> list[bytes]:
        """Advance to each communication point; return the bytes of the values there."""
        result = []
        for time in times:
            self.advance(time)
            result.append(self.bytes())
        return result

    # -- saved states --

    def saved(self) -> bytes:
        """Return the present state, serialized."""
        state = self.fmu.getFMUState()
        data: bytes = self.fmu.serializeFMUState(state)
        self.fmu.freeFMUState(state)
        return data

    def restore(self, data: bytes) -> None:
        """Restore a serialized state."""
        state = self.fmu.deserializeFMUState(data)
        self.fmu.setFMUState(state)
        self.fmu.freeFMUState(state)


class Integrator:
    """Integrator for model exchange: classical Runge-Kutta steps, events located by bisection."""

    EVENT_TIME_ATOL = 1e-12  # s

    def __init__(self, instance: Instance) -> None:
        self.it, self.fmu = instance, instance.fmu
        self.states = instance.description.numberOfContinuousStates
        self.indicators = instance.description.numberOfEventIndicators
        self.derivatives = instance.function("getDerivatives", "getContinuousStateDerivatives")

    def _filled(self, getter: Callable[..., Any], count: int) -> np.ndarray:
        values = (c_double * count)()
        getter(values, count)
        return np.array(values)

    def x(self) -> np.ndarray:
        return self._filled(self.fmu.getContinuousStates, self.states)

    def z(self) -> np.ndarray:
        return self._filled(self.fmu.getEventIndicators, self.indicators)

    def put(self, time: float, x: np.ndarray) -> None:
        self.fmu.setTime(time)
        self.fmu.setContinuousStates((c_double * self.states)(*x), self.states)

    def slope(self, time: float, x: np.ndarray) -> np.ndarray:
        self.put(time, x)
        return self._filled(self.derivatives, self.states)

    def step(self, time: float, x: np.ndarray, h: float) -> np.ndarray:
        k1 = self.slope(time, x)
        k2 = self.slope(time + h / 2, x + h / 2 * k1)
        k3 = self.slope(time + h / 2, x + h / 2 * k2)
        k4 = self.slope(time + h, x + h * k3)
        result: np.ndarray = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        self.put(time + h, result)
        return result

    def advance(self, end: float) -> None:
        time, x = self.it.time, self.x()
        while end - time > self.EVENT_TIME_ATOL:
            sign, h = self.z() > 0.0, min(self.it.substep, end - time)
            x1 = self.step(time, x, h)
            if crossed := ((self.z() > 0.0) != sign).any():
                h, x1 = self._root(time, x, h, sign)
            time, x = time + h, x1
            event, _ = self.fmu.completedIntegratorStep()
            if crossed or event:
                self.fmu.enterEventMode()
                self.it.update()
                x = self.x()
        self.it.time = time

    def _root(
        self, time: float, x: np.ndarray, h: float, sign: np.ndarray
    ) -> tuple[float, np.ndarray]:
        low, high = 0.0, h
        while high - low > self.EVENT_TIME_ATOL:
            middle = (low + high) / 2
            self.step(time, x, middle)
            low, high = (low, middle) if ((self.z() > 0.0) != sign).any() else (middle, high)
        return high, self.step(time, x, high)


def status(function: Callable[..., Any], *arguments: Any) -> int:
    """Call a function of FMPy and return the status."""
    try:
        function(*arguments)
    except FMICallException as error:
        return int(error.status)
    return OK
