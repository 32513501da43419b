"""Sweeps over FMUs of this project, compared with the engine: quantities, inputs over time."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from prbm.base.errors import PrbmError
from prbm.commands.command_line import main
from prbm.runs.quantities import QUANTITIES
from prbm.runs.run import simulate
from prbm.sweeps.study import study
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


def test_the_study_of_an_fmu_is_that_of_its_mechanism(native, mechanisms):
    of_mechanism, of_fmu = (
        study(
            model, {"stop.position": ["1 mm", "2 mm"]}, ["impacts", "shuttle.x", "impact_speed"],
            workers=1, stop_time=0.05, step=1e-3,
        )
        for model in (mechanisms["PRBDM"], native["PRBDM", 2])
    )  # fmt: skip
    assert of_fmu.outputs["impacts"].tolist() == of_mechanism.outputs["impacts"].tolist()
    for name, x in of_mechanism.outputs.items():
        np.testing.assert_allclose(of_fmu.outputs[name], x, rtol=1e-5)
    assert of_fmu.units == of_mechanism.units
    assert of_fmu.table()[0] == of_mechanism.table()[0]


def test_the_command_studies_an_fmu(native, tmp_path, capsys):
    """The record has the name and the hash of the FMU, the table the heads of a mechanism's."""
    words = ["study", str(native["PRBDM", 2]), "--vary", "stop.position=1:2mm:2", "--of", "impacts"]
    assert main([*words, "--set", "stop.restitution=50%", "--stop-time", "50ms",
                 "--out", str(tmp_path)]) == 0  # fmt: skip
    assert "2 simulations, 0 failed" in capsys.readouterr().out
    heads, *rows = (tmp_path / "PRBDM-study.csv").read_text(encoding="utf-8").splitlines()
    assert heads == "stop.position [m],impacts [-],error"
    assert [row.split(",")[0] for row in rows] == ["0.001", "0.002"]
    record = json.loads((tmp_path / "PRBDM-study-run.json").read_text(encoding="utf-8"))
    content = native["PRBDM", 2].read_bytes()
    assert record["mechanism"]["sha256"] == hashlib.sha256(content).hexdigest()
    assert record["arguments"]["values"] == {"stop.restitution": 0.5}


@pytest.mark.slow
def test_the_optimum_and_the_yield_of_an_fmu_are_those_of_its_mechanism(native, mechanisms):
    vary = {"stop.position": (0.0, 2e-3), "stop.restitution": "0.4 +- 5 %"}
    of_mechanism, of_fmu = (
        study(
            model, vary, runs=8, minimise="shuttle.x", workers=1, stop_time=0.02, step=1e-3,
            subject_to=["shuttle.x > -1 m"], tolerances={"stop.position": "1 um"},
        )
        for model in (mechanisms["PRBDM"], native["PRBDM", 2])
    )  # fmt: skip
    assert of_fmu.points.tolist() == of_mechanism.points.tolist()
    assert of_fmu.optimum.value == pytest.approx(of_mechanism.optimum.value, rel=1e-5)
    assert of_fmu.share == of_mechanism.share


def test_outputs_of_a_mechanism_alone_are_no_outputs_of_an_fmu(native):
    varied = {"stop.position": [0.0, 1e-3]}
    with pytest.raises(PrbmError, match=r"FILE\.toml, or take the variable mode\.frequency"):
        study(native["PRBDM", 2], varied, ["fundamental"])
    with pytest.raises(PrbmError, match=r"rest\(shuttle\.x\): needs a mechanism.*FILE\.toml$"):
        study(native["PRBDM", 2], varied, ["rest(shuttle.x)"])
    with pytest.raises(PrbmError, match="an FMU has its own"):
        study(native["PRBDM", 2], varied, ["shuttle.x"], engine="python")


@pytest.mark.parametrize("name", ["PRBDM", "guide.toml"])
def test_a_mechanism_in_place_of_an_fmu_is_referred_to_the_command_for_mechanisms(capsys, name):
    Path("guide.toml").write_text("name = 'guide'", encoding="utf-8")
    assert main(["sweep", name, "table.csv"]) == 2
    printed = capsys.readouterr().err
    assert printed.startswith(f"prbm sweep: {name}")
    assert "the command prbm study" in printed
    with pytest.raises(PrbmError, match=r"prbm\.study\(prbm\.load\(NAME\), \.\.\.\)"):
        study(name, {"stop.position": [0.0, 1e-3]}, ["impacts"])


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
        ({"force.y": "step({hight} N)"}, r"\{hight\} in an input has no value; .* a column hight"),
        ({"forc.x": "step(1 N)"}, "unknown variable 'forc.x'; did you mean force"),
        ({"stop.position": "step(1 mm)"}, "stop.position is a parameter"),
        ({"force.x": "step(1 N)"}, "force.x is given both as a constant and over time"),
        ({"force.y": "step(1 m)"}, "the unit 'm' has another dimension"),
    ],
)
def test_mistakes_in_inputs_over_time_are_reported(native, inputs, sentence):
    table = pd.DataFrame({"force.x": [1.0]})
    with pytest.raises(PrbmError, match=sentence):
        sweep(native["PRBDM", 2], table, inputs=inputs)
