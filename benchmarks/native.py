"""Cost of native FMUs: speed, accuracy, comparison with other software, instructions.

    python benchmarks/native.py
    python benchmarks/native.py --only speed overhead --runs 9

All ratios are ratios of medians within one run on one machine.  CPU time is measured, which hardly
depends on other work on the machine.

speed       the C importer of the tests simulates the default second (with its impacts) at steps of
            1 ms, with no, one and five readings per step: speed over real time, and the error of
            shuttle.x against a run at the tolerance 1e-12, for tolerances from 1e-4 to 1e-10
overhead    time of fmi2DoStep and five fmi2GetReal, called by FMPy, for this FMU and for an FMU
            with the same interface that computes nothing (trivial_fmu.c)
exudyn      cost over error of the 1R guide without its wall, for this FMU and for a model of
            bodies, joints and springs in Exudyn; errors are differences from the scalar equation
octave      time of the algorithm of the thesis in Octave (thesis_algorithm.m)
profile     instructions of a right-hand side, counted by valgrind, and the floating-point
            operations that the equations need
"""

import argparse
import importlib.util
import math
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fmu_src"))

from c_importer import Job, Result, compile_c, execute, kernel_library, native, run
from prbm.mechanics.assembly import assemble
from speed import octave_cost
from support import ScalarGuide, mechanism

Real = NDArray[np.float64]

MODELS = {"1R": "PRBDM", "2R": "PRBDM2R"}
POINTS = 1e-3 * np.arange(1001)
READ = ("shuttle.x", "shuttle.y", "stop.gap", "stop.force", "energy.kinetic")
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
REFERENCE_TOLERANCE = 1e-12
RIGHT_HAND_SIDE = ("rates_of_motion",)  # Function of the kernel in dynamics.c.
FREE = {"stop.position": 1.0}  # A wall that is never reached [m].
EXUDYN_STEPS = (1e-3, 2.5e-4, 1e-4, 2.5e-5, 1e-5)  # Each divides a millisecond [s].
TARGETS = (1e-5, 1e-6, 1e-7)  # Errors at which costs are compared [m].


# -- the C importer --


def cost(job: Job, runs: int, readings: int = len(READ)) -> float:
    """Return the median time of the stepping loop [s]."""
    done = run(job, "speed", runs, readings)
    return statistics.median(float(line) for line in done.output.split())


def motion(model: str, tolerance: float, **options: Any) -> Real:
    """Return shuttle.x at the communication points [m]."""
    job = Job(native(model, 2), points=POINTS, records=READ[:1], tolerance=tolerance, **options)
    found: Real = run(job).rows()["shuttle.x"]
    return found


def speed(runs: int) -> None:
    """Print the speed over real time and the errors."""
    print("\nC importer, default run of 1 s at 1 ms; speed over real time, ms per simulated second")
    heads = ("no readings", "one reading", "five readings")
    print(" " * 14 + "".join(f"{head:>20s}" for head in heads) + f"{'error of x':>12s}")
    for name, model in MODELS.items():
        wanted = motion(model, REFERENCE_TOLERANCE)
        for tolerance in TOLERANCES:
            job = Job(native(model, 2), points=POINTS, records=READ, tolerance=tolerance)
            cells = ""
            for readings in (0, 1, len(READ)):
                seconds = cost(job, runs, readings)
                cells += f"{1 / seconds:11.0f}{1e3 * seconds:9.3f}"
            error = np.abs(motion(model, tolerance) - wanted).max()
            print(f"{name:4s}{tolerance:10.0e}{cells}{error:12.1e}")


# -- FMPy --


def fmpy_cost(fmu: Path, folder: Path, runs: int) -> float:
    """Return the median time of a step with five readings, through FMPy [s]."""
    description = fmpy.read_model_description(fmu)
    references = {v.name: v.valueReference for v in description.modelVariables}
    wanted = [[references[name]] for name in READ]
    instance = fmpy.instantiate_fmu(str(folder), description, fmi_type="CoSimulation")
    durations = []
    for _ in range(runs):
        instance.setupExperiment(startTime=0.0)
        instance.enterInitializationMode()
        instance.exitInitializationMode()
        started = time.process_time()
        for k in range(len(POINTS) - 1):
            instance.doStep(currentCommunicationPoint=k * 1e-3, communicationStepSize=1e-3)
            for reference in wanted:
                instance.getReal(reference)
        durations.append((time.process_time() - started) / (len(POINTS) - 1))
        instance.reset()
    instance.freeInstance()
    return statistics.median(durations)


def overhead(runs: int) -> None:
    """Print the cost of a step in FMPy, for the native and for the trivial FMU."""
    print("\nFMPy, one fmi2DoStep of 1 ms and five fmi2GetReal, over the default run")
    with tempfile.TemporaryDirectory() as name:
        for label, model in MODELS.items():
            folder = native(model, 2)
            idle = Path(name) / model
            shutil.copytree(folder, idle)
            (library,) = (idle / "binaries" / "linux64").iterdir()
            library.unlink()
            flags = ("-fPIC", "-shared")
            compile_c(library, [Path(__file__).with_name("trivial_fmu.c")], flags)
            fmu = folder.with_suffix(".fmu")
            ours, least = (fmpy_cost(fmu, place, runs) for place in (folder, idle))
            print(
                f"{label:4s}{1e6 * ours:8.1f} us, trivial {1e6 * least:6.1f} us, "
                f"ratio {ours / least:5.2f}"
            )


# -- Exudyn --


def scalar_motion() -> Real:
    """Return x of the 1R guide without a wall by its scalar equation [m]."""
    guide, values = _guide()
    g, beta, inertia = guide.g, values["damping.beta"], guide.mass * guide.r**2

    def rates(_: float, y: Real) -> list[float]:
        phi, omega = y
        force = -4 * guide.k * (phi + beta * omega)
        return [omega, (force + guide.mass * g * guide.r * math.cos(phi)) / inertia]

    start = [math.asin(values["release.displacement"] / guide.r), 0.0]
    found = solve_ivp(rates, (0.0, POINTS[-1]), start, "DOP853", POINTS, rtol=1e-13, atol=1e-16)
    x: Real = guide.r * np.sin(found.y[0])
    return x


def _guide() -> tuple[ScalarGuide, dict[str, float]]:
    values = mechanism("PRBDM").values()
    return ScalarGuide.of(values), dict(values)


def exudyn_motion(exudyn: Any, step: float) -> tuple[Real, float]:
    """Return x of the same guide in Exudyn [m] and the time of its solver [s].

    The model has three planar rigid bodies, four revolute joints and four torsion springs with
    dampers.  The solver is Exudyn's implicit trapezoidal rule for index 2.
    """
    from exudyn import itemInterface as item

    guide, values = _guide()
    L, W = values["flexure.length"], values["shuttle.width"]
    r, foot, height = guide.r, (L - guide.r) / 2, L + values["shuttle.com_height"]
    phi = math.asin(values["release.displacement"] / r)
    start = [r * math.sin(phi), r * (math.cos(phi) - 1)]
    lump = (guide.mass - values["shuttle.mass"]) / 2
    system = exudyn.SystemContainer().AddSystem()
    ground = system.AddObject(item.ObjectGround())
    fixed = system.AddMarker(
        item.MarkerNodeCoordinate(nodeNumber=system.AddNode(item.NodePointGround()), coordinate=0)
    )

    def body(x: float, y: float, angle: float, mass: float, inertia: float) -> tuple[int, int]:
        node = system.AddNode(
            item.NodeRigidBody2D(referenceCoordinates=[x, y, 0], initialCoordinates=[*start, angle])
        )
        number = system.AddObject(
            item.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node)
        )
        weight = [mass * guide.g, 0, 0]
        system.AddLoad(item.Force(markerNumber=marker(number, 0.0, 0.0), loadVector=weight))
        return node, number

    def marker(number: int, x: float, y: float) -> int:
        return int(
            system.AddMarker(item.MarkerBodyPosition(bodyNumber=number, localPosition=[x, y, 0]))
        )

    def angle_of(node: int) -> int:
        return int(system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=2)))

    shuttle_node, shuttle = body(
        W / 2, height, 0.0, values["shuttle.mass"], values["shuttle.inertia"]
    )
    for x in (0.0, W):
        node, link = body(x, foot + r, -phi, lump, 0.0)
        for pair in (
            [marker(ground, x, foot), marker(link, 0.0, -r)],
            [marker(link, 0.0, 0.0), marker(shuttle, x - W / 2, foot + r - height)],
        ):
            system.AddObject(item.RevoluteJoint2D(markerNumbers=pair))
        for other in (fixed, angle_of(shuttle_node)):
            system.AddObject(
                item.CoordinateSpringDamper(
                    markerNumbers=[other, angle_of(node)],
                    stiffness=guide.k,
                    damping=values["damping.beta"] * guide.k,
                )
            )
    sensor = system.AddSensor(
        item.SensorNode(
            nodeNumber=shuttle_node,
            storeInternal=True,
            outputVariableType=exudyn.OutputVariableType.Displacement,
        )
    )
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(POINTS[-1] / step)
    settings.timeIntegration.endTime = float(POINTS[-1])
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solution.sensors.writePeriod = float(POINTS[1])
    settings.solution.file.write = False
    started = time.process_time()
    system.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.TrapezoidalIndex2)
    elapsed = time.process_time() - started
    data = system.GetSensorStoredData(sensor)
    return np.interp(POINTS, data[:, 0], data[:, 1]), elapsed


def interpolated(errors: Sequence[float], costs: Sequence[float], target: float) -> float:
    """Return the cost at an error, interpolated in logarithms and constant outside the data."""
    order = np.argsort(errors)
    logs = np.log(np.array(errors)[order]), np.log(np.array(costs)[order])
    return float(np.exp(np.interp(math.log(target), *logs)))


def exudyn_costs(runs: int) -> None:
    """Print cost and error of the guide without a wall, native FMU and Exudyn."""
    if importlib.util.find_spec("exudyn") is None:
        print("\nExudyn is not installed; install it with: python -m pip install exudyn")
        return
    import exudyn

    wanted = scalar_motion()
    print("\n1R guide without a wall, 1 s, x at 1 ms against the scalar equation")
    curves: dict[str, tuple[list[float], list[float]]] = {"Exudyn": ([], []), "FMU": ([], [])}
    for step in EXUDYN_STEPS:
        found = [exudyn_motion(exudyn, step) for _ in range(min(runs, 3))]
        seconds = statistics.median(elapsed for _, elapsed in found)
        _add(curves["Exudyn"], found[0][0] - wanted, seconds, f"Exudyn, step {step:g} s")
    for tolerance in TOLERANCES:
        job = Job(native("PRBDM", 2), points=POINTS, records=READ, tolerance=tolerance, sets=FREE)
        x = motion("PRBDM", tolerance, sets=FREE)
        _add(curves["FMU"], x - wanted, cost(job, runs), f"FMU, tolerance {tolerance:g}")
    for target in TARGETS:
        theirs, ours = (interpolated(*curves[name], target) for name in ("Exudyn", "FMU"))
        print(f"  at {target:g} m: {theirs / ours:.0f} times faster")


def _add(curve: tuple[list[float], list[float]], off: Real, seconds: float, label: str) -> None:
    error = float(np.abs(off).max())
    curve[0].append(error)
    curve[1].append(seconds)
    print(f"  {label:28s}{1e3 * seconds:10.3f} ms{error:10.1e} m")


# -- Octave --


def octave(runs: int) -> None:
    """Print the cost of the algorithm of the thesis and its ratio to that of the native FMU."""
    program = shutil.which("octave-cli")
    if program is None:
        print("\noctave-cli is not installed: the algorithm of the thesis was not timed")
        return
    theirs = octave_cost(program, min(runs, 3))
    print("\nThe algorithm of the thesis in Octave, seconds per simulated second")
    for name, model in MODELS.items():
        ours = cost(Job(native(model, 2), points=POINTS, records=READ), runs)
        print(f"{name:4s}{theirs[name]:8.1f}, FMU at the default tolerance {ours:.2g}: "
              f"{theirs[name] / ours:.0f} times faster")  # fmt: skip


# -- instructions --


def operations(model: str) -> dict[str, int]:
    """Return the number of floating-point operations of a right-hand side, by purpose.

    Assumptions: coordinates that no mass couples form separate blocks; a sine or cosine has 20
    operations, a complex product 6; one half of a symmetric matrix is computed; zeros of constant
    arrays are skipped.
    """
    given = mechanism(model)
    system = assemble(given, given.values())
    n, r = system.n, len(system.loops)
    coupled = system.H != 0
    blocks = _blocks(coupled)
    pairs = int(np.count_nonzero(np.triu(coupled, 1)))
    entries = int(np.count_nonzero(system.loops))
    springs = int(np.count_nonzero(system.K))
    columns = sum(
        b * b * int(np.count_nonzero(system.loops[:, block].any(axis=1)))
        for block in blocks
        for b in [len(block)]
    )
    return {
        "sines and cosines": 40 * n,
        "masses": 12 * pairs + 2 * n,
        "products of rates": 5 * pairs + n,
        "loads, springs and dampers": 4 * n + 4 * springs,
        "loops": 8 * entries,
        "factors": sum(b**3 // 3 + b**2 for b in map(len, blocks)) + columns,
        "multipliers": 2 * (r * (r + 1) // 2) * n + 2 * r**3 // 3 + 2 * r * r,
        "solution": 4 * n * r + sum(4 * b * b for b in map(len, blocks)),
        "dissipation": 2 * springs + 2 * n,
    }


def _blocks(coupled: Any) -> list[list[int]]:
    """Return the sets of coordinates that are coupled by masses."""
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(coupled, directed=False)
    return [[*np.flatnonzero(label == k)] for k in range(count)]


def inclusive(profile: Path, functions: Sequence[str]) -> tuple[int, int]:
    """Return the calls and inclusive instructions of functions in a profile of callgrind."""
    names: dict[str, str] = {}
    calls = total = 0
    callee, pending = "", 0
    for line in profile.read_text(encoding="utf-8").splitlines():
        if pending:
            if callee.split(".")[0] in functions:
                calls, total = calls + pending, total + int(line.split()[-1])
            pending = 0
        elif line.startswith(("fn=", "cfn=")):
            number, _, name = line.partition("=")[2].partition(" ")
            names.setdefault(number, name)
            if line.startswith("cfn="):
                callee = names[number]
        elif line.startswith("calls="):
            pending = int(line.removeprefix("calls=").split()[0])
    if not calls:
        raise RuntimeError(f"{functions[0]} was not called, or was inlined by the compiler")
    return calls, total


def counted(job: Job, *groups: Sequence[str]) -> list[tuple[int, int]]:
    """Run a job in callgrind; return the calls and inclusive instructions of groups of functions.

    Raises
    ------
    RuntimeError
        If the run fails, or a group has not been called.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "profile"
        counter = ("valgrind", "--tool=callgrind", f"--callgrind-out-file={file}")
        done: Result = execute(job, before=counter)
        if done.status:
            raise RuntimeError(done.errors)
        return [inclusive(file, functions) for functions in groups]


def profile(runs: int) -> None:
    """Print the instructions of a right-hand side and its share of a run."""
    del runs
    if shutil.which("valgrind") is None:
        print("\nvalgrind is not installed: no instructions were counted")
        return
    print("\nInstructions per right-hand side, over the default run until 0.1 s")
    library = kernel_library("profiled", ("-g",))
    for name, model in MODELS.items():
        job = Job(native(model, 2), points=POINTS[:101], records=READ, library=library)
        (calls, total), (_, whole) = counted(job, RIGHT_HAND_SIDE, ("fmi2DoStep",))
        needed = operations(model)
        print(
            f"{name:4s}{total / calls:8.0f} instructions, {sum(needed.values())} operations needed "
            f"({calls} right-hand sides, {100 * total / whole:.0f} % of fmi2DoStep)"
        )
        print("    " + ", ".join(f"{purpose} {count}" for purpose, count in needed.items()))


PARTS: dict[str, Callable[[int], None]] = {
    "speed": speed, "overhead": overhead, "exudyn": exudyn_costs, "octave": octave,
    "profile": profile,
}  # fmt: skip


def main() -> None:
    """Print the chosen parts."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--runs", type=int, default=7, help="number of runs (default: %(default)s)")
    parser.add_argument(
        "--only", nargs="+", choices=PARTS, default=[*PARTS], help="parts (default: all)"
    )
    arguments = parser.parse_args()
    for part in arguments.only:
        PARTS[part](arguments.runs)


if __name__ == "__main__":
    main()
