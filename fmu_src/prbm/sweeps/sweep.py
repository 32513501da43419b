"""Studies of an FMU: from a table of parameters to a table of results."""

import importlib.util
from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import ParameterError
from ..base.progress import Progress
from .design import drawn
from .fmu_model import FmuModel
from .plan import Outputs, Plan
from .runner import StudyError
from .study import computed

if TYPE_CHECKING:
    import pandas as pd

FILES = (".csv", ".feather", ".h5", ".json", ".mat", ".ods", ".tsv", ".txt", ".xls", ".xlsx")
"""Suffixes rejected for the results, which are a Parquet file."""


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
    timeout: float | str | None = None,
    overwrite: bool = False,
    retry_failed: bool = False,
    progress: Progress | None = None,
) -> "pd.DataFrame":
    """Run an FMU once for each row of a table, and return a table of results.

    Parameters
    ----------
    fmu : str or Path
        An FMU of FMI 2.0 or 3.0 with co-simulation.
    table : DataFrame, str or Path
        One column per variable, with its name, and one row per run; or a CSV or Parquet file of
        such a table.  The units are those of the FMU: SI for the FMUs of this project.
    out : str or Path
        Parquet file of the results.  If it has runs of the same sweep, only the missing runs are
        computed; rows may have been added to the table since then.
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
    stop_time, step, tolerance : float
        End of the runs [s], communication step [s], relative tolerance; None: those of the FMU's
        default experiment, or else 1 s, a thousandth of the run, no tolerance.
    scheduler : str, Executor or None
        As ``executor`` of :func:`prbm.study`.
    inputs, workers, retries, timeout, overwrite, retry_failed, progress
        As for :func:`prbm.study`.

    Returns
    -------
    DataFrame
        In the order of the table: ``row`` (from 0), its parameters, the outputs (float64; NaN
        for a failed run), ``status`` (``ok``; ``ended``: by the FMU, before ``stop_time``;
        ``failed``, ``crashed``, ``timeout``) and ``message``.

    Raises
    ------
    ParameterError
        If the table, an output, a setting or ``out`` is invalid, ``out`` has the results of another
        sweep, or another sweep is writing to it.
    StudyError
        If the FMU cannot be read or loaded, the scheduler does not respond, or a package is not
        installed.
    """
    _check_packages(*["distributed"] * isinstance(scheduler, str))
    out = Path(out)
    if out.suffix.lower() in FILES:
        raise ParameterError(
            f"out = {out}: the results are a Parquet file, not a {out.suffix} file; choose a name "
            f"such as {out.with_suffix('.parquet')}; pandas.read_parquet(name).to_csv(...) makes a "
            "CSV file of it"
        )
    model = FmuModel(fmu)
    plan = Plan(
        model, table, model.outputs if outputs is None else outputs, values=values,
        inputs=inputs, stop_time=stop_time, step=step, tolerance=tolerance,
    )  # fmt: skip
    computed(
        plan, out, parquet=True, workers=workers, executor=scheduler, retries=retries,
        timeout=timeout, overwrite=overwrite, retry_failed=retry_failed, progress=progress,
    )  # fmt: skip
    import pandas as pd

    return pd.read_parquet(out)


def samples(
    distributions: Mapping[str, Any], n: int, seed: int = 0, method: str = "random"
) -> "pd.DataFrame":
    """Draw a table of parameters, a column for each.

    Parameters
    ----------
    distributions : mapping
        For each parameter a frozen distribution of ``scipy.stats`` (any object with ``ppf``), or
        (low, high) for a uniform distribution; in SI units.
    n : int
        Number of rows; a power of two with ``sobol``, whose sequence is balanced only then.
    seed : int
        The same seed gives the same table.
    method : str
        ``random``, ``latin`` or ``sobol``.

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
    _check_packages()
    import pandas as pd

    return pd.DataFrame(drawn(distributions, n, seed, method), columns=[*distributions])


def _check_packages(*names: str) -> None:
    for name in ("pandas", "pyarrow", *names):
        if importlib.util.find_spec(name) is None:
            raise StudyError(
                f"sweeps need the package {name}; install the packages for sweeps with: python -m "
                'pip install "prbm-impact[sweep]"'
            )
