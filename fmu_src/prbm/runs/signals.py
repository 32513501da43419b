"""Inputs over time: constant, step, pulse, half-sine, sine, chirp, table, function.

A signal is smooth between its breaks, the instants at which it or its slope jumps.  At a break its
value depends on the side, so that each evaluation names a time inside the interval that is meant.
"""

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..base.errors import ParameterError
from ..mechanics.arrays import Real
from ..mechanism.parameters import finite

RAMP_SHARE = 0.1  # Of the duration: the rise and the fall of a trapezoid.
SLOPE_STEP = 1e-6  # Difference for the slope of a function, relative to the time or to 1 s.
SLOPE_WEIGHTS = (11 / 6, -3.0, 3 / 2, -1 / 3)
"""Weights of the values at t, t - h, t - 2 h and t - 3 h in h times the slope, of third order."""


class RowError(ParameterError):
    """A row of a table is invalid.

    Parameters
    ----------
    row : int
        Index of the row.
    reason : str
        The mistake and the remedy.
    """

    def __init__(self, row: int, reason: str) -> None:
        super().__init__(row, reason)
        self.row, self.reason = row, reason

    def __str__(self) -> str:
        return f"row {self.row}: {self.reason}"


@runtime_checkable
class Signal(Protocol):
    """An input over time."""

    @property
    def breaks(self) -> tuple[float, ...]:
        """Increasing instants at which the signal or its slope jumps [s]."""

    def value(self, t: float, inside: float) -> float:
        """Return the value at time t [s], as on the interval between breaks around ``inside``."""

    def slope(self, t: float, inside: float) -> float:
        """Return the derivative by time [1/s times the unit] on that interval."""

    def rate(self, start: float, end: float) -> float | None:
        """Return the largest angular rate [rad/s] between two times without a break between.

        It is 0 for a straight line, and None for a constant.
        """


@dataclass(frozen=True)
class Steps:
    """Constant values between breaks: a constant, a step or a rectangular pulse.

    Parameters
    ----------
    breaks : (m,) tuple of float
        Increasing instants [s].
    levels : (m + 1,) tuple of float
        Values before, between and after them.

    Raises
    ------
    ParameterError
        If the numbers of breaks and levels do not match, the breaks do not increase, or a number is
        not finite.

    Examples
    --------
    >>> step = Steps((0.1,), (0.0, 3.0))
    >>> step.value(0.1, inside=0.05), step.value(0.1, inside=0.15)
    (0.0, 3.0)
    """

    breaks: tuple[float, ...]
    levels: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.levels) != len(self.breaks) + 1:
            raise ParameterError(
                f"{len(self.breaks)} breaks and {len(self.levels)} levels do not match: give one "
                "level more than breaks"
            )
        if not all(map(math.isfinite, (*self.breaks, *self.levels))):
            raise ParameterError(
                f"breaks = {self.breaks} s and levels = {self.levels} must be finite"
            )
        for first, second in pairwise(self.breaks):
            if not first < second:
                raise ParameterError(
                    f"the breaks must increase, but {second:g} s follows {first:g} s"
                )

    def value(self, t: float, inside: float) -> float:
        """Return the value on an interval."""
        return self.levels[bisect_right(self.breaks, inside)]

    def slope(self, t: float, inside: float) -> float:
        """Return 0."""
        return 0.0

    def rate(self, start: float, end: float) -> None:
        """Return None: constant between breaks."""
        return


@dataclass(frozen=True)
class Wave:
    """A sine with linearly increasing frequency from a start to an end, 0 outside.

        u = amplitude sin(phase + 2 pi (f tau + (f1 - f) tau^2 / (2 T))),    tau = t - start

    with T = end - start.  A constant frequency is f1 = f; a half-sine has f = f1 = 1/(2 T).

    Parameters
    ----------
    amplitude : float
        Amplitude, in the unit of the input.
    f, f1 : float
        Frequencies at the start and at the end [Hz].
    start, end : float
        Begin and end [s]; the end may be infinite if the frequency is constant.
    phase : float
        Phase at the start [rad].

    Raises
    ------
    ParameterError
        If the end is not after the start, or a frequency is not finite.

    Examples
    --------
    >>> Wave(2.0, f=250.0, f1=250.0, start=0.0, end=0.002).value(0.001, inside=0.001)
    2.0
    """

    amplitude: float
    f: float
    f1: float
    start: float
    end: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        if not self.start < self.end:
            raise ParameterError(
                f"the end, t = {self.end:g} s, is not after the start, t = {self.start:g} s: give "
                "a longer duration"
            )
        if not (math.isfinite(self.f) and math.isfinite(self.f1)):
            raise ParameterError(
                f"the frequencies {self.f:g} Hz and {self.f1:g} Hz must be finite: check the units "
                "of times and frequencies"
            )

    @property
    def breaks(self) -> tuple[float, ...]:
        """Start and end [s]."""
        return tuple(t for t in (self.start, self.end) if math.isfinite(t))

    def _acts(self, inside: float) -> bool:
        return self.start <= inside < self.end

    def _growth(self) -> float:
        """Return the increase of the frequency per time [Hz/s]."""
        return (self.f1 - self.f) / (self.end - self.start)

    def frequency(self, t: float) -> float:
        """Return the frequency at a time [Hz]."""
        return self.f + self._growth() * (t - self.start)

    def _angle(self, t: float) -> float:
        tau = t - self.start
        return self.phase + 2.0 * math.pi * (self.f + 0.5 * self._growth() * tau) * tau

    def value(self, t: float, inside: float) -> float:
        """Return the value on an interval."""
        return self.amplitude * math.sin(self._angle(t)) if self._acts(inside) else 0.0

    def slope(self, t: float, inside: float) -> float:
        """Return the derivative on an interval."""
        if not self._acts(inside):
            return 0.0
        return self.amplitude * 2.0 * math.pi * self.frequency(t) * math.cos(self._angle(t))

    def rate(self, start: float, end: float) -> float | None:
        """Return the largest angular frequency [rad/s]."""
        if not (self._acts(0.5 * (start + end)) and self.amplitude):
            return None
        return 2.0 * math.pi * max(abs(self.frequency(start)), abs(self.frequency(end)))


@dataclass(frozen=True)
class Table:
    """Values at increasing times, straight lines between them, constant before and after.

    Two equal times in sequence are a jump.

    Parameters
    ----------
    times, values : (m,) tuple of float
        Times [s], and values in the unit of the input.

    Raises
    ------
    ParameterError
        If there are fewer than two times, they decrease, three are equal, or a number is not
        finite.

    Examples
    --------
    >>> ramp = Table((0.0, 1.0), (0.0, 2.0))
    >>> ramp.value(0.25, inside=0.25), ramp.value(7.0, inside=7.0)
    (0.5, 2.0)
    """

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.times) != len(self.values) or len(self.times) < 2:
            raise ParameterError(
                f"{len(self.times)} times and {len(self.values)} values must be equally many, at "
                "least two"
            )
        for k, pair in enumerate(zip(self.times, self.values, strict=True)):
            if not all(map(math.isfinite, pair)):
                raise RowError(
                    k, f"the time {pair[0]:g} s and the value {pair[1]:g} must be finite"
                )
        for k in range(1, len(self.times)):
            third = k > 1 and self.times[k] == self.times[k - 2]
            if self.times[k] < self.times[k - 1] or third:
                raise RowError(
                    k,
                    f"the times must increase, two equal ones are a jump; {self.times[k]:g} s "
                    f"follows {self.times[k - 1]:g} s",
                )

    @property
    def breaks(self) -> tuple[float, ...]:
        """The times [s]."""
        return self.times

    def _line(self, inside: float) -> tuple[float, float, float]:
        """Return time, value and slope of the straight line around a time."""
        k = bisect_right(self.times, inside)
        if k in (0, len(self.times)):
            return inside, self.values[k and -1], 0.0
        begin, end = self.times[k - 1], self.times[k]
        slope = (self.values[k] - self.values[k - 1]) / (end - begin)
        return begin, self.values[k - 1], slope

    def value(self, t: float, inside: float) -> float:
        """Return the value on an interval."""
        begin, value, slope = self._line(inside)
        return value + slope * (t - begin)

    def slope(self, t: float, inside: float) -> float:
        """Return the slope of the straight line."""
        return self._line(inside)[2]

    def rate(self, start: float, end: float) -> float | None:
        """Return 0, or None where the table is constant."""
        return 0.0 if self._line(0.5 * (start + end))[2] else None


@dataclass(frozen=True)
class Function:
    """A function of time without known breaks.

    Parameters
    ----------
    function : callable
        Returns the value at a time [s].  It is not called with times before 0.
    name, unit : str
        Name and unit of the input, for messages.
    """

    function: Callable[[float], Any]
    name: str = "the function of time"
    unit: str = ""

    @property
    def breaks(self) -> tuple[float, ...]:
        """No instants."""
        return ()

    def value(self, t: float, inside: float) -> float:
        """Return the value at time t.

        Raises
        ------
        ParameterError
            If the function does not return a finite number.
        """
        return finite(f"{self.name}({t:g} s)", self.function(t), self.unit)

    def slope(self, t: float, inside: float) -> float:
        """Return a difference to earlier times; at the start, to later ones."""
        h = SLOPE_STEP * max(abs(t), 1.0)
        if 0.0 <= t < len(SLOPE_WEIGHTS) * h:
            h = -h
        return sum(w * self.value(t - k * h, inside) for k, w in enumerate(SLOPE_WEIGHTS)) / h

    def rate(self, start: float, end: float) -> float:
        """Return 0, since the rate is not known."""
        return 0.0


@dataclass(frozen=True)
class Slope:
    """The derivative of a signal by time: the velocity of a wall with a given displacement.

    Parameters
    ----------
    signal : Signal
        The signal.
    """

    signal: Signal

    @property
    def breaks(self) -> tuple[float, ...]:
        """The breaks of the signal [s]."""
        return self.signal.breaks

    def value(self, t: float, inside: float) -> float:
        """Return the slope of the signal."""
        return self.signal.slope(t, inside)

    def slope(self, t: float, inside: float) -> float:
        """Return 0: the second derivative is not used."""
        return 0.0

    def rate(self, start: float, end: float) -> float | None:
        """Return the rate of the signal."""
        return self.signal.rate(start, end)


def after(signal: Signal, t: float) -> float:
    """Return the value of a signal from time t [s] on.

    Examples
    --------
    >>> after(Steps((0.1,), (0.0, 3.0)), 0.1)
    3.0
    """
    k = bisect_right(signal.breaks, t)
    end = signal.breaks[k] if k < len(signal.breaks) else t + 1.0
    return signal.value(t, 0.5 * (t + end))


def table(times: Real, values: Real) -> Table:
    """Return a table from arrays (m,) of times [s] and values."""
    return Table(*(tuple(np.asarray(x, float).ravel().tolist()) for x in (times, values)))


def sawtooth(height: float, start: float, end: float) -> Table:
    """Return a pulse that rises from a start to its height at an end [s], where it falls to 0.

    Examples
    --------
    >>> pulse = sawtooth(3.0, 0.0, 0.2)
    >>> pulse.value(0.1, inside=0.1), pulse.value(0.2, inside=0.19), pulse.value(0.2, inside=0.21)
    (1.5, 3.0, 0.0)
    """
    return Table((start, end, end), (0.0, height, 0.0))


def trapezoid(height: float, start: float, end: float) -> Table:
    """Return a pulse that rises and falls in a tenth of its duration each.

    Examples
    --------
    >>> trapezoid(3.0, 0.0, 0.2).value(0.1, inside=0.1)
    3.0
    """
    ramp = RAMP_SHARE * (end - start)
    return Table((start, start + ramp, end - ramp, end), (0.0, height, height, 0.0))
