"""The impact map of a compliant stop: a pure fundamental mode arrives, the modes are linear.

The modes are those of the shape that a force holds at the wall.  During the contact they obey

    p_i'' + beta omega_i^2 p_i' + omega_i^2 p_i = G_i F,    d = -sum_i G_i p_i,

with G_i = (d gap/dq) phi_i and the contact force F = k d^n (1 + a d'/v0) >= 0.  For n = 1 the
result does not depend on the closing speed v0.  For stiff contacts it is the algebraic map.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...base.errors import ParameterError, SimulationError
from ...base.progress import Progress
from ...mechanics.arrays import Real
from ...mechanics.assembly import assemble
from ...mechanics.compliance import damping_factor
from ...mechanics.modal import Modes, modes
from ...mechanism.description import Mechanism
from ...mechanism.parts import RESTITUTION_MIN, Stop, value
from ..touching import impact_shape
from .maps import OFFSETS, WALLS, Hit, ImpactMap, MovedStop, map_of, point_counter

RTOL, ATOL = 1e-9, 1e-12  # Tolerances of the integration, in units of the hit.
DURATION_MAX = 1e3  # Longest contact, in units of the time scale of the hit.


def compliant(
    mechanism: Mechanism,
    walls: Sequence[float] = WALLS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stiffness: float | None = None,
    speed: float | None = None,
    stop: str | None = None,
    label: str = "compliant",
    progress: Progress | None = None,
) -> ImpactMap:
    """Return the map of a pure fundamental mode arriving at a compliant stop.

    Parameters as for :func:`prbm.analysis.impact_map.routes.algebraic`, and:

    Parameters
    ----------
    stiffness : float or None
        Contact stiffness [N/m^n]; None: that of the compliant stop.
    speed : float or None
        Closing speed [m/s]; without effect and not needed for the exponent 1.

    Raises
    ------
    ParameterError
        If stiffness or speed are missing or not positive, or the restitution is below 0.01.
    SimulationError
        If a contact does not end.
    """
    which = MovedStop.of(mechanism, stop)
    found = mechanism.stops[which.index]
    count = point_counter(progress, len(walls) * len(offsets))

    def hits(offset: float) -> Iterator[Hit]:
        system = assemble(mechanism, mechanism.values(which.at(values, 0.0, offset)))
        law = _law(found, system.values, stiffness, speed)
        beta = system.values["damping.beta"]
        for h in walls:
            shape = impact_shape(system, which.index, h)
            modal = modes(system, shape)
            G = system.gap_rows.jacobian(system.directions(shape.q))[which.index] @ modal.shape
            yield _hit(h, offset, modal, G, law, beta)
            count()

    return map_of(label, [list(hits(d)) for d in offsets])


Law = tuple[float, float, float, float]
"""Stiffness [N/m^n], exponent [-], factor of the damping [-], closing speed [m/s]."""


def _law(
    stop: Stop, values: Mapping[str, float], stiffness: float | None, speed: float | None
) -> Law:
    """Return the law of the contact; reject values out of bounds."""
    n = value(stop, "exponent", values) if stop.compliant else 1.0
    if stiffness is None and not stop.compliant:
        raise ParameterError(
            f'{stop.name} is rigid: give a contact stiffness, or law = "compliant" in its file'
        )
    k = value(stop, "stiffness", values) if stiffness is None else stiffness
    if not 0.0 < k < math.inf:
        raise ParameterError(f"stiffness = {k:g} N/m^{n:g} must be positive and finite")
    if speed is None and n != 1.0:
        raise ParameterError(
            f"{stop.name}.exponent = {n:g}: the map depends on the closing speed; give it in m/s"
        )
    v0 = 1.0 if speed is None else speed
    if not 0.0 < v0 < math.inf:
        raise ParameterError(f"speed = {v0:g} m/s must be positive and finite")
    e = value(stop, "restitution", values)
    if e < RESTITUTION_MIN:
        raise ParameterError(
            f"{stop.name}.restitution = {e:g} of a compliant stop must be at least "
            f"{RESTITUTION_MIN:g}"
        )
    return k, n, damping_factor(e), v0


def _hit(wall: float, offset: float, modal: Modes, G: Real, law: Law, beta: float) -> Hit:
    """Return the hit of the fundamental mode alone."""
    omega = 2.0 * np.pi * modal.frequency
    omega2 = omega * np.abs(omega)
    start = np.zeros(len(G))
    start[0] = -law[3] / G[0]
    p, v = _contact(G, omega2, beta * omega2, start, law)
    before = np.zeros(len(G))
    before[0] = 1.0
    after: Real = (v**2 + omega2 * p**2) / start[0] ** 2
    restitution = -float(v[0] / start[0])
    lost = 1.0 - float(after.sum())
    return Hit(wall, offset, restitution, modal.frequency, before, after, lost)


def _contact(G: Real, omega2: Real, damping: Real, start: Real, law: Law) -> tuple[Real, Real]:
    """Return the amplitudes of the modes and their rates at the end of a contact.

    Time is in units of the time scale of the hit, amplitudes are in units of it times the speeds.
    """
    from scipy.integrate import solve_ivp  # imported here: it takes 0.2 s

    solve: Any = solve_ivp  # Its types exclude events with attributes.
    k, n, a, v0 = law
    m, mobility = len(G), float(G @ G)
    depth = (v0**2 / (mobility * k)) ** (1.0 / (n + 1.0))
    T = depth / v0  # In this time the force k depth^n changes the speed of the hit point by v0.
    scale = float(np.abs(start).max())
    row = G * scale / v0

    def rates(_: float, y: Real) -> Real:
        d, u = -float(row @ y[:m]), -float(row @ y[m:])
        force = max(0.0, math.copysign(abs(d) ** n, d) * (1.0 + a * u))
        pushed = G * (v0 / (mobility * scale)) * force
        return np.concatenate([y[m:], pushed - T**2 * omega2 * y[:m] - T * damping * y[m:]])

    def gap(t: float, y: Real) -> float:
        return float(row @ y[:m]) if t > 0.0 else -1.0

    ends: Any = gap
    ends.terminal, ends.direction = True, 1.0
    y = np.concatenate([np.zeros(m), start / scale])
    path = solve(rates, (0.0, DURATION_MAX), y, "DOP853", rtol=RTOL, atol=ATOL, events=ends)
    if path.status != 1:
        raise SimulationError(
            f"a contact with the stiffness {k:g} N/m^{n:g} does not end: choose a larger stiffness"
        )
    last = path.y[:, -1] * scale
    return T * last[:m], last[m:]
