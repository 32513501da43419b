"""The command that builds FMUs: the same bytes, whole files, one sentence for a mistake."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from fmpy.validation import validate_fmu

from prbm_fmu import archive, cli, python_fmu

ROOT = Path(__file__).parents[1]
BUILD = ROOT / "build_fmu.py"

pytestmark = pytest.mark.fmu


def build(folder: Path, *options: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(BUILD), *options], cwd=folder, capture_output=True, text=True,
        check=False, env=os.environ | environment,
    )  # fmt: skip


def test_from_an_empty_folder_it_builds_simulates_tells_and_plots(tmp_path):
    """Free rest 10.42 and 10.78 mm, 4.957 and 4.889 Hz: the table of the design document."""
    done = build(tmp_path, "--simulate")
    assert done.returncode == 0, done.stderr
    for model, rest, frequency in (("PRBDM", "10.42", "4.957"), ("PRBDM2R", "10.78", "4.889")):
        fmu = tmp_path / "dist" / "python" / f"{model}.fmu"
        assert validate_fmu(str(fmu)) == []
        assert fmu.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
        told = done.stdout.partition(f"{model}: simulating")[2].partition("figure ")[0]
        assert re.search(rf"shuttle\.x = {rest} mm", told)
        assert re.search(rf"fundamental +{frequency} Hz", told)
        assert re.search(r"impacts at stop +\d+, the first at t = 0\.04", told)
        assert re.search(r"came to rest +at t = 0\.24", told)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["dist"]


def test_the_same_input_gives_the_same_bytes_in_every_process(tmp_path):
    for seed in ("1", "2"):
        done = build(tmp_path, "--model", "PRBDM2R", "--out", seed, PYTHONHASHSEED=seed)
        assert done.returncode == 0, done.stderr
    first, second = (tmp_path / seed / "python" / "PRBDM2R.fmu" for seed in ("1", "2"))
    assert first.read_bytes() == second.read_bytes()


def test_another_content_has_another_guid_and_other_module_names(mechanisms, tmp_path):
    names = []
    for changes in ({}, {"stop.restitution": 0.5}):
        path = tmp_path / "fmu"
        archive.write(path, python_fmu.build(mechanisms["PRBDM"], changes))
        with zipfile.ZipFile(path) as fmu:
            xml = fmu.read("modelDescription.xml").decode()
            guid = re.search(r'guid="([^"]+)"', xml).group(1)
            names.append({guid, fmu.read("resources/slavemodule.txt")})
    assert names[0].isdisjoint(names[1])


def test_an_archive_has_sorted_names_and_the_date_of_no_build(fmus):
    with zipfile.ZipFile(fmus["PRBDM"]) as fmu:
        entries = fmu.infolist()
    assert [e.filename for e in entries] == sorted(e.filename for e in entries)
    assert {e.date_time for e in entries} == {(1980, 1, 1, 0, 0, 0)}


@pytest.mark.parametrize("failure", [OSError("disk full"), KeyboardInterrupt()])
def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch, failure):
    path = tmp_path / "model.fmu"
    archive.write(path, b"old")

    def fails(*_: object) -> None:
        raise failure

    monkeypatch.setattr(archive.os, "replace", fails)
    with pytest.raises(type(failure)):
        archive.write(path, b"new")
    assert path.read_bytes() == b"old"
    assert [*tmp_path.iterdir()] == [path]


def test_nothing_is_written_if_one_of_the_models_fails(tmp_path, monkeypatch, capsys):
    """flexure.gamma1 is a parameter of the 2R model only."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(["--set", "flexure.gamma1=0.4"]) == cli.MISTAKE
    assert "PRBDM: there is no variable 'flexure.gamma1'" in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == []


def test_ctrl_c_leaves_nothing_behind(tmp_path, monkeypatch, capsys):
    def interrupted(*_: object) -> bytes:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(python_fmu, "zipped", interrupted)
    assert cli.main([]) == cli.INTERRUPTED
    assert capsys.readouterr().err == "build_fmu.py: interrupted\n"
    assert [*tmp_path.iterdir()] == []


MISTAKES = {
    "--set stop.restitutoin=0.5": "did you mean stop.restitution",
    "--set stop.restitution=nan": "a finite number",
    "--set stop.restitution=high": "a finite number",
    "--set stop.restitution": "write NAME=VALUE",
    "--set stop.restitution=1.5": "stop.restitution = 1.5 must be at most 1",
    "--set shuttle.x=0.1": "shuttle.x is computed by the model",
    "--set release.displacement=0.02": "penetrated",
    "--set release.displacement=-0.2": "cannot be reached",
    "--model PRBDM3": "shipped are PRBDM, PRBDM2R",
    "--mechanism nowhere.toml": "nowhere.toml: cannot be read",
    "--model PRBDM --mechanism x.toml": "not allowed with",
    "--out file/deeper": "file is a file",
    "--flavour native": "not built yet",
    "--flavour python --fmi 3": "Python FMUs are FMI 2.0",
    "--fmi 3": "not built yet",
    "--clock": "not built yet",
    "--platform all": "not built yet",
    "--flavour wood": "invalid choice",
    "--nonsense": "unrecognized arguments: --nonsense",
}


@pytest.mark.parametrize("command", MISTAKES)
def test_a_mistake_is_answered_with_a_sentence_and_status_2(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("in the way")
    assert cli.main(command.split()) == cli.MISTAKE
    error = capsys.readouterr().err
    assert MISTAKES[command] in error
    assert error.startswith("build_fmu.py: ")
    assert error.count("\n") == 1
    assert [*tmp_path.iterdir()] == [tmp_path / "file"]


def test_the_list_names_what_is_shipped(capsys):
    assert cli.main(["--list"]) == cli.OK
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["PRBDM", "PRBDM2R"]


def test_a_mechanism_of_ones_own_is_built_under_its_own_name(tmp_path):
    text = (ROOT / "fmu_src" / "mechanisms" / "PRBDM.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace('name = "PRBDM"', 'name = "Mine"'))
    done = build(tmp_path, "--mechanism", "mine.toml", "--set", "stop.position=1e-3")
    assert done.returncode == 0, done.stderr
    fmu = tmp_path / "dist" / "python" / "Mine.fmu"
    assert validate_fmu(str(fmu)) == []


def test_a_path_that_pythonfmu_cannot_read_is_no_obstacle_to_our_own_simulation(tmp_path):
    """It crashes on percent-encoded paths; the temporary folder is chosen around them."""
    awkward = tmp_path / "modèle 100%"
    awkward.mkdir()
    done = build(awkward, "--model", "PRBDM", "--simulate", TMPDIR=str(awkward))
    assert done.returncode == 0, done.stderr
    assert (awkward / "dist" / "python" / "PRBDM.png").exists()
