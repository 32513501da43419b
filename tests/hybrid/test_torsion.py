"""Torsion springs at joints: vibration, statics, energy, and directional derivatives."""

import math
from dataclasses import replace

import numpy as np
import pytest

from exchange import assert_directional
from free_bodies import ball, pendulum
from prbm.base.errors import ParameterError
from prbm.mechanics.assembly import assemble
from prbm.mechanics.inputs import input_names
from prbm.mechanics.statics import equilibrium, holding_stiffness
from prbm.mechanism.parts import Body, Force, Joint, Release
from prbm.runs.engine import simulation as started

K = 0.7  # N m/rad
engines = pytest.mark.parametrize(
    "engine", ["python", pytest.param("kernel", marks=pytest.mark.native)]
)


def sprung(angle=0.2, **parts):
    """Return a pendulum with a torsion spring at its pin, which turns across gravity."""
    swing = pendulum(angle)
    return replace(
        swing, joints=(replace(swing.joints[0], stiffness=K),), gravity=(0.0, 0.0), **parts
    )


@engines
def test_a_torsional_pendulum_vibrates_harmonically(engine):
    """J q'' + k q = 0 about the pin, for any amplitude."""
    omega = math.sqrt(K / (2e-3 + 0.5 * 0.3**2))
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
    omega = math.sqrt(K / (2e-3 + 0.5 * 0.3**2))
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


@pytest.mark.native
def test_directional_derivatives_with_torsion_equal_differences():
    guide = sprung(forces=(Force("push", "bob"),))
    assert_directional(guide, {"damping.beta": 1e-3}, dict.fromkeys(input_names(guide), 0.1), ())


def test_a_negative_stiffness_is_rejected():
    with pytest.raises(ParameterError, match=r"pin\.stiffness = -1 .* must be at least 0"):
        sprung().values({"pin.stiffness": -1.0})
