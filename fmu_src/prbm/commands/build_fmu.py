"""The command that builds FMUs, up to where it imports what takes time and may be missing."""

import sys
from pathlib import Path

from ..fmu.date import date

FAILED_TO_START, INTERRUPTED = 2, 130


def command_name() -> str:
    """Return what the user typed to get here."""
    path = Path(sys.argv[0])
    if path.resolve() == Path(__file__).resolve():
        return f"python -m {__spec__.name}"
    return path.stem if path.suffix == ".exe" else path.name


def main() -> int:
    """Run the command; return its exit status."""
    try:
        try:
            date()  # a wrong one keeps SciPy from being imported: numpy.f2py reads it too
        except ValueError as error:
            print(f"{command_name()}: {error}", file=sys.stderr)
            return FAILED_TO_START
        from . import building as cli

        return cli.main()
    except ModuleNotFoundError as error:
        print(
            f"{command_name()} needs the Python package {error.name}; install what it needs with "
            "'python -m pip install .' in the folder of build_fmu.py",
            file=sys.stderr,
        )
        return FAILED_TO_START
    except KeyboardInterrupt:
        print(f"{command_name()}: interrupted", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
