"""``prbm sweep``: one simulation of an FMU per row of a table."""

import argparse
from collections.abc import Sequence

from ..base.progress import reporter
from ..files.settings import assigned, optional_quantity
from ..sweeps.fmu_model import FmuModel
from ..sweeps.sweep import summary, sweep
from .duration import given_inputs


def run_sweep(options: argparse.Namespace) -> None:
    """Run a sweep and print a summary; results are written during the sweep."""
    found = sweep(
        options.fmu, options.table, options.out, outputs=options.output,
        values=_values(options.fmu, options.set), inputs=given_inputs(options),
        stop_time=optional_quantity(options.stop_time, "s", "--stop-time"),
        step=optional_quantity(options.step, "s", "--step"),
        tolerance=optional_quantity(options.tolerance, "", "--tolerance"),
        scheduler=options.scheduler, workers=options.workers, retries=options.retries,
        timeout=optional_quantity(options.timeout, "s", "--timeout"),
        overwrite=options.overwrite, retry_failed=options.retry_failed, progress=reporter(),
    )  # fmt: skip
    print(summary(found, options.out))


def _values(fmu: str, texts: Sequence[str]) -> dict[str, float]:
    """Read NAME=VALUE pairs of variables of an FMU."""
    return assigned(FmuModel(fmu).units, texts) if texts else {}
