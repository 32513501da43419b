"""Positions and velocities of bodies at the start in mechanism files: units, copies, mistakes."""

import math

import pytest

from prbm.base.errors import PrbmError
from prbm.files.mechanism_file import read_mechanism

FILE = """
name = "Balls"
title = "Balls that fly"
[[bodies]]
name = "left"
mass = "1 kg"
inertia = "1e-3 kg.m2"
centre = ["-50 mm", "20 mm"]
start_angle = "30 deg"
start_x = "2 mm"
start_y = "3 mm"
start_omega = "2 rad/s"
start_vx = "4 mm/s"
[release]
body = "left"
"""
REPEATED = 'start_vx = "4 mm/s"\nrepeat = {{ count = 2, angle = {}, about = [0, 0] }}'


def reading(tmp_path, *changes):
    text = FILE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "balls.toml"
    path.write_text(text, encoding="utf-8")
    return read_mechanism(path)


def test_values_at_the_start_have_units_and_are_parameters(tmp_path):
    model = reading(tmp_path)
    values = model.values()
    assert values["left.start_angle"] == pytest.approx(math.pi / 6.0)
    assert (values["left.start_x"], values["left.start_vx"]) == (2e-3, 4e-3)
    assert "left.start_vy" not in values
    units = {p.name: p.unit for p in model.parameters}
    assert (units["left.start_omega"], units["left.start_y"]) == ("rad/s", "m")


def test_a_mirror_image_starts_at_the_mirrored_position(tmp_path):
    image = reading(tmp_path, ('start_vx = "4 mm/s"', 'start_vx = "4 mm/s"\nmirror = "x = 0"'))
    left, right = image.bodies
    assert (right.name, right.centre) == ("right", (0.05, 0.02))
    assert (right.start_x, right.start_y) == (-left.start_x, left.start_y)
    assert (right.start_angle, right.start_omega) == (-left.start_angle, -left.start_omega)
    assert (right.start_vx, right.start_vy) == (-left.start_vx, None)


def test_a_turned_copy_starts_at_the_turned_position(tmp_path):
    one, two = reading(tmp_path, ('start_vx = "4 mm/s"', REPEATED.format(90))).bodies
    assert (two.start_x, two.start_y) == (-one.start_y, one.start_x)
    assert (two.start_vx, two.start_vy) == (None, one.start_vx)
    assert (two.start_angle, two.start_omega) == (one.start_angle, one.start_omega)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ('start_vx = "4 mm/s"', REPEATED.format(30)),
            r"left\.start_vy is missing: a copy that is",
        ),
        (('"2 mm"', '"2 mm/s"'), "another dimension"),
        (('"2 mm"', '"2 km"'), r"left\.start_x = 2000 m must be at most 1000"),
        (('"30 deg"', '"101 rad"'), r"left\.start_angle = 101 rad must be at most 100"),
    ],
)
def test_mistakes_of_values_at_the_start_are_rejected_with_a_remedy(tmp_path, change, message):
    with pytest.raises(PrbmError, match=message):
        reading(tmp_path, change)
