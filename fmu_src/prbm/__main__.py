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
        from .commands.missing import missing_package

        print(f"prbm: {missing_package(error)}", file=sys.stderr)
        return MISTAKE
    except KeyboardInterrupt:
        print("prbm: interrupted", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
