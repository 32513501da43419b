"""``prbm stress`` and the stress in the summary of ``prbm simulate``."""

import csv
import io
import math
import shlex
import sys
from pathlib import Path

import pytest

import prbm
from prbm.commands import command_line as cli
from prbm.files.mechanism_file import shipped
from prbm.runs.struck import first_rigid_impact, peak_before

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


def table(name: str = "stress") -> list[list[str]]:
    """Return the rows of the written table."""
    return list(csv.reader(io.StringIO(Path(f"out/PRBDM2R-{name}.csv").read_text("utf-8"))))


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
    rows = table("stress-held")
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


# The stress after the impact is larger than at the release.
STRUCK = "--set release.displacement=0 --set gravity.x=0 --set release.velocity=2"
CHANGES = {"release.displacement": 0.0, "gravity.x": 0.0, "release.velocity": 2.0}


def test_the_stress_before_a_rigid_impact_is_the_peak_of_a_run_that_ends_there(guide):
    mechanism = prbm.load(guide)
    whole = prbm.simulate(mechanism, CHANGES | {"stop.position": 2e-3}, stop_time=0.01)
    hit = first_rigid_impact(whole.columns, mechanism)
    assert hit == whole.impacts[0].time
    until = prbm.simulate(
        mechanism, CHANGES | {"stop.position": 2e-3}, stop_time=0.99999 * hit, step=hit / 50
    )
    assert math.isinf(first_rigid_impact(until.columns, mechanism))
    before = peak_before(whole.columns, "left_flexure", hit)
    assert before <= until["left_flexure.peak_stress"][-1]
    fine = prbm.simulate(
        mechanism, CHANGES | {"stop.position": 2e-3}, stop_time=0.01, step=hit / 200.3
    )
    before = peak_before(fine.columns, "left_flexure", hit)
    assert before == pytest.approx(until["left_flexure.peak_stress"][-1], rel=0.02)
    assert before < fine["left_flexure.peak_stress"][-1]


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("simulate {}", ["before the first impact", "not reliable, safety", "factor of 5"]),
        ("stress {}", ["before the first impact", "factor of 5"]),
    ],
)
def test_a_safety_factor_after_a_rigid_impact_has_a_caveat_and_the_one_before(
    guide, command, words, capsys
):
    base = f"{command.format(guide)} {STRUCK} --stop-time 10ms"
    assert run(f"{base} --set stop.position=2mm") == cli.OK
    struck = capsys.readouterr().out
    assert all(word in struck for word in words)
    assert run(f"{base} --set stop.position=70mm") == cli.OK
    free = capsys.readouterr().out
    assert not any(word in free for word in words)
    assert "stress" in free


@pytest.mark.slow
@pytest.mark.parametrize("options", ["--peak", "--peaks"])
def test_a_shock_with_rigid_impacts_has_the_caveat(guide, options, capsys):
    """The free guide moves by less than 10 mm."""
    base = f'shock {guide} {options} "20 g" --duration 2ms --stop-time 200ms'
    position = "--set gravity.x=0 --set stop.position"
    for place, caveat in (("1mm", True), ("70mm", False)):
        assert run(f"{base} {position}={place}") == cli.OK
        assert ("not reliable" in capsys.readouterr().out) == caveat


@pytest.mark.slow
def test_tables_of_held_shapes_and_of_motion_do_not_replace_each_other(guide):
    assert run(f"stress {guide} --stop-time 10ms --out out") == cli.OK
    moving = table()
    assert run(f"stress {guide} --held 10mm --out out") == cli.OK
    assert table() == moving
    assert table("stress-held") != moving
