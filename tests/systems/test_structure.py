"""Packages as other tools write them: each element of SSP 1.0 has its meaning or is refused."""

import zipfile
from pathlib import Path

import pytest

from coupled import guide
from prbm.runs.run import simulate
from prbm.systems import ssp
from prbm.systems.components import CouplingError
from prbm.systems.structure import Package
from support import mechanism

pytestmark = [
    pytest.mark.fmu, pytest.mark.native, pytest.mark.usefixtures("plain_temporary_folder")
]  # fmt: skip

SPACES = " ".join(
    f'xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for short, name in (
        ("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"),
        ("ssm", "ParameterMapping"),
    )
)  # fmt: skip
UNITS = """<ssd:Units>
  <ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>
  <ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>
</ssd:Units>"""
SET_UNITS = UNITS.replace("ssd:", "ssv:")
IN = '<ssd:Connector name="stop.displacement" kind="input"><ssc:Real/></ssd:Connector>'
OUT = '<ssd:Connector name="shuttle.x" kind="output"><ssc:Real/></ssd:Connector>'


def parameters(*given: str, units: str = "") -> str:
    """Return a parameter set of texts such as 'release.displacement Real value="1"'."""
    lines = []
    for text in given:
        name, kind, value = text.split(" ", 2)
        lines.append(f'<ssv:Parameter name="{name}"><ssv:{kind} {value}/></ssv:Parameter>')
    inside = f"<ssv:Parameters>{''.join(lines)}</ssv:Parameters>{units}"
    return f'<ssv:ParameterSet {SPACES} version="1.0" name="set">{inside}</ssv:ParameterSet>'


def binding(content: str = "", attributes: str = "", mapping: str = "") -> str:
    inside = f"<ssd:ParameterValues>{content}</ssd:ParameterValues>" if content else ""
    return f"<ssd:ParameterBinding {attributes}>{inside}{mapping}</ssd:ParameterBinding>"


def component(name: str = "a", bindings: str = "", source: str = "resources/a.fmu") -> str:
    own = f"<ssd:ParameterBindings>{bindings}</ssd:ParameterBindings>" if bindings else ""
    return (
        f'<ssd:Component name="{name}" source="{source}"><ssd:Connectors>{IN}{OUT}'
        f"</ssd:Connectors>{own}</ssd:Component>"
    )


def system(elements: str, bindings: str = "", name: str = "top", rest: str = "") -> str:
    own = f"<ssd:ParameterBindings>{bindings}</ssd:ParameterBindings>" if bindings else ""
    return (
        f'<ssd:System name="{name}">{own}<ssd:Elements>{elements}</ssd:Elements>{rest}</ssd:System>'
    )


def written(folder: Path, content: str, files=(), fmus=("resources/a.fmu",), end: str = "") -> Path:
    """Return a package of a system, other files, and copies of an FMU."""
    path = folder / "other.ssp"
    root = (
        f'<ssd:SystemStructureDescription {SPACES} version="1.0" name="other">{content}{UNITS}'
        f"{end}</ssd:SystemStructureDescription>"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", root)
        for name, text in dict(files).items():
            archive.writestr(name, text)
        for name in fmus:
            archive.write(guide(2), name)
    return path


def meaning(folder: Path, content: str, **more):
    copies = folder / "copies"
    copies.mkdir()
    return Package(written(folder, content, **more), copies).flat


RELEASE = 'release.displacement Real value="-12" unit="mm"'
START = "a.release.displacement"


@pytest.mark.parametrize(
    "content",
    [
        system(component(bindings=binding(parameters(RELEASE, units=SET_UNITS)))),
        system(component(), binding(parameters(f"a.{RELEASE}", units=SET_UNITS))),
        system(component(), binding(parameters(RELEASE, units=SET_UNITS), 'prefix="a."')),
        system(component(), binding(attributes='source="set.ssv"')),
        system(
            component(bindings=binding(parameters('release.displacement Real value="1"'))),
            binding(parameters(f"a.{RELEASE}", units=SET_UNITS)),
        ),
    ],
    ids=["component", "system", "prefix", "file", "outer replaces inner"],
)
def test_a_start_value_is_bound_at_every_level_with_its_unit(content, tmp_path):
    files = {"set.ssv": parameters(f"a.{RELEASE}", units=SET_UNITS)}
    assert meaning(tmp_path, content, files=files).values == {START: -0.012}


def test_a_start_value_is_mapped_and_transformed(tmp_path):
    entry = (
        f'<ssm:ParameterMapping {SPACES} version="1.0"><ssm:MappingEntry source="pulled" '
        f'target="{START}"><ssc:LinearTransformation factor="-2" offset="0.001"/>'
        "</ssm:MappingEntry></ssm:ParameterMapping>"
    )
    mapping = f"<ssd:ParameterMapping>{entry}</ssd:ParameterMapping>"
    given = binding(parameters('pulled Real value="0.004"'), mapping=mapping)
    assert meaning(tmp_path, system(component(), given)).values == {START: -0.007}


def test_values_reach_nested_systems(tmp_path):
    nested = system(component(), name="inner")
    given = binding(parameters(f"inner.a.{RELEASE}", units=SET_UNITS))
    found = meaning(tmp_path, system(nested, given))
    assert found.values == {"inner/a.release.displacement": -0.012}
    assert found.fmus == {"inner/a": "resources/a.fmu"}


def test_a_bound_release_moves_as_a_simulation_with_it(tmp_path):
    given = binding(parameters(f"a.{RELEASE}", units=SET_UNITS))
    found = ssp.simulate(written(tmp_path, system(component(), given)), 0.1, 1e-3)
    expected = simulate(
        mechanism("PRBDM"), {"release.displacement": -0.012}, stop_time=0.1, step=1e-3
    )
    assert found["a.shuttle.x"][-1] == pytest.approx(expected["shuttle.x"][-1], abs=1e-9)


def test_a_connection_is_transformed_and_names_are_decoded(tmp_path):
    name = "resources/Motor #1 50%.fmu"
    elements = component("a", source="resources/Motor%20%231%2050%25.fmu")
    elements += component("b", source="resources/Motor%20%231%2050%25.fmu")
    rest = (
        '<ssd:Connections><ssd:Connection startElement="a" startConnector="shuttle.x" '
        'endElement="b" endConnector="stop.displacement"><ssc:LinearTransformation factor="0.5" '
        'offset="0.25"/></ssd:Connection></ssd:Connections>'
    )
    found = meaning(tmp_path, system(elements, rest=rest), fmus=[name])
    ((to, (source, signal)),) = found.wires.items()
    assert (to, source, float(signal(3.0))) == ("b.stop.displacement", "a.shuttle.x", 1.75)


def nested(connector: str, *wires: str) -> str:
    """Return a system of a component, with one connector and connections to the component."""
    inside = "".join(f"<ssd:Connection {wire}/>" for wire in wires)
    text = system(component(), name="inner", rest=f"<ssd:Connections>{inside}</ssd:Connections>")
    start = '<ssd:System name="inner">'
    return text.replace(start, f"{start}<ssd:Connectors>{connector}</ssd:Connectors>")


BARE = '<ssd:Connector name="C" kind="input">{}</ssd:Connector>'
DISPLACED = 'startConnector="C" endElement="a" endConnector="stop.displacement"'
SUPPRESSED = f'{DISPLACED} suppressUnitConversion="true"'


def test_a_connector_without_a_unit_has_that_of_what_is_connected_inside(tmp_path):
    """The value is converted on its way to C; there is no conversion after C."""
    given = binding(parameters('inner.C Real value="-12" unit="mm"', units=SET_UNITS))
    found = meaning(tmp_path, system(nested(BARE.format(""), SUPPRESSED), given))
    assert found.values == {"inner/a.stop.displacement": -0.012}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (system(component().replace('kind="input"', 'kind="inout"')), "inout is not supported"),
        (system(component(source="../a.fmu")), "is not in the package"),
        (system(component(source="http://a.de/a.fmu")), "is not in the package"),
        (
            system(
                component().replace(
                    "<ssd:Component", '<ssd:Component implementation="ModelExchange"'
                )
            ),
            "ModelExchange is not supported",
        ),
        (
            system(component(), binding(attributes='source="set.ssv" sourceBase="component"')),
            "sourceBase component is not supported",
        ),
        (
            system(component() + '<ssd:SignalDictionaryReference name="bus" dictionary="d"/>'),
            "SignalDictionaryReference is not supported",
        ),
        (
            system(component(), binding(parameters(f'{START} Real value="1" unit="ft"'))),
            "ft: the unit is not defined",
        ),
        (
            system(component(), binding(parameters(f'{START} String value="1"'))),
            "type String is no Real",
        ),
        (
            system(
                nested(BARE.format(""), DISPLACED, DISPLACED.replace("displacement", "velocity"))
                .replace(IN, IN + IN.replace("displacement", "velocity")),
                binding(parameters('inner.C Real value="1"')),
            ),
            "cannot be deduced",
        ),
        (system(nested(BARE.format("<ssc:String/>"), DISPLACED)), "type String is no Real"),
        (
            system(
                nested(
                    BARE.format("") + '<ssd:Connector name="D" kind="output"/>',
                    'startConnector="C" endConnector="D"',
                ),
                rest='<ssd:Connections><ssd:Connection startElement="inner" startConnector="D" '
                'endElement="inner" endConnector="C"/></ssd:Connections>',
            ),
            "loop without an FMU",
        ),
        (system(component(source="http://[x]/a.fmu")), "is not a valid URI"),
        ("<ssd:System/>", "not valid by SSP 1.0"),
    ],
)  # fmt: skip
def test_what_is_not_supported_is_refused_by_name(content, words, tmp_path):
    with pytest.raises(CouplingError, match=words):
        meaning(tmp_path, content)


def top(name: str) -> str:
    """Return a system whose output of a name is that of its component."""
    connector = f'<ssd:Connector name="{name}" kind="output"/>'
    wire = f'startElement="a" startConnector="shuttle.x" endConnector="{name}"'
    text = system(component(), rest=f"<ssd:Connections><ssd:Connection {wire}/></ssd:Connections>")
    start = '<ssd:System name="top">'
    return text.replace(start, f"{start}<ssd:Connectors>{connector}</ssd:Connectors>")


def test_an_output_of_the_system_without_an_fmu_is_refused(tmp_path):
    """The input of the system leads to its output, which no FMU gives a value."""
    content = top("Y").replace('startElement="a" startConnector="shuttle.x"', 'startConnector="U"')
    given = '<ssd:Connector name="U" kind="input"/>'
    content = content.replace("<ssd:Connectors>", f"<ssd:Connectors>{given}", 1)
    with pytest.raises(CouplingError, match="connection to Y: no output of an FMU leads to"):
        meaning(tmp_path, content)


@pytest.mark.parametrize("name", ["time", "a.shuttle.x"])
def test_an_output_with_the_name_of_another_column_is_refused(name, tmp_path):
    with pytest.raises(CouplingError, match=f"the output {name} of the system has the name of"):
        meaning(tmp_path, top(name))


def test_an_output_may_have_dots_in_its_name(tmp_path):
    found = meaning(tmp_path, top("a.shuttle"))
    assert {to: source for to, (source, _) in found.outputs.items()} == {"a.shuttle": "a.shuttle.x"}


TEMPERATURES = """<UnitDefinitions>
  <Unit name="K"><BaseUnit K="1"/></Unit>
  <Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>
  <Unit name="1e-200 m"><BaseUnit m="1" factor="1e-200"/></Unit>
  <Unit name="1e200 m"><BaseUnit m="1" factor="1e200"/></Unit>
</UnitDefinitions>
<TypeDefinitions>
  <SimpleType name="Difference"><Real unit="degC" relativeQuantity="true"/></SimpleType>
</TypeDefinitions>"""


def converted(folder: Path, source: str, sink: str):
    """Return the signal of a connection of two reals with attributes, in an FMU of their own."""
    variables = "".join(
        f'<ScalarVariable name="{name}" valueReference="{k}" causality="{kind}">'
        f"<Real {own} {more}/></ScalarVariable>"
        for k, (name, kind, own, more) in enumerate(
            (("shuttle.x", "output", source, ""), ("stop.displacement", "input", sink, 'start="0"'))
        )
    )
    text = (
        '<fmiModelDescription fmiVersion="2.0" modelName="x" guid="x"><CoSimulation '
        f'modelIdentifier="x"/>{TEMPERATURES}<ModelVariables>{variables}</ModelVariables>'
        '<ModelStructure><Outputs><Unknown index="1"/></Outputs></ModelStructure>'
        "</fmiModelDescription>"
    )
    fmu = folder / "x.fmu"
    with zipfile.ZipFile(fmu, "w") as archive:
        archive.writestr("modelDescription.xml", text)
    wire = (
        'startElement="a" startConnector="shuttle.x" endElement="a" '
        'endConnector="stop.displacement"'
    )
    content = system(
        component(), rest=f"<ssd:Connections><ssd:Connection {wire}/></ssd:Connections>"
    )
    files = {"resources/a.fmu": fmu.read_bytes()}
    found = meaning(folder, content, files=files, fmus=())
    return found.wires["a.stop.displacement"][1]


RELATIVE = 'relativeQuantity="true"'


@pytest.mark.parametrize(
    ("source", "sink"),
    [
        (f'unit="degC" {RELATIVE}', 'unit="K"'),
        ('unit="degC"', f'unit="K" {RELATIVE}'),
        (f'unit="degC" {RELATIVE}', f'unit="K" {RELATIVE}'),
        ('unit="K"', 'declaredType="Difference"'),
        ('declaredType="Difference"', 'unit="K"'),
    ],
)
def test_an_offset_is_never_added_to_a_difference(source, sink, tmp_path):
    with pytest.raises(CouplingError, match="one of them is a relative quantity"):
        converted(tmp_path, source, sink)


def test_a_difference_without_an_offset_and_a_temperature_with_one_are_converted(tmp_path):
    for k, (source, sink, expected) in enumerate((
        ('unit="degC"', 'unit="K"', 283.15),
        ('declaredType="Difference" relativeQuantity="false"', 'unit="K"', 283.15),
        ('declaredType="Difference"', f'unit="degC" {RELATIVE}', 10.0),
    )):  # fmt: skip
        folder = tmp_path / str(k)
        folder.mkdir()
        assert float(converted(folder, source, sink)(10.0)) == pytest.approx(expected, rel=1e-15)


def test_a_conversion_without_a_float_is_refused(tmp_path):
    """Its factor, 1e400, has no float; the value would be lost in the run."""
    with pytest.raises(CouplingError, match="too small or too large for a float"):
        converted(tmp_path, 'unit="1e200 m"', 'unit="1e-200 m"')
