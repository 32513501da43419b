"""What the tests share: the shipped mechanisms, and the 1R guide as one scalar equation."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from prbm import Mechanism, Simulation
from prbm_tools.mechanism_file import load, shipped


@cache
def mechanism(name: str) -> Mechanism:
    return load(shipped()[name])


def simulation(name: str, values=None, **options) -> Simulation:
    """Return a simulation that keeps a record of its impacts."""
    sim = Simulation(mechanism(name), values, **options)
    sim.record = []
    return sim


def energy_balance(out) -> float:
    """Return kinetic + elastic + gravitational + dissipated - work [J], which is constant."""
    kept = ("kinetic", "elastic", "gravitational", "dissipated")
    return sum(out[f"energy.{name}"] for name in kept) - out["energy.work"]


PMMA = {
    "flexure.length": 0.2,
    "flexure.thickness": 2e-3,
    "flexure.width": 1e-2,
    "flexure.youngs_modulus": 3.21e9,
    "flexure.density": 1190.0,
    "shuttle.width": 0.2,
    "shuttle.mass": 1190 * 0.2 * 0.02 * 0.01,
    "gravity.x": 0.0,
    "release.displacement": 0.0,
    "release.velocity": 1.0,
    "stop.position": 0.15,
    "damping.beta": 0.0,
}
"""The PMMA guide of the thesis (A.1), its wall out of reach."""


@dataclass(frozen=True)
class ScalarGuide:
    """The 1R guide as a pendulum of one angle phi from straight: x = r sin(phi).

    A parallelogram does not rotate its shuttle, so that M r^2 phi'' = -4 k phi + M g r cos(phi)
    with r = gamma L, k = 2 gamma K_theta EI/L and M the shuttle and two lumped masses.
    """

    r: float
    k: float
    mass: float
    g: float

    @classmethod
    def of(cls, values) -> "ScalarGuide":
        v = values
        L, h, b = (v[f"flexure.{name}"] for name in ("length", "thickness", "width"))
        r = v["flexure.gamma"] * L
        flexure = v["flexure.density"] * b * h * L
        lump = flexure / 4 + flexure * L**2 / 12 / r**2
        EI = v["flexure.youngs_modulus"] * b * h**3 / 12
        k = 2 * v["flexure.gamma"] * v["flexure.K_theta"] * EI / L
        return cls(r, k, v["shuttle.mass"] + 2 * lump, v["gravity.x"])

    def potential(self, phi: float) -> float:
        return 2 * self.k * phi**2 - self.mass * self.g * self.r * math.sin(phi)

    def speed(self, phi: float, energy: float) -> float:
        """Return |phi'| [rad/s]."""
        return math.sqrt(max(0.0, 2 * (energy - self.potential(phi)) / self.mass)) / self.r

    def time(self, rest: float, to: float) -> float:
        """Return the time from rest at one angle to another [s], by quadrature.

        phi = rest + (to - rest) s^2 takes the root singularity at rest out.
        """
        energy, span = self.potential(rest), to - rest

        def integrand(s: float) -> float:
            if s == 0.0:
                slope = (self.potential(rest + 1e-7 * span) - energy) / (1e-7 * span)
                return 2 * abs(span) * self.r * math.sqrt(self.mass / (-2 * slope * span))
            return 2 * s * abs(span) / self.speed(rest + span * s * s, energy)

        return quad(integrand, 0.0, 1.0, epsabs=1e-13, epsrel=1e-12, limit=200)[0]

    def turning(self, energy: float, low: float, high: float) -> float:
        return brentq(lambda phi: self.potential(phi) - energy, low, high, xtol=1e-15)

    def bounces(self, x0: float, restitution: float, count: int):
        """Return times and closing speeds along x of the impacts at the straight shape."""
        rest = math.asin(x0 / self.r)
        time, times, speeds = 0.0, [], []
        for _ in range(count):
            time += self.time(rest, 0.0)
            omega = self.speed(0.0, self.potential(rest))
            times.append(time)
            speeds.append(omega * self.r)
            energy = 0.5 * self.mass * (restitution * omega * self.r) ** 2
            rest = self.turning(energy, rest, 0.0)
            time += self.time(rest, 0.0)
        return np.array(times), np.array(speeds)

    def period(self, speed: float) -> float:
        """Return the period after a start from straight at a speed along x, without gravity."""
        amplitude = self.turning(0.5 * self.mass * speed**2, 0.0, 1.5)
        return 4 * self.time(amplitude, 0.0)


@dataclass(frozen=True)
class Run:
    """A default experiment, or its beginning: the simulation, and its outputs at each step.

    ``imbalance`` is the largest change of the energy balance [J], ``opened`` the largest distance
    by which a loop stood open [m].
    """

    simulation: Simulation
    outputs: list[dict[str, float]]
    imbalance: float
    opened: float

    def column(self, name: str) -> np.ndarray:
        return np.array([row[name] for row in self.outputs])


def run(
    model: str | Mechanism, values=None, stop_time: float = 1.0, step: float = 1e-3, **options
) -> Run:
    """Simulate a mechanism, its loops and energies looked at on the way."""
    chosen = mechanism(model) if isinstance(model, str) else model
    sim = Simulation(chosen, values, **options)
    sim.record = []
    outputs, opened = [sim.outputs()], 0.0
    for k in range(1, round(stop_time / step) + 1):
        sim.advance(k * step)
        outputs.append(sim.outputs())
        system = sim.system
        if len(system.loops):
            e = system.directions(sim.state()[: system.n])
            phi = (system.loops @ e).real + system.loops_c
            opened = max(opened, float(np.abs(phi).max()))
    start = energy_balance(outputs[0])
    imbalance = max(abs(energy_balance(row) - start) for row in outputs)
    return Run(sim, outputs, imbalance, opened)
