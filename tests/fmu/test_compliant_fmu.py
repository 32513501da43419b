"""FMUs of a mechanism with a compliant stop: Python FMUs equal the engine."""

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

from point_mass import point_mass
from prbm.base.errors import MechanismError
from prbm.fmu import native_fmu, python_fmu
from prbm.hybrid.simulation import Simulation

END, STEP = 2e-3, 5e-5
OUTPUTS = (
    "mass.x", "stop.force", "stop.contact", "stop.impact_count", "stop.peak_force",
    "stop.indentation", "stop.contact_duration", "stop.impulse_sum", "energy.elastic",
)  # fmt: skip


def mass():
    return point_mass(stiffness=1e5, restitution=0.5)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("compliant") / "PointMass.fmu"
    path.write_bytes(python_fmu.build(mass(), {}))
    return str(path)


@pytest.mark.fmu
def test_a_python_fmu_of_a_compliant_stop_simulates_like_the_engine(path):
    assert not validate_fmu(path)
    found = simulate_fmu(path, stop_time=END, output_interval=STEP, output=list(OUTPUTS))
    sim = Simulation(mass())
    for k in range(round(END / STEP) + 1):
        sim.advance(k * STEP)
        out = sim.outputs()
        row = [float(found[name][k]) for name in OUTPUTS]
        np.testing.assert_allclose(row, [out[name] for name in OUTPUTS], rtol=1e-9, atol=1e-12)
    assert out["stop.impact_count"] == 1
    assert out["stop.contact_duration"] > 0.0


@pytest.mark.fmu
def test_parameters_and_outputs_of_a_compliant_stop_have_their_units(path):
    found = {v.name: v for v in read_model_description(path).modelVariables}
    units = {name: found[f"stop.{name}"].unit for name in (
        "stiffness", "restitution", "force", "peak_force", "indentation", "contact_duration"
    )}  # fmt: skip
    assert list(units.values()) == ["N/m", "1", "N", "N", "m", "s"]
    assert found["stop.stiffness"].variability == "fixed"
    assert found["stop.restitution"].min == "0.01"
    assert found["stop.contact_duration"].variability == "discrete"


@pytest.mark.fmu
def test_a_state_saved_in_contact_restores_in_a_python_fmu(path, tmp_path):
    description = read_model_description(path)
    folder = fmpy.extract(path, unzipdir=str(tmp_path))
    fmu = fmpy.instantiate_fmu(folder, description)
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    references = [v.valueReference for v in description.modelVariables if v.name in (
        "mass.x", "stop.force", "stop.peak_force", "stop.impulse_sum"
    )]  # fmt: skip
    fmu.doStep(0.0, 1.1e-3)
    state, ends = fmu.getFMUState(), []
    for _ in range(2):
        fmu.doStep(1.1e-3, 1e-3)
        ends.append(fmu.getReal(references))
        fmu.setFMUState(state)
    assert ends[0] == ends[1]
    fmu.terminate()
    fmu.freeInstance()


@pytest.mark.parametrize("version", [2, 3])
def test_a_native_fmu_of_a_compliant_stop_is_rejected(version):
    with pytest.raises(MechanismError, match="a native FMU has rigid impacts only"):
        native_fmu.build(mass(), {}, version)
