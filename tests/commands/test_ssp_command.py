"""``prbm ssp`` prints and writes the motion of a package; the rows before a failure too."""

import csv
import zipfile

import numpy as np
import pytest

from coupled import guide, integrator
from prbm.commands.command_line import main
from prbm.systems import ssp

pytestmark = [
    pytest.mark.fmu, pytest.mark.native, pytest.mark.usefixtures("plain_temporary_folder")
]  # fmt: skip


def written(folder):
    """Return the head and the numbers of the table."""
    with (folder / "two.csv").open(encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    return head, np.array(rows, float)


@pytest.fixture
def package(tmp_path):
    path = tmp_path / "two.ssp"
    start = {"sum.gain": 1.0, "guide.release.displacement": -3e-3}
    ssp.package(
        path, {"guide": guide(2), "sum": integrator()}, {"sum.rate": "guide.shuttle.x"}, start, 0.02
    )
    return path


def test_a_package_is_simulated_with_its_own_duration(package, tmp_path, capsys):
    assert main(["ssp", str(package), "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "simulated  0.02 s, 1001 rows" in printed
    head, rows = written(tmp_path)
    found = ssp.simulate(package)
    assert head == list(found.dtype.names)
    np.testing.assert_array_equal(rows[:, head.index("sum.value")], found["sum.value"])
    assert [float(x) for x in line(printed, "guide.shuttle.x")] == pytest.approx(
        [f(found["guide.shuttle.x"]) for f in (lambda x: x[0], np.min, np.max, lambda x: x[-1])],
        rel=1e-5,
    )


def line(printed, name):
    (words,) = (x.split() for x in printed.splitlines() if x.split()[0] == name)
    return words[1:]


def test_rows_before_a_failure_are_written(tmp_path, capsys):
    path = tmp_path / "two.ssp"
    ssp.package(path, {"sum": integrator()}, {}, {"sum.end": 0.5})
    options = ["--step", "100ms", "--stop-time", "1s", "--out", str(tmp_path)]
    assert main(["ssp", str(path), *options]) == 1
    captured = capsys.readouterr()
    assert "sum terminated the simulation at 0.5 s" in captured.err
    assert "simulated  0.5 s, 6 rows" in captured.out
    np.testing.assert_allclose(written(tmp_path)[1][:, 0], np.linspace(0.0, 0.5, 6), rtol=1e-12)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["missing.ssp"], "missing.ssp: there is no such file"),
        (["text.ssp"], "text.ssp: cannot be read as a package"),
        (["two.ssp", "--step", "1kg"], "--step"),
        (["two.ssp", "--step", "0"], "step"),
    ],
)
def test_a_mistake_is_named(words, message, package, capsys, monkeypatch):
    monkeypatch.chdir(package.parent)
    (package.parent / "text.ssp").write_text("text", encoding="utf-8")
    assert main(["ssp", *words]) == 2
    assert message in capsys.readouterr().err


def test_start_values_without_a_variable_are_named(package, tmp_path, capsys):
    path = tmp_path / "renamed.ssp"
    with zipfile.ZipFile(package) as source, zipfile.ZipFile(path, "w") as copy:
        for name in source.namelist():
            content = source.read(name)
            if name == ssp.DESCRIPTION:
                content = content.replace(b'Parameter name="gain"', b'Parameter name="gian"')
            copy.writestr(name, content)
    assert main(["ssp", str(path)]) == 0
    assert "note: the start value sum.gian is ignored" in capsys.readouterr().err
