"""Types of the values of keys in a mechanism file: quantities, names, points, lines."""

import math
import re
from dataclasses import dataclass
from keyword import iskeyword
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    StrictStr,
    Tag,
    ValidationInfo,
)
from pydantic_core import CoreSchema, core_schema

from ..base.errors import MechanismError
from ..mechanism.expressions import Quantity
from ..mechanism.fields import FIELDS
from ..mechanism.flexure import ENDS, MODELS, PROFILES
from ..mechanism.parameters import NAME
from ..mechanism.parts import LAWS
from .images import Line
from .units import number, quantity

NAME_LENGTH_MAX = 100  # Characters; names become parts of file names.
MIRRORS_MAX = 2  # Lines of symmetry of a part.
TEXT, LIST = TAGS = ("<text>", "<list>")  # Tags of the two forms of a point, or of the ends.


@dataclass(frozen=True)
class Measured:
    """Type of a quantity: a plain number, a number with a unit, or an expression.

    Parameters
    ----------
    description : str
        Meaning, for the schema.
    unit : str
        Unit of plain numbers and of the result; empty if dimensionless.
    minimum, maximum : float
        Bounds, for the schema.
    expression : bool
        Whether expressions in parameters are allowed.
    """

    description: str
    unit: str
    minimum: float = -math.inf
    maximum: float = math.inf
    expression: bool = True

    def read(self, written: object) -> Quantity:
        """Return the number in the unit of the key, or the expression."""
        return (quantity if self.expression else number)(written, self.unit)

    def __get_pydantic_core_schema__(self, _: Any, __: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, _: CoreSchema, __: GetJsonSchemaHandler) -> Any:
        bounds = {"minimum": self.minimum, "maximum": self.maximum}
        finite = {name: bound for name, bound in bounds.items() if math.isfinite(bound)}
        choices: list[dict[str, Any]] = [{"type": "number", **finite}]
        if self.expression or self.unit:
            choices.append({"type": "string", "pattern": r"\S" if self.expression else r"\d"})
        return {"description": f"{self.description} [{self.unit or '-'}]", "anyOf": choices}


@dataclass(frozen=True)
class InUnit:
    """Type of a number in the unit of its parameter; a bound may be infinite."""

    bound: bool = False

    def read(self, written: object, info: ValidationInfo) -> float:
        """Return the number in the unit of the parameter."""
        if self.bound and isinstance(written, float) and math.isinf(written):
            return written
        return number(written, str(info.data.get("unit", "")).removeprefix("1"))

    def __get_pydantic_core_schema__(self, _: Any, __: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, _: CoreSchema, __: GetJsonSchemaHandler) -> Any:
        return {"anyOf": [{"type": "number"}, {"type": "string", "pattern": r"\d"}]}


@dataclass(frozen=True)
class Strength(Measured):
    """Type of a strength, which is a number with a unit: a plain number is ambiguous."""

    unit: str = "Pa"
    minimum: float = 1.0
    maximum: float = 1e12
    expression: bool = False

    def read(self, written: object) -> Quantity:
        """Return the strength [Pa]."""
        if not isinstance(written, str):
            raise ValueError('write the strength with its unit, for example "1500 MPa"')
        strength = super().read(written)
        assert isinstance(strength, float)
        if not self.minimum <= strength <= self.maximum:
            raise ValueError(f"must be between {self.minimum:g} and {self.maximum:g} {self.unit}")
        return strength

    def __get_pydantic_json_schema__(self, _: CoreSchema, __: GetJsonSchemaHandler) -> Any:
        return {"description": f"{self.description} [Pa]", "type": "string", "pattern": r"\d"}


def measured(part: type, key: str) -> Measured:
    """Return the type of a field that is a parameter of the mechanism."""
    unit, description, minimum, maximum, *_ = FIELDS[part][key]
    return Measured(description, unit, minimum, maximum)


def _allowed(name: str) -> str:
    """Return a name; reject keywords of Python, because expressions are parsed as Python."""
    if any(iskeyword(word) for word in re.split(r"[.\[]", name)):
        raise MechanismError("a keyword of Python; choose another name")
    return name


@dataclass(frozen=True)
class LineText:
    """Type of a line of symmetry: ``x = ...`` or ``y = ...``."""

    def __get_pydantic_core_schema__(self, _: Any, __: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(Line.read)

    def __get_pydantic_json_schema__(self, _: CoreSchema, __: GetJsonSchemaHandler) -> Any:
        return {"type": "string", "pattern": r"^\s*[xy]\s*="}


Name = Annotated[
    StrictStr,
    Field(max_length=NAME_LENGTH_MAX, pattern=f"^{NAME.pattern}$"),
    AfterValidator(_allowed),
]
PointName = Annotated[StrictStr, Field(max_length=NAME_LENGTH_MAX, pattern=r"^[^\W\d]\w*$")]
Coordinate = Annotated[Quantity, Measured("Coordinate", "m")]
Point = tuple[Coordinate, Coordinate]
Reference = Annotated[StrictStr, Field(pattern=r"^\S+\.[^.\s]+$")]
Angle = Annotated[float, Measured("Direction, counter-clockwise from +x", "deg", expression=False)]
Acceleration = Annotated[
    float, Measured("Acceleration of gravity", "m/s2", -1e6, 1e6, expression=False)
]
End = Annotated[StrictStr, Field(json_schema_extra={"enum": list(ENDS)})]
Profile = Annotated[StrictStr, Field(json_schema_extra={"enum": list(PROFILES)})]
Law = Annotated[StrictStr, Field(json_schema_extra={"enum": list(LAWS)})]
Model = Annotated[StrictStr, Field(json_schema_extra={"enum": list(MODELS)})]


def _written_as(value: object) -> str:
    """Return the tag of the form of a point, or of the ends."""
    return TEXT if isinstance(value, str) else LIST


PointOrName = Annotated[
    Annotated[Point, Tag(LIST)] | Annotated[Reference, Tag(TEXT)], Discriminator(_written_as)
]
EndOrEnds = Annotated[
    Annotated[tuple[End, End], Tag(LIST)] | Annotated[End, Tag(TEXT)],
    Discriminator(_written_as),
]
MirrorLine = Annotated[Line, LineText()]
LineOrLines = Annotated[
    Annotated[tuple[MirrorLine, ...], Field(max_length=MIRRORS_MAX), Tag(LIST)]
    | Annotated[MirrorLine, Tag(TEXT)],
    Discriminator(_written_as),
]
Corner = Annotated[
    Annotated[Point, Tag(LIST)] | Annotated[PointName, Tag(TEXT)], Discriminator(_written_as)
]
