"""Files that all processes of a test run share; each file is made once."""

import atexit
import os
import shutil
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

from prbm.kernel.compiler import _locked


@cache
def shared_folder() -> Path:
    """Return the folder of the shared files; the last process of the run removes it."""
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID", f"of-{os.getpid()}")
    path = Path(tempfile.gettempdir()) / f"prbm_tests_{run}"
    users = path / "users"
    users.mkdir(parents=True, exist_ok=True)
    (users / str(os.getpid())).touch()
    atexit.register(_leave, path)
    return path


def _leave(path: Path) -> None:
    """Remove the folder unless other processes still use it."""
    users = path / "users"
    (users / str(os.getpid())).unlink()
    if not any(users.iterdir()):
        shutil.rmtree(path, ignore_errors=True)


def once(name: str, make: Callable[[Path], object]) -> Path:
    """Return a shared file or folder; the first process that needs it makes it."""
    path = shared_folder() / name
    with _locked(path.with_name(f"{name}.lock")):
        if not path.exists():
            part = path.with_name(f"part-{name}")
            make(part)
            part.rename(path)
    return path
