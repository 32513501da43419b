"""CPU time of the tools: the C kernel compared with the Python engine and an earlier version.

    python benchmarks/desk.py
    python benchmarks/desk.py --old CHECKOUT [--old-python PYTHON] [--validate]

The first table has the complete command `prbm simulate`, in a new process, beside FMPy with the
native FMU of the same mechanism.  The second table has the computations of commands in one process,
after their imports and a first short run.  With --validate, it also has the time that the engine
takes within `prbm validate`.  Each computation is timed in a process of its own; all times are CPU
times of one run, with one thread for linear algebra.
"""

import argparse
import contextlib
import io
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
MODELS = {
    "PRBDM2R": "PRBDM2R",
    "gripper finger": str(ROOT / "tests" / "support" / "finger.toml"),
    "accelerometer": str(ROOT / "benchmarks" / "accelerometer.toml"),
}
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
SIMULATE = "import sys; from prbm.__main__ import main; sys.exit(main())"
FMPY = "import fmpy, sys; fmpy.simulate_fmu(sys.argv[1])"
BOUNCE = {"release.displacement": -0.01}
SPAN, STEP, SCATTER = 0.3, 1e-3, 1e-5  # Record of a fitted response [s], [s], [m].
WALLS, OFFSETS = (-0.01, 0.0, 0.01), (0.0,)  # Points of a fitted map [m].


# --- computations, in this version or in version 0.1 ----------------------------------------------


def old_version() -> bool:
    """Return whether the package on the path is version 0.1."""
    import importlib.util

    return importlib.util.find_spec("prbm_tools") is not None


def mechanism(name: str) -> Any:
    """Return a shipped mechanism."""
    if old_version():
        import mechanisms
        from prbm_tools.mechanism_file import load

        return load(Path(mechanisms.__file__).parent / f"{name}.toml")
    from prbm.files.mechanism_file import load

    return load(name)


def impact_maps() -> Any:
    """Return the module of impact maps."""
    if old_version():
        from prbm_tools import impact_map

        return impact_map
    from prbm.analysis import impact_map

    return impact_map


def run(options: dict[str, str]) -> None:
    """Simulate the default second of the 2R guide."""
    if old_version():
        from prbm_tools.simulate import simulate
    else:
        from prbm.runs.run import simulate
    simulate(mechanism("PRBDM2R"), {}, stop_time=1.0, step=STEP, **options)


def simulated_map(options: dict[str, str]) -> None:
    """Compute the map of simulated impacts with 25 points."""
    impact_maps().simulated(mechanism("PRBDM2R"), **options)


def fitted_map(options: dict[str, str]) -> None:
    """Compute three points of the map of fitted responses."""
    impact_maps().fitted(mechanism("PRBDM2R"), WALLS, OFFSETS, **options)


def response_fit(options: dict[str, str]) -> None:
    """Fit restitution and stiffness of the 1R guide to a bouncing response with scatter."""
    import numpy as np

    if old_version():
        from prbm_tools.fit import Response, fit
        from prbm_tools.records import Series
    else:
        from prbm.analysis.fit import Response, fit
        from prbm.data.series import Series
    guide, times = mechanism("PRBDM"), np.arange(0.0, SPAN, STEP)
    exact = Response(Series(times, np.zeros(len(times)), "x"), "shuttle.x", **options)
    scatter = np.random.default_rng(1).normal(0.0, SCATTER, len(times))
    record = Series(times, exact.model(guide, BOUNCE) + scatter, "x")
    target = Response(record, "shuttle.x", **options)
    fit(guide, ["stop.restitution", "flexure.K_theta"], target, BOUNCE)


TASKS: dict[str, Callable[[dict[str, str]], None]] = {
    "simulate PRBDM2R, 1 s": run,
    "fit --response, 1R, 300 samples": response_fit,
    "impact-map, simulated, 25 points": simulated_map,
    "impact-map, fitted, 3 points": fitted_map,
}
VALIDATE = "validate, share of the engine"


@contextlib.contextmanager
def timed_engine(classes: list[type]) -> Iterator[list[float]]:
    """Yield a list, of which the first item is the CPU time within methods of engines [s]."""
    spent, depth = [0.0], [0]

    def timed(method: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            begin = time.process_time()
            depth[0] += 1
            try:
                return method(*arguments, **options)
            finally:
                depth[0] -= 1
                if not depth[0]:
                    spent[0] += time.process_time() - begin

        return call

    for one in classes:
        for name in ("__init__", "advance", "outputs", "motions", "sample", "state", "set"):
            if name in vars(one):
                setattr(one, name, timed(vars(one)[name]))
    yield spent


def validate(engine: str) -> float:
    """Return the CPU time of the engine within `prbm validate` [s]."""
    if old_version():
        from prbm_tools.cli import main

        from prbm.hybrid import Simulation

        classes: list[type] = [Simulation]
    else:
        from prbm.commands.command_line import main
        from prbm.hybrid.simulation import Simulation
        from prbm.kernel.simulation import KernelSimulation
        from prbm.runs import engine as choice

        classes = [Simulation, KernelSimulation]
        if engine == "python":
            choice.kernel_available = lambda: False
        else:
            run({})  # Loads the library.
    with timed_engine(classes) as spent, contextlib.redirect_stdout(io.StringIO()):
        main(["validate"])
    return spent[0]


def work(task: str, engine: str) -> None:
    """Print the CPU time of a computation in this process [s]."""
    if task == VALIDATE:
        print(validate(engine))
        return
    options = {} if old_version() else {"engine": engine}
    call = partial(TASKS[task], options)
    if engine == "kernel":
        call()  # Loads the library, and SciPy's modules that are imported at the first use.
    else:
        mechanism("PRBDM")
    begin = time.process_time()
    call()
    print(time.process_time() - begin)


# --- comparison -----------------------------------------------------------------------------------


def environment(checkout: Path) -> dict[str, str]:
    """Return the environment of a process with the package of a checkout.

    The package is compiled to bytecode at the first import, as an installed one is.
    """
    own = {"PYTHONPATH": str(checkout / "fmu_src"), "PYTHONDONTWRITEBYTECODE": ""}
    return os.environ | dict.fromkeys(THREADS, "1") | own


def command_time(*command: str) -> float:
    """Return the CPU time of a command of this version [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            command, env=environment(ROOT), cwd=folder, check=True, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def task_time(task: str, engine: str, checkout: Path = ROOT, python: str = sys.executable) -> float:
    """Return the CPU time of a computation in a new process [s]."""
    done = subprocess.run(
        [python, __file__, "--task", task, "--engine", engine], env=environment(checkout),
        check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    return float(done.stdout.split()[-1])


def compare_commands(models: dict[str, str]) -> None:
    """Print the CPU times of `prbm simulate` and of FMPy with the native FMU."""
    from prbm.files.mechanism_file import load
    from prbm.fmu import native_fmu

    print("complete command         prbm simulate      FMPy  difference")
    with tempfile.TemporaryDirectory() as folder:
        for name, model in models.items():
            fmu = Path(folder) / "model.fmu"
            fmu.write_bytes(native_fmu.build(load(model), fmi=3, platforms=("host",)))
            ours, other = (
                min(command_time(sys.executable, "-c", *command) for _ in range(3))
                for command in ((SIMULATE, "simulate", model), (FMPY, str(fmu)))
            )
            print(f"{name:24} {ours:11.2f} s {other:7.2f} s {ours - other:+9.2f} s", flush=True)


def compare_tasks(old: Path | None, old_python: str, tasks: list[str]) -> None:
    """Print the CPU times of all computations and their ratios."""
    print("\ncomputation                            kernel        python           old")
    for task in tasks:
        kernel = task_time(task, "kernel")
        row = f"{task:34} {1e3 * kernel:7.1f} ms"
        times = [task_time(task, "python")]
        if old is not None:
            times.append(task_time(task, "old", old, old_python))
        row += "".join(f" {x:7.2f} s {x / kernel:4.0f}" for x in times)
        print(row, flush=True)
    print("the columns python and old have the time and its ratio to that of the kernel")


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    add = parser.add_argument
    add("--old", type=Path, metavar="CHECKOUT", help="checkout of version 0.1 (default: none)")
    add("--old-python", default=sys.executable, metavar="PYTHON", help="Python of version 0.1")
    add("--validate", action="store_true", help="include prbm validate, which takes minutes")
    add("--short", action="store_true", help="the first row of each table")
    add("--task", help=argparse.SUPPRESS)
    add("--engine", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.task is not None:
        work(options.task, options.engine)
        return
    sys.path.insert(0, str(ROOT / "fmu_src"))
    models = dict([*MODELS.items()][: 1 if options.short else None])
    compare_commands(models)
    old = None if options.old is None else options.old.resolve()
    tasks = [*TASKS, *([VALIDATE] if options.validate else [])]
    compare_tasks(old, options.old_python, tasks[: 1 if options.short else None])


if __name__ == "__main__":
    main()
