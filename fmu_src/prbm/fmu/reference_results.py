"""Reference results inside a native FMU: tables of three experiments, and how to compare.

The Python engine computes them, so they are independent of the C kernel.
"""

import copy
import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from typing import Any

from numpy.typing import NDArray

from ..base.errors import PrbmError
from ..base.progress import messages
from ..hybrid.simulation import Simulation
from ..interface.variables import BASE, Variable, with_starts
from ..mechanics.assembly import assemble
from ..mechanics.modal import modes_at
from ..mechanics.stress import stressed
from ..mechanism.description import Mechanism
from ..runs.engine import PYTHON
from ..runs.experiment import Experiment
from ..runs.result import names
from ..runs.run import SlowSimulationError, communication_points, simulate
from .parameter_sets import MIME_TYPE, parameter_set
from .related import Related

SLOW = "the default experiment takes the Python engine more than about half a minute"
DIGITS = 9  # Significant digits; the error of the engine is larger.
TIME_RTOL = 1e-14  # Communication points differ from decimal numbers by round-off.
STEPS_MAX = 1e5  # Integration steps that the Python engine takes in about half a minute.
CACHED_MAX = 32  # Results in memory: FMI 2.0 and 3.0 share them, mechanism by mechanism.
LARGE = 40  # With more coordinates, the Python engine takes fewer steps in half a minute.
STABLE_STEP_FACTOR = 3.0  # Largest stable step of an explicit method, in units of 1/omega.
SMOKE_STEPS = 10  # Communication steps of the smoke test.
VALIDATION_SHARE = 5  # The default experiment is this many times longer than the validation.
VALIDATION_RESTITUTION = 0.9  # Factor of the coefficients of restitution in the validation.
VALIDATION_ACCELERATION = 0.1  # Acceleration of the base in the validation, of the nominal one.
NEAR_IMPACT = 1e-3  # Of a step: rows nearer to an impact are not compared.
EXCHANGE_TOLERANCE = 1e-8  # Of the solver of the importing tool in model exchange.
COMPLIANT_TOLERANCE = 1e-9  # With compliant stops: forces follow small indentations.
SAME_TIME = 1e-6  # Of a step: largest difference of the times of an impact.
GUIDE = """\
Reference results of {name}

The Python engine has computed these tables. It is independent of the library of this FMU. Columns
are the time [s] and all outputs in SI units, with nine digits.

smoke test   {name}_smoke_out.csv: start values of the FMU, 0 to {smoke:g} s
default      {name}_out.csv: start values of the FMU, 0 to {stop:g} s
{validation}
Rows are {step:g} s apart, which is the communication step. Compare your results as follows.

1. Simulate with this communication step. In co-simulation keep the tolerance of the FMU; in model
   exchange use a relative tolerance of {tolerance:g}, and for each state an absolute one of this
   times its nominal value, as FMPy does.
2. Compare rows of equal time. Leave out rows within {near:g} s of an impact: outputs jump there.
3. Integer and Boolean outputs are equal. Differences of other outputs are at most 1e-5 (model
   exchange: 1e-3) of the largest magnitude in the column, or of a larger nominal value; the
   components x and y of a vector share the larger magnitude; of modal_restitution, a ratio of
   velocities that vanish in the last bounces, ten times as much.
   Without damping a motion can be chaotic: compare the time until the first impacts then.
"""
SAMPLED = """\
   In model exchange, peak_stress is sampled at the steps that your tool completes, and at events.
   Steps must be at most a twentieth of the period of the fastest vibration of the stress; with
   longer steps leave out peak_stress, its time and its position.
"""
VALIDATION = """\
validation   {name}_validation_out.csv: start values in {name}_validation.ssv, 0 to {end:g} s,
             with two additional rows of equal time at each impact: before it and after it
"""
AT_IMPACTS = """\
4. In event mode (FMI 3.0) your results have rows at impacts, too. The first and the last of them
   equal the two rows of the validation at this time, which may differ by {same:g} s.
"""


def reference(
    mechanism: Mechanism,
    changes: Mapping[str, float],
    variables: Iterable[Variable],
    experiment: Experiment,
    progress: Callable[[str], None] = lambda step: None,
) -> tuple[Related, ...]:
    """Return the reference results of three experiments, and a text on their comparison.

    They are the default experiment, its beginning as a smoke test, and a validation with other
    restitution and a constant acceleration of the base.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism to export.
    changes : mapping
        Start values of parameters and inputs that replace those of the mechanism.
    variables : iterable of Variable
        The variables of the FMU; its outputs are recorded.
    experiment : Experiment
        The default experiment.
    progress : callable
        Called with the remaining time, and with the reason if there are no results.

    Returns
    -------
    tuple of Related
        Empty if the default experiment fails, or takes the Python engine more than about half a
        minute.  The time is limited by a number of integration steps, so that every machine builds
        the same FMU.  Without the validation if that fails.
    """
    variables = tuple(variables)
    columns: NDArray[Any] | str = SLOW
    if steps(mechanism, changes, experiment) <= STEPS_MAX:
        cached = _Cached(mechanism, progress)
        columns = _columns(cached, tuple(changes.items()), experiment)
    if isinstance(columns, str):
        progress(f"no reference results: {columns}")
        return ()
    outputs = [v.name for v in variables if v.causality == "output" and v.name in names(columns)]
    name, stop, step = mechanism.name, experiment.stop_time, experiment.step
    smoke = columns[: SMOKE_STEPS + 1]
    validation = _validation(mechanism, changes, variables, experiment, outputs)
    more = VALIDATION.format(name=name, end=stop / VALIDATION_SHARE) if validation else ""
    compliant = any(stop.compliant for stop in mechanism.stops)
    parts = GUIDE, SAMPLED if stressed(mechanism) else "", AT_IMPACTS if validation else ""
    text = "".join(parts).format(
        name=name, stop=stop, step=step, smoke=float(smoke["time"][-1]), validation=more,
        near=NEAR_IMPACT * step, same=SAME_TIME * step,
        tolerance=COMPLIANT_TOLERANCE if compliant else EXCHANGE_TOLERANCE,
    )  # fmt: skip
    about = f"(0 to {stop:g} s, communication step {1e3 * step:g} ms)"
    return (
        Related("README.txt", text.encode(), "text/plain", "document",
                "Reference results: experiments, and how to compare"),
        Related(f"{name}_out.csv", _table(columns, outputs), "text/csv", "result",
                f"Outputs of the default experiment {about}, computed by the Python engine"),
        Related(f"{name}_smoke_out.csv", _table(smoke, outputs), "text/csv", "result",
                f"Outputs of a smoke test: {SMOKE_STEPS} steps of the default experiment"),
        *validation,
    )  # fmt: skip


def _validation(
    mechanism: Mechanism,
    changes: Mapping[str, float],
    variables: tuple[Variable, ...],
    experiment: Experiment,
    outputs: list[str],
) -> tuple[Related, ...]:
    """Return the start values and the results of the validation; empty if it fails."""
    base = f"{BASE}.acceleration.x"
    nominal = next((v.nominal for v in variables if v.name == base), None)
    defaults = mechanism.values()
    values = {**defaults, **changes}
    other = {
        name: float(f"{VALIDATION_RESTITUTION * values[name]:.6g}")
        for name in (f"{stop.name}.restitution" for stop in mechanism.stops)
        if name in values
    }
    chosen = {**changes, **other, base: VALIDATION_ACCELERATION * (nominal or 0.0)}
    table = _validation_table(_Cached(mechanism), tuple(chosen.items()), experiment, tuple(outputs))
    if table is None:
        return ()
    started = with_starts(variables, chosen)
    given = [name for name in chosen if name not in defaults]
    name, end = mechanism.name, experiment.stop_time / VALIDATION_SHARE
    return (
        Related(f"{name}_validation.ssv", parameter_set(mechanism, started, "validation", given),
                MIME_TYPE, "parameter", "Start values of the validation"),
        Related(f"{name}_validation_out.csv", table, "text/csv", "result",
                f"Outputs of the validation (0 to {end:g} s), with rows before and after each "
                "impact, computed by the Python engine"),
    )  # fmt: skip


@lru_cache(maxsize=CACHED_MAX)
def _validation_table(
    cached: "_Cached",
    values: tuple[tuple[str, float], ...],
    experiment: Experiment,
    outputs: tuple[str, ...],
) -> bytes | None:
    """Return the results of the validation as a table; None if the simulation fails."""
    times = communication_points(experiment.stop_time / VALIDATION_SHARE, experiment.step)
    try:
        motion = Simulation(cached.mechanism, dict(values))
        rows = list(rows_with_impacts(motion, times, outputs))
    except PrbmError:
        return None
    return _csv(["time", *outputs], rows)


def rows_with_impacts(
    motion: Simulation, times: Iterable[float], outputs: Iterable[str]
) -> Iterator[tuple[float, ...]]:
    """Yield the time and outputs at each of several times, and two rows at each impact.

    Both rows have the time of the impact; the first has the outputs before it.  An impact at one of
    the times has two rows there instead of one.

    Raises
    ------
    SimulationError
        As :meth:`prbm.hybrid.simulation.Simulation.advance`.
    SlowSimulationError
        If the simulation takes more than :data:`STEPS_MAX` steps.
    """
    chosen = tuple(outputs)

    def row(simulation: Simulation, t: float) -> tuple[float, ...]:
        shown = simulation.outputs()
        return (t, *(float(shown[name]) for name in chosen))

    for t in times:
        # A copy returns to the impacts, since the motion does not depend on communication points.
        earlier = copy.copy(motion)
        earlier.record, motion.record = None, []
        motion.advance(t)
        if motion.step_count > STEPS_MAX:
            raise SlowSimulationError(
                f"more than {STEPS_MAX:g} integration steps until t = {t:g} s"
            )
        struck = sorted({impact.time for impact in motion.record})
        for at in struck:
            earlier.advance(math.nextafter(at, -math.inf))
            yield row(earlier, at)
            earlier.advance(at)
            yield row(earlier, at)
        if t not in struck:
            yield row(motion, t)


def steps(mechanism: Mechanism, changes: Mapping[str, float], experiment: Experiment) -> float:
    """Return an estimate of the number of engine steps in an experiment, from the fastest mode.

    An explicit step is stable up to a few units of 1/omega and, with stiffness-proportional
    damping, of 1/(beta omega^2).  The estimate uses frequencies instead of a measured time, so
    that every build of an FMU gives the same bytes.
    """
    simulation = Simulation(mechanism, changes)
    system, n = simulation.system, simulation.system.n
    omega = (
        2
        * math.pi
        * float(abs(modes_at(system, simulation.state()[:n]).frequency).max(initial=0.0))
    )
    fastest = max(omega, simulation.values["damping.beta"] * omega**2)
    return experiment.stop_time * fastest / STABLE_STEP_FACTOR


class _Cached:
    """A mechanism that is hashed by its identity, with a callback that does not enter the hash."""

    def __init__(
        self, mechanism: Mechanism, progress: Callable[[str], None] = lambda step: None
    ) -> None:
        self.mechanism, self.progress = mechanism, progress

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Cached) and self.mechanism is other.mechanism

    def __hash__(self) -> int:
        return id(self.mechanism)


@lru_cache(maxsize=CACHED_MAX)
def _columns(
    cached: _Cached, changes: tuple[tuple[str, float], ...], experiment: Experiment
) -> NDArray[Any] | str:
    """Return the result of the default experiment, or the reason why there is none.

    The FMUs of one export share it.
    """
    mechanism = cached.mechanism
    size = assemble(mechanism, mechanism.values()).n
    try:
        result = simulate(
            mechanism, dict(changes), stop_time=experiment.stop_time, step=experiment.step,
            engine=PYTHON,
            steps_max=STEPS_MAX / max(1.0, size / LARGE) ** 2,
            progress=messages(lambda text: cached.progress(f"reference results {text}")),
        )  # fmt: skip
    except SlowSimulationError:
        return SLOW
    except PrbmError:
        return "the simulation of the default experiment fails"
    return result.columns


def _table(columns: NDArray[Any], outputs: Iterable[str]) -> bytes:
    chosen = ["time", *outputs]
    return _csv(chosen, columns[chosen])


def _csv(head: Iterable[str], rows: Iterable[Iterable[float]]) -> bytes:
    """Return a table; the times have all digits, so that rows of equal time can be found."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    for time, *values in rows:
        short = f"{time:.{DIGITS}g}"
        exact = math.isclose(float(short), time, rel_tol=TIME_RTOL)
        shown = [short if exact else repr(float(time)), *(f"{float(x):.{DIGITS}g}" for x in values)]
        writer.writerow(shown)
    return text.getvalue().encode()
