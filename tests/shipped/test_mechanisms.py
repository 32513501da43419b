"""Default experiments of all shipped mechanisms: energy balance, constraints, final rest."""

import math

import numpy as np
import pytest

from prbm.files.mechanism_file import shipped
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from support import Run, guided_rate, mechanism, run

LONG = ("CurvedBistable", "FoldedSuspension", "NotchGuide", "PRBDM2RAxial", "PRBDM3R")
"""Mechanisms whose default experiment takes 5 to 20 s of computing time."""
FIRST_IMPACT = {"CurvedBistable": 0.008, "FoldedSuspension": 0.14, "NotchGuide": 0.01}
"""Times after the first impact and before the second one [s]; 0.05 s for other mechanisms."""
PRESSED = {
    "Bistable": "far_stop", "Cantilever": "stop", "CurvedBistable": "far_stop",
    "FoldedSuspension": "stop", "GuideBeam": "stop", "NotchGuide": "stop",
    "PRBDM": "stop", "PRBDM2R": "stop", "PRBDM2RAxial": "stop", "PRBDM3R": "stop",
    "SliderCrank": "stop", "ToggleLatch": "right",
}  # fmt: skip
"""The stops on which mechanisms come to rest."""


def energy_at_release(result: Run) -> float:
    """Return the elastic and kinetic energy at release [J]."""
    return float(result.outputs[0]["energy.elastic"] + result.outputs[0]["energy.kinetic"])


def check_balance(result: Run) -> None:
    """Check that energy is conserved to the tolerance and constraints to round-off.

    The tolerance of 1e-8 is relative to a radian and to a unit stretch.  The energy of the motion
    is up to a thousand times smaller, and its relative error larger: up to 1e-6 for Bistable,
    below 3e-7 for the others.
    """
    system = result.simulation.system
    share = 2e-6 if system.mechanism.name == "Bistable" else 3e-7
    assert result.imbalance < share * energy_at_release(result)
    assert result.loop_error < 1e-12 * system.length
    assert all(math.isfinite(x) for row in result.outputs for x in row.values())


@pytest.mark.parametrize(
    "name", [n if n not in LONG else pytest.param(n, marks=pytest.mark.slow) for n in shipped()]
)
def test_default_experiment_is_balanced_and_ends_at_rest_on_its_stop(name: str) -> None:
    """Mechanisms without a final rest are checked for energy, loops and impacts only."""
    result = run(name)
    check_balance(result)
    assert len(result.simulation.record) >= 9
    if name in PRESSED:
        last, stop = result.outputs[-1], PRESSED[name]
        assert last[f"{stop}.contact"]
        assert last[f"{stop}.force"] > 0.0
        assert last["energy.kinetic"] < 5e-3 * energy_at_release(result)


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
def test_long_experiments_are_balanced_through_the_first_impact(name: str) -> None:
    """The simulation ends shortly after the first impact."""
    result = run(name, stop_time=FIRST_IMPACT.get(name, 0.05))
    check_balance(result)
    assert len(result.simulation.record) == 1
    assert result.column(f"{PRESSED[name]}.gap").min() > -1e-12


@pytest.mark.parametrize("name", ["Bistable", "Cantilever", "ImpactOscillator", "PRBDM"])
def test_the_energy_error_decreases_with_the_tolerance(name: str) -> None:
    """A tolerance of 1e-12 instead of 1e-8 reduces the error by a factor above 100."""
    coarse, fine = (run(name, stop_time=0.1, step=5e-3, tolerance=x) for x in (1e-8, 1e-12))
    assert fine.imbalance < 0.01 * coarse.imbalance


@pytest.mark.parametrize("name", list(shipped()))
def test_dissipated_energy_never_decreases(name: str) -> None:
    """Impacts and damping dissipate energy."""
    result = run(name, stop_time=0.045)
    dissipated = result.column("energy.dissipated")
    assert np.diff(dissipated).min() > -1e-8 * energy_at_release(result)
    assert dissipated[-1] > 0.0


def test_stiffness_of_the_3r_guide_is_that_of_its_pivots() -> None:
    """For small deflections each of its two flexures has the compliance sum (x_i - L/2)^2 / K_i.

    The model error against 12 EI/L^3 is -2.2 %.
    """
    system = assemble(mechanism("PRBDM3R"), mechanism("PRBDM3R").values({"gravity.x": 0.0}))
    v = system.values
    force = equilibrium(system, 1e-6).force
    assert len(system.links) == 10
    assert force / 1e-6 == pytest.approx(2 * guided_rate(v), rel=1e-6)  # Error of order (x/L)^2.
    EI = v["flexure.youngs_modulus"] * v["flexure.width"] * v["flexure.thickness"] ** 3 / 12
    assert guided_rate(v) == pytest.approx(12 * EI / v["flexure.length"] ** 3, rel=0.022)


def test_stretching_flexures_let_the_straight_guide_turn_and_lift() -> None:
    """The stiffness is EA/L W^2/2 in rotation and 2 EA/L along the flexures.

    Without stretch, the straight guide can neither turn nor lift: its lowest mode is the one along
    x, and the other modes bend the flexures alone.
    """
    v = {"gravity.x": 0.0, "flexure.density": 1.0}
    axial, rigid = (
        assemble(mechanism(name), mechanism(name).values(v)) for name in ("PRBDM2RAxial", "PRBDM2R")
    )
    EA = 181.5e9 * 1e-4 * 8e-3
    k, W, m, J = EA / 0.04, 0.08, 0.053187, 2.83664e-5
    turning = math.sqrt(k * W**2 / 2 / J) / 2 / math.pi
    lifting = math.sqrt(2 * k / m) / 2 / math.pi
    found = modes(axial, equilibrium(axial)).frequency
    # The mass of the flexures and the height of the centre of mass cause small differences.
    for exact in (turning, lifting):
        assert min(abs(found / exact - 1.0)) < 5e-3
    found = modes(rigid, equilibrium(rigid)).frequency
    for exact in (turning, lifting):
        assert min(abs(found / exact - 1.0)) > 0.05
