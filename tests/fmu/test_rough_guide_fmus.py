"""FMUs of mechanisms with friction along guides: interface, co-simulation, model exchange."""

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_motion import KINDS, Motion
from guides import rough, slider_crank
from support import own_fmu

MODEL = rough(slider_crank(), 0.1)
OUTPUTS = (
    "crank.angle", "slider.x", "crank.omega", "way.force", "base.moment", "energy.dissipated",
)  # fmt: skip
MOTION = Motion(MODEL, {"way.friction": 0.2}, OUTPUTS, 0.4)


@pytest.fixture(scope="module", params=KINDS)
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("rough") / "SliderCrank.fmu"
    path.write_bytes(own_fmu(request.param, MODEL))
    return path


def test_the_coefficient_is_a_parameter_with_a_unit_of_one(fmu):
    assert validate_fmu(str(fmu)) == []
    description = read_model_description(str(fmu))
    listed = {v.name: v for v in description.modelVariables}
    friction = listed["way.friction"]
    assert (friction.causality, friction.variability) == ("parameter", "tunable")
    assert {"way.slip_indicator", "way.side_indicator"} <= listed.keys() or not (
        description.modelExchange
    )


def test_the_fmu_equals_the_engine_with_another_coefficient(fmu):
    MOTION.check_co_simulation(fmu)


def test_model_exchange_locates_stick_slip_and_changes_of_side(fmu):
    MOTION.check_model_exchange(fmu)
