"""FMUs of mechanisms with friction along guides: interface, co-simulation, model exchange."""

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from guides import rough, slider_crank
from prbm.hybrid.simulation import Simulation
from support import own_fmu

END, STEP = 0.4, 4e-3
STARTS = {"way.friction": 0.2}
OUTPUTS = (
    "crank.angle", "slider.x", "crank.omega", "way.force", "base.moment", "energy.dissipated",
)  # fmt: skip


@pytest.fixture(
    scope="module",
    params=["fmi3", *(pytest.param(x, marks=pytest.mark.slow) for x in ("fmi2", "python"))],
)
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("rough") / "SliderCrank.fmu"
    path.write_bytes(own_fmu(request.param, rough(slider_crank(), 0.1)))
    return path


@pytest.fixture(scope="module")
def expected():
    simulation, rows = Simulation(rough(slider_crank(), 0.1), STARTS), []
    for k in range(round(END / STEP) + 1):
        simulation.advance(k * STEP)
        rows.append(simulation.outputs())
    return rows


def test_the_coefficient_is_a_parameter_with_a_unit_of_one(fmu):
    assert validate_fmu(str(fmu)) == []
    description = read_model_description(str(fmu))
    listed = {v.name: v for v in description.modelVariables}
    friction = listed["way.friction"]
    assert (friction.causality, friction.variability) == ("parameter", "tunable")
    assert {"way.slip_indicator", "way.side_indicator"} <= listed.keys() or not (
        description.modelExchange
    )


def test_the_fmu_equals_the_engine_with_another_coefficient(fmu, expected):
    result = simulate_fmu(
        str(fmu), fmi_type="CoSimulation", stop_time=END, output_interval=STEP, output=OUTPUTS,
        start_values=STARTS,
    )  # fmt: skip
    for name in OUTPUTS:
        wanted = np.array([row[name] for row in expected])
        assert np.abs(result[name] - wanted).max() <= 1e-5 * max(1e-3, np.abs(wanted).max()), name


def test_model_exchange_locates_stick_slip_and_changes_of_side(fmu, expected):
    if read_model_description(str(fmu)).modelExchange is None:
        pytest.skip("co-simulation only")
    result = simulate_fmu(
        str(fmu), fmi_type="ModelExchange", stop_time=END, output_interval=STEP, output=OUTPUTS,
        start_values=STARTS, relative_tolerance=1e-9,
    )  # fmt: skip
    for name in OUTPUTS:
        wanted = expected[-1][name]
        assert result[name][-1] == pytest.approx(wanted, rel=1e-4, abs=1e-5), name
