"""Imported mechanisms beside plane-stress finite elements of the drawing itself.

The difference is that of beam theory with rigid bodies: the finite elements have elastic bodies,
whose edges yield where flexures are clamped, and shear.
"""

import pytest
import shapely

from drawn_plates import filleted_stage, framed_stage, notch_guide, write
from exported_plates import frequencies
from prbm.cad.importing import Options, import_drawing

plate_elements = pytest.importorskip(
    "plate_elements", reason="finite elements need scikit-fem, meshpy"
)

E, DENSITY, POISSON = 200e9, 7850.0, 0.3  # steel
PLATES = {  # Elements across the thinnest part, and the largest difference of the frequency.
    "thin leaves": (framed_stage(0.5), 2, 0.015),
    "thick leaves": (framed_stage(1.0), 2, 0.03),
    "filleted leaves": (filleted_stage(), 2, 0.01),
    "notches of a quarter of their radius": (notch_guide(), 3, 0.055),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PLATES)
@pytest.mark.filterwarnings("ignore")  # of meshpy and scikit-fem
def test_the_fundamental_frequency_is_that_of_plane_stress(name, tmp_path):
    plate, divisions, difference = PLATES[name]
    result = import_drawing(write(tmp_path / "plate.dxf", plate), Options(8e-3))
    found = result.draft.found
    (whole,) = shapely.get_parts(found.plate.shape)
    thin = shapely.unary_union([one.band for one in found.flexures])
    ground = shapely.unary_union([found.bodies[k] for k in found.ground])
    fine = min(one.trace.thinnest for one in found.flexures) / divisions
    grid = plate_elements.mesh(whole, thin, fine, 3e-3)
    known = plate_elements.frequencies(grid, ground, E, DENSITY, POISSON)[0]
    assert frequencies(result.mechanism)[0] == pytest.approx(known, rel=difference)
