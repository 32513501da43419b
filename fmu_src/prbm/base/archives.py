"""Limits of the size of ZIP archives, checked before they are unpacked."""

import os.path
import zipfile
from pathlib import Path
from typing import BinaryIO

from .errors import PrbmError

UNPACKED_SIZE_MAX = 1 << 31  # bytes; all files of an archive.
DESCRIPTION_SIZE_MAX = 1 << 27  # bytes; a model description of 100,000 variables has 50 MB.
DESCRIPTION = "modelDescription.xml"
FILES_MAX = 100_000  # Files of an archive.


class ArchiveError(PrbmError, ValueError):
    """An archive is too large to be unpacked."""


def check_unpacked_size(archive: str | Path | BinaryIO) -> None:
    """Reject an FMU that is too large to be unpacked.

    The sizes are those that the archive declares; :mod:`zipfile` unpacks no more than these.  A
    folder with the files of an FMU is accepted.

    Raises
    ------
    ArchiveError
        If there are too many files, or their size is too large.
    zipfile.BadZipFile
        If the file is not a ZIP archive.
    OSError
        If the file cannot be read.
    """
    if isinstance(archive, str | Path) and os.path.isdir(archive):
        return
    with zipfile.ZipFile(archive) as opened:
        files = opened.infolist()
    if len(files) > FILES_MAX:
        raise ArchiveError(f"{len(files)} files exceed the limit of {FILES_MAX}; use another FMU")
    size = sum(file.file_size for file in files)
    if size > UNPACKED_SIZE_MAX:
        raise ArchiveError(
            f"the unpacked size of {size} bytes exceeds the limit of {UNPACKED_SIZE_MAX}; use "
            "another FMU"
        )
    for file in files:
        if file.filename == DESCRIPTION and file.file_size > DESCRIPTION_SIZE_MAX:
            raise ArchiveError(
                f"the size of {DESCRIPTION}, {file.file_size} bytes, exceeds the limit of "
                f"{DESCRIPTION_SIZE_MAX}; use another FMU"
            )
