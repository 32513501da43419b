"""The runner of studies in threads of one process."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from prbm.sweeps import children
from prbm.sweeps.children import STOPPED, Child, Processes, Unusable
from prbm.sweeps.journal import Journal
from prbm.sweeps.outputs import OK, Outcome
from prbm.sweeps.runner import Runner
from prbm.sweeps.study import study
from talking import Hanging, Talking


class Endless:
    """A simulation that ends for the parameter 0 only."""

    threads = 2

    def run(self, row):
        while row["a"]:
            time.sleep(1e-3)
        return Outcome(OK, values=(0.0,))


def test_an_error_ends_simulations_in_threads():
    """As Ctrl-C does; completed rows are kept."""
    journal, threads = Journal(None, {}, ["a"], ["f"]), threading.active_count()

    def stop(fraction):
        if fraction > 0.0:
            raise InterruptedError

    def compute():
        with Runner(Endless(), ["a"], journal, 2, workers=2) as runner:
            assert runner.here
            runner.outcomes([(0.0,), (1.0,)], stop)

    with pytest.raises(InterruptedError):
        compute()
    assert threading.active_count() == threads
    assert [*journal.known] == [(0.0,)]


@pytest.fixture
def processes():
    found = Processes(Talking(0.0, 1.0, 0.1, None, {}, ()), 0, 1e12)
    yield found
    found.close()


@pytest.mark.slow
def test_the_message_of_a_crash_has_the_last_line_of_its_run_alone(processes):
    assert processes.run({"a": 0.0}).status == OK
    assert processes.run({"a": 1.0}).message.endswith("exit code 3 (the reason)")


@pytest.mark.slow
def test_a_process_that_is_late_is_not_used_again(processes, monkeypatch):
    receive = Child.receive

    def late(child, timeout):
        outcome = receive(child, timeout)
        child._time_out()
        return outcome

    assert processes.run({"a": 0.0}).status == OK
    assert len(processes.idle) == 1
    monkeypatch.setattr(Child, "receive", late)
    assert processes.run({"a": 0.0}).status == OK
    assert not processes.idle


@pytest.mark.slow
def test_a_simulation_that_hangs_while_it_is_opened_ends_the_study(monkeypatch):
    """A short timeout of the runs does not limit the start of a process."""
    monkeypatch.setattr(children, "OPENING_TIMEOUT", 1.0)
    processes = Processes(Hanging(0.0, 1.0, 0.1, None, {}, ()), 0, 1e-3)
    with pytest.raises(Unusable, match="it was not ready after 1 s"):
        processes.run({"a": 0.0})
    assert not processes.busy
    processes.close()


@pytest.mark.slow
def test_a_study_can_be_stopped_while_its_simulation_is_opened():
    processes, found = Processes(Hanging(0.0, 1.0, 0.1, None, {}, ()), 0, None), []

    def run():
        try:
            processes.run({"a": 0.0})
        except Unusable as error:
            found.append(str(error))

    thread = threading.Thread(target=run)
    thread.start()
    while not processes.busy:
        time.sleep(1e-2)
    processes.close()
    thread.join(20.0)
    assert found == [STOPPED]


def test_threads_give_the_same_bits(mechanisms):
    found = [
        study(
            mechanisms["PRBDM"], {"stop.position": [-1e-3, 0.0, 1e-3]}, ["impacts", "shuttle.vx"],
            stop_time=0.1, step=1e-3, workers=workers,
        ).table()
        for workers in (1, 2)
    ]  # fmt: skip
    assert found[0] == found[1]
    assert found[0][1][0][1] > 0


@pytest.mark.slow
def test_an_executor_has_as_many_simulations_at_a_time_as_workers(mechanisms):
    """Its own number of threads is larger."""
    pending, most = set(), []

    class Counting(ThreadPoolExecutor):
        def submit(self, *arguments):
            future = super().submit(*arguments)
            pending.add(future)
            future.add_done_callback(pending.discard)
            most.append(len(pending))
            return future

    with Counting(4) as executor:
        found = study(
            mechanisms["PRBDM"], {"stop.position": [0.0, 1e-3, 2e-3, 3e-3]}, ["impacts"],
            stop_time=0.01, step=1e-3, workers=2, executor=executor,
        )  # fmt: skip
    assert not any(found.messages)
    assert max(most) == 2
