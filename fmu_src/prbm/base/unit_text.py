"""Display units, chosen so that a value has few digits before the decimal point."""

GRAVITY = 9.80665  # Standard gravity, the unit g of an acceleration [m/s^2].
PASCALS_MAX = 1e4  # Larger stresses are shown in MPa [Pa].


def length_unit(size: float) -> tuple[float, str]:
    """Return factor and name of the display unit of a length [m].

    Examples
    --------
    >>> length_unit(0.08), length_unit(3e-4)
    ((1000.0, 'mm'), (1000000.0, 'µm'))
    """
    for factor, name in ((1.0, "m"), (1e3, "mm"), (1e6, "µm")):
        if size * factor >= 2.0:
            return factor, name
    return 1e9, "nm"


def stiffness_unit(exponent: float) -> str:
    """Return the SI unit of a contact stiffness, force over indentation^exponent.

    Examples
    --------
    >>> stiffness_unit(1.0), stiffness_unit(1.5)
    ('N/m', 'N/m^1.5')
    """
    return "N/m" if exponent == 1.0 else f"N/m^{exponent:g}"


def frequency_unit(frequency: float) -> tuple[float, str]:
    """Return factor and name of the display unit of a frequency [Hz].

    Examples
    --------
    >>> frequency_unit(1298.0), frequency_unit(92086.0)
    ((1.0, 'Hz'), (0.001, 'kHz'))
    """
    for factor, name in ((1.0, "Hz"), (1e-3, "kHz"), (1e-6, "MHz")):
        if abs(frequency) * factor < 1e4:
            return factor, name
    return 1e-9, "GHz"


def frequency_text(frequency: float, digits: int = 4) -> str:
    """Return a frequency [Hz] with its display unit.

    Examples
    --------
    >>> frequency_text(4.957), frequency_text(92086.3), frequency_text(12345.0, 5)
    ('4.957 Hz', '92.09 kHz', '12.345 kHz')
    """
    factor, name = frequency_unit(frequency)
    return f"{factor * frequency:.{digits}g} {name}"


def mode_text(frequency: float, rounding: float = 0.0, digits: int = 4) -> str:
    """Return the frequency [Hz] of a mode with its unit and all digits, or a word.

    Parameters
    ----------
    frequency : float
        The frequency; negative if the mode is unstable.
    rounding : float
        Frequency below which it is round-off: the mode is free.
    digits : int
        Number of digits.

    Examples
    --------
    >>> mode_text(4.89), mode_text(92086.3), mode_text(-2.0), mode_text(1e-9, 1e-6)
    ('4.890 Hz', '92.09 kHz', 'unstable', 'free')
    """
    if frequency <= rounding:
        return "free" if frequency >= -rounding else "unstable"
    factor, name = frequency_unit(frequency)
    return f"{factor * frequency:#.{digits}g} {name}".replace(". ", " ")


def prefixed_unit(largest: float, unit: str) -> tuple[float, str]:
    """Return factor and name of the display unit of a quantity whose SI unit is ``unit``.

    ``largest`` is the largest magnitude that is to be displayed.

    Examples
    --------
    >>> prefixed_unit(0.8, "m/s"), prefixed_unit(0.017, "J"), prefixed_unit(0.0, "J")
    ((1.0, 'm/s'), (1000.0, 'mJ'), (1.0, 'J'))

    Stress and Young's moduli are in MPa:

    >>> prefixed_unit(2.2e8, "Pa")
    (1e-06, 'MPa')

    Dimensionless quantities have no prefix:

    >>> prefixed_unit(0.05, "1"), prefixed_unit(0.05, "")
    ((1.0, ''), (1.0, ''))
    """
    if unit in ("", "1"):
        return 1.0, ""
    if unit == "Pa" and largest >= PASCALS_MAX:
        return 1e-6, "MPa"
    if largest == 0.0:
        return 1.0, unit
    for factor, prefix in ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"), (1e12, "p")):
        if largest * factor >= 0.1:
            return factor, prefix + unit
    return 1e15, f"f{unit}"


def time_unit(span: float) -> tuple[float, str]:
    """Return factor and name of the display unit of a duration [s].

    Examples
    --------
    >>> time_unit(0.3), time_unit(4.0)
    ((1000.0, 'ms'), (1.0, 's'))
    """
    for factor, name in ((1.0, "s"), (1e3, "ms")):
        if span * factor >= 2.0:
            return factor, name
    return 1e6, "µs"
