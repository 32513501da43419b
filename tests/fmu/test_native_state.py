"""Saving, restoring, serializing and resetting the state of a native FMU, bit for bit."""

import struct
import zlib
from ctypes import byref, c_size_t, c_uint8, c_void_p, create_string_buffer

import numpy as np
import pytest
from fmpy import simulate_fmu

from native_host import DISCARD, ERROR, INTERFACES, OK, Instance, Integrator, status
from support import around_first_impact, case, each_shipped

STEP = 2.5e-3
TIMES = STEP * np.arange(1, 49)  # up to 0.12 s; four impacts, the first at 0.041 s
BEFORE, AFTER = TIMES[:16], TIMES[16:]
EVERY = (*INTERFACES, (3, "late"))  # "late": event mode without early return.
interfaces = pytest.mark.parametrize(("fmi", "kind"), EVERY)

pytestmark = [pytest.mark.fmu, pytest.mark.native]


def spans(model: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times until shortly before the first impact, and times from there on."""
    before, after = around_first_impact(model)
    return before[1:], after[1:33]


def enter_event_mode(instance: Instance) -> None:
    """Step to the next event of co-simulation with early return and enter Event Mode."""
    event, _, early, instance.time = instance.fmu.doStep(instance.time, 1.0)
    assert event
    assert early
    instance.fmu.enterEventMode()


@interfaces
@each_shipped
def test_a_restored_state_gives_identical_results(native, model, fmi, kind):
    """The states are before the first impact and after several.

    Each is restored twice, the second time after a motion with other inputs.
    """
    it, (before, after) = case(model), spans(model)
    twice = ((before, after), (np.concatenate([before, after[:20]]), after[20:]))
    substep = it.substep(2e-4)
    with Instance(native[model, fmi], kind, substep=substep).initialize() as instance:
        initial = instance.saved()
        for first, then in twice:
            instance.restore(initial)
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


@interfaces
@each_shipped
def test_a_state_deserialized_in_another_instance_gives_identical_results(native, model, fmi, kind):
    """The state contains fixed and tunable parameters, inputs, tolerance and time."""
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
    with Instance(native[model, fmi], kind, substep=substep) as fresh:  # not initialized
        fresh.restore(data)
        fresh.time = before[-1]
        assert fresh.run(after) == expected


@each_shipped
def test_a_pending_event_is_part_of_the_state(native, model):
    """The state is saved before Event Mode, in it before the update, and after the update."""
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
    for data, calls_left in ((due, 3), (inside, 2), (over, 1)):
        with Instance(native[model, 3], "events") as other:
            other.restore(data)
            assert other.saved() == data
            other.time = time
            if calls_left == 3:
                assert status(other.fmu.doStep, time, 1e-3) == ERROR
                assert other.logged("an event is pending at t = ")
                other.fmu.enterEventMode()
            if calls_left >= 2:
                assert status(other.fmu.enterStepMode) == ERROR
                assert other.logged("the event is not finished")
                assert it.impacts(other.values()) == 0
                other.update()
            else:
                other.fmu.enterStepMode()
            assert it.impacts(other.values()) == 1
            other.advance(end)
            assert other.bytes() == expected


@pytest.mark.parametrize("fmi", [2, 3])
@each_shipped
def test_a_trial_step_of_model_exchange_is_undone_by_a_restored_state(native, model, fmi):
    """Time, states and derivatives are again those of the saved state."""
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


@interfaces
def test_a_state_saved_before_initialization_can_be_restored(native, fmi, kind):
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
        instance.restore(first)  # The instance is no longer initialized.
        instance.enter().begin()
        instance.advance(STEP)
        instance.fmu.terminate()
        assert instance.values()["shuttle.x"] > -0.01
        ended = instance.saved()
        instance.restore(first)
        instance.restore(ended)
        assert instance.values()["shuttle.x"] > -0.01


@interfaces
def test_rejected_values_are_part_of_the_state(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind) as instance:
        assert instance.set({"stop.restitution": 1.5}) == ERROR
        data = instance.saved()
        assert instance.set({"stop.restitution": 0.5}) == OK
        instance.restore(data)
        instance.enter()
        assert instance.call("ExitInitializationMode") == ERROR
        assert instance.logged("stop.restitution was set to a rejected value and is still 0.6")


# -- invalid states --


def damages(data: bytes):
    """Yield damaged bytes of a state, each with parts of the possible messages."""
    yield b"", "NULL|not a saved state"
    yield b"other bytes, but long enough to contain a head", "not a saved state"
    yield data[:20], "not a saved state"
    yield data[:-1], "another size"
    yield data[:40], "another size"
    yield b"X" + data[1:], "not a saved state"
    yield data[:8] + b"\x09" + data[9:], "another version"
    rng = np.random.default_rng(0)
    for place in rng.integers(36, len(data), 40):
        flipped = bytearray(data)
        flipped[place] ^= 1 << int(rng.integers(8))
        yield bytes(flipped), "checksum|another model"


def any_logged(instance: Instance, messages: str) -> bool:
    return any(instance.logged(message) for message in messages.split("|"))


@interfaces
def test_damaged_bytes_are_rejected_without_effect(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind, substep=2e-4).initialize() as instance:
        instance.run(BEFORE[:3])
        here, data = instance.bytes(), instance.saved()
        for bad, messages in damages(data):
            instance.log.clear()
            assert status(instance.fmu.deserializeFMUState, bad) == ERROR
            assert any_logged(instance, messages), (messages, instance.messages)
            assert instance.bytes() == here
        assert instance.saved() == data
        instance.restore(data + b"more bytes than needed")
        assert instance.saved() == data
        instance.advance(BEFORE[3])


def with_checksum(data: bytes) -> bytes:
    """Return the bytes of a state with a valid checksum."""
    return data[:16] + struct.pack("<I", zlib.crc32(data[20:])) + data[20:]


@interfaces
@each_shipped
def test_a_forged_state_is_rejected_or_valid(native, model, fmi, kind):
    """States with a valid checksum, but invalid modes, flags or numbers, do not crash."""
    rng, rejected, it = np.random.default_rng(1), 0, case(model)
    before, _ = spans(model)
    with Instance(native[model, fmi], kind, substep=it.substep(2e-4)).initialize() as instance:
        instance.run(before[:3])
        data, here = instance.saved(), instance.bytes()
        token = 36 + struct.unpack_from("<I", data, 32)[0]
        assert with_checksum(data) == data
        forged = [
            data[:token] + struct.pack("<I", 99) + data[token + 4 :],
            data[:token] + struct.pack("<I", 5) + data[token + 4 :],
            data[:token] + struct.pack("<I", 0) + data[token + 4 :],
            data[: token + 4] + struct.pack("<I", 255) + data[token + 8 :],
            data[: token + 16] + struct.pack("<d", np.nan) + data[token + 24 :],
        ]
        for bad in forged:
            state = instance.fmu.deserializeFMUState(with_checksum(bad))
            assert status(instance.fmu.setFMUState, state) == ERROR
            assert instance.logged("damaged")
            assert instance.bytes() == here
            instance.fmu.freeFMUState(state)
        numbers = (len(data) - token - 40) // 8
        for _ in range(150):
            place = len(data) - 8 * int(rng.integers(1, numbers))
            value = rng.choice([np.nan, np.inf, -1.0, 0.5, 1e300, 7.0])
            bad = data[:place] + struct.pack("<d", value) + data[place + 8 :]
            state = instance.fmu.deserializeFMUState(with_checksum(bad))
            if status(instance.fmu.setFMUState, state) != OK:
                assert instance.bytes() == here
                rejected += 1
            instance.fmu.freeFMUState(state)
            instance.restore(data)
            assert instance.bytes() == here
    assert rejected > 150 / 4


@interfaces
def test_a_state_of_another_fmu_or_interface_is_rejected(native, fmi, kind):
    """The state is that of another model, another version of FMI or another interface."""
    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        here = instance.bytes()
        others = [("PRBDM2R", fmi, kind), ("PRBDM", 5 - fmi, "cs")]
        others += [("PRBDM", fmi, other) for version, other in EVERY
                   if version == fmi and other != kind]  # fmt: skip
        for model, version, interface in others:
            instance.log.clear()
            with Instance(native[model, version], interface).initialize() as other:
                data = other.saved()
            if {kind, interface} == {"events", "late"}:
                continue  # They differ only in early return, which is not part of the state.
            assert status(instance.fmu.deserializeFMUState, data) == ERROR
            sentence = "another kind" if (model, version) == ("PRBDM", fmi) else "another model"
            assert instance.logged(sentence), instance.messages
            assert instance.bytes() == here


@interfaces
def test_buffers_that_are_too_small_or_missing_are_rejected(native, fmi, kind):
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
        assert instance.logged(f"a saved state needs {size.value} bytes, not {size.value - 1}")
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


@interfaces
@each_shipped
def test_a_reset_instance_equals_a_new_one(native, model, fmi, kind):
    """Values, trajectory and saved state are identical."""
    it, times = case(model), np.linspace(0.0, spans(model)[0][-1], 20)[1:]
    substep = it.substep(2e-4)
    with Instance(native[model, fmi], kind, substep=substep) as new:
        initial = new.saved()
        new.initialize()
        started, start, expected = new.saved(), new.bytes(), new.run(times)
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
            assert used.saved() == initial
            used.initialize()
            assert used.saved() == started
            assert used.bytes() == start
            assert used.run(times) == expected
            assert used.saved() == last


@interfaces
def test_a_reset_works_in_every_state_of_the_state_machine(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind) as instance:
        initial = instance.saved()
        places = [lambda: None, instance.enter, lambda: instance.enter().begin(),
                  lambda: (instance.enter().begin(), instance.fmu.terminate())]  # fmt: skip
        if kind == "events":
            places.append(lambda: (instance.enter().begin(), enter_event_mode(instance)))
        if kind == "me":
            places.append(lambda: (instance.enter().begin(), instance.fmu.enterEventMode()))
        for place in places:
            place()
            instance.reset()
            assert instance.saved() == initial


@interfaces
def test_saved_states_are_independent_of_each_other(native, fmi, kind):
    """Thirty states are restored in random order and freed; one buffer is used repeatedly."""
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
def test_fmpy_continues_a_simulation_from_a_serialized_state(native, fmi):
    """The state at 0.05 s is passed to a second simulation."""
    path, names = str(native["PRBDM", fmi]), ["shuttle.x", "stop.impact_count"]
    whole = simulate_fmu(path, stop_time=0.1, output_interval=STEP, output=names)
    with Instance(native["PRBDM", fmi]).initialize(tolerance=1e-8) as instance:
        instance.advance(0.05)
        data = instance.saved()
    half = simulate_fmu(
        path, fmu_state=data, start_time=0.05, stop_time=0.1, output_interval=STEP, output=names
    )
    assert len(half) == 21
    for name in names:  # The communication points differ in round-off.
        assert half[name] == pytest.approx(whole[name][-21:], abs=1e-12)
