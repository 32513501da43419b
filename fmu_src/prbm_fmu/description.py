"""The modelDescription.xml of FMI 2.0 for co-simulation."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from . import __version__
from .date import date
from .units import QUANTITIES, UNITS
from .variables import Variable

START_TIME, STOP_TIME, STEP_SIZE = 0.0, 1.0, 1e-3  # s, of the default experiment
TOLERANCE = "solver.tolerance"
GENERATION_TOOL = f"prbm-impact {__version__}"


@dataclass(frozen=True)
class Heading:
    """What a model description says about the model as a whole."""

    name: str
    description: str
    guid: str
    log_categories: Mapping[str, str]


def model_description(heading: Heading, variables: tuple[Variable, ...]) -> bytes:
    """Return the XML."""
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": heading.name,
            "guid": heading.guid,
            "description": heading.description,
            "version": __version__,
            "license": "MIT",
            "generationTool": GENERATION_TOOL,
            "generationDateAndTime": date(),
            "variableNamingConvention": "structured",
        },
    )
    _co_simulation(root, heading.name)
    _units(root, variables)
    _types(root, variables)
    categories = SubElement(root, "LogCategories")
    for name, description in heading.log_categories.items():
        SubElement(categories, "Category", {"name": name, "description": description})
    starts = {v.name: v.start for v in variables}
    experiment = {
        "startTime": number(START_TIME),
        "stopTime": number(STOP_TIME),
        "tolerance": number(starts[TOLERANCE]),
        "stepSize": number(STEP_SIZE),
    }
    SubElement(root, "DefaultExperiment", experiment)
    index = {v.name: str(i) for i, v in enumerate(variables, start=1)}
    listed = SubElement(root, "ModelVariables")
    for variable in variables:
        listed.append(_scalar_variable(variable, index))
    root.append(_structure(variables, index))
    ElementTree.indent(root)
    for element in root.iter():
        for name, value in element.items():
            element.set(name, plain(value))
    text: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def plain(text: str) -> str:
    r"""Return a text with blanks for the characters that XML and HTML cannot hold.

    Examples
    --------
    >>> plain("a bell\a rings")
    'a bell  rings'
    """
    return "".join(c if c.isprintable() else " " for c in text)


def number(value: float | int | bool | None) -> str:
    """Return a number as XML has it, exactly."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value)


def _co_simulation(root: Element, identifier: str) -> None:
    true = (
        "needsExecutionTool",  # Python with NumPy and SciPy
        "canHandleVariableCommunicationStepSize",
        "canNotUseMemoryManagementFunctions",
        "canGetAndSetFMUstate",
        "canSerializeFMUstate",
    )
    attributes = {"modelIdentifier": identifier} | dict.fromkeys(true, "true")
    SubElement(root, "CoSimulation", attributes)


def _units(root: Element, variables: Iterable[Variable]) -> None:
    used = {v.unit for v in variables if v.unit}
    definitions = SubElement(root, "UnitDefinitions")
    for name, unit in UNITS.items():
        if name in used:
            element = SubElement(definitions, "Unit", {"name": name})
            SubElement(element, "BaseUnit", {base: str(n) for base, n in unit.base.items()})
            for display, factor in unit.display.items():
                SubElement(element, "DisplayUnit", {"name": display, "factor": number(factor)})


def _types(root: Element, variables: Iterable[Variable]) -> None:
    used = {v.unit for v in variables if v.unit}
    definitions = SubElement(root, "TypeDefinitions")
    for unit, quantity in QUANTITIES.items():
        if unit in used:
            simple = SubElement(definitions, "SimpleType", {"name": quantity.name})
            attributes = {"quantity": quantity.name, "unit": unit}
            if quantity.display:
                attributes["displayUnit"] = quantity.display
            SubElement(simple, "Real", attributes)


def _scalar_variable(v: Variable, index: Mapping[str, str]) -> Element:
    attributes = {
        "name": v.name,
        "valueReference": str(v.reference),
        "description": v.description,
        "causality": v.causality,
        "variability": v.variability,
    }
    if v.initial:
        attributes["initial"] = v.initial
    element = Element("ScalarVariable", attributes)
    value: dict[str, str] = {}
    if v.type == "Real":
        value |= {"declaredType": v.quantity.name, "unit": v.unit}
        display = v.display or v.quantity.display
        if display:
            value["displayUnit"] = display
    if math.isfinite(v.minimum):
        value["min"] = number(v.minimum)
    if math.isfinite(v.maximum):
        value["max"] = number(v.maximum)
    if v.nominal is not None:
        value["nominal"] = number(float(v.nominal))
    if v.start is not None:
        value["start"] = number(v.start)
    if v.derivative_of:
        value["derivative"] = index[v.derivative_of]
    SubElement(element, v.type, value)
    return element


def _structure(variables: tuple[Variable, ...], index: Mapping[str, str]) -> Element:
    """Return the dependencies of the unknowns.

    At a communication point no output depends on the inputs set there: they act from there on.
    Initially everything depends on the parameters and inputs, except what counts impacts.
    """
    structure = Element("ModelStructure")
    outputs = SubElement(structure, "Outputs")
    initial = SubElement(structure, "InitialUnknowns")
    given = [v for v in variables if v.initial == "exact"]
    inputs = [v for v in variables if v.causality == "input"]
    for v in variables:
        if v.causality == "output":
            SubElement(outputs, "Unknown", {"index": index[v.name], "dependencies": ""})
            known = given + inputs
        elif v.causality == "calculatedParameter":
            prefix = v.name.rpartition(".")[0]
            known = [p for p in given if p.name.startswith(f"{prefix}.gamma")]
        else:
            continue
        dependencies = " ".join(index[k.name] for k in known)
        SubElement(initial, "Unknown", {"index": index[v.name], "dependencies": dependencies})
    return structure
