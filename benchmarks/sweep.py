"""Overhead of a study compared with its simulation alone, and speed-up by a second worker.

    python build_fmu.py --model PRBDM2R
    python benchmarks/sweep.py
    python benchmarks/sweep.py --stop-time 0.001 --runs 2000

Each run is a second of the 2R guide in a thousand steps, with random restitution and offset; two
final values and two reductions of one output are kept.  A sweep of the FMU is compared with the
same FMU in a bare loop (reset, start values, initialization, steps, one output after each), and
with FMPy's ``simulate_fmu``.  A study of the mechanism is compared with a loop over its simulation
in the kernel.  The loops run in one process.

All of them alternate over the rows of one table, and the script prints medians: wall time, which
depends on other work on the machine, and the processor time of all processes, both with the start
of the workers; and the ratios to the loops within each round.
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

from prbm.files.mechanism_file import load
from prbm.mechanism.description import Mechanism
from prbm.runs.run import sampled
from prbm.sweeps.study import study
from prbm.sweeps.sweep import samples

STEP, TOLERANCE = 1e-3, 1e-8
READ = "shuttle.vx"
OUTPUTS = ["stop.impact_count", "stop.impact_time", "max(shuttle.vx)", "mean(shuttle.vx)"]
RANGES = {"stop.restitution": (0.4, 0.8), "stop.offset": (-4e-3, 4e-3)}
FMU, KERNEL = "FMU alone", "kernel alone"


@dataclass(frozen=True)
class Cost:
    """Mean wall time and processor time of a run [s]."""

    wall: float
    processor: float


def measured(work: Callable[[], object], runs: int) -> Cost:
    """Return the cost of a run of some work, with that of the processes it has ended."""
    wall, processor = time.perf_counter(), used()
    work()
    wall, processor = time.perf_counter() - wall, used() - processor
    return Cost(wall / runs, processor / runs)


def used() -> float:
    """Return the processor time of this process and of those that it has ended [s]."""
    ended = os.times()
    return time.process_time() + ended.children_user + ended.children_system


def studied(model: Mechanism | Path, table: pd.DataFrame, stop_time: float, workers: int) -> None:
    """Run a study, with its table in a file."""
    with tempfile.TemporaryDirectory() as folder:
        results = study(
            model, table, OUTPUTS, stop_time=stop_time, step=STEP, tolerance=TOLERANCE,
            workers=workers, table=Path(folder) / "results.parquet",
        )  # fmt: skip
    if results.messages and any(results.messages):
        sys.exit("runs failed: " + "; ".join(set(results.messages)))


def bare(folder: str, table: pd.DataFrame, stop_time: float) -> None:
    """Run the unpacked FMU in a loop."""
    description = fmpy.read_model_description(folder)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    instance = fmpy.instantiate_fmu(folder, description, fmi_type="CoSimulation")
    for row in table.to_dict("records"):
        instance.reset()
        instance.setupExperiment(tolerance=TOLERANCE, startTime=0.0, stopTime=stop_time)
        instance.setReal([reference[name] for name in row], [*row.values()])
        instance.enterInitializationMode()
        instance.exitInitializationMode()
        for k in range(round(stop_time / STEP)):
            instance.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
            instance.getReal([reference[READ]])
        instance.terminate()
    instance.freeInstance()


def one_by_one(folder: str, table: pd.DataFrame, stop_time: float) -> None:
    """Run the unpacked FMU with FMPy's simulate_fmu."""
    for row in table.to_dict("records"):
        fmpy.simulate_fmu(
            folder, stop_time=stop_time, output_interval=STEP, relative_tolerance=TOLERANCE,
            start_values=row, output=["stop.impact_count", "stop.impact_time", READ],
        )  # fmt: skip


def kernel(mechanism: Mechanism, table: pd.DataFrame, stop_time: float) -> None:
    """Run the mechanism in a loop."""
    options = {"stop_time": stop_time, "step": STEP, "tolerance": TOLERANCE}
    for row in table.to_dict("records"):
        sampled(mechanism, row, [READ, "stop.impact_count", "stop.impact_time"], **options)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table of costs."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--fmu", type=Path, default=Path("dist/fmi2/PRBDM2R.fmu"), help="FMU of FMI 2.0 of the 2R"
    )
    for name, default, meaning in (
        ("--runs", 500, "rows of the table of each round"),
        ("--loops", 100, "rows of the loops for comparison"),
        ("--rounds", 7, "rounds"),
    ):
        parser.add_argument(
            name, type=int, default=default, help=f"{meaning} (default: %(default)s)"
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
    few, mechanism = table[: options.loops], load("PRBDM2R")
    with tempfile.TemporaryDirectory() as folder:
        fmpy.extract(options.fmu, unzipdir=folder)
        works: dict[str, tuple[Callable[[], object], int]] = {
            FMU: (lambda: bare(folder, few, stop_time), len(few)),
            "simulate_fmu": (lambda: one_by_one(folder, few, stop_time), len(few)),
            KERNEL: (lambda: kernel(mechanism, few, stop_time), len(few)),
        }
        for workers in options.workers:
            each = f"{workers} worker{'s' if workers > 1 else ''}"
            for name, model in (("sweep", options.fmu), ("study", mechanism)):
                works[f"{name}, {each}"] = (
                    lambda model=model, n=workers: studied(model, table, stop_time, n),
                    len(table),
                )
        rounds = [
            {name: measured(*work) for name, work in works.items()} for _ in range(options.rounds)
        ]
    report(rounds, options.workers)


def report(rounds: Sequence[dict[str, Cost]], workers: Sequence[int]) -> None:
    """Print the medians of the rounds, and those of the ratios within each round."""
    print(f"medians of {len(rounds)} rounds; load of the machine {os.getloadavg()[0]:.1f}")
    print(f"{'cost of a run':<20}{'wall [ms]':>11}{'CPU [ms]':>11}{'CPU / alone':>13}")
    for name in rounds[0]:
        wall = statistics.median(costs[name].wall for costs in rounds)
        processor = statistics.median(costs[name].processor for costs in rounds)
        rival = KERNEL if name.startswith(("study", KERNEL)) else FMU
        ratio = statistics.median(c[name].processor / c[rival].processor for c in rounds)
        print(f"{name:<20}{1e3 * wall:11.2f}{1e3 * processor:11.2f}{ratio:13.2f}")
    for kind in ("sweep", "study") if len(workers) > 1 else ():
        first, last = ([n for n in rounds[0] if n.startswith(kind)][k] for k in (0, -1))
        ratio = statistics.median(costs[first].wall / costs[last].wall for costs in rounds)
        print(f"{kind}: from {workers[0]} to {workers[-1]} workers: x {ratio:.2f}")


if __name__ == "__main__":
    main()
