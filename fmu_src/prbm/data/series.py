"""Signals over time.  A signal is finite, and its times increase without gaps."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..base.errors import PrbmError
from ..mechanics.arrays import Real

SAMPLES_MIN = 16  # Fewest samples of a signal.
GAP_FACTOR = 1.8  # Step over the usual step, from which on a sample is missing.
LONG_STEP_FACTOR = 3.0  # Step over the median step; longer ones do not count as usual steps.


class RecordError(PrbmError, ValueError):
    """A record of measured data cannot be read, is incomplete, or is not a valid signal."""


@dataclass(frozen=True)
class Series:
    """A signal over time.  Its values are finite, and its times increase without gaps.

    Parameters
    ----------
    time : (m,)
        Increasing times [s].
    values : (m,)
        Values in ``unit``.
    name, unit : str
        Name of the signal, and SI unit.
    source : str
        Name of the file, for messages.
    lines : (m,) int
        Line of each sample in the file, for messages; empty if there is no file.

    Raises
    ------
    RecordError
        If the signal is too short or not finite, or its times do not increase or have a gap.
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
        if len(time) < SAMPLES_MIN:
            raise RecordError(
                f"{self.source}: {len(time)} samples of {self.name} are too few to evaluate: "
                f"record {SAMPLES_MIN} or more"
            )
        for name, x in (("the time", time), (self.name, values)):
            bad = np.flatnonzero(~np.isfinite(x))
            if len(bad):
                raise RecordError(
                    f"{self._where(int(bad[0]))}: {name} is {x[bad[0]]}: remove the row, or "
                    "interpolate over it"
                )
        self._check_order()
        self._check_gaps()

    def _where(self, row: int) -> str:
        """Return the position of a sample for messages: its line, or its number from 1."""
        if row < len(self.lines):
            return f"{self.source}, line {self.lines[row]}"
        return f"{self.source}, sample {row + 1}"

    def _check_order(self) -> None:
        """Reject times that do not increase."""
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
        """Reject a step that is so long that a sample must be missing."""
        steps = np.diff(self.time)
        usual = float(steps[steps <= LONG_STEP_FACTOR * np.median(steps)].mean())
        i = int(np.argmax(steps))
        if steps[i] > GAP_FACTOR * usual:
            raise RecordError(
                f"{self._where(i + 1)}: a gap of {steps[i]:.6g} s follows t = {self.time[i]:.9g} "
                f"s, but the usual step is {usual:.6g} s: evaluate the part before or after it "
                "(Series.between)"
            )

    @property
    def duration(self) -> float:
        """Length of the record, m steps for m samples [s]."""
        return self.step * len(self.time)

    @property
    def step(self) -> float:
        """Mean sampling interval [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    def between(self, start: float = -math.inf, end: float = math.inf) -> "Series":
        """Return the part with start <= t <= end [s]; its times do not change.

        Raises
        ------
        RecordError
            If the part has no samples, or too few.
        """
        kept = (self.time >= start) & (self.time <= end)
        if not kept.any():
            low, high = (f"{t:.6g} s" for t in (self.time[0], self.time[-1]))
            raise RecordError(
                f"{self.source}: {self.name} has no samples {_span(start, end)}: choose a start "
                f"and a later end between {low} and {high}"
            )
        lines = self.lines[kept] if len(self.lines) else self.lines
        return Series(self.time[kept], self.values[kept], self.name, self.unit, self.source, lines)

    def from_zero(self) -> "Series":
        """Return the signal with times relative to its first sample."""
        return Series(
            self.time - self.time[0], self.values, self.name, self.unit, self.source, self.lines
        )


def _span(start: float, end: float) -> str:
    """Return an interval of time in words.

    Examples
    --------
    >>> _span(-math.inf, 2.0), _span(3.0, 2.0), _span(20.0, math.inf)
    ('up to 2 s', 'from 3 s to 2 s', 'from 20 s on')
    """
    if start == -math.inf:
        return f"up to {end:g} s"
    return f"from {start:g} s on" if end == math.inf else f"from {start:g} s to {end:g} s"
