"""Progress of a computation, written to a stream."""

import math
import sys
import time
from collections.abc import Callable
from typing import TextIO

Progress = Callable[[float], object]

DELAY = 1.0  # s; shorter computations write nothing.
LINE_INTERVAL = 2.0  # s between lines in a file.
TERMINAL_INTERVAL = 0.1  # s between updates of the line on a terminal.


def reporter(stream: TextIO | None = None) -> Progress:
    """Return a progress callback; its argument is the completed fraction of the work.

    It writes nothing in the first second.  After that it updates one line on a terminal; to any
    other stream it adds a line every two seconds.

    Parameters
    ----------
    stream : text stream or None
        Destination (default: standard error).
    """
    out = sys.stderr if stream is None else stream
    terminal = out.isatty()
    interval = TERMINAL_INTERVAL if terminal else LINE_INTERVAL
    begin = time.monotonic()
    last = -math.inf  # time of the last output [s]

    def report(fraction: float) -> None:
        nonlocal last
        now = time.monotonic() - begin
        done = fraction >= 1.0
        if done and terminal and last > 0.0:
            print("\r100%", file=out, flush=True)
            last = -math.inf
        elif not done and now >= DELAY and now - last >= interval:
            text, end = (f"\r{fraction:4.0%}", "") if terminal else (f"{fraction:4.0%} done", "\n")
            print(text, end=end, file=out, flush=True)
            last = now

    return report
