"""Atomic writing of files: readers see the old content or the new one, never a part of it."""

import os
from collections.abc import Mapping
from pathlib import Path

from .errors import PrbmError

FILE_MODE = 0o644  # The umask removes further permissions.


class FileError(PrbmError, OSError):
    """A file cannot be written at its path."""


def write(path: str | Path, content: bytes) -> None:
    """Write a file completely or not at all; create its folder if needed.

    Raises
    ------
    OSError
        If the folder cannot be created or the file cannot be written.
    """
    write_all({Path(path): content})


def write_all(files: Mapping[Path, bytes]) -> None:
    """Write files; create their folders if needed.

    All contents are written to temporary files first.  Then the temporary files are renamed.  If
    a content cannot be written, no file is changed.  If a renaming fails, the files renamed before
    it remain changed.

    Parameters
    ----------
    files : mapping
        Path and content of each file.

    Raises
    ------
    FileError
        If a path is a pipe or a device, which the renaming would remove.
    OSError
        If a folder cannot be created or a file cannot be written; ``filename`` is that file.
    """
    for path in files:
        check_name(path)
        _check_kind(path)
    partial: dict[Path, Path] = {}
    path = Path()
    try:
        for path, content in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            draft = path.with_name(f".{path.name}.{os.urandom(4).hex()}")
            with open(draft, "xb", opener=_created) as file:
                partial[path] = draft
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        for path, draft in partial.items():
            draft.replace(path)
    except OSError as error:
        error.filename = str(path)
        raise
    finally:
        for draft in partial.values():
            draft.unlink(missing_ok=True)


def _created(name: str, flags: int) -> int:
    return os.open(name, flags, FILE_MODE)


def _check_kind(path: Path) -> None:
    """Check that a path is a file, a folder or does not exist; links are followed."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise FileError(f"cannot write {path}: it is a pipe or a device; choose another name")


def check_name(path: Path) -> None:
    """Check that the encoding of the file system has all characters of a path.

    Raises
    ------
    FileError
        If it lacks one.
    """
    try:
        os.fsencode(path)
    except UnicodeEncodeError as error:
        raise FileError(
            f"cannot write {str(path)!a}: names of files have the encoding {error.encoding} here, "
            f"which lacks {error.object[error.start]!a}; choose another name, or set the "
            "environment variable PYTHONUTF8=1"
        ) from None


def check_writable(folder: Path, remedy: str = "choose a folder with --out") -> None:
    """Check, before a long computation, that files can be written to a folder.

    The folder need not exist.

    Parameters
    ----------
    folder : Path
        The folder.
    remedy : str
        End of the error message.

    Raises
    ------
    FileError
        If the path is a file or not a valid name, or there is no permission to write.
    """
    check_name(folder)
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise FileError(f"cannot write to {folder}: {existing} is a file; {remedy}")
    if not os.access(existing, os.W_OK):
        raise FileError(f"cannot write to {folder}: no permission in {existing}; {remedy}")


def check_file(path: Path) -> None:
    """Check, before a long computation, that a file can be written.

    Its folder need not exist.

    Raises
    ------
    FileError
        If the path is a folder, a pipe or a device, its parent is a file, or there is no
        permission to write.
    """
    check_name(path)
    _check_kind(path)
    if path.is_dir():
        raise FileError(f"cannot write {path}: it is a folder; choose another name")
    check_writable(path.parent, "choose another folder")


def check_no_folder(path: Path) -> None:
    """Check that the path of a file is not a folder.

    Raises
    ------
    FileError
        If the path is a folder.
    """
    if path.is_dir():
        raise FileError(
            f"cannot write {path}: it is a folder; remove it, or choose another path with --out"
        )
