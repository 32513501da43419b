"""Interrupted calls of the kernel, and calls that lack memory: nothing is lost or changed."""

from dataclasses import replace

import numpy as np
import pytest

from kernel_simulation import KernelSimulation as WholeSteps
from prbm.base.errors import SimulationError
from prbm.hybrid import simulation as python
from prbm.hybrid.simulation import Simulation
from prbm.hybrid.stepping import take_step
from prbm.kernel import simulation as module
from prbm.kernel.compiler import ENGINE, Job, _host_compilers, compiled, this_platform
from prbm.kernel.library import _loaded
from prbm.kernel.simulation import UNFINISHED, KernelSimulation
from prbm.kernel.sources import kernel
from support import mechanism

pytestmark = pytest.mark.native


class InterruptError(BaseException):
    """Raised by the tests, as KeyboardInterrupt is by Ctrl-C."""


class Counted:
    """A library that counts the unfinished calls of two functions, and interrupts one of them.

    A signal of the system raises its exception between two calls, too.
    """

    def __init__(self, library, calls=1000):
        self.library, self.calls, self.unfinished = library, calls, 0

    def __getattr__(self, name):
        return getattr(self.library, name)

    def prbm_advance(self, *arguments):
        return self._counted(self.library.prbm_advance, arguments)

    def prbm_sample(self, *arguments):
        return self._counted(self.library.prbm_sample, arguments)

    def _counted(self, function, arguments):
        self.calls -= 1
        if self.calls == -1:
            raise InterruptError
        result = function(*arguments)
        self.unfinished += result == UNFINISHED
        return result


def interrupt_kernel(sim, monkeypatch):
    monkeypatch.setattr(sim, "_library", Counted(sim._library, 3))


def interrupt_python(sim, monkeypatch):
    counted = Counted(None, 300)
    monkeypatch.setattr(python, "take_step", lambda *a: counted._counted(take_step, a))


ENGINES = {"kernel": (KernelSimulation, interrupt_kernel), "python": (Simulation, interrupt_python)}


@pytest.mark.parametrize("name", ENGINES)
def test_an_interrupted_advance_leaves_the_simulation_unchanged(name, monkeypatch):
    engine, interrupt = ENGINES[name]
    interrupted, expected = (engine(mechanism("PRBDM2R")) for _ in range(2))
    interrupted.record = []
    for sim in (interrupted, expected):
        sim.advance(0.03)
        sim.set({"stop.velocity": 0.1})
    with monkeypatch.context() as patch:
        interrupt(interrupted, patch)
        with pytest.raises(InterruptError):
            interrupted.advance(1.0)
    assert (interrupted.time, interrupted.record) == (0.03, [])
    for sim in (interrupted, expected):
        sim.advance(0.1)
    assert interrupted.state().tobytes() == expected.state().tobytes()
    assert len(interrupted.record) == 1


@pytest.mark.parametrize("calls", [0, 1, 2, 5, 6])
@pytest.mark.parametrize("rows", [10, 1000])
def test_interrupted_samples_keep_the_impacts_of_the_times_before(calls, rows):
    times = np.linspace(0.0, 1.0, rows + 1)[1:]
    sampled, expected = (KernelSimulation(mechanism("PRBDM2R")) for _ in range(2))
    sampled.record, expected.record = [], []
    sampled._library = Counted(sampled._library, calls)
    with pytest.raises(InterruptError):
        sampled.sample(times, ["shuttle.x"])
    assert sampled.time in (0.0, *times)
    for t in times[times <= sampled.time]:
        expected.advance(t)
    assert sampled.state().tobytes() == expected.state().tobytes()
    assert [impact.time for impact in sampled.record] == [impact.time for impact in expected.record]
    left = times[times > sampled.time]
    np.testing.assert_array_equal(
        sampled.sample(left, ["shuttle.x"]), expected.sample(left, ["shuttle.x"])
    )


@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize("name", ["PRBDM2R", "FoldedSuspension"])
def test_steps_in_parts_have_the_same_bits_as_whole_steps(name, driven):
    guide = mechanism(name)
    in_parts, whole = KernelSimulation(guide), WholeSteps(guide)
    in_parts._library = Counted(in_parts._library)
    for t in (0.05, 0.3, 0.6):
        if driven:
            for sim in (in_parts, whole):
                sim.set({f"{guide.stops[0].name}.velocity": 0.01 * t})
        whole.advance(t)
        in_parts.advance(t)
        assert in_parts.snapshot()["numbers"] == whole.state.tolist()
    assert in_parts._library.unfinished > 1


@pytest.mark.slow
def test_a_failure_of_memory_for_the_record_changes_nothing(tmp_path, monkeypatch):
    sources = kernel()
    for old, new in [
        (b"room > INT_MAX / 2", b"room > 0"),
        (b"FIRST_ROWS = 16", b"FIRST_ROWS = 3"),
    ]:
        assert sources["engine.c"].count(old) == 1
        sources["engine.c"] = sources["engine.c"].replace(old, new)
    product = replace(ENGINE, flags=(*ENGINE.flags, "-O0"))
    job = Job(this_platform(), next(_host_compilers()), product, sources)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    changed = _loaded(compiled(job), this_platform().suffix)
    monkeypatch.setattr(module, "library", lambda: changed)
    sim, expected = (KernelSimulation(replace(mechanism("PRBDM"))) for _ in range(2))
    sim.record = []
    for one in (sim, expected):
        one.advance(0.05)
    count = len(sim.record)
    with pytest.raises(
        SimulationError, match="not enough memory to record the impacts up to t = 9 s"
    ):
        sim.advance(9.0)
    assert (sim.time, len(sim.record)) == (0.05, count)
    sim.record = None
    with pytest.raises(SimulationError, match="not enough memory to record the events up to t ="):
        sim.sample([9.0], ["shuttle.x"], rows := [])
    assert (sim.time, rows) == (0.05, [])
    for one in (sim, expected):
        one.advance(0.08)
    assert sim.state().tobytes() == expected.state().tobytes()
