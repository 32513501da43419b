"""FMUs of mechanisms whose bodies have positions and velocities at the start."""

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from free_bodies import double_pendulum
from prbm.hybrid.simulation import Simulation
from support import own_fmu

END, STEP = 0.4, 4e-3
STARTS = {"upper.start_angle": 0.6, "lower.start_angle": -1.1, "lower.start_vx": 0.4}
OUTPUTS = ("upper.angle", "lower.x", "lower.omega", "energy.kinetic", "energy.gravitational")


def model():
    """Return a double pendulum with values at the start."""
    return double_pendulum({"start_angle": 0.2}, {"start_angle": 0.1, "start_vx": 0.0})


@pytest.fixture(
    scope="module",
    params=["fmi3", *(pytest.param(x, marks=pytest.mark.slow) for x in ("fmi2", "python"))],
)
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("starts") / "Ball.fmu"
    path.write_bytes(own_fmu(request.param, model()))
    return path


@pytest.fixture(scope="module")
def expected():
    simulation, rows = Simulation(model(), STARTS), []
    for k in range(round(END / STEP) + 1):
        simulation.advance(k * STEP)
        rows.append(simulation.outputs())
    return rows


def test_values_at_the_start_are_parameters(fmu):
    assert validate_fmu(str(fmu)) == []
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    for name, unit in (("upper.start_angle", "rad"), ("lower.start_vx", "m/s")):
        assert (listed[name].causality, listed[name].unit) == ("parameter", unit)
    assert "upper.start_x" not in listed


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_the_fmu_equals_the_engine_with_other_start_values(fmu, expected, kind):
    if kind == "ModelExchange" and read_model_description(str(fmu)).modelExchange is None:
        pytest.skip("co-simulation only")
    result = simulate_fmu(
        str(fmu), fmi_type=kind, stop_time=END, output_interval=STEP, output=OUTPUTS,
        start_values=STARTS, relative_tolerance=1e-9,
    )  # fmt: skip
    for name in OUTPUTS:
        wanted = np.array([row[name] for row in expected])
        difference = np.abs(result[name][[0, -1]] - wanted[[0, -1]]).max()
        assert difference <= 1e-5 * max(1.0, np.abs(wanted).max()), name
