"""Mechanism files are read in linear time in the number of their parts."""

from pathlib import Path

import pytest

from growth import grows
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
    "stops": 'body = "arm"\npoint = "arm.tip"\nrest_speed = "1 mm/s"\n',
    "frictions": 'body = "arm"\npoint = ["ratio", 0]\n',
    "forces": 'body = "arm"\n',
    "probes": 'point = "arm.tip"\n',
}


def text(parts: str, n: int, last: str = "") -> str:
    """Return a mechanism file with n more parts of a kind.

    The rest speeds of its stops are given: their defaults need the fundamental frequency, and its
    time grows with a higher power.
    """
    table = f'[[{parts.split()[0]}]]\nname = "PART"\n{PARTS[parts]}'
    tables = (table.replace("PART", f"part_{i}") for i in range(n))
    example = EXAMPLE.replace('on = "anvil"\n', 'on = "anvil"\nrest_speed = "1 mm/s"\n', 1)
    return example + "\n".join(tables) + last


@pytest.mark.slow
@pytest.mark.parametrize("valid", [True, False])
@pytest.mark.parametrize("parts", PARTS)
def test_the_time_grows_in_proportion_to_the_number_of_parts(parts, valid, tmp_path):
    def make(n: int) -> Path:
        path = tmp_path / f"{n}.toml"
        path.write_text(text(parts, n, "" if valid else "stroke = 3\n"), encoding="utf-8")
        return path

    def read(path: Path) -> None:
        if valid:
            read_mechanism(path)
        else:
            with pytest.raises(MechanismError, match="unknown key"):
                read_mechanism(path)

    assert not grows(read, make, 500, 4, power=1)
