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


def test_the_curve_passes_through_held_shapes_and_its_slope_is_the_stiffness():
    found = prbm.holding_curve(CURVED, start="-0.5 mm", end="0.5 mm", points=3)
    assert [p.displacement for p in found.points] == pytest.approx([-5e-4, 0.0, 5e-4])
    for point in found.points:
        assert point.force == pytest.approx(
            prbm.equilibrium(CURVED, held=point.displacement).force, rel=1e-6, abs=1e-9
        )
    stiffness = prbm.equilibrium(CURVED, held=5e-4).stiffness_matrix("shuttle")
    assert stiffness is None  # The held body is rigid along the direction.
    free = prbm.equilibrium(CURVED)
    np.testing.assert_allclose(
        free.stiffness_matrix("shuttle") @ free.compliance("shuttle"), np.eye(3), atol=1e-6
    )


def test_texts_with_units_equal_numbers_in_si():
    one = prbm.equilibrium(CURVED, {"beam.thickness": "0.5 mm"}, loads={"force.y": "-2 N"})
    other = prbm.equilibrium(CURVED, {"beam.thickness": 5e-4}, loads={"force.y": -2.0})
    assert one.displacement == other.displacement
    held = prbm.equilibrium(CURVED, held="0.3 mm")
    assert held.force == prbm.equilibrium(CURVED, held=3e-4).force


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"held": "3 kg"}, "held = 3 kg: the unit 'kg' has another dimension"),
        ({"held": -10.0}, "held = -10 m: more than the size of the mechanism"),
        ({"held": [1.0]}, r"held = \[1.0\] must be a number in m, or a text"),
        ({"loads": {"force.y": "much"}}, "force.y = much"),
        ({"loads": [1.0]}, r"loads = \[1.0\] must be a mapping"),
        ({"values": {"beam.thickness": "1 N"}}, "beam.thickness = 1 N"),
    ],
)
def test_invalid_arguments_of_shapes_are_rejected(arguments, message):
    for function in (prbm.equilibrium, prbm.modes):
        with pytest.raises(prbm.PrbmError, match=message):
            function(CURVED, **arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"start": "1 mm", "end": "1 mm"}, "start = 0.001 m must be below end = 0.001 m"),
        ({"start": 0.0, "end": "1 N"}, "end = 1 N"),
        ({"start": 0.0, "end": 1e-4, "points": 1}, "points = 1 must lie between 2 and"),
        ({"start": 0.0, "end": 1e-4, "points": 10**9}, "points = 1000000000 must lie between"),
        ({"start": 0.0, "end": 1e-4, "points": 5.0}, "points = 5.0 must be an integer"),
        ({"start": 0.0, "end": 1e-4, "branches": -1}, "branches = -1 must lie between 0"),
        ({"start": 0.0, "end": float("nan")}, "end = nan: write a finite number"),
    ],
)
def test_invalid_ranges_of_curves_are_rejected(arguments, message):
    with pytest.raises(prbm.PrbmError, match=message):
        prbm.holding_curve(CURVED, **arguments)
