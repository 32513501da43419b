"""The model descriptions and contents of native FMUs: valid, and consistent between versions."""

import io
import re
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import fmpy
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu
from lxml import etree

import native_host
from prbm.base.atomic import write
from prbm.base.errors import MechanismError, SimulationError
from prbm.commands import fmu_report as report
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.fmu import native_fmu
from prbm.fmu import reference_results as reference
from prbm.fmu.export import Export
from prbm.fmu.native_fmu import described
from prbm.interface.structure import dependencies
from prbm.kernel.sources import TABLES, UNIT, amalgamation, kernel
from support import GUIDES, SHIPPED, case, each_shipped, own_fmu

SCHEMAS = Path(fmpy.__file__).parent / "schema"
FLAVOURS = [
    pytest.param((*getattr(p, "values", (p,)), fmi), marks=getattr(p, "marks", ()))
    for p in SHIPPED
    for fmi in (2, 3)
]

pytestmark = [pytest.mark.fmu, pytest.mark.native]


@pytest.fixture(scope="module")
def clocked() -> Path:
    return native_host.clocked("PRBDM")


@pytest.fixture(params=[*FLAVOURS, "clock"], ids=str)
def fmu(request, native, clocked) -> SimpleNamespace:
    """Return each native FMU in turn."""
    name, fmi = ("PRBDM", 3) if request.param == "clock" else request.param
    path = clocked if request.param == "clock" else native[name, fmi]
    return SimpleNamespace(name=name, fmi=fmi, path=path, clock=request.param == "clock")


def member(fmu: Path, name: str) -> bytes:
    with zipfile.ZipFile(fmu) as archive:
        return archive.read(name)


@pytest.mark.slow
def test_fmpy_validation_reports_no_problem(fmu):
    """FMPy lists clocks among the initial unknowns, against FMI 3.0.2 (2.4.8)."""
    problems = validate_fmu(str(fmu.path))
    if fmu.clock:
        (problem,) = problems
        assert "InitialUnknowns" in problem
        expected, written = (set(part.split(", ")) for part in re.findall(r"{(.*?)}", problem))
        clocks = {v.name for v in read_model_description(str(fmu.path)).modelVariables
                  if v.type == "Clock"}  # fmt: skip
        assert clocks
        assert expected == written | clocks
    else:
        assert problems == []


def test_all_xml_passes_the_schemas_of_the_standards(fmu):
    files = {
        "modelDescription.xml": f"fmi{fmu.fmi}/fmi{fmu.fmi}ModelDescription.xsd",
    }
    if fmu.fmi == 3:
        files["sources/buildDescription.xml"] = "fmi3/fmi3BuildDescription.xsd"
        files["terminalsAndIcons/terminalsAndIcons.xml"] = "fmi3/fmi3TerminalsAndIcons.xsd"
    for name, schema in files.items():
        checker = etree.XMLSchema(file=str(SCHEMAS / schema))
        assert checker.validate(etree.fromstring(member(fmu.path, name))), checker.error_log


def test_a_failing_default_experiment_has_no_reference_results(monkeypatch):
    def fails(*_: object, **__: object) -> None:
        raise SimulationError("too many impacts")

    monkeypatch.setattr(reference, "simulate", fails)
    reported: list[str] = []
    built = native_fmu.build(read_mechanism(shipped()["PRBDM"]), fmi=3, progress=reported.append)
    with zipfile.ZipFile(io.BytesIO(built)) as archive:
        assert not [name for name in archive.namelist() if name.endswith("_out.csv")]
    assert "no reference results: the simulation of the default experiment fails" in reported


@each_shipped
def test_native_fmus_have_all_variables_of_the_python_fmu(fmus, native, clocked, model):
    """Native FMUs add derivatives, event indicators and, in FMI 3.0, time.

    The nominal values of states differ: those of native FMUs are for the importer's solver.
    """

    def listed(path) -> dict[str, tuple]:
        kinds = {"Float64": "Real", "Int32": "Integer"}
        return {
            v.name: (
                v.valueReference, kinds.get(v.type, v.type), v.causality, v.variability,
                v.initial, v.unit, v.displayUnit, v.min, v.max, v.start, v.description,
                v.derivative and v.derivative.name, None if v.name in states else v.nominal,
            )
            for v in read_model_description(str(path)).modelVariables
        }  # fmt: skip

    derivatives = read_model_description(str(native[model, 2])).derivatives
    states = {unknown.variable.derivative.name for unknown in derivatives}
    plain, two, three = map(listed, (fmus[model], native[model, 2], native[model, 3]))
    assert plain.items() <= two.items() <= three.items()
    assert three.keys() - two.keys() == {"time"}
    assert all(re.search(r"^der\(|_indicator$", name) for name in two.keys() - plain.keys())
    if model == "PRBDM":
        states = set()
        three, clock = listed(native["PRBDM", 3]), listed(clocked)
        assert three.items() <= clock.items()
        assert clock.keys() - three.keys() == {"stop.impact"}


def test_states_derivatives_and_indicators_are_consistent(fmu, mechanisms):
    """States are a coordinate and a rate per degree of freedom and two energies, with reinit."""
    description = read_model_description(str(fmu.path))
    guide = mechanisms[fmu.name]
    held = 2 * (len(guide.flexures) + len(guide.joints))
    held += sum(1 if one.turning else 2 for one in guide.guides)
    bent = r"(link.*|.*\.bend\[\d+\])\.angle$|.*\.strain$"
    moving = [v for v in description.modelVariables if re.match(bent, v.name)]
    freedom = len(moving) + 3 * len(guide.bodies) - held
    states = [u.variable.derivative for u in description.derivatives]
    assert len(states) == len({s.name for s in states}) == 2 * freedom + 2
    root = etree.fromstring(member(fmu.path, "modelDescription.xml"))
    again = [v if v.get("name") else v.getparent() for v in root.xpath("//*[@reinit='true']")]
    assert {v.get("name") for v in again} == {s.name for s in states}
    indicators = [v.name for v in description.modelVariables if v.name.endswith("_indicator")]
    if fmu.fmi == 2:
        assert root.get("numberOfEventIndicators") == str(len(indicators))
    else:
        assert [u.variable.name for u in description.eventIndicators] == indicators
    assert len(indicators) == 3 * len(guide.stops) + len(guide.frictions)


def test_a_clock_is_an_output_but_no_initial_unknown(clocked):
    """It cannot be read in Initialization Mode, and has no ``initial`` (FMI 3.0.2, 2.4.8)."""
    description = read_model_description(str(clocked))
    assert "stop.impact" in {u.variable.name for u in description.outputs}
    initial = {u.variable.name for u in description.initialUnknowns}
    assert "stop.impact" not in initial
    outputs = {v.name for v in description.modelVariables if v.causality == "output"}
    assert outputs - initial == {"stop.impact"}


def test_parameters_are_knowns_in_fmi_3_but_not_in_fmi_2(fmu):
    """The two standards define ``dependencies`` differently."""
    description = read_model_description(str(fmu.path))
    parameters = {v.name for v in description.modelVariables if v.causality == "parameter"}
    of_parameters = set()
    for unknown in (*description.outputs, *description.derivatives):
        known = {v.name for v in unknown.dependencies} & parameters
        assert known in (set(), parameters)
        of_parameters |= {unknown.variable.name} if known else set()
    if fmu.fmi == 2:
        assert not of_parameters
    else:
        it = case(fmu.name)
        assert {it.released, f"{it.stop}.force", "der(energy.work)"} <= of_parameters
        assert not {f"{it.stop}.impact_count", "energy.work"} & of_parameters


def test_capabilities_are_declared(fmu):
    root = etree.fromstring(member(fmu.path, "modelDescription.xml"))
    exchange, simulation = root.find("ModelExchange"), root.find("CoSimulation")
    state = "State" if fmu.fmi == 3 else "state"
    for kind in (exchange, simulation):
        assert kind.get("modelIdentifier") == fmu.name
        assert kind.get(f"canGetAndSetFMU{state}") == kind.get(f"canSerializeFMU{state}") == "true"
        assert kind.get("needsExecutionTool", "false") == "false"
    plural = "s" if fmu.fmi == 3 else ""
    assert exchange.get(f"providesDirectionalDerivative{plural}") == "true"
    assert simulation.get(f"providesDirectionalDerivative{plural}", "false") == "false"
    assert simulation.get("canHandleVariableCommunicationStepSize") == "true"
    if fmu.fmi == 3:
        assert simulation.get("hasEventMode") == "true"
    names = {c.get("name") for c in root.find("LogCategories")}
    assert {"logEvents", "logStatusError", "logAll"} <= names


def test_fmi_2_has_no_terminals_but_an_icon(fmu):
    """FMI Library reports terminals as a fatal error in FMI 2.0."""
    with zipfile.ZipFile(fmu.path) as archive:
        names = archive.namelist()
    assert any(name.startswith("terminalsAndIcons") for name in names) == (fmu.fmi == 3)
    assert ("model.png" in names) == (fmu.fmi == 2)
    folder = "documentation" if fmu.fmi == 2 else "terminalsAndIcons"
    assert etree.fromstring(member(fmu.path, f"{folder}/icon.svg")).tag.endswith("}svg")


@each_shipped
def test_dependencies_cover_every_output_and_derivative(model, mechanisms):
    native = described(Export(mechanisms[model]), 3, clock=True)
    found = dependencies(mechanisms[model], native)
    outputs = {v.name for v in native.variables if v.causality == "output"}
    assert {*outputs, *native.derivatives, *native.indicators} <= found.keys()
    inputs = {v.name for v in native.variables if v.causality == "input"}
    for name, known in found.items():
        assert {*known} <= {*native.states, *inputs}, name
    for i, rate in enumerate(native.states[len(native.independent) : 2 * len(native.independent)]):
        assert found[rate] == (rate,)
        assert native.derivatives[i] == rate
    it = case(model)
    assert found[f"{it.stop}.impact_count"] == ()
    assert f"{it.force}.x" in found["base.force.x"]
    assert f"{it.force}.x" not in found[f"{it.body}.vx"]


def test_an_output_without_dependencies_is_rejected(mechanisms):
    guide = mechanisms["PRBDM"]
    native = described(Export(guide), 3)
    added = replace(native.variables[-1], name="shuttle.energy", causality="output")
    with pytest.raises(MechanismError, match=r"outputs shuttle.energy: add them to"):
        dependencies(guide, replace(native, variables=(*native.variables, added)))


def test_the_source_is_one_file_with_the_functions_of_one_version_of_fmi(mechanisms):
    for fmi, other in ((2, 3), (3, 2)):
        text = amalgamation("X", "*/ title", fmi)
        included = set(re.findall(r'#\s*include\s+"([^"]+)"', text))
        assert included == {TABLES}
        assert f"FMI{fmi}(GetVersion)" in text
        assert f"FMI{other}(GetVersion)" not in text
        assert text.count("/* ") == text.count("*/") or "*/ title" not in text
    assert UNIT in kernel()


STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="calls cc and nm as they are on Linux")
@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_the_compiled_source_needs_no_resources(native, tmp_path, fmi):
    """The source is compiled with strict warnings and without the headers of the standard."""
    with zipfile.ZipFile(native["PRBDM", fmi]) as archive:
        archive.extractall(tmp_path)
    sources = tmp_path / "sources"
    if fmi == 3:
        listed = etree.parse(sources / "buildDescription.xml").getroot()
    else:
        listed = etree.parse(tmp_path / "modelDescription.xml").find("CoSimulation")
    names = [file.get("name") for file in listed.iter("File", "SourceFile")]
    definitions = [f"-D{d.get('name')}" for d in listed.iter("PreprocessorDefinition")]
    command = ["cc", *STRICT, *names]
    (library,) = (tmp_path / "binaries").rglob("*.so")
    subprocess.run(
        [*command, *definitions, "-O0", "-fPIC", "-shared", "-o", library, "-lm"],
        cwd=sources, check=True,
    )  # fmt: skip
    shutil.rmtree(tmp_path / "resources")
    result = simulate_fmu(str(tmp_path), output=["stop.impact_count"])
    assert result["stop.impact_count"][-1] == 14
    prefix = ["-DFMI2_FUNCTION_PREFIX=PRBDM_"] if fmi == 2 else []
    subprocess.run([*command, *prefix, "-c", "-o", "static.o"], cwd=sources, check=True)
    found = subprocess.check_output(["nm", "-g", "--defined-only", "static.o"], cwd=sources)
    shown = {line.split()[-1] for line in found.decode().splitlines()}
    assert shown
    assert all(name.startswith(f"PRBDM_fmi{fmi}") for name in shown)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_two_builds_of_one_source_are_identical(native, mechanisms, fmi):
    again = native_fmu.build(read_mechanism(shipped()["PRBDM2R"]), fmi=fmi)
    assert native["PRBDM2R", fmi].read_bytes() == again


def test_the_token_depends_on_the_content(native, mechanisms):
    """Other start values, another mechanism or another version of FMI give another token."""
    built = [native[name, fmi] for name in GUIDES for fmi in (2, 3)]
    tokens = {
        read_model_description(str(path)).guid
        or read_model_description(str(path)).instantiationToken
        for path in built
    }
    changed = own_fmu("fmi2", mechanisms["PRBDM"], {"stop.restitution": 0.5})
    tokens.add(read_model_description(io.BytesIO(changed)).guid)
    assert len(tokens) == 5
    for fmu in built:
        description = read_model_description(str(fmu))
        token = (description.guid or description.instantiationToken).encode()
        assert token + b"\0" in member(fmu, "resources/mechanism.bin")


def test_changed_start_values_are_in_the_model_description(mechanisms):
    changed = own_fmu("fmi3", mechanisms["PRBDM"], {"stop.restitution": 0.1 + 0.2})
    listed = {v.name: v for v in read_model_description(io.BytesIO(changed)).modelVariables}
    assert float(listed["stop.restitution"].start) == 0.1 + 0.2


def test_licences_of_all_contents_are_included(fmu):
    folder = "documentation/licenses/"
    with zipfile.ZipFile(fmu.path) as archive:
        names = {n.removeprefix(folder) for n in archive.namelist() if n.startswith(folder)}
        entry = archive.read(f"{folder}license.txt").decode()
    assert {"license.txt", "prbm-impact.txt", "wasi-libc.txt", "zig.txt"} == names
    assert all(name in entry for name in names - {"license.txt"})


def test_the_page_names_every_variable_and_state(fmu):
    page = member(fmu.path, "documentation/index.html").decode()
    for v in read_model_description(str(fmu.path)).modelVariables:
        assert f"<code>{v.name}</code>" in page, v.name
    assert "Requirements: <strong>none</strong>" in page
    assert ("fmi3UpdateDiscreteStates" in page) == (fmu.fmi == 3)


def test_the_report_reads_the_mechanism_from_the_fmu(fmu, mechanisms):
    run = report.simulate(fmu.path, lambda fraction: None)
    assert run.mechanism == mechanisms[fmu.name]
    assert run.finished
    text, it = "\n".join(report.summary(run)), case(fmu.name)
    assert re.search(rf"impacts at {it.stop} +\d+, the first at t = 0\.", text)
    if fmu.name in GUIDES:
        assert re.search(r"impacts at stop +14, the first at t = 0\.04", text)
        assert re.search(r"came to rest +at t = 0\.24", text)


def test_clocks_without_a_stop_are_rejected(tmp_path):
    text = shipped()["PRBDM"].read_text(encoding="utf-8")
    text = re.sub(r"\[\[stops\]\].*?\n\n", "", text, flags=re.DOTALL)
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    free = read_mechanism(path)
    assert free.stops == ()
    with pytest.raises(MechanismError, match="PRBDM has no stop"):
        native_fmu.build(free, fmi=3, clock=True)
    assert validate_fmu(_written(tmp_path, own_fmu("fmi3", free))) == []


def _written(folder: Path, content: bytes) -> str:
    write(folder / "free.fmu", content)
    return str(folder / "free.fmu")
