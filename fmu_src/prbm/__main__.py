"""Entry points of the commands; they report a missing package in one sentence."""

import sys

MISTAKE, INTERRUPTED = 2, 130


def main(*words: str) -> int:
    """Run the command ``prbm`` with words before those of the user; return its exit status."""
    try:
        from .commands.program import escape_output, limit_threads

        limit_threads()
        escape_output()
        from .commands.command_line import main as command  # imported here, to catch Ctrl-C

        return command([*words, *sys.argv[1:]])
    except ModuleNotFoundError as error:
        from .commands.missing import missing_package

        print(f"prbm: {missing_package(error)}", file=sys.stderr)
        return MISTAKE
    except KeyboardInterrupt:
        print("prbm: interrupted", file=sys.stderr)
        return INTERRUPTED


def build() -> int:
    """Run ``prbm build`` under its former name, ``prbm-build-fmu``; return its exit status."""
    return main("build")


if __name__ == "__main__":
    sys.exit(main())
