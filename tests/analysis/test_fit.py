"""Parameters fitted to frequencies, responses and forces, and undetermined parameters."""

import dataclasses
import math
import re
from functools import cache

import numpy as np
import pytest
from matplotlib.text import Text
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from prbm.analysis.fit import (
    Fit,
    ForceDeflection,
    Free,
    Frequency,
    Response,
    Valley,
    fit,
    fitted_restitution,
    valley,
)
from prbm.base.errors import ParameterError
from prbm.data.series import Series
from prbm.data.uncertainty import Estimate, EvaluationError
from prbm.drawing.style import png
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modal_restitution, modes
from prbm.mechanics.statics import equilibrium
from prbm.plots.fit import force_figure, response_figure, valley_figure
from support import PMMA, ScalarGuide, mechanism

RATE, NOISE = 750.0, 4e-6  # Hz, m; of the laser in the thesis
K = "flexure.K_theta"
F5 = Frequency(Estimate(5.0, 0.01))
DROPPED = {"release.displacement": -0.01, "damping.beta": 0.0, K: 2.5449}


def guide(values):
    """Return the 1R guide as a scalar equation."""
    return ScalarGuide.of(mechanism("PRBDM").values(values))


def frequency(values):
    """Return the frequency at rest of the scalar equation [Hz]: m r^2 w^2 = 4 k + m g r sin phi."""
    one = guide(values)
    rest = brentq(lambda phi: 4 * one.k * phi - one.mass * one.g * one.r * math.cos(phi), 0, 1.5)
    stiffness = 4 * one.k + one.mass * one.g * one.r * math.sin(rest)
    return math.sqrt(stiffness / one.mass) / one.r / (2 * math.pi)


@cache
def record(restitution, duration=0.2, wall=0.0, seed=0, shift=0.0, noise=NOISE):
    """Return the response of the scalar equation with Newton impacts, by SciPy's DOP853."""
    one = guide(DROPPED)
    t = np.arange(round(duration * RATE)) / RATE
    at = math.asin(wall / one.r)

    def rate(_, y):
        turn = -4 * one.k * y[0] + one.mass * one.g * one.r * math.cos(y[0])
        return [y[1], turn / (one.mass * one.r**2)]

    def hit(_, y):
        return y[0] - at

    hit.terminal, hit.direction = True, 1.0
    start, state, x = 0.0, [math.asin(-0.01 / one.r), 0.0], np.zeros(len(t))
    while start < duration + shift:
        run = solve_ivp(
            rate, (start, duration + shift), state, "DOP853", dense_output=True, events=hit,
            rtol=1e-11, atol=1e-13, max_step=2e-3,
        )  # fmt: skip
        inside = (t + shift >= start) & (t + shift <= run.t[-1])
        if inside.any():
            x[inside] = one.r * np.sin(run.sol(t[inside] + shift)[0])
        start, speed = run.t[-1], run.y[1, -1]
        if abs(speed) * one.r * math.cos(at) < 1e-3:  # stop.rest_speed
            break
        state = [at - 1e-15, -restitution * speed]
    x[t + shift > start] = wall
    return Series(t, x + noise * np.random.default_rng(seed).standard_normal(len(t)))


# --- frequencies --------------------------------------------------------------------------------


@pytest.mark.parametrize("measured", [5.6375, 5.6348])
def test_k_theta_of_the_pmma_guide_fits_to_2_545(measured):
    """Our finite elements give 5.6375 Hz, those of the thesis 5.6348 Hz: K_theta = 2.545 -+ 0.01.

    Without gravity the frequency is proportional to sqrt(K_theta): the fit has a closed form.
    """
    found = fit(mechanism("PRBDM"), [K], Frequency(Estimate(measured, 5e-5)), PMMA)
    expected = 2.65 * (measured / frequency(PMMA)) ** 2
    assert found[K].value == pytest.approx(expected, rel=1e-8)
    assert found[K].value == pytest.approx(2.545, abs=0.01)
    assert found[K].relative == pytest.approx(2 * 5e-5 / measured, rel=1e-6)
    assert found.identifiable
    assert found.notes == ()
    assert found.values[K] == found[K].value


def test_k_theta_of_the_steel_guide_fits_to_2_586():
    """Finite elements give 4.907 Hz at rest; K_theta is above the 2.545 of the straight PMMA guide.

    Gravity deflects the steel guide by a quarter of its length, which stiffens it, and the 1R model
    underestimates this effect.
    """
    found = fit(mechanism("PRBDM"), [K], Frequency(Estimate(4.907, 5e-4)))
    expected = brentq(lambda k: frequency({K: k}) - 4.907, 2.0, 3.0, xtol=1e-13)
    assert found[K].value == pytest.approx(expected, rel=1e-8)
    assert found[K].value == pytest.approx(2.586, abs=1e-3)


@pytest.mark.slow
def test_fits_to_frequencies_of_held_shapes_and_higher_modes_recover_the_parameters():
    """The data are the engine's frequencies for known parameters."""
    m, truth = mechanism("PRBDM2R"), {"flexure.K_theta1": 3.9, "flexure.K_theta2": 1.9}
    system = assemble(m, m.values(truth))
    targets = []
    for mode, displacement in ((1, 0.005), (2, 0.005), (1, None), (2, None)):
        f = modes(system, equilibrium(system, displacement)).frequency[mode - 1]
        targets.append(Frequency(Estimate(float(f), 1e-4 * f), mode, displacement))
    found = fit(m, list(truth), targets)
    for name, value in truth.items():
        assert found[name].value == pytest.approx(value, rel=1e-6)
    assert found.identifiable
    assert found.freedom == 2
    assert list(found.rms) == [target.label for target in targets]


@pytest.mark.slow
def test_stated_uncertainties_of_a_fit_cover_the_truth():
    """The interval includes K_theta in 68.3 % of 200 draws, -+ 3 standard deviations."""
    rng = np.random.default_rng(0)
    truth = frequency({K: 2.6})
    hits = 0
    for _ in range(200):
        target = Frequency(Estimate(truth + 0.01 * rng.standard_normal(), 0.01))
        found = fit(mechanism("PRBDM"), [K], target)[K]
        hits += abs(found.value - 2.6) < found.uncertainty
    assert 0.585 < hits / 200 < 0.781


# --- undetermined parameters -------------------------------------------------------------------

BOTH = ["flexure.K_theta1", "flexure.K_theta2"]


@pytest.fixture(scope="module")
def ambiguous() -> Fit:
    """Fit both stiffness coefficients of the 2R to one frequency, as in the thesis."""
    return fit(mechanism("PRBDM2R"), BOTH, Frequency(Estimate(5.6375, 5e-5)), PMMA)


def test_one_frequency_cannot_separate_two_coefficients(ambiguous):
    """The fit meets the frequency and reports the undetermined direction."""
    assert ambiguous.rms["frequency 1 at rest"] < 1e-6
    assert not ambiguous.identifiable
    assert ambiguous.singular[1] == 0.0
    assert all(math.isinf(ambiguous[name].uncertainty) for name in BOTH)
    (note,) = ambiguous.notes
    assert "cannot separate flexure.K_theta1 and flexure.K_theta2" in note
    assert "has no effect" in note
    assert "not determined" in str(ambiguous)


@pytest.mark.slow
@pytest.mark.parametrize("given", [None, (2e-5, 2e-3)])
def test_a_force_cannot_separate_thickness_and_modulus_with_any_bounds(given):
    """The force over the deflection of leaves depends on E h^3 alone; a length is no ratio."""
    own, x = mechanism("GuideBeam"), np.linspace(-4e-3, 4e-3, 9)
    stiffness = 24.0 * own.values()["flexure.youngs_modulus"] / own.values()["flexure.length"] ** 3
    second = own.values()["flexure.width"] * own.values()["flexure.thickness"] ** 3 / 12.0
    noise = 1e-4 * np.random.default_rng(1).standard_normal(len(x))
    target = ForceDeflection(x, stiffness * second * x + noise, 1e-4)
    thickness = Free("flexure.thickness", *(given or ()))
    free = [thickness, "flexure.youngs_modulus"]
    found = fit(own, free, target, {"gravity.x": 0.0, "gravity.y": 0.0})
    assert found.singular[1] == 0.0
    assert all(math.isinf(found[name].uncertainty) for name in found.problem.names)


def test_the_frequency_is_constant_along_the_valley(ambiguous):
    """A step of 1e-3 has an effect of second order along the valley, of first order across it."""
    direction = np.array(list(ambiguous.valleys[0].shares.values())) * ambiguous.p
    target = ambiguous.problem.targets[0]

    def changed(step):
        values = PMMA | dict(zip(BOTH, map(float, ambiguous.p + step), strict=True))
        return abs(target.model(mechanism("PRBDM2R"), values)[0] - 5.6375) / 5.6375

    across = np.array([direction[1], -direction[0]])
    assert changed(1e-3 * direction) < 1e-6
    assert changed(1e-3 * across) > 1e-4


@pytest.mark.slow
def test_every_point_of_the_valley_has_the_measured_frequency(ambiguous):
    """The valley can be printed and drawn."""
    found = valley(ambiguous, BOTH[0], (2.9, 6.0), 7)
    assert found.points[[0, -1], 0].tolist() == [2.9, 6.0]
    assert np.all(np.diff(found.points, axis=0)[:, 0] > 0)
    assert np.all(np.diff(found.points, axis=0)[:, 1] < 0)
    assert found.misfit.max() < 1e-6
    assert str(found).count("\n") == len(found.points)
    figure = valley_figure(found)
    assert len(figure.axes) == 2
    assert png(figure).startswith(b"\x89PNG")
    assert valley(ambiguous, points=2).along in BOTH


def test_the_header_of_a_valley_is_aligned_with_its_columns():
    """Long names end at the same column as the numbers below them."""
    names = ("flexure.K_theta", "flexure_of_a_long_name.youngs_modulus", "release.displacement")
    points = np.array([[2.65, 181.5e9, -0.01]])
    head, row = str(Valley(names, names[0], points, np.zeros(1), points[0])).splitlines()
    assert head.split() == [*names, "misfit"]
    ends = [[m.end() for m in re.finditer(r"\S+", line)] for line in (head, row)]
    assert ends[0] == ends[1]


@pytest.mark.slow
def test_three_coefficients_and_one_frequency_have_two_undetermined_directions():
    """The third direction is determined as accurately as the frequency."""
    m = mechanism("PRBDM2R")
    kinds = tuple(dataclasses.replace(kind, model="3R") for kind in m.flexure_types)
    m = dataclasses.replace(m, flexure_types=kinds)
    free = [f"flexure.K_theta{i}" for i in (1, 2, 3)]
    found = fit(m, free, Frequency(Estimate(5.6375, 5e-5)), PMMA)
    assert found.rms["frequency 1 at rest"] < 1e-6
    assert [math.isinf(one.uncertainty) for one in found.valleys] == [True, True]
    assert found.singular[0] > 1e4


def test_factors_of_a_product_are_not_determined():
    """The stiffness depends on E K_theta: the valley is (1, -1)/sqrt 2 in relative changes."""
    free = [K, "flexure.youngs_modulus"]
    found = fit(mechanism("PRBDM"), free, Frequency(Estimate(4.9, 1e-3)))
    shares = np.array(list(found.valleys[0].shares.values()))
    assert np.abs(shares) == pytest.approx([math.sqrt(0.5)] * 2, rel=1e-3)
    assert shares[0] * shares[1] < 0
    assert "by +1 %" in str(found.valleys[0])
    assert "by -1 %" in str(found.valleys[0])


def test_a_parameter_without_effect_is_not_determined():
    """The frequency at rest does not depend on the restitution."""
    target = Frequency(Estimate(5.6375, 1e-3))
    found = fit(mechanism("PRBDM"), [K, "stop.restitution"], target, PMMA)
    assert str(found.valleys[0]) == "these data cannot determine stop.restitution"
    assert math.isinf(found["stop.restitution"].uncertainty)
    assert found[K].uncertainty == pytest.approx(found[K].value * 2e-3 / 5.6375, rel=1e-3)
    assert np.isnan(found.correlation[0, 1])


# --- forces -------------------------------------------------------------------------------------


def held(values, x):
    """Return the force that holds the 1R guide: F = 4 k phi/(r cos phi) - m g, x = r sin phi."""
    one = guide(values)
    phi = np.arcsin(x / one.r)
    return 4 * one.k * phi / (one.r * np.cos(phi)) - one.mass * one.g


def test_forces_of_the_1r_equal_those_of_the_scalar_equation():
    x = np.linspace(-0.015, 0.015, 7)
    target = ForceDeflection(x, np.zeros(7))
    np.testing.assert_allclose(target.model(mechanism("PRBDM"), {}), held({}, x), rtol=1e-8)


@pytest.mark.slow
def test_a_fit_to_a_force_deflection_curve_recovers_stiffness_and_sensor_zero():
    """The noise is 1 mN; the slope of the curve separates the stiffness from the sensor's zero."""
    x = np.linspace(-0.01, 0.01, 60)
    F = held({K: 2.5}, x) + 0.02 + 1e-3 * np.random.default_rng(1).standard_normal(60)
    found = fit(mechanism("PRBDM"), [K, Free("record.zero", -0.1, 0.1)], ForceDeflection(x, F))
    assert found[K].value == pytest.approx(2.5, abs=3 * found[K].uncertainty)
    assert found["record.zero"].value == pytest.approx(0.02, abs=1e-3)
    assert found.rms["force over deflection"] == pytest.approx(1e-3, rel=0.3)
    assert found[K].freedom == 58
    assert abs(found.correlation[0, 1]) < 0.1, "a symmetric range decouples them"


@pytest.mark.slow
def test_uncertainties_are_widened_if_the_model_does_not_fit():
    """Forces of a cubic spring: the residuals exceed the stated uncertainty; a note reports it."""
    x = np.linspace(-0.01, 0.01, 40)
    F = held({}, x) * (1 + 2e3 * x**2)
    found = fit(mechanism("PRBDM"), [K], ForceDeflection(x, F, 1e-4))
    assert found.reduced > 10
    assert any("the error of the model exceeds" in note for note in found.notes)
    close = fit(mechanism("PRBDM"), [K], ForceDeflection(x, held({}, x), 1e-4))
    assert found[K].uncertainty > 10 * close[K].uncertainty
    assert close.notes == ()


@pytest.mark.slow
def test_a_parameter_at_its_bound_is_reported():
    found = fit(mechanism("PRBDM"), [Free(K, 2.6, 3.0)], Frequency(Estimate(4.7, 1e-3)))
    assert found[K].value == pytest.approx(2.6, rel=1e-6)
    assert any("ended at its bound 2.6" in note for note in found.notes)
    assert "2.6 (not determined)" in str(found), "the best value is below the bound"
    assert not found.identifiable
    assert found.valleys == (), "the data determine it; the bound limits it"
    wide = fit(mechanism("PRBDM"), [K, Free("stop.restitution", -1.0, 5.0)], F5).problem
    assert (wide.lower[1], wide.upper[1]) == (0.0, 1.0), "bounds of the mechanism are kept"


@pytest.mark.slow
def test_the_title_of_a_fit_is_not_wider_than_its_figure():
    """Parameters with twelve digits take one line each; short ones share a line."""
    m = mechanism("PRBDM")
    d = np.array([-0.01, 0.005, 0.01])
    system = assemble(m, m.values())
    curve = ForceDeflection(d, np.array([equilibrium(system, x).force for x in d]))
    found = fit(m, ["flexure.youngs_modulus", "shuttle.mass"], curve)
    figure = force_figure(found)
    figure.draw_without_rendering()
    title = figure.axes[0].get_title(loc="left")
    assert len(title.splitlines()) == 2
    (drawn,) = (text for text in figure.findobj(Text) if text.get_text() == title)
    assert drawn.get_window_extent().x1 <= figure.bbox.x1


# --- responses ----------------------------------------------------------------------------------


def test_a_fit_to_a_free_response_recovers_the_stiffness():
    """The fit minimises the RMSE over time, as in the thesis, down to the noise of the sensor."""
    series = record(1.0, 0.3, 0.03)  # the wall is out of reach
    values = DROPPED | {"stop.position": 0.03, K: 2.65}
    found = fit(mechanism("PRBDM"), [Free(K, 2.0, 3.2)], Response(series), values)
    assert found[K].value == pytest.approx(2.5449, abs=3 * found[K].uncertainty)
    assert found[K].relative < 1e-5
    assert found.rms["shuttle.x over time"] == pytest.approx(NOISE, rel=0.2)
    assert len(response_figure(found).axes) == 2


@pytest.mark.parametrize("restitution", [0.25, 0.6, 0.95])
def test_a_fit_to_a_bouncing_response_recovers_the_restitution(restitution):
    """The fit starts at 0.5; another integrator has computed the record."""
    found = fitted_restitution(
        mechanism("PRBDM"), record(restitution, 0.13), DROPPED | {"stop.restitution": 0.5}
    )
    estimate = found["stop.restitution"]
    assert estimate.value == pytest.approx(restitution, abs=0.01)
    assert estimate.value == pytest.approx(restitution, abs=max(4 * estimate.uncertainty, 1e-4))
    assert found.rms["shuttle.x over time"] < 1.2 * NOISE


@pytest.mark.slow
def test_a_fit_recovers_restitution_wall_and_start_together():
    """The wall is 0.4 mm off and the record 0.7 ms late."""
    series = record(0.6, 0.2, 0.4e-3, 0, 0.7e-3)
    more = [Free("stop.position", -2e-3, 2e-3), Free("record.shift", -2e-3, 2e-3)]
    found = fitted_restitution(mechanism("PRBDM"), series, DROPPED, uncertainty=NOISE, free=more)
    assert found["stop.restitution"].value == pytest.approx(0.6, abs=1e-3)
    assert found["stop.position"].value == pytest.approx(0.4e-3, abs=5e-6)
    assert found["record.shift"].value == pytest.approx(0.7e-3, abs=2e-5)
    assert found.identifiable


@pytest.mark.slow
def test_stated_uncertainty_of_the_restitution_covers_the_truth():
    """The interval includes 0.6 in 68.3 % of 200 draws, -+ 3 standard deviations of the number."""
    hits = 0
    clean = record(0.6, 0.1, noise=0.0)
    rng = np.random.default_rng(3)
    for _ in range(200):
        x = clean.values + NOISE * rng.standard_normal(len(clean.time))
        target = Response(Series(clean.time, x), uncertainty=NOISE)
        free = [Free("stop.restitution", 0.5, 0.7, 0.6)]
        found = fit(mechanism("PRBDM"), free, target, DROPPED, starts=1)["stop.restitution"]
        hits += abs(found.value - 0.6) < found.uncertainty
    assert 0.585 < hits / 200 < 0.781


@pytest.mark.slow
@pytest.mark.parametrize(("wall", "low", "high"), [(0.0, -0.01, 0.01), (-0.01, 0.04, 0.12)])
def test_a_1r_fitted_to_a_2r_has_its_modal_restitution_at_straight_flexures(wall, low, high):
    """For a 2R with stretching flexures the fit is (1 + eps) mu_1 - 1 at straight flexures.

    At -10 mm the fit is larger.  It is one number for all impacts of the record, and the later
    impacts depend on the energy that the first impact left in other modes.
    """
    m = mechanism("PRBDM2R")
    kinds = tuple(dataclasses.replace(kind, axial=True) for kind in m.flexure_types)
    m = dataclasses.replace(m, flexure_types=kinds)
    values = {"stop.position": wall, "release.displacement": -0.018}
    t = np.arange(105) / RATE
    x = Response(Series(t, t)).model(m, values)
    series = Series(t, x + NOISE * np.random.default_rng(0).standard_normal(len(t)))
    system = assemble(m, m.values(values))
    arriving = modal_restitution(system, equilibrium(system, wall), 0, 0.6)
    rest = Frequency(Estimate(float(modes(system, equilibrium(system)).frequency[0]), 1e-4))
    stiffness = fit(mechanism("PRBDM"), [K], rest)[K].value
    found = fitted_restitution(mechanism("PRBDM"), series, values | {K: stiffness})
    assert low < found["stop.restitution"].value - arriving < high


def test_all_starts_are_evaluated_and_reported():
    """Five starts are spread over the range of the parameter; the sixth is the given value."""
    fractions = []
    found = fit(mechanism("PRBDM"), [K], F5, starts=5, progress=fractions.append)
    assert fractions[:6] == pytest.approx([1 / 12, 2 / 12, 3 / 12, 4 / 12, 5 / 12, 6 / 12])
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert found[K].value == pytest.approx(fit(mechanism("PRBDM"), [K], F5)[K].value, rel=1e-8)


def test_a_fit_without_convergence_has_a_note(monkeypatch):
    monkeypatch.setattr("prbm.analysis.fit.problem.STEPS_MAX", 1)
    found = fit(mechanism("PRBDM"), [K], F5)
    assert not found.converged
    assert "no convergence in" in str(found)
    monkeypatch.undo()
    assert fit(mechanism("PRBDM"), [K], F5).converged


@pytest.mark.slow
def test_record_parameters_can_be_given_or_fitted():
    """A sensor zero that is not fitted keeps its given value."""
    x = np.linspace(-0.01, 0.01, 20)
    target = ForceDeflection(x, held({K: 2.5}, x) + 0.05)
    found = fit(mechanism("PRBDM"), [K], target, {"record.zero": 0.05})
    assert found[K].value == pytest.approx(2.5, rel=1e-8)
    assert "record.zero" not in found.values
    freed = fit(mechanism("PRBDM"), [K, "record.zero"], target, {"record.zero": 0.04})
    assert freed["record.zero"].value == pytest.approx(0.05, rel=1e-8), "bounds are about 0.04"


def test_a_record_without_impact_is_rejected():
    with pytest.raises(EvaluationError, match="no impact in the record"):
        fitted_restitution(mechanism("PRBDM"), record(1.0, 0.5, 0.03), DROPPED)


# --- invalid fits -------------------------------------------------------------------------------

INVALID = {
    "nothing": (lambda m: fit(m, [], F5), "nothing to fit"),
    "no target": (lambda m: fit(m, [K], []), "nothing to fit"),
    "twice": (lambda m: fit(m, [K, K], F5), "listed twice"),
    "bounds": (lambda m: fit(m, [Free(K, 3.0, 2.0)], F5), "are not an interval"),
    "zero without bounds": (lambda m: fit(m, ["stop.position"], F5), "give Free"),
    "mixed uncertainties": (
        lambda m: fit(m, [K], [F5, ForceDeflection(np.zeros(2), np.zeros(2))]), "some targets only"
    ),
    "no freedom": (
        lambda m: fit(m, [K], ForceDeflection(np.array([0.01]), np.array([0.1]))), "1 data cannot"
    ),
    "exact frequency": (lambda m: Frequency(Estimate(5.0, 0.0)), "standard uncertainty"),
    "frequency without uncertainty": (lambda m: Frequency(5.0), "^frequency = 5.0 has no uncert"),
    "frequency as text": (lambda m: Frequency("5 Hz"), r"give Frequency\(Estimate\(value, stand"),
    "number as target": (lambda m: fit(m, [K], 3.0), "3.0 must be a target"),
    "mode 0": (lambda m: Frequency(Estimate(5.0, 0.1), 0), "the fundamental is 1"),
    "mode 2 of one": (lambda m: fit(m, [K], Frequency(Estimate(5.0, 0.1), 2)), "has 1 modes"),
    "pairs": (lambda m: ForceDeflection(np.zeros(2), np.zeros(3)), "give pairs"),
    "uncertainty": (lambda m: ForceDeflection(np.zeros(2), np.zeros(2), 0.0), "must be positive"),
    "sample uncertainty": (lambda m: Response(record(0.6), uncertainty=-1.0), "must be positive"),
    "out of reach": (
        lambda m: fit(m, [K], ForceDeflection(np.array([0.0, 1.0]), np.zeros(2))),
        "narrow the bounds",
    ),
    "starts": (lambda m: fit(m, [K], F5, starts=500), "choose fewer"),
    "valley of one": (lambda m: valley(fit(m, [K], F5)), "two parameters or more"),
    "no response": (lambda m: response_figure(fit(m, [K], F5)), "the fit has no response"),
}  # fmt: skip


@pytest.mark.parametrize("name", INVALID)
def test_invalid_fits_are_rejected(name):
    attempt, message = INVALID[name]
    with pytest.raises(EvaluationError, match=message):
        attempt(mechanism("PRBDM"))


@dataclasses.dataclass(frozen=True)
class Own:
    """A user's target whose model returns given values."""

    returned: object
    label: str = "rest position"
    unit: str = "m"
    uncertainty: float | None = 1e-5

    @property
    def data(self):
        return np.array([0.01])

    def model(self, mechanism, values):
        return self.returned


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        ([1.0, 2.0], "an array of length 2, its data are an array of length 1"),
        (np.ones((1, 1)), r"an array of shape \(1, 1\), its data are an array of length 1"),
        (1.0, r"an array of shape \(\), its data are an array of length 1"),
    ],
)
def test_a_model_with_another_shape_than_its_data_is_rejected(returned, message):
    """NumPy would broadcast it to the shape of the data."""
    with pytest.raises(EvaluationError, match=f"rest position: its model returns {message}"):
        fit(mechanism("PRBDM"), [K], Own(returned))


@dataclasses.dataclass(frozen=True)
class Wells:
    """Residuals (sin(pi x), 0.3 (x - 2), y - 1) with minima near x = 1 and, exact, at x = 2.

    x and y are multiples of the length of the flexures and of the mass of the shuttle.
    """

    size: float
    mass: float
    label: str = "wells"
    unit: str = "m"
    uncertainty: float | None = 1e-3

    @property
    def data(self):
        return np.array([0.0, 0.0, 1.0])

    def model(self, mechanism, values):
        x, y = values["flexure.length"] / self.size, values["shuttle.mass"] / self.mass
        return np.array([math.sin(math.pi * x), 0.3 * (x - 2.0), y])


def test_a_single_search_ends_in_the_wrong_minimum_and_several_find_the_best():
    """The given start, x = 1, lies in the upper well."""
    size, mass = (mechanism("PRBDM").values()[x] for x in ("flexure.length", "shuttle.mass"))
    free = [Free("flexure.length", 0.5 * size, 2.5 * size), "shuttle.mass"]
    one, several = (fit(mechanism("PRBDM"), free, Wells(size, mass), searches=n) for n in (1, None))
    assert one["flexure.length"].value == pytest.approx(size, rel=0.05)
    assert "searches" not in str(one)
    assert several["flexure.length"].value == pytest.approx(2.0 * size, rel=1e-8)
    best, other = several.minima
    assert best.misfit < 1e-3 * other.misfit
    assert other.p[0] == pytest.approx(size, rel=0.05)
    assert best.searches + other.searches == 4
    assert "distinct minima: 2" in str(several)
    assert f"another minimum: flexure.length = {other.p[0]:.6g}, shuttle.mass" in str(several)
    again = fit(mechanism("PRBDM"), free, Wells(size, mass))
    np.testing.assert_array_equal(again.p, several.p)


def test_a_wrong_number_of_searches_is_rejected():
    for count in (0, 100_000):
        with pytest.raises(EvaluationError, match=f"searches = {count} must lie between"):
            fit(mechanism("PRBDM"), [K], F5, searches=count)


def test_the_text_of_a_fit_has_the_interval():
    found = fit(mechanism("PRBDM"), [K], F5)
    low, high = found[K].interval()
    text = str(found)
    assert "±: one standard uncertainty" in text
    shown = [float(x) for x in re.search(r"\(95 %: (\S+) to (\S+)\)", text).groups()]
    assert shown == pytest.approx([low, high], rel=1e-3)
    assert "correlation" not in text


def test_the_strongest_correlation_of_a_fit_is_named():
    """The correlation is that of the inverse of the normal matrix of two similar equations."""

    @dataclasses.dataclass(frozen=True)
    class Sum(Wells):
        def model(self, mechanism, values):
            x, y = values["flexure.length"] / self.size, values["shuttle.mass"] / self.mass
            return np.array([x + y - 2.0, x + 1.1 * y - 2.1, 1.0])

    size, mass = (mechanism("PRBDM").values()[x] for x in ("flexure.length", "shuttle.mass"))
    found = fit(mechanism("PRBDM"), ["flexure.length", "shuttle.mass"], Sum(size, mass))
    r = -2.1 / math.sqrt(2.0 * (1.0 + 1.1**2))  # Of the inverse of ((2, 2.1), (2.1, 2.21)).
    *names, correlation = found.strongest
    assert names == ["flexure.length", "shuttle.mass"]
    assert correlation == pytest.approx(r, rel=1e-6)
    line = f"largest correlation: {r:.3f} between flexure.length and shuttle.mass"
    assert line in str(found)


def test_errors_on_unknown_names_propose_the_nearest():
    with pytest.raises(ParameterError, match=r"did you mean .*flexure\.K_theta"):
        fit(mechanism("PRBDM"), ["flexure.K_thet"], F5)
    with pytest.raises(EvaluationError, match=r"did you mean .*shuttle\.x") as caught:
        fit(mechanism("PRBDM"), [K], Response(record(0.6), "shuttl.x"))
    assert "bounds" not in str(caught.value)
    with pytest.raises(EvaluationError, match="was not fitted"):
        valley(fit(mechanism("PRBDM2R"), BOTH, F5), K)


@pytest.mark.parametrize("amount", [1, 2])
def test_exact_data_give_exact_parameters(amount):
    """A residual of zero must not be mistaken for a lack of information."""
    names, x = ["flexure.youngs_modulus", "shuttle.mass"][:amount], np.linspace(-0.015, 0.015, 7)
    guide = mechanism("PRBDM")
    F = ForceDeflection(x, np.ones(7)).model(guide, {})
    found = fit(guide, names, ForceDeflection(x, F), {})
    assert found.identifiable
    for name in names:
        assert found[name].value == pytest.approx(guide.values()[name], rel=1e-9)
        assert found[name].relative < 1e-7


def test_a_displacement_response_is_the_projection_on_the_release_direction():
    """For a release at 30 degrees it is cos(30) x + sin(30) y."""
    guide = mechanism("PRBDM")
    turned = dataclasses.replace(guide, release=dataclasses.replace(guide.release, direction=30.0))
    t = np.arange(20) * 2e-3
    values = {"release.displacement": -5e-3}
    x, y, along = (
        Response(Series(t, 0 * t), output).model(turned, values)
        for output in ("shuttle.x", "shuttle.y", "displacement")
    )
    np.testing.assert_allclose(along, math.sqrt(0.75) * x + 0.5 * y, atol=1e-12)
    assert along[0] == pytest.approx(-5e-3, abs=1e-9)


@pytest.mark.slow
def test_a_valley_reports_its_progress():
    fractions = []
    both = fit(mechanism("PRBDM2R"), ["flexure.K_theta1", "flexure.K_theta2"], F5)
    found = valley(both, points=3, progress=fractions.append)
    assert len(fractions) == len(found.misfit)
    assert fractions[-1] == 1.0
