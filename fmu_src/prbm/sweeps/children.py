"""Processes that run the simulations of a study, one for each thread of an executor.

A simulation may crash or hang, so it runs in a process of its own.  A crash costs only its run, its
signal can be reported, and the executor survives.  The threads of ``concurrent.futures`` and the
workers of Dask call the same function, :func:`run_row`.
"""

import contextlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import traceback
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass, field
from typing import Any, BinaryIO

from ..base.threads import THREAD_LIMITS
from .outputs import CRASHED, TIMEOUT, Outcome, Output

EXIT_TIMEOUT = 5.0  # Longest wait for the exit of a process before it is killed [s].
OPENING_TIMEOUT = 120.0  # Longest wait for a process to open its simulation, with a timeout [s].
STOPPED = "the study was stopped"
COMMAND = "from prbm.sweeps.children import main; main()"
Row = Mapping[str, float]


class Unusable(Exception):
    """The simulation cannot run here with any parameters; the message gives the reason."""


@dataclass(frozen=True)
class Job:
    """A simulation that can be sent to other machines.

    Parameters
    ----------
    start, stop, step : float
        Start time, stop time and time between samples [s].
    tolerance : float or None
        Relative tolerance; None: that of the mechanism, or not passed to the FMU.
    values : mapping
        Parameters and inputs of all runs, in SI or the units of the FMU.
    outputs : tuple of Output
        The outputs.
    inputs : mapping
        Inputs over time of all runs.  Names in braces in their texts are columns of the table.
    """

    start: float
    stop: float
    step: float
    tolerance: float | None
    values: Mapping[str, float]
    outputs: tuple[Output, ...]
    inputs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def threads(self) -> float:
        """The number of threads of one process that may call ``run`` at a time: none."""
        return 0

    def run(self, row: Row) -> Outcome:
        """Simulate once in this process."""
        raise NotImplementedError

    def placed(self) -> AbstractContextManager["Job"]:
        """Return a context in which the processes of this machine can open the given job."""
        return nullcontext(self)

    def opened(self) -> Callable[[Row], Outcome]:
        """Return the function that simulates, in a process of its own."""
        return self.run

    @property
    def settings(self) -> dict[str, Any]:
        """Times and tolerance, for the journal."""
        return {
            "stop time [s]": self.stop, "step [s]": self.step, "tolerance": self.tolerance,
        }  # fmt: skip

    def driven(self, row: Row) -> tuple[dict[str, float], dict[str, Any]]:
        """Return the values and the inputs of a run; columns in braces are in the inputs."""
        if not self.inputs:
            return {**self.values, **row}, {}
        from ..runs.inputs import filled, placeholders  # imported here: few runs of FMUs need it

        within = placeholders(self.inputs)
        others = {name: x for name, x in row.items() if name not in within}
        return {**self.values, **others}, filled(self.inputs, row)


# --- the process --------------------------------------------------------------------------------


def main() -> None:
    """Run the rows read from standard input and write the outcome of each; then end at once.

    An FMU may hang when its library is unloaded, and another thread waits for more rows.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # Output of an FMU must not mix with the replies.
    received: queue.Queue[Any] = queue.Queue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, received), daemon=True).start()
    try:
        try:
            run = received.get().opened()
        except Exception as error:
            _send(replies, f"{error}" or type(error).__name__)
            raise
        _send(replies, "")
        spent = False
        while not spent:
            outcome = run(received.get())
            _send(replies, outcome)
            spent = outcome.spent
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(1)


def _read(stream: BinaryIO, received: "queue.Queue[Any]") -> None:
    """Queue the rows; end this process at once when its parent ends, even during a run."""
    try:
        while True:
            received.put(pickle.load(stream))
    except (EOFError, OSError, pickle.UnpicklingError):
        os._exit(0)


def _send(stream: BinaryIO, message: object) -> None:
    pickle.dump(message, stream)
    stream.flush()


class Child:
    """A process that opens a simulation and runs it."""

    def __init__(self) -> None:
        paths = os.pathsep.join(path for path in sys.path if path)
        limits = {name: "1" for name in THREAD_LIMITS if name not in os.environ}
        self.stderr = tempfile.TemporaryFile()  # noqa: SIM115  # Closed by close().
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", COMMAND],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.stderr,
            env={**os.environ, **limits, "PYTHONPATH": paths},
            start_new_session=True,  # Ctrl-C must reach only the process of the study.
        )
        self.late = False

    def open(self, job: Job, timeout: float | None) -> None:
        """Open the simulation.

        Raises
        ------
        Unusable
            If the simulation cannot be opened, or not within the timeout [s].
        """
        self.send(job)
        error = self.receive(timeout)
        if error != "":
            end = self.close()
            reason = f"the process of the simulation ended at its start: {end}"
            if self.late:
                reason = f"it was not ready after {timeout:g} s"
            raise Unusable(error or reason)

    def send(self, message: object) -> None:
        """Send a message to the process."""
        with contextlib.suppress(OSError):  # receive() reports that the process has ended.
            _send(self.process.stdin, message)  # type: ignore[arg-type]

    def receive(self, timeout: float | None) -> Any:
        """Return a reply; None if the process ended or was killed after ``timeout`` [s]."""
        timer = threading.Timer(min(timeout or 0.0, threading.TIMEOUT_MAX), self._time_out)
        if timeout is not None:
            timer.start()
        try:
            return pickle.load(self.process.stdout)  # type: ignore[arg-type]
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            return None
        finally:
            timer.cancel()
            if timeout is not None:
                timer.join()  # It may be about to kill the process.

    def _time_out(self) -> None:
        self.late = True
        self.process.kill()

    def close(self) -> str:
        """End the process; return its exit status and the last line of its standard error."""
        with contextlib.suppress(OSError):
            self.process.stdin.close()  # type: ignore[union-attr]
        try:
            code = self.process.wait(EXIT_TIMEOUT)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        self.process.stdout.close()  # type: ignore[union-attr]
        self.stderr.seek(0)
        lines = self.stderr.read().decode(errors="replace").strip().splitlines()
        self.stderr.close()
        names = {-known: known.name for known in signal.Signals}
        end = f"killed by {names.get(code, f'signal {-code}')}" if code < 0 else f"exit code {code}"
        return end + (f" ({lines[-1].strip()})" if lines else "")


# --- the processes of this machine --------------------------------------------------------------


class Processes:
    """The processes that run a job on this machine, at most one per thread.

    A run whose process crashes is repeated ``retries`` times; it may take ``timeout`` [s], if that
    is not None.  Any exception means that the simulation cannot be made ready here.
    """

    def __init__(self, job: Job, retries: int, timeout: float | None) -> None:
        self.retries, self.timeout = retries, timeout
        self.idle, self.busy = list[Child](), set[Child]()
        self.lock, self.stack, self.closed = threading.Lock(), ExitStack(), False
        self.job = self.stack.enter_context(job.placed())

    def run(self, row: Row) -> Outcome:
        """Simulate once.

        Raises
        ------
        Unusable
            If the simulation cannot be opened, or the study was stopped.
        """
        for _ in range(self.retries + 1):
            child = self._child()
            child.send(row)
            outcome: Outcome | None = child.receive(self.timeout)
            with self.lock:
                self.busy.discard(child)
                if outcome is not None and not (outcome.spent or child.late or self.closed):
                    self.idle.append(child)
                    return outcome
            end = child.close()
            if self.closed:
                raise Unusable(STOPPED)
            if outcome is not None:
                return outcome
            if child.late:
                return Outcome(TIMEOUT, f"not finished after {self.timeout:g} s")
        times = f", in each of {self.retries + 1} attempts" if self.retries else ""
        return Outcome(CRASHED, f"the process of the simulation crashed: {end}{times}")

    def _child(self) -> Child:
        """Return an idle process, or a new one, which is busy from now on."""
        with self.lock:
            child = self.idle.pop() if self.idle else None
        if child is not None and child.process.poll() is not None:
            child.close()  # It was killed while it had no work.
            child = None
        new, child = child is None, child or Child()
        with self.lock:
            self.busy.add(child)  # close() ends it from now on.
        try:
            if new and not self.closed:
                limit = None if self.timeout is None else max(self.timeout, OPENING_TIMEOUT)
                child.open(self.job, limit)
        except Unusable:
            with self.lock:
                self.busy.discard(child)
                if not self.closed:
                    raise
            raise Unusable(STOPPED) from None
        if self.closed:
            child.close()
            raise Unusable(STOPPED)
        child.stderr.seek(0)  # For the process, too.
        child.stderr.truncate()
        return child

    def close(self) -> None:
        """Kill all processes, even during a run, and remove the job from this machine."""
        with self.lock:
            self.closed, busy, idle = True, [*self.busy], [*self.idle]
            self.idle.clear()
        for child in busy + idle:
            child.process.kill()
        for child in idle:  # The threads that wait for the other ones close them.
            child.close()
        self.stack.close()


_processes: dict[str, Processes] = {}  # By the name of the study.
_lock = threading.Lock()


def run_row(study: str, row: Row, given: tuple[Any, ...] | None) -> Outcome | None:
    """Simulate once, in a thread of an executor; return None if the machine needs ``given``.

    ``study`` is a name that is unique among all machines.  ``given`` are the arguments of
    :class:`Processes`, which are sent to a machine only once.

    Raises
    ------
    Unusable
        If the simulation cannot run here, or the study was stopped.
    """
    with _lock:
        if study not in _processes:
            if given is None:
                return None
            try:
                _processes[study] = Processes(*given)
            except Exception as error:  # FMPy raises plain exceptions.
                raise Unusable(f"a worker cannot unpack the FMU ({error})") from None
        processes = _processes[study]
    return processes.run(row)


def release(study: str) -> None:
    """End the processes of a study on this machine."""
    with _lock:
        found = _processes.pop(study, None)
    if found is not None:
        found.close()
