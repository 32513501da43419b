"""Records written by hand or by instruments: layouts, units, messages about invalid records."""

import contextlib

import numpy as np
import pytest

from measurement_layouts import LAYOUTS, SIGNAL, TIME, lvm, table
from prbm.base.errors import PrbmError
from prbm.data.records import read_record
from prbm.data.series import RecordError, Series


@pytest.mark.parametrize("name", LAYOUTS)
def test_all_layouts_are_read_as_the_same_channels_in_si(name, tmp_path):
    """The values agree to the nine digits of the file."""
    text, (time, signal) = LAYOUTS[name]
    path = tmp_path / "record.csv"
    path.write_bytes(text.encode())
    record = read_record(path)
    series = record.series(signal, "m")
    assert record.time.name == time
    np.testing.assert_allclose(series.time, TIME, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(series.values, SIGNAL, rtol=1e-8)
    assert series.unit == "m"
    assert "record.csv" in str(record)


@pytest.mark.parametrize(
    ("encoding", "unit"), [("utf-16", "µm"), ("cp1252", "µm"), ("utf-8", "µm"), ("utf-8", "μm")]
)
def test_encodings_are_detected(encoding, unit, tmp_path):
    path = tmp_path / "record.txt"
    path.write_bytes(f"t [s]\tx [{unit}]\n{table(chr(9), factors=(1.0, 1e6))}".encode(encoding))
    np.testing.assert_allclose(read_record(path).column("x", "m"), SIGNAL, rtol=1e-8)


def test_names_of_columns_can_be_given_for_a_table_without_a_head(tmp_path):
    """The carbon-nanotube records of the thesis have three columns and no head."""
    path = tmp_path / "TS02E01CNT009_1_data.txt"
    path.write_text(
        table("\t", factors=(1.0, 1e3, 1.0), columns=(TIME, SIGNAL, SIGNAL)), encoding="utf-8"
    )
    record = read_record(path, columns=["t [s]", "d [mm]", "F"], units={"F": "mN"})
    np.testing.assert_allclose(record.column("d", "mm"), SIGNAL, rtol=1e-8)
    np.testing.assert_allclose(record.column("f", "N"), 1e-3 * SIGNAL, rtol=1e-8)


def test_temperatures_and_percentages_are_converted_to_si(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text(
        "t [min];T [°C];u [%];n [-]\n0;20;50;1\n1;21,5;51;2\n2;22;52;3\n", encoding="utf-8"
    )
    record = read_record(path)
    assert record.time.values.tolist() == [0.0, 60.0, 120.0]
    assert record.column("T", "K") == pytest.approx([293.15, 294.65, 295.15], rel=1e-15)
    assert record.column("u", "-") == pytest.approx([0.5, 0.51, 0.52], rel=1e-15)
    assert record.column("n", "1").tolist() == [1.0, 2.0, 3.0]


HEAD = "t [s],x [mm]\n"
ROWS = table().splitlines()


def rows(*changed, keep=ROWS):
    """Return the table with rows replaced by pairs (index, text); None removes a row."""
    lines = list(keep)
    for i, text in changed:
        lines[i] = text
    return "\n".join(line for line in lines if line is not None) + "\n"


MALFORMED = {  # name: (content of the file, part of the message)
    "empty": (b"", "empty file"),
    "blank": (b" \r\n \n", "empty file"),
    "binary": (bytes(range(256)) * 20, "binary"),
    "zeros": (b"t [s],x [mm]\n\0\0\0\0", "binary"),
    "spreadsheet": (b"PK\x03\x04" + b"x" * 100, "spreadsheet"),
    "prose": (b"Dear all,\nthe data follow tomorrow.\n", "not a table"),
    "one column": (("x [mm]\n" + "\n".join("12345")).encode(), "not a table"),
    "no head": (table().encode(), "no names above 2 columns"),
    "too few names": (("x\n" + table(factors=(1, 1, 1), columns=(TIME,) * 3)).encode(),
                      "1 names above 3 columns"),
    "empty name": ((",x [mm]\n" + table()).encode(), "column 1 has no name"),
    "name twice": (("x [s],x [mm]\n" + table()).encode(),
        "columns 1 and 2 have the same name 'x'"),
    "too short": ((HEAD + rows(keep=ROWS[:2])).encode(), "2 rows of numbers are too few"),
    "too few samples": ((HEAD + rows(keep=ROWS[:9])).encode(), "9 samples of x are too few"),
    "a value missing": ((HEAD + rows((6, "0.006"))).encode(),
        "line 8: 1 values for 2 columns: correct"),
    "a value too many": ((HEAD + rows((6, "0.006,1,2"))).encode(), "line 8: 3 values for 2"),
    "cut off": ((HEAD + rows((39, "0.039"))).encode(),
        "line 41: 1 values for 2 columns: the file was"),
    "NaN": ((HEAD + rows((4, "0.004,NaN"))).encode(), "line 6, column 'x': 'NaN' is not a value"),
    "NaN in the first row": ((HEAD + rows((0, "0,nan"))).encode(), "line 2, column 'x': 'nan'"),
    "infinite": ((HEAD + rows((4, "0.004,-inf"))).encode(),
        "line 6, column 'x': '-inf' is not a value"),
    "overload": ((HEAD + rows((4, "0.004,OL"))).encode(),
        "line 6, column 'x': 'OL' is not a value"),
    "empty cell": ((HEAD + rows((4, ",3"))).encode(), "line 6, column 't': '' is not a value"),
    "word": ((HEAD + rows((4, "0.004,trigger"))).encode(),
        "line 6, column 'x': 'trigger' is not a number"),
    "unit in a cell": ((HEAD + rows((4, "0.004,4.9 mm"))).encode(),
        "'4.9 mm' has a unit: write"),
    "two tables": ((HEAD + table() + HEAD + table()).encode(), "line 42, column 't': 't [s]'"),
    "mixed decimal signs": (("t [s];x [mm]\n" + table(";").replace("0.004;", "0,004;")).encode(),
                            "line 6, column 't': '0,004' has another decimal sign than the rest"),
    "thousands": (("t [s];x [mm]\n" + table(";", ",").replace("0,004;", "1.000,4;")).encode(),
                  "line 6, column 't': '1.000,4' is not a number"),
    "underscore": ((HEAD + rows((4, "0.004,1_0"))).encode(), "'1_0' is not a number"),
    "hexadecimal": ((HEAD + rows((4, "0.004,0x1F"))).encode(), "'0x1F' is not a number"),
    "unit missing": (("t [s],x\n" + table()).encode(),
        "the column 'x' has no unit: give its unit, units="),
    "unit unknown": (("t [s],x [furlong]\n" + table()).encode(),
        "has the unknown unit 'furlong' (known"),
    "unit of another dimension": (("t [s],x [mN]\n" + table()).encode(),
        "'x' is in mN, but m was expected"),
    "mass for force": (("t [s],x [g]\n" + table()).encode(), "'x' is in g, but m was expected"),
    "time in mm": (("t [mm],x [mm]\n" + table()).encode(),
        "no column has a unit of time; columns are t [mm]"),
    "time without unit": (("t,x [mm]\n" + table()).encode(),
        "no column has a unit of time; columns are t [?]"),

    "several times": (
        ("a [s],b [s],x [mm]\n" + table(factors=(1, 1, 1), columns=(TIME,) * 3)).encode(),
        "the columns a, b all have units of time"),
    "another column": (("t [s],y [mm]\n" + table()).encode(),
        "unknown column 'x'; columns are t, y"),
    "time backwards": ((HEAD + rows((7, "0.0035,1"))).encode(),
        "line 9: the time 0.0035 s is before"),
    "time twice": ((HEAD + rows((7, "0.006,1"))).encode(), "line 9: the time 0.006 s equals"),
    "a gap": ((HEAD + rows((7, None))).encode(), "line 9: a gap of 0.002 s follows t = 0.006 s"),
    "a long gap": ((HEAD + rows(*((i, None) for i in range(5, 20)))).encode(),
        "line 7: a gap of 0.016 s"),
    "LabVIEW, two segments": ((lvm() + lvm()).encode(), "of one segment"),
    "LabVIEW, several times": (lvm(columns="Multi").encode(), "X_Columns is Multi"),
    "LabVIEW, cut off in its head": (lvm()[:300].encode(), "two lines ***End_of_Header***"),
    "LabVIEW, a word": (lvm().replace("0.004\t", "stop\t").encode(),
        "line 28, column 'time': 'stop'"),
}  # fmt: skip


@pytest.mark.parametrize("name", MALFORMED)
def test_malformed_records_are_rejected_with_one_message(name, tmp_path):
    """The message begins with the name of the file and has one line."""
    data, expected = MALFORMED[name]
    path = tmp_path / "bad record.csv"
    path.write_bytes(data)
    with pytest.raises(RecordError) as caught:
        read_record(path).series("x", "m")
    message = str(caught.value)
    assert expected in message
    assert message.startswith("bad record.csv")
    assert "\n" not in message
    assert isinstance(caught.value, PrbmError)


def test_arguments_that_disagree_with_the_file_are_rejected(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text(HEAD + table(), encoding="utf-8")
    with pytest.raises(RecordError, match="a unit is given for the unknown column 'y'"):
        read_record(path, units={"y": "mm"})
    with pytest.raises(RecordError, match="the unit 'ell' of 'x' is unknown"):
        read_record(path, units={"x": "ell"})
    with pytest.raises(RecordError, match="3 names for 2 columns"):
        read_record(path, columns=["t [s]", "x [mm]", "F [N]"])
    with pytest.raises(RecordError, match="not a table"):
        read_record(path, delimiter=";")
    with pytest.raises(RecordError, match="cannot be read"):
        read_record(tmp_path / "missing.csv")
    with pytest.raises(RecordError, match="cannot be read"):
        read_record(tmp_path)


def test_given_units_replace_those_of_the_file(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("t [s],x [mm]\n" + table(), encoding="utf-8")
    record = read_record(path, units={"t": "ms", "x": "V"})
    np.testing.assert_allclose(record.time.values, 1e-3 * TIME, atol=1e-15)
    np.testing.assert_allclose(record.column("x", "mV"), 1e3 * SIGNAL, rtol=1e-8)


def test_rounded_times_are_accepted_and_gaps_rejected():
    """Times at 750 Hz, rounded to the millisecond, have steps of 1 and 2 ms."""
    time = np.round(np.arange(400) / 750, 3)
    assert set(np.round(np.diff(time), 6)) == {0.001, 0.002}
    series = Series(time, time)
    assert series.step == pytest.approx(1 / 750, rel=1e-3)
    lost = np.delete(time, 200)
    assert np.diff(lost).max() == pytest.approx(0.003)
    with pytest.raises(RecordError, match=r"sample 201: a gap of 0\.003 s"):
        Series(lost, lost)


def test_a_part_of_a_series_keeps_its_times():
    series = Series(TIME, SIGNAL)
    part = series.between(0.01, 0.03)
    assert (part.time[0], part.time[-1]) == (0.01, 0.03)
    assert part.from_zero().time[0] == 0.0
    assert part.duration == pytest.approx(21e-3)
    with pytest.raises(RecordError, match="too few"):
        series.between(0.01, 0.012)


@pytest.mark.parametrize("seed", range(8))
def test_damaged_files_give_a_record_or_a_record_error(seed, tmp_path):
    """Bytes are changed, removed or repeated at random."""
    rng = np.random.default_rng(seed)
    layouts = [text.encode() for text, _ in LAYOUTS.values()]
    path = tmp_path / "record.csv"
    for data in layouts:
        damaged = bytearray(data)
        for _ in range(int(rng.integers(1, 8))):
            at = int(rng.integers(len(damaged)))
            kind = int(rng.integers(3))
            if kind == 0:
                damaged[at] = int(rng.choice(list(b'\t\n ,;."-+eE#[]()0s\xb5\xff')))
            elif kind == 1:
                del damaged[at : at + int(rng.integers(1, 40))]
            else:
                damaged[at:at] = damaged[at : at + 30]
        path.write_bytes(bytes(damaged))
        with contextlib.suppress(RecordError):
            record = read_record(path)
            record.series(record.names[-1], "m")
