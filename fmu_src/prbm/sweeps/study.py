"""Parameter studies of a mechanism: grids of simulations without an FMU, and their optimum.

    prbm study PRBDM2R --vary "stop.position=-8:8 mm:17" --of settling --minimise settling

The simulations run in processes on all cores of this machine.  A simulation that fails is a row
with its message.  The best sample is refined by further simulations.
"""

import itertools
import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from ..base.errors import ParameterError, PrbmError
from ..base.names import proposal
from ..base.processes import executor, process_count
from ..base.progress import Progress
from ..hybrid.configuration import checked_tolerance
from ..hybrid.given import start_values
from ..hybrid.simulation import Simulation
from ..interface.variables import variables
from ..mechanics.arrays import Real
from ..mechanics.stress import with_stress
from ..mechanism.description import Mechanism
from ..runs.engine import PYTHON, check_engine, kernel_available
from ..runs.experiment import experiment
from ..runs.inputs import Source, filled, placeholders, signals
from ..runs.quantities import QUANTITIES
from ..runs.result import names
from ..runs.run import communication_points, in_si, in_unit, simulate
from ..runs.signals import Signal
from .outputs import FAILED, OK, QUANTITY, Outcome, Output, SpecificationError, evaluate
from .outputs import parse_output as parse

STEPS = 4000  # Communication steps of a simulation, which resolve the vibration after impacts.
RUNS_MAX = 100_000  # More simulations are a mistake in the number of samples.
NEIGHBOURS = 5  # Samples of a range whose worst output is compared with that of other ranges.
FLAT_RTOL = 0.05  # An optimum is flat where the output is within this share of it.
REFINED_RTOL = 1e-3  # Tolerance of the refined parameters, relative to the distance of samples.
ROUNDS_MAX = 4  # Repetitions of the refinement.
REFINEMENTS_MAX = 40  # Simulations that refine an optimum.
REFINEMENTS_EXPECTED = 30  # Usual number of simulations of a refinement, for the progress.
LAST_FRACTION = 0.99  # Reported progress while a refinement takes more simulations than usual.
EDGE_RTOL = 0.02  # Tolerance of the ends of the flat range, relative to the distance of samples.
NAMES_LISTED_MAX = 12  # Messages about unknown outputs do not list more names.
TIMES = ("first", "since")  # Reductions whose value is a time.
Rows = Callable[[Sequence[str], Sequence[object]], object]
Samples = Sequence[float | str] | Real


@dataclass(frozen=True)
class Setup:
    """A study before its simulations.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    outputs : tuple of Output
        The outputs.
    values : mapping
        Parameters and inputs of all simulations.
    inputs : mapping
        Inputs over time of all simulations.
    options : mapping
        Further arguments of :func:`prbm.runs.run.simulate`: stop_time, step, tolerance, engine.
    """

    mechanism: Mechanism
    outputs: tuple[Output, ...]
    values: Mapping[str, float]
    inputs: Mapping[str, Source]
    options: Mapping[str, Any]

    def run(self, values: Mapping[str, float]) -> Outcome:
        """Simulate once; errors of the simulation are returned as outcomes."""
        begin = perf_counter()
        within = placeholders(self.inputs)
        others = {name: x for name, x in values.items() if name not in within}
        try:
            result = simulate(
                self.mechanism, {**self.values, **others}, inputs=filled(self.inputs, values),
                **self.options,
            )  # fmt: skip
        except PrbmError as error:
            return Outcome(FAILED, str(error), perf_counter() - begin)
        columns = _by_name(result.columns)
        found = tuple(evaluate(output, columns, result.impacts) for output in self.outputs)
        return Outcome(OK, "", perf_counter() - begin, found)


def _by_name(columns: Any) -> dict[str, Any]:
    return {name: columns[name] for name in names(columns)}


@dataclass(frozen=True, repr=False)
class Optimum:
    """The refined optimum of an output.

    Parameters
    ----------
    output : str
        The output.
    point : mapping
        Values of the varied parameters.
    value : float
        The output there.
    flat : mapping
        For each varied parameter the range in which the output is within 5 % of the optimum.  With
        two parameters it is the range of the connected samples.
    bounded : mapping
        For each varied parameter whether this range ends inside the samples, at both ends.
    points : (m, p)
        Parameters of all simulations of the refinement.
    values : (m,)
        The output there; NaN for a failed simulation.
    robust : (float, float, float) or None
        First and last of the five neighbouring samples of one parameter whose worst output is best,
        and this output.  None with two parameters, with fewer samples, or if all ranges have failed
        simulations.
    """

    output: str
    point: Mapping[str, float]
    value: float
    flat: Mapping[str, tuple[float, float]]
    bounded: Mapping[str, tuple[bool, bool]]
    points: Real
    values: Real
    robust: tuple[float, float, float] | None = None

    def __repr__(self) -> str:
        place = ", ".join(f"{name} = {x:.6g}" for name, x in self.point.items())
        return f"<Optimum of {self.output}: {self.value:.6g} at {place}>"


@dataclass(frozen=True, repr=False)
class Study:
    """The samples of a study.

    Parameters
    ----------
    varied : mapping
        Samples (k,) of each varied parameter by name; the grid has all combinations, the last
        parameter varies fastest.
    points : (n, p)
        Parameters of each simulation.
    outputs : mapping
        Values (n,) of each output by its text; NaN for a failed simulation.
    units : mapping
        Units of the varied parameters and of the outputs; empty if dimensionless.
    messages : tuple of str
        The error of each simulation; empty if it succeeded.
    optimum : Optimum or None
        The optimum, if one was requested.
    """

    varied: Mapping[str, Real]
    points: Real
    outputs: Mapping[str, Real]
    units: Mapping[str, str]
    messages: tuple[str, ...] = ()
    optimum: Optimum | None = field(default=None)

    def __repr__(self) -> str:
        failed = sum(map(bool, self.messages))
        best = "" if self.optimum is None else f", {self.optimum!r}"
        return (
            f"<Study of {len(self.points)} simulations over {' and '.join(self.varied)}: "
            f"{failed} failed{best}>"
        )


def study(
    mechanism: Mechanism,
    vary: Mapping[str, Samples],
    outputs: Sequence[str],
    *,
    minimise: str | None = None,
    maximise: str | None = None,
    values: Mapping[str, float | str] | None = None,
    inputs: Mapping[str, Source] | None = None,
    stop_time: float | str | None = None,
    step: float | str | None = None,
    tolerance: float | None = None,
    workers: int | None = None,
    engine: str | None = None,
    progress: Progress | None = None,
    rows: Rows | None = None,
) -> Study:
    """Simulate a mechanism on a grid of parameters, and find the optimum of an output.

    The optimum is searched around the best sample, for one parameter by Brent's bounded method
    between the neighbours of the sample, for two by the simplex of Nelder and Mead.

    In a script, call it under ``if __name__ == "__main__":``, because the processes import the
    script; ``workers=1`` starts no processes.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    vary : mapping
        Increasing samples of one or two parameters or inputs by name, numbers in SI or texts with
        a unit, ``"-4 mm"``; or of numbers that are written as ``{name}`` in the texts of inputs.
    outputs : sequence of str
        Outputs as of :func:`prbm.sweeps.sweep.sweep`: ``settling``, ``max(abs(shuttle.vx))``.  If
        one of them is a stress, all flexures have stress outputs.
    minimise, maximise : str or None
        The output whose optimum is searched, at most one of them.
    values, inputs, stop_time, tolerance, engine
        As for :func:`prbm.simulate`.
    step : float, str or None
        Communication step, the resolution of the outputs in time [s]; None: 1/4000 of the duration.
    workers : int or None
        Number of processes; None: one per core.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.
    rows : callable or None
        Called with the heads of the table, and with the row of each simulation of the grid as soon
        as it and those before it are complete: parameters, outputs, the error.

    Raises
    ------
    ParameterError
        If an argument is invalid, or no simulation has a value of the output to be optimised.
    UserMistake
        If a text is not a quantity of the right dimension.
    """
    within = placeholders(inputs or {})
    samples = _checked(mechanism, vary, within)
    if minimise is not None and maximise is not None:
        raise ParameterError("minimise and maximise are both given; omit one of them")
    wanted = minimise if maximise is None else maximise
    texts = list(dict.fromkeys([*outputs, *([] if wanted is None else [wanted])]))
    if any("stress" in text for text in texts):
        mechanism = with_stress(mechanism)
    units = _units(mechanism)
    given = dict(in_si(mechanism, values))
    setup = Setup(
        mechanism, _outputs(texts, units), given, dict(inputs or {}),
        _options(mechanism, given, stop_time, step, tolerance, engine),
    )  # fmt: skip
    first = {name: float(x[0]) for name, x in samples.items()}
    signals(mechanism, filled(setup.inputs, first), {**given, **first})  # Report mistakes.
    for name in given.keys() & samples.keys():
        raise ParameterError(f"{name} is varied and has a fixed value; remove one of them")
    points = np.array(list(itertools.product(*samples.values())))
    with _pool(setup, workers, len(points)) as run:
        report = _report(progress, len(points), 0 if wanted is None else REFINEMENTS_EXPECTED)
        shown = {**{n: units.get(n, "") for n in samples}, **_output_units(setup.outputs, units)}
        heads = [*(f"{name} [{shown[name] or '-'}]" for name in (*samples, *texts)), "error"]
        outcomes = []
        for point, outcome in zip(points, _each(run, [*samples], points), strict=True):
            outcomes.append(outcome)
            if rows is not None:
                rows(heads, [*point.tolist(), *_values(outcome, len(texts)), outcome.message])
            report(len(outcomes))
        table = np.array([_values(outcome, len(texts)) for outcome in outcomes])
        outputs_found = dict(zip(texts, table.T, strict=True))
        messages = tuple(outcome.message for outcome in outcomes)
        found = Study(samples, points, outputs_found, shown, messages)
        if wanted is None:
            return found
        sign = 1.0 if maximise is None else -1.0
        optimum = _Search(run, found, wanted, texts.index(wanted), sign, report).optimum()
    report(math.inf)
    return Study(found.varied, points, found.outputs, found.units, found.messages, optimum)


def _options(
    mechanism: Mechanism,
    values: Mapping[str, float],
    stop_time: float | str | None,
    step: float | str | None,
    tolerance: float | None,
    engine: str | None,
) -> dict[str, Any]:
    """Return the further arguments of all simulations.

    Raises
    ------
    ParameterError
        If one of the values or arguments is invalid, so that every simulation would fail.
    """
    check_engine(engine)
    if engine is None and not kernel_available():  # Compiled and reported here, not by workers.
        engine = PYTHON
    start_values(mechanism, values, 0.0)
    if stop_time is None:
        end = experiment(mechanism, values, engine).stop_time
    else:
        end = in_unit("stop_time", stop_time, "s")
    spacing = end / STEPS if step is None else in_unit("step", step, "s")
    communication_points(end, spacing)
    if tolerance is not None:
        tolerance = checked_tolerance(in_unit("tolerance", tolerance, ""))
    return {"stop_time": end, "step": spacing, "tolerance": tolerance, "engine": engine}


# --- checks ---------------------------------------------------------------------------------------


def _checked(
    mechanism: Mechanism, vary: Mapping[str, Samples], within: set[str]
) -> dict[str, Real]:
    """Return the samples of each parameter or placeholder as arrays."""
    if len(vary) not in (1, 2):
        raise ParameterError(f"{len(vary)} parameters are varied; vary one or two")
    known = _units(mechanism)
    inputs = Simulation(mechanism).given
    settable = {**mechanism.values(), **inputs}
    samples = {}
    for name, sequence in vary.items():
        if name not in settable and name not in within:
            raise ParameterError(f"unknown variable {name!r}; {proposal(name, settable)}")
        if name in settable and name in within:
            raise ParameterError(
                f"{{{name}}} in an input is also a parameter; choose another name in braces"
            )
        given = np.array(sequence, object).ravel()
        x = np.array([in_unit(name, sample, known.get(name, "")) for sample in given])
        if len(x) < 2 or not (np.isfinite(x).all() and (np.diff(x) > 0.0).all()):
            raise ParameterError(
                f"{name}: at least two samples are needed, finite and increasing"
                + (f", in {known[name]}" if known.get(name) else "")
            )
        samples[name] = x
    for name in sorted(within):
        if name not in samples:
            raise ParameterError(f"{{{name}}} in an input has no value; vary {name}")
    count = math.prod(map(len, samples.values()))
    if count > RUNS_MAX:
        raise ParameterError(f"the study has {count} simulations; reduce them to {RUNS_MAX}")
    return samples


def _units(mechanism: Mechanism) -> dict[str, str]:
    """Return the units of all variables of a mechanism by name."""
    every = variables(mechanism, Simulation(mechanism).outputs())
    return {variable.name: variable.unit for variable in every}


def _outputs(texts: Sequence[str], known: Mapping[str, str]) -> tuple[Output, ...]:
    """Return checked outputs."""
    if not texts:
        raise ParameterError("no output is selected; name one, for instance settling")
    kept = []
    for text in texts:
        try:
            output = parse(text, known)
            output.check_extreme(known)
        except SpecificationError as error:
            raise ParameterError(f"output {error}") from None
        lacking = output.lacking(known)
        if lacking:
            remedy = QUANTITIES[output.variable].remedy
            raise ParameterError(
                f"output {text}: the mechanism has no {lacking}, from which it is computed"
                + (f"; {remedy}" if remedy else "")
            )
        if output.reduction != QUANTITY and output.variable not in known:
            hint = proposal(output.variable, dict.fromkeys([*known, *QUANTITIES]))
            if hint.startswith("known") and len(known) > NAMES_LISTED_MAX:
                hint = f"named quantities are {', '.join(QUANTITIES)}"
            raise ParameterError(f"output {text}: unknown variable {output.variable!r}; {hint}")
        kept.append(output)
    return tuple(kept)


def _output_units(outputs: Sequence[Output], known: Mapping[str, str]) -> dict[str, str]:
    """Return the units of outputs by their texts."""
    found = {}
    for output in outputs:
        if output.reduction == QUANTITY:
            found[output.column] = QUANTITIES[output.variable].unit
        else:
            found[output.column] = "s" if output.reduction in TIMES else known[output.variable]
    return found


# --- simulations ----------------------------------------------------------------------------------

Run = Callable[[Mapping[str, float]], "Future[Outcome]"]
_setup: Setup | None = None  # The study of a worker process.


def _prepare(setup: Setup) -> None:
    """Keep the study in a worker process."""
    global _setup
    _setup = setup


def _run(values: Mapping[str, float]) -> Outcome:
    """Simulate in a worker process."""
    assert _setup is not None
    return _setup.run(values)


@contextmanager
def _pool(setup: Setup, workers: int | None, count: int) -> Iterator[Run]:
    """Yield a function that submits a simulation.  An error ends the simulations that still run."""
    if workers is not None and workers < 1:
        raise ParameterError(f"workers = {workers} must be 1 or more")
    processes = process_count(count, workers)
    for name, source in setup.inputs.items():
        if processes > 1 and callable(source) and not isinstance(source, Signal):
            raise ParameterError(
                f"{name}: a function cannot be sent to other processes; give a text or arrays, or "
                "workers=1"
            )
    run = setup.run if processes == 1 else _run
    with executor(processes, _prepare, setup) as pool:
        yield lambda values: pool.submit(run, values)


def _report(progress: Progress | None, samples: int, refinements: int) -> Progress:
    """Return a callback for the number of completed simulations."""
    total, limit = samples + refinements, LAST_FRACTION if refinements else 1.0

    def report(completed: float) -> None:
        if progress is not None:
            progress(1.0 if completed == math.inf else min(completed / total, limit))

    return report


def _each(run: Run, parameters: Sequence[str], points: Real) -> Iterator[Outcome]:
    """Yield the outcomes of all points in order."""
    pending: deque[Future[Outcome]] = deque()
    for point in points:
        pending.append(run(dict(zip(parameters, map(float, point), strict=True))))
        while pending and pending[0].done():
            yield pending.popleft().result()
    while pending:
        yield pending.popleft().result()


def _values(outcome: Outcome, count: int) -> tuple[float, ...]:
    """Return the outputs of a simulation; NaN for a failed one."""
    return outcome.values or (math.nan,) * count


# --- optimum --------------------------------------------------------------------------------------


class _Search:
    """The search of an optimum around the best sample.

    Parameters
    ----------
    run : callable
        Submits a simulation.
    found : Study
        The samples.
    output, index : str, int
        The output, and its position among the outputs.
    sign : float
        1 to minimise, -1 to maximise.
    report : callable
        Called with the number of completed simulations.
    """

    def __init__(
        self,
        run: Run,
        found: Study,
        output: str,
        index: int,
        sign: float,
        report: Progress = lambda completed: None,
    ) -> None:
        self.run, self.found, self.output, self.index, self.sign = run, found, output, index, sign
        self.report = report
        self.samples = list(found.varied.values())
        self.grid = sign * found.outputs[output].reshape([len(x) for x in self.samples])
        if not np.isfinite(self.grid).any():
            reasons = sorted({message for message in found.messages if message})
            why = f": {reasons[0]}" if reasons else "; simulate longer, or choose another output"
            raise ParameterError(f"no simulation has a value of {output}{why}")
        self.points: list[Real] = []
        self.values: list[float] = []

    def value(self, x: Real) -> float:
        """Return the output with its sign at a point (p,); infinite if it has no value."""
        point = np.atleast_1d(np.asarray(x, float))
        outcome = self.run(dict(zip(self.found.varied, map(float, point), strict=True))).result()
        value = self.sign * outcome.values[self.index] if outcome.values else math.nan
        self.points.append(point)
        self.values.append(value)
        self.report(len(self.found.points) + len(self.values))
        return value if math.isfinite(value) else math.inf

    def optimum(self) -> Optimum:
        """Refine the best sample and determine the range around it."""
        best = np.unravel_index(np.nanargmin(self.grid), self.grid.shape)
        names = list(self.found.varied)
        if len(names) == 1:
            ends = {names[0]: self._refined_range()}
        else:
            self._simplex(best)
            ends = self._region(best, self._limit())
        points, values = self._every()
        k = int(np.nanargmin(values))
        return Optimum(
            self.output,
            dict(zip(names, map(float, points[k]), strict=True)),
            float(self.sign * values[k]),
            {name: (low, high) for name, ((low, _), (high, _)) in ends.items()},
            {name: (low, high) for name, ((_, low), (_, high)) in ends.items()},
            np.array(self.points).reshape(-1, len(names)),
            self.sign * np.array(self.values),
            self._robust() if len(names) == 1 else None,
        )

    def _robust(self) -> tuple[float, float, float] | None:
        """Return the neighbouring samples whose worst output is best, and this output."""
        x = self.samples[0]
        if len(x) < NEIGHBOURS:
            return None
        windows = np.lib.stride_tricks.sliding_window_view(self.grid, NEIGHBOURS)
        worst = windows.max(axis=1)  # NaN if a simulation has failed.
        if not np.isfinite(worst).any():
            return None
        k = int(np.nanargmin(worst))
        return float(x[k]), float(x[k + NEIGHBOURS - 1]), float(self.sign * worst[k])

    def _every(self) -> tuple[Real, Real]:
        """Return all points so far, (n, p), and the values there with their sign, (n,)."""
        return (
            np.array([*self.found.points, *self.points]),
            np.array([*self.grid.ravel(), *self.values]),
        )

    def _limit(self) -> float:
        """Return the value up to which the output is within 5 % of its optimum."""
        best = float(np.nanmin(self._every()[1]))
        return best + FLAT_RTOL * abs(best)

    def _refined_range(self) -> tuple[tuple[float, bool], tuple[float, bool]]:
        """Refine the best sample of one parameter, and return the range around the optimum.

        The search for the ends of the range may meet a better point if the output jumps.  The
        refinement is then repeated there.
        """
        for _ in range(ROUNDS_MAX):
            self._along()
            limit, (points, values) = self._limit(), self._every()
            ends = self._range(points[:, 0], values, int(np.nanargmin(values)), limit)
            if self._limit() == limit:
                break
        return ends

    def _along(self) -> None:
        """Refine the best point of one parameter between its neighbours."""
        points, values = self._every()
        x, k = np.unique(points), points[np.nanargmin(values), 0]
        low, high = max(x[x < k], default=x[0]), min(x[x > k], default=x[-1])
        bounded: Any = minimize_scalar  # Its type hints exclude arrays and options.
        bounded(
            self.value, bounds=(low, high), method="bounded",
            options={"xatol": float(REFINED_RTOL * (high - low)), "maxiter": REFINEMENTS_MAX},
        )  # fmt: skip

    def _simplex(self, best: tuple[Any, ...]) -> None:
        """Refine the best of the samples of two parameters, in units of their distances."""
        start = np.array([x[k] for x, k in zip(self.samples, best, strict=True)])
        sizes = np.array([np.ptp(x) / (len(x) - 1) for x in self.samples])
        bounds = [(x[0] / h, x[-1] / h) for x, h in zip(self.samples, sizes, strict=True)]
        inward = np.array([-0.5 if k == len(x) - 1 else 0.5
                           for x, k in zip(self.samples, best, strict=True)])  # fmt: skip
        corners = start / sizes + np.vstack([np.zeros(2), np.diag(inward)])
        options: Any = {
            "initial_simplex": corners, "maxfev": REFINEMENTS_MAX, "xatol": REFINED_RTOL,
            "fatol": 0.0,
        }  # fmt: skip
        simplex: Any = minimize  # Its type hints exclude this function.
        simplex(
            lambda z: self.value(z * sizes), corners[0], method="Nelder-Mead",
            bounds=bounds, options=options,
        )  # fmt: skip

    def _range(
        self, x: Real, values: Real, k: int, limit: float
    ) -> tuple[tuple[float, bool], tuple[float, bool]]:
        """Return the ends of the range around point k in which values are below a limit.

        Each end is bisected between the last point inside and the first one outside; it is false
        with the last sample if no point is outside.
        """
        order = np.argsort(x, kind="stable")
        x, outside = x[order], ~(values[order] <= limit)
        k = int(np.flatnonzero(order == k)[0])
        above, below = np.flatnonzero(outside[k:]), np.flatnonzero(outside[: k + 1])
        last = k + int(above[0]) - 1 if len(above) else len(x) - 1
        first = int(below[-1]) + 1 if len(below) else 0
        return (
            self._edge(x[first], x[first - 1] if len(below) else None, limit),
            self._edge(x[last], x[last + 1] if len(above) else None, limit),
        )

    def _edge(self, inside: float, outside: float | None, limit: float) -> tuple[float, bool]:
        """Return the end of a range, and whether it lies inside the samples."""
        if outside is None:
            return float(inside), False
        size = float(np.ptp(self.samples[0])) / (len(self.samples[0]) - 1)
        while abs(outside - inside) > EDGE_RTOL * size:
            middle = 0.5 * (inside + outside)
            if self.value(np.array([middle])) <= limit:
                inside = middle
            else:
                outside = middle
        return float(inside), True

    def _region(
        self, best: tuple[Any, ...], limit: float
    ) -> dict[str, tuple[tuple[float, bool], tuple[float, bool]]]:
        """Return the ranges of the samples below a limit that are connected to the best one."""
        from scipy.ndimage import label  # imported here: two parameters only

        regions, _ = label(self.grid <= max(limit, self.grid[best]))
        within = np.nonzero(regions == regions[best])
        ends = {}
        for name, x, rows in zip(self.found.varied, self.samples, within, strict=True):
            low, high = int(rows.min()), int(rows.max())
            ends[name] = (float(x[low]), low > 0), (float(x[high]), high < len(x) - 1)
        return ends
