"""The commands and the code of CONTRIBUTING.md run, and the files and names in it exist."""

import re
import shlex
import subprocess
import sys

import pytest

from prbm.mechanism import flexure
from support import ROOT

PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
LINES = [
    line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL) for line in block.splitlines()
]
SELECTIONS = [line for line in LINES if line.startswith("python -m pytest -q")]
PACKAGE = ROOT / "fmu_src" / "prbm"


def names() -> set[str]:
    """Return the texts in backticks outside the blocks and the table of style."""
    prose = re.sub(r"```.*?```", "", PAGE.partition("## Style")[0], flags=re.DOTALL)
    return set(re.findall(r"`([^`]+)`", prose))


def test_the_set_up_is_that_of_the_readme():
    assert README.split("<!-- commands -->\n```sh\n")[1].startswith("\n".join(LINES[:2]))


def test_the_linters_are_those_of_all_checks():
    checks = (
        (ROOT / ".ci" / "run")
        .read_text(encoding="utf-8")
        .replace("ruff format --check", "ruff format")
    )
    linters = [line for line in LINES[2:] if not line.startswith("python ")]
    assert len(linters) == 6
    assert {f"check {line}" for line in linters} <= set(checks.splitlines())


def test_the_paths_of_the_commands_exist():
    paths = [word for line in SELECTIONS for word in shlex.split(line) if "/" in word]
    assert len(paths) > 5
    for path in paths:
        assert (ROOT / path).exists(), path


@pytest.mark.slow
@pytest.mark.parametrize("line", SELECTIONS)
def test_the_commands_select_tests(line):
    words = [sys.executable, *shlex.split(line)[1:], "--collect-only"]
    found = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout
    assert "::" in found.stdout


def test_the_flexure_model_of_the_page_has_the_stiffness_of_a_beam_under_an_end_moment():
    block = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)[0]
    found = dict(vars(flexure))
    exec(compile(block, "CONTRIBUTING.md", "exec"), found)
    model = found["model"]
    assert model.name == f"{len(model.gamma)}R"
    assert model.end_slope == pytest.approx(1.0)
    assert flexure.stub([c.value for c in model.gamma]) < 0.05


def test_files_that_the_page_names_exist():
    files = {
        name for name in names() if re.fullmatch(r"[\w./-]+/[\w./-]*|[\w-]+\.(py|toml|md)", name)
    }
    assert len(files) > 30
    for name in files:
        folders = (ROOT, PACKAGE, ROOT / "tests" / "kernel")
        assert any((folder / name).exists() for folder in folders), name


@pytest.mark.slow
def test_names_in_the_page_occur_in_the_sources():
    sources = [*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.[ch]"), *(ROOT / "tests").rglob("*.py")]
    text = "\n".join(path.read_text(encoding="utf-8") for path in sources)
    for name in names():
        if re.fullmatch(r"[A-Za-z_]+", name):
            assert re.search(rf"\b{name}\b", text) or (PACKAGE / name).exists(), name
