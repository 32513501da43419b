"""Arguments shared by several commands.

This module imports no slow packages, so that help appears at once.
"""

from argparse import ArgumentParser
from pathlib import Path

ANIMATION_USAGE = "[options] (RESULT.csv | MECHANISM | --model NAME | --mechanism FILE) OUT.gif"


def picture_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prbm picture``."""
    add = parser.add_argument
    add("mechanism", metavar="MECHANISM", help="mechanism file, or name of a shipped mechanism")
    add("--modes", type=int, default=0, metavar="N", help="number of modes to draw (default: 0)")
    add(
        "--out", type=Path, metavar="FILE.png",
        help="file to write (default: the mechanism's name with .png)",
    )  # fmt: skip
    set_argument(parser)


def animation_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prbm animate``."""
    add = parser.add_argument
    add(
        "files", nargs="+", metavar="FILE",
        help="RESULT.csv or a mechanism to show, then OUT.gif or OUT.mp4 to write",
    )  # fmt: skip
    mechanism = parser.add_mutually_exclusive_group()
    mechanism.add_argument("--model", metavar="NAME", help="name of a shipped mechanism")
    mechanism.add_argument("--mechanism", metavar="FILE.toml", help="mechanism file")
    set_argument(parser, "value of a parameter or input")
    stop_time_argument(parser)
    add(
        "--slow", type=float, metavar="FACTOR",
        help="factor of slow motion (default: a round factor for a film of about ten seconds)",
    )  # fmt: skip
    add("--fps", type=float, metavar="N", help="frames per second (default: 25)")
    add("--from", dest="start", metavar="T", help="first time shown [s] (default: the release)")
    add(
        "--to", dest="stop", metavar="T",
        help="last time shown [s] (default: shortly after the motion ends)",
    )  # fmt: skip


def stop_time_argument(parser: ArgumentParser) -> None:
    """Add --stop-time."""
    parser.add_argument(
        "--stop-time", metavar="T",
        help="duration of the simulation [s] (default: that of the mechanism's FMU, usually 1)",
    )  # fmt: skip


def set_argument(parser: ArgumentParser, meaning: str = "value of a parameter") -> None:
    """Add --set."""
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE",
        help=f'{meaning}, in SI or with a unit: "release.displacement=-10 mm"; repeatable',
    )  # fmt: skip
