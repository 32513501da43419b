"""Computing time per simulated second: FMUs compared with the algorithm of the thesis in Octave.

    python build_fmu.py
    python benchmarks/speed.py --dist dist/python

For an FMU, only the stepping loop is timed: fmi2DoStep and one output after each step, through
FMPy, over the default run with its impacts, at the tolerance 1e-6.  For the Octave script, only the
time loop is timed, at the fixed step of the thesis, 2^-15 s, until 8 ms after the first impact.
Extraction, loading and initialization are not included.
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
OCTAVE_SCRIPT = Path(__file__).with_name("thesis_algorithm.m")


def fmu_cost(path: Path, runs: int) -> float:
    """Return the median time of the stepping loop of an FMU over its simulated time [-].

    Parameters
    ----------
    path : Path
        An FMI 2.0 co-simulation FMU with the parameter `solver.tolerance`.
    runs : int
        Number of repetitions, with one instance that is reset between them.
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
    """Return the median times of the Octave script over its simulated time, by model [-]."""
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
    """Print the table of times."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--dist",
        type=Path,
        default=Path("dist/python"),
        help="folder of the FMUs (default: %(default)s)",
    )
    parser.add_argument("--runs", type=int, default=5, help="number of runs (default: %(default)s)")
    arguments = parser.parse_args()

    paths = {model: arguments.dist / name for model, name in MODELS.items()}
    for path in paths.values():
        if not path.is_file():
            sys.exit(f"{path} does not exist; build it with `python build_fmu.py`")
    fmu_costs = {model: fmu_cost(path, arguments.runs) for model, path in paths.items()}

    octave = shutil.which("octave-cli")
    octave_costs = octave_cost(octave, arguments.runs) if octave else {}

    print(f"Seconds per simulated second, median of {arguments.runs} runs; stepping loops only")
    print(f"{'model':<6}{'FMU':>10}" + (f"{'Octave':>10}{'ratio':>8}" if octave_costs else ""))
    for model, cost in fmu_costs.items():
        beside = (
            f"{octave_costs[model]:10.1f}{octave_costs[model] / cost:8.0f}" if octave_costs else ""
        )
        print(f"{model:<6}{cost:10.4f}{beside}")
    if not octave:
        print("octave-cli is not installed: the algorithm of the thesis was not timed.")


if __name__ == "__main__":
    main()
