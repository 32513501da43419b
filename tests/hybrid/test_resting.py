"""Bodies at rest: on a wall that starts to move, with friction at two points, in event mode."""

import math
from ctypes import byref, c_bool, c_double, c_void_p

import numpy as np
import pytest
from fmpy.fmi2 import fmi2EventInfo

from kernel_simulation import KernelSimulation
from native_host import OK, WARNING, Instance
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_state import ContactMode
from support import energy_balance, mechanism, simulation

AT_REST = {"release.displacement": 0.0}  # The weight presses the body on the wall.
TWINS = {"engine": Simulation, "kernel": KernelSimulation}
IMPACTS = 14  # Impacts of each guide in its default experiment.
WALL = ("stop.displacement", "stop.velocity")


def sine(amplitude, rate):
    """Return displacement and velocity of a wall over time."""
    return lambda t: (amplitude * math.sin(rate * t), amplitude * rate * math.cos(rate * t))


def events(test):
    """Mark a test that needs native FMUs."""
    return pytest.mark.fmu(pytest.mark.native(test))


@pytest.mark.slow
@pytest.mark.parametrize("twin", TWINS)
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_body_at_rest_follows_a_wall_that_starts_slowly(model, twin):
    """The wall is slower than rest_speed: the contact remains closed and no impact is counted."""
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
def test_a_short_step_after_a_long_one_does_not_accelerate_the_wall(twin, short):
    """Masters make such steps when they return to the events of other FMUs.

    A wall that starts at 3.1 mm/s strikes the body at rest on it a few times.  In a step of 1 ms
    its acceleration moves it 0.05 um away from the extrapolated position.  A correction within
    0.1 us would need 0.5 m/s.
    """
    wall = sine(1e-4, 10 * math.pi)
    moved = TWINS[twin](mechanism("PRBDM"), AT_REST)
    before, time = energy_balance(moved.outputs()), 0.0
    for k in range(1, 41):
        for end in (k * 1e-3 - short, k * 1e-3):
            moved.set(dict(zip(WALL, wall(time), strict=True)))
            moved.advance(end)
            time = end
    out = moved.outputs()
    assert out["stop.impact_count"] <= 4
    assert out["energy.dissipated"] < 1e-5
    assert out["shuttle.x"] == pytest.approx(wall(time)[0], abs=1e-7)
    assert energy_balance(out) == pytest.approx(before, abs=1e-9)


# -- friction at two points --


def frictions(rng):
    """Return random values for a guide at rest, with friction at its stop and friction point."""
    values = {
        **AT_REST, "stop.offset": 0.004, "stop.friction": rng.uniform(0.1, 1.5),
        "friction.coefficient": 0.3, "friction.normal_force": rng.uniform(0.02, 1.0),
        "base.acceleration.x": rng.uniform(-15.0, 5.0),
        "force.y": 3.0 * rng.standard_normal(), "force.moment": 0.03 * rng.standard_normal(),
    }  # fmt: skip
    return {name: float(x) for name, x in values.items()}


def obeys_coulomb(settled: Simulation) -> bool:
    """Return whether friction forces and slip accelerations satisfy Coulomb's law."""
    equations, front, right = settled.equations, settled.front, True
    a, lam, *_ = equations.evaluate(front.time, front.q, front.v)
    for c, mode in enumerate(settled.contacts.modes):
        if mode is ContactMode.STICK:
            friction, limit = equations.friction(c, front.e, lam)
            right &= abs(friction) <= limit
        rate = equations.slip_acceleration(c, front.e, front.v, a)
        right &= mode.slip == 0 or mode.slip * rate > 0.0
    return right


@pytest.mark.slow
def test_friction_at_stop_and_friction_point_obeys_coulombs_law():
    """A stop that would have to pull opens in the first step."""
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
def test_energy_is_balanced_on_a_shaken_base_with_friction_at_two_points(model, rate, offset):
    """Stop and friction point stick and slip, without chatter."""
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
    """Return the final values of a run with a moving wall, and the number of early returns.

    ``place`` returns displacement and velocity of the wall at a time.  If ``inside``, the inputs
    are also set in event mode.  An ``impulse`` is applied in a separate event before each step.
    """
    steps, early, time, point = round(end / 1e-3), 0, 0.0, 0
    with Instance(fmu, kind).initialize(values=values) as instance:

        def set_wall():
            assert instance.set(dict(zip(WALL, place(time), strict=True))) == OK

        while point < steps:
            if impulse:
                instance.change({"force.impulse.y": impulse * (point + 1)})
            set_wall()
            event, _, _, time = instance.fmu.doStep(time, (point + 1) * 1e-3 - time)
            if event:
                early += 1
                instance.fmu.enterEventMode()
                if inside:
                    set_wall()
                instance.update()
            point += time >= (point + 1) * 1e-3 - 1e-12
        return instance.values(), early


@events
@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_body_on_a_slowly_accelerated_wall_remains_at_rest_in_event_mode(native, model, inside):
    """The velocity of the wall changes by 0.1 mm/s per step, a tenth of rest_speed."""
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
def test_a_wall_with_a_tiny_vibration_does_not_cause_chatter(native, inside):
    """The amplitude is 0.01 um; the velocities are a few times the zero speed."""
    wall = sine(1e-8, 40 * math.pi)
    found, _ = driven(native["PRBDM", 3], "events", wall, 0.4, inside=inside)
    assert found["stop.contact"]
    assert found["shuttle.x"] == pytest.approx(wall(0.399)[0], abs=2e-9)


@events
@pytest.mark.parametrize("impulse", [0.0, 1e-9])
def test_a_wall_reaches_its_input_despite_events(native, impulse):
    """Tiny impulses cause an event before each step, which must not stop the wall."""
    found, _ = driven(native["PRBDM", 3], "events", lambda _: (-0.01, 0.0), 0.03, impulse=impulse)
    assert found["stop.gap"] == pytest.approx(0.01 - found["shuttle.x"] - 0.02, abs=1e-9)


@events
@pytest.mark.parametrize("order", ["set, update", "set, update, impulse, update", "update, set",
                                   "update, set, update"])  # fmt: skip
def test_inputs_set_at_an_event_do_not_accelerate_the_wall_in_the_rest_of_the_step(native, order):
    """To reach 0.01 mm in the remaining 1 us after the impact, the wall would need 10 m/s."""
    with Instance(native["PRBDM", 3], "events").initialize() as instance:
        *_, hit = instance.fmu.doStep(0.0, 0.1)
    with Instance(native["PRBDM", 3], "events").initialize() as instance:
        doing = {
            "set": lambda: instance.set({"stop.displacement": -1e-5}),
            "impulse": lambda: instance.set({"force.impulse.y": 1e-12}),
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
        for _ in range(60):  # The wall reaches its reference within two of the longest steps.
            event, _, _, end = instance.fmu.doStep(end, 1e-3)
            if event:
                instance.fmu.enterEventMode()
                instance.update()
        drawn = instance.values()
        assert drawn["stop.gap"] == pytest.approx(-1e-5 - drawn["shuttle.x"], abs=1e-9)


@pytest.mark.parametrize("twin", TWINS)
def test_a_short_step_does_not_accelerate_a_wall_that_has_stopped(twin):
    """The wall brakes from 10 mm/s; a correction within the step of 0.1 us would need 5 m/s."""
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
def test_energy_is_balanced_with_slip_events_on_a_moving_wall(native, model):
    """A slip event is not an impact: it does not change velocities."""
    values = {"stop.friction": 0.2, "stop.rest_speed": 0.01}
    found, early = driven(
        native[model, 3], "events", sine(1e-5, 600.0), 0.35, values=values, inside=True
    )
    assert early > IMPACTS
    start = energy_balance(simulation(model).outputs())
    assert energy_balance(found) == pytest.approx(start, abs=1e-8)


def update_status(instance: Instance) -> int:
    """Update the discrete states; return the status itself, because FMPy ignores warnings."""
    name = "NewDiscreteStates" if instance.version == 2 else "UpdateDiscreteStates"
    results = (fmi2EventInfo(),) if instance.version == 2 else (*(c_bool() for _ in range(5)),
                                                                c_double())  # fmt: skip
    function = instance.fmu.dll[f"fmi{instance.version}{name}"]
    return int(function(c_void_p(instance.fmu.component), *map(byref, results)))


@events
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_wall_set_deep_inside_a_body_is_logged_once_in_model_exchange(native, fmi):
    """The wall does not push the body out: the warning marks the negative gap as invalid."""
    with Instance(native["PRBDM", fmi], "me").initialize() as instance:
        instance.fmu.enterEventMode()
        assert instance.set({"stop.displacement": -0.03}) == OK
        assert update_status(instance) == OK  # Some importers stop at a warning.
        instance.fmu.enterContinuousTimeMode()
        (warning,) = (text for status, _, text in instance.log if status == WARNING)
        assert "stop.gap = -0.012 m: the wall is inside the body" in warning
        instance.change({"stop.displacement": -0.0301})
        assert sum(status == WARNING for status, _, _ in instance.log) == 1
