"""Combinations of several stops, friction and walls: laws of impacts and of motions."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import simpson

from many_parts import two_stops
from prbm.hybrid.simulation import Simulation
from support import ScalarGuide, energy_balance, mechanism, simulation


def checked_run(guide, values=None, time=0.3, step=1e-3):
    """Run a simulation; check energy balance, gaps and stop forces at every output."""
    sim = Simulation(guide, values)
    sim.record = []
    start = energy_balance(sim.outputs())
    dissipated, out = 0.0, sim.outputs()
    for t in np.arange(1, round(time / step) + 1) * step:
        sim.advance(t)
        out = sim.outputs()
        assert energy_balance(out) == pytest.approx(start, abs=1e-6 * abs(start))
        assert out["energy.dissipated"] >= dissipated - 1e-7 * abs(start)
        dissipated = out["energy.dissipated"]
        for stop in guide.stops:
            assert out[f"{stop.name}.gap"] > -1e-9
            assert out[f"{stop.name}.force"] >= 0.0
    return sim, out


@pytest.mark.slow
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
@pytest.mark.parametrize("position", [0.0, -0.006])
def test_converging_bounces_on_two_stops_end_in_rest(model, position):
    """At rest the sum of the forces of both stops is nearly constant."""
    guide = two_stops(model, high={"position": position}, low={"position": position})
    sim, out = checked_run(guide, time=0.45)
    assert out["high.contact"] or out["low.contact"]
    carried = out["high.force"] + out["low.force"]
    sim.advance(0.5)
    later = sim.outputs()
    assert later["high.force"] + later["low.force"] == pytest.approx(carried, rel=0.02)


@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_energy_lost_at_each_of_two_stops_follows_from_its_impulse(model):
    """Energy lost = -P (u- + u+)/2; the result does not depend on the order of the stops."""
    eps = {"high": {"restitution": 0.9}, "low": {"restitution": 0.1}}
    guide = two_stops(model, **eps)
    swapped = dataclasses.replace(guide, stops=guide.stops[::-1])
    results = []
    for one in (guide, swapped):
        sim = Simulation(
            one, {"gravity.x": 0.0, "release.velocity": 0.3, "release.displacement": 0}
        )
        out = sim.outputs()
        assert out["high.impact_count"] + out["low.impact_count"] >= 1
        y, n = sim.state(), sim.system.n
        start = 0.5 * ScalarGuide.of(mechanism("PRBDM").values()).mass * 0.3**2
        assert 0 < out["energy.dissipated"] < start
        for name in ("high", "low"):
            if out[f"{name}.impact_count"]:
                lost = out[f"{name}.impulse"] * (
                    out[f"{name}.approach_speed"] - out[f"{name}.rebound_speed"]
                )
                assert out[f"{name}.energy_lost"] == pytest.approx(lost / 2, rel=1e-9)
        results.append((y[n : 2 * n], out["energy.dissipated"]))
    if model == "PRBDM2R":  # With one degree of freedom, the impulses are not unique.
        np.testing.assert_allclose(results[0][0], results[1][0], atol=1e-9)
        assert results[0][1] == pytest.approx(results[1][1], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("lever", [0.01, 0.03])
def test_a_closed_stop_takes_part_in_an_impact_at_another_stop(friction, lever):
    """The closed stop receives an impulse P >= 0 or opens; its moving wall does the work of P.

    With a short lever the closed stop opens, with a long one it receives an impulse.
    """
    guide = two_stops(
        "PRBDM2R",
        high={"position": -0.006, "offset": lever, "rest_speed": 0.2},
        low={"position": -0.0056, "offset": -lever, "restitution": 0.8, "friction": friction},
    )
    sim = Simulation(guide)
    sim.record = []
    for k in range(200):
        sim.advance(0.4 + (k + 1) * 5e-4)
    assert sim.outputs()["high.contact"]
    start, count = energy_balance(sim.outputs()), sim.outputs()["low.impact_count"]
    while sim.outputs()["low.impact_count"] == count:
        past = sim.time - 0.5  # The wall of the lower stop is faster than that of the closed one.
        sim.set({"high.velocity": -5.0 * past, "high.displacement": -2.5 * past**2})
        sim.set({"low.velocity": -0.2, "low.displacement": -0.2 * past})
        held = sim.outputs()["high.contact"]
        sim.advance(sim.time + 5e-4)
        assert sim.time < 0.52
    assert held
    impact = next(i for i in sim.record if i.stop == "low" and i.time > 0.5)
    system = sim.system
    e = np.exp(1j * impact.q)
    M = (e.conj()[:, None] * system.H * e).real + np.diag(system.J)
    G = -(system.gaps * e).imag
    walls = [wall.motion(impact.time)[1] for wall in sim.inputs.walls]
    rates, before = G @ impact.after + walls, G @ impact.before + walls
    assert abs(before[0]) < 1e-9, "the upper stop must be closed before"
    assert rates[0] >= -1e-12
    if friction == 0.0:
        assert (rates[0] < 1e-9) == (lever == 0.03), "it must stay closed with the long lever only"
        assert rates[1] == pytest.approx(0.8 * impact.latched.approach_speed, rel=1e-9)
        rows = np.vstack([-(system.loops * e).imag, G])
        *_, P_high, P_low = np.linalg.lstsq(rows.T, M @ (impact.after - impact.before), rcond=None)[
            0
        ]
        assert P_low == pytest.approx(impact.impulse, rel=1e-6)
        assert P_high >= -1e-12
        assert (P_high > 1e-6) == (lever == 0.03)
        work = -walls[0] * P_high - walls[1] * P_low
        gained = 0.5 * (impact.after @ M @ impact.after - impact.before @ M @ impact.before)
        assert impact.latched.energy_lost == pytest.approx(work - gained, rel=1e-6)
    assert impact.latched.energy_lost >= 0
    assert energy_balance(sim.outputs()) == pytest.approx(start, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("rest_speed", [0.0, 1e-5])
@pytest.mark.parametrize(("position", "offset"), [(0.0, 0.0), (-0.004, 0.003), (0.005, -0.002)])
def test_converging_bounces_of_the_2r_guide_end_in_rest(rest_speed, position, offset):
    """The wall is on either side of the straight shape, and the rest speed is tiny or zero."""
    values = {
        "stop.rest_speed": rest_speed, "stop.position": position, "stop.offset": offset,
        "damping.beta": 2e-5,
    }  # fmt: skip
    sim = simulation("PRBDM2R", values, tolerance=1e-7)
    sim.advance(0.5)
    assert sim.outputs()["stop.contact"]


@pytest.mark.slow
def test_a_wall_that_pushes_a_body_with_friction_does_its_work():
    """At constant speed the stop force grows by mu N, and mu N times the path is dissipated."""
    still = {"damping.beta": 0.0}
    rubbing = still | {"friction.coefficient": 1.0, "friction.normal_force": 0.2}
    ends = []
    for values in (still, rubbing):
        sim = simulation("PRBDM", values)
        sim.advance(0.6)
        lost = sim.outputs()["energy.dissipated"]
        for k in range(1000):  # The speed reaches 20 mm/s in changes below rest_speed.
            speed = min(0.02, k * 5e-4)
            here = sim.inputs.walls[0].motion(sim.time)[0]
            sim.set({"stop.displacement": here, "stop.velocity": -speed})
            sim.advance(0.6 + (k + 1) * 2e-4)
        out = sim.outputs()
        ends.append((out["stop.force"], out["energy.dissipated"] - lost, out["shuttle.x"]))
    (free, _, x), (pushed, dissipated, y) = ends
    assert x == pytest.approx(y, abs=1e-7)
    assert pushed - free == pytest.approx(0.2, rel=1e-3)
    assert dissipated == pytest.approx(0.2 * abs(y), rel=5e-3)


def test_a_sticking_body_does_not_follow_a_retreating_wall():
    """Friction of 5 N exceeds the weight of 0.5 N: the contact opens."""
    values = {
        "friction.normal_force": 5.0, "friction.coefficient": 1.0, "release.displacement": 0.0,
    }  # fmt: skip
    sim = simulation("PRBDM", values)
    sim.set({"stop.velocity": 0.02})
    sim.advance(0.05)
    out = sim.outputs()
    assert not out["stop.contact"]
    assert abs(out["shuttle.vx"]) < 1e-9
    assert out["stop.gap"] == pytest.approx(0.02 * 0.05, rel=1e-6)


@pytest.mark.slow
def test_friction_of_a_contact_pulled_along_its_wall_is_within_the_cone():
    """2R guide at a bent shape: the friction force is mu N while the contact slides."""
    values = {"stop.position": -0.01, "stop.friction": 0.2, "release.displacement": -0.0101}
    sim = simulation("PRBDM2R", values)
    sim.advance(0.4)
    slipping = 0
    for force in (-2.0, 2.0):
        sim.set({"force.y": force})
        for _ in range(40):
            sim.advance(sim.time + 2.5e-4)
            n, y = sim.system.n, sim.state()
            found = sim.equations.evaluate(sim.time, y[:n], y[n : 2 * n])
            a, lam, M = found.a, found.lam, found.M
            if not sim.equations.held:
                continue
            normal = float(lam[sim.equations.first_hold])
            assert normal > 0.0
            # The residual of the equations of motion along the wall is friction.
            e, v = np.exp(1j * y[:n]), y[n : 2 * n]
            G, T = (-(B * e).imag for B in (sim.system.gaps[0], sim.system.slides[0]))
            C = -(e.conj()[:, None] * sim.system.H * e).imag
            system = sim.system
            torques = system.K @ (y[:n] - system.rest + sim.equations.beta * v)
            left = M @ a + C @ v**2 + torques - (sim.equations.w * e).real - G * normal
            rows = np.vstack([-(sim.system.loops * e).imag, T])
            tangential = float(np.linalg.lstsq(rows.T, left, rcond=None)[0][-1])
            assert abs(tangential) <= 0.2 * normal * (1 + 1e-5)
            if sim.equations.slipping_rows:
                slipping += 1
                assert tangential * float(T @ v) <= 0.0
                assert abs(tangential) == pytest.approx(0.2 * normal, rel=1e-5)
    assert slipping


@pytest.mark.slow
def test_impulse_of_base_reactions_includes_that_of_the_inputs():
    """Integral of base force and moment = impulse of all loads - change of momentum."""
    values = {"gravity.x": 2.0, "gravity.y": -3.0, "stop.position": 0.05}
    sim = simulation("PRBDM2R", values, tolerance=1e-11)
    sim.set({"force.x": 0.3, "force.y": -0.2, "force.moment": 4e-3, "base.acceleration.y": 1.5})
    n, system = sim.system.n, sim.system
    times = np.linspace(0, 0.01, 1001)
    forces, moments, loads, turns = [], [], [], []

    def momenta():
        y = sim.state()
        e, v = np.exp(1j * y[:n]), y[n : 2 * n]
        z, rate = system.A @ e + system.c - system.anchor, 1j * (system.A @ (e * v))
        angular = float((z.conj() * system.m * rate).imag.sum() + system.J @ v)
        return complex(system.m @ rate), angular

    first = momenta()
    for t in times:
        sim.advance(t)
        out = sim.outputs()
        e = np.exp(1j * sim.state()[:n])
        z = system.A @ e + system.c - system.anchor
        frame = system.bodies["shuttle"]
        centre = complex(frame.A @ e) + frame.c - system.anchor
        field, pull = 2.0 - 3.0j - 1.5j, 0.3 - 0.2j
        loads.append(complex(system.m.sum() * field + pull))
        turns.append(
            float((z.conj() * system.m * field).imag.sum())
            + (centre.conjugate() * pull).imag
            + 4e-3
        )
        forces.append(complex(out["base.force.x"], out["base.force.y"]))
        moments.append(out["base.moment"])
    last = momenta()
    linear = simpson(np.array(loads) - np.array(forces), x=times)
    angular = simpson(np.array(turns) - np.array(moments), x=times)
    assert last[0] - first[0] == pytest.approx(linear, abs=1e-6 * abs(linear))
    assert last[1] - first[1] == pytest.approx(angular, abs=1e-6 * abs(angular) + 1e-12)


def test_rounding_errors_cause_no_impact_in_an_equilibrium_with_contact():
    """There is neither gravity nor motion."""
    sim = simulation("PRBDM2R", {"gravity.x": 0.0, "release.displacement": 0.0})
    sim.advance(0.2)
    assert sim.outputs()["stop.impact_count"] == 0
    assert abs(sim.outputs()["stop.gap"]) < 1e-9


@pytest.mark.slow
def test_frequent_bounces_of_a_micrometre_switch_are_not_chatter():
    """Chatter is counted relative to the period of the motion, here 20 us."""
    scale = 1e-4
    values = {
        "flexure.length": 0.04 * scale, "shuttle.width": 0.08 * scale,
        "flexure.thickness": 1e-4 * scale, "flexure.width": 8e-3 * scale,
        "shuttle.com_height": 0.0, "shuttle.mass": 0.05 * scale**3,
        "shuttle.inertia": 2.8e-5 * scale**5, "gravity.x": 0.0,
        "release.displacement": -0.01 * scale, "stop.restitution": 1.0, "damping.beta": 0.0,
    }  # fmt: skip
    sim = simulation("PRBDM", values)
    period = 1 / sim.frequency
    sim.advance(1000 * period)
    assert len(sim.record) == pytest.approx(2000, abs=2)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"start_time": float("nan")}, "start_time = nan s"),
        ({"step": -1e-3}, "step = -0.001 s must be positive"),
        ({"step": float("nan")}, "step = nan s"),
    ],
)
def test_invalid_options_are_rejected(options, words):
    with pytest.raises(ValueError, match=words):
        Simulation(mechanism("PRBDM"), **options)


@pytest.mark.parametrize("bad", ["abc", None, 1j, True])
def test_inputs_that_are_not_real_numbers_are_rejected(bad):
    sim = simulation("PRBDM")
    with pytest.raises(ValueError, match=r"force\.x = "):
        sim.set({"force.x": bad})
    assert sim.given["force.x"] == 0.0


def test_a_force_of_1e300_newtons_is_an_error():
    sim = simulation("PRBDM")
    sim.set({"force.x": 1e300})
    with np.errstate(all="ignore"), pytest.raises(RuntimeError, match="step size fell to"):
        sim.advance(1e-3)


@pytest.mark.slow
def test_an_alternating_moment_moves_the_load_between_two_stops():
    """The straight 2R guide can hardly rotate: both gaps remain closed."""
    guide = two_stops("PRBDM2R")
    sim = Simulation(guide, {"release.displacement": 0.0})
    weight = sim.outputs()["high.force"] + sim.outputs()["low.force"]
    carried = set()
    for k in range(200):
        sim.set({"force.moment": 0.02 * np.sin(2 * np.pi * 10 * sim.time)})
        sim.advance((k + 1) * 1e-3)
        out = sim.outputs()
        assert out["high.force"] + out["low.force"] == pytest.approx(weight, rel=0.2)
        assert min(out["high.gap"], out["low.gap"]) > -1e-9
        carried |= {name for name in ("high", "low") if out[f"{name}.force"] > 0.3 * weight}
    assert carried == {"high", "low"}
    assert out["high.impact_count"] + out["low.impact_count"] == 0
