"""Mechanism files: TOML in, checked :class:`prbm.Mechanism` out."""

import difflib
import tomllib
from dataclasses import fields
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

from prbm.errors import MechanismError, PrbmError
from prbm.mechanism import (
    FIELDS,
    Body,
    Flexure,
    FlexureType,
    Force,
    Friction,
    Mechanism,
    Parameter,
    Release,
    Stop,
)

LARGEST_FILE = 1 << 20  # bytes; a mechanism of a hundred flexures has 20 kB
MOST_PROBLEMS = 5  # told at a time
PARTS: dict[str, type] = {
    "bodies": Body,
    "flexure_types": FlexureType,
    "flexures": Flexure,
    "stops": Stop,
    "frictions": Friction,
    "forces": Force,
    "geometry": Parameter,
    "release": Release,
}
EXPRESSION = "write a number, or an expression in parameters as a text"
REMEDIES = {  # by pydantic's types of errors
    "float_type": "write a number",
    "float_parsing": "write a number",
    "int_type": "write a number",
    "string_type": "write a text in quotes",
    "bool_type": "write true or false",
    "tuple_type": "write a list, [...], or a table [[...]] for every part of a kind",
    "too_long": "take out what is too much",
    "mapping_type": "write a table, [...]",
    "dict_type": "write a table, [...]",
    "dataclass_type": "write a table, [...]",
}

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
        text = path.read_text(encoding="utf-8-sig")
        data = tomllib.loads(text)
    except OSError as error:
        raise MechanismError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise MechanismError(f"{path}: is no TOML file ({error})") from None
    try:
        return _adapter.validate_python(data | {"drawing": drawing(text)})
    except ValidationError as error:
        told = dict.fromkeys(_problem(dict(e), data) for e in error.errors())
        lines = [f"{path}: {sentence}" for sentence in [*told][:MOST_PROBLEMS]]
        raise MechanismError("\n".join(lines)) from None
    except PrbmError as error:
        raise MechanismError(f"{path}: {error}") from None


def _problem(error: dict[str, Any], data: Any) -> str:
    """Return a sentence about one error that pydantic found: the key, and what to do."""
    kind, loc = error["type"], error["loc"]
    if kind == "value_error":
        return str(error["ctx"]["error"])
    if loc and loc[-1] in ("float", "str"):  # it tried both
        loc, remedy = loc[:-1], EXPRESSION
    else:
        remedy = REMEDIES.get(kind, "")
    where = ".".join(map(str, loc)) + _owner(loc, data)
    if kind == "missing" and isinstance(loc[-1], int):
        return f"{'.'.join(map(str, loc[:-1]))} = {error['input']}: a number is missing; add it"
    if kind == "missing":
        return f"{where} is missing: add the key"
    if kind in ("unexpected_keyword_argument", "extra_forbidden"):
        known = [
            f.name for f in fields(PARTS.get(str(loc[0]), Mechanism) if loc[1:] else Mechanism)
        ]
        near = difflib.get_close_matches(str(loc[-1]), known, n=1, cutoff=0.6)
        hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
        return f"{where} is no key that is known there; {hint}"
    return f"{where} = {str(error['input'])[:60]!s}: {remedy or error['msg']}"


def _owner(loc: tuple[int | str, ...], data: Any) -> str:
    """Return the name of the part that a key belongs to, because parts are counted from 0."""
    if len(loc) < 3 or not isinstance(loc[1], int):
        return ""
    part = data[loc[0]][loc[1]]
    name = part.get("name") if isinstance(part, dict) else None
    return f" (of {name})" if isinstance(name, str) else ""


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
