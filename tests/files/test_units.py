"""Conversions by powers of ten equal those of pint, and need no import of pint; decimal commas."""

import os
import re
import subprocess
import sys

import pytest

from prbm.base.errors import MechanismError, PrbmError
from prbm.commands import words
from prbm.commands.command_line import main
from prbm.files import settings, units
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.runs.inputs import read_signal
from prbm.sweeps import plan
from prbm.sweeps.table import read_table

NUMBERS = [
    "0.1", "-53.187", "1e-9", "7.8", "181.5", "2.51327412287183459076", "1e308",
    "0.1234567890123456789012345678901234567890", "9999999999999999999999999999999995",
]  # fmt: skip
PAIRS = [(wanted, unit) for wanted, known in units.COMMON.items() for unit in known]


@pytest.mark.parametrize(("wanted", "unit"), PAIRS)
def test_a_power_of_ten_is_the_conversion_of_pint(wanted, unit, monkeypatch):
    for text in NUMBERS:
        found = answer(text, unit, wanted)
        with monkeypatch.context() as patch:
            patch.setattr(units, "COMMON", {})
            assert answer(text, unit, wanted) == found
    assert units.si_unit(f"3 {unit}") == wanted
    monkeypatch.setattr(units, "COMMON", {})
    assert units.si_unit(f"3 {unit}") == wanted


def answer(*arguments):
    """Return a converted number, or the message of the error."""
    try:
        return units.converted(*arguments)
    except MechanismError as error:
        return str(error)


def test_a_number_too_large_for_a_double_is_rejected():
    for text in ("1e308", "1e999999", "9" * 400):
        with pytest.raises(MechanismError, match="finite"):
            units.converted(text, "GPa", "Pa")


@pytest.mark.parametrize(
    ("read", "text", "pointed"),
    [
        (lambda x: units.quantity(x, "m"), "0,2 mm", "0.2 mm"),
        (lambda x: units.quantity(x, "m"), "shuttle.width/2 + 0,2 mm", "shuttle.width/2 + 0.2 mm"),
        (lambda x: units.number(x, "m/s2"), "-9,81", "-9.81"),
        (lambda x: units.contact_stiffness(x, 1.5), "1e9 N/m^1,5", "1e9 N/m^1.5"),
        (lambda x: settings.quantity(x, "m", "--held"), "0,2mm", "0.2mm"),
        (lambda x: settings.quantity(x, "", "--set"), "2,5 %", "2.5 %"),
        (lambda x: settings.tolerance(x, "m", "--vary"), "0,1 mm +- 2 %", "0.1 mm"),
        (lambda x: settings.stiffness(x, 1.0, "--stiffness"), "1,5e9", "1.5e9"),
        (lambda x: words.estimate(x, "Hz", "--frequency"), "4.82 Hz +- 0,06", "0.06 Hz"),
        (lambda x: words.measured(x), "f=4,82 Hz +- 0.06", "4.82"),
        (lambda x: read_signal("force.x", x, "N"), "half-sine(0,5 N, 2 ms)", "0.5 N"),
        (lambda x: read_signal("force.x", x, "N"), "pulse(1 N, 1,5 ms)", "1.5 ms"),
        (lambda x: read_signal("force.x", x, "N"), "0,5 N", "0.5 N"),
        (lambda x: plan._condition(x) and settings.in_unit("constraint", x[14:], "Hz"),
         "fundamental > 40,5 Hz", "40.5 Hz"),
    ],
)  # fmt: skip
def test_every_reader_of_a_decimal_comma_proposes_a_point(read, text, pointed):
    with pytest.raises(PrbmError) as error:
        read(text)
    assert f"write a decimal point instead of the comma: {pointed}" in str(error.value)


def test_rows_with_decimal_commas_are_rejected(tmp_path):
    """A table of one column more than its head would otherwise be read as labels and numbers."""
    path = tmp_path / "table.csv"
    path.write_text("stop.position\n0,001\n0,002\n", encoding="utf-8")
    with pytest.raises(PrbmError, match=r"2 cells, more than its head has names; .* decimal"):
        read_table(path)
    path.write_text("t [s],a [N]\n0,0,5\n1,1,5\n", encoding="utf-8")
    with pytest.raises(PrbmError, match=r"line 2 of .* has 3 cells for 2 columns; .* decimal"):
        read_signal("force.x", f"csv({path})", "N")


def test_a_decimal_comma_in_a_plain_option_is_reported(capsys):
    assert main(["animate", "PRBDM", "film.gif", "--slow", "0,5"]) == 2
    assert "'0,5'; write a decimal point instead of the comma" in capsys.readouterr().err


def test_commas_between_arguments_of_a_signal_are_no_decimal_commas():
    assert read_signal("force.x", "step(3,5)", "N") == read_signal("force.x", "step(3 N,5 s)", "N")


@pytest.mark.parametrize(
    "line", ["thickness = 0,12", "thickness = '0,12 mm'", "thickness = 0,12 mm"]
)
def test_a_decimal_comma_in_a_file_is_reported_with_its_line(line, tmp_path):
    text = shipped()["PRBDM"].read_text(encoding="utf-8")
    path = tmp_path / "guide.toml"
    path.write_text(re.sub("^thickness = .*$", line, text, flags=re.MULTILINE), encoding="utf-8")
    number = path.read_text(encoding="utf-8").splitlines().index(line) + 1
    with pytest.raises(MechanismError, match=rf"line {number}\b.*instead of the comma: 0\.12"):
        read_mechanism(path)


def test_shipped_mechanisms_are_read_without_pint():
    script = "import prbm, sys; [*map(prbm.load, sys.argv[1:])]; print('pint' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script, *shipped()], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    assert done.stdout == "False\n", done.stderr
