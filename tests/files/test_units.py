"""Conversions by powers of ten equal those of pint, and need no import of pint."""

import subprocess
import sys

import pytest

from prbm.base.errors import MechanismError
from prbm.files import units
from prbm.files.mechanism_file import shipped

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


def test_shipped_mechanisms_are_read_without_pint():
    script = "import prbm, sys; [*map(prbm.load, sys.argv[1:])]; print('pint' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script, *shipped()], capture_output=True, text=True
    )  # fmt: skip
    assert done.stdout == "False\n", done.stderr
