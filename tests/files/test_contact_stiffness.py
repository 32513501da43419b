"""Mistakes in compliant stops, in every place where their values are given, and units of k."""

import re
import shlex

import pytest

import prbm
from point_mass import point_mass
from prbm.analysis.shock import Pulse
from prbm.base.errors import PrbmError
from prbm.commands import command_line as cli
from prbm.hybrid.simulation import Simulation
from prbm.kernel.simulation import KernelSimulation
from support import SUPPORT

ACCELEROMETER = SUPPORT / "accelerometer_1r.toml"
VALUES = [  # Key of the stop, value in TOML and in Python, words of the message: value, remedy.
    ("stiffness", "0", 0.0, "0 N/m must be at least 1e-06 N/m"),
    ("stiffness", '"-5 N/m"', -5.0, "-5 N/m must be at least 1e-06 N/m"),
    ("stiffness", "inf", float("inf"), "inf"),
    ("exponent", "0.5", 0.5, "0.5 must be at least 1"),
    ("restitution", "0.005", 0.005, "0.005 must be at least 0.01"),
    ("restitution", "1.5", 1.5, "1.5 must be at most 1"),
]


def written(tmp_path, **keys):
    """Return the file of the accelerometer with compliant stops that have these keys in TOML."""
    given = {"stiffness": '"1e4 N/m"', "restitution": "0.5", **keys}
    lines = "\n".join(f"{key} = {text}" for key, text in given.items())
    text = ACCELEROMETER.read_text("utf-8")
    file = tmp_path / "stops.toml"
    file.write_text(text.replace("restitution = 0.5", f'law = "compliant"\n{lines}'), "utf-8")
    return file


@pytest.mark.parametrize(("key", "toml", "value", "words"), VALUES)
def test_a_file_with_an_invalid_value_is_rejected(key, toml, value, words, tmp_path):
    with pytest.raises(PrbmError) as error:
        prbm.load(str(written(tmp_path, **{key: toml})))
    assert f"{key}" in str(error.value)
    assert words.partition(" ")[0] in str(error.value)
    assert re.search(r"must be|finite", str(error.value))


@pytest.mark.parametrize(("key", "toml", "value", "words"), VALUES)
def test_an_invalid_value_of_a_stop_is_rejected(key, toml, value, words):
    with pytest.raises(PrbmError, match=re.escape(f"stop.{key} = {words}")):
        point_mass(**{key: value})


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
@pytest.mark.parametrize(("key", "toml", "value", "words"), VALUES)
def test_an_invalid_parameter_of_a_simulation_is_rejected(key, toml, value, words, engine):
    with pytest.raises(PrbmError, match=re.escape(f"stop.{key} = {words}")):
        engine(point_mass(), {f"stop.{key}": value})


@pytest.mark.parametrize(("key", "toml", "value", "words"), VALUES)
def test_an_invalid_option_is_rejected(key, toml, value, words, tmp_path, capsys):
    setting = f"bump_left.{key}={value:g}"
    line = f"simulate {shlex.quote(str(written(tmp_path)))} --set {setting} --stop-time 1e-6"
    assert cli.main(shlex.split(line)) == cli.MISTAKE
    message = capsys.readouterr().err
    assert f"bump_left.{key} = {words}" in message or "write a finite number in N/m" in message


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_an_indentation_beyond_the_size_is_rejected_with_a_remedy(engine):
    soft = {"stiffness": 1e-3, "position": -0.03}
    sim = engine(point_mass(velocity=1.0, displacement=0.0, **soft))
    words = r"stop is indented by 0\.04.* m at t = .* s, more than .*: raise its stiffness, or move"
    with pytest.raises(PrbmError, match=words):
        sim.advance(0.1)


@pytest.mark.parametrize("duration", [0.0, -1e-3, float("nan"), float("inf")])
def test_a_pulse_without_duration_is_rejected(duration):
    with pytest.raises(PrbmError, match=f"duration = {duration:g} s: must be positive and finite"):
        Pulse("half-sine", 100.0, duration)


def test_a_shock_without_duration_is_rejected(capsys):
    line = f'shock {shlex.quote(str(ACCELEROMETER))} --peak "500 g"'
    assert cli.main(shlex.split(line)) == cli.MISTAKE
    assert "duration" in capsys.readouterr().err


@pytest.mark.parametrize("key", ["yield_strength", "fatigue_strength"])
def test_strengths_without_units_are_rejected(key, tmp_path):
    text = ACCELEROMETER.read_text("utf-8")
    file = tmp_path / "strength.toml"
    file.write_text(text + f'\n[[materials]]\nname = "x"\nyoungs_modulus = "1 GPa"\n'
                    f'density = "1 g/cm3"\n{key} = "900"\n', "utf-8")  # fmt: skip
    with pytest.raises(PrbmError, match=rf"{key} .*'900': write .* a number and a unit"):
        prbm.load(str(file))


# --- units of the stiffness -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("exponent", "toml", "expected"),
    [
        (1, '"2 N/mm"', 2e3),
        (1.5, '"1e9 N/m^1.5"', 1e9),
        (1.5, "1e9", 1e9),
        (1.5, '"2 kN/mm^1.5"', 2e3 * 1e3**1.5),
        (2, '"3 N/mm2"', 3e6),
        (2.5, '"3 N / m^2.5"', 3.0),
    ],
)
def test_the_unit_of_the_stiffness_has_the_exponent(exponent, toml, expected, tmp_path):
    own = prbm.load(str(written(tmp_path, exponent=f"{exponent}", stiffness=toml)))
    assert own.stops[0].stiffness == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    ("exponent", "given", "unit"),
    [
        (1.5, "1e9 N/m", "N/m^1.5"),
        (1.5, "1e9", "N/m^1.5"),
        (1.5, "1e9 N/m^2", "N/m^1.5"),
        (1.5, "1e9 kg/m^1.5", "N/m^1.5"),
        (1.5, "1e9 Pa", "N/m^1.5"),
        (1, "1e9 N/m^1.5", "N/m^1"),
        (1, "1e9 Pa", "N/m"),
    ],
)
def test_another_dimension_is_rejected_with_the_expected_unit(exponent, given, unit, tmp_path):
    with pytest.raises(PrbmError) as error:
        prbm.load(str(written(tmp_path, exponent=f"{exponent}", stiffness=f'"{given}"')))
    assert "stiffness" in str(error.value)
    assert given.split()[-1] in str(error.value)
    assert unit in str(error.value)
