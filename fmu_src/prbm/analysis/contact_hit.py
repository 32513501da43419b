"""Contact stiffness of spheres and plates, and the force and duration of one hit."""

import math
from dataclasses import dataclass
from typing import Any

from ..base.errors import ParameterError
from ..mechanics.compliance import damping_factor
from ..mechanism.parts import RESTITUTION_MIN

TOLERANCE = 1e-10  # Relative tolerance of the integration of a hit.
DURATION_MAX = 1e4  # Of the time scale of a hit: longest integration.


@dataclass(frozen=True)
class ContactHit:
    """A hit of a point mass on a compliant stop.

    Parameters
    ----------
    force : float
        Largest force [N].
    elastic_force : float
        Largest force of a hit without damping [N].
    indentation : float
        Largest indentation [m].
    duration : float
        Time from first touch to separation [s].
    """

    force: float
    elastic_force: float
    indentation: float
    duration: float


def hertz_stiffness(
    radius: float, other_radius: float, modulus: float, poisson: float, other: tuple[float, float]
) -> float:
    """Return the stiffness 4/3 E* sqrt(R) of two spheres [N/m^1.5], for the exponent 1.5.

    Parameters
    ----------
    radius, other_radius : float
        Radii [m]; infinite for a plane, negative for a hollow sphere.
    modulus, poisson : float
        Young's modulus [Pa] and Poisson's ratio of the first sphere.
    other : pair of float
        Those of the second one.

    Raises
    ------
    ParameterError
        If a value is out of bounds, or the spheres do not touch in a point.

    Examples
    --------
    A steel ball of 10 mm on a steel plane:

    >>> f"{hertz_stiffness(5e-3, math.inf, 200e9, 0.3, (200e9, 0.3)):.4g}"
    '1.036e+10'
    """
    for E, nu in ((modulus, poisson), other):
        _check_positive("Young's modulus", E, "Pa")
        if not -1.0 < nu <= 0.5:
            raise ParameterError(f"Poisson's ratio = {nu:g} must lie between -1 and 0.5")
    if radius == 0.0 or other_radius == 0.0:
        raise ParameterError("a radius of 0 m has no contact stiffness: give the radii in m")
    curvature = 1.0 / radius + 1.0 / other_radius
    if not 0.0 < curvature < math.inf:
        raise ParameterError(
            f"radii of {radius:g} m and {other_radius:g} m do not touch in a point: one sphere "
            "must be smaller than the hollow in which it lies"
        )
    softness = (1.0 - poisson**2) / modulus + (1.0 - other[1] ** 2) / other[0]
    return 4.0 / (3.0 * softness) / math.sqrt(curvature)


def plate_stiffness(modulus: float, area: float, thickness: float) -> float:
    """Return the stiffness E A/t of a pad that is compressed [N/m], for the exponent 1.

    Examples
    --------
    >>> plate_stiffness(1e7, 1e-4, 2e-3)
    500000.0
    """
    _check_positive("Young's modulus", modulus, "Pa")
    _check_positive("area", area, "m2")
    _check_positive("thickness", thickness, "m")
    return modulus * area / thickness


def first_hit(
    stiffness: float, exponent: float, restitution: float, mass: float, speed: float
) -> ContactHit:
    """Return the hit of a point mass [kg] with a speed [m/s].

    Raises
    ------
    ParameterError
        If a value is out of bounds.

    Examples
    --------
    >>> hit = first_hit(1e6, 1.0, 1.0, mass=0.01, speed=1.0)
    >>> round(hit.force, 6), round(hit.duration * 1e6, 3)  # v sqrt(k m), pi sqrt(m/k)
    (100.0, 314.159)
    """
    _check_positive("stiffness", stiffness, "N/m^n")
    _check_positive("mass", mass, "kg")
    _check_positive("speed", speed, "m/s")
    if not 1.0 <= exponent < math.inf:
        raise ParameterError(f"exponent = {exponent:g} must be at least 1")
    if not RESTITUTION_MIN <= restitution <= 1.0:
        raise ParameterError(
            f"restitution = {restitution:g} must lie between {RESTITUTION_MIN:g} and 1"
        )
    damped = _scaled_hit(exponent, damping_factor(restitution))
    elastic = _scaled_hit(exponent, 0.0)
    depth = (mass * speed**2 / stiffness) ** (1.0 / (exponent + 1.0))
    force = stiffness * depth**exponent
    return ContactHit(
        force * damped[0], force * elastic[0], depth * damped[1], depth / speed * damped[2]
    )


def _scaled_hit(n: float, a: float) -> tuple[float, float, float]:
    """Return largest force and indentation and duration for unit stiffness, mass and speed."""
    from scipy import integrate, optimize  # imported here: they take 0.2 s

    solve: Any = integrate.solve_ivp  # Its types exclude events with attributes.

    def force(d: float, u: float) -> float:
        return math.copysign(abs(d) ** n, d) * (1.0 + a * u)

    opens: Any = lambda t, y: y[0] if t > 0.0 else 1.0  # noqa: E731
    opens.terminal, opens.direction = True, -1.0
    path = solve(
        lambda t, y: (y[1], -force(y[0], y[1])), (0.0, DURATION_MAX), (0.0, 1.0),
        method="DOP853", rtol=TOLERANCE, atol=TOLERANCE, events=(opens, lambda t, y: y[1]),
        dense_output=True,
    )  # fmt: skip
    end, deepest = float(path.t_events[0][0]), float(path.y_events[1][0][0])
    top = optimize.minimize_scalar(
        lambda t: -force(*path.sol(t)), bounds=(0.0, float(path.t_events[1][0])), method="bounded",
        options={"xatol": TOLERANCE},
    )  # fmt: skip
    return -float(top.fun), deepest, end


def _check_positive(name: str, x: float, unit: str) -> None:
    """Reject a number that is not positive and finite."""
    if not 0.0 < x < math.inf:
        raise ParameterError(f"{name} = {x:g} {unit} must be positive and finite")
