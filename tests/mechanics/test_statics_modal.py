"""Static shapes and small vibrations, compared with beam theory, minimisation, differences."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from kernel_simulation import KernelSimulation
from many_parts import cantilever
from prbm.base.errors import EquilibriumError
from prbm.base.tolerances import STATICS_LOAD_STEP_MIN, STATICS_LOAD_STEPS_MAX
from prbm.files.mechanism_file import load
from prbm.mechanics import statics
from prbm.mechanics.assembly import assemble
from prbm.mechanics.forces import elastic_energy, gravitational_energy
from prbm.mechanics.modal import modes
from prbm.mechanics.positions import release_velocity
from prbm.mechanics.statics import equilibrium
from prbm.mechanics.system import jacobian, values
from prbm.mechanism.flexure import MODELS
from support import ROOT, mechanism


def tip_deflection(model, force):
    """Return the deflection of a cantilever under a tip force, in units of F h^3/EI."""
    L, EI = 0.05, 2e11 * 1e-2 * (2e-4) ** 3 / 12
    beam = cantilever(model)
    values = beam.values({"gravity.x": 0.0, "tip.mass": 1.0, "leaf.density": 1.0})
    # The force is the weight of the body, which hangs on the pin and transmits no moment.
    values |= {"gravity.y": force}
    system = assemble(beam, values)
    shape = equilibrium(system)
    e = np.exp(1j * shape.q)
    frame = system.bodies["tip"]
    lever = complex(0.01, 0.004)
    pin = complex(frame.A @ e) + frame.c - lever * e[frame.arm]
    return pin.imag / (force * L**3 / EI)


@pytest.mark.parametrize(("model", "error"), [("1R", 0.037), ("2R", 0.0071), ("3R", 0.022)])
def test_tip_deflection_of_a_cantilever_follows_from_its_published_coefficients(model, error):
    """The deflection is the sum of lever^2/K over the pivots, near the 1/3 of beam theory."""
    data = MODELS[model]
    gamma, K_theta = ([c.value for c in part] for part in (data.gamma, data.K_theta))
    levers = np.cumsum(gamma[::-1])[::-1]
    rates = [K * (g if data.rate_with_gamma else 1.0) for g, K in zip(gamma, K_theta, strict=True)]
    closed = sum(levers**2 / rates)
    assert tip_deflection(model, 1e-4) == pytest.approx(closed, rel=1e-4)
    assert closed == pytest.approx(1 / 3, rel=error)


def test_held_shape_is_the_minimum_of_potential_energy():
    """SLSQP minimises elastic + gravitational energy under the constraints."""
    guide = mechanism("PRBDM2R")
    system = assemble(guide, guide.values())
    shape = equilibrium(system, -0.012)
    B = np.vstack([system.loops, system.release])
    c = np.append(system.loops_c, system.release_c + 0.012)
    found = minimize(
        lambda q: 1e3 * (
            elastic_energy(system.K, q - system.q0) + gravitational_energy(system, np.exp(1j * q))
        ),
        shape.q + 1e-3,
        constraints={"type": "eq", "fun": lambda q: 1e2 * values(B, c, np.exp(1j * q))},
        method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 500},
    )  # fmt: skip
    np.testing.assert_allclose(found.x, shape.q, atol=2e-5)


def test_holding_force_is_the_derivative_of_the_energy():
    """The force dV/dx is computed by a central difference of the energy V over held shapes."""
    guide = mechanism("PRBDM2R")
    system = assemble(guide, guide.values())

    def energy(x):
        q = equilibrium(system, x).q
        return elastic_energy(system.K, q - system.q0) + gravitational_energy(
            system, np.exp(1j * q)
        )

    h = 1e-5
    slope = (energy(-0.01 + h) - energy(-0.01 - h)) / (2 * h)
    assert equilibrium(system, -0.01).force == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_holding_force_is_zero_at_the_free_equilibrium(model):
    guide = mechanism(model)
    system = assemble(guide, guide.values())
    free = equilibrium(system)
    x = float((system.release @ np.exp(1j * free.q)).real) + system.release_c
    held = equilibrium(system, x)
    np.testing.assert_allclose(held.q, free.q, atol=1e-9)
    assert abs(held.force) < 1e-9


def test_modes_are_orthonormal_in_the_mass_matrix_and_satisfy_the_loop_constraints():
    guide = mechanism("PRBDM2R")
    system = assemble(guide, guide.values())
    rest = equilibrium(system)
    found = modes(system, rest)
    rows = jacobian(system.loops, np.exp(1j * rest.q))
    np.testing.assert_allclose(found.shape.T @ found.M @ found.shape, np.eye(5), atol=1e-10)
    assert np.abs(rows @ found.shape).max() < 1e-9


def test_frequencies_equal_those_of_the_linearised_equations_of_motion():
    """The equations are linearised by central differences of the accelerations along each mode."""
    from prbm.hybrid.simulation import Simulation

    guide = mechanism("PRBDM2R")
    sim = Simulation(guide, {"damping.beta": 0.0})
    system = sim.system
    rest = equilibrium(system)
    found = modes(system, rest)
    for phi, f in zip(found.shape.T, found.frequency, strict=True):
        h = 1e-6 / np.abs(phi).max()
        states = [sim.equations.project(0.0, np.concatenate([rest.q + s * h * phi, np.zeros(9)]))
                  for s in (-1, 1)]  # fmt: skip
        a = [sim.equations.evaluate(sim.time, y[:7], np.zeros(7)).a for y in states]
        stiffness = -phi @ found.M @ (a[1] - a[0]) / (2 * h)
        assert math.sqrt(stiffness) / (2 * math.pi) == pytest.approx(f, rel=1e-5)


def test_frequency_of_an_unstable_equilibrium_is_negative():
    """A weight beyond the buckling load gives omega^2 < 0, marked by a negative frequency."""
    guide = mechanism("PRBDM2R")
    system = assemble(guide, guide.values({"gravity.x": 0.0, "gravity.y": -200.0}))
    assert modes(system, equilibrium(system)).frequency[0] < 0


def test_release_velocity_is_that_after_an_impulse_along_the_release():
    """M v = release_q^T P + Phi_q^T Lambda: v has the least kinetic energy for its speed."""
    guide = mechanism("PRBDM2R")
    system = assemble(guide, guide.values())
    q = equilibrium(system, -0.012).q
    v = release_velocity(system, q, 0.7)
    e = np.exp(1j * q)
    rows = jacobian(np.vstack([system.loops, system.release]), e)
    M = (e.conj()[:, None] * system.H * e).real + np.diag(system.J)
    assert rows @ v == pytest.approx([0.0, 0.0, 0.7], abs=1e-12)
    lam = np.linalg.lstsq(rows.T, M @ v, rcond=None)[0]
    np.testing.assert_allclose(rows.T @ lam, M @ v, atol=1e-14)


BUCKLED = load(ROOT / "tests" / "cases" / "buckle.toml")


@pytest.mark.parametrize("share", [1.0, 0.1, 1e-2, 1e-3])
def test_slow_loading_beyond_buckling_bends_to_the_side_of_a_small_load(share):
    """The frame buckles under 0.85 of its weight, to the side of a small gravity across it.

    Its other shapes on that side of buckling are unstable.
    """
    across = share * BUCKLED.values()["gravity.x"]
    rests = []
    for gx in (across, -across):
        system = assemble(BUCKLED, BUCKLED.values({"gravity.x": gx}))
        shape = equilibrium(system)
        assert modes(system, shape).frequency[0] > 0.5
        rests.append(system.amount(shape.q))
    assert rests[0] > 0.02
    assert rests[1] == pytest.approx(-rests[0], rel=1e-7)


def test_a_symmetric_column_stays_straight_beyond_buckling_and_is_unstable():
    system = assemble(BUCKLED, BUCKLED.values({"gravity.x": 0.0}))
    shape = equilibrium(system)
    assert abs(system.amount(shape.q)) < 1e-9
    assert modes(system, shape).frequency[0] < 0.0


@pytest.mark.parametrize("name", ["ligo_3R", "ligo_beam"])
def test_a_mass_hangs_at_rest_on_fibres_whose_stiffness_is_small_beside_its_weight(name):
    """Round-off of the weight is more than 1e-12 of the springs.

    The frequency of a model with few coordinates is above that of the continuous fibre, 0.64458 Hz.
    """
    hanging = load(ROOT / "tests" / "cases" / f"{name}.toml")
    system = assemble(hanging, hanging.values())
    shape = equilibrium(system)
    assert np.abs(shape.q - system.q0).max() < 1e-9
    frequency = modes(system, shape).frequency[0]
    assert 0.64458 < frequency < 0.69
    kernel = KernelSimulation(hanging)
    assert kernel.get("mode.frequency") == pytest.approx(frequency, rel=1e-9)


def test_a_displacement_out_of_reach_is_rejected():
    guide = mechanism("PRBDM")
    system = assemble(guide, guide.values())
    with pytest.raises(EquilibriumError, match="beyond"):
        equilibrium(system, 0.2)


def test_slow_loading_ends_at_the_largest_load_that_can_be_carried(monkeypatch):
    """It ends within the smallest step of it, whatever the rounding of the sums of steps.

    A sum of steps is rounded where it passes a power of two.
    """
    system = assemble(mechanism("PRBDM"), mechanism("PRBDM").values())
    rng = np.random.default_rng(0)
    near = 0.5 ** rng.integers(1, 6, 2000) + STATICS_LOAD_STEP_MIN * rng.uniform(-1, 1, 2000)
    for limit in (1.0, *near, *rng.uniform(size=200)):
        tried, slope = [], rng.uniform(0.6, 3.0)

        def carried(system, given, start, limit=limit, slope=slope, tried=tried):
            share = given.share
            tried.append(share)
            assert len(tried) <= 4.0 / STATICS_LOAD_STEP_MIN, "the loading does not end"
            return np.full(system.n, slope * share) if share <= limit else None

        monkeypatch.setattr(statics, "_newton", carried)
        start = np.zeros(system.n)
        _, done = statics._follow(
            system, lambda share: statics._Given(None, None, None, share), start
        )
        assert limit - 1.001 * STATICS_LOAD_STEP_MIN <= done <= limit
        assert done < 1.0 or limit == 1.0
        assert max(tried) <= 1.0


def test_slow_loading_that_succeeds_in_the_smallest_steps_only_is_given_up(monkeypatch):
    system = assemble(mechanism("PRBDM"), mechanism("PRBDM").values())
    tried = []

    def creeping(system, given, start):
        tried.append(given.share)
        small = given.share - start[0] <= 1.5 * STATICS_LOAD_STEP_MIN
        return np.full(system.n, given.share) if small else None

    monkeypatch.setattr(statics, "_newton", creeping)
    _, done = statics._follow(
        system, lambda share: statics._Given(None, None, None, share), np.zeros(system.n)
    )
    assert len(tried) == STATICS_LOAD_STEPS_MAX
    assert 0.0 < done < 0.2
