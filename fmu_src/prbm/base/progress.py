"""Progress of a computation, reported on a stream."""

import math
import sys
import time
from collections.abc import Callable
from typing import TextIO

Progress = Callable[[float], object]


FIRST_WORD, EVERY = 1.0, 2.0  # s; what is done sooner needs no report, and lines are few


def reporter(stream: TextIO | None = None) -> Progress:
    """Return what tells on a stream, standard error by default, how much of a work is done.

    It says nothing in the first second; then it rewrites its line on a terminal, and adds a line
    every other second elsewhere.
    """
    out = sys.stderr if stream is None else stream
    terminal = out.isatty()
    begin = time.monotonic()
    last = -math.inf  # when it said something [s]

    def report(fraction: float) -> None:
        nonlocal last
        now = time.monotonic() - begin
        done = fraction >= 1.0
        if done and terminal and last > 0.0:
            print("\r100%", file=out, flush=True)
            last = -math.inf
        elif not done and now >= FIRST_WORD and now - last >= (0.1 if terminal else EVERY):
            text, end = (f"\r{fraction:4.0%}", "") if terminal else (f"{fraction:4.0%} done", "\n")
            print(text, end=end, file=out, flush=True)
            last = now

    return report
