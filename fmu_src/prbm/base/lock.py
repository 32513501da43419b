"""Locks between processes, on files that the operating system locks."""

import errno
import os
import platform
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .atomic import FileError
from .errors import PrbmError

OWNER_LENGTH_MAX = 200  # Bytes of the text that describes the owner of a lock.
FLAGS = os.O_RDWR | os.O_CREAT
FLAGS |= sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_NOCTTY"))
LOCKED_BYTE = 1 << 30  # On Windows a locked byte cannot be read; this one is behind the text.
POLLING_INTERVAL = 0.1  # s between two attempts on Windows.


class LockedError(PrbmError, RuntimeError):
    """A lock is held by another process, or by another thread of this one.

    The message describes the owner, as "process 4711 on host".
    """


@contextmanager
def locked(path: Path, *, wait: bool = True) -> Iterator[None]:
    """Hold a lock during a ``with`` block.

    The system releases the lock when its process ends in any way, so that no stale lock remains.
    The file stays; it is empty while no process holds the lock.  If it cannot be opened, or its
    file system has no locks, the block runs without a lock.

    Parameters
    ----------
    path : Path
        The file of the lock, created with its folder if necessary.
    wait : bool
        Wait until the lock is free (default: True).

    Raises
    ------
    LockedError
        If the lock is held and ``wait`` is false.
    FileError
        If the path is a link, a pipe or a device, or the file has another name.
    """
    handle = _opened(path)
    if handle is None:
        yield
        return
    try:
        try:
            _lock(handle, wait)
        except BlockingIOError:
            raise LockedError(_owner(handle)) from None
        except OSError:  # The file system has no locks.
            yield
            return
        _describe(handle, f"process {os.getpid()} on {platform.node() or 'this machine'}")
        try:
            yield
        finally:
            _describe(handle, "")
            _unlock(handle)
    finally:
        os.close(handle)


def open_locked(path: Path) -> int:
    """Return the descriptor of a regular file that is open for reading and writing, and locked.

    The file is created with its folder if necessary.  Closing it releases the lock.  If the file
    system has no locks, the file is not locked.

    Raises
    ------
    LockedError
        If the lock is held.
    FileError
        If the path is a link, a pipe or a device, or the file has another name.
    OSError
        If the file cannot be opened.
    """
    while True:
        handle = _open(path)
        try:
            _lock(handle, False)
        except BlockingIOError:
            os.close(handle)
            raise LockedError("another process") from None
        except OSError:  # The file system has no locks.
            return handle
        if os.fstat(handle).st_nlink:
            return handle
        os.close(handle)  # Its last owner has removed it meanwhile.


def _opened(path: Path) -> int | None:
    """Open the file of a lock; return None if it cannot be opened.

    Its content is replaced, so that it must not be the content of another file.
    """
    try:
        return _open(path)
    except FileError:
        raise
    except OSError:
        return None


def _open(path: Path) -> int:
    """Open a regular file that has no other name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        handle = os.open(path, FLAGS, 0o666)
    except OSError as error:
        if error.errno != errno.ELOOP and not path.is_symlink():
            raise
        raise _foreign(path) from None
    found = os.fstat(handle)
    if stat.S_ISREG(found.st_mode) and found.st_nlink <= 1:  # 0: removed meanwhile.
        return handle
    os.close(handle)
    raise _foreign(path)


def _foreign(path: Path) -> FileError:
    return FileError(f"{path}: a link, a pipe or a device, not the file of a lock; remove it")


def _describe(handle: int, text: str) -> None:
    """Write the owner of a lock to its file."""
    with suppress(OSError):
        os.ftruncate(handle, 0)
        os.lseek(handle, 0, os.SEEK_SET)
        os.write(handle, text.encode(errors="replace")[:OWNER_LENGTH_MAX])


def _owner(handle: int) -> str:
    """Return the text that describes the owner of a lock."""
    with suppress(OSError):
        os.lseek(handle, 0, os.SEEK_SET)
        text = os.read(handle, OWNER_LENGTH_MAX).decode(errors="replace")
        if text:
            return text
    return "another process"


if sys.platform == "win32":
    import msvcrt

    HELD = (13, 36)  # Error numbers of a byte that is locked: EACCES, EDEADLOCK.

    def _lock(handle: int, wait: bool) -> None:
        """Lock a file; raise BlockingIOError if it is locked and ``wait`` is false."""
        while True:
            try:
                os.lseek(handle, LOCKED_BYTE, os.SEEK_SET)
                return msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
            except OSError as error:
                if error.errno not in HELD:
                    raise
                if not wait:
                    raise BlockingIOError(*error.args) from None
            time.sleep(POLLING_INTERVAL)

    def _unlock(handle: int) -> None:
        with suppress(OSError):
            os.lseek(handle, LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_UNLCK, 1)

else:
    import fcntl

    def _lock(handle: int, wait: bool) -> None:
        """Lock a file; raise BlockingIOError if it is locked and ``wait`` is false."""
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))

    def _unlock(handle: int) -> None:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_UN)
