"""Parameter sets in the format SSV of the standard SSP (System Structure and Parameterization).

A set is a file ``.ssv`` of names, values and units.  Tools apply it to the FMU of a mechanism, in a
system description or on its own.  Written sets have the version 1.0; sets of 2.0 are read, too.
"""

import math
from collections.abc import Iterable, Mapping
from decimal import Decimal, InvalidOperation
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ..base import reading
from ..base.errors import ParameterError
from ..base.names import unknown
from ..base.version import GENERATION_TOOL
from ..interface.units import UNITS
from ..interface.variables import Variable
from ..mechanism.description import Mechanism
from .description import number, serialized
from .related import Related

SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"  # Of SSP 2.0, too.
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
MIME_TYPE = "application/x-ssp-parameter-set"
FILE_SIZE_MAX = 10_000_000  # bytes
BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
NO_NUMBERS = ("Boolean", "String", "Enumeration", "Binary")  # Types of values that are no numbers.


def parameter_set(
    mechanism: Mechanism,
    variables: Iterable[Variable],
    name: str = "default",
    inputs: Iterable[str] = (),
) -> bytes:
    """Return the parameter set of a mechanism: the start values of all its parameters, in SI.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    variables : iterable of Variable
        The variables of its FMU, with the start values.
    name : str
        Name of the set.
    inputs : iterable of str
        Names of inputs whose start values are in the set, too.
    """
    given = {*inputs}
    listed = [v for v in variables if v.causality == "parameter" or v.name in given]
    for prefix, space in (("ssv", SSV), ("ssc", SSC)):
        ElementTree.register_namespace(prefix, space)
    root = Element(f"{{{SSV}}}ParameterSet", {"version": "1.0", "name": name})
    root.set("description", mechanism.title)
    root.set("generationTool", GENERATION_TOOL)
    parameters = SubElement(root, f"{{{SSV}}}Parameters")
    for v in listed:
        attributes = {"name": v.name, "description": v.description}
        parameter = SubElement(parameters, f"{{{SSV}}}Parameter", attributes)
        assert v.start is not None
        unit = {} if v.unit == "1" else {"unit": v.unit}
        SubElement(parameter, f"{{{SSV}}}Real", {"value": number(float(v.start))} | unit)
    units = SubElement(root, f"{{{SSV}}}Units")
    used = {v.unit for v in listed} - {"1"}
    for unit_name in (unit for unit in UNITS if unit in used):
        unit_element = SubElement(units, f"{{{SSC}}}Unit", {"name": unit_name})
        base = {symbol: str(n) for symbol, n in UNITS[unit_name].base.items()}
        SubElement(unit_element, f"{{{SSC}}}BaseUnit", base)
    if not used:
        root.remove(units)  # The schema forbids an empty list.
    return serialized(root)


def default_set(mechanism: Mechanism, variables: Iterable[Variable]) -> Related:
    """Return the parameter set inside an FMU: the start values of its parameters and inputs."""
    variables = tuple(variables)
    inputs = [v.name for v in variables if v.causality == "input" and v.start]
    content = parameter_set(mechanism, variables, inputs=inputs)
    text = "Start values of all parameters, and of inputs other than 0"
    return Related(f"{mechanism.name}.ssv", content, MIME_TYPE, "parameter", text)


def read_parameter_set(path: str | Path, units: Mapping[str, str]) -> dict[str, float]:
    """Read a parameter set.

    Parameters
    ----------
    path : str or Path
        A file ``.ssv`` of SSP 1.0 or 2.0.
    units : mapping
        SI units of the known parameters and inputs by name; empty if dimensionless.

    Returns
    -------
    dict of str to float
        Values in SI by name.

    Raises
    ------
    ParameterError
        If the file is no parameter set, a name is unknown or given twice, a value is not a finite
        number, or a unit is not defined or has another dimension.
    """
    root = _root(Path(path))
    defined = {u.get("name", ""): u for u in root.iter(f"{{{SSC}}}Unit")}
    values: dict[str, float] = {}
    for parameter in root.iterfind(f"{{{SSV}}}Parameters/{{{SSV}}}Parameter"):
        name = parameter.get("name", "")
        try:
            if name not in units:
                raise ParameterError(unknown(name, units))
            if name in values:
                raise ParameterError(f"{name} is given twice; remove one of them")
            values[name] = _value(parameter, name, units[name], defined)
        except ParameterError as error:
            raise ParameterError(f"{path}: {error}") from None
    return values


def _root(path: Path) -> Element:
    """Return the root of a parameter set."""
    content = reading.content(path, FILE_SIZE_MAX, ParameterError)
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise ParameterError(f"{path}: not a parameter set ({error}); give a file .ssv") from None
    if root.tag != f"{{{SSV}}}ParameterSet":
        raise ParameterError(
            f"{path}: not a parameter set of SSP (the root element is {root.tag[:80]}); give a "
            "file .ssv, as prbm parameters --out writes"
        )
    return root


def _value(parameter: Element, name: str, unit: str, defined: Mapping[str, Element]) -> float:
    """Return the value of a parameter in SI."""
    found = next((e for e in parameter if e.tag.startswith(f"{{{SSV}}}")), None)
    kind = "" if found is None else found.tag.rpartition("}")[2]
    if found is None or kind in NO_NUMBERS:
        raise ParameterError(f"{name} has {f'a value of type {kind}' if kind else 'no value'}; "
                             "write a Real")  # fmt: skip
    text = found.get("value", "")
    given = _number(name, text)
    written = found.get("unit")
    if written is None or written == (unit or "1"):
        factor, offset = Decimal(1), Decimal(0)
    elif written in defined:
        factor, offset = _conversion(name, written, unit, defined[written])
    else:
        raise ParameterError(
            f"{name} = {text} {written}: the file does not define the unit {written}; define it, "
            f"or write the value in {unit or '1'}"
        )
    value = float(given * factor + offset)
    if not math.isfinite(value):
        raise ParameterError(f"{name} = {text} {written}: write a finite number")
    return value


def _conversion(name: str, written: str, unit: str, defined: Element) -> tuple[Decimal, Decimal]:
    """Return factor and offset from a defined unit to the SI unit of a parameter."""
    base = defined.find(f"{{{SSC}}}BaseUnit")
    attributes = {} if base is None else dict(base.attrib)
    wanted = UNITS[unit or "1"].base if (unit or "1") in UNITS else None
    exponents = {symbol: _number(name, attributes.get(symbol, "0")) for symbol in BASE_UNITS}
    if wanted is None or any(n != wanted.get(symbol, 0) for symbol, n in exponents.items()):
        raise ParameterError(
            f"{name}: the unit {written} has another dimension; write a value in {unit or '1'}"
        )
    return _number(name, attributes.get("factor", "1")), _number(
        name, attributes.get("offset", "0")
    )


def _number(name: str, text: str) -> Decimal:
    """Return a finite number."""
    try:
        number = Decimal(text.strip())
    except InvalidOperation:
        number = Decimal("NaN")
    if not number.is_finite():
        raise ParameterError(f"{name} = {text!r}: write a finite number")
    return number
