"""The mechanism of a command line, put together."""

import argparse

from ..files.mechanism_file import load
from ..files.settings import UserMistake, settings
from ..mechanics.assembly import assemble
from ..mechanics.system import System
from ..mechanism.description import Mechanism

ROUNDING = 1e-9  # of its scale: what a computation leaves of zero


def assembled(options: argparse.Namespace) -> tuple[Mechanism, dict[str, float], System]:
    """Return the mechanism, what --set changes, and the system that they make."""
    mechanism = load(options.mechanism)
    values = settings(mechanism, options.set)
    own = {p.name for p in mechanism.parameters}
    for name in values:
        if name not in own:
            raise UserMistake(
                f"--set {name}: it is an input, which acts while the mechanism moves: "
                "prbm simulate takes it"
            )
    return mechanism, values, assemble(mechanism, mechanism.values(values))


def check_length(x: float, size: float, option: str) -> float:
    """Return a length that is not larger than the mechanism.

    Raises
    ------
    UserMistake
        If it is: its unit was forgotten, or is another one.
    """
    if abs(x) > size:
        raise UserMistake(
            f"{option} {x:g} m is more than the whole mechanism, {size:.3g} m: check the unit, as "
            f"in {option} {x:g}mm"
        )
    return x


def tiny(x: float, scale: float, form: str = ".6g") -> str:
    """Return a number, what rounding leaves of zero as zero.

    Examples
    --------
    >>> tiny(12.5, 1.0), tiny(-1e-14, 1.0)
    ('12.5', '0')
    """
    return format(x, form) if abs(x) > ROUNDING * scale else "0"
