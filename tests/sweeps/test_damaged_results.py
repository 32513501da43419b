"""Damaged results of a sweep are named, never used."""

import pytest

pytest.importorskip("pyarrow")

from prbm.base.errors import ParameterError
from prbm.sweeps.outputs import Outcome
from prbm.sweeps.results import Results


@pytest.fixture
def results(tmp_path):
    """Return the results of one run."""
    found = Results(tmp_path / "r", {"step": 1.0}, ["mass"], ["gap"])
    found.begin()
    return found


@pytest.mark.parametrize("content", [b"[]", b"null", b"1", b"{", b"\xff\xfe", b"[" * 100_000])
def test_damaged_settings_are_named(results, content):
    (results.folder / "_sweep.json").write_bytes(content)
    with pytest.raises(ParameterError, match=r"_sweep\.json is damaged; delete"):
        results.begin()


def test_a_row_with_a_negative_number_is_named(results):
    results.add([-5], [{"mass": 1.0}], [Outcome("ok", "", 0.1, (2.0,))])
    with pytest.raises(ParameterError, match=r"negative one.*remove it to repeat its runs"):
        results.read()


def test_a_draft_of_a_killed_process_is_removed(results):
    (results.folder / "_sweep.json").rename(results.folder / "._sweep.json.1f3a")
    with results.lock():
        results.begin()
    assert {path.name for path in results.folder.iterdir()} == {"_sweep.json", "_sweep.lock"}
