"""The 1R guide as one scalar equation: a reference for systems that contain it.

A parallelogram does not turn its shuttle.  The guide is therefore a pendulum with one angle phi
from straight, x = r sin(phi) and r = gamma L,

    M r^2 phi'' = -4 k (phi + beta phi') + r cos(phi) F,        k = 2 gamma K_theta E I / L

with M the mass of the shuttle and two lumped masses.  The force F may depend on states of a
partner, which are integrated by the same solver.  This module uses no code of the engine.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from ..base.errors import SimulationError

Real = NDArray[np.float64]
Force = Callable[[float, float, float, Real], float]
Rates = Callable[[float, float, float, Real], Sequence[float]]
IMPACT_TIME_ATOL = 1e-14  # s
IMPACTS_MAX = 1000  # Most impacts within one step.


@dataclass(frozen=True)
class ScalarGuide:
    """The 1R guide of two flexures.

    Parameters
    ----------
    r, k, mass, beta : float
        Length of the links [m], spring rate of each of the four pivots [N m/rad], moving mass [kg],
        stiffness-proportional damping [s].
    stops : tuple of float
        Positions of walls along x, positive to the right of the guide, negative to its left [m].
    restitution, rest_speed : float
        Restitution [-] and rest speed [m/s] of all walls.
    """

    r: float
    k: float
    mass: float
    beta: float = 0.0
    stops: tuple[float, ...] = ()
    restitution: float = 0.6
    rest_speed: float = 1e-3

    @classmethod
    def of(cls, values: Mapping[str, float], stops: Sequence[float] = ()) -> Self:
        """Return the guide with the parameters of the mechanism PRBDM.

        Each moving pivot carries m/4 + (m L^2/12)/(gamma L)^2 of a flexure of mass m (thesis,
        eq. 3.3).

        Examples
        --------
        A massless guide of two beams has the rate 4 k / r^2 = 8 K_theta/gamma EI/L^3:

        >>> values = {"flexure.length": 1.0, "flexure.thickness": 1.0, "flexure.width": 12.0,
        ...           "flexure.youngs_modulus": 1.0, "flexure.density": 0.0, "damping.beta": 0.0,
        ...           "flexure.gamma": 0.5, "flexure.K_theta": 2.5, "shuttle.mass": 3.0,
        ...           "stop.restitution": 0.5, "stop.rest_speed": 0.0}
        >>> guide = ScalarGuide.of(values)
        >>> guide.mass, 4 * guide.k / guide.r**2
        (3.0, 40.0)
        """
        L, h, b, E, rho, gamma, K_theta = (
            values[f"flexure.{name}"]
            for name in (
                "length", "thickness", "width", "youngs_modulus", "density", "gamma", "K_theta"
            )
        )  # fmt: skip
        flexure = rho * L * b * h
        lump = flexure / 4 + flexure * L**2 / 12 / (gamma * L) ** 2
        k = 2 * gamma * K_theta * E * b * h**3 / 12 / L
        return cls(
            gamma * L,
            k,
            values["shuttle.mass"] + 2 * lump,
            values["damping.beta"],
            tuple(stops),
            values["stop.restitution"],
            values["stop.rest_speed"],
        )

    @property
    def frequency(self) -> float:
        """Frequency of small vibrations [Hz]."""
        return math.sqrt(4 * self.k / self.mass) / self.r / (2 * math.pi)

    def acceleration(self, phi: float, omega: float, force: float) -> float:
        """Return phi'' [rad/s^2] under a force along x [N]."""
        moment = -4 * self.k * (phi + self.beta * omega) + self.r * math.cos(phi) * force
        return moment / (self.mass * self.r**2)


class Monolith:
    """The guide and a partner in one solver: classical Runge-Kutta steps with located impacts.

    Parameters
    ----------
    guide : ScalarGuide
        The guide.
    force : callable
        ``force(t, x, v, z)`` returns the force along x on the guide [N]; x and v are displacement
        and velocity along x, z the states of the partner.
    rates : callable
        ``rates(t, x, v, z)`` returns the derivatives of the states of the partner.
    z : sequence of float
        States of the partner at time 0.
    x, v : float
        Displacement [m] and velocity [m/s] of the guide at the start.
    substep : float
        Largest step [s].
    """

    def __init__(
        self,
        guide: ScalarGuide,
        force: Force,
        rates: Rates = lambda t, x, v, z: (),
        z: Sequence[float] = (),
        x: float = 0.0,
        v: float = 0.0,
        substep: float = 1e-4,
    ) -> None:
        self.guide, self.force, self.rates, self.substep = guide, force, rates, substep
        phi = math.asin(x / guide.r)
        self.time = 0.0
        self.y: Real = np.array([phi, v / (guide.r * math.cos(phi)), *z])
        self.held: float | None = None  # position of the wall on which the guide rests [m]
        self.impacts: list[tuple[float, float]] = []  # time [s] and closing speed [m/s]
        self.rest_time: float | None = None

    @property
    def x(self) -> float:
        """Displacement of the shuttle [m]."""
        return self.guide.r * math.sin(self.y[0])

    @property
    def v(self) -> float:
        """Velocity of the shuttle along x [m/s]."""
        return self.guide.r * math.cos(self.y[0]) * float(self.y[1])

    @property
    def z(self) -> Real:
        """States of the partner."""
        return self.y[2:]

    def _slope(self, t: float, y: Real) -> Real:
        """Return the derivatives of all states."""
        r, (phi, omega) = self.guide.r, y[:2]
        x, v, z = r * math.sin(phi), r * math.cos(phi) * omega, y[2:]
        turned = (omega, self.guide.acceleration(phi, omega, self.force(t, x, v, z)))
        return np.array(
            [*((0.0, 0.0) if self.held is not None else turned), *self.rates(t, x, v, z)]
        )

    def _step(self, h: float) -> Real:
        """Return the states after a step h [s]."""
        t, y = self.time, self.y
        k1 = self._slope(t, y)
        k2 = self._slope(t + h / 2, y + h / 2 * k1)
        k3 = self._slope(t + h / 2, y + h / 2 * k2)
        k4 = self._slope(t + h, y + h * k3)
        result: Real = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return result

    def _gap(self, wall: float, y: Real) -> float:
        """Return the distance to a wall, negative behind it [m]."""
        return math.copysign(1.0, wall) * (wall - self.guide.r * math.sin(y[0]))

    def _pressed(self, wall: float) -> float:
        """Return the acceleration of the guide at rest towards a wall [rad/s^2]."""
        phi, r = float(self.y[0]), self.guide.r
        force = self.force(self.time, r * math.sin(phi), 0.0, self.z)
        return math.copysign(1.0, wall) * self.guide.acceleration(phi, 0.0, force)

    def advance(self, end: float) -> None:
        """Integrate to a time [s].

        Raises
        ------
        SimulationError
            If more than :data:`IMPACTS_MAX` impacts follow each other within one step.
        """
        while self.time < end:
            self._check_impacts()
            if self.held is not None and self._pressed(self.held) <= 0.0:
                self.held = None
            h = min(self.substep, end - self.time)
            y = self._step(h)
            hit = [w for w in self.guide.stops if self._gap(w, y) < 0.0 and self.held != w]
            if not hit:
                last = self.time + h >= end - IMPACT_TIME_ATOL
                self.time, self.y = end if last else self.time + h, y
                continue
            self._reach(hit[0], h)
            self._impact(hit[0])

    def _check_impacts(self) -> None:
        """Reject impacts that do not end."""
        recent = self.impacts[-IMPACTS_MAX:]
        if len(recent) == IMPACTS_MAX and self.time - recent[0][0] < self.substep:
            raise SimulationError(
                f"more than {IMPACTS_MAX} impacts within {self.substep:g} s of t = {self.time:.9g} "
                f"s: rest_speed = {self.guide.rest_speed:g} m/s is too low for the guide to rest; "
                "increase it"
            )

    def _reach(self, wall: float, h: float) -> None:
        """Advance to the time within a step [s] at which the gap of a wall closes."""
        if self._gap(wall, self.y) > 0.0:
            h = brentq(lambda s: self._gap(wall, self._step(s)), 0.0, h, xtol=IMPACT_TIME_ATOL)
            self.time, self.y = self.time + h, self._step(h)

    def _impact(self, wall: float) -> None:
        """Apply Newton's impact law, or rest if the speed is below ``rest_speed``."""
        self.y[0] = math.asin(wall / self.guide.r)
        speed = abs(self.v)
        if speed < self.guide.rest_speed and self._pressed(wall) > 0.0:
            self.y[1], self.held, self.rest_time = 0.0, wall, self.time
            return
        self.impacts.append((self.time, speed))
        self.y[1] *= -self.guide.restitution
