"""Compare the CPU time of the Python engine in two clones, in alternating runs.

    git worktree add ../old cd58217e          # version 0.2
    python benchmarks/python_engine.py ../old . --runs 7

For every mechanism, it prints the medians of the CPU time of the first part of its default
experiment, without the start of the process, and the ratio of the second clone to the first.
"""

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

MODELS = {"PRBDM": 0.3, "PRBDM2R": 0.2, "GuideBeam": 0.1, "NotchGuide": 0.05}
"""Simulated times [s] by mechanism."""
WORKER = """
import sys, time
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.runs.run import simulate
mechanism = read_mechanism(shipped()[sys.argv[1]])
for line in sys.stdin:
    begin = time.process_time()
    simulate(mechanism, stop_time=float(line), engine="python")
    print(time.process_time() - begin, flush=True)
"""


def worker(clone: Path, model: str) -> "subprocess.Popen[str]":
    """Return a process that simulates a mechanism with the engine of a clone."""
    surroundings = {
        **os.environ, "PYTHONPATH": str(clone.resolve() / "fmu_src"), "OPENBLAS_NUM_THREADS": "1",
    }  # fmt: skip
    return subprocess.Popen(
        [sys.executable, "-c", WORKER, model], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        text=True, env=surroundings,
    )  # fmt: skip


def cost(process: "subprocess.Popen[str]", duration: float) -> float:
    """Return the CPU time of a simulation [s]."""
    assert process.stdin
    assert process.stdout
    process.stdin.write(f"{duration}\n")
    process.stdin.flush()
    return float(process.stdout.readline())


def main() -> None:
    """Print a line for each mechanism."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("clones", type=Path, nargs=2, metavar="CLONE")
    parser.add_argument("--runs", type=int, default=7, help="runs of each engine (default: 7)")
    parser.add_argument("--model", action="append", choices=MODELS, help="default: all")
    options = parser.parse_args()
    for model in options.model or MODELS:
        processes = [worker(clone, model) for clone in options.clones]
        spent: list[list[float]] = [[], []]
        for run in range(options.runs + 1):
            for times, process in zip(spent, processes, strict=True):
                found = cost(process, MODELS[model])
                times += [found] if run else []  # The first run imports and computes constants.
        for process in processes:
            process.communicate()
        old, new = map(statistics.median, spent)
        ratio = statistics.median(b / a for a, b in zip(*spent, strict=True))
        print(
            f"{model:12s} {MODELS[model]:5.2f} s  {1e3 * old:8.1f} ms  {1e3 * new:8.1f} ms  "
            f"ratio of medians {new / old:.3f}, median of ratios {ratio:.3f}"
        )


if __name__ == "__main__":
    main()
