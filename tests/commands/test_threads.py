"""The commands use one thread for linear algebra unless the environment sets a number."""

import os

import pytest

from prbm.__main__ import THREADS, main


@pytest.mark.parametrize("given", [None, "3"])
def test_threads_of_linear_algebra_default_to_one(given, monkeypatch, capsys):
    for name in THREADS:
        monkeypatch.setenv(name, given or "")
        if given is None:
            monkeypatch.delenv(name)
    monkeypatch.setattr("sys.argv", ["prbm", "--version"])
    assert main() == 0
    assert capsys.readouterr().out.strip()
    assert {os.environ[name] for name in THREADS} == {given or "1"}
