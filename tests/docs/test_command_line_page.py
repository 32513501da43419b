"""The commands and the code of the section on the repetition of a run in docs/command-line.md."""

import re
import shlex

from prbm.commands.command_line import main
from support import ROOT

PAGE = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")


def test_the_code_of_the_page_repeats_the_run_of_its_command(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    section = PAGE.split("## Repeat a run\n")[1].split("\n## ")[0]
    commands, code = (
        re.findall(rf"```{kind}\n(.*?)```", section, re.DOTALL)[0] for kind in ("sh", "python")
    )
    for line in commands.splitlines():
        assert main(shlex.split(line)[1:]) == 0
    written = {path.name for path in (tmp_path / "results").iterdir()}
    assert {"PRBDM-run.json", "PRBDM-study-run.json"} <= written
    (count,) = re.findall(r"impacts at stop +(\d+),", capsys.readouterr().out)
    exec(compile(code, "command-line.md", "exec"), {})
    assert capsys.readouterr().out == f"{count} True\n"
