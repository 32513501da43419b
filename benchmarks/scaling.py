"""Cost of a right-hand side over the number of links and of loops.

    python benchmarks/scaling.py

valgrind counts the instructions of the native right-hand side.  The exponent is the slope of a
least-squares line through the logarithms, over the upper half of the sizes.

links   the guide with two chains of n links each, 4 to 50: one loop, growing blocks of the mass
        matrix
axial   the same chains with links that stretch: twice the coordinates
loops   a shuttle on k 2R flexures that stretch, 2 to 12: k - 1 loops, blocks of the mass matrix of
        constant size (parallel links that do not stretch would be over-constrained)
beams   the guide on beams of several orders and numbers of nodes, relative to the 2R guide: the
        right-hand side in instructions, and the default second in CPU time
"""

import argparse
import dataclasses
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fmu_src"))

from c_importer import Job, execute, kernel_library, unpack, write
from native import POINTS, RIGHT_HAND_SIDE, cost, inclusive
from prbm.fmu import native_fmu
from prbm.fmu.reference_results import steps
from prbm.kernel.compiler import FLAGS
from prbm.mechanics.assembly import assemble
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Flexure
from prbm.runs.experiment import Experiment
from support import mechanism

Real = NDArray[np.float64]

LINKS = (4, 8, 12, 18, 25, 35, 50)  # Links per flexure.
LEAVES = (2, 3, 4, 6, 8, 10, 12)  # Parallel flexures.
STOP_TIME_MAX = 2e-5  # Long enough for a mean over the steps [s].
STEPS_MAX = 20  # Enough for a mean if the steps are short.
BEAMS = ((3, 5, False), (3, 6, False), (5, 8, False), (3, 6, True))  # Order, nodes, axial.


def chains(n: int, axial: bool = False) -> Mechanism:
    """Return the guide on two chains of n links."""
    guide = mechanism("PRBDM2R")
    leaf = dataclasses.replace(guide.flexure_types[0], model="nR", n=n, axial=axial)
    return dataclasses.replace(guide, name=f"Chains{n}{'Axial' * axial}", flexure_types=(leaf,))


def leaves(k: int) -> Mechanism:
    """Return a shuttle on k parallel flexures; the first and the last are those of the guide."""
    guide = mechanism("PRBDM2RAxial")
    shuttle, x = guide.bodies[0], [f"{i / (k - 1):.17g}*shuttle.width" for i in range(k)]
    body = dataclasses.replace(
        shuttle, points={f"p{i}": (x[i], "flexure.length") for i in range(k)}
    )
    flexures = tuple(
        Flexure(f"leaf_{i}", "flexure", f"ground.p{i}", f"shuttle.p{i}") for i in range(k)
    )
    return dataclasses.replace(
        guide,
        name=f"Leaves{k}",
        ground={f"p{i}": (x[i], 0.0) for i in range(k)},
        bodies=(body,),
        flexures=flexures,
    )


def beams(order: int, nodes: int, axial: bool) -> Mechanism:
    """Return the guide on two beams."""
    guide = mechanism("PRBDM2R")
    leaf = dataclasses.replace(
        guide.flexure_types[0], model="beam", order=order, nodes=nodes, axial=axial, coefficients={}
    )
    name = f"Beams{order}{nodes}{'Axial' * axial}"
    return dataclasses.replace(guide, name=name, flexure_types=(leaf,))


def unpacked(given: Mechanism, folder: Path) -> Path:
    """Return the folder of an unpacked native FMU, without reference results to save time."""
    with patch.object(native_fmu, "reference", lambda *_: {}):
        write(folder / "model.fmu", native_fmu.build(given, {}, 2, ("host",)))
    return unpack(folder / "model.fmu", folder / "model")


def counted(given: Mechanism, points: Real, functions: Sequence[str]) -> tuple[int, int]:
    """Return the calls and inclusive instructions of functions of a native FMU.

    Parameters
    ----------
    given : Mechanism
        Mechanism of the FMU.
    points : array (k,)
        Communication points of the run [s].
    functions : sequence of str
        Functions of the kernel or of FMI 2.0.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        unpacked(given, folder)
        optimized = [flag for flag in FLAGS if flag != "-g0"]
        library = kernel_library("profiled", ("-g", *optimized))
        job = Job(folder / "model", points=points, records=("shuttle.x",), library=library)
        counter = ("valgrind", "--tool=callgrind", f"--callgrind-out-file={folder / 'profile'}")
        done = execute(job, before=counter)
        if done.status:
            raise RuntimeError(done.errors)
        return inclusive(folder / "profile", functions)


def instructions(given: Mechanism) -> float:
    """Return the mean number of instructions of a right-hand side of a mechanism."""
    stop_time = min(STOP_TIME_MAX, STEPS_MAX / steps(given, {}, Experiment(1.0)))
    calls, total = counted(given, np.array([0.0, stop_time]), RIGHT_HAND_SIDE)
    return total / calls


def rows(sizes: tuple[int, ...], make: Callable[[int], Mechanism]) -> Iterator[tuple[int, float]]:
    """Print and yield the sizes and costs of mechanisms."""
    for size in sizes:
        given = make(size)
        system = assemble(given, given.values())
        cost = instructions(given)
        print(
            f"  {size:4d}: {system.n:4d} coordinates, {len(system.links):4d} links, "
            f"{len(system.loops) // 2:3d} loops {cost:12.0f} instructions"
        )
        yield size, cost


def print_growth(title: str, sizes: tuple[int, ...], make: Callable[[int], Mechanism]) -> float:
    """Print the costs and the exponent of their growth, and return the exponent."""
    print(f"\n{title}")
    size, cost = np.array([*rows(sizes, make)]).T
    half = len(size) // 2
    slope = np.polyfit(np.log(size[half:]), np.log(cost[half:]), 1)[0]
    print(f"  exponent {slope:.2f} over the upper half of the sizes", flush=True)
    return float(slope)


def default_second(given: Mechanism, runs: int) -> float:
    """Return the median CPU time of the steps of the default second [s]."""
    with tempfile.TemporaryDirectory() as name:
        job = Job(unpacked(given, Path(name)), points=POINTS, records=("shuttle.x",))
        return cost(job, runs, 0)


def print_beams(runs: int) -> None:
    """Print the costs of beams, relative to those of the 2R guide."""
    print("\nBeams: the guide on two beams, relative to the 2R guide")
    guide = mechanism("PRBDM2R")
    reference = instructions(guide), default_second(guide, runs)
    for order, nodes, axial in BEAMS:
        given = beams(order, nodes, axial)
        one, all_ = instructions(given), default_second(given, 1 if axial else runs)
        print(
            f"  order {order}, {nodes} nodes{', axial' * axial:7s} "
            f"{one:8.0f} instructions, ratio {one / reference[0]:5.2f}; default second "
            f"{1e3 * all_:8.1f} ms, ratio {all_ / reference[1]:6.2f}",
            flush=True,
        )


def main() -> None:
    """Print the costs and exponents of all series."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--largest",
        type=int,
        default=50,
        help="largest number of links per chain (default: %(default)s)",
    )
    parser.add_argument(
        "--runs", type=int, default=7, help="runs of a default second (default: %(default)s)"
    )
    parser.add_argument("--beams", action="store_true", help="measure only beams")
    arguments = parser.parse_args()
    largest = arguments.largest
    if shutil.which("valgrind") is None:
        sys.exit("valgrind is not installed; it is needed to count instructions")
    if arguments.beams:
        print_beams(arguments.runs)
        return
    sizes = tuple(n for n in LINKS if n <= largest)
    print_growth("Links: two chains of n links", sizes, chains)
    print_growth("Axial: chains of n links that stretch", sizes, lambda n: chains(n, axial=True))
    print_growth("Loops: k parallel 2R flexures that stretch", LEAVES, leaves)
    print_beams(arguments.runs)


if __name__ == "__main__":
    main()
