"""The commands of docs/strength.md and docs/compliant-stops.md run in an empty folder."""

import re
import shlex

import pytest

from prbm.commands import command_line as cli
from support import ROOT


@pytest.mark.slow
@pytest.mark.parametrize("page", ["strength", "compliant-stops"])
def test_commands_of_the_page_run_in_an_empty_folder(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(
        r"```sh\n(.*?)```", (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8"), re.DOTALL
    )
    lines = [shlex.split(line) for block in blocks for line in block.splitlines()]
    assert lines
    for program, *words in lines:
        assert program == "prbm"
        assert cli.main(words) == cli.OK, words
