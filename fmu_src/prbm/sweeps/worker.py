"""The part of a sweep that runs on a Dask worker: processes, one per thread, that run the FMU.

An FMU may crash or hang, so it runs in separate processes.  A crash costs only its run, its signal
can be reported, and the worker survives.  A plugin sends the FMU once to every worker, including
workers that join later.
"""

import contextlib
import io
import math
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from distributed import WorkerPlugin, get_worker

from ..fmu.unpack import unpacked
from .outputs import CRASHED, TIMEOUT, Outcome
from .runs import Job

EXIT_TIMEOUT = 5.0  # Longest wait for the exit of a process before it is killed [s].
STOPPED = "the sweep was stopped"
COMMAND = "from prbm.sweeps.runs import main; main()"


class Unusable(Exception):
    """The FMU cannot run on this worker with any parameters; the message gives the reason."""


class Child:
    """A process that runs the FMU.

    Parameters
    ----------
    folder : Path
        The unpacked FMU.
    job : Job
        Settings of the runs.

    Raises
    ------
    Unusable
        If the FMU cannot be loaded or instantiated.
    """

    def __init__(self, folder: Path, job: Job) -> None:
        paths = os.pathsep.join(path for path in sys.path if path)
        self.stderr = (folder / f"stderr-{os.urandom(4).hex()}").open("ab+")
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", COMMAND],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.stderr,
            env={**os.environ, "PYTHONPATH": paths},
            start_new_session=True,  # Ctrl-C must reach only the process of the sweep.
        )
        self.late = False
        self.send((folder, job))
        error = self.receive(None)
        if error != "":
            end = self.close()
            raise Unusable(error or f"the process of the FMU ended at its start: {end}")

    def send(self, message: object) -> None:
        """Send a message to the process."""
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):  # receive() reports that the process has ended.
            pickle.dump(message, self.process.stdin)
            self.process.stdin.flush()

    def receive(self, timeout: float | None) -> Any:
        """Return a reply; None if the process ended or was killed after ``timeout`` [s]."""
        timer = threading.Timer(timeout, self._time_out) if timeout is not None else None
        if timer:
            timer.start()
        try:
            return pickle.load(self.process.stdout)  # type: ignore[arg-type]
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            return None
        finally:
            if timer:
                timer.cancel()

    def _time_out(self) -> None:
        self.late = True
        self.process.kill()

    @property
    def alive(self) -> bool:
        """Whether the process is running."""
        return self.process.poll() is None

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
        return ending(code) + (f" ({lines[-1].strip()})" if lines else "")


def ending(code: int) -> str:
    """Return the text of an exit code.

    Examples
    --------
    >>> ending(-11), ending(3)
    ('killed by SIGSEGV', 'exit code 3')
    """
    if code >= 0:
        return f"exit code {code}"
    try:
        return f"killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"killed by signal {-code}"


class Processes:
    """The processes of a worker, at most one per thread.

    Parameters
    ----------
    fmu : bytes
        The FMU.
    job : Job
        Settings of the runs.
    retries : int
        Number of repetitions of a run whose process crashed.
    timeout : float or None
        Longest duration of a run [s]; None: no limit.
    """

    def __init__(self, fmu: bytes, job: Job, retries: int, timeout: float | None) -> None:
        self.job, self.retries, self.timeout = job, retries, timeout
        self.idle, self.all = list[Child](), set[Child]()
        self.lock, self.stack, self.closed = threading.Lock(), ExitStack(), False
        self.folder = self.stack.enter_context(unpacked(io.BytesIO(fmu)))

    def run(self, rows: Sequence[Mapping[str, float]]) -> list[Outcome]:
        """Run the FMU once for each mapping of start values.

        Raises
        ------
        Unusable
            If the FMU cannot be loaded, or the sweep was stopped.
        """
        outcomes: list[Outcome] = []
        attempts = 0
        while len(outcomes) < len(rows):
            child = self._child()
            child.send(rows[len(outcomes) :])
            spent = False
            while not spent and len(outcomes) < len(rows):
                outcome = child.receive(self.timeout)
                if outcome is None:
                    break
                outcomes.append(outcome)
                attempts, spent = 0, outcome.spent
            if len(outcomes) == len(rows) and not spent:
                self._keep(child)
                break
            late, end = child.late, self._drop(child)
            limit = self.timeout or math.inf
            if self.closed:
                raise Unusable(STOPPED)
            if spent:
                continue
            attempts += 1
            if late:
                outcomes.append(Outcome(TIMEOUT, f"not finished after {limit:g} s", limit))
                attempts = 0
            elif attempts > self.retries:
                times = f", in each of {attempts} attempts" if attempts > 1 else ""
                outcomes.append(Outcome(CRASHED, f"the process of the FMU crashed: {end}{times}"))
                attempts = 0
        return outcomes

    def _child(self) -> Child:
        """Return an idle process, or a new one."""
        with self.lock:
            if self.closed:
                raise Unusable(STOPPED)
            child = self.idle.pop() if self.idle else None
        if child is not None and child.alive:
            child.stderr.truncate(0)
            return child
        if child is not None:  # It ended itself after IDLE_MAX without work.
            self._drop(child)
        child = Child(self.folder, self.job)
        with self.lock:
            self.all.add(child)
        if self.closed:
            self._drop(child)
            raise Unusable(STOPPED)
        return child

    def _keep(self, child: Child) -> None:
        """Keep a process for further runs, unless the sweep was stopped."""
        with self.lock:
            if not self.closed:
                self.idle.append(child)
                return
        self._drop(child)

    def _drop(self, child: Child) -> str:
        """End a process; return the text of :meth:`Child.close`."""
        with self.lock:
            self.all.discard(child)
        return child.close()

    def close(self) -> None:
        """Kill all processes, even during a run, and delete the unpacked FMU."""
        with self.lock:
            self.closed, children = True, list(self.all)
            idle, self.idle = self.idle, []
        for child in children:
            child.process.kill()
        for child in idle:  # The other processes are closed by the threads that wait for them.
            child.close()
        self.stack.close()


class FmuPlugin(WorkerPlugin):
    """Installs the FMU on a worker and removes it at the end."""

    def __init__(self, fmu: bytes, job: Job, retries: int, timeout: float | None) -> None:
        self.arguments = fmu, job, retries, timeout
        self.processes: Processes | None = None
        self.failure = ""

    def setup(self, worker: Any) -> None:
        """Unpack the FMU; keep the reason of a failure for :meth:`run`."""
        try:
            self.processes = Processes(*self.arguments)
        except Exception as error:  # FMPy raises plain exceptions.
            self.failure = f"{error or type(error).__name__}"

    def run(self, rows: Sequence[Mapping[str, float]]) -> list[Outcome]:
        """Run the FMU once for each mapping of start values.

        Raises
        ------
        Unusable
            If the FMU cannot be unpacked or loaded, or the sweep was stopped.
        """
        if self.processes is None:
            raise Unusable(f"a worker cannot unpack the FMU ({self.failure})")
        return self.processes.run(rows)

    def teardown(self, worker: Any) -> None:
        """End the processes and remove the FMU."""
        if self.processes is not None:
            self.processes.close()


def run_batch(plugin: str, rows: Sequence[Mapping[str, float]]) -> list[Outcome]:
    """Run the FMU on this worker once for each row."""
    installed: Any = get_worker().plugins[plugin]
    return installed.run(rows)  # type: ignore[no-any-return]
