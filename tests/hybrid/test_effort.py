"""Loose tolerances are replaced, and the number of integration steps is limited."""

import re

import numpy as np
import pytest

from kernel_simulation import KernelMistake, KernelSimulation
from point_mass import MASS, point_mass
from prbm.base import tolerances
from prbm.base.errors import SimulationError
from prbm.base.tolerances import TOLERANCE_USED_MAX
from prbm.files.mechanism_file import shipped
from prbm.hybrid import effort
from prbm.hybrid.simulation import Simulation
from prbm.runs.run import simulate
from support import energy_balance, mechanism

each_engine = pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
THICK = {"flexure.thickness": 0.03}  # m, where 0.1 mm is meant
LIMIT = f"enum {{ EFFORT_MAX = {tolerances.EFFORT_MAX} }};"
NO_BURST = (
    "generated.h",
    f"enum {{ BURST_STEPS_MAX = {tolerances.BURST_STEPS_MAX} }};",
    "enum { BURST_STEPS_MAX = 20 };",
)
FEW = ("generated.h", LIMIT, "enum { EFFORT_MAX = 20 };")


@each_engine
@pytest.mark.parametrize("given", [{"tolerance": 1e-2}, {"values": {"solver.tolerance": 1e-3}}])
def test_a_loose_tolerance_is_replaced(engine, given):
    """The motion is bit for bit that of the largest tolerance in use."""
    ends = []
    for options in (given, {"tolerance": TOLERANCE_USED_MAX}):
        sim = engine(mechanism("PRBDM2R"), **options)
        sim.advance(0.05)
        out = sim.outputs()
        ends.append({k: x for k, x in out.items() if k != "solver.tolerance"})
    assert ends[0] == ends[1]


@pytest.mark.parametrize("name", shipped())
def test_energy_error_at_the_loosest_tolerance_is_below_five_per_mille(name):
    """Within 50 ms under 1e4 m/s2, relative to the largest kinetic or initial elastic energy."""
    sim = KernelSimulation(mechanism(name), {"base.acceleration.x": 1e4}, tolerance=1e-2)
    out = sim.outputs()
    start, scale, worst = energy_balance(out), out["energy.elastic"], 0.0
    for t in np.linspace(0.0, 0.05, 51)[1:]:
        sim.advance(t)
        out = sim.outputs()
        worst = max(worst, abs(energy_balance(out) - start))
        scale = max(scale, out["energy.kinetic"])
    assert worst < 5e-3 * scale


def test_a_stiff_mechanism_is_rejected_at_the_steps_of_the_default_experiment():
    sim = Simulation(mechanism("PRBDM2R"), THICK)
    needed = 1e-3 / sim.fastest.longest_step(sim.equations)
    assert needed > tolerances.DEFAULT_EFFORT_MAX
    with pytest.raises(SimulationError, match=r"Hz: a communication step of 0\.001 s would need"):
        sim.check_effort(1e-3)
    with pytest.raises(SimulationError, match=r"Hz: a communication step of 0\.001 s would need"):
        simulate(mechanism("PRBDM2R"), THICK, stop_time=1.0, step=1e-3)


def test_short_communication_steps_of_a_stiff_mechanism_are_accepted():
    assert len(simulate(mechanism("PRBDM2R"), THICK, stop_time=1e-7, step=1e-8)["time"]) == 11


def test_the_shipped_mechanisms_need_few_steps_in_a_default_communication_step():
    for name in shipped():
        Simulation(mechanism(name)).check_effort(10 * 1e-3)


@pytest.mark.parametrize("engine", ["package", pytest.param("kernel", marks=pytest.mark.slow)])
def test_the_effort_of_one_communication_step_is_limited(monkeypatch, engine):
    """A long step fails and changes nothing; shorter steps succeed."""
    guide = mechanism("PRBDM2R")
    if engine == "package":
        monkeypatch.setattr(effort, "EFFORT_MAX", 20)
        sim = Simulation(guide)
    else:
        sim = KernelSimulation(guide, changes=(FEW,))
    before = sim.outputs()
    with pytest.raises((SimulationError, KernelMistake), match="not reached in 20 integration st"):
        sim.advance(0.1)
    assert sim.outputs() == before
    for t in np.linspace(0.0, 0.03, 61)[1:]:
        sim.advance(t)
    expected = Simulation(guide)
    monkeypatch.undo()
    expected.advance(0.03)
    assert sim.outputs()["shuttle.x"] == pytest.approx(expected.outputs()["shuttle.x"], abs=1e-9)


BURSTS = [
    ("PRBDM2R", {"force.impulse.moment": 9128.0}),
    ("PRBDM3R", {"force.impulse.moment": -1.7}),
]


@pytest.mark.slow
@pytest.mark.parametrize(("model", "impulse"), BURSTS)
def test_a_burst_of_steps_is_rejected_with_its_kinetic_energy(model, impulse):
    """The steps are bounded however long the communication step; the message has the energy.

    No energy is lost before: that of the message is at most the work of the impulse.
    """
    sim = KernelSimulation(mechanism(model))
    sim.advance(1e-3)
    before = sim.outputs()
    sim.set(impulse)
    for end in (2e-3, 0.1, 10.0):
        with pytest.raises(KernelMistake, match="the kinetic energy is") as error:
            sim.advance(end)
        assert sim.outputs()["energy.kinetic"] == before["energy.kinetic"]
    found = re.search(r"^(\d+) integration .* energy is (\S+) J", str(error.value))
    assert found is not None
    assert tolerances.BURST_STEPS_MAX <= int(found[1]) <= 2 * tolerances.BURST_STEPS_MAX
    sim.advance(1e-3 + 1e-9)
    out = sim.outputs()
    assert 0.0 < float(found[2]) < 1.001 * (out["energy.work"] + before["energy.kinetic"])


def test_a_guide_that_turns_over_is_rejected():
    """Round-off decides whether its steps are too many, or stop where all links are in line."""
    sim = KernelSimulation(mechanism("PRBDM"))
    sim.advance(1e-3)
    sim.set({"force.impulse.y": 9128.0})
    with pytest.raises(KernelMistake, match=r"the kinetic energy is|the step size fell"):
        sim.advance(10.0)


@pytest.mark.parametrize("engine", ["package", pytest.param("kernel", marks=pytest.mark.slow)])
def test_the_steps_of_the_fastest_mode_are_no_burst(monkeypatch, engine):
    """If no other steps are accepted, they suffice for a motion without events."""
    axial, end = mechanism("PRBDM2RAxial"), 3e-3
    if engine == "package":
        monkeypatch.setattr(effort, "BURST_STEPS_MAX", 20)
        sim = Simulation(axial)
    else:
        sim = KernelSimulation(axial, changes=(NO_BURST,))
    sim.advance(end)
    if engine == "package":
        assert sim.step_count > 5 * 20
    sim.set({"force.impulse.moment": 1.0})
    with pytest.raises((SimulationError, KernelMistake), match="the kinetic energy is"):
        sim.advance(end + 1e-3)


@each_engine
def test_a_force_moves_a_mass_whose_springs_are_almost_without_stiffness(engine):
    """Its power is 1e12 times the energy scale of the springs per second."""
    sim = engine(point_mass(), {"push.x": 1.0})
    sim.advance(2e-4)
    out = sim.outputs()
    assert out["mass.vx"] == pytest.approx(0.1 + 2e-4 / MASS, rel=1e-3)
    assert out["energy.work"] == pytest.approx(0.1 * 2e-4 + 4e-8 / (2 * MASS), rel=1e-3)
