"""Every shipped mechanism does what its description says, with the books balanced."""

import math

import numpy as np
import pytest

from prbm.files.mechanism_file import shipped
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from support import Run, guided_rate, mechanism, run

LONG = ("FoldedSuspension", "PRBDM2RAxial", "PRBDM3R")
"""Those that take 5 to 20 s for the second of the default experiment."""
PRESSED = {
    "Bistable": "far_stop", "Cantilever": "stop", "FoldedSuspension": "stop",
    "PRBDM": "stop", "PRBDM2R": "stop", "PRBDM2RAxial": "stop", "PRBDM3R": "stop",
}  # fmt: skip
"""Those that come to rest on a stop."""


def stored(result: Run) -> float:
    """Return the elastic energy at release [J]."""
    return float(result.outputs[0]["energy.elastic"])


def check_books(result: Run) -> None:
    """Energy is kept to the tolerance, constraints to rounding; all numbers are finite.

    A tolerance of 1e-8 is that of a radian and of a unit stretch; the energies of the motion are
    smaller than those by up to a factor of a thousand (Bistable 1e-6, the others below 1e-7).
    """
    system = result.simulation.system
    share = 2e-6 if system.mechanism.name == "Bistable" else 2e-7
    assert result.imbalance < share * stored(result)
    assert result.loop_error < 1e-12 * system.length
    assert all(math.isfinite(x) for row in result.outputs for x in row.values())


@pytest.mark.parametrize(
    "name", [n if n not in LONG else pytest.param(n, marks=pytest.mark.slow) for n in shipped()]
)
def test_default_experiment(name: str) -> None:
    """A second of it: energy, loops, impacts, and rest where the description promises it."""
    result = run(name)
    check_books(result)
    assert len(result.simulation.record) >= 9
    if name in PRESSED:
        last, stop = result.outputs[-1], PRESSED[name]
        assert last[f"{stop}.contact"]
        assert last[f"{stop}.force"] > 0.0
        assert last["energy.kinetic"] < 5e-3 * result.outputs[0]["energy.elastic"]


@pytest.mark.parametrize("name", LONG)
def test_default_experiment_begins_well(name: str) -> None:
    """What takes long, until shortly after its first impact."""
    result = run(name, stop_time=0.14 if name == "FoldedSuspension" else 0.05)
    check_books(result)
    assert len(result.simulation.record) == 1
    assert result.column("stop.gap").min() > -1e-12


@pytest.mark.parametrize("name", ["Bistable", "Cantilever", "ImpactOscillator", "PRBDM"])
def test_energy_is_kept_better_by_a_smaller_tolerance(name: str) -> None:
    """In proportion: tolerance 1e-8 to 1e-11, the balance by a factor above 100."""
    coarse, fine = (run(name, stop_time=0.1, step=5e-3, tolerance=x) for x in (1e-8, 1e-11))
    assert fine.imbalance < 0.01 * coarse.imbalance


@pytest.mark.parametrize("name", list(shipped()))
def test_no_energy_is_gained(name: str) -> None:
    """Dissipation only grows, by impacts and by damping."""
    result = run(name, stop_time=0.045)
    dissipated = result.column("energy.dissipated")
    assert np.diff(dissipated).min() > -1e-8 * stored(result)
    assert dissipated[-1] > 0.0


def test_the_3r_guide_has_three_pivots_a_half() -> None:
    """Small deflection: two springs in parallel, each with the compliance sum (x_i - L/2)^2 / K_i.

    The model error against 12 EI/L^3 is -2.2 %.
    """
    system = assemble(mechanism("PRBDM3R"), mechanism("PRBDM3R").values({"gravity.x": 0.0}))
    v = system.values
    force = equilibrium(system, 1e-6).force
    assert len(system.links) == 10
    assert force / 1e-6 == pytest.approx(2 * guided_rate(v), rel=1e-6)  # the next order: (x/L)^2
    EI = v["flexure.youngs_modulus"] * v["flexure.width"] * v["flexure.thickness"] ** 3 / 12
    assert guided_rate(v) == pytest.approx(12 * EI / v["flexure.length"] ** 3, rel=0.022)


def test_stretch_lets_the_straight_guide_turn() -> None:
    """k_rot = EA/L W^2/2 about the middle of two struts (and bending), at W^2 of the guide.

    Without stretch the straight guide cannot turn at all: its lowest mode is the one along x, the
    next one bends the flexures alone.
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
    # 2R: of the mass of the flexures, 0.01 %, and the height of the centre of mass
    for exact in (turning, lifting):
        assert min(abs(found / exact - 1.0)) < 5e-3
    found = modes(rigid, equilibrium(rigid)).frequency
    for exact in (turning, lifting):
        assert min(abs(found / exact - 1.0)) > 0.05
