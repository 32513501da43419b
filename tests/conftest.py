"""What several test files need: the shipped mechanisms and their FMUs, built once."""

from pathlib import Path

import pytest

from prbm import Mechanism
from prbm_fmu import native_fmu, python_fmu
from prbm_fmu.archive import write
from prbm_tools.mechanism_file import load, shipped

BUILT = ("PRBDM", "PRBDM2R")  # what the tests of FMUs simulate; others take longer to build


@pytest.fixture(scope="session")
def mechanisms() -> dict[str, Mechanism]:
    """Return the shipped mechanisms by name."""
    return {name: load(path) for name, path in shipped().items()}


@pytest.fixture(scope="session")
def fmus(
    mechanisms: dict[str, Mechanism], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Path]:
    """Return the Python FMUs of the guides by name."""
    folder = tmp_path_factory.mktemp("fmus")
    paths = {}
    for name in BUILT:
        paths[name] = folder / f"{name}.fmu"
        write(paths[name], python_fmu.build(mechanisms[name]))
    return paths


@pytest.fixture(scope="session")
def native(
    mechanisms: dict[str, Mechanism], tmp_path_factory: pytest.TempPathFactory
) -> dict[tuple[str, int], Path]:
    """Return the native FMUs of the guides for this machine, by name and version of FMI."""
    folder = tmp_path_factory.mktemp("native")
    paths = {}
    for name in BUILT:
        for fmi in (2, 3):
            paths[name, fmi] = folder / f"fmi{fmi}" / f"{name}.fmu"
            write(paths[name, fmi], native_fmu.build(mechanisms[name], fmi=fmi))
    return paths
