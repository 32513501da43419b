"""FMUs of mechanisms whose bodies have positions and velocities at the start."""

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_motion import KINDS, Motion
from free_bodies import double_pendulum
from support import own_fmu

MODEL = double_pendulum({"start_angle": 0.2}, {"start_angle": 0.1, "start_vx": 0.0})
STARTS = {"upper.start_angle": 0.6, "lower.start_angle": -1.1, "lower.start_vx": 0.4}
OUTPUTS = ("upper.angle", "lower.x", "lower.omega", "energy.kinetic", "energy.gravitational")
MOTION = Motion(MODEL, STARTS, OUTPUTS, 0.4)


@pytest.fixture(scope="module", params=KINDS)
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("starts") / "Ball.fmu"
    path.write_bytes(own_fmu(request.param, MODEL))
    return path


def test_values_at_the_start_are_parameters(fmu):
    assert validate_fmu(str(fmu)) == []
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    for name, unit in (("upper.start_angle", "rad"), ("lower.start_vx", "m/s")):
        assert (listed[name].causality, listed[name].unit) == ("parameter", unit)
    assert "upper.start_x" not in listed


def test_the_fmu_equals_the_engine_with_other_start_values(fmu):
    MOTION.check_co_simulation(fmu)


def test_model_exchange_equals_co_simulation(fmu):
    MOTION.check_model_exchange(fmu)
