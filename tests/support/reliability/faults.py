"""Faults of the environment: kill at every write, full disk, two writers, missing rights.

The library ``faults.c`` counts the changes of files in the output folder of a command.  In one run
for each change, the process is killed there, or the disk is full from there on.  Afterwards each
file has its old or its new content, a full disk is reported without a traceback, and the next run
succeeds.
"""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import prbm
from c_importer import compile_c, host_fmu
from prbm.kernel.compiler import ENGINE, HOST, browser_module, libraries
from shared import once

from .report import Part

WORKER = Path(__file__).with_name("fault_worker.py")
SOURCES = Path(prbm.__file__).parents[1]
UNPRIVILEGED = ("setpriv", "--bounding-set=-all", "--inh-caps=-all")
"""Takes from an administrator the right to ignore permissions of files."""
NATIVE = ("--flavour", "native", "--fmi", "2", "--model", "PRBDM")
WRITERS = 3
SECONDS_MAX = 1800.0


def fault_library() -> Path:
    """Return the compiled library that injects faults."""
    source = Path(__file__).with_suffix(".c")
    flags = ("-shared", "-fPIC", "-D_GNU_SOURCE", "-ldl")
    return once("faults.so", lambda path: compile_c(path, [source], flags))


def environment(**changes: str | None) -> dict[str, str]:
    """Return this process's environment with the package, and with changes; None removes."""
    result: dict[str, str | None] = {**os.environ, "PYTHONPATH": str(SOURCES), "MPLBACKEND": "Agg"}
    result |= changes
    return {name: value for name, value in result.items() if value is not None}


ZIG = """
import shutil, sys
assert "wasm32" in sys.argv[sys.argv.index("-target") + 1], sys.argv
shutil.copy(__file__.replace("__main__.py", "module.wasm"), sys.argv[sys.argv.index("-o") + 1])
"""
"""A program instead of ziglang that copies the module of live pages."""


def _compilers(folder: Path) -> dict[str, str]:
    """Return variables that name compilers that copy compiled libraries: they take no time."""
    return {"CC": _compiler(folder), "PYTHONPATH": os.pathsep.join([_zig(folder), str(SOURCES)])}


def _zig(folder: Path) -> str:
    """Return a folder of modules with a package instead of ziglang, if that is installed."""
    modules = folder / "modules"
    modules.mkdir()
    if importlib.util.find_spec("ziglang"):
        package = modules / "ziglang"
        package.mkdir()
        (package / "__init__.py").touch()
        (package / "__main__.py").write_text(ZIG, encoding="utf-8")
        (package / "module.wasm").write_bytes(browser_module())
    return str(modules)


def _compiler(folder: Path) -> str:
    """Return a compiler that copies the libraries for this machine."""
    with zipfile.ZipFile(host_fmu("PRBDM", 2)) as archive:
        name = next(n for n in archive.namelist() if n.endswith(".so"))
        (folder / "kernel.so").write_bytes(archive.read(name))
    (engine,) = libraries([HOST], product=ENGINE).values()
    (folder / "engine.so").write_bytes(engine)
    path = folder / "fast-cc"
    path.write_text(
        "#!/bin/sh\n"
        "kind=kernel\n"
        'while [ $# -gt 0 ]; do case "$1" in --version) echo cc 1; exit;; -o) out=$2;; '
        "-DPRBM_ENGINE) kind=engine;; esac\n"
        f'shift; done\ncp "{folder}/$kind.so" "$out"\n',
        encoding="utf-8",
    )
    path.chmod(0o755)
    return str(path)


def searched(command: str, points: int) -> dict[str, Any]:
    """Return the result of the worker for a command."""
    with tempfile.TemporaryDirectory(prefix="prbm_faults_") as name:
        base = Path(name)
        folder = base / "out"
        out = ["--out", str(folder)]
        words: dict[str, tuple[Sequence[str] | None, Sequence[str]]] = {
            "build": ([*NATIVE, *out, "--set", "stop.position=1 mm"], [*NATIVE, *out]),
            "simulate": tuple(
                ["simulate", "PRBDM", "--stop-time", time, "--step", "1e-3", *out]
                for time in ("0.01", "0.02")
            ),
            "study": tuple(
                [
                    "study",
                    "PRBDM",
                    "--vary",
                    "stop.position=0:1 mm:2",
                    "--of",
                    "shuttle.x",
                    "--workers",
                    "1",
                    "--stop-time",
                    time,
                    *out,
                ]
                for time in ("0.01", "0.02")
            ),
            "compile": (None, []),
        }
        job = {
            "fault": str(fault_library()), "folder": str(folder), "command": command,
            "old": words[command][0], "new": words[command][1], "points": points,
            "log": str(base / "log.txt"),
        }  # fmt: skip
        file = base / "job.json"
        file.write_text(json.dumps(job), encoding="utf-8")
        cache = {"XDG_CACHE_HOME": str(folder)} if command == "compile" else {}
        done = subprocess.run(
            [sys.executable, WORKER, file], capture_output=True, text=True, check=False,
            timeout=SECONDS_MAX,
            env=environment(LD_PRELOAD=job["fault"], **_compilers(base), **cache),
        )  # fmt: skip
    if done.returncode:
        return {"faults": 0, "failures": [f"{command}: {done.stderr[-1000:]}"]}
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def command(
    words: Sequence[str],
    before: Sequence[str] = (),
    folder: Path | None = None,
    **changes: str | None,
) -> "subprocess.CompletedProcess[str]":
    """Run a command in a process of its own; return the completed process."""
    return subprocess.run(
        [*before, sys.executable, "-m", "prbm", *words], capture_output=True, text=True,
        check=False, timeout=SECONDS_MAX, env=environment(**changes),
        cwd=folder or tempfile.gettempdir(),
    )  # fmt: skip


def two_writers() -> list[str]:
    """Run the same exports at once into one folder, with one empty cache."""
    with tempfile.TemporaryDirectory(prefix="prbm_faults_") as name:
        out = Path(name) / "out"
        env = environment(**_compilers(Path(name)), XDG_CACHE_HOME=str(Path(name) / "cache"))
        processes = [
            subprocess.Popen(
                [sys.executable, "-m", "prbm", "build", *NATIVE, "--out", str(out)], env=env,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            )
            for _ in range(WRITERS)
        ]  # fmt: skip
        texts = [process.communicate()[0] for process in processes]
        failures = [f"writer: {t[-300:]}" for p, t in zip(processes, texts, strict=True)
                    if p.returncode]  # fmt: skip
        files = sorted((p for p in out.rglob("*") if p.is_file()), key=lambda p: p.suffix)
        expected = ["PRBDM.fmu", "PRBDM-build.json"]
        if [p.name for p in files] != expected or zipfile.ZipFile(files[0]).testzip():
            failures.append(f"writers left {[p.name for p in files]}")
    return failures


def without_rights(case: str) -> list[str]:
    """Export and simulate without a compiler, or as another user without a writable home.

    Parameters
    ----------
    case : str
        ``no compiler``, ``unprivileged user`` or ``read-only home``.
    """
    before = UNPRIVILEGED if os.geteuid() == 0 and case != "no compiler" else ()
    with tempfile.TemporaryDirectory(prefix="prbm_faults_") as name:
        base = Path(name)
        out, home = base / "out", base / "home"
        out.mkdir()
        home.mkdir(mode=0o555)
        changes: dict[str, str | None] = {
            "XDG_CACHE_HOME": None, "MPLCONFIGDIR": None,
            "HOME": str(home if case == "read-only home" else base / "none"),
        }  # fmt: skip
        if case == "no compiler":
            (base / "bin").mkdir()
            changes |= {"PATH": str(base / "bin"), "CC": None, "XDG_CACHE_HOME": str(base / "no")}
        else:
            changes |= _compilers(base)
        simulated = command(
            ["simulate", "PRBDM", "--stop-time", "0.01", "--out", str(out)], before,
            **changes,
        )  # fmt: skip
        built = command(["build", *NATIVE, "--out", str(out)], before, **changes)
        expected = {"simulate": 0, "build": 0}
        if case == "no compiler" and not _has_zig():
            expected["build"] = 1
        failures = []
        for name, done in (("simulate", simulated), ("build", built)):
            if "Traceback" in done.stderr or bool(done.returncode) != bool(expected[name]):
                failures.append(f"{name}: status {done.returncode}: {done.stderr[-400:]!r}")
        home.chmod(0o700)
    return failures


def _has_zig() -> bool:
    """Return whether the package ziglang compiles instead of a system's compiler."""
    return subprocess.run(
        [sys.executable, "-m", "ziglang", "version"], capture_output=True, check=False
    ).returncode == 0  # fmt: skip


def run(points: int, seed: int = 0, names: Sequence[str] | None = None) -> Part:
    """Try all faults; ``points`` is the largest number of faults of a kind and command."""
    del seed  # The faults are not random.
    part = Part("Faults of the environment", ("fault", "runs", "wrong"))
    for name in ("build", "simulate", "study", "compile"):
        if names is None or name in names:
            found = searched(name, points)
            part.add(f"killed or disk full, {name}", found["faults"], len(found["failures"]))
            part.failures += found["failures"]
    cases: Mapping[str, Any] = {
        f"{WRITERS} writers": two_writers,
        **{
            case: lambda case=case: without_rights(case)
            for case in ("no compiler", "unprivileged user", "read-only home")
        },
    }
    for name, check in cases.items():
        if names is None or name in names:
            failures = check()
            part.add(name, WRITERS if name.endswith("writers") else 2, len(failures))
            part.failures += [f"{name}: {line}" for line in failures]
    part.total()
    return part


def available() -> bool:
    """Return whether the faults can be injected here."""
    return sys.platform == "linux" and shutil.which("cc") is not None
