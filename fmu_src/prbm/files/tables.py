"""Tables of a mechanism file that refer to no other table: parameters and materials."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictInt, StrictStr, model_validator

from ..base.errors import MechanismError
from ..mechanism import parts
from ..mechanism.expressions import Quantity
from .units import si_unit
from .values import Angle, InUnit, Name, Point, Strength, measured

REPEAT_MAX = 1000  # Largest number of equal parts in a row or on a circle.
STRENGTHS = ("yield_strength", "tensile_strength", "fatigue_strength", "fatigue_cycles")
CYCLES: Any = {"minimum": 1e4, "maximum": 1e12}  # Range of the cycles of a fatigue strength.


class Table(BaseModel):
    """A table that rejects unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Named(Table):
    """A table with a name."""

    name: Name = Field(description="Name")


class RepeatTable(Table):
    """Equal parts in a row or on a circle."""

    count: Annotated[StrictInt, Field(ge=1, le=REPEAT_MAX)] = Field(
        description="Number of equal parts, with the original"
    )
    step: Point | None = Field(None, description="Displacement from one part to the next [m]")
    angle: Angle | None = Field(
        None, description="Rotation from one part to the next, in place of step [deg]"
    )
    about: Point = Field((0.0, 0.0), description="Centre of the rotation [m]")


class ParameterTable(Named):
    """A parameter that points and other quantities refer to."""

    unit: StrictStr = Field("", description="SI unit of the parameter (default: that of the value)")
    value: Annotated[float, InUnit()] = Field(description="Default value")
    description: StrictStr = Field("", description="Description of the FMU parameter")
    minimum: Annotated[float, InUnit(bound=True)] | None = Field(None, description="Smallest value")
    maximum: Annotated[float, InUnit(bound=True)] | None = Field(None, description="Largest value")
    nominal: Annotated[float, InUnit(bound=True)] | None = Field(
        None, description="Typical magnitude"
    )
    tunable: StrictBool = Field(False, description="Whether it may change during a simulation")

    @model_validator(mode="before")
    @classmethod
    def _unit_of_value(cls, data: Any) -> Any:
        if isinstance(data, dict) and "unit" not in data and isinstance(data.get("value"), str):
            try:
                return {"unit": si_unit(data["value"]), **data}
            except MechanismError:
                pass  # The value is read later, and rejected there.
        return data


class MaterialTable(Named):
    """A material, with the parameters name.youngs_modulus and name.density."""

    youngs_modulus: Annotated[Quantity, measured(parts.FlexureType, "youngs_modulus")]
    density: Annotated[Quantity, measured(parts.FlexureType, "density")]
    yield_strength: Annotated[float, Strength("Yield strength, with a unit")] | None = None
    tensile_strength: Annotated[float, Strength("Tensile strength, with a unit")] | None = None
    fatigue_strength: (
        Annotated[
            float,
            Strength(
                "Amplitude of a fully reversed stress that the material survives for "
                "fatigue_cycles, with a unit"
            ),
        ]
        | None
    ) = None
    fatigue_cycles: Annotated[float, Field(json_schema_extra=CYCLES)] | None = Field(
        None, description="Number of cycles of fatigue_strength"
    )

    @model_validator(mode="after")
    def _complete(self) -> "MaterialTable":
        if (self.fatigue_strength is None) != (self.fatigue_cycles is None):
            raise ValueError("give fatigue_strength and fatigue_cycles, or none of them")
        if self.fatigue_strength is None:
            return self
        if not CYCLES["minimum"] <= (self.fatigue_cycles or 0.0) <= CYCLES["maximum"]:
            raise ValueError("fatigue_cycles must be between 10000 and 1e12")
        if self.tensile_strength is None:
            raise ValueError("fatigue_strength needs tensile_strength: add it")
        if self.fatigue_strength >= parts.KNEE_SHARE * self.tensile_strength:
            raise ValueError(
                f"fatigue_strength must be less than {parts.KNEE_SHARE:g} of tensile_strength"
            )
        return self
