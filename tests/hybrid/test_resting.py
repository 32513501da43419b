"""What rests: on a wall that begins to move, by friction in several places, through events."""

import math

import numpy as np
import pytest

from kernel_simulation import KernelSimulation
from native_host import OK, WARNING, Instance
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_state import ContactMode
from support import energy_balance, mechanism, simulation

AT_REST = {"release.displacement": 0.0}  # on the wall, by its weight
TWINS = {"engine": Simulation, "kernel": KernelSimulation}
IMPACTS = 14  # of the guides in their default run
WALL = ("stop.displacement", "stop.velocity")


def sine(amplitude, rate):
    """Return displacement and velocity of a wall over time."""
    return lambda t: (amplitude * math.sin(rate * t), amplitude * rate * math.cos(rate * t))


def events(test):
    """Mark a test that needs native FMUs."""
    return pytest.mark.fmu(pytest.mark.native(test))


@pytest.mark.parametrize("twin", TWINS)
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_wall_may_begin_to_move_as_slowly_as_it_likes(model, twin):
    """Slower than rest_speed it keeps what rests on it, and strikes nothing that would count."""
    speeds = np.geomspace(1e-10, 1e-6, 30)
    for speed in [*speeds, *-speeds]:
        moved = TWINS[twin](mechanism(model), AT_REST)
        before = energy_balance(moved.outputs())
        moved.set({"stop.velocity": float(speed)})
        moved.advance(5e-4)
        out = moved.outputs()
        assert out["stop.contact"], speed
        assert out["stop.impact_count"] == 0
        assert out["shuttle.x"] == pytest.approx(5e-4 * speed, abs=1e-12)
        assert energy_balance(out) == pytest.approx(before, abs=1e-12)


@pytest.mark.parametrize("short", [1e-4, 1e-5, 1e-7])
@pytest.mark.parametrize("twin", TWINS)
def test_a_short_step_after_a_long_one_does_not_push_the_wall(twin, short):
    """As masters make them that come to each other's events.

    A wall that starts at 3.1 mm/s strikes what rests on it a few times.  In a step of 1 ms its
    acceleration takes it 0.05 um from where it was thought to go: made good in 0.1 us, that would
    be 0.5 m/s.
    """
    wall = sine(1e-4, 10 * math.pi)
    moved = TWINS[twin](mechanism("PRBDM"), AT_REST)
    before, time = energy_balance(moved.outputs()), 0.0
    for k in range(1, 101):
        for end in (k * 1e-3 - short, k * 1e-3):
            moved.set(dict(zip(WALL, wall(time), strict=True)))
            moved.advance(end)
            time = end
    out = moved.outputs()
    assert out["stop.impact_count"] <= 4
    assert out["energy.dissipated"] < 1e-5
    assert out["shuttle.x"] == pytest.approx(wall(time)[0], abs=1e-7)
    assert energy_balance(out) == pytest.approx(before, abs=1e-9)


# -- friction in two places --


def frictions(rng):
    """Return the guide at rest on its wall, with friction there and at its friction point."""
    values = {
        **AT_REST, "stop.offset": 0.004, "stop.friction": rng.uniform(0.1, 1.5),
        "friction.coefficient": 0.3, "friction.normal_force": rng.uniform(0.02, 1.0),
        "base.acceleration.x": rng.uniform(-15.0, 5.0),
        "force.y": 3.0 * rng.standard_normal(), "force.moment": 0.03 * rng.standard_normal(),
    }  # fmt: skip
    return {name: float(x) for name, x in values.items()}


def obeys_coulomb(settled: Simulation) -> bool:
    """Tell whether forces and accelerations are what each friction says."""
    equations, front, right = settled.equations, settled.front, True
    a, lam, _, _ = equations.evaluate(front.time, front.q, front.v)
    for c, mode in enumerate(settled.contacts.modes):
        if mode is ContactMode.STICK:
            friction, limit = equations.friction(c, front.e, lam)
            right &= abs(friction) <= limit
        rate = equations.slip_acceleration(c, front.e, front.v, a)
        right &= mode.slip == 0 or mode.slip * rate > 0.0
    return right


def test_friction_in_two_places_obeys_coulombs_law_in_both():
    """A stop that would have to pull opens at once."""
    rng, found = np.random.default_rng(0), 0
    for k in range(150):
        values = frictions(rng)
        settled = Simulation(mechanism("PRBDM2RAxial"), values)
        if settled.outputs()["stop.force"] > 0.0:
            assert obeys_coulomb(settled), values
            found += 1
        if k % 5:
            continue
        kernel = KernelSimulation(mechanism("PRBDM2RAxial"), values)
        for twin in (settled, kernel):
            twin.advance(5e-5)
        assert settled.contacts.modes[0].closed == (settled.outputs()["stop.force"] > 0.0)
        for name in ("shuttle.vx", "shuttle.vy", "shuttle.omega"):
            assert kernel.get(name) == pytest.approx(settled.outputs()[name], abs=1e-9)
    assert found > 50


@pytest.mark.parametrize(
    ("model", "rate", "offset"), [("PRBDM2RAxial", 200, 0.004), ("PRBDM2R", 10, 0.004),
                                  ("PRBDM2R", 200, 0.0)],
)  # fmt: skip
def test_a_shaken_base_rubs_in_two_places_without_end(model, rate, offset):
    """Sticking and slipping on the wall and at a point: no chatter, books balanced."""
    values = {
        "friction.coefficient": 0.3, "friction.normal_force": 0.5, "stop.friction": 1.0,
        "stop.offset": offset, "stop.restitution": 0.0,
    }  # fmt: skip
    shaken = KernelSimulation(mechanism(model), values)
    before = energy_balance(shaken.outputs())
    for k in range(350):
        shaken.set({"base.acceleration.x": 5.0 * math.sin(rate * k * 1e-3)})
        shaken.advance((k + 1) * 1e-3)
    assert energy_balance(shaken.outputs()) == pytest.approx(before, abs=1e-8)


# -- walls and events --


def driven(fmu, kind, place, end, *, values=None, inside=False, impulse=0.0):
    """Return all values after the wall followed place(t), and the steps that ended early.

    inside: whether the inputs are set in the events, too.  impulse: which comes before each step,
    in an event of its own.
    """
    steps, early, time, point = round(end / 1e-3), 0, 0.0, 0
    with Instance(fmu, kind).initialize(values=values) as instance:

        def tell():
            assert instance.set(dict(zip(WALL, place(time), strict=True))) == OK

        while point < steps:
            if impulse:
                instance.change({"force.impulse.y": impulse * (point + 1)})
            tell()
            event, _, _, time = instance.fmu.doStep(time, (point + 1) * 1e-3 - time)
            if event:
                early += 1
                instance.fmu.enterEventMode()
                if inside:
                    tell()
                instance.update()
            point += time >= (point + 1) * 1e-3 - 1e-12
        return instance.values(), early


@events
@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_what_rests_on_a_gently_moving_wall_rests_in_event_mode_too(native, model, inside):
    """Its velocity changes by 0.1 mm/s a step, a tenth of rest_speed: nothing bounces off."""
    wall, end = sine(1e-4, 10 * math.pi), 0.4
    plain, _ = driven(native[model, 3], "cs", wall, end)
    found, early = driven(native[model, 3], "events", wall, end, inside=inside)
    assert early < 2 * end / 1e-3
    assert abs(found["stop.impact_count"] - plain["stop.impact_count"]) <= 1
    assert found["stop.contact"]
    assert found["shuttle.x"] == pytest.approx(plain["shuttle.x"], abs=1e-9)
    start = energy_balance(simulation(model).outputs())
    assert energy_balance(found) == pytest.approx(start, abs=1e-8)


@events
@pytest.mark.parametrize("inside", [False, True])
def test_a_trembling_wall_does_not_chatter(native, inside):
    """By a hundredth of a micrometre, of which the rates are a few times what counts as still."""
    wall = sine(1e-8, 40 * math.pi)
    found, _ = driven(native["PRBDM", 3], "events", wall, 0.4, inside=inside)
    assert found["stop.contact"]
    assert found["shuttle.x"] == pytest.approx(wall(0.399)[0], abs=2e-9)


@events
@pytest.mark.parametrize("impulse", [0.0, 1e-9])
def test_a_wall_gets_where_it_is_told_whatever_happens_on_the_way(native, impulse):
    """Events before each step, of impulses that are next to nothing, had left it where it was."""
    found, _ = driven(native["PRBDM", 3], "events", lambda _: (-0.01, 0.0), 0.03, impulse=impulse)
    assert found["stop.gap"] == pytest.approx(0.01 - found["shuttle.x"] - 0.02, abs=1e-9)


@events
@pytest.mark.parametrize("order", ["set, update", "set, update, throw, update", "update, set",
                                   "update, set, update"])  # fmt: skip
def test_what_is_set_around_an_event_does_not_push_the_wall_in_the_rest_of_the_step(native, order):
    """0.01 mm, made good in the 1 us that are left after the impact, would be 10 m/s."""
    with Instance(native["PRBDM", 3], "events").initialize() as instance:
        *_, hit = instance.fmu.doStep(0.0, 0.1)
    with Instance(native["PRBDM", 3], "events").initialize() as instance:
        doing = {
            "set": lambda: instance.set({"stop.displacement": -1e-5}),
            "throw": lambda: instance.set({"force.impulse.y": 1e-12}),
        }
        *_, time = instance.fmu.doStep(0.0, hit + 1e-6)
        assert time == pytest.approx(hit, abs=1e-12)
        instance.fmu.enterEventMode()
        for word in order.split(", "):
            if word == "update":
                instance.function("newDiscreteStates", "updateDiscreteStates")()
            else:
                assert doing[word]() == OK
        instance.fmu.enterStepMode()
        event, *_ = instance.fmu.doStep(hit, 1e-6)
        found = instance.values()
        assert not event
        assert found["stop.impact_count"] == 1
        assert found["stop.gap_rate"] == pytest.approx(found["stop.rebound_speed"], rel=1e-3)
        end = hit + 1e-6
        for _ in range(60):  # the wall joins its reference within two recent longest steps
            event, _, _, end = instance.fmu.doStep(end, 1e-3)
            if event:
                instance.fmu.enterEventMode()
                instance.update()
        drawn = instance.values()
        assert drawn["stop.gap"] == pytest.approx(-1e-5 - drawn["shuttle.x"], abs=1e-9)


@pytest.mark.parametrize("twin", TWINS)
def test_a_wall_that_has_come_to_a_stand_is_not_pushed_either(twin):
    """It brakes from 10 mm/s; then a step of 0.1 us with no velocity, which would be at 5 m/s."""
    moved = TWINS[twin](mechanism("PRBDM"), AT_REST)
    for k in range(10):
        left = 1.0 - 0.1 * k
        moved.set(dict(zip(WALL, (5e-5 * (1 - left**2), 0.01 * left), strict=True)))
        moved.advance((k + 1) * 1e-3)
    moved.set(dict(zip(WALL, (5e-5, 0.0), strict=True)))
    moved.advance(0.0100001)
    out = moved.outputs()
    assert out["stop.approach_speed"] < 0.01
    assert abs(out["shuttle.vx"]) < 0.02


@events
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_slips_on_a_moving_wall_leave_the_books_balanced(native, model):
    """A slip is no impact: what the wall carries keeps its velocity through it."""
    values = {"stop.friction": 0.2, "stop.rest_speed": 0.01}
    found, early = driven(
        native[model, 3], "events", sine(1e-5, 600.0), 0.35, values=values, inside=True
    )
    assert early > IMPACTS
    start = energy_balance(simulation(model).outputs())
    assert energy_balance(found) == pytest.approx(start, abs=1e-8)


@events
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_wall_put_deep_into_a_body_is_told_in_model_exchange(native, fmi):
    """Once: it does not push the body out, and nobody should take the gap for right."""
    with Instance(native["PRBDM", fmi], "me").initialize() as instance:
        instance.change({"stop.displacement": -0.03})
        (warning,) = (text for status, _, text in instance.log if status == WARNING)
        assert "stop.gap = -0.012 m: the wall is inside the body" in warning
        instance.change({"stop.displacement": -0.0301})
        assert sum(status == WARNING for status, _, _ in instance.log) == 1
