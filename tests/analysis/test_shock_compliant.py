"""Forces, indentations and durations of hits on the compliant bump stops of an accelerometer."""

import math
import shlex
from dataclasses import replace

import pytest

import prbm
from prbm.analysis.contact_hit import first_hit
from prbm.analysis.shock import Pulse, shock
from prbm.base.unit_text import GRAVITY
from prbm.commands import command_line as cli
from support import ROOT, SUPPORT

ACCELEROMETER = ROOT / "examples" / "shock" / "accelerometer.toml"
SMALL = SUPPORT / "accelerometer_1r.toml"
PULSE = Pulse("half-sine", 500 * GRAVITY, 0.5e-3)
STIFFNESS = 1e4  # N/m
MASS = 2330.0 * 25e-6 * (500e-6 * 200e-6 - 180e-6 * 20e-6)  # Of the proof mass [kg].


def found_shock():
    """Return the shock of the accelerometer with bump stops of constant stiffness."""
    one = prbm.load(str(ACCELEROMETER))
    stops = tuple(replace(s, stiffness=STIFFNESS, exponent=1.0) for s in one.stops)
    one = replace(one, stops=stops)
    return shock(one, {PULSE.input: PULSE.signal}, duration=PULSE.duration, stop_time=1e-3)


@pytest.mark.slow
def test_hits_have_force_indentation_and_duration():
    """Truss, springs and pulse change those of the proof mass alone by less than 15 %."""
    found = found_shock()
    right, left = found.hits
    assert (right.count, right.force, right.indentation) == (0, 0.0, 0.0)
    point = first_hit(STIFFNESS, 1.0, 0.5, mass=MASS, speed=left.speed)
    assert left.count > 0
    assert left.force == pytest.approx(point.force, rel=0.15)
    assert left.indentation == pytest.approx(point.indentation, rel=0.15)
    assert left.duration >= 0.5 * math.pi * math.sqrt(MASS / STIFFNESS)
    largest = max(x.latched.peak_force for x in found.result.impacts)
    assert left.force >= largest > 0.0
    assert left.force >= max(found.result["bump_left.force"])


def test_rigid_stops_have_no_force():
    one = prbm.load(str(SMALL))
    found = shock(one, {PULSE.input: PULSE.signal}, duration=PULSE.duration, stop_time=1e-3)
    assert all(hits.force is None for hits in found.hits)


@pytest.fixture
def file(tmp_path):
    """Return the file of the small accelerometer with compliant bump stops."""
    text = SMALL.read_text("utf-8")
    changed = 'restitution = 0.5\nlaw = "compliant"\nstiffness = "1e4 N/m"'
    path = tmp_path / "compliant.toml"
    path.write_text(text.replace("restitution = 0.5", changed), "utf-8")
    return path


@pytest.mark.slow
def test_the_command_prints_and_draws_the_forces(file, tmp_path, capsys):
    out = ["--out", str(tmp_path / "out")]
    line = '--peak "500 g" --duration 0.5ms --stop-time 1ms'
    assert cli.main(["shock", str(file), *shlex.split(line), *out]) == cli.OK
    printed = capsys.readouterr().out
    assert "force at bump_left" in printed
    line = "--input 'base.acceleration.x=half-sine(500 g, 0.5 ms)' --stop-time 1ms"
    assert cli.main(["simulate", str(file), *shlex.split(line)]) == cli.OK
    assert "force at bump_left" in capsys.readouterr().out
    assert (tmp_path / "out" / "Accelerometer-shock.png").stat().st_size > 10_000


@pytest.mark.slow
def test_the_sweep_over_the_peak_has_a_column_of_the_force(file, tmp_path, capsys):
    """The force grows with the peak; without hits it is zero."""
    line = "--duration 0.5ms --peaks 10 500 800 g --stop-time 0.6ms"
    out = ["--out", str(tmp_path / "out")]
    assert cli.main(["shock", str(file), *line.split(), *out]) == cli.OK
    assert "force [N]" in capsys.readouterr().out
    table = (tmp_path / "out" / "Accelerometer-fragility.csv").read_text("utf-8").splitlines()
    column = table[0].split(",").index("force [N]")
    forces = [float(row.split(",")[column]) for row in table[1:]]
    assert forces[0] == 0.0 < forces[1] < forces[2]
