"""Scales of motions that no spring restores: of a table on two links that falls to one side."""

import math

import pytest

from kernel_simulation import KernelSimulation
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Release, Stop

HEIGHT, GRAVITY, MASS, WALL = 0.1, 9.81, 0.1, 0.03


def table(*, axial: bool, names=("left", "right"), **given) -> Mechanism:
    """Return the table; its links, pinned at both ends, are stiff but can stretch if ``axial``."""
    leaf = FlexureType("leaf", "nR", 1e-3, 1e-2, 2e9, 2000.0, n=1, axial=axial)
    links = {
        name: Flexure(name, "leaf", f"ground.{name}", f"top.{name}", ends=("pin", "pin"))
        for name in ("left", "right")
    }
    return Mechanism(
        "Table", "Table on two links", {"left": (0.0, 0.0), "right": (0.1, 0.0)},
        (Body("top", MASS, 1e-4, (0.05, HEIGHT), {"left": (0.0, HEIGHT), "right": (0.1, HEIGHT)}),),
        (leaf,), tuple(links[name] for name in names),
        **{"release": Release("top", 0.0, 1e-3), "gravity": (0.0, -GRAVITY)} | given,
        stops=(Stop("stop", "top", (0.1, HEIGHT), 0.0, WALL, restitution=0.5),),
    )  # fmt: skip


def rate(model: Mechanism) -> float:
    return Simulation(model).configuration.scales.rate


@pytest.mark.parametrize("axial", [False, True])
def test_the_rate_of_an_unstable_mechanism_is_that_of_its_fall(axial):
    """The links have 2 rho b t l/2 of their mass at the table, and a third of their inertia."""
    links = 2 * 2000.0 * 1e-2 * 1e-3 * HEIGHT
    inertia = (MASS + links / 3) * HEIGHT**2
    expected = math.sqrt((MASS + links / 2) * GRAVITY * HEIGHT / inertia)
    for names in (("left", "right"), ("right", "left")):
        assert rate(table(axial=axial, names=names)) == pytest.approx(expected, rel=1e-3)


def test_without_springs_and_weight_the_rate_is_that_of_the_initial_motion():
    start = Release("top", 0.0, velocity=0.2)
    model = table(axial=True, gravity=(0.0, 0.0), release=start)
    length = Simulation(model).system.length
    assert rate(model) == pytest.approx(0.2 / length, rel=1e-12)


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_a_table_that_leans_on_a_wall_comes_to_rest(engine):
    """The wall carries the weight times the tangent of the lean.  Its links vibrate and damp."""
    model = table(axial=True, damping_beta=1e-3)
    simulation = engine(model)
    simulation.advance(1.5)
    found = simulation.outputs()
    lean = math.asin(WALL / HEIGHT)
    links = 2 * 2000.0 * 1e-2 * 1e-3 * HEIGHT
    assert found["stop.gap"] == pytest.approx(0.0, abs=1e-12)
    weight = (MASS + links / 2) * GRAVITY
    assert found["stop.force"] == pytest.approx(weight * math.tan(lean), rel=1e-3)
