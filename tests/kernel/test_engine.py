"""The kernel as an engine of the package: the same motion and the same errors as in Python."""

import copy
import ctypes
import gc
import json
import math
import pickle
import re
import tempfile
import threading
from contextlib import suppress
from dataclasses import asdict, replace

import numpy as np
import pytest

from kernel_library import KERNEL
from many_parts import elastic, two_stops
from prbm.base.errors import MechanismError, ParameterError, PrbmError, SimulationError
from prbm.hybrid.simulation import Simulation
from prbm.kernel import library as library_module
from prbm.kernel.library import FUNCTIONS, MESSAGE_LENGTH, LibraryError, library
from prbm.kernel.simulation import UNFINISHED, KernelSimulation, tables_of
from support import case, each_shipped, mechanism

pytestmark = pytest.mark.native

ENGINES = [Simulation, KernelSimulation]
STEPS = 20
TYPES = {
    "void": None, "bool": ctypes.c_bool, "int": ctypes.c_int, "double": ctypes.c_double,
    "size_t": ctypes.c_size_t,
}  # fmt: skip


def both(mechanism, values=None, **options):
    """Return simulations in both engines that record their impacts."""
    found = [engine(mechanism, values, **options) for engine in ENGINES]
    for one in found:
        one.record = []
    return found


def prototypes():
    """Return result and argument types of the functions of engine.h, by name."""
    text = re.sub(
        r"/\*.*?\*/", "", (KERNEL / "engine.h").read_text(encoding="utf-8"), flags=re.DOTALL
    )
    found = {}
    for result, star, name, arguments in re.findall(
        r"^EXPORTED (\w+) (\*?)(\w+)\(([^)]*)\);", text, re.MULTILINE
    ):
        types = []
        for argument in arguments.split(","):
            if "*" in argument:
                of_text = re.search(r"\bchar \*", argument)
                types.append(ctypes.c_char_p if of_text else ctypes.c_void_p)
            else:
                types.append(TYPES[argument.split()[0]])
        found[name] = (ctypes.c_void_p if star else TYPES[result], *types)
    return found


def test_the_functions_are_declared_as_in_the_header():
    assert prototypes() == FUNCTIONS
    header = (KERNEL / "engine.h").read_text(encoding="utf-8") + (
        KERNEL / "core" / "memory.h"
    ).read_text(encoding="utf-8")
    numbers = dict(re.findall(r"enum \{ (\w+) = (-?\d+) \};", header))
    assert int(numbers["ENGINE_UNFINISHED"]) == UNFINISHED
    assert int(numbers["PROBLEM_LENGTH"]) == MESSAGE_LENGTH


def same_impacts(one, other, rtol):
    """Assert that two records have the same impacts."""
    assert [impact.stop for impact in one] == [impact.stop for impact in other]
    for a, b in zip(one, other, strict=True):
        scale = np.abs(b.before).max()
        assert a.time == pytest.approx(b.time, abs=1e-7 * b.time)
        np.testing.assert_allclose(a.q, b.q, atol=rtol)
        for name in ("before", "after"):
            np.testing.assert_allclose(getattr(a, name), getattr(b, name), atol=rtol * scale)
        assert a.impulse == pytest.approx(b.impulse, rel=rtol)
        assert asdict(a.latched) == pytest.approx(asdict(b.latched), rel=rtol)


@pytest.mark.parametrize("how", ["default", "driven"])
@each_shipped
def test_both_engines_have_the_same_outputs_states_and_impacts(model, how):
    it = case(model)
    values, schedule = ({}, {}) if how == "default" else (it.starts(), it.changes())
    python, kernel = both(it.mechanism, values, start_time=0.5)
    for k in range(STEPS):
        for one in (python, kernel):
            one.set(schedule.get(k, {}))
            one.advance(0.5 + (k + 1) * it.end / STEPS)
        assert (kernel.time, kernel.values, kernel.given) == (
            python.time, python.values, python.given,
        )  # fmt: skip
        expected, found = python.outputs(), kernel.outputs()
        assert list(found) == list(expected)
        assert [type(x) for x in found.values()] == [type(x) for x in expected.values()]
        scale = np.maximum(python.configuration.scales.of_state(python.state()), 1e-12)
        np.testing.assert_allclose(kernel.state() / scale, python.state() / scale, atol=3e-5)
    same_impacts(kernel.record, python.record, 1e-4)
    assert kernel.motions().items() <= kernel.outputs().items()
    assert kernel.motions().keys() == python.motions().keys()
    assert kernel.frequency == pytest.approx(python.frequency, rel=1e-9)
    assert kernel.tolerance == python.tolerance
    assert kernel.configuration.scales.rate == pytest.approx(python.configuration.scales.rate)
    assert 0 < kernel.step_count == pytest.approx(python.step_count, rel=0.1)


def test_outputs_of_several_stops_and_probes_have_the_order_of_the_python_engine():
    python, kernel = both(elastic())
    assert list(kernel.outputs()) == list(python.outputs())
    python, kernel = both(two_stops("PRBDM"))
    for one in (python, kernel):
        one.advance(0.3)
    assert {impact.stop for impact in kernel.record} == {"high", "low"}
    same_impacts(kernel.record, python.record, 1e-5)


def message(function, *arguments, **options):
    """Return the class and the text of the error that a function raises."""
    with pytest.raises((PrbmError, TypeError)) as error:
        function(*arguments, **options)
    return type(error.value), str(error.value)


MISTAKES = {
    "name": ({"stop.restitutoin": 0.5}, {}),
    "bound": ({"stop.restitution": 1.5}, {}),
    "not finite": ({"release.displacement": math.nan}, {}),
    "text": ({"release.displacement": "-10 mm"}, {}),
    "input": ({"force.x": math.inf}, {}),
    "mobility": ({"stop.mobility": -1.0}, {}),
    "penetrated": ({"stop.position": -0.03}, {}),
    "not reached": ({"release.displacement": 0.5}, {}),
    "links too long": ({"flexure.gamma1": 0.7, "flexure.gamma2": 0.7}, {}),
    "tolerance": ({}, {"tolerance": 0.0}),
    "tolerance above one": ({}, {"tolerance": 2.0}),
    "start time": ({}, {"start_time": math.nan}),
}


@pytest.mark.parametrize("how", MISTAKES)
def test_mistakes_in_start_values_have_the_same_message(how):
    values, options = MISTAKES[how]
    guide = mechanism("PRBDM2R")
    expected, found = (message(engine, guide, values, **options) for engine in ENGINES)
    assert found == expected


def test_a_name_in_place_of_a_mechanism_has_the_same_message():
    assert message(KernelSimulation, "PRBDM") == message(Simulation, "PRBDM")


@pytest.mark.parametrize(
    "changes",
    [
        {"stop.restitution": 0.1, "flexure.length": 0.05},
        {"stop.restitution": 0.1, "shuttle.x": 0.0},
        {"force.x": 1.0, "stop.restitution": -0.1},
        {"force.x": math.nan},
    ],
)
def test_a_rejected_change_has_the_same_message_and_changes_nothing(changes):
    python, kernel = both(mechanism("PRBDM2R"))
    assert message(kernel.set, changes) == message(python.set, changes)
    assert (kernel.values, kernel.given) == (python.values, python.given)
    untouched = KernelSimulation(mechanism("PRBDM2R"))
    for one in (kernel, untouched):
        one.advance(0.1)
    assert kernel.outputs() == untouched.outputs()


@pytest.mark.parametrize("target", [-1.0, math.nan, math.inf, 1e9, "a", None, [0.2], 1j, True])
def test_an_invalid_target_time_has_the_same_message(target):
    python, kernel = both(mechanism("PRBDM"))
    for one in (python, kernel):
        one.advance(0.1)
    assert message(kernel.advance, target) == message(python.advance, target)
    assert kernel.time == 0.1


def test_a_step_that_needs_too_much_effort_has_the_same_message():
    python, kernel = both(mechanism("PRBDM2R"), {"flexure.thickness": 0.03})
    found, expected = (message(one.check_effort, 1e-3) for one in (kernel, python))
    pattern = re.compile(r"[\d.]+e[+-]\d+|\d+\.\d+")  # Numbers agree up to rounding.
    assert pattern.sub("x", found[1]) == pattern.sub("x", expected[1])
    assert found[0] is expected[0]


def vice():
    """Return a guide between two walls that can close in on it."""
    guide = mechanism("PRBDM2R")
    (stop,) = guide.stops
    other = replace(stop, name="right", direction=stop.direction + 180.0, position=0.03)
    return replace(guide, name="Vice", stops=(replace(stop, name="left"), other))


@pytest.mark.slow
def test_a_failed_step_has_the_same_message_and_leaves_the_simulation_unchanged():
    closing = {"left.velocity": -0.5, "right.velocity": -0.5}
    python, kernel = both(vice())
    for one in (python, kernel):
        one.advance(0.05)
        one.set(closing)
    before, impacts = kernel.snapshot(), len(kernel.record)
    found, expected = (message(one.advance, 0.3) for one in (kernel, python))
    assert found[0] is expected[0] is SimulationError
    assert kernel.snapshot() == before
    assert len(kernel.record) == impacts
    assert re.sub(r"[\d.e-]+", "x", found[1]) == re.sub(r"[\d.e-]+", "x", expected[1])


def test_a_damaged_saved_state_is_rejected():
    kernel = KernelSimulation(mechanism("PRBDM"))
    saved = kernel.snapshot()
    with pytest.raises(ParameterError, match="damaged"):
        kernel.restore({**saved, "numbers": [math.nan] * len(saved["numbers"])})
    with pytest.raises(ParameterError, match="another mechanism"):
        kernel.restore(KernelSimulation(mechanism("PRBDM2R")).snapshot())
    with pytest.raises(ParameterError, match="belongs to the Python engine"):
        kernel.restore(Simulation(mechanism("PRBDM")).snapshot())
    with pytest.raises(ParameterError, match="belongs to the kernel"):
        Simulation(mechanism("PRBDM")).restore(saved)
    assert kernel.snapshot() == saved


@pytest.mark.parametrize(
    "copied",
    [
        lambda sim: pickle.loads(pickle.dumps(sim)),
        copy.deepcopy,
        lambda sim: restored(sim.mechanism, json.loads(json.dumps(sim.snapshot()))),
    ],
)
def test_a_copy_continues_bit_for_bit(copied):
    original = KernelSimulation(mechanism("PRBDM2R"), {"force.x": 0.1}, tolerance=1e-7)
    original.record = []
    original.advance(0.0423)
    original.set({"stop.restitution": 0.3, "base.acceleration.y": 1.0})
    copy_ = copied(original)
    assert (copy_.values, copy_.given, copy_.tolerance) == (original.values, original.given, 1e-7)
    for sim in (original, copy_):
        sim.advance(0.2)
    assert copy_.outputs() == original.outputs()
    assert (copy_.state() == original.state()).all()


def restored(mechanism, saved):
    """Return a new simulation of a mechanism in a saved state."""
    sim = KernelSimulation(mechanism)
    sim.restore(saved)
    return sim


@pytest.mark.parametrize("engine", ENGINES)
def test_samples_are_the_outputs_at_their_times(engine):
    guide, times = mechanism("PRBDM2R"), [0.0, 0.01, 0.01, 0.0431, 0.1]
    for names in (["shuttle.x"], ["stop.impact_count", "shuttle.vx", "energy.kinetic"]):
        sampled, stepped = engine(guide), engine(guide)
        sampled.record = []
        rows = sampled.sample(times, names)
        for row, t in zip(rows, times, strict=True):
            stepped.advance(t)
            out = stepped.outputs()
            assert row.tolist() == [out[name] for name in names]
        assert sampled.time == 0.1
        sampled.advance(0.12)
        assert sampled.record[0].time < 0.0431
    with pytest.raises(ParameterError, match=r"unknown variable 'shuttle\.z'"):
        sampled.sample(times, ["shuttle.z"])


@pytest.mark.parametrize("engine", ENGINES)
def test_samples_end_at_the_time_of_an_error(engine):
    sim = engine(mechanism("PRBDM"))
    with pytest.raises(SimulationError, match="must be finite"):
        sim.sample([0.01, 0.02, math.nan], ["shuttle.x"])
    assert sim.time == 0.02


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("name", "stop"), [("PRBDM2R", "stop"), ("SliderCrank", "stop"), ("Bistable", "far_stop")]
)
def test_values_beside_events_are_those_of_the_impacts(engine, name, stop):
    """The rates of the gap are the speeds of the impact; the motion does not change."""
    guide, times = mechanism(name), np.linspace(0.0, 0.12, 31)
    names = [f"{stop}.gap_rate", f"{stop}.impact_count", "energy.kinetic", "energy.elastic"]
    observed, plain, rows = engine(guide), engine(guide), []
    observed.record = []
    assert (observed.sample(times, names, rows) == plain.sample(times, names)).all()
    rows, hits = np.array(rows), observed.record
    assert len(hits) > 0
    assert (np.diff(rows[:, 0]) >= 0.0).all()
    assert {hit.stop for hit in hits} == {stop}
    for hit in hits:
        before = rows[rows[:, 0] == math.nextafter(hit.time, -math.inf)][0, 1:]
        after = rows[rows[:, 0] == hit.time][-1, 1:]
        assert -before[0] == pytest.approx(hit.latched.approach_speed, rel=1e-6)
        assert after[0] == pytest.approx(hit.latched.rebound_speed, rel=1e-6, abs=1e-12)
        assert after[1] - before[1] == 1
        lost = before[2] + before[3] - after[2] - after[3]
        assert lost == pytest.approx(hit.latched.energy_lost, rel=1e-6)


@pytest.mark.parametrize("engine", ENGINES)
def test_events_of_a_failed_advance_are_not_kept(engine, monkeypatch):
    """The same advance is repeated later; each event is kept once, and no more without a list."""
    failing, plain = (engine(mechanism("PRBDM2R")) for _ in range(2))
    kept, expected = [], []
    with monkeypatch.context() as patch:
        if engine is Simulation:
            apply = Simulation._apply
            patch.setattr(Simulation, "_apply", lambda sim, event: (apply(sim, event), 1 / 0))
        else:
            patch.setattr(failing, "_library", Interrupted(failing._library))
        with pytest.raises(ZeroDivisionError):
            failing.sample([0.04, 0.4], ["shuttle.vx"], kept)
    assert failing.time == 0.04
    assert kept == []
    failing.sample([0.4], ["shuttle.vx"], kept)
    plain.sample([0.04, 0.4], ["shuttle.vx"], expected)
    assert len(kept) > 2
    assert kept == expected
    plain.sample([0.5], ["shuttle.vx"])
    plain.sample([0.5], ["shuttle.vx"], rows := [])
    assert rows == []


@pytest.mark.parametrize("engine", ENGINES)
def test_rows_beside_events_have_any_number_of_values(engine):
    """A later sample may have more of them, or none."""
    guide = mechanism("PRBDM2R")
    repeated, once = engine(guide), engine(guide)
    names = list(once.outputs())
    repeated.sample([0.1], names[:1], first := [])
    repeated.sample([1.0], names, second := [])
    once.sample([0.1, 1.0], names, rows := [])
    assert first == [row[:2] for row in rows[: len(first)]]
    assert second == rows[len(first) :]
    assert len(first) > 0
    assert len(second) > 0
    engine(guide).sample([1.0], [], times := [])
    assert times == [row[:1] for row in rows]


@pytest.mark.slow
def test_changes_of_phase_have_no_rows():
    """The contact of a compliant stop has rows at its begin and end only, alike in both engines."""
    guide, found = mechanism("PRBDM2R"), []
    stop = replace(guide.stops[0], law="compliant", stiffness=1e5, exponent=1.5)
    for engine in ENGINES:
        sim = engine(replace(guide, stops=(stop,)))
        sim.record = []
        sim.sample([0.07], ["stop.force"], rows := [])
        assert len(sim.record) > 0
        assert {hit.time for hit in sim.record} <= {time for time, _ in rows}
        found.append(rows)
    assert len(found[0]) == len(found[1])
    times, forces = np.array(found).transpose(2, 0, 1)
    np.testing.assert_allclose(times[0], times[1], atol=1e-7)
    np.testing.assert_allclose(forces[:, [0, -1]], 0.0, atol=1e-3)


class Interrupted:
    """The library of the kernel, with an error at the second part of the second sample."""

    def __init__(self, library):
        self.library, self.parts = library, 0

    def __getattr__(self, name):
        return getattr(self.library, name)

    def prbm_sample(self, address, *arguments):
        count = self.library.prbm_sample(address, *arguments)
        self.parts += self.library.prbm_time(address) > 0.0
        return count if self.parts < 2 else 1 / 0


@pytest.mark.slow
def test_memory_is_freed_with_the_simulation_and_with_the_mechanism(monkeypatch):
    closed = []
    for name in ("prbm_close", "prbm_mechanism_close"):
        function = getattr(library(), name)

        def counting(address, name=name, function=function):
            closed.append(name)
            function(address)

        monkeypatch.setattr(library(), name, counting)
    guide = replace(mechanism("PRBDM"), name="Other")
    first, second = KernelSimulation(guide), KernelSimulation(guide)
    assert tables_of(guide) is tables_of(guide)
    del first
    gc.collect()
    assert closed == ["prbm_close"]
    del guide, second
    gc.collect()
    assert closed == ["prbm_close", "prbm_close", "prbm_mechanism_close"]


def test_threads_compute_the_same_motion_in_parallel():
    guide, found = mechanism("PRBDM2R"), {}

    def run(k):
        sim = KernelSimulation(guide)
        found[k] = sim.sample(np.linspace(0.0, 0.2, 50), ["shuttle.x", "stop.impact_count"])

    threads = [threading.Thread(target=run, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((found[k] == found[0]).all() for k in range(8))


def test_threads_may_share_a_simulation():
    sim, errors = KernelSimulation(mechanism("PRBDM2R")), []
    sim.record = []

    def run():
        for k in range(200):
            try:
                sim.advance(k * 1e-3)
            except SimulationError as error:  # Another thread has gone further.
                errors.append(str(error))
            sim.set({"force.x": 1e-3 * k})
            assert math.isfinite(sim.outputs()["shuttle.x"])

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all("not before the present time" in text for text in errors)
    assert sim.outputs()["stop.impact_count"] > 0


class Brief(KernelSimulation):
    """A simulation whose calls are interrupted after 2,500 integration steps."""

    def _repeat(self, call):
        parts = iter(range(50))

        def part():
            if next(parts, None) is None:
                raise SimulationError("interrupted")
            return call()

        super()._repeat(part)


NUMBERS = [0.0, -0.0, 1.0, -1.0, 1e-300, 1e300, math.inf, -math.inf, math.nan, 2**63, True]


@pytest.mark.parametrize("seed", range(30))
def test_random_calls_raise_no_other_errors_than_those_of_the_package(seed):
    random = np.random.default_rng(seed)
    guide = mechanism(random.choice(["PRBDM2R", "ImpactOscillator", "Bistable"]))
    names = [*guide.values(), *Brief(guide).given, "no.name"]
    outputs = [*Brief(guide).outputs()][:2]

    def number():
        usual = random.random() < 0.6
        return float(random.normal()) if usual else NUMBERS[random.integers(len(NUMBERS))]

    def changes():
        return {str(name): number() for name in random.choice(names, random.integers(1, 4))}

    sim = Brief(guide)
    for _ in range(60):
        calls = [
            lambda: Brief(guide, changes(), tolerance=number()),
            lambda: sim.set(changes()),
            lambda: sim.advance(sim.time + 1e-3 * abs(number())),
            lambda: sim.sample([number(), number()], outputs),
            lambda: sim.check_effort(number()),
            lambda: sim.sample(
                [sim.time + 1e-2 * abs(number())], outputs[: random.integers(len(outputs))], []
            ),
            lambda: sim.restore({**sim.snapshot(), "numbers": damaged(sim, random, number)}),
            sim.outputs,
            sim.state,
        ]
        with suppress(PrbmError):
            calls[random.integers(len(calls))]()


def damaged(sim, random, number):
    """Return the numbers of a saved state with one of them changed."""
    numbers = sim.snapshot()["numbers"]
    numbers[random.integers(len(numbers))] = float(number())
    return numbers


def test_a_mechanism_beyond_the_limits_of_the_kernel_is_rejected():
    guide = mechanism("PRBDM")
    (stop,) = guide.stops
    crowd = replace(guide, stops=tuple(replace(stop, name=f"s{k}") for k in range(65)))
    with pytest.raises(MechanismError, match=r"has 65 stops; .*at most 64"):
        KernelSimulation(crowd)


def test_a_damaged_copy_of_the_library_is_written_again(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for _ in range(2):
        with library_module._file(b"content", ".so") as path:
            assert path.read_bytes() == b"content"
            assert path.parent == library_module.private_cache()
        path.write_bytes(b"planted")
    monkeypatch.setattr(library_module, "private_cache", lambda: None)
    with library_module._file(b"content", ".so") as path:
        assert path.read_bytes() == b"content"
    assert not path.exists()


def test_an_error_of_the_temporary_folder_is_one_of_the_library(tmp_path, monkeypatch):
    monkeypatch.setattr(library_module, "private_cache", lambda: None)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    written = library_module._file(b"content", ".so")
    with pytest.raises(LibraryError, match=r"temporary folder \(No such file .* TMPDIR"), written:
        pytest.fail("no file has been written")


@pytest.mark.parametrize("start_time", ["a", None, math.nan])
def test_an_invalid_start_time_has_the_same_message(start_time):
    guide = mechanism("PRBDM")
    found, expected = (
        message(one, guide, start_time=start_time) for one in (KernelSimulation, Simulation)
    )
    assert found == expected
    assert found[1].startswith("start_time = ")


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("times", [["a"], [None, "b"], [[0.1], [0.1, 0.2]], "abc"])
def test_times_that_are_no_numbers_are_rejected(engine, times):
    with pytest.raises(ParameterError, match=r"times = .* must be a list of numbers in s"):
        engine(mechanism("PRBDM")).sample(times, ["shuttle.x"])


@pytest.mark.parametrize("times", [np.empty((2, 0)), [[0.001, 0.002]], 0.001])
def test_times_with_another_shape_than_a_list_are_rejected(times):
    with pytest.raises(ParameterError, match="give a list of times"):
        KernelSimulation(mechanism("PRBDM")).sample(times, ["shuttle.x"])


def test_the_order_of_names_in_a_saved_state_has_no_effect():
    kernel = KernelSimulation(mechanism("PRBDM"))
    kernel.restore(json.loads(json.dumps(kernel.snapshot(), sort_keys=True)))
    kernel.set({"force.x": 0.5})
    assert kernel.given["force.x"] == 0.5
    with pytest.raises(ParameterError, match="damaged"):
        kernel.restore({**kernel.snapshot(), "given": {}})
    with pytest.raises(ParameterError, match="damaged: 'numbers'"):
        kernel.restore({"engine": "kernel"})
    with pytest.raises(ParameterError, match="another mechanism"):
        kernel.restore({**kernel.snapshot(), "numbers": [[]] * len(kernel.snapshot()["numbers"])})


def test_impacts_before_an_error_are_recorded():
    found = []
    for one in both(mechanism("PRBDM")):
        with pytest.raises(SimulationError):
            one.sample([0.05, 0.1, 0.01], ["shuttle.x"])
        found.append(len(one.record))
    assert found[0] == found[1] > 0
