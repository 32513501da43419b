"""Parameters: values with units and bounds."""

import math
import re
import reprlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from ..base.errors import MechanismError, ParameterError

T = TypeVar("T")
NAME = re.compile(r"[A-Za-z_]\w*(\[\d+\])?(\.[A-Za-z_]\w*(\[\d+\])?)*")


@dataclass(frozen=True)
class Parameter:
    """A named value with its unit, description and bounds.

    Parameters
    ----------
    name : str
        Structured name, for instance ``flexure.length``.
    value : float
        Default, in the unit.
    unit : str
        SI unit, products with dots and powers as in ``kg.m2``; empty if dimensionless.
    description : str
        One phrase for a user who knows the mechanism but not the model.
    minimum, maximum : float
        Inclusive bounds.
    nominal : float or None
        Typical magnitude; None if it is about 1.
    tunable : bool
        Whether it may change during a simulation.
    """

    name: str
    value: float
    unit: str = ""
    description: str = ""
    minimum: float = -math.inf
    maximum: float = math.inf
    nominal: float | None = None
    tunable: bool = False

    def __post_init__(self) -> None:
        if not NAME.fullmatch(self.name):
            raise MechanismError(
                f"the name {self.name!r} is invalid: use letters, digits and _, joined by dots"
            )
        self.check(self.value)

    def check(self, value: float) -> float:
        """Return the value as a float.

        Raises
        ------
        ParameterError
            If the value is not a finite number within the bounds.
        """
        number = finite(self.name, value, self.unit)
        unit = f" {self.unit}" if self.unit else ""
        if number < self.minimum:
            raise ParameterError(
                f"{self.name} = {number:.10g}{unit} must be at least {self.minimum:g}{unit}"
            )
        if number > self.maximum:
            raise ParameterError(
                f"{self.name} = {number:.10g}{unit} must be at most {self.maximum:g}{unit}"
            )
        return number


@dataclass(frozen=True)
class Tolerance:
    """Limits of a parameter on either side of its value.

    Parameters
    ----------
    half_width : float
        Distance of the limits from the value, in the unit of the parameter, or as a share of it.
    relative : bool
        Whether the half-width is a share of the value.
    uniform : bool
        Whether values between the limits are equally likely; otherwise they have a normal
        distribution, whose standard deviation is a third of the half-width.

    Raises
    ------
    ParameterError
        If the half-width is not positive and finite.

    Examples
    --------
    >>> Tolerance(0.02, relative=True).at(-5.0)
    0.1
    """

    half_width: float
    relative: bool = False
    uniform: bool = False

    def __post_init__(self) -> None:
        if not (self.half_width > 0.0 and math.isfinite(self.half_width)):
            raise ParameterError(
                f"a tolerance of +- {self.half_width:g} must be positive and finite"
            )

    def at(self, value: float) -> float:
        """Return the distance of the limits from a value, in its unit."""
        return self.half_width * (abs(value) if self.relative else 1.0)


def by_name(argument: str, given: Mapping[str, T] | None) -> Mapping[str, T]:
    """Return the values of an argument by name, none of them for None.

    Raises
    ------
    ParameterError
        If the argument is not a mapping.
    """
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise ParameterError(
            f"{argument} = {reprlib.repr(given)} must be a mapping from names to values, such as "
            '{"stop.position": 0.001}'
        )
    return given


def number(name: str, value: float, unit: str = "") -> float:
    """Return a number as a float, which may be infinite or NaN.

    Raises
    ------
    ParameterError
        If the value is not a number.
    """
    try:
        if isinstance(value, bool | str | bytes | bytearray):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        of_unit = f" in {unit}" if unit else ""
        raise ParameterError(f"{name} = {value!r} must be a number{of_unit}") from None


def finite(name: str, value: float, unit: str = "") -> float:
    """Return a finite number as a float.

    Raises
    ------
    ParameterError
        If the value is not a finite number.
    """
    x = number(name, value, unit)
    if not math.isfinite(x):
        raise ParameterError(f"{name} = {x}{unit and ' '}{unit} must be a finite number")
    return x
