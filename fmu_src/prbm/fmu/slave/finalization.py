"""Finalization of pythonfmu's library (0.7.0) at the end of a process.

The library has a static object.  Its destructor runs before the library's final function, which
assigns to the object again and so writes to freed memory.  The object is therefore released
before the process ends.
"""

import atexit
import ctypes
import os
import sys
from pathlib import Path

_libraries: set[str] = set()


def note_library(resources: str, name: str) -> None:
    """Register the shared library of an FMU, given its folder of resources and its name."""
    if sys.platform == "linux":
        _libraries.add(str(Path(resources).parent / "binaries" / "linux64" / f"{name}.so"))


@atexit.register
def _finalize_libraries() -> None:
    """Finalize the libraries that are still loaded."""
    for library in _libraries:
        try:
            loaded = ctypes.CDLL(library, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
            loaded.finalizePythonInterpreter()
        except (OSError, AttributeError):
            continue  # Unloaded already, or another version of pythonfmu.
