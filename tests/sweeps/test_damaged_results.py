"""Damaged or foreign journals of a study are named, never used."""

import os

import pytest

from prbm.base.atomic import FileError
from prbm.base.errors import ParameterError
from prbm.sweeps.journal import OWNER, Journal
from prbm.sweeps.outputs import Outcome

SETTINGS = {"step": 1.0}
ROW, FAILURE = Outcome("ok", values=(2.0,)), Outcome("failed", "no,\n'way'")


def journal(folder, settings=SETTINGS) -> Journal:
    return Journal(folder / "table.csv", settings, ["mass"], ["gap [m]"])


@pytest.fixture
def folder(tmp_path):
    """Return a folder with a journal of two rows."""
    written = journal(tmp_path)
    with written.opened():
        written.add((1.0,), ROW)
        written.add((0.1 + 0.2,), FAILURE)
    return tmp_path


def known(folder) -> dict[tuple[float, ...], Outcome]:
    read = journal(folder)
    with read.opened():
        return dict(read.known)


def test_rows_are_kept_to_the_last_bit(folder):
    assert known(folder) == {(1.0,): ROW, (0.1 + 0.2,): Outcome("failed", "no, 'way'")}


@pytest.mark.parametrize("cut", [1, 5, 20])
def test_an_incomplete_line_is_cut_off(folder, cut):
    path = folder / "table.csv.partial"
    path.write_bytes(path.read_bytes()[:-cut])
    assert known(folder) == {(1.0,): ROW}
    assert known(folder) == {(1.0,): ROW}  # A second owner follows complete lines.


@pytest.mark.parametrize(
    "change",
    [
        ("# {", "# ["),
        ("mass", "mess"),
        ("1.0,2.0", "1.0,2.0,3.0"),
        ("1.0,2.0", "1.0,two"),
        ("# {", "# " + "[" * 100_000),
    ],
)
def test_a_damaged_journal_is_named(folder, change):
    path = folder / "table.csv.partial"
    path.write_text(path.read_text(encoding="utf-8").replace(*change), encoding="utf-8")
    with pytest.raises(ParameterError, match=r"table\.csv\.partial is damaged; remove it"):
        known(folder)


def test_other_settings_are_named_and_can_be_overwritten(folder):
    other = journal(folder, {"step": 2.0})
    with pytest.raises(ParameterError, match=r"another step \(1.0, now 2.0\)"), other.opened():
        pass
    assert len(known(folder)) == 2
    with other.opened(overwrite=True):
        assert other.known == {}


def test_failed_rows_are_forgotten_on_request(folder):
    read = journal(folder)
    with read.opened(retry_failed=True):
        assert read.known == {(1.0,): ROW}


def test_a_second_writer_is_refused_with_the_process_of_the_first(tmp_path):
    first, second = journal(tmp_path), journal(tmp_path)
    with (
        first.opened(),
        pytest.raises(ParameterError, match=rf"another study \(process {os.getpid()} on"),
        second.opened(),
    ):
        pass
    assert list(tmp_path.iterdir()) == []


def test_an_empty_journal_is_removed(tmp_path):
    with journal(tmp_path).opened():
        content = (tmp_path / "table.csv.partial").read_text(encoding="utf-8")
    assert content.splitlines()[1].startswith(OWNER)
    assert list(tmp_path.iterdir()) == []


def test_a_link_is_no_journal(tmp_path):
    (tmp_path / "other").write_text("keep", encoding="utf-8")
    (tmp_path / "table.csv.partial").symlink_to(tmp_path / "other")
    with pytest.raises(FileError, match="a link"), journal(tmp_path).opened():
        pass
    assert (tmp_path / "other").read_text(encoding="utf-8") == "keep"
