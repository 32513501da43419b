"""Reference results of FMUs: the manifest, the experiments, and their comparison with the FMU."""

import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description
from lxml import etree

from compliant_pivot import two_compliant_stops
from fmu_host import simulate_fmu
from prbm.base.errors import SimulationError
from prbm.files.settings import units_of
from prbm.fmu import native_fmu
from prbm.fmu import reference_results as reference
from prbm.fmu.parameter_sets import read_parameter_set
from prbm.fmu.related import FOLDER, NAMESPACE
from prbm.fmu.start import interface
from prbm.hybrid.simulation import Simulation
from prbm.runs.experiment import Experiment
from reference_check import (
    DAMPED,
    EXCHANGE_RTOL,
    EXPERIMENT_NAMES,
    EXPERIMENTS,
    compared,
    exchange_tolerance,
    file_of,
    member,
    rows_of,
    start_values,
)
from support import COSTLY_MODELS, GUIDES, mechanism, selected

SCHEMAS = Path(fmpy.__file__).parent / "schema"
pytestmark = [pytest.mark.fmu, pytest.mark.native]


each_quick = pytest.mark.parametrize("model", selected(lambda name: name not in COSTLY_MODELS))


def in_cosimulation(fmu: Path, model: str, experiment: str, folder: Path) -> None:
    """Compare an experiment in co-simulation; event mode, where it exists, has all rows."""
    expected = rows_of(member(fmu, file_of(model, experiment)))
    version = read_model_description(str(fmu)).fmiVersion
    events = version.startswith("3") and experiment == "validation"
    found = simulate_fmu(
        str(fmu), stop_time=expected["time"][-1], output_interval=expected["time"][1],
        start_values=start_values(fmu, model, experiment, folder),
        output=expected.dtype.names[1:], use_event_mode=events, early_return_allowed=events,
    )  # fmt: skip
    doubled = int((np.diff(expected["time"]) == 0.0).sum())
    if model in GUIDES and experiment == "validation":
        assert doubled >= 3
    assert compared(fmu, expected, found) == len(expected) - (0 if events else 2 * doubled)


def in_model_exchange(fmu: Path, model: str, experiment: str, folder: Path) -> int:
    """Compare an experiment in model exchange as README.txt describes."""
    expected = rows_of(member(fmu, file_of(model, experiment)))
    found = simulate_fmu(
        str(fmu), fmi_type="ModelExchange", relative_tolerance=exchange_tolerance(fmu),
        output=expected.dtype.names[1:], stop_time=expected["time"][-1],
        output_interval=expected["time"][1],
        start_values=start_values(fmu, model, experiment, folder),
    )  # fmt: skip
    return compared(fmu, expected, found, EXCHANGE_RTOL)


@EXPERIMENTS
@each_quick
@pytest.mark.parametrize("fmi", [2, 3])
def test_cosimulation_reproduces_each_experiment(native, model, fmi, experiment, tmp_path):
    in_cosimulation(native[model, fmi], model, experiment, tmp_path)


@EXPERIMENTS
@each_quick
@pytest.mark.parametrize("fmi", [2, 3])
def test_model_exchange_reproduces_each_experiment(native, model, fmi, experiment, tmp_path):
    assert in_model_exchange(native[model, fmi], model, experiment, tmp_path) > 10


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("model", COSTLY_MODELS)
def test_costly_mechanisms_reproduce_each_experiment(model, fmi, tmp_path):
    """The FMUs of other tests lack their reference results, which take the engine minutes."""
    fmu = tmp_path / f"{model}.fmu"
    fmu.write_bytes(native_fmu.build(mechanism(model), {}, fmi))
    for experiment in EXPERIMENT_NAMES:
        in_cosimulation(fmu, model, experiment, tmp_path)
        assert in_model_exchange(fmu, model, experiment, tmp_path) > 10


@pytest.fixture(scope="module")
def pivots(tmp_path_factory) -> dict[int, Path]:
    """Return the FMUs of a pivot between two compliant stops, with outputs of the stress."""
    folder = tmp_path_factory.mktemp("pivots")
    own = two_compliant_stops()
    for fmi in (2, 3):
        (folder / f"{own.name}{fmi}.fmu").write_bytes(native_fmu.build(own, DAMPED, fmi))
    return {fmi: folder / f"{own.name}{fmi}.fmu" for fmi in (2, 3)}


@pytest.mark.slow
@EXPERIMENTS
@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize("fmi", [2, 3])
def test_fmus_with_two_compliant_stops_reproduce_forces_and_stresses(
    pivots, fmi, kind, experiment, tmp_path
):
    """The second stop is pressed at release; contacts take a tenth of a communication step."""
    fmu = pivots[fmi]
    if kind == "ModelExchange":
        assert in_model_exchange(fmu, "TwoCompliant", experiment, tmp_path) > 10
        return
    names = rows_of(member(fmu, file_of("TwoCompliant", experiment))).dtype.names
    assert {"upper.peak_force", "lower.indentation", "rising.peak_stress"} <= {*names}
    in_cosimulation(fmu, "TwoCompliant", experiment, tmp_path)


@pytest.mark.slow
def test_the_text_says_that_model_exchange_samples_the_peak_of_the_stress(pivots, native):
    text = member(pivots[3], "README.txt").decode()
    assert "peak_stress is sampled at the steps that your tool completes" in text
    assert "a twentieth of the period" in text
    assert "peak_stress" not in member(native["PRBDM", 3], "README.txt").decode()


@pytest.mark.slow
def test_the_python_fmu_reproduces_the_default_experiment_of_the_native_one(fmus, native):
    expected = rows_of(member(native["PRBDM", 2], "PRBDM_out.csv"))
    found = simulate_fmu(
        str(fmus["PRBDM"]), output=expected.dtype.names[1:], output_interval=1e-3, stop_time=1.0
    )
    assert compared(fmus["PRBDM"], expected, found) == 1001


def test_both_rows_of_an_impact_obey_the_law_of_the_impact():
    """The gap rate is reversed with the restitution, and the energy falls by ``energy_lost``."""
    outputs = ("stop.gap", "stop.gap_rate", "energy.dissipated", "stop.energy_lost", "shuttle.x")
    motion = Simulation(mechanism("PRBDM"))
    rows = np.array([*reference.rows_with_impacts(motion, np.arange(201) * 1e-3, outputs)])
    first = np.flatnonzero(np.diff(rows[:, 0]) == 0.0)
    assert len(first) == 4
    before, after = rows[first], rows[first + 1]
    np.testing.assert_allclose(after[:, 2], -0.6 * before[:, 2], rtol=1e-9)
    np.testing.assert_allclose(after[:, 3] - before[:, 3], after[:, 4], rtol=1e-7)
    np.testing.assert_allclose(after[:, 5], before[:, 5], atol=1e-13)
    np.testing.assert_allclose(before[:, 1], 0.0, atol=1e-12)
    others = np.delete(rows, np.concatenate([first, first + 1]), axis=0)
    np.testing.assert_allclose(others[:, 0], np.arange(201) * 1e-3, rtol=1e-12)


@pytest.mark.parametrize("kind", ["python", 2, 3])
def test_the_manifest_lists_the_files_of_the_layered_standard(native, fmus, kind):
    fmu = fmus["PRBDM"] if kind == "python" else native["PRBDM", kind]
    with zipfile.ZipFile(fmu) as archive:
        inside = {n.removeprefix(f"{FOLDER}/") for n in archive.namelist() if FOLDER in n}
    root = etree.fromstring(member(fmu, "fmi-ls-manifest.xml"))
    assert root.tag == "fmiReferences"
    listed = {related.get("source"): related.get("role") for related in root}
    assert listed.keys() == inside - {"fmi-ls-manifest.xml"}
    results = {
        "README.txt": "document", "PRBDM_out.csv": "result", "PRBDM_smoke_out.csv": "result",
        "PRBDM_validation.ssv": "parameter", "PRBDM_validation_out.csv": "result",
    }  # fmt: skip
    assert listed == {"PRBDM.ssv": "parameter"} | ({} if kind == "python" else results)
    for related in root:
        root.remove(related)
    root.tag, root.text = f"{{{NAMESPACE}}}fmiLayeredStandardManifest", None
    checker = etree.XMLSchema(file=str(SCHEMAS / "fmi3" / "fmi3LayeredStandardManifest.xsd"))
    assert checker.validate(root), checker.error_log


@pytest.mark.slow
def test_the_set_of_the_validation_contains_all_changed_inputs(tmp_path):
    """Changed inputs are start values of the validation, too."""
    small, changes = mechanism("PRBDM"), {"force.x": 0.02, "stop.restitution": 0.5}
    found = reference.reference(small, changes, interface(small, changes), Experiment(0.1))
    path = tmp_path / "x.ssv"
    path.write_bytes(next(x.content for x in found if x.file == "PRBDM_validation.ssv"))
    values = read_parameter_set(path, units_of(small))
    assert values["force.x"] == 0.02
    assert values["stop.restitution"] == 0.45
    assert values["base.acceleration.x"] > 0.0


@pytest.mark.slow
def test_a_validation_that_fails_is_left_out(monkeypatch):
    def fails(*_: object) -> None:
        raise SimulationError("too many impacts")

    monkeypatch.setattr(reference, "rows_with_impacts", fails)
    small = mechanism("PRBDM")
    found = reference.reference(small, {"stop.offset": 2e-3}, interface(small, {}), Experiment(0.1))
    assert [one.file for one in found] == ["README.txt", "PRBDM_out.csv", "PRBDM_smoke_out.csv"]
    assert b"validation" not in found[0].content


def test_the_text_states_the_experiments_of_the_default_experiment(native):
    text = member(native["PRBDM", 3], "README.txt").decode()
    assert max(map(len, text.splitlines())) <= 100
    assert "PRBDM_smoke_out.csv: start values of the FMU, 0 to 0.01 s" in text
    assert "start values in PRBDM_validation.ssv, 0 to 0.2 s" in text
    experiment = read_model_description(str(native["PRBDM", 3])).defaultExperiment
    assert f"Rows are {float(experiment.stepSize):g} s apart" in text
