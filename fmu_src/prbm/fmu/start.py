"""The variables and start values that Python and native FMUs of a mechanism have in common."""

from collections.abc import Mapping
from dataclasses import dataclass

from ..hybrid.configuration import Magnitudes
from ..hybrid.simulation import Simulation
from ..interface.variables import Number, Variable, variables, with_starts
from ..mechanism.description import Mechanism


@dataclass(frozen=True)
class Start:
    """The start of a mechanism.

    Parameters
    ----------
    variables : tuple of Variable
        The variables that every FMU of the mechanism has, with changed start values.
    defaults, sample : mapping
        All outputs at the start by name: without the changes, and with them.
    magnitudes : Magnitudes
        Typical magnitudes of the motion from the changed start.
    """

    variables: tuple[Variable, ...]
    defaults: Mapping[str, Number]
    sample: Mapping[str, Number]
    magnitudes: Magnitudes


def start(mechanism: Mechanism, changes: Mapping[str, float]) -> Start:
    """Return the start of a mechanism with changed start values.

    Raises
    ------
    PrbmError
        If the mechanism cannot start, or ``changes`` has a name that is not a parameter or input.
    """
    plain = Simulation(mechanism, {})
    defaults = plain.outputs()
    changed = with_starts(variables(mechanism, defaults), changes)
    motion = Simulation(mechanism, changes) if changes else plain
    return Start(changed, defaults, motion.outputs(), motion.magnitudes())


def interface(mechanism: Mechanism, changes: Mapping[str, float]) -> tuple[Variable, ...]:
    """Return the variables that every FMU of a mechanism has, as :func:`start`."""
    return start(mechanism, changes).variables
