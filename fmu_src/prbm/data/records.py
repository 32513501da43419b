"""Read measured data from text files: checked channels by name, in SI.

Detected without further arguments:

* columns separated by tabs, semicolons, commas or blanks; decimal point, or decimal comma where
  commas do not separate; quoted cells; UTF-8 with or without a byte order mark, UTF-16 with one,
  Windows-1252;
* units in the head of a column, ``t [s]``, ``time (ms)``, ``Force/N``, ``Load, N``,
  ``x in mm``, or in a row below the names, ``s;mm`` or ``(ms),(V)``;
* lines above the head, comments that start with ``#``, ``%``, ``!`` or ``//``, and a head in a
  comment, as ``numpy.savetxt`` writes it.

These layouts of vendors are read as well:

* LabVIEW measurement files (``.lvm``, versions 0.9 to 2, one segment, ``X_Columns`` No or One):
  separator, decimal sign and units are read from the header, the column of comments is skipped;
* PicoScope and Instron: a row of units in parentheses;
* Keysight oscilloscopes: ``x-axis,1`` above ``second,Volt``;
* Tektronix oscilloscopes: lines ``Horizontal Units`` and ``Vertical Units`` above the table.

Missing units and heads are given by the arguments ``units`` and ``columns``.  The message for an
invalid record names the file, the line, the column, the value and a remedy.
"""

import difflib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..base import reading
from ..files.record_units import KNOWN, in_si, is_unit, same_dimension, si_unit
from ..mechanics.arrays import Real
from .cells import MISSING, Table, is_number, name_and_unit
from .labview import LVM, labview_table
from .plain_table import plain_table
from .series import RecordError, Series

FILE_SIZE_MAX = 1 << 26  # bytes; three channels at 750 Hz for half an hour have 40 MB.
ROWS_MIN = 3  # Rows of a table of numbers.
TIME_NAMES = ("t", "time", "zeit", "temps", "x_value", "x-axis", "timestamp")
PLAIN_NUMBERS = {sign: re.compile(rf"[0-9+\-eE\n{sign}]*") for sign in ".,"}


@dataclass(frozen=True)
class Channel:
    """A column of a record.

    Parameters
    ----------
    name : str
        Name in the file, without the unit.
    written : str
        Unit in the file; empty if it is missing.
    unit : str or None
        SI unit of the values; None if the unit is missing or unknown.
    values : (m,)
        Values in SI, or as in the file if the unit is missing or unknown.
    """

    name: str
    written: str
    unit: str | None
    values: Real


@dataclass(frozen=True)
class Record:
    """Table in a file of measured data.

    Parameters
    ----------
    source : str
        Name of the file.
    channels : tuple of Channel
        Columns, in the order of the file.
    lines : (m,) int
        Line of each row in the file, from 1.
    comments : tuple of str
        Lines above the table, without marks of comments.
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
        """Return a channel by its name; upper and lower case are equal if no name matches exactly.

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
                f"{self.source}: {len(found)} columns have the name {name!r}; give different "
                "names, columns=[...]"
            )
        near = difflib.get_close_matches(name, self.names, n=1, cutoff=0.6)
        hint = f"did you mean {near[0]!r}?" if near else f"columns are {', '.join(self.names)}"
        raise RecordError(f"{self.source}: unknown column {name!r}; {hint}")

    def column(self, name: str, unit: str) -> Real:
        """Return the values of a column in SI.

        Parameters
        ----------
        name : str
            Name of the column.
        unit : str
            Unit with the expected dimension, for instance ``m`` or ``mm`` for a length.

        Raises
        ------
        RecordError
            If the column does not exist, or its unit is missing, unknown or of another dimension.
        """
        channel = self.channel(name)
        if channel.unit is None:
            state = "has no unit"
            if channel.written:
                state = f"has the unknown unit {channel.written!r} (known units are {KNOWN})"
            raise RecordError(
                f"{self.source}: the column {channel.name!r} {state}: give its unit, "
                f"units={{{channel.name!r}: {unit!r}}}"
            )
        if not same_dimension(channel.written, unit):
            raise RecordError(
                f"{self.source}: the column {channel.name!r} is in {channel.written or '1'}, but "
                f"{unit} was expected: choose another column, or correct its unit, "
                f"units={{{channel.name!r}: {unit!r}}}"
            )
        return channel.values

    @property
    def time(self) -> Channel:
        """Column of the time.

        Raises
        ------
        RecordError
            If no column has a unit of time, or several have one and none is named as the time.
        """
        found = [c for c in self.channels if c.unit == "s"]
        named = [c for c in found if c.name.lower() in TIME_NAMES]
        if len(found) == 1 or named:
            return (named or found)[0]
        if found:
            raise RecordError(
                f"{self.source}: the columns {', '.join(c.name for c in found)} all have units of "
                "time: rename the column of the time to t"
            )
        heads = ", ".join(f"{c.name} [{c.written or '?'}]" for c in self.channels)
        raise RecordError(
            f"{self.source}: no column has a unit of time; columns are {heads}: give the unit, "
            f"units={{{self.names[0]!r}: 's'}}"
        )

    def series(self, name: str, unit: str) -> Series:
        """Return a column as a signal over time.

        Parameters
        ----------
        name, unit : str
            Name of the column, and unit with the expected dimension.

        Raises
        ------
        RecordError
            As raised by :meth:`column`, :attr:`time` and :class:`Series`.
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
    r"""Read a table of measured data; the module lists the layouts.

    Parameters
    ----------
    path : str or Path
        Path of the file.
    columns : sequence of str or None
        Names, with units as in ``"t [s]"``, in place of the head in the file.
    units : mapping
        Units by names of columns, in place of those in the file.
    delimiter : {"\t", ";", ",", " "} or None
        Separator of the cells (default: detected).
    decimal : {".", ","} or None
        Decimal sign (default: detected).

    Raises
    ------
    RecordError
        If the file cannot be read or does not contain a table of numbers.
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
    """Return the text of a file; reject large, empty and binary files."""
    data = reading.content(path, FILE_SIZE_MAX, RecordError)
    if not data.strip():
        raise RecordError(f"{path.name}: empty file: export the record again")
    if data.startswith(b"PK\x03\x04") or data.startswith(b"\xd0\xcf\x11\xe0"):
        raise RecordError(f"{path.name}: a spreadsheet or an archive: save the table as CSV")
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
    raise RecordError(f"{path.name}: binary data: export the record as CSV")


def _renamed(source: str, table: Table, columns: Sequence[str]) -> Table:
    """Return a table with given names and units of all columns."""
    width = len(table.rows[0]) if table.rows else 0
    if len(columns) != width:
        raise RecordError(
            f"{source}: {len(columns)} names for {width} columns: give one name for each column"
        )
    heads = [name_and_unit(head) for head in columns]
    return Table(heads, table.lines, table.rows, table.decimal, table.comments)


def _with_units(
    source: str, heads: list[tuple[str, str]], units: Mapping[str, str]
) -> list[tuple[str, str]]:
    """Return the heads with given units; reject unknown units and repeated names."""
    names = [name for name, _ in heads]
    for name, unit in units.items():
        if name not in names:
            raise RecordError(
                f"{source}: a unit is given for the unknown column {name!r}; columns are "
                f"{', '.join(names)}"
            )
        if not is_unit(unit):
            raise RecordError(
                f"{source}: the unit {unit!r} of {name!r} is unknown; known units are {KNOWN}"
            )
    for i, name in enumerate(names, start=1):
        if not name:
            raise RecordError(f"{source}: column {i} has no name: give names, columns=[...]")
        if name in names[: i - 1]:
            raise RecordError(
                f"{source}: columns {names.index(name) + 1} and {i} have the same name {name!r}: "
                "give different names, columns=[...]"
            )
    return [(name, units.get(name, unit)) for name, unit in heads]


def _numbers(source: str, heads: list[tuple[str, str]], table: Table) -> Real:
    """Return the rows as numbers.

    Raises
    ------
    RecordError
        If a row does not have a number for each column, or there are too few rows.
    """
    if len(table.rows) < ROWS_MIN:
        raise RecordError(
            f"{source}: {len(table.rows)} rows of numbers are too few: record {ROWS_MIN} or more"
        )
    quick = _quickly(table, len(heads))
    return np.array(list(_parsed(source, heads, table))) if quick is None else quick


def _quickly(table: Table, width: int) -> Real | None:
    """Return the rows as numbers; None if a cell needs the slower parser, which reports errors."""
    if any(len(row) != width for row in table.rows):
        return None
    text = "\n".join("\n".join(row) for row in table.rows)
    if PLAIN_NUMBERS[table.decimal].fullmatch(text) is None:
        return None
    try:
        numbers = np.array(list(map(float, text.replace(",", ".").split("\n"))))
    except ValueError:
        return None
    return numbers.reshape(-1, width) if np.isfinite(numbers).all() else None


def _parsed(source: str, heads: list[tuple[str, str]], table: Table) -> Iterator[list[float]]:
    """Yield the rows as numbers; reject the first wrong cell."""
    last = table.lines[-1]
    for number, cells in zip(table.lines, table.rows, strict=True):
        if len(cells) != len(heads):
            cut = number == last and len(cells) < len(heads)
            raise RecordError(
                f"{source}, line {number}: {len(cells)} values for {len(heads)} columns: "
                + ("the file was cut off; remove the last line" if cut else "correct the line")
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
            if math.isinf(row[-1]):
                raise RecordError(
                    f"{source}, line {number}, column {name!r}: {cell[:30]!r} is too large: "
                    "correct or remove the line"
                )
        yield row


def _advice(cell: str, decimal: str) -> str:
    """Return the message for a cell that is not a number, with a remedy."""
    if cell.lower() in MISSING:
        return "is not a value: remove the row, or interpolate over it"
    if any(is_number(cell, other) for other in ".,"):
        return f"has another decimal sign than the rest, {decimal!r}: use one decimal sign"
    number = re.match(r"[+-]?[\d.,]+\s*([^\d\s.,].*)", cell)
    if number and is_unit(number[1]):
        return "has a unit: write the unit in the head of the column only"
    return "is not a number: correct or remove the line"


def _channel(name: str, unit: str, values: Real) -> Channel:
    """Return a channel with its values converted to SI if the unit is known."""
    if not unit or not is_unit(unit):
        return Channel(name, unit, None, values)
    factor, offset = in_si(unit)
    with np.errstate(over="ignore"):
        converted: Real = factor * values + offset
    return Channel(name, unit, si_unit(unit), converted)
