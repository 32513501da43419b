"""Threads and output of the commands."""

import io
import os
import sys
from contextlib import suppress

import pytest

from prbm import __main__
from prbm.commands import build_fmu
from prbm.commands.program import THREADS


@pytest.mark.parametrize("main", [__main__.main, build_fmu.main])
@pytest.mark.parametrize("given", [None, "3"])
def test_threads_of_linear_algebra_default_to_one(main, given, monkeypatch, capsys):
    for name in THREADS:
        monkeypatch.setenv(name, given or "")
        if given is None:
            monkeypatch.delenv(name)
    monkeypatch.setattr("sys.argv", ["prbm", "--version"])
    with suppress(SystemExit):
        main()
    assert capsys.readouterr().out.strip()
    assert {os.environ[name] for name in THREADS} == {given or "1"}


@pytest.mark.parametrize("main", [__main__.main, build_fmu.main])
def test_characters_that_the_output_cannot_encode_are_printed_as_escapes(main, monkeypatch):
    printed = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(printed, encoding="ascii"))
    monkeypatch.setattr("sys.argv", ["prbm", "--version"])
    with suppress(SystemExit):
        main()
    print("3 \N{MICRO SIGN}m", flush=True)
    assert printed.getvalue().splitlines()[-1] == rb"3 \xb5m"
    sys.stdout.detach()
