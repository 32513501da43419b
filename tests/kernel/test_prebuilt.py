"""Libraries inside the installed package."""

import pytest

from prbm.kernel import compiler, prebuilt
from prbm.kernel.compiler import PLATFORMS, libraries, this_platform
from prbm.kernel.prebuilt import FOLDER, LIST, DamagedLibraryError

SOURCES = {"a.c": b"int a;", "b.c": b"int b;"}
NAME = "x86_64-linux/prbm_fmu.so"
UNREADABLE = object()  # Stands for a file that cannot be read.


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Return a folder that replaces the installed package; it has two libraries."""
    made = {NAME: b"library", "x86_64-windows/prbm_fmu.dll": b"another"}
    for name, content in prebuilt.package_files(made, "a compiler", SOURCES).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(content)
    monkeypatch.setattr(prebuilt, "files", lambda _: tmp_path)
    return tmp_path


def test_a_library_of_the_package_is_used(package):
    assert prebuilt.prebuilt(NAME, SOURCES) == b"library"


def test_a_library_is_not_used_after_a_change_of_the_source(package):
    assert prebuilt.prebuilt(NAME, SOURCES | {"a.c": b"int c;"}) is None
    assert prebuilt.prebuilt(NAME, {"a.c": SOURCES["a.c"]}) is None


def test_a_library_that_the_package_does_not_list_is_missing_and_not_damaged(package):
    assert prebuilt.prebuilt("aarch64-linux/prbm_fmu.so", SOURCES) is None


def test_a_library_compiled_during_the_installation_serves_this_machine_alone(
    tmp_path, monkeypatch
):
    """It may need the C library of this machine, and so is not one for the platform."""
    here = this_platform()
    assert here is not None
    made = {f"host/prbm_fmu{here.suffix}": b"own"}
    for name, content in prebuilt.package_files(made, "cc", compiler.kernel()).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(content)
    monkeypatch.setattr(prebuilt, "files", lambda _: tmp_path)
    monkeypatch.setattr(compiler, "_library", lambda *_: b"compiled")
    monkeypatch.delenv("CC", raising=False)
    assert libraries(["host"]) == {here: b"own"}
    assert libraries([here.name]) == {here: b"compiled"}


def test_a_package_without_libraries_has_none(tmp_path, monkeypatch):
    monkeypatch.setattr(prebuilt, "files", lambda _: tmp_path)
    assert prebuilt.prebuilt(NAME, SOURCES) is None


@pytest.mark.parametrize(
    ("file", "content"),
    [
        (NAME, b"librarx"),
        (NAME, b""),
        (NAME, None),
        (LIST, b"{"),
        (LIST, b"[]"),
        (LIST, b"\xff"),
        (LIST, UNREADABLE),
    ],
)
def test_error_for_a_damaged_package_names_the_file_and_the_remedy(package, file, content):
    path = package / FOLDER / file
    path.unlink()
    if content is UNREADABLE:
        path.mkdir()
    elif content is not None:
        path.write_bytes(content)
    with pytest.raises(DamagedLibraryError, match=rf"{file} of the .* damaged.*--force-reinstall"):
        prebuilt.prebuilt(NAME, SOURCES)


def test_cc_replaces_the_library_of_the_package_for_this_machine_alone(tmp_path, monkeypatch):
    made = {f"{p.name}/prbm_fmu{p.suffix}": p.name.encode() for p in PLATFORMS.values()}
    for name, content in prebuilt.package_files(made, "a compiler", compiler.kernel()).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(content)
    monkeypatch.setattr(prebuilt, "files", lambda _: tmp_path)
    monkeypatch.setattr(compiler, "_library", lambda *_: b"compiled")
    monkeypatch.delenv("CC", raising=False)
    found = libraries(["all"], lambda step: pytest.fail(step))
    assert {p.name: content for p, content in found.items()} == {p: p.encode() for p in PLATFORMS}
    here = this_platform()
    assert here is not None
    assert libraries(["host"]) == {here: here.name.encode()}
    monkeypatch.setenv("CC", "cc")
    assert libraries(["host"]) == {here: b"compiled"}
    found = libraries(["all"])
    assert {p.name: content for p, content in found.items()} == {p: p.encode() for p in PLATFORMS}


def test_live_pages_use_the_module_of_the_package_even_if_cc_is_set(tmp_path, monkeypatch):
    made = {"wasm32-wasi/prbm_live.wasm": b"module"}
    for name, content in prebuilt.package_files(made, "a compiler", compiler.kernel()).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(content)
    monkeypatch.setattr(prebuilt, "files", lambda _: tmp_path)
    monkeypatch.setenv("CC", "cc")
    assert compiler.browser_module(lambda step: pytest.fail(step)) == b"module"
