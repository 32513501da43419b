"""Every benchmark runs, with its smallest sizes."""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support import ROOT

COMMANDS = {
    "accelerations": f"{ROOT} {ROOT} --states 1 --random 1 --model PRBDM",
    "desk": "--short",
    "flexure_cost": "--short --runs 1",
    "native": "--only overhead profile --runs 1",
    "python_engine": f"{ROOT} {ROOT} --runs 1 --model PRBDM",
    "scaling": "--largest 1 --runs 1",
    "speed": "--dist dist/python --runs 1",
    "sweep": "--runs 4 --loops 1 --workers 1 --stop-time 0.001",
    "versions": "dist dist",
    "work_precision": "--short",
}
OTHERS = {
    "compliant_hits": "references/test_compliant_hits.py",
    "flexure_models": "mechanism/test_flexure_models.py",
    "fuzz": "kernel/test_sanitizers.py",
    "reliability": "project/test_reliability.py",
}
"""Benchmarks whose parts other tests run."""
PROGRAMS = {"flexure_cost": "exudyn", "native": "valgrind", "scaling": "valgrind"}
BUILT = ("speed", "sweep", "versions")  # Those that read FMUs from a folder.


def test_every_benchmark_is_run():
    scripts = {path.stem for path in (ROOT / "benchmarks").glob("*.py")}
    assert scripts == {*COMMANDS, *OTHERS}
    assert all((ROOT / "tests" / name).is_file() for name in OTHERS.values())


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """Return a folder with the FMUs of two guides in ``dist``."""
    folder = tmp_path_factory.mktemp("benchmarks")
    models = ["--model", "PRBDM", "--model", "PRBDM2R"]
    run(folder, ROOT / "build_fmu.py", *models, "--out", "dist")
    return folder


def run(folder: Path, script: Path, *words: str) -> str:
    """Run a script in a folder with one thread for linear algebra; return what it prints."""
    paths = os.pathsep.join([str(ROOT / "fmu_src"), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, str(script), *words], cwd=folder, capture_output=True, text=True,
        encoding="utf-8", check=False, timeout=600,
        env=os.environ | {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1", "PYTHONUTF8": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_a_benchmark_runs_with_its_smallest_sizes(name, tmp_path, request):
    program = PROGRAMS.get(name)
    if program and not (shutil.which(program) or importlib.util.find_spec(program)):
        pytest.skip(f"{program} is not installed")
    folder = request.getfixturevalue("built") if name in BUILT else tmp_path
    assert run(folder, ROOT / "benchmarks" / f"{name}.py", *COMMANDS[name].split()).strip()
