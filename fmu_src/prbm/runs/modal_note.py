"""Whether the modal restitutions of a run are those of its rebounds."""

from collections.abc import Mapping

from ..hybrid.records import Impact
from ..mechanics.assembly import assemble
from ..mechanics.modal import first_acting, modes_at
from ..mechanics.system import System
from .hits import HITS_MAX
from .result import Result

ZERO_SHARE = 1e-9  # Smaller shares are round-off.
SHARE_MIN = 0.5  # Least share of the fundamental mode in the energy if R describes the rebound.


def modal_notes(result: Result) -> list[str]:
    """Return a line about the first impacts whose modal restitution says little; none if all do.

    The modal restitution R of an impact is the ratio of velocities of one mode.  Its magnitude is
    at most 1/sqrt(p), with the share p of this mode in the kinetic energy before the impact: with a
    small share, R may have any value.
    """
    mechanism = result.mechanism
    own = {p.name for p in mechanism.parameters}
    values: Mapping[str, float] = {n: x for n, x in result.start_values.items() if n in own}
    system = assemble(mechanism, values)
    found = {
        number: mode_before(system, impact)
        for number, impact in enumerate(result.impacts[:HITS_MAX], start=1)
    }
    weak = [number for number, (share, _) in found.items() if share < SHARE_MIN]
    if not weak:
        return []
    first = weak[0]
    share, stable = found[first]
    R = result.impacts[first - 1].latched.modal_restitution
    part = f"{100 * share:.2g}" if share > ZERO_SHARE else "0"
    cause = "had" if stable else "is unstable in that shape, differs from model to model and had"
    more = f"; nor do those of {', '.join(map(str, weak[1:]))}" if weak[1:] else ""
    return [
        f"{'modal restitution':21}{R:.3g} of impact {first} does not describe the rebound: its "
        f"mode {cause} {part} % of the energy; use the speeds{more}"
    ]


def mode_before(system: System, impact: Impact) -> tuple[float, bool]:
    """Return the share of the fundamental mode in the energy before an impact.

    Parameters
    ----------
    system : System
        The assembled mechanism.
    impact : Impact
        The impact.

    Returns
    -------
    share : float
        Share of the kinetic energy before the impact, from 0 to 1; 1 if nothing moves.
    stable : bool
        Whether the mode is stable in the shape of the impact, which need not be an equilibrium.
    """
    modes = modes_at(system, impact.q)
    energy = float(impact.before @ modes.M @ impact.before)
    if not len(modes.frequency) or not energy > 0.0:
        return 1.0, True
    k = first_acting(system, modes)
    share = float(modes.shape[:, k] @ modes.M @ impact.before) ** 2 / energy
    return share, bool(modes.frequency[k] >= -modes.rounding)
