"""The source's way of integrating, for comparison: RK4 at a fixed step, projection, late impacts.

The loop of the thesis (A.3): a step of the classical Runge-Kutta method, a projection onto the
loops, a look whether the wall is penetrated, and if it is, Newton's impact there and then, up to a
step late; no further impact until the body has left the wall.  The equations are ours.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..base.errors import ParameterError, SimulationError
from ..hybrid.runge_kutta import rk4
from ..hybrid.simulation import Simulation
from ..mechanics import contact
from ..mechanics.arrays import Real
from ..mechanics.contact_state import ContactState
from ..mechanics.dynamics import Equations
from ..mechanism.description import Mechanism
from ..mechanism.parts import value


@dataclass(frozen=True)
class March:
    """What a fixed-step run gives.

    Parameters
    ----------
    time : (m,)
        [s].
    q, v : (m, n)
        Angles and rates after each step [rad], [rad/s].
    impacts : tuple of (float, str)
        Times at which impacts were noticed [s] and their stops.
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
    """Simulate as the source does, without friction, from the release.

    Parameters
    ----------
    mechanism : Mechanism
        What moves.
    values : mapping
        Parameters that differ from their defaults.
    stop_time, step : float
        End and step size [s].

    Raises
    ------
    ParameterError
        If the step is not positive, or a value is refused by :class:`prbm.Simulation`.
    SimulationError
        If the step is so long that the motion is lost.
    """
    if not 0.0 < step <= stop_time:
        raise ParameterError(f"step = {step:g} s must be positive and within {stop_time:g} s")
    simulation = Simulation(mechanism, values)
    system, n, y = simulation.system, simulation.system.n, simulation.front.y
    contacts = ContactState.free(len(mechanism.stops), len(mechanism.frictions))
    equations = Equations(system, simulation.inputs, contacts, simulation.omega)
    armed = [True] * len(mechanism.stops)
    times, states, impacts = [0.0], [y], []
    for k in range(1, round(stop_time / step) + 1):
        t = k * step
        y = equations.project(t, rk4(equations.rate, t - step, y, step))
        if not np.isfinite(y).all():
            raise SimulationError(f"the step of {step:g} s is too long: lost at t = {t:g} s")
        e = system.directions(y[:n])
        gaps = equations.gaps(t, e)
        for i, stop in enumerate(mechanism.stops):
            if gaps[i] > 0.0:
                armed[i] = True
            elif armed[i]:
                armed[i] = False
                impacts.append((t, stop.name))
                e, M, loops = equations.mass_and_loops(y[:n])
                G = system.gap_rows.jacobian(e)[[i]]
                X = contact.response(M, loops, G)
                eps = np.array([value(stop, "restitution", simulation.values)])
                P = contact.newton(G @ X, G @ y[n : 2 * n], eps)
                y = y.copy()
                y[n : 2 * n] += X @ P
        times.append(t)
        states.append(y)
    table = np.array(states)
    return March(np.array(times), table[:, :n], table[:, n : 2 * n], tuple(impacts))
