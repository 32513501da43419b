"""Guides, constants and functions shared by the reproduced results of the thesis."""

import math
from dataclasses import fields
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..files.mechanism_file import read_mechanism, shipped
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble
from ..mechanics.modal import modes
from ..mechanics.statics import equilibrium
from ..mechanism.description import Mechanism
from ..plots import figures
from ..references import source_model

K = "flexure.K_theta"
K_HOWELL = 2.65  # Published K_theta of the 1R.
K_THESIS = 2.5449  # K_theta of the 1R fitted in the thesis.
REFITTED = np.array([8.7614, 4.0104])  # K_theta1 and K_theta2 of the 2R fitted in the thesis.
LASER_NOISE, LASER_RATE = 4e-6, 750.0  # Noise [m] and sampling rate [Hz] of the laser sensor.
FORCE_NOISE = 1e-3  # Noise of the force sensor [N], 0.2 % of its range.
DRAWS = 200  # Number of synthetic records in a test of stated uncertainties
COVERAGE_ATOL = 3 * math.sqrt(0.683 * 0.317 / DRAWS)  # Three standard deviations of a coverage.
WEIGHTLESS = {"gravity.x": 0.0}
BLUE, RED, GREEN, PINK, GREY = "#1f4e79", "#d55e00", "#009e73", "#cc79a7", "#b4bcc6"


@cache
def guide(name: str) -> Mechanism:
    """Return a shipped mechanism."""
    return read_mechanism(shipped()[name])


def parameters(of: source_model.Structure) -> dict[str, float]:
    """Return the parameters of a guide with the dimensions of a structure, without gravity."""
    names = {
        "length": "flexure.length",
        "thickness": "flexure.thickness",
        "width": "flexure.width",
        "youngs_modulus": "flexure.youngs_modulus",
        "density": "flexure.density",
        "shuttle_width": "shuttle.width",
        "shuttle_mass": "shuttle.mass",
        "com_height": "shuttle.com_height",
    }
    given = {names[one.name]: float(getattr(of, one.name)) for one in fields(of)}
    return {
        **given,
        "shuttle.inertia": of.shuttle_mass * of.shuttle_width**2 / 12,
        "gravity.x": 0.0,
        "damping.beta": 0.0,
    }


PMMA = {
    **parameters(source_model.PMMA),
    "release.displacement": 0.0,
    "release.velocity": 1.0,
    "stop.position": 0.15,
}
"""The PMMA guide of chapter 4, released straight at 1 m/s, with the wall out of reach."""


def frequencies(
    mechanism: Mechanism, values: dict[str, float], displacement: float | None = None
) -> Real:
    """Return the frequencies about the shape at rest, or held at a displacement [Hz]."""
    system = assemble(mechanism, mechanism.values(values))
    return modes(system, equilibrium(system, displacement)).frequency


def crossings(t: Real, x: Real) -> tuple[float, float]:
    """Return the mean frequency between rising zeros [Hz] and the maximum of a free vibration."""
    rising, below = [0.0], False
    for i in range(len(x) - 1):
        below = below or x[i] < -0.1 * x.max()  # Noise does not reach this level.
        if below and x[i + 1] >= 0.0:
            rising.append(float(t[i] - x[i] * (t[i + 1] - t[i]) / (x[i + 1] - x[i])))
            below = False
    return float(1.0 / np.diff(rising).mean()), float(x.max())


def peak_frequency(t: Real, x: Real) -> float:
    """Return the frequency between the first and the last maximum of a free vibration [Hz].

    Maxima are those of parabolas through three samples.
    """
    tops = []
    for i in np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:])) + 1:
        a, b, c = x[i - 1 : i + 2]
        tops.append(float(t[i] + (t[i + 1] - t[i]) * (a - c) / (2 * (a - 2 * b + c))))
    return (len(tops) - 1) / (tops[-1] - tops[0])


def panels(rows: int, columns: int = 1, size: tuple[float, float] = (7.0, 3.0)) -> list[Axes]:
    """Return the axes of a new figure, row by row."""
    return figures.panels(rows, columns, size, dpi=100)[1]


def figure_of(axes: Axes) -> Figure:
    """Return the figure that axes are on."""
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    return figure


def legend(axes: Axes, **options: Any) -> None:
    """Add a legend without a frame."""
    axes.legend(fontsize=9, frameon=False, **options)
