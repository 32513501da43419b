"""Entry point of the command ``prbm``; it reports a missing package in one sentence."""

import sys

MISTAKE, INTERRUPTED = 2, 130


def main() -> int:
    """Run the command; return its exit status."""
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
