"""The pages that simulate their mechanism: contents, escaping, size, and the command for them."""

import json
import re
import webbrowser
import zipfile
from base64 import b64decode
from dataclasses import replace
from gzip import decompress
from io import BytesIO

import pytest

from live import node
from prbm.commands import command_line
from prbm.files.mechanism_file import shipped
from prbm.fmu import native_fmu
from prbm.fmu.explorer import explorer
from prbm.fmu.live.page import script
from prbm.fmu.native_fmu import build
from prbm.kernel.compiler import NoCompilerError, browser_module
from support import mechanism

pytestmark = pytest.mark.native

ADDED_MAX = 350_000  # Bytes that the live part may add to a page.
HOSTILE = "</script><script>alert(1)</script><!-- \" ' & \u2028"


@pytest.fixture(scope="module", autouse=True)
def _module():
    pytest.importorskip("ziglang")


def page_of(name: str) -> str:
    with zipfile.ZipFile(BytesIO(build(mechanism(name)))) as fmu:
        return fmu.read("documentation/index.html").decode()


@pytest.fixture(scope="module")
def page() -> str:
    return page_of("PRBDM")


def data(page: str, name: str) -> str:
    """Return the text of a data element of a page."""
    found = re.search(rf'<script type="[^"]*" id="live-{name}">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return found.group(1)


def without_ziglang(progress):
    raise NoCompilerError("needs the Python package ziglang")


def test_the_module_of_every_page_is_the_compiled_kernel(page):
    packed = data(page, "module")
    assert packed == data(explorer(mechanism("Cantilever")), "module")
    assert decompress(b64decode(packed)) == browser_module()


def test_the_page_is_one_file_without_addresses_of_a_network(page):
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", page)
    assert not re.search(r'<(script|img|link|iframe)[^>]*\b(src|href)="', page)
    assert 'type="module"' not in page
    assert not re.search(r"\b(fetch|XMLHttpRequest|WebSocket|importScripts)\(", script())


def test_the_live_part_adds_at_most_350_kb_to_a_page(page, monkeypatch):
    monkeypatch.setattr(native_fmu, "browser_module", without_ziglang)
    assert len(page) - len(page_of("PRBDM")) < ADDED_MAX


def test_the_page_is_static_without_a_compiler_and_says_why(monkeypatch):
    monkeypatch.setattr(native_fmu, "browser_module", without_ziglang)
    messages: list[str] = []
    with zipfile.ZipFile(BytesIO(build(mechanism("PRBDM"), progress=messages.append))) as fmu:
        text = fmu.read("documentation/index.html").decode()
        assert "documentation/licenses/wasi-libc.txt" not in fmu.namelist()
    assert "<script" not in text
    assert "<h2>Variables</h2>" in text
    (reason,) = [message for message in messages if "ziglang" in message]
    assert "no simulation" in reason


def test_texts_of_the_mechanism_cannot_leave_their_element():
    guide = mechanism("PRBDM")
    geometry = tuple(replace(p, description=HOSTILE) for p in guide.geometry)
    text = explorer(replace(guide, title=HOSTILE, description=HOSTILE, geometry=geometry))
    assert "alert(1)</script>" not in text
    assert text.count("</script>") == 4
    listed = json.loads(data(text, "content"))
    assert listed["title"] == HOSTILE
    assert listed["quantities"][0]["description"] == HOSTILE


@pytest.mark.parametrize("model", shipped())
def test_sliders_contain_the_start_values_and_stay_within_the_bounds(model):
    listed = json.loads(data(explorer(mechanism(model)), "content"))
    for quantity in listed["quantities"]:
        slider = quantity["slider"]
        assert slider["low"] <= quantity["start"] <= slider["high"], quantity["name"]
        assert slider["low"] < slider["high"], quantity["name"]
        for name, sign, bound in (("minimum", 1, "low"), ("maximum", -1, "high")):
            if quantity[name] is not None:
                assert sign * (slider[bound] - quantity[name]) >= 0.0, quantity["name"]


def test_the_joined_script_has_no_syntax_errors(tmp_path):
    path = tmp_path / "page.js"
    path.write_text(script(), encoding="utf-8")
    node("--check", path)


def test_explore_writes_the_page_and_opens_it(tmp_path, monkeypatch, capsys):
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    path = tmp_path / "new" / "guide.html"
    line = ["explore", "PRBDM", "--set", "stop.restitution=0.5", "--out", str(path)]
    assert command_line.main(line) == command_line.OK
    listed = json.loads(data(path.read_text(encoding="utf-8"), "content"))
    starts = {quantity["name"]: quantity["start"] for quantity in listed["quantities"]}
    assert starts["stop.restitution"] == 0.5
    assert opened == [path.as_uri()]
    assert command_line.main([*line, "--no-open"]) == command_line.OK
    assert len(opened) == 1
    assert command_line.main(["explore", "PRBDM", "--set", "stop.restitution=2"]) == 2
