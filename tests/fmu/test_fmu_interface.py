"""The model description of a Python FMU (units, start values, structure) and its contents."""

import ast
import importlib.metadata
import json
import re
import subprocess
import sys
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

import prbm
from fmu_host import OK, Instance
from prbm.fmu.description import Heading, model_description
from prbm.fmu.documentation import page
from prbm.fmu.export import Export
from prbm.fmu.native_fmu import described
from prbm.fmu.slave.resolved import mechanism_from, resolved
from prbm.fmu.start import interface, start
from prbm.interface.units import UNITS
from prbm.interface.variables import variables, with_starts
from prbm.runs.experiment import Experiment, experiment
from support import GUIDES, ROOT, case, each_shipped

pytestmark = pytest.mark.fmu


@each_shipped
def test_fmpy_validation_reports_no_problem(fmus, model):
    assert validate_fmu(str(fmus[model])) == []


@each_shipped
def test_every_variable_has_a_unit_a_description_and_an_exact_start(fmus, mechanisms, model):
    """Start values are written with all digits, so that they read back exactly."""
    values = mechanisms[model].values()
    for v in read_model_description(str(fmus[model])).modelVariables:
        assert v.description, v.name
        assert v.type != "Real" or v.unit, v.name
        if v.causality in ("parameter", "input"):
            assert float(v.start) == values.get(v.name, 0.0), v.name


@each_shipped
def test_a_value_reference_depends_on_the_name_alone(fmus, model):
    listed = read_model_description(str(fmus[model])).modelVariables
    for v in listed:
        assert v.valueReference == zlib.crc32(v.name.encode()) & 0x7FFFFFFF
    assert len({v.valueReference for v in listed}) == len(listed)


NAMES = {
    "parameter fixed": "flexure.length flexure.thickness flexure.width flexure.youngs_modulus "
    "flexure.density shuttle.width shuttle.mass shuttle.inertia shuttle.com_height gravity.x "
    "gravity.y release.displacement release.velocity solver.tolerance",
    "parameter tunable": "damping.zeta damping.beta friction.coefficient friction.normal_force "
    "friction.normal_stiffness stop.position stop.offset stop.restitution stop.friction "
    "stop.rest_speed",
    "input continuous": "force.x force.y force.moment stop.displacement stop.velocity "
    "base.acceleration.x base.acceleration.y stop.mobility",
    "input discrete": "force.impulse.x force.impulse.y force.impulse.moment",
    "output continuous": "shuttle.x shuttle.y shuttle.angle shuttle.vx shuttle.vy shuttle.omega "
    "stop.gap stop.gap_rate stop.force stop.point.displacement stop.point.velocity "
    "stop.point.mobility base.force.x base.force.y base.moment energy.kinetic "
    "energy.elastic energy.gravitational energy.dissipated energy.work",
    "output discrete": "stop.contact stop.impact_count stop.impact_time stop.approach_speed "
    "stop.rebound_speed stop.impulse stop.energy_lost stop.modal_restitution stop.impulse_sum",
    "local fixed": "mode.frequency",
}
FLEXURES = {
    "PRBDM": {"parameter fixed": "flexure.gamma flexure.K_theta"},
    "PRBDM2R": {
        "parameter fixed": "flexure.gamma1 flexure.gamma2 flexure.K_theta1 flexure.K_theta2",
        "calculatedParameter fixed": "flexure.gamma0",
    },
}
LINKS = {"PRBDM": 2, "PRBDM2R": 6}


@pytest.mark.parametrize("model", GUIDES)
def test_names_and_causalities_do_not_change_between_versions(fmus, model):
    links = (f"link[{k + 1}].{what}" for k in range(LINKS[model]) for what in ("angle", "omega"))
    agreed = {(name, "local continuous") for name in links}
    for table in (NAMES, FLEXURES[model]):
        agreed |= {(name, kind) for kind, names in table.items() for name in names.split()}
    listed = read_model_description(str(fmus[model])).modelVariables
    assert {(v.name, f"{v.causality} {v.variability}") for v in listed} == agreed


def test_base_unit_exponents_follow_from_unit_names():
    """N.m = N m, kg/m3 = kg m^-3, ...: the exponents follow from the atoms."""
    atoms = {name: UNITS[name].base for name in ("m", "s", "rad", "kg", "N")} | {"1": {}}
    derived = {"Pa": "N/m2", "J": "N.m", "W": "N.m/s", "Hz": "1/s"}
    for name, unit in UNITS.items():
        above, _, below = derived.get(name, name).partition("/")
        exponents: dict[str, int] = {}
        for part, sign in ((above, 1), (below, -1)):
            for factor in filter(None, part.split(".")):
                atom, power = re.fullmatch(r"([A-Za-z]+|1)(\d*)", factor).groups()
                for base, n in atoms[atom].items():
                    exponents[base] = exponents.get(base, 0) + sign * n * int(power or 1)
        assert {b: n for b, n in exponents.items() if n} == dict(unit.base), name


def test_display_unit_factors_follow_from_their_prefixes():
    prefixes = {"m": 1e-3, "u": 1e-6, "k": 1e3, "M": 1e6, "G": 1e9}
    for name, unit in UNITS.items():
        for display, factor in unit.display.items():
            if display in ("deg", "deg/s", "deg/s2", "g", "g.mm2", "g/cm3", "mN.m/deg"):
                continue  # More than a prefix differs.
            by_parts = [
                prefixes[part[0]] if part != plain else 1.0
                for part, plain in zip(display.split("/"), name.split("/"), strict=True)
            ]
            scale = by_parts[0] / (by_parts[1] if len(by_parts) > 1 else 1.0)
            assert factor == pytest.approx(1 / scale, rel=1e-15), display  # round-off


@each_shipped
def test_velocities_are_declared_as_derivatives(fmus, model):
    listed = {v.name: v for v in read_model_description(str(fmus[model])).modelVariables}
    rates = {"vx": "x", "vy": "y", "omega": "angle", "gap_rate": "gap", "strain_rate": "strain",
             "point.velocity": "point.displacement", "length_rate": "length"}  # fmt: skip
    declared = set()
    for name, v in listed.items():
        owner, _, what = name.rpartition(".")
        if owner.endswith(".point"):
            owner, what = owner.removesuffix(".point"), f"point.{what}"
        if what in rates:
            assert v.derivative is listed[f"{owner}.{rates[what]}"], name
            declared.add(what)
        else:
            assert v.derivative is None, name
    assert {*rates} - {"strain_rate", "length_rate"} <= declared


@each_shipped
def test_capabilities_and_the_default_experiment_are_declared(fmus, model):
    description = read_model_description(str(fmus[model]))
    cs, declared = description.coSimulation, description.defaultExperiment
    expected = experiment(case(model).mechanism)
    assert cs.canGetAndSetFMUstate
    assert cs.canSerializeFMUstate
    assert cs.canHandleVariableCommunicationStepSize
    assert (declared.startTime, float(declared.stopTime)) == ("0.0", expected.stop_time)
    assert (float(declared.stepSize), float(declared.tolerance)) == (expected.step, 1e-8)
    assert description.generationDateAndTime.endswith("Z")


@each_shipped
def test_outputs_ignore_inputs_set_at_the_same_communication_point(fmus, model):
    """ModelStructure declares no dependency of an output on an input; all inputs are changed."""
    guide = case(model).mechanism
    with Instance(fmus[model]).initialize() as instance:
        assert instance.step(0.0, 0.01) == OK
        before = instance.values()
        inputs = [n for n, v in instance.variables.items() if v.causality == "input"]
        instance.set(dict.fromkeys(inputs, 1e-3))
        after = instance.values()
    outputs = [n for n, v in instance.variables.items() if v.causality == "output"]
    assert len(inputs) == 6 * len(guide.forces) + 3 * len(guide.stops) + 2
    assert {n: after[n] for n in outputs} == {n: before[n] for n in outputs}


@each_shipped
def test_outputs_are_within_their_declared_bounds_through_a_run(fmus, model):
    step = case(model).end / 75
    with Instance(fmus[model]).initialize() as instance:
        for k in range(75 if case(model).costly else 100):
            assert instance.step(k * step, step) == OK
            for name, value in instance.values().items():
                v = instance.variables[name]
                assert v.min is None or value >= float(v.min), name
                assert v.max is None or value <= float(v.max), name


@each_shipped
def test_a_mechanism_is_equal_after_a_round_trip_through_json(mechanisms, model):
    mechanism = mechanisms[model]
    data = json.loads(json.dumps(resolved(mechanism, ())))
    assert mechanism_from(data["mechanism"]) == mechanism


@each_shipped
def test_changed_start_values_are_written_exactly(mechanisms, model):
    """The sum 0.1 + 0.2 needs seventeen digits."""
    name = f"{case(model).stop}.restitution"
    listed = interface(mechanisms[model], {name: 0.1 + 0.2})
    xml = ElementTree.fromstring(model_description(Heading("X", "", "", {}), listed))
    start = xml.find(f".//ScalarVariable[@name='{name}']/Real").get("start")
    assert float(start) == 0.1 + 0.2 != 0.3


def test_start_values_of_computed_or_unknown_variables_are_rejected(mechanisms):
    mechanism = mechanisms["PRBDM"]
    listed = variables(mechanism, start(mechanism, {}).sample)
    with pytest.raises(prbm.base.errors.ParameterError, match=r"shuttle\.x is computed"):
        with_starts(listed, {"shuttle.x": 1.0})
    with pytest.raises(prbm.base.errors.ParameterError, match=r"did you mean stop\.restitution"):
        with_starts(listed, {"stop.restitutoin": 1.0})


@pytest.mark.parametrize(
    "name",
    [
        "shuttle.x", "stop.gap", "stop.displacement", "force.x", "energy.work", "link[1].angle",
        "mode.frequency", "time", "flexure.gamma0", "stop.slip_indicator", "stop.impact",
    ],
)  # fmt: skip
def test_a_parameter_cannot_have_the_name_of_another_variable(mechanisms, name):
    """The variables of all kinds of FMUs of the mechanism are checked."""
    guide = mechanisms["PRBDM2R"]
    named = replace(
        guide, geometry=(*guide.geometry, prbm.mechanism.parameters.Parameter(name, 1.0))
    )
    with pytest.raises(
        prbm.base.errors.MechanismError, match=f"have the name {re.escape(name)}: rename"
    ):
        described(Export(named), 3, clock=True)
    harmless = replace(
        guide, geometry=(*guide.geometry, prbm.mechanism.parameters.Parameter("shuttle.depth", 1.0))
    )
    assert {v.name for v in interface(harmless, {})} > {"shuttle.depth", "shuttle.x"}


def test_the_page_draws_a_wall_that_joins_its_line_smoothly(mechanisms):
    """The figure is the cubic: level before t0, and on the dashed line at t0 + T."""
    html = page(mechanisms["PRBDM"], interface(mechanisms["PRBDM"], {}), Experiment())
    assert "Moving walls" in html
    paths = [
        np.array([point.split(",") for point in points.split()], float)
        for points in re.findall(r'points="([^"]*)"', html.partition("Moving walls")[2])
    ]
    wall, line, begin, end = paths
    assert wall[0, 1] == wall[1, 1] == pytest.approx(wall[2, 1], abs=1.0)
    joined = wall[wall[:, 0] == end[0, 0]]
    slope = (line[1] - line[0])[1] / (line[1] - line[0])[0]
    assert joined[0, 1] == pytest.approx(line[0, 1] + slope * (end - begin)[0, 0], abs=0.1)
    assert (wall[-1] == line[-1]).all()


@each_shipped
def test_the_page_names_every_variable_and_the_limits(mechanisms, model):
    listed = interface(mechanisms[model], {})
    html = page(mechanisms[model], listed, Experiment())
    for v in listed:
        assert f"<code>{v.name}</code>" in html
    for limit in (
        "no duration",
        "Stronge",
        "NumPy",
        "percent-encoded",
        "includes the wall",
    ):
        assert limit in html
    kinds = {kind.model for kind in mechanisms[model].flexure_types}
    if kinds:
        assert ("Beams: the bending moment" if kinds == {"beam"} else "End moments") in html
    assert ("chaotic" in html) == ("2R" in kinds)


@each_shipped
def test_an_fmu_contains_documentation_icon_and_licences_but_no_bytecode(fmus, model):
    with zipfile.ZipFile(fmus[model]) as archive:
        names = archive.namelist()
        assert (
            archive.read("documentation/licenses/prbm-impact.txt")
            == (ROOT / "LICENSE").read_bytes()
        )
        bundled = archive.read("documentation/licenses/pythonfmu.txt").decode()
        assert archive.read("model.png").startswith(b"\x89PNG")
        assert archive.read("documentation/icon.svg").endswith(b"</svg>\n")
    installed = importlib.metadata.distribution("pythonfmu")
    license_file = next(f for f in installed.files if f.name == "LICENSE")
    assert bundled.split() == license_file.read_text(encoding="utf-8").split()
    assert "documentation/index.html" in names
    assert not [name for name in names if "pyc" in name]


def test_bundled_modules_import_only_numpy_scipy_and_the_standard_library(fmus):
    allowed = {"numpy", "scipy", "pythonfmu"} | sys.stdlib_module_names
    with zipfile.ZipFile(fmus["PRBDM"]) as archive:
        bundled = [n for n in archive.namelist() if n.endswith(".py") and "/prbm_" in n]
        for name in bundled:
            for node in ast.walk(ast.parse(archive.read(name))):
                imported = []
                if isinstance(node, ast.Import):
                    imported = [alias.name for alias in node.names]
                elif isinstance(node, ast.ImportFrom) and node.level == 0:
                    imported = [node.module]
                assert {module.partition(".")[0] for module in imported} <= allowed, name
    assert len(bundled) > 10


LOADED = """
import pathlib, sys
sys.path[:] = [path for path in sys.path if "prbm" not in path and "fmu_src" not in path]
sys.path.insert(0, sys.argv[1])
__import__(pathlib.Path(sys.argv[1], "slavemodule.txt").read_text())
for name, module in sys.modules.items():
    if name.partition("_")[0].partition(".")[0] == "prbm":
        print(module.__file__)
"""


@pytest.mark.slow
def test_an_fmu_contains_exactly_the_modules_that_it_imports(fmus, tmp_path):
    with zipfile.ZipFile(fmus["PRBDM2R"]) as archive:
        archive.extractall(tmp_path)
    resources = tmp_path / "resources"
    done = subprocess.run(
        [sys.executable, "-I", "-B", "-c", LOADED, str(resources)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    loaded = {Path(line) for line in done.stdout.splitlines()}
    (package,) = (path for path in resources.iterdir() if path.name.startswith("prbm_"))
    assert loaded == {*package.rglob("*.py")}
    engine = {"base", "mechanism", "mechanics", "hybrid", "fmu"}
    assert {path.name for path in package.iterdir() if path.is_dir()} == engine
    assert {path.name for path in (package / "fmu").iterdir() if path.is_dir()} == {"slave"}
