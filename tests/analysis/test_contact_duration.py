"""The effect of the duration of a contact on the modal restitution of an off-centre impact."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import prbm
from prbm.analysis.impact_map import algebraic, with_flexures
from prbm.analysis.touching import impact_shape
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from support import ROOT, mechanism

SPEED = 0.3  # m/s
DAMPING = 0.9749  # Solution a of (1 + a)/(1 - 0.6 a) = exp(1.6 a), for a restitution of 0.6.
OFFSET = 4e-3  # m
GUIDE = with_flexures(mechanism("PRBDM2R"), "2R", axial=True)


def compliant(stiffness: float, offset: float) -> tuple[float, float]:
    """Return modal restitution and duration [s] of a hit on a spring with Hunt-Crossley damping.

    The modes of the straight guide are taken as linear.  The fundamental mode arrives alone.
    """
    system = assemble(GUIDE, GUIDE.values({"gravity.x": 0.0, "stop.offset": offset}))
    shape = impact_shape(system, 0, 0.0)
    found = modes(system, shape)
    G = system.gap_rows.jacobian(system.directions(shape.q))[0] @ found.shape
    omega2 = (2 * np.pi * found.frequency) ** 2
    n = len(G)
    start = np.zeros(2 * n)
    start[n] = -SPEED / G[0]

    def rate(_, y):
        indentation, speed = -(G @ y[:n]), -(G @ y[n:])
        force = stiffness * indentation * (1 + DAMPING * speed / SPEED)
        return np.concatenate([y[n:], G * force - omega2 * y[:n]])

    def gap(_, y):
        return G @ y[:n] - 1e-15

    gap.terminal, gap.direction = True, 1.0
    run = solve_ivp(rate, (0.0, 2e-3), start, "DOP853", rtol=1e-9, atol=1e-14, events=gap)
    return float(-run.y[n, -1] / start[n]), float(run.t[-1])


def rigid(offset: float) -> float:
    """Return the modal restitution of Newton's law."""
    return algebraic(GUIDE, [0.0], [offset], {"gravity.x": 0.0}).restitution.item()


@pytest.mark.parametrize(
    ("stiffness", "duration", "centred", "off"),
    [(6e7, 1.0e-4, 0.596, 0.561), (1e7, 2.3e-4, 0.596, 0.593), (5e6, 3.3e-4, 0.597, 0.603)],
)
def test_the_documented_table_has_the_computed_values(stiffness, duration, centred, off):
    """The table is in docs/flexure-models.md, "Losses of a rigid off-centre impact"."""
    text = (ROOT / "docs" / "flexure-models.md").read_text("utf-8")
    row = f"| {stiffness / 1e6:g} MN/m | {1e3 * duration:.2f} ms | {centred:.3f} | {off:.3f} |"
    assert row in text
    found = compliant(stiffness, 0.0)
    assert found == (pytest.approx(centred, abs=6e-4), pytest.approx(duration, abs=6e-6))
    assert compliant(stiffness, OFFSET)[0] == pytest.approx(off, abs=6e-4)


def test_no_page_claims_that_models_underestimate_the_loss_of_a_real_off_centre_impact():
    """The loss of a real impact depends on the duration of its contact."""
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    pages += [Path(prbm.__file__).parent / "fmu" / "documentation.py"]
    for page in pages:
        text = " ".join(re.sub(r'"\s*\n\s*"', "", page.read_text("utf-8")).split())
        assert not re.search(r"costs? [^.]{0,40}less[^.]{0,40}(real|reality)", text), page.name


def test_a_short_contact_has_the_modal_restitution_of_newtons_law():
    for offset in (0.0, OFFSET):
        restitution, duration = compliant(1e9, offset)
        assert duration < 30e-6
        assert restitution == pytest.approx(rigid(offset), abs=2e-3)


def test_a_contact_of_a_tenth_of_a_millisecond_reduces_the_effect_of_the_offset():
    (centred, duration), (off, _) = (compliant(6e7, offset) for offset in (0.0, OFFSET))
    assert duration == pytest.approx(1e-4, rel=0.05)
    assert 0.6 < (centred - off) / (rigid(0.0) - rigid(OFFSET)) < 0.9


@pytest.mark.parametrize("stiffness", [1e7, 5e6, 1e6])
def test_the_effect_of_the_offset_vanishes_for_contacts_longer_than_a_fifth_of_a_millisecond(
    stiffness,
):
    """An off-centre hit may even return more of the fundamental mode than a centred one."""
    (centred, duration), (off, _) = (compliant(stiffness, offset) for offset in (0.0, OFFSET))
    assert duration > 2e-4
    assert off == pytest.approx(centred, abs=0.007)
    assert rigid(0.0) - rigid(OFFSET) > 0.04
