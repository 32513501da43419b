"""Frequency, damping and impact times from records.

The noise is that of the laser sensor in the thesis.
"""

import dataclasses
import math

import numpy as np
import pytest

from prbm.data.series import Series
from prbm.data.uncertainty import Estimate, EvaluationError
from prbm.data.vibration import damping_verdict, fourier_peak, free_vibration, impacts

RATE, NOISE, FREQUENCY = 750.0, 4e-6, 4.82  # Hz, m, Hz


def vibration(zeta, rng, duration=10.0, amplitude=10e-3, noise=NOISE, frequency=FREQUENCY):
    """Return a record of a damped sine; the frequency is the undamped one."""
    t = np.arange(round(duration * RATE)) / RATE
    omega = 2 * np.pi * frequency
    decay, damped = zeta * omega, omega * math.sqrt(1 - zeta**2)
    phase = rng.uniform(0, 2 * np.pi)
    x = 3e-3 + amplitude * np.exp(-decay * t) * np.cos(damped * t + phase)
    return Series(t, x + noise * rng.standard_normal(len(t)))


@pytest.mark.parametrize("zeta", [1e-4, 1e-3, 1e-2, 0.1, 0.3])
def test_frequency_and_damping_are_recovered(zeta):
    """Frequency within 0.01 Hz; zeta within 10 %, from the fit and from the decrement."""
    found = free_vibration(vibration(zeta, np.random.default_rng(0)))
    assert found.frequency.value == pytest.approx(FREQUENCY, abs=0.01)
    assert found.zeta.value == pytest.approx(zeta, rel=0.1)
    assert found.damping_measurable
    damped = FREQUENCY * math.sqrt(1 - zeta**2)
    assert found.damped_frequency.value == pytest.approx(damped, abs=0.01)
    delta = 2 * np.pi * zeta / math.sqrt(1 - zeta**2)
    assert found.decrement.value == pytest.approx(delta, rel=0.1)
    assert found.decrement_zeta.value == pytest.approx(zeta, rel=0.1)
    assert found.residual == pytest.approx(NOISE, rel=0.05)
    assert "damping ratio, fit" in str(found)


@pytest.mark.parametrize(("unit", "text"), [("m", " m"), ("m/s2", " m/s2"), ("1", "")])
def test_an_amplitude_has_the_unit_of_its_record(unit, text):
    series = dataclasses.replace(vibration(1e-2, np.random.default_rng(0)), unit=unit)
    found = free_vibration(series)
    assert f"amplitude {found.amplitude:.4g}{text}, residual" in str(found)
    assert f"residual {found.residual:.3g}{text}, correlation" in str(found)


def test_a_strongly_damped_motion_has_a_fit_but_no_decrement():
    """At zeta = 0.6, three peaks are above the noise: a half period reduces them to a tenth."""
    found = free_vibration(vibration(0.6, np.random.default_rng(0)))
    assert found.decrement is None
    assert found.decrement_zeta is None
    assert found.zeta.value == pytest.approx(0.6, rel=0.01)


@pytest.mark.parametrize("zeta", [6.88e-9, 0.0])
def test_damping_below_its_uncertainty_is_too_small_to_measure(zeta):
    """The 6.88e-9 of the thesis is a tenth of 8e-8, the uncertainty from 10 s of its laser signal.

    The Cramer-Rao bound of the decay of a sine is u = (noise/amplitude) sqrt(2/n) sqrt(12)/T.
    """
    count = 0
    for seed in range(20):
        series = vibration(zeta, np.random.default_rng(seed))
        found = free_vibration(series)
        bound = NOISE / 10e-3 * math.sqrt(2 / 7500) * math.sqrt(12) / 10 / (2 * np.pi * FREQUENCY)
        assert found.zeta.uncertainty == pytest.approx(bound, rel=0.1)
        count += found.damping.startswith("too small to measure") or "negative" in found.damping
        if found.damping.startswith("too small"):
            assert found.zeta.interval()[1] > zeta
            assert not found.damping_measurable
    assert count >= 17, "at 95 %, one interval in forty is above zero"


@pytest.mark.slow
def test_uncertainties_cover_the_true_values():
    """Each interval includes its true value in 68.3 % of 200 draws, -+ 3 standard deviations."""
    rng = np.random.default_rng(1)
    hits = dict.fromkeys(("frequency", "zeta", "decrement", "zeta by decrement"), 0)
    for _ in range(200):
        found = free_vibration(vibration(2e-3, rng, 3.0, 1e-3))
        delta = 2 * np.pi * 2e-3
        hits["frequency"] += abs(found.frequency.value - FREQUENCY) < found.frequency.uncertainty
        hits["zeta"] += abs(found.zeta.value - 2e-3) < found.zeta.uncertainty
        by_peaks = found.decrement_zeta
        hits["zeta by decrement"] += abs(by_peaks.value - 2e-3) < by_peaks.uncertainty
        hits["decrement"] += abs(found.decrement.value - delta) < found.decrement.uncertainty
    for name, count in hits.items():
        assert 0.585 < count / 200 < 0.781, name


@pytest.mark.slow
def test_confidence_intervals_of_no_damping_include_zero_at_the_stated_level():
    """Of 200 intervals 190 include zero, -+ 3 standard deviations of 3.1."""
    rng = np.random.default_rng(2)
    zeros = sum(
        free_vibration(vibration(0.0, rng, 2.0, 1e-3)).zeta.includes_zero() for _ in range(200)
    )
    assert 181 <= zeros <= 199


@pytest.mark.parametrize("duration", [2.0, 5.3, 16.7])
def test_the_spectral_peak_is_within_its_resolution(duration):
    """The errors are up to 1/2 of a line distance for the highest line, 2 % for the parabola."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        frequency = FREQUENCY + rng.uniform(-0.5, 0.5)
        series = vibration(1e-4, rng, duration, frequency=frequency)
        found = fourier_peak(series)
        assert found.resolution == pytest.approx(1 / duration, rel=1e-9)
        assert abs(found.frequency.value - frequency) <= 0.52 * found.resolution
        assert found.frequency.uncertainty == pytest.approx(found.resolution / math.sqrt(12))
        assert abs(found.interpolated - frequency) <= 0.02 * found.resolution


def test_a_record_of_17_s_has_the_spectral_resolution_of_the_thesis():
    """The spectral lines are 0.06 Hz apart; the thesis states 4.82 Hz -+ 0.06 Hz."""
    found = fourier_peak(vibration(1e-4, np.random.default_rng(4), 1 / 0.06))
    assert found.resolution == pytest.approx(0.06, rel=1e-3)


def test_rounded_sampling_times_give_the_exact_frequency():
    """The values are those at the rounded times, which the fit uses."""
    rng = np.random.default_rng(5)
    t = np.round(np.arange(3000) / RATE, 3)
    x = 1e-2 * np.exp(-0.03 * t) * np.cos(2 * np.pi * FREQUENCY * t)
    found = free_vibration(Series(t, x + NOISE * rng.standard_normal(3000)))
    assert found.damped_frequency.value == pytest.approx(FREQUENCY, abs=1e-4)


def test_quantised_readings_have_the_uncertainty_of_rounding():
    """Steps of 4 um are noise of 4 um/sqrt(12)."""
    t = np.arange(7500) / RATE
    x = 1e-2 * np.exp(-0.1 * t) * np.cos(2 * np.pi * FREQUENCY * t)
    found = free_vibration(Series(t, np.round(x / 4e-6) * 4e-6))
    assert found.residual == pytest.approx(4e-6 / math.sqrt(12), rel=0.05)
    assert found.damped_frequency.value == pytest.approx(FREQUENCY, abs=1e-5)


def test_a_second_mode_increases_the_uncertainty():
    """The residuals of the omitted mode are correlated from sample to sample."""
    rng = np.random.default_rng(6)
    series = vibration(1e-3, rng)
    second = 2e-4 * np.cos(2 * np.pi * 20.0 * series.time)
    found = free_vibration(Series(series.time, series.values + second))
    plain = free_vibration(series)
    assert found.serial > 0.9
    assert found.frequency.uncertainty > 100 * plain.frequency.uncertainty
    assert abs(found.frequency.value - FREQUENCY) < 3 * found.frequency.uncertainty


INVALID = {
    "still": (np.full(200, 3e-3), "does not change"),
    "drift": (np.linspace(0, 1, 200), "periods or less"),
    "one period": (np.cos(np.linspace(0, 2 * np.pi, 200)), "periods or less"),
    "noise": (np.random.default_rng(7).standard_normal(2000), "explains"),
}


@pytest.mark.parametrize("name", INVALID)
def test_records_without_a_vibration_are_rejected(name):
    x, message = INVALID[name]
    with pytest.raises(EvaluationError, match=message) as caught:
        free_vibration(Series(np.arange(len(x)) / RATE, x, source="record.csv"))
    assert str(caught.value).startswith("record.csv: ")


def test_the_damping_of_a_growing_motion_is_reported_as_negative():
    found = free_vibration(vibration(-1e-3, np.random.default_rng(8)))
    assert "negative" in found.damping
    assert not found.damping_measurable
    assert "negative" in damping_verdict(Estimate(-1e-3, 1e-5))


# --- impacts ------------------------------------------------------------------------------------


def bouncing(restitution=0.6, noise=NOISE, height=15e-3, count=5):
    """Return the impact times and the record of a bouncing ball, in closed form."""
    g = 9.81
    fall = math.sqrt(2 * height / g)
    when = [fall]
    speeds = [g * fall]
    for _ in range(count - 1):
        speeds.append(restitution * speeds[-1])
        when.append(when[-1] + 2 * speeds[-1] / g)
    t = np.arange(round((when[-1] + 0.02) * RATE)) / RATE
    x = height - g * t**2 / 2
    for hit, speed in zip(when, speeds, strict=True):
        after = t >= hit
        s = t[after] - hit
        x[after] = restitution * speed * s - g * s**2 / 2
    rng = np.random.default_rng(9)
    return np.array(when), Series(t, x + noise * rng.standard_normal(len(t)))


def test_impact_times_of_a_bouncing_ball_are_found_to_a_sample():
    """All bounces are found, down to a speed of 0.07 m/s."""
    when, series = bouncing()
    assert impacts(series) == pytest.approx(when, abs=1.01 / RATE)


def test_a_record_without_impact_is_rejected():
    with pytest.raises(EvaluationError, match="no impact in the record"):
        impacts(vibration(1e-3, np.random.default_rng(10)))
    with pytest.raises(EvaluationError, match="no impact in the record"):
        impacts(vibration(1e-3, np.random.default_rng(10), noise=0.0))
    with pytest.raises(EvaluationError, match="no impact in the record"):
        impacts(Series(np.arange(100) / RATE, np.zeros(100)))
