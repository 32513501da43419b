"""A shock of an accelerometer against an independent integration of one equation with two stops.

On parallel flexures with one pivot at each end (1R) the proof mass does not turn.  Its motion obeys
one scalar equation exactly, which SciPy integrates here with Newton's law at the stops.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import prbm
from prbm.analysis.shock import Pulse, shock
from prbm.base.unit_text import GRAVITY
from prbm.references.scalar_guide import ScalarGuide
from support import ROOT

LENGTH, WALL, RESTITUTION = 200e-6, 4e-6, 0.5
PULSE = Pulse("half-sine", 500 * GRAVITY, 0.5e-3)
END = 1.5e-3  # s


def scalar(mechanism):
    """Return the scalar equation of the accelerometer."""
    values = mechanism.values()
    own = {f"flexure.{k.removeprefix('beam.')}": x for k, x in values.items() if "beam." in k}
    own |= {"flexure.length": LENGTH, "shuttle.mass": values["proof.mass"], "damping.beta": 0.0}
    own |= {f"stop.{name}": values[f"bump_left.{name}"] for name in ("restitution", "rest_speed")}
    return ScalarGuide.of(own, (-WALL, WALL))


def impacts(guide):
    """Return times [s] and closing speeds [m/s] of the impacts before the first rest."""

    def rates(t, y):
        base = PULSE.peak * math.sin(math.pi * t / PULSE.duration) if t < PULSE.duration else 0.0
        return [y[1], guide.acceleration(y[0], y[1], -guide.mass * base)]

    def gap(wall):
        def event(t, y):
            return math.copysign(1.0, wall) * (wall - guide.r * math.sin(y[0]))

        event.terminal, event.direction = True, -1
        return event

    t, y, found = 0.0, np.zeros(2), []
    while t < END:
        part = solve_ivp(
            rates, (t, PULSE.duration if t < PULSE.duration else END), y, method="DOP853",
            rtol=1e-12, atol=1e-15, events=[gap(wall) for wall in guide.stops], max_step=5e-6,
        )  # fmt: skip
        t, y = float(part.t[-1]), part.y[:, -1]
        if part.status != 1:
            continue
        speed = abs(float(y[1])) * guide.r * math.cos(y[0])
        if speed < guide.rest_speed:
            break
        found.append((t, speed))
        y = np.array([y[0], -guide.restitution * y[1]])
    return found


@pytest.mark.parametrize(("tolerance", "error"), [(1e-8, 1e-4), (1e-12, 1e-6)])
def test_impacts_under_a_shock_are_those_of_the_oscillator_with_stops(tolerance, error):
    """Times relative to the pulse, speeds relative to the fastest impact."""
    mechanism = prbm.load(str(ROOT / "tests" / "support" / "accelerometer_1r.toml"))
    expected = impacts(scalar(mechanism))
    found = shock(
        mechanism, {PULSE.input: PULSE.signal}, {"solver.tolerance": tolerance},
        duration=PULSE.duration, stop_time=END,
    )  # fmt: skip
    hits = [(x.time, x.latched.approach_speed) for x in found.result.impacts]
    assert len(hits) == len(expected) >= 5
    times, speeds = (np.array(x) for x in zip(*hits, strict=True))
    true_times, true_speeds = (np.array(x) for x in zip(*expected, strict=True))
    assert np.abs(times - true_times).max() < error * PULSE.duration
    assert np.abs(speeds - true_speeds).max() < error * true_speeds.max()
    left = found.hits[1]
    assert (left.stop, left.count) == ("bump_left", len(expected))
    assert left.speed == pytest.approx(true_speeds.max(), rel=error)
    effective = scalar(mechanism).mass * (1 + RESTITUTION) * true_speeds.max()
    assert left.impulse == pytest.approx(effective, rel=1e-3)
