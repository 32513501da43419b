"""Round numbers with units, as a person writes them."""

from ..base.unit_text import length_unit

DIGITS_MAX = 12  # Decimals of a number in its unit.
WRITTEN = {"µm": "um"}


class Unit:
    """The unit of lengths of a file, and the accuracy of its numbers.

    Parameters
    ----------
    size : float
        Size of the mechanism, from which the unit follows [m].
    tolerance : float
        Largest rounding [m].

    Examples
    --------
    >>> unit = Unit(0.1, 1e-6)
    >>> unit.text(0.0399998), unit.text(1e-9), unit.text(0.0123456)
    ('"40 mm"', '0', '"12.346 mm"')
    """

    def __init__(self, size: float, tolerance: float) -> None:
        self.factor, name = length_unit(size)
        self.name = WRITTEN.get(name, name)
        self.tolerance = tolerance

    def number(self, x: float, tolerance: float | None = None) -> float:
        """Return the roundest number within a tolerance of a length, in this unit."""
        limit = (self.tolerance if tolerance is None else tolerance) * self.factor
        return roundest(x * self.factor, limit)

    def text(self, x: float, tolerance: float | None = None) -> str:
        """Return a length [m] for a TOML file."""
        number = self.number(x, tolerance)
        return "0" if number == 0.0 else f'"{plain(number)} {self.name}"'

    def point(self, z: complex, tolerance: float | None = None) -> str:
        """Return a point for a TOML file."""
        return f"[{self.text(z.real, tolerance)}, {self.text(z.imag, tolerance)}]"


def roundest(x: float, tolerance: float) -> float:
    """Return the number with the fewest decimals within a tolerance.

    Examples
    --------
    >>> roundest(39.9998, 0.001), roundest(0.5004, 0.001), roundest(12.5, 0.0)
    (40.0, 0.5, 12.5)
    """
    for digits in range(DIGITS_MAX):
        rounded = round(x, digits)
        if abs(rounded - x) <= tolerance:
            return rounded + 0.0
    return x


def plain(x: float) -> str:
    """Return a number without an exponent and without trailing zeros.

    Examples
    --------
    >>> plain(40.0), plain(1e-5), plain(-0.25)
    ('40', '0.00001', '-0.25')
    """
    return f"{x:.{DIGITS_MAX}f}".rstrip("0").rstrip(".")
