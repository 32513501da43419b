"""Searches without a solution end in errors that name the contacts, and change nothing."""

from dataclasses import replace

import numpy as np
import pytest

from kernel_library import KernelError, kernel
from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import SimulationError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics import contact
from support import mechanism


def vice():
    """Return a guide between two walls."""
    guide = mechanism("PRBDM2R")
    (stop,) = guide.stops
    other = replace(stop, name="right", direction=stop.direction + 180.0, position=0.03)
    return replace(guide, name="Vice", stops=(replace(stop, name="left"), other))


@pytest.mark.parametrize("k", [2, 20])
def test_walls_that_close_in_are_rejected(k):
    """Opposite walls: the best of infeasible impulses would let one of them penetrate."""
    row = np.resize([1.0, -1.0], k)
    W, u, eps = np.outer(row, row), np.full(k, -1.0), np.full(k, 0.5)
    with pytest.raises(SimulationError, match="the walls close in on the mechanism"):
        contact.newton(W, u, eps)
    with pytest.raises(KernelError, match="the walls close in on the mechanism"):
        kernel().newton(k, W, u, eps, 0.0, np.zeros(k))


def test_a_wall_that_pushes_where_friction_locks_is_rejected():
    """One degree of freedom that slides away from the wall's push: no impulse ends the approach."""
    W, u = np.array([[1.0, 2.0], [2.0, 4.0]]), np.array([-1.0, 1.0])
    with pytest.raises(SimulationError, match="friction locks; reduce the friction"):
        contact.stronge(W, u, 1.0, 0.5)
    with pytest.raises(KernelError, match="friction locks; reduce the friction"):
        kernel().stronge(W, u, 1.0, 0.5, 0.0, np.zeros(1), np.zeros(1))


def test_many_stops_are_hit_at_once_with_the_impulses_of_one():
    """Forty equal stops share an impulse evenly: sweeps needed not converge."""
    k = 40
    W, u, eps = np.ones((k, k)) / 2.0, np.full(k, -3.0), np.full(k, 0.5)
    np.testing.assert_allclose(contact.newton(W, u, eps), 9.0 / k, rtol=1e-12)


def test_an_event_that_cannot_be_located_is_named(monkeypatch):
    sim = Simulation(mechanism("PRBDM2R"))
    before = sim.outputs()

    def failing(*_, earliest):
        raise SimulationError("the equations are singular")

    monkeypatch.setattr("prbm.hybrid.guards._corrected_time", failing)
    with pytest.raises(SimulationError, match=r"no impact of stop could be located within .* t = "):
        sim.advance(1.0)
    assert sim.outputs() == before


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_a_guide_between_closing_walls_is_left_as_it_was(engine):
    """The guide rests on the left wall, and the right wall arrives within the step."""
    sim = engine(vice(), {"release.displacement": 0.0})
    sim.set({"right.displacement": -0.05})
    before = sim.outputs()
    closing = r"impact at t = 0\.0\d+ s \(left, right\): no impulses open all gaps: the walls close"
    with pytest.raises((SimulationError, KernelMistake), match=closing):
        sim.advance(0.1)
    assert sim.outputs() == before
