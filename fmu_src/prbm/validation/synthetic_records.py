"""Synthetic records: known motions with the noise of the sensors of the thesis."""

import math

import numpy as np

from ..data.series import Series
from ..mechanics.arrays import Real
from .common import LASER_NOISE, LASER_RATE


def bent(
    rng: np.random.Generator,
    samples: int,
    cycles: int,
    stiffness: float,
    largest: float,
    noise: float,
    loss: float = 0.0,
) -> tuple[Real, Real]:
    """Return deflection [m] and force [N] of a beam in cyclic bending.

    Parameters
    ----------
    rng : Generator
        Random numbers of the noise.
    samples, cycles : int
        Number of samples and of cycles.
    stiffness, largest, noise : float
        Stiffness [N/m], largest deflection [m], standard deviation of the force [N].
    loss : float
        Share of the work of a cycle that is lost during unloading [-].
    """
    phase = np.linspace(0.0, 2 * np.pi * cycles, samples)
    d = largest * (1 - np.cos(phase)) / 2
    fall = np.where(np.sin(phase) < 0.0, 1 - 3 * loss * (1 - d / largest), 1.0)
    return d, stiffness * d * fall + noise * rng.standard_normal(samples)


def vibration(rng: np.random.Generator, zeta: float, duration: float, amplitude: float) -> Series:
    """Return a record of a damped sine of 4.82 Hz with the laser's noise."""
    t = np.arange(round(duration * LASER_RATE)) / LASER_RATE
    omega = 2 * np.pi * 4.82
    turning = omega * math.sqrt(1 - zeta**2)
    x = amplitude * np.exp(-zeta * omega * t) * np.cos(turning * t + rng.uniform(0, 2 * np.pi))
    return Series(t, x + LASER_NOISE * rng.standard_normal(len(t)))
