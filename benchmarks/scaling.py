"""Cost of a right-hand side over the number of links, flexures and nodes.

    python benchmarks/scaling.py

valgrind counts the instructions of the native right-hand side, and those of its Schur complement:
the system of the constraint forces of all loops, which is dense.  The exponent is the slope of a
least-squares line through the logarithms, over the upper half of the sizes.

links     the guide with two chains of n links each, 4 to 50: one loop, growing blocks of the mass
          matrix
axial     the same chains with links that stretch: twice the coordinates
parallel  a shuttle on k parallel 2R flexures that stretch, 2 to 50: k - 1 loops, blocks of the mass
          matrix of constant size (flexures that do not stretch would be over-constrained)
series    a column of k 2R flexures with bodies between them, 2 to 16: no loop, one block
nodes     the guide on beams of the order 3 with 5 to 24 nodes
beams     the guide on beams of several orders and numbers of nodes, relative to the 2R guide: the
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

from c_importer import Job, kernel_library, unpack, write
from native import POINTS, RIGHT_HAND_SIDE, cost, counted
from prbm.fmu import native_fmu
from prbm.kernel.compiler import FLAGS
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.assembly import assemble
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Flexure
from support import mechanism

Real = NDArray[np.float64]

LINKS = (4, 8, 12, 18, 25, 35, 50)  # Links per flexure.
PARALLEL = (2, 4, 6, 12, 25, 50)  # Flexures.
SERIES = (2, 4, 6, 8, 12, 16)  # Flexures.
NODES = (5, 6, 8, 12, 16, 24)  # Nodes per beam.
SCHUR_COMPLEMENT = ("schur_of_many",)  # Function of the kernel, for more than four constraints.
SMALL = 4  # Constraints for which the Schur complement is part of other functions.
STOP_TIME_MAX = 2e-5  # Long enough for a mean over the steps [s].
STEPS_MAX = 20  # Enough for a mean if the steps are short.
BEAMS = ((3, 5, False), (3, 6, False), (5, 8, False), (3, 6, True))  # Order, nodes, axial.


def chains(n: int, axial: bool = False) -> Mechanism:
    """Return the guide on two chains of n links."""
    guide = mechanism("PRBDM2R")
    # Thick and undamped, as the FMU rejects a fastest mode far above the fundamental one.
    leaf = dataclasses.replace(guide.flexure_types[0], model="nR", n=n, axial=axial, thickness=1e-3)
    name = f"Chains{n}{'Axial' * axial}"
    release = dataclasses.replace(guide.release, displacement=-1e-3)
    return dataclasses.replace(
        guide, name=name, flexure_types=(leaf,), damping_beta=0.0, release=release
    )


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


def column(k: int) -> Mechanism:
    """Return a shuttle on a column of k flexures with small bodies between them."""
    guide = mechanism("PRBDM2R")
    (shuttle,) = guide.bodies
    height = [f"{i}*flexure.length" for i in range(k + 1)]
    between = [
        dataclasses.replace(
            shuttle, name=f"body_{i}", mass=1e-2, inertia=1e-6, centre=(0.0, height[i]),
            points={"bottom": (0.0, height[i]), "top": (0.0, height[i])},
        )
        for i in range(1, k)
    ]  # fmt: skip
    ends = ["ground.bottom", *(f"body_{i}" for i in range(1, k)), "shuttle.left"]
    flexures = tuple(
        Flexure(
            f"leaf_{i}", "flexure", ends[i] if i == 0 else f"{ends[i]}.top",
            ends[i + 1] if i + 1 == k else f"{ends[i + 1]}.bottom",
        )
        for i in range(k)
    )  # fmt: skip
    top = f"{k}*flexure.length"
    shuttle = dataclasses.replace(shuttle, centre=(0.0, top), points={"left": (0.0, top)})
    stop = dataclasses.replace(guide.stops[0], point=(0.0, top))
    return dataclasses.replace(
        guide, name=f"Column{k}", ground={"bottom": (0.0, 0.0)}, bodies=(*between, shuttle),
        flexures=flexures, stops=(stop,), gravity=(0.0, 0.0),
    )  # fmt: skip


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


@dataclasses.dataclass(frozen=True)
class Cost:
    """Instructions of a right-hand side.

    Parameters
    ----------
    whole : float
        Mean number of instructions of a right-hand side.
    schur : float
        Mean number of those of the Schur complement, 0 for up to four constraints.
    """

    whole: float
    schur: float = 0.0


def counted_in(given: Mechanism, points: Real, *groups: Sequence[str]) -> list[tuple[int, int]]:
    """Return the calls and inclusive instructions of groups of functions of a native FMU.

    Parameters
    ----------
    given : Mechanism
        Mechanism of the FMU.
    points : array (k,)
        Communication points of the run [s].
    groups : sequences of str
        Functions of the kernel or of FMI 2.0.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        unpacked(given, folder)
        optimized = [flag for flag in FLAGS if flag != "-g0"]
        library = kernel_library("profiled", ("-g", *optimized))
        job = Job(folder / "model", points=points, records=("shuttle.x",), library=library)
        return counted(job, *groups)


def right_hand_side(given: Mechanism, constraints: int = 0) -> Cost:
    """Return the instructions of a right-hand side of a mechanism with a number of constraints."""
    motion = KernelSimulation(given, {})
    motion.advance(STOP_TIME_MAX)
    stop_time = STOP_TIME_MAX * min(1.0, STEPS_MAX / motion.step_count)
    groups = (RIGHT_HAND_SIDE, *((SCHUR_COMPLEMENT,) if constraints > SMALL else ()))
    found = counted_in(given, np.array([0.0, stop_time]), *groups)
    return Cost(*(total / calls for calls, total in found))


def instructions(given: Mechanism) -> float:
    """Return the mean number of instructions of a right-hand side of a mechanism."""
    return right_hand_side(given).whole


def rows(sizes: tuple[int, ...], make: Callable[[int], Mechanism]) -> Iterator[tuple[int, Cost]]:
    """Print and yield the sizes and costs of mechanisms."""
    for size in sizes:
        given = make(size)
        system = assemble(given, given.values())
        cost = right_hand_side(given, len(system.loops))
        print(
            f"  {size:4d}: {system.n:4d} coordinates, {len(system.loops):4d} constraints "
            f"{cost.whole:12.0f} instructions, {cost.schur / cost.whole:4.0%} Schur complement",
            flush=True,
        )
        yield size, cost


@dataclasses.dataclass(frozen=True)
class Growth:
    """Costs of mechanisms over their size.

    Parameters
    ----------
    title : str
        What grows.
    sizes : tuple of int, (m,)
        Numbers of links, flexures or nodes.
    costs : tuple of Cost, (m,)
        Costs of the right-hand sides.
    """

    title: str
    sizes: tuple[int, ...]
    costs: tuple[Cost, ...]

    @property
    def exponent(self) -> float:
        """Exponent over the upper half of the sizes."""
        return self._slope([cost.whole for cost in self.costs])

    @property
    def exponent_without_schur(self) -> float:
        """Exponent of the instructions outside of the Schur complement."""
        return self._slope([cost.whole - cost.schur for cost in self.costs])

    def _slope(self, costs: Sequence[float]) -> float:
        half = min(len(self.sizes) // 2, len(self.sizes) - 2)
        return float(np.polyfit(np.log(self.sizes[half:]), np.log(costs[half:]), 1)[0])


def growth(title: str, sizes: tuple[int, ...], make: Callable[[int], Mechanism]) -> Growth:
    """Print and return the costs of mechanisms and the exponents of their growth."""
    print(f"\n{title}")
    found = Growth(title, sizes, tuple(cost for _, cost in rows(sizes, make)))
    print(
        f"  exponent {found.exponent:.2f} over the upper half of the sizes, "
        f"{found.exponent_without_schur:.2f} without the Schur complement",
        flush=True,
    )
    return found


def draw(found: Sequence[Growth], file: Path) -> None:
    """Draw the costs over the sizes into a file."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    axes = figure.add_subplot(xlabel="number of links, flexures or nodes [-]",
                              ylabel="instructions of a right-hand side [-]",
                              xscale="log", yscale="log")  # fmt: skip
    for one, marker in zip(found, "osD^vP", strict=False):
        label = f"{one.title.partition(':')[0].lower()}, exponent {one.exponent:.2f}"
        (line,) = axes.plot(one.sizes, [c.whole for c in one.costs], marker, ls="-", label=label)
        if any(cost.schur for cost in one.costs):
            axes.plot(
                one.sizes, [c.whole - c.schur for c in one.costs], marker, ls="--", mfc="none",
                color=line.get_color(),
                label=f"without the Schur complement, {one.exponent_without_schur:.2f}",
            )  # fmt: skip
    axes.set_xticks([2, 5, 10, 20, 50], labels=["2", "5", "10", "20", "50"])
    axes.minorticks_off()
    axes.grid(which="major", alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(file, dpi=150)


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
        help="largest number of links, flexures or nodes (default: %(default)s); two sizes of each "
        "are the least",
    )
    parser.add_argument(
        "--runs", type=int, default=7, help="runs of a default second (default: %(default)s)"
    )
    parser.add_argument("--figure", type=Path, help="draw the growth into this file")
    parser.add_argument("--beams", action="store_true", help="measure only beams")
    arguments = parser.parse_args()
    largest = arguments.largest
    if shutil.which("valgrind") is None:
        sys.exit("valgrind is not installed; it is needed to count instructions")
    if arguments.beams:
        print_beams(arguments.runs)
        return
    found = [
        growth(title, sizes[: max(2, sum(size <= largest for size in sizes))], make)
        for title, sizes, make in (
            ("Links: two chains of n links", LINKS, chains),
            ("Links that stretch: the same chains", LINKS, lambda n: chains(n, axial=True)),
            ("Parallel flexures: 2R flexures that stretch", PARALLEL, leaves),
            ("Flexures in series: a column of 2R flexures", SERIES, column),
            ("Nodes: two beams of the order 3", NODES, lambda n: beams(3, n, False)),
        )
    ]
    if arguments.figure:
        draw(found, arguments.figure)
    print_beams(arguments.runs)


if __name__ == "__main__":
    main()
