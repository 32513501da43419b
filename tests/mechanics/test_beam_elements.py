"""Beams of rising order, compared with the finite elements of the package."""

from itertools import pairwise

import numpy as np
import pytest

from prbm.analysis import impact_map
from prbm.analysis.flexure_models import with_flexures
from prbm.files.mechanism_file import read_mechanism
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.references.finite_elements import FiniteElements
from support import PMMA, SUPPORT, mechanism

pytest.importorskip("exudyn", reason="finite elements need exudyn: python -m pip install exudyn")

GUIDE, FINGER = mechanism("GuideBeam"), read_mechanism(SUPPORT / "finger.toml")
WEIGHTLESS = {"gravity.x": 0.0}


def stretching_beams(description, order, nodes=None):
    """Return a mechanism with beams that stretch; the default has order + 5 nodes."""
    return with_flexures(description, "beam", order=order, nodes=nodes or order + 5, axial=True)


def rest_and_frequencies(description):
    """Return the rest position [m] and five frequencies [Hz]."""
    system = assemble(description, description.values())
    shape = equilibrium(system)
    return np.array([system.amount(shape.q), *modes(system, shape).frequency[:5]])


def rest_and_frequencies_by_elements(description, elements):
    fe = FiniteElements(description, elements=elements)
    shape = fe.equilibrium()
    return np.array([fe.displacement(shape.q), *fe.modes(shape).frequency[:5]])


@pytest.mark.slow
def test_the_guide_on_beams_converges_to_finite_elements_at_rest():
    """Orders 3, 5, 7: each error falls by 9 or more, down to that of the elements.

    The error of the elements is their change from 32 to 64.  Rest position and five frequencies.
    """
    coarse, fine = (rest_and_frequencies_by_elements(GUIDE, n) for n in (32, 64))
    own = abs(coarse / fine - 1.0)
    found = [rest_and_frequencies(stretching_beams(GUIDE, order)) for order in (3, 5, 7)]
    errors = [abs(one / fine - 1.0) for one in found]
    for before, after in pairwise(errors):
        assert (after <= np.maximum(before / 9.0, own)).all(), after / before
    assert (errors[0] < 5e-3).all()
    assert (errors[2] < own).all()


def at_the_wall(description):
    """Return modal restitution and three frequencies [Hz] of the finger at its wall."""
    (hit,) = impact_map.algebraic(description, [3e-3], [0.0]).hits[0]
    return hit.restitution, hit.frequency[:3]


@pytest.mark.slow
def test_the_finger_on_beams_has_the_restitution_of_finite_elements_at_the_wall():
    """The restitution is -0.182; the orders 3, 4 and 6 give -0.187, -0.177 and -0.181.

    The axial strain is 0.7 % there.  The energy of beams is quadratic in the logarithmic strain,
    that of the elements in the elongation: the third frequency, along the flexures, differs by
    0.7 %.
    """
    (hit,) = impact_map.by_elements(FINGER, [3e-3], [0.0], elements=32).hits[0]
    assert hit.restitution == pytest.approx(-0.182, abs=5e-4)
    for order, nodes, restitution in ((3, 6, -0.187), (4, 8, -0.177), (6, 9, -0.182)):
        found, frequency = at_the_wall(stretching_beams(FINGER, order, nodes))
        assert found == pytest.approx(restitution, abs=1e-3)
        assert frequency == pytest.approx(
            hit.frequency[:3], rel={3: 0.055, 4: 0.02, 6: 8e-3}[order]
        )
    errors = [
        abs(at_the_wall(stretching_beams(FINGER, order))[0] - hit.restitution)
        for order in (3, 5, 7)
    ]
    assert errors[1] < errors[0] / 3
    assert errors[2] < 1e-3


def test_the_finger_on_beams_has_the_frequencies_of_finite_elements_at_rest():
    """At the order 3 the first three are exact to 2e-5, two modes of the flexures to 0.4 %."""
    found = rest_and_frequencies(stretching_beams(FINGER, 3))[1:]
    exact = rest_and_frequencies_by_elements(FINGER, 32)[1:]
    assert (abs(found / exact - 1.0) < [1e-6, 1e-6, 2e-5, 4e-3, 4e-3]).all()
    found = rest_and_frequencies(stretching_beams(FINGER, 6))[1:]
    assert (abs(found / exact - 1.0) < 2e-5).all()


@pytest.mark.slow
def test_the_impact_map_of_the_guide_on_beams_is_that_of_finite_elements():
    """25 points: the largest difference is below 0.003 at the order 3, and falls with the order."""
    wanted = impact_map.by_elements(GUIDE, values=WEIGHTLESS, elements=16).restitution
    assert wanted.shape == (5, 5)
    worst = []
    for order in (3, 5, 7):
        found = impact_map.algebraic(stretching_beams(GUIDE, order), values=WEIGHTLESS)
        worst.append(np.abs(found.restitution - wanted).max())
    assert worst[0] < 0.003
    assert worst[1] < 0.7 * worst[0]
    assert worst[2] < 0.8 * worst[1]


def test_with_the_order_a_rigid_impact_of_heavy_flexures_stops_the_body_alone():
    """C of beams and of elements tends to (1 + eps) m/(m + 13/35 m_f) - 1 in the straight guide.

    The flexures of the PMMA guide have a fifth of the mass of its shuttle.
    """
    known = GUIDE.values()
    values = {name: x for name, x in PMMA.items() if name in known}
    of = {name.removeprefix("flexure."): x for name, x in values.items()}
    flexures = 2 * of["density"] * of["length"] * of["width"] * of["thickness"]
    m = values["shuttle.mass"]
    limit = 1.6 * m / (m + 13 / 35 * flexures) - 1.0
    found = [
        impact_map.algebraic(
            stretching_beams(GUIDE, order), [0.0], [0.0], values
        ).restitution.item()
        for order in (3, 5, 7, 9, 12)
    ]
    assert all(after < before for before, after in pairwise(found))
    assert found[0] - limit > 0.03
    assert 0.0 < found[-1] - limit < 0.006
    coarse, fine = (
        impact_map.by_elements(GUIDE, [0.0], [0.0], values, elements=n).restitution.item()
        for n in (8, 16)
    )
    assert 2 * fine - coarse == pytest.approx(limit, abs=5e-4)  # Errors of the first order.
