"""Bodies, flexures and their dimensions in outlines whose dimensions are known."""

import numpy as np
import pytest
from shapely.affinity import scale

from drawn_plates import (
    between_blocks,
    box,
    disc,
    filleted,
    framed_stage,
    notch_guide,
    notched,
    polygon,
    strip,
    write,
)
from prbm.cad.importing import Imported, Options, import_drawing

LENGTH_RTOL, THICKNESS_RTOL = 5e-3, 1e-2


def imported(tmp_path, plate, **options) -> Imported:
    return import_drawing(
        write(tmp_path / "plate.dxf", plate), Options(**{"thickness": 8e-3} | options)
    )


def only(result: Imported):
    (one,) = result.draft.found.flexures
    return one.shape


def length(shape) -> float:
    return 1e3 * abs(shape.end - shape.start)


def test_a_stage_in_a_frame_has_four_leaves_of_one_original(tmp_path):
    """The frame is the largest body and so the ground; both symmetries are in the file."""
    result = imported(tmp_path, framed_stage())
    mechanism = result.mechanism
    assert [body.name for body in mechanism.bodies] == ["stage"]
    assert [flexure.name for flexure in mechanism.flexures] == [
        "lower_left", "lower_right", "upper_left", "upper_right"
    ]  # fmt: skip
    assert 'mirror = ["x = 50 mm", "y = 40 mm"]' in result.text
    assert 'thickness = "0.4 mm"' in result.text
    assert mechanism.values()["steel.density"] == 7850.0
    assert not result.draft.found.doubts


def test_the_mass_of_a_body_is_that_of_its_area(tmp_path):
    from prbm.mechanism.expressions import affine

    mechanism = imported(tmp_path, framed_stage()).mechanism
    mass = affine(mechanism.bodies[0].mass)(mechanism.values())
    assert mass == pytest.approx(0.04 * 0.02 * 8e-3 * 7850.0, rel=1e-9)


@pytest.mark.parametrize("thickness", [0.1, 2.0])
def test_a_leaf_has_the_drawn_length_and_thickness(tmp_path, thickness):
    plate = between_blocks(box(-thickness / 2, -1, thickness / 2, 41), 40)
    shape = only(imported(tmp_path, plate))
    assert shape.profile == "leaf"
    assert not shape.equivalent
    assert length(shape) == pytest.approx(40.0, rel=1e-4)
    assert 1e3 * shape.thickness == pytest.approx(thickness, rel=1e-4)


@pytest.mark.parametrize(("thickness", "radius", "depth"), [(2, 4, 4), (0.4, 2.8, 2.8), (1, 5, 2)])
def test_a_notch_has_the_half_axes_of_its_arcs(tmp_path, thickness, radius, depth):
    shape = only(imported(tmp_path, notched(thickness, radius, depth)))
    assert shape.profile == "notch"
    assert 1e3 * shape.thickness == pytest.approx(thickness, rel=THICKNESS_RTOL)
    assert 1e3 * shape.dimensions["notch_radius"] == pytest.approx(radius, rel=LENGTH_RTOL)
    assert ("notch_depth" in shape.dimensions) == (depth != radius)
    assert 1e3 * shape.dimensions.get("notch_depth", radius / 1e3) == pytest.approx(depth, rel=5e-3)
    assert length(shape) == pytest.approx(2 * radius, rel=LENGTH_RTOL)


def test_a_shallow_notch_ends_where_its_bar_begins(tmp_path):
    """Arcs of the radius 4 mm, 2.5 mm deep, in a bar 6 mm thick."""
    bar = box(-3, 0, 3, 20)
    for x in (-4.5, 4.5):
        bar = bar.difference(disc(complex(x, 10), 4))
    shape = only(imported(tmp_path, between_blocks(bar, 20)))
    assert 1e3 * shape.dimensions["end_thickness"] == pytest.approx(6.0, rel=1e-3)
    assert length(shape) == pytest.approx(2 * np.sqrt(4**2 - 1.5**2), rel=1e-3)


def test_fillets_belong_to_their_leaf(tmp_path):
    shape = only(imported(tmp_path, filleted(0.5, 40, 0.5)))
    assert shape.profile == "notch"
    assert 1e3 * shape.thickness == pytest.approx(0.5, rel=1e-3)
    assert 1e3 * shape.dimensions["notch_radius"] == pytest.approx(0.5, rel=1e-2)
    assert 1e3 * shape.dimensions["waist_length"] == pytest.approx(39.0, rel=1e-3)
    assert length(shape) == pytest.approx(40.0, rel=1e-3)


def test_a_taper_begins_at_its_thin_end(tmp_path):
    plate = between_blocks(polygon([-1 + 0j, 1, 0.5 + 30j, -0.5 + 30j]), 30)
    shape = only(imported(tmp_path, plate))
    assert shape.profile == "taper"
    assert 1e3 * shape.dimensions["thickness"] == pytest.approx(1.0, rel=1e-3)
    assert 1e3 * shape.dimensions["end_thickness"] == pytest.approx(2.0, rel=1e-3)
    assert 1e3 * shape.start == pytest.approx(30j, abs=0.01)


def test_a_leaf_that_ends_on_an_oblique_edge_ends_in_the_middle_of_its_walls(tmp_path):
    slanted = polygon([-20 + 0j, -20 - 20j, 20 - 20j, 20 + 10j])
    plate = slanted.union(box(-1, 0, 1, 60)).union(box(-20, 50, 20, 70))
    assert length(only(imported(tmp_path, plate))) == pytest.approx(45.0, rel=1e-4)


@pytest.mark.slow
def test_leaves_that_meet_in_a_small_hub_end_at_the_hub(tmp_path):
    """The hub is three leaves thick, the remote centre of a stage."""
    plate = disc(0, 1.5).union(disc(0, 40).difference(disc(0, 29)))
    for k in range(3):
        along = np.exp(2j * np.pi * k / 3 + 0.3j)
        plate = plate.union(strip(along * np.linspace(0, 30, 20), 0.5))
    result = imported(tmp_path, plate)
    shapes = [one.shape for one in result.draft.found.flexures]
    assert [shape.profile for shape in shapes] == ["leaf"] * 3
    expected = np.sqrt(29**2 - 0.25**2) - np.sqrt(1.5**2 - 0.25**2)
    for shape in shapes:
        assert length(shape) == pytest.approx(expected, rel=2e-3)
    assert "repeat = { count = 3, angle = 120, about = [0, 0] }" in result.text
    assert [flexure.name for flexure in result.mechanism.flexures] == ["leaf", "leaf_2", "leaf_3"]


def test_equal_leaves_in_a_row_are_repeated(tmp_path):
    """Four leaves with equal distances, inclined, so that there is no mirror line."""
    plate = box(-20, -20, 60, 0).union(box(-10, 40, 70, 55))
    for k in range(4):
        along = (4 + 40j) / abs(4 + 40j)
        plate = plate.union(strip(12 * k + along * np.linspace(-2, 44, 10), 0.5))
    result = imported(tmp_path, plate)
    assert 'repeat = { count = 4, step = ["12 mm", 0] }' in result.text
    assert len(result.mechanism.flexures) == 4


def test_a_raised_leaf_is_half_a_period_of_a_cosine(tmp_path):
    x = np.linspace(-0.5, 40.5, 400)
    line = x + 1.6j * (1 - np.cos(np.pi * np.clip(x, 0, 40) / 40))
    plate = strip(line, 1.0).union(box(-10, -10, 0, 10)).union(box(40, -10, 50, 20))
    shape = only(imported(tmp_path, plate))
    assert abs(1e3 * shape.dimensions["rise"]) == pytest.approx(3.2, rel=LENGTH_RTOL)
    assert 1e3 * shape.thickness == pytest.approx(1.0, rel=THICKNESS_RTOL)


@pytest.mark.parametrize("size", [1.0, 0.01, 100.0])
def test_an_arc_has_the_curvature_of_its_circle(size, tmp_path):
    """The fit converges in all units: its limits are relative to the chord."""
    angle = np.linspace(-0.31, 0.31, 200)
    edge = 60 * np.sin(0.3)
    plate = strip(60j * (np.exp(-1j * angle) - 1), 0.5)
    plate = plate.union(box(edge, -10, 40, 5)).union(box(-40, -10, -edge, 5))
    shape = only(imported(tmp_path, scale(plate, size, size, origin=(0, 0)), thickness=8e-3 * size))
    assert abs(shape.dimensions["curvature"]) == pytest.approx(1 / (0.06 * size), rel=1e-4)
    assert length(shape) == pytest.approx(2 * edge * size, rel=1e-3)


def test_leaves_curved_to_the_same_side_are_no_mirror_images(tmp_path):
    """Two equal arcs beside each other; with the curvature of mirror images one is wrong."""
    angle = np.linspace(-0.31, 0.31, 200)
    arc = strip(60j * (np.exp(-1j * angle) - 1), 0.5)
    edge = 60 * np.sin(0.3)
    plate = box(edge, -10, 40, 35).union(box(-40, -10, -edge, 35))
    for y in (0, 25):
        moved = np.array(arc.exterior.coords) @ [1, 1j] + 1j * y
        plate = plate.union(polygon(moved))
    result = imported(tmp_path, plate)
    mechanism = result.mechanism
    kinds = [mechanism.type_of(flexure) for flexure in mechanism.flexures]
    values = mechanism.values()
    assert len({values[f"{kind.name}.curvature"] for kind in kinds}) == 1
    assert [mirror.axis for mirror in result.draft.lines] == ["x"] * len(result.draft.lines)


@pytest.mark.slow
def test_the_leg_between_two_notches_is_a_body(tmp_path):
    """The notches end with upright walls, a corner of the leg: it becomes thinner there."""
    result = imported(tmp_path, notch_guide())
    assert [body.name for body in result.mechanism.bodies] == ["stage", "left_bar", "right_bar"]
    assert {one.shape.profile for one in result.draft.found.flexures} == {"notch"}
    assert not result.draft.found.doubts
