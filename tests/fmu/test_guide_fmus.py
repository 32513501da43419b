"""FMUs of mechanisms with guides: interface, co-simulation, model exchange."""

from dataclasses import replace

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from guides import cart
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.parts import Stop
from support import own_fmu

END, STEP = 0.2, 2e-3
STARTS = {"left.stiffness": 350.0, "tray.mass": 0.25}
OUTPUTS = (
    "cart.x", "tray.x", "tray.y", "rail.force", "rail.moment", "ramp.force", "ramp.moment",
    "base.force.y", "energy.kinetic", "wall.impact_count",
)  # fmt: skip


def walled():
    """Return the cart with a wall for its tray."""
    stop = Stop("wall", "tray", (0.0, 0.06), 180.0, 0.03, restitution=0.6)
    return replace(cart(), stops=(stop,))


@pytest.fixture(
    scope="module",
    params=["fmi3", *(pytest.param(x, marks=pytest.mark.slow) for x in ("fmi2", "python"))],
)
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("guides") / "Cart.fmu"
    path.write_bytes(own_fmu(request.param, walled()))
    return path


@pytest.fixture(scope="module")
def expected():
    simulation, rows = Simulation(walled(), STARTS), []
    for k in range(round(END / STEP) + 1):
        simulation.advance(k * STEP)
        rows.append(simulation.outputs())
    return rows


def test_reactions_of_guides_are_outputs(fmu):
    assert validate_fmu(str(fmu)) == []
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    for name, unit in (("rail.force", "N"), ("rail.moment", "N.m"), ("ramp.force", "N")):
        assert (listed[name].causality, listed[name].unit) == ("output", unit)
    assert "on tray.c, positive to the left of" in listed["ramp.force"].description


def test_the_fmu_equals_the_engine_with_other_start_values(fmu, expected):
    result = simulate_fmu(
        str(fmu), fmi_type="CoSimulation", stop_time=END, output_interval=STEP, output=OUTPUTS,
        start_values=STARTS,
    )  # fmt: skip
    assert expected[-1]["wall.impact_count"] > 0
    for name in OUTPUTS:
        wanted = np.array([row[name] for row in expected])
        assert np.abs(result[name] - wanted).max() <= 1e-5 * max(1e-3, np.abs(wanted).max()), name


def test_model_exchange_equals_co_simulation(fmu, expected):
    if read_model_description(str(fmu)).modelExchange is None:
        pytest.skip("co-simulation only")
    result = simulate_fmu(
        str(fmu), fmi_type="ModelExchange", stop_time=END, output_interval=STEP, output=OUTPUTS,
        start_values=STARTS, relative_tolerance=1e-9,
    )  # fmt: skip
    assert result["wall.impact_count"][-1] == expected[-1]["wall.impact_count"]
    for name in OUTPUTS[:-1]:
        wanted = expected[-1][name]
        assert result[name][-1] == pytest.approx(wanted, rel=1e-4, abs=1e-6), name
