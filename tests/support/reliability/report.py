"""The result of a part of the campaign: a table, and the failures."""

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field


@dataclass
class Part:
    """A table with its failures.

    Parameters
    ----------
    title : str
        Caption of the table.
    head : sequence of str
        Heads of the columns.
    rows : list
        Rows of texts or numbers.
    failures : list of str
        One line for each violation, with the words that repeat it.
    """

    title: str
    head: Sequence[str]
    rows: list[Sequence[object]] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def add(self, *cells: object) -> None:
        """Add a row, and print it to the standard error stream as progress."""
        self.rows.append(cells)
        print("  " + "  ".join(map(_text, cells)), file=sys.stderr, flush=True)

    def total(self, first: str = "all") -> None:
        """Add a row with the sums of the columns that have integers only, and blanks otherwise."""
        sums: list[object] = [first]
        for column in list(zip(*self.rows, strict=True))[1:]:
            whole = all(isinstance(cell, int) for cell in column)
            sums.append(sum(column) if whole else "")
        self.add(*sums)

    def table(self) -> str:
        """Return the table in Markdown."""
        lines = [_row(self.head), _row("---" if i == 0 else "---:" for i in range(len(self.head)))]
        return "\n".join(lines + [_row(map(_text, row)) for row in self.rows])


def _row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _text(cell: object) -> str:
    return f"{cell:,}" if isinstance(cell, int) else str(cell)
