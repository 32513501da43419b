"""The C functions that the kernel calls: none whose result differs between platforms.

The results of floor, ldexp and the like are exact, those of sin or pow are not.  Square roots are
instructions of the processor, because the function of a library may round twice.

Undefined symbols of an object file are the calls that remain after the compiler's own replacements,
such as sincos.  Those of a linked library are not enough: on Windows and in WebAssembly the
functions of the C library are linked into it.
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from live import node
from prbm.kernel.compiler import (
    BROWSER,
    ENGINE,
    FMU,
    LIVE,
    PLATFORMS,
    Compiler,
    Job,
    Platform,
    Product,
    _host_compilers,
    _zig,
    compiled,
    libraries,
    this_platform,
)
from prbm.kernel.sources import ENGINE_UNIT, UNIT, kernel

pytestmark = pytest.mark.native

EXACT = {"ceil", "copysign", "floor", "frexp", "ldexp", "nextafter"}
ALLOWED = EXACT | {
    *("calloc", "free", "malloc", "realloc"),
    *("memchr", "memcmp", "memcpy", "memmove", "memset"),
    *("strchr", "strcmp", "strlen", "strstr", "wcscpy", "wcscspn", "wcslen", "wmemcpy"),
    *("fclose", "ferror", "fopen", "_wfopen", "fread", "snprintf", "vsnprintf"),
    # Names that compilers use for the functions above, and to extend the stack.
    *("bcmp", "bzero", "__bzero", "__memcpy_chk", "memset_pattern16"),
    *("__chkstk", "___chkstk_ms"),
}
LINKED = {"__cxa_finalize", "__gmon_start__", "__stack_chk_fail", "_ITM_deregisterTMCloneTable",
          "_ITM_registerTMCloneTable"}  # fmt: skip
"""Functions that the linker and its start files add to a library for Linux."""

HOST = "the system's compiler"
TARGETS = [HOST, *PLATFORMS, BROWSER.name]
SAMPLE = """
#include <math.h>
double real(double x) { return sqrt(x) * tan(exp(log(cbrt(x)))) + pow(x, hypot(x, 1.0)); }
float single(float x) { return powf(x, x); }
double both(double x) { return sin(x) * cos(x); }
double _Complex square(double _Complex x) { return x * x; }
"""
INEXACT = {"cbrt", "exp", "hypot", "log", "pow", "powf", "tan", "__muldc3"}
SINES = {"sin", "cos", "sincos", "__sincos", "__sincos_stret"}
IMPORTS = """
const module = new WebAssembly.Module(require("node:fs").readFileSync(process.argv[1]));
const functions = WebAssembly.Module.imports(module).filter((item) => item.kind === "function");
console.log(JSON.stringify(functions.map((item) => item.name)));
"""


def undefined(path: Path) -> set[str]:
    """Return the names of the functions that an object file or a library does not define."""
    import lief  # This takes half a second in each process that collects tests.

    if path.read_bytes()[:4] == b"\0asm":
        return set(json.loads(node("-e", IMPORTS, path)))
    found = lief.parse(str(path))
    if isinstance(found, lief.COFF.Binary):
        absent = (s.name for s in found.symbols if s.section_idx == s.value == 0)
        return {name.removeprefix("__imp_") for name in absent}
    if isinstance(found, lief.MachO.Binary):
        absent = (s.name for s in found.symbols if s.is_external and not s.numberof_sections)
        return {name.removeprefix("_") for name in absent}
    return {s.name for s in found.symbols if s.shndx == 0 and s.name}


def target(name: str) -> tuple[Platform, Compiler, tuple[str, ...]]:
    """Return the platform, its compiler, and the options of its libraries."""
    if name == HOST:
        here = this_platform()
        assert here is not None
        return here, next(_host_compilers()), FMU.flags
    pytest.importorskip("ziglang")
    chosen = BROWSER if name == BROWSER.name else PLATFORMS[name]
    return chosen, _zig(chosen)[0], LIVE.flags if chosen is BROWSER else FMU.flags


def called(name: str, files: Mapping[str, bytes], folder: Path) -> set[str]:
    """Return the names of the functions that sources call and do not define."""
    platform, compiler, flags = target(name)
    path = folder / "object.o"
    path.write_bytes(compiled(Job(platform, compiler, Product("object", (*flags, "-c")), files)))
    return undefined(path)


def sources(name: str) -> dict[str, bytes]:
    """Return the kernel with the functions of all libraries of a target in one unit.

    WebAssembly has one library, the others have that of FMUs and that of the Python package.
    """
    files, others = kernel(), f'\n#include "{ENGINE_UNIT}"\n'.encode()
    return files if name == BROWSER.name else files | {UNIT: files[UNIT] + others}


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_the_kernel_calls_no_inexact_function(tmp_path, name):
    found = called(name, sources(name), tmp_path)
    assert found > {"realloc", "ldexp"}
    assert found - ALLOWED == set()


@pytest.mark.parametrize(
    "name", [HOST, *(pytest.param(name, marks=pytest.mark.slow) for name in TARGETS[1:])]
)
def test_calls_of_inexact_functions_are_found(tmp_path, name):
    found = called(name, {UNIT: SAMPLE.encode()}, tmp_path)
    assert found - ALLOWED - SINES == INEXACT
    assert found & SINES


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="start files of Linux")
@pytest.mark.parametrize("product", [FMU, ENGINE], ids=lambda product: product.name)
def test_the_libraries_for_this_machine_call_no_inexact_function(tmp_path, product):
    path = tmp_path / "library.so"
    (content,) = libraries(["host"], product=product).values()
    path.write_bytes(content)
    found = undefined(path)
    assert found > {"realloc", "ldexp"}
    assert found - ALLOWED - LINKED == set()
