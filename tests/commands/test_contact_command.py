"""``prbm contact``."""

import csv
import shlex
import tomllib
from pathlib import Path

import pytest

import prbm
from point_mass import point_mass
from prbm.analysis.contact_hit import first_hit
from prbm.commands import command_line as cli
from prbm.files.settings import stiffness
from support import SUPPORT

BALL = '--radius 5mm --youngs-modulus "200 GPa"'
PAD = '--thickness 2mm --area "100 mm2" --youngs-modulus "10 MPa"'
ACCELEROMETER = SUPPORT / "accelerometer_1r.toml"
HIT = ' --mass 53g --speed "0.8 m/s" --restitution 0.5'


def printed(line: str, capsys) -> str:
    """Run the command and return its output."""
    assert cli.main(shlex.split(f"contact {line}")) == cli.OK
    return str(capsys.readouterr().out)


def test_the_output_repeats_sizes_and_materials_in_si(capsys):
    assert "radius 5 m, 200 Pa" in printed("--radius 5 --youngs-modulus 200", capsys)
    assert "0.0001 m2, 0.002 m thick, 1e+07 Pa" in printed(PAD, capsys)


@pytest.mark.parametrize("body", [BALL, PAD])
def test_a_stop_with_the_printed_keys_has_the_printed_force(body, capsys):
    text = printed(body + HIT, capsys)
    keys = tomllib.loads(text.partition("mechanism file:\n")[2])
    keys["stiffness"] = stiffness(keys["stiffness"], keys["exponent"], "stiffness")
    result = prbm.simulate(point_mass(mass=0.053, velocity=0.8, **keys), stop_time=0.03)
    force = next(line for line in text.splitlines() if line.startswith("peak force"))
    assert max(result["stop.peak_force"]) == pytest.approx(float(force.split()[2]), rel=1e-4)


def test_the_printed_stiffness_has_a_unit_that_a_mechanism_file_accepts(tmp_path, capsys):
    text = printed(BALL, capsys)
    keys = text.partition("mechanism file:\n")[2]
    file = tmp_path / "stops.toml"
    file.write_text(ACCELEROMETER.read_text("utf-8").replace("restitution = 0.5", keys), "utf-8")
    stiffness = prbm.load(str(file)).stops[0].stiffness
    assert f'stiffness = "{stiffness:.6g} N/m^1.5"' in keys


@pytest.mark.parametrize(
    ("exponent", "one", "other"),
    [
        (1, "2e6", "2 kN/mm"),
        (1.5, "1e10", "1e10 N/m^1.5"),
        (1.5, "1e10", "1e7 kN/m^1.5"),
        (2, "3e6", "3 N/mm2"),
    ],
)
def test_units_of_the_stiffness_do_not_change_the_hit(exponent, one, other, capsys):
    line = f"--exponent {exponent}{HIT} --stiffness"
    assert printed(f'{line} "{other}"', capsys) == printed(f"{line} {one}", capsys)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (f"{BALL} --mass 53g", "--mass and --speed: give both"),
        ("--radius -5mm --youngs-modulus 200GPa", "--radius -5mm must be positive"),
        ("--radius 0 --youngs-modulus 200GPa", "--radius 0 must be positive"),
        ("--radius 5kg --youngs-modulus 200GPa", "write a quantity in m"),
        ("--thickness 2mm --youngs-modulus 10MPa", "--area is missing"),
        ('--stiffness "1e10 N/m" --exponent 1.5', "--stiffness: '1e10 N/m' must be a force over"),
        ('--stiffness "1e10 N/m^1.5"', "--stiffness 1e10 N/m^1.5: "),
    ],
)
def test_mistakes_are_rejected(options, words, capsys):
    assert cli.main(shlex.split(f"contact {options}")) == cli.MISTAKE
    assert words in capsys.readouterr().err


def test_each_hit_of_a_compliant_stop_has_force_indentation_and_duration(tmp_path, monkeypatch):
    """The hits are those of a point mass, whose force is proportional to its speed."""
    monkeypatch.chdir(tmp_path)
    first, name, rest = ACCELEROMETER.read_text("utf-8").partition('name = "bump_right"')
    keys = 'law = "compliant"\nstiffness = "20 kN/m"\nexponent = 1\nrestitution = 0.5'
    rest = rest.replace("restitution = 0.5", keys, 1).replace("4 um", "0.5 um")
    Path("one.toml").write_text(first + name + rest, encoding="utf-8")
    line = 'simulate one.toml --set release.displacement="-0.4 um" --out . --stop-time 0.2ms'
    line += ' --set release.velocity="0.1 m/s"'
    assert cli.main(shlex.split(line)) == cli.OK
    with open("Accelerometer-impacts.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    hits = [row for row in rows if row["stop"] == "bump_right"]
    rigid = [row for row in rows if row["stop"] == "bump_left"]
    assert len(hits) > 1
    assert rigid
    for row in hits:
        hit = first_hit(2e4, 1.0, 0.5, 9.3e-9, float(row["approach speed [m/s]"]))
        for head, expected in (
            ("peak force [N]", hit.force),
            ("indentation [m]", hit.indentation),
            ("contact duration [s]", hit.duration),
        ):
            assert float(row[head]) == pytest.approx(expected, rel=0.02)
    heads = ("peak force [N]", "indentation [m]", "contact duration [s]")
    assert {row[head] for row in rigid for head in heads} == {""}
