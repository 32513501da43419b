"""Simulations in the kernel and in the engine agree, event by event, in all kinds of motion."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest

from guides import various
from kernel_simulation import KernelMistake, KernelSimulation, library
from many_parts import anvil, beams, elastic, profiles, two_stops
from prbm.base.errors import PrbmError
from prbm.fmu.start import interface
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from support import GUIDES, PMMA, case, each_shipped, mechanism, record

END, STEP = 0.3, 2.5e-3

RUB = {
    "friction.coefficient": 0.3,
    "friction.normal_force": 0.2,
    "friction.normal_stiffness": -50.0,
}
ROUGH = {"stop.friction": 0.4, "stop.offset": 4e-3}
SCENARIOS = {
    "default": ({}, {}),
    "off the centre": ({"stop.offset": 6e-3, "stop.position": -4e-3}, {}),
    "rubbing": (RUB | {"release.displacement": -0.012}, {}),
    "sticking at once": ({"friction.coefficient": 5.0, "friction.normal_force": 3.0}, {}),
    "pushed out of sticking": (
        {"friction.coefficient": 2.0, "friction.normal_force": 0.5},
        {8: {"force.x": 2.5}, 40: {"force.x": -2.0}},
    ),
    "rough stop": (ROUGH | {"stop.restitution": 0.8}, {}),
    "rough stop, rubbing": (ROUGH | RUB, {}),
    "no restitution": ({"stop.restitution": 0.0}, {}),
    "damped": ({"damping.zeta": 0.1, "damping.beta": 1e-4}, {}),
    "thrown at the wall": ({"release.velocity": 1.0, "stop.position": 5e-3}, {}),
    "released at the wall": ({"release.displacement": 0.0, "gravity.x": 5.0}, {}),
    "driven": (
        {"force.moment": 1e-3},
        {4: {"base.acceleration.x": 3.0, "base.acceleration.y": -2.0}, 30: {"force.y": 0.3}},
    ),
    "tuned": (
        {},
        {20: {"stop.restitution": 0.2}, 50: {"stop.position": -2e-3, "damping.zeta": 0.02}},
    ),
    "a wall that comes and goes": (
        {"stop.restitution": 0.3},
        {90: {"stop.velocity": -0.05}, 91: {"stop.displacement": -1.25e-4}}
        | {100: {"stop.velocity": 0.0, "stop.displacement": 0.0}},
    ),
    "pulled off": ({"stop.restitution": 0.2}, {80: {"force.x": -1.5}, 100: {"force.x": 0.0}}),
}  # fmt: skip
END_TIMES = {"thrown at the wall": 0.05}  # s; afterwards the 2R guide amplifies 1e-12 to 1e-2.


def compared(guide, values, schedule, end=END, step=STEP):
    """Run both engines, compare all outputs at every step, return the last outputs of the kernel.

    The motion amplifies rounding errors, by a few hundred for the damped 2R guide.  At rest, the
    fast modes keep a noise of the size of the tolerance times their frequency.
    """
    engine, kernel = Simulation(guide, values), KernelSimulation(guide, values)
    nominal = {v.name: v.nominal or 1.0 for v in interface(guide, {})}
    counts = [f"{stop.name}.{name}" for stop in guide.stops for name in ("impact_count", "contact")]
    for k in range(round(end / step)):
        change = schedule.get(k, {})
        engine.set(change)
        kernel.set(change)
        engine.advance((k + 1) * step)
        kernel.advance((k + 1) * step)
        expected, found = engine.outputs(), kernel.outputs()
        assert expected.keys() <= found.keys()
        for name in counts:
            assert found[name] == expected[name], (name, k)
        for name, value in expected.items():
            scale = max(nominal[name], abs(value))
            assert abs(found[name] - value) <= 3e-5 * scale, (name, k, found[name], value)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("model", GUIDES)
def test_the_motion_of_the_guides_in_the_kernel_equals_that_in_the_engine(model, name):
    values, schedule = SCENARIOS[name]
    compared(mechanism(model), values, schedule, end=END_TIMES.get(name, END))


@pytest.mark.parametrize("how", ["default", "driven", "damped"])
@each_shipped
def test_the_motion_of_every_mechanism_in_the_kernel_equals_that_in_the_engine(model, how):
    it = case(model)
    values, schedule = {
        "default": ({}, {}),
        "driven": (it.starts(), it.changes()),
        "damped": ({"damping.zeta": 0.1, f"{it.stop}.restitution": 0.0}, {}),
    }[how]
    found = compared(it.mechanism, values, schedule, it.end, it.end / 60)
    if how == "default":
        assert it.impacts(found) == len(record(model)) > 0


@pytest.mark.parametrize("model", GUIDES)
@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_the_motion_with_two_stops_in_the_kernel_equals_that_in_the_engine(model, friction):
    fields = {"friction": friction, "restitution": 0.5}
    guide = two_stops(model, high=fields | {"position": -3e-3}, low=fields)
    compared(guide, {"release.displacement": -0.01}, {})


HAMMERED = {
    "blow and rest": ({}, {8: {"blow.y": -0.6}}),
    "smooth": ({"face.friction": 0.0, "rub.coefficient": 0.0}, {8: {"blow.y": -0.6}}),
    "lifted": ({"face.restitution": 0.2}, {4: {"blow.y": -0.6}, 30: {"blow.y": 0.03}}),
    "dragged": (
        {"face.friction": 0.05, "rub.coefficient": 0.0},
        {4: {"blow.y": -0.4}, 20: {"blow.x": 0.5, "blow.moment": 1e-3}, 36: {"blow.x": -0.5}},
    ),
    "a wall that moves on its body": (
        {"face.restitution": 0.0},
        {4: {"blow.y": -0.6}, 20: {"face.velocity": -0.02}, 21: {"face.displacement": -5e-5}}
        | {24: {"face.velocity": 0.0}, 30: {"face.displacement": 0.0}},
    ),
    "shaken": ({"damping.zeta": 0.05}, {2: {"base.acceleration.x": 2.0, "blow.y": -0.3}}),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", HAMMERED)
def test_impacts_and_rest_between_bodies_in_the_kernel_equal_those_in_the_engine(name):
    """A hammer hits a moving stage, rests and slides on it; the flexures stretch."""
    values, schedule = HAMMERED[name]
    found = compared(anvil(), values, schedule, end=0.12)
    assert found["face.impact_count"] + found["face.contact"] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "guide", [elastic(), beams(), profiles()], ids=["links", "beams", "profiles"]
)
def test_the_motion_with_all_kinds_of_parts_in_the_kernel_equals_that_in_the_engine(guide):
    """A chain, a free end, bars, joints and walls on bodies, over the first impacts."""
    compared(
        guide,
        {"L": 0.05, "solver.tolerance": 1e-10},
        {2: {"pull.x": 0.05, "push.moment": 0.01}},
        end=0.02,
    )


def test_the_motion_of_the_pmma_guide_in_the_kernel_equals_that_in_the_engine():
    compared(mechanism("PRBDM"), PMMA, {}, end=0.5)


@each_shipped
def test_impact_times_of_the_default_experiment_equal_those_of_the_engine(model):
    """The times agree to 1e-7 s; the guides end in rest after 14 impacts."""
    it, kernel = case(model), KernelSimulation(mechanism(model))
    for impact in record(model):
        kernel.advance(impact.time + 1e-6)
        assert kernel.get(f"{impact.stop}.impact_time") == pytest.approx(impact.time, abs=1e-7)
        assert kernel.get(f"{impact.stop}.impact_count") == impact.latched.impact_count
    kernel.advance(it.end)
    assert it.impacts(kernel.outputs()) == len(record(model)) > 0
    if model in GUIDES:
        assert len(record(model)) == 14
        assert kernel.get("stop.contact") == 1.0


@each_shipped
def test_a_restored_state_continues_bit_by_bit(model):
    it = case(model)
    kernel = KernelSimulation(mechanism(model), {f"{it.stop}.friction": 0.1})
    for time in (0.0, 0.1 * it.end, record(model)[0].time + 1e-6, 0.5 * it.end, 0.87 * it.end):
        kernel.advance(max(time, kernel.get("time")))
        state, later = kernel.state, kernel.get("time") + it.end / 6
        kernel.advance(later)
        expected = kernel.state
        kernel.restore(state)
        assert kernel.state.tobytes() == state.tobytes()
        kernel.advance(later)
        assert kernel.state.tobytes() == expected.tobytes()
        kernel.restore(state)


@pytest.mark.parametrize(
    ("model", "time"),
    [
        (lambda: mechanism("PRBDM2R"), 0.05),
        pytest.param(various, 1e-3, marks=pytest.mark.slow),
    ],
    ids=["2R", "parts"],
)
def test_a_damaged_state_is_rejected_and_a_valid_one_can_still_be_restored(model, time):
    kernel = KernelSimulation(model())
    kernel.advance(time)
    state, rng = kernel.state, np.random.default_rng(0)
    rejected = 0
    for _ in range(300):
        damaged = state.copy()
        damaged[rng.integers(len(state))] = rng.choice([np.nan, np.inf, -1.0, 1e300, 0.5])
        try:
            kernel.restore(damaged)
            kernel.advance(max(kernel.get("time"), time) + time / 50)
        except KernelMistake:
            rejected += 1
        kernel.restore(state)
        assert kernel.state.tobytes() == state.tobytes()
    assert rejected > 30


@each_shipped
def test_an_instance_takes_less_than_256_kib(model):
    """With many directions the limit is 512 bytes times the square of their number."""
    kernel, guide = KernelSimulation(mechanism(model)), mechanism(model)
    directions = assemble(guide, guide.values()).H.shape[0]
    assert library().simulation_bytes(kernel.inner) < max(256 * 1024, 512 * directions**2)


@pytest.mark.parametrize(
    "values",
    [
        {"stop.position": -0.02},
        {"release.displacement": -0.1},
        {"flexure.gamma1": 0.9},
        {"flexure.thickness": -1.0},
        {"flexure.thickness": 0.1},
        {"flexure.length": 1e-4},
    ],
)
def test_the_kernel_rejects_values_with_the_same_message_as_the_engine(values):
    with pytest.raises(PrbmError) as engine:
        Simulation(mechanism("PRBDM2R"), values)
    with pytest.raises(KernelMistake) as kernel:
        KernelSimulation(mechanism("PRBDM2R"), values)
    assert str(kernel.value) == str(engine.value)


@pytest.mark.parametrize("name", ["thickness", "end_thickness"])
def test_both_engines_reject_a_taper_with_an_end_as_thick_as_long(name):
    guide = mechanism("PRBDM2R")
    kind = replace(
        guide.flexure_types[0], model="beam", profile="taper", end_thickness=2e-4, coefficients={}
    )
    taper, values = replace(guide, flexure_types=(kind,)), {f"flexure.{name}": 0.04}
    words = (
        rf"^flexure\.{name} = 0\.04 m is not less than the length of the flexure left_flexure, "
        r"0\.04 m: check the units of both$"
    )
    for engine, error in ((Simulation, PrbmError), (KernelSimulation, KernelMistake)):
        with pytest.raises(error, match=words):
            engine(taper, values)
        engine(taper, {f"flexure.{name}": 0.039, "release.displacement": 0.0})


@pytest.mark.slow
def test_the_blocks_beside_a_notch_may_be_thicker_than_its_flexure_is_long():
    guide, ends = mechanism("NotchGuide"), []
    kind = replace(guide.flexure_types[0], end_thickness=0.011, notch_depth=5e-3)
    for engine in (Simulation, KernelSimulation):
        sim = engine(replace(guide, flexure_types=(kind,)))
        sim.advance(0.01)
        ends.append(sim.outputs()["shuttle.x"])
    assert ends[0] == pytest.approx(ends[1], abs=1e-12)


def test_endless_chatter_is_an_error():
    values = {
        "stop.rest_speed": 0.0, "stop.restitution": 1.0, "release.displacement": -1e-8,
        "gravity.x": 0.0, "damping.beta": 0.0, "force.x": 17000.0,
    }  # fmt: skip
    kernel = KernelSimulation(mechanism("PRBDM"), values)
    before = kernel.state
    with pytest.raises(KernelMistake, match="chatters"):
        kernel.advance(0.01)
    assert kernel.state.tobytes() == before.tobytes()


def test_a_time_that_is_too_large_to_resolve_a_step_is_an_error():
    """Otherwise a step would not change the time, and the loop would not end."""
    kernel = KernelSimulation(mechanism("PRBDM"), start_time=1e18)
    with pytest.raises(KernelMistake, match="smaller than the rounding error of the time"):
        kernel.advance(1e18 + 256.0)
    late = KernelSimulation(mechanism("PRBDM"), start_time=1e6)
    late.advance(1e6 + END)
    assert late.get("stop.impact_count") == 14.0


@each_shipped
def test_a_communication_step_may_be_left_at_each_internal_step(model):
    """Steps with and without such returns give the same motion, also with a moving wall."""
    it = case(model)
    values, step = {f"{it.stop}.velocity": -0.05, f"{it.stop}.friction": 0.1}, it.end / 60
    whole, pieces = (KernelSimulation(mechanism(model), values) for _ in range(2))
    event, left = ctypes.c_bool(), 0
    for k in range(1, 21):
        time = step * k
        change = {f"{it.stop}.displacement": -0.05 * (time - step)}
        for kernel in (whole, pieces):
            kernel.set(change)
        whole.advance(time)
        effort = (ctypes.c_double * 2)()  # Two whole numbers and a time.
        while pieces.get("time") < time or event.value:
            if event.value:
                pieces.call("simulation_handle_event")
            at = ctypes.byref(event)
            pieces.call("simulation_advance_some", time, True, effort, at)
            left += 1
        assert pieces.outputs() == whole.outputs()
    assert left >= 20
    if model in GUIDES:
        assert it.impacts(whole.outputs()) > 0


def many_stops(count):
    """Return a guide with stops along one wall."""
    (stop,) = mechanism("PRBDM2R").stops
    middle = (count - 1) / 2
    stops = tuple(replace(stop, name=f"s{i}", offset=1e-3 * (i - middle)) for i in range(count))
    return replace(mechanism("PRBDM2R"), name="Many", stops=stops)


@pytest.mark.parametrize("count", [12, 20])
def test_many_resting_stops_carry_the_weight_together(count):
    """Twenty stops have too many subsets to try them all."""
    guide = many_stops(count)
    kernel = KernelSimulation(guide, {"release.displacement": -2e-3})
    kernel.advance(0.2)
    one = KernelSimulation(mechanism("PRBDM2R"), {"release.displacement": -2e-3})
    one.advance(0.2)
    assert min(kernel.get(f"{s.name}.gap") for s in guide.stops) > -1e-9
    carried = sum(kernel.get(f"{s.name}.force") for s in guide.stops)
    assert carried == pytest.approx(one.get("stop.force"), rel=0.02)
