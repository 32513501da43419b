"""Mechanism files: TOML in, checked :class:`prbm.Mechanism` out; and the schema of such files."""

import difflib
import math
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

from ..base.errors import MechanismError, ParameterError, PrbmError
from ..base.names import proposal
from ..mechanism.description import Mechanism
from .schema import LONGEST_NAME, TAGS, MechanismTable, Table, mechanism
from .toml_lines import line_of, lines

Said = TypeVar("Said")
LARGEST_FILE = 1 << 20  # bytes; a mechanism of a hundred flexures has 20 kB
MOST_PROBLEMS = 5  # told at a time
DEEP_KEY = re.compile(r"(?<![\w'\"-])(?:[\w'\"-]+\s*\.\s*){100}")  # tomllib takes hours for more
DIALECT = "http://json-schema.org/draft-07/schema#"  # the latest that TOML editors know
REMEDIES = {  # by pydantic's types of errors
    "int_type": "write a whole number",
    "greater_than_equal": "write a larger number, at least 1",
    "string_type": "write a text in quotes",
    "string_too_long": f"write a shorter name, of at most {LONGEST_NAME} characters",
    "bool_type": "write true or false",
    "tuple_type": "write a list, [...], or a table [[...]] for every part of a kind",
    "too_long": "take out what is too much",
    "dict_type": "write a table, [...]",
    "model_type": "write a table, [...]",
}
NAMES = {  # by what the pattern of a name admits
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
        If the file cannot be read, is no TOML, or does not describe a mechanism; the message
        names the file, the line if it has one, and the key.
    """
    path = Path(path)
    try:
        text = _text(path)
        data = tomllib.loads(text)
    except MechanismError:
        raise
    except OSError as error:
        raise MechanismError(f"{path}: cannot be read ({error.strerror})") from None
    except RecursionError:
        raise MechanismError(f"{path}: is nested too deeply for a mechanism file") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise MechanismError(f"{path}: is no TOML file ({error})") from None
    except ValueError:
        raise MechanismError(f"{path}: has a number of thousands of digits") from None
    try:
        return mechanism(MechanismTable.model_validate(data), drawing(text))
    except ValidationError as error:
        places = [(e["loc"], e) for e in error.errors(include_url=False)]
        told = [(line, _problem(dict(e), data)) for line, e in _in_order(places, text)]
    except PrbmError as error:
        told = _in_order([(_place(str(error), data), str(error))], text)
    sentences = (f"line {line}: {sentence}" if line else sentence for line, sentence in told)
    raise MechanismError("\n".join(f"{path}: {sentence}" for sentence in sentences))


def _text(path: Path) -> str:
    with path.open("rb") as file:
        content = file.read(LARGEST_FILE + 1)
    if len(content) > LARGEST_FILE:
        raise MechanismError(f"{path}: larger than {LARGEST_FILE} bytes, no mechanism file")
    text = content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    if DEEP_KEY.search(text):
        raise MechanismError(f"{path}: is nested too deeply for a mechanism file")
    return text


def drawing(text: str) -> str:
    """Return the comment with which a mechanism file opens, without its marks.

    Directives to editors, ``#:schema``, are no part of it.
    """
    comments = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith("#:"):
            comments.append(line[1:].removeprefix(" "))
    return "\n".join(comments)


def shipped() -> dict[str, Path]:
    """Return the files of the mechanisms that come with the package, by name."""
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
        If there is neither a shipped mechanism of that name nor a file.
    MechanismError
        If the file cannot be read or does not describe a mechanism.

    Examples
    --------
    >>> load("Bistable").name
    'Bistable'
    """
    name, files = str(name), shipped()
    if name in files:
        return read_mechanism(files[name])
    if Path(name).is_dir():
        raise ParameterError(f"{name!r} is a folder; name a mechanism file in it")
    if not Path(name).suffix and not Path(name).is_file():
        raise ParameterError(
            f"there is no model {name!r}; {proposal(name, files)}; a file of your own ends in .toml"
        )
    return read_mechanism(name)


# --- what is wrong ----------------------------------------------------------------------------


def _problem(error: dict[str, Any], data: Any) -> str:
    """Return a sentence about one error that pydantic found: the key, and what to do."""
    kind = error["type"]
    loc = tuple(key for key in error["loc"] if key not in TAGS)
    where = ".".join(str(key) for key in loc if key != "[key]") + _owner(loc, data)
    if kind == "missing" and isinstance(loc[-1], int):
        where = ".".join(map(str, loc[:-1])) + _owner(loc[:-1], data)
        return f"{where} = {reprlib.repr(error['input'])}: a number is missing; add it"
    if kind == "missing":
        return f"{where} is missing: add the key"
    if kind == "extra_forbidden":
        known = _keys(loc)
        near = difflib.get_close_matches(str(loc[-1]), known, n=1, cutoff=0.6)
        hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
        return f"{where} is no key that is known there; {hint}"
    if kind == "value_error":
        remedy = str(error["ctx"]["error"])
    elif kind == "string_pattern_mismatch":
        remedy = NAMES[str(loc[-1])]
    elif kind == "tuple_type" and len(loc) > 1:
        remedy = "write a pair, [..., ...]"
    else:
        remedy = REMEDIES.get(kind, error["msg"])
    if remedy.startswith("cannot read the expression"):
        return f"{where}: {remedy}"  # which it quotes
    return f"{where} = {reprlib.repr(error['input'])}: {remedy}"


def _keys(loc: Sequence[str | int]) -> list[str]:
    """Return the keys that are known beside one that is not."""
    return [*_table(str(loc[0]) if loc[1:] else "").model_fields]


def _table(key: str) -> type[Table]:
    """Return the table that a key of the file holds, or an array of which it holds."""
    field = MechanismTable.model_fields.get(key)
    kinds = (field.annotation, *get_args(field.annotation)) if field else ()
    return next((k for k in kinds if isinstance(k, type) and issubclass(k, Table)), MechanismTable)


def _owner(loc: Sequence[str | int], data: Any) -> str:
    """Return the name of the part that a key belongs to, because parts are counted from 0."""
    if len(loc) < 3 or not isinstance(loc[1], int):
        return ""
    part = data[loc[0]][loc[1]]
    name = part.get("name") if isinstance(part, dict) else None
    return f" (of {reprlib.repr(name)[1:-1]})" if isinstance(name, str) else ""


def _in_order(
    places: Sequence[tuple[Sequence[str | int], Said]], text: str
) -> list[tuple[int | None, Said]]:
    """Return the first of what is said of some keys, each with the line of its key."""
    known = lines(text)
    found = [(line_of(loc, known), said) for loc, said in places]
    return sorted(found, key=lambda one: one[0] or math.inf)[:MOST_PROBLEMS]


_SUBJECT = re.compile(
    r"(?:^(?:mechanism |(?:the )?(?:flexure|joint|stop) )?|')([\w\[\]]+(?:\.[\w\[\]]+)*)"
)


def _place(sentence: str, data: Mapping[str, Any]) -> tuple[str | int, ...]:
    """Return the part or the key of it that a sentence of the engine begins with or quotes."""
    parts = dict(_parts(data))
    for word in _SUBJECT.findall(sentence):
        if word in parts:
            return _quoted(sentence, parts[word], data)
        name, _, key = word.rpartition(".")
        if name in parts:
            return (*parts[name], key)
        if f"{name}_{key}" in parts:  # the parameter damping.zeta is the key damping_zeta
            return parts[f"{name}_{key}"]
    return ()


def _quoted(
    sentence: str, path: tuple[str | int, ...], data: Mapping[str, Any]
) -> tuple[str | int, ...]:
    """Return the key of a part whose value a sentence quotes, or the part."""
    part: Any = data
    for key in path:
        part = part[key]
    values = part.items() if isinstance(part, dict) else ()
    keys = (k for text in re.findall("'(.*?)'", sentence) for k, v in values if v == text)
    return (*path, *islice(keys, 1))


def _parts(data: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str | int, ...]]]:
    """Yield the names of what a file describes, and where."""
    for key, value in data.items():
        yield key, (key,)
        for i, part in enumerate(value if isinstance(value, list) else ()):
            if isinstance(part, dict):
                yield str(part.get("name")), (key, i)


# --- schema -----------------------------------------------------------------------------------


class _Schema(GenerateJsonSchema):
    """What editors of TOML need: no null, which TOML does not have, and no titles."""

    def nullable_schema(self, schema: NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: WithDefaultSchema) -> JsonSchemaValue:
        if schema.get("default") is None:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def tuple_schema(self, schema: TupleSchema) -> JsonSchemaValue:
        result = super().tuple_schema(schema)
        if "prefixItems" in result:  # of one kind here, and no word of the dialect
            result["items"] = result.pop("prefixItems")[0]
        return result

    def dict_schema(self, schema: DictSchema) -> JsonSchemaValue:
        result = super().dict_schema(schema)
        if "patternProperties" in result:
            result["additionalProperties"] = False  # a name of another form is a mistake
        return result

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def schema() -> dict[str, Any]:
    """Return the JSON schema of mechanism files, with which editors complete and check them.

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
