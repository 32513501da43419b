"""Drop a device, and compute the speed at which the shuttle inside it hits its stop.

    python examples/drop_test/run.py

In free fall the mechanism is weightless.  When the housing lands from the height H, its velocity
changes by

    u = (1 + e) sqrt(2 g H)

within a few milliseconds.  The input base.acceleration.x of the guide is a half sine with this
integral.  The shuttle continues its fall until its flexures or the stop decelerate it.
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

from prbm import PrbmError, load
from prbm.base.progress import Progress, reporter
from prbm.fmu.native_fmu import build
from prbm.references.scalar_guide import Monolith, ScalarGuide
from prbm.systems.cosimulation import simulate as cosimulate

GUIDE = load("PRBDM")
TRAVEL = 1e-3  # Distance from the shuttle to the stop [m].
START = {
    "flexure.length": 0.01, "shuttle.width": 0.02, "shuttle.com_height": 0.003,
    "shuttle.mass": 5e-3, "shuttle.inertia": 2e-7, "gravity.x": 0.0,
    "release.displacement": 0.0, "stop.position": TRAVEL, "damping.beta": 0.0,
}  # fmt: skip
GRAVITY = 9.81  # [m/s2]
HOUSING_RESTITUTION = 0.3  # Coefficient of restitution e of the housing [-].
SHOCK_DURATION = 2e-3  # [s]
HEIGHTS = (0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)  # [m]
STEP = 2e-5  # Communication step [s].
OUTPUTS = ("impact_count", "impact_time", "approach_speed", "impulse")


def velocity_change(height: float) -> float:
    """Return the change of the velocity of the housing at landing [m/s]."""
    return (1 + HOUSING_RESTITUTION) * math.sqrt(2 * GRAVITY * height)


def shock(height: float, begin: float, end: float) -> float:
    """Return the mean acceleration of the housing between two times [m/s2].

    The fall is along +x, the acceleration along -x.  The sum of all means, each multiplied by its
    duration, is the change of velocity:

    >>> times = np.linspace(0.0, 2 * SHOCK_DURATION, 12)
    >>> changes = [shock(0.5, a, b) * (b - a) for a, b in zip(times, times[1:])]
    >>> bool(np.isclose(-sum(changes), velocity_change(0.5)))
    True
    """

    def speed_lost(t: float) -> float:
        phase = math.pi * min(max(t / SHOCK_DURATION, 0.0), 1.0)
        return velocity_change(height) * (1 - math.cos(phase)) / 2

    return -(speed_lost(end) - speed_lost(begin)) / (end - begin)


def drop(fmu: Path, height: float, stop_time: float = 8e-3) -> np.ndarray:
    """Simulate the guide in one drop.

    Returns
    -------
    structured array
        Time since the landing [s] and outputs by ``guide.name``.
    """
    record = [f"guide.{name}" for name in ("shuttle.x", *(f"stop.{x}" for x in OUTPUTS))]
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
    """Simulate the guide in a drop from each height.

    Returns
    -------
    structured array
        ``height`` [m], ``time`` [s], ``speed`` [m/s] and ``impulse`` [N s] of the first hit, zero
        without a hit.
    """
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        fmu = Path(folder) / "guide.fmu"
        fmu.write_bytes(build(GUIDE, fmi=3))
        for k, height in enumerate(heights):
            result = drop(fmu, height)
            hit = result["guide.stop.impact_count"] > 0
            first = result[hit.argmax()]
            latched = [first[f"guide.stop.{name}"] if hit.any() else 0.0 for name in OUTPUTS[1:]]
            rows.append((height, *latched))
            if progress is not None:
                progress((k + 1) / len(heights))
    return np.array(rows, [(name, float) for name in ("height", "time", "speed", "impulse")])


def guide() -> ScalarGuide:
    """Return the scalar equation of the guide."""
    return ScalarGuide.of(GUIDE.values(START), [TRAVEL])


def monolith(height: float) -> float:
    """Return the speed of the first hit by the scalar equation, 0 without a hit [m/s]."""
    body = guide()

    def force(t: float, x: float, v: float, z: np.ndarray) -> float:
        sine = math.sin(math.pi * t / SHOCK_DURATION) if t < SHOCK_DURATION else 0.0
        return body.mass * velocity_change(height) * math.pi / (2 * SHOCK_DURATION) * sine

    one = Monolith(body, force, substep=STEP)
    one.advance(SHOCK_DURATION)  # The rate of the acceleration jumps here.
    one.advance(8e-3)
    return one.impacts[0][1] if one.impacts else 0.0


def linear(height: float) -> float:
    """Return the speed of the first hit by beam theory in closed form, 0 without a hit [m/s].

    The undamped oscillator has w^2 = 24 E I / (L^3 m), where m is the mass of the shuttle and 13/35
    of each flexure.  The half sine A sin(p t) with A = u p / 2 and p = pi / T gives

        x = A (p sin(w t) - w sin(p t)) / (w (p^2 - w^2)),      t <= T,

    followed by a free vibration.
    """
    v = GUIDE.values(START)
    L, h, b = (v[f"flexure.{name}"] for name in ("length", "thickness", "width"))
    mass = v["shuttle.mass"] + 2 * 13 / 35 * v["flexure.density"] * L * h * b
    w = math.sqrt(24 * v["flexure.youngs_modulus"] * b * h**3 / 12 / L**3 / mass)
    p = math.pi / SHOCK_DURATION
    scale = velocity_change(height) * p / 2 / (w * (p * p - w * w))

    def state(t: float) -> tuple[float, float]:
        s = min(t, SHOCK_DURATION)
        x = scale * (p * math.sin(w * s) - w * math.sin(p * s))
        v = scale * p * w * (math.cos(w * s) - math.cos(p * s))
        c, d = math.cos(w * (t - s)), math.sin(w * (t - s))
        return x * c + v / w * d, v * c - x * w * d

    times = np.linspace(0.0, math.pi / w + SHOCK_DURATION, 2000)
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
        (velocity_change, "black", "change of the housing's velocity"),
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
    """Simulate all drops, print the hits beside independent values and write the figure."""
    parser = argparse.ArgumentParser(description="Speed at which a dropped guide hits its stop.")
    parser.add_argument(
        "--heights", type=float, nargs="+", default=HEIGHTS, help="drop heights [m]"
    )
    options = parser.parse_args(arguments)
    if not all(0.0 < height <= 100.0 for height in options.heights):
        parser.error("--heights: must be above 0 and at most 100 m")
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
        sys.exit(f"cannot write {error.filename}: {error.strerror}; run this in a writable folder")
    print("figure: drop_test.png")


if __name__ == "__main__":
    main()
