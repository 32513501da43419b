"""Coordinates that a mechanism names as its states in model exchange."""

import math
from dataclasses import replace

import pytest

from exchange import integrate
from guides import slider_crank, slotted_arm
from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import MechanismError
from prbm.mechanics.assembly import assemble
from prbm.mechanics.independent import independent


def names(model):
    variables = assemble(model, model.values()).variables
    return {variables[j][0] for j in independent(model)}


def test_named_coordinates_are_chosen_and_the_others_completed():
    assert names(replace(slider_crank(60.0), states=("rod.angle",))) == {"rod.angle"}
    assert names(replace(slotted_arm(), states=("pin.y",))) > {"pin.y"}
    assert len(names(replace(slotted_arm(), states=("pin.y",)))) == 3


@pytest.mark.parametrize(
    ("states", "message"),
    [
        (("crank.omega",), "states: 'crank.omega' is unknown|states: .*crank.omega"),
        (("crank.angle", "crank.angle"), "crank.angle is named twice"),
        (("crank.angle", "rod.angle"), "do not determine the others"),
        (("slider.angle",), "do not determine the others"),
    ],
)
def test_names_that_are_no_independent_coordinates_are_rejected(states, message):
    with pytest.raises(MechanismError, match=message):
        independent(replace(slider_crank(), states=states))


@pytest.mark.parametrize("states", ["crank.angle", (3,), None])
def test_states_are_texts(states):
    with pytest.raises(MechanismError, match=r"states = .* must be coordinates as texts"):
        replace(slider_crank(), states=states)


@pytest.mark.slow
@pytest.mark.native
def test_a_pin_in_a_turning_slot_makes_full_turns_with_its_place_as_states():
    """Without the names, the angle of the arm determines the pin, which fails at a right angle."""
    model = slotted_arm(velocity=2.0)
    with pytest.raises(KernelMistake, match="do not determine the other coordinates"):
        [*integrate(KernelSimulation(model, {}, exchange=True), 0.5, h=2.0**-11)]
    named = replace(model, states=("pin.x", "pin.y", "pin.angle"))
    exchange, direct = KernelSimulation(named, {}, exchange=True), KernelSimulation(model)
    assert not [*integrate(exchange, 0.5, h=2.0**-13)]
    direct.advance(0.5)
    for name in ("pin.x", "pin.y", "arm.omega"):
        assert exchange.get(name) == pytest.approx(direct.get(name), rel=1e-6, abs=1e-8)
    assert abs(direct.get("arm.angle")) > 0.5 * math.pi
