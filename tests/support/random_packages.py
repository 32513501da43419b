"""Random packages of SSP 1.0 as the schema allows them, of FMUs without a binary or given ones."""

import io
import zipfile
from dataclasses import dataclass, replace
from functools import cache
from random import Random
from urllib.parse import quote
from xml.sax.saxutils import quoteattr

SPACES = " ".join(
    f'xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for short, name in (("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"),
                        ("ssm", "ParameterMapping"))
)  # fmt: skip
UNITS = {
    "m": ("length", 'm="1"'), "mm": ("length", 'm="1" factor="0.001"'),
    "cm": ("length", 'm="1" factor="1e-2"'), "K": ("temperature", 'K="1"'),
    "degC": ("temperature", 'K="1" offset="273.15"'),
    "degF": ("temperature", 'K="1" factor="0.5555555555555556" offset="255.3722222222222"'),
    "rad": ("angle", 'rad="1"'), "deg": ("angle", 'rad="1" factor="0.017453292519943295"'),
    "local": ("length", 'm="1" factor="0.25"'),
}  # fmt: skip
OWN = 'm="1" factor="0.5"'  # the unit local of a parameter set
DIMENSIONS = ("length", "temperature", "angle")
ITEMS = {"Mode": {"off": 1, "on": 2, "auto": 5}, "Gear": {"auto": 1, "off": 3, "on": 7}}
FAULTS = ("dictionary", "inout", "undefined unit", "other dimension", "two sources")


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU, or a connector."""

    name: str
    kind: str
    type: str
    unit: str | None = None
    dimension: str | None = None


def _variables(length, temperature, mode):
    real = [
        ("u", "input", length), ("w", "input", temperature), ("v", "input", "deg"),
        ("x", "input", None), ("y", "output", length), ("t", "output", temperature),
        ("r", "output", "rad"), ("z", "output", None), ("p", "parameter", length),
        ("o", "parameter", temperature), ("q", "parameter", None), ("a.b", "parameter", "mm"),
    ]  # fmt: skip
    others = [
        ("n", "input", "Integer"), ("k", "output", "Integer"), ("i", "parameter", "Integer"),
        ("b", "input", "Boolean"), ("c", "output", "Boolean"), ("f", "parameter", "Boolean"),
        ("e", "input", mode), ("g", "output", mode), ("h", "parameter", mode),
        ("s", "parameter", "String"),
    ]  # fmt: skip
    return (
        *(Variable(n, k, "Real", u, UNITS[u][0] if u else None) for n, k, u in real),
        *(Variable(n, k, t) for n, k, t in others),
    )


VARIABLES = {
    "one": _variables("m", "K", "Mode"), "other kind #1": _variables("mm", "degC", "Gear"),
}  # fmt: skip


def _fmu(variables):
    """Return an FMU 2.0 without a binary."""
    lines = []
    for k, x in enumerate(variables):
        start = "" if x.kind == "output" else {
            "Real": ' start="0"', "Integer": ' start="0"', "Boolean": ' start="false"',
            "String": ' start=""'}.get(x.type, ' start="1"')  # fmt: skip
        kind = "Enumeration" if x.type in ITEMS else x.type
        unit = f' unit="{x.unit}"' if x.unit else ""
        unit += f' declaredType="{x.type}"' if x.type in ITEMS else ""
        variability = {"parameter": "fixed"}.get(
            x.kind, "continuous" if kind == "Real" else "discrete"
        )
        lines.append(
            f'<ScalarVariable name="{x.name}" valueReference="{k}" causality="{x.kind}" '
            f'variability="{variability}"><{kind}{start}{unit}/></ScalarVariable>'
        )
    units = "".join(
        f'<Unit name="{name}"><BaseUnit {base}/></Unit>' for name, (_, base) in UNITS.items()
    )
    types = "".join(
        f'<SimpleType name="{name}"><Enumeration>'
        + "".join(f'<Item name="{x}" value="{value}"/>' for x, value in items.items())
        + "</Enumeration></SimpleType>"
        for name, items in ITEMS.items()
    )
    outputs = "".join(
        f'<Unknown index="{k}"/>' for k, x in enumerate(variables, 1) if x.kind == "output"
    )
    text = (
        '<fmiModelDescription fmiVersion="2.0" modelName="x" guid="x">'
        '<CoSimulation modelIdentifier="x" canHandleVariableCommunicationStepSize="true"/>'
        f"<UnitDefinitions>{units}</UnitDefinitions><TypeDefinitions>{types}</TypeDefinitions>"
        f"<ModelVariables>{''.join(lines)}</ModelVariables>"
        f"<ModelStructure><Outputs>{outputs}</Outputs><InitialUnknowns>{outputs}"
        "</InitialUnknowns></ModelStructure></fmiModelDescription>"
    )
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("modelDescription.xml", text)
    return content.getvalue()


@cache
def _fmus():
    return {name: (_fmu(variables), variables) for name, variables in VARIABLES.items()}


def fmu_without_binary(name):
    """Return the content of an FMU 2.0 with the variables of a name in :data:`VARIABLES`."""
    return _fmus()[name][0]


def random_package(path, seed, fmus=None):
    """Write a package; return the fault in it, or None.

    ``fmus`` are contents and variables by name.
    """
    writer = _Writer(Random(seed), fmus or _fmus())
    path.write_bytes(writer.written())
    return writer.fault if writer.done else None


class _Writer:
    def __init__(self, random, fmus):
        self.random, self.fmus, self.files, self.number = random, fmus, {}, 0
        self.fault = random.choice(FAULTS) if random.random() < 0.1 else None
        self.done = False

    def written(self):
        system, _ = self.system("top", 0)
        units = self.units({name: base for name, (_, base) in UNITS.items()}, "ssd")
        kinds = "".join(
            f'<ssc:Enumeration name="{name}">'
            + "".join(f'<ssc:Item name="{x}" value="{v}"/>' for x, v in items.items())
            + "</ssc:Enumeration>"
            for name, items in ITEMS.items()
        )
        self.files["SystemStructure.ssd"] = (
            f'<ssd:SystemStructureDescription {SPACES} version="1.0" name="x">{system}'
            f"<ssd:Enumerations>{kinds}</ssd:Enumerations>{units}"
            '<ssd:DefaultExperiment stopTime="0.5"/></ssd:SystemStructureDescription>'
        )
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w") as archive:
            for name, text in self.files.items():
                archive.writestr(name, text)
            for name, (fmu, _) in self.fmus.items():
                archive.writestr(f"resources/{name}.fmu", fmu)
        return content.getvalue()

    def chance(self, probability):
        return self.random.random() < probability

    def faulty(self, fault):
        """Return whether to make the fault here, once."""
        if self.fault != fault or self.done:
            return False
        self.done = True
        return True

    def units(self, bases, space):
        inside = "".join(f'<ssc:Unit name="{name}"><ssc:BaseUnit {base}/></ssc:Unit>'
                         for name, base in bases.items())  # fmt: skip
        return f"<{space}:Units>{inside}</{space}:Units>"

    def unit(self, dimension):
        """Return a random unit of a dimension, or None."""
        found = [name for name, (own, _) in UNITS.items() if own == dimension]
        return self.random.choice(found) if found and self.chance(0.7) else None

    # -- elements --

    def system(self, name, depth):
        """Return the text, and the own connectors and hierarchical names."""
        elements, below, texts = {}, [], []
        for own in self.random.sample(["a", "b", "c 1", "d&e", "ü"], self.random.randint(1, 3)):
            make = self.system if depth < 2 and self.chance(0.35) else self.component
            text, (connectors, names) = make(own, depth + 1)
            texts.append(text)
            elements[own] = connectors
            below += [replace(x, name=f"{own}.{x.name}") for x in names]
        if self.faulty("dictionary"):
            texts.append('<ssd:SignalDictionaryReference name="bus" dictionary="d"/>')
        connectors = [self.connector(k) for k in range(self.random.randint(0, 5))]
        names = [*connectors, *below]
        text = (
            f"<ssd:System name={quoteattr(name)}>{self.connectors(connectors)}"
            f"{self.bindings(names)}<ssd:Elements>{''.join(texts)}</ssd:Elements>"
            f"{self.connections(connectors, elements)}</ssd:System>"
        )
        return text, (connectors, names)

    def component(self, name, _):
        kind = self.random.choice(list(self.fmus))
        variables = self.fmus[kind][1]
        connectors = [x for x in variables if self.chance(0.7)]
        shown = [x if self.chance(0.5) else replace(x, unit=None) for x in connectors]
        text = (
            f'<ssd:Component name={quoteattr(name)} source="resources/{quote(kind)}.fmu">'
            f"{self.connectors(shown)}{self.bindings(variables)}</ssd:Component>"
        )
        return text, (connectors, variables)

    def connector(self, number):
        kind = self.random.choice(("input", "output", "parameter"))
        dimension = self.random.choice((*DIMENSIONS, None))
        type_ = self.random.choice(("Real", "Real", "Real", "Integer", "Boolean", "Mode"))
        if type_ != "Real":
            return Variable(f"C{number}", kind, type_)
        return Variable(f"C{number}", kind, type_, self.unit(dimension), dimension)

    def connectors(self, connectors):
        lines = []
        for x in connectors:
            type_ = f'<ssc:Enumeration name="{x.type}"/>' if x.type in ITEMS else f"<ssc:{x.type}/>"
            if x.unit:
                type_ = f'<ssc:Real unit="{x.unit}"/>'
            elif self.chance(0.3):
                type_ = ""
            if self.chance(0.1):
                type_ += '<ssd:ConnectorGeometry x="0" y="1"/>'
            kind = "inout" if self.faulty("inout") else x.kind
            lines.append(f'<ssd:Connector name="{x.name}" kind="{kind}">{type_}</ssd:Connector>')
        return f"<ssd:Connectors>{''.join(lines)}</ssd:Connectors>" if lines else ""

    # -- connections --

    def connections(self, own, elements):
        """Return connections whose types and dimensions match."""
        inner = [(name, x) for name, some in elements.items() for x in some]
        sources = [("", x) for x in own if x.kind != "output"]
        sources += [(name, x) for name, x in inner if x.kind == "output"]
        sinks = [("", x) for x in own if x.kind == "output"]
        sinks += [(name, x) for name, x in inner if x.kind != "output"]
        lines = []
        for sink in sinks:
            found = [x for x in sources if self.match(x[1], sink[1])]
            wrong = [x for x in sources if differ(x[1], sink[1])]
            if wrong and self.faulty("other dimension"):
                lines.append(self.connection(wrong[0], sink))
            elif found and self.chance(0.6):
                lines.append(self.connection(self.random.choice(found), sink))
                if self.faulty("two sources"):
                    lines.append(lines[-1])
        return f"<ssd:Connections>{''.join(lines)}</ssd:Connections>" if lines else ""

    def match(self, source, sink):
        parametric = (source.kind == "parameter", sink.kind == "parameter")
        if parametric[0] != parametric[1]:
            return False
        if source.type != sink.type:
            order = ("Boolean", "Integer", "Real")
            known = {source.type, sink.type} <= set(order)
            return (
                known and order.index(source.type) < order.index(sink.type) and self.chance(0.1)
            ) or {source.type, sink.type} == set(ITEMS)
        return None in (source.dimension, sink.dimension) or source.dimension == sink.dimension

    def connection(self, *ends):
        text = ""
        for name, (element, x) in zip(("start", "end"), self.random.sample(ends, 2), strict=True):
            text += f"{name}Element={quoteattr(element)} " if element else ""
            text += f"{name}Connector={quoteattr(x.name)} "
        dimensions = {x.dimension for _, x in ends}
        wrong = len(dimensions - {None}) > 1
        transformation, suppress = self.options(ends[0][1], 0.0 if wrong else 0.2)
        return f"<ssd:Connection {text}{suppress}>{transformation}</ssd:Connection>"

    def options(self, x, suppressed):
        suppress = 'suppressUnitConversion="true"' if self.chance(suppressed) else ""
        if self.chance(0.6) or x.type == "String":
            return "", suppress
        if x.type == "Real":
            attributes = [f'factor="{self.random.choice((2, -0.5, "1e-3"))}"', 'offset="1.5"']
            some = self.random.sample(attributes, self.random.randint(1, 2))
            return f"<ssc:LinearTransformation {' '.join(some)}/>", suppress
        kind = "Enumeration" if x.type in ITEMS else x.type
        values = {"Integer": ["1", "2", "3"], "Boolean": ["true", "false"]}.get(
            x.type, ["off", "on", "auto"]
        )
        entries = "".join(
            f'<ssc:MapEntry source="{a}" target="{self.random.choice(values)}"/>' for a in values
        )
        tag = f"ssc:{kind}MappingTransformation"
        return f"<{tag}>{entries}</{tag}>", suppress

    # -- start values --

    def bindings(self, names):
        """Return bindings of variables with these hierarchical names."""
        free = [x for x in names if x.kind != "output"]
        lines = [self.binding(free) for _ in range(2) if free and self.chance(0.35)]
        return f"<ssd:ParameterBindings>{''.join(lines)}</ssd:ParameterBindings>" if lines else ""

    def binding(self, free):
        chosen = self.random.sample(free, min(len(free), self.random.randint(1, 4)))
        attributes, prefix = "", ""
        if self.chance(0.3):
            first = chosen[0].name.partition(".")[0] + "."
            same = [x for x in chosen if x.name.startswith(first)]
            if same:
                chosen, prefix = same, first
                attributes = f"prefix={quoteattr(prefix)} "
        mapping, names = "", [x.name.removeprefix(prefix) for x in chosen]
        if self.chance(0.3):
            entries = []
            for k, x in enumerate(chosen):
                transformation, suppress = self.options(x, 0.1)
                names[k] = f"n {k}"
                entries.append(
                    f"<ssm:MappingEntry source={quoteattr(prefix + names[k])} "
                    f"target={quoteattr(x.name)} {suppress}>{transformation}</ssm:MappingEntry>"
                )
            text = (
                f'<ssm:ParameterMapping {SPACES} version="1.0">{"".join(entries)}'
                "</ssm:ParameterMapping>"
            )
            mapping = self.placed(text, "ssm", "<ssd:ParameterMapping{}>{}</ssd:ParameterMapping>")
        lines = [self.parameter(name, x) for name, x in zip(names, chosen, strict=True)]
        if self.chance(0.1):
            lines.append('<ssv:Parameter name="nothing"><ssv:Real value="1"/></ssv:Parameter>')
        bases = {name: base for name, (_, base) in UNITS.items()} | {"local": OWN}
        external = self.chance(0.3)
        units = self.units(bases, "ssv") if external or self.chance(0.3) else ""
        text = (
            f'<ssv:ParameterSet {SPACES} version="1.0" name="x"><ssv:Parameters>{"".join(lines)}'
            f"</ssv:Parameters>{units}</ssv:ParameterSet>"
        )
        if external:
            source = self.file(text, "ssv")
            attributes += f'source="{source}"'
            return f"<ssd:ParameterBinding {attributes}>{mapping}</ssd:ParameterBinding>"
        return (
            f"<ssd:ParameterBinding {attributes}><ssd:ParameterValues>{text}"
            f"</ssd:ParameterValues>{mapping}</ssd:ParameterBinding>"
        )

    def file(self, text, ending):
        self.number += 1
        name = f"set {self.number} 50%.{ending}"
        self.files[name] = text
        return quote(name)

    def placed(self, text, ending, form):
        """Return an element with its content inside or in a file."""
        if self.chance(0.3):
            return form.format(f' source="{self.file(text, ending)}"', "")
        return form.format("", text)

    def parameter(self, name, x):
        values = {
            "Integer": ("1", "2", "3"), "Boolean": ("true", "false", "1", "0"),
            "String": ("", "a b", "50%"), "Real": ("2.5", "-1e-3", "40"),
        }.get(x.type, ("off", "on", "auto"))  # fmt: skip
        kind, value = "Enumeration" if x.type in ITEMS else x.type, self.random.choice(values)
        unit = self.unit(x.dimension)
        if x.type == "Real" and self.faulty("undefined unit"):
            unit = "furlong"
        given = f' unit="{unit}"' if unit else ""
        return (
            f'<ssv:Parameter name={quoteattr(name)}><ssv:{kind} value="{value}"{given}/>'
            "</ssv:Parameter>"
        )


def differ(source, sink):
    """Return whether two connectors of one causality have units of different dimensions."""
    units = source.unit and sink.unit and source.dimension != sink.dimension
    return units and (source.kind == "parameter") == (sink.kind == "parameter")
