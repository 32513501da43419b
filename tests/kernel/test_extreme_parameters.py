"""Combinations of extreme parameters: both engines run or reject them for the same reason."""

import pytest

from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import ParameterError
from prbm.files.mechanism_file import load
from prbm.hybrid.simulation import Simulation

pytestmark = pytest.mark.native

ENGINES = {"python": Simulation, "kernel": KernelSimulation}

WIDE = {
    "strut.span": 0.00057088, "strut.rise": 0.72389, "shuttle.width": 6.3855,
    "shuttle.height": 0.29813, "strut.distance": 336.12, "polyurethane.youngs_modulus":
    18988000000.0, "polyurethane.density": 111.96, "strut.thickness": 2.8224e-07,
    "strut.width": 5.3564e-06, "strut.gamma": 0.0014174, "strut.K_theta": 0.053802,
    "shuttle.mass": 1.5107e-14, "shuttle.inertia": 2.1071e-30, "gravity.x": 582.96,
    "gravity.y": -14638.0, "release.displacement": 0.0, "release.velocity": -0.018583,
    "damping.zeta": 2.5174, "damping.beta": 3.5058e-07, "far_stop.position": 9.7788e-05,
    "far_stop.offset": 4.5349e-06, "far_stop.restitution": 0.1129, "far_stop.friction":
    99.067, "far_stop.rest_speed": 0.0002198, "near_stop.position": 2.7696e-06,
    "near_stop.offset": 0.0, "near_stop.restitution": 0.80157, "near_stop.friction": 56.56,
    "near_stop.rest_speed": 2.3893e-06, "solver.tolerance": 7.0138e-12,
}  # fmt: skip
"""A shuttle of some micrometres of travel, pressed by less than the round-off of its large size."""


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


@pytest.mark.parametrize("engine", ENGINES)
def test_a_stop_released_by_round_off_is_not_penetrated(engine):
    """The penetration after a premature release does not add up over intervals of steps."""
    sim = ENGINES[engine](load("Bistable"), WIDE)
    for k in range(1, 31):
        sim.advance(k * 1e-3)
        out = sim.outputs()
        assert out["far_stop.gap"] > -2e-9
        assert out["near_stop.gap"] > -2e-9
    assert out["far_stop.impact_count"] > 10
