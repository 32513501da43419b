"""A mechanism simulated without an FMU, with the result that FMPy would give for one."""

import math
from collections.abc import Callable, Mapping

from ..base.errors import ParameterError
from ..base.progress import Progress
from ..hybrid.simulation import Simulation
from ..mechanism.description import Mechanism
from .result import Result, structured

Source = Callable[[float], Mapping[str, float]]
MOST_ROWS = 10_000_000  # more communication points than this are a mistake in the units of step
ROUND_OFF = 1e-9  # of a communication step: a last step shorter than this is none


def simulate(
    mechanism: Mechanism,
    values: Mapping[str, float] | None = None,
    stop_time: float = 1.0,
    step: float = 1e-3,
    tolerance: float | None = None,
    source: Source | None = None,
    progress: Progress | None = None,
) -> Result:
    """Simulate a mechanism from its release.

    Parameters
    ----------
    mechanism : Mechanism
        What moves.
    values : mapping
        Parameters and inputs that differ from their defaults.
    stop_time, step : float
        Duration and distance of the communication points [s]; the last step may be shorter.
    tolerance : float or None
        Relative tolerance of the integration; None: ``solver.tolerance``.
    source : callable or None
        Gives inputs and tunable parameters by name for the step that begins at a time [s].
    progress : callable or None
        Told the fraction that is done, from 0 to 1.

    Returns
    -------
    Result
        An input stands in the row at which it begins to act.

    Raises
    ------
    ParameterError
        If a name is unknown, a value out of bounds or there is no step to take.
    EquilibriumError, SimulationError
        As :class:`prbm.Simulation` does.
    """
    times = communication_points(stop_time, step)
    simulation = Simulation(mechanism, values, tolerance=tolerance)
    simulation.record = []
    start = {**simulation.values, **simulation.given}
    rows = []
    for k, t in enumerate(times):
        simulation.advance(t)
        outputs = simulation.outputs()
        if source is not None:
            simulation.set(source(t))
        rows.append({"time": t, **simulation.given, **outputs})
        if progress is not None:
            progress(k / (len(times) - 1))
    return Result(mechanism, start, structured(rows), tuple(simulation.record))


def communication_points(stop_time: float, step: float) -> list[float]:
    """Return 0, step, 2 step, ... up to the stop time [s].

    Raises
    ------
    ParameterError
        If that is not a finite number of steps forwards.

    Examples
    --------
    >>> communication_points(1.0, 0.4)
    [0.0, 0.4, 0.8, 1.0]
    """
    for name, value in (("stop_time", stop_time), ("step", step)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"{name} = {value:g} s must be positive and finite")
    steps = math.ceil(stop_time / step - ROUND_OFF)
    if steps > MOST_ROWS:
        raise ParameterError(
            f"step = {step:g} s makes {steps} steps in {stop_time:g} s: choose a larger one"
        )
    return [*(k * step for k in range(max(steps, 1))), stop_time]
