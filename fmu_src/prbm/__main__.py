"""Entry point of the command ``prbm``; it reports a missing package in one sentence."""

import os
import sys

MISTAKE, INTERRUPTED = 2, 130
# Threads of linear algebra cost more time than they save on matrices of fewer than 300 rows.
THREADS = (
    "MKL_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def main() -> int:
    """Run the command; return its exit status."""
    for name in THREADS:  # NumPy reads them when it is imported.
        os.environ.setdefault(name, "1")
    try:
        from .commands.command_line import main as command  # imported here, to catch Ctrl-C

        return command()
    except ModuleNotFoundError as error:
        print(
            f"prbm: the Python package {error.name} is missing; install all required packages with "
            "'python -m pip install prbm-impact'",
            file=sys.stderr,
        )
        return MISTAKE
    except KeyboardInterrupt:
        print("prbm: interrupted", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
