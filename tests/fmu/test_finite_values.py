"""A value with status OK is finite, however large states and inputs are."""

import ctypes
import math
import struct
import zlib

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from native_host import ERROR, OK, Instance, status
from support import each_shipped

pytestmark = [pytest.mark.fmu, pytest.mark.native]
exchanges = pytest.mark.parametrize("fmi", [2, 3])
EXTREMES = (1e308, -1e308, 1e154, 1e20)


def scalars(instance):
    """Yield the Real variables that can be read, with their values."""
    for name, variable in instance.variables.items():
        if variable.type in ("Real", "Float64"):
            try:
                (x,) = instance.get(name)
            except FMICallException:
                continue
            yield name, x


def arrays(instance):
    """Yield the arrays of model exchange that can be read."""
    nx = instance.description.numberOfContinuousStates
    nz = instance.description.numberOfEventIndicators
    for get, count in (
        (instance.fmu.getContinuousStates, nx),
        (instance.fmu.getNominalsOfContinuousStates, nx),
        (instance.function("getDerivatives", "getContinuousStateDerivatives"), nx),
        (instance.fmu.getEventIndicators, nz),
    ):
        x = (ctypes.c_double * count)()
        if status(get, x, count) == OK:
            yield get.__name__, np.array(x)


def assert_finite(instance, cause):
    for name, x in scalars(instance):
        assert math.isfinite(x), (cause, name)
    for name, x in arrays(instance):
        assert np.isfinite(x).all(), (cause, name)


@exchanges
@each_shipped
def test_values_after_extreme_inputs_and_states_are_finite_or_rejected(native, model, fmi):
    with Instance(native[model, fmi], "me", logging=False).initialize() as instance:
        state, accepted = instance.fmu.getFMUState(), 0
        changed = [n for n, v in instance.variables.items() if v.causality == "input"]
        changed += [
            v.derivative.name for v in instance.variables.values() if v.derivative is not None
        ]
        for name in changed:
            for x in EXTREMES:
                if instance.set({name: x}) == OK:
                    accepted += 1
                    assert_finite(instance, (name, x))
                instance.fmu.setFMUState(state)
        instance.fmu.freeFMUState(state)
        assert accepted > len(changed)


def with_checksum(data: bytes) -> bytes:
    """Return the bytes of a state with a valid checksum."""
    return data[:16] + struct.pack("<I", zlib.crc32(data[20:])) + data[20:]


@exchanges
@pytest.mark.parametrize("x", [math.nan, math.inf, -math.inf])
def test_a_forged_state_without_finite_states_is_rejected(native, fmi, x):
    """The continuous states are the last numbers of a saved state."""
    with Instance(native["PRBDM2R", fmi], "me").initialize() as instance:
        data, here = instance.saved(), instance.bytes()
        for k in range(instance.description.numberOfContinuousStates):
            place = len(data) - 8 * (k + 1)
            bad = data[:place] + struct.pack("<d", x) + data[place + 8 :]
            state = instance.fmu.deserializeFMUState(with_checksum(bad))
            assert status(instance.fmu.setFMUState, state) == ERROR
            instance.fmu.freeFMUState(state)
            assert instance.bytes() == here


@exchanges
@each_shipped
def test_values_after_forged_numbers_are_finite_or_rejected(native, model, fmi):
    with Instance(native[model, fmi], "me", logging=False).initialize() as instance:
        data, rng, restored = instance.saved(), np.random.default_rng(0), 0
        for x in (*EXTREMES, 1e-308, 0.0):
            for _ in range(40):
                place = len(data) - 8 * int(rng.integers(1, (len(data) - 200) // 8))
                bad = data[:place] + struct.pack("<d", x) + data[place + 8 :]
                state = instance.fmu.deserializeFMUState(with_checksum(bad))
                if status(instance.fmu.setFMUState, state) == OK:
                    restored += 1
                    assert_finite(instance, (len(data) - place, x))
                instance.fmu.freeFMUState(state)
                instance.restore(data)
        assert restored > 0
