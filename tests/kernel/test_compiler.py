"""Compilation of the kernel for each platform: cache, choice of the compiler, error messages.

Most tests compile a short stub instead of the kernel.
"""

import hashlib
import os
import re
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import pytest

from prbm.kernel import compiler
from prbm.kernel.compiler import (
    ALL,
    HOST,
    PLATFORMS,
    CompilerError,
    NoCompilerError,
    cache_folder,
    libraries,
    this_platform,
)
from support import ROOT

STUB = b"""
#include <math.h>
#define EXPORTED __attribute__((visibility("default")))
EXPORTED const char *fmi2GetVersion(void) { return "2.0"; }
EXPORTED const char *fmi3GetVersion(void) { return sqrt(4.0) > 1.0 ? "3.0" : ""; }
"""
SYSTEM = shutil.which("cc")

pytestmark = [
    pytest.mark.native,
    pytest.mark.skipif(SYSTEM is None or os.name != "posix", reason="needs the command cc"),
]


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    """Return an empty cache; the stub replaces the kernel, and CC is not set."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compiler, "kernel", lambda: {"prbm_fmu.c": STUB})
    monkeypatch.setattr(compiler, "_loaded", {})
    return cache_folder()


def entries(cache: Path) -> list[Path]:
    """Return the libraries in the cache."""
    return [p for p in cache.iterdir() if p.name != "lock"] if cache.is_dir() else []


def only(made: dict) -> bytes:
    """Return the content of the single library."""
    (content,) = made.values()
    return content


def script(path: Path, text: str) -> Path:
    """Write an executable shell script."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


def without_ziglang(monkeypatch) -> None:
    monkeypatch.setattr(compiler.importlib.util, "find_spec", lambda name: None)


def test_a_second_export_takes_the_library_from_the_cache(cache, monkeypatch):
    messages: list[str] = []
    first = libraries([HOST], messages.append)
    monkeypatch.setattr(compiler, "_loaded", {})  # The memory of a new process is empty.
    monkeypatch.setattr(compiler, "compiled", lambda *_: pytest.fail("compiled again"))
    assert libraries([HOST], messages.append) == first
    (message,) = messages
    assert message.startswith(f"compiling the kernel for {this_platform().name} with cc, once")
    assert len(entries(cache)) == 1


def test_a_changed_kernel_is_compiled_again(cache, monkeypatch):
    first = only(libraries([HOST]))
    monkeypatch.setattr(compiler, "kernel", lambda: {"prbm_fmu.c": STUB.replace(b"2.0", b"2.1")})
    assert only(libraries([HOST])) != first
    assert len(entries(cache)) == 2


def test_a_library_is_reproducible_and_contains_no_path(cache, monkeypatch):
    first = only(libraries([HOST]))
    shutil.rmtree(cache)
    monkeypatch.setattr(compiler, "_loaded", {})
    assert only(libraries([HOST])) == first
    assert b"prbm_" not in first.replace(b"prbm_fmu", b"")
    assert str(Path.home()).encode() + b"/" not in first


def test_error_without_a_compiler_names_the_packages_to_install(cache, monkeypatch):
    monkeypatch.setenv("PATH", "")
    without_ziglang(monkeypatch)
    with pytest.raises(NoCompilerError, match=r"needs a C compiler.*gcc.*pip install ziglang"):
        libraries([HOST])


def test_error_for_other_platforms_without_ziglang_names_ziglang(cache, monkeypatch):
    without_ziglang(monkeypatch)
    for platforms in ([ALL], ["x86_64-windows"]):
        with pytest.raises(NoCompilerError, match=r"pip install ziglang"):
            libraries(platforms)


@pytest.mark.parametrize("chosen", ["no-such-compiler", "false", "'unclosed"])
def test_error_names_a_compiler_that_does_not_run(cache, monkeypatch, chosen):
    monkeypatch.setenv("CC", chosen)
    with pytest.raises(CompilerError, match=re.escape(f"CC = {chosen!r} is not a working")):
        libraries([HOST])


def test_error_contains_the_last_lines_of_the_compiler_output(cache, tmp_path, monkeypatch):
    bad = script(
        tmp_path / "bin" / "bad",
        '[ "$1" = --version ] && echo bad 1.0 && exit 0\n'
        "for i in 1 2 3 4 5 6 7 8 9; do echo line $i >&2; done; exit 3",
    )
    monkeypatch.setenv("CC", shlex.quote(str(bad)))
    with pytest.raises(CompilerError, match=r"status 3: line 4; .*line 9\)") as error:
        libraries([HOST])
    assert "line 3" not in str(error.value)
    assert "\n" not in str(error.value)
    assert entries(cache) == []


def test_the_next_compiler_is_used_if_one_fails(cache, tmp_path, monkeypatch):
    folder = script(tmp_path / "bin" / "cc", '[ "$1" = --version ] && exit 0; exit 1').parent
    script(folder / "gcc", f'exec {SYSTEM} "$@"')
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    messages: list[str] = []
    assert only(libraries([HOST], messages.append))
    assert "with cc, once" in messages[0]
    assert "with gcc, once" in messages[1]


def test_a_compiler_that_writes_no_file_is_an_error(cache, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", shlex.quote(str(script(tmp_path / "bin" / "idle", "exit 0"))))
    with pytest.raises(CompilerError, match=r"cannot compile .*status 0: no message"):
        libraries([HOST])


def test_a_compiler_that_has_been_removed_is_an_error(cache):
    removed = compiler.Compiler(("/none/cc",), "cc 1.0", "cc")
    job = compiler.Job(this_platform(), removed, compiler.FMU, {"prbm_fmu.c": STUB})
    with pytest.raises(CompilerError, match=r"cc cannot be run \(No such file .*; install one"):
        compiler.compiled(job)


def test_an_error_of_the_temporary_folder_is_one_of_the_compilation(cache, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    with pytest.raises(CompilerError, match=r"temporary folder \(No such file .*variable TMPDIR"):
        libraries([HOST])


def test_an_unreadable_source_is_an_error_of_the_compilation(cache, monkeypatch):
    def unreadable():
        raise PermissionError(13, "Permission denied", "walls.c")

    monkeypatch.setattr(compiler, "kernel", unreadable)
    with pytest.raises(CompilerError, match=r"walls\.c cannot be read \(Permission denied\)"):
        libraries([HOST])


def test_options_in_the_variable_cc_are_passed_to_the_compiler(cache, monkeypatch):
    monkeypatch.setenv("CC", f"{SYSTEM} -DEXTRA")
    stub = STUB + b"\n#ifndef EXTRA\n#error\n#endif\n"
    monkeypatch.setattr(compiler, "kernel", lambda: {"prbm_fmu.c": stub})
    assert only(libraries([HOST]))


def test_a_missing_function_is_an_error_of_the_compilation(cache, monkeypatch):
    stub = STUB + b"\nextern int missing(void);\nEXPORTED int fmi2Reset(void *c)"
    stub += b"{ return c ? missing() : 0; }"
    monkeypatch.setattr(compiler, "kernel", lambda: {"prbm_fmu.c": stub})
    monkeypatch.setenv("CC", SYSTEM)
    with pytest.raises(CompilerError, match="missing"):
        libraries([HOST])


def test_libraries_are_compiled_without_a_cache_if_it_cannot_be_written(cache, monkeypatch):
    cache.parent.parent.mkdir(exist_ok=True)
    cache.parent.write_text("a file where the folder should be", encoding="utf-8")
    messages: list[str] = []
    made = libraries([HOST], messages.append)
    assert only(made)
    assert messages[1].startswith(f"the folder {cache} cannot be written")
    assert libraries([HOST], messages.append) == made  # From the memory of this process.
    assert len(messages) == 2


def planted(cache: Path, folder: Path, monkeypatch) -> Path:
    """Put a valid entry with other contents into a folder of the cache; return the entry."""
    libraries([HOST])
    (entry,) = entries(cache)
    content = b"planted library"
    valid = compiler.MAGIC + hashlib.sha256(content).digest() + content
    folder.mkdir(exist_ok=True)
    (folder / entry.name).write_bytes(valid)
    (folder / entry.name).chmod(0o644)
    monkeypatch.setattr(compiler, "_loaded", {})
    assert only(libraries([HOST])) == content  # A private entry is valid.
    monkeypatch.setattr(compiler, "_loaded", {})
    return folder / entry.name


def owned_by_another(monkeypatch, *paths: Path) -> None:
    """Let files appear as those of another user."""
    stats, fstat = os.stat, os.fstat
    others = {(stats(path).st_dev, stats(path).st_ino) for path in paths}

    def changed(found: os.stat_result) -> os.stat_result:
        if (found.st_dev, found.st_ino) not in others:
            return found
        return os.stat_result((*found[:4], os.geteuid() + 1, *found[5:]))

    monkeypatch.setattr(os, "fstat", lambda handle: changed(fstat(handle)))
    monkeypatch.setattr(Path, "stat", lambda path, **options: changed(stats(path, **options)))


def test_a_library_that_others_could_write_is_not_used(cache, monkeypatch):
    entry = planted(cache, cache, monkeypatch)
    entry.chmod(0o664)
    assert b"planted" not in only(libraries([HOST]))
    assert not entry.stat().st_mode & 0o022
    assert b"planted" not in entry.read_bytes()


def test_a_library_of_another_user_is_not_used(cache, monkeypatch):
    entry = planted(cache, cache, monkeypatch)
    owned_by_another(monkeypatch, entry)
    assert b"planted" not in only(libraries([HOST]))


def test_a_cache_of_another_user_is_replaced_by_a_private_one(cache, monkeypatch):
    """Several users may share XDG_CACHE_HOME."""
    planted(cache, cache, monkeypatch)
    owned_by_another(monkeypatch, cache)
    reported: list[str] = []
    assert b"planted" not in only(libraries([HOST], reported.append))
    own = cache.with_name(f"prbm-impact-{os.geteuid()}")
    assert len(entries(own)) == 1
    assert own.stat().st_mode & 0o777 == 0o700
    assert len(reported) == 1


def test_without_a_private_folder_the_library_is_compiled_and_not_stored(cache, monkeypatch):
    own = cache.with_name(f"prbm-impact-{os.geteuid()}")
    planted(cache, cache, monkeypatch)
    own.mkdir()
    owned_by_another(monkeypatch, cache, own)
    reported: list[str] = []
    assert b"planted" not in only(libraries([HOST], reported.append))
    assert reported[1].startswith(f"the folder {cache} cannot be written, or other users")
    assert entries(own) == []


def test_a_cache_folder_that_others_could_write_is_made_private(cache, monkeypatch):
    """The folder gets the mode 0700, and the compiler's files in it are removed."""
    cache.mkdir(parents=True)
    (cache / "zig").mkdir()
    (cache / "zig" / "planted.o").write_bytes(b"")
    cache.chmod(0o777)
    libraries([HOST])
    assert cache.stat().st_mode & 0o777 == 0o700
    assert not (cache / "zig" / "planted.o").exists()
    assert len(entries(cache)) == 1


@pytest.mark.parametrize("depth", [0, 1])
@pytest.mark.parametrize(("mode", "kept"), [(0o777, 0), (0o1777, 1), (0o755, 1)])
@pytest.mark.parametrize("linked", [False, True])
def test_a_folder_that_others_could_exchange_is_not_used(
    cache, tmp_path, monkeypatch, depth, mode, kept, linked
):
    """Others can rename it if they may write to a folder above, unless this is sticky."""
    inside = tmp_path / "above" / "shared"
    inside.mkdir(parents=True)
    if linked:
        (tmp_path / "link").symlink_to(inside)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "link" if linked else inside))
    (inside, inside.parent)[depth].chmod(mode)
    assert only(libraries([HOST]))
    assert len(entries(inside / "prbm-impact")) == kept


@pytest.mark.parametrize("damage", [b"", b"garbage", "truncated", "flipped"])
def test_a_damaged_entry_of_the_cache_is_compiled_again(cache, monkeypatch, damage):
    made = libraries([HOST])
    (entry,) = entries(cache)
    good = entry.read_bytes()
    flipped = good[:-1] + bytes([good[-1] ^ 1])
    entry.write_bytes({"truncated": good[:-1], "flipped": flipped}.get(damage, damage))
    monkeypatch.setattr(compiler, "_loaded", {})
    assert libraries([HOST]) == made
    assert entry.read_bytes() == good


def test_an_interrupted_compilation_leaves_no_file_in_the_cache(cache, monkeypatch):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as context:
        context.setattr(compiler.os, "replace", interrupted)
        with pytest.raises(KeyboardInterrupt):
            libraries([HOST])
    assert entries(cache) == []
    with monkeypatch.context() as context:
        context.setattr(compiler, "compiled", interrupted)
        with pytest.raises(KeyboardInterrupt):
            libraries([HOST])
    assert entries(cache) == []
    assert only(libraries([HOST]))  # The lock has been released.


@pytest.mark.slow
def test_simultaneous_exports_compile_once(cache, tmp_path):
    log = tmp_path / "log"
    note = f"echo one >> {shlex.quote(str(log))}; sleep 1"
    slow = script(
        tmp_path / "bin" / "slow",
        f'[ "$1" = --version ] || {{ {note}; }}\nexec {SYSTEM} "$@"',
    )
    code = (
        "from prbm.kernel import compiler\n"
        f"compiler.kernel = lambda: {{'prbm_fmu.c': {STUB!r}}}\n"
        "import hashlib\n"
        "for made in compiler.libraries(['host']).values():\n"
        "    print(hashlib.sha256(made).hexdigest())"
    )
    environment = os.environ | {"CC": shlex.quote(str(slow)), "PYTHONPATH": str(ROOT / "fmu_src")}
    started = [
        subprocess.Popen(
            [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True
        )
        for _ in range(3)
    ]
    printed = {process.communicate()[0] for process in started}
    assert [process.returncode for process in started] == [0, 0, 0]
    assert len(printed) == 1
    assert log.read_text(encoding="utf-8") == "one\n"


def test_the_lock_of_a_process_that_died_is_released(cache):
    code = (
        "import os, sys\nfrom pathlib import Path\nfrom prbm.kernel import compiler\n"
        "with compiler._locked(Path(sys.argv[1])): os._exit(9)"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT / "fmu_src")}
    done = subprocess.run([sys.executable, "-c", code, str(cache)], env=environment, check=False)
    assert done.returncode == 9
    assert (cache / "lock").exists()
    assert only(libraries([HOST]))


def test_error_on_an_unsupported_machine_names_the_option_for_all_platforms(cache, monkeypatch):
    monkeypatch.setattr(compiler.platform, "machine", lambda: "riscv64")
    assert this_platform() is None
    with pytest.raises(NoCompilerError, match=r"this machine \(riscv64, .*--platform all"):
        libraries([HOST])


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads ELF with nm")
def test_the_library_exports_only_functions_of_fmi_and_needs_only_libc(tmp_path):
    """The library is that of the kernel; other exported names could clash with other libraries."""
    library = tmp_path / "prbm.so"
    library.write_bytes(only(libraries([HOST])))
    named = subprocess.run(
        ["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True
    ).stdout.split()[2::3]
    assert len(named) > 100
    assert {name[:4] for name in named} == {"fmi2", "fmi3"}
    needed = subprocess.run(
        ["readelf", "-d", library], capture_output=True, text=True, check=True
    ).stdout
    libc = {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
    assert set(re.findall(r"NEEDED.*\[(.*)\]", needed)) <= libc


MACHINES = {
    "x86_64-linux": (b"\x7fELF\x02", 18, 62),
    "aarch64-linux": (b"\x7fELF\x02", 18, 183),
    "x86_64-windows": (b"MZ", None, 0x8664),
    "aarch64-windows": (b"MZ", None, 0xAA64),
    "x86_64-darwin": (b"\xcf\xfa\xed\xfe", 4, 0x0007),
    "aarch64-darwin": (b"\xcf\xfa\xed\xfe", 4, 0x000C),
}


@pytest.mark.slow
def test_ziglang_makes_a_library_for_every_platform(native, mechanisms, tmp_path):
    """Each has the format and machine of its platform; those for Linux need at most glibc 2.17."""
    from prbm.fmu import native_fmu

    pytest.importorskip("ziglang")
    made = {platform.name: content for platform, content in libraries([ALL]).items()}
    assert made.keys() == MACHINES.keys() == PLATFORMS.keys()
    for name, content in made.items():
        magic, offset, machine = MACHINES[name]
        assert content.startswith(magic), name
        if offset is None:
            offset = struct.unpack_from("<I", content, 0x3C)[0] + 4
        assert struct.unpack_from("<H", content, offset) == (machine,), name
        if name.endswith("linux"):
            versions = {int(v) for v in re.findall(rb"GLIBC_2\.(\d+)", content)}
            assert max(versions) <= 17, name
    for fmi, folders in ((2, {"linux64", "win64", "darwin64"}), (3, {"x86_64-linux"})):
        path = tmp_path / f"{fmi}.fmu"
        path.write_bytes(native_fmu.build(mechanisms["PRBDM"], fmi=fmi, platforms=[ALL]))
        with zipfile.ZipFile(path) as fmu:
            names = [n for n in fmu.namelist() if n.startswith("binaries/")]
            assert "documentation/licenses/mingw-w64.txt" in fmu.namelist()
            digests = {hashlib.sha256(fmu.read(n)).digest() for n in names}
        assert folders <= {n.split("/")[1] for n in names}
        assert len(names) == len(digests) == len(PLATFORMS)


@pytest.mark.parametrize("option", ["-ffast-math", "-ffinite-math-only"])
def test_options_that_change_results_are_named(monkeypatch, option):
    monkeypatch.setenv("CC", f"{SYSTEM} {option}")
    (found,) = compiler._system_compilers()
    job = compiler.Job(compiler._host(), found, compiler.ENGINE, compiler.kernel())
    with pytest.raises(compiler.CompilerError, match="-ffast-math and its parts change"):
        compiler.compiled(job)
