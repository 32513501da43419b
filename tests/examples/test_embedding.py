"""Examples of coupled systems, compared with one solver, closed forms and energy balances."""

import math
import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from prbm.fmu import native_fmu
from prbm.mechanism.description import Mechanism
from support import ROOT

EXAMPLES = ROOT / "examples"
NAMES = ("voice_coil", "energy_harvester", "drop_test", "escapement", "model_exchange")

pytestmark = [pytest.mark.fmu, pytest.mark.native]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


_built: dict[tuple[str, int], bytes] = {}


def once(mechanism: Mechanism, fmi: int) -> bytes:
    """Return a native FMU, which is built only once for all examples."""
    key = mechanism.name, fmi
    if key not in _built:
        _built[key] = native_fmu.build(mechanism, fmi=fmi)
    return _built[key]


def example(name: str) -> SimpleNamespace:
    """Return the namespace of an example, with a cache for its FMUs."""
    found = runpy.run_path(str(EXAMPLES / name / "run.py"))
    found["main"].__globals__["build"] = once
    return SimpleNamespace(**found)


def is_picture(path: str | Path) -> bool:
    with Image.open(path) as image:
        return image.format == "PNG" and min(image.size) > 300


@pytest.mark.parametrize("name", NAMES)
def test_each_page_has_a_lesson_a_figure_and_a_command(name):
    """The figure is the one that the command draws."""
    text = (EXAMPLES / name / "README.md").read_text(encoding="utf-8")
    assert "**Lesson:**" in text
    assert f"({name}.png)" in text
    assert f"python examples/{name}/run.py" in text
    assert is_picture(EXAMPLES / name / f"{name}.png")


@pytest.mark.slow
def test_voice_coil_impacts_and_rest_agree_with_one_solver(capsys):
    """Times of impacts agree to a tenth of a step, the time of coming to rest to two steps."""
    run = example("voice_coil")
    record, reference = run.simulate(0.2), run.monolith(0.2)
    found, exact = run.impacts(record), np.array(reference.impacts)
    assert len(found) == len(exact) == 9
    np.testing.assert_allclose(found[:, 0], exact[:, 0], atol=0.1 * run.STEP)
    np.testing.assert_allclose(found[:, 1], exact[:, 1], atol=1e-5)
    settled = run.rest_time(record, "guide.stop")
    assert settled == pytest.approx(reference.rest_time, abs=2 * run.STEP)


@pytest.mark.slow
def test_energy_error_of_the_voice_coil_is_proportional_to_the_step():
    """Before any impact, the cause of the error is a velocity that is constant within a step."""
    run = example("voice_coil")
    records = [run.simulate(0.03, step) for step in (1e-4, 5e-5)]
    longer, shorter = (abs(run.energy_error(record)[-1]) for record in records)
    assert shorter == pytest.approx(longer / 2, rel=0.1)
    assert longer < 0.01 * records[0]["guide.energy.work"][-1]


@pytest.mark.slow
def test_voice_coil_prints_and_plots(capsys):
    example("voice_coil").main(["--stop-time", "0.04"])
    assert "not yet at rest: increase --stop-time" in capsys.readouterr().out
    assert is_picture("voice_coil.png")


@pytest.mark.parametrize("time", ["0", "nan", "inf"])
def test_voice_coil_rejects_an_invalid_stop_time(time, capsys):
    with pytest.raises(SystemExit):
        example("voice_coil").main(["--stop-time", time])
    assert f"--stop-time {time}: must be finite and at least 0.0001 s" in capsys.readouterr().err


@pytest.mark.slow
def test_harvester_with_impacts_has_the_power_of_one_solver():
    """The mass hits each stop once per period.

    Load and coil share the power in proportion to their resistances.
    """
    run = example("energy_harvester")
    table = run.sweep([36.0])
    assert table["power"][0] == pytest.approx(run.monolith([36.0])[0], rel=2e-3)
    assert table["impacts"][0] == 2.0
    share = run.LOAD["load"] / run.LOAD["resistance"]
    assert table["power"][0] == pytest.approx(share * table["heat"][0], rel=1e-12)


@pytest.mark.slow
def test_error_of_the_harvester_without_impacts_halves_with_the_step():
    """The delay by half a step h shifts the resonance, in proportion to h."""
    run = example("energy_harvester")
    exact, errors = run.monolith([28.0], stops=False)[0], []
    for steps in (64, 128):
        run.sweep.__globals__["STEPS"] = steps
        table = run.sweep([28.0])
        assert table["impacts"][0] == 0.0
        errors.append(table["power"][0] / exact - 1.0)
    assert abs(errors[0]) < 0.015
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.15)


@pytest.mark.slow
def test_closed_form_of_the_harvester_agrees_with_one_solver():
    """There are no stops; the tolerance is the error of small amplitudes, (x / r)^2 = 4e-4."""
    run = example("energy_harvester")
    assert run.monolith([28.0], stops=False)[0] == pytest.approx(run.linear(28.0), rel=1e-3)


@pytest.mark.slow
def test_power_of_the_harvester_depends_on_the_direction_of_the_sweep():
    """With rising frequency the mass hits both stops up to 44 Hz; back from 50 Hz it hits none."""
    run = example("energy_harvester")
    table = run.sweep([36.0, 38.0, 40.0, 42.0, 44.0, 50.0, 44.0])
    assert table["impacts"].tolist() == [2.0] * 5 + [0.0, 0.0]
    assert table["power"][4] > 10 * table["power"][6]
    assert table["power"][6] == pytest.approx(run.linear(44.0), rel=0.05)


@pytest.mark.slow
def test_harvester_prints_and_plots(capsys, monkeypatch):
    run = example("energy_harvester")
    for name, value in (("SETTLING", 2), ("MEASURED", 1)):
        monkeypatch.setitem(run.main.__globals__, name, value)
    run.main(["--frequencies", "36", "30"])
    printed = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in printed[1:3]] == ["30.0", "36.0"]
    assert is_picture("energy_harvester.png")


@pytest.mark.slow
def test_drop_test_speeds_agree_with_the_scalar_equation_and_beam_theory():
    """Errors of the speed: 2e-4 by the piecewise constant acceleration, 3 % by the stiff 1R."""
    run = example("drop_test")
    heights = (0.01, 0.05, 0.5)
    table = run.study(heights)
    np.testing.assert_allclose(table["speed"], [run.monolith(h) for h in heights], rtol=2e-4)
    np.testing.assert_allclose(table["speed"], [run.linear(h) for h in heights], rtol=0.03)
    assert (table["speed"] > 0).tolist() == [False, True, True]


@pytest.mark.slow
def test_impulse_of_the_drop_test_is_the_change_of_momentum():
    """P = (1 + eps) m v, where m = M/cos(phi)^2 for a mass M at an angle phi on a circle."""
    run = example("drop_test")
    table, body = run.study((0.3,)), run.guide()
    mass = body.mass / (1 - (run.TRAVEL / body.r) ** 2)
    expected = (1 + body.restitution) * mass * table["speed"][0]
    assert table["impulse"][0] == pytest.approx(expected, rel=1e-9)


def test_short_shock_of_the_drop_test_is_an_initial_velocity(monkeypatch):
    """By conservation of energy, an initial speed u is sqrt(u^2 - (w x)^2) at the stop."""
    run = example("drop_test")
    for function in (run.linear, run.monolith):
        monkeypatch.setitem(function.__globals__, "SHOCK_DURATION", 1e-6)
    monkeypatch.setitem(run.monolith.__globals__, "STEP", 1e-7)
    u, body = run.velocity_change(0.1), run.guide()
    mass = 0.005 + 2 * 13 / 35 * 7800 * 0.01 * 8e-3 * 1e-4
    stiffness = 24 * 181.5e9 * 8e-3 * 1e-12 / 12 / 0.01**3
    speed = math.sqrt(u**2 - stiffness / mass * run.TRAVEL**2)
    assert run.linear(0.1) == pytest.approx(speed, rel=1e-5)
    assert body.mass == pytest.approx(mass, rel=0.02)


@pytest.mark.slow
def test_drop_test_prints_and_plots(capsys):
    example("drop_test").main(["--heights", "0.1", "0.01"])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:3]] == ["10.0", "100.0"]
    assert is_picture("drop_test.png")


def test_drop_test_rejects_an_invalid_height(capsys):
    with pytest.raises(SystemExit):
        example("drop_test").main(["--heights", "0"])
    assert "--heights: must be above 0 and at most 100 m" in capsys.readouterr().err


@pytest.mark.slow
def test_cosimulation_is_of_first_order_and_event_mode_has_no_delay(capsys, monkeypatch):
    """The order is one before an impact and, with event mode, also after two impacts."""
    run = example("model_exchange")
    found = run.study([1e-3, 5e-4, 2.5e-4, 1.25e-4])
    with_events = "Gauss-Seidel, event mode"
    for errors in (
        found.before["Gauss-Seidel"],
        found.before[with_events],
        found.after[with_events],
    ):
        assert run.order(found.steps, errors) == pytest.approx(1.0, abs=0.05)
    assert (found.delay[with_events] == 0.0).all()
    for method in ("Jacobi", "Gauss-Seidel"):
        assert (found.delay[method] > 0.0).all()
        assert (found.delay[method] <= found.steps).all() or method == "Jacobi"
    monkeypatch.setitem(run.main.__globals__, "study", lambda: found)
    run.main([])
    printed = capsys.readouterr().out
    assert "longest delay" in printed
    assert is_picture("model_exchange.png")


@pytest.mark.slow
def test_escapement_conserves_momentum_and_converges_to_one_mechanism():
    """Momentum is exact to rounding, energy to the tolerance, times to the square of the step."""
    run = example("escapement")
    reference = run.monolith()
    found = []
    for step in (2e-3, 1e-3, 5e-4):
        result = run.coupled(step)
        assert len(run.impacts(result)) == len(reference) == 6
        assert run.momentum_error(result).max() < 1e-9
        total = run.energy(result)
        assert np.abs(total - total[0]).max() < 1e-7 * total[0]
        found.append(run.errors(result, reference))
    time, speed = np.array(found).T
    assert time[2] < 3e-5
    assert speed[2] < 1e-4  # The wall is up to 2 a h^2 from its reference, at another velocity.
    assert math.log2(time[0] / time[2]) / 2 == pytest.approx(2.0, abs=0.5)


@pytest.mark.slow
def test_escapement_prints_and_plots(capsys, monkeypatch):
    run = example("escapement")
    run.main.__globals__["STEPS"] = (2e-3, 1e-3)
    assert run.main([]) == 0
    assert "momentum             conserved to" in capsys.readouterr().out
    assert is_picture("escapement.png")
