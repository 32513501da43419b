"""The choice of the engine, by keyword, by option, and without a library."""

import logging
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import prbm
from prbm.analysis import impact_map
from prbm.analysis.fit import Response
from prbm.analysis.spectrum import after_impact
from prbm.base.errors import ParameterError
from prbm.commands.command_line import main
from prbm.data.series import Series
from prbm.hybrid.simulation import Simulation
from prbm.kernel.compiler import NoCompilerError
from prbm.kernel.simulation import KernelSimulation
from prbm.runs import engine
from prbm.runs.engine import ENGINES, simulation
from prbm.runs.experiment import experiment
from prbm.runs.run import simulate
from support import mechanism, selected

pytestmark = pytest.mark.native


@pytest.fixture
def without_library(monkeypatch):
    """Let the kernel be missing, as without a compiler."""

    def missing():
        raise NoCompilerError("no compiler was found: install one")

    monkeypatch.setattr(engine, "library", missing)
    for function in (engine.kernel_available, engine._warn):
        function.cache_clear()
    yield
    engine.kernel_available.cache_clear()
    engine._warn.cache_clear()


def test_the_kernel_is_the_default():
    guide = mechanism("PRBDM")
    assert isinstance(simulation(guide), KernelSimulation)
    assert isinstance(prbm.Simulation(guide), KernelSimulation)
    assert isinstance(prbm.Simulation(guide, engine="kernel"), KernelSimulation)
    assert isinstance(prbm.Simulation(guide, engine="python"), Simulation)
    assert [simulate(guide, stop_time=1e-3, engine=e).engine for e in (None, *ENGINES)] == [
        "kernel", "kernel", "python",
    ]  # fmt: skip


def test_fixed_steps_are_those_of_the_python_engine():
    assert isinstance(simulation(mechanism("PRBDM"), step=1e-3), Simulation)
    with pytest.raises(ParameterError, match="fixed steps need engine = 'python'"):
        simulation(mechanism("PRBDM"), step=1e-3, engine="kernel")


def test_an_unknown_engine_is_rejected_with_the_known_names():
    with pytest.raises(ParameterError, match="engine = 'fast' must be one of kernel, python"):
        simulate(mechanism("PRBDM"), stop_time=1e-3, engine="fast")


def test_without_a_library_one_message_is_logged_and_the_python_engine_is_used(
    without_library, caplog
):
    guide = mechanism("PRBDM")
    for _ in range(2):
        assert simulate(guide, stop_time=2e-3, step=1e-3).engine == "python"
    (message,) = caplog.messages
    assert message == (
        "the Python engine is used, which is slower: no compiler was found: install one"
    )
    assert caplog.records[0].levelno == logging.WARNING


def test_a_mechanism_too_large_for_the_kernel_runs_in_the_python_engine(caplog):
    guide = mechanism("PRBDM")
    (stop,) = guide.stops
    crowd = replace(guide, stops=tuple(replace(stop, name=f"s{k}") for k in range(65)))
    assert isinstance(simulation(crowd), Simulation)
    assert "has 65 stops" in caplog.messages[-1]


@pytest.mark.parametrize("model", selected(lambda name: name != "Bistable"))
def test_results_of_both_engines_are_equal(model):
    kernel, python = (
        simulate(mechanism(model), stop_time=0.05, step=5e-4, engine=name) for name in ENGINES
    )
    assert kernel.columns.dtype == python.columns.dtype
    assert kernel.start_values == python.start_values
    for name in ("time", *(f"{body.name}.x" for body in mechanism(model).bodies)):
        scale = max(np.ptp(python[name]), 1e-6)  # m; symmetric mechanisms move in y only.
        np.testing.assert_allclose(kernel[name], python[name], atol=1e-5 * scale)
    assert len(kernel.impacts) == len(python.impacts)


@pytest.mark.slow
def test_a_source_of_inputs_acts_alike_in_both_engines():
    def source(t):
        return {"force.x": 0.2 * np.sin(40 * t), "stop.restitution": 0.5 + t}

    kernel, python = (
        simulate(mechanism("PRBDM"), stop_time=0.2, step=1e-3, source=source, engine=name)
        for name in ENGINES
    )
    assert (kernel["force.x"] == python["force.x"]).all()
    np.testing.assert_allclose(kernel["shuttle.x"], python["shuttle.x"], atol=1e-9)


@pytest.mark.parametrize("name", ["PRBDM2R", "FoldedSuspension"])
def test_the_default_experiment_does_not_depend_on_the_engine(name):
    assert experiment(mechanism(name)) == experiment(mechanism(name), engine="python")


@pytest.mark.slow
def test_responses_maps_and_spectra_are_equal_in_both_engines():
    guide, times = mechanism("PRBDM2R"), np.linspace(0.0, 0.1, 40)
    series = Series(times, np.zeros(40))
    for output in ("displacement", "shuttle.angle", "energy.kinetic"):
        kernel, python = (
            Response(series, output, engine=name).model(guide, {"record.zero": 1e-3})
            for name in ENGINES
        )
        np.testing.assert_allclose(kernel, python, atol=1e-6 * np.abs(python).max())
    kernel, python = (
        impact_map.simulated(guide, [-0.01, 0.0], [0.0, 4e-3], engine=name) for name in ENGINES
    )
    np.testing.assert_allclose(kernel.restitution, python.restitution, atol=1e-5)
    kernel, python = (after_impact(guide, duration=0.02, engine=name) for name in ENGINES)
    assert kernel.impact.time == pytest.approx(python.impact.time, abs=1e-9)
    np.testing.assert_allclose(kernel.turning, python.turning, atol=1e-4)


@pytest.mark.parametrize(
    "command", ["simulate", "impact-map", "fit", "measure", "animate", "study"]
)
def test_the_engine_is_an_option_of_each_command_that_simulates(command, capsys):
    words = ["restitution"] if command == "measure" else []
    assert main([command, *words, "--help"]) == 0
    assert "--engine ENGINE" in capsys.readouterr().out


@pytest.mark.parametrize("name", ENGINES)
def test_the_command_runs_the_chosen_engine(monkeypatch, capsys, name):
    classes = {"kernel": "Simulation", "python": "KernelSimulation"}
    monkeypatch.setattr(engine, classes[name], None)  # The other engine cannot be called.
    options = ["--stop-time", "0.06", "--engine", name]
    assert main(["simulate", "PRBDM", "--spectrum", "--spectrum-time", "0.01", *options]) == 0
    grid = ["--vary", "stop.offset=0:1 mm:2", "--of", "impacts", "--step", "0.03"]
    assert main(["study", "PRBDM", *grid, "--workers", "1", *options]) == 0
    assert "2 simulations, 0 failed" in capsys.readouterr().out


def test_an_unknown_engine_on_the_command_line_is_one_sentence(capsys):
    assert main(["simulate", "PRBDM", "--engine", "pyton"]) == 2
    assert "did you mean python?" in capsys.readouterr().err


@pytest.mark.slow
def test_importing_the_package_loads_no_library():
    script = (
        "import prbm, sys; guide = prbm.load('PRBDM'); prbm.simulate; "
        "from prbm.kernel.library import library; print(library.cache_info().currsize)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout == "0\n", done.stderr
