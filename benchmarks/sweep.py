"""Overhead of a sweep compared with its FMU alone, and speed-up by a second worker.

    python build_fmu.py --model PRBDM2R
    python benchmarks/sweep.py
    python benchmarks/sweep.py --stop-time 0.001

Each run is a second of the 2R guide in a thousand steps, with random restitution and offset; two
final values and two reductions of one output are kept.  The sweep is compared with the same FMU in
a bare loop (reset, start values, initialization, steps, one output after each) and with FMPy's
``simulate_fmu``, both in one process and over rows of the same table.

The script prints wall time (for the loops: medians), which depends on other work on the machine,
and the processor time of all processes of the run, which hardly depends on it.
"""

import argparse
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy
import pandas as pd

from prbm.base.progress import reporter
from prbm.sweeps.sweep import samples, sweep

STEP, TOLERANCE = 1e-3, 1e-8
READ = "shuttle.vx"
OUTPUTS = ["stop.impact_count", "stop.impact_time", "max(shuttle.vx)", "mean(shuttle.vx)"]
RANGES = {"stop.restitution": (0.4, 0.8), "stop.offset": (-4e-3, 4e-3)}


@dataclass(frozen=True)
class Cost:
    """Wall time and mean processor time of a run [s]."""

    wall: float
    processor: float


def swept(fmu: Path, table: pd.DataFrame, stop_time: float, workers: int) -> Cost:
    """Return the cost of a run in a sweep, including the start of the workers."""
    with tempfile.TemporaryDirectory() as folder:
        wall, processor = time.perf_counter(), _processor()
        results = sweep(
            fmu, table, Path(folder) / "results.parquet", outputs=OUTPUTS,
            stop_time=stop_time, step=STEP, tolerance=TOLERANCE, workers=workers,
            progress=reporter(),
        )  # fmt: skip
        wall, processor = time.perf_counter() - wall, _processor() - processor
    if (results["status"] != "ok").any():
        sys.exit("runs failed: " + "; ".join(results["message"].unique()))
    return Cost(wall / len(table), processor / len(table))


def _processor() -> float:
    """Return the processor time of this process and of its finished children [s]."""
    return sum(os.times()[:4])


def bare(fmu: Path, table: pd.DataFrame, stop_time: float) -> Cost:
    """Return the cost of a run in a bare loop over the FMU."""
    description = fmpy.read_model_description(fmu)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    with tempfile.TemporaryDirectory() as folder:
        fmpy.extract(fmu, unzipdir=folder)
        instance = fmpy.instantiate_fmu(folder, description, fmi_type="CoSimulation")

        def run(row: dict[str, float]) -> None:
            instance.reset()
            instance.setupExperiment(tolerance=TOLERANCE, startTime=0.0, stopTime=stop_time)
            instance.setReal([reference[name] for name in row], [*row.values()])
            instance.enterInitializationMode()
            instance.exitInitializationMode()
            for k in range(round(stop_time / STEP)):
                instance.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
                instance.getReal([reference[READ]])
            instance.terminate()

        cost = _each(run, table)
        instance.freeInstance()
    return cost


def one_by_one(fmu: Path, table: pd.DataFrame, stop_time: float) -> Cost:
    """Return the cost of a run with FMPy's simulate_fmu and the unpacked FMU."""
    names = ["stop.impact_count", "stop.impact_time", READ]
    with tempfile.TemporaryDirectory() as folder:
        fmpy.extract(fmu, unzipdir=folder)
        return _each(
            lambda row: fmpy.simulate_fmu(
                folder, stop_time=stop_time, output_interval=STEP, relative_tolerance=TOLERANCE,
                start_values=row, output=names,
            ),
            table,
        )  # fmt: skip


def _each(run: Callable[[dict[str, float]], object], table: pd.DataFrame) -> Cost:
    walls, processors = [], []
    for row in table.to_dict("records"):
        wall, processor = time.perf_counter(), time.process_time()
        run(row)
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    return Cost(statistics.median(walls), statistics.mean(processors))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table of costs."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--fmu", type=Path, default=Path("dist/fmi2/PRBDM2R.fmu"), help="FMU of FMI 2.0"
    )
    parser.add_argument(
        "--runs", type=int, default=10000, help="rows of the table (default: %(default)s)"
    )
    parser.add_argument(
        "--loops",
        type=int,
        default=200,
        help="rows of the loops for comparison (default: %(default)s)",
    )
    parser.add_argument(
        "--workers", type=int, nargs="+", default=[1, 2], help="numbers of workers (default: 1 2)"
    )
    parser.add_argument("--stop-time", type=float, default=1.0, help="duration of a run [s] "
                        "(default: 1); with 0.001, one step, the overhead dominates")  # fmt: skip
    options = parser.parse_args(arguments)
    if not options.fmu.is_file():
        sys.exit(f"{options.fmu} does not exist; build it with `python build_fmu.py`")

    table, stop_time = samples(RANGES, options.runs, method="latin"), options.stop_time
    few = table[: options.loops]
    rows = {"FMU alone (before)": bare(options.fmu, few, stop_time)}
    rows["simulate_fmu"] = one_by_one(options.fmu, few, stop_time)
    for workers in options.workers:
        name = f"sweep, {workers} worker{'s' if workers > 1 else ''}"
        rows[name] = swept(options.fmu, table, stop_time, workers)
    rows["FMU alone (after)"] = bare(options.fmu, few, stop_time)

    print(f"{options.runs} runs of {stop_time:g} s; load of the machine {os.getloadavg()[0]:.1f}")
    print(f"{'cost of a run':<20}{'wall [ms]':>11}{'CPU [ms]':>11}{'runs/s':>9}")
    for name, cost in rows.items():
        wall, processor = 1e3 * cost.wall, 1e3 * cost.processor
        print(f"{name:<20}{wall:11.2f}{processor:11.2f}{1.0 / cost.wall:9.1f}")
    alone = statistics.mean(rows[f"FMU alone ({when})"].processor for when in ("before", "after"))
    for name, cost in rows.items():
        if name.startswith("sweep"):
            print(f"{name}: {1e3 * (cost.processor - alone):.2f} ms CPU in addition to the FMU")
    if len(options.workers) > 1:
        first, *_, last = (rows[name].wall for name in rows if name.startswith("sweep"))
        print(f"from {options.workers[0]} to {options.workers[-1]} workers: x {first / last:.2f}")


if __name__ == "__main__":
    main()
