"""Reading of files of limited size."""

from pathlib import Path

from .errors import PrbmError


def content(path: Path, limit: int, error: type[PrbmError]) -> bytes:
    """Return the content of a file, which may be a device or a pipe.

    Parameters
    ----------
    path : Path
        Path of the file.
    limit : int
        Largest size of the file [bytes].
    error : type of error
        Type of the error that is raised.

    Raises
    ------
    PrbmError
        If the file cannot be read, its path is invalid, or it is too large.
    """
    try:
        with path.open("rb") as file:
            data = file.read(limit + 1)
    except OSError as failure:
        raise error(f"{path}: cannot be read ({failure.strerror})") from None
    except ValueError as failure:  # a null byte or a surrogate in the path
        raise error(f"{str(path)!r}: cannot be read ({failure})") from None
    if len(data) > limit:
        raise error(f"{path}: larger than {limit} bytes, the limit of such files; split it")
    return data
