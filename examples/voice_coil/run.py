"""Three FMUs: a guide with a hard stop, a voice coil and a current controller.

    controller --- voltage ---> coil --- force ---> guide
        ^--------- current ------' ^--- velocity ----'

    python examples/voice_coil/run.py

The current is switched on at rest.  The shuttle hits the stop, bounces and comes to rest there.
"""

import argparse
import math
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pythonfmu import FmuBuilder

from prbm import PrbmError, load
from prbm.base.progress import reporter
from prbm.fmu.native_fmu import build
from prbm.references.scalar_guide import Monolith, ScalarGuide
from prbm.runs.result import rest_time
from prbm.systems.cosimulation import simulate as cosimulate

HERE = Path(__file__).resolve().parent
GUIDE = load("PRBDM")
START = {"gravity.x": 0.0, "release.displacement": 0.0, "stop.position": 0.002}
COIL = {"resistance": 4.0, "inductance": 2e-3, "constant": 2.0}  # Ohm, H, N/A
CONTROLLER = {"gain": 4.0, "rate": 8e3, "limit": 12.0, "wanted": 0.1}  # V/A, V/(A s), V, A
STEP = 1e-4  # Communication step and sampling time of the controller [s].
CONNECTIONS = {
    "controller.current": "coil.current",
    "coil.voltage": "controller.voltage",
    "coil.velocity": "guide.shuttle.vx",
    "guide.force.x": "coil.force",
}
GUIDE_OUTPUTS = (
    "shuttle.x", "energy.work", "energy.kinetic", "energy.elastic", "energy.dissipated",
    "stop.contact", "stop.impact_count", "stop.impact_time", "stop.approach_speed",
)  # fmt: skip
RECORD = (
    *(f"guide.{name}" for name in GUIDE_OUTPUTS),
    *(f"coil.{name}" for name in ("supplied", "heat", "magnetic")),
)


def fmus(folder: Path) -> dict[str, Path]:
    """Build the three FMUs, in the order of their steps."""
    guide = folder / "guide.fmu"
    guide.write_bytes(build(GUIDE, fmi=2))
    return {
        "controller": FmuBuilder.build_FMU(HERE / "current_controller.py", dest=folder),
        "coil": FmuBuilder.build_FMU(HERE / "coil.py", dest=folder),
        "guide": guide,
    }


def values() -> dict[str, float]:
    """Return the start values of the system by ``name.variable``."""
    groups = {"guide": START, "coil": COIL, "controller": CONTROLLER}
    return {f"{name}.{key}": x for name, group in groups.items() for key, x in group.items()}


def simulate(stop_time: float = 0.35, step: float = STEP) -> np.ndarray:
    """Simulate the three coupled FMUs.

    Parameters
    ----------
    stop_time, step : float
        Duration, communication step and sampling time of the controller [s].

    Returns
    -------
    structured array
        Time [s] and the outputs by ``name.variable``, one row per step.
    """
    with tempfile.TemporaryDirectory() as folder:
        return cosimulate(
            fmus(Path(folder)), CONNECTIONS, stop_time, step, values(), RECORD, progress=reporter()
        )


def monolith(stop_time: float = 0.35, step: float = STEP) -> Monolith:
    """Simulate the same system with one solver: scalar guide, coil and sampled controller.

    Returns
    -------
    Monolith
        The system at the end, with its impacts.
    """
    R, L, k = COIL.values()
    guide = ScalarGuide.of(GUIDE.values(START), [START["stop.position"]])
    voltage = integral = 0.0
    system = Monolith(
        guide,
        force=lambda t, x, v, z: k * z[0],
        rates=lambda t, x, v, z: [(voltage - R * z[0] - k * v) / L],
        z=[0.0],
        substep=step,
    )
    for sample in range(round(stop_time / step)):
        error = CONTROLLER["wanted"] - float(system.z[0])
        integral += CONTROLLER["rate"] * error * step  # The voltage does not reach its limit.
        voltage = CONTROLLER["gain"] * error + integral
        system.advance((sample + 1) * step)
    return system


def impacts(record: np.ndarray) -> np.ndarray:
    """Return time [s] and closing speed [m/s] of each impact of a record, shape (n, 2)."""
    new = np.flatnonzero(np.diff(record["guide.stop.impact_count"], prepend=0))
    return np.column_stack(
        [record[f"guide.stop.{name}"][new] for name in ("impact_time", "approach_speed")]
    )


def energy_error(record: np.ndarray) -> np.ndarray:
    """Return the supplied energy less its parts in coil and guide, row by row [J].

    The error comes from the coupling: within a step the coil uses the velocity of the guide at the
    beginning of the step, although this velocity changes.
    """
    parts = ("coil.heat", "coil.magnetic", "guide.energy.kinetic", "guide.energy.elastic",
               "guide.energy.dissipated")  # fmt: skip
    return record["coil.supplied"] - sum(record[name] for name in parts)


def figure(record: np.ndarray, reference: Monolith) -> Figure:
    """Plot motion, current and energies over time."""
    result = Figure((8.0, 6.4), dpi=100, layout="constrained")
    motion, current, energy = result.subplots(3, 1, sharex=True)
    t = 1e3 * record["time"]
    motion.plot(t, 1e3 * record["guide.shuttle.x"], color="#1f4e79", linewidth=1.2)
    times = 1e3 * np.array([time for time, _ in reference.impacts])
    motion.plot(
        times, np.full(len(times), 1e3 * START["stop.position"]), "o", mfc="none",
        color="#d55e00", label="impacts by one solver for all three",
    )  # fmt: skip
    motion.set_ylabel("shuttle.x [mm]")
    motion.legend(loc="lower right", frameon=False)
    current.plot(t, 1e3 * record["coil.current"], color="#1f4e79", linewidth=1.0)
    current.set_ylabel("current [mA]")
    for name, colour in (("supplied", "#e69f00"), ("heat", "#cc79a7")):
        energy.plot(t, 1e3 * record[f"coil.{name}"], color=colour, label=f"coil.{name}")
    energy.plot(t, 1e3 * record["guide.energy.work"], color="#1f4e79", label="guide.energy.work")
    energy.set_ylabel("energy [mJ]")
    energy.set_xlabel("time [ms]")
    energy.legend(loc="upper left", frameon=False)
    for axes in (motion, current, energy):
        axes.grid(color="#eeeeee")
        axes.margins(x=0.0)
    return result


def main(arguments: list[str] | None = None) -> None:
    """Simulate, print the impacts beside those of one solver and write the figure."""
    parser = argparse.ArgumentParser(description="A guide, a coil and its controller: three FMUs.")
    parser.add_argument(
        "--stop-time",
        type=float,
        default=0.35,
        help="end of the simulation [s] (default: %(default)s)",
    )
    options = parser.parse_args(arguments)
    if not STEP <= options.stop_time < math.inf:
        parser.error(f"--stop-time {options.stop_time:g}: must be finite and at least {STEP:g} s")
    try:
        record = simulate(options.stop_time)
    except PrbmError as error:
        sys.exit(str(error))
    reference = monolith(options.stop_time)
    print("impact at [ms]   one solver    speed [mm/s]   one solver")
    for (time, speed), (t, v) in zip(impacts(record), reference.impacts, strict=False):
        print(f"{1e3 * time:14.4f}{1e3 * t:13.4f}{1e3 * speed:16.3f}{1e3 * v:13.3f}")
    settled = rest_time(record, "guide.stop")
    if settled is None or reference.rest_time is None:
        print("not yet at rest: increase --stop-time")
    else:
        print(f"at rest from {1e3 * settled:.1f} ms on; one solver {1e3 * reference.rest_time:.1f}")
    supplied = record["coil.supplied"][-1]
    print(
        f"supplied {1e3 * supplied:.4f} mJ, delivered to the guide "
        f"{1e6 * record['guide.energy.work'][-1]:.2f} uJ; largest error of the energy balance "
        f"{1e6 * np.abs(energy_error(record)).max():.2f} uJ"
    )
    try:
        figure(record, reference).savefig("voice_coil.png")
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a writable folder")
    print("figure: voice_coil.png")


if __name__ == "__main__":
    main()
