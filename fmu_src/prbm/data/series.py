"""Signals over time, checked: finite, in order, without gaps."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..base.errors import PrbmError
from ..mechanics.arrays import Real

FEWEST_SAMPLES = 16  # of a signal over time
GAP = 1.8  # times the usual step; a sample that is missing makes 2, rounded times up to 1.5
LONG = 3.0  # times the median step; longer steps do not count for the usual one


class RecordError(PrbmError, ValueError):
    """A file of measured data cannot be read, or lacks a column, a unit or samples."""


@dataclass(frozen=True)
class Series:
    """A signal over time, checked: finite, in order, without gaps.

    Parameters
    ----------
    time : (m,)
        Increasing [s].
    values : (m,)
        In ``unit``.
    name, unit : str
        What it is; SI.
    source : str
        Where it comes from, for messages.

    Raises
    ------
    RecordError
        If it is too short, holds what is no number, its times do not increase or have a gap.
    """

    time: Real
    values: Real
    name: str = "x"
    unit: str = "m"
    source: str = "data"
    lines: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64), repr=False)

    def __post_init__(self) -> None:
        time, values = self.time, self.values
        if len(time) != len(values):
            raise RecordError(
                f"{self.source}: {len(time)} times for {len(values)} values of {self.name}: give "
                "one time for each value"
            )
        if len(time) < FEWEST_SAMPLES:
            raise RecordError(
                f"{self.source}: {len(time)} samples of {self.name} are too few to evaluate: "
                f"record {FEWEST_SAMPLES} or more"
            )
        for what, x in (("the time", time), (self.name, values)):
            bad = np.flatnonzero(~np.isfinite(x))
            if len(bad):
                raise RecordError(
                    f"{self._where(int(bad[0]))}: {what} is {x[bad[0]]}: take the row out, or "
                    "interpolate over it"
                )
        self._check_order()
        self._check_gaps()

    def _where(self, row: int) -> str:
        if row < len(self.lines):
            return f"{self.source}, line {self.lines[row]}"
        return f"{self.source}, sample {row + 1}"

    def _check_order(self) -> None:
        steps = np.diff(self.time)
        bad = np.flatnonzero(steps <= 0.0)
        if len(bad):
            i = int(bad[0]) + 1
            same = steps[i - 1] == 0.0
            order = "equals" if same else "is before"
            raise RecordError(
                f"{self._where(i)}: the time {self.time[i]:.9g} s {order} that of the row above, "
                f"{self.time[i - 1]:.9g} s: "
                + ("export the time with more digits" if same else "sort or split the record")
            )

    def _check_gaps(self) -> None:
        steps = np.diff(self.time)
        usual = float(steps[steps <= LONG * np.median(steps)].mean())
        i = int(np.argmax(steps))
        if steps[i] > GAP * usual:
            raise RecordError(
                f"{self._where(i + 1)}: a gap of {steps[i]:.6g} s follows t = {self.time[i]:.9g} "
                f"s, where steps are {usual:.6g} s: evaluate the part before or after it "
                "(Series.between)"
            )

    @property
    def duration(self) -> float:
        """Length of the record, m steps for m samples [s]."""
        return self.step * len(self.time)

    @property
    def step(self) -> float:
        """Mean distance of the samples [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    def between(self, start: float = -math.inf, end: float = math.inf) -> "Series":
        """Return the part with start <= t <= end [s]; its times stay as they are.

        Raises
        ------
        RecordError
            If there is nothing of the record in it, or too little.
        """
        kept = (self.time >= start) & (self.time <= end)
        if not kept.any():
            low, high = (f"{t:.6g} s" for t in (self.time[0], self.time[-1]))
            raise RecordError(
                f"{self.source}: nothing of {self.name} is left {_span(start, end)}: the record is "
                f"from {low} to {high}; choose a start and a later end within"
            )
        lines = self.lines[kept] if len(self.lines) else self.lines
        return Series(self.time[kept], self.values[kept], self.name, self.unit, self.source, lines)

    def from_zero(self) -> "Series":
        """Return the same signal with the time counted from its first sample."""
        return Series(
            self.time - self.time[0], self.values, self.name, self.unit, self.source, self.lines
        )


def _span(start: float, end: float) -> str:
    """Return a span of time in words.

    Examples
    --------
    >>> _span(-math.inf, 2.0), _span(3.0, 2.0), _span(20.0, math.inf)
    ('up to 2 s', 'from 3 s to 2 s', 'from 20 s on')
    """
    if start == -math.inf:
        return f"up to {end:g} s"
    return f"from {start:g} s on" if end == math.inf else f"from {start:g} s to {end:g} s"
