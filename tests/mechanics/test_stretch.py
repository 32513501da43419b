"""Links that stretch and walls on bodies: Lagrange equations by SymPy, and reported velocities."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sympy as sp

from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_state import ContactState
from prbm.mechanics.dynamics import Equations
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Release, Stop
from support import mechanism

EA, EI, ROD = 400.0, 2e-3, 3e-3  # Stiffnesses [N], [N m^2] and mass [kg] of a rubber cord.
SPAN = 0.1  # Length of the cord [m].


def type_of(name, axial):
    """Return a section with EA, EI and the mass of a cord."""
    h = np.sqrt(12 * EI / EA)
    modulus, density = EA / (0.01 * h), ROD / (0.01 * h * SPAN)
    return FlexureType(name, "nR", h, 0.01, modulus, density, n=1, axial=axial)


def pendulums():
    """Return two pendulums: A stretches and has a wall on its body, which the body of B hits.

    ::

        wall|<- B          A: |wall, turns with A
          x |   |          |
        ====o===o==========o====
    """
    return Mechanism(
        name="Pendulums",
        title="A stretching pendulum with a wall, a rigid one that hits it",
        ground={"a": (0.0, 0.0), "b": (0.05, 0.02)},
        bodies=(
            Body("A", 0.05, 4e-5, (0.01, -SPAN - 0.01), {"top": (0.0, -SPAN)}),
            Body("B", 0.03, 3e-5, (0.06, -0.09), {"top": (0.05, 0.02 - SPAN)}),
        ),
        flexure_types=(type_of("cord", True), type_of("bar", False)),
        flexures=(
            Flexure("f1", "cord", "ground.a", "A.top", ("clamp", "pin")),
            Flexure("f2", "bar", "ground.b", "B.top", ("clamp", "pin")),
        ),
        stops=(Stop("stop", "B", (0.04, -0.1), direction=200.0, position=0.03, on="A"),),
        forces=(Force("force", "A", (0.02, -0.12)),),
        release=Release("A"),
        gravity=(0.7, -9.81),
    )


@cache
def lagrange():
    """Return a function of (q, v): M, the right side, the gap, its gradient and quadratic term.

    q = (angle and stretch of the cord, angle of A, angle of the bar, angle of B).
    """
    q, v = sp.symbols("q0:5"), sp.symbols("v0:5")

    def turned(angle, x, y):
        c, s = sp.cos(angle), sp.sin(angle)
        return sp.Matrix([c * x - s * y, s * x + c * y])

    def rate(z):
        return z.jacobian(q) * sp.Matrix(v)

    end_a = turned(q[0], SPAN * sp.exp(q[1]), 0)
    end_b = sp.Matrix([0.05, 0.02]) + turned(q[3], SPAN, 0)
    centre_a = end_a + turned(q[2], 0.01, -0.01)
    centre_b = end_b + turned(q[4], 0.01, -0.01)
    g = sp.Matrix([0.7, -9.81])
    # T = m z'^2 / 6 for a rod from a fixed point to z, also while it stretches.
    T = sum(ROD * rate(z).dot(rate(z)) / 6 for z in (end_a, turned(q[3], SPAN, 0)))
    T += 0.05 * rate(centre_a).dot(rate(centre_a)) / 2 + 4e-5 * v[2] ** 2 / 2
    T += 0.03 * rate(centre_b).dot(rate(centre_b)) / 2 + 3e-5 * v[4] ** 2 / 2
    V = sum(EI / SPAN * (angle + sp.pi / 2) ** 2 for angle in (q[0], q[3]))  # Clamp: 2 EI/L.
    V += EA / SPAN * (SPAN * q[1]) ** 2 / 2
    V -= 0.05 * g.dot(centre_a) + 0.03 * g.dot(centre_b) + ROD * g.dot(end_a + end_b) / 2
    force, moment = sp.Matrix([0.4, -0.3]), 0.01
    V -= force.dot(end_a + turned(q[2], 0.02, -0.02)) + moment * q[2]
    # The gap in the frame of body A.
    u = turned(sp.rad(200), 1, 0)
    hit = end_b + turned(q[4], -0.01, -0.02)
    seen = turned(-q[2], *(hit - end_a))
    drawn = sp.Matrix([0.04, -0.1]) - sp.Matrix([0, -SPAN])
    gap = 0.03 - u.dot(seen - drawn)

    M = sp.hessian(T, v)
    right = sp.Matrix([T - V]).jacobian(q).T - sp.Matrix([T]).jacobian(v).jacobian(q) * sp.Matrix(v)
    gradient = sp.Matrix([gap]).jacobian(q)
    quadratic = (gradient * sp.Matrix(v)).jacobian(q) * sp.Matrix(v)
    return sp.lambdify([q, v], [M, right, gap, gradient, quadratic], cse=True)


def state(sim, seed):
    """Return random coordinates about the straight shape, and rates."""
    rng = np.random.default_rng(seed)
    return sim.system.q0 + 0.4 * rng.normal(size=5), 8 * rng.normal(size=5)


@pytest.mark.parametrize("holds", [False, True])
def test_a_stretching_pendulum_with_a_wall_satisfies_lagrange_equations(holds):
    """Accelerations are compared and, for a closed stop, its force: the multiplier of the gap."""
    values = {"force.x": 0.4, "force.y": -0.3, "force.moment": 0.01}
    sim = Simulation(pendulums(), values)
    # Order from the ground: cord, its stretch, body A; bar, body B.
    assert sim.system.arm.tolist() == [0, 0, 2, 3, 4]
    contacts = ContactState.free(1, 0).holding([0] * holds)
    equations = Equations(sim.system, sim.inputs, contacts, sim.configuration.omega)
    for seed in range(20):
        q, v = state(sim, seed)
        M, right, gap, gradient, quadratic = (np.array(x, float) for x in lagrange()(q, v))
        found = equations.evaluate(0.0, q, v)
        a, lam = found.a, found.lam
        np.testing.assert_allclose(found.M, M, rtol=1e-12, atol=1e-18)
        e = sim.system.directions(q)
        assert equations.gaps(0.0, e)[0] == pytest.approx(float(gap), abs=1e-15)
        assert equations.gap_rates(0.0, e, v)[0] == pytest.approx(
            float((gradient @ v)[0]), abs=1e-13
        )
        rows = gradient if holds else np.zeros((0, 5))
        kkt = np.block([[M, -rows.T], [rows, np.zeros((len(rows),) * 2)]])
        x = np.linalg.solve(kkt, [*right.ravel(), *-quadratic.ravel()[: len(rows)]])
        np.testing.assert_allclose(a, x[:5], rtol=1e-9, atol=1e-8)
        np.testing.assert_allclose(lam, x[5:], rtol=1e-9)


def test_reported_velocities_equal_central_differences_of_the_reported_positions():
    """The outputs are displacement, angle and gap of bodies on links that stretch."""
    sim = Simulation(pendulums(), {"release.velocity": 0.8}, tolerance=1e-12)
    h = 1e-6
    for t in (0.002, 0.005, 0.011):
        out = []
        for time in (t - h, t, t + h):
            sim.advance(time)
            out.append(sim.outputs())
        pairs = {"A.x": "A.vx", "A.y": "A.vy", "A.angle": "A.omega", "B.x": "B.vx", "B.y": "B.vy",
                 "stop.gap": "stop.gap_rate"}  # fmt: skip
        for place, rate in pairs.items():
            difference = (out[2][place] - out[0][place]) / (2 * h)
            assert out[1][rate] == pytest.approx(difference, abs=1e-7), place


@pytest.mark.slow
def test_velocities_of_a_guide_equal_central_differences_of_its_displacements():
    """Differences over 2 us; their truncation is h^2 x'''/6 < 1e-5 m/s at modes of 12 kHz."""
    guide = mechanism("PRBDM2R")
    kinds = tuple(replace(kind, axial=True) for kind in guide.flexure_types)
    guide = replace(guide, flexure_types=kinds)
    # An impact at an offset stretches the flexures.
    sim = Simulation(guide, {"stop.offset": 4e-3, "stop.position": -5e-3})
    h = 1e-6
    for t in (0.012, 0.02):
        sim.advance(t - h)
        before = sim.outputs()
        sim.advance(t)
        now = sim.outputs()
        sim.advance(t + h)
        after = sim.outputs()
        for axis in "xy":
            rate = (after[f"shuttle.{axis}"] - before[f"shuttle.{axis}"]) / (2 * h)
            assert now[f"shuttle.v{axis}"] == pytest.approx(rate, abs=5e-6)
