"""FMUs as components of a system, on FMPy's classes: variables by name, errors with remedies."""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import chdir, suppress
from difflib import get_close_matches
from pathlib import Path
from typing import Any, SupportsFloat

from fmpy import extract, read_model_description  # type: ignore[import-untyped]
from fmpy.fmi1 import FMICallException  # type: ignore[import-untyped]
from fmpy.fmi2 import (  # type: ignore[import-untyped]
    FMU2Model,
    FMU2Slave,
    defaultCallbacks,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.fmi3 import FMU3Model, FMU3Slave  # type: ignore[import-untyped]

from ..base.archives import check_unpacked_size
from ..base.errors import PrbmError

Value = float | int | bool
INPUTS = ("input", "parameter", "structuralParameter")  # what may be given a start value
CO_SIMULATION, MODEL_EXCHANGE = "co-simulation", "model exchange"
CLASSES = {
    (CO_SIMULATION, 2): FMU2Slave, (CO_SIMULATION, 3): FMU3Slave,
    (MODEL_EXCHANGE, 2): FMU2Model, (MODEL_EXCHANGE, 3): FMU3Model,
}  # fmt: skip
TEXTS = {"String": str, "Binary": bytes}  # types that are no numbers
ENUMERATED = {2: "Integer", 3: "Int64"}  # as which enumerations are read and given
DESCRIBED = {CO_SIMULATION: "coSimulation", MODEL_EXCHANGE: "modelExchange"}


class CouplingError(PrbmError, ValueError):
    """FMUs cannot be coupled as they are asked to be, or one of them fails."""


class Component:
    """An FMU that is unpacked and loaded; what uses it instantiates and steps it.

    Parameters
    ----------
    name : str
        Of the instance.
    fmu : str or Path
        Of FMI 2.0 or 3.0.
    folder : str or Path
        An empty folder, where it is unpacked.
    kind : str
        :data:`CO_SIMULATION` or :data:`MODEL_EXCHANGE`.

    Attributes
    ----------
    time : float
        Where it is, for messages [s].
    variables : dict
        What FMPy knows of them, by name.

    Raises
    ------
    CouplingError
        If there is no FMU that can do that.
    """

    def __init__(self, name: str, fmu: str | Path, folder: str | Path, kind: str) -> None:
        self.name, self.time = name, 0.0
        self.description = described(name, fmu)
        self.interface = getattr(self.description, DESCRIBED[kind])
        self.version = int(self.description.fmiVersion[0])
        if self.interface is None or self.version < 2:
            raise CouplingError(f"{name}: {fmu} has no {kind} of FMI 2.0 or 3.0")
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.said = ""  # the last message of the FMU about an error
        self.callbacks = self._callbacks()
        self.fmu: Any = self._loaded(CLASSES[kind, self.version], fmu, folder)

    def _loaded(self, of: Any, fmu: str | Path, folder: str | Path) -> Any:
        try:
            with chdir("."):  # back to it: FMPy stays in the folder of what it cannot load
                return of(
                    guid=self.description.guid,
                    unzipDirectory=str(extract(str(fmu), str(folder))),
                    modelIdentifier=self.interface.modelIdentifier,
                    instanceName=self.name,
                )
        except Exception as error:
            raise CouplingError(f"{self.name}: {fmu} cannot be loaded here ({error})") from None

    def instantiate(self, **options: Any) -> None:
        """Instantiate it and keep its messages about errors.

        In FMI 2.0 the instance gets callbacks of its own.  FMPy's default callbacks share one
        native logger with every simulation of the process, and end the process after another
        simulation with a logger has been collected.
        """
        if self.version > 2:
            options |= {"loggingOn": True, "logMessage": self._note}
            self.call("instantiate", **options)
        else:
            self.call("instantiate", callbacks=self.callbacks, loggingOn=True)

    def _callbacks(self) -> Any:
        """Return callbacks of FMI 2.0, which live as long as the component."""
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(self._note_fmi2)
        callbacks.allocateMemory = defaultCallbacks.allocateMemory
        callbacks.freeMemory = defaultCallbacks.freeMemory
        return callbacks

    def _note_fmi2(self, _: Any, __: bytes, status: int, category: bytes, message: bytes) -> None:
        """Keep a message of FMI 2.0, a format without arguments."""
        self._note(
            None, status, category, (message or b"").replace(b"%%", b"%").replace(b"##", b"#")
        )

    def _note(self, _: Any, status: int, category: bytes, message: bytes) -> None:
        """Keep a message about an error, not one about an event."""
        if status > 0:
            self.said = message.decode(errors="replace")

    def call(self, function: str, *arguments: Any, **options: Any) -> Any:
        """Call a function of the FMU by FMPy's name.

        Raises
        ------
        CouplingError
            If it fails; with what the FMU said.
        """
        try:
            return getattr(self.fmu, function)(*arguments, **options)
        except FMICallException as error:
            why = self.said or "it gave no reason"
            raise CouplingError(
                f"{self.name}: {error.function} at {self.time:g} s returned the status "
                f"{error.status}: {why}"
            ) from None
        except Exception as error:
            raise CouplingError(f"{self.name}: {function} failed ({error})") from None

    def variable(self, name: str) -> Any:
        """Return what FMPy knows of a variable.

        Raises
        ------
        CouplingError
            If there is none of that name; the message lists similar ones.
        """
        if name not in self.variables:
            near = get_close_matches(name, self.variables)
            hint = f"; near it are {', '.join(near)}" if near else ""
            raise CouplingError(f"{self.name} has no variable {name!r}{hint}")
        return self.variables[name]

    def get(self, names: Sequence[str]) -> dict[str, Value]:
        """Return variables by name, those of a type with one call."""
        result: dict[str, Value] = {}
        for kind, some in self._kinds(names).items():
            references = [self.variables[name].valueReference for name in some]
            result |= dict(zip(some, self.call(f"get{kind}", references), strict=True))
        return result

    def set(self, values: Mapping[str, Value]) -> None:
        """Give values to variables."""
        for kind, some in self._kinds(values).items():
            references = [self.variables[name].valueReference for name in some]
            self.call(f"set{kind}", references, [values[name] for name in some])

    def _kinds(self, names: Sequence[str] | Mapping[str, Value]) -> dict[str, list[str]]:
        kinds = defaultdict(list)
        for name in names:
            kind = self.variable(name).type
            kinds[ENUMERATED[self.version] if kind == "Enumeration" else kind].append(name)
        return kinds


def described(name: str, fmu: str | Path) -> Any:
    """Return what FMPy knows of an FMU, the name being that of its instance.

    Raises
    ------
    CouplingError
        If there is no FMU that can be read.
    """
    try:
        check_unpacked_size(fmu)
        return read_model_description(str(fmu))
    except Exception as error:
        raise CouplingError(f"{name}: {fmu} is no FMU that can be read ({error})") from None


def start_value(full: str, value: object, variable: Any) -> Any:
    """Return a value as Python's own of the variable's type; numbers of NumPy are numbers, too.

    Raises
    ------
    CouplingError
        If the variable may not be given a start value, or not this one.
    """
    if variable.causality not in INPUTS:
        raise CouplingError(f"{full} = {value} cannot be given: it is neither input nor parameter")
    if variable.type in TEXTS:
        if not isinstance(value, TEXTS[variable.type]):
            kind = TEXTS[variable.type].__name__
            raise CouplingError(f"{full} = {value!r} must be of Python's type {kind}")
        return value
    if isinstance(value, SupportsFloat):  # which a string is not
        with suppress(TypeError, OverflowError):  # an array, a number beyond all floats
            return _of_type(full, value, variable.type)
    raise CouplingError(f"{full} = {value!r} must be a number, in the unit of the variable")


def _of_type(full: str, value: Any, kind: str) -> Value:
    """Return a number as one of a type of FMI."""
    number = float(value)
    if math.isnan(number):
        raise CouplingError(f"{full} = {value} is no number")
    if kind.startswith(("Real", "Float")):
        return number
    if kind == "Boolean":
        if number not in (0.0, 1.0):
            raise CouplingError(f"{full} = {value} must be True or False")
        return bool(number)
    if not number.is_integer():
        raise CouplingError(f"{full} = {value} must be a whole number")
    return int(value)


def check_wire(to: str, given: Any, source: str) -> None:
    """Check that what a connection leads to is an input.

    Raises
    ------
    CouplingError
        If not.
    """
    if given.causality != "input":
        raise CouplingError(f"{to} is no input: connect {source} to one")
