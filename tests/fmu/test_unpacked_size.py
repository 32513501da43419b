"""FMUs that are too large are rejected before they are unpacked."""

import io
import struct
import zipfile
from pathlib import Path

import pytest

from prbm.base import archives
from prbm.base.errors import PrbmError
from prbm.fmu.unpack import unpacked
from prbm.sweeps.fmu_model import read_fmu
from prbm.systems.components import described

SIZE = 1 << 20  # bytes


def archive(**files: int) -> bytes:
    """Return a compressed archive of files of zeros with given sizes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, size in files.items():
            opened.writestr(name.replace("_", "."), bytes(size))
    return buffer.getvalue()


def unpack(path: Path) -> None:
    """Unpack a file from memory, as the workers of a sweep do."""
    with unpacked(io.BytesIO(path.read_bytes())):
        pass


@pytest.mark.parametrize("reader", [read_fmu, lambda path: described("a", path), unpack])
@pytest.mark.parametrize(
    ("limit", "message"),
    [
        ("UNPACKED_SIZE_MAX", "the unpacked size of 2097152 bytes exceeds the limit of"),
        ("DESCRIPTION_SIZE_MAX", "the size of modelDescription.xml, 1048576 bytes, exceeds the"),
        ("FILES_MAX", "2 files exceed the limit of 1"),
    ],
)
def test_archives_beyond_a_limit_are_rejected(reader, limit, message, tmp_path, monkeypatch):
    """The archive contains 2 MiB, compressed to less than 10 kB."""
    path = tmp_path / "large.fmu"
    path.write_bytes(archive(modelDescription_xml=SIZE, data=SIZE))
    assert path.stat().st_size < 10_000
    monkeypatch.setattr(archives, limit, 1 if limit == "FILES_MAX" else SIZE - 1)
    with pytest.raises(PrbmError, match=message):
        reader(path)


def test_no_more_than_the_declared_size_is_unpacked(tmp_path):
    """The declared size is that of the central directory, which the check reads."""
    data = archive(data=SIZE)
    assert data.count(struct.pack("<L", SIZE)) >= 1
    path = tmp_path / "false.fmu"
    path.write_bytes(data.replace(struct.pack("<L", SIZE), struct.pack("<L", 10)))
    with pytest.raises(zipfile.BadZipFile, match="CRC"):
        unpack(path)


def test_archives_within_the_limits_are_unpacked(tmp_path):
    path = tmp_path / "small.fmu"
    path.write_bytes(archive(modelDescription_xml=SIZE, data=SIZE))
    unpack(path)
    archives.check_unpacked_size(tmp_path)
