"""The variables and start values that Python and native FMUs of a mechanism have in common."""

from collections.abc import Mapping

from ..hybrid.configuration import Magnitudes
from ..hybrid.simulation import Simulation
from ..interface.variables import Number, Variable, variables, with_starts
from ..mechanism.description import Mechanism


def start_sample(mechanism: Mechanism, changes: Mapping[str, float]) -> dict[str, Number]:
    """Return all outputs at the start by name.

    Raises
    ------
    PrbmError
        If the mechanism cannot start with these start values.
    """
    return dict(Simulation(mechanism, changes).outputs())


def magnitudes(mechanism: Mechanism, changes: Mapping[str, float]) -> Magnitudes:
    """Return typical magnitudes of the motion from the start."""
    return Simulation(mechanism, changes).magnitudes()


def interface(mechanism: Mechanism, changes: Mapping[str, float]) -> tuple[Variable, ...]:
    """Return the variables that every FMU of a mechanism has, with changed start values.

    Raises
    ------
    PrbmError
        If the mechanism cannot start, or ``changes`` has a name that is not a parameter or input.
    """
    plain = variables(mechanism, start_sample(mechanism, {}))
    changed = with_starts(plain, changes)
    start_sample(mechanism, changes)
    return changed
