"""FMUs as components of a system: FMPy's classes with access by name and errors with remedies."""

import math
import zipfile
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
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
from lxml import etree  # type: ignore[import-untyped]

from ..base.archives import check_unpacked_size
from ..base.errors import PrbmError
from ..runs.result import Columns

Value = float | int | bool
INPUTS = (
    "input",
    "parameter",
    "structuralParameter",
)  # causalities with a start value
CO_SIMULATION, MODEL_EXCHANGE = "co-simulation", "model exchange"
CLASSES = {
    (CO_SIMULATION, 2): FMU2Slave, (CO_SIMULATION, 3): FMU3Slave,
    (MODEL_EXCHANGE, 2): FMU2Model, (MODEL_EXCHANGE, 3): FMU3Model,
}  # fmt: skip
TEXTS = {
    "String": str,
    "Binary": bytes,
}  # Python's types for the non-numeric types of FMI
ENUMERATED = {2: "Integer", 3: "Int64"}  # type of an enumeration's values, by FMI version
INTEGERS = {
    **{f"Int{n}": (-(2 ** (n - 1)), 2 ** (n - 1) - 1) for n in (8, 16, 32, 64)},
    **{f"UInt{n}": (0, 2**n - 1) for n in (8, 16, 32, 64)},
}
INTEGERS |= {"Integer": INTEGERS["Int32"], "Enumeration": INTEGERS["Int64"]}
"""Smallest and largest value by type of FMI; ctypes drops the bits of others without a word."""
FLOAT32_MAX = (2.0 - 2.0**-23) * 2.0**127
LIMITED = {*INTEGERS, "Real", "Float64", "Float32", "String"}  # types of :func:`check_size`
DESCRIBED = {CO_SIMULATION: "coSimulation", MODEL_EXCHANGE: "modelExchange"}


class CouplingError(PrbmError, ValueError):
    """The FMUs cannot be coupled in the requested way, or one of them fails.

    Attributes
    ----------
    columns : structured array or None
        The rows that a simulation has computed before an FMU failed or ended it.
    """

    columns: Columns | None = None


class Component:
    """An unpacked and loaded FMU.  Subclasses instantiate and advance it.

    Parameters
    ----------
    name : str
        Name of the instance.
    fmu : str or Path
        An FMU of FMI 2.0 or 3.0.
    folder : str or Path
        An empty folder into which the FMU is unpacked.
    kind : str
        :data:`CO_SIMULATION` or :data:`MODEL_EXCHANGE`.

    Attributes
    ----------
    time : float
        Current time, for messages [s].
    variables : dict
        FMPy's descriptions of the variables, by name.

    Raises
    ------
    CouplingError
        If the FMU cannot be read or loaded, or does not have this interface.
    """

    def __init__(self, name: str, fmu: str | Path, folder: str | Path, kind: str) -> None:
        self.name, self.time = name, 0.0
        self.description = described(name, fmu)
        self.interface = getattr(self.description, DESCRIBED[kind])
        self.version = int(self.description.fmiVersion[0])
        if self.interface is None or self.version < 2:
            raise CouplingError(f"{name}: {fmu} has no {kind} of FMI 2.0 or 3.0")
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.last_error = ""  # last message of the FMU about an error
        self.callbacks = self._callbacks()
        self.fmu: Any = self._loaded(CLASSES[kind, self.version], fmu, folder)

    def _loaded(self, fmpy_class: Any, fmu: str | Path, folder: str | Path) -> Any:
        try:
            with chdir("."):  # FMPy does not restore the working directory if loading fails.
                return fmpy_class(
                    guid=self.description.guid,
                    unzipDirectory=str(extract(str(fmu), str(folder))),
                    modelIdentifier=self.interface.modelIdentifier,
                    instanceName=self.name,
                )
        except Exception as error:
            raise CouplingError(f"{self.name}: {fmu} cannot be loaded here ({error})") from None

    def instantiate(self, **options: Any) -> None:
        """Instantiate the FMU and store its messages about errors.

        In FMI 2.0 each instance gets separate callbacks.  FMPy's default callbacks share one
        native logger with every simulation of the process.  They crash the process after another
        simulation with a logger has been garbage-collected.
        """
        if self.version > 2:
            options |= {"loggingOn": True, "logMessage": self._note}
            self.call("instantiate", **options)
        else:
            self.call("instantiate", callbacks=self.callbacks, loggingOn=True)

    def _callbacks(self) -> Any:
        """Return callbacks of FMI 2.0; the component keeps them alive."""
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(self._note_fmi2)
        callbacks.allocateMemory = defaultCallbacks.allocateMemory
        callbacks.freeMemory = defaultCallbacks.freeMemory
        return callbacks

    def _note_fmi2(self, _: Any, __: bytes, status: int, category: bytes, message: bytes) -> None:
        """Store a message of FMI 2.0, which is a format string without arguments."""
        self._note(
            None, status, category, (message or b"").replace(b"%%", b"%").replace(b"##", b"#")
        )

    def _note(self, _: Any, status: int, category: bytes, message: bytes) -> None:
        """Store a message about a warning or an error; ignore the others."""
        if status > 0:
            self.last_error = message.decode(errors="replace")

    def call(self, function: str, *arguments: Any, **options: Any) -> Any:
        """Call a function of the FMU by FMPy's name.

        Raises
        ------
        CouplingError
            If it fails; the error contains the last message of the FMU.
        """
        try:
            return getattr(self.fmu, function)(*arguments, **options)
        except FMICallException as error:
            why = self.last_error or "the FMU logged no reason"
            raise CouplingError(
                f"{self.name}: {error.function} at {self.time:g} s returned the status "
                f"{error.status}: {why}"
            ) from None
        except Exception as error:
            why = self.last_error or str(error)
            raise CouplingError(f"{self.name}: {function} failed ({why})") from None

    def variable(self, name: str) -> Any:
        """Return FMPy's description of a variable.

        Raises
        ------
        CouplingError
            If no variable has that name, and the message lists similar names; or it is an array.
        """
        if name not in self.variables:
            near = get_close_matches(name, self.variables)
            hint = f"; similar names are {', '.join(near)}" if near else ""
            raise CouplingError(f"{self.name} has no variable {name!r}{hint}")
        if self.variables[name].dimensions:
            raise CouplingError(
                f"{self.name}.{name} is an array: arrays are not supported; use an FMU whose "
                "variables are scalars"
            )
        return self.variables[name]

    def get(self, names: Sequence[str]) -> dict[str, Value]:
        """Return the values of variables by name, with one call of the FMU per type."""
        result: dict[str, Value] = {}
        for kind, some in self._kinds(names).items():
            references = [self.variables[name].valueReference for name in some]
            found = self.call(f"get{kind}", references)
            if kind == "String" and self.version == 2:  # FMPy decodes those of FMI 3.0 only
                found = [self._decoded(*pair) for pair in zip(some, found, strict=True)]
            result |= dict(zip(some, found, strict=True))
        return result

    def _decoded(self, name: str, text: bytes | None) -> str:
        try:
            return (text or b"").decode()
        except UnicodeDecodeError as error:
            raise CouplingError(f"{self.name}.{name} is not in UTF-8 ({error})") from None

    def set(self, values: Mapping[str, Value]) -> None:
        """Set variables by name, with one call of the FMU per type."""
        for kind, some in self._kinds(values).items():
            references = [self.variables[name].valueReference for name in some]
            if kind in LIMITED:
                for name in some:
                    check_size(f"{self.name}.{name}", values[name], kind)
            self.call(f"set{kind}", references, [values[name] for name in some])

    def _kinds(self, names: Sequence[str] | Mapping[str, Value]) -> dict[str, list[str]]:
        """Return the names by type of FMI."""
        kinds = defaultdict(list)
        for name in names:
            kind = self.variable(name).type
            kinds[ENUMERATED[self.version] if kind == "Enumeration" else kind].append(name)
        return kinds


def attribute(variable: Any, name: str) -> Any:
    """Return an attribute of a variable, or that of its declared type."""
    own = getattr(variable, name)
    return getattr(variable.declaredType, name, None) if own is None else own


def described(name: str, fmu: str | Path) -> Any:
    """Return FMPy's model description of an FMU; the name of the instance is for messages.

    Raises
    ------
    CouplingError
        If the file cannot be read as an FMU.
    """
    try:
        check_unpacked_size(fmu)
        description = read_model_description(str(fmu))
        _mark_relative(description, fmu)
    except Exception as error:
        raise CouplingError(f"{name}: {fmu} cannot be read as an FMU ({error})") from None
    return description


def _mark_relative(description: Any, fmu: str | Path) -> None:
    """Set ``relativeQuantity`` of the variables; FMPy reads that of declared types only."""
    with zipfile.ZipFile(fmu) as archive:
        text = archive.read("modelDescription.xml")
    if b"relativeQuantity" not in text:
        return
    root = etree.fromstring(text, etree.XMLParser(resolve_entities=False, no_network=True))
    variables = {v.name: v for v in description.modelVariables}
    for element in root.iterfind("ModelVariables/*"):
        for own in (element, *element):
            if (given := own.get("relativeQuantity")) is not None:
                variables[element.get("name")].relativeQuantity = given.strip() in ("true", "1")


def start_value(full: str, value: object, variable: Any) -> Any:
    """Convert a start value to Python's type for the variable; NumPy's numbers are accepted.

    Raises
    ------
    CouplingError
        If the variable has no start value, or the value does not fit its type.
    """
    if variable.causality not in INPUTS:
        raise CouplingError(f"{full} = {value} cannot be set: it is neither input nor parameter")
    if variable.type in TEXTS:
        if not isinstance(value, TEXTS[variable.type]):
            kind = TEXTS[variable.type].__name__
            raise CouplingError(f"{full} = {value!r} must be of Python's type {kind}")
        check_size(full, value, variable.type)
        return value
    if isinstance(value, SupportsFloat):  # False for a string
        with suppress(TypeError, OverflowError):  # an array, or an integer above the largest float
            return _of_type(full, value, variable.type)
    raise CouplingError(f"{full} = {value!r} must be a number, in the unit of the variable")


def _of_type(full: str, value: Any, kind: str) -> Value:
    """Convert a number to Python's type for a type of FMI."""
    number = float(value)
    if math.isnan(number):
        raise CouplingError(f"{full} = {value}: must be a number")
    if kind.startswith(("Real", "Float")):
        check_size(full, value, kind)
        return number
    if kind == "Boolean":
        if number not in (0.0, 1.0):
            raise CouplingError(f"{full} = {value} must be True or False")
        return bool(number)
    if not number.is_integer():
        raise CouplingError(f"{full} = {value} must be a whole number")
    check_size(full, int(value), kind)
    return int(value)


def check_size(full: str, value: Any, kind: str) -> None:
    """Check that an FMU receives a value as it is: that it fits the type of FMI.

    Raises
    ------
    CouplingError
        If a number is too large for its type, an integer is not equal to a float, or a text
        contains the character that ends it.
    """
    if kind in INTEGERS:
        least, most = INTEGERS[kind]
        if not least <= value <= most:
            raise CouplingError(f"{full} = {value} must be in [{least}, {most}], its type {kind}")
    elif kind in ("Real", "Float64"):
        if isinstance(value, int) and int(float(value)) != value:
            raise CouplingError(f"{full} = {value}: its type {kind} does not have this integer")
    elif kind == "Float32" and math.isfinite(value) and abs(value) > FLOAT32_MAX:
        raise CouplingError(f"{full} = {value} is too large for its type Float32")
    elif kind == "String" and "\0" in value:
        raise CouplingError(
            f"{full} = {value!r}: a text of an FMU must not contain the character NUL"
        )


def check_instances(names: Iterable[str], forbidden: str) -> None:
    """Check the names of the instances of a system.

    Parameters
    ----------
    names : iterable of str
        The names.
    forbidden : str
        Characters that a name must not contain.

    Raises
    ------
    CouplingError
        If a name is empty or contains one of these characters.
    """
    for name in names:
        if not name or set(name) & set(forbidden):
            raise CouplingError(
                f"instance name {name!r}: must be non-empty and without {' '.join(forbidden)}"
            )


def check_wire(to: str, given: Any, source: str) -> None:
    """Check that the end of a connection is an input.

    Raises
    ------
    CouplingError
        If it has another causality.
    """
    if given.causality != "input":
        raise CouplingError(f"{to} is not an input: connect {source} to an input")
