"""Every example runs, and its main result agrees with an independent value."""

import functools
import re
import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from prbm.plots.animation import animate
from support import ROOT

EXAMPLES = ROOT / "examples"

pytestmark = pytest.mark.fmu


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def example(name: str) -> SimpleNamespace:
    """Return the namespace of an example."""
    return SimpleNamespace(**runpy.run_path(str(EXAMPLES / name)))


def is_picture(path: str) -> bool:
    with Image.open(path) as image:
        return image.format == "PNG" and min(image.size) > 300


@pytest.mark.slow
def test_quickstart_frequency_agrees_with_finite_elements_and_experiment(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The model error of the 2R is 0.5 %; the limit for the experiment is twice its uncertainty."""
    quickstart = example("quickstart.py")
    quickstart.main([])
    printed = capsys.readouterr().out
    frequency = float(printed.split()[2])
    assert frequency == pytest.approx(quickstart.FINITE_ELEMENTS, rel=5e-3)
    measured, uncertainty = quickstart.MEASURED
    assert abs(frequency - measured) < 2 * uncertainty
    assert "14 impacts, at rest from 0.24" in printed
    assert is_picture("quickstart.png")
    assert Path("PRBDM2R.fmu").exists()


def test_quickstart_simulates_until_the_given_time(tmp_path: Path) -> None:
    result = example("quickstart.py").simulate(tmp_path, stop_time=0.02)
    assert result["time"][-1] == pytest.approx(0.02)
    assert {"shuttle.x", "link[6].angle", "mode.frequency"} < set(result.dtype.names)


@pytest.mark.slow
def test_folding_reduces_the_lateral_error_of_beam_theory(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The computed error of two leaves is within 1.5 % of that of beam theory, 3 x^2 / (5 L)."""
    example("straight_line.py").main([])
    printed = capsys.readouterr().out
    lines = [line for line in printed.splitlines() if line.endswith(" um")]
    leaves, uneven, half, folded, beam = (
        float(line.split(": ")[1].removesuffix(" um")) for line in lines
    )
    assert leaves == pytest.approx(beam, rel=0.015)
    assert folded < half < uneven < 0.1 * leaves
    assert is_picture("straight_line.png")


@pytest.mark.slow
def test_an_imported_drawing_has_the_frequency_of_the_formula(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Four leaves between clamps, 12 EI/L^3 each, with 13/35 of their mass."""
    pytest.importorskip("ezdxf", reason="drawings need ezdxf and shapely")
    example("from_a_drawing.py").main()
    words = capsys.readouterr().out.split()
    found, formula = float(words[2]), float(words[7])
    assert found == pytest.approx(formula, rel=1e-3)
    assert is_picture("stage.png")


@pytest.mark.slow
def test_the_period_of_the_impact_oscillator_doubles_where_the_closed_form_does(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    main = example("impact_oscillator.py").main
    monkeypatch.setitem(main.__globals__, "RATIOS", np.arange(2.66, 2.705, 0.01))
    main([])
    printed = capsys.readouterr()
    words = printed.out.split()
    found, closed = float(words[4]), float(words[8])
    assert found == pytest.approx(closed, rel=1e-3)
    assert is_picture("impact_oscillator.png")
    assert "% done, " in printed.err


def test_quickstart_names_the_file_that_it_cannot_write() -> None:
    Path("PRBDM2R.fmu").mkdir()
    with pytest.raises(SystemExit, match=r"cannot write .*PRBDM2R\.fmu: Is a directory; run this"):
        example("quickstart.py").main([])


@pytest.mark.slow
def test_quickstart_writes_a_film_of_a_motion_without_rest(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    main = example("quickstart.py").main
    short = main.__globals__["simulate"]
    monkeypatch.setitem(main.__globals__, "simulate", lambda folder: short(folder, 0.01))
    film = functools.partial(animate, slow=50.0, fps=10.0)
    monkeypatch.setitem(main.__globals__, "animate", film)
    main(["--gif"])
    printed = capsys.readouterr().out
    assert "0 impacts, not yet at rest" in printed
    assert Path("quickstart.gif").exists()


@pytest.mark.slow
def test_parameter_study_agrees_with_the_scalar_equation() -> None:
    """The model rests earlier than the equation: bounces below the rest speed v_r are left out.

    They last at most 2 eps v_r / (a (1 - eps)), with the restitution eps and the acceleration
    a > 9 m/s^2 towards the stop.
    """
    study = example("parameter_study.py")
    restitutions = (0.3, 0.6, 0.8)
    table = study.study(restitutions)
    np.testing.assert_allclose(table["rebound"], restitutions, rtol=1e-9)
    eps = table["restitution"]
    bound = 2 * eps * study.REST_SPEED / (9.0 * (1 - eps)) + 1e-6
    early = table["exact"] - table["rest_time"]
    assert (early > -1e-6).all()
    assert (early < bound).all()


def test_scalar_equation_of_the_parameter_study_has_known_impact_times() -> None:
    """First impact and accumulation of the bounces, computed with another program."""
    rest_time = example("parameter_study.py").exact_rest_time
    assert rest_time(1e-9, release=-0.010, K_theta=2.5449) == pytest.approx(0.034981, abs=1e-6)
    assert rest_time(0.6, release=-0.010, K_theta=2.5449) == pytest.approx(0.18034, abs=1e-5)


@pytest.mark.slow
def test_parameter_study_writes_its_table_and_figure(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    namespace = runpy.run_path(str(EXAMPLES / "parameter_study.py"))
    main = namespace["main"]
    monkeypatch.setitem(main.__globals__, "study", lambda: namespace["study"]((0.2, 0.4)))
    main()
    assert "largest difference" in capsys.readouterr().out
    assert is_picture("parameter_study.png")


@pytest.mark.native
@pytest.mark.slow
def test_sweep_has_the_standard_deviation_of_first_order_propagation(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The tolerance is four standard errors of a standard deviation, s / sqrt(2 n) each."""
    main = example("sweep/run.py").main
    main(["--runs", "40"])
    printed = capsys.readouterr().out
    found, first_order = map(float, re.findall(r"([\d.]+) ms", printed.splitlines()[2]))
    assert found == pytest.approx(first_order, rel=4 / np.sqrt(2 * 40))
    assert "at rest at the end: 40 of 40" in printed
    assert is_picture("settling.png")
    main(["--runs", "40"])  # All rows are already in the file.
    assert capsys.readouterr().out == printed


@pytest.mark.slow
def test_stroke_controller_reaches_its_stroke_and_energies_balance(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The controller's work equals that on the guide; impacts have the speed of beam theory.

    Work and energy balance are exact to the tolerance of the integration.  The speed has two
    errors: the 1R is 4 % stiffer than a beam, and the controller acts one step late.
    """
    run = example("stroke_controller/run.py")
    record = run.simulate(stop_time=2.0)
    np.testing.assert_allclose(run.work(record), record["energy.work"], rtol=3e-7, atol=1e-9)
    assert record["energy.work"][-1] > 0.1  # J, five times the energy of the release.
    assert np.ptp(run.balance(record)) < 1e-6 * record["energy.dissipated"][-1]
    rate, speed = run.steady(record)
    assert speed == pytest.approx(run.expected_speed(run.STROKE), rel=0.03)
    late = record["reached"][record["time"] > 1.0]
    np.testing.assert_allclose(late, run.STROKE, rtol=0.05)
    assert 10.0 < rate < 20.0


@pytest.mark.slow
def test_stroke_controller_prints_and_plots(capsys: pytest.CaptureFixture[str]) -> None:
    example("stroke_controller/run.py").main(["--stop-time", "1.0"])
    printed = capsys.readouterr().out
    assert "set point 8.000 mm" in printed
    assert is_picture("stroke_controller.png")


@pytest.mark.parametrize("time", ["0", "-1", "nan", "inf"])
def test_stroke_controller_rejects_an_invalid_stop_time(
    time: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        example("stroke_controller/run.py").main(["--stop-time", time])
    assert end.value.code == 2
    assert f"--stop-time {time}: must be finite and at least 0.0005 s" in capsys.readouterr().err


@pytest.mark.slow
def test_stroke_controller_reports_too_few_impacts(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The run is a tenth of a second long."""
    example("stroke_controller/run.py").main(["--stop-time", "0.1", "--model", "PRBDM2R"])
    assert (
        "fewer than two impacts in the second half: increase --stop-time" in capsys.readouterr().out
    )


def test_stroke_controller_counts_an_impact_at_the_start() -> None:
    record = np.zeros(5, [(n, float) for n in ("time", "stop.impact_count", "stop.approach_speed")])
    record["time"] = np.arange(5)
    record["stop.impact_count"] = 1, 1, 2, 2, 3
    record["stop.approach_speed"] = 9, 9, 2, 2, 4
    assert example("stroke_controller/run.py").steady(record) == (0.5, 3.0)
    assert example("stroke_controller/run.py").steady(record[:1]) is None


def test_stroke_controller_lifts_a_resting_shuttle_off_its_stop(tmp_path: Path) -> None:
    controller = example("stroke_controller/stroke_controller.py").StrokeController(
        instance_name="c", resources=str(tmp_path)
    )
    controller.do_step(0.0, 1e-3)
    assert controller.force == -controller.limit
    controller.velocity = 0.1
    controller.do_step(1e-3, 1e-3)
    assert controller.force == 0.0


def test_stroke_controller_pushes_in_the_direction_of_the_velocity(tmp_path: Path) -> None:
    controller = example("stroke_controller/stroke_controller.py").StrokeController(
        instance_name="c", resources=str(tmp_path)
    )
    for velocity, position in ((-0.1, -1e-3), (0.1, -3e-3)):
        controller.velocity, controller.position = velocity, position
        controller.do_step(0.0, 1e-3)
    assert controller.reached == 3e-3
    assert controller.force == pytest.approx(25.0 * 5e-3)
    controller.velocity = -0.1
    controller.do_step(0.0, 1e-3)
    assert controller.force == pytest.approx(-25.0 * 5e-3)


@pytest.mark.slow
def test_haptic_button_clicks_with_the_force_of_the_boundary_value_problem(
    capsys: pytest.CaptureFixture[str],
) -> None:
    example("haptic_button/run.py").main([])
    printed = capsys.readouterr().out
    lines = printed.splitlines()
    peak, valley = map(float, re.findall(r"([\d.]+) N", lines[0]))
    assert [peak, valley] == pytest.approx(
        list(map(float, re.findall(r"([\d.]+) N", lines[1]))), rel=5e-3
    )
    assert valley < 0.5 * peak
    static = float(re.findall(r"([\d.]+) MPa", lines[2])[0])
    for line in lines[4:]:
        stress, safety = map(float, re.findall(r"([\d.]+) MPa, safety factor ([\d.]+)", line)[0])
        assert static < stress < 1.2 * static
        assert safety == pytest.approx(830.0 / stress, rel=3e-3)
    assert is_picture("haptic_button.png")
