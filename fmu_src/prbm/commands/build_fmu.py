"""The entry point of the command that builds FMUs.

NumPy and SciPy are imported after ``SOURCE_DATE_EPOCH`` has been checked, and a missing package is
reported in a sentence.
"""

import sys

from ..fmu.date import date
from .program import INTERRUPTED, MISTAKE, command_name


def main() -> int:
    """Run the command; return its exit status."""
    try:
        try:
            date()  # a wrong one fails the import of SciPy: numpy.f2py reads it, too
        except ValueError as error:
            print(f"{command_name()}: {error}", file=sys.stderr)
            return MISTAKE
        from . import building  # here, because it takes a second and packages may be missing

        return building.main()
    except ModuleNotFoundError as error:
        print(
            f"{command_name()} needs the Python package {error.name}; install what it needs with "
            "'python -m pip install .' in the folder of build_fmu.py",
            file=sys.stderr,
        )
        return MISTAKE
    except KeyboardInterrupt:
        print(f"{command_name()}: interrupted", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
