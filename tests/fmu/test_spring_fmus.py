"""FMUs of mechanisms with springs: interface, co-simulation, model exchange, start values."""

from dataclasses import replace

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_motion import Motion
from prbm.mechanism.parts import Stop
from springs import one_sided
from support import own_fmu

STARTS = {"two.stiffness": 90.0, "one.free_length": 0.09, "three.cubic_stiffness": 2e4}
OUTPUTS = (
    "plate.x", "ring.angle", "one.force", "two.length", "four.length_rate", "energy.elastic",
    "energy.dissipated", "wall.impact_count",
)  # fmt: skip


BOTH = ("both",) * 5
MIXED = ("tension", "compression", "tension", "both", "compression")
KINDS = [
    *(("fmi3", BOTH), ("fmi3", MIXED), ("fmi2", MIXED)),
    *(pytest.param(x, marks=pytest.mark.slow) for x in (("fmi2", BOTH), ("python", BOTH))),
    pytest.param(("python", MIXED), marks=pytest.mark.slow),
]


def walled(sides):
    """Return the web of springs with a wall."""
    stop = Stop("wall", "plate", (-0.04, 0.0), 180.0, 4e-3, restitution=0.6)
    return replace(one_sided(sides), stops=(stop,))


@pytest.fixture(scope="module", params=KINDS, ids=lambda x: f"{x[0]}-{x[1][0]}")
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def fmu(kind, tmp_path_factory):
    path = tmp_path_factory.mktemp("springs") / "Web.fmu"
    path.write_bytes(own_fmu(kind[0], walled(kind[1])))
    return path


@pytest.fixture(scope="module")
def motion(kind):
    return Motion(walled(kind[1]), STARTS, OUTPUTS, 0.2)


def test_springs_are_parameters_and_outputs(fmu):
    assert validate_fmu(str(fmu)) == []
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    for name, unit in (
        ("one.stiffness", "N/m"), ("one.free_length", "m"), ("one.cubic_stiffness", "N/m3"),
        ("one.damping", "N.s/m"),
    ):  # fmt: skip
        assert (listed[name].causality, listed[name].unit) == ("parameter", unit)
    assert "two.free_length" not in listed
    for name, unit in (("one.force", "N"), ("one.length", "m"), ("one.length_rate", "m/s")):
        assert (listed[name].causality, listed[name].unit) == ("output", unit)
    assert listed["one.length_rate"].derivative is listed["one.length"]
    assert "between ground.left and plate.a" in listed["one.force"].description


def test_one_sided_springs_have_event_indicators(kind, fmu):
    """There are three of the wall and one of each spring, and as many variables."""
    description = read_model_description(str(fmu))
    if description.modelExchange is None:
        pytest.skip("co-simulation only")
    names = [v.name for v in description.modelVariables if v.name.endswith("_indicator")]
    assert description.numberOfEventIndicators == len(names) == 3 + 5 - kind[1].count("both")


def test_the_fmu_equals_the_engine_with_other_start_values(fmu, motion):
    assert motion.expected[-1]["wall.impact_count"] > 0
    motion.check_co_simulation(fmu)


def test_model_exchange_equals_co_simulation(fmu, motion):
    motion.check_model_exchange(fmu)
