"""Growth of the processor time with the size of a problem, within one run on one machine."""

import time
from collections.abc import Callable
from typing import Any

ATTEMPTS = 5
"""Other programs make times longer.  The smallest of five times of each size counts."""


def duration(call: Callable[[Any], object], problem: object) -> float:
    """Return the processor time of a call [s].

    It is the processor time of this thread, which other programs hardly disturb.
    """
    begin = time.thread_time()
    call(problem)
    return time.thread_time() - begin


def grows(
    call: Callable[[Any], object],
    make: Callable[[int], object],
    size: int,
    factor: int,
    power: int,
) -> bool:
    """Return whether the time of a call grows faster than a power of the size of its problem.

    The times of two sizes are compared.  The limit is in the middle, on a logarithmic scale,
    between their ratios for this power and for the next one: both are away from it by the square
    root of the factor.

    Parameters
    ----------
    call : function
        Solves a problem.
    make : function
        Returns the problem of a size.
    size : int
        The smaller size.
    factor : int
        Ratio of the sizes.
    power : int
        The permitted power of the size.
    """
    small, large = make(size), make(factor * size)
    limit = factor ** (power + 0.5) * min(duration(call, small) for _ in range(ATTEMPTS))
    return all(duration(call, large) >= limit for _ in range(ATTEMPTS))
