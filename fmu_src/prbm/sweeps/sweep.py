"""Parameter sweeps and Monte Carlo: from a table of parameters to a table of results.

    prbm sweep PRBDM2R.fmu table.csv --output "max(shuttle.x)" --stop-time 1

A row of the table is a run of the FMU, and a column is the start value of a variable.  The runs are
distributed over the cores of this machine, or over the workers of a ``distributed`` scheduler at a
given address.  Completed runs are on disk: an interrupted sweep continues from there.  A failed run
is a row with its message.
"""

import hashlib
import importlib.util
import io
import logging
import math
import os
import time
import uuid
from collections import deque
from collections.abc import Collection, Container, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import astuple, dataclass
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import fmpy  # type: ignore[import-untyped]

from ..base.archives import check_unpacked_size
from ..base.errors import ParameterError, PrbmError
from ..base.names import proposal
from ..base.progress import Progress
from ..base.reading import opening_error, shown
from ..runs.inputs import filled, placeholders, read_signal
from ..runs.run import ROWS_MAX
from .outputs import CRASHED, GOOD, Outcome, Output, SpecificationError, parse_output
from .runs import Job

if TYPE_CHECKING:
    import pandas as pd

    from .results import Results

EXTRA = ("distributed", "pandas", "pyarrow")
REMEDY = 'install the packages for sweeps with: python -m pip install "prbm-impact[sweep]"'

BATCH_MIN, BATCH_MAX = 1.0, 30.0  # Limits of the duration of a batch [s].
BATCH_SHARE = 0.02  # Duration of a batch, as a share of the time so far.
BATCHES_PER_THREAD = 2  # Batches submitted per thread, so that no thread waits for work.
RESET_RUNS_MIN = 20  # Runs per process from which on a check of the FMU's reset pays off.
STEPS = 1000  # Communication steps for an FMU without a proposed step.
CONNECTION_TIMEOUT = 10.0  # Longest wait for a scheduler and its workers [s].
FILES = (".csv", ".feather", ".h5", ".json", ".mat", ".ods", ".tsv", ".txt", ".xls", ".xlsx")
"""Suffixes rejected for the results, which are a folder and not a file."""
RECENT_RUNS = 50  # Runs whose median duration determines the size of the next batch.

MISSING_MODULE = "No module named"  # Python's message for a package that is not installed.

Outputs = Sequence[str] | Mapping[str, str]


class SweepError(PrbmError, RuntimeError):
    """The sweep cannot run, for a reason that does not depend on its table."""


def sweep(
    fmu: str | Path,
    table: "pd.DataFrame | str | Path",
    out: str | Path = "results.parquet",
    *,
    outputs: Outputs | None = None,
    values: Mapping[str, float] | None = None,
    inputs: Mapping[str, str] | None = None,
    stop_time: float | None = None,
    step: float | None = None,
    tolerance: float | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    retries: int = 1,
    timeout: float | None = None,
    overwrite: bool = False,
    retry_failed: bool = False,
    progress: Progress | None = None,
) -> "pd.DataFrame":
    """Run an FMU once for each row of a table.

    Parameters
    ----------
    fmu : str or Path
        An FMU of FMI 2.0 or 3.0 with co-simulation.
    table : DataFrame, str or Path
        One column per variable, with its name, and one row per run; or a CSV or Parquet file of
        such a table.  The units are those of the FMU: SI for the FMUs of this project.
    out : str or Path
        Folder of the results, a Parquet dataset.  If it has runs of the same sweep, only the
        missing runs are computed; rows may have been added to the table since then.
    outputs : sequence of str, or mapping of str to str
        Recorded outputs of a run:

        * a variable, for its final value;
        * ``max(x)``, ``min(x)``, ``mean(x)`` over the communication points;
        * ``first(x)``, the first communication point at which x is true [s], and ``since(x)``, the
          point from which x is true to the end [s]; NaN if there is no such point.  Numbers are
          compared, as in ``first(x > 0.001)``;
        * ``abs(x)`` in place of the variable x;
        * a named quantity of :data:`prbm.runs.quantities.QUANTITIES`, for instance ``settling``.

        The keys of a mapping are the names of the columns.  None: the final values of all outputs
        of the FMU.
    values : mapping
        Start values of all runs.
    inputs : mapping
        Inputs over time of all runs: texts such as ``"half-sine({height} g, 0.5 ms)"``.  A name in
        braces is a column of the table with numbers.
    stop_time, step, tolerance : float
        End of the runs [s], communication step [s], relative tolerance; None: those of the FMU's
        default experiment, or else 1 s, a thousandth of the run, no tolerance.
    scheduler : str or None
        Address of a ``distributed`` scheduler, as ``tcp://host:8786``, whose workers need this
        package; None: this machine.
    workers : int or None
        Number of parallel runs on this machine; None: one per core.
    retries : int
        Number of repetitions of a run whose process crashed.
    timeout : float or None
        Longest duration of a run [s]; None: no limit.
    overwrite : bool
        Delete earlier results in ``out`` (default: False).
    retry_failed : bool
        Repeat failed runs (default: False).
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Returns
    -------
    DataFrame
        In the order of the table: ``row`` (from 0), its parameters, the outputs (float64; NaN
        for a failed run), ``status`` (``ok``; ``ended``: by the FMU, before ``stop_time``;
        ``failed``, ``crashed``, ``timeout``), ``message`` and the duration in ``seconds``.

    Raises
    ------
    ParameterError
        If the table, an output, a setting or ``out`` is invalid, ``out`` has the results of another
        sweep, or another sweep is writing to it.
    SweepError
        If the FMU cannot be read or loaded, the scheduler does not respond, or a package is not
        installed.
    KeyboardInterrupt
        After Ctrl-C, with the number of completed runs, which are kept.
    """
    _check_packages()
    _check_name(Path(out))
    plan = _make_plan(fmu, table, outputs, values, inputs or {}, stop_time, step, tolerance)
    _check_counts(workers, retries, timeout)
    results = _results(plan, Path(out))
    report = progress or (lambda fraction: None)
    with ExitStack() as stack:
        stack.enter_context(results.lock())
        # Earlier results are deleted only after the scheduler has responded.
        client = stack.enter_context(_client(scheduler, workers)) if overwrite else None
        results.begin(overwrite)
        done = results.read()
        _same_rows(plan, done, results.folder)
        seen = set(done["row"][done["status"].isin(GOOD)] if retry_failed else done["row"])
        rest = [row for row in range(len(plan.rows)) if row not in seen]
        report(1.0 - len(rest) / len(plan.rows))
        if rest:
            client = client or stack.enter_context(_client(scheduler, workers))
            if retry_failed:
                results.forget_failures()
            _Sweep(client, plan, results, report).run(rest, retries, timeout)
        results.sort()
    return results.read()


def samples(
    distributions: Mapping[str, Any], n: int, seed: int = 0, method: str = "random"
) -> "pd.DataFrame":
    """Draw a table of parameters at random: see :func:`prbm.sweeps.table.samples`."""
    _check_packages()
    from . import table as sweep_table

    return sweep_table.samples(distributions, n, seed, method)


# --- plan -------------------------------------------------------------------------


@dataclass(frozen=True)
class Plan:
    """A checked sweep.

    ``digest`` is the SHA-256 of the FMU's bytes; ``rows`` are the values of each run.
    """

    name: str
    fmu: bytes
    digest: str
    job: Job
    parameters: tuple[str, ...]
    rows: list[dict[str, float]]


def _check_packages() -> None:
    """Check that the packages of the extra ``sweep`` are installed.

    Raises
    ------
    SweepError
        If one is not installed.
    """
    for name in EXTRA:
        if importlib.util.find_spec(name) is None:
            raise SweepError(f"sweeps need the package {name}; {REMEDY}")


def _make_plan(
    fmu: str | Path,
    table: "pd.DataFrame | str | Path",
    outputs: Outputs | None,
    values: Mapping[str, float] | None,
    inputs: Mapping[str, str],
    stop_time: float | None,
    step: float | None,
    tolerance: float | None,
) -> Plan:
    from .table import check_settable, checked, read_table

    data, description = read_fmu(Path(fmu))
    variables = {v.name: v for v in description.modelVariables}
    within = placeholders(inputs)
    frame = checked(read_table(table), variables, within)
    fixed = {name: float(x) for name, x in (values or {}).items()}
    for name, x in fixed.items():
        check_settable(name, variables)
        if name in frame:
            raise ParameterError(f"{name} is in the table and among the values; remove one of them")
        if not math.isfinite(x):
            raise ParameterError(f"{name} = {x:g} among the values must be finite")
    kept = _outputs(outputs, variables)
    _unambiguous([*frame.columns], [output.column for output in kept])
    times = _times(description, stop_time, step, tolerance)
    rows = frame.to_dict("records")
    driven = _inputs(inputs, within, description, rows[0], {*frame, *fixed})  # type: ignore[arg-type]
    job = Job(**times, values=fixed, outputs=kept, inputs=driven)
    return Plan(
        description.modelName, data, hashlib.sha256(data).hexdigest(), job,
        tuple(frame.columns), rows,  # type: ignore[arg-type]
    )  # fmt: skip


def _inputs(
    inputs: Mapping[str, str],
    within: Collection[str],
    description: Any,
    row: Mapping[str, float],
    given: Container[str],
) -> dict[str, tuple[str, str]]:
    """Return checked texts and units of inputs over time by name."""
    variables = {
        v.name: v for v in description.modelVariables
        if v.causality == "input" and v.type in ("Real", "Float64") and not v.shape
    }  # fmt: skip
    if inputs and not description.coSimulation.canHandleVariableCommunicationStepSize:
        raise ParameterError(
            "inputs over time need an FMU with variable communication steps; this one has fixed "
            "steps: leave the inputs out"
        )
    for name in within:
        if name not in row:
            raise ParameterError(f"{{{name}}} in an input has no value; add a column {name}")
    found = {}
    for name, text in inputs.items():
        if name not in variables:
            raise ParameterError(f"the FMU has no input {name!r}; {proposal(name, variables)}")
        if name in given:
            raise ParameterError(
                f"{name} is given both as a start value and over time; remove one of them"
            )
        unit = variables[name].unit or getattr(variables[name].declaredType, "unit", None) or ""
        read_signal(name, str(filled({name: text}, row)[name]), unit)  # Report mistakes.
        found[name] = text, unit
    return found


def read_fmu(path: Path) -> tuple[bytes, Any]:
    """Return the bytes of an FMU and FMPy's model description.

    Raises
    ------
    SweepError
        If it cannot be read, or has no co-simulation of FMI 2.0 or 3.0.
    """
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as error:
        raise SweepError(
            f"{shown(path)} cannot be read ({opening_error(error)}); give an FMU"
        ) from None
    try:
        check_unpacked_size(io.BytesIO(data))
        description = fmpy.read_model_description(io.BytesIO(data), validate=False)
    except Exception as error:  # FMPy raises plain exceptions.
        reason = " ".join(str(error).split())
        raise SweepError(f"{path} is not a readable FMU: {reason}") from None
    if not description.fmiVersion.startswith(("2", "3")) or description.coSimulation is None:
        raise SweepError(
            f"{path} (FMI {description.fmiVersion}): must have co-simulation of FMI 2.0 or 3.0; "
            "export such an FMU"
        )
    return data, description


def _outputs(outputs: Outputs | None, variables: Mapping[str, Any]) -> tuple[Output, ...]:
    from .table import check_outputs

    if outputs is None:
        plain = (v for v in variables.values() if v.causality == "output" and not v.shape)
        outputs = [v.name for v in plain if v.type not in ("String", "Binary", "Clock")]
    if isinstance(outputs, str):
        outputs = [outputs]
    pairs = outputs.items() if isinstance(outputs, Mapping) else ((text, text) for text in outputs)
    try:
        kept = tuple(parse_output(text, variables, column) for column, text in pairs)
        for output in kept:
            output.check_extreme(variables)
    except SpecificationError as error:
        raise ParameterError(f"output {error}") from None
    if not kept:
        raise ParameterError("no output is selected; name one, as in outputs=['shuttle.x']")
    check_outputs(kept, variables)
    return kept


def _unambiguous(parameters: Sequence[str], outputs: Sequence[str]) -> None:
    from .results import OWN

    names = [*parameters, *outputs, *OWN]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ParameterError(
            f"the results would have the column {twice[0]!r} twice; give the output another name, "
            f"as outputs={{'{twice[0]}_': ...}}"
        )


def _times(
    description: Any, stop_time: float | None, step: float | None, tolerance: float | None
) -> dict[str, Any]:
    """Return start, stop, step and tolerance; None is replaced by the default experiment."""
    default, co_simulation = description.defaultExperiment, description.coSimulation

    def proposed(name: str) -> float | None:
        value = getattr(default, name, None)
        return None if value is None else float(value)

    start = proposed("startTime") or 0.0
    stop = stop_time if stop_time is not None else proposed("stopTime")
    stop = start + 1.0 if stop is None else float(stop)
    size = step if step is not None else proposed("stepSize")
    if size is None and co_simulation.fixedInternalStepSize is not None:
        size = float(co_simulation.fixedInternalStepSize)
    size = (stop - start) / STEPS if size is None else float(size)
    tolerance = tolerance if tolerance is not None else proposed("tolerance")
    if not (math.isfinite(stop) and stop > start):
        raise ParameterError(f"stop_time = {stop:g} s must be finite and after {start:g} s")
    for name, x, unit in (("step", size, " s"), ("tolerance", tolerance, "")):
        if x is not None and not (math.isfinite(x) and x > 0.0):
            raise ParameterError(f"{name} = {x:g}{unit} must be positive and finite")
    steps = (stop - start) / size
    if steps > ROWS_MAX:
        raise ParameterError(
            f"step = {size:g} s makes {steps:.0f} steps in {stop - start:g} s: choose a larger one"
        )
    odd = abs(steps - round(steps)) > 1e-9 * steps
    if odd and not co_simulation.canHandleVariableCommunicationStepSize:
        raise ParameterError(
            f"stop_time = {stop:g} s: must be a multiple of step = {size:g} s, since the FMU has a "
            "fixed step; choose a step that divides it"
        )
    return {"start": start, "stop": stop, "step": size, "tolerance": tolerance}


def _check_name(out: Path) -> None:
    if out.suffix.lower() in FILES:
        raise ParameterError(
            f"out = {out}: the results are a folder of Parquet files, not a {out.suffix} file; "
            f"choose a name such as {out.with_suffix('.parquet')}; "
            "pandas.read_parquet(name).to_csv(...) makes one file of them"
        )


def _check_counts(workers: int | None, retries: int, timeout: float | None) -> None:
    if workers is not None and workers < 1:
        raise ParameterError(f"workers = {workers} must be 1 or more")
    if retries < 0:
        raise ParameterError(f"retries = {retries} must be 0 or more")
    if timeout is not None and not timeout > 0.0:
        raise ParameterError(f"timeout = {timeout:g} s must be positive")


def _results(plan: Plan, folder: Path) -> "Results":
    from .results import Results

    job = plan.job
    settings = {
        "FMU": plan.digest,
        "model": plan.name,
        "parameters": plan.parameters,
        "outputs": {o.column: list(astuple(o)[1:]) for o in job.outputs},
        "values": job.values,
        **(
            {"inputs": {name: text for name, (text, _) in job.inputs.items()}} if job.inputs else {}
        ),
        "start time [s]": job.start,
        "stop time [s]": job.stop,
        "step [s]": job.step,
        "tolerance": job.tolerance,
    }
    return Results(folder, settings, plan.parameters, [output.column for output in job.outputs])


def _same_rows(plan: Plan, done: "pd.DataFrame", folder: Path) -> None:
    """Reject results whose rows differ from the rows of the table."""
    for k, *values in done[["row", *plan.parameters]].itertuples(index=False):
        now = [*plan.rows[k].values()] if k < len(plan.rows) else None
        if now != values:
            raise ParameterError(
                f"{folder} contains a sweep over another table: row {k} "
                f"{'is missing now' if now is None else 'has changed'}; give another name for the "
                "results, or overwrite them (--overwrite)"
            )


# --- execution -----------------------------------------------------------------------------------


@contextmanager
def _client(scheduler: str | None, workers: int | None) -> Iterator[Any]:
    """Yield a client of the scheduler at an address, or of a new scheduler in this process.

    In this process one worker with threads suffices: the FMU runs in separate processes.
    """
    from dask.system import CPU_COUNT
    from distributed import Client, LocalCluster

    if scheduler is None:
        with (
            LocalCluster(  # type: ignore[no-untyped-call]
                n_workers=1,
                threads_per_worker=workers or CPU_COUNT,
                processes=False,
                dashboard_address="127.0.0.1:0",  # None would use a port of all interfaces.
                worker_dashboard_address="127.0.0.1:0",
                memory_limit=0,
                silence_logs=logging.CRITICAL,
            ) as cluster,
            Client(cluster, set_as_default=False) as client,  # type: ignore[no-untyped-call]
        ):
            yield client
        return
    try:
        client = Client(  # type: ignore[no-untyped-call]
            scheduler, timeout=CONNECTION_TIMEOUT, set_as_default=False
        )
    except (TimeoutError, OSError, ValueError) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise SweepError(
            f"no scheduler responds at {scheduler} ({reason}); start one with: dask scheduler"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=CONNECTION_TIMEOUT)
        except (TimeoutError, OSError):
            raise SweepError(
                f"the scheduler at {scheduler} has no workers; start one with: "
                f"dask worker {scheduler}"
            ) from None
        yield client


class _Sweep:
    """Sends batches of rows to the workers and writes their results."""

    def __init__(self, client: Any, plan: Plan, results: "Results", progress: Progress) -> None:
        self.client, self.plan, self.results, self.progress = client, plan, results, progress
        self.plugin = f"prbm-sweep-{uuid.uuid4().hex}"
        self.begin = time.monotonic()
        self.recent: deque[float] = deque(maxlen=RECENT_RUNS)
        self.done = 0

    def run(self, rows: Sequence[int], retries: int, timeout: float | None) -> None:
        """Run the rows, and write each batch on completion."""
        self.done = len(self.plan.rows) - len(rows)
        try:
            self._install(rows, retries, timeout)
            self._gather(deque(rows), retries)
        except KeyboardInterrupt:
            kept = len(self.results.read())
            raise KeyboardInterrupt(
                f"the sweep was stopped: {kept} of {len(self.plan.rows)} runs are stored in "
                f"{self.results.folder}; repeat the call to compute the others"
            ) from None
        finally:
            # Fails if the scheduler has ended, or a worker does not have the plugin.
            with suppress(OSError, KeyError):
                self.client.unregister_worker_plugin(self.plugin)

    def _install(self, rows: Sequence[int], retries: int, timeout: float | None) -> None:
        """Send the FMU to the workers."""
        from dataclasses import replace

        from .worker import FmuPlugin

        # The check of a reset doubles the duration of a run, which may exceed a timeout.
        reuse = timeout is None and len(rows) >= RESET_RUNS_MIN * self._threads()
        job = replace(self.plan.job, reuse=reuse)
        try:
            self.client.register_plugin(
                FmuPlugin(self.plan.fmu, job, retries, timeout), name=self.plugin
            )
        except Exception as error:  # distributed wraps the errors of workers.
            if MISSING_MODULE not in str(error):
                raise
            raise SweepError(
                "a worker cannot import prbm; install it there: "
                'python -m pip install "prbm-impact[sweep]"'
            ) from None

    def _threads(self) -> int:
        threads: dict[str, int] = self.client.nthreads()
        return max(1, sum(threads.values()))

    def _gather(self, rest: deque[int], retries: int) -> None:
        from distributed import as_completed

        running: dict[Any, list[int]] = {}
        crashes: dict[int, int] = {}  # Crashes of workers that ran a row, after the first one.
        suspects: deque[int] = deque()
        completed = as_completed(loop=self.client.loop)  # type: ignore[no-untyped-call]
        self._submit(rest, running, completed)
        for future in completed:
            rows = running.pop(future)
            outcomes = self._outcomes(future)
            if outcomes is None:
                outcomes = self._after_crash(rows, crashes, suspects, retries)
            if outcomes:
                self._keep(rows, outcomes)
            self._submit(rest, running, completed)
            if suspects and not running:
                self._send([suspects.popleft()], running, completed)

    def _after_crash(
        self, rows: list[int], crashes: dict[int, int], suspects: deque[int], retries: int
    ) -> list[Outcome]:
        """Return the outcome of a row whose workers crashed too often; otherwise repeat the rows.

        A crashed worker loses all of its rows, not only the row that caused the crash.  At the end
        these rows are repeated one by one, with no other batch submitted, to find the cause.
        """
        for row in rows:
            crashes[row] = crashes.get(row, -1) + 1
        if crashes[rows[0]] > retries:
            return [Outcome(CRASHED, "every worker that ran this row crashed")]
        suspects.extend(rows)
        return []

    def _keep(self, rows: list[int], outcomes: list[Outcome]) -> None:
        self.results.add(rows, [self.plan.rows[row] for row in rows], outcomes)
        self.recent.extend(o.seconds for o in outcomes if o.seconds > 0.0)
        self.done += len(rows)
        self.progress(self.done / len(self.plan.rows))

    def _submit(self, rest: deque[int], running: dict[Any, list[int]], completed: Any) -> None:
        """Submit batches until there are :data:`BATCHES_PER_THREAD` per thread."""
        threads = self._threads()
        while rest and len(running) < BATCHES_PER_THREAD * threads:
            size = self._size(len(rest), threads)
            self._send([rest.popleft() for _ in range(size)], running, completed)

    def _size(self, rest: int, threads: int) -> int:
        """Return the number of rows of the next batch, small at the start and at the end."""
        if not self.recent:
            return 1
        seconds = min(max(BATCH_SHARE * (time.monotonic() - self.begin), BATCH_MIN), BATCH_MAX)
        fair = math.ceil(rest / (BATCHES_PER_THREAD * threads))
        return max(1, min(int(seconds / median(self.recent)), fair))

    def _send(self, rows: list[int], running: dict[Any, list[int]], completed: Any) -> None:
        from .worker import run_batch

        values = [self.plan.rows[row] for row in rows]
        future = self.client.submit(run_batch, self.plugin, values, pure=False)
        running[future] = rows
        completed.add(future)

    def _outcomes(self, future: Any) -> list[Outcome] | None:
        """Return the outcomes of a batch; None if its workers crashed."""
        from distributed import KilledWorker

        from .worker import Unusable

        try:
            return future.result()  # type: ignore[no-any-return]
        except KilledWorker:
            return None
        except Unusable as error:
            raise SweepError(f"{self.plan.name}: {error}") from None
        except CancelledError:
            raise SweepError(
                f"the scheduler has ended: {len(self.results.read())} of {len(self.plan.rows)} "
                f"runs are stored in {self.results.folder}; repeat the call to compute the others"
            ) from None


def summary(results: "pd.DataFrame", out: str | os.PathLike[str]) -> str:
    """Return a summary of the runs of a sweep in a few lines."""
    good = results["status"].isin(GOOD)
    lines = [f"{len(results)} runs, {int((~good).sum())} failed: {out}"]
    for row, status, message in results.loc[~good, ["row", "status", "message"]].head(3).values:
        lines.append(f"row {row} {status}: {message}")
    if (~good).sum() > 3:
        lines.append("see the columns status and message for the other failed runs")
    complete = results[good].select_dtypes("number")
    for name, missing in complete.isna().sum().items():
        if missing:
            lines.append(
                f"{name}: no value in {missing} of {len(complete)} complete runs; simulate longer, "
                "or check the condition"
            )
    return "\n".join(lines)
