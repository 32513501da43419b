"""The code and the commands of docs/describe-your-mechanism.md run in an empty folder."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from prbm.analysis.adequacy import Cause, Impact, Quantity, check
from prbm.files.mechanism_file import read_mechanism
from support import ROOT

PAGE = (ROOT / "docs" / "describe-your-mechanism.md").read_text(encoding="utf-8")


def blocks(kind: str) -> list[str]:
    return re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)


def write_file(folder: Path) -> Path:
    """Write the mechanism file of the page, all pieces in order."""
    path = folder / "lever.toml"
    path.write_text("\n".join(blocks("toml")), encoding="utf-8")
    return path


def test_the_pieces_of_the_page_are_a_mechanism_file(tmp_path: Path) -> None:
    lever = read_mechanism(write_file(tmp_path))
    assert lever.name == "Lever"
    assert lever.drawing.splitlines()[-1].split() == ["left", "right"]
    # All parameters that the text names exist; points and outputs are not among the values.
    named = set(re.findall(r"`((?:leaf|petg|lever|stop)\.\w+)`", PAGE))
    others = {"lever.toml", "lever.left", "lever.x", "lever.angle"}
    others |= {"stop.contact", "stop.impact_count"}
    assert named - others <= set(lever.values())
    assert len(named - others) >= 5


def test_the_page_gives_the_modal_restitution_with_and_without_stretch(tmp_path: Path) -> None:
    lever = read_mechanism(write_file(tmp_path))
    match = re.search(r"`axial = true` changes it from ([\d.]+) to ([\d.]*\d)\.", PAGE)
    assert match is not None
    inextensible, stretched = map(float, match.groups())
    found = check(lever, {}, [Impact(0)])
    (finding,) = (one for one in found if one.quantity is Quantity.RESTITUTION)
    assert finding.cause is Cause.INEXTENSIBLE
    assert "off the centre of mass of lever" in str(finding)
    assert finding.found == pytest.approx(inextensible, abs=0.005)
    assert finding.better == pytest.approx(stretched, abs=0.005)


@pytest.mark.fmu
@pytest.mark.native
@pytest.mark.slow
def test_commands_and_code_of_the_page_print_its_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_file(tmp_path)
    monkeypatch.chdir(tmp_path)
    paths = os.pathsep.join([str(ROOT / "fmu_src"), *os.environ.get("PYTHONPATH", "").split(":")])
    for block in blocks("sh"):
        for line in block.splitlines():
            command = [sys.executable, "-m", *shlex.split(line)]
            subprocess.run(command, check=True, env=os.environ | {"PYTHONPATH": paths})
    with (
        Image.open("lever.png") as drawn,
        Image.open(ROOT / "docs/figures/lever.png") as ours,
    ):
        assert drawn.size == ours.size
    for folder in ("python", "fmi2", "fmi3"):
        assert Path("dist", folder, "Lever.fmu").exists()
    capsys.readouterr()
    space: dict[str, object] = {}
    for block in blocks("python"):
        exec(compile(block, "describe-your-mechanism.md", "exec"), space)
    printed = capsys.readouterr().out.splitlines(keepends=True)
    lines = [line for line in printed if not line.startswith("Warning: missing input")]  # FMPy.
    assert "".join(lines) == "".join(blocks("text"))
