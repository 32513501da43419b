"""Drawings of random mechanisms: lines and arcs in random order, turned, mirrored, with noise.

The noise of all ends is 1e-4 mm.  Lengths are compared within 0.5 %, thicknesses within 1 %, and
the fundamental frequency within 2 %.
"""

import numpy as np
import pytest

from exported_plates import cut, frequencies
from prbm.cad.importing import Options, import_drawing
from prbm.mechanism.description import Mechanism
from prbm.mechanism.expressions import affine
from prbm.mechanism.flexure import NOTCH
from random_plates import DENSITY, FAMILIES, MODULUS, THICKNESS, draw, random_mechanism

SEEDS = 210
LENGTH_RTOL, THICKNESS_RTOL, FREQUENCY_RTOL = 5e-3, 1e-2, 2e-2
KEYS = {
    "thickness": THICKNESS_RTOL,
    "end_thickness": THICKNESS_RTOL,
    "notch_radius": LENGTH_RTOL,
    "notch_depth": LENGTH_RTOL,
    "waist_length": LENGTH_RTOL,
    "curvature": LENGTH_RTOL,
    "rise": LENGTH_RTOL,
}


def flexures(mechanism: Mechanism):
    """Yield the ends, the profile and the dimensions of each flexure."""
    values = mechanism.values()
    for flexure in mechanism.flexures:
        ends = (mechanism.point(end, flexure.name) for end in (flexure.start, flexure.end))
        z = [complex(*(affine(c)(values) for c in end)) for end in ends]
        kind = mechanism.type_of(flexure)
        given = {key: getattr(kind, key) for key in KEYS if getattr(kind, key) is not None}
        named = {k: x if isinstance(x, str) else f"{kind.name}.{k}" for k, x in given.items()}
        yield z, kind.profile, {key: affine(x)(values) for key, x in named.items()}


def check(seed: int, folder) -> None:
    _, known = random_mechanism(seed)
    path = folder / f"{seed}.dxf"
    unit = draw(path, known, seed)
    result = import_drawing(path, Options(THICKNESS, unit=unit))
    again, found = result.mechanism, [*flexures(result.mechanism)]
    known = cut(known, THICKNESS, DENSITY, MODULUS)
    assert len(again.bodies) == len(known.bodies)
    assert len(again.flexures) == len(known.flexures)
    for (a, b), profile, dimensions in flexures(known):
        (c, d), kind, others = min(found, key=lambda one: abs(sum(one[0]) - a - b))
        assert kind == profile
        assert abs(d - c) == pytest.approx(abs(b - a), rel=LENGTH_RTOL)
        for key, value in dimensions.items():
            assert abs(others[key]) == pytest.approx(abs(value), rel=KEYS[key]), key
        assert others.keys() == dimensions.keys() or profile == NOTCH
    assert frequencies(again)[0] == pytest.approx(frequencies(known)[0], rel=FREQUENCY_RTOL)


@pytest.mark.parametrize("seed", range(0, len(FAMILIES) * 5, 5))
def test_a_drawing_of_each_family_gives_its_mechanism(seed, tmp_path):
    check(seed, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, SEEDS, 30))
def test_drawings_of_random_mechanisms_give_their_mechanisms(first, tmp_path):
    for seed in range(first, first + 30):
        check(seed, tmp_path)


def test_the_noise_moves_the_lines_of_a_drawing(tmp_path):
    """The drawings of one mechanism with two seeds differ, their mechanisms hardly."""
    _, known = random_mechanism(0)
    thickest = []
    for seed in (1, 2):
        path = tmp_path / f"{seed}.dxf"
        unit = draw(path, known, seed)
        found = import_drawing(path, Options(THICKNESS, unit=unit, tolerance=1e-9)).draft.found
        thickest.append(max(one.shape.thickness for one in found.flexures))
    assert 0.0 < abs(np.diff(thickest)[0]) < 1e-6
