"""Studies: many simulations of a mechanism or an FMU, their optimum, yield and sensitivities."""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..base.atomic import check_file, write
from ..base.csv_text import csv_text
from ..base.errors import ParameterError
from ..base.progress import Progress
from ..mechanics.arrays import Real
from ..mechanism.description import Mechanism
from ..mechanism.parameters import Tolerance
from ..runs.inputs import Source
from ..runs.signals import Signal
from .design import SENSITIVITY, Sensitivity, Yield, distribution, drawn, sensitivity, yield_of
from .journal import Journal, Point
from .mechanism import MechanismModel
from .optimum import REFINEMENTS_EXPECTED, Optimum, Search
from .outputs import GOOD, Outcome
from .plan import Model, Outputs, Plan, Vary
from .runner import Runner
from .table import PARQUET

YIELD_RUNS = 256  # Simulations around an optimum that give its yield.
YIELD_SEED = 1


@dataclass(frozen=True, repr=False)
class Study:
    """The samples of a study.

    Parameters
    ----------
    varied : mapping
        Samples (k,) of each varied parameter by name.  A grid has all combinations, and the last
        parameter varies fastest; otherwise the samples are those of the points.
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
    whole_grid : bool
        Whether the points are a grid.
    good : (n,)
        Whether each simulation has succeeded and satisfies all constraints.
    share : Yield or None
        The share of simulations that satisfy the constraints, if there are any and the points are
        drawn; with an optimum and tolerances, that of simulations around the optimum.
    toleranced : tuple of str
        The parameters with a tolerance around the optimum.
    sensitivities : mapping
        Sobol's indices of each output, if they were requested and exist.
    settings : mapping
        All that the outputs depend on, except for the varied parameters.
    """

    varied: Mapping[str, Real]
    points: Real
    outputs: Mapping[str, Real]
    units: Mapping[str, str]
    messages: tuple[str, ...] = ()
    optimum: Optimum | None = field(default=None)
    whole_grid: bool = True
    good: Any = True
    share: Yield | None = None
    toleranced: tuple[str, ...] = ()
    sensitivities: Mapping[str, Sensitivity] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def parameters(self) -> dict[str, Real]:
        """The parameter of each simulation (n,) by name."""
        return dict(zip(self.varied, self.points.T, strict=True))

    @property
    def satisfied(self) -> Any:
        """Whether each simulation (n,) satisfies all constraints, or has failed."""
        return np.asarray(self.good) | np.array([bool(message) for message in self.messages])

    def __repr__(self) -> str:
        failed = sum(map(bool, self.messages))
        best = "" if self.optimum is None else f", {self.optimum!r}"
        return (
            f"<Study of {len(self.points)} simulations over {' and '.join(self.varied)}: "
            f"{failed} failed{best}>"
        )

    def table(self) -> tuple[list[str], list[list[object]]]:
        """Return heads and rows: parameters and outputs with their units, and the error."""
        heads = [f"{n} [{self.units[n] or '-'}]" for n in (*self.varied, *self.outputs)]
        values = np.column_stack([self.points, *self.outputs.values()])
        rows: list[list[object]] = [
            [*row, message] for row, message in zip(values.tolist(), self.messages, strict=True)
        ]
        return [*heads, "error"], rows


def study(
    mechanism: Mechanism | str | Path,
    vary: Vary,
    outputs: Outputs | None = (),
    *,
    runs: int | None = None,
    method: str = "sobol",
    seed: int = 0,
    minimise: str | None = None,
    maximise: str | None = None,
    subject_to: Sequence[str] = (),
    tolerances: Mapping[str, str | Tolerance] | None = None,
    values: Mapping[str, float | str] | None = None,
    inputs: Mapping[str, Source] | None = None,
    stop_time: float | str | None = None,
    step: float | str | None = None,
    tolerance: float | None = None,
    workers: int | None = None,
    executor: Executor | str | None = None,
    retries: int = 1,
    timeout: float | str | None = None,
    engine: str | None = None,
    table: str | Path | None = None,
    overwrite: bool = False,
    retry_failed: bool = False,
    progress: Progress | None = None,
) -> Study:
    """Simulate a mechanism for many parameters, and find the optimum of an output.

    The optimum is searched from the best samples, for one parameter by Brent's bounded method
    between the neighbours of the sample, for more by the simplex of Nelder and Mead, under
    constraints after COBYQA.

    Parameters
    ----------
    mechanism : Mechanism, str or Path
        The mechanism, or the path of an FMU for co-simulation, which needs the extra ``sweep``.
    vary : mapping, DataFrame, str, Path or None
        Increasing samples of parameters or inputs by name, numbers in SI or texts with a unit,
        ``"-4 mm"``, whose combinations are simulated; or of numbers that are written as ``{name}``
        in the texts of inputs.  With ``runs``, for each name (low, high), a distribution of
        ``scipy.stats``, or a tolerance such as ``"0.1 mm +- 2 %"`` or ``"+- 2 %"`` of the value of
        the mechanism: a normal distribution with three standard deviations in the half-width, or a
        uniform one, ``"+- 2 % uniform"``.  None: the tolerances of the mechanism.  Or the path of a
        CSV or Parquet file, or a DataFrame, with a row for each simulation and a column for each
        name, in SI or with a unit in the head, ``stop.position [mm]``.
    outputs : sequence of str, mapping of str to str, or None
        Outputs as of :func:`prbm.sweeps.sweep.sweep`: ``settling``, ``max(abs(shuttle.vx))``; or,
        without a simulation, ``fundamental``, ``mode(2)`` and ``rest(shuttle.x)``.  If one of them
        is a stress, all flexures have stress outputs.  The keys of a mapping are their names.
        None: all outputs of an FMU.
    runs : int or None
        Number of points that are drawn; None: ``vary`` is a grid.
    method, seed : str, int
        How they are drawn: ``sobol``, ``latin`` or ``random``; or ``sensitivity`` for the indices
        of Sobol from runs (p + 2) simulations of p parameters.
    minimise, maximise : str or None
        The output whose optimum is searched, at most one of them.
    subject_to : sequence of str
        Constraints on outputs, ``"fundamental > 40 Hz"``.
    tolerances : mapping or None
        Tolerances of parameters, varied or not, ``{"flexure.thickness": "2 %"}``, that give the
        yield around an optimum under constraints, in addition to those of the mechanism.
    values, inputs, stop_time, tolerance, engine
        As for :func:`prbm.simulate`.
    step : float, str or None
        Communication step, the resolution of the outputs in time [s]; None: 1/4000 of the duration.
    workers : int or None
        Number of parallel simulations; None: one per core.  They run in threads of this process if
        the kernel computes them.  With a timeout, or with the Python engine and more than one
        worker, they run in other processes, and a crash costs only its simulation.
    executor : Executor, str or None
        A ``concurrent.futures`` executor, such as that of Dask's ``Client.get_executor()``, or the
        address of a Dask scheduler; None: this machine.
    retries : int
        Number of repetitions of a simulation whose process crashed.
    timeout : float, str or None
        Longest duration of a simulation [s], or a text, ``"20 s"``; None: no limit.
    table : str, Path or None
        Path of a table of the simulations, which is written at the end: CSV, or Parquet as of
        :func:`prbm.sweeps.sweep.sweep` if the name ends in ``.parquet``, to which rows can be
        added.  Completed rows are in ``TABLE.partial`` beside it until then, and a study with the
        same settings continues from there.
    overwrite : bool
        Forget the rows of an earlier study.
    retry_failed : bool
        Repeat the failed simulations of an earlier study.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Raises
    ------
    ParameterError
        If an argument is invalid, or no simulation has a value of the output to be optimised.
    UserMistake
        If a text is not a quantity of the right dimension.
    """
    model = model_of(mechanism)
    plan = Plan(
        model, vary, model.outputs if outputs is None else outputs, runs=runs, method=method,
        seed=seed, minimise=minimise, maximise=maximise, subject_to=subject_to,
        tolerances=tolerances, values=values, inputs=inputs, stop_time=stop_time, step=step,
        tolerance=tolerance, engine=engine,
    )  # fmt: skip
    return computed(
        plan, table, parquet=Path(table or "").suffix.lower() in PARQUET, workers=workers,
        executor=executor, retries=retries, timeout=timeout, overwrite=overwrite,
        retry_failed=retry_failed, progress=progress,
    )  # fmt: skip


def model_of(mechanism: Mechanism | str | Path) -> Model:
    """Return the model of a mechanism, or of the path of an FMU.

    Raises
    ------
    StudyError
        If the FMU cannot be read.
    """
    if isinstance(mechanism, Mechanism):
        return MechanismModel(mechanism)
    from .fmu_model import FmuModel  # imported here: an extra

    return FmuModel(mechanism)


def computed(
    plan: Plan,
    table: str | Path | None,
    *,
    parquet: bool,
    overwrite: bool,
    retry_failed: bool,
    progress: Progress | None,
    **limits: Any,
) -> Study:
    """Compute the rows of a plan, its optimum and yield, and write its table, CSV or Parquet.

    The other arguments, and the errors, are those of :func:`study`; ``limits`` are those of
    :class:`prbm.sweeps.runner.Runner`.
    """
    out = None if table is None else Path(table)
    journal, rows = Journal(out, plan.settings, plan.columns, plan.texts), plan.rows(plan.points)
    if out is not None:
        check_file(out)
        if parquet:
            from . import results  # imported here: an extra

            journal.known |= results.earlier(journal, rows, out, overwrite)
    with (
        Runner(plan.job, plan.columns, journal, len(rows), **limits) as runner,
        journal.opened(overwrite, retry_failed),
    ):
        alone = runner.here and runner.count == 1
        for name, source in plan.job.inputs.items():
            if callable(source) and not isinstance(source, Signal) and not alone:
                raise ParameterError(
                    f"{name}: a function cannot be called by several workers; give a text or "
                    "arrays, or workers=1"
                )
        found = _run(plan, runner, progress or (lambda fraction: None))
        if out is not None and parquet:
            write(out, results.parquet(journal, rows))
        elif out is not None:
            write(out, csv_text(*found.table()).encode())
        journal.remove()
    return found


def _run(plan: Plan, runner: Runner, progress: Progress) -> Study:
    """Simulate, search the optimum and its yield."""
    rows, names, whole = plan.rows(plan.points), [*plan.varied], plan.whole_grid
    further = REFINEMENTS_EXPECTED * len(names) if plan.output is not None else 0
    part = len(rows) / (len(rows) + further + YIELD_RUNS * bool(plan.spread))
    nothing = (math.nan,) * len(plan.texts)

    def values(outcomes: Sequence[Outcome]) -> Real:
        """Return outputs (n, k), NaN for failed simulations."""
        return np.array([outcome.values or nothing for outcome in outcomes])

    outcomes = runner.outcomes(rows, lambda done: progress(part * done))
    messages = tuple("" if x.status in GOOD else x.message for x in outcomes)
    table = values(outcomes)
    outputs = dict(zip(plan.texts, table.T, strict=True))
    good = plan.satisfied(table) & np.array([not message for message in messages])
    best, share, indices = None, None, {}
    if plan.method == SENSITIVITY:
        found = {text: sensitivity(names, y, plan.seed) for text, y in outputs.items()}
        indices = {text: one for text, one in found.items() if one is not None}
    if plan.output is not None:
        search = Search(plan, table, lambda x: values(runner.outcomes(plan.rows(x))))
        best = _optimum(search, messages, runner.journal)
        if plan.spread:
            share = yield_of(plan.satisfied(values(runner.outcomes(_around(plan, best)))))
    elif plan.constraints and not whole:
        share = yield_of(good)
    progress(1.0)
    return Study(
        plan.varied if whole else dict(zip(names, plan.points.T, strict=True)), plan.points,
        outputs, plan.units, messages, best, whole, good, share, tuple(plan.spread), indices,
        plan.settings,
    )  # fmt: skip


def _optimum(search: Search, messages: Sequence[str], journal: Journal) -> Optimum:
    """Search the optimum; an error has a reason or a remedy, and what is in the journal."""
    try:
        return search.optimum()
    except ParameterError as error:
        reason = min(filter(None, messages), default=search.remedy)
        raise ParameterError("; ".join(filter(None, [str(error), reason, journal.kept]))) from None


def _around(plan: Plan, best: Optimum) -> list[Point]:
    """Return drawn values of all columns around an optimum."""
    at = {**best.point, **plan.beside}
    laws = {n: distribution(n, at[n], x) for n, x in plan.spread.items() if x.at(at[n]) > 0.0}
    x = drawn(laws, YIELD_RUNS, YIELD_SEED, "random").T if laws else ()
    columns = {name: np.full(YIELD_RUNS, value) for name, value in at.items()}
    columns |= zip(laws, x, strict=True)
    return [*zip(*(columns[name].tolist() for name in plan.columns), strict=True)]
