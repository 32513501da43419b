"""Models of flexures that a program registers."""

import re

import fmpy
import numpy as np
import pytest

import prbm
from prbm.fmu import native_fmu, python_fmu
from prbm.mechanism.flexure import MODELS
from support import ROOT


@pytest.fixture(autouse=True)
def _models():
    """Remove the models of a test after it."""
    before = {*MODELS}
    yield
    for name in {*MODELS} - before:
        del MODELS[name]


@pytest.mark.native
@pytest.mark.parametrize("engine", ["kernel", "python"])
def test_a_registered_model_moves_like_the_shipped_one_with_its_coefficients(engine, tmp_path):
    model = MODELS["2R"]
    prbm.register_model("Own", *([c.value for c in cs] for cs in (model.gamma, model.K_theta)))
    path = tmp_path / "own.toml"
    text = (ROOT / "fmu_src/prbm/shipped/PRBDM2R.toml").read_text(encoding="utf-8")
    path.write_text(text.replace('model = "2R"', 'model = "Own"'), encoding="utf-8")
    own, shipped = prbm.load(path), prbm.load("PRBDM2R")
    assert {kind.model for kind in own.flexure_types} == {"Own"}
    columns = [prbm.simulate(m, stop_time=0.05, engine=engine)["shuttle.x"] for m in (own, shipped)]
    np.testing.assert_allclose(columns[0], columns[1], rtol=1e-9, atol=1e-12)


@pytest.mark.slow
@pytest.mark.native
def test_a_python_fmu_is_refused_and_a_native_one_has_the_model(tmp_path):
    prbm.register_model("Own", (0.44, 0.46), (3.471, 2.0682))
    path = tmp_path / "own.toml"
    text = (ROOT / "fmu_src/prbm/shipped/PRBDM2R.toml").read_text(encoding="utf-8")
    path.write_text(text.replace('model = "2R"', 'model = "Own"'), encoding="utf-8")
    own = prbm.load(path)
    with pytest.raises(prbm.MechanismError, match=r"the model Own is registered .* native FMU"):
        python_fmu.build(own)
    (tmp_path / "own.fmu").write_bytes(native_fmu.build(own, fmi=2))
    found = fmpy.simulate_fmu(str(tmp_path / "own.fmu"), stop_time=0.02, output=["shuttle.x"])
    column = prbm.simulate(own, stop_time=0.02)["shuttle.x"]
    assert found["shuttle.x"][-1] == pytest.approx(column[-1], rel=1e-9)


@pytest.mark.slow
def test_another_process_names_a_model_that_it_does_not_know(tmp_path):
    """With a timeout, the simulations of a study run in other processes."""
    prbm.register_model("Own", (0.44, 0.46), (3.471, 2.0682))
    path = tmp_path / "own.toml"
    text = (ROOT / "fmu_src/prbm/shipped/PRBDM2R.toml").read_text(encoding="utf-8")
    path.write_text(text.replace('model = "2R"', 'model = "Own"'), encoding="utf-8")
    samples = {"stop.position": [0.0, 1e-3]}
    found = prbm.study(
        prbm.load(path), samples, ["impacts"], stop_time=0.05, workers=1, timeout=60.0
    )
    for message in found.messages:
        assert "Own" in message
        assert "SIGABRT" not in message


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("2R", (0.9,), (2.0,)), "choose another name than 1R"),
        (("my model", (0.9,), (2.0,)), "of letters, digits and _"),
        (("Own", (0.4, 0.4), (2.0,)), "2 lengths gamma and 1 stiffnesses"),
        (("Own", (), ()), "0 lengths"),
        (("Own", (0.6, 0.6), (2.0, 2.0)), "the sum of gamma at most 1"),
        (("Own", (0.9,), (-2.0,)), "must be positive"),
        (("Own", (float("nan"),), (2.0,)), "must be positive"),
        (("Own", (0.9,), (float("inf"),)), "must be positive and finite"),
        (("Own", 0.9, 2.0), "gamma = 0.9 must be a sequence of numbers; write one as (0.85,)"),
        (("Own", ("a",), (2.0,)), "gamma[0] = 'a' must be a number"),
        ((3, (0.9,), (2.0,)), "model 3: choose another name"),
    ],
)
def test_an_invalid_model_is_rejected_and_not_added(arguments, sentence):
    before = dict(MODELS)
    with pytest.raises(prbm.ParameterError, match=re.escape(sentence)):
        prbm.register_model(*arguments)
    assert before == MODELS


def test_the_code_of_the_page_on_stability_prints_its_text(capsys):
    page = (ROOT / "docs" / "stability.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (text,) = re.findall(r"```text\n(.*?)```", page, re.DOTALL)
    exec(compile(code, "stability.md", "exec"), {})
    assert capsys.readouterr().out == text
    assert {f"`{name}`" for name in prbm.__all__ if "_" not in name and "Error" not in name} <= {
        *re.findall(r"`\w+`", page)
    }
