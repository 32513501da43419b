"""Units in the heads of measured data: ``mm``, ``Volts``, ``°C``, ``m/s²``."""

import re
from decimal import Decimal
from functools import cache
from typing import Any

from .units import MECHANICAL, UNIT_LENGTH_MAX, parsed_unit

DEFINITIONS = f"""{MECHANICAL}@alias second = sec
inch = 0.0254 * metre = in = inches
minute = 60 * second = min
hour = 3600 * second = hr
ampere = [current] = A = amp
kelvin = [temperature] = K
degree_Celsius = kelvin; offset: 273.15 = degC
gram_force = 0.00980665 * newton = gf
pound_force = 4.4482216152605 * newton = lbf
bar = 100000 * pascal
volt = watt / ampere = V
ohm = volt / ampere = Ω
percent = 0.01 = pct
"""
COHERENT = ("1", "s", "m", "N", "V", "kg", "A", "Hz", "K", "rad", "Pa", "J", "W", "m/s", "m/s2",
            "N/m", "N.m", "rad/s", "kg.m2", "kg/m3", "V/m", "m/V", "ohm")  # fmt: skip
KNOWN = "m, in, g, s, min, hr, N, gf, lbf, Nm, Pa, bar, J, W, Hz, V, A, K, degC, rad, deg, % with "
KNOWN += "SI prefixes, joined as in m/s2 or N.m, and - for dimensionless numbers"
# Symbols that pint does not read or reads differently.
SYMBOLS = {"%": "pct", "°C": "degC", "-": "1", "": "1", "1": "1", "none": "1", "S": "s"}

_SUPERSCRIPTS = str.maketrans("¹²³⁴⁻", "1234-")


@cache
def _registry() -> Any:
    """Return pint's registry of these units, created at the first call."""
    import pint  # imported here because the import takes 0.3 s

    registry: Any = pint.UnitRegistry(
        None, non_int_type=Decimal, autoconvert_offset_to_baseunit=True
    )
    registry.load_definitions(DEFINITIONS.strip().splitlines())
    return registry


@cache
def _unit(text: str) -> Any:
    """Return pint's unit for a written unit, None if it is unknown."""
    written = text.strip().translate(_SUPERSCRIPTS)
    written = SYMBOLS.get(written, written)
    if written == "1":
        return _registry().parse_units("dimensionless")
    if len(text) > UNIT_LENGTH_MAX or not re.match(r"(1\s*/\s*)?[A-Za-zµμ°Ω]", written):
        return None
    powers = re.sub(r"(?<=[A-Za-zµμ°Ω])\^?(-?[0-9]+)", r"**\1", written)
    product = re.sub(r"\s*[·⋅.]\s*|(?<=[\wµμ°Ω])\s+(?=[A-Za-zµμ°Ω])", "*", powers)
    lowered = len(product) > 2 and product.isalpha()  # Names are read in lower case: Volts, Ohm.
    words = [product, product.lower()] if lowered else [product]
    units = (parsed_unit(_registry(), word) for word in words)
    return next((unit for unit in units if unit is not None), None)


def is_unit(text: str) -> bool:
    """Return whether a text is a known unit; ``-`` stands for a dimensionless number.

    Examples
    --------
    >>> is_unit("mm"), is_unit("Volts"), is_unit("m/s²"), is_unit("-"), is_unit("furlong")
    (True, True, True, True, False)
    """
    return _unit(text) is not None


def si_unit(text: str) -> str:
    """Return the name of the SI unit with the dimension of a known unit.

    Examples
    --------
    >>> si_unit("ms"), si_unit("°C"), si_unit("N/mm"), si_unit("%")
    ('s', 'K', 'N/m', '1')
    """
    measured = _unit(text).dimensionality
    for name in COHERENT:
        if _unit(name).dimensionality == measured:
            return name
    return "SI of " + text


def in_si(text: str) -> tuple[float, float]:
    """Return the factor and the offset that convert x in a known unit to SI, factor x + offset.

    Examples
    --------
    >>> in_si("ms"), in_si("°C"), in_si("mm/s")
    ((0.001, 0.0), (1.0, 273.15), (0.001, 0.0))
    """
    unit = _unit(text)
    mass = Decimal(1000) ** unit.dimensionality.get("[mass]", 0)  # the root unit is the gram
    zero, one = (
        _registry().Quantity(Decimal(x), unit).to_root_units().magnitude / mass for x in (0, 1)
    )
    return float(one - zero), float(zero)


def same_dimension(unit: str, other: str) -> bool:
    """Return whether two known units have the same dimension.

    Examples
    --------
    >>> same_dimension("mm", "m"), same_dimension("mm", "N")
    (True, False)
    """
    return bool(_unit(unit).dimensionality == _unit(other).dimensionality)
