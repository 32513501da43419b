"""Coil springs and dampers between points: closed forms, energy, momentum, both engines."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from exchange import assert_directional, integrate
from kernel_simulation import KernelSimulation
from moved_drawings import moved
from prbm.base.errors import ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.hybrid.stability import FastestMode
from prbm.mechanics.inputs import input_names
from prbm.mechanism.parts import Body, Joint, Release, Spring, Stop
from prbm.runs.engine import simulation as started
from springs import oscillator, truss, web

OMEGA = 10.0  # rad/s of the block on its spring.
engines = pytest.mark.parametrize(
    "engine", ["python", pytest.param("kernel", marks=pytest.mark.native)]
)


def damped(t, zeta):
    """Return the displacement of the block over that at release, at a damping ratio."""
    decay = math.exp(-zeta * OMEGA * t)
    if zeta < 1.0:
        w = OMEGA * math.sqrt(1.0 - zeta**2)
        return decay * (math.cos(w * t) + zeta * OMEGA / w * math.sin(w * t))
    if zeta == 1.0:
        return decay * (1.0 + OMEGA * t)
    w = OMEGA * math.sqrt(zeta**2 - 1.0)
    return decay * (math.cosh(w * t) + zeta * OMEGA / w * math.sinh(w * t))


@engines
@pytest.mark.parametrize("zeta", [0.0, 0.1, 1.0, 2.5])
def test_a_block_on_a_spring_and_a_damper_moves_as_in_closed_form(engine, zeta):
    model = oscillator(damping=2.0 * zeta * OMEGA * 2.0)
    sim = started(model, {}, engine=engine, tolerance=1e-11)
    assert sim.outputs()["mode.frequency"] == pytest.approx(OMEGA / (2.0 * math.pi))
    for t in (0.05, 0.2, 0.7):
        sim.advance(t)
        out = sim.outputs()
        x = 0.02 * damped(t, zeta)
        assert out["block.x"] == pytest.approx(x, abs=1e-9)
        assert out["block.y"] == out["block.angle"] == 0.0
        assert out["coil.length"] == pytest.approx(0.1 + x, abs=1e-9)
        assert out["coil.length_rate"] == pytest.approx(out["block.vx"], rel=1e-12)
        force = 200.0 * x + 40.0 * zeta * out["block.vx"]
        assert out["coil.force"] == pytest.approx(force, abs=1e-7)
        assert out["base.force.x"] == pytest.approx(force, abs=1e-7)
        balance = sum(out[f"energy.{kind}"] for kind in ("kinetic", "elastic", "dissipated"))
        assert balance == pytest.approx(0.5 * 200.0 * 0.02**2, rel=1e-8)


@engines
@pytest.mark.parametrize("cubic", [4e5, -1e5])
def test_a_duffing_oscillator_moves_as_an_elliptic_function(engine, cubic):
    """2 x'' + 200 x + k3 x^3 = 0: the function cn for a hard spring, cd for a soft one."""
    amplitude = 0.02
    sim = started(oscillator(cubic_stiffness=cubic), {}, engine=engine, tolerance=1e-11)
    a, b = 100.0, 0.5 * cubic * amplitude**2  # 1/s^2
    if cubic > 0.0:
        w, m = math.sqrt(a + b), b / (2.0 * (a + b))
    else:
        w, m = math.sqrt(a + 0.5 * b), -0.5 * b / (a + 0.5 * b)
    period = 4.0 * ellipk(m) / w
    for share in (0.13, 0.5, 1.0, 2.2):
        sim.advance(share * period)
        out = sim.outputs()
        _, cn, dn, _ = ellipj(w * share * period, m)
        x = amplitude * (cn if cubic > 0.0 else cn / dn)
        assert out["block.x"] == pytest.approx(x, abs=1e-9)
        assert out["coil.force"] == pytest.approx(200.0 * x + cubic * x**3, abs=1e-7)


@engines
def test_a_stiff_damper_limits_the_step_before_it_is_unstable(engine):
    """A damper of 1e4 1/s: the block creeps with k/c, in steps of the stable size."""
    model = oscillator(damping=2e4)
    sim = started(model, {}, engine=engine)
    sim.advance(0.05)
    assert sim.outputs()["block.x"] == pytest.approx(0.02 * damped(0.05, 500.0), rel=1e-6)


def test_the_longest_step_knows_springs_and_dampers():
    """omega^2 = k/m and the sum of the rates c/m of dampers in the fastest mode."""
    sim = Simulation(oscillator(stiffness=2e4, damping=600.0))
    found = FastestMode.at(sim.front.equations, 0.0, sim.front.y)
    assert found.rate == pytest.approx(100.0, rel=1e-3)
    assert found.decay == pytest.approx(300.0)
    largest = 0.5 * (300.0 + math.sqrt(300.0**2 - 4.0 * 100.0**2))
    assert found.longest_step(sim.front.equations) == pytest.approx(4.0 / largest, rel=1e-3)


@engines
def test_two_bodies_on_a_spring_vibrate_about_their_centre(engine):
    """The reduced mass is m1 m2/(m1 + m2); the momentum is zero, and the pair flies freely."""
    pair = oscillator(parts={
        "ground": {},
        "bodies": (
            Body("one", 1.0, 1e-3, (0.0, 0.0), {"eye": (0.0, 0.0)}),
            Body("two", 3.0, 1e-3, (0.1, 0.0), {"eye": (0.1, 0.0)}),
        ),
        "springs": (Spring("coil", "one.eye", "two.eye", 300.0),),
        "release": Release("two", displacement=0.01),
    })  # fmt: skip
    assert pair.free_bodies == ("one", "two")
    sim = started(pair, {}, engine=engine, tolerance=1e-11)
    omega = math.sqrt(300.0 * (1.0 + 1.0 / 3.0))
    for t in (0.1, 0.33):
        sim.advance(t)
        out = sim.outputs()
        assert out["coil.length"] - 0.1 == pytest.approx(0.01 * math.cos(omega * t), abs=1e-8)
        assert out["one.vx"] + 3.0 * out["two.vx"] == pytest.approx(0.0, abs=1e-10)


@engines
def test_motion_stays_finite_where_the_ends_of_a_spring_meet(engine):
    """Without a free length the force is -k z, which is smooth; the block passes the anchor."""
    model = oscillator(free_length=0.0, displacement=0.05)
    sim = started(model, {}, engine=engine, tolerance=1e-10)
    for t in np.linspace(0.0, math.pi / OMEGA, 5):
        sim.advance(float(t))
        assert sim.outputs()["block.x"] + 0.1 == pytest.approx(0.15 * math.cos(OMEGA * t), abs=1e-8)


@engines
def test_a_compressed_spring_passes_the_point_where_its_direction_turns(engine):
    """The energy is kept although the force changes its sign there."""
    model = oscillator(displacement=0.0, parts={"release": Release("block", velocity=-2.0)})
    sim = started(model, {}, engine=engine, tolerance=1e-9)
    sim.advance(0.08)
    out = sim.outputs()
    assert out["block.x"] < -0.1
    balance = out["energy.kinetic"] + out["energy.elastic"]
    assert math.isfinite(out["coil.length_rate"])
    assert balance == pytest.approx(0.5 * 2.0 * 2.0**2, rel=1e-5)


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (0.3, -2.0)])
@pytest.mark.native
def test_both_engines_move_a_web_of_springs_alike(gravity):
    model = web(gravity)
    stop = Stop("wall", "plate", (-0.04, 0.0), 180.0, 4e-3, restitution=0.6, friction=0.2)
    model = replace(model, stops=(stop,))
    python, kernel = (
        started(model, {}, engine=engine, tolerance=1e-10) for engine in ("python", "kernel")
    )
    energy = None
    for t in np.linspace(0.0, 0.4, 9):
        python.advance(float(t))
        kernel.advance(float(t))
        expected, found = python.outputs(), kernel.outputs()
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)
        total = sum(expected[f"energy.{k}"] for k in ("kinetic", "elastic", "gravitational"))
        total += expected["energy.dissipated"] - expected["energy.work"]
        energy = total if energy is None else energy
        assert total == pytest.approx(energy, abs=1e-8)
    assert expected["wall.impact_count"] > 0


@pytest.mark.native
def test_directional_derivatives_with_springs_equal_differences():
    model = web()
    assert_directional(model, {}, dict.fromkeys(input_names(model), 0.1), ())


@pytest.mark.native
def test_model_exchange_moves_a_web_as_co_simulation():
    model = web()
    exchange = KernelSimulation(model, {}, exchange=True)
    assert not [*integrate(exchange, 0.1, h=2e-4)]
    direct = started(model, {}, engine="kernel", tolerance=1e-11)
    direct.advance(0.1)
    found, expected = exchange.outputs(), direct.outputs()
    for name in ("plate.x", "ring.y", "ring.angle", "one.force", "four.length_rate"):
        assert found[name] == pytest.approx(expected[name], rel=1e-6), name


@pytest.mark.parametrize("change", ["turned", "mirrored", "shifted"])
def test_springs_do_not_depend_on_the_frame(change):
    model = web((0.0, 0.0))
    u = complex(math.cos(1.1), math.sin(1.1))
    other = {
        "turned": lambda: moved(model, lambda z: u * z, turn=math.degrees(1.1)),
        "mirrored": lambda: moved(model, lambda z: z.conjugate(), sign=-1.0),
        "shifted": lambda: moved(model, lambda z: z + 0.4 - 0.3j),
    }[change]()
    first, second = (Simulation(m, tolerance=1e-11) for m in (model, other))
    for sim in (first, second):
        sim.advance(0.1)
    expected, found = first.outputs(), second.outputs()
    for name in expected:
        kind = name.rpartition(".")[2]
        if name.startswith(("energy.", "mode.")) or kind in ("force", "length", "length_rate"):
            assert found[name] == pytest.approx(expected[name], rel=1e-7, abs=1e-9), name


def test_a_spring_stretches_between_bodies_on_a_joint_as_a_torsion_spring():
    """Small rotations: the torsional stiffness is k r1 r2 sin^2 about the joint, here k r^2/2."""
    arms = oscillator(parts={
        "ground": {"pin": (0.0, 0.0), "post": (0.1, 0.0)},
        "bodies": (Body("arm", 1.0, 1e-2, (0.0, 0.0), {"pin": (0.0, 0.0), "end": (0.0, 0.1)}),),
        "joints": (Joint("pin", "ground.pin", "arm.pin"),),
        "springs": (Spring("coil", "ground.post", "arm.end", 50.0),),
        "release": Release("arm", angle=0.01),
    })  # fmt: skip
    omega = math.sqrt(0.5 * 50.0 * 0.1**2 / 1e-2)
    assert Simulation(arms).outputs()["mode.frequency"] == pytest.approx(omega / (2.0 * math.pi))


@engines
def test_a_weight_on_a_level_spring_swings_although_slow_loading_reaches_no_equilibrium(engine):
    """The energy is that of the start; the spring has no stiffness across its axis there."""
    sim = started(oscillator(parts={"gravity": (0.0, -9.81)}), {}, engine=engine, tolerance=1e-10)
    assert sim.outputs()["mode.frequency"] == 0.0
    assert sim.instability().sentences == ()
    sim.advance(0.3)
    out = sim.outputs()
    assert out["block.y"] < -0.2
    total = sum(out[f"energy.{kind}"] for kind in ("kinetic", "elastic", "gravitational"))
    assert total == pytest.approx(0.5 * 200.0 * 0.02**2, abs=1e-8)


def test_coinciding_ends_are_rejected():
    with pytest.raises(ParameterError, match=r"spring coil .* direction is undefined: draw its"):
        Simulation(oscillator(parts={"ground": {"anchor": (0.1, 0.0)}}))


@engines
def test_a_saved_state_continues_with_the_same_damping(engine):
    sim = started(truss(displacement=0.01, damping=3.0), {}, engine=engine)
    sim.advance(0.05)
    saved = sim.snapshot()
    sim.advance(0.1)
    expected = sim.outputs()
    sim.restore(saved)
    sim.advance(0.1)
    assert sim.outputs() == expected
