"""Entry point of the command ``prbm``; it reports a missing package in one sentence."""

import sys

MISTAKE, INTERRUPTED = 2, 130


def main() -> int:
    """Run the command; return its exit status."""
    try:
        from .commands.program import escape_output, limit_threads

        limit_threads()
        escape_output()
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
