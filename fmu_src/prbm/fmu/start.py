"""What every flavour of FMU of a mechanism begins with: its variables and their start values."""

from collections.abc import Mapping

from ..hybrid.simulation import Simulation
from ..interface.variables import Number, Variable, variables, with_starts
from ..mechanism.description import Mechanism


def start_sample(mechanism: Mechanism, changes: Mapping[str, float]) -> dict[str, Number]:
    """Return all outputs at the start, which also shows that the mechanism can start.

    Raises
    ------
    PrbmError
        If it cannot, with these start values.
    """
    return dict(Simulation(mechanism, changes).outputs())


def magnitudes(mechanism: Mechanism, changes: Mapping[str, float]) -> tuple[float, float, float]:
    """Return what angles [rad], rates [rad/s] and energies [J] are measured against."""
    return Simulation(mechanism, changes).magnitudes()


def interface(mechanism: Mechanism, changes: Mapping[str, float]) -> tuple[Variable, ...]:
    """Return the variables that every FMU of a mechanism has, with other start values.

    Raises
    ------
    PrbmError
        If the mechanism cannot start, or a start value names no parameter or input.
    """
    plain = variables(mechanism, start_sample(mechanism, {}))
    changed = with_starts(plain, changes)
    start_sample(mechanism, changes)
    return changed
