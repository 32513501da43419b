"""Circular notches of the engine beside published formulas, and the table of both."""

import math

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from prbm.mechanics.assembly import assemble
from prbm.mechanics.profile import Notch
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Release
from prbm.references.notches import paros_weisbord, paros_weisbord_thin, schotborgh
from support import ROOT

RADIUS, WIDTH, E = 4e-3, 0.01, 2.8e9
PAGE = ROOT / "docs" / "flexure-models.md"
WAISTS = (0.05, 0.1, 0.2, 0.5)  # Of the radius.


def hinge(length=2 * RADIUS, **given):
    """Return a notch between the ground and a body."""
    kind = FlexureType("notch", "beam", width=WIDTH, youngs_modulus=E, density=1410.0, **given)
    return Mechanism(
        name="Notch",
        title="A notch between the ground and a body",
        ground={"clamp": (0.0, 0.0)},
        bodies=(Body("tip", 1e-3, 1e-7, (length, 0.0), {"end": (length, 0.0)}),),
        flexure_types=(kind,),
        flexures=(Flexure("hinge", "notch", "ground.clamp", "tip.end"),),
        forces=(Force("force", "tip"),),
        release=Release("tip", direction=90.0),
    )


def stiffness(waist, order=1):
    """Return the moment over the angle of a circular notch of the engine [N m/rad]."""
    description = hinge(thickness=waist, profile="notch", notch_radius=RADIUS, order=order)
    system = assemble(description, description.values())
    slope = equilibrium(system, loads={"force.moment": 1e-6}).q[system.bodies["tip"].j]
    return 1e-6 / float(slope)


def moved(system, moment, force):
    """Return displacement across the flexure [m] and rotation [rad] of the tip."""
    q = equilibrium(system, loads={"force.moment": moment, "force.y": force}).q
    tip = system.bodies["tip"]
    return float((tip.c + tip.A @ system.directions(q)).imag), float(q[tip.j])


def compliances(notch, length):
    """Return displacement per force of the free tip [m/N], and of a tip that does not rotate.

    The integrals of (L - s)^2/EI and (s - L/2)^2/EI by the definition of the section, with many
    points in sinh(tau), in which the peak at the waist is wide.
    """
    points, weights = leggauss(100)
    h, (a, b), plain = notch.thickness, notch.axes, notch.waist_length or 0.0
    sharp = math.sqrt(h / b) / 2
    end = math.asinh(notch.angle / sharp)
    tau = 0.5 * end * (1 + points)
    beta, step = sharp * np.sinh(tau), 0.5 * end * sharp * np.cosh(tau)
    arc = a * np.sin(beta), weights * step * a * np.cos(beta), h + 4 * b * np.sin(beta / 2) ** 2
    half, rest = 0.5 * plain, 0.5 * (length - notch.length)
    parts = [  # Positions from the middle, their steps, and the thickness, of one half.
        (half * 0.5 * (1 + points), half * 0.5 * weights, h + 0 * points),
        (half + arc[0], *arc[1:]),
        (0.5 * length - rest * 0.5 * (1 + points), rest * 0.5 * weights,
         notch.end_thickness + 0 * points),
    ]  # fmt: skip
    x, ds, thick = map(np.concatenate, zip(*parts, strict=True))
    flexibility = 2 * ds / (E * WIDTH * thick**3 / 12)
    guided = float(flexibility @ x**2)
    return guided + float(flexibility.sum()) * length**2 / 4, guided


@pytest.mark.parametrize("order", [None, 3, pytest.param(7, marks=pytest.mark.slow)])
@pytest.mark.parametrize("shape", ["circular", "elliptic", "filleted"])
def test_the_transverse_compliance_of_a_notch_is_exact_however_thin_its_waist_is(shape, order):
    """The waist is a parameter that changes while the number of nodes stays.

    Under forces at its ends a straight beam has a linear moment, which order 1 contains.
    """
    depth = 2e-3 if shape == "elliptic" else RADIUS
    plain = 3e-3 if shape == "filleted" else None
    given = {"notch_depth": depth, "waist_length": plain}
    length = 2.2 * RADIUS + (plain or 0.0)
    description = hinge(
        length, thickness=0.5 * RADIUS, profile="notch", notch_radius=RADIUS, order=order, **given
    )
    for ratio in (0.01, 0.02, 0.05, 0.125, 0.3, 1.0):
        waist = ratio * depth
        notch = Notch(waist, WIDTH, (RADIUS, depth), waist + 2 * depth, plain)
        changes = {"notch.thickness": waist}
        system = assemble(description, description.values(changes))
        free, guided = compliances(notch, length)
        force = 1e-7 * length / free
        moment = -0.5 * length * force  # It prevents the rotation.
        assert moved(system, 0.0, force)[0] / (force * free) == pytest.approx(1.0, rel=1e-5)
        across, turned = moved(system, moment, force)
        assert across / (force * guided) == pytest.approx(1.0, rel=1e-4)
        assert abs(turned) * length < 1e-4 * force * guided


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
