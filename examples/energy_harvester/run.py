"""Two FMUs: a shuttle between two stops on a shaken frame, and an electrical load.

    guide --- shuttle.vx ---> load
      ^------- force ----------'

    python examples/energy_harvester/run.py

The frequency rises and then falls in steps; at each frequency, the power is measured after the
vibration has settled.  Between the stops the resonance bends to higher frequencies, so that the
power depends on the direction of the sweep.
"""

import argparse
import math
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pythonfmu import FmuBuilder

from prbm import PrbmError, load
from prbm.base.progress import Progress, reporter
from prbm.fmu.native_fmu import build
from prbm.references.scalar_guide import Monolith, ScalarGuide
from prbm.systems.cosimulation import System

HERE = Path(__file__).resolve().parent
MECHANISM = load(HERE / "Harvester.toml")
LOAD = {"resistance": 50.0, "load": 100.0, "inductance": 0.02, "constant": 5.0}
AMPLITUDE = 6.0  # Amplitude of the base acceleration [m/s2].
FREQUENCIES = tuple(np.arange(26.0, 50.1, 2.0))  # [Hz]
SETTLING, MEASURED = 30, 10  # Periods before and during the measurement.
STEPS = 64  # Communication steps per period.
CONNECTIONS = {"load.velocity": "guide.shuttle.vx", "guide.coil.x": "load.force"}
WATCHED = (
    "load.harvested", "load.heat", "guide.left.impact_count", "guide.right.impact_count",
)  # fmt: skip
ROW = [(name, float) for name in ("frequency", "power", "heat", "impacts")]


@contextmanager
def system() -> Iterator[System]:
    """Build the two FMUs, couple them and start them at rest."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "guide.fmu").write_bytes(build(MECHANISM, fmi=3))
        fmus = {
            "guide": folder / "guide.fmu",
            "load": FmuBuilder.build_FMU(HERE / "electrical_load.py", dest=folder),
        }
        with System(fmus, CONNECTIONS, events=True, watched=WATCHED) as coupled:
            coupled.start({f"load.{name}": x for name, x in LOAD.items()})
            yield coupled


def sweep(frequencies: Sequence[float], progress: Progress | None = None) -> np.ndarray:
    """Shake at one frequency after the other, without a pause.

    Parameters
    ----------
    frequencies : sequence of float
        Frequencies in their order [Hz].
    progress : callable or None
        Called with the completed fraction.

    Returns
    -------
    structured array
        ``frequency`` [Hz], mean ``power`` of the load and ``heat`` of the coil [W], ``impacts``
        per period; one row per frequency.
    """
    rows = []
    with system() as coupled:
        for k, frequency in enumerate(frequencies):
            shake(coupled, frequency, SETTLING)
            before = dict(coupled.values)
            shake(coupled, frequency, MEASURED)
            change = [coupled.values[name] - before[name] for name in WATCHED]
            span = MEASURED / frequency
            rows.append((frequency, change[0] / span, change[1] / span, sum(change[2:]) / MEASURED))
            if progress is not None:
                progress((k + 1) / len(frequencies))
    return np.array(rows, ROW)


def shake(coupled: System, frequency: float, periods: int) -> None:
    """Continue for some periods; a step uses the acceleration at the middle of the step."""
    begin, h = coupled.time, 1.0 / frequency / STEPS
    for k in range(periods * STEPS):
        angle = 2 * math.pi * (k + 0.5) / STEPS
        coupled.give({"guide.base.acceleration.x": AMPLITUDE * math.sin(angle)})
        for _ in coupled.steps(begin + (k + 1) * h):
            pass


def guide() -> ScalarGuide:
    """Return the scalar equation of the mechanism."""
    values = MECHANISM.values()
    values |= {f"stop.{name}": values[f"left.{name}"] for name in ("restitution", "rest_speed")}
    return ScalarGuide.of(values, [values["travel"], -values["travel"]])


def linear(frequency: float | np.ndarray) -> float | np.ndarray:
    """Return the power of the load without stops, for small vibrations [W].

    M is the mass, K = 4 k / r^2 the stiffness, beta the damping time, k_e the constant of the coil,
    L its inductance, R the total resistance, a the amplitude of the acceleration and w the angular
    frequency.  The amplitude X of the shuttle solves

        X (K + j w beta K - M w^2 + j w k_e^2 / (R + j w L)) = -M a,

    and the power of the load is R_load |j w k_e X / (R + j w L)|^2 / 2.
    """
    free, w = guide(), 2 * math.pi * frequency
    K = 4 * free.k / free.r**2
    Z = LOAD["resistance"] + LOAD["load"] + 1j * w * LOAD["inductance"]
    braked = 1j * w * LOAD["constant"] ** 2 / Z
    X = -free.mass * AMPLITUDE / (K * (1 + 1j * w * free.beta) - free.mass * w**2 + braked)
    return LOAD["load"] * np.abs(1j * w * LOAD["constant"] * X / Z) ** 2 / 2


def monolith(frequencies: Sequence[float], stops: bool = True) -> list[float]:
    """Return the powers of the load by one solver for both systems, as in :func:`sweep` [W]."""
    R, k = LOAD["resistance"] + LOAD["load"], LOAD["constant"]
    body = guide() if stops else replace(guide(), stops=())
    begin = frequency = 0.0

    def force(t: float, x: float, v: float, z: np.ndarray) -> float:
        shaken = AMPLITUDE * math.sin(2 * math.pi * frequency * (t - begin))
        return -k * z[0] - body.mass * shaken

    def rates(t: float, x: float, v: float, z: np.ndarray) -> list[float]:
        return [(k * v - R * z[0]) / LOAD["inductance"], LOAD["load"] * z[0] ** 2]

    # The substep is below the time constant of the coil, 1.3e-4 s.
    one = Monolith(body, force, rates, [0.0, 0.0], substep=1e-4)
    powers = []
    for frequency in frequencies:
        begin = one.time
        one.advance(begin + SETTLING / frequency)
        before = one.z[1]
        one.advance(begin + (SETTLING + MEASURED) / frequency)
        powers.append(float(one.z[1] - before) * frequency / MEASURED)
    return powers


def figure(up: np.ndarray, down: np.ndarray, checked: dict[float, float]) -> Figure:
    """Plot the power over the frequency."""
    result = Figure((7.0, 4.2), dpi=100, layout="constrained")
    axes = result.subplots()
    f = np.linspace(up["frequency"].min(), up["frequency"].max(), 300)
    axes.plot(f, 1e3 * linear(f), "k--", linewidth=1.0, label="without stops, linear")
    axes.plot(up["frequency"], 1e3 * up["power"], "o-", color="#1f4e79", label="frequency rising")
    axes.plot(
        down["frequency"], 1e3 * down["power"], "v-", color="#d55e00", label="frequency falling"
    )
    axes.plot(
        [*checked], [1e3 * p for p in checked.values()], "s", mfc="none", ms=11, color="#009e73",
        label="one solver, frequency rising",
    )  # fmt: skip
    axes.set_xlabel("frequency of the base [Hz]")
    axes.set_ylabel("power of the load [mW]")
    axes.set_ylim(0.0, 1.6e3 * up["power"].max())
    axes.grid(color="#eeeeee")
    axes.legend(frameon=False)
    return result


def main(arguments: list[str] | None = None) -> None:
    """Sweep up and down, print the powers beside independent values and write the figure."""
    parser = argparse.ArgumentParser(description="Power of a harvester with stops.")
    parser.add_argument(
        "--frequencies",
        type=float,
        nargs="+",
        default=FREQUENCIES,
        help="frequencies of the base [Hz]",
    )
    options = parser.parse_args(arguments)
    rising = sorted(options.frequencies)
    if not 1.0 <= rising[0] <= rising[-1] <= 500.0:
        parser.error("--frequencies: must lie between 1 and 500 Hz")
    try:
        both = sweep([*rising, *rising[-2::-1]], reporter())
    except PrbmError as error:
        sys.exit(str(error))
    up, down = both[: len(rising)], both[len(rising) - 1 :]
    checked = dict(zip(rising[1:6:2], monolith(rising[1:6:2]), strict=True))
    print("frequency [Hz]  rising [mW]  one solver  falling  without stops  impacts per period")
    for row, back in zip(up, down[::-1], strict=True):
        frequency = float(row["frequency"])
        one = f"{1e3 * checked[frequency]:12.4f}" if frequency in checked else " " * 12
        print(
            f"{frequency:14.1f}{1e3 * row['power']:13.4f}{one}{1e3 * back['power']:9.4f}"
            f"{1e3 * linear(frequency):15.4f}{row['impacts']:20.1f}"
        )
    try:
        figure(up, down, checked).savefig("energy_harvester.png")
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a writable folder")
    print("figure: energy_harvester.png")


if __name__ == "__main__":
    main()
