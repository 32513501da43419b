"""The runner of studies: rows of parameters, a simulation and an executor give rows of outcomes.

The rows run in the threads of a ``concurrent.futures`` executor, or on the workers of a Dask
cluster through ``Client.get_executor()``.  The threads simulate themselves if the simulation lets
others work meanwhile, as the kernel does; few short runs then need not wait for the start of
processes.  Otherwise other processes work for them (:mod:`.children`).  Each completed row is in
the journal, so that an interrupted study continues from there.
"""

import ctypes
import math
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from statistics import median
from typing import Any, Self

from ..base.errors import ParameterError, PrbmError
from ..base.processes import process_count
from ..base.progress import Progress
from .children import Job, Row, Unusable, release, run_batch
from .journal import Journal, Point
from .outputs import CRASHED, Outcome

BATCH_MIN, BATCH_MAX = 1.0, 30.0  # Limits of the duration of a batch [s].
BATCH_SHARE = 0.02  # Duration of a batch, as a share of the time so far.
BATCHES_PER_THREAD = 2  # Batches submitted per thread, so that no thread waits for work.
RESET_RUNS_MIN = 20  # Runs per process from which on a check of an FMU's reset pays off.
RECENT_RUNS = 50  # Runs whose median duration determines the size of the next batch.
CONNECTION_TIMEOUT = 10.0  # Longest wait for a scheduler and its workers [s].
MISSING_MODULE = "No module named"  # Python's message for a package that is not installed.


class StudyError(PrbmError, RuntimeError):
    """The study cannot run, for a reason that does not depend on its parameters."""


class Stopped(BaseException):
    """Raised in a thread that simulates when the study ends before the simulation."""


def _check_limits(workers: int | None, timeout: float | None, retries: int) -> None:
    if workers is not None and workers < 1:
        raise ParameterError(f"workers = {workers} must be 1 or more")
    if timeout is not None and not timeout > 0.0:
        raise ParameterError(f"timeout = {timeout:g} s must be positive")
    if retries < 0:
        raise ParameterError(f"retries = {retries} must be 0 or more")


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
    KeyboardInterrupt then has a message about the completed rows.

    Parameters
    ----------
    job : Job
        The simulation.  If it has ``run``, rows may be computed in this process, where they cannot
        be ended: in this thread for one worker, in several ones if it has ``parallel``.
    parameters : sequence of str
        Names of the numbers of a point.
    journal : Journal
        The completed rows.
    runs : int
        Expected number of rows, which limits that of the workers.
    workers, executor, retries, timeout
        As for :func:`prbm.study`.  With a timeout, other processes simulate.

    Raises
    ------
    ParameterError
        If workers or timeout are not positive, or retries negative.
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
        timeout: float | None = None,
    ) -> None:
        _check_limits(workers, timeout, retries)
        self.job, self.parameters, self.journal = job, parameters, journal
        self.retries, self.timeout = retries, timeout
        self.study, self.stack, self.stopped = uuid.uuid4().hex, ExitStack(), False
        self.run: Callable[[Row], Outcome] | None = None  # If threads simulate themselves.
        self.busy: set[int] = set()  # These threads.
        self.closing: Callable[[str], object] = release
        count = process_count(max(runs, 1), workers)
        if hasattr(job, "reuse"):  # The check of a reset doubles the duration of a run.
            many = runs >= RESET_RUNS_MIN * count
            self.job = replace(job, reuse=many and timeout is None)  # type: ignore[call-arg]
        self.executor: Executor | None = None
        if isinstance(executor, str):
            self.executor = self.stack.enter_context(_client(executor)).get_executor(pure=False)
        elif executor is not None:
            self.executor = executor
            count = workers or getattr(executor, "_max_workers", None) or count
        else:
            if timeout is None and (count == 1 or getattr(job, "parallel", False)):
                self.run = getattr(job, "run", None)
            if count > 1 or self.run is None:
                self.executor = threads = ThreadPoolExecutor(count)
                self.stack.callback(threads.shutdown, cancel_futures=True)
        self.threads: Callable[[], int] = lambda: count  # The present number of parallel runs.
        client: Any = getattr(self.executor, "_client", None)  # Of Dask's ClientExecutor.
        if client is not None:
            self.closing = lambda study: client.run(release, study)
            self.threads = lambda: workers or max(1, sum(client.nthreads().values()))
        self.begin = time.monotonic()
        self.recent: deque[float] = deque(maxlen=RECENT_RUNS)
        self.running: dict[Future[Any], list[Point]] = {}
        self.crashes: dict[Point, int] = {}  # Crashes of workers that ran a point.
        self.suspects: deque[Point] = deque()

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
        for k, (point, outcome) in enumerate(self._computed(rest), done + 1):
            self.journal.add(point, outcome)
            report(k / total)
        return [known[point] for point in points]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.stopped = True
        for thread in [*self.busy]:  # After an error or Ctrl-C.
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(thread), ctypes.py_object(Stopped)
            )
        with suppress(OSError, CancelledError):  # The scheduler may have ended.
            self.closing(self.study)
        self.stack.close()
        if kind is KeyboardInterrupt and self.journal.kept:
            raise KeyboardInterrupt(f"interrupted; {self.journal.kept}") from None

    def _run_here(self, batch: Sequence[Point]) -> list[Outcome]:
        """Simulate in this thread, until the study ends."""
        assert self.run is not None
        thread = threading.get_ident()
        self.busy.add(thread)
        try:
            return [self.run(self._row(point)) for point in batch if not self.stopped]
        except Stopped:
            return []
        finally:
            self.busy.discard(thread)

    def _computed(self, points: Sequence[Point]) -> Iterator[tuple[Point, Outcome]]:
        """Yield points with their outcomes as they come."""
        if self.executor is None:
            for point in points:
                yield point, self._run_here([point])[0]
            return
        rest = deque(points)
        self._submit(rest)
        while self.running:
            for future in wait(self.running, return_when=FIRST_COMPLETED).done:
                batch = self.running.pop(future)
                outcomes = self._outcomes(future, batch)
                self.recent.extend(x.seconds for x in outcomes if x.seconds > 0.0)
                yield from zip(batch, outcomes, strict=False)
            self._submit(rest)
            if self.suspects and not self.running:
                self._send([self.suspects.popleft()])

    def _submit(self, rest: deque[Point]) -> None:
        """Submit batches until there are :data:`BATCHES_PER_THREAD` per thread.

        They are small at the start and at the end.
        """
        threads = self.threads()
        while rest and len(self.running) < BATCHES_PER_THREAD * threads:
            size = 1
            if self.recent:
                elapsed = time.monotonic() - self.begin
                seconds = min(max(BATCH_SHARE * elapsed, BATCH_MIN), BATCH_MAX)
                fair = math.ceil(len(rest) / (BATCHES_PER_THREAD * threads))
                size = max(1, min(int(seconds / median(self.recent)), fair))
            self._send([rest.popleft() for _ in range(size)])

    def _send(self, batch: list[Point], given: bool = False) -> None:
        assert self.executor is not None
        if self.run is not None:
            future = self.executor.submit(self._run_here, batch)
        else:
            job = (self.job, self.retries, self.timeout) if given else None
            future = self.executor.submit(run_batch, self.study, [*map(self._row, batch)], job)
        self.running[future] = batch

    def _row(self, point: Point) -> Row:
        return dict(zip(self.parameters, point, strict=True))

    def _outcomes(self, future: "Future[Any]", batch: list[Point]) -> list[Outcome]:
        """Return the outcomes of a batch; none if it has to be repeated."""
        try:
            outcomes: list[Outcome] | None = future.result()
        except Unusable as error:
            raise StudyError(f"the simulation cannot run: {error}") from None
        except CancelledError:
            raise StudyError(f"the cluster has ended; {self.journal.kept}") from None
        except BrokenExecutor:
            kept = self.journal.kept
            raise StudyError(f"a process of the executor has ended early; {kept}") from None
        except Exception as error:
            if type(error).__name__ == "KilledWorker":  # Of Dask, which may not be installed.
                return self._after_crash(batch)
            if MISSING_MODULE in str(error):
                raise StudyError(
                    "a worker cannot import prbm; install it there: "
                    'python -m pip install "prbm-impact[sweep]"'
                ) from None
            raise
        if outcomes is None:
            self._send(batch, given=True)
            return []
        return outcomes

    def _after_crash(self, batch: list[Point]) -> list[Outcome]:
        """Return the outcome of a point whose workers crashed too often; otherwise repeat.

        A crashed worker loses all of its points, not only the one that caused the crash.  At the
        end these points are repeated one by one, with no other batch submitted, to find the cause.
        """
        for point in batch:
            self.crashes[point] = self.crashes.get(point, -1) + 1
        if self.crashes[batch[0]] > self.retries:
            return [Outcome(CRASHED, "every worker that ran this row crashed")]
        self.suspects.extend(batch)
        return []
