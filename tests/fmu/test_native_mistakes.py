"""Errors of an importer of a native FMU: each is logged and rejected without side effects."""

import shutil
import struct
import subprocess
import sys
import zlib
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint32, c_void_p
from pathlib import Path

import numpy as np
import pytest
from fmpy import fmi2, simulate_fmu
from fmpy.fmi1 import FMICallException

from importer_mistakes import AT_START, LATER, STEPS
from native_host import (
    DISCARD,
    ERROR,
    INTERFACES,
    OK,
    Instance,
    Integrator,
    callbacks,
    clocked,
    status,
    unpacked,
)
from standards import ALLOWED, SIGNATURES, free, raw
from support import ROOT, SUPPORT, possible

NAN, INF = float("nan"), float("inf")
interfaces = pytest.mark.parametrize(("fmi", "kind"), INTERFACES)
steps = pytest.mark.parametrize(
    ("fmi", "kind"), [*(pair for pair in INTERFACES if pair[1] != "me"), (3, "late")]
)
versions = pytest.mark.parametrize("fmi", [2, 3])

pytestmark = [pytest.mark.fmu, pytest.mark.native]


def run_after(instance: Instance) -> bytes:
    instance.advance(instance.time + 0.05)
    return instance.bytes()


# -- values: the same cases and messages as in Python FMUs --


@pytest.mark.parametrize("case", AT_START)
@interfaces
def test_an_invalid_start_value_is_logged_and_prevents_initialization(native, case, fmi, kind):
    """After the correction, the motion is the same as without the invalid value."""
    name, value, sentence = AT_START[case]
    with Instance(native["PRBDM", fmi], kind).initialize() as plain:
        expected = run_after(plain)
    with Instance(native["PRBDM", fmi], kind) as instance:
        rejected = instance.set({name: value}) == ERROR
        assert rejected == instance.logged(sentence)
        instance.enter()
        before = len(instance.log)
        assert instance.call("ExitInitializationMode") == ERROR
        assert instance.logged(sentence)
        assert len(instance.log) > before
        assert instance.log[-1][:2] == (ERROR, "logStatusError")
        assert status(instance.get, "shuttle.vx") == ERROR
        assert instance.call("ExitInitializationMode") == ERROR
        if case == "an output":
            assert "reset the instance" in instance.messages[-1]
            instance.reset()
            instance.enter()
        else:
            assert instance.set({name: float(instance.variables[name].start)}) == OK
        instance.begin()
        assert run_after(instance) == expected


@interfaces
def test_links_longer_than_the_flexure_are_rejected(native, fmi, kind):
    with Instance(native["PRBDM2R", fmi], kind) as instance:
        assert instance.set({"flexure.gamma1": 0.7}) == OK
        instance.enter()
        assert instance.call("ExitInitializationMode") == ERROR
        assert instance.logged("gamma0 = -0.16 < 0")
        assert instance.set({"flexure.gamma1": 0.1}) == OK
        instance.begin()


EXPERIMENTS = {
    "NaN for a tolerance": ({"tolerance": NAN}, "the importer's relative tolerance: solver.toler"),
    "no tolerance": ({"tolerance": 0.0}, "the importer's relative tolerance: solver.tolerance = 0"),
    "a negative tolerance": ({"tolerance": -1e-6}, "the importer's relative tolerance"),
    "a huge tolerance": ({"tolerance": 1.0}, "the importer's relative tolerance"),
    "NaN for a start": ({"start": NAN}, "startTime = nan s must be a finite number"),
    "infinity for a start": ({"start": INF}, "startTime = inf s must be a finite number"),
    "a stop before the start": ({"start": 1.0, "stop": 0.5}, "stopTime = 0.5 s must not be before"),
    "NaN for a stop": ({"stop": NAN}, "stopTime = nan s"),
}


@pytest.mark.parametrize("case", EXPERIMENTS)
@interfaces
def test_an_invalid_experiment_is_rejected(native, case, fmi, kind):
    wrong, sentence = EXPERIMENTS[case]
    with Instance(native["PRBDM", fmi], kind) as instance:
        assert status(lambda: instance.enter(**wrong)) == ERROR
        assert instance.logged(sentence), instance.messages
        if fmi == 2:
            assert instance.call("EnterInitializationMode") == ERROR
            assert instance.logged("call fmi2SetupExperiment first, with valid values")
        instance.enter().begin()
        assert instance.values()["stop.impact_count"] == 0


@steps
def test_a_step_beyond_the_stop_time_is_rejected(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind).initialize(stop=0.01) as instance:
        instance.advance(0.01)
        here = instance.bytes()
        assert instance.step(0.01, 1e-3) == ERROR
        assert instance.logged("the step would end at t = 0.011 s, but stopTime = 0.01 s")
        assert instance.bytes() == here


@pytest.mark.parametrize("fmi", [2, 3])
def test_round_off_in_the_sum_of_steps_may_exceed_the_stop_time(native, fmi):
    """A step may end a thousandth of its length after the stop time, here half of that."""
    with Instance(native["PRBDM", fmi], "cs").initialize(stop=0.1) as instance:
        instance.advance(0.1 - 1e-6)
        late = 0.1 - 1e-6 + 1e-10
        assert instance.step(late, 1e-6) == DISCARD, (
            "a step that does not begin at the present time"
        )
        assert instance.step(0.1 - 1e-6, 1e-6 + 5e-10) == OK
        assert instance.step(0.1 + 5e-10, 1e-6) == ERROR


@pytest.mark.parametrize("case", LATER)
@interfaces
def test_an_invalid_value_rejects_steps_until_it_is_corrected(native, case, fmi, kind):
    name, value, sentence = LATER[case]
    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        instance.advance(1e-3)
        before = instance.values()
        if kind != "cs":
            instance.fmu.enterEventMode()
        assert instance.set({name: value}) == ERROR
        assert instance.logged(sentence), instance.messages
        assert instance.values() == before
        update = instance.function("newDiscreteStates", "updateDiscreteStates") \
            if kind != "cs" else None  # fmt: skip
        rejected = (lambda: instance.step(1e-3, 1e-3)) if kind == "cs" else lambda: status(update)
        for _ in range(2):
            assert rejected() in (DISCARD, ERROR)
            assert instance.logged(f"{name} was set to a rejected value and is still")
        assert instance.values() == before
        assert instance.set({name: before[name]}) == OK
        if kind != "cs":
            instance.update()
        instance.advance(2e-3)


@steps
@pytest.mark.parametrize("case", STEPS)
def test_an_invalid_step_is_rejected_and_a_valid_one_succeeds_afterwards(native, case, fmi, kind):
    time, size, sentence = STEPS[case]
    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        instance.advance(1e-3)
        before = instance.bytes()
        assert instance.step(time, size) == DISCARD
        assert instance.logged(sentence), instance.messages
        assert instance.log[-1][:2] == (DISCARD, "logStatusDiscard")
        assert instance.bytes() == before
        instance.advance(2e-3)


CHATTER = {
    "stop.rest_speed": 0.0, "stop.restitution": 1.0, "release.displacement": -1e-8,
    "gravity.x": 0.0, "damping.beta": 0.0, "force.x": 17000.0,
}  # fmt: skip


@pytest.mark.parametrize(("fmi", "kind"), [(2, "cs"), (3, "cs"), (3, "late")])
def test_a_failed_step_leaves_the_state_unchanged(native, fmi, kind):
    """The step fails because of thousands of impacts; the remedy in its message works."""
    rows = []
    for tried in (True, False):
        with Instance(native["PRBDM", fmi], kind).initialize(values=CHATTER) as instance:
            before = instance.bytes()
            if tried:
                assert instance.step(0.0, 0.01) == DISCARD
                assert instance.logged("chatters; raise rest_speed")
                assert instance.bytes() == before
            instance.change({"stop.rest_speed": 1.0})
            rows += instance.run([0.01])
            assert instance.values()["stop.contact"]
    assert rows[0] == rows[1]


def test_the_status_of_a_rejected_step_can_be_read(native):
    """After fmi2Discard, importers such as FMPy read fmi2Terminated and end the simulation."""
    with Instance(native["PRBDM", 2]).initialize() as instance:
        assert instance.step(0.0, 1e-3) == OK
        assert (instance.fmu.getStatus(0), instance.fmu.getBooleanStatus(3)) == (OK, False)
        assert instance.step(1e-3, -1.0) == DISCARD
        assert instance.fmu.getStatus(0) == DISCARD
        assert instance.fmu.getRealStatus(2) == 1e-3
        assert instance.fmu.getBooleanStatus(3)
        kinds = [("Status", 2), ("RealStatus", 0), ("IntegerStatus", 0), ("BooleanStatus", 1)]
        for getter, kind in [*kinds, ("StringStatus", 0), ("Status", 77)]:
            assert status(getattr(instance.fmu, f"get{getter}"), kind) == DISCARD
            assert "does not provide" in instance.messages[-1]


@versions
def test_model_exchange_accepts_parameters_in_event_mode_only(native, fmi):
    with Instance(native["PRBDM", fmi], "me").initialize() as instance:
        assert instance.set({"force.x": 0.1}) == OK
        assert instance.set({"stop.restitution": 0.5}) == ERROR
        assert instance.logged("stop.restitution is a parameter: it can be set in Event Mode")
        assert status(Integrator(instance).slope, 0.0, Integrator(instance).x()) == ERROR
        instance.fmu.enterEventMode()
        assert instance.set({"stop.restitution": 0.5}) == OK
        instance.update()
        instance.advance(1e-3)


@versions
def test_states_must_be_finite_and_are_set_in_continuous_time_mode(native, fmi):
    with Instance(native["PRBDM", fmi], "me").initialize() as instance:
        here, integrator = instance.bytes(), Integrator(instance)
        x = integrator.x()
        assert status(integrator.put, 0.0, np.full(len(x), NAN)) == DISCARD
        assert instance.logged("link[2].angle = nan must be a finite number")
        assert status(integrator.put, INF, x) == ERROR
        assert instance.logged("time = inf s must be a finite number")
        assert instance.set({"link[2].angle": NAN}) == DISCARD
        for count in (0, len(x) - 1, len(x) + 1):
            values = (c_double * 9)()
            assert instance.call("SetContinuousStates", values, count) == ERROR
            assert instance.logged(f"there are {len(x)} continuous states, not {count}")
            assert instance.call("GetContinuousStates", values, count) == ERROR
            assert instance.call("GetEventIndicators", values, count) == ERROR
            assert instance.logged(f"there are 4 event indicators, not {count}")
        assert instance.bytes() == here
        instance.fmu.enterEventMode()
        assert instance.set({"link[2].angle": 0.1}) == ERROR
        assert instance.logged("link[2].angle is a state: it can be set in Continuous-Time Mode")
        assert instance.bytes() == here


@versions
def test_a_singular_shape_is_discarded_with_a_remedy(native, fmi):
    """The shape is a flat parallelogram; an importer's solver can retry with a shorter step."""
    with Instance(native["PRBDM", fmi], "me").initialize() as instance:
        integrator, here = Integrator(instance), instance.bytes()
        x = integrator.x()
        flat = x.copy()
        flat[0] = 0.0
        assert status(integrator.slope, 0.0, flat) == DISCARD
        assert instance.logged("do not determine the other coordinates")
        assert instance.logged("use co-simulation")
        assert instance.log[-1][:2] == (DISCARD, "logStatusDiscard")
        assert status(instance.get, "shuttle.y") == DISCARD
        integrator.put(0.0, x)
        assert instance.bytes() == here
        instance.advance(1e-3)


@versions
def test_invalid_directional_derivatives_are_rejected(native, fmi):
    with Instance(native["PRBDM", fmi], "me").initialize() as instance:
        r, derivative = instance.references, instance.fmu.getDirectionalDerivative
        good = [r["shuttle.x"]], [r["link[2].angle"]], [1.0]
        value = derivative(*good)
        for unknowns, knowns, sentence in (
            (["stop.contact"], ["force.x"], "stop.contact has no derivative"),
            (["shuttle.mass"], ["force.x"], "shuttle.mass has no derivative"),
            (
                ["shuttle.x"],
                ["shuttle.mass"],
                "no derivative with respect to shuttle.mass: parameters change in Init",
            ),
            (["shuttle.x"], ["shuttle.y"], "no derivative with respect to shuttle.y"),
        ):
            numbers = [r[n] for n in unknowns], [r[n] for n in knowns], [1.0]
            assert status(derivative, *numbers) == ERROR
            assert instance.logged(sentence), instance.messages
        assert status(derivative, [12345], [r["force.x"]], [1.0]) == ERROR
        assert status(derivative, [r["shuttle.x"]], [12345], [1.0]) == ERROR
        assert instance.logged("12345 is not in modelDescription.xml: it has no derivative")
        assert instance.logged("12345 is not in modelDescription.xml: there is no derivative with")
        assert derivative(*good) == value
        assert derivative(good[0], [], []) == [0.0]
        assert derivative([], [], []) == []


# -- references and types --


@interfaces
def test_errors_that_no_value_corrects_ask_for_a_reset(native, fmi, kind):
    set_integer = {2: "setInteger", 3: "setInt32"}[fmi]
    for wrong, sentence in (
        (lambda it: getattr(it.fmu, set_integer)([it.references["stop.impact_count"]], [3]),
         "impact_count is not a parameter or"),
        (lambda it: it.function("setReal", "setFloat64")([12345], [3.0]),
         "value reference 12345 is not in modelDescription.xml: it cannot be set"),
        (lambda it: it.function("setReal", "setFloat64")([it.references["shuttle.x"]], [0.1]),
         "shuttle.x is not a parameter or input"),
    ):  # fmt: skip
        with Instance(native["PRBDM", fmi], kind).enter() as instance:
            assert status(wrong, instance) == ERROR
            assert instance.logged(sentence), instance.messages
            assert "reset the instance" in instance.messages[-1]
            assert instance.call("ExitInitializationMode") == ERROR
            assert "reset the instance" in instance.messages[-1]
            instance.reset()
            instance.initialize()
            instance.advance(1e-3)


@versions
def test_a_set_of_the_wrong_type_is_corrected_by_one_of_the_right_type(native, fmi):
    name = {2: "Real", 3: "Float64"}[fmi]
    others = {2: ["Integer", "Boolean", "String"],
              3: ["Int32", "Boolean", "String", "Float32", "Int8", "UInt8", "Int16", "UInt16",
                  "UInt32", "Int64", "UInt64", "Binary"]}[fmi]  # fmt: skip
    with Instance(native["PRBDM", fmi]).initialize() as instance:
        for k, kind in enumerate(others):
            value = {"String": "1", "Binary": b"1"}.get(kind, 1)
            setter = getattr(instance.fmu, f"set{kind}")
            assert status(setter, [instance.references["force.x"]], [value]) == ERROR
            assert instance.logged(f"force.x is of type {name}: set it with fmi{fmi}Set{name}")
            assert instance.step(k * 1e-3, 1e-3) == DISCARD
            assert instance.set({"force.x": 0.0}) == OK
            assert instance.step(k * 1e-3, 1e-3) == OK


WRONG_GETS = {
    2: {"Real": ("stop.contact", "stop.impact_count"), "Integer": ("shuttle.x", "stop.contact"),
        "Boolean": ("shuttle.x", "stop.impact_count"), "String": ("shuttle.x",)},
    3: {"Float64": ("stop.contact", "stop.impact_count"), "Int32": ("shuttle.x", "stop.contact"),
        "Boolean": ("shuttle.x", "stop.impact_count"), "String": ("shuttle.x",),
        "Binary": ("stop.contact",), "Float32": ("shuttle.x",), "Int8": ("shuttle.x",),
        "UInt8": ("shuttle.x",), "Int16": ("stop.impact_count",), "UInt16": ("shuttle.x",),
        "UInt32": ("stop.impact_count",), "Int64": ("shuttle.x",), "UInt64": ("shuttle.x",)},
}  # fmt: skip


@interfaces
def test_a_get_of_the_wrong_type_is_an_error_and_changes_nothing(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        before = instance.bytes()
        for getter, names in WRONG_GETS[fmi].items():
            for name in names:
                reference = [instance.references[name]]
                assert status(getattr(instance.fmu, f"get{getter}"), reference) == ERROR
                assert f"{name} is of type" in instance.messages[-1]
                assert f"get it with fmi{fmi}Get" in instance.messages[-1]
            assert status(getattr(instance.fmu, f"get{getter}"), [12345]) == ERROR
            assert "12345 is not in modelDescription.xml: it has no value" in instance.messages[-1]
        assert instance.bytes() == before
        instance.advance(1e-3)


@interfaces
def test_computed_variables_have_no_value_before_initialization(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind) as instance:
        assert status(instance.get, "shuttle.x") == ERROR
        assert instance.logged("shuttle.x has no value before the instance is initialized")
        assert instance.get("shuttle.mass") == [float(instance.variables["shuttle.mass"].start)]


def test_fmi_3_requires_as_many_values_as_references(native):
    with Instance(native["PRBDM", 3]).initialize() as instance:
        references = (c_uint32 * 2)(*[instance.references[n] for n in ("force.x", "force.y")])
        values = (c_double * 3)(1.0, 2.0, 3.0)
        for count in (0, 1, 3):
            for call in ("GetFloat64", "SetFloat64"):
                assert instance.call(call, references, 2, values, count) == ERROR
                assert instance.logged(f"fmi3{call}: 2 value references, but {count} values")
        assert instance.get("force.x", "force.y") == [0.0, 0.0]


# -- the state machine --

PLACES = {
    "me": ("instantiated", "initialization", "event", "continuous", "terminated"),
    "cs": ("instantiated", "initialization", "step", "terminated"),
    "events": ("instantiated", "initialization", "event", "step", "terminated"),
}


def at(native, fmi: int, kind: str, place: str) -> Instance:
    """Return an instance in a state of the standard's state machine."""
    instance = Instance(native["PRBDM", fmi], kind)
    if place == "initialization":
        instance.enter()
    elif place != "instantiated":
        instance.initialize()
    if place == "event":
        instance.fmu.enterEventMode()
    if place == "terminated":
        instance.fmu.terminate()
    return instance


@pytest.mark.parametrize(("fmi", "kind", "place"), [(fmi, kind, place) for fmi, kind in INTERFACES
                                                    for place in PLACES[kind]])  # fmt: skip
def test_a_call_in_the_wrong_state_names_the_call_that_must_precede(native, fmi, kind, place):
    """Every function is called in every state and compared with the tables of the standard.

    Pointers are NULL, so an allowed call is rejected for another reason or does nothing.
    """
    for name in SIGNATURES[fmi]:
        with at(native, fmi, kind, place) as instance:
            before = None if place == "instantiated" else instance.saved()
            instance.log.clear()
            found = raw(instance, name)
            wrong = [m for m in instance.messages if "cannot be called in" in m or " is for " in m]
            if name in ALLOWED[fmi, kind][place]:
                assert not wrong, (name, wrong)
                continue
            assert found == ERROR, name
            assert len(instance.log) == 1, (name, instance.log)
            assert instance.messages[0].startswith(f"fmi{fmi}{name}"), instance.messages
            assert wrong or ": " in instance.messages[0]
            if wrong and "cannot be called in" in wrong[0]:
                assert "call fmi" in wrong[0]
                assert wrong[0].endswith(" first")
            if before is not None:
                assert instance.saved() == before, name


@versions
def test_a_null_instance_is_an_error_in_every_function(native, fmi):
    with Instance(native["PRBDM", fmi]) as instance:
        for name in SIGNATURES[fmi]:
            assert raw(instance, name, instance=None) == ERROR, name
        free(instance, None)
        assert not instance.log


@interfaces
def test_null_arrays_are_valid_for_length_zero_only(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        before = instance.bytes()
        for kind_of in ("Real", "Integer", "Boolean", "String") if fmi == 2 else \
                ("Float64", "Int32", "Boolean", "String", "UInt64"):  # fmt: skip
            for access in ("Get", "Set"):
                if raw(instance, access + kind_of) != OK:
                    assert "cannot be called in Continuous-Time Mode" in instance.messages[-1]
                    continue
                several = [c_void_p(), c_size_t(3), c_void_p()] + [c_size_t(3)] * (fmi == 3)
                function = instance.fmu.dll[f"fmi{fmi}{access}{kind_of}"]
                assert function(c_void_p(instance.fmu.component), *several) == ERROR
                assert "was called with a pointer that is NULL" in instance.messages[-1]
        assert instance.bytes() == before
        instance.advance(1e-3)


def test_a_step_with_null_result_pointers_is_rejected(native):
    with Instance(native["PRBDM", 3]).initialize() as instance:
        before = instance.saved()
        assert instance.call("DoStep", 0.0, 1e-3, True, None, None, None, None) == ERROR
        assert instance.logged("fmi3DoStep was called with a pointer that is NULL")
        assert instance.saved() == before


REASONS = {
    2: {"SetRealInputDerivatives": "canInterpolateInputs = false",
        "GetRealOutputDerivatives": "maxOutputDerivativeOrder = 0",
        "CancelStep": "there is no step to cancel"},
    3: {"GetOutputDerivatives": "maxOutputDerivativeOrder = 0",
        "GetAdjointDerivative": "providesAdjointDerivatives = false",
        "EnterConfigurationMode": "no structural parameters",
        "ExitConfigurationMode": "no structural parameters",
        "GetNumberOfVariableDependencies": "providesPerElementDependencies = false",
        "GetVariableDependencies": "providesPerElementDependencies = false",
        "GetIntervalDecimal": "triggered by impacts", "GetIntervalFraction": "triggered by impacts",
        "GetShiftDecimal": "triggered by impacts", "GetShiftFraction": "triggered by impacts",
        "SetIntervalDecimal": "triggered by impacts", "SetIntervalFraction": "triggered by impacts",
        "SetShiftDecimal": "triggered by impacts", "SetShiftFraction": "triggered by impacts",
        "ActivateModelPartition": "no scheduled execution"},
}  # fmt: skip


@versions
def test_unsupported_functions_log_the_reason(native, fmi):
    with Instance(native["PRBDM", fmi]).initialize() as instance:
        for name, reason in REASONS[fmi].items():
            assert raw(instance, name) == ERROR
            assert reason in instance.messages[-1], instance.messages[-1]


# -- instantiation --


def instantiated(fmu: Path, kind: str = "cs", **options) -> list[str]:
    """Return the messages of an instantiation that fails."""
    messages: list[str] = []

    class FailingInstance(Instance):
        def _instantiate(self, *arguments) -> None:
            try:
                super()._instantiate(*arguments)
            finally:
                messages.extend(self.messages)

    with pytest.raises(Exception, match="Failed to instantiate"):
        FailingInstance(fmu, kind, **options)
    return messages


@interfaces
def test_a_wrong_token_is_rejected(native, fmi, kind):
    """Format characters in a message are kept, and # is doubled."""
    for token in ("", "{00000000-0000-0000-0000-000000000000}", "100 %s%n of #x#"):
        (message,) = instantiated(native["PRBDM", fmi], kind, guid=token)
        word = "GUID" if fmi == 2 else "instantiation token"
        assert message.startswith(
            f"the {word} {token.replace('#', '##')} differs from that of the tables"
        )


@versions
def test_null_names_tokens_and_locations_do_not_crash(native, fmi):
    with Instance(native["PRBDM", fmi]) as instance:
        function = instance.fmu.dll[{2: "fmi2Instantiate", 3: "fmi3InstantiateModelExchange"}[fmi]]
        function.restype = c_void_p
        folder = unpacked(native["PRBDM", fmi])[0] / "resources"
        place = c_char_p((folder.as_uri() if fmi == 2 else str(folder)).encode())
        token = c_char_p(instance.description.guid.encode())
        null = c_void_p()
        for name, guid, where, made in (
            (null, token, place, True), (null, null, place, False), (null, token, null, False),
            (null, token, c_char_p(b""), False), (null, token, c_char_p(b"http://x/y"), False),
        ):  # fmt: skip
            if fmi == 2:
                found = function(name, c_int(0), guid, where, null, c_int(0), c_int(1))
            else:
                found = function(name, guid, where, c_int(0), c_int(1), null, null)
            assert bool(found) == made
            if made:
                free(instance, found)
        if fmi == 2:
            assert not function(null, c_int(7), token, place, null, c_int(0), c_int(1))


@pytest.fixture
def copied(native, tmp_path):
    """Return a function that replaces the tables of a copy of an FMU and returns its folder."""

    def copy(fmi: int, tables: bytes | None) -> Path:
        folder = tmp_path / f"copy{fmi}"
        if not folder.exists():
            shutil.copytree(unpacked(native["PRBDM", fmi])[0], folder)
        path = folder / "resources" / "mechanism.bin"
        path.unlink() if tables is None else path.write_bytes(tables)
        return folder

    return copy


def tables_of(native, fmi: int, model: str = "PRBDM") -> bytes:
    return (unpacked(native[model, fmi])[0] / "resources" / "mechanism.bin").read_bytes()


def with_checksum(tables: bytes) -> bytes:
    return tables[:12] + struct.pack("<I", zlib.crc32(tables[16:])) + tables[16:]


@interfaces
def test_missing_or_damaged_tables_are_rejected_with_the_reason(native, copied, fmi, kind):
    good = tables_of(native, fmi)
    assert with_checksum(good) == good
    (message,) = instantiated(copied(fmi, None), kind)
    assert message.startswith("the tables of the mechanism cannot be opened; unpack the whole FMU")
    assert "resources/mechanism.bin" in message
    flipped = bytearray(good)
    flipped[len(good) // 2] ^= 1
    not_a_number = good.replace(struct.pack("<d", 0.04), struct.pack("<d", NAN))
    assert not_a_number != good
    other_version = with_checksum(good[:4] + struct.pack("<I", 1) + good[8:])
    for bad in (b"", b"PRBM", good[:-1], good + b"x", bytes(flipped), with_checksum(not_a_number),
                other_version, b"x" * (17 << 20)):  # fmt: skip
        (message,) = instantiated(copied(fmi, bad), kind)
        assert "tables" in message or "mechanism" in message, message
    (message,) = instantiated(copied(fmi, tables_of(native, 5 - fmi)), kind)
    assert "belong to different FMUs" in message
    (message,) = instantiated(copied(fmi, tables_of(native, fmi, "PRBDM2R")), kind)
    assert "belong to different FMUs" in message


@versions
def test_an_fmu_runs_from_a_path_with_umlauts_and_percent_signs(native, tmp_path, fmi):
    folder = possible(tmp_path / "für 100 %20 #1")
    shutil.copytree(unpacked(native["PRBDM", fmi])[0], folder)
    with Instance(folder).initialize() as instance:
        instance.advance(1e-3)


def test_required_intermediate_variables_must_exist(native):
    (message,) = instantiated(native["PRBDM", 3], requiredIntermediateVariables=[12345])
    assert message.startswith("requiredIntermediateVariables has an entry that is not in")


def test_an_fmu_with_clocks_requires_event_mode():
    """The standard requires it; clocks can be read in Event Mode only and cannot be set."""
    path = clocked("PRBDM")
    (message,) = instantiated(path, "cs")
    assert "instantiate it with eventModeUsed = true" in message
    with Instance(path, "events").initialize() as instance:
        (clock,) = (v for v in instance.description.modelVariables if v.type == "Clock")
        reference = [clock.valueReference]
        assert status(instance.fmu.getClock, reference) == ERROR
        assert instance.logged("fmi3GetClock cannot be called in Step Mode: call fmi3Enter")
        assert status(instance.fmu.getFloat64, reference) == ERROR
        assert instance.logged("stop.impact is of type Clock: get it with fmi3GetClock")
        instance.fmu.enterEventMode()
        assert status(instance.fmu.getClock, [instance.references["force.x"]]) == ERROR
        assert instance.logged("force.x is of type Float64: get it with fmi3GetFloat64")
        assert instance.fmu.getClock(reference) == [False]
        assert status(instance.fmu.setClock, reference, [True]) == ERROR
        assert instance.logged("stop.impact is not a parameter or input: it cannot be set")


def test_scheduled_execution_is_rejected_with_a_reason(native):
    with Instance(native["PRBDM", 3]) as instance:
        function = instance.fmu.dll["fmi3InstantiateScheduledExecution"]
        function.restype = c_void_p
        logger = instance.fmu.logMessage
        null = c_void_p()
        assert not function(c_char_p(b"it"), null, null, c_int(0), c_int(1), null, logger, null,
                            null, null)  # fmt: skip
        assert "has no partitions to schedule" in instance.messages[-1]
    with Instance(native["PRBDM", 3], "cs").initialize() as instance:
        for name in ("EnterEventMode", "EnterStepMode", "UpdateDiscreteStates", "GetClock"):
            assert raw(instance, name) == ERROR
            assert "is for instances made with eventModeUsed = true" in instance.messages[-1]


# -- the log --


@interfaces
def test_log_categories_filter_messages_and_unknown_ones_are_rejected(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind, logging=False).initialize() as instance:
        categories = instance.fmu.setDebugLogging
        instance.advance(0.05)
        assert not instance.log
        assert status(categories, True, ["logStatusError", "logNonsense"]) == ERROR
        texts = [text for _, _, text in instance.log]
        assert not texts or "unknown log category logNonsense" in texts[0]
        assert len(texts) == (fmi == 2)  # FMI 3.0 does not log errors without logging.
        instance.log.clear()
        assert status(categories, True, ["logEvents"]) == OK
        instance.advance(0.12)
        assert instance.log
        assert {entry[:2] for entry in instance.log} == {(OK, "logEvents")}
        assert status(categories, False, ["logEvents"]) == OK
        instance.log.clear()
        instance.advance(0.15)
        assert not instance.log
        assert status(categories, False, []) == OK
        assert status(instance.function("setReal", "setFloat64"), [12345], [1.0]) == ERROR
        assert not instance.log
        assert status(categories, True, []) == OK
        assert status(instance.function("setReal", "setFloat64"), [12345], [1.0]) == ERROR
        assert instance.log[-1][:2] == (ERROR, "logStatusError")
        declared = {category.name for category in instance.description.logCategories}
        for category in declared:
            assert status(categories, True, [category]) == OK
        assert {"logEvents", "logStatusError", "logStatusDiscard"} <= declared


def test_a_logger_without_formatting_receives_complete_messages(native):
    """Loggers of FMI 2.0 in languages without C's variable arguments do not format messages."""
    messages = []

    def log(_, name, status, category, text):
        messages.append(text.decode())

    listening = fmi2.fmi2CallbackFunctions()
    listening.logger = fmi2.fmi2CallbackLoggerTYPE(log)  # Without FMPy's formatting proxy.
    listening.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
    listening.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
    folder, description = unpacked(native["PRBDM", 2])
    slave = fmi2.FMU2Slave(
        guid=description.guid, unzipDirectory=str(folder), modelIdentifier="PRBDM",
        instanceName="alone",
    )  # fmt: skip
    slave.instantiate(callbacks=listening, loggingOn=True)
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, 0.05)
    slave.freeInstance()
    assert messages[-1].startswith("impact 1 at stop, t = 0.041")


@interfaces
def test_impacts_are_logged_with_their_numbers(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind).initialize() as instance:
        instance.advance(0.05)
        values = instance.values()
        ((code, category, text),) = instance.log
    assert (code, category) == (OK, "logEvents")
    assert text == (
        f"impact 1 at stop, t = {values['stop.impact_time']:.9g} s: closing at "
        f"{values['stop.approach_speed']:.6g} m/s, opening at {values['stop.rebound_speed']:.6g} "
        f"m/s, {values['stop.energy_lost']:.6g} J lost"
    )


@versions
def test_fmpy_stops_and_prints_the_reason(native, fmi, capfd):
    callbacks()
    with pytest.raises(FMICallException, match="failed with status 3"):
        simulate_fmu(
            str(native["PRBDM", fmi]), start_values={"stop.restitution": 1.5}, debug_logging=True
        )
    assert "stop.restitution = 1.5 must be at most 1" in capfd.readouterr().out


# -- repetition --

SURVIVAL = """
import sys
from pathlib import Path
from standards import wrong_calls
print(wrong_calls(Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])))
"""


def python(script: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    paths = [str(SUPPORT), str(ROOT / "fmu_src")]
    return subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:0] = {paths!r}\n{script}",
         *map(str, arguments)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.slow
@interfaces
def test_the_process_survives_thousands_of_invalid_calls(native, fmi, kind):
    """All interfaces together make ten thousand calls, of every function and in every state.

    The order is random.  Arguments are NULL pointers and invalid references, lengths and numbers.
    """
    done = python(SURVIVAL, native["PRBDM2R", fmi], kind, 10_000 // len(INTERFACES))
    assert done.returncode == 0, done.stderr[-2000:]
    assert 1_000 < int(done.stdout) < 2_000


@interfaces
def test_an_instance_works_after_repeated_errors_and_resets(native, fmi, kind):
    with Instance(native["PRBDM", fmi], kind).initialize() as plain:
        expected = run_after(plain)
    with Instance(native["PRBDM", fmi], kind) as instance:
        for name, value, _ in [*AT_START.values()] * 5:
            instance.set({name: value})
            status(instance.enter)
            assert instance.call("ExitInitializationMode") == ERROR
            instance.reset()
        for name, value, _ in [*LATER.values()] * 5:
            instance.initialize()
            instance.advance(1e-3)
            if kind != "cs":
                instance.fmu.enterEventMode()
            assert instance.set({name: value}) == ERROR
            instance.reset()
        instance.initialize()
        assert run_after(instance) == expected


def test_a_state_can_be_freed_twice(native):
    """The first call sets the state to NULL, and NULL may be freed."""
    with Instance(native["PRBDM", 3]).initialize() as instance:
        state = instance.fmu.getFMUState()
        for _ in range(3):
            assert instance.call("FreeFMUState", byref(state)) == OK
            assert not state.value
