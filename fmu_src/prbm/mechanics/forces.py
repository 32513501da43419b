r"""Generalised forces of springs, damping, gravity, inputs and friction, along increasing q [N m].

A force F (complex, [N]) at the point z = c + A E has the generalised force Re(conj(F) i A e) along
each direction, with the columns of A repeated for stretches.  All forces together are one complex
row w = i sum conj(F) A.  Their generalised forces are Q = Phi^T Re(w e).
"""

import numpy as np

from .arrays import Complex, Real
from .places import BodyFrame
from .system import System


def springs(K: Real, deflection: Real) -> Real:
    """Return the torque -K (q - q0) of the springs.

    Examples
    --------
    >>> springs(np.array([[2.0]]), np.array([0.25])).item()
    -0.5
    """
    result: Real = -(K @ deflection)
    return result


def elastic_energy(K: Real, deflection: Real) -> float:
    """Return (q - q0)^T K (q - q0) / 2 [J].

    Examples
    --------
    >>> elastic_energy(np.array([[2.0]]), np.array([0.5]))
    0.25
    """
    return 0.5 * float(deflection @ K @ deflection)


def field_row(S: Complex, acceleration: complex) -> Complex:
    """Return the row w of a uniform field of acceleration [N m].

    Parameters
    ----------
    S : (d,) complex
        First mass moments m^T A [kg m].
    acceleration : complex
        Acceleration of gravity, or minus that of the base [m/s^2].
    """
    return 1j * acceleration.conjugate() * S


def force_row(A: Complex, force: complex) -> Complex:
    """Return the row w of a force at z = c + A E [N m].

    Examples
    --------
    A force along +x at the end of a lever of 2 m that points to +y:

    >>> w = force_row(np.array([2.0 + 0j]), 3.0 + 0j)
    >>> float((w @ np.array([1j])).real)
    -6.0
    """
    return 1j * force.conjugate() * A


def load_rows(system: System, frame: BodyFrame, e: Complex) -> Real:
    """Return the generalised forces of a unit force along x, along y and of a unit moment, (3, n).

    They are also the gradients of the position of the point [m/rad] and of the angle [rad/rad].
    """
    rows = np.zeros((3, system.n))
    for k, force in enumerate((1.0 + 0.0j, 1.0j)):
        w = system.repeat_columns(force_row(frame.A, force))
        rows[k] = system.Phi.to_coordinates(generalised(w, e))
    rows[2, frame.j] = 1.0
    return rows


def generalised(w: Complex, e: Complex) -> Real:
    """Return Re(w e), the generalised force along each direction [N m]."""
    return (w * e).real


def gravitational_energy(system: System, e: Complex) -> float:
    """Return -Re(conj(g) sum m (z - z0)), zero at the straight shape [J]."""
    fall = system.S @ (e - system.directions(system.q0))
    return -float((np.conj(system.gravity) * fall).real)


def normal_force(lift: float, preload: float, stiffness: float) -> float:
    """Return the normal force of a friction point, max(0, N0 + k s) [N] (thesis 3.4.2).

    Examples
    --------
    >>> normal_force(-1e-3, 2.0, 1e3), normal_force(-3e-3, 2.0, 1e3)
    (1.0, 0.0)
    """
    return max(0.0, preload + stiffness * lift)
