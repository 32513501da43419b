"""Equations of motion: comparison with Lagrange's equations by SymPy, and identities."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from many_parts import cantilever, elastic
from prbm.base.errors import SimulationError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics import constraints
from prbm.mechanics.assembly import assemble
from prbm.mechanics.dynamics import Equations
from prbm.mechanics.kinetics import inertia
from support import mechanism


@pytest.fixture
def rng():
    """Return random numbers that do not depend on the order of the tests."""
    return np.random.default_rng(3)


def test_the_mass_matrix_is_that_of_the_shape_if_other_scales_factor_the_equations(monkeypatch):
    """The first scales fail: the matrix's own ones factor it."""
    sim = Simulation(mechanism("PRBDM2R"))
    y, n, answers = sim.state(), sim.system.n, iter([False, False])
    monkeypatch.setattr(constraints, "_regular", lambda diagonal: next(answers, True))
    found = sim.equations.evaluate(0.0, y[:n], y[n : 2 * n])
    assert not np.array_equal(found.factors.scale, sim.equations.scale)
    expected = sim.system.mass_matrix(found.e)
    np.testing.assert_allclose(found.M, expected, rtol=1e-12, atol=1e-12 * expected.max())


def test_accelerations_equal_those_of_lagrange_equations(rng):
    """The mechanism is a 2R cantilever with a body on a pin at its tip: three angles, no loop."""
    sim = Simulation(cantilever(damping_beta=0.0))
    system = sim.system
    n = system.n
    assert n == 3
    assert len(system.loops) == 0
    L, h, b, E, rho = 0.05, 2e-4, 1e-2, 2e11, 7800.0
    EI, m_leaf = E * b * h**3 / 12, rho * b * h * L
    g1, g2, K1, K2 = 0.44, 0.46, 3.4710 * EI / L, 2.0682 * EI / L

    t = sp.symbols("t")
    q = [sp.Function(f"q{i}")(t) for i in range(3)]
    unit = [sp.Matrix([sp.cos(a), sp.sin(a)]) for a in q]
    across = [sp.Matrix([-sp.sin(a), sp.cos(a)]) for a in q]
    pivot = sp.Matrix([0.1 * L, 0])
    end1 = pivot + g1 * L * unit[0]
    end2 = end1 + g2 * L * unit[1]
    rods = [
        (g1 * m_leaf, pivot + g1 * L / 2 * unit[0], (g1 * L) ** 2 / 12, q[0]),
        (g2 * m_leaf, end1 + g2 * L / 2 * unit[1], (g2 * L) ** 2 / 12, q[1]),
        (0.02, end2 + 0.01 * unit[2] + 0.004 * across[2], 3e-6 / 0.02, q[2]),
    ]
    T = sum(m * (z.diff(t).dot(z.diff(t)) + k2 * a.diff(t) ** 2) / 2 for m, z, k2, a in rods)
    V = K1 * q[0] ** 2 / 2 + K2 * (q[1] - q[0]) ** 2 / 2
    V -= sum(m * z.dot(sp.Matrix([1.0, -9.81])) for m, z, _, _ in rods)
    Q, W, A = (sp.symbols(f"{name}0:3") for name in "QWA")
    equations = []
    for a in q:
        lagrange = (T - V).diff(a.diff(t)).diff(t) - (T - V).diff(a)
        for i in range(3):
            lagrange = (
                lagrange.subs(q[i].diff(t, 2), A[i]).subs(q[i].diff(t), W[i]).subs(q[i], Q[i])
            )
        equations.append(lagrange)
    matrix, right = sp.linear_eq_to_matrix(equations, A)
    evaluate = sp.lambdify([*Q, *W], (matrix, right))
    for _ in range(20):
        angles, rates = rng.normal(size=3), 20 * rng.normal(size=3)
        M, f = evaluate(*angles, *rates)
        expected = np.linalg.solve(np.array(M, float), np.array(f, float).ravel())
        evaluation = sim.equations.evaluate(sim.time, angles, rates)
        found, mass = evaluation.a, evaluation.M
        np.testing.assert_allclose(mass, np.array(M, float), rtol=1e-12, atol=1e-20)
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-8)


def test_power_of_centrifugal_terms_is_the_change_of_kinetic_energy_at_constant_rates(rng):
    """With the mass matrix M, its rate M' and rates v, v.(M' v)/2 = v.C v^2."""
    system = assemble(mechanism("PRBDM2R"), mechanism("PRBDM2R").values())
    J, h = np.diag(system.J), 1e-6
    for _ in range(20):
        q, v = rng.normal(size=system.n), rng.normal(size=system.n)
        M1, M2 = (inertia(system.H, J, np.exp(1j * (q + s * h * v)))[0] for s in (-1, 1))
        _, C = inertia(system.H, J, np.exp(1j * q))
        power = v @ (M2 - M1) @ v / (4 * h)
        assert v @ C @ (v * v) == pytest.approx(power, rel=1e-6, abs=1e-12)
        np.testing.assert_allclose(C, -C.T, atol=1e-18)


def test_combined_equations_equal_the_separate_functions(rng):
    """The engine evaluates inertia, jacobian and convective in one product with e."""
    from prbm.mechanics import constraints, forces
    from prbm.mechanics.system import convective, jacobian

    sim = Simulation(mechanism("PRBDM2R"), {"damping.zeta": 0.02})
    system, equations = sim.system, sim.equations
    for _ in range(10):
        q = system.q0 + 0.2 * rng.normal(size=system.n)
        v = rng.normal(size=system.n)
        e = np.exp(1j * q)
        M, C = inertia(system.H, np.diag(system.J), e)
        rows = jacobian(system.loops, e)
        w = forces.field_row(system.S, system.gravity)
        Q = forces.springs(system.K, q - system.q0) + forces.generalised(w, e)
        Q -= 8e-6 * system.K @ v + 2 * 0.02 * sim.configuration.omega * M @ v
        right = np.concatenate([Q - C @ v**2, convective(system.loops, e, v)])
        x = np.linalg.solve(constraints.saddle(M, rows, rows), right)
        a, lam, *_ = equations.evaluate(0.0, q, v)
        np.testing.assert_allclose(a, x[: system.n], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(lam, -x[system.n :], rtol=1e-9, atol=1e-12)


def test_constraint_rows_equal_central_differences_of_the_constraints(rng):
    """The convective term equals a central difference of these rows."""
    from prbm.mechanics.system import convective, jacobian, values

    system = assemble(mechanism("PRBDM2R"), mechanism("PRBDM2R").values())
    B, h = np.vstack([system.loops, system.gaps, system.slides, system.rubs]), 6e-6
    q, v = rng.normal(size=system.n), rng.normal(size=system.n)
    zero = np.zeros(len(B))

    def value(angles):
        return values(B, zero, np.exp(1j * angles))

    def rows(angles):
        return jacobian(B, np.exp(1j * angles))

    differences = np.array(
        [(value(q + d) - value(q - d)) / (2 * h) for d in h * np.eye(system.n)]
    ).T
    np.testing.assert_allclose(rows(q), differences, atol=1e-9)
    bent = (rows(q + h * v) - rows(q - h * v)) @ v / (2 * h)
    np.testing.assert_allclose(convective(B, np.exp(1j * q), v), -bent, atol=1e-9)


def pivots(G):
    """Return the pivots D of a Hermitian matrix L D L^*, L with ones on its diagonal."""
    return np.diag(np.linalg.cholesky(G)).real ** 2


def test_no_configuration_has_smaller_pivots_than_the_coupling(rng):
    """The kernel tests G = H + diag(J) once, instead of M = Re(U^* G U) at every evaluation."""
    for _ in range(300):
        n = int(rng.integers(1, 6))
        parts = rng.normal(size=(2, n + 1, n))
        A = (parts[0] + 1j * parts[1]) * 10.0 ** rng.uniform(-2, 2, n)
        G = A.conj().T @ A
        U = np.exp(1j * rng.uniform(-np.pi, np.pi, n))
        M = (U.conj()[:, None] * G * U).real
        assert np.all(pivots(M) >= pivots(G) * (1.0 - 1e-9))


@pytest.mark.parametrize("given", [mechanism("PRBDM2R"), mechanism("GuideBeam"), elastic()])
def test_no_shape_has_a_gradient_beyond_the_reach_of_the_rows(given, rng):
    """Arms that stretch have a length of exp(s); walls on bodies turn with them."""
    system = assemble(given, given.values())
    for rows in (system.loop_rows, system.gap_rows, system.slide_rows):
        for _ in range(20):
            q = system.q0 + rng.normal(size=system.n)
            q[system.strains] = -np.abs(q[system.strains])
            gradient = np.abs(rows.jacobian(system.directions(q)))
            assert np.all(gradient <= rows.reach() * (1 + 1e-12) + 1e-15)


def test_a_constraint_that_no_motion_changes_makes_the_equations_singular():
    sim = Simulation(mechanism("PRBDM"))
    loops = np.vstack([sim.system.loops, np.zeros(sim.system.d)])
    system = replace(sim.system, loops=loops, loops_c=np.append(sim.system.loops_c, 0.0))
    equations = Equations(system, sim.inputs, sim.contacts, 0.0)
    with pytest.raises(SimulationError, match="singular"):
        equations.rate(0.0, sim.state())


@pytest.mark.parametrize("slope", [1.0, 1e-4, 1e-7, 1e-11])
def test_a_row_near_a_dead_centre_counts_until_it_is_round_off(slope):
    """Two coordinates of unit mass; the row (slope, 0) gives the multiplier 1/slope^2."""
    kkt = constraints.saddle(np.eye(2), *2 * [np.array([[slope, 0.0]])])
    if slope < 1e-10:
        with pytest.raises(SimulationError, match="singular"):
            constraints.factor_saddle(kkt, 2, 1.0, np.ones(3))
        return
    factors = constraints.factor_saddle(kkt, 2, 1.0, np.ones(3))
    found = constraints.solve_saddle(factors, np.array([0.0, 3.0, 1.0]))
    assert found == pytest.approx([1.0 / slope, 3.0, -1.0 / slope**2], rel=1e-9)
