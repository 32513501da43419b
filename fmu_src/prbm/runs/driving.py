r"""Simulations whose inputs are signals.

Inputs of a :class:`Simulation` are constant between changes.  Signals are therefore replaced by
constant pieces.  The time between two rows of the result, or between a row and a break of a
signal, is divided into equal steps.  Each step has two pieces of equal length with the values

    u_1 = m - d,  u_2 = m + d,    m = 1/h \int u ds,  d = 4/h^2 \int s u ds

where s is the time since the middle of the step.  The pieces have the zeroth and the first moment
of the signal.  Step by step the error of the motion therefore falls with h^5, and overall with
h^4.  The integrals are computed by Gauss' formula with three points.

Walls, impulses and the mobilities of walls have their value at the start of each piece instead.
A wall joins its reference within two communication steps, which the pieces are.  If a signal
moves a wall, no step of the simulation is therefore longer than ``Driver.wall_step``.  It is at
most a hundredth of each interval between breaks in which a wall moves.

The last piece before a row is short and has the value of the signal at this row, because some
outputs (contact and base forces) depend on the present value of the inputs.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Protocol

from ..base.errors import ParameterError
from ..mechanics.inputs import LOADS, MOBILITY, WALL_INPUTS
from .signals import Signal, after

SAMPLING_ERROR_FACTOR = 720.0  # A harmonic oscillation has the relative error (omega h)^4 / 720.
IMPULSE = "impulse"  # Group of the inputs that are impulses, as in force.impulse.x.
SAMPLED = (*WALL_INPUTS, MOBILITY, IMPULSE)
SAMPLING_TOLERANCE_MIN = 1e-12
LAST_PIECE_RTOL = 1e-6  # Duration of the last piece before a row, relative to the row spacing.
SAMPLING_STEPS_MAX = 10_000_000  # More steps are a mistake in the unit of a frequency or a time.
JUMP_ATOL = 1e-12  # m: a smaller jump of a wall is round-off.
WALL_PIECES_MIN = 100  # Pieces of each interval between breaks in which a wall moves.
GAUSS_NODE = math.sqrt(0.6)  # Nodes of Gauss' formula: 0 and +- this share of half a step.


class Driveable(Protocol):
    """The part of a simulation that is used here."""

    def set(self, changes: Mapping[str, float]) -> None:
        """Change inputs."""

    def advance(self, time: float) -> None:
        """Continue the motion to a time [s]."""


def _kind(name: str) -> str:
    """Return the kind of an input: the last word of its name, or :data:`IMPULSE`.

    Examples
    --------
    >>> _kind("force.impulse.x"), _kind("stop.velocity"), _kind("impulse.x")
    ('impulse', 'velocity', 'x')
    """
    *parts, last = name.split(".")
    return IMPULSE if parts[1:] == [IMPULSE] and last in LOADS else last


class Driver:
    """Advances a simulation whose inputs are signals.

    Parameters
    ----------
    signals : mapping
        Signals by the names of the inputs.
    start : float
        Time at the start [s].
    """

    def __init__(self, signals: Mapping[str, Signal], start: float = 0.0) -> None:
        self.signals = dict(signals)
        self.omega, self.share, self.now = 0.0, 1.0, start
        self.breaks = sorted({t for signal in signals.values() for t in signal.breaks if t > start})
        kinds = {name: _kind(name) for name in signals}
        self.walls = [name for name, kind in kinds.items() if kind in WALL_INPUTS]
        # Inputs that act by their values at single times.
        self.sampled = {name for name, kind in kinds.items() if kind in SAMPLED}
        self.wall_step = math.inf  # Longest step if signals move walls [s].
        for name, signal in signals.items():
            if kinds[name] == "displacement":
                _check_continuity(name, signal, start)
            elif kinds[name] == IMPULSE:
                _check_start(name, signal, start)

    def values(self, t: float) -> dict[str, float]:
        """Return the values of the signals from time t [s] on."""
        return {name: after(signal, t) for name, signal in self.signals.items()}

    def sample(self, frequency: float, tolerance: float, stop_time: float) -> None:
        """Choose the longest steps.

        A harmonic oscillation of the mechanism or of a signal then has the relative error
        ``tolerance``.

        Parameters
        ----------
        frequency : float
            Fundamental frequency of the mechanism [Hz]; 0: none.
        tolerance : float
            Relative tolerance.
        stop_time : float
            End of the simulation [s].

        Raises
        ------
        ParameterError
            If there are more than ``SAMPLING_STEPS_MAX`` steps; the message names the signal.
        """
        self.omega = 2.0 * math.pi * frequency
        self.share = (SAMPLING_ERROR_FACTOR * max(tolerance, SAMPLING_TOLERANCE_MIN)) ** 0.25
        points = [self.now, *self._between(self.now, stop_time), stop_time]
        walls = [self.signals[name] for name in self.walls]
        driven = [
            (a, b) for a, b in pairwise(points) if any(s.rate(a, b) is not None for s in walls)
        ]
        self.wall_step = min(
            (min(self._step(walls, a, b), (b - a) / WALL_PIECES_MIN) for a, b in driven),
            default=math.inf,
        )
        for name, signal in self.signals.items():
            longest = self.wall_step if name in self.walls else math.inf
            steps = sum(
                (b - a) / min(self._step((signal,), a, b), longest) for a, b in pairwise(points)
            )
            if steps > SAMPLING_STEPS_MAX:
                raise ParameterError(
                    f"the signal of {name} needs {steps:.3g} steps in {stop_time:g} s; check the "
                    "units of its frequencies and times, or simulate a shorter time"
                )

    def _step(self, signals: Sequence[Signal], start: float, end: float) -> float:
        """Return the longest step between two times without a break between them [s]."""
        rates = [rate for s in signals if (rate := s.rate(start, end)) is not None]
        fastest = max([*rates, self.omega]) if rates else 0.0
        return min(end - start, self.share / fastest if fastest else math.inf)

    def advance(self, simulation: Driveable, time: float) -> None:
        """Continue the motion to the time of the next row [s]."""
        if not self.signals or time <= self.now:
            simulation.advance(time)
            return
        start, signals = self.now, tuple(self.signals.values())
        points = [start, *self._between(start, time), time]
        last = time - LAST_PIECE_RTOL * (time - start)
        for a, b in pairwise(points):
            if all(signal.rate(a, b) is None for signal in signals):
                self._hold(simulation, a, 0.5 * (a + b), b)
                continue
            steps = math.ceil((b - a) / min(self._step(signals, a, b), self.wall_step))
            grid = [*(a + k * (b - a) / steps for k in range(steps)), min(b, max(last, a))]
            for c, d in pairwise(grid):
                if d > c:
                    self._sample(simulation, c, d)
            if b == time:
                self._hold(simulation, b, 0.5 * (a + b), b)
        self.now = time

    def _between(self, start: float, end: float) -> list[float]:
        """Return the breaks between two times [s]."""
        return self.breaks[bisect_right(self.breaks, start) : bisect_left(self.breaks, end)]

    def _hold(self, simulation: Driveable, t: float, inside: float, end: float) -> None:
        """Advance to a time [s] with the values at time t, on the interval around ``inside``."""
        simulation.set({n: signal.value(t, inside) for n, signal in self.signals.items()})
        pieces = math.ceil((end - t) / self.wall_step)
        for k in range(1, pieces):
            simulation.advance(t + k * (end - t) / pieces)
        simulation.advance(end)

    def _sample(self, simulation: Driveable, start: float, end: float) -> None:
        """Advance by a step of two constant pieces [s]."""
        middle, half = 0.5 * (start + end), 0.5 * (end - start)
        first, second = {}, {}
        for name, signal in self.signals.items():
            u = [signal.value(middle + x * half, middle) for x in (-GAUSS_NODE, 0.0, GAUSS_NODE)]
            mean = (5.0 * u[0] + 8.0 * u[1] + 5.0 * u[2]) / 18.0
            change = 5.0 / 9.0 * GAUSS_NODE * (u[2] - u[0])
            first[name], second[name] = mean - change, mean + change
            if name in self.sampled:
                first[name], second[name] = signal.value(start, middle), u[1]
        simulation.set(first)
        simulation.advance(middle)
        simulation.set(second)
        simulation.advance(end)


def _check_continuity(name: str, signal: Signal, start: float) -> None:
    """Reject a displacement of a wall that jumps after the start [s]."""
    times = [-math.inf, *signal.breaks, math.inf]
    for before, t, behind in zip(times, times[1:], times[2:], strict=False):
        left = signal.value(t, max(0.5 * (before + t), t - 1.0))
        right = signal.value(t, min(0.5 * (t + behind), t + 1.0))
        if t > start and abs(right - left) > JUMP_ATOL:
            raise ParameterError(
                f"the signal of {name} jumps from {left:.6g} m to {right:.6g} m at t = {t:.6g} s: "
                "a wall cannot jump; give a ramp, such as the rows of a CSV file"
            )


def _check_start(name: str, signal: Signal, start: float) -> None:
    """Reject an impulse that is not zero at the start [s]."""
    value = after(signal, start)
    if value:
        unit = LOADS[name.rpartition(".")[2]]
        raise ParameterError(
            f"{name} = {value:.6g} {unit}.s at t = {start:g} s has no effect, because an impulse "
            "acts by its increases after the start: let it increase later, as in "
            f"step({value:.6g} {unit}.s, 1 ms), or give the released body a velocity"
        )
