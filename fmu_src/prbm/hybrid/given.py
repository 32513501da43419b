"""Checks of the values that a user gives to a simulation, for both engines."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..base.errors import ParameterError
from ..base.names import unknown
from ..mechanics.arrays import Real
from ..mechanics.inputs import check_input, input_names
from ..mechanism.description import Mechanism
from ..mechanism.parameters import by_name, finite

Values = dict[str, float]


def start_values(
    mechanism: Mechanism, changes: Mapping[str, float] | None, start_time: float
) -> tuple[Values, Values, float]:
    """Return the values of all parameters and of all inputs, and the time, at the start.

    Parameters
    ----------
    mechanism : Mechanism
        Description.
    changes : mapping or None
        Parameters and inputs that differ from their defaults.
    start_time : float
        Time at the start [s].

    Raises
    ------
    TypeError
        If the mechanism is a name or a path.
    ParameterError
        If a name is unknown, or a value is not a finite number or out of bounds.
    """
    if not isinstance(mechanism, Mechanism):
        raise TypeError(f"mechanism = {mechanism!r} must be a Mechanism, as prbm.load returns")
    given = dict.fromkeys(input_names(mechanism), 0.0)
    parameters = {p.name for p in mechanism.parameters}
    changes = by_name("values", changes)
    own = {name: x for name, x in changes.items() if name in parameters}
    values = mechanism.values(own)
    for name, x in changes.items():
        if name in given:
            given[name] = check_input(name, x, given)
        elif name not in parameters:
            raise ParameterError(unknown(name, {**values, **given}))
    return values, given, finite("start_time", start_time, "s")


def changed_values(
    mechanism: Mechanism,
    values: Mapping[str, float],
    given: Mapping[str, float],
    changes: Mapping[str, float],
) -> tuple[Values, Values]:
    """Return the values of all parameters and of all inputs after changes during the motion.

    Parameters
    ----------
    mechanism : Mechanism
        Description.
    values, given : mapping
        Values of all parameters and of all inputs before the changes.
    changes : mapping
        New values by name.

    Raises
    ------
    ParameterError
        If a name is unknown or belongs to a fixed parameter, or a value is out of bounds.
    """
    changes, known, inputs = by_name("changes", changes), dict(values), dict(given)
    only_inputs = changes.keys() <= inputs.keys()
    parameters = {} if only_inputs else {p.name: p for p in mechanism.parameters}
    for name, x in changes.items():
        if name in parameters:
            number = parameters[name].check(x)
            if not parameters[name].tunable and number != known[name]:
                raise ParameterError(
                    f"{name} is a fixed parameter; set it before the motion starts"
                )
            known[name] = number
        elif name in inputs:
            inputs[name] = check_input(name, x, inputs)
        else:
            raise ParameterError(unknown(name, {**parameters, **inputs}))
    return known, inputs


def checked_times(times: Sequence[float] | Real) -> Real:
    """Return times [s] as an array (m,).

    Raises
    ------
    ParameterError
        If they are not a list of numbers.
    """
    try:
        found = np.array(times, float)
    except (TypeError, ValueError):
        raise ParameterError(f"times = {times!r} must be a list of numbers in s") from None
    if found.ndim != 1:
        raise ParameterError(f"times have the shape {found.shape}: give a list of times in s")
    return found
