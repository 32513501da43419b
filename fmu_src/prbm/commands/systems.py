"""The mechanism of a command line and its assembled system."""

import argparse

from ..files.mechanism_file import load
from ..files.settings import UserMistake, settings
from ..mechanics.assembly import assemble
from ..mechanics.system import System
from ..mechanism.description import Mechanism

ZERO_RTOL = 1e-9  # Numbers below this fraction of their scale are round-off.


def assembled(options: argparse.Namespace) -> tuple[Mechanism, dict[str, float], System]:
    """Return the mechanism, the parameters given by --set, and the assembled system.

    Raises
    ------
    UserMistake
        If --set gives an input, which has no effect on an equilibrium.
    """
    mechanism = load(options.mechanism)
    values = settings(mechanism, options.set)
    own = {p.name for p in mechanism.parameters}
    for name in values:
        if name not in own:
            raise UserMistake(f"--set {name}: inputs act only in simulations; use prbm simulate")
    return mechanism, values, assemble(mechanism, mechanism.values(values))


def rounded(x: float, scale: float, form: str = ".6g") -> str:
    """Return a number as text; round-off relative to a scale becomes 0.

    Examples
    --------
    >>> rounded(12.5, 1.0), rounded(-1e-14, 1.0)
    ('12.5', '0')
    """
    return format(x, form) if abs(x) > ZERO_RTOL * scale else "0"
