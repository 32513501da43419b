"""FMUs of mechanisms with springs: interface, co-simulation, model exchange, start values."""

from dataclasses import replace

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.parts import Stop
from springs import web
from support import own_fmu

END, STEP = 0.2, 2e-3
STARTS = {"two.stiffness": 90.0, "one.free_length": 0.09, "three.cubic_stiffness": 2e4}
OUTPUTS = (
    "plate.x", "ring.angle", "one.force", "two.length", "four.length_rate", "energy.elastic",
    "energy.dissipated", "wall.impact_count",
)  # fmt: skip


def walled():
    """Return the web of springs with a wall."""
    stop = Stop("wall", "plate", (-0.04, 0.0), 180.0, 4e-3, restitution=0.6)
    return replace(web(), stops=(stop,))


@pytest.fixture(
    scope="module",
    params=["fmi3", *(pytest.param(x, marks=pytest.mark.slow) for x in ("fmi2", "python"))],
)
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("springs") / "Web.fmu"
    path.write_bytes(own_fmu(request.param, walled()))
    return path


@pytest.fixture(scope="module")
def expected():
    simulation, rows = Simulation(walled(), STARTS), []
    for k in range(round(END / STEP) + 1):
        simulation.advance(k * STEP)
        rows.append(simulation.outputs())
    return rows


def test_springs_are_parameters_and_outputs(fmu):
    assert validate_fmu(str(fmu)) == []
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    for name, unit in (
        ("one.stiffness", "N/m"), ("one.free_length", "m"), ("one.cubic_stiffness", "N/m3"),
        ("one.damping", "N.s/m"),
    ):  # fmt: skip
        assert (listed[name].causality, listed[name].unit) == ("parameter", unit)
    assert "two.free_length" not in listed
    for name, unit in (("one.force", "N"), ("one.length", "m"), ("one.length_rate", "m/s")):
        assert (listed[name].causality, listed[name].unit) == ("output", unit)
    assert listed["one.length_rate"].derivative is listed["one.length"]
    assert "between ground.left and plate.a" in listed["one.force"].description


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
