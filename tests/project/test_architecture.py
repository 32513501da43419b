"""The page on architecture and its picture describe the present modules."""

import json
import re
import runpy

import pytest
from PIL import Image

from support import ROOT

PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
SCRIPT = runpy.run_path(str(ROOT / "docs" / "draw_architecture.py"))


@pytest.fixture(scope="module")
def drawn() -> dict[str, list[list[str]]]:
    """Return the layers and arrows in the metadata of the picture."""
    with Image.open(SCRIPT["PICTURE"]) as picture:
        return json.loads(picture.text["Architecture"])


def test_the_arrows_of_the_picture_are_the_imports_of_the_modules(drawn):
    assert drawn == SCRIPT["data"](), "run: python docs/draw_architecture.py"
    assert len(drawn["arrows"]) > 50


def test_no_arrow_goes_up_or_stays_in_its_layer(drawn):
    level = {name: k for k, row in enumerate(drawn["layers"]) for name in row}
    assert [(a, b) for a, b in drawn["arrows"] if level[a] >= level[b]] == []


def test_the_picture_and_the_page_describe_every_package(drawn):
    folders = {path.parent.name for path in SCRIPT["PACKAGE"].glob("*/__init__.py")}
    layered = [name for row in drawn["layers"] for name in row]
    assert set(layered) == folders - {"shipped"}
    assert SCRIPT["ABOUT"].keys() == set(layered)
    assert re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE) == layered


@pytest.mark.slow
def test_drawing_twice_gives_the_same_bytes(tmp_path):
    for name in ("a.png", "b.png"):
        SCRIPT["main"]([str(tmp_path / name)])
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_the_files_and_functions_that_the_page_names_exist():
    """Paths are relative to the package or the project; a function follows its file and a colon."""
    named = re.findall(r"`((?:[\w.]+/)+[\w.]*)`(?:: `([\w.]+)`)?", PAGE)
    assert len(named) > 20
    for path, function in named:
        file = next((p for p in (SCRIPT["PACKAGE"] / path, ROOT / path) if p.exists()), None)
        assert file is not None, path
        if function:
            name = re.sub(r"^(fmi[23])(\w+)", r"(\1\2|FMI[23]\\(\2\\))", function.split(".")[-1])
            assert re.search(rf"\b{name}\(", file.read_text(encoding="utf-8")), function
    for name in re.findall(r"`(test_\w+\.py)`", PAGE):
        assert (ROOT / "tests" / "kernel" / name).exists(), name
