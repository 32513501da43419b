"""Simulation of a mechanism without an FMU, with the columns that FMPy returns for one."""

import math
from collections.abc import Callable, Mapping

from ..base.errors import ParameterError
from ..base.progress import Progress
from ..hybrid.simulation import Simulation
from ..mechanism.description import Mechanism
from .experiment import experiment
from .result import Result, structured

Source = Callable[[float], Mapping[str, float]]
ROWS_MAX = 10_000_000  # More communication points are a mistake in the unit of the step.
LAST_STEP_RTOL = 1e-9  # A last step below this fraction of a communication step is round-off.


def simulate(
    mechanism: Mechanism,
    changes: Mapping[str, float] | None = None,
    *,
    stop_time: float | None = None,
    step: float | None = None,
    tolerance: float | None = None,
    source: Source | None = None,
    progress: Progress | None = None,
) -> Result:
    """Simulate a mechanism from its release.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    changes : mapping or None
        Parameters and inputs that differ from their defaults, in SI units.
    stop_time, step : float or None
        Duration and communication step [s]; None: those of the default experiment, for most
        mechanisms 1 s and 1 ms.  The last step may be shorter.
    tolerance : float or None
        Relative tolerance of the integration; None: ``solver.tolerance``.
    source : callable or None
        Function of time that returns inputs and tunable parameters by name, for the step that
        begins at that time [s].
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Returns
    -------
    Result
        The columns have one row per communication point.  The row of an input is the time from
        which it acts.

    Raises
    ------
    ParameterError
        If a name is unknown, a value is out of bounds, or a time is not positive.
    EquilibriumError, SimulationError
        As :class:`prbm.Simulation`.

    Examples
    --------
    >>> from prbm.files.mechanism_file import find
    >>> result = simulate(find("PRBDM"), {"stop.restitution": 0.5}, stop_time=0.05)
    >>> len(result["time"]), int(result["stop.impact_count"][-1])
    (51, 1)
    """
    if stop_time is None or step is None:
        default = experiment(mechanism, changes)
        stop_time = default.stop_time if stop_time is None else stop_time
        step = default.step if step is None else step
    times = communication_points(stop_time, step)
    simulation = Simulation(mechanism, changes, tolerance=tolerance)
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
        If a time is not positive and finite, or there are more than :data:`ROWS_MAX` steps.

    Examples
    --------
    >>> communication_points(1.0, 0.4)
    [0.0, 0.4, 0.8, 1.0]
    """
    for name, value in (("stop_time", stop_time), ("step", step)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"{name} = {value:g} s must be positive and finite")
    steps = math.ceil(stop_time / step - LAST_STEP_RTOL)
    if steps > ROWS_MAX:
        raise ParameterError(
            f"step = {step:g} s makes {steps} steps in {stop_time:g} s; choose a larger step"
        )
    return [*(k * step for k in range(max(steps, 1))), stop_time]
