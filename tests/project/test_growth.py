"""The growth of times is found, although other programs make some of the times longer."""

import itertools
import time

import pytest

from growth import grows


@pytest.fixture
def clock(monkeypatch):
    """Return a function that spends time on a clock, which takes the place of the processor's.

    Every second time is three times as long as it takes.
    """
    now = 0.0
    delays = itertools.cycle([3.0, 1.0])

    def spend(operations: float) -> None:
        nonlocal now
        now += next(delays) * operations

    monkeypatch.setattr(time, "thread_time", lambda: now)
    return spend


@pytest.mark.parametrize("power", [1, 2])
def test_a_higher_power_is_found(clock, power):
    assert grows(lambda n: clock(n ** (power + 1)), int, 100, 8, power)


@pytest.mark.parametrize("power", [1, 2])
def test_the_power_itself_is_no_growth(clock, power):
    assert not grows(lambda n: clock(n**power), int, 100, 8, power)
