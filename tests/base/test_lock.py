"""Locks between processes."""

import errno
import importlib.util
import os
import platform
import subprocess
import sys
import threading
import time
import types
from pathlib import Path

import pytest

import prbm
from prbm.base import lock as locks
from prbm.base.atomic import FileError
from prbm.base.lock import LockedError, locked

HOLDER = """
import sys, time
from pathlib import Path
from prbm.base.lock import locked
with locked(Path(sys.argv[1])):
    print("locked", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """Return a process that holds the lock of tmp_path/lock."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path / "lock")],
        env={**os.environ, "PYTHONPATH": str(Path(prbm.__file__).parents[1])},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "locked\n"
    yield process
    process.kill()
    process.communicate()


def test_a_held_lock_is_rejected_with_its_owner(holder, tmp_path):
    with (
        pytest.raises(LockedError, match=f"process {holder.pid} on "),
        locked(tmp_path / "lock", wait=False),
    ):
        pytest.fail("the lock was taken twice")


def test_the_lock_of_a_killed_process_is_free(holder, tmp_path):
    holder.kill()
    holder.wait()
    assert (tmp_path / "lock").read_text(
        encoding="utf-8"
    ) == f"process {holder.pid} on {platform.node()}"
    with locked(tmp_path / "lock", wait=False):
        assert str(os.getpid()) in (tmp_path / "lock").read_text(encoding="utf-8")
    assert (tmp_path / "lock").read_text(encoding="utf-8") == ""


def test_a_wait_for_a_lock_ends_when_its_owner_ends(holder, tmp_path):
    begin = time.monotonic()
    threading.Timer(0.5, holder.kill).start()
    with locked(tmp_path / "lock"):
        assert time.monotonic() - begin > 0.3


def test_threads_and_nested_blocks_lock_each_other_out(tmp_path):
    with (
        locked(tmp_path / "lock"),
        pytest.raises(LockedError),
        locked(tmp_path / "lock", wait=False),
    ):
        pytest.fail("the lock was taken twice")


def test_a_block_runs_without_lock_if_the_file_cannot_be_opened(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with locked(tmp_path / "file" / "lock", wait=False):
        pass


def test_a_block_runs_without_lock_on_a_file_system_without_locks(tmp_path, monkeypatch):
    def unsupported(handle, wait):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(locks, "_lock", unsupported)
    with locked(tmp_path / "lock", wait=False), locked(tmp_path / "lock", wait=False):
        pass


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other links")
@pytest.mark.parametrize("kind", ["symlink", "dangling", "link", "pipe"])
def test_the_file_of_a_lock_is_no_other_file(tmp_path, kind):
    precious, lock = tmp_path / "precious", tmp_path / "lock"
    if kind != "dangling":
        precious.write_text("content", encoding="utf-8")
    make = {"link": lock.hardlink_to, "pipe": lambda _: os.mkfifo(lock)}
    make.get(kind, lock.symlink_to)(precious)
    with pytest.raises(FileError, match="not the file of a lock; remove it"), locked(lock):
        pytest.fail("the lock was taken")
    if kind == "dangling":
        assert not precious.exists()
    else:
        assert precious.read_text(encoding="utf-8") == "content"


class Msvcrt(types.ModuleType):
    """Replacement for the module of Windows: one handle at a time may lock the byte of a file."""

    LK_NBLCK, LK_UNLCK = 2, 0

    def __init__(self):
        super().__init__("msvcrt")
        self.owners = {}

    def locking(self, handle, mode, count):
        key = (os.fstat(handle).st_ino, os.lseek(handle, 0, os.SEEK_CUR))
        assert key[1] == locks.LOCKED_BYTE
        if mode == self.LK_UNLCK:
            assert self.owners.pop(key) == handle
        elif self.owners.setdefault(key, handle) != handle:
            raise OSError(errno.EACCES, "Permission denied")


@pytest.fixture
def windows(monkeypatch):
    """Return ``prbm.base.lock`` as it is imported on Windows."""
    monkeypatch.setitem(sys.modules, "msvcrt", Msvcrt())
    monkeypatch.setattr(sys, "platform", "win32")
    spec = importlib.util.spec_from_file_location("prbm.base.windows_lock", locks.__file__)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_on_windows_a_held_lock_is_rejected_with_its_owner(windows, tmp_path):
    with (
        windows.locked(tmp_path / "lock"),
        pytest.raises(windows.LockedError, match=f"process {os.getpid()} on "),
        windows.locked(tmp_path / "lock", wait=False),
    ):
        pytest.fail("the lock was taken twice")
    with windows.locked(tmp_path / "lock", wait=False):
        pass


def test_on_windows_a_held_lock_is_polled(windows, tmp_path, monkeypatch):
    path = tmp_path / "lock"
    path.touch()
    owners = windows.msvcrt.owners
    owners[path.stat().st_ino, locks.LOCKED_BYTE] = None
    monkeypatch.setattr(windows.time, "sleep", lambda seconds: owners.clear())
    with windows.locked(path):
        assert path.read_text(encoding="utf-8").startswith(f"process {os.getpid()}")
