"""Threads and output of the commands."""

import io
import os
import subprocess
import sys
from contextlib import suppress

import pytest

from prbm import __main__
from prbm.base.threads import THREAD_LIMITS
from prbm.commands import program


@pytest.mark.parametrize("main", [__main__.main, __main__.build])
@pytest.mark.parametrize("given", [None, "3"])
def test_threads_of_linear_algebra_default_to_one(main, given, monkeypatch, capsys):
    for name in THREAD_LIMITS:
        monkeypatch.setenv(name, given or "")
        if given is None:
            monkeypatch.delenv(name)
    monkeypatch.setattr("sys.argv", ["prbm", "--version"])
    with suppress(SystemExit):
        main()
    assert capsys.readouterr().out.strip()
    assert {os.environ[name] for name in THREAD_LIMITS} == {given or "1"}


@pytest.mark.parametrize("main", [__main__.main, __main__.build])
def test_characters_that_the_output_cannot_encode_are_printed_as_escapes(main, monkeypatch):
    printed = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(printed, encoding="ascii"))
    monkeypatch.setattr("sys.argv", ["prbm", "--version"])
    with suppress(SystemExit):
        main()
    print("3 \N{MICRO SIGN}m", flush=True)
    assert printed.getvalue().splitlines()[-1] == rb"3 \xb5m"
    sys.stdout.detach()


@pytest.mark.parametrize(
    "arguments",
    [
        ["prbm", "list"],
        ["prbm", "build", "--list"],
        ["prbm", "build", "--flavour", "python", "PRBDM", "PRBDM2R"],
    ],
)
def test_a_reader_that_closes_the_pipe_ends_a_command_without_a_message(arguments, tmp_path):
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", *arguments]
    with os.fdopen(write, encoding="utf-8") as pipe:
        done = subprocess.run(command, stdout=pipe, stderr=subprocess.PIPE, cwd=tmp_path, text=True)
    assert (done.returncode, done.stderr) == (program.FAILED, "")
    assert [*tmp_path.iterdir()] == []
