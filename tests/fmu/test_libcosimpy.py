"""Native FMUs of FMI 2.0, coupled by libcosim, a co-simulation master in C++."""

from itertools import pairwise

import pytest
from fmpy import read_model_description

from c_importer import native
from fmu_host import OK, Instance

pytestmark = pytest.mark.native

STEPS, STEP = 250, 1_000_000  # The step is in ns, the unit of libcosim.
START = {"stop.position": 0.02, "stop.restitution": 0.8}
WIRES = {"stop.displacement": "shuttle.x", "stop.velocity": "shuttle.vx"}
READ = ("shuttle.x", "shuttle.vx", "stop.gap", "stop.impulse", "energy.dissipated")


def fmu(model: str) -> str:
    return str(native(model, 2).with_suffix(".fmu"))


def reference(name: str) -> int:
    """Return the value reference of a variable, which is the same in both FMUs."""
    variables = read_model_description(fmu("PRBDM")).modelVariables
    return next(v.valueReference for v in variables if v.name == name)


def by_fmpy() -> list[list[float]]:
    """Return the variables READ of both mechanisms after each step, with a master in Python."""
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
    """Return the variables READ of both mechanisms after each step, with libcosim as master."""
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
    rows, references = [], [reference(name) for name in READ]
    for _ in range(STEPS):
        assert execution.step()
        rows.append(
            [x for slave in (carrier, guide) for x in observer.last_real_values(slave, references)]
        )
    return rows


def test_a_coupled_wall_moves_identically_in_libcosim_and_fmpy():
    """The wall of the 1R guide moves with the shuttle of the 2R guide."""
    pytest.importorskip("libcosimpy", reason="libcosimpy is not installed (PyPI: libcosimpy)")
    assert by_libcosim() == by_fmpy()
