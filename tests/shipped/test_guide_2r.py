"""The 2R guide: reference values, conservation, the default experiment, sensitivity."""

import numpy as np
import pytest

from prbm.hybrid import impacts
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modal_restitution, modes
from prbm.mechanics.statics import equilibrium
from support import energy_balance, mechanism, simulation

GUIDE = mechanism("PRBDM2R")


def test_rest_position_and_modes_at_rest_equal_their_reference_values():
    """The values of the 2R steel structure have four digits."""
    system = assemble(GUIDE, GUIDE.values())
    rest = equilibrium(system)
    frame = system.bodies["shuttle"]
    x = (frame.A @ np.exp(1j * rest.q) + frame.c - frame.drawn).real
    assert x == pytest.approx(10.78e-3, abs=5e-6)
    np.testing.assert_allclose(
        modes(system, rest).frequency, [4.889, 115.9, 182.9, 370.7, 396.3], atol=0.05, rtol=0
    )
    assert modes(system, rest).frequency[0] == pytest.approx(4.889, abs=5e-4)


@pytest.mark.parametrize(("model", "f1"), [("PRBDM", 4.726), ("PRBDM2R", 4.624)])
def test_frequency_of_the_straight_guide_without_gravity_equals_its_reference_value(model, f1):
    guide = mechanism(model)
    system = assemble(guide, guide.values({"gravity.x": 0.0}))
    assert modes(system, equilibrium(system)).frequency[0] == pytest.approx(f1, abs=1e-3)


@pytest.mark.slow
def test_energy_of_a_conservative_second_drifts_less_than_1e_8():
    """The drift is relative to the largest kinetic energy; no damping, no wall within reach."""
    values = {"damping.beta": 0.0, "stop.position": 0.05}
    sim = simulation("PRBDM2R", values, tolerance=1e-10)
    balance, kinetic = [energy_balance(sim.outputs())], []
    for t in np.linspace(0, 1, 201)[1:]:
        sim.advance(t)
        out = sim.outputs()
        balance.append(energy_balance(out))
        kinetic.append(out["energy.kinetic"])
    assert np.ptp(balance) < 1e-8 * max(kinetic)


def run(values=None, **options):
    sim = simulation("PRBDM2R", values, **options)
    rows = []
    for t in np.arange(1, 1001) * 1e-3:
        sim.advance(t)
        rows.append(sim.outputs())
    return sim, rows


@pytest.fixture(scope="module")
def default_run():
    return run()


@pytest.mark.slow
def test_default_experiment_has_about_14_impacts_and_ends_at_rest(default_run):
    sim, rows = default_run
    assert 12 <= len(sim.record) <= 16
    contact = np.array([row["stop.contact"] for row in rows])
    first = int(np.argmax(contact))
    assert rows[first]["stop.contact"]
    assert contact[first:].all()
    assert (first + 1) * 1e-3 == pytest.approx(0.240, abs=1.5e-3)
    assert sim.record[-1].time == pytest.approx(0.240, abs=1e-3)
    force = np.array([row["stop.force"] for row in rows[first:]])
    assert (force > 0).all()
    assert np.ptp(force[-100:]) < 1e-4 * force[-1], "the force becomes steady"


def test_energy_balance_of_the_default_experiment_includes_the_impacts(default_run):
    _, rows = default_run
    balance = [energy_balance(row) for row in rows]
    assert np.ptp(balance) < 1e-6 * rows[-1]["energy.dissipated"]


def test_the_gap_is_never_negative(default_run):
    _, rows = default_run
    assert min(row["stop.gap"] for row in rows) > -1e-9


@pytest.mark.slow
def test_loops_stay_closed():
    """The loop errors are below 1e-12 m and 1e-9 m/s at every output."""
    sim = Simulation(GUIDE)
    n, system = sim.system.n, sim.system
    for t in np.linspace(0, 0.4, 333)[1:]:
        sim.advance(t)
        y = sim.state()
        e, v = np.exp(1j * y[:n]), y[n : 2 * n]
        assert np.abs((system.loops @ e).real + system.loops_c).max() < 1e-12
        assert np.abs((system.loops @ (e * v)).imag).max() < 1e-9


@pytest.mark.slow
def test_a_change_of_1e_11_m_shifts_the_impacts_by_less_than_a_nanosecond(default_run):
    """Without the default damping, the motion would be chaotic."""
    sim, _ = default_run
    other, _ = run({"release.displacement": -0.018 + 1e-11})
    assert len(other.record) == len(sim.record)
    shifts = [abs(a.time - b.time) for a, b in zip(sim.record, other.record, strict=True)]
    assert max(shifts) < 1e-9


def test_each_impact_satisfies_the_momentum_balance_and_the_law_of_its_energy_loss(default_run):
    """M (v+ - v-) = G^T P + Phi_q^T L with the impulses P of the stop and L of the loops.

    The energy loss is -P (u- + u+)/2, and the gap rates are related by u+ = -eps u-.
    """
    sim, _ = default_run
    system = sim.system
    for impact in sim.record:
        e = np.exp(1j * impact.q)
        M = (e.conj()[:, None] * system.H * e).real + np.diag(system.J)
        G = -(system.gaps[0] * e).imag
        Phi_q = -(system.loops * e).imag
        jump = M @ (impact.after - impact.before) - G * impact.impulse
        lam = np.linalg.lstsq(Phi_q.T, jump, rcond=None)[0]
        assert np.abs(jump - Phi_q.T @ lam).max() < 1e-12 * np.abs(M @ impact.before).max()
        assert np.abs(Phi_q @ impact.after).max() < 1e-12
        closing, opening = float(G @ impact.before), float(G @ impact.after)
        assert opening == pytest.approx(-0.6 * closing, rel=1e-9)
        T = [0.5 * v @ M @ v for v in (impact.before, impact.after)]
        loss = -impact.impulse * (closing + opening) / 2
        assert impact.latched.energy_lost == pytest.approx(loss, rel=1e-8)
        assert T[0] - T[1] == pytest.approx(loss, rel=1e-6)


FE = {  # By offset of the hit point [mm]; columns: wall at -10, 0, 10 mm.
    -4: (0.4089, 0.5483, 0.4084),
    0: (0.4519, 0.5947, 0.4519),
    4: (0.4104, 0.5482, 0.4108),
}


def algebraic(model, offset, wall):
    guide = mechanism(model)
    system = assemble(guide, guide.values({"gravity.x": 0.0, "stop.offset": offset}))
    return modal_restitution(system, equilibrium(system, wall), 0, 0.6)


@pytest.mark.parametrize("offset", FE)
@pytest.mark.parametrize("column", range(3))
def test_modal_restitution_agrees_with_finite_elements_within_the_model_error(offset, column):
    """The model error is 0.048: the shuttle of the straight inextensible 2R cannot rotate."""
    found = algebraic("PRBDM2R", offset * 1e-3, (-10e-3, 0.0, 10e-3)[column])
    assert found == pytest.approx(FE[offset][column], abs=0.05)


@pytest.mark.parametrize("wall", [-0.01, 0.0, 0.005])
def test_modal_restitution_of_one_degree_of_freedom_is_the_restitution(wall):
    """There is no other mode that could take up energy."""
    assert algebraic("PRBDM", 0.003, wall) == pytest.approx(0.6, abs=1e-12)


def test_a_simulated_pure_mode_has_the_algebraic_modal_restitution():
    """The impact is at the static shape, in the fundamental mode."""
    values = {
        "gravity.x": 0.0, "release.displacement": -0.01, "stop.position": -0.01,
        "stop.offset": 0.002, "damping.beta": 0.0,
    }  # fmt: skip
    system = assemble(GUIDE, GUIDE.values(values))
    shape = equilibrium(system, -0.01)
    phi = modes(system, shape).shape[:, 0]
    expected = modal_restitution(system, shape, 0, 0.6)
    sim = simulation("PRBDM2R", values)
    G = -(system.gaps[0] * np.exp(1j * shape.q)).imag
    sim.front.v[:] = -0.1 * phi / (G @ phi)
    _, (hit,) = impacts.impact(sim.configuration, sim.front, 0)
    assert hit.latched.modal_restitution == pytest.approx(expected, abs=1e-9)
