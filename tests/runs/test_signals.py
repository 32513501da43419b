"""Inputs over time: sampling, closed forms of responses, texts and files, mistakes."""

import cmath
import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from prbm.base.errors import ParameterError, PrbmError
from prbm.mechanism.description import Mechanism
from prbm.runs.driving import Driver
from prbm.runs.inputs import read_signal, signals
from prbm.runs.run import simulate
from prbm.runs.signals import Function, Signal, Slope, Steps, Table, Wave, after

FREE = {"release.displacement": 0.0, "stop.position": 0.05, "gravity.x": 0.0, "damping.beta": 0.0}
OMEGA = 30.0  # rad/s


class Oscillator:
    """x'' + omega^2 x = force.x, solved exactly for constant forces, from rest."""

    def __init__(self, omega: float = OMEGA) -> None:
        self.omega, self.force, self.time = omega, 0.0, 0.0
        self.x, self.v = 0.0, 0.0
        self.given: list[tuple[float, float]] = []

    def set(self, changes: Mapping[str, float]) -> None:
        self.force = changes["force.x"]

    def advance(self, time: float) -> None:
        t, w = time - self.time, self.omega
        self.given.append((self.time, self.force))
        if w:
            turned = (self.x - self.force / w**2 + 1j * self.v / w) * cmath.exp(-1j * w * t)
            self.x, self.v = turned.real + self.force / w**2, w * turned.imag
        else:
            self.x += (self.v + 0.5 * self.force * t) * t
            self.v += self.force * t
        self.time = time


def response(
    guide: Mechanism, signal: Signal, times: np.ndarray, tolerance: float, omega: float = OMEGA
) -> np.ndarray:
    """Return displacement and velocity of the oscillator at increasing times, (m, 2)."""
    driver, oscillator = Driver({"force.x": signal}), Oscillator(omega)
    driver.sample(omega / (2 * math.pi), tolerance, float(times[-1]))
    rows = []
    for t in times:
        driver.advance(oscillator, t)
        rows.append((oscillator.x, oscillator.v))
        assert oscillator.time == t
    return np.array(rows)


def half_sine_response(T: float, omega: float, t: np.ndarray) -> np.ndarray:
    """Return the displacement of an oscillator after a half-sine of height 1 from time 0 on."""
    W = math.pi / T

    def during(s: np.ndarray) -> np.ndarray:
        return (np.sin(W * s) - W / omega * np.sin(omega * s)) / (omega**2 - W**2)

    # A half-sine is the sum of two sines, the second one later by T.
    return during(t) + np.where(t > T, during(t - T), 0.0)


@pytest.fixture(scope="module")
def guide(mechanisms: dict[str, Mechanism]) -> Mechanism:
    return mechanisms["PRBDM"]


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("T", [5e-4, 0.03, 0.2])
def test_response_to_a_half_sine_equals_its_closed_form_to_the_tolerance(guide, T, tolerance):
    t = np.linspace(0.0, 0.4, 57)  # The end of the pulse is not among the rows.
    x = response(guide, Wave(1.0, 0.5 / T, 0.5 / T, 0.0, T), t, tolerance)[:, 0]
    exact = half_sine_response(T, OMEGA, t)
    np.testing.assert_allclose(x, exact, atol=tolerance * np.abs(exact).max())


def test_a_free_mass_has_the_exact_velocity_after_a_half_sine(guide):
    """Its velocity is 2 a T / pi, and its displacement grows from the middle of the pulse."""
    T = 5e-4
    x, v = response(
        guide, Wave(1.0, 0.5 / T, 0.5 / T, 1e-3, 1e-3 + T), np.array([0.01]), 1e-8, 0.0
    )[0]
    assert v == pytest.approx(2 * T / math.pi, rel=1e-12)
    assert x == pytest.approx(v * (0.01 - 1e-3 - T / 2), rel=1e-12)


def test_response_to_a_sine_at_resonance_grows_linearly(guide):
    """X = (sin wt - wt cos wt) / (2 w^2)."""
    t = np.linspace(0.0, 3.0, 31)
    x = response(guide, Wave(1.0, *(OMEGA / (2 * math.pi),) * 2, 0.0, math.inf), t, 1e-8)[:, 0]
    exact = (np.sin(OMEGA * t) - OMEGA * t * np.cos(OMEGA * t)) / (2 * OMEGA**2)
    np.testing.assert_allclose(x, exact, atol=1e-8 * np.abs(exact).max())


def test_the_error_falls_with_the_fourth_power_of_the_steps(guide):
    """The tolerance is proportional to it."""
    t = np.array([1.0])
    signal = Wave(1.0, 2.0, 11.0, 0.0, 1.0, phase=0.4)
    exact = response(guide, signal, t, 1e-11)
    errors = [
        float(np.abs(response(guide, signal, t, tolerance) - exact)[0, 0])
        for tolerance in (1e-2, 1e-2 / 16, 1e-2 / 256)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, 4.0, atol=0.25)


def test_jumps_between_rows_are_boundaries_of_the_integration(guide):
    """The response to a pulse is the difference of two step responses, to round-off."""
    t = np.array([0.1, 0.2])
    x = response(guide, Steps((0.033, 0.0771), (0.0, 2.0, 0.0)), t, 1e-3)[:, 0]
    exact = 2.0 / OMEGA**2 * (np.cos(OMEGA * (t - 0.0771)) - np.cos(OMEGA * (t - 0.033)))
    np.testing.assert_allclose(x, exact, atol=1e-15)


def test_straight_lines_of_a_table_are_integrated_between_its_points(guide):
    """The response of a free mass to a ramp is cubic; constant parts take one step each."""
    driver, mass = Driver({"force.x": Table((0.1, 0.3), (0.0, 2.0))}), Oscillator(0.0)
    driver.sample(0.0, 1e-8, 0.5)
    driver.advance(mass, 0.25)
    assert mass.x == pytest.approx(10.0 / 6.0 * 0.15**3, rel=1e-12)
    before = len(mass.given)
    driver.advance(mass, 0.3)
    driver.advance(mass, 0.4)
    driver.advance(mass, 0.5)
    assert [force for _, force in mass.given[-2:]] == [2.0, 2.0]
    assert len(mass.given) - before <= 3 + 2


def test_the_last_piece_before_a_row_has_the_value_there(guide):
    """Contact and base forces depend on the present input; at a jump it is the value before."""
    signal = Table((0.0, 0.1, 0.1, 0.2), (1.0, 3.0, -5.0, -6.0))
    driver, oscillator = Driver({"force.x": signal}), Oscillator()
    driver.sample(5.0, 1e-4, 0.2)
    for t, force in ((0.05, 2.0), (0.1, 3.0), (0.15, -5.5)):
        driver.advance(oscillator, t)
        assert oscillator.force == pytest.approx(force, rel=1e-12)
        assert oscillator.time == t
    assert driver.values(0.1) == {"force.x": -5.0}


def test_walls_get_their_displacement_and_velocity_at_the_start_of_each_piece(guide):
    found = signals(guide, {"stop.displacement": "sine(1 mm, 5 Hz)"})
    driver = Driver(found)
    driver.sample(5.0, 1e-6, 0.1)
    given: list[tuple[float, dict[str, float]]] = []

    class Recorder:
        time, values = 0.0, dict[str, float]()

        def set(self, changes):
            self.values = dict(changes)

        def advance(self, time):
            given.append((self.time, self.values))
            self.time = time

    driver.advance(Recorder(), 0.1)
    w = 10 * math.pi
    for t, values in given[:-1]:
        assert values["stop.displacement"] == pytest.approx(1e-3 * math.sin(w * t), abs=1e-15)
        assert values["stop.velocity"] == pytest.approx(1e-3 * w * math.cos(w * t), abs=1e-12)


# --- mechanisms ----------------------------------------------------------------------------------


def scalar_guide(guide: Mechanism, mobility: float):
    """Return the right-hand side of the 1R guide with a force on its shuttle.

    The shuttle moves on a circle of radius r = gamma L: M r^2 T'' = F r cos T - 4 k T.
    """
    p = guide.values()
    r = p["flexure.gamma"] * p["flexure.length"]
    inertia = p["flexure.width"] * p["flexure.thickness"] ** 3 / 12
    k = (
        2 * p["flexure.gamma"] * p["flexure.K_theta"] * p["flexure.youngs_modulus"] * inertia
        / p["flexure.length"]
    )  # fmt: skip
    return r, lambda T, F: (F * r * math.cos(T) - 4 * k * T) * mobility / r**2


def moved(acceleration, force, breaks, t):
    """Return angle and rate of the guide at times t, from rest, (m, 2).

    The force is a function of the time and of a time inside the interval between breaks.
    """
    y, found = np.zeros(2), np.zeros((len(t), 2))
    for begin, end in pairwise([0.0, *breaks, t[-1]]):
        inside = 0.5 * (begin + end)
        solution = solve_ivp(
            lambda s, x, inside=inside: (x[1], acceleration(x[0], force(s, inside))),
            (begin, end), y, method="DOP853", rtol=1e-12, atol=1e-15, max_step=5e-4,
            dense_output=True,
        )  # fmt: skip
        rows = (t >= begin) & (t <= end)
        found[rows], y = solution.sol(t[rows]).T, solution.y[:, -1]
    return found


def late_half_sine(t, inside):
    return 5.0 * math.sin(math.pi * (t - 0.0103) / 3e-3) if 0.0103 < inside < 0.0133 else 0.0


@pytest.mark.parametrize(
    ("text", "force", "breaks"),
    [
        ("half-sine(5 N, 3 ms, 10.3 ms)", late_half_sine, (0.0103, 0.0133)),
        (
            "chirp(50 mN, 2 Hz, 30 Hz, 100 ms)",
            lambda t, _: 0.05 * math.sin(2 * math.pi * (2.0 * t + 0.5 * 28.0 / 0.1 * t * t)),
            (),
        ),
        ("step(0.1 N, 20.5 ms)", lambda _, inside: 0.1 if inside > 0.0205 else 0.0, (0.0205,)),
    ],
)
def test_the_1r_guide_moves_as_its_scalar_equation_with_the_same_force(guide, text, force, breaks):
    """The equation is solved with the signal as a function of time, restarted at its breaks.

    The tolerance of the engine is relative to the angles, which are about a right angle.
    """
    tolerance, end = 1e-9, 0.08
    result = simulate(
        guide, FREE, inputs={"force.x": text}, stop_time=end, step=1e-3, tolerance=tolerance
    )
    r, acceleration = scalar_guide(guide, float(result["stop.point.mobility"][0]))
    angle, rate = moved(acceleration, force, breaks, result["time"]).T
    x, vx, limit = r * np.sin(angle), r * np.cos(angle) * rate, 10 * tolerance * r
    assert np.abs(x).max() > 5e-4
    np.testing.assert_allclose(result["shuttle.x"], x, rtol=0, atol=limit)
    np.testing.assert_allclose(result["shuttle.vx"], vx, rtol=0, atol=OMEGA * limit)


def test_energies_balance_and_results_do_not_depend_on_the_rows(guide):
    """Kinetic + elastic + gravitational + dissipated - work is constant."""
    shaken = {"base.acceleration.x": "sine(5 m/s2, 20 Hz, phase=30 deg)"}
    result, many = (
        simulate(guide, FREE, inputs=shaken, stop_time="0.1 s", step=step, tolerance=1e-10)
        for step in ("5 ms", "0.5 ms")
    )
    names = ("kinetic", "elastic", "gravitational", "dissipated")
    balance = sum(result[f"energy.{name}"] for name in names) - result["energy.work"]
    assert np.ptp(balance) < 1e-6 * result["energy.kinetic"].max()
    phase = 2 * math.pi * 20.0 * result["time"] + math.pi / 6
    np.testing.assert_allclose(result["base.acceleration.x"], 5.0 * np.sin(phase), atol=1e-12)
    for name in ("shuttle.x", "shuttle.vx", "base.force.x", "energy.work"):
        limit = 1e-7 * np.abs(many[name]).max()
        np.testing.assert_allclose(many[name][::10], result[name], atol=limit, err_msg=name)


def test_a_wall_follows_its_signal_within_twice_its_acceleration_times_the_piece_squared(guide):
    """The gap and the displacement of the hit point add up to the displacement of the wall."""
    w, amplitude, tolerance = 2 * math.pi * 20.0, 1e-3, 1e-8
    result = simulate(
        guide, {"stop.position": 0.02}, inputs={"stop.displacement": "sine(1 mm, 20 Hz)"},
        stop_time=0.05, step=1e-3, tolerance=tolerance,
    )  # fmt: skip
    wall = result["stop.gap"] + result["stop.point.displacement"]
    piece = 0.5 * (720 * tolerance) ** 0.25 / w
    error = np.abs(wall - amplitude * np.sin(w * result["time"]))
    assert error.max() < 2 * amplitude * w**2 * piece**2


def test_forms_of_a_signal_are_equivalent(guide):
    t = np.linspace(0.0, 0.02, 21)
    values = np.where(t < 0.01, 0.0, 0.1 * (t - 0.01))
    results = [
        simulate(guide, FREE, inputs={"force.x": form}, stop_time=0.02)["shuttle.x"]
        for form in ((t, values), Table(tuple(t), tuple(values)), lambda s: np.interp(s, t, values))
    ]
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_allclose(results[2], results[0], atol=1e-12)
    constant = simulate(guide, FREE, inputs={"force.x": "3 mN"}, stop_time=0.02)["shuttle.x"]
    given = simulate(guide, {**FREE, "force.x": 3e-3}, stop_time=0.02)["shuttle.x"]
    np.testing.assert_array_equal(constant, given)


def test_a_step_of_an_impulse_changes_the_velocity_at_its_time(guide):
    result = simulate(
        guide, FREE, inputs={"force.impulse.x": "step(1 mN.s, 4.5 ms)"}, stop_time="5 ms"
    )
    assert (result["shuttle.vx"][:5] == 0.0).all()
    mobility = result["stop.point.mobility"][0]
    assert result["shuttle.vx"][5] == pytest.approx(1e-3 * mobility, rel=1e-3)


# --- texts, files, mistakes -----------------------------------------------------------------------


def test_g_is_the_standard_gravity_for_accelerations(guide):
    pulse = read_signal("base.acceleration.x", "half-sine(500 g, 0.5 ms)", "m/s2")
    assert pulse.value(0.25e-3, 0.25e-3) == pytest.approx(500 * 9.80665, rel=1e-15)


def test_arguments_may_be_named():
    assert read_signal("a", "pulse(1, start=2 s, duration=3 s)", "N") == read_signal(
        "a", " pulse ( 1 N , 3 s, 2 s ) ", "N"
    )


@pytest.mark.parametrize(
    "signal",
    [
        Wave(2.0, 5.0, 50.0, 0.1, 0.4, 0.3),
        Wave(2.0, 5.0, 5.0, 0.1, math.inf),
        Table((0.0, 0.2, 0.5), (1.0, -1.0, 4.0)),
        Function(lambda t: math.sin(7.0 * t)),
        Steps((0.1,), (0.0, 1.0)),
    ],
)
def test_slopes_are_derivatives(signal):
    for t in (0.15, 0.3, 0.35):
        h = 1e-6
        difference = (signal.value(t + h, t) - signal.value(t - h, t)) / (2 * h)
        assert signal.slope(t, t) == pytest.approx(difference, rel=1e-6, abs=1e-8)
        assert Slope(signal).value(t, t) == signal.slope(t, t)


@pytest.mark.parametrize(
    ("values", "inputs"),
    [
        ({}, {"stop.velocity": "sine(0.1 m/s, 5 Hz)"}),
        ({"stop.displacement": 1e-3}, {"stop.velocity": 0.1}),
        ({"stop.velocity": 0.1}, {}),
    ],
)
def test_a_velocity_of_a_wall_without_its_displacement_is_rejected(guide, values, inputs):
    with pytest.raises(ParameterError, match=r"give stop\.displacement over time"):
        simulate(guide, values, inputs=inputs, stop_time=1e-3)


def test_a_wall_may_have_signals_of_its_displacement_and_of_its_velocity(guide):
    given = {"stop.displacement": ([0.0, 0.02], [0.0, 2e-3]), "stop.velocity": "0.1 m/s"}
    result = simulate(guide, {"stop.position": 0.01}, inputs=given, stop_time=0.02)
    wall = result["stop.gap"] + result["shuttle.x"]
    np.testing.assert_allclose(wall, 0.01 + 0.1 * result["time"], atol=1e-9)


def test_a_function_is_not_evaluated_outside_of_the_simulated_time(guide):
    times = []

    def displacement(t):
        times.append(t)
        return 1e-3 * math.sin(50.0 * t) ** 2

    result = simulate(guide, inputs={"stop.displacement": displacement}, stop_time=0.02)
    assert (min(times), max(times)) == (0.0, 0.02)
    rate = 0.05 * np.sin(100.0 * result["time"])
    np.testing.assert_allclose(result["stop.velocity"], rate, atol=1e-10)


BY_HAND = [
    (lambda: Steps((0.1,), (0.0,)), "1 breaks and 1 levels do not match"),
    (lambda: Steps((0.2, 0.1), (0.0, 1.0, 0.0)), "the breaks must increase, but 0.1 s follows"),
    (lambda: Steps((), (math.nan,)), "must be finite"),
    (lambda: Wave(1.0, 5.0, 5.0, 0.1, 0.1), "the end, t = 0.1 s, is not after the start"),
    (lambda: Wave(1.0, math.inf, 5.0, 0.0, 0.1), "the frequencies inf Hz and 5 Hz must be finite"),
]


@pytest.mark.parametrize(("signal", "sentence"), BY_HAND)
def test_mistakes_in_signals_built_by_hand_are_reported(signal, sentence):
    with pytest.raises(ParameterError, match=sentence):
        signal()


def test_a_column_of_a_file_is_converted_to_si(guide, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("shock.csv").write_text("t [ms],a [g],F [mN]\n0,0,1\n2,100,3\n4,0,5\n", encoding="utf-8")
    signal = read_signal("base.acceleration.x", "csv(shock.csv, a)", "m/s2")
    assert signal.breaks == (0.0, 0.002, 0.004)
    assert after(signal, 0.001) == pytest.approx(50 * 9.80665, rel=1e-14)
    assert after(signal, 1.0) == 0.0
    force = read_signal("force.x", "csv(shock.csv, F)", "N")
    assert after(force, 0.001) == pytest.approx(2e-3)
    Path("plain.csv").write_text("time,F\n0,1\n1,3\n", encoding="utf-8")
    assert read_signal("force.x", "csv(plain.csv)", "N") == Table((0.0, 1.0), (1.0, 3.0))


MISTAKES = [
    ({"base.aceleration.x": "1"}, r"unknown variable .*did you mean base\.acceleration\.x"),
    ({"stop.position": "sine(1 mm, 5 Hz)"}, r"stop\.position is a parameter, which has one value"),
    ({"force.x": "halfsine(1 N, 1 ms)"}, "unknown shape 'halfsine'; did you mean half-sine"),
    ({"force.x": "half-sine(1 m, 1 ms)"}, "height = 1 m: the unit 'm' has another dimension"),
    ({"force.x": "half-sine(1 g, 1 ms)"}, "height = 1 g: the unit 'g' has another dimension"),
    ({"force.x": "half-sine(1 N)"}, r"duration is missing; write half-sine\(height, duration"),
    ({"force.x": "half-sine(1 N, 0 s)"}, "duration = 0 s must be positive"),
    ({"force.x": "half-sine(1 N, -1 ms)"}, r"duration = -0\.001 s must be positive"),
    ({"force.x": "half-sine(1 N, 1e-320 s)"}, "duration = .* s must be at least 1e-15 s"),
    ({"force.x": "pulse(1 N, 2 fs, 99 s)"}, "the breaks must increase, but 99 s follows 99 s"),
    (
        {"force.x": "sine(1 N, 5 Hz, 99 s, 2 fs)"},
        "the end, t = 99 s, is not after the start",
    ),
    ({"force.x": "sine(nan, 5 Hz)"}, "amplitude = nan: write a finite number"),
    ({"force.x": "sine(1 N, 0 Hz)"}, "frequency = 0 Hz must be positive"),
    ({"force.x": "sine(1 N, 5 Hz, 0 s, 1 s, 0, 7)"}, "6 arguments are given; at most 5"),
    ({"force.x": "sine(1 N, 5 Hz, hight=3)"}, "unknown argument 'hight'"),
    ({"force.x": "sine(1 N, 5 Hz, frequency=3 Hz)"}, "frequency is given twice"),
    ({"force.x": "sine(1 N, 5 Hz,)"}, "start is empty; write a quantity"),
    ({"force.x": "sine(1 N, 1 GHz)"}, r"the signal of force\.x needs .* steps"),
    ({"force.x": "much"}, "write a number"),
    ({"force.x": True}, "must be a text such as"),
    ({"force.x": [1.0, 2.0, 3.0]}, "must be a text such as"),
    ({"force.x": math.inf}, r"force\.x = inf must be finite"),
    ({"force.x": ([0.0, 1.0], [0.0, math.nan])}, "row 1: the time 1 s and the value nan must"),
    ({"force.x": ([1.0, 0.0], [0.0, 1.0])}, "row 1: the times must increase"),
    ({"force.x": ([0.0], [0.0])}, "1 times and 1 values must be equally many, at least two"),
    ({"force.x": lambda t: math.nan}, r"force\.x\(0 s\) = nan N must be a finite number"),
    (
        {"force.x": lambda t: None if t > 0.0 else 1.0},
        r"force\.x\(.* s\) = None must be a number in N",
    ),
    ({"force.x": lambda t: [t, t]}, r"force\.x\(0 s\) = \[0\.0, 0\.0\] must be a number in N"),
    (
        {"stop.displacement": lambda t: None},
        r"stop\.displacement\(0 s\) = None must be a number in m",
    ),
    ({"force.x": "csv(none.csv, a)"}, r"none\.csv: cannot be read"),
    ({"force.x": "csv(a.csv, c)"}, "the file has no column 'c'; known names are a, b"),
    ({"force.x": "csv(a.csv)"}, "the file has 3 columns; name one of a, b"),
    ({"force.x": "csv(a.csv, b)"}, r"column 'b \[mm\]', 1 mm: the unit 'mm' has another dimen"),
    ({"force.x": "csv(gap.csv)"}, "line 3 has no number for t or F"),
    ({"force.x": "csv(blank.csv, F)"}, "line 5 has no number for t or F"),
    ({"force.x": "csv(blank.csv, b)"}, "line 5: the times must increase"),
    ({"force.x": "csv(bare.csv)"}, r"bare\.csv must have a head"),
]


@pytest.mark.parametrize(("inputs", "sentence"), MISTAKES)
def test_mistakes_in_signals_are_reported(guide, inputs, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_text("t [s],a [N],b [mm]\n0,0,1\n2,100,3\n", encoding="utf-8")
    Path("gap.csv").write_text("t,F\n0,0\n1,\n", encoding="utf-8")
    Path("blank.csv").write_text("\nt,F,b\n1,1,2\n\n0,-,4\n", encoding="utf-8")
    Path("bare.csv").write_text("0,0\n1,1\n2,2\n", encoding="utf-8")
    with pytest.raises(PrbmError, match=sentence):
        simulate(guide, inputs=inputs, stop_time=0.01)


def test_an_input_has_either_a_constant_or_a_signal(guide):
    with pytest.raises(ParameterError, match=r"force\.x is given both as a constant and over time"):
        simulate(guide, {"force.x": 1.0}, inputs={"force.x": "1 N"}, stop_time=0.01)


@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_a_wall_follows_a_signal_that_begins_after_a_constant_part(guide, step):
    """The steps of the constant part do not delay the wall: its error is below 1 um of 1 mm."""
    result = simulate(
        guide, {"stop.position": 0.02}, stop_time=0.012, step=step,
        inputs={"stop.displacement": "half-sine(1 mm, 4 ms, 5 ms)"},
    )  # fmt: skip
    wall = result["stop.gap"] + result["stop.point.displacement"]
    assert np.abs(wall - wall[0] - result["stop.displacement"]).max() < 1e-6


@pytest.mark.parametrize("signal", ["step(1 mm, 5 ms)", "pulse(1 mm, 5 ms, 2 ms)"])
def test_a_displacement_of_a_wall_that_jumps_is_rejected(guide, signal):
    with pytest.raises(ParameterError, match=r"stop.displacement jumps .* a wall cannot jump"):
        simulate(guide, inputs={"stop.displacement": signal}, stop_time=0.01)


def test_a_table_may_begin_with_a_jump():
    table = Table((0.0, 0.0, 1.0), (0.0, 1.0, 1.0))
    assert after(table, 0.0) == 1.0
    with pytest.raises(ParameterError, match="two equal ones are a jump"):
        Table((0.0, 0.0, 0.0), (0.0, 1.0, 2.0))


@pytest.mark.parametrize("source", ["step(1 mN.s, 0 s)", 1e-3, "pulse(1 mN.s, 2 ms)"])
def test_an_impulse_at_the_start_is_rejected(guide, source):
    """It acts by its increases, of which there is none at the start."""
    with pytest.raises(ParameterError, match=r"impulse\.x = 0\.001 N\.s at t = 0 s has no effect"):
        simulate(guide, inputs={"force.impulse.x": source}, stop_time=0.01)
