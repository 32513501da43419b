"""Simulation of a mechanism without an FMU; the columns are those that FMPy returns for an FMU."""

import logging
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..base.errors import ParameterError, SimulationError
from ..base.progress import Progress
from ..files.settings import in_si, in_unit
from ..hybrid.configuration import replaced_tolerance
from ..hybrid.records import Impact
from ..mechanics.arrays import Real
from ..mechanism.description import Mechanism
from ..mechanism.parameters import by_name
from .driving import Driver
from .engine import Engine, simulation
from .experiment import experiment, experiment_of
from .inputs import Source as InputSource
from .inputs import check_wall, signals
from .result import Columns, Result, row_type
from .signals import after

Source = Callable[[float], Mapping[str, float]]
ROWS_MAX = 10_000_000  # Most communication points; a larger number is likely a wrong unit.
LAST_STEP_RTOL = 1e-9  # A last step below this fraction of a communication step is round-off.
EARLY_SHARE = 0.2  # Share of steps_max that is permitted at the beginning, with most impacts.

_log = logging.getLogger(__name__)


class SlowSimulationError(SimulationError):
    """A simulation takes more integration steps than permitted."""


def simulate(
    mechanism: Mechanism,
    changes: Mapping[str, float | str] | None = None,
    *,
    inputs: Mapping[str, InputSource] | None = None,
    stop_time: float | str | None = None,
    step: float | str | None = None,
    tolerance: float | None = None,
    source: Source | None = None,
    progress: Progress | None = None,
    steps_max: float | None = None,
    engine: str | None = None,
    observer: Callable[[Engine], None] | None = None,
) -> Result:
    """Simulate a mechanism from its release.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    changes : mapping or None
        Parameters and inputs that differ from their defaults: numbers in SI units, or texts with
        a unit, ``"-10 mm"``.
    inputs : mapping or None
        Inputs over time: texts such as ``"half-sine(500 g, 0.5 ms)"`` and the other forms of
        :func:`prbm.runs.inputs.signals`.
    stop_time, step : float, str or None
        Duration and communication step, numbers [s] or texts, ``"20 ms"``; None: those
        of the default experiment, for most mechanisms 1 s and 1 ms.  The last step may be shorter.
    tolerance : float or None
        Relative tolerance of the integration; None: ``solver.tolerance``.  A value above 1e-5 is
        replaced by 1e-5, with a warning in the log.
    source : callable or None
        Function of time that returns inputs and tunable parameters by name, for the step that
        begins at that time [s].
    progress : callable or None
        Called with the completed fraction, from 0 to 1.
    steps_max : float or None
        Largest number of integration steps; None: no limit.  Until the time t, a proportional
        part is permitted: t over the duration, or :data:`EARLY_SHARE` if that is more.
    engine : str or None
        ``"kernel"``, the C kernel, or ``"python"``, the specification, which is slower.  None: the
        kernel if it can be compiled.
    observer : callable or None
        Called with the simulation at each communication point.

    Returns
    -------
    Result
        The columns have one row per communication point.  The input of a row acts from the time of
        this row.

    Raises
    ------
    TypeError
        If the mechanism is a name or a path: load it first.
    ParameterError
        If a name is unknown, a value is not a number or out of bounds, a signal is invalid, a time
        is not positive, or the velocity of a wall is given and its displacement is constant.
    UserMistake
        If a text is not a quantity of the right dimension.
    EquilibriumError, SimulationError
        As :func:`prbm.Simulation`.
    SlowSimulationError
        If the simulation takes more integration steps than permitted.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load
    >>> result = simulate(load("PRBDM"), {"stop.restitution": 0.5}, stop_time=0.05)
    >>> len(result["time"]), int(result["stop.impact_count"][-1])
    (51, 1)
    >>> result = simulate(load("PRBDM"), {"release.displacement": "-10 mm"}, stop_time="20 ms")
    >>> result.start_values["release.displacement"], float(result["time"][-1])
    (-0.01, 0.02)
    >>> result = simulate(load("PRBDM"), inputs={"force.x": "step(1 N, 5 ms)"}, stop_time="20 ms")
    >>> result["force.x"][[4, 5]].tolist()
    [0.0, 1.0]
    """
    if not isinstance(mechanism, Mechanism):
        raise TypeError(f"mechanism = {mechanism!r} must be a Mechanism, as prbm.load returns")
    values = in_si(mechanism, changes)
    driver = Driver(signals(mechanism, by_name("inputs", inputs), values))
    values = {**values, **driver.values(0.0)}
    duration, spacing = (
        None if x is None else in_unit(name, x, "s")
        for name, x in (("stop_time", stop_time), ("step", step))
    )
    if tolerance is not None:
        tolerance = in_unit("tolerance", tolerance, "")
    motion = simulation(mechanism, values, tolerance=tolerance, engine=engine)
    default = experiment_of(motion)
    duration = default.stop_time if duration is None else duration
    spacing = default.step if spacing is None else spacing
    times = communication_points(duration, spacing)
    _check(motion, driver, source, times[-1], spacing, tolerance)
    impacts: list[Impact] = []
    motion.record = impacts
    start = {**motion.values, **motion.given}
    columns: Columns = np.empty(0)
    observe = observer or _ignore
    for k, t in enumerate(times):
        driver.advance(motion, t)
        if steps_max is not None:
            _check_steps(motion, steps_max, k / (len(times) - 1))
        outputs = motion.outputs()
        observe(motion)
        if source is not None:
            motion.set(source(t))
        row = {"time": t, **motion.given, **driver.values(t), **outputs}
        if k == 0:
            columns = np.empty(len(times), row_type(row))
        columns[k] = tuple(row.values())
        if progress is not None:
            progress(k / (len(times) - 1))
    return Result(mechanism, start, columns, tuple(impacts), motion.engine)


def sampled(
    mechanism: Mechanism,
    values: Mapping[str, float],
    names: Sequence[str],
    *,
    stop_time: float,
    step: float,
    inputs: Mapping[str, InputSource] | None = None,
    tolerance: float | None = None,
    engine: str | None = None,
    at_events: bool = False,
) -> tuple[dict[str, Real], tuple[Impact, ...]]:
    """Return outputs of a simulation, the same numbers as :func:`simulate`.

    It computes the outputs ``names`` only, and so takes hardly longer than the engine alone.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping
        Parameters and inputs that differ from their defaults, in SI.
    names : sequence of str
        Outputs and inputs.
    stop_time, step, inputs, tolerance, engine
        As for :func:`simulate`, in SI.
    at_events : bool
        Sample directly before and after each event, too.

    Returns
    -------
    columns : dict of (m,)
        ``time`` and the outputs.
    impacts : tuple of Impact
        All impacts.

    Raises
    ------
    ParameterError, EquilibriumError, SimulationError
        As :func:`simulate`.
    """
    times = communication_points(stop_time, step)
    driver = Driver(signals(mechanism, inputs or {}, values))
    start = {**values, **driver.values(0.0)}
    motion = simulation(mechanism, start, tolerance=tolerance, engine=engine)
    _check(motion, driver, None, times[-1], step, tolerance)
    given = {**motion.values, **motion.given}
    wanted = [name for name in names if name not in given and name != "time"]
    impacts: list[Impact] = []
    motion.record = impacts
    events: list[list[float]] = []
    sampler = _Sampler(motion, wanted, events if at_events else None)
    rows = sampler.driven(driver, times) if driver.signals else sampler.rows(times)
    table = np.column_stack((times, rows))
    if events:
        table = _in_order(np.array(events), table)
    columns = dict(zip(("time", *wanted), table.T, strict=True))
    columns |= {name: np.full(len(table), x) for name, x in given.items() if name in names}
    for name in driver.signals.keys() & set(names):
        signal = driver.signals[name]
        columns[name] = np.array([after(signal, t) for t in columns["time"].tolist()])
    return columns, tuple(impacts)


class _Sampler:
    """A motion whose outputs, and rows beside events unless None, are kept as it advances."""

    def __init__(
        self, motion: Engine, names: Sequence[str], events: list[list[float]] | None
    ) -> None:
        self.motion, self.names, self.events = motion, names, events
        self.set = motion.set
        self.last: Real = np.empty(0)

    def rows(self, times: Sequence[float]) -> Real:
        """Advance to each of several times [s], and return the outputs there."""
        return self.motion.sample(times, self.names, self.events)

    def advance(self, time: float) -> None:
        """Continue the motion to a time [s]."""
        self.last = self.rows([time])[0]

    def driven(self, driver: Driver, times: Sequence[float]) -> Real:
        """Advance with inputs over time, and return the outputs at several times [s]."""
        rows = np.empty((len(times), len(self.names)))
        for row, t in zip(rows, times, strict=True):
            driver.advance(self, t)
            row[:] = self.last
        return rows


def _in_order(events: Real, samples: Real) -> Real:
    """Return rows at events and samples in the order of their times, in their first column.

    Of events at one time, the row before the first one and that after the last one remain.

    Examples
    --------
    >>> events = np.array([[0.9, 1.0], [1.0, 2.0], [0.9, 3.0], [1.0, 4.0], [1.5, 5.0], [1.6, 6.0]])
    >>> _in_order(events, np.array([[0.0, 0.0], [1.0, 4.0]])).tolist()
    [[0.0, 0.0], [0.9, 1.0], [1.0, 4.0], [1.5, 5.0], [1.6, 6.0]]
    """
    times = np.maximum.accumulate(events[:, 0])
    rows = np.concatenate((np.column_stack((times, events[:, 1:])), samples))
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    last: Real = rows[np.append(np.diff(rows[:, 0]) > 0.0, True)]
    return last


def _check(
    motion: Engine,
    driver: Driver,
    source: Source | None,
    end: float,
    spacing: float,
    tolerance: float | None,
) -> None:
    """Check the effort and the walls of a motion at its start, and warn of what is unstable."""
    _warn(motion, motion.values["solver.tolerance"] if tolerance is None else tolerance)
    _check_effort(motion, spacing)
    _check_walls(motion, driver, source)
    driver.sample(motion.frequency, motion.tolerance, end)


def _check_walls(motion: Engine, driver: Driver, source: Source | None) -> None:
    """Reject constant velocities of walls that do not move; a source may move them."""
    if source is not None:
        return
    for stop in motion.mechanism.stops:
        velocity = f"{stop.name}.velocity"
        if motion.given[velocity] != 0.0:
            check_wall(velocity, motion.given, driver.signals)


def _ignore(motion: Engine) -> None:
    """Observe nothing."""


def _warn(motion: Engine, tolerance: float) -> None:
    """Log a tolerance that is replaced, and what is unstable at the start."""
    if replaced := replaced_tolerance(tolerance):
        _log.warning("%s", replaced)
    for sentence in motion.instability().sentences:
        _log.warning("%s", sentence)


def _check_effort(motion: Engine, spacing: float) -> None:
    """Reject a simulation that needs too many integration steps for a communication step.

    The check uses ``spacing`` [s], or the step of the default experiment if that is shorter.
    """
    try:
        motion.check_effort(spacing)
    except SimulationError:
        default = experiment(motion.mechanism, engine=motion.engine)
        motion.check_effort(min(spacing, default.step))


def _check_steps(motion: Engine, steps_max: float, fraction: float) -> None:
    """Reject a simulation that takes more steps than are permitted until a fraction of its end."""
    if motion.step_count > steps_max * max(fraction, EARLY_SHARE):
        raise SlowSimulationError(
            f"the simulation takes {motion.step_count} integration steps until t = "
            f"{motion.time:.6g} s; at most {steps_max:g} are permitted in total"
        )


def check_duration(name: str, value: float) -> None:
    """Check a duration [s].

    Raises
    ------
    ParameterError
        If it is not positive and finite.
    """
    if not (math.isfinite(value) and value > 0.0):
        raise ParameterError(f"{name} = {value:g} s must be positive and finite")


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
    check_duration("stop_time", stop_time)
    check_duration("step", step)
    steps = math.ceil(stop_time / step - LAST_STEP_RTOL)
    if steps > ROWS_MAX:
        raise ParameterError(
            f"step = {step:g} s makes {steps} steps in {stop_time:g} s; choose a larger step"
        )
    return [*(k * step for k in range(max(steps, 1))), stop_time]
