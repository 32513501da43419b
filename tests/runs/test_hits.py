"""The printed impacts of a run: those of a mass on a spring-like stop, and of a rigid one."""

import math
import re

import numpy as np
import pytest

from point_mass import point_mass
from prbm.runs.headline import headline
from prbm.runs.hits import HITS_MAX, hits
from prbm.runs.marks import marks
from prbm.runs.run import simulate

MASS, STIFFNESS, SPEED, FORCE = 2.0, 8e5, 0.5, 400.0


def run(stop_time, **stop):
    """Return the motion of a mass that a force presses on its stop."""
    guide = point_mass(mass=MASS, velocity=SPEED, displacement=-1e-6, **stop)
    return simulate(guide, inputs={"push.x": FORCE}, stop_time=stop_time, step=1e-4)


def test_a_line_has_the_peak_force_indentation_and_duration_of_an_elastic_hit():
    """The contact is a part of a vibration about the balance with the pressing force."""
    lines = hits(run(0.01, restitution=1.0, stiffness=STIFFNESS))
    rate = math.sqrt(STIFFNESS / MASS)
    found = re.search(r"0.5 m/s to .*, (.*) N, indentation (.*) mm, contact (.*) ms", lines[0])
    force, depth, duration = map(float, found.groups())
    balance = FORCE / STIFFNESS
    assert 1e-3 * depth == pytest.approx(balance + math.hypot(SPEED / rate, balance), rel=1e-2)
    assert force == pytest.approx(STIFFNESS * 1e-3 * depth, rel=1e-2)
    half = math.pi + 2 * math.atan2(balance, SPEED / rate)
    assert 1e-3 * duration == pytest.approx(half / rate, rel=1e-2)


def test_rigid_hits_have_impulses_and_the_number_of_the_rest():
    """The impulse is (1 + eps) m v, and the first flight lasts 2 eps m v/F."""
    lines = hits(run(0.02, law="rigid", stiffness=None, restitution=0.5))
    assert lines[0].endswith(", 0.5 m/s to 0.25 m/s, 1.5 N s")
    assert lines[1][21:].startswith("stop: 2.50")
    assert ", 0.25 m/s to 0.125 m/s, 0.75" in lines[1]
    assert len(lines) == HITS_MAX + 1
    assert re.fullmatch(r"more impacts +\d+", lines[-1])


@pytest.mark.parametrize("share", np.linspace(0.1, 0.9, 3))
def test_a_mass_in_an_impact_has_not_come_to_rest(share):
    """Its velocity at the end of the run is that of an oscillation."""
    contact = math.pi / math.sqrt(STIFFNESS / MASS)
    result = run(2e-6 + share * contact, restitution=1.0, stiffness=STIFFNESS)
    assert result["stop.contact"][-1]
    lines = headline(result, result.mechanism, result.start_values)
    assert not [line for line in lines if line.startswith("came to rest")]


def test_a_mass_on_a_compliant_stop_comes_to_rest():
    result = run(0.1, restitution=0.1, stiffness=STIFFNESS)
    lines = headline(result, result.mechanism, result.start_values)
    assert [line for line in lines if line.startswith("came to rest")]


@pytest.mark.parametrize("step", [1e-3, 2e-2])
def test_columns_alone_have_the_peak_forces_of_the_impacts(step):
    """Contacts of 5 ms: some rows lie within a contact; with the longer step none does."""
    guide = point_mass(
        mass=MASS, velocity=SPEED, displacement=-1e-6, restitution=0.8, stiffness=STIFFNESS
    )
    result = simulate(guide, inputs={"push.x": FORCE / 20}, stop_time=0.4, step=step)
    known = {mark.count: mark for mark in marks(result, guide)}
    found = marks(result.columns, guide)
    assert len(found) > 2
    for mark in found[:-1]:  # The last one may not have ended.
        assert mark.force == pytest.approx(known[mark.count].force, rel=1e-12)
