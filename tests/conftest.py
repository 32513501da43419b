"""Fixtures for all tests: the shipped mechanisms and their FMUs, each built once per run."""

import os
import shutil
import tempfile
from collections.abc import Callable, Hashable, Iterable, Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # Tests run beside each other.

import pytest
from hypothesis import HealthCheck, settings

from c_importer import host_fmu
from prbm.base.atomic import write
from prbm.files.mechanism_file import shipped
from prbm.fmu import python_fmu
from prbm.fmu.unpack import plain_folder
from prbm.mechanism.description import Mechanism
from shared import once, shared_folder
from support import GUIDES, SUPPORT, mechanism

collect_ignore = ["support"]  # Modules that tests import; they contain no tests.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")
LONGEST = "tests/project/test_wheel_with_libraries.py"  # It takes minutes and is started first.


class FmuCache(dict[Any, Path]):
    """Paths of FMUs by key.  FMUs of the keys in ``first`` are built at once, others on access."""

    def __init__(self, build: Callable[[Any], Path], first: Iterable[Hashable]) -> None:
        super().__init__((key, build(key)) for key in first)
        self.build = build

    def __missing__(self, key: Hashable) -> Path:
        self[key] = self.build(key)
        return self[key]


def further_cases() -> dict[str, set[str]]:
    """Return the parameters with which a test is slow, by the name of the test."""
    lines = (SUPPORT / "further_cases.txt").read_text("utf-8").splitlines()
    pairs = (line.split(": ", 1) for line in lines if not line.startswith("#"))
    return {name: {*parameters.split(" | ")} for name, parameters in pairs}


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the further cases of a test as slow; put the longest tests first."""
    further = further_cases()
    for item in items:
        name, _, case = item.nodeid.partition("[")
        case = case.removesuffix("]")
        if further.get(name, set()) & {case, *case.split("-")}:
            item.add_marker(pytest.mark.slow)
    items.sort(key=lambda item: not item.nodeid.startswith(LONGEST))


@pytest.fixture(scope="session")
def mechanisms() -> dict[str, Mechanism]:
    """Return the shipped mechanisms by name."""
    return {name: mechanism(name) for name in shipped()}


@pytest.fixture(scope="session")
def fmus(mechanisms: dict[str, Mechanism]) -> dict[str, Path]:
    """Return the paths of the Python FMUs by name of the mechanism."""

    def build(name: str) -> Path:
        def make(folder: Path) -> None:
            write(folder / f"{name}.fmu", python_fmu.build(mechanisms[name]))

        return once(f"python-{name}", make) / f"{name}.fmu"

    return FmuCache(build, GUIDES)


@pytest.fixture
def plain_temporary_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[None]:
    """Let other programs unpack Python FMUs to a folder that pythonfmu can read."""
    shared_folder()  # The files of the test run stay in its own folder.
    tmp_path_factory.getbasetemp()  # Those of pytest too.
    folder = tempfile.mkdtemp(dir=plain_folder())
    monkeypatch.setattr(tempfile, "tempdir", folder)
    monkeypatch.setenv("TMPDIR", folder)
    yield
    shutil.rmtree(folder)


@pytest.fixture(scope="session")
def native() -> dict[tuple[str, int], Path]:
    """Return the paths of the native FMUs for this machine, by name and version of FMI."""
    return FmuCache(lambda key: host_fmu(*key), [(name, fmi) for name in GUIDES for fmi in (2, 3)])
