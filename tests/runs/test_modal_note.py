"""The line about modal restitutions that do not describe the rebound."""

import math
import re
from dataclasses import replace

import pytest

import prbm
from prbm.mechanics.assembly import assemble
from prbm.runs.modal_note import modal_notes, mode_before
from prbm.runs.result import Result

FIRST = 0.06  # The first impact only [s].


def of_order(order: int) -> Result:
    guide = prbm.load("GuideBeam")
    kinds = tuple(replace(kind, order=order) for kind in guide.flexure_types)
    return prbm.simulate(replace(guide, flexure_types=kinds), stop_time=FIRST)


def test_a_modal_restitution_of_an_unstable_mode_is_reported_with_its_share_of_the_energy():
    result = of_order(3)
    (line,) = modal_notes(result)
    assert re.match(r"modal restitution +1\.7\d of impact 1 does not describe the rebound", line)
    assert "unstable in that shape" in line
    share, stable = mode_before(
        assemble(result.mechanism, result.mechanism.values()), result.impacts[0]
    )
    assert not stable
    assert f"{100 * share:.2g} % of the energy" in line


@pytest.mark.parametrize("order", [3, 5])
def test_the_share_bounds_the_modal_restitution(order):
    result = of_order(order)
    hit = result.impacts[0]
    share, _ = mode_before(assemble(result.mechanism, result.mechanism.values()), hit)
    assert 0.0 < share <= 1.0
    assert abs(hit.latched.modal_restitution) <= 1.0 / math.sqrt(share)


def test_an_impact_of_the_fundamental_mode_alone_has_no_line():
    """With the order 5 the mode has the energy, and its restitution is that of the stop nearly."""
    result = of_order(5)
    assert modal_notes(result) == []
    assert result.impacts[0].latched.modal_restitution == pytest.approx(0.6, abs=0.01)
    assert modal_notes(prbm.simulate(prbm.load("PRBDM"), stop_time=FIRST)) == []


def test_a_body_that_does_not_vibrate_before_its_hit_has_no_restitution_of_the_mode():
    """The hammer hits the oscillator at rest, whose mode is the fundamental one."""
    pair = prbm.load("ImpactOscillator")
    lines = modal_notes(prbm.simulate(pair, stop_time=0.1))
    assert lines[0].startswith("modal restitution    0 of impact 1 does not describe the rebound")
    assert "its mode had 0 % of the energy" in lines[0]
