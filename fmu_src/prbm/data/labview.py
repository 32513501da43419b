"""LabVIEW measurement files (``.lvm``), versions 0.9 to 2, with one segment."""

from collections.abc import Mapping

from .cells import Table, cells_of
from .series import RecordError

LVM, LVM_END = "LabVIEW Measurement", "***End_of_Header***"


def labview_table(source: str, lines: list[str]) -> Table:
    """Return the table of a LabVIEW measurement file with one segment.

    Raises
    ------
    RecordError
        If the header is incomplete, or the file has several segments or several X columns.
    """
    ends = [i for i, line in enumerate(lines) if line.startswith(LVM_END)]
    if len(ends) != 2 or ends[1] + 2 >= len(lines):
        raise RecordError(
            f"{source}: a LabVIEW measurement file of one segment has two lines {LVM_END}, this "
            f"one has {len(ends)}: export one segment per file, with its header"
        )
    between = "\t" if "Tab" in " ".join(lines[: ends[0]]) else ","
    tags = {
        cells[0]: cells[1:] for cells in (cells_of(x, between) for x in lines[: ends[1]]) if cells
    }
    decimal = _value(tags, "Decimal_Separator", ".")
    if decimal not in (".", ","):
        raise RecordError(
            f"{source}: Decimal_Separator is {decimal!r}: export with a decimal point or comma"
        )
    axes = _value(tags, "X_Columns", "One")
    if axes not in ("No", "One"):
        raise RecordError(
            f"{source}: X_Columns is {axes}, one for each channel: export with one X column"
        )
    try:
        channels = int(_value(tags, "Channels", ""))
    except ValueError:
        channels = 0
    if channels < 1:
        raise RecordError(f"{source}: the header has no number of Channels: export the file again")
    names = [cell.strip() for cell in lines[ends[1] + 1].split(between)][1 : channels + 1]
    if len(names) < channels:
        raise RecordError(
            f"{source}, line {ends[1] + 2}: {len(names)} names for {channels} channels: export "
            "the file again"
        )
    units = tags.get("Y_Unit_Label", [])
    units = units + [""] * (channels - len(units))
    is_time = _value(tags, "X_Dimension", "Time") == "Time"
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
    return Table(heads, numbers, rows, decimal, comments)


def _value(tags: Mapping[str, list[str]], key: str, default: str) -> str:
    """Return the first value of a key in the header, or a default if it is missing."""
    return (tags.get(key) or [default])[0]


def _count_times(
    source: str, rows: list[list[str]], tags: Mapping[str, list[str]], decimal: str
) -> None:
    """Write the times X0 + i Delta_X into the first cell of each row, which is empty."""
    try:
        start, step = (float(tags[key][0].replace(",", ".")) for key in ("X0", "Delta_X"))
    except (KeyError, IndexError, ValueError):
        raise RecordError(
            f"{source}: has neither an X column nor X0 and Delta_X: export with an X column"
        ) from None
    for i, row in enumerate(rows):
        row[0] = repr(start + i * step).replace(".", decimal)
