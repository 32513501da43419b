"""SSP packages and containers: valid by the standard's schemas, equal results in all masters."""

import hashlib
import os
import re
import tempfile
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from lxml import etree

from coupled import guide, integrator, relay
from package_meaning import Meaning
from prbm.base.errors import PrbmError
from prbm.systems import cosimulation, ssp
from prbm.systems.components import CouplingError, described
from prbm.systems.container import _common_platforms, container
from prbm.systems.cosimulation import JACOBI
from prbm.systems.structure import Package
from random_packages import fmu_without_binary

pytestmark = [
    pytest.mark.fmu, pytest.mark.native, pytest.mark.usefixtures("plain_temporary_folder")
]  # fmt: skip

SCHEMAS = Path(fmpy.__file__).parent / "ssp" / "schema"
STOP, STEP = 0.3, 1e-3
WIRES = {
    "follower.stop.displacement": "carrier.shuttle.x",
    "follower.stop.velocity": "carrier.shuttle.vx",
    "sum.rate": "carrier.shuttle.vx",
    "carrier.force.x": "sum.value",
}
VALUES = {
    "carrier.release.displacement": 0.0, "carrier.stop.position": 0.05,
    "follower.release.displacement": -5e-3, "follower.stop.position": 1e-3,
    "follower.stop.restitution": 0.8, "sum.gain": -4.0, "sum.skipped": 3, "sum.off": False,
}  # fmt: skip
"""Connected outputs are zero at the start, since FMPy's master starts with zero inputs."""


def fmus(fmi: int = 2) -> dict[str, Path]:
    """Return an integrator, a guide as carrier, and a guide whose stop is on the carrier.

    The integrator is the law of a spring on the carrier.
    """
    return {"sum": integrator(), "carrier": guide(fmi), "follower": guide(fmi)}


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ssp") / "walls.ssp"
    ssp.package(path, fmus(), WIRES, VALUES, STOP, "Walls")
    return path


@pytest.fixture(scope="module")
def ours() -> np.ndarray:
    watched = ["follower.stop.impact_count", "follower.shuttle.x"]
    return cosimulation.simulate(fmus(), WIRES, STOP, STEP, VALUES, watched, JACOBI)


def test_the_description_of_a_package_is_valid(package):
    """The system structure and the parameter sets match the schemas of SSP 1.0."""
    with zipfile.ZipFile(package) as archive:
        root = etree.fromstring(archive.read("SystemStructure.ssd"))
    etree.XMLSchema(etree.parse(SCHEMAS / "SystemStructureDescription.xsd")).assertValid(
        etree.ElementTree(root)
    )
    schema = etree.XMLSchema(etree.parse(SCHEMAS / "SystemStructureParameterValues.xsd"))
    sets = root.findall(f".//{{{ssp.SSV}}}ParameterSet")
    assert len(sets) == 3
    for parameters in sets:
        schema.assertValid(etree.ElementTree(parameters))
    names = [
        f"{x.get('name')}.{p.get('name')}" for x in sets for p in x.iter(f"{{{ssp.SSV}}}Parameter")
    ]
    assert sorted(names) == sorted(VALUES)


def test_a_package_may_contain_a_single_fmu(tmp_path):
    """Inputs and outputs have connectors; there are no empty lists, which the schema forbids."""
    path = tmp_path / "one.ssp"
    ssp.package(path, {"guide": guide(2)}, {})
    found = ssp.simulate(path, 0.01, 1e-3)
    assert len(found) == 11
    assert "guide.shuttle.x" in found.dtype.names


def test_a_package_that_cannot_be_written_leaves_the_old_file(tmp_path, monkeypatch):
    def fails(*_: object) -> None:
        raise OSError(28, "No space left on device")

    path = tmp_path / "one.ssp"
    path.write_bytes(b"old")
    monkeypatch.setattr(os, "fsync", fails)
    with pytest.raises(OSError, match="No space"):
        ssp.package(path, {"guide": guide(2)}, {})
    assert path.read_bytes() == b"old"
    assert [*tmp_path.iterdir()] == [path]


def damaged(path: Path) -> Path:
    """Return an FMU with a description that can be read, and a file with a wrong checksum."""
    content = bytearray(guide(2).read_bytes())
    with zipfile.ZipFile(guide(2)) as archive:
        entry = archive.getinfo("model.png")
    content[entry.header_offset + 30 + len(entry.filename) + entry.compress_size // 2] ^= 0xFF
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("kind", ["package", "system", "container"])
def test_a_rejected_system_leaves_no_temporary_folder(tmp_path, monkeypatch, kind):
    bad, folder = {"a": damaged(tmp_path / "bad.fmu")}, tmp_path / "temporary"
    ssp.package(tmp_path / "bad.ssp", bad, {}, stop_time=STOP)
    rejected = {
        "package": lambda: ssp.simulate(tmp_path / "bad.ssp"),
        "system": lambda: cosimulation.simulate(bad, {}, STOP, STEP),
        "container": lambda: container(tmp_path / "bad-container.fmu", bad, {}, STEP),
    }
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    with pytest.raises(CouplingError, match=r"Bad CRC-32 .* 'model\.png'"):
        rejected[kind]()
    assert [*folder.iterdir()] == []


def test_the_name_of_an_instance_in_a_container_is_no_path(tmp_path):
    with pytest.raises(CouplingError, match=r"'\.\./a': must be non-empty and without \. /"):
        container(tmp_path / "c.fmu", {"../a": guide(2)}, {}, STEP)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"fmus": {}}, "at least one FMU"),
        ({"fmus": {"a.b": "x.fmu"}}, "'a.b': must be non-empty and without"),
        ({"fmus": {"..": "x.fmu"}}, "'..': must be non-empty and without"),
        ({"step": 0.0}, "step = 0 s must be positive and finite"),
        ({"step": np.nan}, "step = nan s must be positive and finite"),
        ({"stop_time": np.inf}, "stop_time = inf s must be positive and finite"),
        ({"fmi": 1}, "fmi = 1 must be 2 or 3"),
        ({"values": {"sum.gain": np.inf}}, "sum.gain = inf must be finite in a container"),
        ({"values": {"sum.rate": 1.0}}, "sum.rate takes sum.value, so its value has no effect"),
        ({"shown": ["sum.rate"]}, "sum.rate takes sum.value, so its value has no effect"),
    ],
)
def test_a_container_that_would_be_invalid_is_refused(changes, words, tmp_path):
    given = {"fmus": {"sum": integrator()}, "connections": {"sum.rate": "sum.value"}, "step": 1e-3}
    with pytest.raises(PrbmError, match=re.escape(words)):
        container(tmp_path / "x.fmu", **given | changes)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"fmus": {"a.b": "x.fmu"}}, "'a.b': must be non-empty and without"),
        ({"fmus": {"a/b": "x.fmu"}}, "'a/b': must be non-empty and without"),
        ({"stop_time": np.inf}, "stop_time = inf s must be positive and finite"),
        ({"values": {"a.Real": np.inf}}, "a.Real = inf must be finite in a package"),
        ({"values": {"a.Integer": 2**31}}, "a.Integer = 2147483648 must be in"),
        ({"connections": {"a.Boolean": "a.Real_out"}}, "a.Real_out of type Real cannot be connec"),
    ],
)
def test_a_package_that_no_reader_takes_is_refused(changes, words, tmp_path):
    given = {"fmus": {"a": relay()}, "connections": {}}
    with pytest.raises(PrbmError, match=re.escape(words)):
        ssp.package(tmp_path / "x.ssp", **given | changes)
    assert not any(tmp_path.iterdir())


def test_package_contains_the_unchanged_fmus(package):
    with zipfile.ZipFile(package) as archive:
        for name, fmu in fmus().items():
            assert archive.read(f"resources/{name}.fmu") == fmu.read_bytes()


def test_equal_systems_give_equal_bytes(package, tmp_path):
    again = tmp_path / "again.ssp"
    ssp.package(again, fmus(), WIRES, VALUES, STOP, "Walls")
    with zipfile.ZipFile(again) as archive:
        assert {info.date_time for info in archive.infolist()} == {ssp.EPOCH}
    digests = {hashlib.sha256(path.read_bytes()).digest() for path in (package, again)}
    assert len(digests) == 1


def test_a_package_moves_as_its_system(package, ours):
    found = ssp.simulate(package, STOP, STEP)
    assert ours["follower.stop.impact_count"][-1] >= 2
    for name in ("time", *WIRES.values()):
        np.testing.assert_array_equal(found[name], ours[name])


def test_libcosim_runs_the_package_as_our_master_does(package, ours):
    pytest.importorskip("libcosimpy", reason="libcosimpy is not installed (PyPI: libcosimpy)")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_ssp_file(str(package), step_size=round(STEP * 1e9))
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer)
    variables = read_model_description(guide(2)).modelVariables
    reference = next(v.valueReference for v in variables if v.name == "shuttle.x")
    slave = execution.slave_index_from_instance_name("follower")
    rows = []
    for _ in range(round(STOP / STEP)):
        assert execution.step()
        rows += observer.last_real_values(slave, [reference])
    np.testing.assert_allclose(rows, ours["follower.shuttle.x"][1:], rtol=1e-9, atol=1e-12)


def slow(*values):
    return pytest.param(*values, marks=pytest.mark.slow)


@pytest.mark.slow
@pytest.mark.parametrize(("outer", "inner"), [(2, 2), (3, 3), slow(3, 2), slow(2, 3)])
def test_container_moves_as_in_our_master(outer, inner, ours, tmp_path):
    """The container is a valid FMU of either version, with FMUs of either version inside."""
    path = tmp_path / "walls.fmu"
    shown = ["follower.shuttle.x", "follower.stop.impact_count"]
    container(path, fmus(inner), WIRES, STEP, VALUES, shown, outer, STOP)
    description = read_model_description(path, validate=True)
    assert description.fmiVersion == f"{outer}.0"
    assert [x.variable.name for x in description.initialUnknowns] == shown
    with zipfile.ZipFile(path) as archive:  # FMI 2.0 allows this attribute for inputs only.
        assert b"canHandleMultipleSet" not in archive.read("modelDescription.xml")
    variables = {x.name: x for x in description.modelVariables}
    assert variables["follower.shuttle.x"].unit == "m"
    assert {x.name for x in description.unitDefinitions} >= {"m"}
    found = simulate_fmu(path, stop_time=STOP, output_interval=STEP)
    assert set(found.dtype.names) == {"time", *shown}
    np.testing.assert_allclose(
        found["follower.shuttle.x"], ours["follower.shuttle.x"], rtol=1e-9, atol=1e-12
    )
    assert (found["follower.stop.impact_count"] == ours["follower.stop.impact_count"]).all()


@pytest.mark.slow
def test_a_start_value_of_the_container_reaches_the_inner_fmu(ours, tmp_path):
    path = tmp_path / "walls.fmu"
    container(path, fmus(), WIRES, STEP, VALUES, ["follower.stop.impact_count"])
    found = simulate_fmu(
        path, stop_time=STOP, output_interval=STEP, start_values={"follower.stop.position": 1.0}
    )
    assert ours["follower.stop.impact_count"][-1] > 0
    assert not found["follower.stop.impact_count"].any()


@pytest.mark.parametrize(
    ("wires", "values"),
    [
        ({"sum.rate": "unknown.x"}, {}),
        ({"sum.nothing": "carrier.shuttle.x"}, {}),
        ({}, {"carrier.nothing": 1.0}),
        ({}, {"unknown.x": 1.0}),
    ],
)
def test_unknown_names_are_rejected(wires, values, tmp_path):
    sentence = "unknown variable; write INSTANCE.VARIABLE"
    with pytest.raises(CouplingError, match=sentence):
        ssp.package(tmp_path / "x.ssp", fmus(), wires, values)
    with pytest.raises(CouplingError, match=sentence):
        container(tmp_path / "x.fmu", fmus(), wires, 1e-3, values)


@pytest.mark.parametrize(
    ("wires", "values", "sentence"),
    [
        ({"carrier.shuttle.x": "sum.value"}, {}, "carrier.shuttle.x is not an input: connect sum"),
        ({}, {"carrier.shuttle.x": 1.0}, "carrier.shuttle.x = 1.0 cannot be set"),
        ({}, {"carrier.force.x": "1 N"}, "carrier.force.x = '1 N' must be a number"),
    ],
)
def test_wrong_causalities_and_values_are_rejected(wires, values, sentence, tmp_path):
    with pytest.raises(CouplingError, match=sentence):
        ssp.package(tmp_path / "x.ssp", fmus(), wires, values)
    with pytest.raises(CouplingError, match=sentence):
        container(tmp_path / "x.fmu", fmus(), wires, 1e-3, values)
    assert not any(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("number", [np.float32(1.0), np.int64(1), np.bool_(True), True])
def test_every_number_may_be_a_start_value(number, tmp_path):
    """Packages and containers are equal to those with Python's float."""
    found = []
    for value in (1.0, number):
        ssp.package(tmp_path / "x.ssp", fmus(), {}, {"carrier.force.x": value})
        container(tmp_path / "x.fmu", fmus(), {}, 1e-3, {"carrier.force.x": value})
        [shown] = read_model_description(tmp_path / "x.fmu").modelVariables[1:]
        found.append(((tmp_path / "x.ssp").read_bytes(), shown.start))
    assert found[0] == found[1]


@pytest.mark.parametrize("name", ["text.fmu", "missing.fmu"])
def test_an_unreadable_fmu_is_rejected(name, tmp_path):
    (tmp_path / "text.fmu").write_text("no FMU", encoding="utf-8")
    with pytest.raises(CouplingError, match=rf"a: .*{name} cannot be read as an FMU"):
        ssp.package(tmp_path / "x.ssp", {"a": tmp_path / name}, {})
    with pytest.raises(CouplingError, match=rf"a: .*{name} cannot be read as an FMU"):
        container(tmp_path / "x.fmu", {"a": tmp_path / name}, {}, 1e-3)


def test_a_package_connects_only_outputs_to_inputs(tmp_path):
    with pytest.raises(CouplingError, match=r"carrier\.flexure\.length is not an output"):
        ssp.package(tmp_path / "x.ssp", fmus(), {"sum.rate": "carrier.flexure.length"})


def moved(folder, platform):
    """Return a copy of an integrator whose only binary is that of a platform."""
    path = folder / f"{platform}.fmu"
    with zipfile.ZipFile(integrator()) as source, zipfile.ZipFile(path, "w") as copy:
        copy.writestr("modelDescription.xml", source.read("modelDescription.xml"))
        copy.writestr(f"binaries/{platform}/Integrator.dll", b"")
    return path


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_container_has_the_platforms_of_all_its_fmus(fmi, tmp_path):
    path, system = tmp_path / "x.fmu", {"guide": guide(2), "sum": integrator()}
    container(path, system, {}, 1e-3, fmi=fmi)
    with zipfile.ZipFile(path) as archive:
        found = {x.split("/")[1] for x in archive.namelist() if x.startswith("binaries/") and x[9:]}
    assert found == {"linux64" if fmi == 2 else "x86_64-linux"}
    with pytest.raises(CouplingError, match=r"win: .* binaries for win64, none of which"):
        container(path, system | {"win": moved(tmp_path, "win64")}, {}, 1e-3, fmi=fmi)


def test_a_container_has_no_platform_that_an_fmu_may_lack(tmp_path):
    """The folder darwin64 of FMI 2.0 is for x86-64; FMPy has libraries for some platforms only."""
    found = _common_platforms({"mac": moved(tmp_path, "darwin64")})
    assert found == {"x86_64-darwin"}
    with pytest.raises(CouplingError, match="binaries for aarch64-linux, none of which"):
        _common_platforms({"arm": moved(tmp_path, "aarch64-linux")})


def test_texts_and_enumerations_are_written_by_the_schema(tmp_path):
    """The reader of the standard finds the start values and the connection."""
    paths = {}
    for name, kind in (("a", "one"), ("b", "other kind #1")):
        paths[name] = tmp_path / f"{name}.fmu"
        paths[name].write_bytes(fmu_without_binary(kind))
    path, values = tmp_path / "x.ssp", {"a.h": 5, "b.h": 3, "a.s": 'a "b" & <c>'}
    ssp.package(path, paths, {"b.e": "a.g"}, values)
    found = Meaning(path)
    assert found.values == values
    source, function, _ = found.links["b.e"]
    assert (source, [function(x) for x in (1, 2, 5)]) == ("a.g", [3, 7, 1])
    copies = tmp_path / "copies"
    copies.mkdir()
    assert Package(path, copies).flat.values == values
    with pytest.raises(CouplingError, match=r"a\.h = 4 must be one of 1, 2, 5"):
        ssp.package(path, paths, {}, {"a.h": 4})


def test_a_container_refuses_what_its_library_does_not_support(tmp_path, monkeypatch):
    path, system = tmp_path / "x.fmu", {"guide": guide(2), "sum": integrator()}
    with pytest.raises(
        CouplingError, match=r"stop\.contact of type Boolean cannot .* use the master"
    ):
        container(path, system, {"sum.rate": "guide.stop.contact"}, 1e-3)
    assert not path.exists()

    def with_type(name, fmu, kind):
        found = described(name, fmu)
        next(v for v in found.modelVariables if v.name == "value").type = kind
        return found

    for kind, words in (
        ("Clock", "does not support clocks, such as value"),
        ("String", "type String"),
    ):
        monkeypatch.setattr(
            "prbm.systems.container.described", lambda *x, kind=kind: with_type(*x, kind)
        )
        with pytest.raises(CouplingError, match=words):
            container(path, {"sum": integrator()}, {}, 1e-3, shown=["sum.value"])


def test_a_container_needs_co_simulation(tmp_path, monkeypatch):
    def without(name, fmu):
        found = described(name, fmu)
        found.coSimulation = None
        return found

    monkeypatch.setattr("prbm.systems.container.described", without)
    with pytest.raises(CouplingError, match=r"sum: .* has no co-simulation"):
        container(tmp_path / "x.fmu", {"sum": integrator()}, {}, 1e-3, shown=["sum.value"])


def test_a_container_rejects_local_variables(tmp_path):
    with pytest.raises(CouplingError, match=r"link\[1\]\.angle: must be a parameter, an input"):
        container(tmp_path / "x.fmu", fmus(), {}, 1e-3, shown=["carrier.link[1].angle"])


def test_a_file_that_is_not_a_package_is_rejected(tmp_path):
    path = tmp_path / "x.ssp"
    path.write_bytes(b"nothing")
    with pytest.raises(CouplingError, match=r"x\.ssp: cannot be read as a package \(File is not"):
        ssp.simulate(path, 1.0, 0.1)


@pytest.mark.slow
def test_a_package_of_fmi_3_moves_as_that_of_fmi_2(tmp_path):
    found = []
    for fmi in (2, 3):
        path = tmp_path / f"{fmi}.ssp"
        ssp.package(path, {"ab": guide(fmi), "a": guide(fmi)}, {})
        found.append(ssp.simulate(path, 0.01, 1e-3)["a.shuttle.x"])
    np.testing.assert_array_equal(*found)
