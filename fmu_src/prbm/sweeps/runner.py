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
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
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
RECENT_RUNS = 50  # Runs whose median duration determines the size of the next batch.
CONNECTION_TIMEOUT = 10.0  # Longest wait for a scheduler and its workers [s].
MISSING_MODULE = "No module named"  # Python's message for a package that is not installed.


class StudyError(PrbmError, RuntimeError):
    """The study cannot run, for a reason that does not depend on its parameters."""


class Stopped(BaseException):
    """Raised in a thread that simulates when the study ends before the simulation."""


@dataclass
class Pool:
    """An executor and the number of simulations that it runs at a time.

    Parameters
    ----------
    executor : Executor or None
        None: this thread runs the simulations.
    threads : callable
        Returns the present number of parallel runs.
    here : bool
        Whether the threads of the executor simulate themselves, in this process.
    closing : callable
        Called with the name of the study at its end.
    """

    executor: Executor | None
    threads: Callable[[], int]
    here: bool = False
    closing: Callable[[str], object] = release


def check_limits(workers: int | None, timeout: float | None, retries: int = 0) -> None:
    """Reject limits of a study that are not positive.

    Raises
    ------
    ParameterError
        If the number of workers or the longest duration of a run [s] is not positive, or the number
        of repetitions is negative.
    """
    if workers is not None and workers < 1:
        raise ParameterError(f"workers = {workers} must be 1 or more")
    if timeout is not None and not timeout > 0.0:
        raise ParameterError(f"timeout = {timeout:g} s must be positive")
    if retries < 0:
        raise ParameterError(f"retries = {retries} must be 0 or more")


@contextmanager
def pool(
    workers: int | None,
    runs: int,
    *,
    here: bool = False,
    parallel: bool = False,
    executor: Executor | str | None = None,
) -> Iterator[Pool]:
    """Yield where the simulations of a study run.

    Parameters
    ----------
    workers : int or None
        Number of parallel runs; None: one per core, or those of the executor.
    runs : int
        Number of runs.
    here : bool
        The simulations may run in this process, where they cannot be ended: one at a time,
    parallel : bool
        or in parallel, since they release the lock of the interpreter.
    executor : Executor, str or None
        A ``concurrent.futures`` executor, or the address of a Dask scheduler.  None: threads of
        this process, each with a process that simulates.

    Raises
    ------
    StudyError
        If the scheduler does not respond or has no workers.
    """
    if isinstance(executor, str):
        with _client(executor) as client:
            yield Pool(
                client.get_executor(pure=False),
                lambda: max(1, sum(client.nthreads().values())),
                closing=lambda study: client.run(release, study),
            )
        return
    if executor is not None:
        known: Any = executor
        client = getattr(known, "_client", None)  # Of Dask's ClientExecutor.
        if workers is None and client is not None:
            yield Pool(executor, lambda: max(1, sum(client.nthreads().values())),
                       closing=lambda study: client.run(release, study))  # fmt: skip
        else:
            count = workers or getattr(known, "_max_workers", None) or process_count(runs)
            yield Pool(executor, lambda: count)
        return
    count = process_count(max(runs, 1), workers)
    if here and count == 1:
        yield Pool(None, lambda: 1)
        return
    threads = ThreadPoolExecutor(count)
    try:
        yield Pool(threads, lambda: count, here and parallel)
    finally:
        threads.shutdown(cancel_futures=True)


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


@dataclass
class Runner:
    """Computes rows and keeps their outcomes in a journal.

    It is used in a ``with`` block, at whose end the processes of the study end.  A
    KeyboardInterrupt then has a message about the completed rows.

    Parameters
    ----------
    job : Job
        The simulation; ``run`` of it is called in this process if the pool has no executor.
    parameters : sequence of str
        Names of the numbers of a point.
    journal : Journal
        The completed rows.
    pool : Pool
        Where the simulations run.
    retries : int
        Number of repetitions of a run whose process crashed.
    timeout : float or None
        Longest duration of a run [s]; None: no limit.
    """

    job: Job
    parameters: Sequence[str]
    journal: Journal
    pool: Pool
    retries: int = 1
    timeout: float | None = None
    study: str = field(default_factory=lambda: uuid.uuid4().hex)
    stopped: bool = False
    busy: set[int] = field(default_factory=set)  # Threads that simulate themselves.

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
        for point, outcome in self._computed(rest):
            self.journal.add(point, outcome)
            done += 1
            report(done / total)
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
            self.pool.closing(self.study)
        if kind is KeyboardInterrupt and self.journal.kept:
            raise KeyboardInterrupt(f"interrupted; {self.journal.kept}") from None

    def _row(self, point: Point) -> Row:
        return dict(zip(self.parameters, point, strict=True))

    def run(self, rows: Sequence[Row]) -> list[Outcome]:
        """Simulate in this thread, until the study ends."""
        run: Callable[[Row], Outcome] = self.job.run  # type: ignore[attr-defined]
        thread = threading.get_ident()
        self.busy.add(thread)
        try:
            return [run(row) for row in rows if not self.stopped]
        except Stopped:
            return []
        finally:
            self.busy.discard(thread)

    def _computed(self, points: Sequence[Point]) -> Iterator[tuple[Point, Outcome]]:
        if self.pool.executor is None:
            for point in points:
                yield point, self.run([self._row(point)])[0]
        elif points:
            yield from _Batches(self, self.pool.executor).computed(points)


class _Batches:
    """Sends batches of points to an executor."""

    def __init__(self, runner: Runner, executor: Executor) -> None:
        self.runner, self.executor = runner, executor
        self.begin = time.monotonic()
        self.recent: deque[float] = deque(maxlen=RECENT_RUNS)
        self.running: dict[Future[Any], list[Point]] = {}
        self.crashes: dict[Point, int] = {}  # Crashes of workers that ran a point.
        self.suspects: deque[Point] = deque()

    def computed(self, points: Sequence[Point]) -> Iterator[tuple[Point, Outcome]]:
        """Yield points with their outcomes as they come."""
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
        """Submit batches until there are :data:`BATCHES_PER_THREAD` per thread."""
        threads = self.runner.pool.threads()
        while rest and len(self.running) < BATCHES_PER_THREAD * threads:
            self._send([rest.popleft() for _ in range(self._size(len(rest), threads))])

    def _size(self, rest: int, threads: int) -> int:
        """Return the number of points of the next batch, small at the start and at the end."""
        if not self.recent:
            return 1
        seconds = min(max(BATCH_SHARE * (time.monotonic() - self.begin), BATCH_MIN), BATCH_MAX)
        fair = math.ceil(rest / (BATCHES_PER_THREAD * threads))
        return max(1, min(int(seconds / median(self.recent)), fair))

    def _send(self, batch: list[Point], given: bool = False) -> None:
        runner = self.runner
        job = (runner.job, runner.retries, runner.timeout) if given else None
        rows = [runner._row(point) for point in batch]
        call = (runner.run, rows) if runner.pool.here else (run_batch, runner.study, rows, job)
        self.running[self.executor.submit(*call)] = batch

    def _outcomes(self, future: "Future[Any]", batch: list[Point]) -> list[Outcome]:
        """Return the outcomes of a batch; none if it has to be repeated."""
        try:
            outcomes: list[Outcome] | None = future.result()
        except Unusable as error:
            raise StudyError(f"the simulation cannot run: {error}") from None
        except CancelledError:
            raise StudyError(f"the cluster has ended; {self.runner.journal.kept}") from None
        except Exception as error:
            if type(error).__name__ == "KilledWorker":  # Of Dask, which may not be installed.
                return self._after_crash(batch)
            if isinstance(error, BrokenExecutor):
                kept = self.runner.journal.kept
                raise StudyError(f"a process of the executor has ended early; {kept}") from None
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
        if self.crashes[batch[0]] > self.runner.retries:
            return [Outcome(CRASHED, "every worker that ran this row crashed")]
        self.suspects.extend(batch)
        return []
