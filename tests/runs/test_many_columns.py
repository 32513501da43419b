"""The time to read a table is proportional to the number of its columns and rows."""

import io

import pytest

from growth import grows
from prbm.base import reading
from prbm.runs.result import read_csv

SIZE, FACTOR = 2000, 6


@pytest.mark.parametrize("long", [False, True])
def test_results_with_many_columns_or_rows(monkeypatch, long):
    def text(n: int) -> str:
        columns, rows = (4, n) if long else (n, 2)
        head = ",".join(["time", *(f"x{k}" for k in range(1, columns))])
        return "\n".join([head, *[",".join(["1"] * columns)] * rows])

    monkeypatch.setattr(reading, "text", lambda content, *_: io.StringIO(content, newline=""))
    monkeypatch.setattr("prbm.runs.result.Path", lambda content: content)
    assert not grows(read_csv, text, SIZE, FACTOR, 1)


def test_tables_of_sweeps_with_many_columns():
    pd = pytest.importorskip("pandas")
    from prbm.sweeps import table

    def frame(n: int) -> object:
        return pd.DataFrame([[0.0] * n] * 2, columns=[f"x{k}" for k in range(n)])

    def read(frame: object) -> object:
        read = table.read_table(frame)
        return [table.numbers(name, cells) for name, (cells, _) in read.items()]

    assert not grows(read, frame, 200, FACTOR, 1)
