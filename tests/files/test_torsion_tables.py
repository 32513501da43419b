"""Torsion at joints in mechanism files: units, copies, mistakes."""

import math

import pytest

from prbm.base.errors import PrbmError
from prbm.files.mechanism_file import read_mechanism

FILE = """
name = "Levers"
title = "Levers on torsion springs"
[ground]
left = ["-50 mm", 0]
[[bodies]]
name = "left_lever"
mass = "1 kg"
inertia = "1e-3 kg.m2"
centre = ["-50 mm", "20 mm"]
points = { eye = ["-50 mm", 0] }
mirror = "x = 0"
[[joints]]
name = "left_pin"
start = "ground.left"
end = "left_lever.eye"
stiffness = "20 mN.m/deg"
free_angle = "-30 deg"
damping = "0.1 mN.m.s/rad"
mirror = "x = 0"
[release]
body = "left_lever"
"""


def reading(tmp_path, *changes):
    text = FILE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "levers.toml"
    path.write_text(text, encoding="utf-8")
    return read_mechanism(path)


def test_quantities_of_joints_have_units(tmp_path):
    pin = reading(tmp_path).joints[0]
    assert pin.stiffness == pytest.approx(3.6 / math.pi, rel=1e-12)
    assert pin.free_angle == pytest.approx(-math.pi / 6.0, rel=1e-12)
    assert pin.damping == 1e-4


def test_the_free_angle_of_a_mirror_image_has_the_opposite_sign(tmp_path):
    left, right = reading(tmp_path).joints
    assert (right.name, right.end) == ("right_pin", "right_lever.eye")
    assert right.free_angle == -left.free_angle
    assert (right.stiffness, right.damping) == (left.stiffness, left.damping)


def test_the_free_angle_of_a_mirror_image_of_an_expression_shares_its_parameter(tmp_path):
    turned = (
        '[[bodies]]', '[[geometry]]\nname = "wound"\nvalue = "0.2 rad"\n[[bodies]]'
    )  # fmt: skip
    given = reading(tmp_path, turned, ('"-30 deg"', '"wound/2 - 0.1 rad"'))
    assert [joint.free_angle for joint in given.joints] == ["wound/2 - 0.1", "- 0.5*wound + 0.1"]


def test_a_repeated_copy_has_the_same_free_angle(tmp_path):
    row = ('mirror = "x = 0"', "repeat = { count = 2, angle = 90 }")
    one, two = reading(tmp_path, row).joints
    assert one.free_angle == two.free_angle == pytest.approx(-math.pi / 6.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ('stiffness = "20 mN.m/deg"\n', ""),
            r"left_pin\.free_angle: the joint has no spring; add",
        ),
        (('"-30 deg"', '"-30 mm"'), "another dimension"),
        (('"-30 deg"', '"101 rad"'), "left_pin.free_angle = 101 rad must be at most 100"),
        (('"0.1 mN.m.s/rad"', '"0.1 mN.m/rad"'), "another dimension"),
        (('"0.1 mN.m.s/rad"', '"-1 mN.m.s/rad"'), "must be at least 0"),
    ],
)
def test_mistakes_of_torsion_are_rejected_with_a_remedy(tmp_path, change, message):
    with pytest.raises(PrbmError, match=message):
        reading(tmp_path, change)
