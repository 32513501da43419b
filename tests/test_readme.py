"""What the README shows runs as it stands there."""

import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


@pytest.mark.fmu
def test_python_blocks_run(fmus, tmp_path, monkeypatch, capsys):
    """In order, in a folder that holds what the first command has built."""
    folder = tmp_path / "dist" / "python"
    folder.mkdir(parents=True)
    for name, path in fmus.items():
        shutil.copy(path, folder / f"{name}.fmu")
    monkeypatch.chdir(tmp_path)
    assert len(BLOCKS) == 2
    for block in BLOCKS:
        exec(compile(block, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert re.search(r"^\d+ impacts, resting: True$", printed, re.MULTILINE)
    assert len(re.findall(r"^0\.\d{6} s: \d\.\d{4} m/s$", printed, re.MULTILINE)) == 3


def test_files_that_the_readme_names_exist():
    named = set(re.findall(r"\]\(([^)#:]+)\)", README))
    named |= {name for name in re.findall(r"`([\w./]+)`", README) if "/" in name}
    for name in named - {"dist/python/PRBDM.fmu", "dist/python/PRBDM2R.fmu"}:
        assert (ROOT / name).exists() or name == "documentation/index.html", name


def test_there_are_two_commands():
    """The first installs, builds and simulates; the second runs the tests."""
    commands = README.split("<!-- commands -->")[1].split("<!-- end -->")[0]
    lines = [line for line in commands.splitlines() if line and not line.startswith("```")]
    assert len(lines) == 2
    assert "build_fmu.py --simulate" in lines[0]
    assert "pytest" in lines[1]
