"""The mode that sets the step of the integration."""

import re

import pytest

from prbm.analysis.fastest import fastest
from prbm.commands import simulation
from prbm.commands.command_line import main
from prbm.files.mechanism_file import load


def test_light_leaves_have_the_fastest_mode_and_are_named():
    """The frequency of a leaf is in proportion to the inverse root of its density."""
    guide = load("GuideBeam")
    heavy, light = (fastest(guide, {"flexure.density": rho}) for rho in (4.0, 1.0))
    assert heavy.parameter == light.parameter == "flexure.density"
    assert light.effect == pytest.approx(0.5, abs=0.01)
    assert light.frequency == pytest.approx(2.0 * heavy.frequency, rel=0.01)


def test_a_slow_run_is_explained(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    line = "simulate GuideBeam --stop-time 1ms --set flexure.density=1"
    assert main(line.split()) == 0
    assert "the run is slow" not in capsys.readouterr().out
    monkeypatch.setattr(simulation, "SLOW", 0.0)
    assert main(line.split()) == 0
    printed = capsys.readouterr().out
    assert re.search(r"resolve a mode of .*Hz; flexure\.density changes this frequency", printed)
