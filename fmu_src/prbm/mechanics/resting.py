r"""Static shapes that rest on stops, and the rows that hold them.

The loads are those of an equilibrium without stops, in which the hit points lie behind their walls.
The gaps are raised to zero from there in steps, and Newton's method balances

    P(q) + Phi^T Re(w e) + Q + R^T lam = 0,      R = (loops, gaps of the stops).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import EquilibriumError, SimulationError
from ..base.tolerances import (
    STATICS_CONSTRAINT_RTOL,
    STATICS_ITERATIONS_MAX,
    STATICS_LOAD_STEP_MIN,
    STATICS_SHRINK,
    STATICS_STEP_ATOL,
)
from ..mechanism.parts import value
from . import constraints
from .arrays import Complex, Real
from .elements import Elements
from .statics import Equilibrium, tangent_stiffness
from .system import Rows, System


@dataclass(frozen=True, eq=False)
class RestingShape:
    """A static shape with closed stops.

    Parameters
    ----------
    q : (n,)
        Coordinates [rad], [-].
    rows : Rows
        The loops and the gaps of the closed stops [m].
    lam : (r + s,)
        Forces of the loops, and of the stops (> 0 pushes) [N].
    load : (d,) complex
        Row of the loads [N m].
    """

    q: Real
    rows: Rows
    lam: Real
    load: Complex


def resting_shape(
    system: System, shape: Equilibrium, moment: Real, stops: Sequence[int]
) -> RestingShape:
    """Return the shape in which closed stops carry a part of the loads of an equilibrium.

    Parameters
    ----------
    system : System
        The mechanism.
    shape : Equilibrium
        The free equilibrium under the same loads, without stops.
    moment : (n,)
        Moments of the loads [N m].
    stops : sequence of int
        The stops that are closed.

    Raises
    ------
    EquilibriumError
        If a stop is compliant, is not reached, would have to pull, or the shape is
        not found.
    """
    parts = [system.mechanism.stops[i] for i in stops]
    for stop in parts:
        if stop.compliant:
            raise EquilibriumError(
                f"{stop.name} is compliant: shapes that rest on it are not computed; choose rigid "
                "stops"
            )
    walls = np.array([value(stop, "position", system.values) for stop in parts])
    gaps = system.gap_rows.values(system.directions(shape.q))[list(stops)] + walls
    for stop, gap in zip(parts, gaps, strict=True):
        if gap > 0.0:
            raise EquilibriumError(
                f"{stop.name} is not reached: its gap in the equilibrium is {gap:.4g} m; add "
                "loads that press on it, or leave it out"
            )
    rows = system.loop_rows.beside(system.gap_rows.some(list(stops)))
    closed = rows.c + np.concatenate([np.zeros(len(system.loops)), walls])
    behind = np.concatenate([np.zeros(len(system.loops)), gaps])
    state = np.concatenate([shape.q, shape.lam, np.zeros(len(stops))])
    done, step = 0.0, 1.0
    while done < 1.0:
        target = min(1.0, done + step)
        found = _balanced(rows, closed - (1.0 - target) * behind, shape.load, moment, state)
        if found is not None:
            state, done = found, target
        elif step <= STATICS_LOAD_STEP_MIN:
            names = ", ".join(stop.name for stop in parts)
            raise EquilibriumError(f"no shape that rests on {names} was found; give fewer stops")
        else:
            step *= STATICS_SHRINK
    lam = state[system.n :]
    for stop, force in zip(parts, lam[len(system.loops) :], strict=True):
        if force < 0.0:
            raise EquilibriumError(
                f"{stop.name} would have to pull with {-force:.4g} N: leave it out"
            )
    return RestingShape(state[: system.n], rows, lam, shape.load)


def _balanced(rows: Rows, c: Real, w: Complex, moment: Real, start: Real) -> Real | None:
    """Return coordinates and multipliers on rows with constants c; None: not found."""
    system = rows.system
    n, state, turn, elements = system.n, start, math.inf, Elements(system)
    for _ in range(STATICS_ITERATIONS_MAX):
        q, lam = state[:n], state[n:]
        e = system.directions(q)
        G, open_by = rows.jacobian(e), rows.values(e, c)
        if turn <= STATICS_STEP_ATOL and (
            np.abs(open_by).max(initial=0.0) <= STATICS_CONSTRAINT_RTOL * system.length
        ):
            return state
        loads = system.Phi.to_coordinates((w * e).real) + moment
        torque = elements.force(q, e) + loads + lam @ G
        kkt = constraints.saddle(tangent_stiffness(elements.tangent(e), w, rows, lam, e), G, G)
        try:
            right = np.concatenate([torque, -open_by])
            change = constraints.solve(kkt, right, n, system.length)
        except SimulationError:
            return None
        change[n:] *= -1.0
        last, turn = turn, float(np.abs(change[:n]).max())
        if not turn < 1.0 or turn > 2.0 * last:
            return None
        state = state + change
    return None
