"""Guides in mechanism files: copies, mistakes."""

import pytest

from prbm.base.errors import PrbmError
from prbm.files.mechanism_file import read_mechanism
from prbm.mechanism.parts import Guide

FILE = """
name = "Table"
title = "A table between two posts on lines"
[ground]
left = ["-50 mm", 0]
left_up = ["-50 mm", "10 mm"]
[[bodies]]
name = "left_post"
mass = "1 kg"
inertia = "1e-3 kg.m2"
centre = ["-50 mm", 0]
points = { pin = ["-50 mm", 0], top = ["-50 mm", "40 mm"] }
mirror = "x = 0"
[[guides]]
name = "left_way"
point = "left_post.pin"
start = "ground.left"
end = "ground.left_up"
turning = false
mirror = "x = 0"
[release]
body = "left_post"
direction = 90
"""


def reading(tmp_path, *changes):
    text = FILE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "table.toml"
    path.write_text(text, encoding="utf-8")
    return read_mechanism(path)


def test_guides_have_mirror_images(tmp_path):
    found = reading(tmp_path)
    assert found.guides == (
        Guide("left_way", "left_post.pin", "ground.left", "ground.left_up", False),
        Guide("right_way", "right_post.pin", "ground.right", "ground.right_up", False),
    )
    assert found.ground["right_up"] == (0.05, 0.01)
    assert found.free_bodies == ()


def test_guides_have_repeated_copies(tmp_path):
    row = 'repeat = { count = 3, step = ["20 mm", 0] }'
    found = reading(tmp_path, ('mirror = "x = 0"', row)).guides
    assert [guide.point for guide in found[1:]] == ["left_post_2.pin", "left_post_3.pin"]
    assert len({guide.start for guide in found}) == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('"left_post.pin"', '"left_post.pins"'), "left_way refers to the point 'left_post.pins'"),
        (('"left_post.pin"', '"left_post.top"'), None),
        (('start = "ground.left"', 'start = "left_post.top"'), "points of two bodies"),
        (("turning = false", "turning = 0"), "turning"),
        (("turning = false", "friction = -0.1"), "friction"),
        (("turning = false", 'friction = "0.1 N"'), "friction"),
        (('end = "ground.left_up"', 'end = "ground.left"'), "undefined: draw these points apart"),
        (
            ('left_up = ["-50 mm", "10 mm"]', 'left_up = ["-40 mm", "10 mm"]'),
            None,
        ),
        (
            ('left = ["-50 mm", 0]', 'left = ["-48 mm", 0]'),
            r"left_post.pin is drawn 0.00196\d m to the left of the line",
        ),
    ],
)
def test_mistakes_name_the_guide_and_a_remedy(tmp_path, change, message):
    if message is None:  # The point of the line may be any.
        reading(tmp_path, change)
        return
    with pytest.raises(PrbmError, match=message):
        reading(tmp_path, change)
