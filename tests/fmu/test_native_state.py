"""Saving, restoring, serializing and resetting the state of a native FMU, to the byte."""

import struct
import zlib
from ctypes import byref, c_size_t, c_uint8, c_void_p, create_string_buffer

import numpy as np
import pytest
from fmpy import simulate_fmu

from native_host import DISCARD, ERROR, OK, WAYS, Instance, Integrator, status
from support import around_first_impact, case, each_shipped

STEP = 2.5e-3
TIMES = STEP * np.arange(1, 49)  # until 0.12 s: the first impact comes at 0.041 s, four till then
BEFORE, AFTER = TIMES[:16], TIMES[16:]
EVERY = (*WAYS, (3, "late"))
ways = pytest.mark.parametrize(("fmi", "kind"), EVERY)
models = each_shipped

pytestmark = [pytest.mark.fmu, pytest.mark.native]


def spans(model: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times until shortly before the first impact, and from there to some more."""
    before, after = around_first_impact(model)
    return before[1:], after[1:33]


def waiting(instance: Instance) -> None:
    """Go to the next event of co-simulation with early return and stop before it, in Event Mode."""
    event, _, early, instance.time = instance.fmu.doStep(instance.time, 1.0)
    assert event
    assert early
    instance.fmu.enterEventMode()


@ways
@models
def test_a_state_restored_gives_the_same_bytes(native, model, fmi, kind):
    """Before an impact and after some; the second time from a motion that has gone elsewhere."""
    it, (before, after) = case(model), spans(model)
    twice = ((before, after), (np.concatenate([before, after[:20]]), after[20:]))
    substep = it.substep(2e-4)
    with Instance(native[model, fmi], kind, substep=substep).initialize() as instance:
        unborn = instance.saved()
        for first, then in twice:
            instance.restore(unborn)
            instance.time = 0.0
            instance.run(first)
            state, here, data = instance.fmu.getFMUState(), instance.bytes(), instance.saved()
            expected = instance.run(then)
            instance.fmu.setFMUState(state)
            instance.time = first[-1]
            assert instance.bytes() == here
            assert instance.saved() == data
            assert instance.run(then) == expected
            instance.change({f"{it.stop}.restitution": 0.1, f"{it.force}.x": 0.2})
            instance.advance(2 * then[-1] - then[-2])
            instance.fmu.setFMUState(state)
            instance.time = first[-1]
            assert instance.run(then) == expected
            assert it.impacts(instance.values()) >= 1
            instance.fmu.freeFMUState(state)


@ways
@models
def test_a_state_through_bytes_into_another_instance_gives_the_same_bytes(native, model, fmi, kind):
    """Fixed and tunable parameters, inputs, tolerance and time go with it."""
    it, (before, after) = case(model), spans(model)
    name, substep = f"{it.body}.mass", it.substep(2e-4)
    mass = 1.1 * it.mechanism.values()[name]
    with Instance(native[model, fmi], kind, substep=substep) as instance:
        instance.initialize(tolerance=1e-7, values={name: mass}).run(before)
        instance.change({f"{it.force}.x": 0.05, f"{it.stop}.restitution": 0.7})
        data = instance.saved()
        assert data == instance.saved()
        expected = instance.run(after)
    with Instance(native[model, fmi], kind, "other", substep=substep) as other:
        other.initialize(values={name: 1.05 * mass})
        other.restore(data)
        assert other.saved() == data
        other.time = before[-1]
        assert other.run(after) == expected
        assert other.values()[name] == mass
    with Instance(native[model, fmi], kind, substep=substep) as fresh:  # not even initialized
        fresh.restore(data)
        fresh.time = before[-1]
        assert fresh.run(after) == expected


@models
def test_an_event_that_waits_is_part_of_the_state(native, model):
    """Saved within Event Mode before the update, before entering it, and after the update."""
    it = case(model)
    with Instance(native[model, 3], "events").initialize() as instance:
        event, _, _, instance.time = instance.fmu.doStep(0.0, 1.0)
        assert event
        due = instance.saved()
        instance.fmu.enterEventMode()
        inside = instance.saved()
        assert instance.fmu.updateDiscreteStates()[0] is False
        over = instance.saved()
        instance.fmu.enterStepMode()
        time, end = instance.time, instance.time + it.end / 20
        instance.advance(end)
        expected = instance.bytes()
    assert len({due, inside, over}) == 3
    for data, ways_on in ((due, 3), (inside, 2), (over, 1)):
        with Instance(native[model, 3], "events") as other:
            other.restore(data)
            assert other.saved() == data
            other.time = time
            if ways_on == 3:
                assert status(other.fmu.doStep, time, 1e-3) == ERROR
                assert other.said("an event waits at t = ")
                other.fmu.enterEventMode()
            if ways_on >= 2:
                assert status(other.fmu.enterStepMode) == ERROR
                assert other.said("the event is not finished")
                assert it.impacts(other.values()) == 0
                other.update()
            else:
                other.fmu.enterStepMode()
            assert it.impacts(other.values()) == 1
            other.advance(end)
            assert other.bytes() == expected


@pytest.mark.parametrize("fmi", [2, 3])
@models
def test_a_trial_step_of_model_exchange_is_undone_by_a_restored_state(native, model, fmi):
    """Time, states and derivatives are those of the saved instant again."""
    it, (before, _) = case(model), spans(model)
    with Instance(native[model, fmi], "me", substep=it.substep(2e-4)).initialize() as instance:
        instance.run(before)
        data, here = instance.saved(), instance.bytes()
        integrator = Integrator(instance)
        x = integrator.x()
        integrator.put(1.25 * before[-1], x + 0.01)
        assert instance.set({f"{it.force}.x": 1.0}) == OK
        assert instance.bytes() != here
        instance.restore(data)
        assert instance.bytes() == here
        assert (integrator.x() == x).all()


@ways
def test_a_state_saved_before_initialization_is_one_too(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind) as instance:
        assert instance.set({"release.displacement": -0.01}) == OK
        first = instance.saved()
        assert instance.set({"release.displacement": -0.005}) == OK
        instance.restore(first)
        instance.enter()
        inside = instance.saved()
        assert instance.values()["shuttle.x"] == pytest.approx(-0.01, abs=1e-12)  # statics
        assert instance.set({"release.displacement": -0.002}) == OK
        assert instance.values()["shuttle.x"] == pytest.approx(-0.002, abs=1e-12)
        instance.restore(inside)
        instance.begin()
        assert instance.values()["shuttle.x"] == pytest.approx(-0.01, abs=1e-12)
        instance.restore(first)  # back to before: initialize again
        instance.enter().begin()
        instance.advance(STEP)
        instance.fmu.terminate()
        assert instance.values()["shuttle.x"] > -0.01
        ended = instance.saved()
        instance.restore(first)
        instance.restore(ended)
        assert instance.values()["shuttle.x"] > -0.01


@ways
def test_what_was_refused_is_part_of_the_state(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind) as instance:
        assert instance.set({"stop.restitution": 1.5}) == ERROR
        data = instance.saved()
        assert instance.set({"stop.restitution": 0.5}) == OK
        instance.restore(data)
        instance.enter()
        assert instance.call("ExitInitializationMode") == ERROR
        assert instance.said("stop.restitution was set to what is refused and is still 0.6")


# -- what is no state --


def damages(data: bytes):
    """Yield what may happen to bytes, each with what is said then."""
    yield b"", "NULL|no saved state"
    yield b"no state at all, but long enough to look into it", "no saved state"
    yield data[:20], "no saved state"
    yield data[:-1], "another size"
    yield data[:40], "another size"
    yield b"X" + data[1:], "no saved state"
    yield data[:8] + b"\x09" + data[9:], "another version"
    rng = np.random.default_rng(0)
    for place in rng.integers(36, len(data), 40):
        flipped = bytearray(data)
        flipped[place] ^= 1 << int(rng.integers(8))
        yield bytes(flipped), "checksum|another model"


def told(instance: Instance, sentences: str) -> bool:
    return any(instance.said(sentence) for sentence in sentences.split("|"))


@ways
def test_damaged_bytes_are_refused_and_nothing_changes(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind, substep=2e-4).initialize() as instance:
        instance.run(BEFORE[:3])
        here, data = instance.bytes(), instance.saved()
        for bad, sentences in damages(data):
            instance.log.clear()
            assert status(instance.fmu.deserializeFMUState, bad) == ERROR
            assert told(instance, sentences), (sentences, instance.messages)
            assert instance.bytes() == here
        assert instance.saved() == data
        instance.restore(data + b"more room than needed")
        assert instance.saved() == data
        instance.advance(BEFORE[3])


def resealed(data: bytes) -> bytes:
    """Return bytes with a checksum that fits."""
    return data[:16] + struct.pack("<I", zlib.crc32(data[20:])) + data[20:]


@ways
@models
def test_a_forged_state_is_refused_or_harmless(native, model, fmi, kind):
    """With a right checksum: a mode that there is not, NaN, a clock that stands; never a crash."""
    rng, refused, it = np.random.default_rng(1), 0, case(model)
    before, _ = spans(model)
    with Instance(native[model, fmi], kind, substep=it.substep(2e-4)).initialize() as instance:
        instance.run(before[:3])
        data, here = instance.saved(), instance.bytes()
        token = 36 + struct.unpack_from("<I", data, 32)[0]
        assert resealed(data) == data
        forged = [
            data[:token] + struct.pack("<I", 99) + data[token + 4 :],
            data[:token] + struct.pack("<I", 5) + data[token + 4 :],
            data[:token] + struct.pack("<I", 0) + data[token + 4 :],
            data[: token + 4] + struct.pack("<I", 255) + data[token + 8 :],
            data[: token + 16] + struct.pack("<d", np.nan) + data[token + 24 :],
        ]
        for bad in forged:
            state = instance.fmu.deserializeFMUState(resealed(bad))
            assert status(instance.fmu.setFMUState, state) == ERROR
            assert instance.said("damaged")
            assert instance.bytes() == here
            instance.fmu.freeFMUState(state)
        numbers = (len(data) - token - 40) // 8
        for _ in range(150):
            place = len(data) - 8 * int(rng.integers(1, numbers))
            value = rng.choice([np.nan, np.inf, -1.0, 0.5, 1e300, 7.0])
            bad = data[:place] + struct.pack("<d", value) + data[place + 8 :]
            state = instance.fmu.deserializeFMUState(resealed(bad))
            if status(instance.fmu.setFMUState, state) != OK:
                assert instance.bytes() == here
                refused += 1
            instance.fmu.freeFMUState(state)
            instance.restore(data)
            assert instance.bytes() == here
    assert refused > 150 / 4


@ways
def test_a_state_of_something_else_is_refused(native, fmi, kind):
    """Of the other model, the other version, another interface."""
    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        here = instance.bytes()
        others = [("PRBDM2R", fmi, kind), ("PRBDM", 5 - fmi, "cs")]
        others += [("PRBDM", fmi, other) for version, other in EVERY
                   if version == fmi and other != kind]  # fmt: skip
        for model, version, way in others:
            instance.log.clear()
            with Instance(native[model, version], way).initialize() as other:
                data = other.saved()
            if {kind, way} == {"events", "late"}:
                continue  # the same use: whether a step may end early is asked at instantiation
            assert status(instance.fmu.deserializeFMUState, data) == ERROR
            sentence = "another use" if (model, version) == ("PRBDM", fmi) else "another model"
            assert instance.said(sentence), instance.messages
            assert instance.bytes() == here


@ways
def test_buffers_that_are_too_small_or_missing_are_refused(native, fmi, kind):
    word, de = {2: ("FMUstate", "DeSerialize"), 3: ("FMUState", "Deserialize")}[fmi]
    names = [f"Get{word}", f"Serialized{word}Size", f"Serialize{word}", f"{de}{word}"]
    names += [f"Set{word}", f"Free{word}"]
    get, size_of, serialize, deserialize, put, free = names
    byte = {2: create_string_buffer, 3: lambda n: (c_uint8 * n)()}[fmi]
    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        state, size = instance.fmu.getFMUState(), c_size_t()
        assert instance.call(size_of, state, byref(size)) == OK
        buffer = byte(size.value)
        assert instance.call(serialize, state, buffer, size.value - 1) == ERROR
        assert instance.said(f"a saved state needs {size.value} bytes, not {size.value - 1}")
        assert instance.call(serialize, state, None, size.value) == ERROR
        assert instance.call(serialize, None, buffer, size.value) == ERROR
        assert instance.call(size_of, state, None) == ERROR
        assert instance.call(size_of, None, byref(size)) == ERROR
        assert instance.call(get, None) == ERROR
        assert instance.call(put, None) == ERROR
        assert instance.call(deserialize, None, size.value, byref(c_void_p())) == ERROR
        assert instance.call(serialize, state, buffer, size.value) == OK
        assert instance.call(deserialize, buffer, size.value, None) == ERROR
        assert sum("a pointer that is NULL" in text for text in instance.messages) == 8
        assert instance.call(free, None) == OK
        assert instance.call(free, byref(c_void_p())) == OK
        assert instance.call(free, byref(state)) == OK
        assert not state.value
        instance.advance(STEP)


# -- reset --


@ways
@models
def test_reset_is_a_new_instance(native, model, fmi, kind):
    """To the byte: of the values, of the motion, and of the state itself."""
    it, times = case(model), np.linspace(0.0, spans(model)[0][-1], 20)[1:]
    substep = it.substep(2e-4)
    with Instance(native[model, fmi], kind, substep=substep) as new:
        unborn = new.saved()
        new.initialize()
        born, start, expected = new.saved(), new.bytes(), new.run(times)
        last = new.saved()
    wrong = {f"{it.body}.mass": 0.1, f"{it.stop}.restitution": 0.2}
    with Instance(native[model, fmi], kind, substep=substep) as used:
        used.initialize(start=1.0, tolerance=1e-5, stop=9.0, values=wrong)
        used.advance(1.0 + times[-1])
        used.change({f"{it.force}.x": 1.0})
        assert used.set({f"{it.body}.y": 1.0, f"{it.stop}.restitution": 7.0}) == ERROR
        assert status(used.function("setReal", "setFloat64"), [12345], [1.0]) == ERROR
        if kind != "me":
            assert used.step(1.0 + times[-1], -1.0) == DISCARD
        for _ in range(2):
            used.reset()
            assert used.saved() == unborn
            used.initialize()
            assert used.saved() == born
            assert used.bytes() == start
            assert used.run(times) == expected
            assert used.saved() == last


@ways
def test_reset_from_every_state_of_the_state_machine(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind) as instance:
        unborn = instance.saved()
        places = [lambda: None, instance.enter, lambda: instance.enter().begin(),
                  lambda: (instance.enter().begin(), instance.fmu.terminate())]  # fmt: skip
        if kind == "events":
            places.append(lambda: (instance.enter().begin(), waiting(instance)))
        if kind == "me":
            places.append(lambda: (instance.enter().begin(), instance.fmu.enterEventMode()))
        for place in places:
            place()
            instance.reset()
            assert instance.saved() == unborn


@ways
def test_many_states_leave_each_other_alone(native, fmi, kind):
    """Kept at once, restored in any order, freed, and one buffer used again and again."""
    rng = np.random.default_rng(0)
    name = {2: "GetFMUstate", 3: "GetFMUState"}[fmi]
    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        states, rows, again = [], [], c_void_p()
        for k in range(30):
            states.append(instance.fmu.getFMUState())
            rows.append(instance.bytes())
            assert instance.call(name, byref(again)) == OK
            instance.advance((k + 1) * STEP)
        for k in rng.permutation(30):
            instance.fmu.setFMUState(states[k])
            assert instance.bytes() == rows[k]
            instance.fmu.freeFMUState(states[k])
        instance.fmu.setFMUState(again)
        assert instance.bytes() == rows[-1]
        instance.fmu.freeFMUState(again)


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpys_simulation_goes_on_from_a_serialized_state(native, fmi):
    """As its users would: simulate, keep the state, simulate on from there."""
    path, names = str(native["PRBDM", fmi]), ["shuttle.x", "stop.impact_count"]
    whole = simulate_fmu(path, stop_time=0.1, output_interval=STEP, output=names)
    with Instance(native["PRBDM", fmi]).initialize(tolerance=1e-8) as instance:
        instance.advance(0.05)
        data = instance.saved()
    half = simulate_fmu(
        path, fmu_state=data, start_time=0.05, stop_time=0.1, output_interval=STEP, output=names
    )
    assert len(half) == 21
    for name in names:  # communication points differ in their rounding
        assert half[name] == pytest.approx(whole[name][-21:], abs=1e-12)
