"""The commands use one thread for linear algebra unless the environment sets a number."""

import os
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
