"""Unpacking of FMUs to paths that pythonfmu can read."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO
from urllib.parse import unquote

import fmpy  # type: ignore[import-untyped]

from ..base.archives import check_unpacked_size


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
    candidates = (tempfile.gettempdir(), "/tmp", "/var/tmp", r"C:\Users\Public", ".")
    for candidate in map(Path, candidates):
        if candidate.is_dir() and plain(candidate.resolve()):
            with tempfile.TemporaryDirectory(prefix="prbm_", dir=candidate.resolve()) as folder:
                fmpy.extract(fmu, unzipdir=folder)
                yield Path(folder)
            return
    raise RuntimeError(
        f"no folder for temporary files has a path of plain ASCII letters (tried {candidates[0]}); "
        "set the environment variable TMPDIR to a folder with such a path"
    )


def plain(path: Path) -> bool:
    """Return whether pythonfmu can read a path: its URI encodes no characters but spaces.

    Examples
    --------
    >>> plain(Path("/tmp/my model")), plain(Path("/tmp/modèle")), plain(Path("/tmp/100%"))
    (True, False, False)
    """
    uri = path.absolute().as_uri().replace("%20", " ")
    return unquote(uri) == uri and "%" not in uri
