"""Model exchange with compliant stops: states, indicators, events and directional derivatives."""

from dataclasses import replace

import pytest

from exchange import assert_directional, integrate
from kernel_library import constants
from kernel_simulation import KernelSimulation
from prbm.hybrid.simulation import Simulation
from support import energy_balance, mechanism

INPUTS = {
    "force.x": 0.1, "force.y": -0.2, "force.moment": 1e-3, "stop.displacement": 1e-3,
    "stop.velocity": 0.02, "base.acceleration.x": 0.3, "base.acceleration.y": -0.4,
}  # fmt: skip
FRICTION = {"stop.friction": 0.3, "damping.zeta": 0.05}
CONTACTS = [
    (phase, slides)
    for phase in ("PRESSED", "RISING", "SETTLED")
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
    contact = constants()[f"PHASE_{phase}"], 0.7, 1e-4 if phase == "SETTLED" else 0.0
    assert_directional(own, FRICTION, INPUTS, (1, slides, 2), contact)


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


def test_a_resting_body_settles_and_is_pulled_off_in_model_exchange():
    """A settled contact is left when a force reduces its load by more than a per cent."""
    own = soft("PRBDM", 1e5)
    kernel, phases = KernelSimulation(own, exchange=True), []
    forces = lambda t: {"force.x": 0.05 if t > 0.4 else 0.0}  # noqa: E731
    for _, z in integrate(kernel, 0.45, h=1e-4, inputs=forces):
        assert (z > 0.0).all()
        phases.append(kernel.touching(0))
    settled = constants()["PHASE_SETTLED"]
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
