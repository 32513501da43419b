"""The displacement or rotation at which the released body is held: units and bounds."""

import math
from dataclasses import dataclass

from ..files.settings import UserMistake
from ..mechanics.system import System
from ..mechanism.description import Mechanism


@dataclass(frozen=True)
class HeldUnit:
    """Units of a held displacement, or of a held rotation if the release is by an angle.

    Parameters
    ----------
    amount, si : str
        Name of the amount, and its SI unit.
    factor, shown : float, str
        Factor and name of its printed unit.
    effort, si_effort, si_stiffness : str
        Name of the holding force or moment, its SI unit, and that of the stiffness.
    """

    amount: str
    si: str
    factor: float
    shown: str
    effort: str
    si_effort: str
    si_stiffness: str


DISPLACED = HeldUnit("displacement", "m", 1e3, "mm", "force", "N", "N/m")
TURNED = HeldUnit("rotation", "rad", 180 / math.pi, "deg", "moment", "N.m", "N.m/rad")
POINTS_MAX = 100_000  # Points of a curve.
TURN_MAX = 2 * math.pi  # rad; a larger held rotation is a mistake in the unit.


def held_unit(mechanism: Mechanism) -> HeldUnit:
    """Return the units of the displacement or rotation at which the released body is held."""
    return TURNED if mechanism.release.turns else DISPLACED


def held_scale(system: System) -> float:
    """Return the scale of held amounts: the size [m], or one radian."""
    return 1.0 if system.mechanism.release.turns else system.length


def check_held(x: float, system: System, option: str) -> float:
    """Return a displacement [m] or rotation [rad] at which the released body is held.

    Raises
    ------
    UserMistake
        If it is larger than the mechanism, or than a turn.
    """
    if not math.isfinite(x):
        raise UserMistake(f"{option} {x:g}: write a finite number")
    if not system.mechanism.release.turns:
        return check_length(x, system.length, option)
    if abs(x) > TURN_MAX:
        raise UserMistake(
            f"{option} {x:g} rad: more than a turn; check the unit, for instance {option} {x:g}deg"
        )
    return x


def check_length(x: float, size: float, option: str) -> float:
    """Return a length [m] if it is not larger than the mechanism.

    Raises
    ------
    UserMistake
        If it is larger: its unit is missing or wrong.
    """
    if abs(x) > size:
        raise UserMistake(
            f"{option} {x:g} m: more than the size of the mechanism, {size:.3g} m; check the unit, "
            f"for instance {option} {x:g}mm"
        )
    return x
