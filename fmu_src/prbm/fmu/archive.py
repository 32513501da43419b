"""Reproducible zip archives: equal contents give equal bytes."""

import io
import zipfile
from collections.abc import Mapping

from ..base.atomic import FILE_MODE

TIMESTAMP = (1980, 1, 1, 0, 0, 0)  # Time of every file, the earliest that a zip archive can store.
EXECUTABLE_MODE = 0o755
LIBRARIES = (".so", ".dll", ".dylib")
UNIX = 3  # System of origin: file permissions are applied only if it is Unix.


def zipped(contents: Mapping[str, bytes]) -> bytes:
    """Return a zip archive of files by path; its bytes depend on paths and contents alone."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in sorted(contents):
            info = zipfile.ZipInfo(name, TIMESTAMP)
            info.create_system = UNIX
            info.compress_type = zipfile.ZIP_DEFLATED
            mode = EXECUTABLE_MODE if name.endswith(LIBRARIES) else FILE_MODE
            info.external_attr = mode << 16
            archive.writestr(info, contents[name])
    return buffer.getvalue()
