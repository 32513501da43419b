"""Exit statuses of the commands, and the name under which the FMU builder was started."""

import sys
from pathlib import Path

OK, FAILED, MISTAKE, INTERRUPTED = 0, 1, 2, 130
BUILDER = "build_fmu"  # Module that python -m runs.


def command_name() -> str:
    """Return the name of the running program as the user typed it."""
    path = Path(sys.argv[0])
    if path.resolve() == Path(__file__).resolve().with_name(f"{BUILDER}.py"):
        return f"python -m {__package__}.{BUILDER}"
    return path.stem if path.suffix == ".exe" else path.name
