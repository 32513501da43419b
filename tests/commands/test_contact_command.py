"""``prbm contact``."""

import shlex
import tomllib

import pytest

import prbm
from point_mass import point_mass
from prbm.commands import command_line as cli
from prbm.files.units import number

BALL = '--radius 5mm --youngs-modulus "200 GPa"'
PAD = '--thickness 2mm --area "100 mm2" --youngs-modulus "10 MPa"'
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
    keys["stiffness"] = number(str(keys["stiffness"]), "N/m") if body == PAD else keys["stiffness"]
    result = prbm.simulate(point_mass(mass=0.053, velocity=0.8, **keys), stop_time=0.03)
    force = next(line for line in text.splitlines() if line.startswith("peak force"))
    assert max(result["stop.peak_force"]) == pytest.approx(float(force.split()[2]), rel=1e-4)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (f"{BALL} --mass 53g", "--mass and --speed: give both"),
        ("--radius -5mm --youngs-modulus 200GPa", "--radius -5mm must be positive"),
        ("--radius 0 --youngs-modulus 200GPa", "--radius 0 must be positive"),
        ("--radius 5kg --youngs-modulus 200GPa", "write a quantity in m"),
        ("--thickness 2mm --youngs-modulus 10MPa", "--area is missing"),
    ],
)
def test_mistakes_are_rejected(options, words, capsys):
    assert cli.main(shlex.split(f"contact {options}")) == cli.MISTAKE
    assert words in capsys.readouterr().err
