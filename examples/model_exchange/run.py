"""One solver for the guide and its controller, compared with their co-simulation.

    guide --- shuttle.x, shuttle.vx ---> controller
      ^------------- force.x ----------------'

    python examples/model_exchange/run.py

With model exchange, one solver integrates the equations of the guide together with those of the
controller, without a communication step and without an error of coupling.  This is the reference
for co-simulation with ever shorter communication steps.
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

from prbm import PrbmError, load
from prbm.base.progress import reporter
from prbm.fmu.native_fmu import build
from prbm.systems import model_exchange
from prbm.systems.cosimulation import GAUSS_SEIDEL, JACOBI
from prbm.systems.cosimulation import simulate as cosimulate

HERE = Path(__file__).resolve().parent
GUIDE = load("PRBDM")
START = {"gravity.x": 0.0, "release.displacement": -5e-3, "stop.restitution": 0.8}
CONTROLLER = {"gain": 20.0, "damping": 0.5, "wanted": 1e-3, "lag": 5e-3}  # In SI units.
CONNECTIONS = {
    "controller.position": "guide.shuttle.x",
    "controller.velocity": "guide.shuttle.vx",
    "guide.force.x": "controller.force",
}
BEFORE, AFTER = 0.04, 0.16  # Times before the first and after the second impact [s].
STEPS = tuple(2e-3 / 2**k for k in range(6))  # Communication steps [s].
METHODS = {
    "Jacobi": (JACOBI, False),
    "Gauss-Seidel": (GAUSS_SEIDEL, False),
    "Gauss-Seidel, event mode": (GAUSS_SEIDEL, True),
}
OUTPUTS = ("shuttle.x", "stop.impact_count", "stop.impact_time")


def controller(
    t: float, outputs: Mapping[str, float], z: np.ndarray
) -> tuple[dict[str, float], list[float]]:
    """Return the input of the guide, which is the force z[0] of the actuator, and the rate of z."""
    error = CONTROLLER["wanted"] - outputs["shuttle.x"]
    command = CONTROLLER["gain"] * error - CONTROLLER["damping"] * outputs["shuttle.vx"]
    return {"force.x": float(z[0])}, [(command - z[0]) / CONTROLLER["lag"]]


def one_solver(fmu: Path) -> np.ndarray:
    """Simulate guide and controller in one solver.

    Returns
    -------
    structured array
        Time [s], displacement [m] and impacts, one row per millisecond.
    """
    return model_exchange.simulate(
        fmu, controller, [0.0], AFTER, 1e-3, START, ("shuttle.x", "shuttle.vx"), OUTPUTS
    )


def coupled(fmus: Mapping[str, Path], step: float, scheme: str, events: bool) -> np.ndarray:
    """Simulate guide and controller by co-simulation."""
    values = {f"guide.{name}": x for name, x in START.items()}
    values |= {f"controller.{name}": x for name, x in CONTROLLER.items()}
    record = [f"guide.{name}" for name in OUTPUTS]
    return cosimulate(fmus, CONNECTIONS, AFTER, step, values, record, scheme, events)


@dataclass(frozen=True)
class Study:
    """Errors by communication step: arrays of shape (steps,) by name of the method.

    Parameters
    ----------
    steps : sequence of float
        Communication steps [s].
    before, after : dict
        Errors of the displacement before the first impact and after the second [m].
    times : dict
        Errors of the time of the second impact [s].
    delay : dict
        Longest time from an impact to the row in which the controller receives it [s].
    """

    steps: Sequence[float]
    before: dict[str, np.ndarray]
    after: dict[str, np.ndarray]
    times: dict[str, np.ndarray]
    delay: dict[str, np.ndarray]


def study(steps: Sequence[float] = STEPS) -> Study:
    """Compare co-simulation with one solver.

    Parameters
    ----------
    steps : sequence of float
        Communication steps; 40 ms must be a multiple of each [s].
    """
    report, done = reporter(), 0
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
        for method, (scheme, events) in METHODS.items():
            found[method] = []
            for step in steps:
                found[method].append(errors(coupled(fmus, step, scheme, events), exact))
                done += 1
                report(done / len(steps) / len(METHODS))
    columns = [{name: np.array(rows)[:, k] for name, rows in found.items()} for k in range(4)]
    return Study(tuple(steps), *columns)


def errors(record: np.ndarray, exact: np.ndarray) -> list[float]:
    """Return the errors before and after impacts [m], the error of a time and the delay [s]."""
    at = [np.abs(record["time"] - t).argmin() for t in (BEFORE, AFTER)]
    same = [np.abs(exact["time"] - t).argmin() for t in (BEFORE, AFTER)]
    x = record["guide.shuttle.x"][at] - exact["shuttle.x"][same]
    time = record["guide.stop.impact_time"][-1] - exact["stop.impact_time"][-1]
    new = np.flatnonzero(np.diff(record["guide.stop.impact_count"], prepend=0))
    delay = record["time"][new] - record["guide.stop.impact_time"][new]
    return [*np.abs(x), abs(time), delay.max()]


def order(steps: Sequence[float], error: np.ndarray) -> float:
    """Return the exponent p of error = c h^p, by least squares over all steps.

    >>> round(order([0.4, 0.2, 0.1], np.array([0.32, 0.08, 0.02])), 12)
    2.0
    """
    return float(np.polyfit(np.log(steps), np.log(error), 1)[0])


def figure(found: Study) -> Figure:
    """Plot the errors over the communication step."""
    result = Figure((9.6, 4.4), dpi=100, layout="constrained")
    left, right = result.subplots(1, 2)
    steps = 1e3 * np.array(found.steps)
    styles = dict(zip(METHODS, (("#d55e00", "v"), ("#1f4e79", "o"), ("#009e73", "s")), strict=True))
    for method, (colour, marker) in styles.items():
        left.plot(steps, 1e6 * found.before[method], marker + "--", color=colour, mfc="none")
        left.plot(steps, 1e6 * found.after[method], marker + "-", color=colour, label=method)
        delay = np.maximum(1e3 * found.delay[method], 1e-12)
        right.plot(steps, delay, marker + "-", color=colour, label=method)
    guide = 1e6 * found.after["Jacobi"][-1] * steps / steps[-1]
    left.plot(steps, 2 * guide, "k:", linewidth=1.0, label="first order")
    left.set_ylabel("error of shuttle.x [um]")
    left.set_title("dashed: before any impact; solid: after two", fontsize=10)
    right.set_ylabel("delay until the controller receives an impact [ms]")
    right.set_title("no delay is drawn as 1e-12 ms", fontsize=10)
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
    """Compare, print errors and orders, and write the figure."""
    parser = argparse.ArgumentParser(description="Co-simulation compared with one solver.")
    parser.parse_args(arguments)
    try:
        found = study()
    except PrbmError as error:
        sys.exit(str(error))
    print(f"{'':26}order before   after   error of an impact time   longest delay")
    for method in METHODS:
        print(
            f"{method:26}{order(found.steps, found.before[method]):12.3f}"
            f"{order(found.steps, found.after[method]):8.3f}"
            f"{found.times[method][-1]:23.2e} s{found.delay[method].max():14.1e} s"
        )
    print(f"errors of the time are at the shortest step, {1e3 * found.steps[-1]:g} ms")
    try:
        figure(found).savefig("model_exchange.png")
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a writable folder")
    print("figure: model_exchange.png")


if __name__ == "__main__":
    main()
