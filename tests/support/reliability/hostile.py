"""Links, pipes and devices in the place of each file that a command writes."""

import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from .faults import command
from .report import Part

RUN = ["--stop-time", "2 ms"]
COMMANDS: dict[str, Sequence[str]] = {
    "simulate": ["simulate", "PRBDM", *RUN, "--out", "."],
    "study": ["study", "PRBDM", "--vary", "stop.position=0:1 mm:2", "--workers", "1", *RUN,
              "--of", "shuttle.x", "--out", "."],
    "modes": ["modes", "PRBDM", "--out", "."],
    "parameters": ["parameters", "PRBDM", "--out", "a.ssv"],
    "modelica": ["modelica", "PRBDM", "--out", "a.mo"],
    "explore": ["explore", "PRBDM", "--no-open", "--out", "a.html"],
    "picture": ["picture", "PRBDM", "--out", "a.png"],
    "animate": ["animate", "PRBDM", "a.gif", *RUN, "--slow", "200", "--fps", "10"],
}  # fmt: skip
KEPT = b"kept"


def _link(path: Path, other: Path) -> None:
    path.symlink_to(other)


def _hard_link(path: Path, other: Path) -> None:
    path.hardlink_to(other)


def _device(path: Path, _: Path) -> None:
    path.symlink_to("/dev/null")


def _pipe(path: Path, _: Path) -> None:
    os.mkfifo(path)


PLACED: dict[str, Callable[[Path, Path], None]] = {
    "link": _link, "hard link": _hard_link, "device": _device, "pipe": _pipe,
}  # fmt: skip


def attacked(name: str, kinds: Iterable[str] = PLACED) -> tuple[int, list[str]]:
    """Return the number of runs of a command, and what was wrong.

    The other file at a link keeps its content.  A device or a pipe is refused with a message, and
    remains.  In the place of one file, all others are written or none.
    """
    wrong, runs = [], 0
    with tempfile.TemporaryDirectory(prefix="prbm_hostile_") as folder:
        base = Path(folder)
        _run(name, base / "first")
        files = sorted(p.name for p in (base / "first").iterdir())
        if not files:
            wrong.append(f"{name} writes no file")
        for kind in kinds:
            for k, file in enumerate(files):
                runs += 1
                place = base / f"{kind} {k}"
                wrong += [f"{name}, {kind} {file}: {x}" for x in _attack(name, kind, place, file)]
    return runs, wrong


def _run(name: str, folder: Path) -> tuple[int, str]:
    folder.mkdir(exist_ok=True)
    done = command(COMMANDS[name], folder=folder)
    return done.returncode, done.stderr


def _attack(name: str, kind: str, folder: Path, file: str) -> list[str]:
    folder.mkdir()
    other, path = folder.with_name("other"), folder / file
    other.write_bytes(KEPT)
    PLACED[kind](path, other)
    status, text = _run(name, folder)
    found = []
    if "Traceback" in text:
        found.append(text[-300:])
    if other.read_bytes() != KEPT:
        found.append("the other file has changed")
    if kind in ("device", "pipe"):
        remains = path.is_fifo() if kind == "pipe" else path.is_symlink()
        if not (status and text.strip() and remains):
            found.append(f"status {status}, {text[-200:]!r}")
        if len([*folder.iterdir()]) != 1:
            found.append("a part of the files was written")
    elif status or path.is_symlink():
        found.append(f"status {status}, {text[-200:]!r}")
    return found


def run(kinds: int = len(PLACED), seed: int = 0) -> Part:
    """Try the first kinds of all commands."""
    del seed  # Nothing is random.
    part = Part("Links, pipes and devices", ("command", "runs", "wrong"))
    for name in COMMANDS:
        runs, wrong = attacked(name, [*PLACED][:kinds])
        part.add(name, runs, len(wrong))
        part.failures += wrong
    part.total()
    return part
