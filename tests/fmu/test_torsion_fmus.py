"""FMUs of mechanisms with torsion at joints: interface, co-simulation, model exchange."""

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from prbm.hybrid.simulation import Simulation
from springs import four_bar
from support import own_fmu

END, STEP = 0.4, 4e-3
STARTS = {"third.stiffness": 0.06, "third.free_angle": -0.4, "third.damping": 3e-4}
OUTPUTS = (
    "ab.angle", "bc.x", "cd.omega", "base.moment", "energy.elastic", "energy.dissipated",
    "mode.frequency",
)  # fmt: skip


@pytest.fixture(
    scope="module",
    params=["fmi3", *(pytest.param(x, marks=pytest.mark.slow) for x in ("fmi2", "python"))],
)
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("torsion") / "FourBar.fmu"
    model = four_bar(stiffness=0.04, free_angle=0.3, damping=1e-4)
    path.write_bytes(own_fmu(request.param, model))
    return path


@pytest.fixture(scope="module")
def expected():
    model = four_bar(stiffness=0.04, free_angle=0.3, damping=1e-4)
    simulation, rows = Simulation(model, STARTS), []
    for k in range(round(END / STEP) + 1):
        simulation.advance(k * STEP)
        rows.append(simulation.outputs())
    return rows


def test_torsion_has_parameters_as_far_as_it_is_given(fmu):
    assert validate_fmu(str(fmu)) == []
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    for name, unit in (
        ("third.stiffness", "N.m/rad"), ("third.free_angle", "rad"), ("third.damping", "N.m.s/rad"),
    ):  # fmt: skip
        assert (listed[name].causality, listed[name].unit) == ("parameter", unit)
    assert "first.free_angle" not in listed
    assert "second.stiffness" not in listed


def test_the_fmu_equals_the_engine_with_other_start_values(fmu, expected):
    result = simulate_fmu(
        str(fmu), fmi_type="CoSimulation", stop_time=END, output_interval=STEP, output=OUTPUTS,
        start_values=STARTS,
    )  # fmt: skip
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
    for name in OUTPUTS:
        wanted = expected[-1][name]
        assert result[name][-1] == pytest.approx(wanted, rel=1e-4, abs=1e-6), name
