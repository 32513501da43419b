"""The record of a run beside its results: what is needed to repeat it, as JSON.

    {"version": "0.2.0",
     "mechanism": {"name": "PRBDM", "file": "PRBDM.toml", "sha256": "..."},
     "arguments": {"changes": {"stop.restitution": 0.5}, "stop_time": 0.25, ...},
     "files": {"shock.csv": "..."}}

``arguments`` are those of the function in Python, for instance of :func:`prbm.simulate`.  A record
has no dates and no folders: equal arguments give equal bytes.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..base import reading
from ..base.version import __version__
from ..files.settings import UserMistake

SIZE_MAX = 1 << 24  # bytes; the record of a study over 100,000 samples has 2 MB.


class Record:
    """The record of a run in the output folder.

    Parameters
    ----------
    folder : Path or None
        Output folder; None: nothing is written.
    name : str
        Name of the file of the record.
    file : Path
        The mechanism file.
    """

    def __init__(self, folder: Path | None, name: str, file: Path) -> None:
        self.folder, self.name, self.file = folder, name, file
        path = None if folder is None else folder / name
        earlier = _earlier(path) if path is not None and path.is_file() else None
        self.before = earlier or file.name

    def notes(self, folder: Path | None = None) -> list[str]:
        """Return a note if the results of another mechanism file are replaced.

        Parameters
        ----------
        folder : Path or None
            Output folder as the user knows it; None: that of the record.
        """
        if self.before == self.file.name:
            return []
        return [
            f"note: {folder or self.folder} had results of {self.before}, a mechanism of the same "
            f"name; those of {self.file.name} replace them. To keep both, choose another folder "
            "with --out, or another name in one of the files"
        ]

    def text(self, mechanism: str, arguments: Mapping[str, Any], files: Iterable[str] = ()) -> str:
        """Return the text of the record.

        Parameters
        ----------
        mechanism : str
            Name of the mechanism.
        arguments : mapping
            Arguments of the function in Python; arrays become lists.
        files : iterable of str
            Paths of further files that the run has read.
        """
        read = {name: _hash(Path(name)) for name in files}
        content = {
            "version": __version__,
            "mechanism": {
                "name": mechanism, "file": self.file.name, "sha256": _hash(self.file),
            },
            "arguments": arguments,
            **({"files": read} if read else {}),
        }  # fmt: skip
        return json.dumps(content, indent=2, default=_plain) + "\n"


def _earlier(path: Path) -> str | None:
    """Return the name of the mechanism file in a record; None if the file is no record."""
    try:
        file = json.loads(reading.content(path, SIZE_MAX, UserMistake))["mechanism"]["file"]
        return file if isinstance(file, str) else None
    except (ValueError, KeyError, TypeError, RecursionError, UserMistake):
        return None


def _hash(path: Path) -> str | None:
    """Return the SHA-256 of a file; None for a pipe, which is read once."""
    if not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _plain(x: Any) -> Any:
    """Return an object as JSON has it."""
    return x.tolist() if hasattr(x, "tolist") else str(x)
