"""``prbm new``: a commented mechanism file to start from."""

import argparse
import re
from importlib import resources
from pathlib import Path

from ..base.atomic import check_file, write
from ..files.mechanism_file import read_mechanism
from ..files.settings import UserMistake


def write_template(options: argparse.Namespace) -> None:
    """Write the file, and print what to do with it."""
    path = Path(options.name if options.name.endswith(".toml") else f"{options.name}.toml")
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", path.stem):
        raise UserMistake(
            f"{path.stem!r} is no name of a mechanism: use letters, digits and _, not a digit first"
        )
    if path.exists():
        raise UserMistake(f"{path} exists: choose another name")
    check_file(path)
    write(path, template(options.kind, path.stem).encode())
    print(f"{path}: {read_mechanism(path).title}")
    for command in ("picture", "simulate", "explore"):
        print(f"  prbm {command} {path}")


def template(kind: str, name: str) -> str:
    """Return the text of a mechanism file.

    Parameters
    ----------
    kind : str
        Name of a file in ``prbm/files/templates``.
    name : str
        Name of the mechanism.

    Examples
    --------
    >>> 'name = "Stage"' in template("guide", "Stage")
    True
    """
    folder = resources.files(__package__.rpartition(".")[0] + ".files") / "templates"
    text = (folder / f"{kind}.toml").read_text(encoding="utf-8")
    return text.replace('"NAME"', f'"{name}"', 1)
