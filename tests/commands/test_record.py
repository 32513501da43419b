"""The record beside the results of a run, and what it says about other mechanism files."""

import hashlib
import json
import shlex
from pathlib import Path

import pytest

import prbm
from prbm.base.csv_text import csv_text
from prbm.commands import command_line as cli
from prbm.files.mechanism_file import shipped

SHOCK = "t [s],a [m/s2]\n0,0\n1e-3,50\n2e-3,0\n"


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def run(line: str) -> int:
    return cli.main(shlex.split(line))


def record(path: str) -> dict:
    return json.loads(Path(path).read_text(encoding="utf-8"))


def own_file(path: str, thickness: str = "0.1 mm") -> None:
    """Write a mechanism file of the name PRBDM."""
    text = shipped()["PRBDM"].read_text(encoding="utf-8")
    Path(path).parent.mkdir(exist_ok=True)
    Path(path).write_text(text.replace("0.1 mm", thickness), encoding="utf-8")


def test_the_arguments_of_a_record_repeat_the_simulation():
    """The table of the motion is that of the function with the arguments of the record."""
    Path("shock.csv").write_text(SHOCK, encoding="utf-8")
    line = (
        "simulate PRBDM --set stop.restitution=0.5 --set release.displacement=-5mm --step 1ms "
        "--stop-time 20ms --tolerance 1e-7 --input base.acceleration.x=csv(shock.csv) --out a"
    )
    assert run(line) == cli.OK
    found = record("a/PRBDM-run.json")
    own = found["mechanism"]
    result = prbm.simulate(prbm.load(own["name"]), **found["arguments"])
    rows = (list(row) for row in result.columns.tolist())
    assert Path("a/PRBDM.csv").read_text(encoding="utf-8") == csv_text([*result], rows)
    assert found["version"] == prbm.__version__
    assert found["arguments"]["tolerance"] == 1e-7
    assert found["arguments"]["engine"] == result.engine
    content = shipped()["PRBDM"].read_bytes()
    assert (own["file"], own["sha256"]) == ("PRBDM.toml", hashlib.sha256(content).hexdigest())
    assert found["files"] == {"shock.csv": hashlib.sha256(SHOCK.encode()).hexdigest()}


def test_equal_arguments_give_equal_bytes_in_any_folder():
    for folder in ("a", "deep/b"):
        assert run(f"simulate PRBDM --stop-time 5ms --out {folder}") == cli.OK
    first, second = (
        {path.name: path.read_bytes() for path in Path(folder).iterdir()}
        for folder in ("a", "deep/b")
    )
    assert first == second
    assert "PRBDM-run.json" in first


def test_the_arguments_of_a_record_repeat_the_study():
    line = (
        "study PRBDM --vary stop.position=0:1mm:2 --of impacts --minimise impact_speed "
        "--stop-time 60ms --step 1ms --workers 1 --out a"
    )
    assert run(line) == cli.OK
    found = record("a/PRBDM-study-run.json")
    again = prbm.study(prbm.load("PRBDM"), **found["arguments"], workers=1)
    assert Path("a/PRBDM-study.csv").read_text(encoding="utf-8") == csv_text(*again.table())
    assert found["arguments"]["vary"] == {"stop.position": [0.0, 1e-3]}
    assert again.optimum is not None


@pytest.mark.slow
def test_results_of_another_file_with_the_same_name_are_replaced_with_a_note(capsys):
    """An edited file replaces its own results without a note."""
    own_file("one.toml")
    own_file("two.toml", "0.12 mm")
    for file, before in (("one", None), ("one", None), ("two", "one"), ("two", None)):
        assert run(f"simulate {file}.toml --stop-time 1ms --out a") == cli.OK
        printed = capsys.readouterr().out
        note = f"note: a had results of {before}.toml, a mechanism of the same name; those of two"
        assert (note in printed) == (before is not None), file
        assert record("a/PRBDM-run.json")["mechanism"]["file"] == f"{file}.toml"
        own_file("one.toml", "0.11 mm")


def test_an_fmu_of_another_file_with_the_same_name_is_replaced_with_a_note(capsys):
    own_file("one.toml")
    own_file("two.toml", "0.12 mm")
    built = []
    for file in ("one", "two"):
        assert run(f"build {file}.toml --flavour python --set stop.restitution=0.5") == cli.OK
        built.append(Path("dist/python/PRBDM.fmu").read_bytes())
        found = record("dist/python/PRBDM-build.json")
        assert found["mechanism"]["file"] == f"{file}.toml"
        assert found["arguments"]["values"] == {"stop.restitution": 0.5}
    assert built[0] != built[1]
    assert capsys.readouterr().out.count("note: dist had results of one.toml, a mechanism") == 1


@pytest.mark.parametrize(
    "content", [b"", b"{}", b"[1]", b'{"mechanism": {"file": 1}}', b"\xff", b"[" * 100_000]
)
@pytest.mark.parametrize(
    "line",
    [
        "simulate PRBDM --stop-time 1ms",
        "study PRBDM --vary stop.position=0:1mm:2 --of impacts",
        "build PRBDM --flavour python",
    ],
)
def test_a_file_that_is_no_record_is_replaced_as_other_files_are(line, content, capsys):
    names = {
        "simulate": "PRBDM-run.json",
        "study": "PRBDM-study-run.json",
        "build": "python/PRBDM-build.json",
    }
    path = Path(names[line.split()[0]])
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
    assert run(f"{line} --out .") == 0
    assert "note: . had results of" not in capsys.readouterr().out
    assert json.loads(path.read_text("utf-8"))["mechanism"]["file"] == "PRBDM.toml"
