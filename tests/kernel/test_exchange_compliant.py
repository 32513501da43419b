"""Model exchange with compliant stops: states, indicators, events and directional derivatives."""

import math
from dataclasses import replace

import numpy as np
import pytest

from exchange import assert_directional, integrate
from kernel_library import constants
from kernel_simulation import KernelSimulation
from point_mass import MASS, point_mass
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.inputs import input_names
from support import energy_balance, mechanism

INPUTS = {
    "force.x": 0.1, "force.y": -0.2, "force.moment": 1e-3, "stop.displacement": 1e-3,
    "stop.velocity": 0.02, "base.acceleration.x": 0.3, "base.acceleration.y": -0.4,
}  # fmt: skip
FRICTION = {"stop.friction": 0.3, "damping.zeta": 0.05}
CONTACTS = [
    (phase, slides)
    for phase in ("PRESSED", "RISING", "FROZEN")
    for slides in (2, 1, -1, 0)
] + [("FREE", 2)]  # fmt: skip


def soft(name, stiffness, **changes):
    """Return a shipped guide with a compliant stop."""
    own = mechanism(name)
    stop = replace(own.stops[0], law="compliant", stiffness=stiffness, **changes)
    return replace(own, stops=(stop,))


@pytest.mark.parametrize(("phase", "slides"), CONTACTS)
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_directional_derivatives_in_contact_equal_differences(exponent, phase, slides):
    """The contact is pressed, rises, is free or settled, and slides, sticks or has no friction."""
    own = soft("PRBDM2R", 1e4 if exponent == 1.0 else 1e5, exponent=exponent, direction=10.0)
    contact = constants()[f"PHASE_{phase}"], 0.7, 1e-4 if phase == "FROZEN" else 0.0
    assert_directional(own, FRICTION, INPUTS, (1, slides, 2), contact)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_hits_in_model_exchange_are_those_of_co_simulation(friction):
    """The body hits the stop several times; the indicators are positive after each event."""
    own = soft("PRBDM", 1e5, friction=friction, direction=20.0 if friction else 0.0)
    kernel, alone, phases = KernelSimulation(own, exchange=True), Simulation(own), set()
    start = energy_balance({name: kernel.get(name) for name in alone.outputs()})
    for t, z in integrate(kernel, 0.225, h=4e-5):
        assert (z > 0.0).all(), (t, z)
        phases.add(kernel.touching(0))
    alone.advance(0.225)
    expected = {name: float(x) for name, x in alone.outputs().items()}
    assert expected["stop.impact_count"] > 1
    assert constants()["PHASE_RISING"] in phases or friction
    exact = ("stop.impact_count", "stop.contact", "stop.impact_time", "stop.contact_duration")
    for name in exact:
        assert kernel.get(name) == pytest.approx(expected[name], abs=1e-6), name
    for name in ("approach_speed", "energy_lost", "impulse", "impulse_sum", "contact_loss"):
        rel = 1e-3 if friction else 1e-4
        assert kernel.get(f"stop.{name}") == pytest.approx(expected[f"stop.{name}"], rel=rel)
    for name in ("peak_force", "indentation"):
        assert kernel.get(f"stop.{name}") == pytest.approx(expected[f"stop.{name}"], rel=1e-3)
    assert kernel.get("stop.force") == pytest.approx(expected["stop.force"], rel=1e-3)
    found = energy_balance({name: kernel.get(name) for name in expected})
    assert found == pytest.approx(start, rel=1e-6)


@pytest.mark.parametrize(("restitution", "exponent"), [(1.0, 1.0), (0.6, 1.0), (0.2, 1.5)])
def test_maxima_of_a_contact_do_not_depend_on_completed_steps(restitution, exponent):
    """No step is completed between first touch and separation; each extremum is an event.

    The body then bounces between the stop and the springs.  Without damping the largest force and
    indentation have closed forms, up to the arc on which the body moves.
    """
    stiffness = 1e5 if exponent == 1.0 else 1e7
    own = point_mass(stiffness=stiffness, restitution=restitution, exponent=exponent)
    kernel, alone = KernelSimulation(own, exchange=True), Simulation(own)
    count = 0
    for t, z in integrate(kernel, 2e-3, h=2e-6, completes=False):
        assert (z > 0.0).all(), (t, z)
        count += kernel.touching(0) != 0
    assert count >= 2  # Touch and the maxima.
    alone.advance(2e-3)
    expected = alone.outputs()
    for name in ("peak_force", "indentation", "contact_duration"):
        found = kernel.get(f"stop.{name}")
        assert found == pytest.approx(float(expected[f"stop.{name}"]), rel=1e-6), name
    if restitution == 1.0:
        speed, root = kernel.get("stop.approach_speed"), math.sqrt(stiffness * MASS)
        assert kernel.get("stop.peak_force") == pytest.approx(speed * root, rel=1e-4)
        assert kernel.get("stop.indentation") == pytest.approx(speed * MASS / root, rel=1e-4)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_the_indicator_of_the_largest_force_has_a_directional_derivative(exponent):
    """Shortly before the largest force, the indicator is the relative rate of the force."""
    own = point_mass(stiffness=1e5, restitution=0.3, exponent=exponent)
    kernel = KernelSimulation(own, exchange=True)
    events = [t for t, _ in integrate(kernel, 2e-3, h=2e-6)]
    at = events[0] + 0.95 * (events[1] - events[0])
    kernel = KernelSimulation(own, exchange=True)
    assert len([*integrate(kernel, at, h=2e-6)]) == 1
    x, t = kernel.exchange_get(), kernel.get("time")
    name, inputs = "stop.release_indicator", np.zeros(len(input_names(own)))
    place = list(kernel.slots).index(name)
    phase = 1.0 + kernel.get("stop.gap_rate") / kernel.get("stop.approach_speed")
    assert 0.0 < kernel.get(name) < 0.95 * phase  # The margin of the phase is larger.
    for k in range(2):  # Angle and rate.
        dx = np.eye(len(x))[k]
        h = 1e-7 * abs(x[k])
        values = []
        for step in (h, -h):
            kernel.exchange_set(t, x + step * dx)
            values.append(kernel.get(name))
        kernel.exchange_set(t, x)
        slope = (values[0] - values[1]) / (2 * h)
        assert kernel.directional(dx, inputs)[place] == pytest.approx(slope, rel=1e-5)


def test_an_extremum_is_the_sign_change_of_an_indicator():
    """Rows at events contain the largest force and the largest indentation, whose rate is zero."""
    kernel = KernelSimulation(point_mass(stiffness=1e5), exchange=True)
    seen = []
    for _ in integrate(kernel, 1.6e-3, h=2e-6, completes=False):
        seen.append((kernel.get("stop.force"), kernel.get("stop.gap_rate")))
    forces, rates = np.array(seen).T
    assert forces.max() == pytest.approx(kernel.get("stop.peak_force"), rel=1e-10)
    assert np.abs(rates[1:]).min() < 1e-6  # The largest indentation is an event.


def test_sampled_peaks_of_the_stress_need_a_twentieth_of_the_period():
    """The pages of FMUs with outputs of the stress name this step, and an error of 0.1 %."""
    own = mechanism("PRBDM")
    types = tuple(replace(kind, stress=True) for kind in own.flexure_types)
    free = {"stop.position": 0.03, "damping.beta": 0.0, "release.displacement": -5e-3}
    own = replace(own, flexure_types=types)
    name = f"{own.flexures[0].name}.peak_stress"
    period = 1.0 / Simulation(own, free).frequency
    kernel = KernelSimulation(own, free | {"release.velocity": 0.2}, exchange=True)
    alone = Simulation(own, free | {"release.velocity": 0.2})
    alone.advance(1.2 * period)
    assert [*integrate(kernel, 1.2 * period, h=period / 20)] == []
    assert kernel.get(name) == pytest.approx(float(alone.outputs()[name]), rel=1e-3)


@pytest.mark.parametrize("exchange", [False, True])
def test_the_force_of_a_preload_is_a_maximum_from_the_start(exchange):
    own = point_mass(stiffness=1e5, displacement=1e-5, velocity=0.0)
    kernel = KernelSimulation(own, exchange=exchange)
    if exchange:
        kernel.event()
    force = kernel.get("stop.force")
    assert force == pytest.approx(1.0, rel=1e-6)
    assert kernel.get("stop.peak_force") == force
    assert kernel.get("stop.indentation") == pytest.approx(1e-5, rel=1e-9)
    out = Simulation(own).outputs()
    assert out["stop.peak_force"] == out["stop.force"] == pytest.approx(force, rel=1e-12)


@pytest.mark.slow
def test_a_resting_body_settles_and_is_pulled_off_in_model_exchange():
    """A settled contact is left when a force reduces its load by more than a per cent."""
    own = soft("PRBDM", 1e5)
    kernel, phases = KernelSimulation(own, exchange=True), []
    forces = lambda t: {"force.x": 0.05 if t > 0.4 else 0.0}  # noqa: E731
    for _, z in integrate(kernel, 0.45, h=1e-4, inputs=forces):
        assert (z > 0.0).all()
        phases.append(kernel.touching(0))
    settled = constants()["PHASE_FROZEN"]
    assert settled in phases
    assert phases[-1] != settled or phases.count(settled) > 1
    assert kernel.get("stop.contact") == 1.0


def test_a_state_saved_in_contact_restores_to_the_same_bytes_in_model_exchange():
    kernel = KernelSimulation(soft("PRBDM2R", 1e6), exchange=True)
    next(integrate(kernel, 0.2))
    assert kernel.touching(0) in (constants()["PHASE_PRESSED"], constants()["PHASE_RISING"])
    saved, ends = kernel.state, []
    for _ in range(2):
        kernel.restore(saved)
        assert kernel.state.tobytes() == saved.tobytes()
        kernel.exchange_set(kernel.get("time") + 1e-5, kernel.exchange_get())
        kernel.completed_step()
        kernel.event()
        ends.append(kernel.state.tobytes())
    assert ends[0] == ends[1]
