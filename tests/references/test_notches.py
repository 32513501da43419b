"""Circular notches of the engine beside published formulas, and the table of both."""

import pytest

from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Release
from prbm.references.notches import paros_weisbord, paros_weisbord_thin, schotborgh
from support import ROOT

RADIUS, WIDTH, E = 4e-3, 0.01, 2.8e9
PAGE = ROOT / "docs" / "flexure-models.md"
WAISTS = (0.05, 0.1, 0.2, 0.5)  # Of the radius.


def stiffness(waist, order=1):
    """Return the moment over the angle of a notch of the engine [N m/rad]."""
    kind = FlexureType(
        "notch", "beam", waist, WIDTH, E, 1410.0, order=order, profile="notch", notch_radius=RADIUS
    )
    length = 2 * RADIUS
    description = Mechanism(
        name="Notch",
        title="A circular notch between the ground and a body",
        ground={"clamp": (0.0, 0.0)},
        bodies=(Body("tip", 1e-3, 1e-7, (length, 0.0), {"end": (length, 0.0)}),),
        flexure_types=(kind,),
        flexures=(Flexure("hinge", "notch", "ground.clamp", "tip.end"),),
        forces=(Force("force", "tip"),),
        release=Release("tip", direction=90.0),
    )
    system = assemble(description, description.values())
    slope = equilibrium(system, loads={"force.moment": 1e-6}).q[system.bodies["tip"].j]
    return 1e-6 / float(slope)


def row(ratio):
    """Return a row of the table: stiffness over E width waist^2 [-]."""
    waist = ratio * RADIUS
    given = (RADIUS, waist, WIDTH, E)
    found = (stiffness(waist), paros_weisbord(*given), paros_weisbord_thin(*given),
             schotborgh(*given))  # fmt: skip
    numbers = (f"{x / (E * WIDTH * waist**2):.5f}" for x in found)
    return f"| {ratio:g} | {' | '.join(numbers)} |"


@pytest.mark.parametrize("ratio", WAISTS)
@pytest.mark.parametrize("order", [1, 3])
def test_the_stiffness_of_a_circular_notch_is_that_of_paros_and_weisbord(ratio, order):
    waist = ratio * RADIUS
    exact = paros_weisbord(RADIUS, waist, WIDTH, E)
    assert stiffness(waist, order) == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize(("ratio", "limit"), [(0.05, 0.01), (0.1, 0.02), (0.2, 0.06)])
def test_fits_to_finite_elements_approach_the_theory_of_beams_for_thin_waists(ratio, limit):
    given = (RADIUS, ratio * RADIUS, WIDTH, E)
    assert schotborgh(*given) == pytest.approx(paros_weisbord(*given), rel=limit)


def test_the_page_has_the_table_of_circular_notches():
    rows = "\n".join(map(row, WAISTS))
    assert rows in PAGE.read_text("utf-8"), f"docs/flexure-models.md needs the rows\n{rows}"
