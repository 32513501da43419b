"""Outputs that cannot be written end every command with a message and a status."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import prbm

resource = pytest.importorskip("resource")

FULL = Path("/dev/full")
COMMANDS = {
    "list": ["list"],
    "modes": ["modes", "PRBDM"],
    "parameters": ["parameters", "PRBDM"],
    "help": ["--help"],
    "help of a command": ["simulate", "--help"],
}


def run(*words, **options):
    return subprocess.run(
        [sys.executable, "-m", "prbm", *words],
        env={**os.environ, "PYTHONPATH": str(Path(prbm.__file__).parents[1])},
        stderr=subprocess.PIPE, encoding="utf-8", check=False, **options,
    )  # fmt: skip


@pytest.mark.skipif(not FULL.exists(), reason="the system has no full device")
@pytest.mark.parametrize("command", COMMANDS)
def test_a_full_standard_output_is_reported(command):
    with FULL.open("wb") as full:
        done = run(*COMMANDS[command], stdout=full)
    assert "cannot write standard output (No space left on device)" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.returncode == 1


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other standard outputs")
def test_a_closed_standard_output_is_no_error():
    done = run("list", stdout=subprocess.DEVNULL, preexec_fn=lambda: os.close(1))
    assert done.stderr == ""
    assert done.returncode == 0


@pytest.mark.parametrize("command", ["parameters", "modelica"])
@pytest.mark.parametrize("fault", ["limit", "name"])
def test_a_file_that_cannot_be_written_is_reported(tmp_path, command, fault):
    name = "n" * 300 if fault == "name" else "out"
    limit = 64 if fault == "limit" else resource.RLIM_INFINITY
    done = run(
        command, "PRBDM", "--out", str(tmp_path / name), stdout=subprocess.DEVNULL,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )  # fmt: skip
    assert "Traceback" not in done.stderr
    assert f"cannot write {tmp_path / name} (File " in done.stderr
    assert done.returncode == 1
    assert [*tmp_path.iterdir()] == []
