"""Simulations: impacts, rest, friction, moving walls, saved states and rejected values."""

import dataclasses
import json
import math

import numpy as np
import pytest

from prbm.base.errors import EquilibriumError, ParameterError, SimulationError
from prbm.hybrid import events
from prbm.hybrid.events import Event, EventKind
from prbm.hybrid.simulation import Simulation
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.contact_state import ContactMode
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Friction, Release, Stop
from support import ScalarGuide, energy_balance, mechanism, simulation

WEIGHTLESS_UNDAMPED = {"gravity.x": 0.0, "damping.beta": 0.0}


def guide(values):
    return ScalarGuide.of(mechanism("PRBDM").values(values))


# --- friction point ---------------------------------------------------------------------------


def test_coulomb_friction_reduces_the_amplitude_linearly():
    """A linear oscillator loses 2 mu N/k of its amplitude in each half period."""
    mu_N, x0 = 2e-3, -1e-3
    values = WEIGHTLESS_UNDAMPED | {
        "release.displacement": x0, "stop.position": 0.01,
        "friction.coefficient": 1.0, "friction.normal_force": mu_N,
    }  # fmt: skip
    one = guide(values)
    stiffness = 4 * one.k / one.r**2
    sim = simulation("PRBDM", values, tolerance=1e-11)
    omega = 2 * math.pi * sim.frequency
    amplitude = abs(x0)
    for half in range(1, 4):
        amplitude -= 2 * mu_N / stiffness
        sim.advance(half * math.pi / omega)
        # The deviation from a linear oscillator is (x/r)^2 = 1e-3.
        assert abs(sim.outputs()["shuttle.x"]) == pytest.approx(amplitude, rel=2e-3)


def test_friction_sticks_where_it_exceeds_the_spring_force():
    """The motion ends with |k x| <= mu N; the remaining energy is elastic."""
    values = WEIGHTLESS_UNDAMPED | {
        "release.displacement": -1e-3, "stop.position": 0.01,
        "friction.coefficient": 0.5, "friction.normal_force": 0.02,
    }  # fmt: skip
    one = guide(values)
    sim = simulation("PRBDM", values)
    sim.advance(1.0)
    out = sim.outputs()
    assert sim.contacts.modes[1] is ContactMode.STICK
    assert abs(out["shuttle.vx"]) < 1e-12
    assert 4 * one.k / one.r**2 * abs(out["shuttle.x"]) <= 0.01 * (1 + 1e-3)
    assert out["energy.elastic"] + out["energy.dissipated"] == pytest.approx(
        one.potential(math.asin(1e-3 / one.r)), rel=1e-5
    )


def test_sliding_reverses_when_residual_speed_is_below_time_resolution():
    """At 1e5 m/s^2, the time resolution of 1e-13 s leaves a residual speed of 1e-8 m/s."""
    cord = FlexureType("cord", "2R", 1e-4, 1e-2, 1e11, 1e3, axial=True)
    body = Body("body", 0.02, 1e-5, (0.1, 0.0), {"end": (0.1, 0.0)})
    mechanism = Mechanism(
        name="Cord",
        title="A body on a cord, with friction along it",
        ground={"clamp": (0.0, 0.0)},
        bodies=(body,),
        flexure_types=(cord,),
        flexures=(Flexure("flexure", "cord", "ground.clamp", "body.end", ("clamp", "free")),),
        frictions=(Friction("rub", "body", coefficient=0.3, normal_force=0.02),),
        release=Release("body", velocity=0.5),
    )
    sim = Simulation(mechanism)
    assert sim.contacts.modes == (ContactMode.SLIP_POSITIVE,)
    front = sim.front
    front.q[sim.system.stretches] = 0.05
    row = sim.equations.slip_row(0, front.e)
    front.v[:] = 1e-8 * row / (row @ row)
    front, _ = events.apply(sim.configuration, front, Event(EventKind.REVERSAL, 0, 0.0))
    assert front.contacts.modes == (ContactMode.SLIP_NEGATIVE,)


def test_a_sticking_shuttle_slides_when_the_force_exceeds_friction():
    """Up to mu N the shuttle sticks.  Beyond, the force minus mu N accelerates it."""
    values = WEIGHTLESS_UNDAMPED | {
        "release.displacement": 0.0, "stop.position": 0.02,
        "friction.coefficient": 1.0, "friction.normal_force": 0.5,
    }  # fmt: skip
    sim = simulation("PRBDM", values)
    sim.set({"force.x": 0.49})
    sim.advance(0.01)
    assert sim.outputs()["shuttle.x"] == pytest.approx(0.0, abs=1e-15)
    sim.set({"force.x": 0.6})
    sim.advance(0.0101)
    acceleration = 0.1 / guide(values).mass
    assert sim.outputs()["shuttle.vx"] == pytest.approx(acceleration * 1e-4, rel=1e-4)


def test_normal_force_grows_towards_the_neutral_position():
    """N = max(0, N0 + k y): there is no friction where y < -N0/k, far from the neutral position."""
    values = WEIGHTLESS_UNDAMPED | {
        "release.displacement": -0.01, "stop.position": 0.05,
        "friction.coefficient": 1.0, "friction.normal_force": 0.01,
        "friction.normal_stiffness": 1e3,
    }  # fmt: skip
    sim = simulation("PRBDM", values)
    early = sim.outputs()
    assert 0.01 + 1e3 * early["shuttle.y"] < 0
    sim.advance(1e-3)
    assert sim.outputs()["energy.dissipated"] == 0.0
    sim.advance(0.2)
    assert sim.outputs()["energy.dissipated"] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_stop_carries_the_load_of_a_body_at_rest_with_friction(model):
    """The stop force is constant, and the friction point of a body at rest is frictionless."""
    values = {"friction.coefficient": 0.3, "friction.normal_force": 0.2}
    sim = simulation(model, values)
    sim.advance(0.6)
    first = sim.outputs()
    sim.advance(1.0)
    out = sim.outputs()
    assert first["stop.contact"]
    assert out["stop.contact"]
    assert sim.contacts.modes[1] is ContactMode.FRICTIONLESS
    assert out["stop.force"] == pytest.approx(first["stop.force"], rel=1e-3)
    assert energy_balance(out) == pytest.approx(
        energy_balance(simulation(model).outputs()), rel=1e-6
    )


# --- friction at the stop ---------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_friction_at_the_stop_does_not_gain_energy(model, restitution):
    """Impacts at a bent shape slide along the wall; the dissipated energy never decreases."""
    values = {
        "stop.position": -0.005, "stop.friction": 0.4, "stop.offset": 0.003,
        "stop.restitution": restitution,
    }  # fmt: skip
    sim = simulation(model, values)
    start = energy_balance(sim.outputs())
    dissipated = 0.0
    for t in np.linspace(0, 0.4, 201)[1:]:
        sim.advance(t)
        out = sim.outputs()
        assert out["energy.dissipated"] >= dissipated - 1e-12
        dissipated = out["energy.dissipated"]
        assert energy_balance(out) == pytest.approx(start, abs=1e-7 * 0.02)
        assert out["stop.gap"] > -1e-9
    assert sim.record
    for impact in sim.record:
        assert impact.latched.energy_lost >= -1e-15


@pytest.mark.slow
def test_a_sliding_contact_remains_closed():
    """The stop has friction, and is away from the straight shape."""
    values = {"stop.position": -0.01, "stop.friction": 0.2, "release.displacement": -0.0101}
    sim = simulation("PRBDM2R", values)
    sim.advance(0.5)
    out = sim.outputs()
    assert out["stop.contact"]
    assert out["stop.force"] > 0


# --- walls ------------------------------------------------------------------------------------


def test_a_moving_wall_hits_a_shuttle_at_rest_by_newtons_law():
    """In the frame of the wall: v+ = (1 + eps) w; the work of the wall is P w."""
    values = WEIGHTLESS_UNDAMPED | {
        "release.displacement": 0.0,
        "stop.position": 1e-4,
        "stop.restitution": 0.5,
    }
    sim = simulation("PRBDM", values)
    sim.set({"stop.velocity": -0.1})
    t = 0.0
    while not sim.record:
        t += 1e-4
        sim.set({"stop.displacement": -0.1 * (t - 1e-4)})
        sim.advance(t)
    (impact,) = sim.record
    assert impact.time == pytest.approx(1e-3, abs=1e-9)
    assert impact.latched.approach_speed == pytest.approx(0.1, rel=1e-6)
    mass = guide(values).mass
    assert impact.impulse == pytest.approx(mass * 1.5 * 0.1, rel=1e-5)
    out = sim.outputs()
    assert out["energy.work"] == pytest.approx(impact.impulse * 0.1, rel=1e-9)
    assert energy_balance(out) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_shuttle_at_rest_follows_a_slowly_accelerated_wall(model):
    """The contact remains closed, without impacts, and the wall does the work."""
    sim = simulation(model)
    for k in range(200):
        sim.advance(0.4 + (k + 1) * 1e-3)
    start, impacts = energy_balance(sim.outputs()), len(sim.record)
    size, rate = 1e-3, math.pi / 0.2
    for k in range(200):
        past = rate * (sim.time - 0.6)
        sim.set({
            "stop.displacement": -size * (1 - math.cos(past)),
            "stop.velocity": -size * rate * math.sin(past),
        })  # fmt: skip
        sim.advance(0.6 + (k + 1) * 1e-3)
        out = sim.outputs()
        assert out["stop.contact"]
        assert abs(out["stop.gap"]) < 1e-12
        assert energy_balance(out) == pytest.approx(start, abs=1e-9)
    assert len(sim.record) == impacts
    assert out["shuttle.x"] == pytest.approx(-2e-3, rel=1e-3)
    assert out["energy.work"] > 0


def test_a_wall_that_starts_with_a_velocity_moves_the_body_at_rest_on_it():
    """The wall reaches its velocity within two steps: the body is pushed without an impact.

    The wall decelerates faster than gravity at the end, so that the body flies for a short time.
    """
    sim = simulation("PRBDM", {"damping.beta": 0.0})
    for k in range(100):
        sim.advance(0.3 + (k + 1) * 1e-3)
    count, start = len(sim.record), energy_balance(sim.outputs())
    for k in range(40):
        sim.set({"stop.displacement": -2e-5 * k, "stop.velocity": -0.02})
        sim.advance(0.4 + (k + 1) * 1e-3)
        if k == 0:
            assert sim.outputs()["stop.contact"]
            assert len(sim.record) == count
    out = sim.outputs()
    assert energy_balance(out) == pytest.approx(start, abs=1e-9)
    assert out["stop.contact"]
    assert out["shuttle.vx"] == pytest.approx(-0.02, rel=1e-9)


def test_a_contact_opens_when_its_force_is_zero():
    """A force pulls the shuttle off its stop; without the force, the gap closes again."""
    sim = simulation("PRBDM", {"damping.beta": 0.0})
    sim.advance(0.4)
    weight = sim.outputs()["stop.force"]
    sim.set({"force.x": -0.99 * weight})
    sim.advance(0.41)
    assert sim.outputs()["stop.contact"]
    sim.set({"force.x": -1.5 * weight})
    sim.advance(0.45)
    out = sim.outputs()
    assert not out["stop.contact"]
    assert out["stop.gap"] > 1e-4
    sim.set({"force.x": 0.0})
    sim.advance(1.0)
    assert sim.outputs()["stop.contact"]


def test_base_acceleration_acts_like_opposite_gravity():
    """The work of the base acceleration is part of energy.work, that of gravity is potential."""
    values = {"release.displacement": 0.0, "stop.position": 0.05}
    # Damping and error scales depend on gravity only; a small tolerance hides the difference.
    falls = simulation("PRBDM", values | {"gravity.x": 9.81}, tolerance=1e-12)
    shaken = simulation("PRBDM", values | {"gravity.x": 0.0}, tolerance=1e-12)
    shaken.set({"base.acceleration.x": -9.81})
    for sim in (falls, shaken):
        sim.advance(0.08)
    a, b = falls.outputs(), shaken.outputs()
    assert b["shuttle.x"] == pytest.approx(a["shuttle.x"], rel=1e-9)
    assert b["energy.work"] == pytest.approx(-a["energy.gravitational"], rel=1e-9)
    assert b["base.force.x"] == pytest.approx(a["base.force.x"], rel=1e-8)


@pytest.mark.slow
def test_impulse_of_the_base_force_equals_the_change_of_momentum():
    """Integral of (base force - loads) = - change of momentum, without impacts."""
    values = WEIGHTLESS_UNDAMPED | {"stop.position": 0.05, "release.displacement": -0.01}
    sim = simulation("PRBDM2R", values, tolerance=1e-11)
    n, times = sim.system.n, np.linspace(0, 0.01, 2001)

    def momentum():
        y = sim.state()
        v = 1j * np.exp(1j * y[:n]) * y[n : 2 * n]
        return complex(sim.system.m @ (sim.system.A @ v))

    start, forces = momentum(), []
    for t in times:
        sim.advance(t)
        out = sim.outputs()
        forces.append(complex(out["base.force.x"], out["base.force.y"]))
    from scipy.integrate import simpson

    impulse = simpson(forces, x=times)
    assert momentum() - start == pytest.approx(-impulse, abs=1e-7 * abs(impulse))


# --- errors -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"flexure.length": -0.02}, "flexure.length = -0.02 m must be at least"),
        ({"flexure.length": 0.0}, "flexure.length = 0 m"),
        ({"shuttle.mass": 0.0}, "shuttle.mass = 0 kg"),
        ({"shuttle.mass": -1.0}, "shuttle.mass = -1 kg"),
        ({"stop.restitution": 1.5}, "stop.restitution = 1.5 must be at most 1"),
        ({"flexure.thickness": math.nan}, "flexure.thickness = nan m must be a finite number"),
        ({"gravity.x": math.inf}, "gravity.x = inf m/s2"),
        ({"force.x": math.nan}, "force.x = nan"),
        ({"stop.position": -0.019}, "penetrated by 0.001 m at release"),
        ({"stop.positon": 0.0}, "did you mean stop.position"),
        ({"flexure.gamma": 1.2}, "flexure.gamma = 1.2 must be at most 1"),
        ({"solver.tolerance": 0.0}, "solver.tolerance = 0"),
    ],
)
def test_error_about_an_invalid_value_has_its_name_value_and_unit(values, words):
    with pytest.raises(ParameterError) as caught:
        Simulation(mechanism("PRBDM"), values)
    assert words in str(caught.value)


def test_links_longer_than_the_flexure_are_rejected():
    with pytest.raises(ParameterError, match=r"gamma0 = -0\.04"):
        Simulation(mechanism("PRBDM2R"), {"flexure.gamma1": 0.58})


@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_displacement_at_release_that_is_out_of_reach_is_rejected(model):
    with pytest.raises(EquilibriumError, match=r"displacement = -0\.05 m cannot be reached"):
        Simulation(mechanism(model), {"release.displacement": -0.05})


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
@pytest.mark.parametrize(("modulus", "hint"), [(2.0, True), (2e11, False)])
def test_a_release_out_of_reach_from_the_start_has_a_hint_at_units(modulus, hint, engine):
    """The unit of Young's modulus may be missing."""
    values = {"flexure.youngs_modulus": modulus, "gravity.x": 0.0, "gravity.y": -9.81}
    with pytest.raises(EquilibriumError, match="cannot be reached") as caught:
        engine(mechanism("GuideBeam"), values | {"release.displacement": -0.2})
    assert ("check the units of youngs_modulus and thickness" in str(caught.value)) is hint


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_a_body_that_turns_freely_without_gravity_is_rejected_with_a_hint_at_its_pins(engine):
    """Nothing determines the angle of a body on a leaf with pins at both ends."""
    arm = mechanism("Cantilever")
    (leaf,) = arm.flexures
    free = dataclasses.replace(arm, flexures=(dataclasses.replace(leaf, ends=("pin", "pin")),))
    given = {"gravity.x": 0.0, "gravity.y": 0.0, "release.displacement": 1e-3}
    with pytest.raises(EquilibriumError, match=r"turns freely on pins.*add gravity") as caught:
        engine(free, given)
    assert "youngs_modulus" not in str(caught.value)


def test_an_earlier_or_invalid_time_is_rejected():
    sim = simulation("PRBDM")
    sim.advance(0.01)
    with pytest.raises(SimulationError, match="not before the present time"):
        sim.advance(0.005)
    with pytest.raises(SimulationError):
        sim.advance(math.nan)
    with pytest.raises(SimulationError, match="both times are in seconds"):
        sim.advance(1e300)


def test_a_rejected_change_does_not_change_any_value():
    """A change of a fixed parameter, or of a value to an invalid one, rejects all changes."""
    sim = simulation("PRBDM")
    sim.advance(0.01)
    with pytest.raises(ParameterError, match=r"flexure\.length is a fixed"):
        sim.set({"stop.restitution": 0.3, "flexure.length": 0.05})
    with pytest.raises(ParameterError, match="at most 1"):
        sim.set({"damping.zeta": 0.1, "stop.restitution": 2.0})
    assert sim.values["damping.zeta"] == 0.0
    assert sim.values["stop.restitution"] == 0.6


@pytest.mark.slow
def test_endless_chatter_is_an_error():
    """Endless elastic bounces of half a microsecond under a huge force."""
    values = WEIGHTLESS_UNDAMPED | {
        "release.displacement": -1e-8, "stop.restitution": 1.0, "stop.rest_speed": 0.0,
        "force.x": 17000.0,
    }  # fmt: skip
    sim = simulation("PRBDM", values)
    with pytest.raises(SimulationError, match="chatters"):
        sim.advance(0.01)
    assert sim.time == 0.0, "the last valid state must be kept"
    assert sim.outputs()["stop.gap"] == pytest.approx(1e-8, rel=1e-6)


def test_a_release_at_the_wall_starts_in_rest():
    """Gravity presses the shuttle against the wall; there is no impact."""
    sim = simulation("PRBDM2R", {"release.displacement": 0.0})
    assert sim.outputs()["stop.contact"]
    sim.advance(0.1)
    out = sim.outputs()
    assert out["stop.contact"]
    assert out["stop.impact_count"] == 0


def test_a_release_at_the_wall_with_a_velocity_starts_with_an_impact():
    sim = Simulation(
        mechanism("PRBDM"),
        {"release.displacement": 0.0, "release.velocity": 0.3} | WEIGHTLESS_UNDAMPED,
    )
    out = sim.outputs()
    assert out["stop.impact_count"] == 1
    assert out["shuttle.vx"] == pytest.approx(-0.6 * 0.3, rel=1e-12)


# --- communication points ---------------------------------------------------------------------


@pytest.mark.slow
def test_the_trajectory_does_not_depend_on_the_communication_points():
    coarse, fine = simulation("PRBDM2R"), simulation("PRBDM2R")
    coarse.advance(0.12)
    for t in np.sort(np.random.default_rng(0).uniform(0, 0.12, 400)):
        fine.advance(float(t))
        fine.outputs()
    fine.advance(0.12)
    assert fine.outputs() == coarse.outputs()


@pytest.mark.parametrize(
    ("model", "time", "end"),
    [("PRBDM", 0.0, 0.4), ("PRBDM", 0.241, 0.4), ("PRBDM2R", 0.0405, 0.12), ("PRBDM", 0.3, 0.4)],
)
def test_a_restored_state_continues_bit_by_bit(model, time, end):
    """The state has been converted to JSON and back."""
    sim = simulation(model, {"stop.friction": 0.1})
    sim.set({"force.x": 0.01})
    sim.advance(time)
    saved = json.loads(json.dumps(sim.snapshot()))
    sim.advance(end)
    expected = sim.outputs()
    other = Simulation(mechanism(model))
    other.restore(saved)
    other.advance(end)
    assert other.outputs() == expected
    sim.restore(saved)
    sim.advance(end)
    assert sim.outputs() == expected


@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_state_saved_between_a_change_and_its_step_is_complete(model):
    """The changes act in the next step, also after the state is restored."""
    sim = simulation(model, {"release.displacement": -0.002})
    sim.advance(0.3)
    before = sim.outputs()
    changes = {"force.x": 0.05, "stop.offset": 0.002, "base.acceleration.y": 1.0}
    sim.set(changes | {"stop.velocity": -1e-4, "damping.zeta": 0.01})
    saved = json.loads(json.dumps(sim.snapshot()))
    other = simulation(model)
    other.restore(saved)
    assert sim.outputs() == other.outputs() == before
    assert other.values == sim.values
    assert other.given == sim.given
    for one in (sim, other):
        one.advance(0.31)
    assert sim.outputs() == other.outputs()
    assert sim.outputs()["base.force.y"] != before["base.force.y"]


def test_a_state_of_another_mechanism_is_rejected():
    with pytest.raises(ParameterError, match="another mechanism"):
        simulation("PRBDM").restore(simulation("PRBDM2R").snapshot())


def test_a_time_that_is_too_large_to_resolve_a_step_is_an_error():
    sim = simulation("PRBDM", start_time=1e18)
    with pytest.raises(SimulationError, match="nearer to zero"):
        sim.advance(1e18 + 1e3)


def test_a_start_time_shifts_the_impacts():
    late = simulation("PRBDM", start_time=5.0)
    early = simulation("PRBDM")
    late.advance(5.2)
    early.advance(0.2)
    assert late.record[2].time == pytest.approx(early.record[2].time + 5.0, abs=1e-9)


# --- linkages ---------------------------------------------------------------------------------


def linkage(**parts):
    """Return a bar between two pins that carries a body: a double pendulum without springs."""
    return Mechanism(
        name="Linkage",
        title="A double pendulum without gravity",
        ground={"pin": (0.0, 0.0)},
        bodies=(Body("body", 0.05, 1e-5, (0.11, -0.004), {"pin": (0.1, 0.0)}),),
        flexure_types=(FlexureType("bar", "2R", 1e-3, 1e-2, 1e9, 1e3),),
        flexures=(Flexure("bar1", "bar", "ground.pin", "body.pin", ("pin", "pin")),),
        release=Release("body", direction=90.0, velocity=1.0),
        **parts,
    )


def test_a_linkage_without_springs_keeps_its_energy_and_angular_momentum():
    """The angular momentum about the pin is constant up to the first impact, the energy always."""
    sim = Simulation(linkage(stops=(Stop("stop", "body", (0.1, 0.0), 90.0, 0.02),)))
    assert sim.frequency == 0.0
    before = sim.outputs()["energy.kinetic"]
    sim.record = []
    sim.advance(0.015)
    assert sim.outputs()["energy.kinetic"] == pytest.approx(before, rel=1e-8)
    system, n = sim.system, sim.system.n

    def momentum():
        q, v = sim.state()[:n], sim.state()[n : 2 * n]
        e = system.directions(q)
        z, u = system.A @ e, 1j * (system.A @ (e * v))
        return float((system.m * (z.conj() * u).imag).sum() + system.J @ v)

    angular = momentum()
    sim.advance(0.017)
    assert momentum() == pytest.approx(angular, rel=1e-8)
    sim.advance(0.1)
    assert sim.record
    assert energy_balance(sim.outputs()) == pytest.approx(before, rel=1e-7)


@pytest.mark.parametrize("ends", [("clamp", "pin"), ("pin", "clamp")])
def test_a_linkage_without_springs_has_the_frequency_zero(ends):
    """The frequency is exactly zero, not 1e-6 Hz of round-off."""
    parts = linkage()
    flexure = Flexure("bar1", "bar", "ground.pin", "body.pin", ends)
    sim = Simulation(dataclasses.replace(parts, flexures=(flexure,)))
    assert sim.frequency == 0.0
    with_weight = Simulation(parts, {"gravity.x": 9.81})
    assert 1.0 < with_weight.frequency < 2.0


def test_a_release_velocity_that_the_loops_forbid_is_rejected():
    """A straight guide of rigid links cannot move along its flexures."""
    guide = mechanism("PRBDM")
    upwards = dataclasses.replace(guide, release=dataclasses.replace(guide.release, direction=90.0))
    values = {"release.displacement": 0.0, "release.velocity": 0.1, "gravity.x": 0.0}
    with pytest.raises(
        ParameterError, match=r"release.velocity = 0.1 m/s: the body shuttle cannot"
    ):
        Simulation(upwards, values)


def test_gap_rows_are_recomputed_for_a_new_offset_but_not_after_an_impact():
    """The recomputed rows equal those of a simulation that starts with the offset."""
    sim = simulation("PRBDM2R")
    rows = sim.system.gap_rows
    sim.advance(0.05)
    assert len(sim.record) >= 1
    assert sim.system.gap_rows is rows
    sim.set({"stop.offset": 2e-3})
    sim.advance(0.051)
    fresh = simulation("PRBDM2R", {"stop.offset": 2e-3})
    np.testing.assert_array_equal(sim.system.gap_rows.B, fresh.system.gap_rows.B)
    assert not np.array_equal(sim.system.gap_rows.B, rows.B)


def test_a_first_step_that_is_too_long_for_axial_modes_is_rejected_and_repeated():
    """The axial modes of a chain are a thousand times faster than the mode of the first step."""
    from dataclasses import replace

    guide = mechanism("PRBDM2R")
    kinds = tuple(
        replace(k, model="nR", n=2, axial=True, coefficients={}) for k in guide.flexure_types
    )
    sim = Simulation(replace(guide, flexure_types=kinds), tolerance=1e-7)
    start = energy_balance(sim.outputs())
    sim.advance(1e-4)
    assert energy_balance(sim.outputs()) == pytest.approx(start, abs=1e-9)
