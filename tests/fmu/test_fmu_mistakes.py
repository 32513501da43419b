"""Errors of an importer of a Python FMU: each is logged and rejected, and the process survives."""

import subprocess
import sys
import zipfile

import numpy as np
import pytest

from fmu_host import DISCARD, OK, Instance, simulate_fmu
from importer_mistakes import AT_START, LATER, NAN, STEPS
from prbm.fmu.slave import instance
from prbm.fmu.slave.resolved import FILE
from prbm.fmu.slave.slave import MechanismSlave
from support import ROOT, SUPPORT

CYCLES = 50

pytestmark = pytest.mark.fmu


def logged(instance: Instance, sentence: str) -> bool:
    return any(sentence in message for message in instance.messages)


@pytest.mark.parametrize("case", AT_START)
def test_an_invalid_start_value_is_logged_and_rejects_the_first_step(fmus, case):
    name, value, sentence = AT_START[case]
    with Instance(fmus["PRBDM"]) as instance:
        instance.initialize(**{name.replace(".", "__"): value})
        assert logged(instance, sentence), instance.messages
        assert np.isnan(instance.values()["shuttle.x"])
        assert instance.step(0.0, 1e-3) == DISCARD
        assert instance.step(0.0, 1e-3) == DISCARD


def test_links_longer_than_the_flexure_are_rejected(fmus):
    with Instance(fmus["PRBDM2R"]).initialize(flexure__gamma1=0.7) as instance:
        assert logged(instance, "gamma0 = -0.16 < 0")
        assert instance.step(0.0, 1e-3) == DISCARD


@pytest.mark.parametrize("tolerance", [NAN, 0.0, -1e-6, 1.0])
def test_an_invalid_tolerance_is_rejected(fmus, tolerance):
    with Instance(fmus["PRBDM"]).initialize(tolerance=tolerance) as instance:
        assert logged(instance, "the importer's relative tolerance")
        assert instance.step(0.0, 1e-3) == DISCARD


@pytest.mark.parametrize("case", LATER)
def test_an_invalid_value_rejects_steps_until_it_is_corrected(fmus, case):
    name, value, sentence = LATER[case]
    with Instance(fmus["PRBDM"]).initialize() as instance:
        assert instance.step(0.0, 1e-3) == OK
        before = instance.values()
        instance.set({name: value})
        assert logged(instance, sentence), instance.messages
        assert instance.step(1e-3, 1e-3) == DISCARD
        assert instance.values() == before
        instance.set({name: before[name]})
        assert instance.step(1e-3, 1e-3) == OK


@pytest.mark.parametrize("case", STEPS)
def test_an_invalid_step_is_rejected_and_a_valid_one_succeeds_afterwards(fmus, case):
    time, size, sentence = STEPS[case]
    with Instance(fmus["PRBDM"]).initialize() as instance:
        assert instance.step(0.0, 1e-3) == OK
        before = instance.bytes()
        assert instance.step(time, size) == DISCARD
        assert logged(instance, sentence), instance.messages
        assert instance.bytes() == before
        assert instance.step(1e-3, 1e-3) == OK


def test_a_step_before_initialization_is_rejected(fmus):
    with Instance(fmus["PRBDM"]) as instance:
        instance.fmu.setupExperiment(startTime=0.0)
        assert instance.step(0.0, 1e-3) == DISCARD
        assert logged(instance, "initialize the instance first")


def test_a_value_corrected_before_the_start_has_no_effect(fmus):
    with Instance(fmus["PRBDM"]) as instance:
        instance.set({"stop.restitution": 1.5, "release.displacement": -0.2})
        instance.fmu.enterInitializationMode()
        assert np.isnan(instance.values()["shuttle.x"])
        instance.set({"stop.restitution": 0.5, "release.displacement": -0.01})
        instance.fmu.exitInitializationMode()
        assert instance.values()["shuttle.x"] == pytest.approx(-0.01, abs=1e-12)  # statics
        assert instance.step(0.0, 1e-3) == OK


@pytest.mark.parametrize("name", ["stop.restitution", "shuttle.mass", "stop.position"])
def test_a_valid_value_after_the_start_corrects_an_invalid_one_before_it(fmus, name):
    """The motion starts after the correction, also if the wall was first set inside the body."""
    bad = {"stop.position": -0.03}.get(name, -1.0)
    good = {"stop.position": 1e-3}.get(name, 0.5)
    with Instance(fmus["PRBDM"]).initialize(**{name.replace(".", "__"): bad}) as instance:
        assert np.isnan(instance.values()["shuttle.x"])
        assert instance.step(0.0, 1e-3) == DISCARD
        instance.set({name: good})
        assert instance.step(0.0, 0.05) == OK
        found = instance.values()
    with Instance(fmus["PRBDM"]).initialize(**{name.replace(".", "__"): good}) as instance:
        assert instance.step(0.0, 0.05) == OK
        assert instance.values() == found


def test_errors_that_no_value_corrects_ask_for_a_reset(fmus):
    with Instance(fmus["PRBDM"]).initialize() as instance:
        counter = instance.variables["stop.impact_count"].valueReference
        for wrong, sentence in (
            (lambda: instance.fmu.setInteger([counter], [3]), "impact_count is not a parameter or"),
            (lambda: instance.fmu.setReal([12345], [3.0]), "value reference 12345 is not in"),
            (lambda: instance.set({"shuttle.x": 0.1}), "shuttle.x is not a parameter or input"),
        ):
            wrong()
            assert logged(instance, sentence), instance.messages
            assert "reset the instance" in instance.messages[-1]
            assert instance.step(0.0, 1e-3) == DISCARD
            instance.fmu.reset()
            instance.initialize()
            assert instance.step(0.0, 1e-3) == OK
            instance.fmu.reset()
            instance.initialize()


def test_a_set_of_the_wrong_type_is_corrected_by_one_of_the_right_type(fmus):
    with Instance(fmus["PRBDM"]).initialize() as instance:
        instance.fmu.setBoolean([instance.variables["force.x"].valueReference], [True])
        assert logged(instance, "force.x is of type Real: set it with fmi2SetReal")
        assert instance.step(0.0, 1e-3) == DISCARD
        instance.set({"force.x": 0.0})
        assert instance.step(0.0, 1e-3) == OK


WRONG_GETS = {
    "getReal": ("stop.contact", "stop.impact_count", None),
    "getInteger": ("shuttle.x", "stop.contact", None),
    "getBoolean": ("shuttle.x", "stop.impact_count", None),
    "getString": ("shuttle.x", None),
}


@pytest.mark.parametrize("getter", WRONG_GETS)
def test_a_get_of_the_wrong_type_logs_an_error_and_changes_nothing(fmus, getter):
    """If a getter left an exception pending, ctypes would raise it here."""
    with Instance(fmus["PRBDM"]).initialize() as instance:
        for name in WRONG_GETS[getter]:
            reference = instance.variables[name].valueReference if name else 12345
            for _ in range(2):
                (value,) = getattr(instance.fmu, getter)([reference])
                assert not value or np.isnan(value)
            sentence = f"{name} is of type" if name else "12345 is not in modelDescription.xml"
            assert sum(sentence in message for message in instance.messages) == 1
        assert instance.step(0.0, 1e-3) == OK


@pytest.mark.parametrize("error", [ZeroDivisionError("by nothing"), KeyboardInterrupt()])
def test_an_exception_during_the_start_is_the_reason_that_is_logged(
    error, fmus, tmp_path, monkeypatch, capsys
):
    def fails(*_: object, **__: object) -> None:
        raise error

    class Slave(MechanismSlave):
        pass

    with zipfile.ZipFile(fmus["PRBDM"]) as fmu:
        (tmp_path / FILE).write_bytes(fmu.read(f"resources/{FILE}"))
    monkeypatch.setattr(instance, "Simulation", fails)
    slave = Slave(instance_name="it", resources=str(tmp_path))
    slave.exit_initialization_mode()
    reason = "by nothing" if isinstance(error, ZeroDivisionError) else "was interrupted"
    assert reason in slave.instance.failure
    assert not slave.do_step(0.0, 1e-3)
    assert reason in capsys.readouterr().err
    assert not any("was called before" in entry.msg for entry in slave.log_queue)


def test_impacts_are_logged_with_their_numbers(fmus):
    with Instance(fmus["PRBDM"]).initialize() as instance:
        assert instance.step(0.0, 0.05) == OK
        values = instance.values()
        found = [m for m in instance.messages if m.startswith("impact 1 at stop")]
    assert len(found) == 1
    assert f"t = {values['stop.impact_time']:.9g} s" in found[0]


def test_fmpy_ends_early_and_the_reason_is_printed_to_standard_error(fmus, capfd):
    result = simulate_fmu(str(fmus["PRBDM"]), start_values={"stop.restitution": 1.5})
    assert result["time"][-1] == 0.0
    assert "PRBDM: stop.restitution = 1.5 must be at most 1" in capfd.readouterr().err


SURVIVAL = """
import sys
from importer_mistakes import AT_START, LATER, STEPS
from fmu_host import DISCARD, OK, Instance
from prbm.fmu.slave.slave import MechanismSlave

cases = [*AT_START.values()] + [*LATER.values()] + [*STEPS.values()]
for cycle in range(int(sys.argv[2])):
    first, second, _ = cases[cycle % len(cases)]
    with Instance(sys.argv[1]) as instance:
        at_start = cycle % len(cases) < len(AT_START)
        instance.initialize(**({first.replace(".", "__"): second} if at_start else {}))
        if not at_start:
            assert instance.step(0.0, 1e-3) == OK
            if isinstance(first, str):
                instance.set({first: second})
                first, second = 1e-3, 1e-3
            assert instance.step(first, second) == DISCARD
        else:
            assert instance.step(0.0, 1e-3) == DISCARD
        instance.fmu.reset()
        instance.initialize()
        assert instance.step(0.0, 1e-3) == OK
print("survived")
"""


def python(script: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    paths = [str(SUPPORT), str(ROOT / "fmu_src")]
    return subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:0] = {paths!r}\n{script}",
         *map(str, arguments)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_the_process_survives_repeated_errors(fmus):
    """Every case runs in a new instance, which works again after a reset."""
    done = python(SURVIVAL, fmus["PRBDM"], CYCLES)
    assert (done.returncode, done.stdout) == (0, "survived\n"), done.stderr[-2000:]


WITHOUT_SCIPY = """
import sys
from fmu_host import Instance
sys.modules["scipy"] = None  # Importing SciPy then fails, as if it were not installed.
Instance._log = lambda self, *message: print(message[-1].decode())
for attempt in range(3):
    try:
        Instance(sys.argv[1])
    except Exception as error:
        print(error)
"""


def test_a_missing_scipy_is_logged_and_the_instantiation_fails(fmus):
    done = python(WITHOUT_SCIPY, fmus["PRBDM"])
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.count("PRBDM.fmu needs NumPy and SciPy in the Python that runs it") == 3
    assert done.stdout.count("python -m pip install numpy scipy") == 3
    assert done.stdout.count("Failed to instantiate model") == 3


def test_a_percent_sign_is_doubled_for_the_importers_printf():
    slave = object.__new__(MechanismSlave)
    slave.log_queue = []
    slave.log("100 % of \udcff")
    assert slave.log_queue[0].msg == "100 %% of ?"
