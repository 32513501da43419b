"""Sweeps over FMUs of this project, compared with the engine: quantities, inputs over time."""

import numpy as np
import pandas as pd
import pytest

from prbm.base.errors import PrbmError
from prbm.runs.quantities import QUANTITIES
from prbm.runs.run import simulate
from prbm.sweeps.sweep import sweep

pytestmark = [pytest.mark.fmu, pytest.mark.native]


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_named_quantities_of_fmus_are_those_of_the_engine(native, mechanisms):
    known = simulate(mechanisms["PRBDM"], stop_time=1e-3).columns.dtype.names
    quantities = {name: x for name, x in QUANTITIES.items() if not x.lacking(known)}
    names = [*quantities, "max(abs(shuttle.vx))"]
    table = pd.DataFrame({"stop.position": [0.0, 2e-3]})
    found = sweep(native["PRBDM", 2], table, outputs=names, stop_time=0.3, step=1e-3)
    for row, position in enumerate(table["stop.position"]):
        result = simulate(mechanisms["PRBDM"], {"stop.position": position}, stop_time=0.3)
        for name, quantity in quantities.items():
            assert found[name][row] == pytest.approx(quantity.compute(result.columns), rel=1e-6)
        largest = np.abs(result["shuttle.vx"]).max()
        assert found["max(abs(shuttle.vx))"][row] == pytest.approx(largest, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_inputs_over_time_of_fmus_are_those_of_the_engine(native, mechanisms, fmi):
    """Heights of the shock are a column of the table; the shock lies between two steps."""
    values = {"release.displacement": 0.0, "stop.position": 0.02, "gravity.x": 0.0}
    table = pd.DataFrame({"height": [5.0, 20.0], "stop.restitution": [0.5, 0.6]})
    signals = {
        "base.acceleration.x": "half-sine({height} g, 2 ms, 3.3 ms)",
        "stop.displacement": "sine(1 mm, 20 Hz)",
    }
    found = sweep(
        native["PRBDM", fmi], table, outputs=["shuttle.x", "max(shuttle.vx)", "stop.gap"],
        values=values, inputs=signals, stop_time=0.02, step=1e-3,
    )  # fmt: skip
    assert found["status"].tolist() == ["ok", "ok"], found["message"].tolist()
    for row, height in enumerate(table["height"]):
        signals["base.acceleration.x"] = f"half-sine({height} g, 2 ms, 3.3 ms)"
        result = simulate(mechanisms["PRBDM"], values, inputs=signals, stop_time=0.02, step=1e-3)
        assert found["shuttle.x"][row] == pytest.approx(result["shuttle.x"][-1], rel=1e-6)
        assert found["max(shuttle.vx)"][row] == pytest.approx(result["shuttle.vx"].max(), rel=1e-6)
        assert found["stop.gap"][row] == pytest.approx(result["stop.gap"][-1], rel=1e-6)


@pytest.mark.parametrize(
    ("inputs", "sentence"),
    [
        ({"force.y": "step({hight} N)"}, r"\{hight\} in an input has no value; add a column hight"),
        ({"forc.x": "step(1 N)"}, "the FMU has no input 'forc.x'; did you mean force"),
        ({"stop.position": "step(1 mm)"}, "the FMU has no input 'stop.position'"),
        ({"force.x": "step(1 N)"}, "force.x is given both as a start value and over time"),
        ({"force.y": "step(1 m)"}, "the unit 'm' has another dimension"),
    ],
)
def test_mistakes_in_inputs_over_time_are_reported(native, inputs, sentence):
    table = pd.DataFrame({"force.x": [1.0]})
    with pytest.raises(PrbmError, match=sentence):
        sweep(native["PRBDM", 2], table, inputs=inputs)
