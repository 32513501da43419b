"""Parsers of values with uncertainties, free parameters and measured quantities."""

import re
from pathlib import Path

from ..analysis.fit import RECORD_UNITS, Free, Frequency
from ..base.errors import MechanismError, ParameterError
from ..base.names import unknown
from ..data.uncertainty import Estimate
from ..files.settings import PERCENT, UserMistake, has_unit, quantity, without_exponent
from ..files.units import si_unit
from ..mechanism.description import Mechanism

PLUS_MINUS = re.compile(r"\s*(?:\+\s*+(?:/\s*+)?-|±)\s*")
WHERE = re.compile(
    r"(?P<value>.*?)(?:(?<!\s)\s+mode\s+(?P<mode>\d{1,9}))?(?:(?<!\s)\s+at\s+(?P<at>.+))?(?<!\s)\s*",
    re.DOTALL,
)


def estimate(text: str, unit: str, option: str) -> Estimate:
    """Read a value with its standard uncertainty, which is 0 if not given.

    Raises
    ------
    UserMistake
        If the text is not a value with at most one uncertainty.

    Examples
    --------
    >>> print(estimate("4.82 Hz +- 0.06", "Hz", "--frequency"))
    4.820 ± 0.060 Hz
    >>> print(estimate("40 ± 0.05 mm", "m", "--length"))
    0.040000 ± 0.000050 m
    >>> round(estimate("0.1 mm +- 0.5 %", "m", "--thickness").relative, 12)
    0.005
    """
    parts = PLUS_MINUS.split(text.strip())
    if len(parts) == 1:
        return Estimate(quantity(text, unit, option), 0.0, unit)
    if len(parts) > 2:
        raise UserMistake(
            f"{option} {text}: write a value and one uncertainty, for instance 4.82 +- 0.06"
        )
    value, u = parts
    share = PERCENT.fullmatch(u)
    if share and unit:
        x = quantity(value, unit, option)
        return Estimate(x, abs(x) * quantity(u, "", option), unit)
    own, of_u = (re.search(r"[A-Za-zµμ°].*", without_exponent(part)) for part in parts)
    if own and not of_u:
        u = f"{u} {own[0]}"
    elif of_u and not own:
        value = f"{value} {of_u[0]}"
    spread = quantity(u, unit, option)
    if spread < 0.0:
        raise UserMistake(f"{option} {text}: the uncertainty must not be negative")
    return Estimate(quantity(value, unit, option), spread, unit)


def free(mechanism: Mechanism, text: str) -> Free:
    """Read a free parameter of a fit, NAME or NAME=LOW:HIGH.

    Raises
    ------
    UserMistake
        If the bounds are invalid.
    ParameterError
        If there is no such parameter.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> free(load("PRBDM"), "stop.position=-1 mm : 1 mm")
    Free(name='stop.position', lower=-0.001, upper=0.001, start=None)
    """
    name, equals, limits = (part.strip() for part in text.partition("="))
    units = RECORD_UNITS | {p.name: p.unit for p in mechanism.parameters}
    if name not in units:
        raise ParameterError(f"--free {text}: {unknown(name, units)}")
    if not equals:
        return Free(name)
    ends = limits.split(":")
    if len(ends) != 2:
        raise UserMistake(f"--free {text}: write bounds as {name}=LOW:HIGH")
    last = re.search(r"[A-Za-zµμ°].*", without_exponent(ends[1]))
    if last and not has_unit(ends[0]):
        ends[0] = f"{ends[0].strip()} {last[0]}"
    low, high = (quantity(end, units[name], f"--free {name}=") for end in ends)
    if not low < high:
        raise UserMistake(f"--free {text}: the lower bound must be below the upper bound")
    return Free(name, low, high)


def frequency(text: str) -> Frequency:
    """Read a measured natural frequency, VALUE +- U [mode N] [at DISPLACEMENT].

    Raises
    ------
    UserMistake
        If a quantity is invalid or the uncertainty is missing.
    EvaluationError
        If the frequency, its uncertainty or the number of the mode is not positive.

    Examples
    --------
    >>> one = frequency("130.7 Hz +- 0.5 mode 2 at -10 mm")
    >>> one.mode, one.displacement, one.frequency.value
    (2, -0.01, 130.7)
    """
    found = WHERE.fullmatch(text.strip())
    assert found is not None  # The pattern matches every text.
    value = estimate(found["value"], "Hz", "--frequency")
    if value.uncertainty == 0.0:
        raise UserMistake(
            f"--frequency {text}: add the standard uncertainty, for instance --frequency "
            f'"{value.value:g} Hz +- {0.01 * value.value:.1g}"; for a computed frequency, half of '
            "its last digit"
        )
    at = None if found["at"] is None else quantity(found["at"], "m", "--frequency ... at")
    return Frequency(value, int(found["mode"] or 1), at)


def measured(text: str) -> tuple[str, Estimate]:
    """Read NAME=VALUE+-U in any unit; return the name and the value with its uncertainty in SI.

    Raises
    ------
    UserMistake
        If the text has another form, or a unit is unknown.

    Examples
    --------
    >>> name, value = measured("frequency=4.82 Hz +- 0.06")
    >>> print(name, value)
    frequency 4.820 ± 0.060 Hz
    """
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise UserMistake(
            f"--measured {text}: write NAME=VALUE+-U, for instance "
            '"frequency 1 at rest=4.82 Hz +- 0.06"'
        )
    unit = ""
    for part in reversed(PLUS_MINUS.split(value)):
        unit = _si(part, f"--measured {text}") or unit
    return name, estimate(value, unit, f"--measured {name}=")


def _si(text: str, option: str) -> str:
    """Return the SI unit of the dimension of a quantity."""
    try:
        return si_unit(text)
    except MechanismError as error:
        raise UserMistake(f"{option}: {error}") from None


def pair(text: str, option: str) -> tuple[str, str]:
    """Read NAME=TEXT.

    Raises
    ------
    UserMistake
        If the name or the equals sign is missing.

    Examples
    --------
    >>> pair("x = mm", "--unit")
    ('x', 'mm')
    """
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals):
        raise UserMistake(f"{option} {text}: write NAME=TEXT, for instance {option} x=mm")
    return name, value


def stem(path: str) -> str:
    """Return the name of a file without folder and suffix, for the names of output files.

    Examples
    --------
    >>> stem("data/free.csv")
    'free'
    """
    return Path(path).stem
