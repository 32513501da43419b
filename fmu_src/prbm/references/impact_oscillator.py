"""Closed form of the linear oscillator with a wall in the middle, driven by a sine force.

S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983)
129.
"""

import math
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq


def periodic_orbit(ratio: float, zeta: float, restitution: float) -> tuple[float, Any]:
    """Return closing speed and multipliers of the motion with one impact per driving period.

    In units of the oscillator, x'' + 2 zeta x' + x = sin(ratio t + phase) for x > 0, with a wall at
    x = 0 and the restitution eps.  The mass leaves the wall with the velocity v and hits it after a
    period T with -v/eps.  Between impacts x = p + Phi(t) (x_0 - p_0) for x and its velocity, with
    the periodic response p of the oscillator without the wall and Phi = exp(A t).  Hence

        p_0 = (I - Phi)^-1 ((0, -v/eps) - Phi (0, v)),

    and the amplitude of p gives v.  The multipliers are the eigenvalues of S Phi with the saltation
    matrix S of the impact.

    Parameters
    ----------
    ratio : float
        Driving frequency over that of the undamped oscillator [-].
    zeta : float
        Damping ratio [-].
    restitution : float
        Coefficient of restitution eps, above 0 [-].

    Returns
    -------
    speed, multipliers
        Closing speed over (static displacement times natural angular frequency) [-], and the two
        multipliers [-].  The motion is stable if both are inside the unit circle.
    """
    eps = restitution
    phi = expm(np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]]) * 2.0 * math.pi / ratio)
    p = np.linalg.solve(np.eye(2) - phi, [0.0, -1.0 / eps] - phi @ [0.0, 1.0])
    v = 1.0 / abs(1.0 - ratio**2 + 2j * zeta * ratio) / math.hypot(p[0], p[1] / ratio)
    force = v * (p[0] * (1.0 - ratio**2) + 2.0 * zeta * p[1])
    before, after = force + 2.0 * zeta * v / eps, force - 2.0 * zeta * v
    saltation = [[-eps, 0.0], [-(after + eps * before) / (v / eps), -eps]]
    return v / eps, np.linalg.eigvals(np.array(saltation) @ phi)


def period_doubling(zeta: float, restitution: float, low: float, high: float) -> float:
    """Return the frequency ratio between two others at which a multiplier is -1.

    Raises
    ------
    ValueError
        If no multiplier passes -1 between them.

    Examples
    --------
    >>> round(period_doubling(0.05, 0.5, 2.5, 3.0), 4)
    2.6753
    """

    def beyond(ratio: float) -> float:
        return float(periodic_orbit(ratio, zeta, restitution)[1].real.min()) + 1.0

    return float(brentq(beyond, low, high))
