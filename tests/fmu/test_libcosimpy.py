"""A master in C++, libcosim, runs native FMUs of FMI 2.0 side by side."""

from itertools import pairwise

import pytest
from fmpy import read_model_description

from c_importer import native
from fmu_host import OK, Instance

pytestmark = pytest.mark.native

STEPS, STEP = 250, 1_000_000  # ns, in which libcosim counts
START = {"stop.position": 0.02, "stop.restitution": 0.8}
WIRES = {"stop.displacement": "shuttle.x", "stop.velocity": "shuttle.vx"}
READ = ("shuttle.x", "shuttle.vx", "stop.gap", "stop.impulse", "energy.dissipated")


def fmu(model: str) -> str:
    return str(native(model, 2).with_suffix(".fmu"))


def reference(name: str) -> int:
    """Return the value reference of a variable: it depends on the name only."""
    variables = read_model_description(fmu("PRBDM")).modelVariables
    return next(v.valueReference for v in variables if v.name == name)


def by_fmpy() -> list[list[float]]:
    """Return what is read of both mechanisms at each step, with a master of a few lines."""
    rows = []
    with Instance(fmu("PRBDM2R"), "carrier") as carrier, Instance(fmu("PRBDM"), "guide") as guide:

        def wire() -> None:
            found = carrier.values()
            guide.set({to: found[source] for to, source in WIRES.items()})

        guide.set(START)
        for instance in (carrier, guide):
            instance.fmu.setupExperiment(startTime=0.0)
            instance.fmu.enterInitializationMode()
        wire()
        for instance in (carrier, guide):
            instance.fmu.exitInitializationMode()
        times = [k * STEP / 1e9 for k in range(STEPS + 1)]
        for begin, end in pairwise(times):
            wire()
            for instance in (carrier, guide):
                assert instance.step(begin, end - begin) == OK
            found = [instance.values() for instance in (carrier, guide)]
            rows.append([values[name] for values in found for name in READ])
        assert guide.values()["stop.impact_count"] >= 2
    return rows


def by_libcosim() -> list[list[float]]:
    """Return the same by libcosim's algorithm of fixed steps."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_step_size(STEP)
    carrier = execution.add_local_slave(CosimLocalSlave(fmu("PRBDM2R"), "carrier"))
    guide = execution.add_local_slave(CosimLocalSlave(fmu("PRBDM"), "guide"))
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer)
    for name, value in START.items():
        assert execution.real_initial_value(guide, reference(name), value)
    for to, source in WIRES.items():
        execution.connect_real_variables(carrier, reference(source), guide, reference(to))
    rows, asked = [], [reference(name) for name in READ]
    for _ in range(STEPS):
        assert execution.step()
        rows.append(
            [x for slave in (carrier, guide) for x in observer.last_real_values(slave, asked)]
        )
    return rows


def test_a_wall_that_another_mechanism_carries_is_the_same_in_both_masters():
    """The stop of the 1R guide rides on the shuttle of the 2R guide."""
    pytest.importorskip("libcosimpy", reason="libcosimpy is not installed (PyPI: libcosimpy)")
    assert by_libcosim() == by_fmpy()
