"""The page about embedding runs as it stands there, and its ways agree."""

import re
from itertools import pairwise
from pathlib import Path

import pytest

from support import ROOT, built, mechanism

PAGE = ROOT / "docs" / "embedding.md"

pytestmark = [pytest.mark.fmu, pytest.mark.native]


def blocks() -> list[tuple[str, str]]:
    """Return what stands behind the fence, and the code."""
    return re.findall(r"```python ?(.*?)\n(.*?)```", PAGE.read_text(), re.DOTALL)


@pytest.fixture
def printed(tmp_path, monkeypatch, capsys) -> str:
    """Run the page in a folder with what the first command builds; return what it prints."""
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
            Path(note.removeprefix("file=")).write_text(code)
        else:
            exec(compile(code, PAGE.name, "exec"), space)
    return capsys.readouterr().out


def test_embedding_page_runs_and_its_ways_agree(printed):
    """Coupling errors halve with the step, to what one solver gives; three masters agree."""
    assert re.search(r"^base\.acceleration\.x \[m/s2\]: ", printed, re.MULTILINE)
    assert re.search(r"^alone: \d+ impacts$", printed, re.MULTILINE)
    pairs = re.findall(r"taken (\S+) mJ, given (\S+) mJ", printed)
    taken, given = ([float(pair[k]) for pair in pairs] for k in (0, 1))
    *gaps, none = (a - b for a, b in zip(taken, given, strict=True))
    for longer, shorter in pairwise(gaps):
        assert shorter == pytest.approx(longer / 2, rel=0.05)  # and terms of the second order
    assert abs(none) < 2e-5  # mJ: both are rounded to 1e-5
    errors = [abs(x - taken[-1]) for x in taken[:-1]]
    assert errors == sorted(errors, reverse=True)
    speeds = re.findall(r"^(?:SSP in FMPy|SSP in libcosim|container): (\S+) m/s", printed, re.M)
    assert len(speeds) == 3
    assert len(set(speeds)) == 1
    assert abs(float(speeds[0])) > 1e-2  # they do not agree on being at rest
    happened = int(re.search(r"^(\d+) times something happened", printed, re.MULTILINE)[1])
    assert happened >= 3
