"""Compliant stops in the kernel: the motion, the impacts and the saved states of the engine."""

import dataclasses
import json

import numpy as np
import pytest

from point_mass import MASS, point_mass
from prbm.base.errors import SimulationError
from prbm.hybrid.simulation import Simulation
from prbm.kernel.simulation import KernelSimulation
from support import energy_balance, mechanism


def guide(name, stiffness, **changes):
    """Return a shipped guide with a compliant stop."""
    own = mechanism(name)
    (stop,) = own.stops
    keys = {"law": "compliant", "stiffness": stiffness, "exponent": 1.0, **changes}
    soft = dataclasses.replace(stop, **keys)
    return dataclasses.replace(own, stops=(soft,))


CASES = {  # Mechanism, values, end [s], values set at half the time.
    "hit": (point_mass(), {}, 2e-3, {}),
    "elastic hit": (point_mass(restitution=1.0), {}, 2e-3, {}),
    "plastic hit": (point_mass(restitution=0.05), {}, 3e-3, {}),
    "Hertz": (point_mass(stiffness=1e8, exponent=1.5, restitution=0.3), {}, 2e-3, {}),
    "rest and strike": (
        point_mass(stiffness=1e7, velocity=0.0), {"push.x": 1.0}, 0.03,
        {"push.impulse.x": MASS},
    ),
    "rest and release": (
        point_mass(stiffness=1e7, velocity=0.0), {"push.x": 1.0}, 0.02, {"push.x": -1.0}
    ),
    "pulled off": (point_mass(stiffness=1e5, restitution=0.05), {}, 2.1e-3,
                   {"push.impulse.x": -1.5e-4}),
    "pushed in": (
        point_mass(stiffness=1e4, displacement=-1e-9, velocity=2e-3), {"push.x": 1.0}, 2e-3, {}
    ),
    "preload": (
        point_mass(stiffness=1e5, displacement=1e-4, velocity=0.0), {}, 2e-3, {}
    ),
    "moving wall": (
        point_mass(stiffness=1e6), {"stop.velocity": -0.02}, 2e-3, {"stop.velocity": 0.01}
    ),
    "guide": (guide("PRBDM", 6e7), {}, 0.3, {}),
    "oblique hit": (
        point_mass(stiffness=1e7, restitution=0.8, direction=30.0, friction=0.3), {}, 2e-3, {}
    ),
    "sticking hit": (
        point_mass(stiffness=1e6, restitution=0.8, direction=5.0, friction=0.5), {}, 2e-3, {}
    ),
    "oblique guide": (guide("PRBDM2R", 6e6, direction=5.0, friction=0.4), {}, 0.15, {}),
    "oblique guide of one degree of freedom": (
        guide("PRBDM", 6e6, direction=30.0, friction=0.9), {}, 0.15, {}
    ),
    "guide and giving wall": (guide("PRBDM2R", 6e6), {"stop.mobility": 5.0}, 0.1, {}),
    "giving wall": (point_mass(), {"stop.mobility": 0.7 / MASS}, 2e-3, {}),
    "giving wall at rest": (
        point_mass(stiffness=1e7, velocity=0.0), {"push.x": 1.0, "stop.mobility": 1e-3 / MASS},
        0.02, {"push.x": -0.1},
    ),
    "giving wall, pushed in": (
        point_mass(stiffness=1e4, displacement=-1e-9, velocity=2e-3),
        {"push.x": 1.0, "stop.mobility": 0.5 / MASS}, 2e-3, {},
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_the_motion_with_compliant_stops_is_that_of_the_engine(case):
    own, values, end, changes = CASES[case]
    both = Simulation(own, values), KernelSimulation(own, values)
    for one in both:
        one.record = []
    for k in range(1, 41):
        for one in both:
            one.advance(k * end / 40)
        expected, found = (one.outputs() for one in both)
        assert found.keys() == expected.keys()
        rows = ([out[name] for name in expected] for out in (found, expected))
        np.testing.assert_allclose(*rows, rtol=1e-6, atol=1e-9, err_msg=str([*expected]))
        if k == 20:
            for one in both:
                one.set(changes)
    assert abs(both[0].step_count - both[1].step_count) <= 2  # Round-off may repeat a step.
    engine, kernel = (one.record for one in both)
    assert len(kernel) == len(engine)
    for mine, theirs in zip(kernel, engine, strict=True):
        assert mine.time == pytest.approx(theirs.time, rel=1e-9)
        np.testing.assert_allclose(mine.before, theirs.before, rtol=1e-6, atol=1e-9)
        for name, x in vars(theirs.latched).items():
            if name != "modal_restitution":
                assert getattr(mine.latched, name) == pytest.approx(x, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("time", [0.00103, 0.02])
def test_a_state_saved_in_contact_restores_in_the_kernel(time):
    values = {"push.x": 1.0} if time == 0.02 else {}
    own = point_mass(restitution=0.3, velocity=0.0 if values else 0.1)
    sim = KernelSimulation(own, values)
    sim.advance(time)
    assert sim.outputs()["stop.contact"]
    saved = json.loads(json.dumps(sim.snapshot()))
    other = KernelSimulation(own)
    other.restore(saved)
    assert other.snapshot() == saved
    for one in (sim, other):
        one.advance(time + 0.01)
    assert other.snapshot() == sim.snapshot()


def test_an_indentation_beyond_the_size_is_rejected_by_the_kernel():
    sim = KernelSimulation(
        point_mass(velocity=1.0, displacement=0.0, stiffness=1e-3, position=-0.03)
    )
    with pytest.raises(SimulationError, match="more than the size of the mechanism"):
        sim.advance(0.1)


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
@pytest.mark.parametrize("time", [0.00103, 0.02])
def test_a_change_of_the_position_in_contact_is_work_of_the_wall(engine, time):
    """The contact is pressed at the first time, and settled at the second one."""
    values = {"push.x": 1.0} if time == 0.02 else {}
    sim = engine(point_mass(velocity=0.0 if values else 0.1), values)
    sim.advance(time)
    start, before = energy_balance(sim.outputs()), sim.outputs()["energy.work"]
    sim.set({"stop.position": -2e-7})
    for k in range(1, 6):
        sim.advance(time + 1e-5 * k)
        assert energy_balance(sim.outputs()) == pytest.approx(start, abs=1e-6 * abs(start) + 1e-12)
    assert sim.outputs()["energy.work"] != before
    assert sim.outputs()["stop.contact"]


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_a_contact_does_not_shorten_the_steps_of_the_flight_after_it(engine):
    steps, count = {}, 0
    for own in (mechanism("PRBDM"), guide("PRBDM", 6e7)):
        sim = engine(own)
        sim.advance(0.2)
        steps[own.stops[0].law], count = sim.step_count, sim.outputs()["stop.impact_count"]
    assert count == 4
    assert steps["compliant"] - steps["rigid"] <= 13 * count
