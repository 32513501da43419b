"""Synthetic measurement records with known parameters and realistic noise."""

import numpy as np

from prbm.hybrid.simulation import Simulation
from support import mechanism

NOISE, RATE = 4e-6, 750.0  # m, Hz


def write(path, head, *columns):
    rows = "\n".join(",".join(f"{x:.9g}" for x in row) for row in zip(*columns, strict=True))
    path.write_text(f"{head}\n{rows}\n", encoding="utf-8")


def records(folder):
    """Write four records of measurements to a folder.

    They are a bending test (181.5 GPa), a calibration of a laser (200 V/m, 1.3 V), a free vibration
    (4.9 Hz), and a bouncing motion (restitution 0.6).
    """
    rng = np.random.default_rng(0)
    d = 1.5e-3 * (1 - np.cos(np.linspace(0, 10 * np.pi, 3000)))
    stiffness = 181.5e9 * 8e-3 * 0.1e-3**3 / (4 * 40e-3**3)
    F = stiffness * d + 1e-3 * rng.standard_normal(len(d))
    write(folder / "bending.csv", "d [mm],F [mN]", 1e3 * d, 1e3 * F)
    x = np.linspace(0, 2.5e-3, 50)
    volts = 1.3 + 200 * (x + NOISE * rng.standard_normal(50))
    write(folder / "stage.csv", "position (mm),laser (V)", 1e3 * x, volts)
    t = np.arange(3750) / RATE
    x = 1e-3 * np.exp(-0.02 * t) * np.cos(2 * np.pi * 4.9 * t) + NOISE * rng.standard_normal(3750)
    write(folder / "free.csv", "t [s],laser [V]", t, 1.3 + 200 * x)
    simulation, x = Simulation(mechanism("PRBDM"), {"release.displacement": -0.01}), []
    for time in t[:75]:
        simulation.advance(time)
        x.append(simulation.outputs()["shuttle.x"] + NOISE * rng.standard_normal())
    write(folder / "bounce.csv", "t [s],x [m]", t[:75], x)
