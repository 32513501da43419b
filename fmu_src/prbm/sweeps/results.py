"""Results of a study as a Parquet file, with its settings, to which rows can be added later."""

import io
import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]

from ..base.errors import ParameterError
from .journal import Journal, Point, compare
from .outputs import Outcome

OWN = ("row", "status", "message")
"""Columns of every table; no parameter or output may have these names."""
SETTINGS = b"prbm.settings"  # Key of the settings in the metadata of the Parquet file.


def parquet(journal: Journal, points: Sequence[Point]) -> bytes:
    """Return the content of a Parquet file of the rows of points, and of their settings."""
    rows = [(k, *journal.row(point, journal.known[point])) for k, point in enumerate(points)]
    frame = pd.DataFrame(rows, columns=[OWN[0], *journal.heads])
    table = pa.Table.from_pandas(frame, preserve_index=False)
    notes = {**table.schema.metadata, SETTINGS: json.dumps(journal.settings).encode()}
    content = io.BytesIO()
    pq.write_table(table.replace_schema_metadata(notes), content)
    return content.getvalue()


def earlier(
    journal: Journal, points: Sequence[Point], out: Path, overwrite: bool
) -> dict[Point, Outcome]:
    """Return the rows of a complete table of the same study, if there is one.

    Raises
    ------
    ParameterError
        If the table would have two columns of one name, or the file has no study; or, unless it is
        to be overwritten, another one or other rows.
    """
    names = [*OWN, *journal.heads[:-2]]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ParameterError(
            f"the results would have the column {twice[0]!r} twice; give the output another name, "
            f"as outputs={{'{twice[0]}_': ...}}"
        )
    if not out.exists():
        return {}
    try:
        table = pq.read_table(out)
        settings = json.loads((table.schema.metadata or {})[SETTINGS])
    except KeyError:
        raise ParameterError(
            f"{out} exists but contains no sweep; give another name for the results"
        ) from None
    except (OSError, ValueError, RecursionError) as error:  # Errors of pyarrow are subclasses.
        if overwrite:
            return {}
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise ParameterError(
            f"{out} cannot be read ({reason}); give another name for the results, or overwrite "
            "them (--overwrite)"
        ) from None
    if overwrite:
        return {}
    compare(f"{out} contains a sweep", settings, journal.settings)
    rows = table.select(journal.heads).to_pylist()
    found = [journal.outcome([*row.values()]) for row in rows]
    for k, (point, _) in enumerate(found):
        if k >= len(points) or point != points[k]:
            raise ParameterError(
                f"{out} contains a sweep over another table: row {k} "
                f"{'is missing now' if k >= len(points) else 'has changed'}; give another "
                "name for the results, or overwrite them (--overwrite)"
            )
    return dict(found)
