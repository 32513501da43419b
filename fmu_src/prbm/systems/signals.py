"""Values on their way through connectors: units, transformations and types of SSP 1.0.

A value is converted to the unit of the next connector, and then transformed.  Factors and offsets
are exact fractions until the end.
"""

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from .components import CouplingError

REAL, INTEGER, BOOLEAN, ENUMERATION = "Real", "Integer", "Boolean", "Enumeration"
WIDENED = {(BOOLEAN, INTEGER), (BOOLEAN, REAL), (INTEGER, REAL)}
"""Types that another one contains: true is 1."""
BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def exact(text: object, where: str) -> Fraction:
    """Return a finite number of an attribute exactly as the float that it denotes.

    Raises
    ------
    CouplingError
        If it is not finite.
    """
    number = float(str(text))  # bounds the exponent: a fraction of 1e999999999 would fill memory
    if not math.isfinite(number):
        raise CouplingError(f"{where}: {text} is not a finite number; write one")
    return Fraction(repr(number))


@dataclass(frozen=True)
class Unit:
    """A unit: its value times ``factor`` plus ``offset`` is the value in SI.

    Parameters
    ----------
    name : str
        Its name.
    base : tuple of int, or None
        Exponents of :data:`BASE_UNITS`; None: the file does not define the unit.
    factor, offset : Fraction
        Conversion to SI.
    relative : bool
        It is the unit of a difference of two values, to which no offset applies.
    """

    name: str
    base: tuple[int, ...] | None = None
    factor: Fraction = Fraction(1)
    offset: Fraction = Fraction(0)
    relative: bool = False

    @classmethod
    def of(cls, name: str, given: Mapping[str, Any]) -> "Unit":
        """Return a unit from the attributes of its ``BaseUnit``."""
        where = f"the unit {name}"
        factor = exact(given.get("factor", 1), where)
        if factor == 0:
            raise CouplingError(f"{where}: factor = 0; write another factor")
        return cls(
            name, tuple(int(given.get(x, 0)) for x in BASE_UNITS), factor,
            exact(given.get("offset", 0), where),
        )  # fmt: skip


@dataclass(frozen=True)
class Linear:
    """The function ``factor * value + offset``."""

    factor: Fraction = Fraction(1)
    offset: Fraction = Fraction(0)

    def __call__(self, value: Any) -> Any:
        """Return the value of the function, exact for a fraction."""
        if isinstance(value, Fraction):
            return self.factor * value + self.offset
        return float(self.factor) * value + float(self.offset)

    def then(self, other: "Linear") -> "Linear":
        """Return the function that applies this one first."""
        return Linear(other.factor * self.factor, other.factor * self.offset + other.offset)


@dataclass(frozen=True)
class Table:
    """A function of values of a type, given by its values."""

    kind: str
    entries: tuple[tuple[Any, Any], ...]
    where: str

    def __call__(self, value: Any) -> Any:
        """Return the value of the function."""
        for given, result in self.entries:
            if given == value:
                return result
        raise CouplingError(f"{self.where}: there is no entry for {value}; add one")


Transformation = Linear | Table
IDENTITY = Linear()


def conversion(source: Unit | None, target: Unit | None, where: str) -> Linear:
    """Return the conversion between units; none takes place if one of them is not known.

    Raises
    ------
    CouplingError
        If the dimensions differ, a unit is not defined, or an offset would apply to a difference.
    """
    if source is None or target is None:
        return IDENTITY
    if None in (source.base, target.base):
        if source.name == target.name:
            return IDENTITY
        unknown = source if source.base is None else target
        raise CouplingError(
            f"{where}: {source.name} cannot be converted to {target.name}, since {unknown.name} is "
            "not defined; define it, or set suppressUnitConversion"
        )
    if source.base != target.base:
        raise CouplingError(
            f"{where}: {source.name} cannot be converted to {target.name}, which has another "
            "dimension; correct the unit, or set suppressUnitConversion"
        )
    if (source.relative or target.relative) and source.offset != target.offset:
        raise CouplingError(
            f"{where}: {source.name} is not converted to {target.name}, since one of them is a "
            "relative quantity and an offset lies between the units; use units without an offset"
        )
    return Linear(source.factor / target.factor, (source.offset - target.offset) / target.factor)


def _check_size(steps: tuple[Transformation, ...], where: str) -> None:
    """Check that factors and offsets of functions are zero or floats of full precision."""
    least, most = Fraction(sys.float_info.min), Fraction(sys.float_info.max)
    for step in steps:
        for number in (step.factor, step.offset) if isinstance(step, Linear) else ():
            if number and not least <= abs(number) <= most:
                raise CouplingError(
                    f"{where}: units and transformations on the way have a factor or an offset "
                    "that is too small or too large for a float; use units of a similar size"
                )


@dataclass(frozen=True)
class Signal:
    """A value at a connector, as a function of the value at its origin.

    Parameters
    ----------
    kind : str
        Its type in SSP; enumerations are the names of their items.
    unit : Unit or None
        Its unit; None: not known.
    steps : tuple of functions
        The functions from the origin to here.
    vague : bool
        The unit of the connector here cannot be deduced.
    """

    kind: str
    unit: Unit | None = None
    steps: tuple[Transformation, ...] = ()
    vague: bool = False

    def __call__(self, value: Any) -> Any:
        """Return the value here for a value at the origin."""
        for step in self.steps:
            value = step(value)
        return value

    def after(self, step: Transformation) -> "Signal":
        """Return the signal after another function."""
        if step == IDENTITY:
            return self
        steps = self.steps
        if steps and isinstance(step, Linear) and isinstance(steps[-1], Linear):
            step, steps = steps[-1].then(step), steps[:-1]
        return replace(self, steps=(*steps, step))

    def of_kind(self, kind: str | None, where: str) -> "Signal":
        """Return the signal at a connector of a type; None: any type.

        Raises
        ------
        CouplingError
            If that type does not contain the present one.
        """
        if kind in (None, self.kind):
            return self
        if (self.kind, kind) not in WIDENED:
            raise CouplingError(f"{where}: a value of type {self.kind} is no {kind}; use one type")
        return replace(self, kind=kind)

    def at(
        self,
        kind: str | None,
        unit: Unit | None,
        where: str,
        transformation: Transformation | None = None,
        suppress: bool = False,
        vague: bool = False,
    ) -> "Signal":
        """Return the signal at the next connector.

        Parameters
        ----------
        kind, unit : str or None, Unit or None
            Type and unit of the connector; None: it has none, and takes that of the signal.
        where : str
            Name of the connection, for messages.
        transformation : Linear, Table or None
            Transformation after the conversion of the unit.
        suppress : bool
            The unit is not converted.
        vague : bool
            The unit of the connector cannot be deduced from what is connected inside.

        Raises
        ------
        CouplingError
            If types or units do not match, the value depends on a unit that cannot be deduced, or a
        factor is no float.
        """
        signal = self
        if isinstance(transformation, Table):
            if transformation.kind != self.kind:
                raise CouplingError(
                    f"{transformation.where}: the value is of type {self.kind}, not "
                    f"{transformation.kind}; use the transformation of its type"
                )
            signal = signal.after(transformation)
        signal = signal.of_kind(kind, where)
        linear = isinstance(transformation, Linear)
        depends = (suppress and self.vague) or (vague and (suppress or linear or self.unit is None))
        if depends and signal.kind == REAL:
            raise CouplingError(
                f"{where}: the unit of a connector on the way cannot be deduced from what is "
                "connected inside its system; give the connector a unit"
            )
        if unit is not None:
            converted = IDENTITY if suppress else conversion(self.unit, unit, where)
            signal = replace(signal.after(converted), unit=unit)
        signal = replace(signal, vague=vague)
        if isinstance(transformation, Linear):
            if signal.kind != REAL:
                raise CouplingError(
                    f"{where}: LinearTransformation of a value of type {signal.kind}; it is for "
                    "Real only"
                )
            signal = signal.after(transformation)
        _check_size(signal.steps, where)
        return signal
