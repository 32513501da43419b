"""The code of docs/embedding.md runs, and its co-simulation masters agree."""

import json
import re
from itertools import pairwise
from pathlib import Path

import pytest

from prbm import systems
from prbm.fmu.start import interface
from support import ROOT, built, mechanism

PAGE = ROOT / "docs" / "embedding.md"

pytestmark = [pytest.mark.fmu, pytest.mark.native]


def blocks() -> list[tuple[str, str]]:
    """Return the attribute of each code block, and its code."""
    return re.findall(r"```python ?(.*?)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def test_quoted_messages_of_the_table_are_those_of_the_package():
    _, page = PAGE.read_text(encoding="utf-8").split("## Supported and refused", 1)
    table, _ = page.split("## Partners", 1)
    quoted = re.findall(r'"([^"]+)"', table)
    assert len(quoted) > 10
    texts = [path.read_text("utf-8") for path in sorted(Path(systems.__path__[0]).glob("*.py"))]
    joined = re.sub(r'"\s*\n\s*f?"', "", "\n".join(texts))
    assert [words for words in quoted if words not in joined] == []


@pytest.fixture
def printed(tmp_path, monkeypatch, capsys) -> str:
    """Run the page in a folder with the FMUs of the first command; return the printed text."""
    for version in (2, 3):
        there = tmp_path / "dist" / f"fmi{version}"
        there.mkdir(parents=True)
        (there / "PRBDM.fmu").write_bytes(built(mechanism("PRBDM"), version))
    monkeypatch.chdir(tmp_path)
    space: dict[str, object] = {}
    for note, code in blocks():
        if "libcosimpy" in code:
            pytest.importorskip("libcosimpy", reason="libcosimpy is not installed")
        if note:
            Path(note.removeprefix("file=")).write_text(code, encoding="utf-8")
        else:
            exec(compile(code, PAGE.name, "exec"), space)
    return capsys.readouterr().out


@pytest.mark.slow
def test_coupling_errors_of_the_page_halve_with_the_step_and_masters_agree(printed):
    """The energies converge to the result of one solver as the step becomes shorter."""
    assert re.search(r"^base\.acceleration\.x \[m/s2\]: ", printed, re.MULTILINE)
    assert re.search(r"^alone: \d+ impacts$", printed, re.MULTILINE)
    pairs = re.findall(r"taken (\S+) mJ, given (\S+) mJ", printed)
    taken, given = ([float(pair[k]) for pair in pairs] for k in (0, 1))
    *gaps, last = (a - b for a, b in zip(taken, given, strict=True))
    for longer, shorter in pairwise(gaps):
        assert shorter == pytest.approx(longer / 2, rel=0.05)  # Terms of second order remain.
    assert abs(last) < 2e-5  # mJ; both are rounded to 1e-5.
    errors = [abs(x - taken[-1]) for x in taken[:-1]]
    assert errors == sorted(errors, reverse=True)
    speeds = re.findall(r"^(?:SSP|SSP in libcosim|container): (\S+) m/s", printed, re.M)
    assert len(speeds) == 3
    assert len(set(speeds)) == 1
    assert abs(float(speeds[0])) > 1e-2  # The equal speeds are not zero.
    events = int(re.search(r"^(\d+) events", printed, re.MULTILINE)[1])
    assert events >= 3


def test_recipes_for_other_tools_connect_the_same_variables():
    """The systems of fmucontainer and ecos are those of the first example of the page."""
    text = PAGE.read_text(encoding="utf-8")
    (code,) = re.findall(r"```json\n(.*?)```", text, re.DOTALL)
    recipe = json.loads(code)
    short = {"PRBDM.fmu": "guide", "Brake.fmu": "brake"}
    links = {(f"{short[a]}.{x}", f"{short[b]}.{y}") for a, x, b, y in recipe["link"]}
    ecos = re.findall(r'real_connection\("(\S+)::(\S+)", "(\S+)::(\S+)"\)', text)
    assert links == {(f"{a}.{x}", f"{b}.{y}") for a, x, b, y in ecos}
    assert links == {("guide.shuttle.vx", "brake.velocity"), ("brake.force", "guide.force.x")}
    (coupled,) = re.findall(r"^connections = (\{.*\})$", text, re.MULTILINE)
    assert links == {(source, to) for to, source in json.loads(coupled).items()}
    starts = {f"{short[fmu]}.{name}": value for fmu, name, value in recipe["start"]}
    assert starts == {"brake.damping": 0.2, "guide.release.displacement": -0.012}
    described = interface(mechanism("PRBDM"), {})
    assert {"shuttle.vx", "force.x", "release.displacement"} <= {v.name for v in described}
