"""Text of tables as CSV."""

import csv
import io
from collections.abc import Iterable, Sequence


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
