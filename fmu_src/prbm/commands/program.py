"""Exit statuses, threads and output of the commands."""

import io
import os
import sys

from ..base.threads import THREAD_LIMITS

OK, FAILED, MISTAKE, INTERRUPTED = 0, 1, 2, 130


def limit_threads() -> None:
    """Limit linear algebra to one thread, unless the environment has a number of threads.

    The function has no effect after the import of NumPy, which reads the variables.
    """
    for name in THREAD_LIMITS:
        os.environ.setdefault(name, "1")


def escape_output() -> None:
    r"""Print characters that the encoding of the output lacks as escapes, such as ``\xb5``.

    A redirected output may have an encoding without the characters of units or paths.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def discard_output() -> int:
    """Discard all further output, whose reader has closed the pipe; return the exit status."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return FAILED


def flush_output() -> None:
    """Write all output now; there is none if standard output is closed."""
    if sys.stdout is not None:
        sys.stdout.flush()


def report_unwritable(name: str, error: OSError) -> int:
    """Report a file or an output that cannot be written; return the exit status."""
    place = error.filename or "standard output"
    print(
        f"{name}: cannot write {place} ({error.strerror or error}); choose another place for the "
        "output",
        file=sys.stderr,
    )
    try:
        flush_output()
    except OSError:
        discard_output()
    return FAILED
