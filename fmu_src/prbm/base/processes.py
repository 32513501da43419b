"""Work in several processes."""

import math
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any

from .errors import PrbmError
from .threads import THREAD_LIMITS

PROCESSES_MAX = 61 if sys.platform == "win32" else math.inf  # Windows waits for no more.


class _Serial(Executor):
    """Runs in this process."""

    def submit(self, function: Any, /, *arguments: Any, **more: Any) -> "Future[Any]":
        future: Future[Any] = Future()
        future.set_result(function(*arguments, **more))
        return future


class _Pool(ProcessPoolExecutor):
    """Runs in other processes with one thread each, which ignore Ctrl-C from their start."""

    def submit(self, function: Any, /, *arguments: Any, **more: Any) -> "Future[Any]":
        with _interrupts_ignored(), _single_threaded():
            return super().submit(function, *arguments, **more)


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Ignore Ctrl-C for the moment in which a process starts, which inherits this.

    Ctrl-C in this moment, of some milliseconds, is lost.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Let processes that start meanwhile use one thread for linear algebra.

    There is a process for each core; more threads would wait for each other.  Limits that the
    environment already has remain.
    """
    added = [name for name in THREAD_LIMITS if name not in os.environ]
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)


def process_count(tasks: int, requested: int | None = None) -> int:
    """Return the number of processes for several tasks: one for each core, or as requested."""
    return int(min(requested or os.cpu_count() or 1, tasks, PROCESSES_MAX))


@contextmanager
def executor(
    processes: int, prepare: Callable[..., None] | None = None, *arguments: Any
) -> Iterator[Executor]:
    """Yield an executor; an error inside the ``with`` block ends the tasks that still run.

    Parameters
    ----------
    processes : int
        Number of processes.  With one, tasks run in this process when they are submitted, and
        their errors are raised there.
    prepare : callable, optional
        Called in each of several new processes with ``arguments``.

    Raises
    ------
    PrbmError
        If a process ends before its task.
    """
    if processes == 1:
        yield _Serial()
        return
    others = {*multiprocessing.active_children()}
    context = multiprocessing.get_context("spawn")
    pool = _Pool(processes, context, _prepare, (prepare, arguments))
    try:
        yield pool
    except BrokenProcessPool:
        raise PrbmError(
            "a process of this computation ended early: a script must make the call under "
            "'if __name__ == \"__main__\":'; otherwise memory may be short, close other programs"
        ) from None
    except BaseException:  # Ctrl-C, too.
        for process in {*multiprocessing.active_children()} - others:
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _prepare(prepare: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # The main process handles Ctrl-C.
    if prepare is not None:
        prepare(*arguments)
