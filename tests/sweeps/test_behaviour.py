"""Maps of behaviour: the bouncing ball on a table, whose thresholds are known in closed form."""

import math

import numpy as np
import pytest

from prbm.base.errors import ParameterError
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
