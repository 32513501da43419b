"""The C kernel as a library of this process, and its functions of ``engine.h``.

The library is compiled once and kept in the user's cache, see :mod:`prbm.kernel.compiler`.
"""

import ctypes
import hashlib
import logging
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path

from ..base.atomic import write
from ..base.errors import PrbmError
from .compiler import ENGINE, HOST, OTHER_FOLDER, libraries, private_cache, trusted

MESSAGE_LENGTH = 640  # Bytes of an error message, PROBLEM_LENGTH in C.

_bool, _int, _double, _size = ctypes.c_bool, ctypes.c_int, ctypes.c_double, ctypes.c_size_t
_address, _bytes = ctypes.c_void_p, ctypes.c_char_p
FUNCTIONS = {
    "prbm_mechanism_open": (_address, _bytes, _size, _bytes),
    "prbm_mechanism_close": (None, _address),
    "prbm_open": (_address, _address),
    "prbm_close": (None, _address),
    "prbm_set": (_bool, _address, _int, _int, _address, _bytes),
    "prbm_start": (_bool, _address, _double, _double, _bytes),
    "prbm_instability": (_bool, _address, _address, _bytes),
    "prbm_check_step": (_bool, _address, _double, _bytes),
    "prbm_advance": (_int, _address, _double, _bytes),
    "prbm_abandon": (None, _address),
    "prbm_values": (_bool, _address, _int, _address, _address, _bytes),
    "prbm_sample": (
        _int, _address, _int, _address, _int, _address, _address, _address, _bytes,
    ),
    "prbm_state": (_bool, _address, _address, _bytes),
    "prbm_section_count": (_int, _address),
    "prbm_sections": (_bool, _address, _address, _bytes),
    "prbm_time": (_double, _address),
    "prbm_steps": (_double, _address),
    "prbm_coordinates": (_int, _address),
    "prbm_point_count": (_int, _address),
    "prbm_points": (None, _address, _address, _address),
    "prbm_mode_count": (_int, _address),
    "prbm_modes": (_int, _address, _address, _address, _address, _bytes),
    "prbm_record": (None, _address, _bool),
    "prbm_impact_size": (_int, _address),
    "prbm_impacts": (None, _address, _address),
    "prbm_observe": (_bool, _address, _int, _address, _bytes),
    "prbm_observed_count": (_int, _address),
    "prbm_observed": (None, _address, _address),
    "prbm_saved_count": (_size, _address),
    "prbm_save": (None, _address, _address),
    "prbm_restore": (_bool, _address, _address, _bytes),
}  # fmt: skip
"""Type of the result and types of the arguments of each function."""

log = logging.getLogger(__name__)


class LibraryError(PrbmError):
    """The compiled kernel cannot be loaded."""


@cache
def library() -> ctypes.CDLL:
    """Return the kernel, compiled and loaded at the first call.

    Raises
    ------
    CompilerError
        If there is no compiler, or it fails.
    DamagedLibraryError
        If the library of the installed package is damaged.
    LibraryError
        If the library cannot be loaded.
    """
    ((platform, content),) = libraries([HOST], log.warning, ENGINE).items()
    return _loaded(content, platform.suffix)


def _loaded(content: bytes, suffix: str) -> ctypes.CDLL:
    """Return a library from the content of its file, with the types of its functions."""
    with _file(content, suffix) as path:
        try:
            loaded = ctypes.CDLL(str(path))
        except OSError as error:
            raise LibraryError(f"the compiled kernel cannot be loaded ({error})") from None
    for name, (result, *arguments) in FUNCTIONS.items():
        function = getattr(loaded, name, None)
        if function is None:
            raise LibraryError(f"the compiled kernel has no function {name}")
        function.restype, function.argtypes = result, arguments
    return loaded


@contextmanager
def _file(content: bytes, suffix: str) -> Iterator[Path]:
    """Yield the path of a file with a library, in the private cache or in a temporary folder."""
    folder = private_cache()
    if folder is not None:
        path = folder / f"engine-{hashlib.sha256(content).hexdigest()[:32]}{suffix}"
        if _kept(path, content):
            yield path
            return
    with ExitStack() as stack:
        try:
            # A loaded library cannot be removed on Windows; it remains in the folder there.
            temporary = tempfile.TemporaryDirectory(prefix="prbm_", ignore_cleanup_errors=True)
            path = Path(stack.enter_context(temporary)) / f"prbm_engine{suffix}"
            path.write_bytes(content)
        except OSError as error:
            raise LibraryError(
                "the compiled kernel cannot be written to a temporary folder "
                f"({error.strerror or error}): {OTHER_FOLDER}"
            ) from None
        yield path


def _kept(path: Path, content: bytes) -> bool:
    """Return whether a file that only this user can write has a content; write it if necessary."""
    try:
        if path.is_file() and trusted(path.stat()) and path.read_bytes() == content:
            return True
        write(path, content)
    except OSError:
        return False
    return True
