"""FMUs of mechanisms that are released by an angle or along a mode."""

import math
from dataclasses import replace

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_host import simulate_fmu
from prbm.files.mechanism_file import read_mechanism
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.parts import Release
from support import SUPPORT, own_fmu

PIVOT = read_mechanism(SUPPORT / "pivot.toml")
LEAF = replace(PIVOT.flexure_types[0], model="1R")  # The 3R has modes of several kHz.
PIVOT = replace(PIVOT, flexure_types=(LEAF,))
ALONG_MODE = Release("wheel", 90.0, mode=1, amplitude=-1e-3, point=("span", "span/2"))
STARTS = {"angle": (PIVOT.release, -0.1, "rad"), "amplitude": (ALONG_MODE, -2e-3, "m")}
END = 2e-3


@pytest.mark.parametrize(
    ("flavour", "start"),
    [
        ("python", "angle"),
        ("fmi3", "amplitude"),
        pytest.param("python", "amplitude", marks=pytest.mark.slow),
        pytest.param("fmi2", "angle", marks=pytest.mark.slow),
    ],
)
def test_the_start_of_an_fmu_is_a_parameter(flavour, start, tmp_path):
    release, other, unit = STARTS[start]
    model, name, path = replace(PIVOT, release=release), f"release.{start}", tmp_path / "Pivot.fmu"
    path.write_bytes(own_fmu(flavour, model))
    assert validate_fmu(str(path)) == []
    variables = {v.name: v for v in read_model_description(str(path)).modelVariables}
    assert "release.displacement" not in variables
    assert variables[name].unit == unit
    assert float(variables[name].start) == getattr(release, start)
    result = simulate_fmu(
        str(path), fmi_type="CoSimulation", start_values={name: other}, stop_time=END,
        output_interval=END, output=["wheel.angle", "stop.gap"],
    )  # fmt: skip
    engine = Simulation(model, {name: other})
    for row, time in enumerate((0.0, END)):
        engine.advance(time)
        expected = engine.outputs()
        for output in ("wheel.angle", "stop.gap"):
            found = result[output][row]
            assert math.isclose(found, expected[output], rel_tol=1e-7, abs_tol=1e-11), output
