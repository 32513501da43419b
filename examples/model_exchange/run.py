"""One solver for the guide and its controller, and the co-simulation of the two beside it.

    guide --- shuttle.x, shuttle.vx ---> controller
      ^------------- force.x ----------------'

    python examples/model_exchange/run.py

Model exchange gives the equations of the guide away, so that they and those of the controller can
be integrated together: no communication step, no error of coupling.  This is what co-simulation is
held against, for ever shorter communication steps.
"""

import argparse
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pythonfmu import FmuBuilder

from prbm import load
from prbm.base.errors import PrbmError
from prbm.base.progress import reporter
from prbm.fmu.native_fmu import build
from prbm.systems import model_exchange
from prbm.systems.cosimulation import GAUSS_SEIDEL, JACOBI
from prbm.systems.cosimulation import simulate as cosimulate

HERE = Path(__file__).resolve().parent
GUIDE = load("PRBDM")
START = {"gravity.x": 0.0, "release.displacement": -5e-3, "stop.restitution": 0.8}
CONTROLLER = {"gain": 20.0, "damping": 0.5, "wanted": 1e-3, "lag": 5e-3}  # N/m, N s/m, m, s
CONNECTIONS = {
    "controller.position": "guide.shuttle.x",
    "controller.velocity": "guide.shuttle.vx",
    "guide.force.x": "controller.force",
}
BEFORE, AFTER = 0.04, 0.16  # s: before the first impact, and after the second
STEPS = tuple(2e-3 / 2**k for k in range(6))  # s
WAYS = {
    "Jacobi": (JACOBI, False),
    "Gauss-Seidel": (GAUSS_SEIDEL, False),
    "Gauss-Seidel, event mode": (GAUSS_SEIDEL, True),
}
SAID = ("shuttle.x", "stop.impact_count", "stop.impact_time")


def controller(
    t: float, outputs: Mapping[str, float], z: np.ndarray
) -> tuple[dict[str, float], list[float]]:
    """Give the force of the actuator, z[0], to the guide; return its rate."""
    missing = CONTROLLER["wanted"] - outputs["shuttle.x"]
    command = CONTROLLER["gain"] * missing - CONTROLLER["damping"] * outputs["shuttle.vx"]
    return {"force.x": float(z[0])}, [(command - z[0]) / CONTROLLER["lag"]]


def one_solver(fmu: Path) -> np.ndarray:
    """Simulate guide and controller in one solver.

    Returns
    -------
    structured array
        Time [s], displacement [m] and impacts, a row each millisecond.
    """
    return model_exchange.simulate(
        fmu, controller, [0.0], AFTER, 1e-3, START, ("shuttle.x", "shuttle.vx"), SAID
    )


def coupled(fmus: Mapping[str, Path], step: float, scheme: str, events: bool) -> np.ndarray:
    """Simulate the same by co-simulation."""
    values = {f"guide.{name}": x for name, x in START.items()}
    values |= {f"controller.{name}": x for name, x in CONTROLLER.items()}
    record = [f"guide.{name}" for name in SAID]
    return cosimulate(fmus, CONNECTIONS, AFTER, step, values, record, scheme, events)


@dataclass(frozen=True)
class Study:
    """Errors by communication step, arrays of shape (steps,) by the names of the ways.

    Parameters
    ----------
    steps : sequence of float
        Communication steps [s].
    before, after : dict
        Errors of the displacement before the first impact and after the second [m].
    times : dict
        Errors of the time of the second impact [s].
    late : dict
        Longest time from an impact to the row in which the controller is told of it [s].
    """

    steps: Sequence[float]
    before: dict[str, np.ndarray]
    after: dict[str, np.ndarray]
    times: dict[str, np.ndarray]
    late: dict[str, np.ndarray]


def study(steps: Sequence[float] = STEPS) -> Study:
    """Compare co-simulation with one solver.

    Parameters
    ----------
    steps : sequence of float
        Communication steps, of which 40 ms is a multiple [s].
    """
    tell, done = reporter(), 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        guide = folder / "guide.fmu"
        guide.write_bytes(build(GUIDE, fmi=3))
        fmus = {
            "guide": guide,
            "controller": FmuBuilder.build_FMU(HERE / "position_controller.py", dest=folder),
        }
        exact = one_solver(guide)
        found: dict[str, list[list[float]]] = {}
        for way, (scheme, events) in WAYS.items():
            found[way] = []
            for step in steps:
                found[way].append(errors(coupled(fmus, step, scheme, events), exact))
                done += 1
                tell(done / len(steps) / len(WAYS))
    columns = [{way: np.array(rows)[:, k] for way, rows in found.items()} for k in range(4)]
    return Study(tuple(steps), *columns)


def errors(record: np.ndarray, exact: np.ndarray) -> list[float]:
    """Return errors before and after impacts [m], of an impact's time and of the news of it [s]."""
    at = [np.abs(record["time"] - t).argmin() for t in (BEFORE, AFTER)]
    same = [np.abs(exact["time"] - t).argmin() for t in (BEFORE, AFTER)]
    x = record["guide.shuttle.x"][at] - exact["shuttle.x"][same]
    time = record["guide.stop.impact_time"][-1] - exact["stop.impact_time"][-1]
    new = np.flatnonzero(np.diff(record["guide.stop.impact_count"], prepend=0))
    late = record["time"][new] - record["guide.stop.impact_time"][new]
    return [*np.abs(x), abs(time), late.max()]


def order(steps: Sequence[float], error: np.ndarray) -> float:
    """Return the exponent p of error = c h^p, by least squares over all steps.

    >>> round(order([0.4, 0.2, 0.1], np.array([0.32, 0.08, 0.02])), 12)
    2.0
    """
    return float(np.polyfit(np.log(steps), np.log(error), 1)[0])


def figure(found: Study) -> Figure:
    """Plot the errors over the step."""
    result = Figure((9.6, 4.4), dpi=100, layout="constrained")
    left, right = result.subplots(1, 2)
    steps = 1e3 * np.array(found.steps)
    styles = dict(zip(WAYS, (("#d55e00", "v"), ("#1f4e79", "o"), ("#009e73", "s")), strict=True))
    for way, (colour, marker) in styles.items():
        left.plot(steps, 1e6 * found.before[way], marker + "--", color=colour, mfc="none")
        left.plot(steps, 1e6 * found.after[way], marker + "-", color=colour, label=way)
        late = np.maximum(1e3 * found.late[way], 1e-12)
        right.plot(steps, late, marker + "-", color=colour, label=way)
    guide = 1e6 * found.after["Jacobi"][-1] * steps / steps[-1]
    left.plot(steps, 2 * guide, "k:", linewidth=1.0, label="first order")
    left.set_ylabel("error of shuttle.x [um]")
    left.set_title("dashed: before any impact; solid: after two", fontsize=10)
    right.set_ylabel("controller hears of an impact later by [ms]")
    right.set_title("1e-12 ms stands for none", fontsize=10)
    for axes in (left, right):
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xticks(steps, [f"{step:.3g}" for step in steps])
        axes.minorticks_off()
        axes.set_xlabel("communication step [ms]")
        axes.grid(color="#eeeeee")
        axes.legend(frameon=False, fontsize=9)
    return result


def main(arguments: list[str] | None = None) -> None:
    """Compare, print errors and orders, write the figure."""
    parser = argparse.ArgumentParser(description="Co-simulation beside one solver for all.")
    parser.parse_args(arguments)
    try:
        found = study()
    except PrbmError as error:
        sys.exit(str(error))
    print(f"{'':26}order before   after   error of an impact's time   heard of it late by")
    for way in WAYS:
        print(
            f"{way:26}{order(found.steps, found.before[way]):12.3f}"
            f"{order(found.steps, found.after[way]):8.3f}"
            f"{found.times[way][-1]:25.2e} s{found.late[way].max():20.1e} s"
        )
    print(f"errors of the time are those of the shortest step, {1e3 * found.steps[-1]:g} ms")
    try:
        figure(found).savefig("model_exchange.png")
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a folder of yours")
    print("figure: model_exchange.png")


if __name__ == "__main__":
    main()
