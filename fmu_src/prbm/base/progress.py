"""Progress of a computation, with the remaining time, reported on a stream or as messages."""

import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

Progress = Callable[[float], object]

DELAY = 1.0  # A shorter computation reports nothing [s].
LINE_INTERVAL = 5.0  # Least time between two lines or messages [s].
TERMINAL_INTERVAL = 0.1  # Least time between two updates of a line on a terminal [s].
STEADY = 0.8  # Part of an estimated duration in which the reported fraction grows evenly.
WIDTH = 24  # Characters of the line on a terminal.
CLEAR = f"\r{'':{WIDTH}}\r"


def reporter(stream: TextIO | None = None) -> Progress:
    """Return a progress callback, to be called with the completed fraction, from 0 to 1.

    It writes nothing in the first second.  After that it updates one line on a terminal; to any
    other stream it writes a line at most every five seconds.

    Parameters
    ----------
    stream : text stream or None
        Destination (default: standard error).
    """
    out = sys.stderr if stream is None else stream
    if not out.isatty():
        return messages(lambda text: print(text, file=out, flush=True))
    shown = False

    def update(text: str) -> None:
        nonlocal shown
        shown = True
        print(f"\r{text:{WIDTH}}", end="", file=out, flush=True)

    timed = messages(update, TERMINAL_INTERVAL, done="")

    def report(fraction: float) -> None:
        nonlocal shown
        timed(fraction)
        if fraction >= 1.0 and shown:
            print(f"\r{'100%':{WIDTH}}", file=out, flush=True)
            shown = False

    return report


def messages(
    write: Callable[[str], object], interval: float = LINE_INTERVAL, done: str = " done"
) -> Progress:
    """Return a progress callback that calls ``write`` with a text such as `` 20% done, 12 s left``.

    Parameters
    ----------
    write : callable
        Called with each text, not in the first second and not after the end.
    interval : float
        Least time between two texts [s].
    done : str
        Text after the percentage.
    """
    begin = time.monotonic()
    last = -math.inf  # Time of the last text [s].
    first: tuple[float, float] | None = None  # Time [s] and fraction of the first call.

    def report(fraction: float) -> None:
        nonlocal last, first
        now = time.monotonic() - begin
        first = first or (now, fraction)
        if fraction < 1.0 and now >= DELAY and now - last >= interval:
            last = now
            write(f"{fraction:4.0%}{done}{_remaining(now - first[0], fraction, first[1])}")

    return report


def estimated(elapsed: float, duration: float) -> float:
    """Return the completed fraction of a task that takes about ``duration`` [s].

    It grows with time, and stays below 1 if the task takes longer.

    Examples
    --------
    >>> [round(estimated(t, 10.0), 2) for t in (0.0, 4.0, 8.0, 10.0, 20.0)]
    [0.0, 0.4, 0.8, 0.93, 1.0]
    """
    part = elapsed / duration
    rest = 1.0 - STEADY
    return part if part < STEADY else 1.0 - rest * math.exp((STEADY - part) / rest)


@contextmanager
def waiting(duration: float, stream: TextIO | None = None) -> Iterator[None]:
    """Report the remaining time of a task that cannot report its progress, on a terminal only.

    Parameters
    ----------
    duration : float
        Approximate time of the task, the ``with`` block [s].
    stream : text stream or None
        Destination (default: standard error).
    """
    out = sys.stderr if stream is None else stream
    if out is None or not out.isatty():
        yield
        return
    ended, report, begin = threading.Event(), reporter(out), time.monotonic()

    def update() -> None:
        while not ended.wait(TERMINAL_INTERVAL):
            report(estimated(time.monotonic() - begin, duration))

    report(0.0)
    thread = threading.Thread(target=update, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        print(CLEAR, end="", file=out, flush=True)


def _remaining(elapsed: float, fraction: float, first: float) -> str:
    """Return the remaining time as text, if it can be estimated.

    Parameters
    ----------
    elapsed : float
        Time since the first call [s].
    fraction, first : float
        Completed fraction now and in the first call; a continued computation starts above 0.

    Examples
    --------
    >>> _remaining(3.0, 0.2, 0.0), _remaining(60.0, 0.5, 0.25), _remaining(1.0, 0.5, 0.5)
    (', 12 s left', ', 2 min left', '')
    """
    if fraction <= first:
        return ""
    seconds = elapsed * (1.0 - fraction) / (fraction - first)
    for size, unit in ((3600.0, "h"), (60.0, "min")):
        if seconds >= 1.5 * size:
            return f", {seconds / size:.0f} {unit} left"
    return f", {max(1, round(seconds))} s left"
