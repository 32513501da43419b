"""Springs in mechanism files: units, copies, mistakes."""

import pytest

from prbm.base.errors import PrbmError
from prbm.files.mechanism_file import read_mechanism

FILE = """
name = "Held"
title = "A block between springs"
[ground]
left = ["-50 mm", 0]
[[bodies]]
name = "block"
mass = "1 kg"
inertia = "1e-3 kg.m2"
centre = [0, 0]
points = { left = ["-10 mm", 0], right = ["10 mm", 0] }
[[springs]]
name = "left_coil"
start = "ground.left"
end = "block.left"
stiffness = "2 N/mm"
cubic_stiffness = "1 N/mm3"
damping = "50 mN.s/mm"
[release]
body = "block"
"""


def reading(tmp_path, *changes):
    text = FILE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "held.toml"
    path.write_text(text, encoding="utf-8")
    return read_mechanism(path)


def test_quantities_of_springs_have_units(tmp_path):
    (spring,) = reading(tmp_path, ("damping =", 'free_length = "45 mm"\ndamping =')).springs
    assert (spring.stiffness, spring.cubic_stiffness, spring.damping) == (2e3, 1e9, 50.0)
    assert spring.free_length == 0.045


def test_springs_have_mirror_images_and_repeated_copies(tmp_path):
    found = reading(tmp_path, ("damping =", 'mirror = "x = 0"\ndamping =')).springs
    assert [(s.name, s.start, s.end) for s in found] == [
        ("left_coil", "ground.left", "block.left"), ("right_coil", "ground.right", "block.right")
    ]  # fmt: skip
    assert found[1].stiffness == 2e3
    row = ("damping =", 'repeat = { count = 3, step = [0, "5 mm"] }\ndamping =')
    assert len(reading(tmp_path, row).springs) == 3


def test_springs_and_their_copies_act_on_a_side(tmp_path):
    pulling = ("damping =", 'acts = "tension"\nmirror = "x = 0"\ndamping =')
    assert [s.side for s in reading(tmp_path, pulling).springs] == [1, 1]
    (both,) = reading(tmp_path, ("damping =", 'acts = "both"\ndamping =')).springs
    assert (both.acts, both.side) == ("both", 0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("damping =", 'acts = "pull"\ndamping ='), "acts .* = 'pull'"),
        (('"block.left"', '"block.lefts"'), "left_coil refers to the point 'block.lefts'"),
        (('"ground.left"', '"block.right"'), "spring left_coil joins block to itself"),
        (('["-50 mm", 0]', '["-10 mm", 0]'), r"has the length 0 m, so that its direction"),
        (('stiffness = "2 N/mm"', ""), "stiffness"),
        (('"2 N/mm"', '"2 N/mm2"'), "another dimension"),
        (('"2 N/mm"', '"-2 N/mm"'), "must be at least 0"),
        (('name = "left_coil"', 'name = "block"'), "used twice"),
    ],
)
def test_mistakes_of_springs_are_rejected_with_a_remedy(tmp_path, change, message):
    with pytest.raises(PrbmError, match=message):
        reading(tmp_path, change)
