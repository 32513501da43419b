"""The wheel with libraries: two builds are identical, and no compiler is needed with it."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from fmpy import simulate_fmu

from prbm.kernel.compiler import BROWSER, LIVE, PLATFORMS, PRODUCTS, cache_folder

ROOT = Path(__file__).parents[2]

pytestmark = [pytest.mark.slow, pytest.mark.native]


def cache_without(suffix: str, folder: Path) -> Path:
    """Return a folder of caches with the user's libraries, except those with a suffix.

    It shares the folder in which ziglang keeps the libraries of the systems.
    """
    kept, cache = cache_folder() / "zig", folder / "cache" / cache_folder().name
    for path in (kept, cache):
        path.mkdir(parents=True, exist_ok=True, mode=0o700)
    (cache / "zig").symlink_to(kept)
    for library in cache_folder().iterdir():
        if library.is_file() and library.suffix not in ("", suffix):
            shutil.copy2(library, cache)
    return cache.parent


def built(folder: Path, **environment: str) -> Path:
    """Build the wheel with changes of the environment; return its path."""
    pytest.importorskip("ziglang")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder / "dist"],
        cwd=ROOT, check=True, capture_output=True,
        env=os.environ | {"PRBM_LIBRARIES": "all"} | environment,
    )  # fmt: skip
    (wheel,) = (folder / "dist").iterdir()
    return wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Build the wheel with the user's cache, from which other tests have the same libraries."""
    return built(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> dict[str, str]:
    """Install the wheel; return an environment that has it, and no compiler."""
    folder = tmp_path_factory.mktemp("installed")
    command = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", folder, wheel]
    subprocess.run(command, check=True)
    cache = tmp_path_factory.mktemp("cache")
    kept = {name: os.environ[name] for name in os.environ if name not in ("CC", "PATH")}
    return kept | {"PYTHONPATH": str(folder), "PATH": str(cache), "XDG_CACHE_HOME": str(cache)}


def run(words: str, environment: dict[str, str], folder: Path) -> str:
    """Run a module of the installed package in a folder; return the printed text."""
    done = subprocess.run(
        [sys.executable, "-m", *words.split()], cwd=folder, env=environment, capture_output=True,
        text=True, check=True,
    )  # fmt: skip
    assert "compiling" not in done.stdout + done.stderr
    return done.stdout


def test_two_builds_of_the_wheel_are_identical(wheel, tmp_path):
    """The second build compiles the libraries for Windows again: their format has dates."""
    again = built(tmp_path, XDG_CACHE_HOME=str(cache_without(".dll", tmp_path)))
    assert wheel.read_bytes() == again.read_bytes()


def test_the_wheel_lists_the_hash_of_each_library_and_is_small(wheel):
    assert wheel.stat().st_size < 6e6
    assert wheel.name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        listed = json.loads(archive.read("prbm/kernel/libraries/libraries.json"))
        assert listed["libraries"].keys() == {
            *(f"{p.name}/{q.name}{p.suffix}" for p in PLATFORMS.values() for q in PRODUCTS),
            f"{BROWSER.name}/{LIVE.name}{BROWSER.suffix}",
        }
        for name, digest in listed["libraries"].items():
            content = archive.read(f"prbm/kernel/libraries/{name}")
            assert hashlib.sha256(content).hexdigest() == digest
        licences = {Path(name).name for name in archive.namelist() if "/licenses/" in name}
    assert {"LICENSE", "mingw-w64.txt", "zig.txt"} <= licences


def test_fmus_for_all_platforms_are_built_without_a_compiler(installed, tmp_path):
    assert "PRBDM2R" in run("prbm list", installed, tmp_path)
    run("prbm simulate PRBDM2R --stop-time 0.3s --out results", installed, tmp_path)
    build = "prbm build PRBDM2R --flavour native --platform all"
    run(build, installed, tmp_path)
    for fmi in (2, 3):
        fmu = tmp_path / "dist" / f"fmi{fmi}" / "PRBDM2R.fmu"
        with zipfile.ZipFile(fmu) as archive:
            names = [name for name in archive.namelist() if name.startswith("binaries/")]
        assert len(names) == len(PLATFORMS)
        assert simulate_fmu(str(fmu), output=["stop.impact_count"])["stop.impact_count"][-1] > 5
