"""Commands name what does not apply to bodies that fly freely or without flexures."""

import pytest

from prbm.commands import command_line as cli

BALL = """
name = "LoneBall"
title = "A ball falls on a floor"
gravity = [0.0, -9.81]
[[bodies]]
name = "ball"
mass = "1 kg"
inertia = "1 kg m2"
centre = [0.0, "1 m"]
[[stops]]
name = "floor"
body = "ball"
point = [0.0, "1 m"]
direction = -90.0
position = "1 m"
restitution = 0.7
[release]
body = "ball"
"""
PENDULUM = """
[ground]
pin = [0.0, "2 m"]
[[bodies]]
name = "bob"
mass = "1 kg"
inertia = "1 g m2"
centre = [0.0, "1.5 m"]
points = { pin = [0.0, "2 m"] }
[[joints]]
name = "hinge"
start = "ground.pin"
end = "bob.pin"
"""


@pytest.fixture
def ball(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(BALL, encoding="utf-8")
    return str(path)


def test_a_mechanism_without_modes_or_flexures_is_rejected_by_name(ball, capsys):
    assert cli.main(["modes", ball]) == 2
    assert "LoneBall has no modes: all bodies fly freely" in capsys.readouterr().err
    assert cli.main(["stress", ball]) == 2
    assert "LoneBall has no flexures" in capsys.readouterr().err


def test_modes_name_the_bodies_that_they_leave_out(tmp_path, capsys):
    path = tmp_path / "both.toml"
    path.write_text(BALL.replace("[[bodies]]", PENDULUM + "[[bodies]]", 1), encoding="utf-8")
    assert cli.main(["modes", str(path)]) == 0
    assert "bodies that fly freely are fixed in these modes: ball" in capsys.readouterr().out


def test_the_summary_of_a_motion_without_modes_does_not_refer_to_them(ball, capsys):
    assert cli.main(["simulate", ball, "--stop-time", "1"]) == 0
    text = capsys.readouterr().out
    assert "none: all bodies fly freely" in text
    assert "simulate longer" in text
    assert "prbm modes" not in text
