"""Young's modulus, hysteresis and calibration from records with the noise of real sensors."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from prbm.data.measurement import (
    STIFFENING,
    Beam,
    beam_table,
    calibrate,
    hysteresis,
    turning_points,
    youngs_modulus,
)
from prbm.data.series import Series
from prbm.data.uncertainty import Estimate, EvaluationError, line, power_law
from prbm.plots.measurement import bending_figure

E, LENGTH, WIDTH, THICKNESS = 181.5e9, 40e-3, 8e-3, 0.1e-3  # Steel flexures of the thesis.
CELL_NOISE = 1e-3  # N; 0.2 % of the range 0 to 0.5 N of the load cell.
STIFFNESS = E * WIDTH * THICKNESS**3 / (4 * LENGTH**3)


def beam(u_length=0.0, u_width=0.0, u_thickness=0.0, name="1"):
    return Beam(
        name, Estimate(LENGTH, u_length), Estimate(WIDTH, u_width), Estimate(THICKNESS, u_thickness)
    )


def bent(rng, samples=600, cycles=1, noise=CELL_NOISE, loss=0.0, largest=3e-3):
    """Return deflection and force of loading cycles, with offsets and negative force."""
    phase = np.linspace(0.0, 2 * np.pi * cycles, samples)
    d = largest * (1 - np.cos(phase)) / 2
    back = np.sin(phase) < 0.0
    F = STIFFNESS * d * np.where(back, 1 - loss * (1 - d / largest), 1.0)
    return d + 1e-3, -(F + 0.02) + noise * rng.standard_normal(samples)


def test_youngs_modulus_is_recovered_within_a_percent():
    """The forces of up to 17 mN have a noise of 1 mN; the flexure of 5.7 N/m is bent by 3 mm."""
    d, F = bent(np.random.default_rng(0), 12000, 10)
    found = youngs_modulus(d, F, beam(), window=10)
    assert found.modulus.value == pytest.approx(E, rel=0.01)
    assert found.modulus.relative < 0.005
    assert found.stiffness.value == pytest.approx(STIFFNESS, rel=0.01)
    (note,) = found.notes
    assert "so that the ± includes the scatter of the fit only" in note
    assert "E = (18" in str(found)
    assert len(bending_figure(found).axes) == 1


def test_youngs_modulus_is_exact_without_noise():
    """Order of the samples, fit window, and the sensor's sign, zero and angle have no effect."""
    d, F = bent(np.random.default_rng(0), noise=0.0)
    for options in (
        {}, {"window": 7}, {"fit_range": (0.0, 1.0)}, {"force_gain": Estimate(1.0, 0.01)},
    ):  # fmt: skip
        assert youngs_modulus(d, F, beam(), **options).modulus.value == pytest.approx(E, rel=1e-9)
    tilted = youngs_modulus(d, F * math.cos(math.radians(30)), beam(), sensor_angle=30.0)
    assert tilted.modulus.value == pytest.approx(E, rel=1e-9)
    shuffled = np.random.default_rng(1).permutation(len(d))
    assert youngs_modulus(d[shuffled], F[shuffled], beam()).modulus.value == pytest.approx(
        E, rel=1e-9
    )


def test_dimensions_in_mm_taken_as_metres_are_noted():
    """E is proportional to l^3/(b h^3), so that it is a thousandth of the true value."""
    d, F = bent(np.random.default_rng(0))
    sizes = (Estimate(1e3 * x, 0.0) for x in (LENGTH, WIDTH, THICKNESS))
    found = youngs_modulus(d, F, Beam("1", *sizes))
    assert found.modulus.value == pytest.approx(1e-3 * E, rel=0.05)
    assert any("40 m long" in note and "give 40 mm" in note for note in found.notes)


@pytest.mark.parametrize("factor", [1e3, 1e-9])
def test_a_modulus_outside_the_range_of_solids_is_noted(factor):
    """The cause may be a force in mN taken as N."""
    d, F = bent(np.random.default_rng(0))
    assert any("no solid" in note for note in youngs_modulus(d, factor * F, beam()).notes)


def test_the_uncertainty_of_the_fit_covers_the_true_modulus():
    """The interval includes E in 68.3 % of 200 draws, -+ 3 standard deviations of the number."""
    rng = np.random.default_rng(2)
    hits = 0
    for _ in range(200):
        d, F = bent(rng)
        found = youngs_modulus(d, F, beam(), window=3).modulus
        hits += abs(found.value - E) < found.uncertainty
    assert 0.585 < hits / 200 < 0.781


def test_the_uncertainty_includes_the_dimensions():
    """Each draw has other measured dimensions, normally distributed about the true ones."""
    rng = np.random.default_rng(3)
    u = (0.05e-3, 0.02e-3, 0.5e-6)
    hits = 0
    for _ in range(200):
        d, F = bent(rng, noise=3e-4)
        l, b, h = (
            x + ux * rng.standard_normal()
            for x, ux in zip((LENGTH, WIDTH, THICKNESS), u, strict=True)
        )
        one = Beam("", Estimate(l, u[0]), Estimate(b, u[1]), Estimate(h, u[2]))
        found = youngs_modulus(d, F, one)
        hits += abs(found.modulus.value - E) < found.modulus.uncertainty
    assert 0.585 < hits / 200 < 0.781
    assert max(found.budget, key=found.budget.get) == "thickness"
    assert found.budget["thickness"] == pytest.approx(3 * 0.005, rel=0.02)
    assert found.budget["length"] == pytest.approx(3 * 0.05 / 40, rel=0.01)


def test_points_of_one_x_are_rejected():
    """Round-off can make the spread of equal numbers about their mean positive."""
    x = 0.5e-3 + np.array([0.0, 1.0, 0.0, 1.0]) * np.spacing(0.5e-3)
    for n in (3, 4, 7, 10):
        with pytest.raises(EvaluationError, match=r"points are at x = 0\.0003: give points"):
            line(np.full(n, 0.3e-3), np.arange(float(n)))
    with pytest.raises(EvaluationError, match=r"does not change, it is 0\.0005 m"):
        youngs_modulus(x, np.arange(4.0), beam())


def test_dimensions_without_uncertainty_are_noted():
    """The note lists the contributions that the ± includes."""
    d, F = bent(np.random.default_rng(0), 12000, 10)
    sizes = dict(zip(("u_length", "u_width", "u_thickness"), (5e-5, 2e-5, 5e-7), strict=True))
    assert youngs_modulus(d, F, beam(**sizes), window=10).notes == ()
    (note,) = youngs_modulus(d, F, beam(), window=10).notes
    assert note.startswith("length, width and thickness have no uncertainty")
    (note,) = youngs_modulus(
        d, F, beam(**sizes | {"u_width": 0.0}), window=10, force_gain=Estimate(1.0, 0.01)
    ).notes
    assert note.startswith("width has no uncertainty, so that the ± includes the scatter")
    assert "the fit, length, thickness and force gain only; give an uncertainty" in note


def test_the_uncertainty_of_the_sensor_angle_contributes_by_its_tangent():
    """The force is divided by cos a for a sensor angle a, and d(1/cos a)/(1/cos a) = tan a da."""
    d, F = bent(np.random.default_rng(0), noise=0.0)
    found = youngs_modulus(d, F, beam(), sensor_angle=Estimate(30.0, 1.0))
    expected = math.tan(math.radians(30)) * math.radians(1.0)
    assert found.budget["sensor angle"] == pytest.approx(expected, rel=1e-12)


def elastica(alpha):
    """Return the ratio of tip deflection to length under P l^2/EI = alpha, by shooting."""

    def end(curvature):
        run = solve_ivp(
            lambda s, y: [y[1], -alpha * np.cos(y[0]), np.sin(y[0])], (0, 1), [0, curvature, 0],
            rtol=1e-11, atol=1e-13,
        )  # fmt: skip
        return run.y[:, -1]

    return end(brentq(lambda c: end(c)[1], 0, 2 * alpha, xtol=1e-14))[2]


def test_the_stiffening_coefficient_is_that_of_the_elastica():
    """F l^2/EI = 3 r (1 + 36/35 r^2 + ...), r = d/l; the next term is about 1.2 r^4."""
    for alpha in (0.03, 0.1, 0.3):
        r = elastica(alpha)
        assert (alpha / 3 / r - 1) / r**2 == pytest.approx(STIFFENING, abs=1.3 * r**2)


@pytest.mark.slow
def test_large_deflections_are_noted_with_their_error():
    """The stated stiffening is the error of E from forces of the elastica."""
    alphas = np.linspace(0.0, 0.9, 30)[1:]
    d = np.array([elastica(alpha) for alpha in alphas]) * LENGTH
    F = alphas * E * WIDTH * THICKNESS**3 / 12 / LENGTH**2
    d, F = np.append(0.0, d), np.append(0.0, F)
    found = youngs_modulus(d, F, beam(), fit_range=(0.0, 1.0))
    assert found.modulus.value / E - 1 == pytest.approx(found.stiffening, rel=0.15)
    assert found.stiffening > 0.05
    assert any("of the length" in note for note in found.notes)
    assert any("deviate from a line" in note for note in found.notes)
    small = youngs_modulus(d[:6], F[:6], beam(), fit_range=(0.0, 1.0))
    assert abs(small.modulus.value / E - 1) < 0.01
    assert not any("of the length" in note for note in small.notes)


def test_the_loss_of_a_cycle_is_the_area_of_the_loop():
    """The force k d is reduced by the share c (1 - r) in unloading, where r = d/d_max.

    The lost share of the work is c/3: the integrals of r c (1 - r) and r over r are c/6 and 1/2.
    """
    for cycles in (1, 4):
        d, F = bent(np.random.default_rng(4), 4000, cycles, noise=0.0, loss=0.3)
        loops = hysteresis(d, F)
        assert len(loops) == cycles
        for loop in loops:
            assert loop.fraction == pytest.approx(0.1, abs=1e-3)  # 1000 points per cycle
            assert loop.work == pytest.approx(STIFFNESS * 3e-3**2 / 2, rel=1e-3)
    noisy = hysteresis(*bent(np.random.default_rng(4), 4000, 4, noise=3e-4, loss=0.3))
    assert [loop.fraction for loop in noisy] == pytest.approx([0.1] * 4, abs=0.02)
    assert hysteresis(*bent(np.random.default_rng(4), 600, 0.5)) == ()


def test_different_branches_of_a_cycle_are_noted():
    """With a loss of 10 % of the work, E is between the moduli of the two branches."""
    d, F = bent(np.random.default_rng(4), 4000, 1, noise=1e-5, loss=0.3)
    both, up, down = (
        youngs_modulus(d[part], F[part], beam())
        for part in (slice(None), slice(2000), slice(2000, None))
    )
    assert up.modulus.value == pytest.approx(E, rel=1e-3)
    assert up.modulus.value < both.modulus.value < down.modulus.value
    assert both.loss == pytest.approx(0.1, abs=0.01)
    assert any("10 % of the work is lost" in note for note in both.notes)
    assert up.loss is None
    assert not any("lost" in note for note in up.notes)


def test_turning_points_ignore_noise():
    phase = np.linspace(0, 6 * np.pi, 900)
    x = -np.cos(phase) + 0.05 * np.random.default_rng(5).standard_normal(900)
    turns = turning_points(x, 0.4)
    assert np.diff(turns) == pytest.approx(150, abs=15)
    assert len(turns) == 7


def test_a_table_of_beams_has_mean_and_scatter():
    """The mean of n values of deviation s has the uncertainty s/sqrt(n)."""
    rng = np.random.default_rng(6)
    found = [youngs_modulus(*bent(rng, cycles=2, loss=0.3), beam(name=str(i))) for i in range(5)]
    table = beam_table(found)
    values = [one.modulus.value for one in found]
    assert table.mean.value == pytest.approx(np.mean(values), rel=1e-12)
    assert table.mean.uncertainty == pytest.approx(np.std(values, ddof=1) / math.sqrt(5), rel=1e-12)
    assert table.mean.freedom == 4
    assert str(table).count("\n") == 6
    assert 0.3 < table.excess < 3.0, "the stated uncertainty explains the scatter of noise"
    with pytest.raises(EvaluationError, match="two beams"):
        beam_table(found[:1])


INVALID = {
    "pairs": ({"force": np.zeros(3)}, "pairs"),
    "not a number": ({"force": np.array([1.0, np.nan] * 30)}, r"force\[1\] = nan"),
    "units": ({"deflection": np.linspace(0, 4, 60)}, "longer than the beam"),
    "range": ({"fit_range": (0.9, 0.2)}, "fit_range"),
    "window": ({"window": 0}, "window"),
    "wide window": ({"window": 40}, "window"),
    "narrow": ({"fit_range": (0.5, 0.501)}, "three|3 points"),
    "angle": ({"sensor_angle": 90.0}, "sensor_angle"),
    "no stiffness": ({"force": np.tile([1e-3, -1e-3], 30)}, "no stiffness"),
    "still": ({"deflection": np.zeros(60)}, "the deflection does not change"),
}


@pytest.mark.parametrize("name", INVALID)
def test_data_without_a_modulus_are_rejected(name):
    options, message = INVALID[name]
    data = {"deflection": np.linspace(0, 4e-3, 60), "force": np.linspace(0, 0.02, 60)} | options
    with pytest.raises(EvaluationError, match=message):
        youngs_modulus(beam=beam(), **data)


def test_dimensions_of_a_beam_must_be_positive():
    with pytest.raises(EvaluationError, match="width = 0 m must be positive"):
        Beam("x", Estimate(1.0, 0.0), Estimate(0.0, 0.0), Estimate(1.0, 0.0))


# --- calibration --------------------------------------------------------------------------------


def stage(rng, n=60, noise=4e-6):
    """Return positions of a stage over 2.5 mm and the volts of a sensor of 200 V/m."""
    x = np.linspace(0.0, 2.5e-3, n)
    return x, 1.3 + 200.0 * (x + noise * rng.standard_normal(n))


def test_the_uncertainties_of_a_calibration_cover_the_true_values():
    """The gain and a calibrated position lie within one standard uncertainty in 68 % of draws."""
    rng = np.random.default_rng(7)
    gains = positions = 0
    at = 1.3 + 200.0 * 2e-3
    for _ in range(200):
        sensor = calibrate(*stage(rng))
        gains += abs(sensor.gain.value - 1 / 200.0) < sensor.gain.uncertainty
        reading = np.array([at])
        error = abs(sensor(reading)[0] - 2e-3)
        positions += error < sensor.uncertainty(reading)[0]
    assert 0.585 < gains / 200 < 0.781
    assert 0.585 < positions / 200 < 0.781
    assert sensor.residual == pytest.approx(4e-6, rel=0.3)
    assert sensor.gain.unit == "m/V"
    assert sensor.sensitivity.value == pytest.approx(200.0, rel=0.01)
    assert "gain" in str(sensor)


def test_a_calibration_converts_a_record_from_volts_to_metres():
    x, volts = stage(np.random.default_rng(8), noise=0.0)
    sensor = calibrate(x, volts)
    series = Series(np.arange(60) / 750, volts, "laser", "V", "record.csv")
    length = sensor.applied(series)
    np.testing.assert_allclose(length.values, x, atol=1e-15)
    assert (length.unit, length.name) == ("m", "laser")
    with pytest.raises(
        EvaluationError, match="laser is in m, but the calibration is for readings in V"
    ):
        sensor.applied(length)


def test_a_nonlinear_characteristic_is_reported():
    x, volts = stage(np.random.default_rng(8))
    sensor = calibrate(x, volts + 2e3 * (x - 1.25e-3) ** 2)
    assert "not linear" in str(sensor)
    assert "not linear" not in str(calibrate(x, volts))
    assert sensor.nonlinearity > 1e-6


def test_a_reading_independent_of_the_quantity_is_rejected():
    rng = np.random.default_rng(9)
    with pytest.raises(EvaluationError, match="does not change with the quantity"):
        calibrate(np.linspace(0, 1, 50), rng.standard_normal(50))
    with pytest.raises(EvaluationError, match="pairs"):
        calibrate(np.zeros(3), np.zeros(4))
    with pytest.raises(EvaluationError, match="3 points or more"):
        calibrate(np.array([0.0, 1.0]), np.array([0.0, 1.0]))


# --- lines and estimates ------------------------------------------------------------------------


def test_correlated_residuals_increase_the_uncertainty():
    """With autoregressive errors of r = 0.8, plain uncertainties cover a third of 200 draws."""
    rng = np.random.default_rng(10)
    x = np.linspace(0, 1, 300)
    hits = plain = 0
    for _ in range(200):
        noise = np.zeros(300)
        for i in range(1, 300):
            noise[i] = 0.8 * noise[i - 1] + rng.standard_normal()
        fit = line(x, 2.0 * x + noise)
        hits += abs(fit.slope.value - 2.0) < fit.slope.uncertainty
        narrow = fit.residual / math.sqrt(((x - x.mean()) ** 2).sum())
        plain += abs(fit.slope.value - 2.0) < narrow
    assert 0.585 < hits / 200 < 0.781
    assert plain / 200 < 0.4


def test_the_uncertainty_of_a_power_law_is_that_of_random_samples():
    """The law is y = 3 x^2/z; the deviation of 1e5 random draws agrees to 1 %."""
    rng = np.random.default_rng(11)
    x, z = Estimate(2.0, 0.02), Estimate(5.0, 0.05)
    y, _ = power_law({"x": (x, 2.0), "z": (z, -1.0)}, 3.0)
    draws = 3.0 * rng.normal(2.0, 0.02, 100_000) ** 2 / rng.normal(5.0, 0.05, 100_000)
    assert y.uncertainty == pytest.approx(draws.std(), rel=0.01)
    assert y.value == pytest.approx(2.4, rel=1e-12)


def test_degrees_of_freedom_follow_welch_and_satterthwaite():
    """u^4/sum(u_i^4/v_i): two equal contributions of 4 degrees of freedom give 8."""
    part = Estimate(1.0, 0.01, freedom=4)
    y, _ = power_law({"a": (part, 1.0), "b": (part, 1.0)})
    assert y.freedom == pytest.approx(8.0, rel=1e-12)


@pytest.mark.parametrize("wrong", [(math.nan, 1.0), (1.0, -1.0), (1.0, math.nan), (math.inf, 0.0)])
def test_invalid_estimates_are_rejected(wrong):
    with pytest.raises(EvaluationError, match="invalid estimate"):
        Estimate(*wrong)


@pytest.mark.parametrize(
    ("estimate", "text"),
    [
        (Estimate(1.5e11, 2.5e9, "Pa"), "(150.0 ± 2.5)e9 Pa"),
        (Estimate(0.6, 0.0123), "0.600 ± 0.012"),
        (Estimate(4.9071234, 0.00045, "Hz"), "4.90712 ± 0.00045 Hz"),
        (Estimate(2.0, math.inf), "2 (not determined)"),
        (Estimate(0.0, 0.0), "0.000000 ± 0.000000"),
        (Estimate(-3e-4, 2e-5, "m"), "(-300 ± 20)e-6 m"),
    ],
)
def test_estimates_are_printed_with_two_digits_of_uncertainty(estimate, text):
    assert str(estimate) == text


def test_a_beam_as_thick_as_long_is_rejected():
    """0.1 mm taken as 0.1 m would make E a billion times too small."""
    with pytest.raises(
        EvaluationError, match=r"thickness = 0\.1 m is not less than length = 0\.04 m"
    ):
        Beam("1", Estimate(40e-3, 0.0), Estimate(8e-3, 0.0), Estimate(0.1, 0.0))


@pytest.mark.parametrize("gain", [0.0, -1.0])
def test_a_force_gain_must_be_positive(gain):
    d, F = bent(np.random.default_rng(0))
    with pytest.raises(EvaluationError, match=r"force_gain = .* must be positive"):
        youngs_modulus(d, F, beam(), force_gain=Estimate(gain, 0.0))
