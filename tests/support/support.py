"""Shared by the tests: the shipped mechanisms, and the 1R guide as one scalar equation."""

import math
import os
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.fmu import native_fmu, python_fmu
from prbm.hybrid.records import Impact
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.references import scalar_guide

ROOT = Path(__file__).resolve().parents[2]
"""Root folder of the project."""

SUPPORT = Path(__file__).resolve().parent
"""Folder of the modules that the tests import."""

CASES = ROOT / "tests" / "cases"
"""Folder of the public cases; README.md has their values."""


@cache
def mechanism(name: str) -> Mechanism:
    return read_mechanism(shipped()[name])


def possible(path: Path) -> Path:
    """Return a path; skip the test if the encoding of the file system lacks one of its letters."""
    try:
        os.fsencode(path)
    except UnicodeEncodeError as error:
        pytest.skip(f"names of files have the encoding {error.encoding} here")
    return path


GUIDES = ("PRBDM", "PRBDM2R")
"""Mechanisms with friction on the shuttle that come to rest on the stop."""

IMPACT_END_TIMES = {
    "Bistable": 0.09, "Cantilever": 0.24, "FoldedSuspension": 0.135, "ImpactOscillator": 0.12,
    "PRBDM2RAxial": 0.045, "PRBDM3R": 0.048, "CurvedBistable": 0.01, "NotchGuide": 0.02,
    "ToggleLatch": 0.03,
}  # fmt: skip
"""Times [s] before which the default experiment has an impact; 0.3 s for other mechanisms."""

QUICK_MODELS = (*GUIDES, "ImpactOscillator")
"""Mechanisms checked by default: the guides, and one with a stop fixed to a moving body.

Checks of the other mechanisms are marked as slow.
"""

COSTLY_MODELS = ("CurvedBistable", "FoldedSuspension", "NotchGuide", "PRBDM2RAxial", "PRBDM3R")
"""Mechanisms whose default experiment of 1 s takes the engine 5 to 20 s."""

SHIPPED = [
    name if name in QUICK_MODELS else pytest.param(name, marks=pytest.mark.slow)
    for name in shipped()
]
"""Names of the shipped mechanisms, as parameters of a test that runs for each of them."""

each_shipped = pytest.mark.parametrize("model", SHIPPED)


def selected(keep) -> list:
    """Return the parameters in SHIPPED for whose name ``keep`` is true."""
    return [p for p in SHIPPED if keep(p if isinstance(p, str) else p.values[0])]


@dataclass(frozen=True)
class Case:
    """The data of a shipped mechanism for tests that run for each of them.

    ``end`` is a time [s] before which the default experiment has an impact, if it has any.
    """

    mechanism: Mechanism
    end: float

    @property
    def costly(self) -> bool:
        """Whether a default experiment takes the engine several seconds."""
        return self.mechanism.name in COSTLY_MODELS

    @property
    def body(self) -> str:
        """Name of the released body."""
        return self.mechanism.release.body

    @property
    def stop(self) -> str:
        """Name of the first stop."""
        return self.mechanism.stops[0].name

    @property
    def force(self) -> str:
        """Name of the first force."""
        return self.mechanism.forces[0].name

    @property
    def displacement(self) -> float:
        """Default displacement at release, along the direction of the release [m]."""
        return float(self.mechanism.values()["release.displacement"])

    @property
    def released(self) -> str:
        """Output that equals the displacement at release except for its sign."""
        upright = round(self.mechanism.release.direction) % 180 != 0
        return f"{self.body}.{'y' if upright else 'x'}"

    def outputs(self, *names: str) -> list[str]:
        """Return the full names of outputs of all bodies, such as x and y."""
        return [f"{body.name}.{name}" for body in self.mechanism.bodies for name in names]

    def at_stops(self, *names: str) -> list[str]:
        """Return the full names of outputs of all stops, such as contact."""
        return [f"{stop.name}.{name}" for stop in self.mechanism.stops for name in names]

    def starts(self) -> dict[str, float]:
        """Return start values other than the defaults: half the displacement, and a force."""
        return {"release.displacement": 0.5 * self.displacement, f"{self.force}.x": 0.05}

    def changes(self) -> dict[int, dict[str, float]]:
        """Return changes of inputs and tunable parameters, by number of the communication step."""
        return {
            3: {f"{self.force}.x": 0.3, "base.acceleration.y": 2.0},
            5: {f"{self.stop}.displacement": 1e-3, f"{self.stop}.velocity": 0.0},
            8: {f"{self.stop}.restitution": 0.9, "damping.zeta": 0.05},
            12: {f"{self.stop}.displacement": -1e-3, f"{self.force}.moment": 1e-3},
        }

    def substep(self, largest: float) -> float:
        """Return a step [s] at which the classical Runge-Kutta method is stable.

        It is half of the bounds h omega < 2 and h beta omega^2 < 2 for the fastest mode at release.
        """
        omega, beta = fastest(self.mechanism.name), self.mechanism.damping_beta
        return min(largest, 1.0 / omega, 1.0 / max(beta * omega**2, 1e-300))

    def impacts(self, values) -> int:
        """Return the number of impacts at all stops, from the values of all outputs."""
        return sum(int(values[name]) for name in self.at_stops("impact_count"))


@cache
def case(name: str) -> Case:
    return Case(mechanism(name), IMPACT_END_TIMES.get(name, 0.3))


def built(guide: Mechanism, fmi: int, platforms=("host",), clock=False) -> bytes:
    """Return a native FMU; the costly models are built without reference results."""
    reference = (lambda *_: ()) if guide.name in COSTLY_MODELS else native_fmu.reference
    with patch.object(native_fmu, "reference", reference):
        return native_fmu.build(guide, fmi=fmi, platforms=platforms, clock=clock)


def own_fmu(kind: str, guide: Mechanism, changes=None) -> bytes:
    """Return the FMU of a test's own mechanism, without reference results.

    Their computation takes most of the time of a build; tests of shipped mechanisms check them.
    """
    if kind == "python":
        return python_fmu.build(guide, changes)
    with patch.object(native_fmu, "reference", lambda *_: ()):
        return native_fmu.build(guide, changes, int(kind[-1]))


def simulation(name: str, values=None, **options) -> Simulation:
    """Return a simulation that records its impacts."""
    sim = Simulation(mechanism(name), values, **options)
    sim.record = []
    return sim


@cache
def fastest(name: str) -> float:
    """Return the circular frequency of the fastest mode at release [rad/s].

    The frequency of an unstable mode, which may be the only one, is negative.
    """
    guide = mechanism(name)
    system = assemble(guide, guide.values())
    shape = equilibrium(system, system.values["release.displacement"])
    return 2.0 * math.pi * float(np.abs(modes(system, shape).frequency).max())


@cache
def record(name: str) -> list[Impact]:
    """Return the impacts that the engine finds up to the end time of a case."""
    sim = simulation(name)
    sim.advance(case(name).end)
    return sim.record


def around_first_impact(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return communication points before the first impact (16 steps) and around it (47 steps).

    They meet at 97.5 % of the time of the first impact.  The last point is at four times that time
    or at the end time of the case.
    """
    first, end = record(name)[0].time, case(name).end
    middle = 0.975 * first
    return np.linspace(0.0, middle, 17), np.linspace(middle, min(end, 4 * first), 48)


def energy_balance(out) -> float:
    """Return kinetic + elastic + gravitational + dissipated energy - work [J], a constant."""
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
"""Parameters of the PMMA guide of the thesis (A.1), with the wall out of reach."""


ELASTIC = {"damping.beta": 0.0, "stop.restitution": 0.6, "stop.rest_speed": 1e-3}


@dataclass(frozen=True)
class ScalarGuide(scalar_guide.ScalarGuide):
    """The 1R guide as a pendulum with one angle phi from the straight shape: x = r sin(phi).

    A parallelogram does not rotate its shuttle.  Hence M r^2 phi'' = -4 k phi + M g r cos(phi)
    with r = gamma L, k = 2 gamma K_theta EI/L and M the mass of the shuttle and two lumped masses.
    """

    g: float = 0.0

    @classmethod
    def of(cls, values, stops=()) -> "ScalarGuide":
        g = values["gravity.x"]
        return replace(super().of(ELASTIC | values, stops), g=g)

    def potential(self, phi: float) -> float:
        """Return the elastic and gravitational energy [J]."""
        return 2 * self.k * phi**2 - self.mass * self.g * self.r * math.sin(phi)

    def speed(self, phi: float, energy: float) -> float:
        """Return |phi'| at an angle, from the total energy [J], in rad/s."""
        return math.sqrt(max(0.0, 2 * (energy - self.potential(phi)) / self.mass)) / self.r

    def time(self, rest: float, to: float) -> float:
        """Return the time from rest at one angle to another [s], by quadrature.

        The substitution phi = rest + (to - rest) s^2 removes the root singularity at rest.
        """
        energy, span = self.potential(rest), to - rest

        def integrand(s: float) -> float:
            if s == 0.0:
                slope = (self.potential(rest + 1e-7 * span) - energy) / (1e-7 * span)
                return 2 * abs(span) * self.r * math.sqrt(self.mass / (-2 * slope * span))
            return 2 * s * abs(span) / self.speed(rest + span * s * s, energy)

        return quad(integrand, 0.0, 1.0, epsabs=1e-13, epsrel=1e-12, limit=200)[0]

    def turning(self, energy: float, low: float, high: float) -> float:
        """Return the angle between two others at which the speed is zero [rad]."""
        return brentq(lambda phi: self.potential(phi) - energy, low, high, xtol=1e-15)

    def bounces(self, x0: float, restitution: float, count: int):
        """Return times [s] and closing speeds along x [m/s] of impacts at the straight shape."""
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
        """Return the period without gravity [s], from the speed at the straight shape [m/s]."""
        amplitude = self.turning(0.5 * self.mass * speed**2, 0.0, 1.5)
        return 4 * self.time(amplitude, 0.0)


@dataclass(frozen=True)
class Run:
    """The result of a simulation: the simulation, and its outputs at each step.

    ``imbalance`` is the largest change of the energy balance [J], ``loop_error`` the largest
    residual of the loop closures [m].
    """

    simulation: Simulation
    outputs: list[dict[str, float]]
    imbalance: float
    loop_error: float

    def column(self, name: str) -> np.ndarray:
        return np.array([row[name] for row in self.outputs])


def run(
    model: str | Mechanism, values=None, stop_time: float = 1.0, step: float = 1e-3, **options
) -> Run:
    """Simulate a mechanism; check its loop closures and its energy balance at each step."""
    chosen = mechanism(model) if isinstance(model, str) else model
    sim = Simulation(chosen, values, **options)
    sim.record = []
    outputs, loop_error = [sim.outputs()], 0.0
    for k in range(1, round(stop_time / step) + 1):
        sim.advance(k * step)
        outputs.append(sim.outputs())
        system = sim.system
        if len(system.loops):
            e = system.directions(sim.state()[: system.n])
            phi = (system.loops @ e).real + system.loops_c
            loop_error = max(loop_error, float(np.abs(phi).max()))
    start = energy_balance(outputs[0])
    imbalance = max(abs(energy_balance(row) - start) for row in outputs)
    return Run(sim, outputs, imbalance, loop_error)


def guided_rate(v, name: str = "flexure") -> float:
    """Return the lateral stiffness [N/m] of a 3R flexure between two clamps for small deflections.

    By symmetry each pivot turns by F (x_i - L/2) / K_i.  The deflection is therefore
    F sum (x_i - L/2)^2 / K_i.
    """
    E = v.get("pmma.youngs_modulus") or v[f"{name}.youngs_modulus"]
    L, EI = v[f"{name}.length"], E * v[f"{name}.width"] * v[f"{name}.thickness"] ** 3 / 12
    gamma = [1.0 - sum(v[f"{name}.gamma{i}"] for i in (1, 2, 3))]
    gamma += [v[f"{name}.gamma{i}"] for i in (1, 2)]
    rates = [v[f"{name}.K_theta{i}"] * EI / (L / 2) for i in (1, 2, 3)]
    levers = L / 2 * (1.0 - np.cumsum(gamma))
    return 1.0 / (2 * float((levers**2 / rates).sum()))
