"""The commands prbm import and prbm export: files, printed sentences, and messages."""

import shlex

import pytest
from PIL import Image

from drawn_plates import framed_stage, write
from prbm.commands import command_line as cli
from prbm.files.mechanism_file import load


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "stage.dxf", framed_stage())


def run(line: str) -> int:
    """Run a command line in this process; return its status."""
    return cli.main(shlex.split(line))


@pytest.mark.slow
def test_import_writes_the_file_and_the_picture_and_prints_what_was_recognised(capsys):
    line = "import stage.dxf --thickness 8mm --ground -5,-5 --out out/a.toml --check out/a.png"
    assert run(line) == 0
    printed = capsys.readouterr().out
    assert "1 moving body: stage" in printed
    assert "thickness 0.4 mm, length 30 mm" in printed
    assert "fundamental frequency: 86.5 Hz" in printed
    assert len(load("out/a.toml").flexures) == 4
    with Image.open("out/a.png") as image:
        assert min(image.size) > 300


def test_a_point_with_units_is_in_metres_and_one_without_in_units_of_the_drawing(capsys):
    """A point in inches would be outside the plate."""
    assert run("import stage.dxf --thickness 8mm --ground -5mm,-5mm --out a.toml") == 0
    assert run("import stage.dxf --thickness 8mm --ground=-5,-5 --unit in --out b.toml") == 0
    thick = [load(name).values()["leaf.thickness"] for name in ("a.toml", "b.toml")]
    assert thick[1] == pytest.approx(25.4 * thick[0])


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ("--thickness 0", "--thickness 0: write a positive length, for instance 8mm"),
        ("--thickness 8mm --ground 5", "--ground 5: write a point x,y"),
        ("--thickness 8mm --ground 20,20", "is on no body; the nearest body is at"),
        ("--thickness 8mm --material cheese", "the material 'cheese' is unknown"),
        ("--thickness 8mm --unit kg", "--unit 1 kg: the unit 'kg' has another dimension"),
        ("--thickness 8mm --flexures-below 0.1mm", "no flexures were found"),
    ],
)
def test_a_mistake_is_reported_in_one_sentence_and_no_file_is_written(options, reason, capsys):
    assert run(f"import stage.dxf {options} --out a.toml --check a.png") == 2
    printed = capsys.readouterr()
    assert reason in printed.err
    assert printed.out == ""
    with pytest.raises(ValueError, match="cannot be read"):
        load("a.toml")


def test_export_writes_a_drawing_that_import_reads(capsys):
    assert run("export NotchGuide --set notch.thickness=2mm --out guide.dxf") == 0
    assert "the stop stop is not drawn" in capsys.readouterr().out
    assert run("import guide.dxf --thickness 10mm --material pom --out guide.toml") == 0
    assert load("guide.toml").values()["notch.thickness"] == pytest.approx(2e-3, rel=1e-3)
    assert run("export Bistable") == 2
    assert "has pins" in capsys.readouterr().err
