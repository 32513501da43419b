"""The code and the commands of docs/inputs.md run."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from prbm.commands.command_line import main
from prbm.runs.inputs import FILE, SHAPES
from support import ROOT

PAGE = (ROOT / "docs" / "inputs.md").read_text(encoding="utf-8")


def test_the_code_of_the_page_gives_equal_results_for_equal_signals():
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    found = {}
    exec(compile(block, "inputs.md", "exec"), found)
    assert found["result"]["base.acceleration.x"].max() == pytest.approx(50 * 9.80665)
    sampled, computed = found["sampled"]["shuttle.x"], found["computed"]["shuttle.x"]
    np.testing.assert_allclose(sampled, computed, atol=1e-7)


def test_the_table_of_the_page_lists_all_signals_with_their_arguments():
    listed = dict(re.findall(r"^\| `([\w-]+)\((.*?)\)` \|", PAGE, re.MULTILINE))
    written = {shape: ", ".join(arguments) for shape, arguments in SHAPES.items()}
    assert listed == {**written, FILE: "FILE, COLUMN"}


@pytest.mark.slow
def test_the_commands_of_the_page_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    for line in block.splitlines():
        assert main(shlex.split(line)[1:]) == 0
    assert Path("results/PRBDM2R.csv").exists()
    assert Path("shaken.gif").exists()
