"""The entry point of the command ``prbm``: reports a missing package in a sentence."""

import sys

NOT_STARTED, INTERRUPTED = 2, 130


def main() -> int:
    """Run the command; return its exit status."""
    try:
        from .commands.command_line import main as command  # here, so that Ctrl-C is caught

        return command()
    except ModuleNotFoundError as error:
        print(
            f"prbm needs the Python package {error.name}; install what it needs with "
            "'python -m pip install prbm-impact'",
            file=sys.stderr,
        )
        return NOT_STARTED
    except KeyboardInterrupt:
        print("prbm: interrupted", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
