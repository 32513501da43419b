"""What contacts share at a position: laws of the mobility, and how often it is computed."""

from collections import Counter

import numpy as np
import pytest

from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_problem import ContactProblem
from support import mechanism


def problem(name: str) -> ContactProblem:
    simulation = Simulation(mechanism(name))
    return ContactProblem(simulation.system, simulation.front.q)


@pytest.mark.parametrize("name", ["PRBDM", "PRBDM2R", "Cantilever"])
def test_unit_impulses_do_half_their_velocity_of_work_and_keep_the_loops_closed(name):
    """The kinetic energy after a unit impulse from rest is half the mobility (Kelvin)."""
    at = problem(name)
    v = at.response(at.gaps[[0]])[:, 0]
    mobility = at.mobility(at.gaps[[0]])
    assert v @ at.M @ v == pytest.approx(mobility, rel=1e-12)
    assert at.gaps[0] @ v == pytest.approx(mobility, rel=1e-12)
    assert np.abs(at.loops @ v).max(initial=0.0) <= 1e-12 * np.abs(v).max()


def test_a_row_is_independent_unless_the_held_rows_contain_it():
    at = problem("Cantilever")
    row = at.gaps[[0]]
    assert at.independent(at.loops, row)
    assert not at.independent(np.vstack([at.loops, row]), row)
    assert not at.independent(at.loops, 1e-13 * row)


def test_all_contacts_at_a_position_share_one_problem(monkeypatch):
    """Captures, impulses and the choice of modes use the mass matrix that was computed first."""
    counts: Counter[bytes] = Counter()
    create = ContactProblem.__init__

    def counting(self, system, q):
        counts[q.tobytes()] += 1
        create(self, system, q)

    simulation = Simulation(mechanism("PRBDM"))
    monkeypatch.setattr(ContactProblem, "__init__", counting)
    simulation.advance(0.3)
    assert simulation.outputs()["stop.impact_count"] > 10
    assert len(counts) > 10
    assert max(counts.values()) == 1
