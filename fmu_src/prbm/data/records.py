"""Measured data from text files: channels by name, in SI, checked.

Recognized without further arguments:

* columns separated by tabs, semicolons, commas or blanks; decimal point, or decimal comma where
  commas do not separate; quoted cells; UTF-8 with or without a byte order mark, UTF-16 with one,
  Windows-1252;
* units in the head of a column, ``t [s]``, ``time (ms)``, ``Force/N``, ``Load, N``,
  ``x in mm``, or in a row of their own below the names, ``s;mm`` or ``(ms),(V)``;
* lines above the head, comments that start with ``#``, ``%``, ``!`` or ``//``, and a head that
  is itself a comment, as ``numpy.savetxt`` writes it.

That covers plain tables and spreadsheets' CSV, and these layouts of vendors:

* LabVIEW measurement files (``.lvm``, versions 0.9 to 2, one segment, ``X_Columns`` No or One):
  separator, decimal sign and units are taken from the header, the column of comments is dropped;
* PicoScope and Instron: a row of units in parentheses;
* Keysight oscilloscopes: ``x-axis,1`` above ``second,Volt``;
* Tektronix oscilloscopes: lines ``Horizontal Units`` and ``Vertical Units`` above the table.

A column without a unit can be given one (``units``), and a table without a head its names
(``columns``).  An invalid record is rejected with a sentence that names the file, the line, the
column, the value and a remedy.
"""

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..files.record_units import KNOWN, in_si, is_unit, same_dimension, si_unit
from ..mechanics.arrays import Real
from .cells import MISSING, Table, is_number, name_and_unit
from .labview import LVM, labview_table
from .plain_table import plain_table
from .series import RecordError, Series

LARGEST_FILE = 1 << 26  # bytes; three channels at 750 Hz for half an hour have 40 MB
FEWEST_ROWS = 3  # of a table of numbers
TIMES = ("t", "time", "zeit", "temps", "x_value", "x-axis", "timestamp")
PLAIN = {sign: re.compile(rf"[0-9+\-eE\n{sign}]*") for sign in ".,"}


@dataclass(frozen=True)
class Channel:
    """A column of a record.

    Parameters
    ----------
    name : str
        As in the file, without the unit.
    written : str
        The unit as in the file, or an empty text.
    unit : str or None
        SI unit of the values; None if the unit is missing or unknown.
    values : (m,)
        In SI, or as in the file if the unit is not known.
    """

    name: str
    written: str
    unit: str | None
    values: Real


@dataclass(frozen=True)
class Record:
    """The table in a file of measured data.

    Parameters
    ----------
    source : str
        Name of the file.
    channels : tuple of Channel
        Its columns, in order.
    lines : (m,) int
        The line of the file that each row comes from.
    comments : tuple of str
        The lines above the table, without marks of comments.
    """

    source: str
    channels: tuple[Channel, ...]
    lines: NDArray[np.int64]
    comments: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(channel.name for channel in self.channels)

    def channel(self, name: str) -> Channel:
        """Return a channel by its name, upper or lower case.

        Raises
        ------
        RecordError
            If no channel has this name, or several have it.
        """
        found = [c for c in self.channels if c.name == name]
        found = found or [c for c in self.channels if c.name.lower() == name.lower()]
        if len(found) == 1:
            return found[0]
        if found:
            raise RecordError(
                f"{self.source}: the name {name!r} stands above {len(found)} columns; give the "
                "columns names of their own, columns=[...]"
            )
        near = difflib.get_close_matches(name, self.names, n=1, cutoff=0.6)
        hint = f"did you mean {near[0]!r}?" if near else f"columns are {', '.join(self.names)}"
        raise RecordError(f"{self.source}: there is no column {name!r}; {hint}")

    def column(self, name: str, unit: str) -> Real:
        """Return a column in SI, of the dimension of a unit.

        Parameters
        ----------
        name : str
            Of the column.
        unit : str
            For instance ``m`` or ``mm`` for a length; the values are in SI in either case.

        Raises
        ------
        RecordError
            If there is no such column, its unit is missing or unknown, or it has another
            dimension.
        """
        channel = self.channel(name)
        if channel.unit is None:
            what = "has no unit"
            if channel.written:
                what = f"has the unit {channel.written!r}, which is unknown (known are {KNOWN})"
            raise RecordError(
                f"{self.source}: the column {channel.name!r} {what}: give it, "
                f"units={{{channel.name!r}: {unit!r}}}"
            )
        if not same_dimension(channel.written, unit):
            raise RecordError(
                f"{self.source}: the column {channel.name!r} is in {channel.written or '1'}, but "
                f"{unit} was expected: take another column, or correct its unit, "
                f"units={{{channel.name!r}: {unit!r}}}"
            )
        return channel.values

    @property
    def time(self) -> Channel:
        """The column of times.

        Raises
        ------
        RecordError
            If none is measured in s, or several are and none has a name of the time.
        """
        found = [c for c in self.channels if c.unit == "s"]
        named = [c for c in found if c.name.lower() in TIMES]
        if len(found) == 1 or named:
            return (named or found)[0]
        if found:
            raise RecordError(
                f"{self.source}: the columns {', '.join(c.name for c in found)} are all in s: call "
                "the one that is the time t"
            )
        heads = ", ".join(f"{c.name} [{c.written or '?'}]" for c in self.channels)
        raise RecordError(
            f"{self.source}: no column is a time; columns are {heads}: give the unit of the time, "
            f"units={{{self.names[0]!r}: 's'}}"
        )

    def series(self, name: str, unit: str) -> Series:
        """Return a column over time.

        Parameters
        ----------
        name, unit : str
            As for :meth:`column`.

        Raises
        ------
        RecordError
            As :meth:`column`, :attr:`time` and :class:`Series` do.
        """
        values = self.column(name, unit)
        return Series(self.time.values, values, name, si_unit(unit), self.source, self.lines)

    def __str__(self) -> str:
        rows = [f"{self.source}: {len(self.lines)} rows"]
        for c in self.channels:
            low, high = float(np.min(c.values)), float(np.max(c.values))
            written = f" (in the file: {c.written})" if c.written else ""
            rows.append(f"  {c.name:<20} {low:>12.6g} ... {high:<12.6g} {c.unit or '?'}{written}")
        return "\n".join(rows)


def read_record(
    path: str | Path,
    *,
    columns: Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
) -> Record:
    r"""Read a table of measured data; see the module for the layouts.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : sequence of str or None
        Names, with units as in ``"t [s]"``, in place of the head or where there is none.
    units : mapping
        Units of columns by name, where they are missing or wrong in the file.
    delimiter : {"\t", ";", ",", " "} or None
        Separator of the cells (default: recognized).
    decimal : {".", ","} or None
        The decimal sign (default: recognized).

    Raises
    ------
    RecordError
        If the file cannot be read or does not hold a table of numbers.
    """
    path = Path(path)
    source = path.name
    lines = _text(path).splitlines()
    if lines and lines[0].startswith(LVM):
        table = labview_table(source, lines)
    else:
        table = plain_table(source, lines, columns, delimiter, decimal)
    if columns is not None:
        table = _renamed(source, table, columns)
    heads = _with_units(source, table.heads, units or {})
    numbers = _numbers(source, heads, table)
    channels = tuple(_channel(*head, numbers[:, i]) for i, head in enumerate(heads))
    return Record(source, channels, np.array(table.lines, np.int64), table.comments)


def _text(path: Path) -> str:
    """Return the text of a file."""
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise RecordError(f"{path.name}: {size} bytes are too many for a record: split it")
        data = path.read_bytes()
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from None
    if not data.strip():
        raise RecordError(f"{path.name}: is empty: export the record again")
    if data.startswith(b"PK\x03\x04") or data.startswith(b"\xd0\xcf\x11\xe0"):
        raise RecordError(f"{path.name}: is a spreadsheet or an archive: save the table as CSV")
    encoding = "utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    for attempt in (encoding, "cp1252"):
        try:
            text = data.decode(attempt)
        except UnicodeDecodeError:
            continue
        bad = re.search(r"[^\t\n\r\f\x1a -\U0010ffff]", text)
        if bad is None:
            return text.rstrip("\x1a")
        break
    raise RecordError(f"{path.name}: is no text but binary data: export the record as CSV")


def _renamed(source: str, table: Table, columns: Sequence[str]) -> Table:
    width = len(table.rows[0]) if table.rows else 0
    if len(columns) != width:
        raise RecordError(
            f"{source}: {len(columns)} names were given for {width} columns: name every column"
        )
    heads = [name_and_unit(head) for head in columns]
    return Table(heads, table.lines, table.rows, table.decimal, table.comments)


def _with_units(
    source: str, heads: list[tuple[str, str]], units: Mapping[str, str]
) -> list[tuple[str, str]]:
    """Return the heads with the units that were given."""
    names = [name for name, _ in heads]
    for name, unit in units.items():
        if name not in names:
            raise RecordError(
                f"{source}: a unit was given for {name!r}, which is no column; columns are "
                f"{', '.join(names)}"
            )
        if not is_unit(unit):
            raise RecordError(f"the unit {unit!r} given for {name!r} is unknown; known are {KNOWN}")
    for i, name in enumerate(names, start=1):
        if not name:
            raise RecordError(f"{source}: column {i} has no name: give columns=[...]")
        if name in names[: i - 1]:
            raise RecordError(
                f"{source}: the name {name!r} stands above columns {names.index(name) + 1} and "
                f"{i}: give the columns names of their own, columns=[...]"
            )
    return [(name, units.get(name, unit)) for name, unit in heads]


def _numbers(source: str, heads: list[tuple[str, str]], table: Table) -> Real:
    """Return the rows as numbers.

    Raises
    ------
    RecordError
        At the first row that has not a number for every column.
    """
    if len(table.rows) < FEWEST_ROWS:
        raise RecordError(
            f"{source}: {len(table.rows)} rows of numbers are too few to evaluate: record "
            f"{FEWEST_ROWS} or more"
        )
    quick = _quickly(table, len(heads))
    return np.array(list(_parsed(source, heads, table))) if quick is None else quick


def _quickly(table: Table, width: int) -> Real | None:
    """Return the rows as numbers; None if a cell needs the slower parser, which names errors."""
    if any(len(row) != width for row in table.rows):
        return None
    text = "\n".join("\n".join(row) for row in table.rows)
    if PLAIN[table.decimal].fullmatch(text) is None:
        return None
    try:
        numbers = list(map(float, text.replace(",", ".").split("\n")))
    except ValueError:
        return None
    return np.array(numbers).reshape(-1, width)


def _parsed(source: str, heads: list[tuple[str, str]], table: Table) -> Iterator[list[float]]:
    last = table.lines[-1]
    for number, cells in zip(table.lines, table.rows, strict=True):
        if len(cells) != len(heads):
            cut = number == last and len(cells) < len(heads)
            raise RecordError(
                f"{source}, line {number}: {len(cells)} values for {len(heads)} columns: "
                + ("the file was cut off; take the last line out" if cut else "mend the line")
            )
        row = []
        for (name, _), cell in zip(heads, cells, strict=True):
            if not is_number(cell, table.decimal):
                raise RecordError(
                    f"{source}, line {number}, column {name!r}: {cell[:30]!r} "
                    + _advice(cell, table.decimal)
                )
            text = cell.replace(table.decimal, ".").lower().replace("d", "e")
            row.append(float(text))
        yield row


def _advice(cell: str, decimal: str) -> str:
    """Return the error in a cell that is not a number, and a remedy."""
    if cell.lower() in MISSING:
        return "is no value: take the row out, or interpolate over it"
    if any(is_number(cell, other) for other in ".,"):
        return f"has another decimal sign than the rest, {decimal!r}: write all numbers alike"
    number = re.match(r"[+-]?[\d.,]+\s*([^\d\s.,].*)", cell)
    if number and is_unit(number[1]):
        return "has a unit of its own: write the unit once, in the head of the column"
    return "is no number: take the line out or mend it"


def _channel(name: str, unit: str, values: Real) -> Channel:
    if not unit or not is_unit(unit):
        return Channel(name, unit, None, values)
    factor, offset = in_si(unit)
    return Channel(name, unit, si_unit(unit), factor * values + offset)
