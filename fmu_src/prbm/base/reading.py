"""Reading of files of limited size."""

import io
from collections.abc import Callable
from pathlib import Path

from .errors import PrbmError


def content(path: Path, limit: int, error: Callable[[str], PrbmError]) -> bytes:
    """Return the content of a file, which may be a device or a pipe.

    Parameters
    ----------
    path : Path
        Path of the file.
    limit : int
        Largest size of the file [bytes].
    error : callable
        Returns the error that is raised from its message, for instance a type of errors.

    Raises
    ------
    PrbmError
        If the file cannot be read, its path is invalid, or it is too large.
    """
    try:
        with path.open("rb") as file:
            data = file.read(limit + 1)
    except (OSError, ValueError) as failure:
        raise error(
            f"{shown(path)}: cannot be read ({opening_error(failure)}); correct the path, or the "
            "permissions of the file"
        ) from None
    if len(data) > limit:
        raise error(f"{path}: larger than {limit} bytes, the limit of such files; split it")
    return data


def text(path: Path, limit: int, error: Callable[[str], PrbmError]) -> io.StringIO:
    """Return the text of a file in UTF-8, with or without a mark of the byte order.

    The arguments and errors are those of :func:`content`.

    Raises
    ------
    UnicodeDecodeError
        If the file has another encoding.
    """
    return io.StringIO(content(path, limit, error).decode("utf-8-sig"), newline="")


def shown(path: Path) -> str:
    r"""Return a path for a message, with escapes if a file cannot have this name.

    Examples
    --------
    >>> shown(Path("a.toml")), shown(Path("a\0.toml")), shown(Path("a\ud800.toml"))
    ('a.toml', "'a\\x00.toml'", "'a\\ud800.toml'")
    """
    text = str(path)
    return text if text.isprintable() else ascii(text)


def opening_error(error: OSError | ValueError) -> str:
    """Return the reason why a file cannot be opened.

    A :class:`ValueError` is raised for a path with a null byte, or with characters that the
    encoding of the file system lacks.
    """
    return getattr(error, "strerror", None) or str(error)
