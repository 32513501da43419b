"""What a Dask worker does for a sweep: it keeps processes, one a thread, that run the FMU.

An FMU may crash or hang.  So it runs in processes of its own: one that dies costs the run that it
was at, its signal is known, and the worker stays.  The FMU comes to every worker once, also to
those that join late, as a plugin.
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
from .runs import CRASHED, TIMEOUT, Job, Outcome

PATIENCE = 5.0  # s for a process to end that has been told to
STOPPED = "the sweep was stopped"
COMMAND = "from prbm.sweeps.runs import main; main()"


class Unusable(Exception):
    """The FMU cannot be run here, whatever its parameters; the message says why."""


class Child:
    """A process that runs the FMU.

    Raises
    ------
    Unusable
        If it does not get as far as an instance.
    """

    def __init__(self, folder: Path, job: Job) -> None:
        paths = os.pathsep.join(path for path in sys.path if path)
        self.said = (folder / f"said-{os.urandom(4).hex()}").open("ab+")
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", COMMAND],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.said,
            env={**os.environ, "PYTHONPATH": paths},
            start_new_session=True,  # Ctrl-C is for the one who asked for the sweep
        )
        self.late = False
        self.send((folder, job))
        complaint = self.receive(None)
        if complaint != "":
            end = self.close()
            raise Unusable(complaint or f"the process of the FMU ended at once: {end}")

    def send(self, what: object) -> None:
        """Tell it something."""
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):  # a process that is no more is found out by receive
            pickle.dump(what, self.process.stdin)
            self.process.stdin.flush()

    def receive(self, timeout: float | None) -> Any:
        """Return what it answers; None if it ended, or was ended after so many seconds."""
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
        """Whether it may be asked for more."""
        return self.process.poll() is None

    def close(self) -> str:
        """End it; return how it ended, with the last line that it wrote."""
        with contextlib.suppress(OSError):
            self.process.stdin.close()  # type: ignore[union-attr]
        try:
            code = self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        self.process.stdout.close()  # type: ignore[union-attr]
        self.said.seek(0)
        lines = self.said.read().decode(errors="replace").strip().splitlines()
        self.said.close()
        return ending(code) + (f" ({lines[-1].strip()})" if lines else "")


def ending(code: int) -> str:
    """Return how a process ended, from its exit code.

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
    """The processes of a worker: as many as its threads ask for at a time.

    Parameters
    ----------
    fmu : bytes
        The FMU.
    job : Job
        What all runs have in common.
    retries : int
        How often a run whose process died is tried again.
    timeout : float or None
        After how long a run is given up [s].
    """

    def __init__(self, fmu: bytes, job: Job, retries: int, timeout: float | None) -> None:
        self.job, self.retries, self.timeout = job, retries, timeout
        self.idle, self.all = list[Child](), set[Child]()
        self.lock, self.stack, self.closed = threading.Lock(), ExitStack(), False
        self.folder = self.stack.enter_context(unpacked(io.BytesIO(fmu)))

    def run(self, rows: Sequence[Mapping[str, float]]) -> list[Outcome]:
        """Run the FMU with each of some sets of values.

        Raises
        ------
        Unusable
            If the FMU cannot be loaded, or no more runs are wanted.
        """
        outcomes: list[Outcome] = []
        attempts = 0
        while len(outcomes) < len(rows):
            child = self._child()
            child.send(rows[len(outcomes) :])
            spent = False
            while not spent and len(outcomes) < len(rows):
                answer = child.receive(self.timeout)
                if answer is None:
                    break
                outcomes.append(answer)
                attempts, spent = 0, answer.spent
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
                outcomes.append(Outcome(TIMEOUT, f"not done after {limit:g} s", limit))
                attempts = 0
            elif attempts > self.retries:
                times = f", {attempts} times out of {attempts}" if attempts > 1 else ""
                outcomes.append(Outcome(CRASHED, f"the process of the FMU died: {end}{times}"))
                attempts = 0
        return outcomes

    def _child(self) -> Child:
        """Return a process that is idle, or a new one."""
        with self.lock:
            if self.closed:
                raise Unusable(STOPPED)
            child = self.idle.pop() if self.idle else None
        if child is not None and child.alive:
            child.said.truncate(0)
            return child
        if child is not None:  # it waited too long for work
            self._drop(child)
        child = Child(self.folder, self.job)
        with self.lock:
            self.all.add(child)
        if self.closed:
            self._drop(child)
            raise Unusable(STOPPED)
        return child

    def _keep(self, child: Child) -> None:
        with self.lock:
            if not self.closed:
                self.idle.append(child)
                return
        self._drop(child)

    def _drop(self, child: Child) -> str:
        with self.lock:
            self.all.discard(child)
        return child.close()

    def close(self) -> None:
        """End all processes, also in the middle of a run, and remove what was unpacked."""
        with self.lock:
            self.closed, children = True, list(self.all)
            idle, self.idle = self.idle, []
        for child in children:
            child.process.kill()
        for child in idle:  # the thread that waits for another one closes that
            child.close()
        self.stack.close()


class FmuPlugin(WorkerPlugin):
    """Brings the FMU to a worker, and takes it away."""

    def __init__(self, fmu: bytes, job: Job, retries: int, timeout: float | None) -> None:
        self.arguments = fmu, job, retries, timeout

    def setup(self, worker: Any) -> None:
        """Unpack the FMU."""
        self.processes = Processes(*self.arguments)

    def teardown(self, worker: Any) -> None:
        """End the processes and remove the FMU."""
        self.processes.close()


def run_batch(plugin: str, rows: Sequence[Mapping[str, float]]) -> list[Outcome]:
    """Run some rows on this worker."""
    installed: Any = get_worker().plugins[plugin]
    return installed.processes.run(rows)  # type: ignore[no-any-return]
