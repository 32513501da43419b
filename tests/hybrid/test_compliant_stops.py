"""Compliant stops: closed forms of a point mass, and the rules of contacts that overlap or last."""

import dataclasses
import json
import math

import numpy as np
import pytest

from point_mass import MASS, point_mass
from prbm.base.errors import MechanismError, SimulationError
from prbm.hybrid.compliant import switch
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.compliance import damping_factor
from prbm.mechanics.contact_state import Phase
from prbm.mechanism.parts import Stop
from prbm.runs.engine import simulation
from springs import oscillator
from support import energy_balance, mechanism

SPEED = 0.1  # m/s


def after_hit(values=None, **stop):
    """Return the simulation at the end of the first contact, with its outputs."""
    sim = Simulation(point_mass(**stop), values)
    sim.record = []
    while not sim.record:
        sim.advance(sim.time + 2e-4)
        assert sim.time < 0.1
    return sim, sim.outputs()


def compliant(name, stiffness, restitution=0.6):
    """Return a shipped mechanism with compliant stops."""
    own = mechanism(name)
    keys = {"law": "compliant", "stiffness": stiffness, "restitution": restitution}
    return dataclasses.replace(
        own, stops=tuple(dataclasses.replace(stop, **keys) for stop in own.stops)
    )


def resting(**stop):
    """Return a simulation of a body that a force of 1 N holds on the settled stop."""
    sim = Simulation(point_mass(velocity=0.0, **stop), {"push.x": 1.0})
    sim.advance(0.02)
    assert sim.contacts.touching[0].phase is Phase.FROZEN
    return sim


# --- closed forms -----------------------------------------------------------------------------


STIFFNESSES = [1e4, 1e7, pytest.param(1e10, marks=pytest.mark.slow)]
RESTITUTIONS = [
    0.01,
    0.05,
    0.6,
    1.0,
    *(pytest.param(e, marks=pytest.mark.slow) for e in (0.3, 0.95)),
]


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("stiffness", STIFFNESSES)
@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_a_point_mass_rebounds_with_the_restitution(exponent, stiffness, restitution):
    unit = 1e2 if exponent > 1 else 1.0  # The same order of force for both exponents.
    _, out = after_hit(stiffness=stiffness * unit, exponent=exponent, restitution=restitution)
    ratio = out["stop.rebound_speed"] / out["stop.approach_speed"]
    assert ratio == pytest.approx(restitution, abs=1e-6)


def test_the_restitution_does_not_depend_on_the_speed():
    for speed in (1e-2, 2e-3):
        _, out = after_hit(velocity=speed, displacement=-1e-5, stiffness=1e6)
        ratio = out["stop.rebound_speed"] / out["stop.approach_speed"]
        assert ratio == pytest.approx(0.6, abs=1e-6)


def test_a_linear_elastic_contact_has_its_duration_force_and_indentation():
    _, out = after_hit(stiffness=1e6, restitution=1.0)
    omega = math.sqrt(1e6 * out["stop.point.mobility"])
    speed = out["stop.approach_speed"]
    assert out["stop.contact_duration"] == pytest.approx(math.pi / omega, rel=1e-6)
    assert out["stop.indentation"] == pytest.approx(speed / omega, rel=1e-6)
    assert out["stop.peak_force"] == pytest.approx(1e6 * speed / omega, rel=1e-6)
    assert out["stop.impulse"] == pytest.approx(2 * speed / out["stop.point.mobility"], rel=1e-6)


def test_a_contact_of_hertz_has_its_duration_and_force():
    _, out = after_hit(stiffness=1e9, exponent=1.5, restitution=1.0)
    m, v = 1 / out["stop.point.mobility"], out["stop.approach_speed"]
    duration = 3.218065 * (m**2 / (1e18 * v)) ** 0.2
    assert out["stop.contact_duration"] == pytest.approx(duration, rel=1e-5)
    assert out["stop.peak_force"] == pytest.approx(1e9 * (5 * m * v**2 / 4e9) ** 0.6, rel=1e-5)


def test_a_mass_on_a_spring_has_the_contact_time_of_sdnd101():
    """Test SDND101 of code_aster: 100 kg, 1e4 N/m, contact 1e6 N/m, 1 m/s; 31.26 ms."""
    size = {"mass": 100.0, "length": 10.0, "displacement": -1e-6, "velocity": 1.0}
    trial = Simulation(point_mass(young=1e9, **size)).configuration.omega
    young = 1e9 * (10.0 / trial) ** 2
    _, out = after_hit(young=young, stiffness=1e6, restitution=1.0, **size)
    expected = math.pi / math.sqrt(1e2 + 1e6 * out["stop.point.mobility"])
    assert out["stop.contact_duration"] == pytest.approx(expected, rel=1e-4)
    assert expected == pytest.approx(31.26e-3, rel=5e-3)


@pytest.mark.parametrize("e", [0.1, 0.3, 0.6])
def test_the_peak_force_of_a_damped_contact_is_that_of_an_independent_integration(e):
    from scipy.integrate import solve_ivp

    a = damping_factor(e)
    path = solve_ivp(
        lambda t, y: (y[1], -y[0] * (1 + a * y[1])), (0, 6), (0, 1), rtol=1e-10, atol=1e-12,
        max_step=1e-3,
    ).y  # fmt: skip
    ratio = float((path[0] * (1 + a * path[1])).max())
    _, out = after_hit(stiffness=1e6, restitution=e)
    elastic = out["stop.approach_speed"] * math.sqrt(1e6 / out["stop.point.mobility"])
    assert out["stop.peak_force"] / elastic == pytest.approx(ratio, rel=1e-5)
    assert out["energy.dissipated"] == pytest.approx(out["stop.energy_lost"], rel=1e-12)


def test_stiff_stops_converge_to_the_rigid_law_in_order():
    """The contact time falls with the square root of the stiffness, and with it the difference."""
    rigid = Simulation(mechanism("PRBDM"))
    rigid.advance(0.06)
    expected = rigid.outputs()["shuttle.x"]
    differences = []
    for stiffness in (1e6, 1e8, 1e10):
        sim = Simulation(compliant("PRBDM", stiffness))
        sim.advance(0.06)
        differences.append(abs(sim.outputs()["shuttle.x"] - expected))
    first, second, third = differences
    assert first / second == pytest.approx(10, rel=0.1)
    assert second / third == pytest.approx(10, rel=0.1)


@pytest.mark.parametrize(
    ("exponent", "stiffness", "step", "order"), [(1.0, 1e6, 2e-5, 7.0), (1.5, 1e8, 1e-5, 2.5)]
)
def test_fixed_steps_through_a_contact_have_their_order(exponent, stiffness, step, order):
    """First touch is an event, after which the force is smooth: the order is that of the pair.

    With the exponent 1.5 the force begins with the power 1.5 of the time, and its integral over the
    first step has an error of the power 2.5.
    """
    errors = []
    for h in (step, step / 2):
        sim = Simulation(point_mass(stiffness=stiffness, exponent=exponent), step=h)
        sim.advance(0.0015)
        out = sim.outputs()
        errors.append(abs(out["stop.rebound_speed"] / out["stop.approach_speed"] - 0.6))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_friction_takes_its_share_of_an_oblique_elastic_hit(friction):
    """The normal force F has the tangential force mu F against sliding, which turns at the peak."""
    _, out = after_hit(stiffness=1e7, restitution=1.0, direction=30.0, friction=friction)
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    expected = math.sqrt((c - friction * s) / (c + friction * s))
    ratio = out["stop.rebound_speed"] / out["stop.approach_speed"]
    assert ratio == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("engine", ["kernel", "python"])
@pytest.mark.parametrize(
    ("stiffness", "e", "force"), [(1e4, 0.6, 0.1), (1e6, 0.1, 1.0), (1e6, 0.6, 1.0)]
)
def test_friction_holds_or_slides_after_each_reversal(engine, stiffness, e, force):
    """The contact accelerates the body much more than its weak flexures do."""
    own = point_mass(stiffness=stiffness, restitution=e, direction=10.0, friction=0.3)
    sim = simulation(own, {"push.x": force}, engine=engine)
    start = energy_balance(sim.outputs())
    sim.advance(0.008)
    out = sim.outputs()
    assert out["stop.impact_count"] > 0
    assert energy_balance(out) == pytest.approx(start, abs=1e-6 * out["energy.dissipated"])


@pytest.mark.parametrize("engine", ["kernel", "python"])
def test_a_hit_off_the_centre_slides_alike_on_either_side(engine):
    """The velocity along the wall is zero first, and the force turns the body to the side."""
    angles = []
    for side in (1.0, -1.0):
        stop = Stop("stop", "block", (0.11, side * 0.01), 0.0, 0.0, 0.0, 1.0, 0.3, law="compliant",
                    stiffness=1e5, exponent=1.0)  # fmt: skip
        model = oscillator(displacement=-0.02, parts={"stops": (stop,)})
        body = dataclasses.replace(model.bodies[0], inertia=1e-4)
        sim = simulation(dataclasses.replace(model, bodies=(body,)), engine=engine)
        sim.advance(0.17)
        assert sim.outputs()["stop.impact_count"] == 1
        angles.append(side * sim.outputs()["block.angle"])
    assert abs(angles[0]) > 0.05
    assert angles[1] == pytest.approx(angles[0], rel=1e-6)


# --- rules of contacts ------------------------------------------------------------------------


@pytest.mark.slow
def test_energy_is_conserved_through_all_contacts_until_rest():
    sim = Simulation(compliant("PRBDM2R", 1e6, 0.3))
    start = energy_balance(sim.outputs())
    for t in np.linspace(0.0, 0.2, 81)[1:]:
        sim.advance(float(t))
        assert energy_balance(sim.outputs()) == pytest.approx(start, rel=1e-6)
    assert sim.outputs()["stop.impact_count"] > 1


def test_a_resting_body_that_is_struck_has_the_force_of_a_hit():
    """With the reference speed of the resting contact the damping would be many times too large."""
    sim = resting(stiffness=1e7)
    sim.set({"push.impulse.x": MASS})  # To 1 m/s.
    sim.advance(sim.time + 2e-5)
    assert sim.outputs()["stop.impact_count"] == 6
    elastic = math.sqrt(1e7 / sim.outputs()["stop.point.mobility"])
    assert sim.outputs()["stop.peak_force"] == pytest.approx(0.98 * elastic, rel=0.02)


def test_a_wall_that_jumps_in_speed_raises_the_reference_speed():
    sim = Simulation(point_mass(stiffness=1e4, restitution=0.6))
    sim.advance(0.0011)
    before = sim.contacts.touching[0].reference_speed
    sim.set({"push.impulse.x": 3 * SPEED * MASS})
    sim.advance(0.00111)
    assert sim.contacts.touching[0].reference_speed > 2.5 * before


@pytest.mark.parametrize(("exponent", "stiffness"), [(1.0, 1e8), (1.5, 1e12)])
def test_the_reference_speed_at_first_touch_is_the_largest_of_the_contact(exponent, stiffness):
    """A force accelerates the body, by less than a thousandth, until the contact's equals it."""
    own = point_mass(stiffness=stiffness, exponent=exponent, displacement=-1e-9, velocity=0.02)
    sim, top, phases = Simulation(own, {"push.x": 0.1}), 0.0, set()
    while not phases:
        sim.advance(sim.time + 5e-9)
        phases |= {touching.phase for touching in sim.contacts.touching if touching}
    reference = sim.contacts.touching[0].reference_speed
    for _ in range(100):
        top = max(top, -sim.outputs()["stop.gap_rate"])
        sim.advance(sim.time + 5e-9)
        phases |= {touching.phase for touching in sim.contacts.touching if touching}
    assert phases == {Phase.PRESSED}
    assert reference / sim.outputs()["stop.approach_speed"] > 1 + 5e-5
    assert reference == pytest.approx(top, rel=5e-7)


def test_a_body_that_is_pushed_into_the_stop_raises_the_reference_speed_with_its_own():
    """A force that accelerates the body in contact: the reference speed follows its speed."""
    sim = Simulation(point_mass(stiffness=1e4, displacement=-1e-9, velocity=2e-3), {"push.x": 1.0})
    start, phases, top = energy_balance(sim.outputs()), set(), 0.0
    for _ in range(60):
        sim.advance(sim.time + 1e-5)
        touching, out = sim.contacts.touching[0], sim.outputs()
        phases.add(touching.phase if touching else None)
        top = max(top, -out["stop.gap_rate"])
        if touching and touching.phase is Phase.PRESSED:
            assert touching.reference_speed >= 0.999 * top
        assert energy_balance(out) == pytest.approx(start, abs=1e-9)
    assert {Phase.RISING, Phase.PRESSED} <= phases


@pytest.mark.parametrize("engine", ["kernel", "python"])
@pytest.mark.parametrize(
    ("acceleration", "stiffness", "speed", "e"),
    [(1e5, 1e8, 1e-3, 0.05), (1e6, 1e9, 1e-2, 0.6), (1e8, 1e8, 1e-2, 0.6)],
)
def test_a_contact_rises_under_any_acceleration(engine, acceleration, stiffness, speed, e):
    """The speed changes by more than its margin within the error of the time of an event."""
    start, rate = 1e-8, math.sqrt(stiffness / MASS)
    own = point_mass(stiffness=stiffness, restitution=e, displacement=-start, velocity=speed)
    sim = simulation(own, engine=engine)
    sim.advance(start / speed + 0.7 / rate)
    before = energy_balance(sim.outputs())
    sim.set({"push.x": MASS * acceleration})
    sim.advance(sim.time + 4.0 / rate)
    out = sim.outputs()
    assert out["stop.peak_force"] > MASS * acceleration
    assert energy_balance(out) == pytest.approx(before, abs=1e-6 * out["energy.work"])


def pulled_off():
    """Return a simulation whose body is pulled off faster than the indentation recovers."""
    sim = Simulation(point_mass(stiffness=1e5, restitution=0.05))
    sim.advance(0.00105)
    sim.set({"push.impulse.x": -1.5 * SPEED * MASS})
    sim.advance(0.001051)
    assert sim.contacts.touching[0].phase is Phase.FREE
    return sim


def test_a_free_contact_is_pressed_again_without_a_new_impact():
    """The body is pushed back while the indentation recovers: the contact goes on."""
    sim = pulled_off()
    count = sim.outputs()["stop.impact_count"]
    start = energy_balance(sim.outputs())
    assert sim.outputs()["stop.force"] == 0.0
    assert sim.outputs()["stop.gap"] < 0.0
    sim.set({"push.x": 50.0})
    while sim.contacts.touching[0].phase is Phase.FREE:
        sim.advance(sim.time + 1e-7)
        assert sim.time < 0.00106
    sim.advance(sim.time + 1e-6)
    out = sim.outputs()
    assert out["stop.force"] > 0.0
    assert out["stop.impact_count"] == count
    assert energy_balance(out) == pytest.approx(start, abs=1e-10)


def test_a_phase_that_ends_changes_although_round_off_in_the_rate_denies_it():
    """Otherwise the same event would follow again and again."""
    sim = pulled_off()
    pressed = switch(sim.configuration, sim.front, 0)
    assert pressed.contacts.touching[0].phase is Phase.PRESSED
    assert switch(sim.configuration, pressed, 0).contacts == sim.contacts


def test_a_contact_ends_when_its_gap_opens():
    """The force of the free contact is zero, and the body still touches."""
    sim = pulled_off()
    free = 0
    while not sim.outputs()["stop.contact_duration"]:
        out = sim.outputs()
        assert out["stop.contact"]
        assert out["stop.gap"] < 0.0
        assert out["stop.force"] == 0.0
        free += 1
        sim.advance(sim.time + 2e-6)
    assert free > 5
    assert sim.outputs()["stop.gap"] >= 0.0


@pytest.mark.parametrize("step", [1.0, 1e-6])
def test_equal_masses_exchange_their_velocities(step):
    """An elastic contact between equal masses stops the body; the wall takes its energy."""
    sim = Simulation(point_mass(stiffness=1e6, restitution=1.0), {"stop.mobility": 1 / MASS})
    start, x, v, total = energy_balance(sim.outputs()), 0.0, 0.0, 0.0
    while sim.time < 0.0015:
        h = min(step, 0.0015 - sim.time) if step > 1e-3 or sim.time > 9e-4 else 9e-4
        sim.advance(sim.time + h)
        impulse = sim.outputs()["stop.impulse_sum"]
        after = v + (impulse - total) / MASS
        x, v, total = x + h * (v + after) / 2, after, impulse
        if step < 1e-3:
            sim.set({"stop.displacement": x, "stop.velocity": v})
    out = sim.outputs()
    assert out["stop.impact_count"] == 1
    assert v == pytest.approx(SPEED, rel=1e-4)
    assert energy_balance(out) == pytest.approx(start, rel=1e-7)
    assert out["energy.kinetic"] + MASS * v**2 / 2 == pytest.approx(start, rel=1e-4)
    assert out["energy.work"] == pytest.approx(-start, rel=1e-4)


@pytest.mark.slow
def test_a_settled_stop_costs_no_more_than_a_rigid_one():
    steps = {}
    for own in (mechanism("PRBDM"), compliant("PRBDM", 6e7)):
        sim = Simulation(own)
        sim.advance(0.4)
        before = sim.step_count
        sim.advance(1.0)
        steps[own.stops[0].law] = sim.step_count - before
    assert steps["compliant"] <= 1.1 * steps["rigid"] + 2


@pytest.mark.parametrize(
    ("name", "ratio"), [("PRBDM", 3.3), pytest.param("PRBDM2R", 1.3, marks=pytest.mark.slow)]
)
def test_the_cost_until_rest_is_a_small_multiple_of_the_rigid_one(name, ratio):
    """The rigid 1R guide has four steps for each flight, so that the contacts dominate."""
    steps = {}
    for own in (mechanism(name), compliant(name, 6e7)):
        sim = Simulation(own)
        sim.advance(0.45)
        steps[own.stops[0].law] = sim.step_count
        assert sim.outputs()["stop.contact"]
    assert steps["compliant"] <= ratio * steps["rigid"]


def pressed_softly(restitution, speed):
    """Return a simulation of a body in balance on a stop, with a speed [m/s], and its period [s].

    The balance is at an indentation of 1e-7 m; the reference speed is that of rest.
    """
    own = point_mass(stiffness=1e7, restitution=restitution, displacement=1e-7, velocity=speed)
    sim = Simulation(own, {"push.x": 1.0})
    return sim, 2 * math.pi / math.sqrt(1e7 * sim.outputs()["stop.point.mobility"])


@pytest.mark.parametrize("restitution", [0.6, 1.0])
def test_a_vibration_below_the_speed_of_rest_settles_in_its_balance(restitution):
    """After half a period, at the next passage of the balance; its energy is a loss."""
    sim, period = pressed_softly(restitution, 5e-4)
    start = energy_balance(sim.outputs())
    sim.advance(0.45 * period)
    assert sim.contacts.touching[0].phase is Phase.PRESSED
    sim.advance(1.3 * period)
    assert sim.contacts.touching[0].phase is Phase.FROZEN
    out = sim.outputs()
    assert out["stop.gap"] == pytest.approx(-1e-7, rel=5e-3)
    assert out["stop.force"] == pytest.approx(1.0, rel=5e-3)
    assert energy_balance(out) == pytest.approx(start, abs=1e-15)


def test_an_elastic_vibration_above_the_speed_of_rest_continues():
    sim, period = pressed_softly(1.0, 1.5e-3)
    sim.advance(10 * period)
    assert sim.contacts.touching[0].phase is Phase.PRESSED


def test_a_settled_stop_is_released_when_its_force_changes():
    sim = resting(stiffness=1e7)
    for force, settled in ((1.004, True), (1.05, False)):
        sim.set({"push.x": force})
        sim.advance(sim.time + 1e-7)
        assert (sim.contacts.touching[0].phase is Phase.FROZEN) == settled
    gap = sim.outputs()["stop.gap"]
    sim.advance(sim.time + 0.01)
    assert sim.contacts.touching[0].phase is Phase.FROZEN
    out = sim.outputs()
    assert out["stop.force"] == pytest.approx(1.05, rel=1e-6)
    assert -out["stop.gap"] == pytest.approx(1.05e-7, rel=0.01)
    assert out["stop.gap"] < gap


def test_a_settled_stop_opens_when_the_body_is_pulled_off():
    sim = resting(stiffness=1e7)
    sim.set({"push.x": -1.0})
    sim.advance(sim.time + 1e-3)
    out = sim.outputs()
    assert not out["stop.contact"]
    assert out["stop.force"] == 0.0
    assert out["mass.vx"] == pytest.approx(-1.0 / MASS * 1e-3, rel=1e-2)


def test_a_penetrated_stop_at_release_pushes_the_body_off():
    sim = Simulation(point_mass(stiffness=1e5, restitution=1.0, displacement=1e-4, velocity=0.0))
    assert sim.outputs()["stop.force"] == pytest.approx(10.0, rel=1e-9)
    assert sim.outputs()["energy.elastic"] == pytest.approx(5e-4, rel=1e-9)
    sim.advance(0.0008)
    out = sim.outputs()
    assert out["energy.kinetic"] == pytest.approx(5e-4, rel=1e-6)
    assert out["stop.impact_count"] == 0
    assert out["stop.peak_force"] == pytest.approx(10.0, rel=1e-9)


def test_peaks_and_outputs_do_not_depend_on_the_communication_points():
    coarse, fine = (Simulation(point_mass(stiffness=1e6, restitution=0.3)) for _ in range(2))
    coarse.advance(0.0015)
    largest = 0.0
    while fine.time < 0.0015 - 1e-9:
        fine.advance(min(fine.time + 3.7e-6, 0.0015))
        out = fine.outputs()
        if out["stop.contact"]:
            largest = max(largest, out["stop.force"])
            assert out["stop.peak_force"] >= largest * (1 - 1e-9)
    for name in ("peak_force", "indentation", "contact_duration", "impulse", "rebound_speed"):
        assert fine.outputs()[f"stop.{name}"] == coarse.outputs()[f"stop.{name}"]


@pytest.mark.parametrize("time", [0.00103, 0.00115, 0.02])
def test_a_state_saved_in_contact_restores_to_the_same_motion(time):
    values = {"push.x": 1.0} if time == 0.02 else {}
    velocity = 0.0 if values else SPEED
    sim = Simulation(point_mass(stiffness=1e6, restitution=0.1, velocity=velocity), values)
    sim.advance(time)
    assert sim.contacts.touching[0]
    saved = json.dumps(sim.snapshot())
    other = Simulation(sim.mechanism)
    other.restore(json.loads(saved))
    assert json.dumps(other.snapshot()) == saved
    for one in (sim, other):
        one.advance(time + 0.01)
    assert json.dumps(other.snapshot()) == json.dumps(sim.snapshot())


def test_rigid_stops_have_no_outputs_of_compliant_ones():
    out = Simulation(mechanism("PRBDM")).outputs()
    assert not {"stop.peak_force", "stop.indentation", "stop.contact_duration"} & out.keys()


# --- rejections -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"law": "soft"}, "stop.law = 'soft': choose one of rigid, compliant"),
        ({"stiffness": None}, "stop.stiffness is missing"),
        ({"law": "rigid"}, "a rigid stop has no stiffness"),
    ],
)
def test_inconsistent_laws_are_rejected(keys, message):
    with pytest.raises(MechanismError, match=message):
        point_mass(**keys)


def test_an_indentation_beyond_the_size_is_rejected():
    soft = {"stiffness": 1e-3, "position": -0.03}
    sim = Simulation(point_mass(velocity=1.0, displacement=0.0, **soft))
    with pytest.raises(SimulationError, match="more than the size of the mechanism"):
        sim.advance(0.1)
    with pytest.raises(SimulationError, match="more than the size of the mechanism"):
        Simulation(point_mass(velocity=0.0, displacement=0.03, **soft))
