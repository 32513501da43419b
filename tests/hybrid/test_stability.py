"""Steps are stable, and round-off does not change their sizes."""

import numpy as np
import pytest

from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import SimulationError
from prbm.hybrid.simulation import Simulation
from prbm.hybrid.stability import FastestMode
from prbm.hybrid.stepping import StepSizeController, rounded_step
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from support import energy_balance, mechanism

STIFF = ("FoldedSuspension", "PRBDM2RAxial")
each_stiff = pytest.mark.parametrize("name", STIFF)
each_engine = pytest.mark.parametrize("engine", [Simulation, KernelSimulation])


@pytest.mark.parametrize("name", [*STIFF, "PRBDM2R", "Bistable"])
def test_the_fastest_mode_has_the_highest_frequency(name):
    """At the straight shape without loads, where only springs are stiff."""
    guide = mechanism(name)
    straight = {"release.displacement": 0.0, "gravity.x": 0.0, "gravity.y": 0.0}
    sim = Simulation(guide, straight | {f"{guide.stops[0].name}.position": 0.1})
    system = assemble(guide, guide.values(straight))
    highest = 2.0 * np.pi * modes(system, equilibrium(system, 0.0)).frequency.max()
    assert sim.fastest.rate == pytest.approx(highest, rel=1e-2)
    assert sim.fastest.rate <= highest * (1.0 + 1e-9)


def test_stability_limits_the_step_by_the_damping_of_an_overdamped_mode():
    """The faster of the two real rates of s^2 + beta omega^2 s + omega^2 = 0 counts."""
    rate, beta = 1e4, 1e-3
    sim = Simulation(mechanism("PRBDM2R"), {"damping.beta": beta})
    roots = np.roots([1.0, beta * rate**2, rate**2])
    longest = FastestMode(np.ones(1), rate).longest_step(sim.equations)
    assert longest * np.abs(roots).max() == pytest.approx(4.0, rel=1e-9)


@pytest.mark.slow
@each_stiff
@each_engine
def test_round_off_does_not_grow_in_steps_that_stability_limits(name, engine):
    """Two motions whose releases differ by 1e-15 differ by less than 1e-9 of the rates."""
    guide, end = mechanism(name), 0.03
    release = guide.values()["release.displacement"]
    found = []
    for x in (release, release * (1.0 + 1e-15)):
        sim = engine(guide, {"release.displacement": x}, tolerance=1e-5)
        rows = []
        for t in np.linspace(0.0, end, 31)[1:]:
            sim.advance(float(t))
            out = sim.outputs()
            rows.append([out[x] for x in sorted(out) if x.endswith(("omega", "strain_rate"))])
        found.append(np.array(rows))
    assert np.abs(found[1] - found[0]).max() < 1e-9 * np.abs(found[0]).max()


def test_round_off_of_an_error_does_not_change_the_step_size():
    rng = np.random.default_rng(0)
    for error in 10.0 ** rng.uniform(-3.0, 3.0, 1000):
        controller = StepSizeController(h=rng.uniform(1e-6, 1e-3))
        assert controller.next(error).h == controller.next(error * (1.0 + 1e-9)).h


def test_a_rounded_step_has_four_binary_digits():
    rng = np.random.default_rng(0)
    for h in 10.0 ** rng.uniform(-12.0, 2.0, 1000):
        fraction, _ = np.frexp(rounded_step(h))
        assert fraction * 16 == round(fraction * 16)
        assert rounded_step(h) == pytest.approx(h, rel=1 / 16)


@each_engine
@pytest.mark.parametrize("velocity", [-5.0, -7.0, -15.0])
def test_energy_is_balanced_up_to_an_error_at_the_flat_shape(velocity, engine):
    """Friction reverses where the flexures are flat and the loop does not determine the motion."""
    values = {"release.velocity": velocity, "stop.position": 1.0, "friction.coefficient": 0.3}
    sim = engine(mechanism("PRBDM"), values)
    out = sim.outputs()
    start, scale, message = energy_balance(out), 0.0, "straight line"
    for t in np.linspace(0.0, 0.03, 31)[1:]:
        try:
            sim.advance(float(t))
            out = sim.outputs()
        except (SimulationError, KernelMistake) as error:
            message = str(error)
            break
        scale = max(scale, out["energy.kinetic"], out["energy.elastic"])
        assert energy_balance(out) == pytest.approx(start, abs=4e-5 * scale)
    assert "straight line" in message


@each_engine
@pytest.mark.parametrize("velocity", [-7.0, -10.0])
def test_friction_reverses_at_the_flat_shape(velocity, engine):
    """The shuttle turns where the flexures are flat, at x = -gamma L.

    The work of friction is mu N times the path.
    """
    guide, force = mechanism("PRBDM"), 20.0
    values = {"release.displacement": 0.0, "release.velocity": velocity, "damping.beta": 0.0}
    values |= {"friction.coefficient": 0.3, "friction.normal_force": force, "stop.position": 1.0}
    turn = guide.values()["flexure.gamma"] * guide.values()["flexure.length"]
    sim = engine(guide, values)
    start = energy_balance(sim.outputs())
    sim.advance(-1.5 * 0.06 / velocity)
    out = sim.outputs()
    assert out["shuttle.vx"] > 1.0
    path = 2 * turn + out["shuttle.x"]
    assert out["energy.dissipated"] == pytest.approx(0.3 * force * path, rel=1e-6)
    assert energy_balance(out) == pytest.approx(start, abs=1e-6 * out["energy.kinetic"])
