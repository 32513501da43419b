"""The cantilever with a tip mass, compared with an Euler-Bernoulli beam."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from support import mechanism, run

LEAF = mechanism("Cantilever")
V = LEAF.values()
L, M, J, C = V["leaf.length"], V["tip.mass"], V["tip.inertia"], V["tip.length"] / 2
EI = V["steel.youngs_modulus"] * V["leaf.width"] * V["leaf.thickness"] ** 3 / 12
MASS_PER_LENGTH = V["steel.density"] * V["leaf.width"] * V["leaf.thickness"]  # [kg/m]
STRAIGHT = {"gravity.y": 0.0}


def residual(omega: float) -> float:
    """Return the determinant of the conditions at the tip for w = a (cos - cosh) + b (sin - sinh).

    The conditions are EI w''' = -omega^2 M w_c and EI w'' = omega^2 (J w' + C M w_c), with
    w_c = w + C w' at the centre of mass of the body.
    """
    k = (MASS_PER_LENGTH * omega**2 / EI) ** 0.25
    c, s, ch, sh = math.cos(k * L), math.sin(k * L), math.cosh(k * L), math.sinh(k * L)
    w, w1 = np.array([c - ch, s - sh]), k * np.array([-s - sh, c - ch])
    w2, w3 = k**2 * np.array([-c - ch, -s - sh]), k**3 * np.array([s - sh, -c - ch])
    centre = w + C * w1
    force = EI * w3 + omega**2 * M * centre
    moment = EI * w2 - omega**2 * (J * w1 + C * M * centre)
    return float(force[0] * moment[1] - force[1] * moment[0])


def exact_frequencies() -> list[float]:
    """Return the first three frequencies of the beam [Hz]."""
    grid = np.linspace(10.0, 3000.0, 600)
    signs = np.sign([residual(x) for x in grid])
    turns = np.flatnonzero(signs[1:] != signs[:-1])
    return [brentq(residual, grid[i], grid[i + 1], rtol=1e-13) / (2 * math.pi) for i in turns]


def frequencies(model: str, n: int = 0) -> np.ndarray:
    kind = replace(LEAF.flexure_types[0], model=model, n=n)
    changed = replace(LEAF, flexure_types=(kind,))
    system = assemble(changed, changed.values(STRAIGHT))
    return modes(system, equilibrium(system)).frequency


def test_fundamental_frequency_is_that_of_a_beam_with_a_tip_mass() -> None:
    """The model error of the 3R is -0.8 %."""
    assert frequencies("3R")[0] == pytest.approx(exact_frequencies()[0], rel=0.01)


def test_frequencies_of_a_chain_converge_to_the_beam() -> None:
    """Three frequencies converge with second order in 1/n, n = 10, 20, 40, 80."""
    exact = np.array(exact_frequencies()[:3])
    counts = np.array([10, 20, 40, 80])
    errors = np.array([np.abs(frequencies("nR", n)[:3] / exact - 1.0) for n in counts])
    slopes = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    np.testing.assert_allclose(slopes, -2.0, atol=0.1)
    assert errors[-1].max() < 1e-3


def test_the_last_link_belongs_to_the_tip() -> None:
    """The three links, the last of them fixed to the tip, have three coordinates and no loop."""
    system = assemble(LEAF, V)
    assert (system.n, len(system.loops)) == (3, 0)


def test_static_deflection_is_that_of_a_beam() -> None:
    """The loads are M g at L + C and the weight of the leaf, at a hundredth of gravity.

    The 3R model is 2.2 % too soft.
    """
    g = 9.81e-2
    system = assemble(LEAF, LEAF.values({"gravity.y": -g}))
    E = system.directions(equilibrium(system).q)
    frame = system.bodies["tip"]
    sag = -complex(frame.A @ E + frame.c - frame.drawn).imag
    tip = M * g * (L**3 / 3 + L**2 * C + L * C**2) / EI
    own = MASS_PER_LENGTH * g * (L**4 / 8 + C * L**3 / 6) / EI
    assert sag == pytest.approx(tip + own, rel=0.025)


@pytest.mark.slow
def test_force_at_rest_on_the_stop_is_weight_less_bending_force() -> None:
    """With the force P of the stop, the sag under M g - P and the weight of the beam is 3 mm.

    The slope of the tip, 4 degrees, which shifts the contact point, and the softer 3R model cause
    a difference of 1.3 %.
    """
    result = run(LEAF, stop_time=1.0, step=2e-3)
    last = result.outputs[-1]
    assert last["stop.contact"]
    assert last["stop.gap"] == pytest.approx(0.0, abs=1e-12)
    assert last["stop.impact_count"] > 5
    assert last["energy.kinetic"] < 1e-9
    compliance = (L**3 / 3 + L**2 * C + L * C**2) / EI
    own = MASS_PER_LENGTH * 9.81 * (L**4 / 8 + C * L**3 / 6) / EI
    pressed = M * 9.81 - (3e-3 - own) / compliance
    assert last["stop.force"] == pytest.approx(pressed, rel=0.02)
    assert result.imbalance < 2e-8 * result.outputs[0]["energy.elastic"]


@pytest.mark.slow
def test_impacts_at_the_foot_obey_newtons_law_and_turn_the_tip() -> None:
    """The foot is below the centre of mass."""
    result = run(LEAF, stop_time=0.2)
    system = result.simulation.system
    for impact in result.simulation.record:
        latched = impact.latched
        assert latched.rebound_speed == pytest.approx(0.6 * latched.approach_speed, rel=1e-9)
        turned = (impact.after - impact.before)[system.bodies["tip"].j]
        assert abs(turned) > 1e-2  # [rad/s]
        energy = [0.5 * v @ _mass(system, impact.q) @ v for v in (impact.before, impact.after)]
        assert energy[0] - energy[1] == pytest.approx(latched.energy_lost, rel=1e-8)


def _mass(system, q) -> np.ndarray:
    T = 1j * system.A * system.directions(q)
    return (T.conj().T @ (system.m[:, None] * T)).real + np.diag(system.J)
