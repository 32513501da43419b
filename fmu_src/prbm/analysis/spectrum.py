r"""Frequency content of the motion after an impact, beside the modes at the impact shape.

The wall is removed after the first impact, so that the motion is that of the mechanism alone.  The
modes are those about the shape of the impact.  Some modes depend on the shape, for instance the
vertical and pitch modes of a parallel guide: their lines spread towards the frequencies at the
later shapes.

The amplitude of a line is the amplitude of a sine of this frequency,

    a(f) = 2 |sum_k w_k x_k exp(-2 pi i f t_k)| / sum_k w_k,

with Hann's window w, after subtraction of the straight line through x.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import detrend, find_peaks
from scipy.signal.windows import hann

from ..base.errors import ParameterError
from ..hybrid.records import Impact
from ..mechanics.arrays import Real
from ..mechanics.modal import modes_at
from ..mechanics.system import unit
from ..mechanism.description import Mechanism
from ..runs.engine import simulation as start
from ..runs.released import system_of
from ..runs.result import Result
from .impact_map import first_impact

REMOVED_WALL = 10.0  # Displacement of a removed wall, in sizes of the mechanism.
SAMPLES_MIN = 16  # Least number of samples of a spectrum.
STEP_RTOL = 1e-6  # Largest relative difference between equal steps.
MODES_SHOWN = 6  # Number of modes in a figure.
SIGNALS = {
    "along": "velocity along the impact [m/s]",
    "across": "velocity across the impact [m/s]",
    "turning": "angular velocity [rad/s]",
}


@dataclass(frozen=True)
class AfterImpact:
    """The free motion of the hit body after an impact.

    Parameters
    ----------
    title : str
        Title of the mechanism.
    impact : Impact
        The impact.
    time : (m,)
        Time since the impact, in equal steps [s].
    along, across, turning : (m,)
        Velocity of the body's centre of mass along the direction of the stop, and to the left of
        this direction [m/s]; angular velocity of the body [rad/s].
    modes : (k,)
        Frequencies at the shape of the impact [Hz]; negative ones are unstable.
    """

    title: str
    impact: Impact
    time: Real
    along: Real
    across: Real
    turning: Real
    modes: Real


def after_impact(
    mechanism: Mechanism,
    values: Mapping[str, float] | None = None,
    duration: float = 0.2,
    step: float = 2e-4,
    *,
    stop: int = 0,
    tolerance: float = 1e-8,
    engine: str | None = None,
) -> AfterImpact:
    """Simulate from the release to the first impact, then without the wall.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping
        Parameters that differ from their defaults.
    duration, step : float
        Length and step of the record after the impact [s]; its frequencies reach 1/(2 step).
    stop : int
        Index of the stop; the walls of other stops remain.
    tolerance : float
        Relative tolerance of the integration.
    engine : str or None
        As for :func:`prbm.simulate`.

    Raises
    ------
    ParameterError
        If there are too few samples.
    EquilibriumError
        If the wall is not reached.
    """
    count = round(duration / step) if step > 0.0 else 0
    if count < SAMPLES_MIN:
        raise ParameterError(
            f"duration = {duration:g} s and step = {step:g} s give {count} samples; a spectrum "
            f"needs at least {SAMPLES_MIN}"
        )
    simulation = start(mechanism, values, tolerance=tolerance, engine=engine)
    impact = first_impact(simulation, stop)
    s = mechanism.stops[stop]
    simulation.set({f"{s.name}.displacement": REMOVED_WALL * simulation.system.length})
    u = unit(s.direction).conjugate()
    times = np.linspace(0.0, (count - 1) * step, count)
    begin = simulation.time
    names = [f"{s.body}.{output}" for output in ("vx", "vy", "omega")]
    vx, vy, turning = simulation.sample(begin + times, names).T
    v = u * (vx + 1j * vy)
    found = modes_at(simulation.system, impact.q).frequency
    since = times + begin - impact.time
    return AfterImpact(mechanism.title, impact, since, v.real, v.imag, turning, found)


def after_last_impact(result: Result) -> AfterImpact:
    """Return the motion of a result after its last impact, in its equal steps.

    The wall remains.  The motion is that of the mechanism alone until the next contact.

    Raises
    ------
    ParameterError
        If there is no impact, too little is recorded after it, or the body rests on the stop.
    """
    if not result.impacts:
        raise ParameterError("the result has no impact: simulate longer, or move the stop")
    impact, columns = result.impacts[-1], result.columns
    s = next(stop for stop in result.mechanism.stops if stop.name == impact.stop)
    later = columns[columns["time"] > impact.time]
    if len(later) and (later[f"{s.name}.contact"] != 0).any():
        raise ParameterError(
            f"after the last impact, at t = {impact.time:.6g} s, {s.body} rests on {s.name}: "
            "there is no free motion; choose the first impact, or a shorter simulation"
        )
    steps = np.diff(later["time"])
    if len(steps) and abs(steps[-1] - steps[0]) > STEP_RTOL * steps[0]:
        later = later[:-1]  # The last step may be shorter.
    if len(later) < SAMPLES_MIN:
        raise ParameterError(
            f"{len(later)} samples follow the last impact, at t = {impact.time:.6g} s; a spectrum "
            f"needs at least {SAMPLES_MIN}: simulate longer, or in smaller steps"
        )
    v = unit(s.direction).conjugate() * (later[f"{s.body}.vx"] + 1j * later[f"{s.body}.vy"])
    found = modes_at(system_of(result), impact.q).frequency
    return AfterImpact(
        result.mechanism.title, impact, later["time"] - impact.time, v.real, v.imag,
        later[f"{s.body}.omega"], found,
    )  # fmt: skip


def spectrum(time: Real, signal: Real) -> tuple[Real, Real]:
    """Return frequencies and amplitudes of a signal.

    Parameters
    ----------
    time : (m,)
        Times in equal steps [s].
    signal : (m,)
        Samples in any unit.

    Returns
    -------
    frequency : (m // 2 + 1,)
        Frequencies up to half of the sampling rate [Hz].
    amplitude : (m // 2 + 1,)
        Amplitude of the sine at each frequency, in the unit of the signal.

    Raises
    ------
    ParameterError
        If there are too few samples, or their steps differ.

    Examples
    --------
    >>> t = np.arange(1000) / 1000
    >>> f, a = spectrum(t, 3.0 * np.sin(2 * np.pi * 50 * t))
    >>> float(f[a.argmax()]), round(float(a.max()), 3)
    (50.0, 3.0)
    """
    steps = np.diff(time)
    if len(time) < SAMPLES_MIN:
        raise ParameterError(f"a spectrum needs at least {SAMPLES_MIN} samples, not {len(time)}")
    if np.ptp(steps) > STEP_RTOL * abs(float(steps.mean())):
        raise ParameterError(
            f"a spectrum needs equal steps, not {steps.min():.6g} s to {steps.max():.6g} s: "
            "interpolate the signal, or record it in equal steps"
        )
    window = hann(len(time), sym=False)
    lines = np.fft.rfft(window * detrend(signal))
    frequency: Real = np.array(np.fft.rfftfreq(len(time), float(steps.mean())), float)
    amplitude: Real = 2.0 * np.abs(lines) / float(window.sum())
    return frequency, amplitude


def peaks(frequency: Real, amplitude: Real, share: float = 0.02) -> Real:
    """Return the frequencies of peaks, by parabolas through the logarithm of the amplitude.

    Parameters
    ----------
    frequency, amplitude : (m,)
        Results of :func:`spectrum`.
    share : float
        Least height of a peak, as a share of the largest amplitude.

    Returns
    -------
    (p,)
        Frequencies of the peaks, increasing [Hz].

    Examples
    --------
    >>> t = np.arange(1000) / 1000
    >>> peaks(*spectrum(t, np.sin(2 * np.pi * 50.3 * t))).round(1).tolist()
    [50.3]
    """
    top = float(amplitude.max())
    found, _ = find_peaks(amplitude, height=share * top, prominence=share * top / 2)
    low, here, high = (np.log(amplitude[found + k]) for k in (-1, 0, 1))
    shift = (low - high) / (2.0 * (low - 2.0 * here + high))
    result: Real = np.array(frequency[found] + shift * (frequency[1] - frequency[0]), float)
    return result


def numbered(modes: Real) -> list[tuple[int, float]]:
    """Return the first modes with their numbers, without unstable ones.

    Examples
    --------
    >>> numbered(np.array([-1.6, 116.0]))
    [(2, 116.0)]
    """
    first = enumerate(map(float, modes[:MODES_SHOWN]), start=1)
    return [(i, f) for i, f in first if f > 0.0]
