"""The model descriptions of native FMUs: FMI 2.0 and 3.0, model exchange and co-simulation."""

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement

from ..interface.native import NativeInterface
from ..interface.structure import dependencies
from ..interface.variables import CLOCK, Variable
from ..kernel.sources import OVERRIDE
from ..mechanism.description import Mechanism
from .description import (
    Heading,
    add_experiment,
    add_log_categories,
    add_types,
    add_units,
    add_variables,
    initial_dependencies,
    serialized,
    used_types,
    value_attributes,
)

LOG_CATEGORIES = {
    "logEvents": "Impacts, with time, speeds and energy loss.",
    "logStatusWarning": "Warnings; the simulation continues.",
    "logStatusDiscard": "Reasons why a value could not be computed in the present state.",
    "logStatusError": "Rejected calls and values, with the reason and a remedy.",
    "logStatusFatal": "Reasons why the instance cannot be used any more.",
    "logAll": "All messages.",
}
TYPES_3 = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", CLOCK: CLOCK}

# Capability flags whose default in the standard is false and that are true here.
BOTH_2 = ("canNotUseMemoryManagementFunctions", "canGetAndSetFMUstate", "canSerializeFMUstate")
EXCHANGE_2 = (*BOTH_2, "providesDirectionalDerivative")
SIMULATION_2 = (*BOTH_2, "canHandleVariableCommunicationStepSize")
BOTH_3 = ("canGetAndSetFMUState", "canSerializeFMUState")
EXCHANGE_3 = (*BOTH_3, "providesDirectionalDerivatives", "needsCompletedIntegratorStep")
SIMULATION_3 = (
    *BOTH_3,
    "canHandleVariableCommunicationStepSize",
    "providesIntermediateUpdate",
    "mightReturnEarlyFromDoStep",
    "canReturnEarlyAfterIntermediateUpdate",
    "hasEventMode",
)


def description(
    version: int,
    heading: Heading,
    mechanism: Mechanism,
    interface: NativeInterface,
    source: str,
) -> bytes:
    """Return the modelDescription.xml of a native FMU.

    Parameters
    ----------
    version : {2, 3}
        Version of FMI.
    heading : Heading
        Metadata of the model as a whole.
    mechanism : Mechanism
        The mechanism to export.
    interface : NativeInterface
        Its variables.
    source : str
        Name of the source file in ``sources``; FMI 2.0 lists it.
    """
    if version == 2:
        return _fmi2(heading, mechanism, interface, source)
    return _fmi3(heading, mechanism, interface)


def _capabilities(
    root: Element, kind: str, identifier: str, capabilities: Iterable[str]
) -> Element:
    attributes = {"modelIdentifier": identifier} | dict.fromkeys(capabilities, "true")
    return SubElement(root, kind, attributes)


# --- FMI 2.0 ------------------------------------------------------------------------------------


def _fmi2(heading: Heading, mechanism: Mechanism, interface: NativeInterface, source: str) -> bytes:
    version = {"fmiVersion": "2.0", "modelName": heading.name, "guid": heading.guid}
    root = Element("fmiModelDescription", version | heading.attributes())
    root.set("numberOfEventIndicators", str(len(interface.indicators)))
    for kind, capabilities in (("ModelExchange", EXCHANGE_2), ("CoSimulation", SIMULATION_2)):
        element = _capabilities(root, kind, heading.name, capabilities)
        SubElement(SubElement(element, "SourceFiles"), "File", {"name": source})
    add_units(root, interface.variables)
    add_types(root, interface.variables)
    add_log_categories(root, heading)
    add_experiment(root, heading, interface.variables)
    index = {v.name: str(i) for i, v in enumerate(interface.variables, start=1)}
    add_variables(root, interface.variables, index)
    structure = SubElement(root, "ModelStructure")
    known = dependencies(mechanism, interface)
    outputs = [v.name for v in interface.variables if v.causality == "output"]
    for kind, names in (("Outputs", outputs), ("Derivatives", interface.derivatives)):
        element = SubElement(structure, kind)
        for name in names:
            SubElement(element, "Unknown", _unknown("index", name, known[name], index))
    element = SubElement(structure, "InitialUnknowns")
    for v in initial_unknowns(interface):
        names = initial_dependencies(v, interface.variables)
        SubElement(element, "Unknown", _unknown("index", v.name, names, index))
    return serialized(root)


def _unknown(
    reference: str, name: str, known: Iterable[str], index: Mapping[str, str]
) -> dict[str, str]:
    """Return the attributes of an unknown: its reference and those of its dependencies."""
    return {reference: index[name], "dependencies": " ".join(index[k] for k in known)}


def initial_unknowns(interface: NativeInterface) -> list[Variable]:
    """Return the initial unknowns: outputs, calculated parameters, states and derivatives.

    Clocks are none, although they are outputs.  FMI 3.0.2 (2.4.8) lists outputs whose ``initial``
    is approx or calculated, a clock has no such attribute, and ``fmi3GetClock`` is not permitted
    in Initialization Mode.
    """
    moving = {*interface.states, *interface.derivatives}
    return [
        v
        for v in interface.variables
        if (v.causality in ("output", "calculatedParameter") and v.type != CLOCK)
        or v.name in moving
    ]


# --- FMI 3.0 ------------------------------------------------------------------------------------


def _fmi3(heading: Heading, mechanism: Mechanism, interface: NativeInterface) -> bytes:
    token = {"instantiationToken": heading.guid}
    version = {"fmiVersion": "3.0", "modelName": heading.name} | token
    root = Element("fmiModelDescription", version | heading.attributes())
    _capabilities(root, "ModelExchange", heading.name, EXCHANGE_3)
    _capabilities(root, "CoSimulation", heading.name, SIMULATION_3)
    add_units(root, interface.variables)
    types = SubElement(root, "TypeDefinitions")
    for name, attributes in used_types(interface.variables):
        SubElement(types, "Float64Type", {"name": name} | attributes)
    add_log_categories(root, heading)
    add_experiment(root, heading, interface.variables)
    listed = SubElement(root, "ModelVariables")
    reference = {v.name: str(v.reference) for v in interface.variables}
    for v in interface.variables:
        SubElement(listed, TYPES_3[v.type], _attributes(v, reference))
    structure = SubElement(root, "ModelStructure")
    known = dependencies(mechanism, interface)
    parameters = tuple(v.name for v in interface.variables if v.causality == "parameter")

    def add(element: str, name: str, names: Iterable[str]) -> None:
        SubElement(structure, element, _unknown("valueReference", name, names, reference))

    def add_moving(element: str, name: str) -> None:
        """Add an unknown.  If it depends on other variables, it depends on all parameters, too."""
        computed = {*known[name]} - {name}
        add(element, name, (*parameters, *known[name]) if computed else known[name])

    for v in interface.variables:
        if v.causality == "output":
            add_moving("Output", v.name)
    for name in interface.derivatives:
        add_moving("ContinuousStateDerivative", name)
    for v in initial_unknowns(interface):
        add("InitialUnknown", v.name, initial_dependencies(v, interface.variables))
    for name in interface.indicators:
        add_moving("EventIndicator", name)
    return serialized(root)


def _attributes(v: Variable, reference: Mapping[str, str]) -> dict[str, str]:
    """Return the attributes of a variable of FMI 3.0."""
    attributes = {
        "name": v.name,
        "valueReference": str(v.reference),
        "description": v.description,
        "causality": v.causality,
    }
    if v.type == CLOCK:
        return attributes | {"intervalVariability": "triggered"}
    attributes["variability"] = v.variability
    if v.causality == "independent":
        return attributes | {"quantity": v.quantity.name, "unit": v.unit}
    if v.variability == "continuous" and v.causality in ("output", "local"):
        attributes["intermediateUpdate"] = "true"
    if v.initial:
        attributes["initial"] = v.initial
    return attributes | value_attributes(v, reference)


# --- sources -------------------------------------------------------------------------------------


def build_description(identifier: str, source: str) -> bytes:
    """Return the buildDescription.xml of FMI 3.0, from which importers compile the sources."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = SubElement(root, "BuildConfiguration", {"modelIdentifier": identifier})
    sources = SubElement(configuration, "SourceFileSet", {"language": "C99"})
    SubElement(sources, "SourceFile", {"name": source})
    override = {"name": OVERRIDE.format(3), "optional": "true"}
    text = "Function names without the prefix of the model, as in a shared library"
    SubElement(sources, "PreprocessorDefinition", override | {"description": text})
    return serialized(root)
