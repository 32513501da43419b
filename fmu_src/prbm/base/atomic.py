"""Files that are written at once: whoever looks sees the old one or the new one, never a part."""

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from .errors import PrbmError

PLAIN = 0o644


class FileError(PrbmError, OSError):
    """A file cannot be written where it should be."""


def write(path: str | Path, content: bytes) -> None:
    """Write a file whole or not at all, in a folder that is created if it does not exist.

    Raises
    ------
    OSError
        If the folder cannot be created or the file cannot be written.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_all({path: content})


def write_all(files: Mapping[Path, bytes]) -> None:
    """Write files: first all contents beside their places, then all names.

    Raises
    ------
    OSError
        If one of them cannot be written, which it names; then none is, unless it is a name that
        fails after others went well.
    """
    partial: dict[Path, str] = {}
    path = Path()
    try:
        for path, content in files.items():
            handle, partial[path] = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(partial[path], PLAIN)
        for path, name in partial.items():
            os.replace(name, path)
    except OSError as error:
        error.filename = str(path)
        raise
    finally:
        for name in partial.values():
            Path(name).unlink(missing_ok=True)


def check_writable(folder: Path, remedy: str = "choose a folder with --out") -> None:
    """Find out before the work whether its result can be kept in a folder, which may not exist.

    Raises
    ------
    FileError
        If it is a file, or there is no permission.
    """
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise FileError(f"cannot write to {folder}: {existing} is a file; {remedy}")
    if not os.access(existing, os.W_OK):
        raise FileError(f"cannot write to {folder}: no permission in {existing}; {remedy}")


def check_file(path: Path) -> None:
    """Find out before the work whether a file can be written, whose folder may not exist.

    Raises
    ------
    FileError
        If it is a folder, its folder is a file, or there is no permission.
    """
    if path.is_dir():
        raise FileError(f"cannot write {path}: it is a folder; choose another name")
    check_writable(path.parent, "choose another folder")


def check_no_folder(path: Path) -> None:
    """Refuse a folder where a file is to be.

    Raises
    ------
    FileError
        If there is one.
    """
    if path.is_dir():
        raise FileError(
            f"cannot write {path}: it is a folder; remove it, or choose another place with --out"
        )
