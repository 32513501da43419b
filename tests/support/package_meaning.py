"""The meaning of a package by the text of SSP 1.0, from its XML: backwards from each variable.

It shares no code with the package.  Types are not checked.
"""

import zipfile
from fractions import Fraction
from urllib.parse import unquote
from xml.etree import ElementTree as ET

ENTERING = ("input", "parameter")
BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
VAGUE = "unit of a connector that cannot be deduced"
PLAIN = ET.Element("Connection")


def exact(text):
    """Return a number of an attribute, exactly the float that it denotes."""
    return Fraction(repr(float(text)))


def real(value):
    """Return a value exactly if it is a float."""
    return exact(value) if isinstance(value, float) else value


class Undefined(Exception):
    """The standard does not define the meaning."""


def units(root, path):
    """Return dimension, factor and offset of each unit below a path."""
    found = {}
    for unit in root.iterfind(path):
        base = unit.find("{*}BaseUnit")
        exponents = tuple(int(base.get(x, 0)) for x in BASE)
        factor, offset = exact(base.get("factor", "1")), exact(base.get("offset", "0"))
        found[unit.get("name")] = exponents, factor, offset
    return found


class Fmu:
    """Causalities, types, units and items of the variables of an FMU 2.0."""

    def __init__(self, content):
        root = ET.fromstring(content)
        defined = units(root, "UnitDefinitions/Unit")
        types = {x.get("name"): x for x in root.iterfind("TypeDefinitions/SimpleType")}
        self.kinds, self.units, self.items, self.types = {}, {}, {}, {}
        for x in root.iterfind("ModelVariables/ScalarVariable"):
            name, own = x.get("name"), x[0]
            self.kinds[name], self.types[name] = x.get("causality"), own.tag
            self.units[name] = defined.get(own.get("unit"))
            if own.tag == "Enumeration":
                items = types[own.get("declaredType")].iterfind("Enumeration/Item")
                self.items[name] = {i.get("name"): int(i.get("value")) for i in items}


class Element:
    """A component or a system."""

    def __init__(self, xml, parent, archive):
        self.xml, self.parent, self.name = xml, parent, xml.get("name")
        self.path = "" if parent is None else f"{parent.path}/{self.name}".lstrip("/")
        self.connectors = {x.get("name"): x for x in xml.iterfind("{*}Connectors/{*}Connector")}
        self.wires = [
            (x, [(x.get(f"{at}Element", ""), x.get(f"{at}Connector")) for at in ("start", "end")])
            for x in xml.iterfind("{*}Connections/{*}Connection")
        ]
        inside = xml.findall("{*}Elements/*")
        self.inside = {x.get("name"): Element(x, self, archive) for x in inside}
        self.fmu = None
        if source := xml.get("source"):
            with zipfile.ZipFile(archive.open(unquote(source))) as fmu:
                self.fmu = Fmu(fmu.read("modelDescription.xml"))

    def kind(self, name):
        return self.fmu.kinds[name] if self.fmu else self.connectors[name].get("kind")

    def lineage(self):
        """Return the element and all systems around it, from inside."""
        return [self, *(self.parent.lineage() if self.parent else ())]

    def below(self):
        return [self, *(x for inner in self.inside.values() for x in inner.below())]


class Meaning:
    """Start values and connections of the FMUs of a package.

    ``values`` are by ``path.variable``.  ``links`` are a source, a function of its value and its
    type, by the variable of an FMU or the output of the package.
    """

    def __init__(self, path):
        with zipfile.ZipFile(path) as archive:
            self.archive = archive
            root = ET.fromstring(archive.read("SystemStructure.ssd"))
            self.units = units(root, "{*}Units/{*}Unit")
            self.top = Element(root.find("{*}System"), None, archive)
            self.values, self.links = {}, {}
            for element in self.top.below():
                for name in element.fmu.kinds if element.fmu else ():
                    if element.kind(name) in ENTERING:
                        self.read((element, name), f"{element.path}.{name}")
            for name in self.top.connectors:
                if self.top.kind(name) == "output":
                    self.read((self.top, name), name)

    def read(self, end, full):
        chain = [(PLAIN, end)]  # connections and what they lead to, backwards
        while before := self.before(chain[-1][1]):
            wire, place = before
            chain[-1] = wire, chain[-1][1]
            chain.append((PLAIN, place))
        places = [place for _, place in chain]
        source, name = places[-1]
        if len(chain) > 1 and source.fmu and source.kind(name) == "output":
            names = {value: x for x, value in source.fmu.items.get(name, {}).items()}
            own = source.fmu.units[name]

            def link(value):
                return self.carried(names.get(value, real(value)), own, chain[:-1])

            self.links[full] = f"{source.path}.{name}", link, source.fmu.types[name]
        for system in reversed(end[0].lineage()):
            if (given := self.bound(system, places)) is not None:
                position, entry, value, unit = given
                steps = [*chain[:position], (entry, places[position])]
                self.values[full] = self.carried(value, unit, steps)
                return

    def before(self, place):
        """Return the connection that leads to a place, and the place from which it comes."""
        element, name = place
        leaves = element.fmu is None and element.kind(name) == "output"
        if element.fmu and element.kind(name) == "output":
            return None
        scope, own = (element, ("", name)) if leaves else (element.parent, (element.name, name))
        for wire, ends in scope.wires if scope else ():
            if own in ends:
                first, other = ends[1 - ends.index(own)]
                return wire, (scope.inside[first] if first else scope, other)
        return None

    def unit(self, place):
        """Return the unit of a place: its own, else that of what is connected inside."""
        element, name = place
        if element.fmu:
            return element.fmu.units[name]
        typed = element.connectors[name].find("{*}Real")
        if typed is not None and typed.get("unit"):
            return self.units[typed.get("unit")]
        found = [
            ends[1 - ends.index(("", name))] for _, ends in element.wires if ("", name) in ends
        ]
        known = {self.unit((element.inside[x], y)) for x, y in found if x}
        return known.pop() if len(known) == 1 else VAGUE

    def carried(self, value, unit, steps):
        """Return a value after steps, which are in backward order."""
        vague = False
        for wire, place in reversed(steps):
            own = self.unit(place)
            suppressed = wire.get("suppressUnitConversion") in ("true", "1")
            change = next((x for x in wire if x.tag.endswith("Transformation")), None)
            linear = change is not None and "Linear" in change.tag
            depends = suppressed or linear or unit is None if own == VAGUE else suppressed and vague
            if depends and isinstance(value, Fraction):
                raise Undefined
            vague, own = own == VAGUE, None if own == VAGUE else own
            if own and unit and not suppressed:
                if own[0] != unit[0]:
                    raise Undefined
                value = (value * unit[1] + unit[2] - own[2]) / own[1]
            unit = own or unit
            value = value if change is None else changed(value, change)
        element, name = steps[0][1]
        items = element.fmu.items.get(name) if element.fmu else None
        return items[value] if items else value

    def bound(self, system, places):
        """Return position, entry, value and unit of the start value in a system for a chain."""
        for binding in reversed(system.xml.findall("{*}ParameterBindings/{*}ParameterBinding")):
            found = [
                (position, *given[1:])
                for given in self.given(binding)
                for position, (element, name) in enumerate(places)
                if system in element.lineage() and relative(system, element, name) == given[0]
            ]
            if len(found) > 1:
                raise Undefined
            if found:
                return found[0]
        return None

    def given(self, binding):
        """Yield target, entry, value and unit for each value of a binding."""
        content = self.content(binding, binding.find("{*}ParameterValues"))
        mapping = binding.find("{*}ParameterMapping")
        entries = None if mapping is None else self.content(mapping, mapping).findall("*")
        known = (self.units if binding.get("source") is None else {}) | units(
            content, "{*}Units/{*}Unit"
        )
        for parameter in content.iterfind("{*}Parameters/{*}Parameter"):
            name, typed = binding.get("prefix", "") + parameter.get("name"), parameter[0]
            read = {"Real": exact, "Integer": int, "Boolean": boolean}.get(
                typed.tag.partition("}")[2], str
            )
            value, unit = read(typed.get("value")), known.get(typed.get("unit"))
            for entry in [None] if entries is None else entries:
                if entry is None:
                    yield name, PLAIN, value, unit
                elif entry.get("source") == name:
                    yield entry.get("target"), entry, value, unit

    def content(self, element, inside):
        source = element.get("source")
        return inside[0] if source is None else ET.fromstring(self.archive.read(unquote(source)))


def changed(value, change):
    """Return a value after a transformation."""
    kind = change.tag.partition("}")[2]
    if kind == "LinearTransformation":
        return exact(change.get("factor", "1")) * value + exact(change.get("offset", "0"))
    read = {"I": int, "B": boolean, "E": str}[kind[0]]
    table = {read(x.get("source")): read(x.get("target")) for x in change}
    if value not in table:
        raise Undefined
    return table[value]


def boolean(text):
    return text in ("true", "1")


def relative(system, element, name):
    """Return the hierarchical name in a system of a variable of an element inside."""
    while element is not system:
        element, name = element.parent, f"{element.name}.{name}"
    return name
