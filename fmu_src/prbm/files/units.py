"""Read quantities with units: ``0.1 mm``, ``7.8 g/cm3``, ``shuttle.width/2 + 3 mm``.

Numbers without a unit are in SI.  Units are products of powers, ``kg.m2``, ``g mm2``, ``N.m``,
and quotients, ``N/m``, ``m/s2``, ``1/s``.  Powers are written as digits after the symbol.  Angles
have a dimension, so that an angle is not accepted as a dimensionless number.  Numbers are
converted as decimals: ``0.1 mm`` and ``1e-4`` give the same double.
"""

import math
import re
import reprlib
from decimal import Decimal
from functools import cache
from itertools import chain
from typing import Any

from ..base.errors import MechanismError
from ..base.text import comma_advice
from ..base.unit_text import GRAVITY
from ..mechanism.expressions import Quantity, affine

EXPRESSION_LENGTH_MAX = 1000  # characters
UNIT_LENGTH_MAX = 100  # characters
EXPONENT_MAX = 20  # Exponent of a base unit; no quantity of mechanics has a larger one.
COHERENT = (
    "m", "kg", "s", "rad", "N", "Pa", "kg/m3", "kg.m2", "N/m", "N.m", "m/s", "m/s2", "Hz", "rad/s",
    "1/m", "N.m/rad", "N/m3", "N.s/m", "N.m.s/rad",
)  # fmt: skip
DEGREE = Decimal("0.017453292519943295769236907685")  # rad
Factors = dict[str, int | Decimal]
_WRITTEN: dict[str, Factors] = {
    "m": {"m": 0, "cm": -2, "mm": -3, "um": -6, "µm": -6, "μm": -6, "nm": -9},
    "kg": {"kg": 0, "g": -3, "mg": -6},
    "kg/m3": {"kg/m3": 0, "g/cm3": 3},
    "kg.m2": {"kg.m2": 0, "kg m2": 0, "kg.mm2": -6, "kg mm2": -6, "g.mm2": -9, "g mm2": -9},
    "Pa": {"Pa": 0, "kPa": 3, "MPa": 6, "GPa": 9},
    "m/s": {"m/s": 0, "mm/s": -3},
    "N": {"N": 0, "mN": -3},
    "rad": {"rad": 0, "deg": DEGREE},
    "N/m": {"N/m": 0, "N/mm": 3, "kN/m": 3},
    "N.m": {"N.m": 0, "Nm": 0, "N.mm": -3, "mN.m": -3},
    "s": {"s": 0, "ms": -3, "us": -6, "µs": -6, "μs": -6},
}
COMMON: dict[str, Factors] = {unit: {unit: 0, **_WRITTEN.get(unit, {})} for unit in COHERENT}
"""Powers of ten, or factors, by SI unit and written unit, which need no import of pint."""
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
degree = {DEGREE} * radian = deg = °
newton = kilogram * metre / second ** 2 = N
newton_metre = newton * metre = Nm
pascal = newton / metre ** 2 = Pa
joule = newton * metre = J
watt = joule / second = W
hertz = 1 / second = Hz
"""
DEFINITIONS = f"""{MECHANICAL}tera- = 1e12 = T-
"""  # Pint's own list is not used: some of its units are likely misprints of these.
KNOWN = "m, g, s, N, Nm, Pa, J, W, Hz, rad, deg, with SI prefixes, joined as in kg/m3 or N.m"

_NUMBER = r"(?>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)"  # Atomic: 1e3 is not 1 with the unit e3.
_POWER = r"[A-Za-zµμ°]+(?:\^?-?[0-9]+)?"
_PRODUCT = rf"{_POWER}(?:(?:\s*[.*·⋅]\s*|\s+){_POWER})*"
_UNIT = rf"{_PRODUCT}(?:\s*/\s*{_POWER})*"
_PLAIN = re.compile(rf"([+-]?{_NUMBER})\s*+((?:1?\s*+/\s*+)?{_UNIT})")
_SYMBOL = r"[A-Za-zµμ]+"
_STIFFNESS = re.compile(rf"([+-]?{_NUMBER})\s*({_SYMBOL})\s*/\s*({_SYMBOL})\^?([0-9]+\.?[0-9]*)?")
_LITERAL = re.compile(rf"(?<![\w.\]])({_NUMBER})\s*({_UNIT})")
_SUPERSCRIPTS = str.maketrans("¹²³⁴⁻", "1234-")


def quantity(written: object, unit: str) -> Quantity:
    """Read a number, a number with a unit, or an expression in parameters.

    Parameters
    ----------
    written : float or str
        Value in the file.
    unit : str
        Unit of the result, for instance ``kg.m2``; empty if dimensionless.

    Raises
    ------
    MechanismError
        If ``written`` cannot be read as a quantity, its unit has another dimension, it has a
        decimal comma, or a number in quotes has no unit although the quantity has a dimension.

    Examples
    --------
    >>> quantity("0.1 mm", "m"), quantity("7.8 g/cm3", "kg/m3"), quantity(40, "m")
    (0.0001, 7800.0, 40.0)
    >>> quantity("shuttle.width/2 + 3 mm", "m")
    'shuttle.width/2 + 0.003'
    """
    if not isinstance(written, str):
        if isinstance(written, bool) or not isinstance(written, int | float):
            raise MechanismError("write a number, or an expression in parameters in quotes")
        return _finite(written)
    text = _pointed(written)
    plain = _PLAIN.fullmatch(text)
    return converted(plain[1], plain[2], unit) if plain else _expression(text, unit)


def number(written: object, unit: str) -> float:
    """Read a number, or a number with a unit.

    Raises
    ------
    MechanismError
        If it is neither, or has another dimension.

    Examples
    --------
    >>> number("90 deg", "deg"), number(9.81, "m/s2")
    (90.0, 9.81)
    """
    plain = _PLAIN.fullmatch(_pointed(written)) if isinstance(written, str) else None
    if plain:
        return converted(plain[1], plain[2], unit)
    if isinstance(written, bool) or not isinstance(written, int | float):
        example = f' in {unit}, or a number and a unit in quotes, "3 {unit}"' if unit else ""
        raise MechanismError(f"write a number{example}")
    return _finite(written)


def converted(value: str, unit: str, wanted: str) -> float:
    """Return a number in another unit, correctly rounded.

    The unit g of an acceleration is the standard gravity, 9.80665 m/s2.

    Raises
    ------
    MechanismError
        If a unit is unknown, the two have different dimensions, or the result is too large.

    Examples
    --------
    >>> converted("53.187", "g", "kg"), converted("1", "rad", "deg")
    (0.053187, 57.29577951308232)
    >>> converted("2", "g", "m/s2")
    19.6133
    """
    common = COMMON.get(wanted, {}).get(unit)
    if common is not None:
        return _scaled(value, common)
    if unit == "g" and same_dimension(wanted or "1", "m/s2"):
        value, unit = str(Decimal(value) * Decimal(repr(GRAVITY))), "m/s2"
    written = _unit(unit)
    if written.dimensionality != _unit(wanted).dimensionality:
        raise MechanismError(f"the unit {unit!r} has another dimension; {_advice(wanted)}")
    try:
        result = _registry().Quantity(Decimal(value), written).to(_unit(wanted)).magnitude
    except ArithmeticError:
        result = math.inf
    return _finite(result)


def _scaled(value: str, factor: int | Decimal) -> float:
    """Return a decimal number times a power of ten, or times a factor, correctly rounded."""
    try:
        number = Decimal(value)
        return _finite(number.scaleb(factor) if isinstance(factor, int) else number * factor)
    except ArithmeticError:
        return _finite(math.inf)


def same_dimension(unit: str, other: str) -> bool:
    """Return whether two units have the same dimension.

    Raises
    ------
    MechanismError
        If a unit is unknown.
    """
    return bool(_unit(unit).dimensionality == _unit(other).dimensionality)


def si_unit(written: str) -> str:
    """Return the SI unit of a number with a unit, an empty text for other texts.

    Raises
    ------
    MechanismError
        If the unit is unknown, or the number has a decimal comma.

    Examples
    --------
    >>> si_unit("40 mm"), si_unit("3 mNm"), si_unit("0.6")
    ('m', 'N.m', '')
    """
    plain = _PLAIN.fullmatch(_pointed(written))
    if plain is None:
        return ""
    common = (unit for unit, known in COMMON.items() if plain[2] in known)
    near = (unit for unit in COHERENT if same_dimension(plain[2], unit))
    return next(chain(common, near), "")


def contact_stiffness(written: str, exponent: float | str) -> float | str:
    """Return a contact stiffness in N/m^exponent; expressions in parameters are not changed.

    Raises
    ------
    MechanismError
        If its unit is not a force over a length to the power of the exponent, or if the exponent is
        an expression and the stiffness has a unit.

    Examples
    --------
    >>> contact_stiffness("2 kN/m^1.5", 1.5), contact_stiffness("1 N/mm^2", 2.0)
    (2000.0, 1000000.0)
    """
    text = _pointed(written)
    plain = _STIFFNESS.fullmatch(text)
    power = float(plain[4] or 1.0) if plain else None
    measured = plain is not None or _PLAIN.fullmatch(text) is not None
    if isinstance(exponent, str):
        if measured:
            raise MechanismError(
                f"{written[:40]!r} has a unit, which depends on the exponent {exponent[:40]!r}: "
                "write a number in N/m^exponent, without quotes"
            )
        return written
    wrong = MechanismError(
        f"{written[:40]!r} must be a force over a length to the power {exponent:g}: write it in "
        f'N/m^{exponent:g}, for instance "1e9 N/m^{exponent:g}"'
    )
    if exponent == 1.0:
        if power not in (None, 1.0):
            raise wrong
        return written  # Its unit is that of other stiffnesses.
    if plain is None or power != exponent:
        if measured or re.fullmatch(rf"[+-]?{_NUMBER}", text):
            raise wrong
        return written
    try:
        force, length = converted("1", plain[2], "N"), converted("1", plain[3], "m")
    except MechanismError:
        raise wrong from None
    return _finite(float(plain[1]) * force / length**exponent)


def check_coherent(unit: str) -> None:
    """Reject a unit other than the SI unit of its dimension.

    Raises
    ------
    MechanismError
        If the unit is unknown, or a multiple of the SI unit.
    """
    if unit in ("", "1", *COHERENT):
        return
    factor = _registry().Quantity(Decimal(1), _unit(unit)).to_root_units().magnitude
    mass = _unit(unit).dimensionality.get("[mass]", 0)
    if factor != Decimal(1000) ** mass:  # Pint's root unit is the gram.
        raise MechanismError(
            'not an SI unit; write the unit after the number instead, as in value = "40 mm"'
        )


def _expression(text: str, unit: str) -> str:
    """Return an expression in which numbers with units are numbers in the given unit."""
    plain = _LITERAL.sub(lambda m: _written(converted(m[1], m[2], unit)), text)
    expression = affine(plain)
    if plain != text:
        _check_terms(text)
    if unit and (plain != text or not expression.terms):
        without = affine(_LITERAL.sub("0", text)).constant
        if without:
            raise MechanismError(
                f"{without:g} has no unit: write a unit after each number, as in "
                f'"{without:g} {unit}", or a number in {unit} without quotes'
            )
    return plain


def _check_terms(text: str) -> None:
    """Reject products of a number with a unit and a parameter, which change the dimension."""
    try:
        affine(_LITERAL.sub(lambda m: f"({m[1]} * written.unit)", text))
    except MechanismError:
        raise MechanismError(
            f"cannot read the expression {text[:80]!r}: a number with a unit must be a term of a "
            "sum; write factors without units, in SI"
        ) from None


def _written(value: float) -> str:
    """Return a number as it is written in an expression, negative ones in parentheses."""
    return repr(value) if value >= 0 else f"({value!r})"


def _short(text: str) -> str:
    """Return a text without outer blanks and superscripts; reject a long one."""
    if len(text) > EXPRESSION_LENGTH_MAX:
        raise MechanismError(f"write an expression of at most {EXPRESSION_LENGTH_MAX} characters")
    return text.strip().translate(_SUPERSCRIPTS)


def _pointed(text: str) -> str:
    """Return a text as :func:`_short` does; reject a decimal comma."""
    if advice := comma_advice(text[:EXPRESSION_LENGTH_MAX]):
        raise MechanismError(advice)
    return _short(text)


def _finite(value: float | Decimal) -> float:
    """Return a number as a finite float; reject other numbers."""
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise MechanismError("write a finite number")
    return result


def _advice(unit: str) -> str:
    """Return the remedy for a wrong dimension."""
    return f"write a quantity in {unit}" if unit else "write a number without a unit"


@cache
def _registry() -> Any:
    """Return pint's registry of these units, created at the first call."""
    import pint  # imported here because the import takes 0.3 s

    registry: Any = pint.UnitRegistry(None, non_int_type=Decimal)
    registry.load_definitions(DEFINITIONS.strip().splitlines())
    return registry


@cache
def _unit(text: str) -> Any:
    """Return pint's unit for a written unit; reject an unknown one."""
    powers = re.sub(r"(?<=[A-Za-zµμ°])\^?(-?[0-9]+)", r"**\1", text[: UNIT_LENGTH_MAX + 1])
    product = re.sub(r"\s*[·⋅.]\s*|(?<=[\wµμ°])\s+(?=[A-Za-zµμ°])", "*", powers.strip())
    unit = parsed_unit(_registry(), re.sub(r"^1?\s*/", "1/", product))
    if unit is None or len(text) > UNIT_LENGTH_MAX:
        name = reprlib.repr(text)
        raise MechanismError(f"the unit {name} is unknown; known units are {KNOWN}")
    return unit


def parsed_unit(registry: Any, text: str) -> Any:
    """Return the unit of a registry of pint, None if it is unknown or not convertible to SI.

    For invalid texts pint raises errors of many types, among them AssertionError, KeyError and
    TokenError.
    """
    try:
        unit = registry.parse_units(text)
        zero, one = (registry.Quantity(Decimal(x), unit).to_root_units().magnitude for x in (0, 1))
        exponent = max(map(abs, unit.dimensionality.values()), default=0)
        return unit if exponent <= EXPONENT_MAX and 0.0 < float(one - zero) < math.inf else None
    except Exception:
        return None
