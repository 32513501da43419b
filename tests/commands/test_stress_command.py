"""``prbm stress`` and the stress in the summary of ``prbm simulate``."""

import csv
import io
import shlex
import sys
from pathlib import Path

import pytest

import prbm
from prbm.commands import command_line as cli
from prbm.files.mechanism_file import shipped

MATERIAL = """
[[materials]]
name = "steel"
youngs_modulus = "181.5 GPa"
density = "7.8 g/cm3"
yield_strength = "1000 MPa"
tensile_strength = "1500 MPa"
fatigue_strength = "450 MPa"
fatigue_cycles = 1e7
"""


def run(line: str) -> int:
    """Run a command line in this process; return its status."""
    return cli.main(shlex.split(line))


def table() -> list[list[str]]:
    """Return the rows of the written table."""
    return list(csv.reader(io.StringIO(Path("out/PRBDM2R-stress.csv").read_text("utf-8"))))


@pytest.fixture
def guide(tmp_path, monkeypatch):
    """Write a file of the guide with a material and stress as outputs; return its name."""
    monkeypatch.chdir(tmp_path)
    text = shipped()["PRBDM2R"].read_text(encoding="utf-8")
    own = 'youngs_modulus = "181.5 GPa"\ndensity = "7.8 g/cm3"\n'
    assert own in text
    text = text.replace(own, 'material = "steel"\nstress = true\n')
    text = text.replace("[ground]", MATERIAL + "\n[ground]")
    (tmp_path / "guide.toml").write_text(text, encoding="utf-8")
    return "guide.toml"


@pytest.mark.slow
def test_held_shapes_have_the_static_stress(guide, capsys):
    assert run(f"stress {guide} --held 10 18 mm --set gravity.x=0 --out out") == cli.OK
    rows = table()
    found = {(row[0], row[1]): float(row[2]) for row in rows[1:]}
    expected = {
        ("0.01", "left_flexure"): 366.7e6, ("0.01", "right_flexure"): 331.8e6,
        ("0.018", "left_flexure"): 740.7e6, ("0.018", "right_flexure"): 601.2e6,
    }  # fmt: skip
    assert found == pytest.approx(expected, rel=0.012)
    assert "2.7" in capsys.readouterr().out  # 1000 MPa / 366.7 MPa.


def test_motion_has_a_peak_a_safety_factor_and_a_damage(guide, capsys):
    assert run(f"stress {guide} --stop-time 100ms --out out") == cli.OK
    printed = capsys.readouterr().out
    assert "left_flexure" in printed
    rows = table()
    for row in rows[1:]:
        peak, safety, damage = float(row[1]), float(row[4]), float(row[5])
        assert safety == pytest.approx(1e9 / peak)
        assert 0.0 < damage < 1e-3


def test_missing_strengths_have_a_remedy(capsys):
    assert run("stress PRBDM2R --stop-time 20ms") == cli.OK
    printed = capsys.readouterr().out
    assert "add it to the material" in printed
    assert "fatigue_strength" in printed


@pytest.mark.parametrize(
    "command", ["stress {}", 'shock {} --peak "20 g" --duration 2ms --set stop.position=12mm']
)
def test_without_the_package_for_cycles_stress_is_printed_without_damage(
    guide, command, capsys, monkeypatch
):
    monkeypatch.setitem(sys.modules, "rainflow", None)
    assert run(command.format(guide) + " --stop-time 20ms") == cli.OK
    text = capsys.readouterr().out
    assert "no damage: the Python package rainflow is missing" in text
    assert "yield" in text


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--held 10mm --stop-time 1", "--held excludes --input and --stop-time"),
        ("--held 10mm --set force.x=1", "inputs have no effect on held shapes"),
        ("--held 1", "more than the size of the mechanism"),
    ],
)
def test_mistakes_are_rejected(options, words, capsys):
    assert run(f"stress PRBDM2R {options}") == cli.MISTAKE
    assert words in capsys.readouterr().err


def test_the_summary_of_a_simulation_has_the_safety_factor(guide, capsys):
    assert run(f"simulate {guide} --stop-time 20ms") == cli.OK
    printed = capsys.readouterr().out
    peak = prbm.simulate(prbm.load(guide), stop_time=0.02)["right_flexure.peak_stress"][-1]
    assert f"stress in right_flexure {1e-6 * peak:.4g} MPa" in printed
    assert f"safety factor {1e9 / peak:.3g} (yield)" in printed
