"""Duration and step of a simulation, as given on a command line or as suits the mechanism."""

from collections.abc import Mapping

from ..files.settings import quantity
from ..mechanism.description import Mechanism
from .experiment import Experiment, experiment


def span(
    mechanism: Mechanism,
    values: Mapping[str, float],
    stop_time: str | None,
    step: str | None = None,
) -> tuple[float, float]:
    """Return duration and step of a simulation [s], as given or as suits the mechanism.

    Raises
    ------
    UserMistake, ParameterError, EquilibriumError
        As :func:`quantity` and :func:`prbm.runs.experiment.experiment` do.

    Examples
    --------
    >>> from prbm.files.mechanism_file import find
    >>> span(find("PRBDM"), {}, None), span(find("PRBDM"), {}, "200 ms", "1e-4")
    ((1.0, 0.001), (0.2, 0.0001))
    """
    duration = None if stop_time is None else quantity(stop_time, "s", "--stop-time")
    if step is not None and duration is not None:
        return duration, quantity(step, "s", "--step")
    chosen = experiment(mechanism, values)
    if duration is None:
        duration, distance = chosen.stop_time, chosen.step
    else:
        distance = min(chosen.step, Experiment(duration).step) if duration > 0.0 else chosen.step
    return duration, distance if step is None else quantity(step, "s", "--step")
