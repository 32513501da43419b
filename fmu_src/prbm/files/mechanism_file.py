"""Read mechanism files (TOML) as :class:`prbm.Mechanism`, and describe them by a JSON schema."""

import difflib
import math
import os.path
import re
import reprlib
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import ValidationError
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core.core_schema import DictSchema, NullableSchema, TupleSchema, WithDefaultSchema

from ..base import reading
from ..base.errors import MechanismError, ParameterError, PrbmError
from ..base.names import proposal
from ..base.text import comma_advice, printable
from ..mechanism.description import Mechanism
from .schema import MechanismTable, mechanism
from .tables import RepeatTable, Table
from .toml_lines import key_length, line_of, lines
from .values import NAME_LENGTH_MAX, TAGS

Item = TypeVar("Item")
FILE_SIZE_MAX = 1 << 20  # bytes; a mechanism of a hundred flexures has 20 kB.
PROBLEMS_MAX = 5  # Problems of one file in a message.
KEY_LENGTH_MAX = 100  # Parts of a dotted key; tomllib needs more than linear time for longer ones.
LINE_LENGTH_MAX = 80  # Characters of a line of a file in a message.
UNQUOTED = 'write texts, and numbers with a unit, in quotes, for instance "5 mm"'
UNQUOTED_VALUE = re.compile(r"=[\s\[]*+(?!(?:True|False)\b)[^\"'#]*[^\W\d_]")
COMMA_VALUE = re.compile(r"=\s*([+-]?\d+,\d[^,#\"'\]]*)(?=#|$)")  # An unquoted decimal comma.
DIALECT = "http://json-schema.org/draft-07/schema#"  # The latest that TOML editors support.
REMEDIES = {  # Remedy for each of pydantic's error types.
    "int_type": "write a whole number",
    "greater_than_equal": "write a number of at least 1",
    "string_type": "write a text in quotes",
    "string_too_long": f"write a shorter name, of at most {NAME_LENGTH_MAX} characters",
    "bool_type": "write true or false",
    "too_long": "remove the surplus values; numbers have a decimal point, and commas between them",
}
_CORNERS = "write a list of corners, [[..., ...], [..., ...], [..., ...]]"
FORMS = {  # Remedy for a value of another form than those that these keys have.
    "gravity": "write a pair, gravity = [0, -9.81]",
    "outline": _CORNERS,
    "holes": _CORNERS + ", for each hole",
    "states": 'write a list of coordinates, states = ["crank.angle"]',
    "mirror": 'write the line of symmetry, "x = 0" or "y = 40 mm", or a list of both',
    "ends": "write clamp, pin or free in quotes, or a pair of them",
}
NAME_REMEDIES = {  # Remedy for a name that does not match the pattern of this key.
    "start": "write the name of a point, body.point or ground.point",
    "end": "write the name of a point, body.point or ground.point",
    "point": "write the name of a point, body.point",
    "name": "use letters, digits and _, joined by dots",
    "[key]": "use letters, digits and _ in the name of a point",
}


# --- reading ----------------------------------------------------------------------------------


def read_mechanism(path: str | Path) -> Mechanism:
    """Read a mechanism from a TOML file.

    Raises
    ------
    MechanismError
        If the file cannot be read, is not TOML, or does not describe a mechanism.  The message
        names the file, the line if there is one, and the key.
    """
    path = Path(path)
    content = reading.content(path, FILE_SIZE_MAX, MechanismError)
    try:
        text = content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
        deep = key_length(text, KEY_LENGTH_MAX + 1) > KEY_LENGTH_MAX
        data = None if deep else tomllib.loads(text)
    except RecursionError:
        data = None
    except UnicodeDecodeError as error:
        raise MechanismError(f"{path}: not a TOML file ({error})") from None
    except tomllib.TOMLDecodeError as error:
        raise MechanismError(f"{path}: not a TOML file ({_syntax(str(error), text)}") from None
    except ValueError:
        raise MechanismError(f"{path}: a number has thousands of digits; round it") from None
    if data is None:
        raise MechanismError(f"{path}: its tables, lists or keys are nested too deeply")
    try:
        return mechanism(MechanismTable.model_validate(data), drawing(text))
    except ValidationError as error:
        places = [(e["loc"], e) for e in error.errors(include_url=False)]
        problems = [(line, _problem(dict(e), data)) for line, e in _first_by_line(places, text)]
    except PrbmError as error:
        problems = _first_by_line([(_place(str(error), data), str(error))], text)
    messages = (f"line {line}: {message}" if line else message for line, message in problems)
    raise MechanismError("\n".join(f"{path}: {message}" for message in messages))


def drawing(text: str) -> str:
    """Return the comment at the top of a mechanism file, without its marks.

    Directives to editors, ``#:schema``, are skipped.
    """
    comments = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith("#:"):
            comments.append(line[1:].removeprefix(" "))
    return "\n".join(comments)


def shipped() -> dict[str, Path]:
    """Return the mechanism files of the package by name."""
    folder = Path(str(resources.files(__package__.rpartition(".")[0] + ".shipped")))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load(name: str | Path) -> Mechanism:
    """Return a shipped mechanism, or read one from a file.

    Parameters
    ----------
    name : str or Path
        Name of a shipped mechanism, or path of a mechanism file.

    Raises
    ------
    ParameterError
        If there is neither a shipped mechanism of that name nor such a file, or it is a folder.
    MechanismError
        If the file cannot be read or does not describe a mechanism.

    Examples
    --------
    >>> load("Bistable").name
    'Bistable'
    """
    return read_mechanism(file_of(name))


def file_of(name: str | Path) -> Path:
    """Return the path of the file of a mechanism.

    Parameters
    ----------
    name : str or Path
        Name of a shipped mechanism, or path of a mechanism file.

    Raises
    ------
    ParameterError
        As :func:`load`.

    Examples
    --------
    >>> file_of("Bistable").name, str(file_of("my/guide.toml"))
    ('Bistable.toml', 'my/guide.toml')
    """
    name, files = str(name), shipped()
    if name in files:
        return files[name]
    if os.path.isdir(name):
        raise ParameterError(f"{name!r} is a folder; give a mechanism file in it")
    if not Path(name).suffix and not os.path.isfile(name):
        raise ParameterError(
            f"unknown mechanism {name!r} (mechanism files end in .toml); {proposal(name, files)}"
        )
    return Path(name)


# --- error messages ---------------------------------------------------------------------------


def _syntax(reason: str, text: str) -> str:
    """Return the end of the message for an error of the syntax: reason, line and remedy."""
    number = re.search(r"at line (\d+)", reason)
    line = text.split("\n")[int(number[1]) - 1] if number else ""
    shown = printable(line).strip()[:LINE_LENGTH_MAX]
    remedy = f"; {UNQUOTED}" if UNQUOTED_VALUE.search(shown) else ""
    if value := COMMA_VALUE.search(shown):
        remedy = f"; {comma_advice(value[1].strip())}{remedy}"
    return f"{reason}){shown and f': {shown}'}{remedy}"


def _problem(error: dict[str, Any], data: Any) -> str:
    """Return the message for one error that pydantic found: key, value and remedy."""
    kind = error["type"]
    loc = tuple(key for key in error["loc"] if key not in TAGS)
    where = ".".join(str(key) for key in loc if key != "[key]") + _owner(loc, data)
    if kind == "missing" and isinstance(loc[-1], int):
        where = ".".join(map(str, loc[:-1])) + _owner(loc[:-1], data)
        missing = "an end" if loc[-2] == "ends" else "a number"
        return f"{where} = {reprlib.repr(error['input'])}: {missing} is missing; add it"
    if kind == "missing":
        return f"{where} is missing: add the key"
    if kind == "extra_forbidden":
        known = _keys(loc)
        near = difflib.get_close_matches(str(loc[-1]), known, n=1, cutoff=0.6)
        hint = f"did you mean {near[0]}?" if near else f"allowed keys are {', '.join(known)}"
        return f"unknown key {where}; {hint}"
    remedy = _remedy(error, loc)
    if remedy.startswith("cannot read the expression"):
        return f"{where}: {remedy}"  # The remedy quotes the value already.
    return f"{where}{_shown(error['input'])}: {remedy}"


def _shown(value: object) -> str:
    """Return a value for a message, ` = VALUE`; a table, or a list of them, by its kind."""
    if isinstance(value, dict):
        return " is a table"
    if isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
        return " is a list of tables"
    return f" = {reprlib.repr(value)}"


def _remedy(error: dict[str, Any], loc: Sequence[str | int]) -> str:
    """Return the remedy for an invalid value."""
    kind, key = error["type"], next(str(one) for one in reversed(loc) if isinstance(one, str))
    if kind == "value_error":
        return str(error["ctx"]["error"])
    if kind in ("string_pattern_mismatch", "tuple_type") and key in FORMS:
        return FORMS[key]
    if kind == "string_pattern_mismatch":
        return NAME_REMEDIES[key]
    table = ".".join(one for one in loc if isinstance(one, str))
    if kind == "tuple_type":
        return "write a pair, [..., ...]" if len(loc) > 1 else f"write [[{table}]] for each part"
    if kind in ("dict_type", "model_type"):
        return f"write [[{table}]]" if isinstance(loc[-1], int) else f"write [{table}]"
    if kind == "less_than_equal":
        return f"write a number of at most {error['ctx']['le']}"
    return str(REMEDIES.get(kind, error["msg"]))


def _keys(loc: Sequence[str | int]) -> list[str]:
    """Return the allowed keys of the table that has an unknown key."""
    if "repeat" in loc[:-1]:
        return [*RepeatTable.model_fields]
    return [*_table(str(loc[0]) if loc[1:] else "").model_fields]


def _table(key: str) -> type[Table]:
    """Return the class of the table, or of the array of tables, at a key of the file."""
    field = MechanismTable.model_fields.get(key)
    kinds = (field.annotation, *get_args(field.annotation)) if field else ()
    return next((k for k in kinds if isinstance(k, type) and issubclass(k, Table)), MechanismTable)


def _owner(loc: Sequence[str | int], data: Any) -> str:
    """Return the name of the part that a key belongs to, as `` (of NAME)``, or an empty text."""
    if len(loc) < 3 or not isinstance(loc[1], int):
        return ""
    part = data[loc[0]][loc[1]]
    name = part.get("name") if isinstance(part, dict) else None
    return f" (of {reprlib.repr(name)[1:-1]})" if isinstance(name, str) else ""


def _first_by_line(
    places: Sequence[tuple[Sequence[str | int], Item]], text: str
) -> list[tuple[int | None, Item]]:
    """Return the first items in the order of their lines, each with the line of its key."""
    known = lines(text)
    found = [(line_of(loc, known), item) for loc, item in places]
    return sorted(found, key=lambda numbered: numbered[0] or math.inf)[:PROBLEMS_MAX]


# The name at the beginning of a message, after the kind of the part, or a quoted name.
_SUBJECT = re.compile(
    r"(?:^(?:mechanism |(?:the )?(?:body|flexure|joint|stop) )?|')([\w\[\]]+(?:\.[\w\[\]]+)*)"
)


def _place(message: str, data: Mapping[str, Any]) -> tuple[str | int, ...]:
    """Return the path of the part or key that a message of the engine names first."""
    parts = dict(_parts(data))
    for word in _SUBJECT.findall(message):
        if word in parts:
            return _quoted(message, parts[word], data)
        head, _, rest = word.partition(".")
        if head == "tolerances" in parts:
            return (head, *rest.split("."))
        name, _, key = word.rpartition(".")
        if name in parts:
            return (*parts[name], key)
        if f"{name}_{key}" in parts:  # The parameter damping.zeta is the key damping_zeta.
            return parts[f"{name}_{key}"]
    return ()


def _quoted(
    message: str, path: tuple[str | int, ...], data: Mapping[str, Any]
) -> tuple[str | int, ...]:
    """Return the path of the key whose value a message quotes, or else that of the part."""
    part: Any = data
    for key in path:
        part = part[key]
    values = part.items() if isinstance(part, dict) else ()
    keys = (k for text in re.findall("'(.*?)'", message) for k, v in values if v == text)
    return (*path, *islice(keys, 1))


def _parts(data: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str | int, ...]]]:
    """Yield the names of the tables and parts of a file with their paths."""
    for key, value in data.items():
        yield key, (key,)
        for i, part in enumerate(value if isinstance(value, list) else ()):
            if isinstance(part, dict):
                yield str(part.get("name")), (key, i)


# --- schema -----------------------------------------------------------------------------------


class _Schema(GenerateJsonSchema):
    """Generator of a schema for TOML editors: without null, which TOML lacks, and titles."""

    def nullable_schema(self, schema: NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: WithDefaultSchema) -> JsonSchemaValue:
        if schema.get("default") is None:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def tuple_schema(self, schema: TupleSchema) -> JsonSchemaValue:
        result = super().tuple_schema(schema)
        if "prefixItems" in result:  # not in draft 7; all items have one type here
            result["items"] = result.pop("prefixItems")[0]
        return result

    def dict_schema(self, schema: DictSchema) -> JsonSchemaValue:
        result = super().dict_schema(schema)
        if "patternProperties" in result:
            result["additionalProperties"] = False  # reject names of another form
        return result

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def schema() -> dict[str, Any]:
    """Return the JSON schema of mechanism files; editors complete and check the files with it.

    Examples
    --------
    >>> schema()["definitions"]["BodyTable"]["properties"]["mass"]["description"]
    'Mass [kg]'
    """
    result = MechanismTable.model_json_schema(
        ref_template="#/definitions/{model}", schema_generator=_Schema
    )
    definitions = result.pop("$defs")
    for table in (result, *definitions.values()):
        table.pop("title", None)
    return {"$schema": DIALECT, "title": "Mechanism", **result, "definitions": definitions}
