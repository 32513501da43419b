"""The journal of a study: its completed rows in a file beside the table, until that is written.

    # {"mechanism": "...", "step [s]": 0.001}      settings
    # process 4711 on host                         the present owner
    stop.position,settling,status,message
    0.001,0.21,ok,

Rows are appended as they come, in any order.  A killed process leaves at most one incomplete line,
which is cut off when the study continues.  The file is locked by the process that writes to it.
"""

import csv
import io
import json
import os
import platform
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import nan
from pathlib import Path
from typing import IO, Any

from ..base.atomic import FileError, check_file
from ..base.errors import ParameterError
from ..base.lock import LockedError, open_locked
from .outputs import GOOD, Outcome

PARTIAL = ".partial"  # End of the name of a journal, after the name of the table.
OWNER = "# process "
SYNC_INTERVAL = 1.0  # Longest time of rows that a power failure loses [s].
Point = tuple[float, ...]


class Journal:
    """The completed rows of a study by their parameters, beside its table.

    Without the path of a table the rows are in memory only.  ``settings`` are everything that the
    results depend on, except for the parameters.
    """

    def __init__(
        self,
        table: Path | None,
        settings: Mapping[str, Any],
        parameters: Sequence[str],
        outputs: Sequence[str],
    ) -> None:
        self.path = None if table is None else table.with_name(table.name + PARTIAL)
        self.settings = json.loads(json.dumps(settings))
        self.width = len(parameters)
        self.heads = [*parameters, *outputs, "status", "message"]
        self.known: dict[Point, Outcome] = {}
        self.file: IO[bytes] | None = None
        self.empty = False  # Whether the file has no row.
        self.synced = time.monotonic()

    @contextmanager
    def opened(self, overwrite: bool = False, retry_failed: bool = False) -> Iterator[None]:
        """Read the journal of an interrupted study, and keep other processes from it.

        The rows of an earlier study are forgotten to overwrite them, or those that have failed.

        Raises
        ------
        ParameterError
            If the journal has another study or is damaged, or another process writes to it.
        FileError
            If it cannot be written, or is a link, a pipe or a device.
        """
        if self.path is None:
            yield
            return
        check_file(self.path)
        try:
            self.file = os.fdopen(open_locked(self.path), "r+b")
        except LockedError:
            raise ParameterError(
                f"{self.path} is in use by another study ({_owner(self.path)}); wait until it "
                "ends, stop it, or give another name for the results"
            ) from None
        except FileError:
            raise
        except OSError as error:
            raise FileError(f"cannot write {self.path}: {error.strerror}") from None
        try:
            self._continue(b"" if overwrite else self.file.read())
            if retry_failed:
                self.known = {x: y for x, y in self.known.items() if y.status in GOOD}
            yield
        finally:
            if self.empty:
                self.remove()
            self._close()

    def _continue(self, content: bytes) -> None:
        """Read the rows of an earlier study, and go to the end of the last complete one."""
        complete = content[: content.rfind(b"\n") + 1]
        lines = complete.decode(errors="replace").splitlines(keepends=True)
        assert self.file is not None
        self.file.seek(0)
        owner = f"{OWNER}{os.getpid()} on {platform.node() or 'this machine'}"
        self.empty = len(lines) < 3  # The settings, an owner and the heads.
        if self.empty:
            self.file.truncate(0)
            self._write(f"# {json.dumps(self.settings)}", owner, _line(self.heads))
            return
        try:
            before = json.loads(lines[0].removeprefix("# "))
            rows = [line for line in lines[1:] if not line.startswith(OWNER)]
            compare(f"{self.path} has the rows of a study", before, self.settings)
            if next(csv.reader(rows[:1])) != self.heads:
                raise ValueError
            self.known |= map(self.outcome, csv.reader(rows[1:]))
        except (ValueError, RecursionError, StopIteration, csv.Error) as error:
            if isinstance(error, ParameterError):
                raise
            raise ParameterError(f"{self.path} is damaged; remove it") from None
        self.file.truncate(len(complete))
        self.file.seek(len(complete))
        self._write(owner)

    def row(self, point: Point, outcome: Outcome) -> list[Any]:
        """Return the cells of a row."""
        values = outcome.values or (nan,) * (len(self.heads) - self.width - 2)
        return [*point, *values, outcome.status, " ".join(outcome.message.split())]

    def outcome(self, cells: Sequence[Any]) -> tuple[Point, Outcome]:
        """Return the parameters and the outcome of a row.

        Raises
        ------
        ValueError
            If the number of cells is wrong, or one of them is no number.
        """
        if len(cells) != len(self.heads):
            raise ValueError
        *numbers, status, message = cells
        point, values = numbers[: self.width], numbers[self.width :]
        found = tuple(map(float, values)) if status in GOOD else ()
        return tuple(map(float, point)), Outcome(status, message, values=found)

    def _write(self, *lines: str) -> None:
        assert self.file is not None
        try:
            self.file.write("".join(f"{line}\n" for line in lines).encode(errors="replace"))
            self.file.flush()
            if time.monotonic() - self.synced > SYNC_INTERVAL:
                os.fsync(self.file.fileno())
                self.synced = time.monotonic()
        except OSError as error:
            self._close()
            raise FileError(
                f"cannot write {self.path}: {error.strerror}; choose another folder with --out"
            ) from None

    def add(self, point: Point, outcome: Outcome) -> None:
        """Keep and write a completed row."""
        self.known[point] = outcome
        self.empty = False
        if self.file is not None:
            self._write(_line(self.row(point, outcome)))

    def _close(self) -> None:
        if self.file is not None:
            with suppress(OSError):  # Each line was flushed; its error has been reported.
                self.file.close()
            self.file = None

    def remove(self) -> None:
        """Remove the file, when the table has been written."""
        if self.path is None or self.file is None:
            return
        with suppress(PermissionError):  # Windows removes no open file.
            self.path.unlink(missing_ok=True)
        self._close()
        self.path.unlink(missing_ok=True)

    @property
    def kept(self) -> str:
        """Phrase about the rows that have been written; empty if there are none."""
        if self.path is None or not self.known:
            return ""
        return (
            f"{self.path} has the {len(self.known)} completed rows; repeat the call to compute "
            "the others"
        )


def compare(where: str, before: Any, now: Mapping[str, Any]) -> None:
    """Reject results of other settings.

    Raises
    ------
    ParameterError
        If settings differ.
    ValueError
        If the former settings are no mapping.
    """
    if not isinstance(before, dict):
        raise ValueError
    for name in {**before, **now}:
        old, new = before.get(name), now.get(name)
        if old != new:
            raise ParameterError(
                f"{where} with another {name} ({_short(old)}, now {_short(new)}); give another "
                "name for the results, or overwrite them (--overwrite)"
            )


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _owner(path: Path) -> str:
    """Return the text about the process that writes to a journal."""
    named = ["another process"]
    with suppress(OSError):
        lines = path.read_bytes().decode(errors="replace").splitlines()
        named += [line.removeprefix("# ") for line in lines if line.startswith(OWNER)]
    return named[-1]


def _line(cells: Sequence[object]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="").writerow(cells)
    return out.getvalue()
