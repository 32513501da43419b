"""Maps of behaviour against closed forms: the bouncing ball, and the linear impact oscillator."""

import math

import numpy as np
import pytest

from prbm.base.errors import ParameterError
from prbm.references.impact_oscillator import period_doubling, periodic_orbit
from prbm.references.scalar_guide import ScalarGuide
from prbm.sweeps.behaviour import Behaviour, behaviour

GRAVITY, FREQUENCY, RESTITUTION = 9.81, 50.0, 0.5
INPUTS = {"base.acceleration.x": "sine({a} m/s^2, 50 Hz)"}


def ball(guide, amplitudes: list[float], transient: int) -> Behaviour:
    """Return the map of a shuttle on very soft flexures, begun on the motion of period one.

    The base is the table.  Its amplitudes are relative to gravity, Gamma = A omega^2 / g.  The ball
    hits the table once a period T with the speed g T / 2 at the phase phi, where cos phi = pi (1 -
    eps) / ((1 + eps) Gamma).
    """
    omega, eps, period = 2.0 * math.pi * FREQUENCY, RESTITUTION, 1.0 / FREQUENCY
    phase = math.acos(math.pi * (1 - eps) / ((1 + eps) * amplitudes[0]))
    size, hit = amplitudes[0] * GRAVITY / omega**2, phase / omega
    speed = GRAVITY * (hit - 0.5 * period)
    height = size * math.sin(phase) - speed * hit + 0.5 * GRAVITY * hit**2
    values = {
        "gravity.x": 0.0, "gravity.y": 0.0, "damping.beta": 0.0, "stop.restitution": eps,
        "stop.rest_speed": 2e-4, "release.displacement": -height,
        "release.velocity": size * omega - speed,
        "flexure.youngs_modulus": 1e-5 * guide.values()["flexure.youngs_modulus"],
    }  # fmt: skip
    mass = ScalarGuide.of({**guide.values(), **values}).mass
    return behaviour(
        guide, "a", GRAVITY * np.array(amplitudes), ["stop.approach_speed"], INPUTS, period,
        values={**values, "force.x": GRAVITY * mass}, transient=transient, periods=8,
    )  # fmt: skip


@pytest.mark.slow
def test_the_period_of_the_bouncing_ball_doubles_at_its_threshold(mechanisms):
    """Stable up to Gamma^2 = (pi (1-e)/(1+e))^2 + (2 (1+e^2)/(1+e)^2)^2 (Luo and Han 1996)."""
    e = RESTITUTION
    threshold = math.hypot(math.pi * (1 - e) / (1 + e), 2 * (1 + e**2) / (1 + e) ** 2)
    found = ball(mechanisms["PRBDM"], [0.9 * threshold, 1.02 * threshold], 100)
    assert [found.period(k) for k in range(2)] == [1, 2]
    assert (found.impacts == 1).all()


def test_the_bouncing_ball_hits_the_table_once_a_period(mechanisms):
    """Relative to the table the ball closes with g T / (1 + eps): it gains g T each period."""
    found = ball(mechanisms["PRBDM"], [1.2], 4)
    assert (found.impacts == 1).all()
    assert found.period(0) == 1
    speed = GRAVITY / FREQUENCY / (1 + RESTITUTION)
    np.testing.assert_allclose(found.speeds[0], speed, rtol=1e-3)


# --- the linear impact oscillator -----------------------------------------------------------------

LINEAR = {"gravity.x": 0.0, "gravity.y": 0.0, "damping.beta": 0.0, "stop.rest_speed": 1e-5}
ZETA, BOUNCE = 0.05, 0.5


@pytest.mark.slow
def test_the_impact_oscillator_of_shaw_and_holmes_doubles_its_period(mechanisms):
    """The speeds are those of the closed form; the period doubles where a multiplier is -1."""
    guide, size = mechanisms["PRBDM"], 2e-4  # m; angles of 0.006 rad are linear.
    values = {**LINEAR, "damping.zeta": ZETA, "stop.position": 0.0, "stop.restitution": BOUNCE,
              "release.displacement": -0.5 * size}  # fmt: skip
    scalar = ScalarGuide.of({**guide.values(), **values})
    omega = 2.0 * math.pi * scalar.frequency
    threshold = period_doubling(ZETA, BOUNCE, 2.5, 3.0)
    ratios = np.array([2.2, 2.45, threshold - 0.03, threshold + 0.03])
    frequencies = ratios * scalar.frequency
    force = f"sine({size * scalar.mass * omega**2} N, {{frequency}} Hz, {{start}} s)"
    found = behaviour(
        guide, "frequency", frequencies, ["shuttle.vx"], {"force.x": force}, 1.0 / frequencies,
        values=values, transient=100, periods=8,
    )  # fmt: skip
    assert [found.period(k) for k in range(4)] == [1, 1, 1, 2]
    assert (found.impacts == 1).all()
    for ratio, speeds in zip(ratios[:3], found.speeds, strict=False):
        np.testing.assert_allclose(
            speeds, size * omega * periodic_orbit(ratio, ZETA, BOUNCE)[0], rtol=2e-4
        )


def test_grazing_impacts_follow_the_square_root_of_nordmark(mechanisms):
    """From the linear response of amplitude A, the first impact at a gap d has w sqrt(A^2 - d^2).

    Below A = d there is none (Nordmark 1991).
    """
    guide, gap, ratio = mechanisms["PRBDM"], 2e-4, 0.7
    values = {**LINEAR, "damping.zeta": ZETA, "stop.position": gap, "stop.restitution": BOUNCE}
    scalar = ScalarGuide.of({**guide.values(), **values})
    omega = 2.0 * math.pi * scalar.frequency
    response = 1.0 / (1.0 - ratio**2 + 2j * ZETA * ratio) / (scalar.mass * omega**2)
    for above in (-0.01, 0.01, 0.04):
        force = (1.0 + above) * gap / abs(response)
        start = {
            "release.displacement": force * response.imag,
            "release.velocity": ratio * omega * force * response.real,
        }
        found = behaviour(
            guide, "size", [force], ["shuttle.x"],
            {"force.x": f"sine({{size}} N, {ratio * scalar.frequency} Hz)"},
            1.0 / (ratio * scalar.frequency), values=values | start, transient=0, periods=3,
        )  # fmt: skip
        if above < 0.0:
            assert found.impacts.sum() == 0
        else:
            speed = ratio * omega * gap * math.sqrt((1.0 + above) ** 2 - 1.0)
            assert found.speeds[0][0] == pytest.approx(speed, rel=2e-3)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"name": "b"}, r"write the varied number as \{b\}"),
        ({"samples": []}, "give at least one value"),
        ({"period": 0.0}, "positive durations"),
    ],
)
def test_mistakes_in_maps_are_reported(mechanisms, change, sentence):
    given = {"name": "a", "samples": [1.0], "period": 0.02} | change
    with pytest.raises(ParameterError, match=sentence):
        behaviour(mechanisms["PRBDM"], outputs=["shuttle.x"], inputs=INPUTS, **given)
