"""The number of unstable directions of a shape, free and held."""

import numpy as np
import pytest

import prbm
from prbm.hybrid.simulation import Simulation
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes, moved_by, unstable_directions
from prbm.mechanics.statics import balance_matrix, equilibrium

CURVED = {"gravity.x": 0.0, "gravity.y": 0.0}


def negative(system, shape, held):
    """Return the number of negative eigenvalues of the stiffness in the plane of active rows."""
    kkt = balance_matrix(system, shape, held)
    n = system.n
    Z = np.linalg.svd(kkt[n:, :n])[2][len(kkt) - n :].T
    return int(np.count_nonzero(np.linalg.eigvalsh(Z.T @ kkt[:n, :n] @ Z) < 0.0))


@pytest.mark.parametrize("share", [0.05, 0.3, 0.6, 0.9, 1.3, 1.7, 1.99])
@pytest.mark.parametrize("name", ["CurvedBistable", "Bistable"])
def test_unstable_directions_are_the_negative_eigenvalues_of_the_projected_stiffness(name, share):
    """The held row is one more row of the projection; its count follows from the free modes."""
    guide = prbm.load(name)
    size = {"CurvedBistable": 3e-3, "Bistable": 4e-3}[name]
    system = assemble(guide, guide.values(CURVED))
    shape = equilibrium(system, share * size)
    found = modes(system, shape)
    along = moved_by(system, shape.q, found.shape)
    assert unstable_directions(found.frequency) == negative(system, shape, held=False)
    assert unstable_directions(found.frequency, along) == negative(system, shape, held=True)


def test_a_motion_without_stiffness_is_not_unstable_and_yields_to_the_hold():
    assert unstable_directions(np.array([-1e-12, 2.0])) == 0
    assert unstable_directions(np.array([-1.0, 1e-12, 2.0]), np.array([1.0, 1.0, 0.0])) == 1
    assert unstable_directions(np.array([-1.0, 1e-12, 2.0]), np.array([1.0, 0.0, 0.0])) == 0


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_engines_report_an_unstable_release_and_an_unstable_rest(engine):
    """The symmetric shape of curved beams becomes unstable at about 1.4 mm, held or not."""
    curved = prbm.load("CurvedBistable")
    for displacement, expected in ((1.2e-3, False), (1.6e-3, True)):
        found = engine(curved, {**CURVED, "release.displacement": displacement}).instability()
        assert found.rest == 0
        assert (found.release > 0) == expected
        assert len(found.sentences) == int(expected)
    guide = prbm.load("PRBDM2R")
    found = engine(
        guide, {"gravity.x": 0.0, "gravity.y": -1600.0, "release.displacement": -1e-3}
    ).instability()
    assert (found.rest, found.release) == (5, 4)
    assert "unstable in 5 of" in found.sentences[0]
