"""Texts that no option expects end every command with a message, never with a traceback."""

import argparse
import io
import shlex
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from prbm.commands import command_line as cli

BASES = {
    "fit": "PRBDM --free flexure.youngs_modulus --frequency '4.82 Hz +- 0.06'",
    "measure": "free.csv --column x",
    "modes": "PRBDM",
    "parameters": "PRBDM",
    "shock": "PRBDM --stop-time 1ms",
    "simulate": "PRBDM --stop-time 1ms",
    "study": "PRBDM --vary 'stop.position=0:1 mm:2' --stop-time 1ms --workers 1",
    "sweep": "PRBDM.fmu free.csv",
}
QUICK = ("modes",)
DIGITS = "9" * 5000  # More than Python converts to an integer.
TEXTS = (
    "1\n2", f"4 Hz +- 1 mode {DIGITS}", DIGITS, "4 Hz +- 1 mode ²", "x=0:1:²", "\udcff", "a\0b",
    "stop.position=1\nmm", f"stop.position=0:1:{DIGITS}", "force.x=csv(a\0b)", "(" * 3000,
)  # fmt: skip


def leaves(parser: argparse.ArgumentParser, words: str) -> Iterator[tuple[list[str], str]]:
    """Yield the options with values of each command, and its words."""
    nested = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    for name, inner in nested[0].choices.items() if nested else ():
        yield from leaves(inner, f"{words} {name}")
    if not nested:
        options = [a for a in parser._actions if a.option_strings and a.nargs != 0]
        yield [a.option_strings[-1] for a in options if a.dest != "out"], words.strip()


COMMANDS = {words: options for options, words in leaves(cli.parser(), "")}


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(words, marks=[] if words in QUICK else pytest.mark.slow)
        for words in COMMANDS
        if words.partition(" ")[0] in BASES
    ],
)
def test_options_reject_texts_that_they_do_not_expect(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("free.csv").write_text("t [s],x [m]\n0,0\n1,1\n2,0\n3,1\n", encoding="utf-8")
    base = command.split() + shlex.split(BASES[command.partition(" ")[0]])
    for option in COMMANDS[command]:
        for text in TEXTS:
            with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as errors:
                status = cli.main([*base, option, text])
            assert status in (cli.OK, cli.FAILED, cli.MISTAKE), option
            assert status == cli.OK or errors.getvalue(), option
