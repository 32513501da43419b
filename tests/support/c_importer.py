"""The C importer of ``importer/``: compile it, write its job files, run it, read its rows."""

import dataclasses
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.model_description import ModelDescription

import prbm.kernel
from compliant_pivot import two_compliant_stops
from many_parts import anvil
from prbm.base.atomic import write
from prbm.kernel.compiler import cache_folder
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Stop
from shared import once, shared_folder
from support import built, mechanism

SOURCES = Path(__file__).with_name("importer")
KERNEL = Path(prbm.kernel.__file__).parent
HEADERS = Path(fmpy.__file__).parent / "c-code"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
FOLDERS = (f"-I{KERNEL}", "-isystem", str(HEADERS))
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", *WARNINGS, *FOLDERS)
POSIX = ("-D_POSIX_C_SOURCE=200809L", "-ldl", "-lm", "-lpthread")
TYPES = {"Real": "r", "Float64": "r", "Integer": "i", "Int32": "i", "Boolean": "b"}
TWO_STOPS, ANVIL, COMPLIANT = "TwoStops", "Anvil", "TwoCompliant"


@dataclass(frozen=True)
class Host:
    """The platform of an importer: this machine, or another one in an emulator."""

    name: str
    folders: tuple[str, ...]
    suffix: str
    target: str = ""
    emulator: tuple[str, ...] = ()
    environment: tuple[tuple[str, str], ...] = ()

    @property
    def windows(self) -> bool:
        return self.suffix == ".dll"

    def path(self, path: Path) -> str:
        """Return the path of a file of this machine as the emulated program sees it."""
        return "Z:" + str(path).replace("/", "\\") if self.windows else str(path)

    def uri(self, path: Path) -> str:
        return ("file:///Z:" if self.windows else "file://") + quote(str(path))


NATIVE = Host("x86_64-linux", ("x86_64-linux", "linux64"), ".so")
WINE = Host(
    "x86_64-windows",
    ("x86_64-windows", "win64"),
    ".dll",
    "x86_64-windows-gnu",
    ("wine",),
    (("WINEDEBUG", "-all"), ("WINEDLLOVERRIDES", "mscoree,mshtml=")),
)
ARM = Host(
    "aarch64-linux",
    ("aarch64-linux",),
    ".so",
    "aarch64-linux-gnu.2.17",
    ("qemu-aarch64-static", "-L", "/usr/aarch64-linux-gnu"),
)
PACKAGES = {
    "cc": "gcc",
    "aarch64-linux-gnu-gcc": "gcc-aarch64-linux-gnu",
    "x86_64-w64-mingw32-gcc": "gcc-mingw-w64-x86-64",
    "valgrind": "valgrind",
    "wine": "wine64",
    "qemu-aarch64-static": "qemu-user-static and libc6-arm64-cross",
}


def needs(*programs: str) -> None:
    """Skip the test if a program is missing, and name the package that provides it."""
    for program in programs:
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed (Debian: {PACKAGES.get(program, program)})")


def zig(target: str) -> list[str]:
    return [sys.executable, "-m", "ziglang", "cc", "-target", target]


def zig_environment() -> dict[str, str]:
    """Return an environment in which ziglang uses the exporter's cache for its global files."""
    return os.environ | {
        "ZIG_GLOBAL_CACHE_DIR": str(cache_folder() / "zig"),
        "ZIG_LOCAL_CACHE_DIR": str(shared_folder() / f"zig-{os.getpid()}"),
    }


def compile_c(
    output: Path,
    sources: Sequence[Path],
    flags: Sequence[str] = (),
    target: str = "",
    compiler: str = "cc",
) -> None:
    """Compile with the system's compiler, or with ziglang for a target; warnings are errors."""
    needs(*([] if target else [compiler]))
    command = zig(target) if target else [compiler]
    done = subprocess.run(
        [*command, *FLAGS, *map(str, sources), "-o", str(output), *flags],
        capture_output=True, text=True, check=False,
        env=zig_environment() if target else None,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@cache
def importer(host: Host = NATIVE, flags: tuple[str, ...] = ()) -> Path:
    """Return the importer for a host; skip the test if the compiler or emulator is missing."""
    needs(*host.emulator[:1])
    name = f"importer-{host.name}-{len(flags)}{'.exe' if host.windows else ''}"
    sources, system = sorted(SOURCES.glob("*.c")), () if host.windows else POSIX
    return once(name, lambda path: compile_c(path, sources, [*flags, *system], host.target))


@cache
def _description(folder: Path) -> ModelDescription:
    return read_model_description(str(folder))


@dataclass(frozen=True)
class Job:
    """A simulation of an unpacked FMU by the importer.

    Parameters
    ----------
    folder : Path
        The unpacked FMU.
    kind : str
        ``cs``, ``events`` (co-simulation in event mode) or ``me``.
    points : array
        Communication points [s]; the first is the start time.
    sets : mapping
        Start values by name.
    changes : mapping
        Values by name, to be set at the communication point with the index of the key.
    records : sequence of str
        Names of the recorded variables; all variables if empty.
    tolerance : float or None
        Relative tolerance passed to the FMU; none is passed if None.
    substep : float
        Step of the integration in model exchange [s].
    library : Path or None
        Library to load instead of that in the FMU.
    resources : str or None
        Location of the resources to pass instead of the folder in the FMU.
    host : Host
        Platform on which the importer runs.
    """

    folder: Path
    kind: str = "cs"
    points: Any = (0.0, 1e-3)
    sets: Mapping[str, float] = field(default_factory=dict)
    changes: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    records: Sequence[str] = ()
    tolerance: float | None = None
    substep: float = 2e-5
    library: Path | None = None
    resources: str | None = None
    host: Host = NATIVE

    def text(self) -> str:
        """Return the text of the job file."""
        found = _description(self.folder)
        variables = {v.name: v for v in found.modelVariables if v.type in TYPES}
        version = int(found.fmiVersion[0])
        interface = found.modelExchange if self.kind == "me" else found.coSimulation
        named = {n: f"{v.valueReference} {TYPES[v.type]}" for n, v in variables.items()}
        library = self.library or self._library(interface.modelIdentifier)
        resources = self.folder / "resources"
        location = self.host.uri(resources) if version == 2 else self.host.path(resources)
        lines = [
            f"fmi {version}",
            f"kind {self.kind}",
            f"library {self.host.path(library)}",
            f"resources {location if self.resources is None else self.resources}",
            "name an instance",
            f"token {found.guid if version == 2 else found.instantiationToken}",
            f"start {_bits(self.points[0])}",
            f"substep {_bits(self.substep)}",
        ]
        if self.kind == "me":
            states = found.numberOfContinuousStates
            lines += [f"states {states}", f"indicators {found.numberOfEventIndicators}"]
        if self.tolerance is not None:
            lines.append(f"tolerance {_bits(self.tolerance)}")
        lines += [f"set {named[name]} {_bits(x)}" for name, x in self.sets.items()]
        lines += [f"record {named[name]}" for name in self.records or named]
        for k, time in enumerate(self.points[1:]):
            change = self.changes.get(k, {})
            lines += [f"change {named[name]} {_bits(x)}" for name, x in change.items()]
            lines.append(f"point {_bits(time)}")
        return "\n".join(lines) + "\n"

    def _library(self, identifier: str) -> Path:
        for folder in self.host.folders:
            path = self.folder / "binaries" / folder / (identifier + self.host.suffix)
            if path.is_file():
                return path
        pytest.skip(f"the FMU has no library for {self.host.name}")

    def names(self) -> list[str]:
        """Return the names of the recorded variables: the columns after the time."""
        found = _description(self.folder)
        return [*self.records] or [v.name for v in found.modelVariables if v.type in TYPES]

    def on(self, host: Host) -> "Job":
        return replace(self, host=host)


def _bits(x: float) -> str:
    return struct.pack(">d", float(x)).hex()


@dataclass(frozen=True)
class Result:
    """The result of a job: exit status, standard output and errors, names of the columns."""

    status: int
    output: bytes
    errors: str
    names: Sequence[str]

    def rows(self, marks: str = "p") -> np.ndarray:
        """Return the rows with one of the marks as a structured array; ``at`` is the time."""
        lines = [line.split() for line in self.output.decode().splitlines()]
        numbers = [
            [struct.unpack(">d", bytes.fromhex(word))[0] for word in words[1:]]
            for words in lines
            if words[0] in marks
        ]
        kinds = [(name, float) for name in ("at", *self.names)]
        return np.array([tuple(row) for row in numbers], dtype=kinds)


def unpack(fmu: Path, folder: Path) -> Path:
    """Unpack an FMU into a folder."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    return folder


def execute(
    job: Job,
    *words: Any,
    program: Path | None = None,
    before: Sequence[str] = (),
    environment: Mapping[str, str] | None = None,
    timeout: float = 600.0,
) -> Result:
    """Run the importer with a job; a failure is in the status of the result."""
    host = job.host
    program = program or importer(host)
    needs(*host.emulator[:1], *before[:1])
    with tempfile.TemporaryDirectory(prefix="prbm_job_") as name:
        file = Path(name) / "job.txt"
        file.write_text(job.text(), encoding="utf-8")
        own = {"WINEPREFIX": str(shared_folder() / f"wine-{os.getpid()}")} if host.windows else {}
        done = subprocess.run(
            [*host.emulator, *before, str(program), host.path(file), *map(str, words)],
            capture_output=True, check=False, timeout=timeout,
            env=os.environ | own | dict(host.environment) | dict(environment or {}),
        )  # fmt: skip
    return Result(done.returncode, done.stdout, done.stderr.decode(errors="replace"), job.names())


def run(job: Job, *words: Any, **options: Any) -> Result:
    """Run the importer with a job that must succeed."""
    done = execute(job, *words, **options)
    assert done.status == 0, done.errors
    return done


@cache
def described(model: str) -> Mechanism:
    """Return a mechanism by name: a shipped one, or one of three that only the tests use.

    ``TWO_STOPS`` is the 2R guide with two stops with friction.  ``ANVIL`` has two bodies that hit
    each other, on flexures that stretch.  ``COMPLIANT`` is a pivot between two compliant stops
    with friction, with outputs of the stress.
    """
    if model == ANVIL:
        return anvil()
    if model == COMPLIANT:
        pivot = two_compliant_stops()
        rough = tuple(dataclasses.replace(stop, friction=0.2) for stop in pivot.stops)
        return dataclasses.replace(pivot, stops=rough)
    if model != TWO_STOPS:
        return mechanism(model)
    place = ("shuttle.width", "flexure.length + shuttle.com_height")
    stops = [
        Stop(name, "shuttle", place, offset=offset, friction=friction, restitution=restitution)
        for name, offset, friction, restitution in (
            ("high", 0.01, 0.3, 0.7),
            ("low", -0.01, 0.1, 0.5),
        )
    ]
    return dataclasses.replace(mechanism("PRBDM2R"), name=TWO_STOPS, stops=tuple(stops))


@cache
def host_fmu(model: str, fmi: int) -> Path:
    """Return the path of the native FMU of a mechanism for this machine.

    One process builds both versions, because they have the same reference results.
    """

    def make(folder: Path) -> None:
        for version in (2, 3):
            write(folder / f"fmi{version}" / f"{model}.fmu", built(described(model), version))

    return once(f"native-{model}", make) / f"fmi{fmi}" / f"{model}.fmu"


@cache
def native(model: str, fmi: int, platform: str = "host") -> Path:
    """Return the folder of an unpacked native FMU; the FMU is beside it, with the suffix .fmu."""
    name = f"{model}-{fmi}-{platform}"

    def make(path: Path) -> None:
        if platform == "host":
            shutil.copy(host_fmu(model, fmi), path)
        else:
            write(path, built(described(model), fmi, (platform,)))

    fmu = once(f"{name}.fmu", make)
    return once(name, lambda path: unpack(fmu, path))


@cache
def native_clock(model: str) -> Path:
    """Return the folder of an unpacked native FMU of FMI 3.0 with a clock."""
    name = f"{model}-clock"
    fmu = once(f"{name}.fmu", lambda path: write(path, built(described(model), fmi=3, clock=True)))
    return once(name, lambda path: unpack(fmu, path))


PLAIN = ("plain", ("-g",))
WITHOUT_VECTORS = ("without-vectors", ("-DPRBM_PLAIN",))
"""Names and options of libraries that several tests use: see :func:`kernel_library`."""


@cache
def kernel_library(
    name: str, flags: tuple[str, ...], compiler: str = "cc", host: Host = NATIVE, target: str = ""
) -> Path:
    """Return the library of the native FMUs, compiled with more flags; it fits every mechanism.

    The compiler is that of ziglang if a target is given.
    """
    system = () if host.windows else ("-fPIC", "-lm")
    shared = ("-shared", "-fvisibility=hidden", *flags, *system)
    sources = [KERNEL / "prbm_fmu.c"]
    return once(
        f"{name}{host.suffix}",
        lambda path: compile_c(path, sources, shared, target, compiler),
    )
