"""Contents of the wheel and the sdist."""

import os
import re
import shlex
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

from prbm.commands.missing import missing_package

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "fmu_src"


@pytest.fixture(scope="module")
def dist(tmp_path_factory) -> Path:
    """Return a folder with the wheel and the sdist of the project."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-t", "sdist", "-d", folder],
        cwd=ROOT, check=True, capture_output=True,
        env=os.environ | {"PRBM_LIBRARIES": "none"},
    )  # fmt: skip
    return folder


def source_files() -> set[str]:
    files = (path for path in (SOURCE / "prbm").rglob("*") if path.is_file())
    return {
        path.relative_to(SOURCE).as_posix() for path in files if "__pycache__" not in path.parts
    }


def test_a_wheel_installs_one_import_package_with_all_its_files(dist):
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
        "version"
    ]
    (wheel,) = dist.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if not name.endswith("/")}
    info = f"prbm_impact-{version}.dist-info"
    assert {name.partition("/")[0] for name in names} == {"prbm", info}
    assert {name for name in names if name.startswith("prbm/")} == source_files()
    assert f"{info}/licenses/LICENSE" in names


def test_an_sdist_has_one_import_package_with_all_its_files(dist):
    (sdist,) = dist.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    inside = {name.removeprefix("fmu_src/") for name in names if name.startswith("fmu_src/")}
    assert inside == source_files()
    assert {"LICENSE", "README.md", "pyproject.toml", "build_fmu.py", "hatch_build.py"} <= names


@pytest.mark.parametrize("kind", [".c", ".h", ".toml", ".txt", ".py"])
def test_c_sources_data_and_licences_are_files_of_the_package(kind):
    assert [name for name in source_files() if name.endswith(kind)]


def test_extras_are_quoted_for_all_shells_wherever_they_are_to_be_installed():
    """Brackets are patterns in zsh; cmd.exe knows double quotes only."""
    texts = [*(ROOT / "fmu_src").rglob("*.py"), *(ROOT / "docs").glob("*.md"), ROOT / "README.md"]
    found = [
        (path.name, command[0])
        for path in texts
        for command in re.finditer(r"install [^\n`]{0,12}(.)prbm-impact\[", path.read_text("utf-8"))
        if command[1] != '"'
    ]
    assert found == []
    command = missing_package(ModuleNotFoundError(name="rainflow")).partition(": ")[2]
    assert shlex.split(command)[-1] == "prbm-impact[fatigue]"
    assert '"prbm-impact[fatigue]"' in command
