"""The constant part of a simulation: mechanism, parameters, tolerances and scales."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import ParameterError
from ..base.tolerances import (
    EVENT_TIME_FACTOR,
    EVENT_TIME_RTOL,
    EVENT_TIME_ULPS,
    NOMINAL_ANGLE_MIN,
    NOMINAL_STRAIN_FACTOR,
    RELEASE_PENETRATION_RTOL,
    STEP_MAX_RTOL,
    STIFFNESS_ROUNDING_RTOL,
    TOLERANCE_MAX,
    TOLERANCE_MIN,
    TOLERANCE_USED_MAX,
    TOUCHING_RTOL,
    ZERO_RATE_RTOL,
)
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble, calculated
from ..mechanics.contact_state import ContactState
from ..mechanics.dynamics import Equations
from ..mechanics.elements import Elements
from ..mechanics.inputs import Inputs
from ..mechanics.modal import fundamental_frequency, slow_rates
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parts import value


@dataclass(frozen=True)
class Scales:
    """Magnitudes that turn dimensionless tolerances into numbers with units.

    Parameters
    ----------
    length : float
        Size of the mechanism [m].
    rate : float
        Fundamental angular frequency; if it is zero, the rate of a fall or of the initial motion
        (:func:`prbm.mechanics.modal.slow_rates`) [rad/s].
    energy : float
        Torque of the stiffest element at one radian, or at a displacement of the size; without
        elements, or if that is round-off, the largest inertia times the square of the rate [J].
    time : float
        Period of the motion [s].

    Examples
    --------
    >>> scales = Scales(length=0.5, rate=2.0, energy=1e-3, time=3.0)
    >>> scales.zero_speed
    1e-09
    """

    length: float
    rate: float
    energy: float
    time: float

    @classmethod
    def of(cls, system: System, omega: float) -> "Scales":
        """Return the scales of a system with a fundamental angular frequency [rad/s], or 0."""
        arms = np.ones(system.d)
        arms[system.shifts] = arms[system.floats] = system.length
        K, inertia = (
            np.abs(Elements(system).drawn),
            float((np.abs(system.H) * np.outer(arms, arms)).max()),
        )
        turns = np.setdiff1d(np.arange(system.n), system.strains)
        rate, fast = (omega, omega) if omega else slow_rates(system)
        energy, kinetic = float(K[np.ix_(turns, turns)].max()), inertia * rate**2
        if energy <= STIFFNESS_ROUNDING_RTOL * kinetic:  # Of a spring whose length is constant.
            energy = kinetic
        return cls(system.length, rate, energy, 2 * math.pi / fast)

    @property
    def zero_speed(self) -> float:
        """Speed below which a speed is round-off [m/s]."""
        return ZERO_RATE_RTOL * self.speed

    @property
    def speed(self) -> float:
        """Speed of the motion [m/s]."""
        return self.rate * self.length

    @property
    def zero_acceleration(self) -> float:
        """Acceleration below which an acceleration is round-off [m/s^2]."""
        return ZERO_RATE_RTOL * self.rate**2 * self.length

    @property
    def zero_force(self) -> float:
        """Force below which the direction of the force of a guide is round-off [N]."""
        return ZERO_RATE_RTOL * self.energy / self.length

    @property
    def touching(self) -> float:
        """Gap below which a stop closes together with others [m].

        A stop that was released too early closes again at this penetration.
        """
        return TOUCHING_RTOL * self.length

    @property
    def penetration(self) -> float:
        """Largest penetration of a wall at release [m]."""
        return RELEASE_PENETRATION_RTOL * self.length

    def time_resolution(self, time: float) -> float:
        """Return the error of the time of an event in the longest step [s]."""
        located = EVENT_TIME_RTOL * STEP_MAX_RTOL * self.time
        return EVENT_TIME_FACTOR * located + EVENT_TIME_ULPS * math.ulp(time)

    @property
    def step_max(self) -> float:
        """Longest step [s]."""
        return STEP_MAX_RTOL * self.time

    def of_state(self, y: Real) -> Real:
        """Return the magnitudes against which errors of a state are measured, (2 n + 2,).

        The magnitude of an angle is one radian.  Those of rates and energies are their absolute
        values, but at least the scales.
        """
        n = len(y) // 2 - 1
        scale = np.abs(y)
        scale[:n] = 1.0
        np.maximum(scale[n : 2 * n], self.rate, out=scale[n : 2 * n])
        np.maximum(scale[2 * n :], self.energy, out=scale[2 * n :])
        return scale


@dataclass(frozen=True)
class Magnitudes:
    """Typical magnitudes of a motion, from its start; nominal values are derived from them.

    Parameters
    ----------
    angle : float
        Largest angle from the straight shape [rad].
    rate : float
        Angular velocity, or strain rate, that corresponds to it at the fundamental frequency
        [rad/s], [1/s].
    strain : float
        Strain of a link; 0 if no link stretches.
    energy : float
        Elastic energy of the springs [J].
    impulse : float
        Impulse of a contact: this energy divided by the speed of the motion [N s].
    """

    angle: float
    rate: float
    strain: float
    energy: float
    impulse: float

    @classmethod
    def of(cls, system: System, scales: Scales, y: Real) -> "Magnitudes":
        """Return the magnitudes of the motion that starts with the state y, (2 n + 2,)."""
        n, K = system.n, Elements(system).drawn
        amplitude = y[:n] - system.q0 + y[n : 2 * n] / scales.rate
        turns = np.setdiff1d(np.arange(n), system.strains)
        angle = max(float(np.abs(amplitude[turns]).max()), NOMINAL_ANGLE_MIN)
        least = scales.energy * NOMINAL_ANGLE_MIN**2
        energy = max(float(amplitude @ K @ amplitude) / 2, least)
        stiffest = float(K.diagonal()[list(system.strains)].max(initial=0.0))
        strain = math.sqrt(2 * NOMINAL_STRAIN_FACTOR * energy / stiffest) if stiffest else 0.0
        rate = angle * scales.rate
        return cls(angle, rate, strain, energy, energy / (rate * system.length))


@dataclass(frozen=True)
class Configuration:
    """The mechanism of a simulation with its parameters and tolerances.

    Parameters
    ----------
    mechanism : Mechanism
        Description.
    values : mapping
        Values of all parameters.
    system : System
        Constant arrays of the mechanism.
    calculated : mapping
        Calculated parameters, such as ``flexure.gamma0``.
    tolerance : float
        Relative tolerance of the integration, at most ``TOLERANCE_USED_MAX``.
    step : float or None
        Fixed step size [s]; None: adaptive.
    frequency : float
        Fundamental frequency at the start [Hz]; 0 if no mode vibrates.
    scales : Scales
        Scales of lengths, rates and energies.
    """

    mechanism: Mechanism
    values: Mapping[str, float]
    system: System
    calculated: Mapping[str, float]
    tolerance: float
    step: float | None
    frequency: float
    scales: Scales

    @classmethod
    def of(
        cls,
        mechanism: Mechanism,
        values: Mapping[str, float],
        tolerance: float | None = None,
        step: float | None = None,
    ) -> "Configuration":
        """Return the configuration for values of all parameters.

        Raises
        ------
        ParameterError
            If a value, the tolerance or the step is invalid.
        """
        system = assemble(mechanism, values)
        known = calculated(mechanism, values)
        wanted = checked_tolerance(values["solver.tolerance"] if tolerance is None else tolerance)
        if step is not None and not (math.isfinite(step) and step > 0.0):
            raise ParameterError(f"step = {step} s must be positive")
        frequency = fundamental_frequency(system)
        scales = Scales.of(system, 2 * math.pi * frequency)
        used = min(wanted, TOLERANCE_USED_MAX)
        return cls(mechanism, values, system, known, used, step, frequency, scales)

    @property
    def omega(self) -> float:
        """Fundamental angular frequency [rad/s]; 0: none."""
        return 2 * math.pi * self.frequency

    def with_values(self, values: Mapping[str, float]) -> "Configuration":
        """Return the configuration with other values of tunable parameters."""
        if values == self.values:
            return self
        system = assemble(self.mechanism, values)
        known = calculated(self.mechanism, values)
        return replace(self, values=values, system=system, calculated=known)

    def restored(
        self,
        values: Mapping[str, float],
        frequency: float,
        tolerance: float,
        step: float | None,
    ) -> "Configuration":
        """Return the configuration of a saved state of the same mechanism."""
        known = self.with_values(dict(values))
        scales = Scales.of(known.system, 2 * math.pi * frequency)
        return replace(known, frequency=frequency, tolerance=tolerance, step=step, scales=scales)

    def equations(self, inputs: Inputs, contacts: ContactState) -> Equations:
        """Return the equations of motion for inputs and modes of the contacts."""
        return Equations(self.system, inputs, contacts, self.omega)

    def stop_value(self, stop: int, name: str) -> float:
        """Return a parameter of a stop, for instance ``restitution``."""
        return value(self.mechanism.stops[stop], name, self.values)


def contact_names(mechanism: Mechanism, contacts: Iterable[int]) -> str:
    """Return the names of contacts and springs, in their order, without repetition."""
    parts = (*mechanism.stops, *mechanism.rubbing, *mechanism.springs)
    names = [part.name for part in parts]
    return ", ".join(names[c] for c in sorted(set(contacts)))


def checked_tolerance(tolerance: float) -> float:
    """Return a relative tolerance as a float.

    Raises
    ------
    ParameterError
        If it is out of bounds.
    """
    if not (math.isfinite(tolerance) and TOLERANCE_MIN <= tolerance <= TOLERANCE_MAX):
        raise ParameterError(
            f"tolerance = {tolerance:g} must lie between {TOLERANCE_MIN:g} and {TOLERANCE_MAX:g}"
        )
    return float(tolerance)


def replaced_tolerance(wanted: float) -> str:
    """Return the message that a tolerance is too loose to be used; empty if it is not.

    Examples
    --------
    >>> replaced_tolerance(1e-6)
    ''
    >>> replaced_tolerance(1e-3)
    'tolerance = 0.001 is replaced by 1e-05: looser tolerances lose energy without notice'
    """
    if not wanted > TOLERANCE_USED_MAX:
        return ""
    return (
        f"tolerance = {wanted:g} is replaced by {TOLERANCE_USED_MAX:g}: looser tolerances lose "
        "energy without notice"
    )
