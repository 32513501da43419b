"""``prbm picture`` and ``prbm animate``."""

import argparse

from ..base.atomic import FileError
from ..plots import animation, picture


def drawn(options: argparse.Namespace) -> None:
    """Draw a mechanism to a PNG file."""
    try:
        print(picture.run(options))
    except OSError as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{error.filename}: cannot be written ({error.strerror})") from None


def animated(options: argparse.Namespace) -> None:
    """Write a film."""
    print(animation.run(options))
