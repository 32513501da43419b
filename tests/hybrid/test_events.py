"""Guards and resets of events, evaluations and the step size controller."""

import math
from dataclasses import replace

import numpy as np
import pytest

from prbm.base.tolerances import STEP_GROWTH_MAX, STEP_SHRINK_MIN
from prbm.hybrid import events
from prbm.hybrid.events import TRANSITIONS, EventKind
from prbm.hybrid.simulation import Simulation
from prbm.hybrid.stepping import StepSizeController, rounded_step
from prbm.mechanics.contact_state import ContactMode, ContactState
from support import mechanism, simulation

SLIDING = {
    "gravity.x": 0.0, "release.displacement": -1e-3, "stop.position": 0.01,
    "friction.coefficient": 1.0, "friction.normal_force": 2e-3,
}  # fmt: skip
RUBBING = {
    "release.displacement": 0.0, "stop.friction": 0.5, "stop.offset": 0.01,
}  # fmt: skip


def fixed(t):
    """Return displacement [m] and velocity [m/s] of a fixed wall."""
    return 0.0, 0.0


def ramp(t):
    return 0.05 * t, 0.05


def sine(t):
    return 1e-4 * math.sin(31.0 * t), 31e-4 * math.cos(31.0 * t)


def test_each_kind_of_event_has_one_guard_and_one_reset():
    assert [row.kind for row in TRANSITIONS] == list(EventKind)


def test_contact_modes_change_before_an_impact_at_the_same_time(monkeypatch):
    """The earliest event is first; at one time the order is release, slip, reversal, impact."""
    found = dict.fromkeys(EventKind, 1.0) | {EventKind.SLIP: 0.5}
    rows = [
        replace(row, watched=lambda looks: (0,), detect=lambda *_, kind=row.kind: found[kind])
        for row in TRANSITIONS
    ]
    monkeypatch.setattr(events, "TRANSITIONS", rows)
    assert events.first_event(None).kind == EventKind.SLIP
    found[EventKind.SLIP] = 1.0
    assert events.first_event(None).kind == EventKind.RELEASE
    found |= {kind: None for kind in EventKind if kind is not EventKind.IMPACT}
    assert events.first_event(None) == events.Event(EventKind.IMPACT, 0, 1.0)


@pytest.mark.parametrize(
    ("kind", "model", "values", "wall"),
    [
        (EventKind.IMPACT, "PRBDM", {}, fixed),
        (EventKind.REVERSAL, "PRBDM", SLIDING, fixed),
        (EventKind.RELEASE, "PRBDM", {"release.displacement": 0.0, "stop.rest_speed": 0.2}, ramp),
        (EventKind.SLIP, "PRBDM2R", RUBBING, sine),
    ],
)
def test_the_guard_of_an_event_falls_to_zero(monkeypatch, kind, model, values, wall):
    """The wall is fixed, retreats from the shuttle that rests on it, or vibrates."""
    guard = next(row.guard for row in TRANSITIONS if row.kind == kind)
    found, apply = [], events.apply

    def recording(configuration, front, event):
        found.append((front, event))
        return apply(configuration, front, event)

    monkeypatch.setattr(events, "apply", recording)
    sim = simulation(model, values)
    for k in range(300):
        sim.set(dict(zip(("stop.displacement", "stop.velocity"), wall(k * 1e-3), strict=True)))
        sim.advance((k + 1) * 1e-3)
        if found and found[-1][1].kind == kind:
            break
    front, event = found[-1]
    assert event.kind == kind

    def z(h):
        n, y, a = (
            front.equations.n,
            front.y.copy(),
            front.equations.evaluate(front.time, front.q, front.v).a,
        )
        y[:n] -= h * front.v - h**2 / 2 * a
        y[n : 2 * n] -= h * a
        return guard(front.equations, event.contact, event.time - h, y)

    assert z(1e-7) > 100 * abs(z(0.0))
    assert z(1e-6) == pytest.approx(10 * z(1e-7), rel=0.05)


def test_a_later_evaluation_does_not_change_the_arrays_of_an_earlier_one():
    sim = simulation("PRBDM2R")
    q, v = sim.front.q, sim.front.v
    first = sim.equations.evaluate(sim.time, q, v)
    kept = [x.copy() for x in (first.a, first.lam, first.M, first.factors[0])]
    sim.equations.evaluate(sim.time, q + 0.1, v + 1.0)
    for x, same in zip((first.a, first.lam, first.M, first.factors[0]), kept, strict=True):
        np.testing.assert_array_equal(x, same)


def test_any_number_of_stops_can_rest_at_once():
    """Of many equal stops, one carries the guide; the motion is that with one stop."""
    guide = mechanism("PRBDM")
    stops = tuple(replace(guide.stops[0], name=f"wall{k}") for k in range(24))
    crowded = Simulation(replace(guide, stops=stops), {"release.displacement": 0.0})
    alone = Simulation(guide, {"release.displacement": 0.0})
    assert len(crowded.contacts.held) == 1
    force = sum(crowded.outputs()[f"{s.name}.force"] for s in stops)
    assert force == pytest.approx(alone.outputs()["stop.force"], rel=1e-9)
    crowded.advance(1e-3)
    assert crowded.outputs()["shuttle.x"] == pytest.approx(alone.outputs()["shuttle.x"], abs=1e-12)


def test_changes_of_the_step_size_are_limited():
    controller = StepSizeController(h=1e-3)
    growth = min(STEP_GROWTH_MAX, 0.85 * 1e-4 ** -(1 / 8 - 0.07))
    assert controller.next(0.0).h == rounded_step(1e-3 * growth)
    for error in (1e12, math.inf, math.nan):
        rejected = controller.next(error)
        assert rejected.h == rounded_step(1e-3 * STEP_SHRINK_MIN)
        assert rejected.next(1e-9).h <= rejected.h


def test_contact_modes_have_the_directions_of_their_slip():
    assert [mode.slip for mode in ContactMode] == [0, 0, 0, 1, -1]
    state = ContactState.free(stops=2, points=1).holding([1]).with_mode(2, ContactMode.STICK)
    assert state.held == (1,)
    assert state.open_stops == (0,)
    assert state.released(1) == state.opened()
    assert state.without_friction().modes[2] is ContactMode.FRICTIONLESS
