"""Three FMUs: a guide, a voice coil and the controller of its current, up to a hard stop and on.

    controller --- voltage ---> coil --- force ---> guide
        ^--------- current ------' ^--- velocity ----'

    python examples/voice_coil/run.py

The current is switched on at rest; the shuttle runs into the stop, bounces and settles there.
"""

import argparse
import math
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pythonfmu import FmuBuilder

from prbm import load
from prbm.base.errors import PrbmError
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
STEP = 1e-4  # s, from sample to sample of the controller
CONNECTIONS = {
    "controller.current": "coil.current",
    "coil.voltage": "controller.voltage",
    "coil.velocity": "guide.shuttle.vx",
    "guide.force.x": "coil.force",
}
GUIDE_SAYS = ("shuttle.x", "energy.work", "energy.kinetic", "energy.elastic", "energy.dissipated")
STOP_SAYS = tuple(f"stop.{x}" for x in ("contact", "impact_count", "impact_time", "approach_speed"))
RECORD = (
    *(f"guide.{name}" for name in (*GUIDE_SAYS, *STOP_SAYS)),
    *(f"coil.{name}" for name in ("supplied", "heat", "magnetic")),
)


def fmus(folder: Path) -> dict[str, Path]:
    """Build the three FMUs, in the order in which they go."""
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
    """Couple the three FMUs.

    Parameters
    ----------
    stop_time, step : float
        Duration, communication step and sampling time of the controller [s].

    Returns
    -------
    structured array
        Time [s] and the outputs by ``name.variable``, a row each step.
    """
    with tempfile.TemporaryDirectory() as folder:
        return cosimulate(
            fmus(Path(folder)), CONNECTIONS, stop_time, step, values(), RECORD, progress=reporter()
        )


def monolith(stop_time: float = 0.35, step: float = STEP) -> Monolith:
    """Simulate the same system in one solver: the scalar guide, the coil, the sampled controller.

    Returns
    -------
    Monolith
        At the end, with the impacts that there were.
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
        missing = CONTROLLER["wanted"] - float(system.z[0])
        integral += CONTROLLER["rate"] * missing * step  # the voltage stays far from its limit
        voltage = CONTROLLER["gain"] * missing + integral
        system.advance((sample + 1) * step)
    return system


def impacts(record: np.ndarray) -> np.ndarray:
    """Return time [s] and closing speed [m/s] of each impact of a record, shape (n, 2)."""
    new = np.flatnonzero(np.diff(record["guide.stop.impact_count"], prepend=0))
    return np.column_stack(
        [record[f"guide.stop.{name}"][new] for name in ("impact_time", "approach_speed")]
    )


def books(record: np.ndarray) -> np.ndarray:
    """Return what is supplied less all that it becomes, row by row [J].

    What the coil takes from the circuit and what the guide gets from it differ within a step, in
    which the one sees the velocity at its beginning: an error of the coupling.
    """
    becomes = ("coil.heat", "coil.magnetic", "guide.energy.kinetic", "guide.energy.elastic",
               "guide.energy.dissipated")  # fmt: skip
    return record["coil.supplied"] - sum(record[name] for name in becomes)


def figure(record: np.ndarray, reference: Monolith) -> Figure:
    """Plot motion, current and energies."""
    result = Figure((8.0, 6.4), dpi=100, layout="constrained")
    motion, current, energy = result.subplots(3, 1, sharex=True)
    t = 1e3 * record["time"]
    motion.plot(t, 1e3 * record["guide.shuttle.x"], color="#1f4e79", linewidth=1.2)
    times = 1e3 * np.array([time for time, _ in reference.impacts])
    motion.plot(
        times, np.full(len(times), 1e3 * START["stop.position"]), "o", mfc="none",
        color="#d55e00", label="impacts of one solver for all three",
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
    """Couple the FMUs, print how they settle beside one solver for all, write the figure."""
    parser = argparse.ArgumentParser(description="A guide, a coil and its controller: three FMUs.")
    parser.add_argument("--stop-time", type=float, default=0.35, help="[s]; %(default)s")
    options = parser.parse_args(arguments)
    if not STEP <= options.stop_time < math.inf:
        parser.error(f"--stop-time {options.stop_time:g}: must be {STEP:g} s or longer")
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
        print("not at rest yet: simulate longer")
    else:
        print(f"at rest from {1e3 * settled:.1f} ms on; one solver {1e3 * reference.rest_time:.1f}")
    supplied = record["coil.supplied"][-1]
    print(
        f"supplied {1e3 * supplied:.4f} mJ, of which the guide got "
        f"{1e6 * record['guide.energy.work'][-1]:.2f} uJ; the books of the three differ by "
        f"{1e6 * np.abs(books(record)).max():.2f} uJ at most"
    )
    try:
        figure(record, reference).savefig("voice_coil.png")
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a folder of yours")
    print("figure: voice_coil.png")


if __name__ == "__main__":
    main()
