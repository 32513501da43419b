"""Impacts with a coupled partner: mobilities of walls, impulses as inputs and as outputs."""

import itertools
import json

import numpy as np
import pytest

from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_problem import ContactProblem
from prbm.mechanism.parts import value
from support import mechanism

GUIDES = ("PRBDM", "PRBDM2R", "ImpactOscillator")
WALL = 3.0  # 1/kg


def moved(simulation):
    """Return the displacement of the first wall from its drawn position [m]."""
    drawn = value(simulation.mechanism.stops[0], "position", simulation.values)
    return simulation.inputs.walls[0].motion(simulation.time)[0] - drawn


def first_impact(name, **values):
    """Return a simulation up to 1 ms after its first impact, and the impact."""
    found = mechanism(name)
    stop = found.stops[0].name
    simulation = Simulation(found, {f"{stop}.{k}": x for k, x in values.items()})
    simulation.record = []
    for k in itertools.count(1):
        simulation.advance(k * 1e-3)
        if simulation.record:
            return simulation, simulation.record[0]


@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("name", GUIDES)
def test_an_impact_with_a_mobile_wall_is_an_impact_of_two_masses(name, restitution):
    """The impulse is P = (1 + eps) u/(W + w), the energy lost (1 - eps^2) u^2/2/(W + w).

    u is the closing speed, W the mobility of the hit point and w that of the wall.
    """
    if name == "ImpactOscillator" and restitution == 0.0:
        pytest.skip("the hammer is captured: there is no impact")
    simulation, impact = first_impact(name, mobility=WALL, restitution=restitution)
    u, P = impact.latched.approach_speed, impact.latched.impulse
    system = simulation.system
    at = ContactProblem(system, impact.q)
    W = at.mobility(at.gaps[[0]])
    assert pytest.approx((1 + restitution) * u, rel=1e-9) == P * (W + WALL)
    assert impact.latched.rebound_speed == pytest.approx(restitution * u, abs=1e-9 * u)
    lost = (1 - restitution**2) * u**2 / 2 / (W + WALL)
    assert impact.latched.energy_lost == pytest.approx(lost, rel=1e-9, abs=1e-12 * u**2)
    assert system.n == len(impact.before)


def total(simulation):
    """Return the energy balance [J], which is constant."""
    out = simulation.outputs()
    kinds = ("kinetic", "elastic", "gravitational", "dissipated")
    return sum(out[f"energy.{kind}"] for kind in kinds) - out["energy.work"]


@pytest.mark.parametrize("name", GUIDES)
def test_energy_is_balanced_with_a_mobile_wall(name):
    """The energies without that of the wall, less the work of the wall, are constant."""
    found = mechanism(name)
    stop = found.stops[0].name
    simulation = Simulation(found, {f"{stop}.mobility": WALL})
    start = total(simulation)
    simulation.record = []
    for k in range(1, 101):
        # The wall is a free mass that keeps its velocity after each impact.
        rate = simulation.inputs.walls[0].rate
        simulation.set({f"{stop}.displacement": moved(simulation), f"{stop}.velocity": rate})
        simulation.advance(k * 1e-3)
    assert simulation.record
    kinetic = max(simulation.outputs()["energy.kinetic"], 1e-4)
    assert total(simulation) == pytest.approx(start, abs=1e-6 * kinetic)
    wall = simulation.inputs.walls[0]
    assert wall.rate == pytest.approx(WALL * simulation.latched[0].impulse_sum, rel=1e-6)


@pytest.mark.parametrize("name", ["PRBDM", "PRBDM2R"])
def test_an_impulse_is_the_limit_of_a_short_force(name):
    """The velocities after shorter and shorter forces converge to those after the impulse."""
    given = {"stop.position": 1.0, "release.displacement": -5e-3}
    impulse = {"force.impulse.x": 2e-3, "force.impulse.y": 1e-3, "force.impulse.moment": 1e-4}
    struck = Simulation(mechanism(name), given)
    struck.set(impulse)
    n = struck.system.n
    struck.advance(1e-12)
    after, errors = struck.state()[n : 2 * n], []
    for span in (4e-6, 2e-6, 1e-6):
        pushed = Simulation(mechanism(name), given, tolerance=1e-12)
        pushed.set({k.replace("impulse.", ""): x / span for k, x in impulse.items()})
        pushed.advance(span)
        errors.append(np.abs(pushed.state()[n : 2 * n] - after).max())
    assert errors[2] < 1e-3 * np.abs(after).max()
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.3)


@pytest.mark.parametrize("name", ["PRBDM", "PRBDM2R"])
def test_the_work_of_an_impulse_equals_the_change_of_energy(name):
    simulation = Simulation(mechanism(name), {"stop.position": 1.0})
    simulation.advance(0.013)
    before = total(simulation), simulation.outputs()["energy.kinetic"]
    simulation.set({"force.impulse.x": -5e-3, "force.impulse.moment": 2e-4})
    simulation.advance(0.013 + 1e-9)
    after = total(simulation), simulation.outputs()["energy.kinetic"]
    assert after[0] == pytest.approx(before[0], abs=1e-9 * before[1])
    assert abs(after[1] - before[1]) > 0.1 * before[1]


STUCK = {"friction.coefficient": 0.5, "friction.normal_force": 20.0, "stop.position": 1.0,
         "release.displacement": 0.0}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", ["PRBDM", "PRBDM2R"])
@pytest.mark.parametrize(
    "kind", [Simulation, pytest.param(KernelSimulation, marks=pytest.mark.native)]
)
def test_sticking_friction_does_not_resist_an_impulse(name, kind):
    """The velocity after the impulse is impulse times mobility; friction acts afterwards only."""
    simulation = kind(mechanism(name), STUCK)
    simulation.advance(0.01)
    before = simulation.outputs()
    assert before["shuttle.vx"] == pytest.approx(0.0, abs=1e-12)
    simulation.set({"force.impulse.x": 1e-3})
    start = total(simulation)
    simulation.advance(0.01 + 1e-9)
    after = simulation.outputs()
    # The force acts on the centre of mass, on the line of impact of the stop.
    expected = 1e-3 * after["stop.point.mobility"]
    assert after["shuttle.vx"] == pytest.approx(expected, rel=1e-4)
    assert total(simulation) == pytest.approx(start, abs=1e-9 * after["energy.kinetic"])


def resting(name):
    """Return a simulation that rests on its stop."""
    simulation = Simulation(mechanism(name), {"stop.restitution": 0.5})
    simulation.advance(0.5)
    assert simulation.contacts.modes[0].closed
    return simulation


@pytest.mark.parametrize("name", ["PRBDM", "PRBDM2R"])
def test_an_impulse_towards_the_wall_makes_a_resting_body_bounce(name):
    simulation = resting(name)
    count, mobility = (
        simulation.latched[0].impact_count,
        simulation.outputs()["stop.point.mobility"],
    )
    simulation.record = []
    simulation.set({"force.impulse.x": 1e-3})
    simulation.advance(simulation.time + 1e-9)
    latched = simulation.latched[0]
    assert latched.impact_count == count + 1
    # The force acts on the centre of mass, on the line of impact of the stop.
    assert latched.approach_speed == pytest.approx(1e-3 * mobility, rel=1e-9)
    assert latched.rebound_speed == pytest.approx(0.5e-3 * mobility, rel=1e-9)


@pytest.mark.parametrize("name", ["PRBDM", "PRBDM2R"])
def test_an_impulse_away_from_the_wall_opens_the_contact_of_a_resting_body(name):
    simulation = resting(name)
    simulation.set({"force.impulse.x": -1e-3})
    simulation.advance(simulation.time + 1e-4)
    assert not simulation.contacts.modes[0].closed
    assert simulation.outputs()["stop.gap"] > simulation.configuration.scales.penetration


@pytest.mark.parametrize("name", GUIDES)
def test_the_gap_is_the_difference_of_the_displacements_of_wall_and_contact_point(name):
    simulation, _ = first_impact(name)
    stop = simulation.mechanism.stops[0].name
    simulation.set({f"{stop}.displacement": 2e-3, f"{stop}.velocity": 0.1})
    simulation.advance(simulation.time + 1e-3)
    out = simulation.outputs()
    gap = moved(simulation) - out[f"{stop}.point.displacement"]
    assert out[f"{stop}.gap"] == pytest.approx(gap, abs=1e-15)
    rate = simulation.inputs.walls[0].motion(simulation.time)[1] - out[f"{stop}.point.velocity"]
    assert out[f"{stop}.gap_rate"] == pytest.approx(rate, abs=1e-15)


@pytest.mark.parametrize("name", GUIDES)
def test_a_saved_state_keeps_impulses_and_mobilities(name):
    found = mechanism(name)
    force, stop = found.forces[0].name, found.stops[0].name
    given = {f"{stop}.mobility": WALL, f"{force}.impulse.x": 1e-4}
    simulation = Simulation(found)
    simulation.set(given)
    simulation.advance(0.05)
    saved = json.loads(json.dumps(simulation.snapshot()))
    simulation.set({f"{force}.impulse.x": 2e-4})
    simulation.advance(0.1)
    expected = simulation.outputs()
    other = Simulation(found)
    other.restore(saved)
    other.set({f"{force}.impulse.x": 2e-4})
    other.advance(0.1)
    assert other.outputs() == expected


def test_impulse_inputs_at_the_start_have_no_effect():
    given = {"force.impulse.x": 1.0, "stop.position": 1.0}
    one, other = (Simulation(mechanism("PRBDM"), x) for x in (given, {"stop.position": 1.0}))
    one.advance(0.01)
    other.advance(0.01)
    assert one.front.y.tolist() == other.front.y.tolist()


@pytest.mark.parametrize("twin", [Simulation, KernelSimulation])
@pytest.mark.parametrize(
    ("mobility", "words"),
    [(-1.0, r"= -1 1/kg must not be negative"), (1e200, r"= 1e\+200 1/kg must be at most 1e\+100")],
)
def test_an_invalid_mobility_is_rejected(twin, mobility, words):
    with pytest.raises((ParameterError, KernelMistake), match=f"stop.mobility {words}"):
        twin(mechanism("PRBDM"), {"stop.mobility": mobility})
