"""The end of a process that has used pythonfmu's library (0.7.0).

The library has a static object; its destructor runs before the library's own final function, which
assigns to that object once more and so writes to freed memory.  The library is therefore asked
to release the object before the process ends.
"""

import atexit
import ctypes
import os
import sys
from pathlib import Path

_libraries: set[str] = set()


def note_library(resources: str, name: str) -> None:
    """Remember the shared library of an FMU, given its folder of resources and its name."""
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
            continue  # unloaded already, or another version of pythonfmu
