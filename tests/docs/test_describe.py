"""The page that teaches to describe a mechanism does what it shows, from an empty folder."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from prbm.analysis.stretching import notes, restitution, stretching
from prbm.files.mechanism_file import read_mechanism
from support import ROOT

PAGE = (ROOT / "docs" / "describe-your-mechanism.md").read_text()


def blocks(kind: str) -> list[str]:
    return re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)


def write_file(folder: Path) -> Path:
    """Fill the file of the page from top to bottom."""
    (folder / "lever").mkdir()
    path = folder / "lever" / "lever.toml"
    path.write_text("\n".join(blocks("toml")))
    return path


def test_the_pieces_are_a_mechanism_file(tmp_path: Path) -> None:
    lever = read_mechanism(write_file(tmp_path))
    assert lever.name == "Lever"
    assert lever.drawing.splitlines()[-1].split() == ["left", "right"]
    # all variables that the text names are there, but for those of an FMU's outputs
    named = set(re.findall(r"`((?:leaf|petg|lever|stop)\.\w+)`", PAGE))
    outputs = {"lever.toml", "lever.x", "lever.angle", "stop.contact", "stop.impact_count"}
    assert named - outputs <= set(lever.values())
    assert len(named - outputs) >= 5


def test_stretching_matters_to_the_impact_of_the_lever_as_the_page_says(tmp_path: Path) -> None:
    lever = read_mechanism(write_file(tmp_path))
    said = re.search(r"lever of this page goes from (\d\.\d+) to (\d\.\d+)", PAGE)
    assert said is not None
    as_it_is, stretched = map(float, said.groups())
    (told,) = notes(lever, {})
    assert "off the centre of mass of lever" in told
    assert restitution(lever, {}, 0) == pytest.approx(as_it_is, abs=0.005)
    assert restitution(stretching(lever), {}, 0) == pytest.approx(stretched, abs=0.005)


@pytest.mark.fmu
@pytest.mark.native
def test_the_page_from_a_sketch_to_a_simulation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Commands end well, code runs, and what the page says is printed is printed."""
    write_file(tmp_path)
    monkeypatch.chdir(tmp_path)
    paths = os.pathsep.join([str(ROOT / "fmu_src"), *os.environ.get("PYTHONPATH", "").split(":")])
    for block in blocks("sh"):
        for line in block.splitlines():
            program, *words = shlex.split(line)
            assert program in ("python", "prbm")
            if program == "prbm":
                words = ["-m", "prbm", *words]
            words = [str(ROOT / word) if word == "build_fmu.py" else word for word in words]
            subprocess.run(
                [sys.executable, *words], check=True, env=os.environ | {"PYTHONPATH": paths}
            )
    with (
        Image.open("lever/lever.png") as drawn,
        Image.open(ROOT / "docs/figures/lever.png") as ours,
    ):
        assert drawn.size == ours.size
    for folder in ("python", "fmi2", "fmi3"):
        assert Path("lever", folder, "Lever.fmu").exists()
    capsys.readouterr()
    space: dict[str, object] = {}
    for block in blocks("python"):
        exec(compile(block, "describe-your-mechanism.md", "exec"), space)
    printed = capsys.readouterr().out.splitlines(keepends=True)
    told = [line for line in printed if not line.startswith("Warning: missing input")]  # FMPy's
    assert "".join(told) == "".join(blocks("text"))
