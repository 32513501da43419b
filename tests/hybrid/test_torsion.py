"""Torsion at joints: springs, free angles and dampers, in both engines."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from exchange import assert_directional
from free_bodies import ball, pendulum
from prbm.analysis.linear_model import linearize
from prbm.base.errors import MechanismError, ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.hybrid.stability import FastestMode
from prbm.mechanics.assembly import assemble
from prbm.mechanics.inputs import input_names
from prbm.mechanics.modal import damping, modes
from prbm.mechanics.statics import equilibrium, holding_stiffness
from prbm.mechanism.parts import Body, Force, Joint, Release
from prbm.runs.engine import simulation as started
from springs import four_bar
from support import energy_balance

K = 0.7  # N m/rad
engines = pytest.mark.parametrize(
    "engine", ["python", pytest.param("kernel", marks=pytest.mark.native)]
)


J = 2e-3 + 0.5 * 0.3**2  # kg m2 of the pendulum about its pin.
OMEGA = math.sqrt(K / J)


def sprung(angle=0.2, free=None, damping=None, gravity=(0.0, 0.0), **parts):
    """Return a pendulum with torsion at its pin, which turns across gravity."""
    swing = pendulum(angle)
    pin = replace(swing.joints[0], stiffness=K, free_angle=free, damping=damping)
    return replace(swing, joints=(pin,), gravity=gravity, **parts)


@engines
def test_a_torsional_pendulum_vibrates_harmonically(engine):
    """J q'' + k q = 0 about the pin, for any amplitude."""
    omega = OMEGA
    sim = started(sprung(2.0), {}, engine=engine, tolerance=1e-11)
    assert sim.outputs()["energy.elastic"] == pytest.approx(0.5 * K * 2.0**2)
    for t in np.linspace(0.1, 5.0, 5):
        sim.advance(float(t))
        out = sim.outputs()
        assert out["bob.angle"] == pytest.approx(2.0 * math.cos(omega * t), abs=1e-7)
        assert out["mode.frequency"] == pytest.approx(omega / (2 * math.pi))
        balance = out["energy.kinetic"] + out["energy.elastic"]
        assert balance == pytest.approx(0.5 * K * 2.0**2, rel=1e-8)


@engines
def test_damping_in_proportion_to_stiffness_damps_the_spring(engine):
    """The amplitude falls as exp(-beta omega^2 t/2)."""
    omega = OMEGA
    sim = started(sprung(0.5), {"damping.beta": 0.01}, engine=engine, tolerance=1e-11)
    decay = 0.5 * 0.01 * omega**2
    vibration = math.sqrt(omega**2 - decay**2)
    sim.advance(2 * math.pi / vibration)
    expected = 0.5 * math.exp(-decay * 2 * math.pi / vibration)
    assert sim.outputs()["bob.angle"] == pytest.approx(expected, abs=1e-7)


@engines
def test_two_free_bodies_on_a_sprung_joint_turn_against_each_other(engine):
    """Their reduced inertia is J1 J2/(J1 + J2), and the angular momentum is zero."""
    pin = {"pin": (0.0, 0.0)}
    pair = ball(
        gravity=(0.0, 0.0), stops=(),
        bodies=(Body("one", 1.0, 2e-3, (0.0, 0.0), pin), Body("two", 1.0, 3e-3, (0.0, 0.0), pin)),
        joints=(Joint("pin", "two.pin", "one.pin", K),), release=Release("two", angle=0.3),
    )  # fmt: skip
    sim = started(pair, {}, engine=engine, tolerance=1e-11)
    omega = math.sqrt(K * (1 / 2e-3 + 1 / 3e-3))
    for t in np.linspace(0.0, 0.5, 6):
        sim.advance(float(t))
        out = sim.outputs()
        turned = 0.3 * math.cos(omega * t)
        assert out["two.angle"] - out["one.angle"] == pytest.approx(turned, abs=1e-7)
        assert 2e-3 * out["one.omega"] + 3e-3 * out["two.omega"] == pytest.approx(0.0, abs=1e-9)


def test_a_moment_turns_the_body_by_moment_over_stiffness():
    pushed = sprung(forces=(Force("push", "bob"),))
    system = assemble(pushed, pushed.values({"pin.stiffness": 2.0}))
    shape = equilibrium(system, loads={"push.moment": 0.5})
    assert shape.q[system.released.j] == pytest.approx(0.25)
    assert holding_stiffness(system, equilibrium(system, 0.1)) == pytest.approx(2.0)


@engines
@pytest.mark.parametrize("zeta", [0.1, 1.0, 2.5])
def test_a_damper_at_the_pin_damps_the_vibration_about_the_free_angle(engine, zeta):
    """J q'' + c q' + k (q - q0) = 0, at rest 0.3 rad away from q0 at the start."""
    model = sprung(0.5, free=0.2, damping=2.0 * zeta * J * OMEGA)
    sim = started(model, {}, engine=engine, tolerance=1e-11)
    assert sim.outputs()["mode.frequency"] == pytest.approx(OMEGA / (2.0 * math.pi))
    roots = np.roots([1.0, 2.0 * zeta * OMEGA, OMEGA**2]).astype(complex)
    for t in (0.1, 0.4, 1.1):
        sim.advance(t)
        out = sim.outputs()
        if zeta == 1.0:
            share = (1.0 + OMEGA * t) * math.exp(-OMEGA * t)
        else:
            one, two = roots
            share = ((one * np.exp(two * t) - two * np.exp(one * t)) / (one - two)).real
        assert out["bob.angle"] == pytest.approx(0.2 + 0.3 * share, abs=1e-8)
        assert out["energy.elastic"] == pytest.approx(0.5 * K * (0.3 * share) ** 2, abs=1e-9)
        assert energy_balance(out) == pytest.approx(0.5 * K * 0.3**2, rel=1e-8)


def test_a_linear_model_has_the_frequency_and_the_damping_ratio_of_the_pendulum():
    """The rest position q has k (q - q0) = -m g l sin q; then omega^2 = (k + m g l cos q)/J."""
    weight = 0.5 * 9.81 * 0.3
    model = sprung(0.0, free=1.0, damping=0.02, gravity=(0.0, -9.81))
    system = assemble(model, model.values())
    rest = brentq(lambda q: K * (q - 1.0) + weight * math.sin(q), 0.0, 1.0)
    shape = equilibrium(system)
    assert shape.q[system.released.j] == pytest.approx(rest, rel=1e-10)
    omega = math.sqrt((K + weight * math.cos(rest)) / J)
    found = modes(system, shape)
    assert found.frequency[0] == pytest.approx(omega / (2.0 * math.pi), rel=1e-9)
    assert damping(system, found, shape.q)[0] == pytest.approx(0.02 / (2.0 * J * omega), rel=1e-9)
    A = linearize(model, inputs=["base.acceleration.x"], outputs=["bob.angle"]).A
    root = next(x for x in np.linalg.eigvals(A) if x.imag > 0.0)
    assert abs(root) == pytest.approx(omega, rel=1e-9)
    assert -root.real / abs(root) == pytest.approx(0.02 / (2.0 * J * omega), rel=1e-9)


@engines
@pytest.mark.parametrize("closing", [False, True])
def test_a_free_angle_is_a_constant_moment(engine, closing):
    """A spring with phi0 moves the bodies as one without it and the moments k phi0 on them."""
    turned = four_bar(stiffness=0.04, free_angle=0.5, damping=1e-4)
    plain = four_bar(stiffness=0.04, damping=1e-4)
    if closing:  # The moment on the third link is the opposite one.
        turned, plain = (replace(one, joints=one.joints[::-1]) for one in (turned, plain))
    plain = replace(plain, forces=(*plain.forces, Force("back", "cd")))
    moments = {"push.moment": 0.04 * 0.5, "back.moment": -0.04 * 0.5}
    one = started(turned, {}, engine=engine, tolerance=1e-11)
    two = started(plain, moments, engine=engine, tolerance=1e-11)
    angle = one.outputs()["ab.angle"]
    assert angle == pytest.approx(two.outputs()["ab.angle"]) == pytest.approx(0.3)
    for t in (0.05, 0.2):
        one.advance(t)
        two.advance(t)
        found, expected = one.outputs(), two.outputs()
        for name in ("ab.angle", "bc.x", "cd.omega", "energy.dissipated"):
            assert found[name] == pytest.approx(expected[name], rel=1e-6, abs=1e-7)


@engines
def test_torsion_in_a_loop_keeps_the_balance_of_energy(engine):
    model = four_bar(stiffness=0.04, free_angle=-0.6, damping=3e-4)
    sim = started(model, {"push.x": 0.2, "damping.beta": 1e-4}, engine=engine, tolerance=1e-11)
    whole = energy_balance(sim.outputs())
    for t in (0.1, 0.3, 0.6):
        sim.advance(t)
        assert energy_balance(sim.outputs()) == pytest.approx(whole, rel=1e-8)
    assert sim.outputs()["energy.dissipated"] > 1e-4


@engines
def test_a_stiff_damper_at_a_pin_limits_the_step_before_it_is_unstable(engine):
    """The pendulum creeps with the rate k/c, in steps of the stable size."""
    sim = started(sprung(0.5, damping=2e4 * J), {}, engine=engine)
    sim.advance(0.05)
    assert sim.outputs()["bob.angle"] == pytest.approx(
        0.5 * math.exp(-K / (2e4 * J) * 0.05), rel=1e-6
    )


def test_the_longest_step_knows_torsion():
    """omega^2 = k/J and the rate c/J."""
    sim = Simulation(sprung(damping=30.0 * J))
    found = FastestMode.at(sim.front.equations, 0.0, sim.front.y)
    assert found.rate == pytest.approx(OMEGA, rel=1e-3)
    assert found.decay == pytest.approx(30.0)


def test_a_damper_alone_stops_a_pendulum_exponentially():
    """J q'' + c q' = 0 across gravity; the pin has no spring, and no parameter of one."""
    swing = pendulum(0.0)
    pin = replace(swing.joints[0], damping=0.1)
    model = replace(
        swing, joints=(pin,), gravity=(0.0, 0.0), release=Release("bob", 0.0, velocity=0.6)
    )
    assert "pin.stiffness" not in model.values()
    sim = Simulation(model, tolerance=1e-11)
    sim.advance(0.3)
    assert sim.outputs()["bob.omega"] == pytest.approx(2.0 * math.exp(-0.1 / J * 0.3), rel=1e-8)


@pytest.mark.native
@pytest.mark.parametrize("closing", [False, True])
def test_directional_derivatives_with_torsion_equal_differences(closing):
    model = four_bar(stiffness=0.04, free_angle=0.5, damping=1e-3)
    if closing:
        model = replace(model, joints=model.joints[::-1])
    assert_directional(model, {"damping.beta": 1e-3}, dict.fromkeys(input_names(model), 0.1), ())


def test_a_free_angle_without_a_stiffness_is_rejected():
    with pytest.raises(MechanismError, match=r"pin\.free_angle: the joint has no spring; add"):
        Joint("pin", "ground.a", "arm.a", free_angle=0.1)


def test_a_negative_stiffness_is_rejected():
    with pytest.raises(ParameterError, match=r"pin\.stiffness = -1 .* must be at least 0"):
        sprung().values({"pin.stiffness": -1.0})
