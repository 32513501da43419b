"""Arguments that commands share.  It imports no slow packages, so that help appears at once."""

from argparse import ArgumentParser
from pathlib import Path

ANIMATION_USAGE = "[options] (RESULT.csv | MECHANISM | --model NAME | --mechanism FILE) OUT.gif"


def picture_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of a picture."""
    add = parser.add_argument
    add("mechanism", metavar="MECHANISM", help="a mechanism file, or the name of a shipped one")
    add("--modes", type=int, default=0, metavar="N", help="how many modes to draw, too")
    add("--out", type=Path, metavar="FILE.png", help="default: the name of the mechanism, .png")
    set_argument(parser)


def animation_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of a film."""
    add = parser.add_argument
    add(
        "files", nargs="+", metavar="FILE",
        help="RESULT.csv or a mechanism to show; OUT.gif or OUT.mp4 to write",
    )  # fmt: skip
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--model", metavar="NAME", help="a mechanism that comes with the package")
    which.add_argument("--mechanism", metavar="FILE.toml", help="one of your own")
    set_argument(parser, "a parameter or input")
    stop_time_argument(parser)
    add("--slow", type=float, help="factor of slow motion; a round one for about ten seconds")
    add("--fps", type=float, help="frames per second; 25")
    add("--from", dest="start", metavar="T", help="first time shown [s]")
    add("--to", dest="stop", metavar="T", help="last time shown [s]")


def stop_time_argument(parser: ArgumentParser) -> None:
    """Add --stop-time."""
    parser.add_argument(
        "--stop-time", metavar="T",
        help="duration of the simulation [s]; as in an FMU of the mechanism, mostly 1",
    )  # fmt: skip


def set_argument(parser: ArgumentParser, what: str = "a parameter") -> None:
    """Add --set."""
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE",
        help=f'{what}, in SI or with a unit, "release.displacement=-10 mm"; may be repeated',
    )  # fmt: skip
