"""Modes about shapes under loads, from the command line."""

import csv

import pytest

from prbm.analysis.static_shape import equilibrium
from prbm.commands import command_line as cli
from support import mechanism


def frequencies(options, folder):
    assert cli.main(["modes", "CurvedBistable", *options.split(), "--out", str(folder)]) == 0
    with open(folder / "CurvedBistable-modes.csv", encoding="utf-8", newline="") as file:
        return [float(row["frequency [Hz]"]) for row in csv.DictReader(file)]


@pytest.mark.slow
def test_a_load_and_the_holding_force_of_its_shape_give_the_same_modes(tmp_path, capsys):
    """The holding force along -y and the load on the same point are one dead load."""
    shape = equilibrium(mechanism("CurvedBistable"), loads={"force.y": -5.0})
    loaded = frequencies("--load force.y=-5N", tmp_path / "loaded")
    held = frequencies(f"--held {shape.displacement!r}", tmp_path / "held")
    assert loaded == pytest.approx(held, rel=1e-6)
    assert loaded[0] < 0.98 * frequencies("", tmp_path / "free")[0]
    assert "force.y = -5" in capsys.readouterr().out


def test_an_unknown_load_is_rejected_with_the_known_ones(capsys):
    assert cli.main(["modes", "CurvedBistable", "--load", "push.y=-5N"]) == 2
    assert "the loads are force.x, force.y, force.moment" in capsys.readouterr().err
