"""Builds of the kernel by several compilers, and the bytes of the motion that they compute."""

import base64
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np

from c_importer import ARM, NATIVE, WINE, Host, Job, kernel_library, native, needs, run
from live import simulated
from prbm.runs.experiment import experiment
from support import mechanism

LEVELS = ("-O0", "-O2", "-O3")
UNCHECKED = ("-fno-sanitize=undefined",)
"""Switches off the checks that ziglang adds at -O0.  They cost most of the time in an emulator, and
the tests of the sanitizers have them with GCC."""
DIGITS = 8  # Hexadecimal digits of a hash that are printed.


@dataclass(frozen=True)
class Compiler:
    """A compiler of the kernel for a host; that of ziglang if it has a target.

    ``linker`` is the program whose package has the C library for the compiler.
    """

    host: Host
    name: str
    command: str = ""
    target: str = ""
    flags: tuple[str, ...] = ()
    linker: tuple[str, ...] = ()


COMPILERS = (
    Compiler(NATIVE, "gcc", "gcc"),
    Compiler(NATIVE, "clang", "clang"),
    Compiler(NATIVE, "zig", target="x86_64-linux-gnu.2.17", flags=UNCHECKED),
    Compiler(ARM, "gcc", "aarch64-linux-gnu-gcc"),
    Compiler(
        ARM, "clang", "clang", flags=("--target=aarch64-linux-gnu",),
        linker=("aarch64-linux-gnu-gcc",),
    ),
    Compiler(ARM, "zig", target=ARM.target, flags=UNCHECKED),
    Compiler(WINE, "gcc", "x86_64-w64-mingw32-gcc", flags=("-static-libgcc",)),
    Compiler(WINE, "zig", target=WINE.target, flags=UNCHECKED),
)  # fmt: skip
NATIVE_BUILDS: Mapping[str, tuple[Compiler, str]] = {
    f"{compiler.host.name} {compiler.name} {level}": (compiler, level)
    for compiler, level in product(COMPILERS, LEVELS)
}
FMU_BUILD = "FMU of this machine"
BROWSER_BUILD = "wasm32-wasi zig"
"""The module of live pages, in Node."""

BUILDS = (FMU_BUILD, *NATIVE_BUILDS, BROWSER_BUILD)
"""Names of the builds: platform, compiler and level of optimization."""


def motion(model: str, build: str, steps: int | None = None) -> bytes:
    """Return the bytes of all variables in the default experiment of a mechanism.

    The variables are those of the FMU: states, derivatives and outputs, at all communication
    points or, if ``steps`` is given, at the first ones.  The test is skipped if a program is
    missing.
    """
    default = experiment(mechanism(model))
    whole = round(default.stop_time / default.step)
    count = min(steps or whole, whole)
    job = Job(native(model, 3), "cs", default.step * np.arange(count + 1))
    if build == BROWSER_BUILD:
        found = simulated(mechanism(model), [*job.names()], steps=count, rows=True)
        assert found["error"] is None
        return base64.b64decode(found["rows"])
    if build != FMU_BUILD:
        compiler, level = NATIVE_BUILDS[build]
        job = replace(job, library=library(compiler, level), host=compiler.host)
    return np.array(run(job).rows().tolist())[:, 1:].tobytes()


def library(compiler: Compiler, level: str) -> Path:
    """Return the library of a build; skip the test if a program is missing."""
    host = compiler.host
    needs(*host.emulator[:1], *compiler.linker)
    return kernel_library(
        f"kernel-{host.name}-{compiler.name}{level}", (level, *compiler.flags), compiler.command,
        host, compiler.target,
    )  # fmt: skip


@cache
def digest(model: str, build: str, steps: int | None = None) -> str:
    """Return the first digits of the hash of :func:`motion`."""
    return hashlib.sha256(motion(model, build, steps)).hexdigest()[:DIGITS]
