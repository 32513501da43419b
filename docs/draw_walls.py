"""Draw how a wall joins its reference, for docs/embedding.md.

python docs/draw_walls.py
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from prbm.mechanics.inputs import Wall

STEP, AMPLITUDE, RATE = 10e-3, 1.0, 10 * np.pi  # s, mm, rad/s
TARGET = Path(__file__).parent / "figures" / "walls.png"


def true(t: np.ndarray | float) -> np.ndarray | float:
    """Return the position of the true wall [mm], at rest until it starts."""
    return AMPLITUDE * (1 - np.cos(RATE * np.maximum(t, 0.0)))


def velocity(t: float) -> float:
    """Return its velocity [mm/s]."""
    return float(AMPLITUDE * RATE * np.sin(RATE * max(t, 0.0)))


def draw() -> Figure:
    """Draw position and distance from the true wall, at communication steps of 10 ms."""
    figure = Figure(figsize=(7.5, 3.2), layout="constrained")
    place, distance = figure.subplots(1, 2)
    x, speed, span = 0.0, 0.0, 2 * STEP
    for k in range(10):
        t = k * STEP
        wall = Wall(float(true(t)), velocity(t), t, x - float(true(t)), speed - velocity(t), span)
        times = np.linspace(t, t + STEP, 30)
        found, _, _ = wall.motion(times)
        first = {"label": "wall"} if k == 0 else {}
        place.plot(1e3 * times, found, "C0", **first)
        line = {"label": "references"} if k == 0 else {}
        place.plot(1e3 * times, wall.reference(times), "C1:", lw=1.0, **line)
        distance.plot(1e3 * times, 1e3 * (found - true(times)), "C0")
        x, speed = (float(part) for part in wall.motion(t + STEP)[:2])
    times = np.linspace(0.0, 10 * STEP, 300)
    place.plot(1e3 * times, true(times), "k--", lw=0.8, label="true wall")
    bound = 2e3 * AMPLITUDE * (RATE * STEP) ** 2
    for sign in (-1, 1):
        distance.axhline(sign * bound, color="k", ls=":", lw=0.8)
    distance.text(0.0, 0.85 * bound, "2 a h$^2$")
    place.set(xlabel="time [ms]", ylabel="position [mm]")
    distance.set(xlabel="time [ms]", ylabel="wall - true wall [um]")
    place.legend(frameon=False)
    return figure


if __name__ == "__main__":
    draw().savefig(TARGET, dpi=120)
