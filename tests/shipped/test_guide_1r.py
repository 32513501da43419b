"""The 1R guide, compared with its scalar equation of motion."""

import math

import numpy as np
import pytest

from support import PMMA, ScalarGuide, energy_balance, mechanism, simulation

STEEL = {"flexure.K_theta": 2.5449, "release.displacement": -0.01, "damping.beta": 0.0}


def scalar(changes):
    return ScalarGuide.of(mechanism("PRBDM").values(changes))


def test_bounce_times_and_speeds_are_those_of_the_scalar_equation():
    """Quadrature of the scalar equation gives the flights, the restitution the rebound speeds."""
    times, speeds = scalar(STEEL).bounces(-0.01, 0.6, 8)
    sim = simulation("PRBDM", STEEL)
    sim.advance(0.2)
    found = sim.record[:8]
    np.testing.assert_allclose([i.time for i in found], times, rtol=0, atol=1e-7)
    np.testing.assert_allclose([i.latched.approach_speed for i in found], speeds, rtol=1e-6)
    assert times[:5] == pytest.approx(  # Documented reference times [s].
        [0.034981, 0.087268, 0.122819, 0.145415, 0.159290], abs=1e-6
    )


def test_events_are_located_to_a_picosecond():
    """At the tolerance 1e-12, the error of the event location dominates."""
    times, _ = scalar(STEEL).bounces(-0.01, 0.6, 3)
    sim = simulation("PRBDM", STEEL, tolerance=1e-12)
    sim.advance(0.13)
    np.testing.assert_allclose([i.time for i in sim.record], times, rtol=0, atol=1e-11)
    for impact in sim.record:
        e = np.exp(1j * impact.q)
        gap = float((e @ sim.system.gaps[0]).real + sim.system.gaps_c[0])
        assert abs(gap) < 1e-12 * impact.latched.approach_speed


@pytest.mark.slow
@pytest.mark.parametrize(("rest_speed", "when"), [(1e-5, 0.1803), (1e-3, None)])
def test_accumulating_bounces_end_in_a_resting_contact(rest_speed, when):
    """The bounces accumulate at 0.18034 s; rest begins up to 2 eps v_r/(a (1 - eps)) earlier."""
    guide = scalar(STEEL)
    times, speeds = guide.bounces(-0.01, 0.6, 16)
    a = guide.g  # Only gravity presses in the straight shape.
    flights = 2 * 0.6 * speeds[-1] / a / (1 - 0.6)  # The remaining flights are parabolas.
    accumulation = times[-1] + flights
    assert accumulation == pytest.approx(0.18034, abs=1e-5)
    sim = simulation("PRBDM", STEEL | {"stop.rest_speed": rest_speed})
    rest = None
    for t in np.concatenate([np.arange(1, 9500) * 2e-5, np.arange(190, 1001) * 1e-3]):
        sim.advance(t)
        out = sim.outputs()
        assert out["stop.gap"] > -1e-9
        if out["stop.contact"]:
            rest = rest or t
            assert out["stop.force"] == pytest.approx(guide.mass * guide.g, rel=1e-9)
        else:
            assert rest is None, "the resting contact ends"
    assert accumulation - 2 * 0.6 * rest_speed / (a * 0.4) - 2e-5 <= rest <= accumulation + 2e-5
    if when:
        assert rest == pytest.approx(when, abs=6e-5)


def test_infinitely_many_bounces_end_in_rest_without_a_rest_speed():
    """With rest_speed = 0, rest begins at the accumulation time; the simulation does not hang."""
    sim = simulation("PRBDM", STEEL | {"stop.rest_speed": 0.0})
    sim.advance(0.2)
    assert sim.outputs()["stop.contact"] is True
    assert sim.record[-1].time == pytest.approx(0.18034, abs=1e-5)
    assert 25 < len(sim.record) < 60


@pytest.mark.parametrize(
    ("K_theta", "frequency", "amplitude"),
    [(2.65, 5.74656, 27.574e-3), (2.5449, 5.63145, 28.132e-3)],
)
def test_the_pmma_guide_has_its_exact_frequency_and_amplitude(K_theta, frequency, amplitude):
    """The closed form, the value in the thesis and the engine agree after a start at 1 m/s."""
    values = PMMA | {"flexure.K_theta": K_theta}
    guide = scalar(values)
    sim = simulation("PRBDM", values, tolerance=1e-11)
    assert sim.frequency == pytest.approx(
        math.sqrt(4 * guide.k / guide.mass) / guide.r / (2 * math.pi), rel=1e-12
    )
    peak = guide.r * math.sin(guide.turning(0.5 * guide.mass, 0.0, 1.5))
    period = guide.period(1.0)
    assert 1 / period == pytest.approx(frequency, abs=6e-6)
    assert peak == pytest.approx(amplitude, abs=1e-6)
    sim.advance(period / 4)
    assert sim.outputs()["shuttle.x"] == pytest.approx(peak, rel=1e-8)
    sim.advance(period)
    assert sim.outputs()["shuttle.x"] == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize("zeta", [0.02, 0.1])
def test_damping_ratio_is_that_of_the_fundamental(zeta):
    """Free decay about the straight shape without gravity: x ~ exp(-zeta omega t)."""
    values = {
        "damping.zeta": zeta, "damping.beta": 0.0, "gravity.x": 0.0,
        "release.displacement": -1e-6, "stop.position": 0.01,
    }  # fmt: skip
    sim = simulation("PRBDM", values, tolerance=1e-12)
    omega = 2 * math.pi * sim.frequency
    damped = omega * math.sqrt(1 - zeta**2)
    period = 2 * math.pi / damped
    sim.advance(period)
    decay = math.exp(-zeta * omega * period)
    assert sim.outputs()["shuttle.x"] == pytest.approx(-1e-6 * decay, rel=1e-5)


def test_stiffness_proportional_damping_is_beta_omega_over_two():
    """The damping ratio of a mode under beta K is beta omega / 2."""
    values = {
        "damping.beta": 1e-3, "gravity.x": 0.0,
        "release.displacement": -1e-6, "stop.position": 0.01,
    }  # fmt: skip
    sim = simulation("PRBDM", values, tolerance=1e-12)
    omega = 2 * math.pi * sim.frequency
    zeta = 1e-3 * omega / 2
    period = 2 * math.pi / (omega * math.sqrt(1 - zeta**2))
    sim.advance(period)
    assert sim.outputs()["shuttle.x"] == pytest.approx(
        -1e-6 * math.exp(-zeta * omega * period), rel=1e-5
    )


@pytest.mark.parametrize("restitution", [0.0, 0.3, 1.0])
def test_rebound_speed_is_restitution_times_approach_speed(restitution):
    """With restitution 0 the shuttle stays on the wall; with 1 it returns to the release."""
    sim = simulation("PRBDM", STEEL | {"stop.restitution": restitution}, tolerance=1e-11)
    times, _ = scalar(STEEL).bounces(-0.01, 0.6, 1)
    sim.advance(2 * times[0])
    impact = sim.record[0].latched
    assert impact.rebound_speed == pytest.approx(restitution * impact.approach_speed, abs=1e-12)
    out = sim.outputs()
    if restitution == 0.0:
        assert out["stop.contact"]
        assert out["stop.impact_count"] == 1
    if restitution == 1.0:
        assert out["shuttle.x"] == pytest.approx(-0.01, abs=1e-10)
        assert impact.energy_lost == pytest.approx(0.0, abs=1e-16)
    assert energy_balance(out) == pytest.approx(
        scalar(STEEL).potential(math.asin(-0.01 / (0.8517 * 0.04))), rel=1e-8
    )


def test_base_reaction_at_rest_is_the_weight():
    """At rest on the wall, the ground carries the total weight through the clamps and the stop."""
    guide = scalar(STEEL)
    sim = simulation("PRBDM", STEEL)
    sim.advance(0.5)
    out = sim.outputs()
    assert out["base.force.x"] == pytest.approx(guide.mass * guide.g, rel=1e-9)
    assert out["base.force.y"] == pytest.approx(0.0, abs=1e-9)
    values = mechanism("PRBDM").values(STEEL)
    lump = (guide.mass - values["shuttle.mass"]) / 2
    height = 0.04 + values["shuttle.com_height"]
    pivot = 0.04 - (1 - 0.8517) / 2 * 0.04  # The stub at the shuttle is below its clamp.
    lever = values["shuttle.mass"] * height + 2 * lump * pivot
    assert out["base.moment"] == pytest.approx(-9.81 * lever, rel=1e-9)
