"""``prbm new``: mechanism files to start from."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from prbm.commands.command_line import KINDS, main
from prbm.commands.new import template
from prbm.commands.program import MISTAKE, OK
from prbm.files.mechanism_file import load, shipped
from prbm.runs.run import simulate


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_mechanism_hits_its_stop_and_settles(kind, capsys):
    assert main(["new", "Mine", "--kind", kind]) == OK
    printed = capsys.readouterr().out
    mine = load("Mine.toml")
    assert mine.name == "Mine"
    assert mine.title in printed
    for line in re.findall(r"^  prbm (.*)$", printed, re.MULTILINE):
        assert shlex.split(line)[1] == "Mine.toml"
    result = simulate(mine)
    assert result.impacts[0].latched.approach_speed > 0.05
    assert main(["simulate", "Mine.toml"]) == OK
    printed = capsys.readouterr()
    assert re.search(r"^settled +at t = ", printed.out, re.MULTILINE)
    assert "note:" not in printed.out + printed.err


@pytest.mark.parametrize("kind", KINDS)
def test_every_table_of_a_new_file_has_a_comment_or_a_description(kind):
    """A reader learns the meaning of each kind of table from the file itself."""
    text = template(kind, "Mine")
    assert text.startswith("# ")
    assert max(map(len, text.splitlines())) <= 100
    for word in ("[[stops]]", "[[forces]]", "[release]", "[[flexure_types]]", "[[geometry]]"):
        piece = text.partition(word)[2].partition("\n\n")[0]
        assert "#" in piece or "description" in piece


@pytest.mark.parametrize("name", shipped())
def test_a_copy_of_a_shipped_mechanism_differs_in_name_and_title_only(name, capsys):
    assert main(["new", "Mine", "--from", name]) == OK
    before, mine = load(name), load("Mine.toml")
    assert mine.title == f"Mine, from {name}: {before.title}"
    assert mine.title in capsys.readouterr().out
    assert replace(mine, name=name, title=before.title) == before
    old, new = (
        path.read_text(encoding="utf-8").splitlines()
        for path in (shipped()[name], Path("Mine.toml"))
    )
    assert [k for k, (a, b) in enumerate(zip(old, new, strict=True)) if a != b] == [
        k for k, line in enumerate(old) if line == f'name = "{name}"' or line.startswith("title = ")
    ]


def test_an_unknown_shipped_mechanism_is_rejected_with_a_proposal(capsys):
    assert main(["new", "Mine", "--from", "GuidBeam"]) == MISTAKE
    assert "did you mean GuideBeam" in capsys.readouterr().err
    assert main(["new", "Mine", "--from", "GuideBeam", "--kind", "pivot"]) == MISTAKE
    assert "not allowed with" in capsys.readouterr().err
    assert [*Path().iterdir()] == []


def test_an_existing_file_is_kept(capsys):
    Path("Mine.toml").write_text("mine", encoding="utf-8")
    assert main(["new", "Mine.toml"]) == MISTAKE
    assert "Mine.toml exists" in capsys.readouterr().err
    assert Path("Mine.toml").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("name", ["2nd", "my guide", "a-b", ""])
def test_a_name_that_fmi_forbids_is_rejected(name, capsys):
    assert main(["new", name]) == MISTAKE
    assert "use letters, digits and _" in capsys.readouterr().err
    assert [*Path().iterdir()] == []
