"""Paths that the file system cannot hold are rejected with a message."""

import os
import sys
from pathlib import Path

import pytest

import prbm
from prbm.base import atomic
from prbm.base.errors import PrbmError
from prbm.data.records import read_record
from prbm.fmu import parameter_sets
from prbm.fmu.parameter_sets import read_parameter_set
from prbm.runs import inputs, result
from prbm.runs.inputs import read_signal
from prbm.runs.result import read_csv
from prbm.sweeps import fmu_model, journal, table
from prbm.sweeps.fmu_model import read_fmu
from prbm.systems.components import described

UNPAIRED = "half\ud800.toml"  # No encoding of a file system has half of a pair of surrogates.

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows allows such names")


@pytest.mark.parametrize(
    "write",
    [
        lambda path: atomic.write(path, b""),
        lambda path: atomic.write_all({path.with_name("first"): b"", path: b""}),
        atomic.check_file,
        atomic.check_writable,
        lambda path: atomic.check_writable(path / "deeper"),
    ],
)
def test_a_name_that_the_encoding_lacks_is_rejected_before_a_file_is_written(tmp_path, write):
    with pytest.raises(PrbmError, match=r"write '.*half\\ud800.*lacks '\\ud800'.*PYTHONUTF8"):
        write(tmp_path / UNPAIRED)
    assert [*tmp_path.iterdir()] == []


READERS = {
    "mechanism": prbm.load,
    "record": read_record,
    "parameter set": lambda path: read_parameter_set(path, {}),
    "signal": lambda path: read_signal("force.x", f"csv({path}, force)", "N"),
    "result": read_csv,
    "FMU of a sweep": read_fmu,
    "FMU of a system": lambda path: described("guide", path),
}


BOUNDED = READERS | {"table": table.read_table}


@pytest.mark.parametrize("kind", READERS)
def test_a_name_that_the_encoding_lacks_cannot_be_read(tmp_path, kind):
    with pytest.raises(PrbmError, match=r"half.*read.*codec can't encode"):
        READERS[kind](tmp_path / UNPAIRED)


@pytest.mark.parametrize("kind", READERS)
def test_a_name_with_a_null_byte_cannot_be_read(tmp_path, kind):
    with pytest.raises(PrbmError, match=r"read.*null"):
        READERS[kind](tmp_path / "half\0.toml")


@pytest.mark.parametrize("write", [lambda path: atomic.write(path, b""), atomic.check_file])
@pytest.mark.parametrize("linked", [False, True])
def test_a_pipe_is_not_replaced_by_a_file(tmp_path, write, linked):
    pipe, link = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    with pytest.raises(PrbmError, match="a pipe or a device; choose another name"):
        write(link if linked else pipe)
    assert pipe.is_fifo()
    assert link.is_symlink()


@pytest.mark.parametrize(
    ("kind", "module", "limit"),
    [
        ("signal", inputs, "FILE_SIZE_MAX"),
        ("result", result, "FILE_SIZE_MAX"),
        ("parameter set", parameter_sets, "FILE_SIZE_MAX"),
        ("table", table, "FILE_SIZE_MAX"),
        ("FMU of a sweep", fmu_model, "UNPACKED_SIZE_MAX"),
    ],
)
def test_no_more_of_an_endless_file_is_read_than_the_limit(monkeypatch, kind, module, limit):
    monkeypatch.setattr(module, limit, 1000)
    with pytest.raises(PrbmError, match="larger than 1000 bytes, the limit"):
        BOUNDED[kind](Path("/dev/zero"))


def test_no_device_or_pipe_is_the_journal_of_a_study(tmp_path):
    written = journal.Journal(tmp_path / "table.csv", {}, (), ())
    assert written.path is not None
    os.mkfifo(written.path)
    with pytest.raises(PrbmError, match="a pipe or a device"), written.opened():
        pass
    assert written.path.is_fifo()


def test_a_table_in_parquet_is_no_pipe(tmp_path):
    os.mkfifo(tmp_path / "table.parquet")
    with pytest.raises(PrbmError, match="a pipe or a device"):
        table.read_table(tmp_path / "table.parquet")


def test_files_have_the_permissions_of_the_umask(tmp_path):
    before = os.umask(0o077)
    try:
        atomic.write(tmp_path / "file", b"content")
    finally:
        os.umask(before)
    assert (tmp_path / "file").stat().st_mode & 0o777 == 0o600
