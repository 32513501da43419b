"""The code of docs/measurements.md runs on synthetic records and finds their parameters."""

import re

import pytest

from measurement_records import records
from support import ROOT

PAGE = ROOT / "docs" / "measurements.md"


@pytest.mark.slow
def test_the_code_of_the_page_finds_the_parameters_of_the_records(tmp_path, monkeypatch, capsys):
    (block,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    records(tmp_path)
    monkeypatch.chdir(tmp_path)
    found = {}
    exec(compile(block, str(PAGE), "exec"), found)
    assert found["free"].frequency.value == pytest.approx(4.9, abs=0.001)
    assert "beam flexure: E = (18" in capsys.readouterr().out
    assert not found["ambiguous"].identifiable
    assert found["stiffness"].identifiable
