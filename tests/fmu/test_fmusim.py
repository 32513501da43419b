"""The reference check in fmusim, the importer in C of the Modelica Association.

The variable ``FMUSIM`` is the path of the program.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from compliant_pivot import two_compliant_stops
from prbm.fmu import native_fmu
from reference_check import (
    DAMPED,
    EQUAL_RTOL,
    EXCHANGE_RTOL,
    EXPERIMENT_NAMES,
    EXPERIMENTS,
    compared,
    exchange_tolerance,
    file_of,
    member,
    rows_of,
    start_values,
)
from support import COSTLY_MODELS, mechanism, selected

pytestmark = [
    pytest.mark.fmu, pytest.mark.native, pytest.mark.slow,
    pytest.mark.skipif("FMUSIM" not in os.environ, reason="needs the variable FMUSIM"),
]  # fmt: skip
INTERFACES = [(2, "cs"), (3, "cs"), (2, "me"), (3, "me")]
interfaces = pytest.mark.parametrize(("fmi", "kind"), INTERFACES)


def checked(fmu: Path, model: str, kind: str, experiment: str, folder: Path) -> int:
    """Run an experiment in fmusim as README.txt describes; return the number of compared rows."""
    expected = rows_of(member(fmu, file_of(model, experiment)))
    out = folder / "out.csv"
    words = ["--interface-type", kind, "--output-file", str(out)]
    words += ["--stop-time", repr(float(expected["time"][-1]))]
    words += ["--output-interval", repr(float(expected["time"][1]))]
    if kind == "me":
        words += ["--solver", "cvode", "--tolerance", repr(exchange_tolerance(fmu))]
    for name in expected.dtype.names[1:]:
        words += ["--output-variable", name]
    for name, value in start_values(fmu, model, experiment, folder).items():
        words += ["--start-value", name, repr(float(value))]
    done = subprocess.run(
        [os.environ["FMUSIM"], *words, str(fmu)],
        capture_output=True, text=True, check=False, errors="replace",
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-500:]
    found = rows_of(out.read_bytes())
    assert np.isfinite(found["time"]).all()
    rtol = EQUAL_RTOL if kind == "cs" else EXCHANGE_RTOL
    return compared(fmu, expected, found, rtol, complete=kind == "cs")


@EXPERIMENTS
@interfaces
@pytest.mark.parametrize("model", selected(lambda name: name not in COSTLY_MODELS))
def test_fmusim_reproduces_each_experiment(native, model, fmi, kind, experiment, tmp_path):
    assert checked(native[model, fmi], model, kind, experiment, tmp_path) > 10


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("model", COSTLY_MODELS)
def test_fmusim_reproduces_costly_mechanisms(model, fmi, tmp_path):
    """The FMUs of other tests lack their reference results, which take the engine minutes."""
    fmu = tmp_path / f"{model}.fmu"
    fmu.write_bytes(native_fmu.build(mechanism(model), {}, fmi))
    for kind in ("cs", "me"):
        for experiment in EXPERIMENT_NAMES:
            assert checked(fmu, model, kind, experiment, tmp_path) > 10


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmusim_reproduces_forces_and_stresses_of_two_stops(fmi, tmp_path):
    own = two_compliant_stops()
    fmu = tmp_path / f"{own.name}.fmu"
    fmu.write_bytes(native_fmu.build(own, DAMPED, fmi))
    for kind in ("cs", "me"):
        for experiment in EXPERIMENT_NAMES:
            assert checked(fmu, own.name, kind, experiment, tmp_path) > 10
