"""Measured data from text files: channels by name, in SI, checked.

What is read without being told more:

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

Whatever has no unit can be given one (``units``), and a table without a head its names
(``columns``).  A record is refused with one sentence that names the file, the line, the column,
the value and what to do.
"""

import csv
import difflib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..base.errors import PrbmError
from ..mechanics.arrays import Real
from .record_units import KNOWN, in_si, is_unit, same_dimension, si_unit

LARGEST_FILE = 1 << 26  # bytes; three channels at 750 Hz for half an hour have 40 MB
SAMPLE = 400  # lines by which the separator is recognised
FEWEST_ROWS = 3  # of a table of numbers
FEWEST_SAMPLES = 16  # of a signal over time
GAP = 1.8  # times the usual step; a sample that is missing makes 2, rounded times up to 1.5
LONG = 3.0  # times the median step: what does not belong to the usual steps
COMMENT = re.compile(r"\s*(#|%|!|//)\s*")
MISSING = frozenset(
    ("", "nan", "inf", "+inf", "-inf", "-", "--", "na", "n/a", "#n/a", "null", "none", "ol",
     "over", "overflow", "∞", "-∞", "1.#qnan", "#div/0!", "#wert!", "#value!")
)  # fmt: skip
CHARACTERS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}
FORMATS = [("\t", "."), ("\t", ","), (";", "."), (";", ","), (",", "."), (",", ","), (" ", "."),
           (" ", ",")]  # fmt: skip
TIMES = ("t", "time", "zeit", "temps", "x_value", "x-axis", "timestamp")
LVM, LVM_END = "LabVIEW Measurement", "***End_of_Header***"
PLAIN = {sign: re.compile(rf"[0-9+\-eE\n{sign}]*") for sign in ".,"}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
BRACKETS = re.compile(r"(.*?)\s*/?\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))\s*")
SUFFIX = re.compile(r"(.*\S)\s*(?:/\s*|,\s+|\s+in\s+)(\S+)")


class RecordError(PrbmError, ValueError):
    """A file of measured data cannot be read, or does not hold what was asked for."""


@dataclass(frozen=True)
class Channel:
    """A column of a record.

    Parameters
    ----------
    name : str
        As in the file, without the unit.
    written : str
        The unit as in the file; empty if there is none.
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
class Series:
    """A signal over time, checked: finite, in order, without gaps.

    Parameters
    ----------
    time : (m,)
        Increasing [s].
    values : (m,)
        In ``unit``.
    name, unit : str
        What it is; SI.
    source : str
        Where it comes from, for messages.

    Raises
    ------
    RecordError
        If it is too short, holds what is no number, its times do not increase or have a gap.
    """

    time: Real
    values: Real
    name: str = "x"
    unit: str = "m"
    source: str = "data"
    lines: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64), repr=False)

    def __post_init__(self) -> None:
        time, values = self.time, self.values
        if len(time) != len(values):
            raise RecordError(
                f"{self.source}: {len(time)} times for {len(values)} values of {self.name}: give "
                "one time for each value"
            )
        if len(time) < FEWEST_SAMPLES:
            raise RecordError(
                f"{self.source}: {len(time)} samples of {self.name} are too few to evaluate: "
                f"record {FEWEST_SAMPLES} or more"
            )
        for what, x in (("the time", time), (self.name, values)):
            bad = np.flatnonzero(~np.isfinite(x))
            if len(bad):
                raise RecordError(
                    f"{self._where(int(bad[0]))}: {what} is {x[bad[0]]}: take the row out, or "
                    "interpolate over it"
                )
        self._check_order()
        self._check_gaps()

    def _where(self, row: int) -> str:
        if row < len(self.lines):
            return f"{self.source}, line {self.lines[row]}"
        return f"{self.source}, sample {row + 1}"

    def _check_order(self) -> None:
        steps = np.diff(self.time)
        bad = np.flatnonzero(steps <= 0.0)
        if len(bad):
            i = int(bad[0]) + 1
            same = steps[i - 1] == 0.0
            order = "equals" if same else "is before"
            raise RecordError(
                f"{self._where(i)}: the time {self.time[i]:.9g} s {order} that of the row above, "
                f"{self.time[i - 1]:.9g} s: "
                + ("export the time with more digits" if same else "sort or split the record")
            )

    def _check_gaps(self) -> None:
        steps = np.diff(self.time)
        usual = float(steps[steps <= LONG * np.median(steps)].mean())
        i = int(np.argmax(steps))
        if steps[i] > GAP * usual:
            raise RecordError(
                f"{self._where(i + 1)}: a gap of {steps[i]:.6g} s follows t = {self.time[i]:.9g} "
                f"s, where steps are {usual:.6g} s: evaluate the part before or after it "
                "(Series.between)"
            )

    @property
    def duration(self) -> float:
        """Length of the record, m steps for m samples [s]."""
        return self.step * len(self.time)

    @property
    def step(self) -> float:
        """Mean distance of the samples [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    def between(self, start: float = -math.inf, end: float = math.inf) -> "Series":
        """Return the part with start <= t <= end [s]; its times stay as they are.

        Raises
        ------
        RecordError
            If there is nothing of the record in it, or too little.
        """
        kept = (self.time >= start) & (self.time <= end)
        if not kept.any():
            low, high = (f"{t:.6g} s" for t in (self.time[0], self.time[-1]))
            raise RecordError(
                f"{self.source}: nothing of {self.name} is left {_span(start, end)}: the record is "
                f"from {low} to {high}; choose a start and a later end within"
            )
        lines = self.lines[kept] if len(self.lines) else self.lines
        return Series(self.time[kept], self.values[kept], self.name, self.unit, self.source, lines)

    def from_zero(self) -> "Series":
        """Return the same signal with the time counted from its first sample."""
        return Series(
            self.time - self.time[0], self.values, self.name, self.unit, self.source, self.lines
        )


def _span(start: float, end: float) -> str:
    """Return a span of time in words.

    Examples
    --------
    >>> _span(-math.inf, 2.0), _span(3.0, 2.0), _span(20.0, math.inf)
    ('up to 2 s', 'from 3 s to 2 s', 'from 20 s on')
    """
    if start == -math.inf:
        return f"up to {end:g} s"
    return f"from {start:g} s on" if end == math.inf else f"from {start:g} s to {end:g} s"


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
            If there is none, or several.
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
        """Return a column in SI that measures what a unit does.

        Parameters
        ----------
        name : str
            Of the column.
        unit : str
            For instance ``m`` or ``mm`` for a length; the values are in SI all the same.

        Raises
        ------
        RecordError
            If there is no such column, its unit is missing or unknown, or it measures something
            else.
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


@dataclass(frozen=True)
class _Table:
    """What the lines of a file hold before units are applied."""

    heads: list[tuple[str, str]]
    lines: list[int]
    rows: list[list[str]]
    decimal: str
    comments: tuple[str, ...]


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
        Units of columns by name, where the file has none or a wrong one.
    delimiter : {"\t", ";", ",", " "} or None
        What separates the cells; None: recognised.
    decimal : {".", ","} or None
        The decimal sign; None: recognised.

    Raises
    ------
    RecordError
        If the file cannot be read or is no table of numbers.
    """
    path = Path(path)
    source = path.name
    lines = _text(path).splitlines()
    if lines and lines[0].startswith(LVM):
        table = _labview(source, lines)
    else:
        table = _plain(source, lines, columns, delimiter, decimal)
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


# --- plain tables -------------------------------------------------------------------------------


def _cells(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, without empty ones at its end."""
    if delimiter == " ":
        cells = line.split()
    elif '"' in line:
        cells = next(csv.reader([line.strip("\r\n")], delimiter=delimiter, skipinitialspace=True))
    else:
        cells = line.split(delimiter)
    cells = [cell.strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _is_number(cell: str, decimal: str) -> bool:
    if decimal == ",":
        if "." in cell:
            return False
        cell = cell.replace(",", ".")
    return NUMBER.fullmatch(cell) is not None


def _is_data(cells: list[str], decimal: str) -> bool:
    """Tell whether cells are a row of the table: numbers, or what stands for a missing one."""
    numbers = sum(_is_number(cell, decimal) for cell in cells)
    return numbers > 0 and all(
        _is_number(cell, decimal) or cell.lower() in MISSING for cell in cells
    )


def _recognised(
    source: str, lines: list[str], delimiter: str | None, decimal: str | None
) -> tuple[str, str]:
    """Return delimiter and decimal sign that make most lines a row of two numbers or more."""
    kept = [line for line in lines if line.strip() and not COMMENT.match(line)]
    sample = kept[:: max(1, len(kept) // SAMPLE)][-SAMPLE:]
    best, found = 0, None
    for option in FORMATS:
        if delimiter not in (None, option[0]) or decimal not in (None, option[1]):
            continue
        rows = [_cells(line, option[0]) for line in sample]
        score = sum(len(row) > 1 and _is_data(row, option[1]) for row in rows)
        if score > best:
            best, found = score, option
    if found is None:
        known = ", ".join(CHARACTERS.values())
        raise RecordError(
            f"{source}: is no table: no line holds two numbers or more separated by {known}; "
            "export a time and a signal as columns"
        )
    return found


def _plain(
    source: str,
    lines: list[str],
    columns: Sequence[str] | None,
    delimiter: str | None,
    decimal: str | None,
) -> _Table:
    """Return the table of a file without a layout of its own."""
    between, sign = _recognised(source, lines, delimiter, decimal)
    first = _first_row(lines, between, sign)
    numbers, rows = [], []
    for number, line in enumerate(lines[first:], start=first + 1):
        if line.strip() and not COMMENT.match(line):
            numbers.append(number)
            rows.append(_cells(line, between))
    above = [line for line in lines[:first] if line.strip()]
    comments = tuple(COMMENT.sub("", line, count=1).strip() for line in above)
    width = max(len(row) for row in rows[:2])
    heads = [] if columns is not None else _heads(source, above, between, width)
    return _Table(heads, numbers, rows, sign, comments)


def _first_row(lines: list[str], delimiter: str, decimal: str) -> int:
    """Return the index of the first line of two numbers or more that another one follows."""
    kept = [i for i, line in enumerate(lines) if line.strip() and not COMMENT.match(line)]
    data = []
    for i in kept:
        cells = _cells(lines[i], delimiter)
        data.append(len(cells) > 1 and _is_data(cells, decimal))
    for k, is_data in enumerate(data):
        if is_data and (k + 1 == len(kept) or data[k + 1]):
            return kept[k]
    return kept[data.index(True)]


def _heads(source: str, above: list[str], delimiter: str, width: int) -> list[tuple[str, str]]:
    """Return names and units of the columns from the lines above the table."""
    plain = [line for line in above if not COMMENT.match(line)]
    if not plain:
        plain = [COMMENT.sub("", line, count=1) for line in above]
    if delimiter == " ":  # a unit belongs to the name before it
        plain = [re.sub(r"(?<=[^\])\s])\s+(?=[\[(])", "", line) for line in plain]
    rows = [_padded(_cells(line, delimiter), width) for line in plain]
    if not rows or len(rows[-1]) != width:
        seen = f"{len(_cells(plain[-1], delimiter))} names" if rows else "no names"
        raise RecordError(
            f"{source}: there are {seen} above {width} columns of numbers separated by "
            f"{CHARACTERS[delimiter]}: write a head, or give "
            f'columns=["t [s]", "x [mm]"] and the like'
        )
    last = [_bare(cell) for cell in rows[-1]]
    has_units = (
        len(rows) > 1
        and len(rows[-2]) == width
        and all(is_unit(cell) for cell in last)
        and any(cell not in ("", "-", "1") for cell in last)
    )
    if has_units:
        return list(zip(rows[-2], last, strict=True))
    return _axes_units([_split(cell) for cell in rows[-1]], plain[:-1], delimiter)


def _padded(cells: list[str], width: int) -> list[str]:
    """Return cells with one empty unit or name added where a row ends with it."""
    return [*cells, ""] if len(cells) == width - 1 else cells


def _bare(cell: str) -> str:
    """Return a unit without its brackets."""
    return cell[1:-1].strip() if re.fullmatch(r"\[.*\]|\(.*\)", cell) else cell


def _split(head: str) -> tuple[str, str]:
    """Return name and unit of the head of a column.

    Examples
    --------
    >>> [_split(s) for s in ("t [s]", "time (ms)", "Force/N", "v / (m/s)", "Load, N", "x in mm")]
    [('t', 's'), ('time', 'ms'), ('Force', 'N'), ('v', 'm/s'), ('Load', 'N'), ('x', 'mm')]
    >>> _split("force (filtered) / mN"), _split("ratio/total"), _split("Ch1")
    (('force (filtered)', 'mN'), ('ratio/total', ''), ('Ch1', ''))
    """
    found = BRACKETS.fullmatch(head)
    if found and found[1]:
        unit = found[2] if found[2] is not None else found[3]
        return found[1].strip(), unit.strip() or "-"
    found = SUFFIX.fullmatch(head)
    if found and is_unit(found[2]):
        return found[1].strip(), found[2]
    return head, ""


def _axes_units(
    heads: list[tuple[str, str]], above: list[str], delimiter: str
) -> list[tuple[str, str]]:
    """Add the units of lines ``Horizontal Units`` and ``Vertical Units`` where none are known."""
    tags = {cells[0].lower(): cells[1:] for cells in (_cells(x, delimiter) for x in above) if cells}
    across, up = tags.get("horizontal units", []), tags.get("vertical units", [])
    if not across or not up:
        return heads
    given = [across[0], *up]
    given += [given[-1]] * (len(heads) - len(given)) if len(up) == 1 else []
    return [
        (name, unit or (given[i] if i < len(given) else "")) for i, (name, unit) in enumerate(heads)
    ]


# --- LabVIEW ------------------------------------------------------------------------------------


def _labview(source: str, lines: list[str]) -> _Table:
    """Return the table of a LabVIEW measurement file of one segment."""
    ends = [i for i, line in enumerate(lines) if line.startswith(LVM_END)]
    if len(ends) != 2 or ends[1] + 2 >= len(lines):
        raise RecordError(
            f"{source}: a LabVIEW measurement file of one segment has two lines {LVM_END} above "
            f"its numbers, this one has {len(ends)}: export one segment a file, with a header"
        )
    between = "\t" if "Tab" in " ".join(lines[: ends[0]]) else ","
    tags = {
        cells[0]: cells[1:] for cells in (_cells(x, between) for x in lines[: ends[1]]) if cells
    }
    decimal = tags.get("Decimal_Separator", ["."])[0]
    axes = tags.get("X_Columns", ["One"])[0]
    if axes not in ("No", "One"):
        raise RecordError(
            f"{source}: X_Columns is {axes}, a time for every channel: export with one X column"
        )
    try:
        channels = int(tags["Channels"][0])
    except (KeyError, IndexError, ValueError):
        raise RecordError(
            f"{source}: the header does not say how many Channels there are"
        ) from None
    names = [cell.strip() for cell in lines[ends[1] + 1].split(between)][1 : channels + 1]
    if len(names) < channels:
        raise RecordError(
            f"{source}, line {ends[1] + 2}: {len(names)} names for {channels} channels: export "
            "the file again"
        )
    units = tags.get("Y_Unit_Label", [])
    units = units + [""] * (channels - len(units))
    is_time = tags.get("X_Dimension", ["Time"])[0] == "Time"
    heads = [("time" if is_time else "X_Value", "s" if is_time else "")]
    heads += list(zip(names, units[:channels], strict=True))
    numbers, rows = [], []
    for number, line in enumerate(lines[ends[1] + 2 :], start=ends[1] + 3):
        if line.strip():
            numbers.append(number)
            rows.append([cell.strip() for cell in line.split(between)][: channels + 1])
    if axes == "No":
        _count_times(source, rows, tags, decimal)
    comments = tuple(line.strip() for line in lines[: ends[1]] if line.strip())
    return _Table(heads, numbers, rows, decimal, comments)


def _count_times(
    source: str, rows: list[list[str]], tags: Mapping[str, list[str]], decimal: str
) -> None:
    """Write X0 + i Delta_X into the first, empty cells."""
    try:
        start, step = (float(tags[key][0].replace(",", ".")) for key in ("X0", "Delta_X"))
    except (KeyError, IndexError, ValueError):
        raise RecordError(
            f"{source}: there is no X column, nor X0 and Delta_X to count it: export with X column"
        ) from None
    for i, row in enumerate(rows):
        row[0] = repr(start + i * step).replace(".", decimal)


# --- columns ------------------------------------------------------------------------------------


def _renamed(source: str, table: _Table, columns: Sequence[str]) -> _Table:
    width = len(table.rows[0]) if table.rows else 0
    if len(columns) != width:
        raise RecordError(
            f"{source}: {len(columns)} names were given for {width} columns: name every column"
        )
    heads = [_split(head) for head in columns]
    return _Table(heads, table.lines, table.rows, table.decimal, table.comments)


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


def _numbers(source: str, heads: list[tuple[str, str]], table: _Table) -> Real:
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


def _quickly(table: _Table, width: int) -> Real | None:
    """Return the rows as numbers if all are plain ones, else None; the slow way says why."""
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


def _parsed(source: str, heads: list[tuple[str, str]], table: _Table) -> Iterator[list[float]]:
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
            if not _is_number(cell, table.decimal):
                raise RecordError(
                    f"{source}, line {number}, column {name!r}: {cell[:30]!r} "
                    + _advice(cell, table.decimal)
                )
            text = cell.replace(table.decimal, ".").lower().replace("d", "e")
            row.append(float(text))
        yield row


def _advice(cell: str, decimal: str) -> str:
    """Return what is wrong with a cell that is no number, and what to do."""
    if cell.lower() in MISSING:
        return "is no value: take the row out, or interpolate over it"
    if any(_is_number(cell, other) for other in ".,"):
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
