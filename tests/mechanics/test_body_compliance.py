"""Compliance and stiffness matrices of bodies."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

from moved_drawings import moved
from prbm.base.errors import EquilibriumError
from prbm.files.mechanism_file import load
from prbm.mechanics.assembly import assemble
from prbm.mechanics.body_compliance import compliance_matrix, stiffness_matrix
from prbm.mechanics.statics import equilibrium, holding_stiffness
from support import ROOT, mechanism

TURN = 33.0  # deg
CASES = ROOT / "tests" / "cases"


def assembled(guide, **values):
    return assemble(guide, guide.values(values))


def place(system, shape, frame):
    """Return position [m] and angle [rad] of a point."""
    z = frame.c + frame.A @ system.directions(shape.q)
    return np.array([z.real, z.imag, shape.q[frame.j]])


@pytest.mark.parametrize("name", ["CurvedBistable", "PRBDM2RAxial", "Cantilever", "NotchGuide"])
def test_the_compliance_is_the_derivative_of_the_place_by_the_loads(name):
    """By central differences, about a loaded shape."""
    system = assembled(mechanism(name))
    (push, *_), steps = system.mechanism.forces, (1e-3, 1e-3, 1e-5)
    (frame, *_) = system.pushed
    names = [f"{push.name}.{x}" for x in ("x", "y", "moment")]
    at = dict.fromkeys(names, 0.0) | {names[1]: -0.05, names[0]: 0.02}
    shape = equilibrium(system, None, at)
    C = compliance_matrix(system, shape, frame)
    np.testing.assert_allclose(C, C.T, atol=1e-9 * np.abs(C).max())
    for k, (load_name, step) in enumerate(zip(names, steps, strict=True)):
        ahead, behind = (
            place(system, equilibrium(system, None, at | {load_name: at[load_name] + x}), frame)
            for x in (step, -step)
        )
        found = (ahead - behind) / (2 * step)
        scale = np.sqrt(C[k, k] * C.diagonal())
        round_off = 1e-15 / step * np.array([system.length, system.length, 1.0])
        assert (np.abs(found - C[:, k]) <= 1e-5 * scale + round_off).all()


def test_the_compliance_turns_with_the_drawing():
    """C of the turned mechanism is R C R^T."""
    upright, u = load(CASES / "buckle.toml"), cmath.exp(1j * math.radians(TURN))
    C, D = (
        compliance_matrix(s, equilibrium(s), s.bodies["s"])
        for s in (assembled(upright), assembled(moved(upright, lambda z: u * z, turn=TURN)))
    )
    R = np.diag([0.0, 0.0, 1.0])
    R[:2, :2] = [[u.real, -u.imag], [u.imag, u.real]]
    np.testing.assert_allclose(D, R @ C @ R.T, atol=1e-9 * np.abs(C).max())


@pytest.mark.parametrize(
    ("share", "published"),
    [(0.0, 14.0), (0.02, 10.258), (0.04, 5.693), (0.06, 3.269), (0.1, 1.3835)],
)
def test_the_bearing_stiffness_of_a_double_parallelogram_falls_with_its_displacement(
    share, published
):
    """Values of the beam-column [1]; cubic and higher terms of the leaves make up to 0.5 %.

    [1] S. Awtar, A. H. Slocum, E. Sevincer, J. Mech. Des. 129 (2007) 625.
    """
    system = assembled(load(CASES / "dp.toml"))
    shape = equilibrium(system, share * 0.05)
    C = compliance_matrix(system, shape, system.bodies["prim"], held=True)
    assert 1e-6 / C[0, 0] == pytest.approx(published, rel=5e-3 if share else 1e-9)
    assert stiffness_matrix(C, system.length) is None


def test_the_compliance_along_the_release_is_that_of_the_holding_force():
    system = assembled(mechanism("CurvedBistable"))
    shape = equilibrium(system)
    C = compliance_matrix(system, shape, system.bodies["shuttle"])
    assert 1.0 / C[1, 1] == pytest.approx(holding_stiffness(system, shape), rel=1e-9)
    K = stiffness_matrix(C, system.length)
    assert K is not None
    np.testing.assert_allclose(K @ C, np.eye(3), atol=1e-9)


def test_a_rhombus_amplifies_small_motions_as_its_boundary_value_problem():
    system = assembled(load(CASES / "rhombus.toml"))
    (out,), shape = system.probes, equilibrium(system, 1e-9)
    rise = place(system, shape, out)[1] - out.drawn.imag
    assert 2 * abs(rise) / 1e-9 == pytest.approx(12.06680, rel=1e-5)


def test_a_body_that_turns_freely_has_no_compliance():
    arm = mechanism("Cantilever")
    (leaf,) = arm.flexures
    hinged = replace(arm, flexures=(replace(leaf, ends=("pin", "pin")),))
    system = assembled(hinged, **{"gravity.x": 0.0, "gravity.y": 0.0})
    (body,) = system.bodies.values()
    with pytest.raises(EquilibriumError, match="is infinite"):
        compliance_matrix(system, equilibrium(system), body)


def test_the_mirrored_rest_of_a_bistable_mechanism_has_the_stiffness_of_the_drawn_one() -> None:
    """Its pins turn freely: round-off of their stiffness is not their scale."""
    system = assembled(mechanism("Bistable"))
    rise = 2.0 * system.mechanism.values()["strut.rise"]
    drawn, mirrored = (holding_stiffness(system, equilibrium(system, x)) for x in (0.0, rise))
    assert mirrored == pytest.approx(drawn, rel=1e-9)
