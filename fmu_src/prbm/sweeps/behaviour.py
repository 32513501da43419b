"""Maps of behaviour: impacts per period and stroboscopic values of a driven mechanism.

The driving signals have a number, as the amplitude in ``sine({amplitude} mm, 50 Hz)``, that is
varied upwards or downwards.  The motion continues from one value to the next one, so that motions
which exist beside each other are found on different ways.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import ParameterError
from ..base.progress import Progress
from ..files.settings import in_si
from ..hybrid.records import Impact
from ..mechanics.arrays import Real
from ..mechanism.description import Mechanism
from ..runs.driving import Driver
from ..runs.engine import simulation
from ..runs.inputs import Source, filled, placeholders, signals

START = "start"  # Placeholder of the time at which the signals of a value begin.
RETURN_RTOL = 1e-3  # Differences of stroboscopic values of a periodic motion, relative to them.
PERIODS_MAX = 10  # Longest period that is recognized, in driving periods.


@dataclass(frozen=True)
class Behaviour:
    """The motion of a driven mechanism over a number of its driving signals.

    Parameters
    ----------
    name : str
        The number.
    values : (n,)
        Its values, in the order of the sweep.
    strobe : mapping
        For each output its values (n, m) at the end of the last m driving periods.
    impacts : (n, m)
        Number of impacts in each of these periods.
    speeds : tuple of (k,)
        For each value the closing speeds of all impacts in these periods [m/s].
    """

    name: str
    values: Real
    strobe: Mapping[str, Real]
    impacts: Real
    speeds: tuple[Real, ...]

    def period(self, k: int) -> int:
        """Return the period of the motion at value k, in driving periods; 0 if none is recognized.

        The motion has the period p if all outputs and impacts repeat after p driving periods.
        """
        m = self.impacts.shape[1]
        for p in range(1, min(PERIODS_MAX, m - 1) + 1):
            same = (self.impacts[k, p:] == self.impacts[k, :-p]).all()
            near = [
                np.abs(x[k, p:] - x[k, :-p]).max() <= RETURN_RTOL * np.abs(x[k]).max()
                for x in self.strobe.values()
            ]
            if same and all(near):
                return p
        return 0


def behaviour(
    mechanism: Mechanism,
    name: str,
    samples: Sequence[float] | Real,
    outputs: Sequence[str],
    inputs: Mapping[str, Source],
    period: float | Sequence[float] | Real,
    *,
    values: Mapping[str, float | str] | None = None,
    transient: int = 100,
    periods: int = 20,
    tolerance: float | None = None,
    engine: str | None = None,
    progress: Progress | None = None,
) -> Behaviour:
    """Simulate a driven mechanism over a number of its driving signals, with continued state.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    name : str
        The number in braces that is varied.
    samples : (n,)
        Its values, upwards or downwards.
    outputs : sequence of str
        Outputs that are sampled once per driving period.
    inputs : mapping
        Texts of inputs over time with the number in braces, ``"sine({amplitude} mm, 50 Hz)"``.  If
        the period changes, ``{start}`` stands for the time [s] at which the signals of a value
        begin: ``"sine(2 m/s^2, {frequency} Hz, {start} s)"``.
    period : float or (n,)
        Driving period, or that of each value [s].
    values, tolerance, engine
        As for :func:`prbm.simulate`.
    transient, periods : int
        Driving periods at each value that are not recorded, and those that are.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Raises
    ------
    ParameterError
        If the number is in no signal, a count or a period is not positive, or an argument is
        invalid.
    SimulationError
        If the simulation fails; the message has the time.
    """
    x = np.asarray(samples, float).ravel()
    spans = np.broadcast_to(np.asarray(period, float), x.shape)
    within = placeholders(inputs)
    if name not in within or within - {name, START}:
        raise ParameterError(f"write the varied number as {{{name}}} in the inputs, and no other")
    if not len(x) or not (spans > 0.0).all() or transient < 0 or periods < 1:
        raise ParameterError("give at least one value, one period and positive durations")
    given = in_si(mechanism, values)
    record: list[Impact] = []

    def driver(k: int, begin: float) -> Driver:
        texts = filled(inputs, {name: float(x[k]), START: begin})
        return Driver(signals(mechanism, texts, given), begin)

    first = driver(0, 0.0)
    motion = simulation(
        mechanism, {**given, **first.values(0.0)}, tolerance=tolerance, engine=engine
    )
    motion.record = record
    strobe = np.empty((len(outputs), len(x), periods))
    impacts, speeds, begin = np.zeros((len(x), periods)), [], 0.0
    for k, span in enumerate(spans.tolist()):
        driving = driver(k, begin)
        if k:
            motion.set(driving.values(begin))
        end = begin + (transient + periods) * span
        driving.sample(motion.frequency, motion.tolerance, end)
        if transient:
            driving.advance(motion, begin + transient * span)
        record.clear()
        for j in range(periods):
            before = len(record)
            driving.advance(motion, begin + (transient + j + 1) * span)
            found = motion.outputs()
            strobe[:, k, j] = [float(found[output]) for output in outputs]
            impacts[k, j] = len(record) - before
        speeds.append(np.array([impact.latched.approach_speed for impact in record]))
        begin = end
        if progress is not None:
            progress((k + 1) / len(x))
    columns = dict(zip(outputs, strobe, strict=True))
    return Behaviour(name, x, columns, impacts, tuple(speeds))
