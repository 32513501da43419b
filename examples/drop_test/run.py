"""Drop a device, and see how hard the shuttle inside it hits its stop.

    python examples/drop_test/run.py

In free fall nothing weighs anything.  When the housing lands, its velocity changes by

    u = (1 + e) sqrt(2 g H)

within a few milliseconds: a half sine of acceleration, base.acceleration.x of the guide, which goes
on as it fell until its flexures stop it, or the stop does.
"""

import argparse
import math
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq

from prbm import load
from prbm.base.errors import PrbmError
from prbm.base.progress import Progress, reporter
from prbm.fmu.native_fmu import build
from prbm.references.scalar_guide import Monolith, ScalarGuide
from prbm.systems.cosimulation import simulate as cosimulate

GUIDE = load("PRBDM")
TRAVEL = 1e-3  # m, to the stop
START = {
    "flexure.length": 0.01, "shuttle.width": 0.02, "shuttle.com_height": 0.003,
    "shuttle.mass": 5e-3, "shuttle.inertia": 2e-7, "gravity.x": 0.0,
    "release.displacement": 0.0, "stop.position": TRAVEL, "damping.beta": 0.0,
}  # fmt: skip
GRAVITY, REBOUND, SHOCK = 9.81, 0.3, 2e-3  # m/s2, e of the housing [-], duration of the shock [s]
HEIGHTS = (0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)  # m
STEP = 2e-5  # s
SAID = ("impact_count", "impact_time", "approach_speed", "impulse")


def change(height: float) -> float:
    """Return the change of the housing's velocity by landing [m/s]."""
    return (1 + REBOUND) * math.sqrt(2 * GRAVITY * height)


def shock(height: float, begin: float, end: float) -> float:
    """Return the mean acceleration of the housing from one time to another [m/s2].

    Against the direction of the fall, which is +x.  Means add up to the change of the velocity:

    >>> times = np.linspace(0.0, 2 * SHOCK, 12)
    >>> means = [shock(0.5, a, b) * (b - a) for a, b in zip(times, times[1:])]
    >>> bool(np.isclose(-sum(means), change(0.5)))
    True
    """

    def gone(t: float) -> float:
        return change(height) * (1 - math.cos(math.pi * min(max(t / SHOCK, 0.0), 1.0))) / 2

    return -(gone(end) - gone(begin)) / (end - begin)


def drop(fmu: Path, height: float, stop_time: float = 8e-3) -> np.ndarray:
    """Drop the guide.

    Returns
    -------
    structured array
        Time since the landing [s] and outputs by ``guide.name``.
    """
    record = [f"guide.{name}" for name in ("shuttle.x", *(f"stop.{x}" for x in SAID))]
    return cosimulate(
        {"guide": fmu},
        {},
        stop_time,
        STEP,
        {f"guide.{name}": x for name, x in START.items()},
        record,
        source=lambda t: {"guide.base.acceleration.x": shock(height, t, t + STEP)},
    )


def study(heights: Sequence[float] = HEIGHTS, progress: Progress | None = None) -> np.ndarray:
    """Drop the guide from each height.

    Returns
    -------
    structured array
        ``height`` [m], ``time`` [s], ``speed`` [m/s] and ``impulse`` [N s] of the first hit, zero
        if there is none.
    """
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        fmu = Path(folder) / "guide.fmu"
        fmu.write_bytes(build(GUIDE, fmi=3))
        for k, height in enumerate(heights):
            result = drop(fmu, height)
            hit = result["guide.stop.impact_count"] > 0
            first = result[hit.argmax()]
            said = [first[f"guide.stop.{name}"] if hit.any() else 0.0 for name in SAID[1:]]
            rows.append((height, *said))
            if progress is not None:
                progress((k + 1) / len(heights))
    return np.array(rows, [(name, float) for name in ("height", "time", "speed", "impulse")])


def guide() -> ScalarGuide:
    """Return the guide as one scalar equation."""
    return ScalarGuide.of(GUIDE.values(START), [TRAVEL])


def monolith(height: float) -> float:
    """Return the speed of the first hit by the scalar equation [m/s]; 0 if there is none."""
    body = guide()

    def force(t: float, x: float, v: float, z: np.ndarray) -> float:
        inside = math.sin(math.pi * t / SHOCK) if t < SHOCK else 0.0
        return body.mass * change(height) * math.pi / (2 * SHOCK) * inside

    one = Monolith(body, force, substep=STEP)
    one.advance(SHOCK)  # where the shock has a corner
    one.advance(8e-3)
    return one.impacts[0][1] if one.impacts else 0.0


def linear(height: float) -> float:
    """Return the same of a beam theory oscillator without damping, in closed form [m/s].

    w^2 = 24 E I / (L^3 m), m the shuttle and 13/35 of each flexure; a half sine
    A sin(p t), A = u p / 2, p = pi / T, gives

        x = A (p sin(w t) - w sin(p t)) / (w (p^2 - w^2)),      t <= T

    and then a free vibration.
    """
    v = GUIDE.values(START)
    L, h, b = (v[f"flexure.{name}"] for name in ("length", "thickness", "width"))
    mass = v["shuttle.mass"] + 2 * 13 / 35 * v["flexure.density"] * L * h * b
    w = math.sqrt(24 * v["flexure.youngs_modulus"] * b * h**3 / 12 / L**3 / mass)
    p = math.pi / SHOCK
    scale = change(height) * p / 2 / (w * (p * p - w * w))

    def state(t: float) -> tuple[float, float]:
        s = min(t, SHOCK)
        x = scale * (p * math.sin(w * s) - w * math.sin(p * s))
        v = scale * p * w * (math.cos(w * s) - math.cos(p * s))
        c, d = math.cos(w * (t - s)), math.sin(w * (t - s))
        return x * c + v / w * d, v * c - x * w * d

    times = np.linspace(0.0, math.pi / w + SHOCK, 2000)
    beyond = [t for t in times if state(t)[0] > TRAVEL]
    if not beyond:
        return 0.0
    return state(brentq(lambda t: state(t)[0] - TRAVEL, 0.0, beyond[0]))[1]


def figure(table: np.ndarray) -> Figure:
    """Plot the speed of the hit over the height."""
    result = Figure((7.0, 4.2), dpi=100, layout="constrained")
    axes = result.subplots()
    heights = np.geomspace(table["height"].min(), table["height"].max(), 300)
    lines = (
        (change, "black", "change of the housing's velocity"),
        (linear, "#8fb4d8", "beam theory, closed form"),
    )
    for law, colour, label in lines:
        axes.plot(
            1e3 * heights, [law(h) for h in heights], label=label, linewidth=1.2, color=colour
        )
    axes.plot(1e3 * table["height"], table["speed"], "o", color="#1f4e79", label="FMU")
    axes.set_xscale("log")
    axes.set_xlabel("drop height [mm]")
    axes.set_ylabel("speed of the first hit [m/s]")
    axes.grid(color="#eeeeee", which="both")
    axes.legend(frameon=False)
    return result


def main(arguments: list[str] | None = None) -> None:
    """Drop from all heights, print the hits beside two others' values, write the figure."""
    parser = argparse.ArgumentParser(description="How hard a dropped guide hits its stop.")
    parser.add_argument("--heights", type=float, nargs="+", default=HEIGHTS, help="[m]")
    options = parser.parse_args(arguments)
    if not all(0.0 < height <= 100.0 for height in options.heights):
        parser.error("--heights: must be above 0 and up to 100 m")
    try:
        table = study(sorted(options.heights), reporter())
    except PrbmError as error:
        sys.exit(str(error))
    print("height [mm]  hit at [ms]  speed [m/s]  scalar equation  beam theory  impulse [mN s]")
    for height, time, speed, impulse in table:
        print(
            f"{1e3 * height:11.1f}{1e3 * time:13.4f}{speed:13.5f}{monolith(height):17.5f}"
            f"{linear(height):13.4f}{1e3 * impulse:16.3f}"
        )
    try:
        figure(table).savefig("drop_test.png")
    except OSError as error:
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a folder of yours")
    print("figure: drop_test.png")


if __name__ == "__main__":
    main()
