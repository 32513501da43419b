"""Compare the FMUs of two versions: interface, default runs, number of impacts.

    python build_fmu.py --out new            # in the clone of this version
    python build_fmu.py --out old            # in the clone of the other version
    python benchmarks/versions.py old new

For every FMU in both folders, it prints

* the variables whose name, value reference, type, causality or start value differ;
* the largest difference of the continuous outputs of the default run, per unit, up to the time at
  which the two runs diverge (a difference of lengths above ``--divergence``), and that time;
* the number of impacts of every stop in both runs.

The exit status is 1 if an interface differs, a run differs by more than 1e-9 m before it diverges,
or a number of impacts differs.

    python benchmarks/versions.py old new --time 100 --only fmi2/PRBDM2R.fmu

prints the CPU time of the steps of the default run instead.  Both FMUs run in turn, 100 times each.
The ratios are those of the new time to the old time, for the medians and for the shortest times.

    python benchmarks/versions.py old new --instructions 1000 --only fmi2/PRBDM2R.fmu

prints the instructions of the first 1000 steps of the default run, which valgrind counts.
"""

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))

from c_importer import Job, unpack
from native import counted

LENGTH_ATOL = 1e-9  # Largest difference of lengths before the runs diverge [m].
KINDS = ("ModelExchange", "CoSimulation")


def interface(path: Path) -> dict[str, tuple[Any, ...]]:
    """Return the properties of each variable of an FMU by its name."""
    description = fmpy.read_model_description(str(path))
    return {
        v.name: (v.valueReference, v.type, v.causality, v.variability, v.start)
        for v in description.modelVariables
    }


def run(path: Path, kind: str) -> Any:
    """Return the default run of an FMU, all outputs by name."""
    description = fmpy.read_model_description(str(path))
    outputs = [v for v in description.modelVariables if v.causality == "output"]
    clocks = any(v.type == "Clock" for v in outputs)
    return fmpy.simulate_fmu(
        str(path),
        fmi_type=kind,
        output=[v.name for v in outputs if v.type != "Clock"],
        use_event_mode=clocks,
        early_return_allowed=clocks,
    )


def units(path: Path) -> dict[str, str]:
    """Return the units of the continuous outputs by name."""
    description = fmpy.read_model_description(str(path))
    return {
        v.name: v.unit or (v.declaredType.unit if v.declaredType else None) or "-"
        for v in description.modelVariables
        if v.causality == "output" and v.variability == "continuous"
    }


def compared(old: Path, new: Path, kind: str, divergence: float) -> Iterator[tuple[str, bool]]:
    """Yield lines that compare the default runs of two FMUs, and whether each is within limits."""
    before, after = run(old, kind), run(new, kind)
    rows = min(len(before), len(after))
    unit = units(new)
    lengths = [name for name in unit if unit[name] == "m" and name in before.dtype.names]
    gap = np.max([np.abs(before[n][:rows] - after[n][:rows]) for n in lengths], axis=0)
    apart = np.flatnonzero(gap > divergence)
    end = int(apart[0]) if len(apart) else rows
    worst: dict[str, float] = {}
    for name, symbol in unit.items():
        if name in before.dtype.names and end:
            off = float(np.abs(before[name][:end] - after[name][:end]).max())
            worst[symbol] = max(worst.get(symbol, 0.0), off)
    until = f"until {before['time'][end - 1]:g} s" if end < rows else "to the end"
    text = ", ".join(f"{off:.1e} {symbol}" for symbol, off in sorted(worst.items()) if off)
    agrees = worst.get("m", 0.0) <= LENGTH_ATOL
    yield f"{kind}: {text or 'the same bits'} {until}", agrees
    for name in before.dtype.names:
        if name.endswith("impact_count"):
            counts = int(before[name][-1]), int(after[name][-1])
            yield f"{kind}: {name} {counts[0]} and {counts[1]}", counts[0] == counts[1]


def report(old: Path, new: Path, divergence: float) -> bool:
    """Print the comparison of two FMUs; return whether they agree."""
    good = True
    one, other = interface(old), interface(new)
    for name in sorted(one.keys() | other.keys()):
        if one.get(name) != other.get(name):
            good = False
            print(f"  {name}: {one.get(name)} and {other.get(name)}")
    description = fmpy.read_model_description(str(new))
    kinds = (description.modelExchange, description.coSimulation)
    for kind, supported in zip(KINDS, kinds, strict=True):
        if supported is not None:
            for line, fine in compared(old, new, kind, divergence):
                good &= fine
                print(f"  {line}{'' if fine else '   <-- differs'}")
    return good


def stepper(path: Path, folder: Path) -> Callable[[], float]:
    """Return a function that makes the steps of the default run and returns their CPU time [s]."""
    description = fmpy.read_model_description(str(path))
    unpacked = fmpy.extract(str(path), unzipdir=str(folder))
    slave = fmpy.instantiate_fmu(unpacked, description, fmi_type="CoSimulation")
    experiment = description.defaultExperiment
    step, stop = float(experiment.stepSize), float(experiment.stopTime)

    def run_once() -> float:
        slave.reset()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        begin = time.process_time()
        for k in range(round(stop / step)):
            slave.doStep(currentCommunicationPoint=k * step, communicationStepSize=step)
        return time.process_time() - begin

    return run_once


def timed(old: Path, new: Path, pairs: int) -> None:
    """Print the CPU times of the default runs of two FMUs of FMI 2.0, in alternating runs."""
    with tempfile.TemporaryDirectory() as name:
        runs = [stepper(path, Path(name) / str(i)) for i, path in enumerate((old, new))]
        spent: list[list[float]] = [[], []]
        for _ in range(pairs):
            for times, one in zip(spent, runs, strict=True):
                times.append(one())
    medians, best = ([f(times) for times in spent] for f in (statistics.median, min))
    ratio = statistics.median(b / a for a, b in zip(*spent, strict=True))
    print(
        f"  {pairs} pairs: medians {1e3 * medians[0]:.3f} and {1e3 * medians[1]:.3f} ms "
        f"(new / old {medians[1] / medians[0]:.3f}), best {1e3 * best[0]:.3f} and "
        f"{1e3 * best[1]:.3f} ms ({best[1] / best[0]:.3f}), median of ratios {ratio:.3f}"
    )


def instructions(path: Path, steps: int) -> int:
    """Return the instructions of the first steps of the default run of an FMU of FMI 2.0."""
    description = fmpy.read_model_description(str(path))
    points = float(description.defaultExperiment.stepSize) * np.arange(steps + 1)
    output = next(v.name for v in description.modelVariables if v.causality == "output")
    with tempfile.TemporaryDirectory() as name:
        job = Job(unpack(path, Path(name) / "model"), points=points, records=(output,))
        [(_, total)] = counted(job, ("fmi2DoStep",))
        return total


def main() -> int:
    """Compare all FMUs that two folders have in common; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("old", type=Path, help="folder of FMUs of one version")
    parser.add_argument("new", type=Path, help="folder of FMUs of the other version")
    parser.add_argument(
        "--divergence", type=float, default=1e-7, metavar="LENGTH",
        help="difference at which chaotic runs count as diverged (default: 1e-7 m)",
    )  # fmt: skip
    parser.add_argument("--only", metavar="FMU", help="path of one FMU below both folders")
    parser.add_argument("--time", type=int, metavar="PAIRS", help="measure the CPU time instead")
    parser.add_argument(
        "--instructions", type=int, metavar="STEPS", help="count the instructions of steps instead"
    )
    options = parser.parse_args()
    common = sorted(
        path.relative_to(options.old)
        for path in options.old.rglob("*.fmu")
        if (options.new / path.relative_to(options.old)).exists()
        and options.only in (None, path.relative_to(options.old).as_posix())
    )
    if not common:
        parser.error(f"{options.old} and {options.new} have no FMU in common")
    good = True
    for path in common:
        print(path)
        if options.time:
            timed(options.old / path, options.new / path, options.time)
            continue
        if options.instructions:
            before, after = (
                instructions(folder / path, options.instructions)
                for folder in (options.old, options.new)
            )
            print(f"  {before:,} and {after:,} instructions (new / old {after / before:.3f})")
            continue
        good &= report(options.old / path, options.new / path, options.divergence)
    if not (options.time or options.instructions):
        print("the versions agree" if good else "the versions differ")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
