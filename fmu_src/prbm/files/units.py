"""Quantities as people write them: ``0.1 mm``, ``7.8 g/cm3``, ``shuttle.width/2 + 3 mm``.

A number without a unit is in SI.  A unit is a product of powers, ``kg.m2``, ``g mm2``, ``N.m``,
over others, ``N/m``, ``m/s2``, ``1/s``; a power is the digits after the symbol.  Angles have a
dimension of their own here, so that an angle is not taken for a plain number.  Numbers are
converted as decimals: ``0.1 mm`` is the double that 1e-4 is.
"""

import math
import re
from decimal import Decimal
from functools import cache
from typing import Any

from ..base.errors import MechanismError
from ..mechanism.expressions import Quantity, affine

LONGEST_TEXT = 1000  # characters of an expression
COHERENT = (
    "m", "kg", "s", "rad", "N", "Pa", "kg/m3", "kg.m2", "N/m", "N.m", "m/s", "m/s2", "Hz", "rad/s",
)  # fmt: skip
PREFIXES = """
femto- = 1e-15 = f-
pico- = 1e-12 = p-
nano- = 1e-9 = n-
micro- = 1e-6 = u- = µ- = μ-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
deci- = 1e-1 = d-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
"""
MECHANICAL = f"""{PREFIXES}metre = [length] = m = meter
gram = [mass] = g
second = [time] = s
radian = [angle] = rad
degree = 0.017453292519943295769236907685 * radian = deg = °
newton = kilogram * metre / second ** 2 = N
newton_metre = newton * metre = Nm
pascal = newton / metre ** 2 = Pa
joule = newton * metre = J
watt = joule / second = W
hertz = 1 / second = Hz
"""
DEFINITIONS = f"""{MECHANICAL}tera- = 1e12 = T-
"""  # an engineer's mechanism needs no more, and pint's own list makes a metre of a misprint
KNOWN = "m, g, s, N, Nm, Pa, J, W, Hz, rad, deg, with SI prefixes, joined as in kg/m3 or N.m"

_NUMBER = r"(?>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"  # atomic: 1e3 is not 1 of the unit e3
_POWER = r"[A-Za-zµμ°]+(?:\^?-?\d+)?"
_PRODUCT = rf"{_POWER}(?:(?:\s*[.*·⋅]\s*|\s+){_POWER})*"
_UNIT = rf"{_PRODUCT}(?:\s*/\s*{_POWER})*"
_PLAIN = re.compile(rf"([+-]?{_NUMBER})\s*((?:1?\s*/\s*)?{_UNIT})")
_LITERAL = re.compile(rf"(?<![\w.\]])({_NUMBER})\s*({_UNIT})")
_SUPERSCRIPTS = str.maketrans("¹²³⁴⁻", "1234-")


def quantity(written: object, unit: str) -> Quantity:
    """Read a number, a number with a unit, or an expression in parameters.

    Parameters
    ----------
    written : float or str
        What is in the file.
    unit : str
        Unit of the result, for instance ``kg.m2``; empty if dimensionless.

    Raises
    ------
    MechanismError
        If it is none of them, or measures something else.

    Examples
    --------
    >>> quantity("0.1 mm", "m"), quantity("7.8 g/cm3", "kg/m3"), quantity(40, "m")
    (0.0001, 7800.0, 40.0)
    >>> quantity("shuttle.width/2 + 3 mm", "m")
    'shuttle.width/2 + 0.003'
    """
    if not isinstance(written, str):
        if isinstance(written, bool) or not isinstance(written, int | float):
            raise MechanismError("write a number, or an expression in parameters as a text")
        return _finite(written)
    text = _short(written)
    plain = _PLAIN.fullmatch(text)
    return converted(plain[1], plain[2], unit) if plain else _expression(text, unit)


def number(written: object, unit: str) -> float:
    """Read a number, or a number with a unit.

    Raises
    ------
    MechanismError
        If it is anything else, or measures something else.

    Examples
    --------
    >>> number("90 deg", "deg"), number(9.81, "m/s2")
    (90.0, 9.81)
    """
    plain = _PLAIN.fullmatch(_short(written)) if isinstance(written, str) else None
    if plain:
        return converted(plain[1], plain[2], unit)
    if isinstance(written, bool) or not isinstance(written, int | float):
        example = f' in {unit}, or a number and a unit in quotes, "3 {unit}"' if unit else ""
        raise MechanismError(f"write a number{example}")
    return _finite(written)


def converted(value: str, unit: str, wanted: str) -> float:
    """Return a number in another unit, correctly rounded.

    Raises
    ------
    MechanismError
        If a unit is unknown, the two measure different things or the number is too large.

    Examples
    --------
    >>> converted("53.187", "g", "kg"), converted("1", "rad", "deg")
    (0.053187, 57.29577951308232)
    """
    written = _unit(unit)
    if written.dimensionality != _unit(wanted).dimensionality:
        raise MechanismError(f"{unit!r} is the unit of something else; {_advice(wanted)}")
    try:
        result = _registry().Quantity(Decimal(value), written).to(_unit(wanted)).magnitude
    except ArithmeticError:
        result = math.inf
    return _finite(result)


def same_dimension(unit: str, other: str) -> bool:
    """Return whether two units measure the same.

    Raises
    ------
    MechanismError
        If a unit is unknown.
    """
    return bool(_unit(unit).dimensionality == _unit(other).dimensionality)


def si_unit(written: str) -> str:
    """Return the SI unit of what is written, empty if there is none.

    Examples
    --------
    >>> si_unit("40 mm"), si_unit("3 mNm"), si_unit("0.6")
    ('m', 'N.m', '')
    """
    plain = _PLAIN.fullmatch(_short(written))
    near = (unit for unit in COHERENT if plain and same_dimension(plain[2], unit))
    return next(near, "")


def check_coherent(unit: str) -> None:
    """Refuse a unit that is not the one that its kind of quantity has in SI.

    Raises
    ------
    MechanismError
        If the unit is unknown, or a multiple of the SI unit.
    """
    if unit in ("", "1", *COHERENT):
        return
    factor = _registry().Quantity(Decimal(1), _unit(unit)).to_root_units().magnitude
    mass = _unit(unit).dimensionality.get("[mass]", 0)
    if factor != Decimal(1000) ** mass:  # the root unit is the gram
        raise MechanismError(
            'parameters are in SI; write the unit after the number instead, value = "40 mm"'
        )


def _expression(text: str, unit: str) -> str:
    """Return an expression with its numbers with units as numbers in the wanted unit."""
    plain = _LITERAL.sub(lambda m: _written(converted(m[1], m[2], unit)), text)
    affine(plain)
    if plain != text:
        _check_terms(text)
    return plain


def _check_terms(text: str) -> None:
    """Refuse products of a unit with a parameter or a unit: their dimension is another one."""
    try:
        affine(_LITERAL.sub(lambda m: f"({m[1]} * written.unit)", text))
    except MechanismError:
        raise MechanismError(
            f"cannot read the expression {text[:80]!r}: a number with a unit is a term of a sum; "
            "write a factor in SI, without its unit"
        ) from None


def _written(value: float) -> str:
    return repr(value) if value >= 0 else f"({value!r})"


def _short(text: str) -> str:
    if len(text) > LONGEST_TEXT:
        raise MechanismError(f"write an expression of at most {LONGEST_TEXT} characters")
    return text.strip().translate(_SUPERSCRIPTS)


def _finite(value: float | Decimal) -> float:
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise MechanismError("write a finite number")
    return result


def _advice(unit: str) -> str:
    return f"write a quantity in {unit}" if unit else "write a number without a unit"


@cache
def _registry() -> Any:
    """Return the units, made when the first one is met."""
    import pint  # here, because it takes a third of a second

    registry: Any = pint.UnitRegistry(None, non_int_type=Decimal)
    registry.load_definitions(DEFINITIONS.strip().splitlines())
    return registry


@cache
def _unit(text: str) -> Any:
    """Return pint's unit for a unit as it is written here."""
    import pint  # here, because it takes a third of a second

    powers = re.sub(r"(?<=[A-Za-zµμ°])\^?(-?\d+)", r"**\1", text)
    product = re.sub(r"\s*[·⋅.]\s*|(?<=[\wµμ°])\s+(?=[A-Za-zµμ°])", "*", powers.strip())
    product = re.sub(r"^1?\s*/", "1/", product)
    try:
        return _registry().parse_units(product)
    except (pint.PintError, ValueError, ArithmeticError, TypeError, AttributeError):
        raise MechanismError(f"the unit {text!r} is unknown; known are {KNOWN}") from None
