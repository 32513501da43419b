"""Entry point of the command that builds FMUs.

It checks ``SOURCE_DATE_EPOCH`` before NumPy and SciPy are imported, and reports a missing package
in one sentence.
"""

import sys

from ..fmu.date import date
from .missing import missing_package
from .program import (
    INTERRUPTED,
    MISTAKE,
    command_name,
    discard_output,
    escape_output,
    flush_output,
    limit_threads,
    report_unwritable,
)


def main() -> int:
    """Run the command; return its exit status."""
    limit_threads()
    escape_output()
    try:
        try:
            date()  # SciPy cannot be imported with an invalid date: numpy.f2py reads it, too.
        except ValueError as error:
            print(f"{command_name()}: {error}", file=sys.stderr)
            return MISTAKE
        from . import building  # imported here: it takes a second, and packages may be missing

        status = building.main()
        flush_output()
        return status
    except BrokenPipeError:  # The reader of the output, for instance head, has closed the pipe.
        return discard_output()
    except OSError as error:
        return report_unwritable(command_name(), error)
    except ModuleNotFoundError as error:
        print(f"{command_name()}: {missing_package(error)}", file=sys.stderr)
        return MISTAKE
    except KeyboardInterrupt:
        print(f"{command_name()}: interrupted", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
