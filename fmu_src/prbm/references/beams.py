r"""Cantilevers in closed form, as references for the flexure models.

The beam is that of Euler and Bernoulli, for large deflections (the elastica): its moment is EI
times its curvature, and it neither stretches nor shears.  It is clamped at the origin and points
along +x.  Lengths are in units of the length L of the beam.

Sources
-------
.. [1] K. E. Bisshopp, D. C. Drucker, Q. Appl. Math. 3 (1945) 272 (end force).
.. [2] S. P. Timoshenko, D. H. Young, W. Weaver, Vibration Problems in Engineering, 4th ed.,
   Wiley, 1974, ch. 5 (transverse vibrations of beams).
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from ..base.errors import EquilibriumError

LOAD_MIN = 1e-9  # Below this load the difference of the elliptic integrals is round-off.


@dataclass(frozen=True)
class Tip:
    """Position of the end of a cantilever, in units of L, and its slope [rad]."""

    z: complex
    slope: float


def end_force(load: float) -> Tip:
    r"""Return the tip under an end force of constant direction, normal to the unloaded beam.

    With alpha = P L^2/EI and the slope Theta of the tip, k^2 = (1 + sin Theta)/2 and
    sin phi = 1/(k sqrt 2) (eqs. 8 to 16 of [1]):

        sqrt(alpha) = K(k) - F(phi, k),
        x/L = sqrt(2 sin(Theta)/alpha),
        y/L = 1 - 2 (E(k) - E(phi, k))/sqrt(alpha).

    Parameters
    ----------
    load : float
        alpha = P L^2/EI; positive along +y [-].

    Examples
    --------
    A small force deflects the tip by alpha/3 and turns it by alpha/2:

    >>> tip = end_force(1e-4)
    >>> round(tip.z.imag / 1e-4, 6), round(tip.slope / 1e-4, 6)
    (0.333333, 0.5)
    """
    alpha = abs(load)
    if alpha < LOAD_MIN:
        return Tip(complex(1.0, load / 3), load / 2)

    def excess(slope: float) -> float:
        k2, phi = _modulus(slope)
        return float(ellipk(k2) - ellipkinc(phi, k2)) - math.sqrt(alpha)

    slope = float(brentq(excess, 1e-16, math.pi / 2 - 1e-12, xtol=1e-16, rtol=1e-15))
    k2, phi = _modulus(slope)
    x = math.sqrt(2 * math.sin(slope) / alpha)
    y = 1 - 2 * float(ellipe(k2) - ellipeinc(phi, k2)) / math.sqrt(alpha)
    return Tip(complex(x, math.copysign(y, load)), math.copysign(slope, load))


def _modulus(slope: float) -> tuple[float, float]:
    """Return k^2 and phi of the elliptic integrals."""
    k2 = (1 + math.sin(slope)) / 2
    return k2, math.asin(1 / math.sqrt(2 * k2))


def end_moment(load: float) -> Tip:
    """Return the tip under an end moment, which bends the beam to an arc of a circle.

    Parameters
    ----------
    load : float
        M L/EI, the slope of the tip; positive counter-clockwise [-].

    Examples
    --------
    Half a circle ends above its clamp, at the distance of its diameter 2/pi:

    >>> tip = end_moment(math.pi)
    >>> round(tip.z.real, 12), round(tip.z.imag * math.pi, 12)
    (0.0, 2.0)
    """
    if load == 0.0:
        return Tip(1 + 0j, 0.0)
    half = load / 2
    return Tip(math.sin(half) / half * complex(math.cos(half), math.sin(half)), load)


def wavenumber(mode: int, mass: float = 0.0, inertia: float = 0.0) -> float:
    r"""Return beta L of a mode of a cantilever with a rigid body at its tip (ch. 5 of [2]).

    The body has its centre of mass at the tip.  With mu and nu its mass and its inertia in units
    of the beam's m and m L^2, the shape

        W = A (cosh b s - cos b s) + B (sinh b s - sin b s),    0 <= s <= 1, b = beta L,

    satisfies W'' = nu b^4 W' and W''' = -mu b^4 W at s = 1.  The frequency is
    omega = b^2 sqrt(EI/(m L^3)).

    Parameters
    ----------
    mode : int
        Number of the mode, 1 for the fundamental.
    mass, inertia : float
        mu, nu [-] (default: 0, no body).

    Raises
    ------
    EquilibriumError
        If the mode is not found.

    Examples
    --------
    Without a body cos b cosh b = -1; the first root is 1.8751, the second 4.6941:

    >>> round(wavenumber(1), 4), round(wavenumber(2), 4)
    (1.8751, 4.6941)
    """
    mu, nu = mass, inertia

    def determinant(b: float) -> float:
        scale = math.exp(-b)  # keeps the hyperbolic functions of order one
        ch, sh = (1 + scale * scale) / 2, (1 - scale * scale) / 2
        c, s = scale * math.cos(b), scale * math.sin(b)
        W, slope = (ch - c, sh - s), (sh + s, ch - c)
        moment, shear = (ch + c, sh + s), (sh - s, ch + c)
        bend = [m - nu * b**3 * w for m, w in zip(moment, slope, strict=True)]
        force = [q + mu * b * w for q, w in zip(shear, W, strict=True)]
        return bend[0] * force[1] - bend[1] * force[0]

    # Dunkerley: the beam, the mass and the inertia alone have omega^-2 = 1/12.36, mu/3 and nu.
    lowest = 0.9 * (mu / 3 + nu + 1 / 12) ** -0.25
    grid = np.geomspace(min(1e-3, lowest), (mode + 1) * math.pi, 400 * (mode + 1))
    values = [determinant(float(b)) for b in grid]
    changes = [i for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0]
    if len(changes) < mode:
        raise EquilibriumError(
            f"mode {mode} of a cantilever with mass = {mass:g} and inertia = {inertia:g} was not "
            "found: give a mass and an inertia of the order of the beam's"
        )
    i = changes[mode - 1]
    return float(brentq(determinant, grid[i], grid[i + 1], xtol=1e-15, rtol=1e-14))
