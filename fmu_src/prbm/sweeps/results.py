"""Results of a sweep on disk: a Parquet dataset that grows part by part and survives a kill.

    results.parquet/_sweep.json            settings of the sweep
    results.parquet/_sweep.lock            locked while a sweep runs
    results.parquet/part-000000-1f3a.parquet, ...

A part has the runs of one batch.  It is written under another name and then renamed, so that it is
complete whenever it exists.  pandas, pyarrow and Dask read the folder as one table.
"""

import io
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]

from ..base import reading
from ..base.atomic import write
from ..base.errors import ParameterError
from ..base.lock import LockedError, locked
from .outputs import GOOD, Outcome

SETTINGS, LOCK = "_sweep.json", "_sweep.lock"
DRAFTS = f".{SETTINGS}.*"  # Names of drafts of the settings, which a killed process leaves.
SETTINGS_SIZE_MAX = 1 << 24  # bytes; the names of 100,000 outputs have some MB.
PART_DRAFTS = ".part-*"  # Those of drafts of parts.
ROW, STATUS, MESSAGE, SECONDS = "row", "status", "message", "seconds"
OWN = (ROW, STATUS, MESSAGE, SECONDS)
"""Columns of every sweep; no parameter or output may have these names."""


class Results:
    """The dataset of a sweep.

    Parameters
    ----------
    folder : Path
        Folder of the dataset.
    settings : mapping
        All settings that the results depend on, except for the table.  They are stored as JSON and
        compared when a sweep continues.
    parameters, outputs : sequence of str
        Names of the columns.
    """

    def __init__(
        self,
        folder: Path,
        settings: Mapping[str, Any],
        parameters: Sequence[str],
        outputs: Sequence[str],
    ) -> None:
        self.folder, self.settings = folder, json.loads(json.dumps(settings))
        self.parameters, self.outputs = tuple(parameters), tuple(outputs)
        numbers = [(name, pa.float64()) for name in (*self.parameters, *self.outputs)]
        own = [(STATUS, pa.string()), (MESSAGE, pa.string()), (SECONDS, pa.float64())]
        self.schema = pa.schema([(ROW, pa.int64()), *numbers, *own])
        self.count = 0

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Keep other sweeps from using the folder during a ``with`` block.

        Raises
        ------
        ParameterError
            If another sweep uses the folder, or it has other contents.
        """
        self._check_contents()
        try:
            with locked(self.folder / LOCK, wait=False):
                yield
        except LockedError as error:
            raise ParameterError(
                f"{self.folder} is in use by another sweep ({error}); wait until it ends, stop it, "
                "or give another name for the results"
            ) from None

    def _check_contents(self) -> None:
        """Reject a folder that was not made by a sweep."""
        if (self.folder / SETTINGS).exists() or not self.folder.exists():
            return
        if not self.folder.is_dir() or any(
            path.name != LOCK and not path.match(DRAFTS) for path in self.folder.iterdir()
        ):
            raise ParameterError(
                f"{self.folder} exists but contains no sweep; give another name for the results"
            )

    def begin(self, overwrite: bool = False) -> None:
        """Create the folder, or continue in a folder of a sweep with the same settings.

        The folder must be locked, since drafts of an interrupted sweep are deleted.

        Raises
        ------
        ParameterError
            If the folder cannot be written, or has a sweep with other settings and ``overwrite``
            is false.
        """
        file = self.folder / SETTINGS
        try:
            for pattern in (PART_DRAFTS, DRAFTS):
                for draft in self.folder.glob(pattern):
                    draft.unlink()
            if file.exists() and overwrite:
                self._clear()
            if file.exists():
                before = json.loads(reading.content(file, SETTINGS_SIZE_MAX, ParameterError))
                if not isinstance(before, dict):
                    raise ValueError
                self._compare(before)
                return
            write(file, json.dumps(self.settings, indent=2).encode())
        except ParameterError:
            raise
        except OSError as error:
            raise ParameterError(
                f"{self.folder} cannot be written ({error.strerror or error}); give another name"
            ) from None
        except (ValueError, RecursionError):
            raise ParameterError(f"{file} is damaged; delete {self.folder}") from None

    def _compare(self, before: Mapping[str, Any]) -> None:
        """Reject a sweep whose settings differ from the stored ones."""
        for name in {**before, **self.settings}:
            old, new = before.get(name), self.settings.get(name)
            if old != new:
                raise ParameterError(
                    f"{self.folder} contains a sweep with another {name} ({_short(old)}, now "
                    f"{_short(new)}); give another name for the results, or overwrite them "
                    "(--overwrite)"
                )

    def _clear(self) -> None:
        for part in self._parts():
            part.unlink()
        (self.folder / SETTINGS).unlink()

    def _parts(self) -> list[Path]:
        return sorted(self.folder.glob("part-*.parquet"))

    def read(self) -> pd.DataFrame:
        """Return the stored runs, ordered by row, each row once.

        Raises
        ------
        ParameterError
            If a part cannot be read.
        """
        tables = [table for _, table in self._tables()]
        self.count = len(tables)
        if not tables:
            return self.schema.empty_table().to_pandas()  # type: ignore[no-any-return]
        frame: pd.DataFrame = pa.concat_tables(tables).to_pandas()
        return frame.drop_duplicates(ROW).sort_values(ROW, ignore_index=True)

    def _tables(self) -> Iterator[tuple[Path, Any]]:
        for part in self._parts():
            try:
                if not part.is_file():
                    raise ValueError("not a file")
                table = pq.read_table(part, schema=self.schema)
                if any(row is None or row < 0 for row in table[ROW].to_pylist()):
                    raise ValueError("a row has no number, or a negative one")
            except (OSError, ValueError, pa.ArrowException) as error:
                reason = str(error).splitlines()[0]
                raise ParameterError(
                    f"{part} cannot be read ({reason}); remove it to repeat its runs"
                ) from None
            yield part, table

    def sort(self) -> None:
        """Replace all parts by one part with ordered rows, so that every reader gets them in order.

        A kill leaves the new part beside old ones; :meth:`read` drops the duplicate rows.
        """
        parts = self._parts()
        rows = [row for _, table in self._tables() for row in table[ROW].to_pylist()]
        if rows == sorted(rows):
            return
        table = pa.Table.from_pandas(self.read(), schema=self.schema, preserve_index=False)
        self._write(table, self.folder / f"part-{0:06d}-{os.urandom(3).hex()}.parquet")
        for part in parts:
            part.unlink()
        self.count = 1

    def forget_failures(self) -> None:
        """Remove the rows of failed runs, so that these are repeated."""
        for part, table in list(self._tables()):
            good = table.filter(pa.compute.is_in(table[STATUS], pa.array(GOOD)))
            if good.num_rows == 0:
                part.unlink()
            elif good.num_rows < table.num_rows:
                self._write(good, part)

    def add(
        self,
        rows: Sequence[int],
        values: Sequence[Mapping[str, float]],
        outcomes: Sequence[Outcome],
    ) -> None:
        """Write the runs of a batch as a part."""
        columns: dict[str, Any] = {ROW: list(rows)}
        for name in self.parameters:
            columns[name] = [row[name] for row in values]
        for k, name in enumerate(self.outputs):
            columns[name] = [o.values[k] if o.values else float("nan") for o in outcomes]
        columns[STATUS] = [o.status for o in outcomes]
        columns[MESSAGE] = [o.message for o in outcomes]
        columns[SECONDS] = [o.seconds for o in outcomes]
        name = f"part-{self.count:06d}-{os.urandom(3).hex()}.parquet"
        self._write(pa.table(columns, schema=self.schema), self.folder / name)
        self.count += 1

    def _write(self, table: Any, part: Path) -> None:
        """Write a part; a killed process leaves only a draft."""
        content = io.BytesIO()
        pq.write_table(table, content)
        write(part, content.getvalue())


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
