r"""Normal stress in the sections of flexures.

The stress of the left face, seen from the start to the end of a flexure, and that of the right face
are

    N/A - M/W,      N/A + M/W,

with the normal force N (positive in tension), the bending moment M (positive if the flexure turns
counter-clockwise from its start to its end), the area A and the section modulus W.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..base.tolerances import STRESS_TIE_RTOL, SUMMIT_SHARE_MIN, SUMMIT_STEPS
from ..mechanism.description import Mechanism
from .arrays import Real
from .dynamics import Equations, Evaluation
from .free_body import SectionLoads
from .sections import section_loads, static_section_loads
from .statics import Equilibrium
from .system import System


class Stress(NamedTuple):
    """Stress in a flexure.

    Parameters
    ----------
    start, end : float
        Stress of the left face at the start and at the end, positive in tension [Pa].
    largest : float
        Largest magnitude over all sections and both faces, and between the nodes of a beam [Pa].
    place : int
        Number of its section, or of one beside it, from 1 at the start; negative for the right
        face.
    position : float
        Its position along the flexure [m].
    """

    start: float
    end: float
    largest: float
    place: int
    position: float


SectionStresses = dict[str, tuple[Real, Real]]
"""Stress of the left and of the right face in the sections of flexures by name, (m,), (m,) [Pa]."""


def stressed(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the indices of the flexures whose stress is an output.

    They are those of the types with ``stress``.
    """
    return tuple(i for i, f in enumerate(mechanism.flexures) if mechanism.type_of(f).stress)


def with_stress(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism whose flexures all have their stress as outputs."""
    kinds = tuple(replace(kind, stress=True) for kind in mechanism.flexure_types)
    return replace(mechanism, flexure_types=kinds)


def faces(loads: SectionLoads) -> tuple[Real, Real]:
    """Return the stress of the left and of the right face in all sections, (m,), (m,) [Pa]."""
    pulled, bent = loads.tension / loads.area, loads.bending / loads.modulus
    return pulled - bent, pulled + bent


def differences(x: Real, f: Real) -> Real:
    """Return the divided differences of values f at points x, (m,): Newton's form.

    Examples
    --------
    >>> differences(np.array([0.0, 1.0, 3.0]), np.array([1.0, 2.0, 10.0])).tolist()
    [1.0, 1.0, 1.0]
    """
    c = f.copy()
    for k in range(1, len(x)):
        c[k:] = (c[k:] - c[k - 1 : -1]) / (x[k:] - x[:-k])
    return c


def polynomial(x: Real, c: Real, s: float) -> tuple[float, float, float]:
    """Return a polynomial at s and its first two derivatives, from :func:`differences` c.

    Examples
    --------
    >>> polynomial(np.array([0.0, 1.0, 3.0]), np.array([1.0, 1.0, 1.0]), 2.0)
    (5.0, 4.0, 2.0)
    """
    value = slope = bend = 0.0
    for point, factor in zip(x[::-1].tolist(), c[::-1].tolist(), strict=True):
        apart = s - point
        bend = bend * apart + 2.0 * slope
        slope = slope * apart + value
        value = value * apart + factor
    return value, slope, bend


def summit(x: Real, c: Real, sign: float, low: float, high: float) -> float | None:
    """Return the place of an extremum of a polynomial between low and high; None: there is none.

    Parameters
    ----------
    x, c : (m,)
        Newton's form, from :func:`differences`.
    sign : float
        1: a maximum; -1: a minimum.
    low, high : float
        Ends of the interval.

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 3.0])
    >>> summit(x, differences(x, 1.0 - (x - 1.25) ** 2), 1.0, 0.0, 3.0)
    1.25
    >>> summit(x, differences(x, x**2), 1.0, 0.0, 3.0)
    """
    rise, fall = (polynomial(x, c, s)[1] for s in (low, high))
    if not (sign * rise > 0.0 and sign * fall < 0.0):
        return None
    s = low + rise / (rise - fall) * (high - low)
    for _ in range(SUMMIT_STEPS):
        _, slope, bend = polynomial(x, c, s)
        if not sign * bend < 0.0:
            return s
        s = min(max(s - slope / bend, low), high)
    return s


def stress(loads: SectionLoads) -> Stress:
    """Return the stress in a flexure.

    Between the nodes of a beam the largest magnitude is that of the polynomial through the nodes,
    except in notches, which have a section at the waist.  Among sections with the same stress,
    apart from round-off, the first one counts.
    """
    left, right = faces(loads)
    sizes = np.maximum(np.abs(left), np.abs(right))
    largest = float(sizes.max())
    k = int(np.argmax(sizes >= (1.0 - STRESS_TIE_RTOL) * largest))
    on_left = abs(left[k]) >= (1.0 - STRESS_TIE_RTOL) * abs(right[k])
    found = Stress(
        float(left[0]), float(left[-1]), largest, k + 1 if on_left else -(k + 1),
        float(loads.position[k]),
    )  # fmt: skip
    for face, side in ((left, 1), (right, -1)):
        found = _between(loads, face, side, SUMMIT_SHARE_MIN * largest, found)
    return found


def _between(loads: SectionLoads, face: Real, side: int, least: float, found: Stress) -> Stress:
    """Return the largest stress with that of a face between the nodes, beside at least ``least``.

    ``side`` is the sign of the place on this face.
    """
    nodes = slice(loads.smooth.start, loads.smooth.stop)
    x = loads.position[nodes]
    c = differences(x, face[nodes])
    for k in loads.smooth:
        if abs(face[k]) < least:
            continue
        sign = math.copysign(1.0, face[k])
        s = summit(x, c, sign, float(loads.position[k - 1]), float(loads.position[k + 1]))
        if s is not None:
            size = sign * polynomial(x, c, s)[0]
            if size > (1.0 + STRESS_TIE_RTOL) * found.largest:
                found = found._replace(largest=size, place=side * (k + 1), position=s)
    return found


def stresses(equations: Equations, q: Real, v: Real, found: Evaluation) -> dict[str, Stress]:
    """Return the stress in the flexures whose stress is an output, by name.

    The arguments are those of :func:`prbm.mechanics.sections.section_loads`.
    """
    wanted = stressed(equations.system.mechanism)
    if not wanted:
        return {}
    loads, _ = section_loads(equations, q, v, found)
    return {loads[i].name: stress(loads[i]) for i in wanted}


def section_stresses(equations: Equations, q: Real, v: Real, found: Evaluation) -> SectionStresses:
    """Return the stress in all sections of the flexures whose stress is an output.

    The arguments are those of :func:`prbm.mechanics.sections.section_loads`.
    """
    loads, _ = section_loads(equations, q, v, found)
    return {loads[i].name: faces(loads[i]) for i in stressed(equations.system.mechanism)}


def section_positions(system: System) -> dict[str, Real]:
    """Return the positions of these sections along the flexures, from the start, (m,) [m]."""
    own = {c.flexure.name: c.flexure for c in system.connections if c.flexure}
    names = [system.mechanism.flexures[i].name for i in stressed(system.mechanism)]
    return {
        name: own[name].position if own[name].forwards else own[name].position[::-1]
        for name in names
    }


def static_stresses(
    system: System, shape: Equilibrium, inputs: Mapping[str, float] | None = None
) -> dict[str, Stress]:
    """Return the stress in all flexures in a static shape, by name.

    The arguments are those of :func:`prbm.mechanics.sections.static_section_loads`.
    """
    return {one.name: stress(one) for one in static_section_loads(system, shape, inputs)}
