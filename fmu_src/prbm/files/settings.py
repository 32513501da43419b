"""Read quantities with units, and NAME=VALUE settings, from the options of a command."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from ..base.errors import MechanismError, ParameterError, PrbmError
from ..base.names import unknown
from ..base.text import comma_advice
from ..mechanics.inputs import input_units
from ..mechanism import parameters
from ..mechanism.description import Mechanism
from ..mechanism.parameters import Tolerance, by_name
from .units import contact_stiffness, number

PERCENT = re.compile(r"(.*\d)\s*%")
TOLERANCE = re.compile(r"(.*?)(?:\+-|\+/-|±)(.*?)(uniform)?", re.DOTALL)
UNIT_ALONE = re.compile(r"[A-Za-zµμ°][^=]*|1/.*")


class UserMistake(PrbmError, ValueError):
    """An option or an argument is invalid; the message gives the reason and a remedy."""


def quantity(text: str, unit: str, option: str) -> float:
    """Read a number, in SI if it has no unit.

    A dimensionless quantity may be given in per cent.

    Parameters
    ----------
    text : str
        Value of the option.
    unit : str
        Unit of the result, empty if dimensionless.
    option : str
        Name of the option, for messages.

    Raises
    ------
    UserMistake
        If the text is not a finite number, or its unit is unknown or has another dimension.

    Examples
    --------
    >>> quantity("-10 mm", "m", "--held"), quantity("-1e-2", "m", "--held")
    (-0.01, -0.01)
    """
    text = text.strip()
    try:
        value = float(text)
    except ValueError:
        if advice := comma_advice(text):
            raise UserMistake(f"{option} {text}: {advice}") from None
        percent = PERCENT.fullmatch(text) if not unit else None
        try:
            value = 0.01 * float(percent[1]) if percent else number(text, unit)
        except (MechanismError, ValueError) as error:
            raise UserMistake(f"{option} {text}: {error}") from None
    if not math.isfinite(value):
        raise UserMistake(f"{option} {text}: write a finite number{f' in {unit}' if unit else ''}")
    return value


def is_tolerance(text: str) -> bool:
    """Return whether a text is a value with a tolerance, or a tolerance.

    Examples
    --------
    >>> is_tolerance("0.1 mm +- 2 %"), is_tolerance("0.1 mm")
    (True, False)
    """
    return TOLERANCE.fullmatch(text) is not None


def tolerance(text: str, unit: str, option: str) -> tuple[float | None, Tolerance]:
    """Read a tolerance, ``+- 2 %`` or ``5 um uniform``, which may follow a value and ``+-``.

    Parameters
    ----------
    text, unit, option : str
        As for :func:`quantity`.

    Returns
    -------
    value, tolerance
        The value before ``+-``, or None.

    Raises
    ------
    UserMistake
        If the value or the half-width is invalid.

    Examples
    --------
    >>> tolerance("0.1 mm +- 2 %", "m", "--vary")
    (0.0001, Tolerance(half_width=0.02, relative=True, uniform=False))
    >>> tolerance("5 um uniform", "m", "--vary")
    (None, Tolerance(half_width=5e-06, relative=False, uniform=True))
    """
    found = TOLERANCE.fullmatch(text.strip() if is_tolerance(text) else f"+- {text.strip()}")
    assert found is not None
    middle, half, relative = found[1].strip(), found[2].strip(), found[2].strip().endswith("%")
    value = quantity(middle, unit, option) if middle else None
    try:
        width = quantity(half, "" if relative else unit, option)
        return value, Tolerance(width, relative, found[3] is not None)
    except ParameterError as error:
        raise UserMistake(f"{option} {text.strip()}: {error}") from None


def optional_quantity(text: str | None, unit: str, option: str) -> float | None:
    """Read a number as :func:`quantity` does; None for an option that is not given."""
    return None if text is None else quantity(text, unit, option)


def quantities(texts: Sequence[str], unit: str, option: str) -> list[float]:
    """Read quantities; a unit alone at the end applies to all numbers before it.

    Parameters
    ----------
    texts : sequence of str
        Values of the option.
    unit : str
        Unit of the results, empty if dimensionless.
    option : str
        Name of the option, for messages.

    Raises
    ------
    UserMistake
        If a quantity is invalid, or only some of the numbers other than 0 have a unit.

    Examples
    --------
    >>> quantities(["-10", "0", "10", "mm"], "m", "--heights")
    [-0.01, 0.0, 0.01]
    >>> quantities(["-10mm", "0", "1 cm"], "m", "--heights")
    [-0.01, 0.0, 0.01]
    """
    return [quantity(text, unit, option) for text in with_shared_unit(texts, option)]


def with_shared_unit(texts: Sequence[str], option: str) -> list[str]:
    """Return quantities as texts, in which a unit alone at the end is added to all numbers before.

    Raises
    ------
    UserMistake
        If only some of the numbers other than 0 have a unit.

    Examples
    --------
    >>> with_shared_unit(["1", "2", "kN/mm^1.5"], "--stiffness")
    ['1 kN/mm^1.5', '2 kN/mm^1.5']
    """
    given = [text.strip() for text in texts]
    if len(given) > 1 and UNIT_ALONE.fullmatch(given[-1]):
        last = given.pop()
        given = [x if has_unit(x) else f"{x} {last}" for x in given]
    bare = [x for x in given if not has_unit(x) and _nonzero(x)]
    if bare and len(bare) < sum(map(_nonzero, given)):
        raise UserMistake(
            f"{option} {' '.join(texts)}: {bare[0]} has no unit and others have one; write a unit "
            f"after every number, or one at the end for all"
        )
    return given


def stiffness(text: str, exponent: float, option: str) -> float:
    """Read a contact stiffness in N/m^exponent, in SI if it has no unit.

    Raises
    ------
    UserMistake
        If the text is not a finite number, or its unit is not a force over a length to the power of
        the exponent.

    Examples
    --------
    >>> stiffness("2 kN/m^1.5", 1.5, "--stiffness")
    2000.0
    """
    if exponent == 1.0:
        return quantity(text, "N/m", option)
    try:
        read = contact_stiffness(text, exponent) if has_unit(text) else text
    except MechanismError as error:
        raise UserMistake(f"{option}: {error}") from None
    return quantity(read, "", option) if isinstance(read, str) else read


def without_exponent(text: str) -> str:
    """Return a quantity without the exponent of its number, because the e in 1e-2 is not a unit.

    Examples
    --------
    >>> without_exponent("-1e-2 m")
    '-1 m'
    """
    return re.sub(r"(?<=[\d.])[eE][+-]?\d+", "", text)


def has_unit(text: str) -> bool:
    """Return whether a quantity has a unit.

    Examples
    --------
    >>> has_unit("1e-2"), has_unit("10mm")
    (False, True)
    """
    return re.search(r"[A-Za-zµμ°]", without_exponent(text)) is not None


def _nonzero(text: str) -> bool:
    """Return whether a text is other than a zero without a unit."""
    return re.fullmatch(r"[+-]?0*(?:\.0*)?", text) is None


def units_of(mechanism: Mechanism) -> dict[str, str]:
    """Return the units of the parameters and inputs of a mechanism by name.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> units = units_of(load("PRBDM"))
    >>> units["flexure.length"], units["force.moment"], units["base.acceleration.x"]
    ('m', 'N.m', 'm/s2')
    """
    return input_units(mechanism) | {p.name: p.unit for p in mechanism.parameters}


def in_si(
    mechanism: Mechanism, given: Mapping[str, float | str] | None, argument: str = "changes"
) -> dict[str, float]:
    """Return values of parameters and inputs with texts converted to numbers in SI.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    given : mapping or None
        Numbers in SI units, or texts with a unit, by name.
    argument : str
        Name of the argument, for messages.

    Raises
    ------
    ParameterError
        If the name of a text is unknown.
    UserMistake
        If a text is not a quantity of the right dimension.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> in_si(load("PRBDM"), {"release.displacement": "-10 mm", "stop.restitution": 0.5})
    {'release.displacement': -0.01, 'stop.restitution': 0.5}
    """
    units = units_of(mechanism)
    result: dict[str, float] = {}
    for name, x in by_name(argument, given).items():
        if isinstance(x, str):
            if name not in units:
                raise ParameterError(unknown(name, units))
            x = quantity(x, units[name], f"{name} =")
        result[name] = x
    return result


def in_unit(name: str, value: Any, unit: str) -> float:
    """Return a number in a unit, from a number in this unit or a text with a unit.

    Raises
    ------
    ParameterError
        If the value is neither a number nor a text.
    UserMistake
        If a text is not a quantity of the right dimension.

    Examples
    --------
    >>> in_unit("step", "20 ms", "s"), in_unit("step", 0.1, "s")
    (0.02, 0.1)
    """
    if isinstance(value, str):
        return quantity(value, unit, f"{name} =")
    try:
        return parameters.number(name, value, unit)
    except ParameterError as error:
        raise ParameterError(f'{error}, or a text, "1 {unit}"' if unit else str(error)) from None


def settings(mechanism: Mechanism, texts: Sequence[str]) -> dict[str, float]:
    """Read NAME=VALUE pairs of parameters and inputs of a mechanism.

    Raises
    ------
    UserMistake
        If a text is not such a pair, or its value is invalid.
    ParameterError
        If a parameter or input is unknown.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> settings(load("PRBDM"), ["stop.restitution=0.5", "release.displacement = -10 mm"])
    {'stop.restitution': 0.5, 'release.displacement': -0.01}
    """
    return assigned(units_of(mechanism), texts)


def pairs(texts: Sequence[str], option: str, example: str) -> dict[str, str]:
    """Split NAME=VALUE pairs.

    Parameters
    ----------
    texts : sequence of str
        Values of the option.
    option, example : str
        Name of the option and an example of a pair, for messages.

    Raises
    ------
    UserMistake
        If a text is not such a pair, or a name is given twice.

    Examples
    --------
    >>> pairs(["force.x = sine(1 N, 5 Hz, phase=1)"], "--input", "")
    {'force.x': 'sine(1 N, 5 Hz, phase=1)'}
    """
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise UserMistake(f"{option} {text}: write NAME=VALUE, for instance {example}")
        if name in found:
            raise UserMistake(f"{option} {text}: {name} is given twice; remove one of them")
        found[name] = value
    return found


def assigned(units: Mapping[str, str], texts: Sequence[str]) -> dict[str, float]:
    """Read NAME=VALUE pairs of variables with given units.

    Raises
    ------
    UserMistake
        If a text is not such a pair, or its value is invalid.
    ParameterError
        If a variable is unknown.

    Examples
    --------
    >>> assigned({"angle": "rad", "gain": ""}, ["angle=180 deg", "gain=50 %"])
    {'angle': 3.141592653589793, 'gain': 0.5}
    """
    found = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise UserMistake(
                f"--set {text}: write NAME=VALUE, for instance --set stop.restitution=0.5 or --set "
                '"release.displacement=-10 mm"'
            )
        if name not in units:
            raise ParameterError(f"--set {text}: {unknown(name, units)}")
        found[name] = quantity(value, units[name], f"--set {name}=")
    return found
