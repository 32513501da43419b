"""The commands of docs/verdict.md run in their order, and print the text of the page."""

import re
import shlex
from pathlib import Path

import pytest

from prbm.commands.command_line import main
from support import ROOT

PAGE = (ROOT / "docs" / "verdict.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
TEXTS = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)


def run(command: str) -> None:
    """Run a command of the page."""
    assert main(shlex.split(command.replace("\\\n", " "))[1:]) == 0


def numbers(text: str) -> list[float]:
    return [float(x) for x in re.findall(r"-?\d+(?:\.\d+)?", text)]


def label(text: str) -> list[str]:
    """Return the first words of a line, up to its first number."""
    (words,) = re.findall(r"^\D*", text)
    return words.split()[:3]


@pytest.mark.slow
def test_the_commands_of_the_page_print_its_verdict(tmp_path, monkeypatch, capsys):
    """The keys that prbm contact prints are those that the page puts into the file."""
    monkeypatch.chdir(tmp_path)
    new, contact, simulated, stress, study = COMMANDS[:5]
    run(new)
    (picture,) = re.findall(r"`(prbm picture [^`]*)`", PAGE)
    run(picture.replace("\n", " "))
    capsys.readouterr()
    run(contact)
    (keys,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    printed = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert set(keys.splitlines()) <= set(printed)
    file = Path("Stage.toml")
    file.write_text(re.sub(r"restitution = .*\n", keys, file.read_text("utf-8")), "utf-8")
    for command, text in zip((simulated, stress, study), TEXTS, strict=True):
        run(command)
        found = capsys.readouterr().out.splitlines()
        for line in text.splitlines():
            (like,) = [one for one in found if label(one) == label(line)][:1] or [""]
            if command == simulated:
                # The number of slow impacts depends on the rest speed.
                part = slice(1, 3) if line.startswith("impacts") else slice(3)
                assert numbers(like)[part] == pytest.approx(numbers(line)[part], rel=0.02), line
            elif command == stress:
                assert like.startswith(line), line
            else:
                assert numbers(like)[:2] == pytest.approx(numbers(line)[:2], rel=0.02), line
    assert Path("results/Stage-study.png").exists()
