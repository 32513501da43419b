"""Modes that deform no spring are called free, and those that leave an equilibrium unstable."""

import shlex

import pytest

from prbm.commands import command_line as cli

TABLE = """
name = "Table"
title = "A body on two links with pinned ends"
gravity = [0.0, {gravity}]
[ground]
left = ["0 m", "0 m"]
right = ["40 mm", "0 m"]
[[bodies]]
name = "plate"
mass = "0.1 kg"
inertia = "1e-4 kg m2"
centre = ["20 mm", "80 mm"]
points = {{ left = ["0 m", "80 mm"], right = ["40 mm", "80 mm"] }}
[[flexure_types]]
name = "bar"
model = "1R"
thickness = "1 mm"
width = "10 mm"
youngs_modulus = "200 GPa"
density = "7800 kg/m3"
[[flexures]]
name = "one"
type = "bar"
start = "ground.left"
end = "plate.left"
ends = ["pin", "pin"]
[[flexures]]
name = "two"
type = "bar"
start = "ground.right"
end = "plate.right"
ends = ["pin", "pin"]
[[stops]]
name = "stop"
body = "plate"
point = ["40 mm", "80 mm"]
position = "10 mm"
restitution = 0.5
[release]
body = "plate"
displacement = "0 m"
velocity = "0.01 m/s"
"""


@pytest.mark.parametrize(
    ("gravity", "mode", "summary"),
    [
        (0.0, " free ", "none: without stops, a motion deforms no flexure"),
        (-9.81, " unstable ", "none: without stops, the equilibrium under gravity is unstable"),
    ],
)
def test_free_and_unstable_modes_are_told_apart(
    gravity, mode, summary, tmp_path, monkeypatch, capsys
):
    """Links that stand on pins fall under gravity, and do nothing without it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.toml").write_text(TABLE.format(gravity=gravity), encoding="utf-8")
    assert cli.main(shlex.split("modes table.toml")) == cli.OK
    assert mode in capsys.readouterr().out.splitlines()[2]
    assert cli.main(shlex.split("simulate table.toml --stop-time 0.1")) == cli.OK
    assert summary in capsys.readouterr().out
