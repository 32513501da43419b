"""Mechanism files are read in linear time in the number of their parts."""

import math
import time
from pathlib import Path

import pytest

from mechanism_mistakes import EXAMPLE
from prbm.base.errors import MechanismError
from prbm.files.mechanism_file import read_mechanism

PARTS = {
    "geometry": 'value = "3 mm"\n',
    "materials": "youngs_modulus = 1e9\ndensity = 1e3\n",
    "flexure_types": 'model = "2R"\nthickness = 1e-4\nwidth = 1e-2\nmaterial = "steel"\n',
    "bodies": (
        'mass = 1\ninertia = 1\ncentre = [0, 0]\npoints.p = ["arm.length", 0]\n'
        '[[joints]]\nname = "PART_pin"\nstart = "arm.tip"\nend = "PART.p"\n'
    ),
    "flexures": 'type = "leaf"\nstart = "ground.foot"\nend = "arm.root"\n',
    "flexures with sections": (
        'model = "1R"\nthickness = 1e-4\nwidth = 1e-2\nmaterial = "steel"\n'
        'start = "ground.foot"\nend = "arm.root"\n'
    ),
    "joints": 'start = "arm.tip"\nend = "anvil.hook"\n',
    "stops": 'body = "arm"\npoint = "arm.tip"\n',
    "frictions": 'body = "arm"\npoint = ["ratio", 0]\n',
    "forces": 'body = "arm"\n',
    "probes": 'point = "arm.tip"\n',
}


def text(parts: str, n: int, last: str = "") -> str:
    """Return a mechanism file with n more parts of a kind."""
    table = f'[[{parts.split()[0]}]]\nname = "PART"\n{PARTS[parts]}'
    tables = (table.replace("PART", f"part_{i}") for i in range(n))
    return EXAMPLE + "\n".join(tables) + last


def duration(path: Path, content: str, valid: bool) -> float:
    """Return the processor time of reading a file [s]."""
    path.write_text(content)
    begin = time.process_time()
    if valid:
        read_mechanism(path)
    else:
        with pytest.raises(MechanismError, match="unknown key"):
            read_mechanism(path)
    return time.process_time() - begin


@pytest.mark.slow
@pytest.mark.parametrize("valid", [True, False])
@pytest.mark.parametrize("parts", PARTS)
def test_four_times_as_many_parts_take_about_four_times_as_long(parts, valid, tmp_path):
    """A quadratic part of the time would make the ratio larger than 8 at these numbers.

    Other programs may disturb the times.  The smallest of up to three times counts.
    """
    path, few, many = tmp_path / "many.toml", math.inf, math.inf
    last = "" if valid else "stroke = 3\n"
    for _ in range(3):
        few = min(few, duration(path, text(parts, 500, last), valid))
        many = min(many, duration(path, text(parts, 2000, last), valid))
        if many < 8 * few and many < 4.0:
            return
    pytest.fail(f"{few:.3g} s for 500 parts, {many:.3g} s for 2000")
