"""Links, devices and folders in the place of each file that a command reads.

A link to a file is read.  A device, a folder and a link that leads nowhere or to itself are refused
with a message, without much memory, and no file is written.
"""

import contextlib
import io
import os
import tempfile
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from prbm.commands.command_line import main

from .report import Part

FILE = "FILE"
COMMANDS: dict[str, Sequence[str]] = {
    "mechanism": ["simulate", "FILE.toml", "--stop-time", "2 ms", "--out", "out"],
    "input": ["simulate", "PRBDM", "--stop-time", "2 ms", "--out", "out", "--input",
              "force.x=csv(FILE.csv)"],
    "record": ["measure", "frequency", "FILE.csv"],
    "package": ["ssp", "FILE.ssp", "--stop-time", "2 ms", "--out", "out"],
    "drawing DXF": ["import", "FILE.dxf", "--thickness", "1 mm", "--out", "out"],
    "drawing SVG": ["import", "FILE.svg", "--thickness", "1 mm", "--out", "out"],
    "FMU": ["sweep", "FILE.fmu", "table.csv", "--out", "out"],
}  # fmt: skip
KINDS: dict[str, Callable[[Path], object]] = {
    "endless device": lambda path: path.symlink_to("/dev/zero"),
    "empty device": lambda path: path.symlink_to("/dev/null"),
    "folder": lambda path: path.mkdir(),
    "link to nothing": lambda path: path.symlink_to("none"),
    "link to itself": lambda path: path.symlink_to(path.name),
}
MISTAKE = 2  # Status of a command after a mistake of the user.


def attacked(name: str, kinds: Sequence[str] = tuple(KINDS)) -> list[str]:
    """Return what was wrong when a command read each kind of file."""
    wrong = []
    for kind in kinds:
        with tempfile.TemporaryDirectory(prefix="prbm_readers_") as folder:
            with contextlib.chdir(folder):
                status, text = _run(name, kind)
            written = sorted(p.name for p in Path(folder).rglob("*") if p.name[:4] != FILE)
        if status != MISTAKE or FILE not in text or "Traceback" in text or written:
            wrong.append(f"{name}, {kind}: status {status}, {text[-300:]!r}, written: {written}")
    return wrong


def _run(name: str, kind: str) -> tuple[object, str]:
    words = COMMANDS[name]
    (word,) = (word for word in words if FILE in word)
    at = word[word.index(FILE) :].strip(")")
    KINDS[kind](Path(os.curdir) / at)
    streams = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
        try:
            status: object = main(list(words))
        except SystemExit as end:
            status = end.code
        except BaseException:
            status = traceback.format_exc()
    return status, streams[1].getvalue()


def run(kinds: int = len(KINDS), seed: int = 0) -> Part:
    """Try the first kinds of files in all commands."""
    del seed  # Nothing is random.
    part = Part("Files that cannot be read", ("file", "runs", "wrong"))
    for name in COMMANDS:
        wrong = attacked(name, [*KINDS][:kinds])
        part.add(name, kinds, len(wrong))
        part.failures += wrong
    part.total()
    return part
