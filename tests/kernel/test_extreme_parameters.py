"""Combinations of extreme parameters: both engines run or reject them for the same reason."""

import pytest

from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import ParameterError
from prbm.files.mechanism_file import load
from prbm.hybrid.simulation import Simulation

pytestmark = pytest.mark.native

ENGINES = {"python": Simulation, "kernel": KernelSimulation}


def light(mass: float) -> dict[str, float]:
    return {"oscillator.mass": mass, "oscillator.inertia": 1e-30}


def test_an_inertia_below_round_off_is_rejected_with_the_same_message():
    """The hammer has 1.6e-5 kg m2, the oscillator 4.5e-4 m2 times its mass: at 1e-15 kg, 3e-14."""
    mechanism = load("ImpactOscillator")
    with pytest.raises(ParameterError, match=r"inertia of body oscillator, .* make the") as ours:
        Simulation(mechanism, light(1e-15))
    with pytest.raises(KernelMistake) as theirs:
        KernelSimulation(mechanism, light(1e-15))
    assert str(theirs.value) == str(ours.value)
    for engine in ENGINES.values():
        engine(mechanism, light(1e-12)).advance(1e-3)
