"""FMUs of mechanisms with torsion at joints: interface, co-simulation, model exchange."""

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_motion import KINDS, Motion
from springs import four_bar
from support import own_fmu

MODEL = four_bar(stiffness=0.04, free_angle=0.3, damping=1e-4)
STARTS = {"third.stiffness": 0.06, "third.free_angle": -0.4, "third.damping": 3e-4}
OUTPUTS = (
    "ab.angle", "bc.x", "cd.omega", "base.moment", "energy.elastic", "energy.dissipated",
    "mode.frequency",
)  # fmt: skip
MOTION = Motion(MODEL, STARTS, OUTPUTS, 0.4)


@pytest.fixture(scope="module", params=KINDS)
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("torsion") / "FourBar.fmu"
    path.write_bytes(own_fmu(request.param, MODEL))
    return path


def test_torsion_has_parameters_as_far_as_it_is_given(fmu):
    assert validate_fmu(str(fmu)) == []
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    for name, unit in (
        ("third.stiffness", "N.m/rad"), ("third.free_angle", "rad"), ("third.damping", "N.m.s/rad"),
    ):  # fmt: skip
        assert (listed[name].causality, listed[name].unit) == ("parameter", unit)
    assert "first.free_angle" not in listed
    assert "second.stiffness" not in listed


def test_the_fmu_equals_the_engine_with_other_start_values(fmu):
    MOTION.check_co_simulation(fmu)


def test_model_exchange_equals_co_simulation(fmu):
    MOTION.check_model_exchange(fmu)
