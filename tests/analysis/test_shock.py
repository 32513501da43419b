"""Shocks of the base: pulses, an oscillator in closed form, drops, the level of failure."""

import math
import shlex
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

import prbm
from prbm.analysis.shock import PULSES, Pulse, at_rest, fragility, shock
from prbm.base.errors import ParameterError
from prbm.commands import command_line as cli
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import equilibrium, free_displacement
from support import ROOT

ACCELEROMETER = ROOT / "examples" / "shock" / "accelerometer.toml"
QUOTED = shlex.quote(str(ACCELEROMETER))


def accelerometer():
    """Return the accelerometer of the examples."""
    return prbm.load(str(ACCELEROMETER))


@pytest.mark.parametrize("kind", PULSES)
def test_velocity_of_a_pulse_is_the_integral_of_its_acceleration(kind):
    pulse = Pulse(kind, 300.0, 2e-3)
    t = (np.arange(20_000) + 0.5) * 2e-3 / 20_000
    values = [pulse.signal.value(float(x), float(x)) for x in t]
    assert sum(values) * 1e-7 == pytest.approx(pulse.velocity, rel=1e-4)
    assert max(values) == pytest.approx(300.0, rel=1e-4)
    assert pulse.signal.value(2.5e-3, 2.5e-3) == 0.0


@pytest.mark.parametrize("kind", PULSES)
def test_a_drop_changes_the_velocity_by_that_of_the_fall(kind):
    pulse = Pulse.drop(kind, 0.5, 1e-3)
    assert pulse.velocity == pytest.approx(math.sqrt(2 * 9.80665 * 0.5))


def oscillation(omega, zeta, pulse, t):
    """Return x(t) of x'' + 2 zeta omega x' + omega^2 x = -omega^2 a(t), by superposition."""
    tau = np.linspace(0.0, pulse.duration, 2_001)
    a = np.array([pulse.signal.value(float(x), float(min(x, 0.999 * pulse.duration))) for x in tau])
    damped = omega * math.sqrt(1 - zeta**2)
    since = t - tau
    kernel = np.where(since > 0, np.exp(-zeta * omega * since) * np.sin(damped * since), 0.0)
    return float(-trapezoid(a * kernel, tau) * omega**2 / damped)


@pytest.mark.parametrize("kind", PULSES)
def test_response_without_impacts_is_that_of_an_oscillator(kind):
    """The static displacement per acceleration is the amplitude of the oscillator."""
    mechanism = accelerometer()
    pulse = Pulse(kind, 50 * 9.80665, 0.1e-3)
    found = shock(mechanism, {pulse.input: pulse.signal}, duration=pulse.duration, stop_time=0.4e-3)
    assert not sum(hits.count for hits in found.hits)
    system = assemble(mechanism, mechanism.values({"gravity.x": 1.0}))
    per_acceleration = free_displacement(system)
    omega = 2 * math.pi * float(found.result["mode.frequency"][0])
    x = np.array(found.result["proof.x"])
    t = np.array(found.result["time"])
    rows = range(20, len(t), 150)
    expected = [per_acceleration * oscillation(omega, 0.1, pulse, float(t[k])) for k in rows]
    assert x[rows] - x[0] == pytest.approx(expected, abs=2e-3 * np.abs(x).max())


def test_the_mechanism_starts_at_rest_in_its_equilibrium():
    guide = prbm.load("PRBDM2R")
    free = replace(guide, stops=())
    simulation = prbm.Simulation(at_rest(free))
    simulation.advance(0.1)
    out = simulation.outputs()
    assert out["energy.kinetic"] < 1e-12
    system = assemble(free, free.values())
    assert out["shuttle.x"] == pytest.approx(system.amount(equilibrium(system).q), rel=1e-6)


@pytest.mark.slow
def test_bump_stops_limit_the_displacement_and_are_hit():
    pulse = Pulse("half-sine", 500 * 9.80665, 0.5e-3)
    found = shock(accelerometer(), {pulse.input: pulse.signal}, duration=pulse.duration)
    right, left = found.hits
    assert -4e-6 - left.indentation <= found.displacement < -4e-6
    assert (right.count, left.count > 0) == (0, True)
    assert 0.0 < left.speed < 0.2
    assert left.impulse > 0.0
    assert found.safety == pytest.approx(7e8 / found.peak_stress)
    page = (ROOT / "docs" / "strength.md").read_text("utf-8").replace("\n", " ")
    assert f"with a safety factor of {found.safety:.0f}" in page
    assert f"with {1e3 * left.force:.1f} mN" in page


def weak_springs():
    """Return a small accelerometer without stops that yields at 50 MPa."""
    mechanism = prbm.load(str(ROOT / "tests" / "support" / "accelerometer_1r.toml"))
    kinds = tuple(replace(kind, yield_strength=5e7) for kind in mechanism.flexure_types)
    return replace(mechanism, flexure_types=kinds, stops=())


@pytest.mark.slow
def test_safety_factor_at_the_level_of_failure_is_one():
    weak, pulse = weak_springs(), Pulse("sawtooth", 1.0, 0.2e-3)
    peaks = [20 * 9.80665, 100 * 9.80665, 400 * 9.80665]
    _, found, level = fragility(weak, pulse, peaks, stop_time=0.5e-3)
    assert [one.safety < 1.0 for one in found] == [False, False, True]
    at = replace(pulse, peak=level)
    again = shock(weak, {at.input: at.signal}, duration=at.duration, stop_time=0.5e-3)
    assert again.safety == pytest.approx(1.0, rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("first", [60.0, 800.0])
def test_search_for_the_level_of_failure_starts_on_either_side_of_it(first):
    """Without stops the stress is in proportion to the peak, up to the stiffening at 30 um."""
    pulse = Pulse("half-sine", first * 9.80665, 0.2e-3)
    peaks, found, level = fragility(weak_springs(), pulse, stop_time=0.4e-3)
    assert peaks == sorted(peaks)
    fails = [one.safety < 1.0 for one in found]
    assert fails in ([False] * (len(found) - 1) + [True], [False] + [True] * (len(found) - 1))
    linear = pulse.peak * found[peaks.index(pulse.peak)].safety
    assert level == pytest.approx(linear, rel=0.02)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("triangle", 1.0, 1e-3), "triangle"),
        (("half-sine", 0.0, 1e-3), "peak = 0 m/s2"),
        (("half-sine", 1.0, math.inf), "duration = inf s"),
        (("half-sine", 1.0, 1e-3, "z"), "axis = 'z'"),
    ],
)
def test_invalid_pulses_are_rejected(arguments, words):
    with pytest.raises(ParameterError, match=words):
        Pulse(*arguments)


def run(line: str) -> int:
    """Run a command line in this process; return its status."""
    return cli.main(shlex.split(line))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--peak 500g", "--duration is missing"),
        ("--duration 1ms", "give --peak"),
        ('--duration 1ms --peak "1 g" --height 1m', "give --peak"),
        ('--duration 1ms --peak "1 g" --set release.displacement=1mm', "a shock acts on the"),
        ('--record r.csv --peak "1 g"', "--record excludes --peak"),
        ('--duration 1ms --peaks 1 2 g --height "1 m"', "--peaks excludes"),
        ("--sweep peak", "--duration is missing"),
        ("--duration 1ms --sweep peak", "has no yield_strength: add it to the material"),
        ("--record r.csv --sweep peak", "--record excludes --sweep"),
        ('--duration 0 --peak "1 g"', "duration = 0 s"),
        (
            '--duration 1ms --peak "1 g" --set gravity.x=0 --set stop.position=-5mm',
            "the wall stop is penetrated by 0.005 m in the equilibrium without stops, from which a "
            "shock starts: stop.position = -0.005 m, the hit point is at 0 m; move the stop, or "
            "change gravity",
        ),
    ],
)
def test_mistakes_are_rejected(options, words, capsys):
    assert run(f"shock PRBDM2R {options}") == cli.MISTAKE
    assert words in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_prints_hits_stress_and_level_and_writes_files(tmp_path, capsys):
    line = f"shock {QUOTED} --duration 0.5ms --out {shlex.quote(str(tmp_path))} --stop-time 1ms"
    assert run(f'{line} --peak "500 g"') == cli.OK
    printed = capsys.readouterr().out
    assert "impacts at bump_left" in printed
    assert "safety factor" in printed
    assert {path.name for path in tmp_path.iterdir()} == {
        "Accelerometer-shock.csv", "Accelerometer-shock.png",
    }  # fmt: skip
    assert run(f"{line} --peaks 50 100 g") == cli.OK
    assert "at none of these peaks" in capsys.readouterr().out
    assert (tmp_path / "Accelerometer-fragility.png").stat().st_size > 10_000


@pytest.mark.slow
def test_a_record_replaces_the_pulse(tmp_path, capsys):
    record = tmp_path / "record.csv"
    t = np.linspace(0.0, 0.5e-3, 201)
    a = 500 * 9.80665 * np.sin(np.pi * t / 0.5e-3)
    rows = "\n".join(f"{x!r},{y!r}" for x, y in zip(t.tolist(), a.tolist(), strict=True))
    record.write_text(f"time [s],a [m/s2]\n{rows}\n", encoding="utf-8")
    assert run(f"shock {QUOTED} --record {shlex.quote(str(record))} --stop-time 1ms") == cli.OK
    of_record = capsys.readouterr().out.splitlines()[1:]
    line = f'shock {QUOTED} --peak "500 g" --duration 0.5ms --stop-time 1ms'
    assert run(line) == cli.OK
    of_pulse = capsys.readouterr().out.splitlines()[1:]
    assert of_record[0] == of_pulse[0]
