"""Files of drawings: versions, units, layers, blocks, gaps, and files that are refused."""

import contextlib
import os
import shutil
from itertools import pairwise

import ezdxf
import numpy as np
import pytest
import shapely

import prbm
from drawn_plates import box, disc, filleted_stage, framed_stage, rings, strip, svg, write
from prbm.cad import curves, dxf
from prbm.cad.curves import DrawingError
from prbm.cad.importing import Options, import_drawing
from prbm.cad.numbers import plain, roundest
from prbm.files.settings import UserMistake
from support import possible

OPTIONS = Options(8e-3)


def drawing(tmp_path, change, plate=None, **options):
    """Import the framed stage from a file that a function changes before it is saved."""
    document = ezdxf.new("R2010", units=4)
    change(document, document.modelspace())
    for ring in rings(framed_stage() if plate is None else plate):
        document.modelspace().add_lwpolyline(ring[:-1], close=True)
    path = tmp_path / "plate.dxf"
    document.saveas(path)
    return import_drawing(path, Options(**{"thickness": 8e-3} | options))


def thickness(result) -> float:
    """Return the thickness of the leaves [mm]."""
    return 1e3 * result.draft.kinds[0].dimensions["thickness"]


@pytest.mark.parametrize("version", ["R12", "R2000", "R2004", "R2007", "R2010", "R2013", "R2018"])
def test_every_version_gives_the_same_mechanism(tmp_path, version):
    result = import_drawing(write(tmp_path / "plate.dxf", framed_stage(), version), OPTIONS)
    assert len(result.mechanism.flexures) == 4
    assert thickness(result) == pytest.approx(0.4, rel=1e-9)


@pytest.mark.parametrize("version", ["R12", "R2000", "R2018"])
def test_a_binary_file_gives_the_mechanism_of_its_text(tmp_path, version):
    path = write(tmp_path / "plate.dxf", framed_stage(), version)
    text = import_drawing(path, OPTIONS)
    ezdxf.readfile(path).saveas(path, fmt="bin")
    assert path.read_bytes().startswith(dxf.BINARY)
    assert import_drawing(path, OPTIONS).text == text.text


@pytest.mark.parametrize("tiny", [1e-306, -1e-312])
def test_coordinates_that_are_nearly_zero_are_zero(tmp_path, tiny):
    """Nothing overflows: NumPy's warnings are errors here."""
    path, texts = tmp_path / "plate.dxf", []
    for zero in (0.0, tiny):
        document = ezdxf.new("R2010", units=4)
        for ring in rings(framed_stage()):
            points = [(x - 30.0 or k * zero, y - 30.0 or k * zero) for k, (x, y) in enumerate(ring)]
            document.modelspace().add_lwpolyline(points[:-1], close=True)
        document.saveas(path)
        with np.errstate(all="raise", under="ignore"):
            texts.append(import_drawing(path, OPTIONS).text)
    assert texts[0] == texts[1]


def test_a_damaged_binary_file_is_refused(tmp_path):
    path = write(tmp_path / "plate.dxf", framed_stage(), "R2000")
    ezdxf.readfile(path).saveas(path, fmt="bin")
    content = path.read_bytes()
    for end in range(len(dxf.BINARY), len(content), 997):
        path.write_bytes(content[:end])
        with contextlib.suppress(DrawingError):
            import_drawing(path, OPTIONS)


@pytest.mark.parametrize(("unit", "length"), [(1, 25.4), (4, 1.0), (5, 10.0), (13, 1e-3)])
def test_the_unit_of_the_file_scales_the_mechanism(tmp_path, unit, length):
    path = write(tmp_path / "plate.dxf", framed_stage(), unit=unit)
    result = import_drawing(path, Options(8e-3 * length))
    assert thickness(result) == pytest.approx(0.4 * length, rel=1e-6)


def test_a_drawing_without_a_unit_is_in_millimetres_and_says_so(tmp_path):
    result = import_drawing(write(tmp_path / "plate.dxf", framed_stage(), "R12"), OPTIONS)
    assert "the drawing has no unit: millimetres are assumed" in result.notes
    inches = Options(8e-3, unit=0.0254)
    again = import_drawing(tmp_path / "plate.dxf", inches)
    assert thickness(again) == pytest.approx(25.4 * 0.4)


def test_marks_name_the_ground_instead_of_the_largest_body(tmp_path):
    """The stage is fixed, and the frame moves."""

    def mark(document, space):
        space.add_point((50, 40), dxfattribs={"layer": "Ground"})

    draft = drawing(tmp_path, mark).draft
    assert draft.found.bodies[draft.stage].bounds == pytest.approx((-0.01, -0.01, 0.11, 0.09))


def test_a_given_point_names_the_ground_in_units_of_the_drawing(tmp_path):
    result = drawing(tmp_path, lambda *_: None, ground=(50, 40))
    assert result.draft.found.bodies[result.draft.stage].bounds[0] == pytest.approx(-0.01)
    with pytest.raises(ValueError, match=r"the point \(20, 20\) mm is on no body; the nearest"):
        drawing(tmp_path, lambda *_: None, ground=["20mm,20mm"])


@pytest.mark.parametrize(
    ("wall", "direction", "gap"),
    [(((71, 35), (71, 45)), 0.0, 1e-3), (((28, 45), (28, 35)), 180.0, 2e-3),
     (((40, 50.5), (60, 50.5)), 90.0, 0.5e-3)],
)  # fmt: skip
def test_a_line_on_the_layer_stops_is_a_stop_with_its_gap(tmp_path, wall, direction, gap):
    def stop(document, space):
        space.add_line(*wall, dxfattribs={"layer": "stops"})

    (found,) = drawing(tmp_path, stop).mechanism.stops
    assert found.body == "stage"
    assert found.direction == direction
    assert found.position == pytest.approx(gap, abs=1e-9)


def test_construction_lines_and_hidden_layers_are_ignored(tmp_path):
    def lines(document, space):
        document.layers.add("hidden").off()
        for layer in ("construction", "hidden", "Defpoints"):
            space.add_line((-20, 40), (120, 40), dxfattribs={"layer": layer})
        space.add_text("plate")

    result = drawing(tmp_path, lines)
    assert len(result.mechanism.flexures) == 4
    assert "not read: 1 LINE on a hidden layer, 1 TEXT" in result.notes


def test_blocks_in_blocks_are_placed(tmp_path):
    """The outline is in a block, turned by 90 degrees in another one."""
    document = ezdxf.new("R2010", units=4)
    inner, outer = document.blocks.new("inner"), document.blocks.new("outer")
    for ring in rings(framed_stage()):
        inner.add_lwpolyline(ring[:-1], close=True)
    outer.add_blockref("inner", (0, 0), dxfattribs={"rotation": 90})
    document.modelspace().add_blockref("outer", (10, 20))
    document.saveas(tmp_path / "plate.dxf")
    result = import_drawing(tmp_path / "plate.dxf", OPTIONS)
    assert len(result.mechanism.flexures) == 4
    assert result.draft.found.plate.shape.bounds == pytest.approx((-0.08, 0.01, 0.02, 0.13))


BLOCK = [(71, 36), (90, 36), (90, 44), (71, 44)]


@pytest.mark.parametrize(
    ("draw", "direction", "gap", "place"),
    [
        (lambda s, at: s.add_lwpolyline(BLOCK, close=True, dxfattribs=at), 0.0, 1.0, 70 + 40j),
        (lambda s, at: s.add_lwpolyline(BLOCK[2:] + BLOCK[:2], dxfattribs=at), 0.0, 1.0, 70 + 40j),
        (lambda s, at: [s.add_line(*ends, dxfattribs=at)
                        for ends in zip(BLOCK, BLOCK[1:] + BLOCK[:1], strict=True)],
         0.0, 1.0, 70 + 40j),
        (lambda s, at: s.add_circle((75, 38), 3, dxfattribs=at), 0.0, 2.0, 70 + 38j),
        (lambda s, at: s.add_circle((74, 53), 3, dxfattribs=at), 36.8699, 2.0, 70 + 50j),
        (lambda s, at: s.add_line((71, 38), (71, 42), dxfattribs=at), 0.0, 1.0, 70 + 40j),
        (lambda s, at: s.add_line((71, 38), (71, 90), dxfattribs=at), 0.0, 1.0, 70 + 44j),
        (lambda s, at: s.add_line((71, 45), (71, 55), dxfattribs=at), 0.0, 1.0, 70 + 50j),
    ],
    ids=["block", "bent", "lines", "pin", "pin at a corner", "line", "beyond", "about a corner"],
)  # fmt: skip
def test_the_nearest_face_of_a_drawn_stop_is_the_wall(tmp_path, draw, direction, gap, place):
    """The hit point is in front of the middle of the face, or of its part beside the body."""

    def stop(document, space):
        draw(space, {"layer": "stops"})

    (found,) = drawing(tmp_path, stop).draft.stops
    chords = 1.5  # deg; half the angle of the chords of an arc
    assert np.degrees(np.angle(found.direction)) == pytest.approx(direction, abs=chords)
    assert 1e3 * found.gap == pytest.approx(gap, abs=2e-3)
    assert 1e3 * found.point == pytest.approx(place, abs=0.02)


def closed(*corners):
    """Return a function that draws a closed wall."""
    return lambda s, at: s.add_lwpolyline(corners, close=True, dxfattribs=at)


def line(*points):
    """Return a function that draws an open wall."""
    return lambda s, at: s.add_lwpolyline(points, dxfattribs=at)


@pytest.mark.parametrize(
    ("draw", "direction", "gap", "place"),
    [
        (closed((70.1, 38), (80, 38), (80, 42), (70.1, 42)), 0.0, 0.1, 70 + 40j),
        (lambda s, at: s.add_circle((73, 40), 2.9, dxfattribs=at), 0.0, 0.1, 70 + 40j),
        (closed((70, 38), (80, 38), (80, 42), (70, 42)), 0.0, 0.0, 70 + 40j),
        (lambda s, at: s.add_circle((85, 40), 15, dxfattribs=at), 0.0, 0.0, 70 + 40j),
        (closed((70, 40), (75, 38), (75, 42)), 0.0, 0.0, 70 + 40j),
        (line((70.5, 35), (72, 45)), 0.0, 0.5, 70 + 35j),
        (line((71, 40), (75, 40)), 0.0, 1.0, 70 + 40j),
        (line((71, 60), (71, 70)), 0.0, 1.0, 70 + 50j),
        (line((71, 31), (71, 37), (71, 41)), 0.0, 1.0, 70 + 36j),
        (closed((71, 36), (80, 36), (80, 44), (71, 44), (71, 38)), 0.0, 1.0, 70 + 40j),
        (lambda s, at: [closed((71, low), (80, low), (80, low + 6), (71, low + 6))(s, at)
                        for low in (34, 40)], 0.0, 1.0, 70 + 40j),
        (closed((40, 50), (60, 50), (60, 55), (40, 55)), 90.0, 0.0, 50 + 50j),
    ],
    ids=["near block", "near pin", "touching block", "touching pin", "touching tip", "inclined",
         "end on", "beside", "three points", "vertex in a face", "two blocks", "block on top"],
)  # fmt: skip
def test_gap_direction_and_hit_point_are_those_of_the_nearest_way(
    tmp_path, draw, direction, gap, place
):
    def stop(document, space):
        draw(space, {"layer": "stops"})

    (found,) = drawing(tmp_path, stop).draft.stops
    assert found.on == -1
    assert np.degrees(np.angle(found.direction)) == pytest.approx(direction, abs=1e-3)
    assert 1e3 * found.gap == pytest.approx(gap, abs=3e-3)
    assert 1e3 * found.point == pytest.approx(place, abs=0.02)


def test_a_wall_in_front_of_a_recess_has_the_gap_there(tmp_path):
    plate = framed_stage().union(box(70, 30, 72, 33))
    (found,) = drawing(
        tmp_path, lambda d, s: line((70.5, 40), (70.5, 50))(s, {"layer": "stops"}), plate
    ).draft.stops
    assert 1e3 * found.gap == pytest.approx(0.5)
    assert 1e3 * found.point == pytest.approx(70 + 45j)


@pytest.mark.parametrize(
    ("draw", "reason"),
    [
        (line((60, 40), (80, 40)), "overlaps a moving body"),
        (closed((60, 38), (65, 38), (65, 42), (60, 42)), "overlaps a moving body"),
        (closed((70, 50), (75, 50), (75, 55), (70, 55)), "touches a body at corners only"),
        (lambda s, at: s.add_point((71, 40), dxfattribs=at), "a point on the layer stops"),
    ],
)
def test_a_wall_without_a_gap_or_a_side_is_reported_and_left_out(tmp_path, draw, reason):
    result = drawing(tmp_path, lambda d, s: draw(s, {"layer": "stops"}))
    assert not result.draft.stops
    assert any(reason in text for _, text in result.draft.found.doubts)


@pytest.mark.parametrize("near", [0.05, 1.0])
def test_a_wall_on_either_side_does_not_penetrate_the_release(tmp_path, near):
    """The release is away from the first wall, and before the second one."""

    def stop(document, space):
        line((72, 35), (72, 45))(space, {"layer": "stops"})
        line((30 - near, 35), (30 - near, 45))(space, {"layer": "stops"})

    mechanism = drawing(tmp_path, stop).mechanism
    result = prbm.simulate(mechanism, stop_time=0.01)
    assert min(result[f"{name}.gap"].min() for name in ("stop_1", "stop_2")) > -1e-9


def test_an_open_outline_is_named_with_its_place(tmp_path):
    """The leaf at the gap has one wall only; without the rest there is no flexure."""
    path = tmp_path / "plate.dxf"
    document = ezdxf.new("R2010", units=4)
    plate = box(0, 0, 40, 20).union(box(0, 60, 40, 80)).union(box(19.8, 10, 20.2, 70))
    (ring,) = rings(plate)
    k = next(k for k, (a, b) in enumerate(pairwise(ring)) if abs(b[1] - a[1]) == 40)
    for i, (a, b) in enumerate(pairwise(ring)):
        document.modelspace().add_line(a, (b[0], b[1] - 0.3 * (i == k)))
    document.saveas(path)
    with pytest.raises(DrawingError, match=r"0\.3 mm at .*; close them, or increase --gap"):
        import_drawing(path, OPTIONS)


@pytest.mark.parametrize("name", ["thickness", "gap", "tolerance", "flexures_below"])
def test_a_length_that_is_larger_than_the_drawing_is_a_mistake(tmp_path, name):
    path = write(tmp_path / "plate.dxf", framed_stage())
    message = f"--{name.replace('_', '-')} 4: 4 m is more than the diagonal of the drawing"
    with pytest.raises(UserMistake, match=message):
        prbm.read_drawing(path, **{"thickness": 8e-3} | {name: 4})
    with pytest.raises(UserMistake, match="write a positive length"):
        prbm.read_drawing(path, **{"thickness": 8e-3} | {name: -4e-3})


@pytest.mark.parametrize(
    "ground", [(-5, -5), [-5, -5], "-5,-5", "-5mm,-5mm", [(-5, -5)], ["-5,-5", (105, 40)]]
)
def test_the_ground_is_a_point_or_several(tmp_path, ground):
    path = write(tmp_path / "plate.dxf", framed_stage())
    found = prbm.read_drawing(path, thickness="8 mm", ground=ground)
    assert [body.name for body in found.bodies] == ["stage"]
    assert found.values()["leaf.width"] == 8e-3


@pytest.mark.parametrize(
    "options",
    [{"thickness": None}, {"thickness": [1]}, {"material": None}, {"material": 5},
     {"youngs_modulus": 200e9}, {"density": 7850}, {"unit": ""}, {"gap": "wide"}],
    ids=str,
)  # fmt: skip
def test_wrong_types_of_options_are_named(tmp_path, options):
    path = write(tmp_path / "plate.dxf", framed_stage())
    (name,) = options
    with pytest.raises(prbm.PrbmError, match=f"{name.replace('_', '.')}"):
        prbm.read_drawing(path, **{"thickness": "8 mm"} | options)


def test_an_outline_with_many_gaps_is_named_with_their_places(tmp_path):
    document = ezdxf.new("R2010", units=4)
    for ring in rings(framed_stage()):
        for a, b in pairwise(ring):
            document.modelspace().add_line(a, (b[0] + 0.05 * (abs(b[1] - a[1]) > 25), b[1]))
    document.saveas(tmp_path / "plate.dxf")
    with pytest.raises(DrawingError, match=r"lines end at|there are gaps of up to"):
        import_drawing(tmp_path / "plate.dxf", OPTIONS)


@pytest.mark.parametrize("ground", [(1, 2, 3), "5", [5], [("a", "b")], 5, 1j])
def test_what_is_no_point_is_rejected(tmp_path, ground):
    path = write(tmp_path / "plate.dxf", framed_stage())
    with pytest.raises(prbm.PrbmError, match="--ground"):
        prbm.read_drawing(path, thickness="8 mm", ground=ground)


def test_gaps_and_lines_that_are_drawn_twice_are_repaired_and_reported(tmp_path):
    document = ezdxf.new("R2010", units=4)
    space = document.modelspace()
    for ring in rings(framed_stage()):
        for k, (a, b) in enumerate(pairwise(ring)):
            space.add_line(a, (b[0] + 0.005 * (k == 0), b[1]))
            if k == 1:
                space.add_line(b, a)
    document.saveas(tmp_path / "plate.dxf")
    result = import_drawing(tmp_path / "plate.dxf", OPTIONS)
    assert len(result.mechanism.flexures) == 4
    start = "5 gaps were closed, of at most 0.005 mm: (110, 90), "
    assert any(note.startswith(start) for note in result.notes)
    assert any("are drawn twice" in note for note in result.notes)


def test_an_open_outline_is_refused_with_its_gap(tmp_path):
    def outline(document, space):
        space.add_lwpolyline([(0, 0), (50, 0), (50, 20), (0, 20), (0, 1.5)])

    with pytest.raises(ValueError, match=r"gaps of up to 1.5 mm at \(0, .*; close them, or incr"):
        drawing(tmp_path, outline, plate=shapely.MultiPolygon())


def test_parts_that_nothing_holds_are_left_out_and_reported(tmp_path):
    def island(document, space):
        space.add_circle((200, 40), 10)

    result = drawing(tmp_path, island)
    assert [text for _, text in result.draft.found.doubts] == [
        "nothing connects this part to the ground: left out"
    ]


# --- SVG ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("head", "scale"),
    [('width="120mm" viewBox="0 0 120 100"', 1.0), ('width="12in" viewBox="0 0 120 100"', 2.54)],
)
def test_an_svg_file_gives_the_mechanism_with_its_unit(tmp_path, head, scale):
    path = tmp_path / "plate.svg"
    path.write_text(svg(filleted_stage(), head), encoding="utf-8")
    result = import_drawing(path, OPTIONS)
    assert len(result.mechanism.flexures) == 4
    assert thickness(result) == pytest.approx(0.4 * scale, rel=1e-3)
    bounds = np.array([-10.0, -10.0, 110.0, 90.0]) * 1e-3 * scale
    assert result.draft.found.plate.shape.bounds == pytest.approx(bounds, rel=1e-3)


def test_transformations_shapes_and_layers_of_svg_files_are_read(tmp_path):
    """Two plates joined by a leaf: a rectangle, a circle as a hole, and a stop on a layer."""
    body = (
        '<g transform="translate(5 5) rotate(90)"><rect x="0" y="0" width="30" height="20"/>'
        '<circle cx="10" cy="10" r="3"/></g><rect x="-20" y="75" width="40" height="20"/>'
        '<polygon points="-4.8,34 -5.2,34 -5.2,76 -4.8,76"/>'
        '<g id="stops"><line x1="7" y1="10" x2="7" y2="30"/></g>'
    )
    head = 'xmlns="http://www.w3.org/2000/svg" width="100mm" viewBox="0 0 100 100"'
    path = tmp_path / "plate.svg"
    path.write_text(f"<svg {head}>{body}</svg>", encoding="utf-8")
    result = import_drawing(path, Options(8e-3, ground="0,-90mm"))
    (flexure,) = result.draft.found.flexures
    assert abs(flexure.shape.end - flexure.shape.start) == pytest.approx(0.04, rel=1e-3)
    assert len(result.draft.found.bodies[result.draft.stage].interiors) == 1
    assert result.mechanism.stops[0].position == pytest.approx(2e-3, abs=1e-6)


# --- files that are refused -----------------------------------------------------------------------


def test_files_that_are_no_drawings_are_refused(tmp_path):
    for name, content, reason in (
        ("a.dxf", b"", "there are no lines or curves"),
        ("b.dxf", b"AC1027\0\0\0", "it is a DWG file; export the drawing as DXF"),
        ("c.dxf", b"\x00\xff" * 200, "not a DXF file|there are no lines"),
        ("d.svg", b"<svg", "not an SVG file"),
        ("e.svg", b"<html/>", "its root is html"),
        ("f.svg", b'<!DOCTYPE x [<!ENTITY a "b">]><svg>&a;</svg>', "it defines entities"),
        ("g.step", b"", "drawings are read from .dxf and .svg files"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ValueError, match=reason):
            import_drawing(tmp_path / name, OPTIONS)
    with pytest.raises(ValueError, match="cannot be read"):
        import_drawing(tmp_path / "none.dxf", OPTIONS)


def test_limits_of_size_entities_points_nesting_and_copies(tmp_path, monkeypatch):
    path = write(tmp_path / "plate.dxf", framed_stage())
    for module, limit, value, reason in (
        (dxf, "FILE_SIZE_MAX", 100, "larger than 100 bytes"),
        (curves, "ENTITIES_MAX", 1, "more than 1 entities"),
        (curves, "POINTS_MAX", 3, "more than 3 points"),
        (curves, "COORDINATE_MAX", 1e-3, "farther than 0.001 m from the origin"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(module, limit, value)
            with pytest.raises(ValueError, match=reason):
                import_drawing(path, OPTIONS)

    def nested(document, space):
        for k in range(12):
            document.blocks.new(f"b{k}").add_blockref(f"b{k + 1}", (0, 0))
        document.blocks.new("b12").add_circle((0, 0), 1)
        space.add_blockref("b0", (0, 0))

    with pytest.raises(ValueError, match="blocks are nested more than 8 deep"):
        drawing(tmp_path, nested)

    def copied(document, space):
        document.blocks.new("b").add_circle((0, 0), 1)
        space.add_blockref("b", (0, 0)).grid((1000, 1000), (1, 1))

    with pytest.raises(ValueError, match="1000000 copies in an array"):
        drawing(tmp_path, copied)


def test_a_coordinate_that_is_not_a_number_is_refused(tmp_path):
    def line(document, space):
        space.add_line((0, 0), (float("nan"), 1))

    with pytest.raises(ValueError, match=r"is not a number or farther|inconsistent|not a DXF"):
        drawing(tmp_path, line)


@pytest.mark.slow
def test_random_changes_of_a_file_give_a_mechanism_or_a_reason(tmp_path):
    """Bytes of a file are changed, removed or repeated; each result is a message or a mechanism."""
    content = bytearray(write(tmp_path / "plate.dxf", framed_stage(), "R12").read_bytes())
    start = content.index(b"ENTITIES")
    rng = np.random.default_rng(0)
    path, read = tmp_path / "changed.dxf", 0
    for _ in range(40):
        changed = bytearray(content)
        for _ in range(int(rng.integers(1, 4))):
            k = int(rng.integers(start, len(changed)))
            kind = rng.integers(3)
            if kind == 0:
                changed[k] = int(rng.integers(256))
            elif kind == 1:
                del changed[k : k + int(rng.integers(1, 30))]
            else:
                changed[k:k] = changed[k : k + int(rng.integers(1, 30))]
        path.write_bytes(bytes(changed))
        with contextlib.suppress(DrawingError):
            read += len(import_drawing(path, OPTIONS).mechanism.flexures) > 0
    assert read > 5


def test_a_material_is_known_or_given():
    with pytest.raises(ValueError, match="material 'cheese' is unknown: choose one of steel"):
        import_drawing("any.dxf", Options(8e-3, material="cheese"))


def test_round_numbers_have_the_fewest_decimals_within_the_tolerance():
    assert roundest(39.9998, 0.001) == 40.0
    assert roundest(-0.50004, 1e-4) == -0.5
    assert plain(1e-6) == "0.000001"


def test_the_name_of_a_drawing_may_have_any_letters(tmp_path):
    quote = "'" if os.name == "nt" else '"'
    path = write(tmp_path / "plate.dxf", framed_stage())
    other = shutil.copy(path, possible(tmp_path / f"3 {quote}plätze{quote} {{v2}}.dxf"))
    assert import_drawing(other, OPTIONS).mechanism.name.isidentifier()


@pytest.mark.slow
def test_crossing_leaves_of_two_plates_are_bolted_to_the_same_bodies(tmp_path):
    """A cross pivot: each plate has one leaf, and holes at the same places in both bodies."""
    along = np.exp(1j * np.pi / 4)
    holes = [disc(complex(x, y), 2) for x in (-25, 25) for y in (-30, 30)]
    document = ezdxf.new("R2010", units=4)
    for layer, turn in (("0", along), ("plate 2", along.conjugate())):
        bars = box(-40, -40, 40, -20).union(box(-40, 20, 40, 40))
        plate = bars.union(strip(turn * np.linspace(-30, 30, 10), 0.5))
        for ring in rings(plate.difference(shapely.unary_union(holes))):
            document.modelspace().add_lwpolyline(ring[:-1], close=True, dxfattribs={"layer": layer})
    document.saveas(tmp_path / "plate.dxf")
    result = import_drawing(tmp_path / "plate.dxf", Options(8e-3, ground=[(-30, -30)]))
    mechanism = result.mechanism
    assert [body.name for body in mechanism.bodies] == ["stage"]
    assert len(mechanism.flexures) == 2
    ends = [one.shape.end - one.shape.start for one in result.draft.found.flexures]
    assert sorted(np.degrees(np.angle(ends))) == pytest.approx([45.0, 135.0], abs=1e-3)
    mass = 7850.0 * 8e-3 * 2 * (0.08 * 0.02 - 2 * np.pi * 0.002**2)
    assert mechanism.bodies[0].mass == pytest.approx(mass, rel=2e-3)
