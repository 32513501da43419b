"""Output files of a command: tables and figures, written together at the end."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.atomic import FileError, check_file, check_no_folder, check_writable, write_all
from ..base.csv_text import csv_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
