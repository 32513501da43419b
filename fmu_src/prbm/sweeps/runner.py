"""The runner of studies: rows of parameters, a simulation and an executor give rows of outcomes.

The rows run in the threads of a ``concurrent.futures`` executor, or on the workers of a Dask
cluster through ``Client.get_executor()``.  The threads simulate themselves if the simulation lets
others work meanwhile, as the kernel does; few short runs then need not wait for the start of
processes.  Otherwise other processes work for them (:mod:`.children`).  Each completed row is in
the journal, so that an interrupted study continues from there.
"""

import ctypes
import math
import queue
import threading
import time
import uuid
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from typing import Any, Self

from ..base.counts import check_count
from ..base.errors import ParameterError, PrbmError
from ..base.processes import process_count
from ..base.progress import Progress
from ..files.settings import in_unit
from .children import Job, Row, Unusable, release, run_row
from .journal import Journal, Point
from .outputs import CRASHED, Outcome

ROWS_PER_THREAD = 2  # Rows submitted per thread, so that no thread waits for work.
ASKING_INTERVAL = 1.0  # Time after which a cluster is asked again for its threads [s].
CONNECTION_TIMEOUT = 10.0  # Longest wait for a scheduler and its workers [s].
MISSING_MODULE = "No module named"  # Python's message for a package that is not installed.


class StudyError(PrbmError, RuntimeError):
    """The study cannot run, for a reason that does not depend on its parameters."""


class Stopped(BaseException):
    """Raised in a thread that simulates when the study ends before the simulation."""


@contextmanager
def _client(address: str) -> Iterator[Any]:
    """Yield a client of the Dask scheduler at an address."""
    from distributed import Client  # imported here: an extra

    try:
        client = Client(  # type: ignore[no-untyped-call]
            address, timeout=CONNECTION_TIMEOUT, set_as_default=False
        )
    except (TimeoutError, OSError, ValueError) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise StudyError(
            f"no scheduler responds at {address} ({reason}); start one with: dask scheduler"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=CONNECTION_TIMEOUT)
        except (TimeoutError, OSError):
            raise StudyError(
                f"the scheduler at {address} has no workers; start one with: dask worker {address}"
            ) from None
        yield client


class Runner:
    """Computes rows and keeps their outcomes in a journal.

    It is used in a ``with`` block, at whose end the processes of the study end.  A
    KeyboardInterrupt then has a message about the completed rows.  The expected number of ``runs``
    limits that of the workers.  With a timeout, other processes simulate.

    Raises
    ------
    ParameterError
        If workers or timeout are not positive, retries negative, or the executor is not one.
    StudyError
        If the scheduler does not respond or has no workers.
    """

    def __init__(
        self,
        job: Job,
        parameters: Sequence[str],
        journal: Journal,
        runs: int,
        *,
        workers: int | None = None,
        executor: Executor | str | None = None,
        retries: int = 1,
        timeout: float | str | None = None,
    ) -> None:
        workers = None if workers is None else check_count("workers", workers, 1)
        retries = check_count("retries", retries, 0)
        timeout = None if timeout is None else in_unit("timeout", timeout, "s")
        if timeout is not None and not 0.0 < timeout < math.inf:
            raise ParameterError(f"timeout = {timeout:g} s must be positive and finite")
        self.job, self.parameters, self.journal = job, parameters, journal
        self.retries, self.timeout = retries, timeout
        self.study, self.stack, self.stopped = uuid.uuid4().hex, ExitStack(), False
        self.count = process_count(max(runs, 1), workers)  # Of parallel runs.
        self.here = executor is None and timeout is None and self.count <= job.threads
        self.ahead = ROWS_PER_THREAD if executor is None or workers is None else 1
        self.executor: Executor
        if executor is None:
            self.executor = ThreadPoolExecutor(self.count)
            self.stack.callback(self.executor.shutdown, cancel_futures=True)
        elif isinstance(executor, str):
            client = self.stack.enter_context(_client(executor))
            self.executor = client.get_executor(pure=False)
        elif not isinstance(executor, Executor):
            raise ParameterError(
                f"executor = {executor!r} must be an executor of concurrent.futures, or the "
                "address of a Dask scheduler"
            )
        else:
            self.executor = executor
            self.count = workers or getattr(executor, "_max_workers", None) or self.count
        self.client: Any = getattr(self.executor, "_client", None)  # Of Dask's ClientExecutor.
        self.elastic, self.asked = self.client is not None and workers is None, -math.inf
        self.busy: set[int] = set()  # Threads that simulate.
        self.running, self.done = dict[Future[Any], Point](), queue.SimpleQueue[Future[Any]]()
        self.crashes = Counter[Point]()  # Crashes of workers that ran a point.
        self.suspects: deque[Point] = deque()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.stopped = True
        for thread in [*self.busy]:  # After an error or Ctrl-C.
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(thread), ctypes.py_object(Stopped)
            )
        with suppress(OSError, CancelledError):  # The scheduler may have ended.
            release(self.study) if self.client is None else self.client.run(release, self.study)
        self.stack.close()
        if kind is KeyboardInterrupt and self.journal.kept:
            raise KeyboardInterrupt(f"interrupted; {self.journal.kept}") from None

    def outcomes(self, points: Sequence[Point], progress: Progress | None = None) -> list[Outcome]:
        """Return the outcomes of points in their order; only those not in the journal are computed.

        Raises
        ------
        StudyError
            If the simulation cannot run with any parameters, or the cluster has ended.
        """
        known = self.journal.known
        rest = [point for point in dict.fromkeys(points) if point not in known]
        done, total = len(points) - len(rest), max(len(points), 1)
        report = progress or (lambda fraction: None)
        report(done / total)
        for k, (point, outcome) in enumerate(self._computed(deque(rest)), done + 1):
            self.journal.add(point, outcome)
            report(k / total)
        return [known[point] for point in points]

    def threads(self) -> int:
        """Return the present number of parallel runs."""
        if self.elastic and time.monotonic() > self.asked + ASKING_INTERVAL:
            self.asked = time.monotonic()
            self.count = max(1, sum(self.client.nthreads().values()))
        return self.count

    def _computed(self, rest: deque[Point]) -> Iterator[tuple[Point, Outcome]]:
        """Yield points with their outcomes as they come."""
        while rest or self.suspects or self.running:
            while rest and len(self.running) < self.ahead * self.threads():
                self._send(rest.popleft())
            if not self.running:
                self._send(self.suspects.popleft())
            try:
                future = self.done.get(timeout=ASKING_INTERVAL)
            except queue.Empty:
                continue
            point = self.running.pop(future)
            outcome = self._outcome(future, point)
            if outcome is not None:
                yield point, outcome

    def _send(self, point: Point, given: bool = False) -> None:
        row: Row = dict(zip(self.parameters, point, strict=True))
        if self.here:
            future = self.executor.submit(self._run_here, row)
        else:
            job = (self.job, self.retries, self.timeout) if given else None
            future = self.executor.submit(run_row, self.study, row, job)
        self.running[future] = point
        future.add_done_callback(self.done.put)

    def _run_here(self, row: Row) -> Outcome | None:
        """Simulate in this thread, until the study ends."""
        thread = threading.get_ident()
        self.busy.add(thread)
        try:
            return None if self.stopped else self.job.run(row)
        except Stopped:
            return None
        finally:
            self.busy.discard(thread)

    def _outcome(self, future: "Future[Any]", point: Point) -> Outcome | None:
        """Return the outcome of a point; None if it has to be repeated."""
        try:
            outcome: Outcome | None = future.result()
        except Unusable as error:
            raise StudyError(f"the simulation cannot run: {error}") from None
        except CancelledError:
            raise StudyError(f"the cluster has ended; {self.journal.kept}") from None
        except BrokenExecutor:
            kept = self.journal.kept
            raise StudyError(f"a process of the executor has ended early; {kept}") from None
        except Exception as error:
            if type(error).__name__ == "KilledWorker":  # Of Dask, which may not be installed.
                return self._after_crash(point)
            if MISSING_MODULE in str(error):
                raise StudyError(
                    "a worker cannot import prbm; install it there: "
                    'python -m pip install "prbm-impact[sweep]"'
                ) from None
            raise
        if outcome is None:  # The machine needs the job.
            self._send(point, given=True)
        return outcome

    def _after_crash(self, point: Point) -> Outcome | None:
        """Return the outcome of a point whose workers crashed too often; otherwise repeat it.

        A crashed worker loses all of its points, not only the one that caused the crash.  At the
        end these points are repeated one by one, with no other one submitted, to find the cause.
        """
        self.crashes[point] += 1
        if self.crashes[point] > self.retries + 1:
            return Outcome(CRASHED, "every worker that ran this row crashed")
        self.suspects.append(point)
        return None
