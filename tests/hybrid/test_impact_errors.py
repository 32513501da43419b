"""Errors of closing speeds and of the energy that accumulate over steps and impacts."""

from dataclasses import replace

import numpy as np
import pytest

from prbm.files.mechanism_file import read_mechanism
from prbm.kernel.simulation import KernelSimulation
from prbm.runs.run import simulate
from support import SUPPORT, mechanism

PIVOT = read_mechanism(SUPPORT / "pivot.toml")
TOLERANCE = 1e-8  # The default.
END = 0.1


def pivot(model, direction, position):
    """Return the cross-spring pivot on stretching flexures, with its stop elsewhere."""
    kinds = tuple(replace(k, model=model, coefficients={}, axial=True) for k in PIVOT.flexure_types)
    stop = replace(PIVOT.stops[0], direction=direction, position=position)
    return replace(PIVOT, flexure_types=kinds, stops=(stop,))


def hits(model, tolerance, start=1.0):
    """Return times [s] and closing speeds [m/s] of the first impacts; start: share of the angle."""
    given = {"solver.tolerance": tolerance, "release.angle": start * model.release.angle}
    found = simulate(model, given, stop_time=END, step=END / 100, engine="kernel").impacts[:2]
    return np.array([[one.time, one.latched.approach_speed] for one in found])


@pytest.mark.parametrize(
    ("model", "direction", "position"),
    [
        ("2R", 90.0, 0.0),
        ("2R", 0.0, -3e-5),
        pytest.param("beam", 0.0, -3e-6, marks=pytest.mark.slow),
    ],
)
def test_errors_of_closing_speeds_are_those_of_the_steps_that_the_motion_amplifies(
    model, direction, position
):
    """The error is at most the tolerance, times the largest speed, for each step.

    After the first impact it grows like a change of the start, whose effect is found with a change
    by 1e-7.  The factor 2 is for the smaller errors of the references.
    """
    chosen = pivot(model, direction, position)
    exact, found = hits(chosen, 1e-12), hits(chosen, TOLERANCE)
    assert len(exact) == len(found) == 2
    moved = hits(chosen, 1e-12, 1.0 + 1e-7)
    free = simulate(replace(chosen, stops=()), stop_time=END, step=END / 1000)
    largest = float(np.abs(free["wheel.omega"]).max()) * 0.02 * 2**0.5  # [m/s], of the rim
    for k in range(2):
        simulation = KernelSimulation(chosen, {"solver.tolerance": TOLERANCE})
        simulation.advance(exact[k, 0])
        error = abs(found[k, 1] - exact[k, 1]) / largest
        amplified = max(1.0, abs(moved[k, 1] - exact[k, 1]) / largest / 1e-7)
        assert error < 2 * TOLERANCE * simulation.step_count * amplified


@pytest.mark.parametrize("tolerance", [1e-8, 1e-10])
def test_elastic_impacts_change_the_energy_by_at_most_twice_the_tolerance_each(
    tolerance,
):
    given = {"stop.restitution": 1.0, "damping.zeta": 0.0, "damping.beta": 0.0}
    simulation = KernelSimulation(mechanism("PRBDM"), given | {"solver.tolerance": tolerance})

    def energies():
        out = simulation.outputs()
        parts = ("kinetic", "elastic", "gravitational", "dissipated")
        total = sum(out[f"energy.{name}"] for name in parts) - out["energy.work"]
        return total, out["energy.kinetic"] + out["energy.elastic"]

    start, moving = energies()
    while simulation.outputs()["stop.impact_count"] < 1000:
        simulation.advance(simulation.time + 5.0)
    count = simulation.outputs()["stop.impact_count"]
    assert abs(energies()[0] - start) < 2 * tolerance * count * moving
