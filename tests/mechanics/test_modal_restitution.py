"""Bounds of the modal restitution of an impact, and its dependence on the coordinates."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh, null_space

from prbm.analysis.impact_map.impacts import mode_energies
from prbm.fmu.start import start
from prbm.hybrid import impacts
from prbm.hybrid.simulation import Simulation
from prbm.interface.variables import variables
from prbm.mechanics.assembly import assemble
from prbm.mechanics.forces import elastic_energy, gravitational_energy
from prbm.mechanics.modal import modes, modes_at, simulated_restitution
from prbm.mechanics.statics import equilibrium
from prbm.mechanics.system import jacobian, values
from support import ROOT, mechanism, simulation

OFFSET = {"stop.offset": 4e-3}

# --- bounds ---------------------------------------------------------------------------------------

STRAIGHT = OFFSET | {
    "gravity.x": 0.0, "release.displacement": 0.0, "stop.position": 0.0, "damping.beta": 0.0,
}  # fmt: skip


def impact_of_two_modes(share, towards):
    """Return the modal restitution of an impact of two modes, and its closed form.

    The fundamental mode has the given share of the kinetic energy, and moves towards the wall or
    away from it.  The second mode, a rotation, moves towards the wall.  With G_i the derivatives of
    the gap by the modes and v_i their velocities,

        R = (1 + eps) G_1 (G_1 v_1 + G_2 v_2)/(v_1 sum_i G_i^2) - 1.
    """
    sim = simulation("PRBDM2RAxial", STRAIGHT)
    system = sim.system
    phi = modes(system, equilibrium(system, 0.0)).shape
    G = system.gap_rows.jacobian(system.directions(sim.front.q))[0] @ phi
    k = 1 + int(np.argmax(np.abs(G[1:])))
    v1 = -math.copysign(math.sqrt(share), G[0]) * (1 if towards else -1)
    v2 = -math.copysign(math.sqrt(1.0 - share), G[k])
    sim.front.v[:] = 0.1 * (v1 * phi[:, 0] + v2 * phi[:, k])
    _, (hit,) = impacts.impact(sim.configuration, sim.front, 0)
    expected = 1.6 * G[0] * (v1 * G[0] + v2 * G[k]) / (v1 * float(G @ G)) - 1.0
    return hit.latched.modal_restitution, expected


@pytest.mark.parametrize("share", [1e-2, 1e-3, 1e-4])
def test_restitution_is_below_minus_one_if_the_fundamental_mode_moves_away_from_the_wall(share):
    """The mode must have a small share of the energy; otherwise the gap would open."""
    found, expected = impact_of_two_modes(share, towards=False)
    assert found == pytest.approx(expected, rel=1e-6)
    assert -1.0 / math.sqrt(share) <= found < -1.0


def test_restitution_is_far_below_minus_one_if_the_fundamental_mode_has_little_energy():
    assert impact_of_two_modes(1e-4, towards=False)[0] < -20.0


@pytest.mark.parametrize("share", [1.0, 0.5, 1e-2, 1e-4])
def test_restitution_is_above_minus_one_if_the_fundamental_mode_moves_towards_the_wall(share):
    found, expected = impact_of_two_modes(share, towards=True)
    assert found == pytest.approx(expected, rel=1e-6)
    assert -1.0 <= found <= 1.0 / math.sqrt(share)


@pytest.mark.slow
def test_restitution_is_bounded_by_the_share_of_the_fundamental_mode():
    """With the share p of the energy before the impact, R^2 <= 1/p: an impact gains no energy."""
    sim = Simulation(mechanism("PRBDM3R"), OFFSET)
    sim.record = []
    sim.advance(0.24)
    hits = [mode_energies(sim.system, impact) for impact in sim.record]
    assert all(hit.restitution**2 * hit.before[0] <= 1.0 for hit in hits)
    assert max(hit.restitution for hit in hits if hit.before[0] < 0.01) > 1.0


@pytest.mark.slow
def test_restitution_is_that_of_an_unstable_mode_if_the_impact_shape_has_one():
    """The guide passes a shape that would be unstable at rest."""
    sim = Simulation(mechanism("PRBDM3R"))
    sim.record = []
    sim.advance(0.05)
    lowest, fundamental = modes_at(sim.system, sim.record[0].q).frequency[:2]
    assert lowest < 0.0
    assert fundamental == pytest.approx(4.5, abs=1.0)
    assert sim.record[0].latched.modal_restitution < -5.0


# --- coordinates ----------------------------------------------------------------------------------


def fundamental(system, q, M, curved):
    """Return frequency and shape of the fundamental mode at a shape, by differences of energies.

    The multipliers are those of Gauss' principle for the shape at rest, held by a force on the
    released body.  The coordinates are the angles of the links or, with ``curved``, the sines of
    their rotations.  The sines are scaled to the same velocities at the shape, so that the modes in
    both coordinates can be compared.
    """
    B = np.vstack([system.loops, system.release])
    c = np.append(system.loops_c, system.release_c)
    curvature = np.tan(q - system.q0) if curved else np.zeros(len(q))

    def potential(q):
        return elastic_energy(system.K, q - system.q0) + gravitational_energy(
            system, np.exp(1j * q)
        )

    identity, h = np.eye(len(q)), 1e-5
    gradient = np.array([(potential(q + h * x) - potential(q - h * x)) / (2 * h) for x in identity])
    rows = jacobian(B, np.exp(1j * q))
    lam = -np.linalg.solve(rows @ np.linalg.solve(M, rows.T), rows @ np.linalg.solve(M, gradient))

    def lagrangian(p):
        moved = q + p + curvature * p**2 / 2
        return potential(moved) + lam @ values(B, c, np.exp(1j * moved))

    h = 1e-3
    hessian = np.array([
        [
            (lagrangian(h * (a + b)) - lagrangian(h * (a - b))
             - lagrangian(h * (b - a)) + lagrangian(-h * (a + b))) / (4 * h * h)
            for b in identity
        ]
        for a in identity
    ])  # fmt: skip
    Z = null_space(jacobian(system.loops, np.exp(1j * q)))
    omega2, reduced = eigh(Z.T @ hessian @ Z, Z.T @ M @ Z)
    return math.sqrt(omega2[0]) / (2 * math.pi), Z @ reduced[:, 0]


@pytest.mark.parametrize("wall", [-5e-3, 10e-3])
def test_away_from_equilibrium_restitution_depends_on_the_coordinates(wall):
    """Restitution changes by up to 0.2 %, frequency by up to 5 %; the engine uses the angles."""
    sim = Simulation(mechanism("PRBDM2R"), OFFSET | {"stop.position": wall})
    sim.record = []
    while not sim.record:
        sim.advance(sim.time + 1e-3)
    hit = sim.record[0]
    found = modes_at(sim.system, hit.q)
    restitution = hit.latched.modal_restitution
    for curved in (False, True):
        frequency, phi = fundamental(sim.system, hit.q, found.M, curved)
        other = simulated_restitution(phi, found.M, hit.before, hit.after)
        if curved:
            assert 1e-5 < abs(other - restitution) < 2e-3 * restitution
            assert 0.01 < abs(frequency / found.frequency[0] - 1) < 0.05
        else:
            assert other == pytest.approx(restitution, abs=1e-7)
            assert frequency == pytest.approx(found.frequency[0], rel=1e-5)


def test_at_a_held_shape_the_modes_do_not_depend_on_the_coordinates():
    guide = mechanism("PRBDM2R")
    system = assemble(guide, guide.values())
    shape = equilibrium(system, -0.01)
    found = modes(system, shape)
    for curved in (False, True):
        frequency, phi = fundamental(system, shape.q, found.M, curved)
        assert frequency == pytest.approx(found.frequency[0], rel=1e-5)
        assert abs(phi @ found.M @ found.shape[:, 0]) == pytest.approx(1.0, abs=1e-9)


# --- documentation --------------------------------------------------------------------------------


def test_bounds_and_coordinates_are_documented():
    page = (ROOT / "docs" / "conventions.md").read_text("utf-8")
    section = page.partition("## Modal restitution")[2].partition("\n## ")[0]
    assert "below -1" in section
    assert "coordinates" in section
    listed = variables(mechanism("PRBDM"), start(mechanism("PRBDM"), {}).sample)
    (found,) = [v.description for v in listed if v.name == "stop.modal_restitution"]
    assert "below -1" in found
