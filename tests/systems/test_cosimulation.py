"""The co-simulation master: schemes with closed forms, events as in FMPy, error messages."""

import gc
import math
import os
import re
import shutil
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2LastSuccessfulTime
from fmpy.fmi3 import FMU3Slave
from fmpy.model_description import Dimension

from coupled import guide, integrator, relay
from prbm.base.errors import ParameterError
from prbm.references.scalar_guide import ScalarGuide
from prbm.runs.result import structured
from prbm.systems import components, cosimulation
from prbm.systems.components import (
    CO_SIMULATION,
    Component,
    CouplingError,
    check_size,
    described,
    start_value,
)
from prbm.systems.cosimulation import GAUSS_SEIDEL, JACOBI, System, simulate
from reference_fmus import table
from support import mechanism, possible

pytestmark = [pytest.mark.fmu, pytest.mark.native]

H, STEPS = 1 / 64, 500
CIRCLE = {"b.rate": "a.value", "a.rate": "b.value"}
START = {"a.start": 1.0, "a.gain": 1.0, "b.gain": -1.0}
IMPACTS = ("stop.impact_count", "stop.impact_time", "stop.approach_speed")


def circle(scheme):
    """Simulate a' = b, b' = -a from (1, 0); return time, a and b."""
    fmus = {"a": integrator(), "b": integrator()}
    found = simulate(fmus, CIRCLE, STEPS * H, H, START, scheme=scheme)
    return found["time"], found["a.value"], found["b.value"]


def test_jacobi_is_explicit_euler():
    """A step multiplies a + i b by 1 - i h, so that the circle grows by (1 + h^2)^(n/2)."""
    time, a, b = circle(JACOBI)
    np.testing.assert_allclose(time, H * np.arange(STEPS + 1), rtol=1e-15)
    np.testing.assert_allclose(a + 1j * b, (1 - 1j * H) ** np.arange(STEPS + 1), rtol=1e-12)


def test_gauss_seidel_is_symplectic_euler():
    """The first FMU uses the old output of the second: a^2 + b^2 + h a b is conserved."""
    _, a, b = circle(GAUSS_SEIDEL)
    np.testing.assert_allclose(a**2 + b**2 + H * a * b, 1.0, rtol=1e-12)
    assert a[1] == 1.0
    assert b[1] == -H  # The second FMU uses the new output a[1] = 1.


def test_outputs_reach_inputs_in_initialization_mode():
    """The start of an instance may depend on its connected inputs."""
    fmus = {"sum": integrator(), "guide": guide(2)}
    with System(fmus, {"sum.rate": "guide.shuttle.x"}, watched=["sum.value"]) as system:
        system.start({"sum.feedthrough": 2.0, "guide.release.displacement": -3e-3})
        assert system.values["sum.value"] == pytest.approx(-6e-3, rel=1e-12)


def test_names_and_temporary_folders_may_have_any_letters(fmus, tmp_path, monkeypatch):
    """The library inside a Python FMU crashes where a URI encodes the path of its resources."""
    folder = possible(tmp_path / "Prüfung 試験 100%")
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    found = simulate({"Führung": fmus["PRBDM"]}, {}, 2e-3, 1e-3, None, ["Führung.shuttle.x"])
    assert np.isfinite(found["Führung.shuttle.x"]).all()


def test_the_last_step_may_be_shorter():
    found = simulate({"a": integrator()}, {}, 1.0, 0.3, {"a.rate": 1.0}, ["a.value"])
    np.testing.assert_allclose(found["a.value"], found["time"], rtol=1e-15)
    assert found["time"][-1] == 1.0


def test_integers_and_booleans_keep_their_type():
    values = {"a.rate": 1.0, "a.skipped": 2, "b.rate": 1.0, "b.off": True}
    fmus = {"a": integrator(), "b": integrator()}
    found = simulate(fmus, {}, 4.0, 1.0, values, ["a.value", "b.value"])
    assert found["a.value"].tolist() == [0.0, 0.0, 0.0, 1.0, 2.0]
    assert not found["b.value"].any()


def test_source_inputs_act_in_the_step_that_begins():
    seen = []
    found = simulate(
        {"a": integrator()}, {}, 3.0, 1.0, record=["a.value"],
        source=lambda t: {"a.rate": 1.0 + t}, progress=seen.append,
    )  # fmt: skip
    assert found["a.value"].tolist() == [0.0, 1.0, 3.0, 6.0]
    assert seen == [1 / 3, 2 / 3, 1.0]


@pytest.mark.parametrize("fmi", [2, 3])
def test_base_acceleration_acts_as_gravity(fmi):
    """The negative acceleration of the base adds to gravity, exact to rounding."""
    values = {"guide.gravity.x": 0.0, "guide.release.displacement": 0.0}
    by_base = simulate(
        {"guide": guide(fmi)}, {}, 0.1, 1e-3, values, ["guide.shuttle.x"],
        source=lambda t: {"guide.base.acceleration.x": -2.0},
    )  # fmt: skip
    values["guide.gravity.x"] = 2.0
    found = simulate({"guide": guide(fmi)}, {}, 0.1, 1e-3, values, ["guide.shuttle.x"])
    # Gravity would change the shape at release; here both guides are straight.
    np.testing.assert_allclose(by_base["guide.shuttle.x"], found["guide.shuttle.x"], atol=1e-12)


def alone(**values):
    """Return the impacts of one guide simulated by FMPy, shape (n, 2): time and closing speed."""
    start = {name.replace("__", "."): x for name, x in values.items()}
    found = simulate_fmu(guide(2), stop_time=0.2, output_interval=1e-4,
                         start_values=start, output=IMPACTS)  # fmt: skip
    return impacts(found, "")


def impacts(found, prefix):
    """Return time and closing speed of each impact in a result, shape (n, 2)."""
    new = np.flatnonzero(np.diff(found[f"{prefix}stop.impact_count"], prepend=0))
    return np.column_stack([found[f"{prefix}{name}"][new] for name in IMPACTS[1:]])


def test_all_instances_stop_at_the_time_of_an_event():
    """The integral of 1 equals the time; each impact has a row before it and one after it."""
    fmus = {"clock": integrator(), "guide": guide(3)}
    record = ["clock.value", *(f"guide.{name}" for name in IMPACTS)]
    found = simulate(fmus, {}, 0.2, 0.01, {"clock.rate": 1.0}, record, events=True)
    np.testing.assert_allclose(found["clock.value"], found["time"], rtol=1e-14)
    new = np.flatnonzero(np.diff(found["guide.stop.impact_count"], prepend=0))
    assert len(new) >= 2
    assert (found["time"][new] == found["guide.stop.impact_time"][new]).all()
    assert (found["time"][new] == found["time"][new - 1]).all()
    assert (
        found["guide.stop.impact_count"][new - 1] == found["guide.stop.impact_count"][new] - 1
    ).all()


def test_without_events_rows_are_the_communication_points():
    fmus = {"guide": guide(3)}
    found = simulate(fmus, {}, 0.1, 0.01, record=["guide.stop.impact_count"])
    np.testing.assert_allclose(found["time"], 0.01 * np.arange(11), rtol=1e-15)


AT_REST = {"guide.gravity.x": 0.0, "guide.release.displacement": 0.0, "guide.stop.position": 0.1}
IMPULSE = "guide.force.impulse.x"


@pytest.mark.parametrize("events", [False, True])
def test_a_discrete_input_may_be_set_at_any_step(events):
    """An impulse P on a guide of mass M at rest adds the energy P^2 / (2 M)."""
    found = simulate(
        {"guide": guide(3)}, {}, 0.011, 1e-3, AT_REST, ["guide.shuttle.vx", "guide.energy.work"],
        events=events, source=lambda t: {IMPULSE: 0.0 if t < 0.0095 else 0.01},
    )  # fmt: skip
    mass = ScalarGuide.of(mechanism("PRBDM").values()).mass
    assert (found["guide.shuttle.vx"][found["time"] < 0.0105] == 0.0).all()
    assert found["guide.energy.work"][-1] == pytest.approx(0.01**2 / 2 / mass, rel=1e-9)


@pytest.mark.parametrize("events", [False, True])
def test_a_discrete_input_may_be_connected(events):
    """An impulse sum that grows by 0.2 N s per second acts as a force of 0.2 N."""
    fmus = {"sum": integrator(), "guide": guide(3)}
    values = AT_REST | {"sum.rate": 0.2}
    found = simulate(
        fmus, {IMPULSE: "sum.value"}, 0.02, 1e-4, values, ["guide.shuttle.vx"], events=events
    )
    pushed = simulate(
        {"guide": guide(3)}, {}, 0.02, 1e-4, AT_REST | {"guide.force.x": 0.2}, ["guide.shuttle.vx"]
    )
    expected = pushed["guide.shuttle.vx"][-1]
    assert found["guide.shuttle.vx"][-1] == pytest.approx(
        expected, rel=0.01
    )  # The impulse is exchanged in 200 parts.


@pytest.mark.parametrize("scheme", [GAUSS_SEIDEL, JACOBI])
def test_an_impulse_reaches_the_partner_at_the_time_of_the_impact(scheme):
    """Two equal guides: momentum is conserved to rounding; Newton's law holds for the speeds."""
    wires = {
        "b.stop.displacement": "a.shuttle.x",
        "b.stop.velocity": "a.shuttle.vx",
        "b.stop.mobility": "a.stop.point.mobility",
        "a.force.impulse.x": "b.stop.impulse_sum",
    }
    values = {f"{name}.gravity.x": 0.0 for name in "ab"} | {
        "a.release.displacement": 0.0, "a.stop.position": 0.1,
        "b.release.displacement": -5e-3, "b.stop.restitution": 0.8,
    }  # fmt: skip
    fmus = {"a": guide(3), "b": guide(3)}
    record = ["b.shuttle.vx", "b.stop.impact_count"]
    found = simulate(fmus, wires, 0.06, 1e-3, values, record, scheme, events=True)
    (after,) = np.flatnonzero(np.diff(found["b.stop.impact_count"])) + 1
    a, b = found["a.shuttle.vx"], found["b.shuttle.vx"]
    assert found["time"][after] == found["time"][after - 1]
    assert b[after - 1] > 0.1
    assert a[after] + b[after] == pytest.approx(a[after - 1] + b[after - 1], rel=1e-12)
    assert a[after] - b[after] == pytest.approx(0.8 * (b[after - 1] - a[after - 1]), rel=1e-9)


@pytest.mark.parametrize("scheme", [GAUSS_SEIDEL, JACOBI])
def test_two_unconnected_guides_with_events_move_as_each_does_alone(scheme):
    """At an event of one guide the other is restored and steps to the event.

    The times agree to the tolerance of the FMUs.
    """
    fmus = {"one": guide(3), "other": guide(3)}
    values = {"one.stop.restitution": 0.6, "other.stop.restitution": 0.5}
    record = [f"{name}.{x}" for name in fmus for x in IMPACTS]
    found = simulate(fmus, {}, 0.2, 0.02, values, record, scheme, events=True)
    for name in fmus:
        expected = alone(stop__restitution=values[f"{name}.stop.restitution"])
        np.testing.assert_allclose(impacts(found, f"{name}."), expected, atol=2e-7)
    assert (np.diff(found["time"]) >= 0.0).all()


def test_an_fmu_without_events_uses_the_new_outputs_of_one_with_events():
    """In the Gauss-Seidel scheme FMUs with events step first."""
    fmus = {"sum": integrator(), "guide": guide(3)}
    wires = {"sum.rate": "guide.shuttle.vx"}
    found = simulate(fmus, wires, 0.03, 1e-3, record=["sum.value"], events=True)
    expected = np.concatenate([[0.0], 1e-3 * np.cumsum(found["guide.shuttle.vx"][1:])])
    np.testing.assert_allclose(found["sum.value"], expected, atol=1e-15)
    assert found["guide.shuttle.vx"][-1] == pytest.approx(np.ptp(found["guide.shuttle.vx"]))
    assert found["guide.shuttle.vx"][-1] > 0.1


def test_an_fmu_that_cannot_restore_its_state_is_rejected():
    with System({"a": guide(3), "b": guide(3)}, {}, events=True) as system:
        system.start()
        system.instances["b"].restorable = False
        with pytest.raises(CouplingError, match="b cannot restore a saved state"):
            system.advance(0.01)


def test_an_endless_event_iteration_is_reported(monkeypatch):
    monkeypatch.setattr(cosimulation.Instance, "update", lambda self: True)
    with (
        pytest.raises(CouplingError, match=r"iteration at 0 s does not end after 100 updates"),
        System({"a": guide(3)}, {}, events=True) as system,
    ):
        system.start()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"connections": {"a.rate": "x.value"}}, "'x.value': unknown .* one of a, guide"),
        ({"connections": {"a.rat": "guide.shuttle.x"}}, "a has no variable 'rat'; similar names"),
        ({"connections": {"a.rate": "guide.shuttle"}}, "guide has no variable 'shuttle'"),
        ({"connections": {"a.value": "guide.shuttle.x"}}, "a.value is not an input: connect guide"),
        ({"record": ["guide.nothing"]}, "guide has no variable 'nothing'"),
        ({"values": {"a.value": 1.0}}, "a.value = 1.0 cannot be set: it is neither"),
        ({"values": {"guide.force.x": "much"}}, "guide.force.x = 'much' must be a number"),
        ({"values": {"guide.force.x": math.nan}}, "guide.force.x = nan: must be a number"),
        ({"values": {"guide.force.x": np.ones(2)}}, "guide.force.x = array.* must be a number"),
        ({"values": {"a.skipped": 1.5}}, "a.skipped = 1.5 must be a whole number"),
        ({"values": {"a.off": 2}}, "a.off = 2 must be True or False"),
        ({"scheme": "newton"}, "scheme = 'newton' must be 'gauss-seidel' or 'jacobi'"),
        ({"values": {"guide.flexure.length": -1.0}}, "guide: fmi2.* returned the status 3"),
        ({"fmus": {"a.b": "x.fmu"}}, "instance name 'a.b': must be non-empty and without"),
        ({"fmus": {"a": "missing.fmu"}}, "a: missing.fmu cannot be read as an FMU"),
    ],
)  # fmt: skip
def test_error_messages_name_variable_and_remedy(changes, sentence):
    system = {"fmus": {"a": integrator(), "guide": guide(2)}, "connections": {}} | changes
    with pytest.raises(CouplingError, match=sentence):
        simulate(stop_time=0.01, step=1e-3, **system)


@pytest.mark.slow
def test_messages_do_not_depend_on_loggers_of_other_simulations():
    """FMPy wraps the logger of the last simulation in one native logger for all."""
    simulate_fmu(str(guide(2)), stop_time=0.01, logger=lambda *_: None)
    gc.collect()
    values = {"guide.flexure.length": -1.0}
    with pytest.raises(CouplingError, match=r"status 3: flexure\.length = -1 m"):
        simulate({"guide": guide(2)}, {}, 0.01, 1e-3, values)


@pytest.mark.parametrize("kind", [float, int, bool, np.float32, np.int64, np.bool_, np.array])
@pytest.mark.parametrize("name", ["gain", "skipped", "off"])
def test_every_number_is_taken_as_the_type_of_its_variable(name, kind):
    values = {"a.gain": 3.0, "a.rate": 2.0} | {f"a.{name}": kind(1)}
    found = simulate({"a": integrator()}, {}, 0.5, 0.25, values, ["a.value"])["a.value"]
    end = {"gain": 0.5 * 2.0, "skipped": 0.25 * 3.0 * 2.0, "off": 0.0}[name]
    assert found[-1] == pytest.approx(end)


@pytest.mark.usefixtures("plain_temporary_folder")
def test_enumerations_are_integers_and_strings_are_strings():
    one = Component("a", integrator(), tempfile.mkdtemp(), CO_SIMULATION)
    one.instantiate()
    skipped = one.variable("skipped")
    skipped.type = "Enumeration"
    one.set({"skipped": start_value("a.skipped", 2.0, skipped)})
    assert one.get(["skipped"]) == {"skipped": 2}
    skipped.type = "String"
    assert start_value("a.skipped", "two", skipped) == "two"
    with pytest.raises(CouplingError, match=r"a\.skipped = 2 must be of Python's type str"):
        start_value("a.skipped", 2, skipped)


@pytest.mark.parametrize("library", [None, b"damaged"])
def test_an_fmu_that_cannot_be_loaded_is_reported(library, tmp_path):
    """The library for this platform is missing or damaged; the working directory is kept."""
    here, path = Path.cwd(), tmp_path / "x.fmu"
    with zipfile.ZipFile(guide(3)) as whole, zipfile.ZipFile(path, "w") as part:
        for name in whole.namelist():
            content = library if name.startswith("binaries/") else whole.read(name)
            if content is not None:
                part.writestr(name, content)
    with pytest.raises(CouplingError, match=r"a: .*x\.fmu cannot be loaded here \(.* library"):
        System({"a": path}, {})
    assert Path.cwd() == here


def test_errors_contain_the_message_of_the_fmu():
    with pytest.raises(CouplingError, match=r"status 3: flexure\.length = -1 m must be at least"):
        simulate({"guide": guide(3)}, {}, 0.1, 0.01, {"guide.flexure.length": -1.0})


def test_a_step_of_zero_is_rejected():
    with pytest.raises(ParameterError, match=re.escape("step = 0 s must be positive and finite")):
        simulate({"a": integrator()}, {}, 1.0, 0.0)


def test_rows_before_a_failure_are_kept():
    fmus = {"a": integrator(), "b": integrator()}
    with pytest.raises(CouplingError, match="b terminated") as caught:
        simulate(fmus, CIRCLE, 1.0, H, START | {"b.end": 10 * H}, scheme=JACOBI)
    found, (_, a, _) = caught.value.columns, circle(JACOBI)
    np.testing.assert_array_equal(found["time"], H * np.arange(11))
    np.testing.assert_array_equal(found["a.value"], a[:11])


@pytest.fixture
def uneven(tmp_path):
    """Return the path of an integrator that needs steps of one length."""
    path = tmp_path / "uneven.fmu"
    wanted = 'canHandleVariableCommunicationStepSize="true"'
    with zipfile.ZipFile(integrator()) as source, zipfile.ZipFile(path, "w") as copy:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                assert wanted.encode() in content
                content = content.replace(wanted.encode(), wanted.replace("true", "false").encode())
            copy.writestr(name, content)
    return path


def test_steps_have_one_length_if_an_fmu_needs_that(uneven):
    fmus = {"guide": guide(3), "one": uneven}
    assert len(simulate(fmus, {}, 0.3, 0.1, record=["one.value"])) == 4
    with pytest.raises(CouplingError, match=r"one needs .* multiple of step = 0.2 s"):
        simulate(fmus, {}, 0.3, 0.2)
    with pytest.raises(CouplingError, match=r"one needs .* use events=False"):
        simulate(fmus, {}, 0.3, 0.1, events=True)


def test_the_end_by_an_fmu_of_fmi_2_is_the_reason():
    """The status of the step is Discard, with the status ``fmi2Terminated``; no rows are lost."""
    with pytest.raises(CouplingError, match=r"b terminated the simulation at 0.1 s$") as caught:
        simulate({"b": integrator()}, {}, 1.0, 0.1, {"b.end": 0.1}, ["b.value"])
    np.testing.assert_array_equal(caught.value.columns["time"], [0.0, 0.1])


@pytest.mark.parametrize("scheme", [GAUSS_SEIDEL, JACOBI])
def test_the_row_of_a_complete_step_that_ends_the_simulation_is_kept(scheme, monkeypatch):
    """An FMU of FMI 2.0 reaches the end of its step, an FMU of FMI 3.0 its event before it."""

    def status(own, kind):
        return 1.0 if kind == fmi2LastSuccessfulTime else True

    monkeypatch.setattr(FMU2Slave, "getBooleanStatus", status)
    monkeypatch.setattr(FMU2Slave, "getRealStatus", status)
    fmus = {"a": integrator(), "b": integrator()}
    values = {"a.rate": 1.0, "b.rate": 1.0, "b.end": 0.75}
    with pytest.raises(CouplingError, match=r"b terminated the simulation at 1 s") as caught:
        simulate(fmus, {}, 2.0, 0.25, values, ["a.value"], scheme)
    assert caught.value.columns["time"].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert caught.value.columns["a.value"][-1] == 1.0


@pytest.mark.parametrize("reached", [0.015, 0.02])
def test_a_step_that_ends_the_simulation_before_its_end_has_no_row(reached, monkeypatch):
    monkeypatch.setattr(FMU3Slave, "doStep", lambda *_, **__: (False, True, False, reached))
    with pytest.raises(CouplingError, match=r"guide terminated the simulation at") as caught:
        simulate({"guide": guide(3)}, {}, 0.1, 0.02, record=["guide.shuttle.x"])
    expected = [0.0, 0.02] if reached == 0.02 else [0.0]
    assert caught.value.columns["time"].tolist() == expected


def test_the_reason_that_a_python_fmu_logs_is_part_of_the_message(fmus):
    own = {"guide": fmus["PRBDM"]}
    with pytest.raises(CouplingError, match=r"guide terminated .* at 0 s: .*stop.restitution = 2"):
        simulate(own, {}, 0.1, 0.1, {"guide.stop.restitution": 2.0})


@pytest.mark.parametrize(
    ("wires", "values", "record"),
    [
        ({}, {}, ["guide.shuttle.x"]),
        ({"guide.force.y": "guide.shuttle.x"}, {}, []),
        ({"guide.force.x": "guide.shuttle.y"}, {}, []),
        ({}, {"guide.force.x": 0.1}, []),
    ],
)
def test_arrays_are_refused_before_the_run(wires, values, record, monkeypatch):
    def with_arrays(name, fmu):
        description = described(name, fmu)
        for v in description.modelVariables:
            if v.name in ("shuttle.x", "force.x"):
                v.dimensions = [Dimension("3", None)]
        return description

    monkeypatch.setattr(components, "described", with_arrays)
    with pytest.raises(CouplingError, match=r"guide\.(shuttle|force)\.x is an array"):
        simulate({"guide": guide(3)}, wires, 0.1, 0.1, values, record)


@pytest.mark.parametrize("fmi", [2, 3])
def test_missing_resources_are_named(fmi, tmp_path):
    path = tmp_path / "bare.fmu"
    with zipfile.ZipFile(guide(fmi)) as source, zipfile.ZipFile(path, "w") as copy:
        for name in source.namelist():
            if not name.startswith("resources/"):
                copy.writestr(name, source.read(name))
    with pytest.raises(CouplingError, match=r"a: instantiate failed .*including its folder reso"):
        simulate({"a": path}, {}, 0.1, 0.1)


def test_a_step_that_fails_is_no_end(monkeypatch):
    def fails(own, kind):
        raise FMICallException(function="fmi2GetBooleanStatus", status=3)

    for answer in (lambda own, kind: False, fails):
        monkeypatch.setattr(FMU2Slave, "getBooleanStatus", answer)
        with pytest.raises(CouplingError, match=r"b: .*DoStep at 0 s returned the status 2"):
            simulate({"b": integrator()}, {}, 1.0, 0.1, {"b.end": 0.0})


def test_the_end_of_a_simulation_in_event_mode_is_not_ignored(monkeypatch):
    """No partner at hand ends it there, so that the answer of the guide is exchanged."""
    with System({"guide": guide(3)}, {}, events=True) as system:
        system.start()
        own = system.instances["guide"]
        own.enter_events()
        monkeypatch.setattr(own.fmu, "updateDiscreteStates", lambda: (False, True, False))
        with pytest.raises(CouplingError, match=r"guide terminated the simulation at 0 s"):
            own.update()


KINDS = ("Real", "Integer", "Boolean", "String")
VALUES = {"Real": 0.5, "Integer": 3, "Boolean": True, "String": "ä b"}
WIDER = {("Boolean", "Integer"), ("Boolean", "Real"), ("Integer", "Real")}


@pytest.mark.parametrize("sink", KINDS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_value_arrives_unchanged_or_its_connection_is_refused(kind, sink):
    """A type is connected to itself and to types that contain it; true is 1."""
    fmus, wires = {"a": relay(), "b": relay()}, {f"b.{sink}": f"a.{kind}_out"}
    values = {f"a.{kind}": VALUES[kind]}
    if kind == sink or (kind, sink) in WIDER:
        found = simulate(fmus, wires, 0.4, 0.1, values, [f"b.{sink}_out"])
        assert found[f"b.{sink}_out"][-1] == VALUES[kind]
        return
    with pytest.raises(
        CouplingError, match=rf"a\.{kind}_out of type {kind} cannot be connected to b\.{sink} of"
    ) as caught:
        simulate(fmus, wires, 0.4, 0.1, values)
    assert caught.value.columns is None  # before the run


def test_a_function_may_change_the_type_of_a_value():
    fmus, wires = {"a": relay(), "b": relay()}, {"b.Integer": "a.Real_out"}
    found = simulate(
        fmus, wires, 0.4, 0.1, {"a.Real": 2.75}, ["b.Integer_out"], functions={"b.Integer": int}
    )
    assert found["b.Integer_out"][-1] == 2


@pytest.mark.parametrize("bits", [8, 16, 32, 64])
@pytest.mark.parametrize("sign", ["", "U"])
def test_integers_outside_their_type_are_refused(bits, sign):
    """Two's complement: the least is -2^(n - 1) or zero, the most is one less than the power."""
    kind = f"{sign}Int{bits}"
    least, most = (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for value in (least, most):
        check_size("a.x", value, kind)
    for value in (least - 1, most + 1):
        with pytest.raises(CouplingError, match=rf"a\.x = {value} must be in .* type {kind}"):
            check_size("a.x", value, kind)


@pytest.mark.parametrize(
    ("kind", "good", "bad"),
    [
        ("Float32", np.finfo(np.float32).max.item(), 3.5e38),
        ("Float64", 2**53, 2**53 + 1),
        ("Real", -(2**60), 2**60 + 1),
        ("Integer", -(2**31), 2**31),
        ("String", "ä b", "a\0b"),
    ],
)
def test_values_that_a_type_does_not_have_are_refused(kind, good, bad):
    check_size("a.x", good, kind)
    with pytest.raises(CouplingError, match=r"a\.x = "):
        check_size("a.x", bad, kind)


def test_an_integer_that_grows_too_large_ends_the_run_with_its_rows():
    fmus = {"a": integrator(), "b": relay()}
    functions = {"b.Integer": lambda x: int(x * 2**31)}
    with pytest.raises(CouplingError, match=r"b\.Integer = 2147483648 must be in") as caught:
        simulate(fmus, {"b.Integer": "a.value"}, 2.0, 0.25, {"a.rate": 1.0}, functions=functions)
    assert caught.value.columns["time"].tolist() == [0.0, 0.25, 0.5, 0.75]
    with pytest.raises(CouplingError, match=r"b\.Integer = 1099511627776 must be in"):
        simulate({"b": relay()}, {}, 1.0, 0.1, {"b.Integer": 2**40})


@pytest.mark.parametrize(
    "values", [[1, 2**31], [-5, 2**53 + 1], [0, 2**64 - 1], ["", "ä b"], [b"", b"\x01\x00"]]
)
def test_rows_of_large_integers_texts_and_bytes_keep_their_values(values):
    found = structured([{"time": 0.0, "a.x": x} for x in values])
    assert found["a.x"].tolist() == values


@pytest.mark.parametrize(("fmi", "attribute"), [(2, b'guid="'), (3, b'instantiationToken="')])
def test_the_message_of_an_fmu_that_cannot_be_instantiated_appears(fmi, attribute, tmp_path):
    path = tmp_path / "other.fmu"
    with zipfile.ZipFile(guide(fmi)) as source, zipfile.ZipFile(path, "w") as copy:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = content.replace(attribute, attribute + b"other", 1)
            copy.writestr(name, content)
    word = attribute.decode().removesuffix('="')
    with pytest.raises(
        CouplingError, match=rf"(?i)a: instantiate failed \(.*({word}|token).*other"
    ):
        simulate({"a": path}, {}, 0.1, 0.1)


@pytest.mark.slow
def test_the_reference_fmus_are_partners_or_refused():
    """The folder is a clone of the Reference FMUs of the Modelica Association."""
    if "REFERENCE_FMUS" not in os.environ or shutil.which("cmake") is None:
        pytest.skip("needs CMake, and the variable REFERENCE_FMUS with the path of a clone")
    found = table(Path(os.environ["REFERENCE_FMUS"]))
    assert len(found) == 9
    for name, fmi, texts in found:
        assert "WRONG" not in texts, (name, fmi)
        assert name == "Clocks" or texts[:2] == ("equal", "equal"), (name, fmi, texts)
