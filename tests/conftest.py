"""What several test files need: the shipped mechanisms and their FMUs, built once."""

from collections.abc import Callable, Hashable, Iterable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from prbm import Mechanism
from prbm_fmu import native_fmu, python_fmu
from prbm_fmu.archive import write
from prbm_tools.mechanism_file import shipped
from support import COSTLY, GUIDES, mechanism


class Built(dict[Any, Path]):
    """FMUs by what they are of: the guides' at once, others when they are asked for."""

    def __init__(self, build: Callable[[Any], Path], first: Iterable[Hashable]) -> None:
        super().__init__((key, build(key)) for key in first)
        self.build = build

    def __missing__(self, key: Hashable) -> Path:
        self[key] = self.build(key)
        return self[key]


def without_results(*_: object) -> dict[str, bytes]:
    """Stand in for the reference results of what takes the engine long."""
    return {}


@pytest.fixture(scope="session")
def mechanisms() -> dict[str, Mechanism]:
    """Return the shipped mechanisms by name."""
    return {name: mechanism(name) for name in shipped()}


@pytest.fixture(scope="session")
def fmus(
    mechanisms: dict[str, Mechanism], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Path]:
    """Return the Python FMUs by name."""
    folder = tmp_path_factory.mktemp("fmus")

    def built(name: str) -> Path:
        write(folder / f"{name}.fmu", python_fmu.build(mechanisms[name]))
        return folder / f"{name}.fmu"

    return Built(built, GUIDES)


@pytest.fixture(scope="session")
def native(
    mechanisms: dict[str, Mechanism], tmp_path_factory: pytest.TempPathFactory
) -> dict[tuple[str, int], Path]:
    """Return the native FMUs for this machine, by name and version of FMI.

    Those that take the engine long are without reference results.
    """
    folder = tmp_path_factory.mktemp("native")

    def built(key: tuple[str, int]) -> Path:
        name, fmi = key
        path = folder / f"fmi{fmi}" / f"{name}.fmu"
        with patch.object(native_fmu, "reference", without_results if name in COSTLY else native_fmu.reference):
            write(path, native_fmu.build(mechanisms[name], fmi=fmi))
        return path

    return Built(built, [(name, fmi) for name in GUIDES for fmi in (2, 3)])
