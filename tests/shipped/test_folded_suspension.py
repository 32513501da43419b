"""The folded suspension, compared with beam theory: straightness, stiffness, frequency."""

import runpy
from dataclasses import replace

import numpy as np
import pytest

from prbm.analysis import holding
from prbm.base.errors import MechanismError
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from support import ROOT, guided_rate, mechanism, run

FOLDED = mechanism("FoldedSuspension")
SYSTEM = assemble(FOLDED, FOLDED.values())
EXAMPLE = runpy.run_path(str(ROOT / "examples" / "straight_line.py"))
SIDES = [f"{a}_{b}_{c}" for a in ("upper", "lower") for b in ("left", "right")
         for c in ("inner", "outer")]  # fmt: skip


def beam() -> tuple[float, float, float, float]:
    """Return EI/L^3 [N/m], the masses of a flexure, the shuttle and a truss [kg]."""
    v = SYSTEM.values
    L, h, b = (v[f"flexure.{x}"] for x in ("length", "thickness", "width"))
    EI = v["pmma.youngs_modulus"] * b * h**3 / 12
    return EI / L**3, v["pmma.density"] * b * h * L, v["shuttle.mass"], v["upper_truss.mass"]


def test_the_suspension_has_two_trusses_and_eight_flexures() -> None:
    assert sorted(f.name for f in FOLDED.flexures) == sorted(SIDES)
    assert [body.name for body in FOLDED.bodies] == ["shuttle", "upper_truss", "lower_truss"]
    assert SYSTEM.n == 8 * (5 + 1) + 3
    assert len(SYSTEM.loops) == 2 * (8 - 3)


def test_rigid_links_are_over_constrained_when_straight() -> None:
    kinds = tuple(replace(kind, axial=False) for kind in FOLDED.flexure_types)
    rigid = replace(FOLDED, flexure_types=kinds)
    with pytest.raises(MechanismError, match=r"over-constrained.*axial = true"):
        assemble(rigid, rigid.values())


def test_stiffness_is_24_ei_over_l3() -> None:
    """Two trusses, each with two pairs of flexures in series; the model error of 3R is -2.2 %."""
    EI_L3, *_ = beam()
    rate = equilibrium(SYSTEM, 1e-5).force / 1e-5
    assert rate == pytest.approx(
        2 * guided_rate(SYSTEM.values), rel=1e-6
    )  # Error of order (x/L)^2.
    assert rate == pytest.approx(24 * EI_L3, rel=0.022)  # Model error.


def test_stiffness_rises_by_less_than_a_percent_over_the_stroke() -> None:
    """The inner and outer flexures shorten equally, so that no tension builds up.

    Flexures that could not shorten would add a stiffness of the order EA/L (3/5) (x/2L)^2,
    hundreds of percent.
    """
    x = np.array([1e-5, 0.03])
    rates = np.array([point.force for point in holding.curve(SYSTEM, x).points]) / x
    assert 0.0 < rates[1] / rates[0] - 1.0 < 0.01


def test_fundamental_frequency_is_below_rayleighs_quotient() -> None:
    """The quotient has the stiffness 24 EI/L^3 and the following mass.

    M + 2 M_t/4 + 4 m 13/35 / 4 + 4 m (1/4 + 1/4 + 13/140), with the masses M of the shuttle, M_t of
    a truss and m of a flexure.

    The fixed-guided shape 3 s^2 - 2 s^3 has the mean 1/2 and the mean square 13/35.  Rayleigh's
    quotient is an upper bound, here 1.1 % too high: because of their inertia, the trusses move more
    than half as far as the shuttle.  The stiffness of the 3R model adds -1.1 %.
    """
    EI_L3, m, shuttle, truss = beam()
    mass = shuttle + 2 * truss / 4 + 4 * m * 13 / 35 / 4 + 4 * m * (0.25 + 0.25 + 13 / 140)
    found = modes(SYSTEM, equilibrium(SYSTEM)).frequency[0]
    bound = np.sqrt(2 * guided_rate(SYSTEM.values) / mass) / (2 * np.pi)
    assert 0.98 * bound < found < bound
    assert found == pytest.approx(np.sqrt(24 * EI_L3 / mass) / (2 * np.pi), rel=0.025)


def test_trusses_move_half_as_far_and_descend_as_a_guide() -> None:
    """The descent is 3 (x/2)^2 / (5 L); that of the 3R model is 0.9 % less."""
    x, L = 0.02, SYSTEM.values["flexure.length"]
    E = SYSTEM.directions(equilibrium(SYSTEM, x).q)
    for name, sign in (("upper_truss", 1), ("lower_truss", -1)):
        frame = SYSTEM.bodies[name]
        moved = complex(frame.A @ E + frame.c - frame.drawn)
        assert moved.real == pytest.approx(x / 2, rel=1e-9)
        assert -sign * moved.imag == pytest.approx(0.6 * (x / 2) ** 2 / L, rel=0.015)


@pytest.mark.slow
def test_the_path_is_far_straighter_than_that_of_a_parallel_guide() -> None:
    """The strokes are up to 30 mm, with flexures of 0.2 m."""
    x, L = EXAMPLE["STROKES"], SYSTEM.values["flexure.length"]
    errors = {name: np.abs(error) for name, error in EXAMPLE["simulate"]().items()}
    guide = 0.6 * x**2 / L
    np.testing.assert_allclose(errors["two leaves"], guide, rtol=0.015, atol=1e-12)
    assert errors["folded"].max() < 1e-12  # Zero by symmetry.
    assert np.all(errors["folded, one truss"][1:] < 2e-3 * guide[1:])
    assert np.all(errors["folded, one leaf 5 % thicker"][1:] < 0.1 * guide[1:])


@pytest.mark.slow
def test_the_first_impact_does_not_turn_the_shuttle() -> None:
    """The line of impact passes through the centre of mass, and the mechanism is symmetric."""
    result = run(FOLDED, stop_time=0.2)
    assert len(result.simulation.record) == 1
    assert np.abs(result.column("shuttle.angle")).max() < 1e-9
    assert np.abs(result.column("shuttle.y")).max() < 1e-9
