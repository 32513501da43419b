r"""Frequency and damping of a free vibration, and impacts in a response.

The model is x(t) = c + exp(-lambda t) (a cos omega_d t + b sin omega_d t), with

    lambda = zeta omega_n,      omega_d = omega_n sqrt(1 - zeta^2),
    delta = ln(x_k/x_k+1) = 2 pi zeta/sqrt(1 - zeta^2)          (logarithmic decrement).

Large motion of a mechanism is neither harmonic nor of one frequency.  The residuals are then
correlated; the result states their correlation, and its uncertainties are larger.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import find_peaks

from ..mechanics.arrays import Real
from .series import Series
from .uncertainty import CONFIDENCE_LEVEL, Estimate, EvaluationError, serial_correlation, widening

PERIODS_MIN = 3.0  # Periods in a record from which a frequency is evaluated.
EXPLAINED_POWER_MIN = 0.25  # Least share of the signal's power that the fit must explain.
PEAKS_MIN = 4  # Peaks from which a decrement is evaluated.
PEAK_NOISE_MIN = 5.0  # Ratio of a peak to the noise: lower peaks are biased, and skipped.
KINK_FACTOR = 6.0  # Second difference of an impact over the usual one.
DEVIATION_PER_MAD = 1.4826  # Standard over median absolute deviation of Gaussian noise.
START_DECAYS = (0.0, 0.3, 1.0, 3.0, 10.0, 30.0)  # Start values of the fit for lambda T.


@dataclass(frozen=True)
class FourierPeak:
    """Highest peak of a spectrum.

    Parameters
    ----------
    frequency : Estimate
        Frequency of the highest line [Hz].  The true frequency is uniformly distributed within half
        a line distance, so that u = 1/(T sqrt 12).
    resolution : float
        Distance of the lines, 1/T [Hz].
    interpolated : float
        Frequency at the vertex of a parabola through the logarithms of three lines, of the signal
        with a Hann window [Hz].
    """

    frequency: Estimate
    resolution: float
    interpolated: float


def fourier_peak(series: Series) -> FourierPeak:
    """Return the highest peak of the spectrum of a record.

    Raises
    ------
    EvaluationError
        If the signal does not change, or has fewer than three periods.
    """
    T, n = series.duration, len(series.values)
    x = series.values - series.values.mean()
    if float(np.abs(x).max()) <= 1e-12 * float(np.abs(series.values).max()):
        raise EvaluationError(
            f"{series.source}: {series.name} does not change: choose another column"
        )
    grid = series.time[0] + series.step * np.arange(n)
    x = np.interp(grid, series.time, x)  # for uneven sampling
    lines = np.abs(np.fft.rfft(x))
    peak = int(np.argmax(lines[1:])) + 1
    if peak < PERIODS_MIN:
        raise EvaluationError(
            f"{series.source}: {series.name} has {peak} periods or less in {T:.4g} s: record "
            f"{PERIODS_MIN:g} or more, or remove the drift"
        )
    smooth = np.abs(np.fft.rfft(x * np.hanning(n)))
    top = peak - 1 + int(np.argmax(smooth[peak - 1 : peak + 2]))
    top = min(max(top, 1), len(smooth) - 2)
    a, b, c = np.log(np.maximum(smooth[top - 1 : top + 2], 1e-300))
    bend = a - 2.0 * b + c
    shift = 0.5 * (a - c) / bend if bend < 0.0 else 0.0
    return FourierPeak(
        Estimate(peak / T, 1.0 / (T * math.sqrt(12.0)), "Hz"), 1.0 / T, (top + shift) / T
    )


@dataclass(frozen=True)
class FreeVibration:
    """Damped sine fitted to a record by least squares, and the logarithmic decrement.

    Parameters
    ----------
    frequency : Estimate
        Undamped natural frequency omega_n/(2 pi) [Hz].
    damped_frequency : Estimate
        omega_d/(2 pi) [Hz].
    zeta : Estimate
        Damping ratio of the fit [-].
    decrement : Estimate or None
        Logarithmic decrement per period, from the peaks [-]; None if there are too few peaks.
    decrement_zeta : Estimate or None
        Damping ratio from the decrement [-].
    amplitude : float
        Amplitude at the start of the record, in the unit of the record.
    rest : float
        Position of rest, in the unit of the record.
    residual : float
        Standard deviation about the fit, in the unit of the record.
    serial : float
        Correlation of neighbouring residuals [-]; about 0 for noise.
    peak : FourierPeak
        Highest peak of the spectrum.
    unit : str
        Unit of the record; 1 if it is dimensionless.
    """

    frequency: Estimate
    damped_frequency: Estimate
    zeta: Estimate
    decrement: Estimate | None
    decrement_zeta: Estimate | None
    amplitude: float
    rest: float
    residual: float
    serial: float
    peak: FourierPeak
    unit: str = "m"

    @property
    def damping_measurable(self) -> bool:
        """Whether the 95 % confidence interval of the damping ratio is above zero."""
        return self.zeta.interval(CONFIDENCE_LEVEL)[0] > 0.0

    @property
    def damping(self) -> str:
        """Damping ratio in words, or its upper bound if it is too small to measure."""
        return damping_verdict(self.zeta)

    def __str__(self) -> str:
        rows = [
            f"frequency {self.frequency}  (damped {self.damped_frequency})",
            f"  spectrum: {self.peak.frequency.value:.6g} Hz with lines {self.peak.resolution:.3g} "
            f"Hz apart, interpolated {self.peak.interpolated:.6g} Hz",
            f"damping ratio, fit: {self.damping}",
        ]
        if self.decrement_zeta is not None:
            rows.append(f"damping ratio, decrement: {damping_verdict(self.decrement_zeta)}")
        unit = "" if self.unit == "1" else f" {self.unit}"
        rows.append(
            f"amplitude {self.amplitude:.4g}{unit}, residual {self.residual:.3g}{unit}, "
            f"correlation of residuals {self.serial:.2f}"
        )
        return "\n".join(rows)


def damping_verdict(zeta: Estimate) -> str:
    """Return a damping ratio in words, or its upper bound if it is too small to measure.

    Examples
    --------
    >>> damping_verdict(Estimate(6.9e-9, 8e-8))
    'too small to measure: (7 ± 80)e-9 includes zero; below 1.6e-07 at 95 %'
    >>> damping_verdict(Estimate(0.0123, 0.0002))
    '0.01230 ± 0.00020'
    """
    low, high = zeta.interval(CONFIDENCE_LEVEL)
    if low > 0.0:
        return str(zeta)
    if high <= 0.0:
        return f"{zeta} is negative: the motion grows, or is not a free vibration"
    return f"too small to measure: {zeta} includes zero; below {high:.2g} at 95 %"


def free_vibration(series: Series) -> FreeVibration:
    """Return frequency and damping of a free vibration.

    Parameters
    ----------
    series : Series
        Signal from the release on, or later, of at least three periods.

    Raises
    ------
    EvaluationError
        If the signal has fewer periods, or is not a damped sine.
    """
    peak = fourier_peak(series)
    t, x = series.time - series.time[0], series.values
    y = _fitted(t, x, 2.0 * math.pi * peak.interpolated)
    model, J = _damped_sine(t, y), _jacobian(t, y)
    rest = x - model
    n = len(x)
    explained = 1.0 - float(rest @ rest) / float(((x - x.mean()) ** 2).sum())
    if explained < EXPLAINED_POWER_MIN:
        raise EvaluationError(
            f"{series.source}: a damped sine explains {100 * max(explained, 0.0):.0f} % of "
            f"{series.name}: choose a part of free vibration (Series.between)"
        )
    residual = math.sqrt(float(rest @ rest) / (n - len(y)))
    serial = serial_correlation(rest)
    wider = widening(serial, n)
    c, a, b, decay, omega = y
    scale = np.linalg.norm(J, axis=0)
    covariance = np.linalg.pinv((J / scale).T @ (J / scale)) / np.outer(scale, scale)
    covariance = covariance * (wider * residual) ** 2
    natural = math.hypot(decay, omega)
    freedom = n - len(y)

    def estimate(value: float, by_decay: float, by_omega: float, unit: str = "") -> Estimate:
        g = np.array([by_decay, by_omega])
        u = math.sqrt(max(0.0, float(g @ covariance[3:, 3:] @ g)))
        return Estimate(value, u, unit, freedom)

    turn = 2.0 * math.pi
    amplitude = math.hypot(a, b)
    decrement = _decrement(t, x - c, turn / omega, max(residual, 1e-12 * amplitude))
    return FreeVibration(
        estimate(natural / turn, decay / natural / turn, omega / natural / turn, "Hz"),
        estimate(omega / turn, 0.0, 1.0 / turn, "Hz"),
        estimate(decay / natural, omega**2 / natural**3, -decay * omega / natural**3),
        decrement, _decrement_zeta(decrement),
        amplitude, float(c), residual, serial, peak, series.unit,
    )  # fmt: skip


def _damped_sine(t: Real, y: Real) -> Real:
    """Return c + exp(-decay t) (a cos omega t + b sin omega t) for y = (c, a, b, decay, omega)."""
    c, a, b, decay, omega = y
    result: Real = c + np.exp(-decay * t) * (a * np.cos(omega * t) + b * np.sin(omega * t))
    return result


def _jacobian(t: Real, y: Real) -> Real:
    """Return the derivatives of the damped sine with respect to y, (m, 5)."""
    _, a, b, decay, omega = y
    envelope = np.exp(-decay * t)
    cos, sin = envelope * np.cos(omega * t), envelope * np.sin(omega * t)
    columns = [np.ones_like(t), cos, sin, -t * (a * cos + b * sin), t * (b * cos - a * sin)]
    return np.column_stack(columns)


def _linear_part(t: Real, x: Real, decay: float, omega: float) -> tuple[Real, float]:
    """Return the best (c, a, b) for a decay and a frequency, and the sum of squared residuals."""
    J = _jacobian(t, np.array([0.0, 0.0, 0.0, decay, omega]))[:, :3]
    best = np.asarray(np.linalg.lstsq(J, x, rcond=None)[0], np.float64)
    rest = x - J @ best
    return best, float(rest @ rest)


def _fitted(t: Real, x: Real, omega: float) -> Real:
    """Return (c, a, b, decay, omega) of the damped sine of least squares."""
    starts = [decay / t[-1] for decay in START_DECAYS]
    decay = min(starts, key=lambda one: _linear_part(t, x, one, omega)[1])
    start = np.array([*_linear_part(t, x, decay, omega)[0], decay, omega])
    size = max(math.hypot(start[1], start[2]), 1e-300)
    scale = np.array([size, size, size, 1.0 / t[-1], 1.0 / t[-1]])

    def residuals(z: Real) -> Real:
        rest: Real = (_damped_sine(t, z * scale) - x) / size
        return rest

    def derivatives(z: Real) -> Real:
        J: Real = _jacobian(t, z * scale) * scale / size
        return J

    found = least_squares(
        residuals, start / scale, derivatives, method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    if not found.success:
        raise EvaluationError(
            f"the damped sine could not be fitted to the record ({found.message}): give a part of "
            "the record in which the vibration decays freely"
        )
    y: Real = found.x * scale
    if y[4] < 0.0:
        y[[2, 4]] *= -1.0
    return y


def _decrement(t: Real, x: Real, period: float, noise: float) -> Estimate | None:
    """Return the logarithmic decrement per period from the peaks on both sides.

    A parabola through the samples within a twelfth of a period of each peak gives its time and
    height.  The decrement is the negative slope of the line through the logarithms of the heights
    over time in periods.
    """
    step = t[-1] / (len(t) - 1)
    half = max(1, round(period / 12.0 / step))
    tops, _ = find_peaks(np.abs(x), distance=max(1, int(0.35 * period / step)))
    places, heights, sizes = [], [], []
    for i in tops:
        if i < half or i + half >= len(t):
            continue
        part = slice(i - half, i + half + 1)
        s = (t[part] - t[i]) / period
        c2, c1, c0 = np.polyfit(s, x[part], 2)
        height = abs(c0 - c1**2 / (4.0 * c2)) if c2 else abs(c0)
        if height < PEAK_NOISE_MIN * noise:
            break
        places.append((t[i] - c1 / (2.0 * c2) * period if c2 else t[i]) / period)
        heights.append(math.log(height))
        sizes.append(height)
    if len(places) < PEAKS_MIN:
        return None
    fit = _weighted_line(np.array(places), np.array(heights), np.array(sizes))
    return Estimate(-fit.value, fit.uncertainty, freedom=fit.freedom)


def _weighted_line(x: Real, y: Real, weight: Real) -> Estimate:
    """Return the slope of the line of least squares with weights proportional to 1/u(y)."""
    w = weight**2
    centre, mean = float(w @ x / w.sum()), float(w @ y / w.sum())
    spread = float(w @ (x - centre) ** 2)
    slope = float(w @ ((x - centre) * (y - mean))) / spread
    rest = y - mean - slope * (x - centre)
    freedom = len(x) - 2
    return Estimate(slope, math.sqrt(float(w @ rest**2) / freedom / spread), freedom=freedom)


def _decrement_zeta(decrement: Estimate | None) -> Estimate | None:
    """Return zeta = delta/sqrt(4 pi^2 + delta^2)."""
    if decrement is None:
        return None
    delta, turn = decrement.value, 2.0 * math.pi
    root = math.hypot(turn, delta)
    u = turn**2 / root**3 * decrement.uncertainty
    return Estimate(delta / root, u, freedom=decrement.freedom)


# --- impacts ------------------------------------------------------------------------------------


def impacts(series: Series) -> Real:
    """Return the times of impacts: kinks of the signal, where its velocity jumps [s].

    At a kink, the deviation of the second difference from the median is more than six times the
    usual deviation, which follows from the median absolute deviation.  Times are accurate to one
    sample.

    Raises
    ------
    EvaluationError
        If there is no impact.
    """
    x = series.values
    second = x[2:] - 2.0 * x[1:-1] + x[:-2]
    second = np.abs(second - np.median(second))
    usual = DEVIATION_PER_MAD * float(np.median(second))
    found, _ = find_peaks(
        np.concatenate([[0.0], second, [0.0]]), height=KINK_FACTOR * usual, distance=3
    )
    if not len(found) or usual == 0.0:
        raise EvaluationError(
            f"{series.source}: no impact in the record: the sharpest kink of {series.name} is "
            f"{float(second.max()) / max(usual, 1e-300):.2g} times the usual second difference, "
            f"less than {KINK_FACTOR:g}; check that the stop was reached, or sample faster"
        )
    times: Real = series.time[found]
    return times
