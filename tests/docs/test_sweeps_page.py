"""The code and the command of docs/sweeps.md run."""

import re
import shlex
import shutil
from pathlib import Path

import pandas as pd
import pytest

from prbm.commands.command_line import main
from support import ROOT

PAGE = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")

pytestmark = [pytest.mark.fmu, pytest.mark.native]


@pytest.mark.slow
def test_code_and_command_of_the_page_give_equal_results(native, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("dist/fmi2").mkdir(parents=True)
    shutil.copy(native["PRBDM2R", 2], "dist/fmi2/PRBDM2R.fmu")
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    found = {}
    exec(compile(block, "sweeps.md", "exec"), found)
    assert "since(stop.contact)" in capsys.readouterr().out
    results = found["results"]
    assert (results["status"] == "ok").all()

    found["table"].to_csv("table.csv", index=False)
    (command,) = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    words = shlex.split(command.replace("\\\n", " ").replace("settling", "command"))
    assert words[0] == "prbm"
    assert main(words[1:]) == 0
    again = pd.read_parquet("command.parquet").sort_values("row", ignore_index=True)
    for name in ("stop.impact_count", "since(stop.contact)"):
        assert again[name].equals(results[name])
