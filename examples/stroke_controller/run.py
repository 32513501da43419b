"""Two coupled FMUs: the guide, and a controller that keeps it bouncing.

    guide --- shuttle.x, shuttle.vx ---> controller
      ^------------- force.x ----------------'

The force is constant within a step, so that its work is the sum of force times displacement.  The
script compares it with the work that the guide reports, and the speed of the impacts with an energy
balance.
"""

import argparse
import math
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from matplotlib.figure import Figure
from pythonfmu import FmuBuilder

from prbm import load
from prbm.files.mechanism_file import shipped
from prbm.fmu.python_fmu import build

STROKE = 0.008  # [m]
RESTITUTION = 0.6
STEP = 5e-4  # Communication step [s].
MODEL = "PRBDM"  # PRBDM2R takes five times as long.
ENERGIES = tuple(
    f"energy.{name}" for name in ("kinetic", "elastic", "gravitational", "dissipated", "work")
)
RECORDED = ("shuttle.x", "shuttle.vx", "stop.impact_count", "stop.approach_speed", *ENERGIES)


class Slave:
    """An FMU of FMI 2.0 in a co-simulation, with access to its variables by name."""

    def __init__(self, fmu: Path, folder: Path, name: str) -> None:
        unzipped = fmpy.extract(fmu, folder / name)
        description = fmpy.read_model_description(unzipped)
        self.variables = {v.name: v for v in description.modelVariables}
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=unzipped,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )

    def start(self, values: Mapping[str, float]) -> None:
        """Instantiate and initialize with start values."""
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        for name, x in values.items():
            self[name] = x
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def step(self, time: float, size: float) -> None:
        """Make a step of a size from a time [s]."""
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=size)

    def stop(self) -> None:
        """End the simulation and free the instance."""
        self.fmu.terminate()
        self.fmu.freeInstance()

    def __getitem__(self, name: str) -> float:
        variable = self.variables[name]
        get = {"Real": self.fmu.getReal, "Integer": self.fmu.getInteger}[variable.type]
        return get([variable.valueReference])[0]

    def __setitem__(self, name: str, x: float) -> None:
        self.fmu.setReal([self.variables[name].valueReference], [x])


@contextmanager
def slaves(model: str, stroke: float) -> Iterator[tuple[Slave, Slave]]:
    """Build and start the guide and the controller, and stop them at the end."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "guide.fmu").write_bytes(build(load(model)))
        source = Path(__file__).with_name("stroke_controller.py")
        controller_fmu = FmuBuilder.build_FMU(source, dest=folder)
        guide = Slave(folder / "guide.fmu", folder, "guide")
        controller = Slave(controller_fmu, folder, "controller")
        guide.start({"stop.restitution": RESTITUTION})
        controller.start({"stroke": stroke})
        try:
            yield guide, controller
        finally:
            controller.stop()
            guide.stop()


def simulate(stop_time: float = 3.0, model: str = MODEL, stroke: float = STROKE) -> np.ndarray:
    """Simulate the guide with its controller.

    Parameters
    ----------
    stop_time : float
        End of the simulation [s].
    model : str
        Name of the mechanism.
    stroke : float
        Set point of the distance from the stop to the far end of a bounce [m].

    Returns
    -------
    structured array
        Time, motion, force, last stroke, energies and impacts, one row per step.
    """
    rows = []
    with slaves(model, stroke) as (guide, controller):
        for k in range(round(stop_time / STEP) + 1):
            t = k * STEP
            controller["position"] = guide["shuttle.x"]
            controller["velocity"] = guide["shuttle.vx"]
            controller.step(t, STEP)
            force = controller["force"]
            rows.append((t, force, controller["reached"], *(guide[x] for x in RECORDED)))
            guide["force.x"] = force
            guide.step(t, STEP)
    names = ("time", "force.x", "reached", *RECORDED)
    return np.array(rows, [(name, float) for name in names])


def work(record: np.ndarray) -> np.ndarray:
    """Return the work of the force as the sum of force times displacement, row by row [J]."""
    portions = record["force.x"][:-1] * np.diff(record["shuttle.x"])
    return np.concatenate([[0.0], np.cumsum(portions)])


def balance(record: np.ndarray) -> np.ndarray:
    """Return kinetic + elastic + gravitational + dissipated - work [J]."""
    kinetic, elastic, gravitational, dissipated, done = (record[name] for name in ENERGIES)
    return kinetic + elastic + gravitational + dissipated - done


def steady(record: np.ndarray) -> tuple[float, float] | None:
    """Return rate [1/s] and mean closing speed [m/s] of the impacts in the second half.

    Fewer than two impacts give None.
    """
    new = np.flatnonzero(np.diff(record["stop.impact_count"], prepend=0.0))
    late = record[new][record["time"][new] >= record["time"][-1] / 2]
    if len(late) < 2:
        return None
    rate = (len(late) - 1) / (late["time"][-1] - late["time"][0])
    return rate, late["stop.approach_speed"].mean()


def expected_speed(stroke: float) -> float:
    """Return the closing speed of a steady bounce over a stroke by beam theory [m/s].

    Over the stroke s the springs and gravity store E = 12 EI s^2 / L^3 + m g s.  The force F adds
    F s on the way out and again on the way back.  With the restitution eps, the shuttle leaves the
    stop with the energy eps^2 (E + F s), so that eps^2 (E + F s) + F s = E.
    """
    L, h, b, young, density = 0.04, 1e-4, 8e-3, 181.5e9, 7800.0
    mass = 0.053187 + 2 * 13 / 35 * density * L * h * b
    stored = 12 * young * b * h**3 / 12 / L**3 * stroke**2 + 0.053187 * 9.81 * stroke
    driven = stored * (1 - RESTITUTION**2) / (1 + RESTITUTION**2)
    return math.sqrt(2 * (stored + driven) / mass)


def figure(record: np.ndarray) -> Figure:
    """Plot motion, force and energies."""
    result = Figure((8.0, 6.6), dpi=120, layout="constrained")
    motion, force, energy = result.subplots(3, 1, sharex=True)
    t = record["time"]
    motion.plot(t, 1e3 * record["shuttle.x"], color="#1f4e79", linewidth=1.0)
    motion.axhline(-1e3 * STROKE, color="#d55e00", linewidth=1.0, linestyle="--", label="set point")
    motion.set_ylabel("shuttle.x [mm]")
    motion.legend(loc="lower right", frameon=False)
    force.plot(t, record["force.x"], color="#1f4e79", linewidth=0.8, drawstyle="steps-post")
    force.set_ylabel("force.x [N]")
    energy.plot(t, 1e3 * record["energy.work"], color="#e69f00", label="energy.work")
    energy.plot(t, 1e3 * work(record), "k:", label="sum of force times displacement")
    energy.plot(t, 1e3 * record["energy.dissipated"], color="#cc79a7", label="dissipated")
    energy.plot(t, 1e3 * balance(record), "k--", linewidth=1.0, label="balance")
    energy.set_ylabel("energy [mJ]")
    energy.set_xlabel("time [s]")
    energy.legend(loc="upper left", frameon=False, fontsize=9)
    for axes in (motion, force, energy):
        axes.grid(color="#eeeeee")
        axes.margins(x=0.0)
    return result


def main(arguments: list[str] | None = None) -> None:
    """Simulate, print the settled state and write the figure."""
    parser = argparse.ArgumentParser(description="A controller FMU keeps a guide FMU bouncing.")
    parser.add_argument(
        "--model", default=MODEL, choices=sorted(shipped()),
        help="shipped mechanism (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--stop-time",
        type=float,
        default=3.0,
        help="end of the simulation [s] (default: %(default)s)",
    )
    options = parser.parse_args(arguments)
    if not STEP <= options.stop_time < math.inf:
        parser.error(f"--stop-time {options.stop_time:g}: must be finite and at least {STEP:g} s")
    record = simulate(options.stop_time, options.model)
    settled = steady(record)
    if settled is None:
        print("fewer than two impacts in the second half: increase --stop-time; ", end="")
    else:
        print("impacts {:.2f} per second at {:.4f} m/s; ".format(*settled), end="")
    print(f"energy balance of a steady bounce {expected_speed(STROKE):.4f} m/s")
    print(f"stroke {1e3 * record['reached'][-1]:.3f} mm, set point {1e3 * STROKE:.3f} mm")
    print(
        f"work of the controller {1e3 * work(record)[-1]:.6f} mJ, "
        f"energy.work of the guide {1e3 * record['energy.work'][-1]:.6f} mJ"
    )
    print(f"energy balance constant to {1e3 * np.ptp(balance(record)):.1e} mJ")
    try:
        figure(record).savefig("stroke_controller.png")
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a writable folder")
    print("figure: stroke_controller.png")


if __name__ == "__main__":
    main()
