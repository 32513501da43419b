"""Quantities with units, written by users, and the parameters and inputs that they set."""

import math
import re
from collections.abc import Mapping, Sequence

from ..base.errors import MechanismError, ParameterError, PrbmError
from ..base.names import unknown
from ..mechanics.inputs import input_units
from ..mechanism.description import Mechanism
from .units import number

PERCENT = re.compile(r"(.*\d)\s*%")
UNIT_ALONE = re.compile(r"[A-Za-zµμ°][^=]*|1/.*")


class UserMistake(PrbmError, ValueError):
    """A request of the user cannot be fulfilled; the message says why and names a remedy."""


def quantity(text: str, unit: str, what: str) -> float:
    """Read a number, which is in SI, or a number with a unit.

    Parameters
    ----------
    text : str
        As it was given.
    unit : str
        Of the result.
    what : str
        The option, for messages.

    Raises
    ------
    UserMistake
        If it is none, or measures something else.

    Examples
    --------
    >>> quantity("-10 mm", "m", "--held"), quantity("-1e-2", "m", "--held")
    (-0.01, -0.01)
    """
    text = text.strip()
    try:
        value = float(text)
    except ValueError:
        percent = PERCENT.fullmatch(text) if not unit else None
        try:
            value = 0.01 * float(percent[1]) if percent else number(text, unit)
        except (MechanismError, ValueError) as error:
            raise UserMistake(f"{what} {text}: {error}") from None
    if not math.isfinite(value):
        raise UserMistake(f"{what} {text}: write a finite number{f' in {unit}' if unit else ''}")
    return value


def quantities(texts: Sequence[str], unit: str, what: str) -> list[float]:
    """Read quantities; a unit that stands alone at the end is that of all numbers before it.

    Raises
    ------
    UserMistake
        If one is none, or some have a unit and others have none.

    Examples
    --------
    >>> quantities(["-10", "0", "10", "mm"], "m", "--heights")
    [-0.01, 0.0, 0.01]
    >>> quantities(["-10mm", "0", "1 cm"], "m", "--heights")
    [-0.01, 0.0, 0.01]
    """
    given = [text.strip() for text in texts]
    if len(given) > 1 and UNIT_ALONE.fullmatch(given[-1]):
        last = given.pop()
        given = [x if has_unit(x) else f"{x} {last}" for x in given]
    bare = [x for x in given if not has_unit(x) and _nonzero(x)]
    if bare and len(bare) < sum(map(_nonzero, given)):
        raise UserMistake(
            f"{what} {' '.join(texts)}: {bare[0]} has no unit and others have one: write a unit "
            f"after every number, or one at the end for all"
        )
    return [quantity(text, unit, what) for text in given]


def without_exponent(text: str) -> str:
    """Return a number without its power of ten, whose e is no unit.

    Examples
    --------
    >>> without_exponent("-1e-2 m")
    '-1 m'
    """
    return re.sub(r"(?<=[\d.])[eE][+-]?\d+", "", text)


def has_unit(text: str) -> bool:
    """Tell whether a unit stands in a quantity.

    Examples
    --------
    >>> has_unit("1e-2"), has_unit("10mm")
    (False, True)
    """
    return re.search(r"[A-Za-zµμ°]", without_exponent(text)) is not None


def _nonzero(text: str) -> bool:
    """Tell whether a quantity needs a unit: nothing is nothing in every unit."""
    return re.fullmatch(r"[+-]?0*\.?0*", text) is None


def units_of(mechanism: Mechanism) -> dict[str, str]:
    """Return the units of the parameters and inputs by their names.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> units = units_of(load("PRBDM"))
    >>> units["flexure.length"], units["force.moment"], units["base.acceleration.x"]
    ('m', 'N.m', 'm/s2')
    """
    return input_units(mechanism) | {p.name: p.unit for p in mechanism.parameters}


def settings(mechanism: Mechanism, texts: Sequence[str]) -> dict[str, float]:
    """Read NAME=VALUE pairs of parameters and inputs of a mechanism.

    Raises
    ------
    UserMistake
        If a text is no such pair.
    ParameterError
        If there is no such parameter or input.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> settings(load("PRBDM"), ["stop.restitution=0.5", "release.displacement = -10 mm"])
    {'stop.restitution': 0.5, 'release.displacement': -0.01}
    """
    return assigned(units_of(mechanism), texts)


def assigned(units: Mapping[str, str], texts: Sequence[str]) -> dict[str, float]:
    """Read NAME=VALUE pairs of variables with these units.

    Raises
    ------
    UserMistake
        If a text is no such pair.
    ParameterError
        If there is no such variable.

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
