"""The laws of moving walls in FMUs, whichever interface moves them (prbm.hybrid.walls)."""

import itertools
import math

import numpy as np
import pytest

from native_host import OK, Instance
from support import energy_balance, simulation

WAYS = [(2, "cs"), (3, "cs"), (3, "events"), (3, "late")]
ways = pytest.mark.parametrize(("fmi", "kind"), WAYS)
PRESSED = {"release.displacement": 0.0}
AMPLITUDE, RATE = 1e-3, 10 * math.pi

pytestmark = [pytest.mark.fmu, pytest.mark.native]


def sine(t):
    return {
        "stop.displacement": AMPLITUDE * math.sin(RATE * t),
        "stop.velocity": AMPLITUDE * RATE * math.cos(RATE * t),
    }


def points(end):
    """Return communication points at random distances from 1 us to 20 ms."""
    rng, found = np.random.default_rng(7), [0.0]
    while found[-1] < end:
        found.append(found[-1] + float(np.exp(rng.uniform(math.log(1e-6), math.log(2e-2)))))
    return found


@ways
def test_uniform_motion_is_followed_exactly(native, fmi, kind):
    speed, distance = -0.1, 5e-3
    values = {"release.displacement": 0.0, "gravity.x": 0.0, "stop.position": distance,
              "stop.velocity": speed}  # fmt: skip
    with Instance(native["PRBDM", fmi], kind) as instance:
        instance.initialize(values=values)
        for t, end in itertools.pairwise(points(0.1)):
            assert instance.set({"stop.displacement": speed * t, "stop.velocity": speed}) == OK
            instance.advance(end)
            found = instance.values()
            if found["stop.impact_count"]:
                break
    assert found["stop.impact_time"] == pytest.approx(-distance / speed, abs=1e-9)
    assert found["stop.approach_speed"] == pytest.approx(-speed, rel=1e-9)


@ways
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_pressed_body_stays_on_its_wall(native, model, fmi, kind):
    with Instance(native[model, fmi], kind).initialize(values=PRESSED) as instance:
        count, rested = None, False
        for t, end in itertools.pairwise(points(0.2)):
            assert instance.set(sine(t)) == OK
            instance.advance(end)
            found = instance.values()
            if rested:
                assert found["stop.contact"]
            elif t > 0.05:
                rested = found["stop.contact"]
                count = found["stop.impact_count"]
    assert rested
    assert found["stop.impact_count"] == count
    start = energy_balance(simulation(model, PRESSED).outputs())
    assert energy_balance(found) == pytest.approx(start, abs=1e-9)


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("kind", ["events", "late"])
def test_inputs_that_are_set_in_events_move_the_wall_no_differently(native, kind, inside):
    """A velocity that is set in an event is that of the wall from there on."""
    with Instance(native["PRBDM", 3], kind).initialize(values=PRESSED) as instance:
        for k in range(200):
            instance.change(sine(k * 1e-3)) if inside else instance.set(sine(k * 1e-3))
            instance.advance((k + 1) * 1e-3)
            if k == 100:
                count = instance.values()["stop.impact_count"]
        found = instance.values()
    assert found["stop.contact"]
    assert found["stop.impact_count"] == count
    assert found["shuttle.x"] == pytest.approx(sine(0.2)["stop.displacement"], abs=2e-6)
    start = energy_balance(simulation("PRBDM", PRESSED).outputs())
    assert energy_balance(found) == pytest.approx(start, abs=1e-9)


@pytest.mark.parametrize("speed", [-5e-4, 5e-4, -2e-2])
def test_a_jump_below_rest_speed_keeps_a_stop_closed_and_is_a_capture(native, speed):
    with Instance(native["PRBDM", 3], "events").initialize(values=PRESSED) as instance:
        instance.advance(1e-3)
        before = instance.values()
        instance.change({"stop.velocity": speed})
        found = instance.values()
    assert found["stop.contact"] == (abs(speed) < 1e-3)
    assert found["stop.impact_count"] == (abs(speed) >= 1e-3)
    assert energy_balance(found) == pytest.approx(energy_balance(before), abs=1e-12)
    if found["stop.contact"]:
        assert found["shuttle.vx"] == pytest.approx(speed, rel=1e-9)
        lost = found["energy.dissipated"] - before["energy.dissipated"]
        mass = 1 / found["stop.point.mobility"]
        assert lost == pytest.approx(mass * speed**2 / 2, rel=1e-6)


@ways
def test_a_state_saved_while_a_wall_catches_up_restores_to_the_same_bytes(native, fmi, kind):
    def goes_on(instance, begin):
        rows = []
        for k in range(10):
            t = begin + k * 1e-3
            instance.set({"stop.displacement": sine(t)["stop.displacement"]})
            instance.advance(t + 1e-3)
            rows.append(instance.bytes())
        return rows

    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        goes_on(instance, 0.0)
        state, time = instance.fmu.getFMUState(), instance.time
        first = goes_on(instance, time)
        instance.fmu.setFMUState(state)
        instance.time = time
        assert goes_on(instance, time) == first
        instance.fmu.freeFMUState(state)
    with (
        Instance(native["PRBDM", fmi], kind).initialize() as one,
        Instance(native["PRBDM", fmi], kind).initialize() as other,
    ):
        goes_on(one, 0.0)
        other.set({"stop.displacement": 1e-3})
        other.advance(0.02)
        assert goes_on(one, time) == first


@pytest.mark.parametrize("fmi", [2, 3])
def test_in_model_exchange_a_pressed_body_follows_its_wall(native, fmi):
    """Where the wall is at each moment as the inputs say, with events at changes of its speed."""
    with Instance(native["PRBDM", fmi], "me", substep=1e-4) as instance:
        instance.initialize(values=PRESSED)
        for k in range(300):
            instance.set(sine(k * 1e-4 + 0.05))
            instance.advance((k + 1) * 1e-4)
            if k == 100:
                count = instance.values()["stop.impact_count"]
        found = instance.values()
    assert found["stop.contact"]
    assert found["stop.impact_count"] == count
    assert abs(found["stop.gap"]) < 1e-5
