"""FMUs of mechanisms with guides: interface, co-simulation, model exchange."""

from dataclasses import replace

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_motion import KINDS, Motion
from guides import cart
from prbm.mechanism.parts import Stop
from support import own_fmu

STARTS = {"left.stiffness": 350.0, "tray.mass": 0.25}
OUTPUTS = (
    "cart.x", "tray.x", "tray.y", "rail.force", "rail.moment", "ramp.force", "ramp.moment",
    "base.force.y", "energy.kinetic", "wall.impact_count",
)  # fmt: skip


def walled():
    """Return the cart with a wall for its tray."""
    stop = Stop("wall", "tray", (0.0, 0.06), 180.0, 0.03, restitution=0.6)
    return replace(cart(), stops=(stop,))


MOTION = Motion(walled(), STARTS, OUTPUTS, 0.2)


@pytest.fixture(scope="module", params=KINDS)
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("guides") / "Cart.fmu"
    path.write_bytes(own_fmu(request.param, walled()))
    return path


def test_reactions_of_guides_are_outputs(fmu):
    assert validate_fmu(str(fmu)) == []
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    for name, unit in (("rail.force", "N"), ("rail.moment", "N.m"), ("ramp.force", "N")):
        assert (listed[name].causality, listed[name].unit) == ("output", unit)
    assert "on tray.c, positive to the left of" in listed["ramp.force"].description


def test_the_fmu_equals_the_engine_with_other_start_values(fmu):
    assert MOTION.expected[-1]["wall.impact_count"] > 0
    MOTION.check_co_simulation(fmu)


def test_model_exchange_equals_co_simulation(fmu):
    MOTION.check_model_exchange(fmu)
