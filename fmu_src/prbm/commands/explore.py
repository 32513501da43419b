"""``prbm explore``: a page that simulates a mechanism in the browser."""

import argparse
import webbrowser
from pathlib import Path

from ..base.atomic import check_file, write
from ..files.mechanism_file import load
from ..fmu.explorer import explorer
from .parameters import given_values


def write_page(options: argparse.Namespace) -> None:
    """Write the page of a mechanism, and open it in the browser."""
    mechanism = load(options.mechanism)
    path = options.out or Path(f"{mechanism.name}.html")
    check_file(path)
    page = explorer(mechanism, given_values(mechanism, options))
    write(path, page.encode())
    print(path)
    if options.open:
        webbrowser.open(path.resolve().as_uri())
