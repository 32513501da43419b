"""The code and the commands of the README and of the page on native FMUs run."""

import re
import shlex
import shutil
import tomllib

import pytest

import prbm
from prbm.base.version import __version__
from prbm.commands.command_line import main
from prbm.runs.engine import KERNEL, PYTHON, kernel_available
from support import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
NATIVE = (ROOT / "docs" / "native-fmus.md").read_text(encoding="utf-8")


def blocks(text: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


@pytest.fixture
def _built(fmus, native, tmp_path, monkeypatch) -> None:
    """Change to a folder with the FMUs of the guides, in the folders of ``prbm build``."""
    paths = {("python", name): path for name, path in fmus.items()}
    paths |= {(f"fmi{fmi}", name): path for (name, fmi), path in native.items()}
    for (folder, name), path in paths.items():
        there = tmp_path / "dist" / folder
        there.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, there / f"{name}.fmu")
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
@pytest.mark.fmu
@pytest.mark.native
@pytest.mark.usefixtures("_built")
def test_python_blocks_of_the_readme_run(capsys):
    assert len(blocks(README)) == 2
    for block in blocks(README):
        exec(compile(block, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert re.search(r"^\d+ impacts, resting: True$", printed, re.MULTILINE)
    assert len(re.findall(r"^0\.\d{6} s: \d\.\d{4} m/s$", printed, re.MULTILINE)) == 3


@pytest.mark.slow
@pytest.mark.fmu
@pytest.mark.native
@pytest.mark.usefixtures("_built")
def test_native_fmus_have_equal_impacts_in_all_interfaces_of_their_page(capsys):
    """Newton's law holds at the first impact, with a coefficient of restitution of 0.6."""
    space: dict[str, object] = {}
    for block in blocks(NATIVE):
        exec(compile(block, "native-fmus.md", "exec"), space)
    printed = capsys.readouterr().out
    assert re.findall(r"^(.*): 14 impacts$", printed, re.MULTILINE) == [
        "co-simulation", "model exchange"
    ]  # fmt: skip
    before, after = map(float, re.findall(r"(-?0\.\d+) m/s", printed))
    # The impact is centred, and the wall does not move.
    assert after == pytest.approx(-0.6 * before, abs=1e-4)  # Printed with four decimals.


def test_files_that_the_readme_names_exist():
    named = set(re.findall(r"\]\(([^)#:]+)\)", README))
    named |= {name for name in re.findall(r"`([\w./]+)`", README) if "/" in name}
    for name in named:
        built = name.startswith("dist/") or name == "documentation/index.html"
        assert built or (ROOT / name).exists(), name


def test_the_readme_prints_the_result_of_its_first_command(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (command,) = re.findall(r"^pip install \. && prbm (.*)$", README, re.MULTILINE)
    assert main(shlex.split(command)) == 0
    printed = capsys.readouterr().out
    (block,) = re.findall(r"```text\n(.*?)```", README, re.DOTALL)
    for line in block.splitlines():
        assert line in printed
    files = ("PRBDM2R.csv", "PRBDM2R-impacts.csv", "PRBDM2R.png", "PRBDM2R-run.json")
    assert {path.name for path in (tmp_path / "results").iterdir()} == set(files)


def test_two_commands_set_up_the_development():
    """The first command installs, builds and simulates; the second runs the tests."""
    commands = README.split("<!-- commands -->")[1].split("<!-- end -->")[0]
    lines = [line for line in commands.splitlines() if line and not line.startswith("```")]
    assert len(lines) == 2
    assert "build_fmu.py --simulate" in lines[0]
    assert "pytest" in lines[1]


def test_the_named_wheel_has_the_present_version():
    assert {*re.findall(r"prbm_impact-([\d.]+)-py3-none-any\.whl", README)} == {__version__}


def test_the_extras_of_the_readme_are_those_of_the_project():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = {x for text in re.findall(r"(?:whl|\.)\[([\w,]+)\]", README) for x in text.split(",")}
    assert {"notebook", "sweep"} <= named <= {*project["optional-dependencies"]}


def test_the_readme_names_the_option_that_prints_the_version(capsys):
    assert "`prbm --version`" in README
    assert main(["--version"]) == 0
    assert __version__ in capsys.readouterr().out


def test_the_kernel_is_the_default_engine_as_the_readme_says():
    result = prbm.simulate(prbm.load("PRBDM"), stop_time=1e-3)
    assert result.engine == (KERNEL if kernel_available() else PYTHON)
    assert prbm.simulate(prbm.load("PRBDM"), stop_time=1e-3, engine=PYTHON).engine == PYTHON
