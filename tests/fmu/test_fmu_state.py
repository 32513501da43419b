"""Saving, restoring, serializing and resetting the state of a Python FMU."""

import hashlib
import json
from ctypes import byref, c_void_p

import numpy as np
import pytest

from fmu_host import DISCARD, OK, Instance
from support import around_first_impact, case, each_shipped

STEP = 2.5e-3
DIGEST = 32  # Bytes before the text of a serialized state.
BEFORE = STEP * np.arange(17)  # The last time is 0.04 s; the first impact is at 0.041 s.
AFTER = STEP * np.arange(16, 64)  # Six more impacts follow until 0.1575 s.

pytestmark = pytest.mark.fmu


@each_shipped
def test_a_state_restored_before_an_impact_gives_identical_results(fmus, model):
    """The state is restored twice, the second time after a motion with other inputs."""
    it, (before, after) = case(model), around_first_impact(model)
    with Instance(fmus[model]).initialize() as instance:
        instance.run(before)
        assert it.impacts(instance.values()) == 0
        state = instance.fmu.getFMUState()
        here = instance.bytes()
        first = instance.run(after)
        instance.fmu.setFMUState(state)
        assert instance.bytes() == here
        assert instance.run(after) == first
        assert it.impacts(instance.values()) >= 1
        instance.set({f"{it.stop}.restitution": 0.1, f"{it.force}.x": 0.2})
        assert instance.step(after[-1], after[1] - after[0]) == OK
        instance.fmu.setFMUState(state)
        assert instance.run(after) == first
        instance.fmu.freeFMUState(state)


@each_shipped
def test_a_state_deserialized_in_another_instance_gives_identical_results(fmus, model):
    """The state contains fixed and tunable parameters, inputs, tolerance and time."""
    it, (before, after) = case(model), around_first_impact(model)
    mass = 1.1 * it.mechanism.values()[f"{it.body}.mass"]
    with Instance(fmus[model]).initialize(tolerance=1e-7, **{f"{it.body}__mass": mass}) as instance:
        instance.run(before)
        instance.set({f"{it.force}.x": 0.05, f"{it.stop}.restitution": 0.7})
        state = instance.fmu.getFMUState()
        data = instance.fmu.serializeFMUstate(state)
        assert data == instance.fmu.serializeFMUstate(state)
        instance.fmu.freeFMUState(state)
        expected = instance.run(after)
    with Instance(fmus[model], "other").initialize() as other:
        state = other.fmu.deSerializeFMUstate(data)
        other.fmu.setFMUState(state)
        assert other.run(after) == expected
        other.fmu.freeFMUState(state)
        assert other.values()[f"{it.body}.mass"] == mass


def test_a_state_saved_before_initialization_can_be_restored(fmus):
    with Instance(fmus["PRBDM"]) as instance:
        instance.fmu.setupExperiment(startTime=0.0)
        instance.set({"release.displacement": -0.01})
        state = instance.fmu.getFMUState()
        instance.set({"release.displacement": -0.005})
        instance.fmu.setFMUState(state)
        instance.fmu.enterInitializationMode()
        instance.fmu.exitInitializationMode()
        assert instance.values()["shuttle.x"] == pytest.approx(-0.01, abs=1e-12)  # statics
        instance.fmu.freeFMUState(state)


@pytest.mark.parametrize("data", [b"no state", b"[1]", b"{}", b'{"model": "Other.Other_1"}'])
def test_a_state_of_another_fmu_or_interface_is_rejected(fmus, data):
    with Instance(fmus["PRBDM"]).initialize() as instance:
        state = instance.fmu.deSerializeFMUstate(data)
        instance.fmu.setFMUState(state)
        assert any("not saved by this version" in m for m in instance.messages)
        assert instance.step(0.0, 1e-3) == DISCARD
        instance.fmu.freeFMUState(state)


@pytest.mark.parametrize("lost", ["clock", "snapshot", "snapshot front", "snapshot history"])
def test_an_incomplete_state_is_rejected_as_a_whole(fmus, lost):
    """None of its values are restored, and a complete state can be restored afterwards."""
    with Instance(fmus["PRBDM"]).initialize() as instance:
        instance.run(BEFORE)
        good = instance.fmu.getFMUState()
        data = json.loads(instance.fmu.serializeFMUstate(good)[DIGEST:])
        instance.run(AFTER[:3])
        here = instance.values()
        *inside, key = lost.split()
        del (data[inside[0]] if inside else data)[key]
        text = json.dumps(data).encode()
        bad = instance.fmu.deSerializeFMUstate(hashlib.sha256(text).digest() + text)
        instance.fmu.setFMUState(bad)
        assert any("is damaged" in m and key in m for m in instance.messages)
        assert instance.values() == here
        assert instance.step(AFTER[2], STEP) == DISCARD
        instance.fmu.setFMUState(good)
        assert instance.step(BEFORE[-1], STEP) == OK
        instance.fmu.freeFMUState(bad)
        instance.fmu.freeFMUState(good)


def test_a_state_of_which_a_byte_has_changed_is_rejected(fmus):
    with Instance(fmus["PRBDM"]).initialize() as instance:
        instance.run(BEFORE)
        good = instance.fmu.getFMUState()
        data = instance.fmu.serializeFMUstate(good)
        for place in range(0, len(data), len(data) // 50):
            changed = bytes([*data[:place], data[place] ^ 1, *data[place + 1 :]])
            bad = instance.fmu.deSerializeFMUstate(changed)
            instance.fmu.setFMUState(bad)
            assert instance.step(BEFORE[-1], STEP) == DISCARD, place
            instance.fmu.freeFMUState(bad)
        instance.fmu.setFMUState(good)
        assert instance.step(BEFORE[-1], STEP) == OK
        instance.fmu.freeFMUState(good)


def test_a_state_of_another_model_is_rejected(fmus):
    with Instance(fmus["PRBDM2R"]).initialize() as instance:
        state = instance.fmu.getFMUState()
        data = instance.fmu.serializeFMUstate(state)
        instance.fmu.freeFMUState(state)
    with Instance(fmus["PRBDM"]).initialize() as instance:
        state = instance.fmu.deSerializeFMUstate(data)
        instance.fmu.setFMUState(state)
        assert instance.step(0.0, 1e-3) == DISCARD
        instance.fmu.freeFMUState(state)


@each_shipped
def test_a_reset_instance_equals_a_new_one(fmus, model):
    it = case(model)
    times = np.linspace(0.0, (0.1 if it.costly else 0.25) * it.end, 30)
    changed = {f"{it.body}__mass": 0.1, f"{it.stop}__restitution": 0.2}
    with Instance(fmus[model]).initialize() as new:
        start, expected = new.bytes(), new.run(times)
    with Instance(fmus[model]) as used:
        used.initialize(start=1.0, tolerance=1e-5, **changed)
        assert used.step(1.0, times[-1]) == OK
        used.set({f"{it.force}.x": 1.0})
        assert used.step(1.0 + times[-1], -1.0) == DISCARD
        used.fmu.reset()
        used.initialize()
        assert used.bytes() == start
        assert used.run(times) == expected


def test_freeing_a_state_does_not_change_the_instance(fmus):
    """Two hundred states are saved, restored and freed in turn."""
    with Instance(fmus["PRBDM"]).initialize() as instance:
        for k in range(200):
            state = instance.fmu.getFMUState()
            assert instance.step(k * 1e-4, 1e-4) == OK
            instance.fmu.setFMUState(state)
            assert instance.step(k * 1e-4, 1e-4) == OK
            instance.fmu.fmi2FreeFMUstate(instance.fmu.component, byref(c_void_p(state.value)))
        assert instance.values()["stop.impact_count"] == 0
