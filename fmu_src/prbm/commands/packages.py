"""``prbm ssp``: the motion of coupled FMUs in a package of SSP 1.0."""

import argparse
import time

from ..base.atomic import FileError
from ..base.errors import SimulationError
from ..base.progress import reporter
from ..files.settings import quantity
from ..runs.result import Columns, names
from ..systems import ssp
from ..systems.components import CouplingError
from .output import Output

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
    stop_time, step = (
        None if text is None else quantity(text, "s", option)
        for text, option in ((options.stop_time, "--stop-time"), (options.step, "--step"))
    )
    output = Output(options.out)
    begin, ended = time.perf_counter(), None
    try:
        columns = ssp.simulate(options.package, stop_time, step, reporter())
    except CouplingError as error:
        if error.columns is None:
            raise
        columns, ended = error.columns, error
    seconds = time.perf_counter() - begin
    print(f"simulated  {columns['time'][-1]:g} s, {len(columns)} rows, in {seconds:.2f} s")
    for line in _ranges(columns):
        print(line)
    rows = (list(row) for row in columns.tolist())
    output.table(f"{options.package.stem}.csv", names(columns), rows)
    output.write()
    if ended is not None:
        raise SimulationError(str(ended)) from None


def _ranges(columns: Columns) -> list[str]:
    """Return the lines of a table of the outputs."""
    found = [name for name in names(columns) if name != "time"]
    rows = [HEAD] + [
        (name, *(f"{float(f):.6g}" for f in (x[0], x.min(), x.max(), x[-1])))
        for name in found
        for x in [columns[name]]
    ]
    width = max(len(row[0]) for row in rows)
    return [row[0].ljust(width) + "".join(x.rjust(14) for x in row[1:]) for row in rows]
