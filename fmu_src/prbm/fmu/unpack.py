"""Unpacking of FMUs to paths that pythonfmu can read."""

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import fmpy  # type: ignore[import-untyped]

from ..base.archives import check_unpacked_size

CANDIDATES = ("/tmp", "/var/tmp", r"C:\Users\Public", ".")
"""Folders for temporary files besides that of the system."""


@contextmanager
def unpacked(fmu: Path | BinaryIO) -> Iterator[Path]:
    """Unpack an FMU to a temporary folder that pythonfmu can read; remove the folder afterwards.

    Raises
    ------
    ArchiveError
        If the FMU is too large to be unpacked.
    RuntimeError
        If the path of every candidate has characters that a URI encodes.
    """
    check_unpacked_size(fmu)
    chosen = plain_folder()
    if chosen is None:
        raise RuntimeError(
            "no folder for temporary files has a path of plain ASCII letters (tried "
            f"{tempfile.gettempdir()}); set the environment variable TMPDIR to a folder with such "
            "a path"
        )
    with tempfile.TemporaryDirectory(prefix="prbm_", dir=chosen) as folder:
        fmpy.extract(fmu, unzipdir=folder)
        yield Path(folder)


def plain_folder() -> Path | None:
    """Return a folder for temporary files whose path pythonfmu can read, or None."""
    folders = (Path(folder).resolve() for folder in (tempfile.gettempdir(), *CANDIDATES))
    return next((folder for folder in folders if folder.is_dir() and plain(folder)), None)


def plain(path: Path) -> bool:
    """Return whether pythonfmu can read a path: its URI encodes no characters but spaces.

    Examples
    --------
    >>> plain(Path("/tmp/my model")), plain(Path("/tmp/modèle")), plain(Path("/tmp/100%"))
    (True, False, False)
    """
    text = path.absolute().as_posix().removeprefix(path.drive)
    return re.fullmatch(r"[\w./~ -]*", text, re.ASCII) is not None
