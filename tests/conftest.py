"""What several test files need: the shipped mechanisms and their FMUs, built once."""

from collections.abc import Callable, Hashable, Iterable
from pathlib import Path
from typing import Any

import pytest

from prbm.base.atomic import write
from prbm.files.mechanism_file import shipped
from prbm.fmu import python_fmu
from prbm.mechanism.description import Mechanism
from support import GUIDES, built, mechanism

collect_ignore = ["support"]  # imported by tests, not collected


class Built(dict[Any, Path]):
    """FMUs by what they are of: the guides' at once, others when they are asked for."""

    def __init__(self, build: Callable[[Any], Path], first: Iterable[Hashable]) -> None:
        super().__init__((key, build(key)) for key in first)
        self.build = build

    def __missing__(self, key: Hashable) -> Path:
        self[key] = self.build(key)
        return self[key]


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

    def one(name: str) -> Path:
        write(folder / f"{name}.fmu", python_fmu.build(mechanisms[name]))
        return folder / f"{name}.fmu"

    return Built(one, GUIDES)


@pytest.fixture(scope="session")
def native(
    mechanisms: dict[str, Mechanism], tmp_path_factory: pytest.TempPathFactory
) -> dict[tuple[str, int], Path]:
    """Return the native FMUs for this machine, by name and version of FMI.

    Those that take the engine long are without reference results.
    """
    folder = tmp_path_factory.mktemp("native")

    def one(key: tuple[str, int]) -> Path:
        name, fmi = key
        path = folder / f"fmi{fmi}" / f"{name}.fmu"
        write(path, built(mechanisms[name], fmi))
        return path

    return Built(one, [(name, fmi) for name in GUIDES for fmi in (2, 3)])
