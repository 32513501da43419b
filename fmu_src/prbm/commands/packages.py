"""``prbm ssp``: the motion of coupled FMUs in a package of SSP 1.0."""

import argparse
import sys
import time

from ..base.atomic import FileError
from ..base.errors import SimulationError
from ..base.progress import reporter
from ..files.settings import optional_quantity
from ..runs.result import Columns, names
from ..systems import ssp
from ..systems.components import CouplingError
from .output import Output, aligned

HEAD = ("output", "start", "least", "largest", "end")


def run_package(options: argparse.Namespace) -> None:
    """Simulate a package and print the ranges of its outputs.

    The table is written also if an FMU ends the simulation.

    Raises
    ------
    FileError, CouplingError
        If there is no such file, or it cannot be simulated.
    SimulationError
        If an FMU fails or ends the simulation before its end.
    """
    if not options.package.is_file():
        raise FileError(f"{options.package}: there is no such file")
    stop_time = optional_quantity(options.stop_time, "s", "--stop-time")
    step = optional_quantity(options.step, "s", "--step")
    output = Output(options.out)
    begin, ended = time.perf_counter(), None
    try:
        columns = ssp.simulate(options.package, stop_time, step, reporter(), _note)
    except CouplingError as error:
        if error.columns is None:
            raise
        columns, ended = error.columns, error
    seconds = time.perf_counter() - begin
    print(f"simulated  {columns['time'][-1]:g} s, {len(columns)} rows, in {seconds:.2f} s")
    print(_ranges(columns))
    rows = (list(row) for row in columns.tolist())
    output.table(f"{options.package.stem}.csv", names(columns), rows)
    output.write()
    if ended is not None:
        raise SimulationError(str(ended)) from None


def _note(sentence: str) -> None:
    print(f"note: {sentence}", file=sys.stderr)


def _ranges(columns: Columns) -> str:
    """Return the table of the outputs as text."""
    found = {name: columns[name] for name in names(columns) if name != "time"}
    rows = [
        [name, *(f"{float(value):.6g}" for value in (x[0], x.min(), x.max(), x[-1]))]
        for name, x in found.items()
    ]
    return aligned(HEAD, rows)
