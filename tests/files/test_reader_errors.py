"""Readers of mechanism files, records and units raise only errors of the package."""

import contextlib
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from changed_texts import CHANGES, FRAGMENTS, REMOVED_MAX, change, pieces_of
from measurement_layouts import LAYOUTS, lvm
from mechanism_mistakes import EXAMPLE
from prbm.base.errors import PrbmError
from prbm.data.records import read_record
from prbm.data.series import RecordError
from prbm.files import record_units, units
from prbm.files.mechanism_file import load, read_mechanism
from prbm.files.settings import quantities, quantity


@st.composite
def changed(draw: st.DrawFn, texts: list[str]) -> str:
    """Return a text in which some pieces are replaced, removed, repeated or exchanged."""
    pieces = pieces_of(draw(st.sampled_from(texts)))
    for _ in range(draw(st.integers(1, 4))):
        i, j = (draw(st.integers(0, max(0, len(pieces) - 1))) for _ in range(2))
        kind, count = draw(st.integers(0, CHANGES - 1)), draw(st.integers(1, REMOVED_MAX))
        change(pieces, kind, i, j, count, draw(st.sampled_from(FRAGMENTS) | st.text(max_size=5)))
    return "".join(pieces)


@pytest.mark.parametrize("reader", [read_record, read_mechanism, load])
@pytest.mark.parametrize("path", ["a\0b.toml", "\ud800.toml", "~" * 5000, "", "."])
def test_invalid_paths_are_rejected(reader, path):
    with pytest.raises(PrbmError):
        reader(path)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no such device")
def test_reading_of_an_endless_record_stops_at_the_size_limit():
    with pytest.raises(RecordError, match="larger than 67108864 bytes"):
        read_record("/dev/zero")


ROWS = "".join(f"{i},{i}\n" for i in range(20))


@pytest.mark.parametrize(
    "text",
    [
        '"a' + "x" * 200_000 + f'"\n{ROWS}',
        f"t [s],x [m]\n{ROWS}".replace("5,5", f'"5","5{"y" * 200_000}"'),
        f"t [s],x [m]\n{ROWS}".replace("5,5", "5,1e999"),
        f"t [s],x [km9]\n{ROWS}".replace("5,5", "5,1e300"),
        lvm().replace("X_Columns\tOne", "X_Columns"),
        lvm().replace("Decimal_Separator\t.", "Decimal_Separator"),
        lvm().replace("Decimal_Separator\t.", "Decimal_Separator\tx"),
        lvm(columns="No").replace("Channels\t2", "Channels\t-1"),
        lvm().replace("X_Dimension\tTime\tTime", "X_Dimension"),
    ],
)
def test_unusual_records_are_read_or_rejected(text):
    read(evaluate, text)


UNIT_TEXTS = [
    "kg.m2",
    "m/s2",
    "1/s",
    "g mm2",
    "N.m/rad",
    "°C",
    "µm",
    "3 mm + a/2",
    "12 deg",
    "10 %",
]


def read(reader: Callable[[Path], object], text: str) -> None:
    """Read a file with a text, which may have lone surrogates; allow errors of the package."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.txt"
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        with contextlib.suppress(PrbmError):
            reader(path)


def evaluate(path: Path) -> None:
    """Read a record and print its columns and its signals."""
    record = read_record(path)
    assert str(record)
    for name in record.names:
        for unit in ("m", "N"):
            with contextlib.suppress(PrbmError):
                record.series(name, unit)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(changed([EXAMPLE]))
def test_changed_mechanism_files_are_read_or_rejected(text):
    read(read_mechanism, text)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(changed([text for text, _ in LAYOUTS.values()]))
def test_changed_records_are_read_or_rejected(text):
    read(evaluate, text)


@pytest.mark.slow
@settings(max_examples=500, deadline=None)
@given(changed(UNIT_TEXTS), st.sampled_from(["m", "", "kg.m2", "rad"]))
def test_changed_quantities_are_read_or_rejected(text, unit):
    for reader in (
        lambda: units.quantity(text, unit),
        lambda: units.number(text, unit),
        lambda: units.si_unit(text),
        lambda: units.si_unit(f"3 {text}"),
        lambda: units.check_coherent(text),
        lambda: units.converted("1", text, unit),
        lambda: quantity(text, unit, "--held"),
        lambda: quantities(text.split(), unit, "--offsets"),
    ):
        with contextlib.suppress(PrbmError):
            reader()
    if record_units.is_unit(text):
        assert record_units.si_unit(text)
        assert record_units.in_si(text)[0] > 0.0
