"""``prbm list``: the shipped mechanisms."""

import argparse

from ..files.mechanism_file import read_mechanism, shipped


def print_list(options: argparse.Namespace) -> None:
    """Print name and title of each shipped mechanism."""
    files = shipped()
    width = max(map(len, files))
    for name, path in files.items():
        print(f"{name:{width}}  {read_mechanism(path).title}")
