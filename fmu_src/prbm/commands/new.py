"""``prbm new``: a commented mechanism file to start from, a template or a shipped mechanism."""

import argparse
import re
from importlib import resources
from pathlib import Path

from ..base.atomic import check_file, write
from ..base.names import proposal
from ..files.mechanism_file import read_mechanism, shipped
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
    text = (
        template(options.kind, path.stem)
        if options.shipped is None
        else copied(options.shipped, path.stem)
    )
    write(path, text.encode())
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


def copied(shipped_name: str, name: str) -> str:
    """Return the text of a shipped mechanism with another name and title.

    Parameters
    ----------
    shipped_name : str
        Name of the shipped mechanism.
    name : str
        Name of the mechanism.

    Raises
    ------
    UserMistake
        If no such mechanism is shipped.

    Examples
    --------
    >>> text = copied("Bistable", "Snap")
    >>> 'name = "Snap"' in text, 'title = "Snap, from Bistable: Bistable shuttle that' in text
    (True, True)
    """
    files = shipped()
    if shipped_name not in files:
        raise UserMistake(
            f"--from {shipped_name}: no shipped mechanism; {proposal(shipped_name, files)}"
        )
    text = files[shipped_name].read_text(encoding="utf-8")
    text = text.replace(f'\nname = "{shipped_name}"\n', f'\nname = "{name}"\n', 1)
    return text.replace('\ntitle = "', f'\ntitle = "{name}, from {shipped_name}: ', 1)
