"""The modelDescription.xml of Python FMUs, and the parts common to all model descriptions."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ..base.text import printable
from ..base.version import GENERATION_TOOL, __version__
from ..interface.units import QUANTITIES, UNITS
from ..interface.variables import Variable
from ..runs.experiment import Experiment
from .date import date

TOLERANCE = "solver.tolerance"


@dataclass(frozen=True)
class Heading:
    """Metadata of a model as a whole.

    Parameters
    ----------
    name, description : str
        Name of the model and one sentence about it.
    guid : str
        The guid (FMI 2.0) or instantiation token (FMI 3.0).
    log_categories : mapping of str to str
        Description of each category of log messages.
    experiment : Experiment
        The default experiment.
    """

    name: str
    description: str
    guid: str
    log_categories: Mapping[str, str]
    experiment: Experiment = field(default_factory=Experiment)

    def attributes(self) -> dict[str, str]:
        """Return the attributes that model descriptions of FMI 2.0 and 3.0 have in common."""
        return {
            "description": self.description,
            "version": __version__,
            "license": "MIT",
            "generationTool": GENERATION_TOOL,
            "generationDateAndTime": date(),
            "variableNamingConvention": "structured",
        }


def model_description(heading: Heading, variables: tuple[Variable, ...]) -> bytes:
    """Return the modelDescription.xml of a Python FMU: FMI 2.0, co-simulation."""
    version = {"fmiVersion": "2.0", "modelName": heading.name, "guid": heading.guid}
    root = Element("fmiModelDescription", version | heading.attributes())
    _co_simulation(root, heading.name)
    add_units(root, variables)
    add_types(root, variables)
    add_log_categories(root, heading)
    add_experiment(root, heading, variables)
    index = {v.name: str(i) for i, v in enumerate(variables, start=1)}
    add_variables(root, variables, index)
    root.append(_structure(variables, index))
    return serialized(root)


def serialized(root: Element) -> bytes:
    """Return the bytes of an XML file, indented, without unprintable characters."""
    ElementTree.indent(root)
    for element in root.iter():
        for name, value in element.items():
            element.set(name, printable(value))
    text: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def number(value: float | int | bool | None) -> str:
    """Return a number as the text of an XML attribute that reads back exactly."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value)


def _co_simulation(root: Element, identifier: str) -> None:
    true = (
        "needsExecutionTool",  # Python with NumPy and SciPy.
        "canHandleVariableCommunicationStepSize",
        "canNotUseMemoryManagementFunctions",
        "canGetAndSetFMUstate",
        "canSerializeFMUstate",
    )
    attributes = {"modelIdentifier": identifier} | dict.fromkeys(true, "true")
    SubElement(root, "CoSimulation", attributes)


def add_log_categories(root: Element, heading: Heading) -> None:
    """Add the categories of log messages."""
    categories = SubElement(root, "LogCategories")
    for name, description in heading.log_categories.items():
        SubElement(categories, "Category", {"name": name, "description": description})


def add_experiment(root: Element, heading: Heading, variables: Iterable[Variable]) -> None:
    """Add the default experiment."""
    starts = {v.name: v.start for v in variables}
    experiment = {
        "startTime": number(0.0),
        "stopTime": number(heading.experiment.stop_time),
        "tolerance": number(starts[TOLERANCE]),
        "stepSize": number(heading.experiment.step),
    }
    SubElement(root, "DefaultExperiment", experiment)


def add_units(root: Element, variables: Iterable[Variable]) -> None:
    """Add the definitions of the units that the variables have."""
    used = {v.unit for v in variables if v.unit}
    definitions = SubElement(root, "UnitDefinitions")
    for name, unit in UNITS.items():
        if name in used:
            element = SubElement(definitions, "Unit", {"name": name})
            SubElement(element, "BaseUnit", {base: str(n) for base, n in unit.base.items()})
            for display, factor in unit.display.items():
                SubElement(element, "DisplayUnit", {"name": display, "factor": number(factor)})


def add_types(root: Element, variables: Iterable[Variable]) -> None:
    """Add the definitions of the quantities that the variables have, in the form of FMI 2.0."""
    definitions = SubElement(root, "TypeDefinitions")
    for quantity, attributes in used_types(variables):
        simple = SubElement(definitions, "SimpleType", {"name": quantity})
        SubElement(simple, "Real", attributes)


def used_types(variables: Iterable[Variable]) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield the name and the attributes of each quantity that the variables have."""
    used = {v.unit for v in variables if v.unit}
    for unit, quantity in QUANTITIES.items():
        if unit in used:
            attributes = {"quantity": quantity.name, "unit": unit}
            if quantity.display:
                attributes["displayUnit"] = quantity.display
            yield quantity.name, attributes


def add_variables(root: Element, variables: Iterable[Variable], index: Mapping[str, str]) -> None:
    """Add the variables in the form of FMI 2.0; ``index`` maps their names to their indices."""
    listed = SubElement(root, "ModelVariables")
    for v in variables:
        attributes = {
            "name": v.name,
            "valueReference": str(v.reference),
            "description": v.description,
            "causality": v.causality,
            "variability": v.variability,
        }
        if v.initial:
            attributes["initial"] = v.initial
        scalar = SubElement(listed, "ScalarVariable", attributes)
        SubElement(scalar, v.type, value_attributes(v, index))


def value_attributes(v: Variable, index: Mapping[str, str]) -> dict[str, str]:
    """Return the attributes of a variable's values: type, unit, bounds, nominal and start value.

    ``index`` maps variable names to the numbers that refer to them: indices in FMI 2.0, value
    references in FMI 3.0.
    """
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
    if v.reinit:
        value["reinit"] = "true"
    return value


def _structure(variables: tuple[Variable, ...], index: Mapping[str, str]) -> Element:
    """Return the ModelStructure: the dependencies of outputs and of initial unknowns.

    At a communication point no output depends on the inputs that are set there, because they act
    from the next step on.
    """
    structure = Element("ModelStructure")
    outputs = SubElement(structure, "Outputs")
    initial = SubElement(structure, "InitialUnknowns")
    for v in variables:
        if v.causality == "output":
            SubElement(outputs, "Unknown", {"index": index[v.name], "dependencies": ""})
        elif v.causality != "calculatedParameter":
            continue
        known = initial_dependencies(v, variables)
        dependencies = " ".join(index[name] for name in known)
        SubElement(initial, "Unknown", {"index": index[v.name], "dependencies": dependencies})
    return structure


def initial_dependencies(unknown: Variable, variables: Iterable[Variable]) -> list[str]:
    """Return the parameters and inputs that the initial value of an unknown depends on.

    The length of a flexure's stub, ``gamma0``, depends on the other gammas of its type; every other
    unknown depends on all parameters and inputs.
    """
    prefix = ""
    if unknown.causality == "calculatedParameter":
        prefix = unknown.name.rpartition(".")[0] + ".gamma"
    return [
        v.name
        for v in variables
        if (v.initial == "exact" or v.causality == "input") and v.name.startswith(prefix)
    ]
