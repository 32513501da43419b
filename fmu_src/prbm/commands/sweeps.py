"""``prbm sweep``: one simulation of an FMU per row of a table."""

import argparse

from ..base.progress import reporter
from ..files.settings import assigned, optional_quantity
from ..sweeps.fmu_model import FmuModel
from ..sweeps.sweep import summary, sweep
from .duration import given_inputs, times


def run_sweep(options: argparse.Namespace) -> None:
    """Run a sweep and print a summary; results are written during the sweep."""
    values = assigned(FmuModel(options.fmu).units, options.set) if options.set else {}
    found = sweep(
        options.fmu, options.table, options.out, outputs=options.output, values=values,
        inputs=given_inputs(options), **times(options), scheduler=options.scheduler,
        workers=options.workers, retries=options.retries,
        timeout=optional_quantity(options.timeout, "s", "--timeout"), overwrite=options.overwrite,
        retry_failed=options.retry_failed, progress=reporter(),
    )  # fmt: skip
    print(summary(found, options.out))
