"""``prbm contact``."""

import shlex
import tomllib

import pytest

import prbm
from point_mass import point_mass
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
