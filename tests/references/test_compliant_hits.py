"""Hits of the steel guide on compliant stops: beams in the kernel beside finite elements."""

import math

import numpy as np
import pytest

import compliant_hits as hits
from prbm.references.finite_elements import FiniteElementError, FiniteElements
from prbm.references.finite_elements.hit import compliant_hit
from prbm.runs.engine import simulation

pytest.importorskip("exudyn", reason="finite elements need exudyn: python -m pip install exudyn")

CENTRED, OFF = hits.OFFSETS


@pytest.mark.slow
def test_the_table_of_the_page_is_that_of_the_script():
    assert hits.shown(hits.PAGE.read_text("utf-8")) == hits.table()


@pytest.mark.parametrize("offset", hits.OFFSETS)
@pytest.mark.parametrize(
    "stiffness",
    [k if k in (1e6, 6e7) else pytest.param(k, marks=pytest.mark.slow) for k in hits.STIFFNESSES],
)
def test_beams_and_finite_elements_return_the_same_share_of_the_fundamental_mode(stiffness, offset):
    exact = hits.by_finite_elements(stiffness, offset)
    third, fifth = (hits.by_beams(order, stiffness, offset) for order in hits.ORDERS)
    assert fifth.restitution == pytest.approx(exact.restitution, abs=1.5e-4)
    assert third.restitution == pytest.approx(exact.restitution, abs=1.2e-3)
    for beams in (third, fifth):
        assert beams.force == pytest.approx(exact.force, rel=6e-4)
        assert beams.duration == pytest.approx(exact.duration, rel=6e-4)


def test_finite_elements_converge_with_elements_and_with_the_square_of_the_step():
    coarse, fine = (hits.by_finite_elements(1e7, OFF, elements) for elements in (8, 16))
    assert coarse.restitution == pytest.approx(fine.restitution, abs=1e-5)
    found = [hits.by_finite_elements(1e7, CENTRED, 8, steps).force for steps in (100, 200, 400)]
    changes = np.abs(np.diff(found))
    assert 3.0 < changes[0] / changes[1] < 5.0


def test_an_elastic_hit_has_the_duration_and_force_of_a_mass_on_a_spring():
    """The flexures have 0.9 % of the mass.  A rigid elastic hit returns 0.993 of the mode."""
    k, speed = 1e6, hits.SPEED
    fe = FiniteElements(hits.guide(3, k), {**hits.UNDAMPED, "stop.restitution": 1.0}, elements=4)
    m = fe.values["shuttle.mass"]
    hit = compliant_hit(fe, speed, math.pi * math.sqrt(m / k), 400)
    assert hit.duration == pytest.approx(math.pi * math.sqrt(m / k), rel=5e-3)
    assert hit.force == pytest.approx(speed * math.sqrt(k * m), rel=5e-3)
    assert 0.993 < hit.restitution < 1.0


def test_the_loss_of_an_off_centre_hit_needs_a_contact_shorter_than_a_fifth_of_a_millisecond():
    for stiffness in hits.STIFFNESSES:
        centred, off = (hits.by_beams(3, stiffness, offset) for offset in hits.OFFSETS)
        loss = centred.restitution - off.restitution
        assert (loss > 0.03) == (centred.duration < 2e-4)
        assert loss < 0.05


@pytest.mark.slow
def test_damping_of_the_flexures_changes_restitution_as_the_page_states():
    damped = {"damping.beta": 8e-6}
    for offset, limit in ((CENTRED, 2e-4), (OFF, 4e-3)):
        for stiffness in hits.STIFFNESSES:
            with_damping = hits.by_beams(5, stiffness, offset, damped)
            without = hits.by_beams(5, stiffness, offset)
            assert with_damping.restitution == pytest.approx(without.restitution, abs=limit)
    exact = hits.by_finite_elements(6e7, OFF, values=damped).restitution
    beams = hits.by_beams(5, 6e7, OFF, damped)
    assert beams.restitution == pytest.approx(exact, abs=1.5e-4)


def test_a_rigid_stop_is_rejected():
    fe = FiniteElements(hits.guide(3), hits.UNDAMPED, elements=2)
    with pytest.raises(FiniteElementError, match="must be a compliant stop on the ground"):
        compliant_hit(fe, 0.3, 1e-4, 10)


def test_the_output_of_a_stop_is_the_restitution_of_the_mode_at_first_touch():
    """At separation the leaves vibrate along their length, and their own modes are unstable."""
    start = {"release.displacement": -1e-7, "release.velocity": 0.3, "stop.offset": OFF}
    for engine in ("kernel", "python"):
        motion = simulation(hits.guide(3, 6e7), {**hits.UNDAMPED, **start}, engine=engine)
        motion.advance(2e-4)
        assert motion.outputs()["stop.modal_restitution"] == pytest.approx(0.56, abs=0.01)
