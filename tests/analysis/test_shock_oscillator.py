"""A shock of an accelerometer against an independent integration of one equation with two stops.

On parallel flexures with one pivot at each end (1R) the proof mass does not turn.  Its motion obeys
one scalar equation exactly, which SciPy integrates here with Newton's law at the stops.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import prbm
from prbm.analysis.shock import Pulse, shock
from prbm.base.unit_text import GRAVITY
from prbm.mechanics.compliance import damping_factor
from prbm.mechanism.parts import COMPLIANT
from prbm.references.scalar_guide import ScalarGuide
from support import ROOT

LENGTH, WALL, RESTITUTION = 200e-6, 4e-6, 0.5
PULSE = Pulse("half-sine", 500 * GRAVITY, 0.5e-3)
END = 1.5e-3  # s
STIFFNESS = 1e4  # N/m


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


# --- compliant stops --------------------------------------------------------------------------


class Oscillator:
    """The scalar equation with compliant stops: flight, rising and pressed contacts."""

    def __init__(self, guide):
        self.guide, self.a = guide, damping_factor(RESTITUTION)
        self.phase, self.side, self.v0 = "flight", 0.0, 0.0

    def depth(self, y, side):
        """Return the indentation of the stop at a side, and its rate."""
        r = self.guide.r
        return side * r * math.sin(y[0]) - WALL, side * r * math.cos(y[0]) * y[1]

    def force(self, y):
        if self.phase == "flight":
            return 0.0
        d, rate = self.depth(y, self.side)
        return STIFFNESS * d * (1 + self.a * (1.0 if self.phase == "rising" else rate / self.v0))

    def rates(self, t, y):
        base = PULSE.peak * math.sin(math.pi * t / PULSE.duration) if t < PULSE.duration else 0.0
        force = -self.guide.mass * base - self.side * self.force(y)
        return [y[1], self.guide.acceleration(y[0], y[1], force)]

    def growth(self, t, y):
        """Return the second derivative of the indentation."""
        r, (omega, alpha) = self.guide.r, self.rates(t, y)
        return self.side * r * (math.cos(y[0]) * alpha - math.sin(y[0]) * omega**2)

    def events(self):
        """Return functions and directions of the events of the phase, and the phase or side."""
        if self.phase == "flight":
            found = [(lambda t, y, s=s: self.depth(y, s)[0], 1, s) for s in (-1.0, 1.0)]
        elif self.phase == "rising":
            found = [(self.growth, -1, "pressed")]
        else:
            found = [
                (lambda t, y: self.depth(y, self.side)[0], -1, "flight"),
                (lambda t, y: self.depth(y, self.side)[1] - self.v0, 1, "rising"),
            ]
        return found

    def run(self):
        """Return times, closing speeds and peak forces of the impacts.

        The last one ends in rest, until the end of the pulse; its force is that of the pulse.
        """
        t, y, hits = 0.0, np.zeros(2), []
        while t < PULSE.duration:
            found = self.events()
            guards = [guard(*row[:2]) for row in found]
            flight = self.phase == "flight"
            part = solve_ivp(
                self.rates, (t, PULSE.duration), y, method="DOP853", rtol=1e-12, atol=1e-16,
                events=guards,
                max_step=5e-6 if flight else 1e-7, dense_output=not flight,
            )  # fmt: skip
            if not flight:
                hits[-1][2] = max(hits[-1][2], self.peak(part))
            t, y = float(part.t[-1]), part.y[:, -1]
            if part.status != 1:
                continue
            happened = next(row for row, x in zip(found, part.t_events, strict=True) if len(x))
            if flight:
                self.side = happened[2]
                speed = self.depth(y, self.side)[1]
                if speed < self.guide.rest_speed:
                    break
                hits.append([t, speed, 0.0])
                self.v0 = speed
                self.phase = "rising" if self.growth(t, y) > 0 else "pressed"
            else:
                self.phase = happened[2]
                self.v0 = max(self.v0, self.depth(y, self.side)[1])
                self.side = self.side if self.phase != "flight" else 0.0
        return np.array(hits).T

    def peak(self, part):
        """Return the largest force of a part of a contact, by a parabola through its samples."""
        times = np.linspace(part.t[0], part.t[-1], 801)
        forces = [self.force(part.sol(t)) for t in times]
        k = min(max(int(np.argmax(forces)), 1), 799)
        before, at, after = forces[k - 1 : k + 2]
        bend = before - 2 * at + after
        vertex = at - (before - after) ** 2 / (8 * bend) if bend < 0 else at
        return max(*forces, vertex if 0 < int(np.argmax(forces)) < 800 else at)


def guard(function, direction):
    """Return a terminal event of SciPy."""

    def event(t, y):
        return function(t, y)

    event.terminal, event.direction = True, direction
    return event


@pytest.mark.parametrize(("tolerance", "error"), [(1e-8, 1e-4), (1e-12, 1e-6)])
def test_impacts_on_compliant_stops_are_those_of_the_oscillator(tolerance, error):
    """Times relative to the pulse, speeds and forces relative to the largest."""
    mechanism = prbm.load(str(ROOT / "tests" / "support" / "accelerometer_1r.toml"))
    guide = scalar(mechanism)
    stops = tuple(replace(s, law=COMPLIANT, stiffness=STIFFNESS) for s in mechanism.stops)
    found = shock(
        replace(mechanism, stops=stops), {PULSE.input: PULSE.signal},
        {"solver.tolerance": tolerance}, duration=PULSE.duration, stop_time=END,
    )  # fmt: skip
    times, speeds, forces = Oscillator(guide).run()
    hits = [x.latched for x in found.result.impacts][: len(times)]
    assert len(hits) == len(times) >= 5
    assert hits[-1].contact_duration > 2 * max(x.contact_duration for x in hits[:-1])
    own_times = np.array([x.impact_time for x in hits])
    assert np.abs(own_times - times).max() < error * PULSE.duration
    own_speeds = np.array([x.approach_speed for x in hits])
    assert np.abs(own_speeds - speeds).max() < error * speeds.max()
    own_forces = np.array([x.peak_force for x in hits])
    assert np.abs(own_forces - forces)[:-1].max() < error * forces.max()
    assert found.hits[1].force == pytest.approx(forces.max(), rel=error)
