"""Static shapes as objects of the public interface."""

import numpy as np
import pytest

import prbm
from prbm.mechanics.stress import static_stresses

CURVED = prbm.load("CurvedBistable")


def test_a_held_shape_has_the_force_that_keeps_it_there():
    """The same shape is free under the force as a load, with the same positions."""
    held = prbm.equilibrium(CURVED, held=5e-4)
    free = prbm.equilibrium(CURVED, loads={"force.y": -held.force})
    assert held.held
    assert not free.held
    assert held.displacement == pytest.approx(5e-4, rel=1e-12)
    assert free.displacement == pytest.approx(5e-4, rel=1e-9)
    assert free.force == 0.0
    assert held.stiffness == pytest.approx(1.0 / free.compliance("shuttle")[1, 1], rel=1e-9)
    assert held.stable
    np.testing.assert_allclose(held.positions["shuttle"], free.positions["shuttle"], atol=1e-12)
    assert held.positions["shuttle"].y == pytest.approx(-5e-4)
    assert abs(held.compliance("shuttle")[1, 1]) < 1e-12 / held.stiffness
    for name, one in static_stresses(held.system, held.shape).items():
        assert held.stress[name] == one
        assert free.stress[name].largest == pytest.approx(one.largest, rel=1e-6)


def test_the_compliance_at_a_point_is_that_at_the_centre_moved_by_the_lever():
    """With the lever (a, b) the rows of x and y change by -b and a times that of the angle."""
    shape = prbm.equilibrium(CURVED)
    C = shape.compliance("shuttle")
    D = shape.compliance("shuttle", "shuttle.top")
    lever = shape.system.bodies["shuttle"].drawn
    probe = shape._frame("shuttle", "shuttle.top").drawn
    a, b = (probe - lever).real, (probe - lever).imag
    T = np.array([[1.0, 0.0, -b], [0.0, 1.0, a], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(D, T @ C @ T.T, atol=1e-9 * np.abs(D).max())


@pytest.mark.parametrize(
    ("body", "at", "message"),
    [
        ("stage", None, "there is no body stage; the bodies are shuttle"),
        ("shuttle", "ground.upper_left", "is no point of shuttle"),
    ],
)
def test_unknown_bodies_and_points_are_rejected(body, at, message):
    with pytest.raises(prbm.ParameterError, match=message):
        prbm.equilibrium(CURVED).compliance(body, at)
