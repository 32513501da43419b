"""The outline of a mechanism as a drawing, and its import."""

from dataclasses import replace

import ezdxf
import numpy as np
import pytest
import shapely
import shapely.affinity

from drawn_plates import disc, framed_stage, rings
from exported_plates import cut, frequencies
from prbm.base.errors import MechanismError
from prbm.cad.export import dxf
from prbm.cad.importing import Options, import_drawing
from prbm.cad.outline import outline
from prbm.files.mechanism_file import load
from prbm.mechanism.expressions import affine
from prbm.mechanism.parts import GroundPart

CUT = ("NotchGuide", "GuideBeam", "CurvedBistable", "Cantilever", "ImpactOscillator", "PRBDM")
THICKNESS = 8e-3


def ends(mechanism):
    """Return the owners and coordinates of both ends of each flexure, in any order."""
    values, found = mechanism.values(), []
    for flexure in mechanism.flexures:
        pair = []
        for end in (flexure.start, flexure.end):
            x, y = (affine(c)(values) for c in mechanism.point(end, flexure.name))
            pair.append(complex(x, y))
        found.append(pair)
    return found


def read_again(name, tmp_path):
    path = tmp_path / "again.dxf"
    path.write_bytes(dxf(outline(load(name))))
    return import_drawing(path, Options(THICKNESS))


@pytest.mark.parametrize("name", CUT)
def test_the_import_of_an_export_is_the_mechanism(name, tmp_path):
    """Flexures and their fundamental frequency, for bodies with the mass of the drawing."""
    known = cut(load(name), THICKNESS, 7850.0, 200e9)
    again = read_again(name, tmp_path).mechanism
    assert len(again.flexures) == len(known.flexures)
    assert len(again.bodies) == len(known.bodies)
    for a, b in ends(again):
        # A notch ends at its edges, so that its flexure may be shorter than the original.
        distances = [abs((a + b) / 2 - (c + d) / 2) for c, d in ends(known)]
        c, d = ends(known)[int(np.argmin(distances))]
        assert min(distances) <= 0.005 * abs(d - c)
    assert frequencies(again)[0] == pytest.approx(frequencies(known)[0], rel=0.02)


def test_stops_in_front_of_their_body_are_drawn(tmp_path):
    """The near and the far stop of the bistable shuttle, with 1 mm and 5.6 mm gaps."""
    again = read_again("CurvedBistable", tmp_path).mechanism
    found = sorted((stop.direction, round(1e3 * float(stop.position), 3)) for stop in again.stops)
    assert found == [(-90.0, 5.6), (90.0, 1.0)]


@pytest.mark.parametrize(
    ("name", "reason"),
    [("Bistable", "has pins"), ("FoldedSuspension", "ground and shuttle overlap at")],
)
def test_a_mechanism_that_cannot_be_cut_from_a_plate_is_rejected(name, reason):
    with pytest.raises(ValueError, match=reason):
        outline(load(name))


@pytest.mark.slow
def test_a_drawing_that_is_imported_and_exported_keeps_its_material(tmp_path):
    """The frame too, with its holes; a wall keeps its place in front of the stage."""
    plate = framed_stage().difference(disc(-5 + 20j, 2)).difference(disc(105 + 60j, 2))
    path = tmp_path / "plate.dxf"
    document = ezdxf.new("R2010", units=4)
    for ring in rings(plate):
        document.modelspace().add_lwpolyline(ring[:-1], close=True)
    document.modelspace().add_line((71, 45), (71, 55), dxfattribs={"layer": "stops"})
    document.saveas(path)
    first = import_drawing(path, Options(THICKNESS))
    drawn = outline(first.mechanism)
    again = tmp_path / "again.dxf"
    again.write_bytes(dxf(drawn))
    second = import_drawing(again, Options(THICKNESS))
    unequal = drawn.plate.symmetric_difference(shapely.affinity.scale(plate, 1e-3, 1e-3, 1, (0, 0)))
    assert unequal.buffer(-1e-4 * 0.15).area < 1e-3 * drawn.plate.area
    assert len(first.mechanism.ground_parts) == len(second.mechanism.ground_parts) == 1
    assert len(second.mechanism.ground_parts[0].holes) == 3
    (a,), (b,) = (one.draft.stops for one in (first, second))
    assert b.point == pytest.approx(a.point, abs=1e-6)
    assert b.gap == pytest.approx(a.gap, abs=1e-6)
    assert frequencies(second.mechanism) == pytest.approx(frequencies(first.mechanism), rel=1e-3)


@pytest.mark.parametrize("part", ["ground", "left"])
@pytest.mark.parametrize("corners", [[0, 2 + 1j, 2, 1j], [0, 1]], ids=["crossing", "line"])
def test_an_outline_without_an_area_is_rejected(corners, part):
    outlined = tuple((1e-3 * complex(z).real, 1e-3 * complex(z).imag) for z in corners)
    guide = load("NotchGuide")
    if part == "ground":
        wrong = replace(guide, ground_parts=(GroundPart(outlined),))
    else:
        wrong = replace(
            guide, bodies=(replace(guide.bodies[0], outline=outlined), *guide.bodies[1:])
        )
    with pytest.raises(MechanismError, match=f"the outline of {part} crosses or touches itself"):
        outline(wrong)


def test_equal_outlines_give_equal_bytes():
    drawn = outline(load("NotchGuide"))
    assert dxf(drawn) == dxf(drawn)
