"""FMUs as archives: the same bytes for the same content, and never half a file."""

import io
import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

TIMESTAMP = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip archive can hold
PLAIN, EXECUTABLE = 0o644, 0o755
LIBRARIES = (".so", ".dll", ".dylib")
UNIX = 3


def zipped(files: Mapping[str, bytes]) -> bytes:
    """Return a zip archive whose bytes depend on names and contents alone."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in sorted(files):
            info = zipfile.ZipInfo(name, TIMESTAMP)
            info.create_system = UNIX
            info.compress_type = zipfile.ZIP_DEFLATED
            mode = EXECUTABLE if name.endswith(LIBRARIES) else PLAIN
            info.external_attr = mode << 16
            archive.writestr(info, files[name])
    return buffer.getvalue()


def write(path: Path, content: bytes) -> None:
    """Write a file at once: whoever looks sees the old one or the new one, never a part.

    Raises
    ------
    OSError
        If the folder cannot be made or written to.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, PLAIN)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
