"""The integration of the thesis for comparison: RK4 at a fixed step, projection, late impacts.

After each step of the classical Runge-Kutta method the state is projected onto the loops.  If a
wall is now penetrated, Newton's impact law is applied at once, up to a step late; the next impact
follows only after the body has left the wall.  The equations of motion are those of this package.

Source: S. Boersma, Modelling and Validation of the Impact Response in Compliant Mechanisms, MSc
thesis, TU Delft 2015, appendix A.3.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..base.errors import ParameterError, SimulationError
from ..hybrid.runge_kutta import rk4
from ..hybrid.simulation import Simulation
from ..mechanics import contact
from ..mechanics.arrays import Real
from ..mechanics.contact_problem import ContactProblem
from ..mechanics.contact_state import ContactState
from ..mechanics.dynamics import Equations
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from ..mechanism.supported import COMPLIANT_STOPS, check_supported


@dataclass(frozen=True)
class March:
    """The result of a run with a fixed step.

    Parameters
    ----------
    time : (m,)
        Times [s].
    q, v : (m, n)
        Angles [rad] and rates [rad/s] after each step.
    impacts : tuple of (float, str)
        Detection time of each impact [s], and the name of its stop.
    """

    time: Real
    q: Real
    v: Real
    impacts: tuple[tuple[float, str], ...]


def march(
    mechanism: Mechanism,
    values: Mapping[str, float] | None = None,
    *,
    stop_time: float,
    step: float,
) -> March:
    """Simulate from the release with the integration of the thesis, without friction.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping
        Parameters that differ from their defaults.
    stop_time, step : float
        Duration and step size [s].

    Raises
    ------
    MechanismError
        If a stop is compliant.
    ParameterError
        If the step is not positive, or :class:`prbm.Simulation` rejects a value.
    SimulationError
        If the state is no longer finite, because the step is too long.
    """
    if not 0.0 < step <= stop_time:
        raise ParameterError(f"step = {step:g} s must be positive and within {stop_time:g} s")
    check_supported(mechanism, "the integration with fixed steps", COMPLIANT_STOPS)
    simulation = Simulation(mechanism, values)
    system, n, y = simulation.system, simulation.system.n, simulation.front.y
    contacts = ContactState.free(len(mechanism.stops), len(mechanism.rubbing))
    equations = Equations(system, simulation.inputs, contacts, simulation.configuration.omega)
    armed = [True] * len(mechanism.stops)
    times, states, impacts = [0.0], [y], []
    for k in range(1, round(stop_time / step) + 1):
        t = k * step
        y = equations.project(t, rk4(equations.rate, t - step, y, step))
        if not np.isfinite(y).all():
            raise SimulationError(f"step = {step:g} s is too long: no finite state at t = {t:g} s")
        e = system.directions(y[:n])
        gaps = equations.gaps(t, e)
        for i, stop in enumerate(mechanism.stops):
            if gaps[i] > 0.0:
                armed[i] = True
            elif armed[i]:
                armed[i] = False
                impacts.append((t, stop.name))
                at = ContactProblem(system, y[:n])
                G = at.gaps[[i]]
                X = at.response(G)
                eps = np.array([value(stop, "restitution", simulation.values)])
                P = contact.newton(G @ X, G @ y[n : 2 * n], eps)
                y = y.copy()
                y[n : 2 * n] += X @ P
        times.append(t)
        states.append(y)
    table = np.array(states)
    return March(np.array(times), table[:, :n], table[:, n : 2 * n], tuple(impacts))
