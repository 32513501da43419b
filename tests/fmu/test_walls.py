"""The laws of moving walls in FMUs, for all interfaces (prbm.hybrid.walls)."""

import itertools
import math

import numpy as np
import pytest

from fmu_host import Instance as PythonInstance
from native_host import OK, Instance, Integrator
from prbm.systems.cosimulation import simulate
from support import energy_balance, simulation

WAYS = [(2, "cs"), (3, "cs"), (3, "events"), (3, "late")]
"""Versions and interfaces of co-simulation with native FMUs."""
ways = pytest.mark.parametrize(("fmi", "kind"), WAYS)
all_ways = pytest.mark.parametrize(("fmi", "kind"), [("python", "cs"), *WAYS])
PRESSED = {"release.displacement": 0.0}
AMPLITUDE, RATE = 1e-3, 10 * math.pi

pytestmark = [pytest.mark.fmu, pytest.mark.native]


def sine(t):
    return {
        "stop.displacement": AMPLITUDE * math.sin(RATE * t),
        "stop.velocity": AMPLITUDE * RATE * math.cos(RATE * t),
    }


def points(end, longest=2e-2):
    """Return communication points at random distances from 1 us up."""
    rng, found = np.random.default_rng(7), [0.0]
    while found[-1] < end:
        found.append(found[-1] + float(np.exp(rng.uniform(math.log(1e-6), math.log(longest)))))
    return found


class Guide(PythonInstance):
    """An instance of a Python FMU with the methods of a native instance."""

    time = 0.0

    def initialize(self, *, values):
        return super().initialize(**{name.replace(".", "__"): x for name, x in values.items()})

    def set(self, values):
        super().set(values)
        return OK

    def advance(self, end):
        assert self.step(self.time, end - self.time) == OK
        self.time = end

    def saved(self):
        state = self.fmu.getFMUState()
        data = self.fmu.serializeFMUstate(state)
        self.fmu.freeFMUState(state)
        return data

    def restore(self, data):
        state = self.fmu.deSerializeFMUstate(data)
        self.fmu.setFMUState(state)
        self.fmu.freeFMUState(state)

    def reset(self):
        self.fmu.reset()
        self.time = 0.0


@pytest.fixture
def opened(fmus, native):
    """Return a function that instantiates an FMU of a model, version and interface."""

    def instance(model, fmi, kind):
        return Guide(fmus[model]) if fmi == "python" else Instance(native[model, fmi], kind)

    return instance


AWAY = {"release.displacement": 0.0, "gravity.x": 0.0, "stop.position": 0.01}
"""Values for a shuttle at rest, with the wall out of reach."""


def place(found):
    """Return the displacement of the wall, up to a constant [m]."""
    return found["stop.gap"] + found["stop.point.displacement"]


@all_ways
@pytest.mark.parametrize("longest", [1e-3, 1e-2])
def test_a_wall_is_within_twice_the_acceleration_times_the_step_squared(opened, fmi, kind, longest):
    grid = points(0.25, longest)
    with opened("PRBDM", fmi, kind).initialize(values=AWAY) as instance:
        begin = place(instance.values())
        for t, end in itertools.pairwise(grid):
            assert instance.set(sine(t)) == OK
            instance.advance(end)
            if t > 6 * longest and end - t > 0.1 * longest:
                off = place(instance.values()) - begin - sine(end)["stop.displacement"]
                assert abs(off) < 2 * AMPLITUDE * RATE**2 * longest**2


@all_ways
def test_position_error_of_a_wall_after_a_jump_is_at_most_the_jump(opened, fmi, kind):
    jump = -1e-3
    with opened("PRBDM", fmi, kind).initialize(values=AWAY) as instance:
        begin = place(instance.values())
        for t, end in itertools.pairwise(points(0.15)):
            given = jump if t > 0.05 else 0.0
            assert instance.set({"stop.displacement": given}) == OK
            instance.advance(end)
            off = place(instance.values()) - begin - given
            assert abs(off) <= abs(jump) * (1 + 1e-9)
    assert off == pytest.approx(0.0, abs=1e-12)


class Moved(Integrator):
    """An integrator that sets the position of a uniformly moving wall at each evaluation."""

    speed = -0.1

    def put(self, time, x):
        super().put(time, x)
        self.it.set({"stop.displacement": self.speed * time, "stop.velocity": self.speed})


@pytest.mark.parametrize("fmi", [2, 3])
def test_in_model_exchange_uniform_motion_is_followed_exactly(native, fmi):
    distance = 5e-3
    values = AWAY | {"stop.position": distance, "stop.velocity": Moved.speed}
    with Instance(native["PRBDM", fmi], "me", substep=2e-3) as instance:
        instance.initialize(values=values)
        Moved(instance).advance(0.051)
        found = instance.values()
    assert found["stop.impact_count"] == 1
    assert found["stop.impact_time"] == pytest.approx(-distance / Moved.speed, abs=1e-9)
    assert found["stop.approach_speed"] == pytest.approx(-Moved.speed, rel=1e-9)


@all_ways
def test_uniform_motion_is_followed_exactly(opened, fmi, kind):
    speed, distance = -0.1, 5e-3
    values = AWAY | {"stop.position": distance, "stop.velocity": speed}
    with opened("PRBDM", fmi, kind) as instance:
        instance.initialize(values=values)
        for t, end in itertools.pairwise(points(0.1)):
            assert instance.set({"stop.displacement": speed * t, "stop.velocity": speed}) == OK
            instance.advance(end)
            found = instance.values()
            if found["stop.impact_count"]:
                break
    assert found["stop.impact_time"] == pytest.approx(-distance / speed, abs=1e-9)
    assert found["stop.approach_speed"] == pytest.approx(-speed, rel=1e-9)


@all_ways
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_pressed_body_stays_on_its_wall(opened, model, fmi, kind):
    with opened(model, fmi, kind).initialize(values=PRESSED) as instance:
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
def test_a_pressed_body_stays_on_a_wall_whose_inputs_are_set_in_events(native, kind, inside):
    """In event mode (inside) a velocity acts at once, else from the beginning of the step."""
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


def bytes_of_next_steps(instance):
    """Advance by ten steps, with displacements only; return the bytes of the values after each."""
    rows = []
    for _ in range(10):
        given = sine(instance.time)["stop.displacement"]
        assert instance.set({"stop.displacement": given}) == OK
        instance.advance(instance.time + 1e-3)
        rows.append(instance.bytes())
    return rows


@all_ways
def test_a_state_saved_while_a_wall_joins_its_reference_restores_to_the_same_bytes(
    opened, fmi, kind
):
    with opened("PRBDM", fmi, kind).initialize(values={}) as instance:
        bytes_of_next_steps(instance)
        data, time = instance.saved(), instance.time
        first = bytes_of_next_steps(instance)
        bytes_of_next_steps(instance)
        instance.restore(data)
        instance.time = time
        assert instance.saved() == data
        assert bytes_of_next_steps(instance) == first


@all_ways
def test_a_reset_forgets_the_motion_of_a_wall(opened, fmi, kind):
    with opened("PRBDM", fmi, kind).initialize(values={}) as instance:
        first = bytes_of_next_steps(instance)
        instance.reset()
        instance.initialize(values={})
        assert bytes_of_next_steps(instance) == first


@all_ways
def test_walls_of_two_instances_in_one_process_are_independent(opened, fmi, kind):
    with (
        opened("PRBDM", fmi, kind).initialize(values={}) as one,
        opened("PRBDM", fmi, kind).initialize(values={}) as other,
    ):
        first = bytes_of_next_steps(one)
        assert other.set({"stop.velocity": 0.01}) == OK
        other.advance(0.02)
        second = bytes_of_next_steps(one)
    with opened("PRBDM", fmi, kind).initialize(values={}) as alone:
        assert [bytes_of_next_steps(alone), bytes_of_next_steps(alone)] == [first, second]


@pytest.mark.parametrize("fmi", [2, 3])
def test_in_model_exchange_a_pressed_body_follows_its_wall(native, fmi):
    """The inputs are position and velocity of the wall; changes of its velocity cause events."""
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


RESTING = {
    "body.stop.displacement": "carrier.shuttle.x",
    "body.stop.velocity": "carrier.shuttle.vx",
    "carrier.force.x": "body.stop.force",
}


@pytest.mark.parametrize("step", [1e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("share", [0.33, 0.40])
def test_a_body_rests_on_a_carrier_of_more_than_eleven_quarters_of_its_mass(native, share, step):
    """At first the whole force acts on the carrier alone, with the acceleration a = share g.

    After one step h the wall has the offset e = -a h^2/2 and the excess u = -a h, so that its cubic
    begins with the acceleration -(6 e/T + 4 u)/T = 11/4 a, T = 2 h.  The body stays while that is
    less than g.
    """
    fmus = {name: native["PRBDM", 3] for name in ("carrier", "body")}
    mass = simulation("PRBDM").values["shuttle.mass"]
    start = {
        "carrier.stop.position": 1.0,
        "carrier.gravity.x": 0.0,
        "carrier.release.displacement": 0.0,
        "carrier.shuttle.mass": mass / share,
        "body.release.displacement": 0.0,
    }
    found = simulate(
        fmus, RESTING, 8 * step, step, start, ["body.stop.contact"], scheme="jacobi", events=True
    )
    assert found["body.stop.contact"].all() == (share < 4 / 11)
