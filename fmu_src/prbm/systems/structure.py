"""Reading of system structure packages (SSP 1.0), and their meaning as one level of FMUs.

Every element of the standard is either supported or refused by name.  Graphics, annotations and
metadata have no effect.
"""

import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote, urlsplit

import fmpy  # type: ignore[import-untyped]
from lxml import etree  # type: ignore[import-untyped]

from ..base.archives import DESCRIPTION_SIZE_MAX, check_unpacked_size
from .components import CouplingError, Value, described, start_value
from .nodes import (
    SLASH,
    Connector,
    Flat,
    Node,
    Wire,
    check_loops,
    check_names,
    deduce_units,
    items_of,
    kind_of,
    place,
)
from .signals import BOOLEAN, ENUMERATION, INTEGER, REAL, Linear, Signal, Table, Unit, exact

NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructure"
SSD, SSC, SSV, SSM = (
    f"{{{NAMESPACE}{x}}}" for x in ("Description", "Common", "ParameterValues", "ParameterMapping")
)
DESCRIPTION = "SystemStructure.ssd"
FMU = "application/x-fmu-sharedlibrary"
TRANSFORMATIONS = {
    "LinearTransformation": REAL, "BooleanMappingTransformation": BOOLEAN,
    "IntegerMappingTransformation": INTEGER, "EnumerationMappingTransformation": ENUMERATION,
}  # fmt: skip
"""Transformations by the types of their values."""
ENTERING, PARAMETRIC = ("input", "parameter"), ("parameter", "calculatedParameter")
"""Kinds of connectors that take a value, and that are constant."""


# -- files --


@cache
def _schema(name: str) -> Any:
    folder = Path(fmpy.__file__).parent / "ssp" / "schema"
    return etree.XMLSchema(etree.parse(str(folder / f"SystemStructure{name}.xsd")))


def _document(content: bytes, schema: str, where: str) -> Any:
    """Return the root of a file, which matches its schema, without comments."""
    safe = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True,
        remove_pis=True,
    )  # fmt: skip
    try:
        root = etree.fromstring(content, safe)
    except etree.XMLSyntaxError as error:
        raise CouplingError(f"{where}: not an XML file ({error})") from None
    if root.getroottree().docinfo.doctype:
        raise CouplingError(f"{where}: a document type declaration is not supported; remove it")
    return _valid(root, schema, where)


def _valid(element: Any, schema: str, where: str) -> Any:
    version = element.get("version", "1.0")
    if version != "1.0":
        raise CouplingError(f"{where}: version {version} is not supported; export SSP 1.0")
    checked = _schema(schema)
    if not checked.validate(etree.ElementTree(element)):
        first = checked.error_log[0]
        raise CouplingError(f"{where}: not valid by SSP 1.0, line {first.line}: {first.message}")
    return element


def local_path(source: str, where: str) -> str:
    """Return the path of a file in the package from its URI.

    Raises
    ------
    CouplingError
        If the URI is not valid, leads out of the package, or has a fragment or a query.

    Examples
    --------
    >>> local_path("resources/Motor%20%231.fmu", "Motor")
    'resources/Motor #1.fmu'
    """
    try:
        parts = urlsplit(source)
    except ValueError as error:
        raise CouplingError(f"{where}: source {source} is not a valid URI ({error})") from None
    path = PurePosixPath(unquote(parts.path))
    if parts.scheme or parts.netloc or parts.query or path.is_absolute() or ".." in path.parts:
        raise CouplingError(f"{where}: source {source} is not in the package; put the file into it")
    if parts.fragment or "#" in source:
        raise CouplingError(
            f"{where}: source {source}: fragments are not supported; write # in a name as %23"
        )
    return str(path)


class Package:
    """An opened package.

    Parameters
    ----------
    path : str or Path
        A file ``.ssp``.
    folder : str or Path
        An empty folder into which its FMUs are copied.

    Raises
    ------
    CouplingError
        If it cannot be read, or contains something that is not supported.
    """

    def __init__(self, path: str | Path, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.copies: dict[str, Path] = {}
        try:
            check_unpacked_size(path)
            self.archive = zipfile.ZipFile(path)
        except Exception as error:
            raise CouplingError(f"{path}: cannot be read as a package ({error})") from None
        with self.archive:
            try:
                self.flat = _Reader(self).flat()
            except CouplingError as error:
                raise CouplingError(f"{path}: {error}") from None

    def read(self, name: str, where: str, limit: int | None = DESCRIPTION_SIZE_MAX) -> bytes:
        """Return the content of a file.

        Raises
        ------
        CouplingError
            If it is missing, damaged or larger than the limit.
        """
        try:
            if limit is not None and self.archive.getinfo(name).file_size > limit:
                raise CouplingError(f"{where}: {name} is larger than {limit} bytes")
            return self.archive.read(name)
        except CouplingError:
            raise
        except KeyError:
            raise CouplingError(f"{where}: the package has no file {name!r}; add it") from None
        except Exception as error:
            raise CouplingError(f"{where}: {name} cannot be read ({error})") from None

    def copy(self, name: str, where: str) -> Path:
        """Return the path of an FMU, copied to the folder under a number."""
        if name not in self.copies:
            path = self.folder / f"{len(self.copies)}.fmu"
            path.write_bytes(self.read(name, where, None))
            self.copies[name] = path
        return self.copies[name]


# -- structure --


class _Reader:
    """Reads the description of a package into nodes, and flattens them."""

    def __init__(self, package: Package) -> None:
        self.package = package
        self.root = _document(package.read(DESCRIPTION, DESCRIPTION), "Description", DESCRIPTION)
        self.units = _units(self.root.find(f"{SSD}Units"))
        self.fmus: dict[str, str] = {}
        self.descriptions: dict[str, Any] = {}
        self.ignored: list[str] = []

    def flat(self) -> Flat:
        """Return the meaning of the package."""
        experiment = self.root.find(f"{SSD}DefaultExperiment")
        times = {} if experiment is None else experiment.attrib
        if float(times.get("startTime", 0)) != 0.0:
            raise CouplingError(
                f"DefaultExperiment: startTime = {times['startTime']} s is not supported; use 0"
            )
        top = self.system(self.root.find(f"{SSD}System"), None)
        check_loops(top)
        deduce_units(top)
        components = list(_components(top))
        wires: dict[str, tuple[str, Signal]] = {}
        outputs: dict[str, tuple[str, Signal]] = {}
        recorded = []
        for component in components:
            for name in component.connectors:
                variable = component.variables[name]
                full, kind = f"{component.path}.{name}", component.connectors[name].kind
                if kind == "output" and _numeric(variable):
                    recorded.append(full)
                if kind in ENTERING:
                    continue
                for node, end, signal in _from(component, name, variable):
                    if kind != "output":
                        raise CouplingError(
                            f"{full}: connections of calculatedParameter are not supported; give "
                            "the parameter a start value"
                        )
                    (outputs if node.fmu is None else wires)[place(node, "", end)] = full, signal
        _check_driven(top, outputs)
        stop = times.get("stopTime")
        check_names(outputs, recorded)
        return Flat(
            {x.path: x.fmu or "" for x in components}, wires, outputs, self.values(top),
            tuple(recorded), tuple(self.ignored), None if stop is None else float(stop),
        )  # fmt: skip

    def system(self, element: Any, parent: Node | None) -> Node:
        """Return a system with all its elements."""
        node = self.node(element, parent)
        for child in element.iterfind(f"{SSD}Elements/*"):
            kind = etree.QName(child).localname
            if kind == "SignalDictionaryReference":
                raise CouplingError(
                    f"{child.get('name')}: SignalDictionaryReference is not supported; connect the "
                    "components directly"
                )
            name = child.get("name")
            if name in node.elements:
                raise CouplingError(f"two elements have the name {name}; rename one")
            of_kind = self.system if kind == "System" else self.component
            node.elements[name] = of_kind(child, node)
        sinks = set()
        for child in element.iterfind(f"{SSD}Connections/{SSD}Connection"):
            wire = _wire(node, child)
            if wire.sink in sinks:
                raise CouplingError(f"{place(node, *wire.sink)} has two sources; remove one")
            sinks.add(wire.sink)
            node.wires.append(wire)
        return node

    def node(self, element: Any, parent: Node | None) -> Node:
        """Return a system or a component with its connectors and bindings."""
        name = element.get("name")
        if parent is not None and ("." in name or SLASH in name):
            raise CouplingError(f"element {name}: a name with . or / is not supported; rename it")
        path = "" if parent is None else f"{parent.path}{SLASH}{name}".lstrip(SLASH)
        node = Node(name, path, parent)
        for child in element.iterfind(f"{SSD}Connectors/{SSD}Connector"):
            own = child.get("name")
            where = f"connector {place(node, '', own)}"
            if own in node.connectors:
                raise CouplingError(f"{where}: two have this name; rename one")
            node.connectors[own] = self.connector(child, where)
        node.bindings = element.findall(f"{SSD}ParameterBindings/{SSD}ParameterBinding")
        return node

    def connector(self, element: Any, where: str) -> Connector:
        """Return a connector."""
        kind = element.get("kind")
        if kind == "inout":
            raise CouplingError(f"{where}: kind inout is not supported; use input or output")
        given = next((x for x in element if x.tag.startswith(SSC)), None)
        given_type = None if given is None else etree.QName(given).localname
        unit = None if given is None else given.get("unit")
        if unit is not None and unit not in self.units:
            raise CouplingError(f"{where}: the unit {unit} is not defined; define it in Units")
        return Connector(kind, given_type, None if unit is None else self.units[unit])

    def component(self, element: Any, parent: Node) -> Node:
        """Return a component, whose connectors match its FMU."""
        node = self.node(element, parent)
        where = f"component {node.path}"
        if element.get("type", FMU) != FMU:
            raise CouplingError(f"{where}: type {element.get('type')} is not supported; use FMUs")
        if element.get("implementation") == "ModelExchange":
            raise CouplingError(
                f"{where}: implementation ModelExchange is not supported; use CoSimulation"
            )
        node.fmu = local_path(element.get("source"), where)
        if node.fmu not in self.descriptions:
            copy = self.package.copy(node.fmu, where)
            self.descriptions[node.fmu] = described(node.path, copy)
        description = self.descriptions[node.fmu]
        if description.coSimulation is None:
            raise CouplingError(f"{where}: {node.fmu} has no co-simulation; export it with it")
        node.variables = {x.name: x for x in description.modelVariables}
        node.units = {
            x.name: Unit.of(x.name, {k: getattr(x.baseUnit, k) for k in x.baseUnit.__slots__
                                     if not k.startswith("_")})
            for x in description.unitDefinitions if x.baseUnit is not None
        }  # fmt: skip
        for name, connector in node.connectors.items():
            _check_connector(node, name, connector)
        return node

    # -- start values --

    def values(self, node: Node) -> dict[str, Value]:
        """Return the start values of a node: outer bindings replace inner ones, later earlier."""
        result: dict[str, Value] = {}
        for element in node.elements.values():
            result |= self.values(element)
        names: dict[str, str] = {}
        for binding in node.bindings:
            given: dict[str, Value] = {}
            for name, parameter, options in self.parameters(node, binding):
                where = f"start value {place(node, '', name)}"
                owner = _owner(node, name)
                if owner is None:
                    self.ignored.append(place(node, "", name))
                    continue
                ends = list(_ends(*owner, parameter.signal, options, where))
                for component, variable, signal in ends:
                    full = f"{component.path}.{variable.name}"
                    if full in given or names.setdefault(full, name) != name:
                        raise CouplingError(
                            f"{where}: {full} has another start value in {node.path or node.name}, "
                            f"by the name {names[full]}; remove one"
                        )
                    given[full] = _value(full, parameter, signal, variable)
            result |= given
        return result

    def parameters(
        self, node: Node, binding: Any
    ) -> Iterator[tuple[str, "Parameter", tuple[Linear | Table | None, bool]]]:
        """Yield the names, values and transformations of a binding."""
        where = f"ParameterBinding of {node.path or node.name}"
        inside = binding.find(f"{SSD}ParameterValues")
        content = self.content(binding, inside, SSV, "ParameterSet", where)
        if content is None:
            return
        units = _units(content.find(f"{SSV}Units"))
        if binding.get("source") is None:
            units = self.units | units
        mapping = binding.find(f"{SSD}ParameterMapping")
        entries = None
        if mapping is not None:
            found = self.content(mapping, mapping, SSM, "ParameterMapping", where)
            entries = [] if found is None else found.findall(f"{SSM}MappingEntry")
        seen = set()
        for element in content.iterfind(f"{SSV}Parameters/{SSV}Parameter"):
            name = binding.get("prefix", "") + element.get("name")
            if name in seen:
                raise CouplingError(f"{where}: two parameters have the name {name}; remove one")
            seen.add(name)
            parameter = _parameter(element, units, f"{where}: {name}")
            if entries is None:
                yield name, parameter, (None, False)
                continue
            mapped = [x for x in entries if x.get("source") == name]
            if not mapped and _owner(node, name) is not None:
                raise CouplingError(
                    f"{where}: {name} is not in the ParameterMapping, but there is a variable of "
                    "that name; add a MappingEntry"
                )
            if not mapped:
                self.ignored.append(place(node, "", name))
            for entry in mapped:
                yield entry.get("target"), parameter, _options(entry, f"{where}: {name}")

    def content(self, element: Any, inside: Any, space: str, tag: str, where: str) -> Any:
        """Return the root of a parameter set or mapping, inside the file or of its own."""
        expected = f"application/x-ssp-{'parameter-set' if space == SSV else 'parameter-mapping'}"
        if element.get("type", expected) != expected:
            raise CouplingError(
                f"{where}: type {element.get('type')} is not supported; use {expected}"
            )
        source = element.get("source")
        children = [] if inside is None else [x for x in inside if not x.tag.startswith(SSD)]
        schema = space.rpartition("}")[0].removeprefix("{" + NAMESPACE)
        if source is None:
            if not children:
                return None
            if len(children) > 1 or children[0].tag != f"{space}{tag}":
                raise CouplingError(f"{where}: the content must be one {tag} of SSP 1.0")
            return _valid(children[0], schema, where)
        if children:
            raise CouplingError(f"{where}: source and content are both given; remove one")
        if element.get("sourceBase", "SSD") != "SSD":
            raise CouplingError(
                f"{where}: sourceBase component is not supported; put {source} into the package"
            )
        name = local_path(source, where)
        return _document(self.package.read(name, where), schema, name)


def _units(element: Any) -> dict[str, Unit]:
    """Return the units of a file by name."""
    result: dict[str, Unit] = {}
    for unit in () if element is None else element.iterfind(f"{SSC}Unit"):
        name = unit.get("name")
        if name in result:
            raise CouplingError(f"the unit {name} is defined twice; remove one definition")
        result[name] = Unit.of(name, unit.find(f"{SSC}BaseUnit").attrib)
    return result


def _components(node: Node) -> Iterator[Node]:
    if node.fmu is not None:
        yield node
    for element in node.elements.values():
        yield from _components(element)


def _check_driven(top: Node, outputs: Mapping[str, object]) -> None:
    """Reject outputs of the system whose connections lead to no output of an FMU."""
    for wire in top.wires:
        name = place(top, *wire.sink)
        if not wire.sink[0] and name not in outputs:
            raise CouplingError(
                f"connection to {name}: no output of an FMU leads to this output of the system, "
                "which is not supported; remove the connection"
            )


def _numeric(variable: Any) -> bool:
    return kind_of(variable) in (REAL, INTEGER, BOOLEAN, ENUMERATION) and not variable.dimensions


def _check_numeric(full: str, variable: Any) -> None:
    if not _numeric(variable):
        kind = "arrays" if variable.dimensions else f"type {variable.type}"
        raise CouplingError(f"{full}: connections of {kind} are not supported; remove them")


def _check_connector(node: Node, name: str, connector: Connector) -> None:
    """Check that a connector of a component matches the variable of its FMU."""
    full = f"{node.path}.{name}"
    if name not in node.variables:
        raise CouplingError(f"connector {full}: {node.fmu} has no variable of that name")
    variable = node.variables[name]
    if variable.causality != connector.kind:
        raise CouplingError(
            f"connector {full}: kind {connector.kind}, but the variable is {variable.causality}"
        )
    if connector.type not in (None, kind_of(variable)):
        raise CouplingError(
            f"connector {full}: type {connector.type}, but the variable is {variable.type}"
        )
    own, given = node.unit(variable), connector.unit
    if own is None or given is None or (own.name == given.name and own.base is None):
        return
    if own.base is None or (own.base, own.factor, own.offset) != (
        given.base, given.factor, given.offset
    ):  # fmt: skip
        raise CouplingError(
            f"connector {full}: unit {given.name}, but the variable has {own.name}; use the "
            "variable's unit"
        )


def _wire(node: Node, element: Any) -> Wire:
    """Return a connection; its direction follows from the kinds of its connectors."""
    ends = [
        (element.get(f"{x}Element", ""), element.get(f"{x}Connector")) for x in ("start", "end")
    ]
    kinds = []
    for end in ends:
        owner = node if not end[0] else node.elements.get(end[0])
        if owner is None or end[1] not in owner.connectors:
            raise CouplingError(f"connection: there is no connector {place(node, *end)}")
        kinds.append((owner.connectors[end[1]].kind, bool(end[0])))
    # Outputs of elements and inputs of the system itself are sources inside it.
    sources = [(kind in ENTERING) != inner for kind, inner in kinds]
    names = " and ".join(place(node, *end) for end in ends)
    if sources[0] == sources[1] or len({kind in PARAMETRIC for kind, _ in kinds}) > 1:
        raise CouplingError(
            f"connection of {names}: kinds {kinds[0][0]} and {kinds[1][0]} cannot be connected"
        )
    source, sink = ends if sources[0] else ends[::-1]
    wire = Wire(source, sink, *_options(element, f"connection of {names}"))
    (kind, unit), (given, other) = (_declared(node, *end) for end in (source, sink))
    if kind is not None:
        options = wire.transformation, wire.suppress
        Signal(kind, unit).at(given, other, f"connection to {place(node, *sink)}", *options)
    return wire


def _declared(node: Node, element: str, name: str) -> tuple[str | None, Unit | None]:
    """Return the type and the unit of a connector of a system or of one of its elements."""
    owner = node.elements[element] if element else node
    if owner.fmu is not None:
        variable = owner.variables[name]
        return kind_of(variable), owner.unit(variable)
    return owner.connectors[name].type, owner.connectors[name].unit


def _options(element: Any, where: str) -> tuple[Linear | Table | None, bool]:
    """Return transformation and suppression of the unit of a connection or a mapping entry."""
    suppress = _boolean(element.get("suppressUnitConversion", "false"))
    given = next((x for x in element if x.tag.startswith(SSC)
                  and etree.QName(x).localname in TRANSFORMATIONS), None)  # fmt: skip
    if given is None:
        return None, suppress
    tag = etree.QName(given).localname
    if tag == "LinearTransformation":
        numbers = (given.get("factor", 1), given.get("offset", 0))
        return Linear(*(exact(x, f"{where}, {tag}") for x in numbers)), suppress
    read = READERS[TRANSFORMATIONS[tag]]
    entries = tuple((read(x.get("source")), read(x.get("target"))) for x in given)
    if len({x for x, _ in entries}) < len(entries):
        raise CouplingError(f"{where}: {tag} has two entries for one source; remove one")
    return Table(TRANSFORMATIONS[tag], entries, f"{where}, {tag}"), suppress


def _boolean(text: str) -> bool:
    return text.strip() in ("true", "1")


READERS: dict[str, Any] = {INTEGER: int, BOOLEAN: _boolean, ENUMERATION: str}


@dataclass(frozen=True)
class Parameter:
    """A start value: its text, its type and unit, and its value."""

    text: str
    signal: Signal
    value: Any


def _parameter(element: Any, units: Mapping[str, Unit], where: str) -> Parameter:
    """Return the value of a parameter."""
    given = element[0]
    kind, text = etree.QName(given).localname, given.get("value")
    if kind == "Binary":
        raise CouplingError(f"{where}: a value of type Binary is not supported; remove it")
    name = given.get("unit")
    if name is not None and name not in units:
        raise CouplingError(f"{where} = {text} {name}: the unit is not defined; define it in Units")
    unit = None if name is None else units[name]
    value: Any = text
    if kind == REAL:
        value = exact(text, where)
    elif kind != "String":
        value = READERS[kind](text)
    return Parameter(f"{text} {name}" if name else text, Signal(kind, unit), value)


def _owner(node: Node, name: str) -> tuple[Node, str] | None:
    """Return the component or system of a hierarchical name, and the name there."""
    if node.fmu is not None:
        return (node, name) if name in node.variables else None
    first, dot, rest = name.partition(".")
    inner = _owner(node.elements[first], rest) if dot and first in node.elements else None
    if name not in node.connectors:
        return inner
    if inner is not None:
        raise CouplingError(
            f"{place(node, '', name)} is a connector and a variable of {first}; rename one"
        )
    return node, name


End = tuple[Node, Any, Signal]


def _ends(
    owner: Node,
    name: str,
    signal: Signal,
    options: tuple[Linear | Table | None, bool],
    where: str,
) -> Iterator[End]:
    """Yield component, variable and signal for each variable that a start value reaches."""
    if owner.fmu is not None:
        variable = owner.variables[name]
        end = _last(signal, owner, variable, where, options)
        yield owner, variable, end
        return
    connector = owner.connectors[name]
    if connector.kind not in ENTERING:
        raise CouplingError(f"{where}: start values of outputs are not supported; remove it")
    signal = signal.at(connector.type, connector.unit, where, *options, connector.vague)
    for node, end_name, end in _forward(owner, ("", name), signal):
        if node.fmu is None or not _inside(node, owner):
            raise CouplingError(
                f"{where}: it reaches the output {place(node, '', end_name)} through a connection "
                "of two connectors of a system, which is not supported for start values"
            )
        yield node, node.variables[end_name], end


def _inside(node: Node | None, owner: Node) -> bool:
    return node is not None and (node is owner or _inside(node.parent, owner))


def _from(component: Node, name: str, variable: Any) -> Iterator[tuple[Node, str, Signal]]:
    """Yield where an output of a component leads: node, name and signal."""
    signal = Signal(kind_of(variable), component.unit(variable))
    full = f"{component.path}.{name}"
    if signal.kind == ENUMERATION:
        signal = signal.after(Table(ENUMERATION, tuple(items_of(variable).items()), full))
    assert component.parent is not None
    for node, end, found in _forward(component.parent, (component.name, name), signal):
        if component.connectors[name].kind == "output":
            _check_numeric(full, variable)
        if node.fmu is not None:
            _check_numeric(place(node, "", end), node.variables[end])
            found = _settled(found, items_of(variable), place(node, "", end))
        elif signal.kind == ENUMERATION:
            raise CouplingError(
                f"{end}: an Enumeration as output of the system is not supported; remove the "
                f"connection of {full}"
            )
        yield node, end, found


def _settled(signal: Signal, items: Mapping[int, str], where: str) -> Signal:
    """Return a signal of an enumeration as one table of its values; other signals unchanged."""
    if signal.kind != ENUMERATION:
        return signal
    return Signal(ENUMERATION, None, (Table(
        ENUMERATION, tuple((value, signal(value)) for value in items), where),))  # fmt: skip


def _forward(
    system: Node, source: tuple[str, str], signal: Signal
) -> Iterator[tuple[Node, str, Signal]]:
    """Yield the variables of FMUs and outputs of the outermost system that a signal reaches."""
    for wire in system.wires:
        if wire.source != source:
            continue
        element, name = wire.sink
        where = f"connection to {place(system, *wire.sink)}"
        node = system.elements[element] if element else system
        options = wire.transformation, wire.suppress
        if node.fmu is not None:
            yield node, name, _last(signal, node, node.variables[name], where, options)
            continue
        connector = node.connectors[name]
        passed = signal.at(connector.type, connector.unit, where, *options, connector.vague)
        if element:
            yield from _forward(node, ("", name), passed)
        elif system.parent is None:
            yield node, name, passed
        else:
            yield from _forward(system.parent, (system.name, name), passed)


def _last(
    signal: Signal,
    node: Node,
    variable: Any,
    where: str,
    options: tuple[Linear | Table | None, bool],
) -> Signal:
    """Return the signal at a variable of an FMU."""
    kind, unit = kind_of(variable), node.unit(variable)
    signal = signal.at(kind, unit, where, *options)
    if kind != ENUMERATION:
        return signal
    entries = tuple((name, value) for value, name in items_of(variable).items())
    return signal.after(Table(ENUMERATION, entries, where))


def _value(full: str, parameter: Parameter, signal: Signal, variable: Any) -> Value:
    """Return a start value in the unit of its variable."""
    if variable.dimensions:
        raise CouplingError(f"{full} = {parameter.text}: start values of arrays are not supported")
    value = signal(parameter.value)
    if isinstance(value, Fraction):
        try:
            value = float(value)
        except OverflowError:
            raise CouplingError(f"{full} = {parameter.text}: too large in its unit") from None
    result: Value = start_value(full, value, variable)
    return result
