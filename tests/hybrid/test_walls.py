"""Moving walls: each joins its reference along a cubic (prbm.hybrid.walls)."""

import itertools
import json
import math

import numpy as np
import pytest

from kernel_simulation import KernelSimulation
from many_parts import anvil
from prbm.base.tolerances import WALL_LONGEST_RTOL
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.inputs import Wall
from support import energy_balance, mechanism

TWINS = {"engine": Simulation, "kernel": KernelSimulation}
both = pytest.mark.parametrize("twin", TWINS)

AWAY = {"release.displacement": 0.0, "gravity.x": 0.0, "stop.position": 0.01}
"""Values for a shuttle at rest, with the wall out of reach."""
PRESSED = {"release.displacement": 0.0}
"""Values for a shuttle at rest on the wall, pressed by its weight."""
AMPLITUDE, RATE = 1e-3, 10 * math.pi
"""Amplitude [m] and circular frequency [rad/s] of the true wall: up to 0.031 m/s, 0.99 m/s2."""
ACCELERATION = AMPLITUDE * RATE**2


def sine(t: float) -> tuple[float, float]:
    """Return displacement [m] and velocity [m/s] of the true wall at a time."""
    return AMPLITUDE * math.sin(RATE * t), AMPLITUDE * RATE * math.cos(RATE * t)


def grid(kind: str, end: float) -> list[float]:
    """Return communication points from 0 to an end [s]."""
    rng = np.random.default_rng(3)
    steps = {
        "1 ms": lambda k: 1e-3,
        "10 ms": lambda k: 1e-2,
        "20 ms": lambda k: 2e-2,
        "alternating": lambda k: (1e-3, 1e-6)[k % 2],
        "random": lambda k: float(np.exp(rng.uniform(math.log(1e-6), math.log(1e-2)))),
        "short and long": lambda k: float(rng.choice([1e-6, 1e-4, 2e-2])),
    }[kind]
    points, k = [0.0], 0
    while points[-1] < end - 1e-9:
        points.append(min(points[-1] + steps(k), end))
        k += 1
    return points


GRIDS = ("1 ms", "10 ms", "alternating", "random", "short and long")


def wall_of(sim) -> tuple[float, float]:
    """Return displacement and velocity of the simulated wall, from gap and contact point."""
    out = sim.outputs()
    place = out["stop.gap"] + out["stop.point.displacement"]
    return place, out["stop.gap_rate"] + out["stop.point.velocity"]


def given(true, t: float, velocities: bool) -> dict[str, float]:
    """Return the inputs for the true wall at a time, with its velocity or without."""
    d, v = true(t)
    return {"stop.displacement": d} | ({"stop.velocity": v} if velocities else {})


@pytest.mark.parametrize(("offset", "excess"), [(1e-3, 0.0), (0.0, 0.2), (-1e-3, 0.3)])
def test_velocity_and_acceleration_of_a_wall_are_derivatives_of_its_position(offset, excess):
    wall = Wall(0.1, -0.3, 2.0, offset, excess, 4e-3)
    for t in (2.0005, 2.002, 2.0039):
        _, velocity, acceleration = wall.motion(t)
        near = [wall.motion(t + dt) for dt in (-1e-7, 1e-7)]
        assert velocity == pytest.approx((near[1][0] - near[0][0]) / 2e-7, abs=1e-6)
        slope = (near[1][1] - near[0][1]) / 2e-7
        assert acceleration == pytest.approx(slope, abs=1e-6 * abs(acceleration) + 1e-3)
    start, end = wall.motion(wall.since), wall.motion(wall.end)
    assert start[:2] == pytest.approx((0.1 + offset, -0.3 + excess))
    assert end[:2] == pytest.approx((0.1 - 0.3 * 4e-3, -0.3))


@both
@pytest.mark.parametrize("kind", GRIDS)
def test_a_wall_follows_a_uniform_motion_exactly(twin, kind):
    """Time and closing speed of the impact do not depend on the communication steps."""
    speed, distance = -0.1, 8e-3
    values = AWAY | {"stop.position": distance, "stop.restitution": 0.5, "stop.velocity": speed}
    sim = TWINS[twin](mechanism("PRBDM"), values)
    for t, end in itertools.pairwise(grid(kind, 0.1)):
        sim.set({"stop.displacement": speed * t, "stop.velocity": speed})
        sim.advance(end)
        if sim.outputs()["stop.impact_count"]:
            break
    out = sim.outputs()
    assert out["stop.impact_time"] == pytest.approx(-distance / speed, abs=1e-9)
    assert out["stop.approach_speed"] == pytest.approx(-speed, rel=1e-9)


def errors(sim, kind: str, *, velocities: bool) -> float:
    """Return the largest position error of the wall divided by a h^2, after the first steps."""
    points, worst = grid(kind, 0.3 if kind == "20 ms" else 0.15), 0.0
    longest = max(b - a for a, b in itertools.pairwise(points))
    assert longest <= WALL_LONGEST_RTOL * 0.22
    for k, (t, end) in enumerate(itertools.pairwise(points)):
        sim.set(given(sine, t, velocities))
        sim.advance(end)
        if t > 6 * longest and k % 3 < 2:
            worst = max(worst, abs(wall_of(sim)[0] - sine(end)[0]))
    return worst / (ACCELERATION * longest**2)


@both
@pytest.mark.parametrize("velocities", [True, False])
@pytest.mark.parametrize("kind", [*GRIDS, "20 ms"])
def test_position_error_of_a_wall_is_bounded_by_acceleration_and_step(twin, kind, velocities):
    """The error is below 2 a h^2, or 3 a h^2 at these random steps without velocities."""
    sim = TWINS[twin](mechanism("PRBDM"), AWAY)
    bound = 2.0 if velocities or kind != "random" else 3.0
    assert errors(sim, kind, velocities=velocities) < bound


@pytest.mark.slow
@both
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
@pytest.mark.parametrize("kind", ["1 ms", "alternating", "random"])
def test_a_pressed_body_stays_on_its_wall_without_impacts(twin, model, kind):
    """Gravity is ten times the acceleration of the wall."""
    sim = TWINS[twin](mechanism(model), PRESSED | dict(zip(INPUTS, sine(0.0), strict=True)))
    struck = sim.outputs()["stop.impact_count"]
    before, points = energy_balance(sim.outputs()), grid(kind, 0.1)
    settled = False
    for t, end in itertools.pairwise(points):
        sim.set(given(sine, t, velocities=True))
        sim.advance(end)
        out = sim.outputs()
        settled = settled or (t > 0.02 and bool(out["stop.contact"]))
        if settled:
            assert out["stop.contact"], t
            assert abs(out["stop.gap"]) < 1e-12
        else:
            struck = out["stop.impact_count"]
    assert settled
    assert out["stop.impact_count"] == struck
    assert energy_balance(out) == pytest.approx(before, abs=1e-9)


INPUTS = ("stop.displacement", "stop.velocity")


@both
@pytest.mark.parametrize("kind", ["1 ms", "alternating", "random"])
def test_position_error_of_a_wall_after_a_jump_is_at_most_the_jump(twin, kind):
    jump = -1e-3
    sim, points = TWINS[twin](mechanism("PRBDM"), AWAY), grid(kind, 0.15)
    off, last = [], 0.0
    for t, end in itertools.pairwise(points):
        sim.set({"stop.displacement": jump if t > 0.05 else 0.0})
        sim.advance(end)
        off.append(abs(wall_of(sim)[0] - (jump if t > 0.05 else 0.0)))
        last = wall_of(sim)[0]
    assert max(off) <= abs(jump) * (1 + 1e-9)
    assert last == pytest.approx(jump, abs=1e-12)


@both
def test_the_motion_of_a_wall_in_short_steps_is_not_extrapolated_over_a_long_step(twin):
    """The mean rate over steps of 1 us is not kept for 20 ms."""
    sim = TWINS[twin](mechanism("PRBDM"), AWAY)
    for k in range(3):
        sim.set({"stop.displacement": -1e-4 * k})
        sim.advance(1e-6 * (k + 1))
    sim.set({"stop.displacement": -3e-4})
    sim.advance(2e-2)
    assert abs(wall_of(sim)[0] + 3e-4) <= 3e-4


@both
def test_the_force_of_a_closed_stop_includes_the_acceleration_of_its_wall(twin):
    """The force is weight plus acceleration over mobility; a fast retreat opens the stop."""
    sim = TWINS[twin](mechanism("PRBDM"), PRESSED)
    sim.advance(1e-3)
    weight, mobility = (sim.outputs()[f"stop.{name}"] for name in ("force", "point.mobility"))
    sim.set({"stop.velocity": -1e-3})
    sim.advance(1e-3 + 1e-9)
    # The acceleration at the start of the cubic is 4 u / T; T is two steps of 1 ms.
    expected = weight + 4 * 1e-3 / 2e-3 / mobility
    assert sim.outputs()["stop.force"] == pytest.approx(expected, rel=1e-3)
    sim.set({"stop.velocity": 0.1})
    sim.advance(1e-3 + 1e-6)
    assert not sim.outputs()["stop.contact"]


@both
def test_setting_an_input_to_its_present_value_has_no_effect(twin):
    runs = [TWINS[twin](mechanism("PRBDM"), {"stop.velocity": -0.02}) for _ in range(2)]
    for k in range(40):
        for sim, again in zip(runs, (False, True), strict=True):
            if again or k == 0:
                sim.set({"stop.displacement": -0.02 * k * 1e-3, "stop.velocity": -0.02})
            elif not again:
                sim.set({"stop.displacement": -0.02 * k * 1e-3})
            sim.advance((k + 1) * 1e-3)
    assert runs[0].outputs() == runs[1].outputs()


def partner(twin, *, mobility: float, end: float, h: float):
    """Return a guide after impacts with a free mass as wall, and the motion of the mass.

    The results are: the simulation of the guide; position and velocity of the mass; after each
    step, the momentum of the mass minus the impulses that it has received.
    """
    sim = TWINS[twin](
        mechanism("PRBDM"),
        {"release.displacement": 0.0, "gravity.x": 0.0, "stop.position": 2e-3,
         "stop.mobility": mobility, "stop.velocity": -0.1, "stop.restitution": 0.6},
    )  # fmt: skip
    x, v, received, momenta = 0.0, -0.1, 0.0, []
    for k in range(round(end / h)):
        sim.set({"stop.displacement": x, "stop.velocity": v})
        sim.advance((k + 1) * h)
        out = sim.outputs()
        total = out["stop.impulse_sum"]
        if total != received:
            # Time from the impact to the end of the step.
            left = (k + 1) * h - out["stop.impact_time"]
            change = mobility * (total - received)
            x, v, received = x + v * (h - left) + (v + change) * left, v + change, total
        else:
            x += v * h
        momenta.append(v / mobility - total)
    return sim, x, v, momenta


@both
@pytest.mark.parametrize("h", [1e-3, 3e-4])
def test_a_wall_moves_exactly_as_the_partner_that_receives_its_impulses(twin, h):
    """The partner is a free mass; it returns its position and velocity as inputs of the wall."""
    sim, x, v, momenta = partner(twin, mobility=5.0, end=0.06, h=h)
    assert sim.outputs()["stop.impact_count"] >= 1
    assert momenta == pytest.approx([momenta[0]] * len(momenta), rel=1e-13)
    place, velocity = wall_of(sim)
    assert (place, velocity) == pytest.approx((x, v), abs=1e-9)


@both
def test_an_impact_changes_the_velocity_of_the_reference_with_that_of_the_wall(twin):
    """Mobility times impulse is added to both; the wall keeps this velocity until new inputs."""
    values = {"release.displacement": 0.0, "gravity.x": 0.0, "stop.position": 1e-3,
              "stop.mobility": 5.0, "stop.velocity": -0.1, "stop.restitution": 1.0}  # fmt: skip
    sim = TWINS[twin](mechanism("PRBDM"), values)
    sim.advance(0.015)
    out = sim.outputs()
    assert out["stop.impact_count"] == 1
    velocity = -0.1 + 5.0 * out["stop.impulse_sum"]
    left = 0.015 - out["stop.impact_time"]
    place = -0.1 * out["stop.impact_time"] + velocity * left
    assert wall_of(sim) == pytest.approx((place, velocity), abs=1e-12)


@pytest.mark.slow
def test_the_force_of_a_moving_wall_does_its_work():
    """Energy is balanced while the wall accelerates below a body at rest on it."""
    for kind in ("1 ms", "random"):
        sim = Simulation(mechanism("PRBDM2R"), PRESSED)
        sim.advance(0.01)
        before = energy_balance(sim.outputs())
        for t, end in itertools.pairwise(grid(kind, 0.1)):
            if end > sim.time:
                d = AMPLITUDE * (1 - math.cos(RATE * t)), AMPLITUDE * RATE * math.sin(RATE * t)
                sim.set(dict(zip(INPUTS, d, strict=True)))
                sim.advance(end)
        assert energy_balance(sim.outputs()) == pytest.approx(before, abs=1e-9)


# --- saved states -----------------------------------------------------------------------------


def simulation_with_joining_wall(twin):
    """Return a simulation after 30 steps, while the wall is joining its reference."""
    sim = TWINS[twin](mechanism("PRBDM"), {})
    for k in range(30):
        sim.set({"stop.displacement": sine(k * 1e-3)[0]})
        sim.advance((k + 1) * 1e-3)
    return sim


def next_outputs(sim) -> list[dict]:
    """Advance by 20 steps and return the outputs after each."""
    found = []
    for k in range(30, 50):
        sim.set({"stop.displacement": sine(k * 1e-3)[0], "stop.velocity": 0.01 * (k > 40)})
        sim.advance((k + 1) * 1e-3)
        found.append(sim.outputs())
    return found


def test_a_state_saved_while_a_wall_joins_its_reference_restores_to_the_same_bytes():
    sim = simulation_with_joining_wall("engine")
    assert any(wall.span for wall in sim.inputs.walls)
    saved = json.dumps(sim.snapshot())
    other = Simulation(mechanism("PRBDM"))
    other.restore(json.loads(saved))
    assert json.dumps(other.snapshot()) == saved
    assert next_outputs(other) == next_outputs(sim)


def test_a_state_of_the_kernel_restores_to_the_same_bytes():
    sim, other = simulation_with_joining_wall("kernel"), simulation_with_joining_wall("kernel")
    saved = sim.state
    expected = next_outputs(sim)
    other.advance(0.2)
    other.restore(saved)
    assert other.state.tobytes() == saved.tobytes()
    assert next_outputs(other) == expected


@both
def test_simulations_are_independent_of_each_other(twin):
    one, other = simulation_with_joining_wall(twin), simulation_with_joining_wall(twin)
    other.set({"stop.displacement": 1e-3})
    other.advance(0.031)
    assert next_outputs(one) == next_outputs(simulation_with_joining_wall(twin))


def test_the_engine_and_the_kernel_agree_on_random_motions_of_the_wall():
    """Random inputs at random communication points, with impacts, rest and jumps."""
    rng = np.random.default_rng(5)
    twins, t = [kind(mechanism("PRBDM"), {}) for kind in TWINS.values()], 0.0
    for _ in range(150):
        t += float(np.exp(rng.uniform(math.log(1e-5), math.log(1e-2))))
        values = {"stop.displacement": 1e-4 * rng.normal(), "stop.velocity": 0.01 * rng.normal()}
        if rng.uniform() < 0.3:
            values = {"stop.position": 1e-4 * rng.normal()}
        for sim in twins:
            sim.set({name: float(x) for name, x in values.items()})
            sim.advance(t)
        engine, kernel = (sim.outputs() for sim in twins)
        for name in ("shuttle.x", "stop.gap", "stop.impact_count"):
            assert kernel[name] == pytest.approx(engine[name], abs=1e-7), (t, name)
    assert kernel["stop.impact_count"] > 1


@both
def test_energy_is_balanced_when_the_offset_of_a_held_stop_changes(twin):
    """The wall moves with the hit point: the gap stays closed, and the wall does the work."""
    sim = TWINS[twin](anvil(), {"face.restitution": 0.0, "blow.y": -2.0})
    points = [k * 1e-4 for k in range(1, 41)]
    while not sim.outputs()["face.force"] > 0.0:
        sim.advance(points.pop(0))
    start = energy_balance(sim.outputs())
    sim.set({"face.offset": 3e-3})
    sim.advance(points.pop(0))
    assert abs(sim.outputs()["face.gap"]) < 1e-12
    assert sim.outputs()["face.force"] > 0.0
    for t in points:
        sim.advance(t)
        out = sim.outputs()
        scale = out["energy.kinetic"] + out["energy.elastic"]
        assert energy_balance(out) == pytest.approx(start, abs=1e-6 * scale)
