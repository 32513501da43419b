"""The mode that sets the step of the integration, and the mass that it depends on most."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ..base.errors import EquilibriumError
from ..mechanics.assembly import assemble
from ..mechanics.modal import modes
from ..mechanics.statics import equilibrium
from ..mechanism.description import Mechanism

MASS_UNITS = ("kg", "kg/m3")
CHANGE = 1.01  # Factor of a mass, for the effect on a frequency.


class Fastest(NamedTuple):
    """The fastest mode at rest.

    Parameters
    ----------
    frequency : float
        Its frequency [Hz].
    parameter : str
        The mass or density that changes it most; empty if there is none.
    effect : float
        Relative change of the frequency over that of the parameter, with its sign reversed: 0.5 if
        all of the moving mass follows the parameter [-].
    """

    frequency: float
    parameter: str
    effect: float


def fastest(mechanism: Mechanism, values: Mapping[str, float]) -> Fastest | None:
    """Return the fastest mode about the equilibrium under gravity; None if there is no such shape.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping
        Values of parameters that differ from the defaults.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> found = fastest(load("PRBDM"), {})  # one mode; the flexures have mass, too
    >>> found.parameter, round(found.effect, 2)
    ('shuttle.mass', 0.41)
    """
    parameters = mechanism.values(dict(values))
    try:
        frequency = _highest(mechanism, parameters)
        if frequency == 0.0:
            return None
        effects = {
            p.name: -math.log(_highest(mechanism, changed) / frequency) / math.log(CHANGE)
            for p in mechanism.parameters
            if p.unit in MASS_UNITS
            for changed in [{**parameters, p.name: parameters[p.name] * CHANGE}]
        }
    except EquilibriumError:
        return None
    name = max(effects, key=lambda n: effects[n], default="")
    return Fastest(frequency, name, effects.get(name, 0.0))


def _highest(mechanism: Mechanism, parameters: Mapping[str, float]) -> float:
    system = assemble(mechanism, parameters)
    return float(modes(system, equilibrium(system)).frequency.max(initial=0.0))
