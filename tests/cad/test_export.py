"""The outline of a mechanism as a drawing, and its import."""

import numpy as np
import pytest

from exported_plates import cut, frequencies
from prbm.cad.export import dxf
from prbm.cad.importing import Options, import_drawing
from prbm.cad.outline import outline
from prbm.files.mechanism_file import load
from prbm.mechanism.expressions import affine

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


def test_equal_outlines_give_equal_bytes():
    drawn = outline(load("NotchGuide"))
    assert dxf(drawn) == dxf(drawn)
