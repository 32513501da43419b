"""Studies of an FMU: from a table of parameters to a table of results.

    prbm sweep PRBDM2R.fmu table.csv --output "max(shuttle.x)" --stop-time 1

A row of the table is a run of the FMU, and a column is the start value of a variable.  The runs are
distributed over the cores of this machine, or over an executor or a Dask cluster (:mod:`.runner`).
"""

import hashlib
import importlib.util
import io
import json
import math
import os
from collections.abc import Collection, Container, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fmpy  # type: ignore[import-untyped]

from ..base import reading
from ..base.archives import UNPACKED_SIZE_MAX, check_unpacked_size
from ..base.atomic import check_file, write
from ..base.errors import ParameterError
from ..base.names import proposal
from ..base.processes import process_count
from ..base.progress import Progress
from ..runs.inputs import filled, placeholders, read_signal
from ..runs.run import ROWS_MAX
from .design import drawn
from .fmu import Job
from .journal import Journal, Point, compare
from .outputs import GOOD, Outcome, Output, parse_output
from .runner import Runner, StudyError

if TYPE_CHECKING:
    import pandas as pd

EXTRA = ("pandas", "pyarrow")
REMEDY = 'install the packages for sweeps with: python -m pip install "prbm-impact[sweep]"'

RESET_RUNS_MIN = 20  # Runs per process from which on a check of the FMU's reset pays off.
STEPS = 1000  # Communication steps for an FMU without a proposed step.
FILES = (".csv", ".feather", ".h5", ".json", ".mat", ".ods", ".tsv", ".txt", ".xls", ".xlsx")
"""Suffixes rejected for the results, which are a Parquet file."""
ROW, STATUS, MESSAGE = OWN = ("row", "status", "message")
"""Columns of every table; no parameter or output may have these names."""
SETTINGS = b"prbm.settings"  # Key of the settings in the metadata of the Parquet file.
Outputs = Sequence[str] | Mapping[str, str]


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
    scheduler: str | Executor | None = None,
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
        Parquet file of the results.  If it has runs of the same sweep, only the missing runs are
        computed; rows may have been added to the table since then.  The rows are in
        ``OUT.partial`` (CSV) until the table is complete, and remain there after an interruption.
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
    scheduler : str, Executor or None
        Address of a Dask scheduler, as ``tcp://host:8786``, whose workers need this package; or a
        ``concurrent.futures`` executor, such as that of ``Client.get_executor()``.  None: this
        machine.
    workers : int or None
        Number of parallel runs; None: one per core of this machine, or those of the executor.
    retries : int
        Number of repetitions of a run whose process crashed.
    timeout : float or None
        Longest duration of a run [s]; None: no limit.
    overwrite : bool
        Replace earlier results in ``out`` (default: False).
    retry_failed : bool
        Repeat failed runs (default: False).
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Returns
    -------
    DataFrame
        In the order of the table: ``row`` (from 0), its parameters, the outputs (float64; NaN
        for a failed run), ``status`` (``ok``; ``ended``: by the FMU, before ``stop_time``;
        ``failed``, ``crashed``, ``timeout``) and ``message``.  Runs that are repeated or continued
        give the same bytes.

    Raises
    ------
    ParameterError
        If the table, an output, a setting or ``out`` is invalid, ``out`` has the results of another
        sweep, or another sweep is writing to it.
    StudyError
        If the FMU cannot be read or loaded, the scheduler does not respond, or a package is not
        installed.
    KeyboardInterrupt
        After Ctrl-C, with the number of completed runs, which are kept.
    """
    _check_packages("distributed" if isinstance(scheduler, str) else "pandas")
    out = Path(out)
    _check_name(out)
    plan = _make_plan(fmu, table, outputs, values, inputs or {}, stop_time, step, tolerance)
    # The check of a reset doubles the duration of a run, which may exceed a timeout.
    many = len(plan.points) >= RESET_RUNS_MIN * process_count(len(plan.points), workers)
    job = replace(plan.job, reuse=many and timeout is None)
    journal = Journal(out, plan.settings, plan.parameters, plan.outputs)
    journal.known |= _earlier(plan, journal, out, overwrite)
    with (
        Runner(
            job, plan.parameters, journal, len(plan.points), workers=workers, executor=scheduler,
            retries=retries, timeout=timeout,
        ) as runner,
        journal.opened(overwrite, retry_failed),
    ):  # fmt: skip
        found = _frame(plan, runner.outcomes(plan.points, progress))
        write(out, _parquet(found, journal.settings))
        journal.remove()
    return found


def samples(
    distributions: Mapping[str, Any], n: int, seed: int = 0, method: str = "random"
) -> "pd.DataFrame":
    """Draw a table of parameters, a column for each, with :func:`prbm.sweeps.design.drawn`.

    Parameters
    ----------
    distributions : mapping
        For each parameter a frozen distribution of ``scipy.stats`` (any object with ``ppf``), or
        (low, high) for a uniform distribution; in SI units.
    n : int
        Number of rows; a power of two with ``sobol``.
    seed : int
        Seed (default: 0).  The same seed gives the same table.
    method : str
        ``random`` (default), ``latin`` or ``sobol``.

    Raises
    ------
    ParameterError
        If n or the number of parameters is zero, or a distribution or a method is invalid.

    Examples
    --------
    >>> table = samples({"stop.restitution": (0.4, 0.6)}, 4, method="latin")
    >>> sorted((table["stop.restitution"] * 20).astype(int).tolist())
    [8, 9, 10, 11]
    """
    _check_packages("pandas")
    import pandas as pd

    return pd.DataFrame(drawn(distributions, n, seed, method), columns=[*distributions])


# --- plan -------------------------------------------------------------------------


@dataclass(frozen=True)
class Plan:
    """A checked sweep.

    ``settings`` are all that the results depend on except for the table; ``points`` are the values
    of each run.
    """

    job: Job
    settings: Mapping[str, Any]
    parameters: tuple[str, ...]
    points: list[Point]

    @property
    def outputs(self) -> list[str]:
        """Columns of the outputs."""
        return [output.column for output in self.job.outputs]


def _check_packages(*names: str) -> None:
    """Check that packages of the extra ``sweep`` are installed.

    Raises
    ------
    StudyError
        If one is not installed.
    """
    for name in {*EXTRA, *names}:
        if importlib.util.find_spec(name) is None:
            raise StudyError(f"sweeps need the package {name}; {REMEDY}")


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
    first: dict[str, float] = frame.iloc[0].to_dict()  # type: ignore[assignment]
    driven = _inputs(inputs, within, description, first, {*frame, *fixed})
    job = Job(**times, values=fixed, outputs=kept, inputs=driven, content=data)
    settings = {
        "FMU": hashlib.sha256(data).hexdigest(),
        "model": description.modelName,
        "parameters": [*frame.columns],
        "outputs": {o.column: list(astuple(o)[1:]) for o in kept},
        "values": fixed,
        "inputs": {name: text for name, (text, _) in driven.items()},
        "start time [s]": job.start,
        "stop time [s]": job.stop,
        "step [s]": job.step,
        "tolerance": job.tolerance,
    }
    points = [tuple(row) for row in frame.to_numpy(float).tolist()]
    return Plan(job, settings, tuple(frame.columns), points)


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
    StudyError
        If it cannot be read, or has no co-simulation of FMI 2.0 or 3.0.
    """
    data = reading.content(path, UNPACKED_SIZE_MAX, StudyError)
    try:
        check_unpacked_size(io.BytesIO(data))
        description = fmpy.read_model_description(io.BytesIO(data), validate=False)
    except Exception as error:  # FMPy raises plain exceptions.
        reason = " ".join(str(error).split())
        raise StudyError(f"{path} is not a readable FMU: {reason}") from None
    if not description.fmiVersion.startswith(("2", "3")) or description.coSimulation is None:
        raise StudyError(
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
    kept = tuple(parse_output(text, variables, column) for column, text in pairs)
    if not kept:
        raise ParameterError("no output is selected; name one, as in outputs=['shuttle.x']")
    check_outputs(kept, variables)
    return kept


def _unambiguous(parameters: Sequence[str], outputs: Sequence[str]) -> None:
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
            f"out = {out}: the results are a Parquet file, not a {out.suffix} file; choose a name "
            f"such as {out.with_suffix('.parquet')}; pandas.read_parquet(name).to_csv(...) makes a "
            "CSV file of it"
        )
    check_file(out)


# --- results --------------------------------------------------------------------------------------


def _frame(plan: Plan, outcomes: Sequence[Outcome]) -> "pd.DataFrame":
    """Return the table of results."""
    import pandas as pd

    nothing = (math.nan,) * len(plan.outputs)
    rows = [
        (k, *point, *(outcome.values or nothing), outcome.status, outcome.message)
        for k, (point, outcome) in enumerate(zip(plan.points, outcomes, strict=True))
    ]
    return pd.DataFrame(rows, columns=[ROW, *plan.parameters, *plan.outputs, STATUS, MESSAGE])


def _parquet(found: "pd.DataFrame", settings: Mapping[str, Any]) -> bytes:
    """Return the content of a Parquet file of results and their settings."""
    import pyarrow as pa  # type: ignore[import-untyped]
    import pyarrow.parquet as pq  # type: ignore[import-untyped]

    table = pa.Table.from_pandas(found, preserve_index=False)
    notes = {**table.schema.metadata, SETTINGS: json.dumps(settings).encode()}
    content = io.BytesIO()
    pq.write_table(table.replace_schema_metadata(notes), content)
    return content.getvalue()


def _earlier(plan: Plan, journal: Journal, out: Path, overwrite: bool) -> dict[Point, Outcome]:
    """Return the rows of a complete table of the same sweep, if there is one.

    Raises
    ------
    ParameterError
        If the file has no sweep; or, unless it is to be overwritten, another one or other rows.
    """
    if not out.exists():
        return {}
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(out)
        settings = json.loads((table.schema.metadata or {})[SETTINGS])
    except KeyError:
        raise ParameterError(
            f"{out} exists but contains no sweep; give another name for the results"
        ) from None
    except (OSError, ValueError, RecursionError) as error:  # Errors of pyarrow are subclasses.
        if overwrite:
            return {}
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise ParameterError(
            f"{out} cannot be read ({reason}); give another name for the results, or overwrite "
            "them (--overwrite)"
        ) from None
    if overwrite:
        return {}
    compare(f"{out} contains a sweep", settings, journal.settings)
    found = {}
    for k, row in enumerate(table.to_pylist()):
        point = tuple(row[name] for name in plan.parameters)
        if k >= len(plan.points) or point != plan.points[k]:
            raise ParameterError(
                f"{out} contains a sweep over another table: row {k} "
                f"{'is missing now' if k >= len(plan.points) else 'has changed'}; give another "
                "name for the results, or overwrite them (--overwrite)"
            )
        values = tuple(row[name] for name in plan.outputs) if row[STATUS] in GOOD else ()
        found[point] = Outcome(row[STATUS], row[MESSAGE], values=values)
    return found


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
