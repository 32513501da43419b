"""Export and simulate in new environments with the lowest and the newest dependencies.

The lowest versions are the lower bounds in ``pyproject.toml``.  Each environment exports a guide in
all flavours and simulates each FMU.  No warning of the package may appear, and the printed results
of all environments must be equal.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path

from .report import Part

ROOT = Path(__file__).resolve().parents[3]
ENVIRONMENTS = (("3.11", "lowest"), ("3.12", "newest"), ("3.13", "newest"))
LOWER_BOUND = re.compile(r"([\w.-]+)>=([\d.]+)")
RESULTS = ("fundamental", "free rest position", "impacts at", "came to rest")
FLAVOURS = 3
SECONDS_MAX = 1800.0


def python(version: str) -> str | None:
    """Return the interpreter of a version, from the PATH or from pyenv; None if there is none.

    pyenv has programs on the PATH for all installed versions, which fail for inactive ones.
    """
    installed = Path.home() / ".pyenv" / "versions"
    found = [str(path) for path in sorted(installed.glob(f"{version}.*/bin/python"))]
    for path in (shutil.which(f"python{version}"), *reversed(found)):
        if path and _call([path, "-c", ""]).returncode == 0:
            return path
    return None


def requirements(which: str) -> list[str]:
    """Return the requirements of package, FMPy and sweeps; "lowest" pins them to the bounds."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    wanted = [*project["dependencies"], *extras["fmpy"], *extras["sweep"]]
    wanted = [name for name in wanted if not name.startswith(project["name"])]
    if which == "newest":
        return wanted
    return [f"{m[1]}=={m[2]}" for m in map(LOWER_BOUND.match, wanted) if m]


def _call(words: Sequence[str]) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        words, capture_output=True, text=True, check=False, timeout=SECONDS_MAX, cwd=ROOT
    )


def tried(interpreter: str, which: str) -> tuple[list[str], list[str]]:
    """Return the results that the simulations print, and the failures."""
    with tempfile.TemporaryDirectory(prefix="prbm_versions_") as name:
        own = str(Path(name) / "venv" / "bin" / "python")
        for words in (
            [interpreter, "-m", "venv", str(Path(name) / "venv")],
            [own, "-m", "pip", "install", "-q", *requirements(which)],
        ):
            done = _call(words)
            if done.returncode:
                return [], [f"{' '.join(words[1:4])}: {(done.stdout + done.stderr)[-500:]}"]
        done = _call(
            [own, "build_fmu.py", "--model", "PRBDM", "--simulate", "--out", str(Path(name) / "d")]
        )
    lines = [line.strip() for line in (done.stdout + done.stderr).splitlines()]
    results = [line for line in lines if line.startswith(RESULTS)]
    failures = [line for line in lines if "Warning" in line or "Traceback" in line]
    if done.returncode or len(results) != FLAVOURS * len(RESULTS):
        failures.append(f"status {done.returncode}: {lines[-5:]}")
    return results, failures


def run(size: int, seed: int = 0, names: Sequence[str] | None = None) -> Part:
    """Try the first ``size`` environments whose interpreters are installed."""
    del seed, names
    part = Part("Versions of dependencies", ("Python", "dependencies", "FMUs", "wrong"))
    first: list[str] = []
    for version, which in ENVIRONMENTS[:size]:
        interpreter = python(version)
        if interpreter is None:
            print(f"  no interpreter for Python {version}", file=sys.stderr)
            continue
        results, failures = tried(interpreter, which)
        first = first or results
        if results != first:
            failures.append(f"results differ: {results} and {first}")
        part.add(version, which, FLAVOURS, len(failures))
        part.failures += [f"Python {version}, {which}: {line}" for line in failures]
    return part
