"""The code and the command of docs/studies.md run, and the command prints the text of the page."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from prbm.commands.command_line import main
from support import ROOT

PAGE = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_code_of_the_page_runs():
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    found = {}
    exec(compile(block, "studies.md", "exec"), found)
    assert np.isfinite(found["found"].outputs["settling"]).all()


@pytest.mark.slow
def test_the_command_of_the_page_finds_the_optimum_of_the_page(tmp_path, monkeypatch, capsys):
    """The irregular side of the optimum depends on errors of the integration: 2 % are allowed."""
    monkeypatch.chdir(tmp_path)
    command, shocks, limited = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    assert main(shlex.split(limited.replace("\\\n", " "))[1:]) == 0
    assert "constraints: fundamental > 5 Hz (5" in capsys.readouterr().out
    assert main(shlex.split(shocks.replace("\\\n", " "))[1:]) == 0
    assert "height [-]  impact_speed [m/s]" in capsys.readouterr().out
    assert main(shlex.split(command.replace("\\\n", " "))[1:]) == 0
    (text,) = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
    printed, shown = (
        [float(x) for x in re.findall(r"(-?\d+\.\d+) m?[ms]\b", lines)]
        for lines in (capsys.readouterr().out.split("failed\n")[1], text)
    )
    assert printed[0] == pytest.approx(shown[0], rel=0.02)
    assert -2.4 < printed[1] < -1.2
    assert printed[3] == pytest.approx(shown[3], abs=0.1)
    assert Path("results/PRBDM2R-study.png").exists()
