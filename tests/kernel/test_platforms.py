"""Libraries for other platforms: dependencies, exported names, and results bit by bit."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from c_importer import (
    ARM,
    HEADERS,
    KERNEL,
    NATIVE,
    PLAIN,
    TWO_STOPS,
    WINE,
    WITHOUT_VECTORS,
    Job,
    compile_c,
    kernel_library,
    native,
    needs,
    run,
    unpack,
)

pytestmark = [pytest.mark.native, pytest.mark.slow]

# Functions import lief, because this takes half a second in each process that collects tests.

POINTS = 1e-3 * np.arange(301)
SYSTEMS = {
    "linux": {"libc.so.6", "libm.so.6"},
    "windows": {"kernel32.dll", "msvcrt.dll"},
    "darwin": {"/usr/lib/libSystem.B.dylib"},
}
UNIVERSAL_RUNTIME = re.compile(r"api-ms-win-crt-[a-z]+-l1-1-0\.dll")  # Part of Windows 10.
OLDEST_GLIBC = (2, 17)
OLDEST_MACOS = (11, 0)
MACHINES = {"x86_64": ("X86_64", "AMD64"), "aarch64": ("AARCH64", "ARM64")}
FOLDERS = {
    2: {
        "x86_64-linux": "linux64",
        "x86_64-windows": "win64",
        "x86_64-darwin": "darwin64",
    },
    3: {},
}
PLATFORMS = [f"{m}-{s}" for m in MACHINES for s in SYSTEMS]


@pytest.fixture(scope="module")
def library():
    """Return the library of a platform in the FMU of a version."""

    def find(fmi: int, platform: str):
        name = FOLDERS[fmi].get(platform, platform)
        (path,) = (native("PRBDM", fmi, "all") / "binaries" / name).iterdir()
        return path

    return find


def functions_of_the_standards() -> set[str]:
    """Return the names of all functions of FMI 2.0 and 3.0, from the standards' headers."""
    names = set()
    for version in (2, 3):
        header = (HEADERS / f"fmi{version}FunctionTypes.h").read_text(encoding="utf-8")
        names |= set(re.findall(rf"\b(fmi{version}\w+)TYPE\b", header))
    return names


def dependencies(library) -> set[str]:
    """Return the names of the libraries that a library needs."""
    import lief

    if isinstance(library, lief.MachO.Binary):
        own = lief.MachO.LoadCommand.TYPE.ID_DYLIB
        return {item.name for item in library.libraries if item.command != own}
    if isinstance(library, lief.PE.Binary):
        return {name.lower() for name in library.libraries}
    return set(library.libraries)


def exported(library) -> set[str]:
    """Return the names that a library exports."""
    import lief

    if isinstance(library, lief.PE.Binary):
        return {entry.name for entry in library.get_export().entries}
    names = {symbol.name for symbol in library.exported_symbols}
    if isinstance(library, lief.MachO.Binary):  # The linker adds two symbols to every library.
        names = {name.removeprefix("_") for name in names}
        names -= {"__mh_dylib_header", "_mh_dylib_header", "__dso_handle", "___dso_handle"}
    return names


@pytest.mark.parametrize("platform", PLATFORMS)
def test_a_library_is_for_its_platform_and_exports_only_functions_of_fmi(library, platform):
    import lief

    machine, _, system = platform.partition("-")
    found = lief.parse(str(library(3, platform)))
    assert exported(found) == functions_of_the_standards()
    kind = found.header.cpu_type if system == "darwin" else (
        found.header.machine if system == "windows" else found.header.machine_type
    )  # fmt: skip
    assert kind.name in MACHINES[machine]
    needed = {name for name in dependencies(found) if not UNIVERSAL_RUNTIME.fullmatch(name)}
    assert needed <= SYSTEMS[system]


@pytest.mark.parametrize("machine", MACHINES)
def test_the_linux_library_runs_with_glibc_2_17(library, machine):
    import lief

    found = lief.parse(str(library(3, f"{machine}-linux")))
    versions = [
        symbol.name
        for needed in found.symbols_version_requirement
        for symbol in needed.get_auxiliary_symbols()
    ]
    assert versions
    for version in versions:
        numbers = tuple(int(x) for x in version.removeprefix("GLIBC_").split("."))
        assert numbers[:2] <= OLDEST_GLIBC, version


@pytest.mark.parametrize("machine", MACHINES)
def test_the_macos_library_is_a_dylib_for_macos_11(library, machine):
    """On ARM64 the library needs a signature; the anonymous one of the linker is sufficient."""
    import lief

    found = lief.parse(str(library(3, f"{machine}-darwin")))
    assert found.header.file_type == lief.MachO.Header.FILE_TYPE.DYLIB
    assert tuple(found.build_version.minos[:2]) <= OLDEST_MACOS
    assert found.has_code_signature or machine == "x86_64"
    own = [item for item in found.libraries if item.command == lief.MachO.LoadCommand.TYPE.ID_DYLIB]
    assert [item.name.startswith("@rpath/") for item in own] == [True]


def test_the_libraries_of_both_fmi_versions_are_identical(library):
    for platform in PLATFORMS:
        assert library(2, platform).read_bytes() == library(3, platform).read_bytes()


WARNED = {
    "Linux": ("x86_64-linux-gnu.2.17", "-O0"),
    "Windows": ("x86_64-windows-gnu", "-O0"),
    "macOS": ("aarch64-macos.11.0", "-O0"),
    "FMI 2.0 alone": ("", "-O0", "-DPRBM_FMI=2"),
    "FMI 3.0 alone": ("", "-O0", "-DPRBM_FMI=3"),
}


@pytest.mark.parametrize("name", WARNED)
def test_the_kernel_compiles_without_a_warning(tmp_path, name):
    target, *flags = WARNED[name]
    needs("cc")
    compile_c(tmp_path / "kernel.o", [KERNEL / "prbm_fmu.c"], ["-c", *flags], target)


@pytest.mark.parametrize("library", [PLAIN, WITHOUT_VECTORS], ids=lambda library: library[0])
def test_libraries_of_the_system_s_compiler_have_no_warning(library):
    """Other tests use these libraries.  Warnings of optimized code differ from those at -O0."""
    assert kernel_library(*library).is_file()


# -- bytes --


def output(host, model: str, fmi: int, kind: str) -> bytes:
    return run(Job(native(model, fmi, "all"), kind, POINTS, host=host)).output


@pytest.mark.parametrize(("fmi", "kind"), [(2, "cs"), (3, "events"), (3, "me")])
@pytest.mark.parametrize("model", ["PRBDM", TWO_STOPS])
@pytest.mark.parametrize("host", [WINE, ARM], ids=lambda host: host.name)
def test_every_platform_computes_the_same_bytes(host, model, fmi, kind):
    assert output(host, model, fmi, kind) == output(NATIVE, model, fmi, kind)


@pytest.mark.parametrize("model", ["PRBDM", TWO_STOPS])
def test_every_compiler_computes_the_same_bytes(model):
    """The compilers are that of the system and ziglang."""
    host = run(Job(native(model, 2), "cs", POINTS))
    assert output(NATIVE, model, 2, "cs") == host.output


@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R", "GuideBeam", TWO_STOPS])
def test_a_compiler_without_vectors_computes_the_same_bytes(model):
    """Compilers other than GCC and Clang use the code without vectors."""
    job = Job(native(model, 2), "cs", POINTS)
    plain = kernel_library(*WITHOUT_VECTORS)
    assert run(replace(job, library=plain)).output == run(job).output


PLACES = ("with spaces", "Prüfstand µ", "a#b+c 100%20 %")


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_runs_from_any_folder_on_windows(tmp_path: Path, fmi: int, place: str):
    """Paths have spaces, characters outside of ASCII, and characters that a URI encodes."""
    folder = unpack(native("PRBDM", fmi, "all").with_suffix(".fmu"), tmp_path / place)
    assert run(Job(folder, host=WINE)).output == run(Job(folder)).output
