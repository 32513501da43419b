"""Libraries of the kernel inside a wheel, for this machine or for every platform.

A wheel that was built with libraries has them in the folder ``libraries`` of this package, with
their SHA-256 and that of the kernel's source in ``libraries.json``.  A clone has no such folder.
"""

import hashlib
import json
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from ..base.errors import PrbmError
from .sources import files_digest

FOLDER = "libraries"
LIST = "libraries.json"


class DamagedLibraryError(PrbmError):
    """A library of the installed package is missing or differs from the one that was built."""


def package_files(
    libraries: Mapping[str, bytes], compiler: str, sources: Mapping[str, bytes]
) -> dict[str, bytes]:
    """Return the files that a wheel adds to this package, by path relative to the package.

    Parameters
    ----------
    libraries : mapping of str to bytes
        Libraries by path: the name of the platform, a slash and the name of the library.
    compiler : str
        Name and version of the compiler.
    sources : mapping of str to bytes
        The source from which they were compiled.
    """
    listed = {
        "compiler": compiler,
        "kernel": files_digest(sources),
        "libraries": {name: hashlib.sha256(libraries[name]).hexdigest() for name in libraries},
    }
    content = json.dumps(listed, indent=1, sort_keys=True) + "\n"
    result = {f"{FOLDER}/{LIST}": content.encode()}
    return result | {f"{FOLDER}/{name}": libraries[name] for name in libraries}


def prebuilt(name: str, sources: Mapping[str, bytes]) -> bytes | None:
    """Return a library of the installed package.

    Parameters
    ----------
    name : str
        Path of the library, as in :func:`package_files`.
    sources : mapping of str to bytes
        The kernel's source.

    Returns
    -------
    bytes or None
        None if the package does not list the library, or if its source has been changed since the
        libraries were compiled.

    Raises
    ------
    DamagedLibraryError
        If the listed library is missing or its SHA-256 is not the listed one.
    """
    folder = files(__package__).joinpath(FOLDER)
    try:
        listed: dict[str, Any] = json.loads(folder.joinpath(LIST).read_bytes())
        compiled, digests = listed["kernel"], dict(listed["libraries"])
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError, TypeError, KeyError):
        raise _damaged(LIST) from None
    if name not in digests or compiled != files_digest(sources):
        return None
    try:
        content = folder.joinpath(name).read_bytes()
    except OSError:
        raise _damaged(name) from None
    if hashlib.sha256(content).hexdigest() != digests[name]:
        raise _damaged(name)
    return content


def _damaged(name: str) -> DamagedLibraryError:
    return DamagedLibraryError(
        f"the file {FOLDER}/{name} of the installed package is damaged; install it again with "
        "'python -m pip install --force-reinstall', or, for this machine alone, set the "
        "environment variable CC to a compiler"
    )
