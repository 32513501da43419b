"""Draw how a wall joins its reference, for docs/embedding.md.

python docs/draw_walls.py
"""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
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


def draw_joining(axes: Axes) -> None:
    """Draw a wall at rest that joins the line of new inputs."""
    wall, end = Wall(0.4, 0.6, 0.0, -0.4, -0.6, 1.0), 1.4
    times = np.linspace(0.0, wall.span, 50)
    axes.plot([-0.3, *times, end], [0.0, *wall.motion(times)[0], wall.reference(end)], "C0")
    axes.plot([0.0, end], [wall.reference(0.0), wall.reference(end)], "C1--")
    for time in (0.0, wall.span):
        axes.axvline(time, color="k", ls=":", lw=0.8)
    axes.annotate("", (0.0, 0.0), (0.0, 0.4), arrowprops={"arrowstyle": "<->"})
    axes.text(-0.15, 0.18, "-e")
    axes.text(0.06, 0.68, "line r", color="C1")
    axes.text(0.45, 0.25, "wall x", color="C0")
    axes.set_xticks([0.0, wall.span], ["t0", "t0 + T"])
    axes.set_yticks([])
    axes.set(xlabel="time", ylabel="position")


def draw_distance(axes: Axes) -> None:
    """Draw the distance from a true wall, at communication steps of 10 ms."""
    x, speed, span = 0.0, 0.0, 2 * STEP
    for k in range(25):
        t = k * STEP
        wall = Wall(float(true(t)), velocity(t), t, x - float(true(t)), speed - velocity(t), span)
        times = np.linspace(t, t + STEP, 30)
        axes.plot(1e3 * times, 1e3 * (wall.motion(times)[0] - true(times)), "C0")
        x, speed = (float(part) for part in wall.motion(t + STEP)[:2])
    bound = 2e3 * AMPLITUDE * (RATE * STEP) ** 2
    for sign in (-1, 1):
        axes.axhline(sign * bound, color="k", ls=":", lw=0.8)
    axes.text(0.0, 0.85 * bound, "2 a h$^2$")
    axes.set(xlabel="time [ms]", ylabel="wall - true wall [um]")


def draw() -> Figure:
    """Draw the cubic of a wall, and the distance from a true wall."""
    figure = Figure(figsize=(7.5, 3.2), layout="constrained")
    joining, distance = figure.subplots(1, 2)
    draw_joining(joining)
    draw_distance(distance)
    return figure


if __name__ == "__main__":
    draw().savefig(TARGET, dpi=120)
