r"""Small vibrations about a static shape, and the effect of an impact on the fundamental mode."""

import math
from dataclasses import dataclass

import numpy as np

from ..base.tolerances import (
    RELEASE_MODE_RTOL,
    SPRINGLESS_RATE,
    ZERO_FREQUENCY_RTOL,
    ZERO_MODE_RTOL,
)
from . import constraints
from .arrays import Complex, Real
from .elements import Elements
from .forces import field_row
from .positions import start_speed
from .statics import Equilibrium, held_rows, resting, sprung, tangent_stiffness
from .system import Rows, System

SHOWN = 6  # Frequencies in the text of modes.


@dataclass(frozen=True, repr=False)
class Modes:
    """Mass-normalised modes in rising order of frequency.

    Parameters
    ----------
    frequency : (k,)
        Frequencies [Hz].  Those of unstable modes (omega^2 < 0) are -sqrt(-omega^2)/(2 pi).
    shape : (n, k)
        Columns phi, velocities that keep the loops closed, with phi^T M phi = 1 [rad/(kg^.5 m)].
    M : (n, n)
        Mass matrix at the shape [kg m^2].
    """

    frequency: Real
    shape: Real
    M: Real

    def __repr__(self) -> str:
        first = ", ".join(f"{f:.6g}" for f in self.frequency[:SHOWN])
        more = ", ..." if len(self.frequency) > SHOWN else ""
        return f"<Modes: {len(self.frequency)}, at {first}{more} Hz>"

    @property
    def rounding(self) -> float:
        """Frequency below which a frequency is round-off: the mode is free [Hz]."""
        return ZERO_FREQUENCY_RTOL * float(np.abs(self.frequency).max(initial=0.0))


def modes(system: System, shape: Equilibrium) -> Modes:
    """Return the modes about a static shape.

    The loads and the holding force of the shape are dead loads: they keep directions and sizes.

    Parameters
    ----------
    system : System
        The mechanism.
    shape : Equilibrium
        Static shape, as :func:`prbm.mechanics.statics.equilibrium` returns it.
    """
    rows, lam = system.loop_rows, shape.lam
    if shape.force != 0.0:
        rows = held_rows(system, system.amount(shape.q))
        lam = np.append(lam, shape.force)
    e = system.directions(shape.q)
    return _modes(system, e, system.mass_matrix(e), rows, lam, shape.load)


def _modes(system: System, e: Complex, M: Real, rows: Rows, lam: Real, w: Complex) -> Modes:
    """Solve K_t phi = omega^2 M phi for phi on the tangent space of the loops.

    Bodies that nothing connects to the ground do not move.
    The tangent stiffness K_t is that of the loads w and of the multipliers lam along rows.
    """
    K_t = tangent_stiffness(Elements(system).tangent(e), w, rows, lam, e)
    still = np.eye(system.n)[system.placed]
    return vibrations(M, K_t, np.vstack([system.loop_rows.jacobian(e), still]))


def vibrations(M: Real, K_t: Real, rows: Real) -> Modes:
    """Return the solutions of K_t phi = omega^2 M phi with rows phi = 0.

    Parameters
    ----------
    M : (n, n)
        Mass matrix [kg m^2].
    K_t : (n, n)
        Tangent stiffness [N m/rad].
    rows : (r, n)
        Gradients of the active constraints, which are independent of each other.
    """
    # Coordinates of unit inertia make the basis Z independent of how the inertias differ.
    scale = 1.0 / np.sqrt(M.diagonal())
    Z = scale[:, None] * np.linalg.qr((rows * scale).T, mode="complete")[0][:, len(rows) :]
    L = constraints.cholesky(Z.T @ M @ Z)
    omega2, y = np.linalg.eigh(np.linalg.solve(L, np.linalg.solve(L, Z.T @ K_t @ Z).T))
    frequency = np.sign(omega2) * np.sqrt(np.abs(omega2)) / (2 * np.pi)
    return Modes(frequency, Z @ np.linalg.solve(L.T, y), M)


def unstable_directions(frequency: Real, along: Real | None = None) -> int:
    r"""Return the number of unstable directions of a shape, under dead loads or held.

    Under dead loads it is the number of unstable modes.  Holding a displacement g whose response to
    a small force, sum g_i^2/omega_i^2, is against the force removes one of them.  Motions without
    stiffness, whose frequencies are round-off, are stable.

    Parameters
    ----------
    frequency : (k,)
        Frequencies of the modes [Hz], in rising order; negative if unstable.
    along : (k,) or None
        Change g_i of the held displacement by each mass-normalised mode; zero if it is round-off.
        None: nothing is held.

    Examples
    --------
    Two motions of 1 kg with -1 N/m and 3 N/m; the sum of both is held, and their difference stable:

    >>> omega = np.array([-1.0, math.sqrt(3.0)])
    >>> unstable_directions(omega / (2.0 * math.pi))
    1
    >>> unstable_directions(omega / (2.0 * math.pi), np.array([1.0, 1.0]))
    0
    """
    least = ZERO_FREQUENCY_RTOL * float(np.abs(frequency).max(initial=0.0))
    count = int(np.count_nonzero(frequency < -least))
    if along is None or count == 0:
        return count
    free = np.abs(frequency) <= least
    if np.any(along[free]):
        return count
    omega2 = np.sign(frequency[~free]) * frequency[~free] ** 2
    return count - int(float(np.sum(along[~free] ** 2 / omega2)) < 0.0)


def moved_by(system: System, q: Real, phi: Real) -> Real:
    """Return the displacement of the released body by modes phi (n, k), (k,).

    It is that along the direction of the release [m], or the rotation times the size if the release
    is by an angle; zero if it is round-off.
    """
    moved = system.gradient(system.holding_row(q)[None], system.directions(q))[0] @ phi
    turn = np.abs(phi).max(axis=0, initial=0.0)
    return np.where(np.abs(moved) > RELEASE_MODE_RTOL * system.length * turn, moved, 0.0)


def damping(system: System, found: Modes, q: Real) -> tuple[Real, Real]:
    """Return damping ratios [-] and decay times [s] of modes, (k,) each.

    The damping is C = 2 zeta omega_1 M + beta K, and that of dampers, with the parameters
    ``damping.zeta`` and ``damping.beta``, the fundamental angular frequency omega_1 about the
    equilibrium under gravity and the stiffness K of flexures and joints.  Of a mode phi only
    phi^T C phi counts; couplings of modes by C are neglected.  The amplitude falls to 1/e in the
    decay time; above the damping ratio 1 it is that of the slower of both motions.  Both are NaN
    for modes that do not vibrate, and the decay time is infinite without damping.

    Parameters
    ----------
    system : System
        The mechanism.
    found : Modes
        Its modes, as :func:`modes` returns them.
    q : (n,)
        Their shape.
    """
    omega_1, phi = 2 * math.pi * fundamental_frequency(system), found.shape
    C = Elements(system).damping(system.directions(q), system.values["damping.beta"])
    rates = 2.0 * system.values["damping.zeta"] * omega_1 + np.einsum("ik,ij,jk->k", phi, C, phi)
    omega = 2 * math.pi * found.frequency
    ratios, times = np.full((2, len(omega)), math.nan)
    for k in np.flatnonzero(found.frequency > found.rounding):
        ratios[k] = ratio = float(rates[k]) / (2.0 * float(omega[k]))
        root = math.sqrt(max(ratio**2 - 1.0, 0.0))
        # The slower motion, without the difference of two large numbers.
        times[k] = (
            (ratio + root) / omega[k] if ratio > 1.0 else 2.0 / rates[k] if ratio else math.inf
        )
    return ratios, times


def fundamental_frequency(system: System) -> float:
    """Return the fundamental frequency about the equilibrium under gravity [Hz].

    It is zero if that equilibrium is unstable or is not found, or if a motion deforms no element.
    Such motions of bodies that only springs connect to the ground are left out.
    """
    shape, balanced = resting(system)
    if not balanced:
        return 0.0
    found = modes(system, shape)
    lowest = float(found.frequency[first_acting(system, found)]) if len(found.frequency) else 0.0
    return lowest if lowest > found.rounding else 0.0


def first_acting(system: System, found: Modes) -> int:
    """Return the index of the fundamental mode, which is the first that no round-off makes.

    Without bodies that only springs connect to the ground it is 0.
    """
    if not len(sprung(system)):
        return 0
    acting = np.flatnonzero(np.abs(found.frequency) > found.rounding)
    return int(acting[0]) if len(acting) else 0


def slow_rates(system: System) -> tuple[float, float]:
    """Return the rates of a mechanism without a fundamental frequency [rad/s].

    The first is the scale of velocities.  About an unstable equilibrium it is the rate of the most
    unstable mode.  If a motion deforms no spring and lifts no weight, it is the larger of the rates
    sqrt(g/L) and u/L of a fall and of the motion at the release, with the size L, gravity g and the
    largest speed u given there; without both, the lowest angular frequency that is not zero.

    The second is the scale of times: the same, or the lowest angular frequency if it is larger and
    the mechanism is not unstable.
    """
    found = modes(system, resting(system)[0])
    frequency, least = found.frequency, found.rounding
    if len(frequency) and frequency[0] < -least:
        return (-2 * math.pi * float(frequency[0]),) * 2
    speed = start_speed(system)
    fall = math.sqrt(abs(system.gravity) / system.length)
    acting = 2 * math.pi * frequency[frequency > least]
    lowest = float(acting[0]) if len(acting) else 0.0
    rate = max(fall, speed / system.length) or lowest or SPRINGLESS_RATE
    return rate, max(rate, lowest)


def fundamental_at(system: System, q: Real) -> tuple[Real, Real]:
    """Return the fundamental mode and the mass matrix at a shape that is not in equilibrium.

    Returns
    -------
    phi : (n,)
        Mass-normalised mode; zeros if all bodies are free.
    M : (n, n)
        Mass matrix [kg m^2].
    """
    found = modes_at(system, q)
    if not len(found.frequency):
        return np.zeros(system.n), found.M
    return found.shape[:, first_acting(system, found)], found.M


def modes_at(system: System, q: Real) -> Modes:
    """Return the modes at a shape that is not in equilibrium.

    The multipliers in the tangent stiffness are those of the shape held at rest by a force on the
    released body.  This force makes the accelerations that remain as small as possible (Gauss'
    principle).  At a static shape these multipliers are exact.  At other shapes the modes depend on
    the choice of the coordinates, and some may be unstable; unstable modes come first.
    """
    e = system.directions(q)
    M = system.mass_matrix(e)
    rows = held_rows(system, system.amount(q))
    G = rows.jacobian(e)
    w = field_row(system.repeat_columns(system.S), system.gravity)
    load = Elements(system).force(q, e) + system.Phi.to_coordinates((w * e).real)
    right = np.concatenate([load, np.zeros(len(rows))])
    kkt = constraints.saddle(M, G, G)
    lam = -constraints.solve(kkt, right, system.n, system.length)[system.n :]
    return _modes(system, e, M, rows, lam, w)


def simulated_restitution(phi: Real, M: Real, before: Real, after: Real) -> float:
    """Return the modal restitution R of an impact, -phi^T M v+ / phi^T M v- [-].

    R is zero if the velocity of the fundamental mode before the impact is round-off.  Otherwise
    |R| <= 1/sqrt(p), with the share p of this mode in the kinetic energy before the impact.  If p
    is small, R can be far below -1 or above 1.

    Examples
    --------
    >>> phi, M = np.array([1.0, 0.0]), np.eye(2)
    >>> simulated_restitution(phi, M, np.array([2.0, 1.0]), np.array([-1.0, 3.0]))
    0.5
    """
    momentum = M @ phi
    return modal_ratio(momentum, before, momentum, after)


def modal_ratio(first: Real, before: Real, last: Real, after: Real) -> float:
    """Return -(last^T after) / (first^T before) [-]; zero if first^T before is round-off.

    Parameters
    ----------
    first, last : (n,)
        M phi of the fundamental mode before and after an impact.
    before, after : (n,)
        Rates before and after the impact [rad/s].
    """
    arriving = float(first @ before)
    if abs(arriving) <= ZERO_MODE_RTOL * float(np.abs(first) @ (np.abs(before) + np.abs(after))):
        return 0.0
    return -float(last @ after) / arriving


def modal_restitution(system: System, shape: Equilibrium, stop: int, restitution: float) -> float:
    r"""Return the modal restitution R of an impact before which only the fundamental mode moves.

    R depends on the share mu_1 of the fundamental mode in the mobility of the hit point:

        R = (1 + eps) mu_1 - 1,    mu_1 = G_1^2 / sum_i G_i^2,    G_i = (dg/dq) phi_i,

    with the gap g and the mass-normalised modes phi_i.

    Parameters
    ----------
    system : System
        The mechanism.
    shape : Equilibrium
        Shape at the impact, held by a force on the released body.
    stop : int
        Number of the stop that is hit.
    restitution : float
        Coefficient of restitution eps [-].
    """
    found = modes(system, shape)
    G = system.gap_rows.jacobian(system.directions(shape.q))[stop]
    share = (G @ found.shape) ** 2
    return (1.0 + restitution) * float(share[0] / share.sum()) - 1.0
