"""Mechanism files: TOML in, checked :class:`prbm.Mechanism` out."""

import tomllib
from importlib import resources
from pathlib import Path

from pydantic import ConfigDict, TypeAdapter, ValidationError

from prbm.errors import MechanismError, PrbmError
from prbm.mechanism import FIELDS, Flexure, Force, Mechanism, Parameter

LARGEST_FILE = 1 << 20  # bytes; a mechanism of a hundred flexures has 20 kB

for part in (*FIELDS, Parameter, Flexure, Force, Mechanism):
    # the engine knows nothing of pydantic; a key that it does not know is a mistake, not a note
    setattr(part, "__pydantic_config__", ConfigDict(extra="forbid"))  # noqa: B010
_adapter = TypeAdapter(Mechanism)


def load(path: str | Path) -> Mechanism:
    """Read a mechanism from a TOML file.

    Raises
    ------
    MechanismError
        If the file cannot be read, is no TOML, or does not describe a mechanism; the message
        names the file and the key.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise MechanismError(f"{path}: larger than {LARGEST_FILE} bytes, no mechanism file")
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except OSError as error:
        raise MechanismError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise MechanismError(f"{path}: is no TOML file ({error})") from None
    try:
        return _adapter.validate_python(data | {"drawing": drawing(text)})
    except ValidationError as error:
        lines = [f"{path}: {_where(e['loc'])}{e['msg']}" for e in error.errors()[:5]]
        raise MechanismError("\n".join(lines)) from None
    except PrbmError as error:
        raise MechanismError(f"{path}: {error}") from None


def _where(loc: tuple[int | str, ...]) -> str:
    return ".".join(str(part) for part in loc) + ": " if loc else ""


def drawing(text: str) -> str:
    """Return the comment with which a mechanism file opens, without its marks."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line[1:].removeprefix(" "))
    return "\n".join(lines)


def shipped() -> dict[str, Path]:
    """Return the files of the mechanisms that come with the package, by name."""
    folder = Path(str(resources.files("mechanisms")))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}
