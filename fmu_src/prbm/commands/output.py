"""Output files of a command: tables and figures, written together at the end."""

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING

from ..base.atomic import FileError, check_file, check_no_folder, check_writable, write_all

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PARTIAL = ".partial"  # End of the name of a file with the first rows of a table.


@dataclass
class Output:
    """Files collected during a computation and then written together.

    Parameters
    ----------
    folder : Path or None
        Output folder; None: no file is written and no figure is drawn.

    Raises
    ------
    FileError
        If the folder is not writable.
    """

    folder: Path | None
    files: dict[Path, bytes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.folder is not None:
            check_writable(self.folder)

    def check(self, *names: str) -> None:
        """Check, before a long computation, that files can be written.

        Raises
        ------
        FileError
            If a path is a folder, a pipe or a device.
        """
        if self.folder is not None:
            for name in names:
                check_file(self.folder / name)

    def text(self, name: str, content: str) -> None:
        """Add a text file."""
        if self.folder is not None:
            self.files[self.folder / name] = content.encode()

    def table(self, name: str, head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
        """Add a table as CSV, numbers with all digits."""
        if self.folder is not None:
            self.text(name, csv_text(head, rows))

    def figure(self, name: str, draw: Callable[[], "Figure"]) -> None:
        """Add a figure as PNG."""
        if self.folder is not None:
            from ..drawing.style import png  # imported here: it takes a second

            self.files[self.folder / name] = png(draw())

    def write(self) -> None:
        """Write all files or none; print their paths.

        Raises
        ------
        FileError
            If a file cannot be written.
        """
        if self.folder is None:
            return
        for path in self.files:
            check_no_folder(path)
        try:
            write_all(self.files)
        except OSError as error:
            raise FileError(
                f"cannot write {error.filename or self.folder}: {error.strerror}; choose another "
                "folder with --out"
            ) from None
        for path in self.files:
            print(path)


class RowFile:
    """The rows of a table that is written at the end, kept in a file beside it meanwhile.

    The table itself is replaced at once, when it is complete.  If the computation ends early, the
    rows so far remain in ``NAME.partial``.

    Parameters
    ----------
    folder : Path or None
        Output folder, which is created; None: no file is written.
    name : str
        Name of the table.

    Raises
    ------
    FileError
        If the table or the file of its rows cannot be written at its path.
    """

    def __init__(self, folder: Path | None, name: str) -> None:
        self.path = None if folder is None else folder / f"{name}{PARTIAL}"
        self.count = 0
        self.file: IO[str] | None = None
        if folder is not None and self.path is not None:
            check_file(folder / name)
            check_file(self.path)

    def add(self, heads: Sequence[str], row: Sequence[object]) -> None:
        """Write a row, after the heads if it is the first one."""
        if self.path is None:
            return
        text = csv_text(heads, [row])
        try:
            if self.file is None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self.path.unlink(missing_ok=True)
                self.file = self.path.open("x", encoding="utf-8", newline="")
            else:
                text = text.partition("\n")[2]
            self.file.write(text)
            self.file.flush()
        except OSError as error:
            raise FileError(
                f"cannot write {self.path}: {error.strerror}; choose another folder with --out"
            ) from None
        self.count += 1

    def close(self) -> None:
        """Close the file."""
        if self.file is not None:
            with suppress(OSError):  # Reported by the last flush.
                self.file.close()
            self.file = None

    def remove(self) -> None:
        """Remove the file, when the table has been written."""
        self.close()
        if self.path is not None:
            self.path.unlink(missing_ok=True)

    @property
    def kept(self) -> str:
        """Phrase about the rows that have been written; empty if there are none."""
        return f"{self.path} has the {self.count} completed rows" if self.count else ""


def csv_text(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table as CSV.

    Examples
    --------
    >>> print(csv_text(["mode", "frequency [Hz]"], [[1, 4.5]]), end="")
    mode,frequency [Hz]
    1,4.5
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([_cell(x) for x in row] for row in rows)
    return out.getvalue()


def _cell(x: object) -> str:
    """Return a cell: numbers with all digits, Booleans as 1 and 0, as FMPy writes them."""
    if isinstance(x, str):
        return x
    if x is None:
        return ""
    if type(x).__name__ in ("bool", "bool_"):
        return "1" if x else "0"
    return repr(x.item()) if hasattr(x, "item") else repr(x)


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table with aligned columns.

    Examples
    --------
    >>> print(aligned(["mode", "Hz"], [["1", "4.5"], ["2", "130"]]))
    mode   Hz
       1  4.5
       2  130
    """
    lines = [list(head), *map(list, rows)]
    widths = [max(len(row[i]) for row in lines) for i in range(len(head))]
    return "\n".join(
        "  ".join(f"{cell:>{width}}" for cell, width in zip(row, widths, strict=True))
        for row in lines
    )
