"""What a simulated second costs: the exported FMUs beside the source's algorithm in Octave.

    python build_fmu.py
    python benchmarks/speed.py --dist dist/python

Of an FMU only the stepping loop counts: the calls of fmi2DoStep and the reading of one output
after each, through FMPy, over the default run (with its impacts) at the tolerance 1e-6.  Of
the Octave script only its time loop counts, at the source's fixed step of 2^-15 s, until 8 ms
after the first impact.  Extracting, loading and initialising are left out of both.
"""

import argparse
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import fmpy

MODELS = {"1R": "PRBDM.fmu", "2R": "PRBDM2R.fmu"}
STOP_TIME, STEP = 1.0, 1e-3  # [s]
TOLERANCE = 1e-6
OUTPUT = "shuttle.x"
OCTAVE_SCRIPT = Path(__file__).with_name("source_algorithm.m")


def fmu_cost(path: Path, runs: int) -> float:
    """Median time of the stepping loop of an FMU over its simulated time [-].

    Parameters
    ----------
    path : Path
        An FMI 2.0 co-simulation FMU with the parameter `solver.tolerance`.
    runs : int
        Repetitions, all with one instance, which is reset between them.

    Returns
    -------
    float
    """
    description = fmpy.read_model_description(path)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    with tempfile.TemporaryDirectory() as folder:
        fmpy.extract(path, unzipdir=folder)
        fmu = fmpy.instantiate_fmu(folder, description, fmi_type="CoSimulation")
        durations = []
        for _ in range(runs):
            fmu.setReal([reference["solver.tolerance"]], [TOLERANCE])
            fmu.setupExperiment(tolerance=TOLERANCE, startTime=0.0, stopTime=STOP_TIME)
            fmu.enterInitializationMode()
            fmu.exitInitializationMode()
            started = time.perf_counter()
            for step in range(round(STOP_TIME / STEP)):
                fmu.doStep(currentCommunicationPoint=step * STEP, communicationStepSize=STEP)
                fmu.getReal([reference[OUTPUT]])
            durations.append(time.perf_counter() - started)
            fmu.terminate()
            fmu.reset()
        fmu.freeInstance()
    return statistics.median(durations) / STOP_TIME


def octave_cost(octave: str, runs: int) -> dict[str, float]:
    """Median times of the source's algorithm over its simulated time, by model [-]."""
    command = [octave, "--no-gui", "--quiet", str(OCTAVE_SCRIPT)]
    costs: dict[str, list[float]] = {model: [] for model in MODELS}
    for _ in range(runs):
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{OCTAVE_SCRIPT.name} failed: {done.stderr.strip()}")
        for line in done.stdout.splitlines():
            model, cost = line.split()
            costs[model].append(float(cost))
    return {model: statistics.median(values) for model, values in costs.items()}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--dist", type=Path, default=Path("dist/python"), help="where the FMUs are")
    parser.add_argument("--runs", type=int, default=5, help="runs of which to take the median")
    arguments = parser.parse_args()

    paths = {model: arguments.dist / name for model, name in MODELS.items()}
    for path in paths.values():
        if not path.is_file():
            sys.exit(f"{path} does not exist; `python build_fmu.py` builds it.")
    ours = {model: fmu_cost(path, arguments.runs) for model, path in paths.items()}

    octave = shutil.which("octave-cli")
    theirs = octave_cost(octave, arguments.runs) if octave else {}

    print(f"Seconds per simulated second, median of {arguments.runs} runs; stepping loops only")
    print(f"{'model':<6}{'FMU':>10}" + (f"{'Octave':>10}{'ratio':>8}" if theirs else ""))
    for model, cost in ours.items():
        beside = f"{theirs[model]:10.1f}{theirs[model] / cost:8.0f}" if theirs else ""
        print(f"{model:<6}{cost:10.4f}{beside}")
    if not octave:
        print("octave-cli is not installed, so the source's algorithm was not timed.")


if __name__ == "__main__":
    main()
