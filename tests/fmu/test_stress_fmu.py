"""Stress and its peaks in the FMUs of all versions and kinds."""

from dataclasses import replace

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

import prbm
from fmu_host import simulate_fmu
from prbm.hybrid.simulation import Simulation
from support import own_fmu

pytestmark = [pytest.mark.fmu, pytest.mark.native]

END, STEP = 0.06, 1e-3
THROWN = {"release.displacement": 0.0, "release.velocity": -0.5, "gravity.x": 0.0}
STRESSES = ("left_flexure.stress_start", "left_flexure.stress_end", "right_flexure.stress")
PEAKS = ("left_flexure.peak_stress", "right_flexure.peak_stress")


def guide():
    """Return the guide with beams and their stress as outputs."""
    known = prbm.load("PRBDM2R")
    kinds = tuple(
        replace(k, model="beam", coefficients={}, stress=True) for k in known.flexure_types
    )
    return replace(known, flexure_types=kinds)


@pytest.fixture(scope="module", params=["python", "fmi2", "fmi3"])
def fmu(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("stress") / "Guide.fmu"
    path.write_bytes(own_fmu(request.param, guide(), THROWN))
    return path


@pytest.fixture(scope="module")
def expected():
    simulation = Simulation(guide(), THROWN)
    simulation.advance(END)
    return simulation.outputs()


@pytest.mark.slow
def test_stress_in_co_simulation_is_that_of_the_engine(fmu, expected):
    assert validate_fmu(str(fmu)) == []
    result = simulate_fmu(
        str(fmu), fmi_type="CoSimulation", stop_time=END, output_interval=STEP,
        output=[*STRESSES, *PEAKS, "left_flexure.peak_stress_time"],
    )  # fmt: skip
    for name in (*STRESSES, *PEAKS):
        assert result[name][-1] == pytest.approx(expected[name], rel=1e-6, abs=10.0)
    assert 0.0 < result["left_flexure.peak_stress_time"][-1] < END
    assert np.all(np.diff(result["left_flexure.peak_stress"]) >= 0.0)


def test_stress_has_units_in_the_description(fmu):
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    for name in (*STRESSES, *PEAKS):
        assert (listed[name].causality, listed[name].unit) == ("output", "Pa")
    assert listed["left_flexure.peak_stress_position"].unit == "m"


def test_peaks_in_model_exchange_are_those_of_the_steps_of_the_importer(fmu, expected):
    if read_model_description(str(fmu)).modelExchange is None:
        pytest.skip("co-simulation only")
    result = simulate_fmu(
        str(fmu), fmi_type="ModelExchange", stop_time=END, output_interval=STEP,
        relative_tolerance=1e-8, output=[*STRESSES, *PEAKS],
    )  # fmt: skip
    for name in PEAKS:
        assert result[name][-1] == pytest.approx(expected[name], rel=0.01)
    assert result[PEAKS[1]][-1] >= result["right_flexure.stress"].max()
