"""Impacts between two bodies on parallel guides (1R)."""

import math

import numpy as np
import pytest

from prbm.hybrid.simulation import Simulation
from support import ScalarGuide, mechanism, run

NAME = "ImpactOscillator"


def guides(values) -> tuple[ScalarGuide, ScalarGuide]:
    """Return the scalar equations of the hammer and the oscillator."""
    found = []
    for body, leaf in (("hammer", "hammer_leaf"), ("oscillator", "oscillator_leaf")):
        v = {key.replace(leaf, "flexure"): x for key, x in values.items() if key.startswith(leaf)}
        v |= {f"flexure.{key}": values[f"steel.{key}"] for key in ("youngs_modulus", "density")}
        v |= {"shuttle.mass": values[f"{body}.mass"], "gravity.x": 0.0}
        found.append(ScalarGuide.of(v))
    return found[0], found[1]


@pytest.fixture(scope="module")
def default():
    return run(NAME)


def motions(simulation: Simulation, q, v) -> list[tuple[complex, complex]]:
    """Return complex displacements and velocities of the two bodies."""
    system = simulation.system
    E = system.directions(q)
    out = []
    for name in ("hammer", "oscillator"):
        frame = system.bodies[name]
        z = complex(frame.A @ E + frame.c - frame.drawn)
        moving = complex(frame.A @ (1j * E * v))
        out.append((z, moving))
    return out


def test_impacts_obey_newtons_law_and_conserve_momentum(default) -> None:
    """The impulse is P = (1 + eps) u/(1/m_1 + 1/m_2), with the closing speed u.

    A body on a parallel guide moves along a circle of radius r = gamma L; the impulse is along x.
    The effective mass is m_i = M_i/cos(phi_i)^2 with sin(phi_i) = x_i/r_i.
    """
    hammer, oscillator = guides(default.simulation.values)
    assert len(default.simulation.record) > 5
    restitution = default.simulation.values["impact.restitution"]
    for impact in default.simulation.record:
        mass, change = [], []
        before = motions(default.simulation, impact.q, impact.before)
        after = motions(default.simulation, impact.q, impact.after)
        for guide, (z, old), (_, new) in zip((hammer, oscillator), before, after, strict=True):
            mass.append(guide.mass / (1.0 - (z.real / guide.r) ** 2))
            change.append(new.real - old.real)
        closing = before[0][1].real - before[1][1].real
        opening = after[1][1].real - after[0][1].real
        assert impact.latched.approach_speed == pytest.approx(closing, rel=1e-9)
        assert opening == pytest.approx(restitution * closing, rel=1e-9)
        pair = 1.0 / (1.0 / mass[0] + 1.0 / mass[1])
        assert impact.impulse == pytest.approx((1 + restitution) * pair * closing, rel=1e-9)
        np.testing.assert_allclose(np.multiply(mass, change), [-impact.impulse, impact.impulse])
        lost = 0.5 * (1 - restitution**2) * pair * closing**2
        assert impact.latched.energy_lost == pytest.approx(lost, rel=1e-9)


def test_the_gap_is_the_distance_of_hammer_and_oscillator(default) -> None:
    """The gap is the distance of the two bodies, 2 mm in the straight shape, and never negative."""
    apart = default.column("oscillator.x") - default.column("hammer.x") + 2e-3
    np.testing.assert_allclose(default.column("impact.gap"), apart, atol=1e-12)
    assert apart.min() > -1e-12
    assert np.ptp(default.column("oscillator.x")) > 5e-3


def test_first_hit_is_at_the_time_of_the_scalar_equation() -> None:
    """The hammer moves from -6 mm to the face at 2 mm; the oscillator is at rest."""
    undamped = {"damping.beta": 0.0, "damping.zeta": 0.0}
    result = run(NAME, undamped, stop_time=0.012, tolerance=1e-11)
    hammer, _ = guides(result.simulation.values)
    a, b = (math.asin(x / hammer.r) for x in (-6e-3, 2e-3))
    impact = result.simulation.record[0]
    assert impact.time == pytest.approx(hammer.time(a, b), rel=1e-9)
    closing = hammer.speed(b, hammer.potential(a)) * hammer.r * math.cos(b)
    assert impact.latched.approach_speed == pytest.approx(closing, rel=1e-9)


@pytest.mark.slow
def test_impacts_with_restitution_one_conserve_energy() -> None:
    values = {"impact.restitution": 1.0, "damping.beta": 0.0, "damping.zeta": 0.0}
    result = run(NAME, values, stop_time=0.3, tolerance=1e-11)
    assert len(result.simulation.record) > 5
    kept = result.column("energy.kinetic") + result.column("energy.elastic")
    np.testing.assert_allclose(kept, kept[0], rtol=1e-8)


def driven(gap: float) -> tuple[np.ndarray, Simulation]:
    """Return the displacement of the oscillator while a periodic force acts on the hammer [m]."""
    values = {"release.displacement": 0.0, "impact.distance": gap}
    simulation = Simulation(mechanism(NAME), values)
    period = 1.0 / simulation.frequency
    x = []
    for k in range(600):
        t = k * 2e-3
        simulation.set({"drive.x": 1.2 if t % period < period / 8 else 0.0})
        simulation.advance(t + 2e-3)
        x.append(simulation.outputs()["oscillator.x"])
    return np.array(x), simulation


@pytest.mark.slow
def test_the_hammer_drives_the_oscillator_only_by_impacts() -> None:
    x, simulation = driven(2e-3)
    assert simulation.outputs()["impact.impact_count"] > 5
    assert np.abs(x[300:]).max() > 1e-3
    out = simulation.outputs()
    assert out["energy.work"] > 0.0
    far, untouched = driven(0.03)
    assert untouched.outputs()["impact.impact_count"] == 0
    assert np.abs(far).max() < 1e-9
