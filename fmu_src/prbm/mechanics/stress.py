r"""Normal stress in the sections of flexures.

The stress of the left face, seen from the start to the end of a flexure, and that of the right face
are

    N/A - M/W,      N/A + M/W,

with the normal force N (positive in tension), the bending moment M (positive if the flexure turns
counter-clockwise from its start to its end), the area A and the section modulus W.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..base.tolerances import STRESS_TIE_RTOL
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
        Largest magnitude over all sections and both faces [Pa].
    place : int
        Number of its section, from 1 at the start; negative for the right face.
    position : float
        Position of this section along the flexure [m].
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


def stress(loads: SectionLoads) -> Stress:
    """Return the stress in a flexure.

    Among sections with the same stress, apart from round-off, the first one counts.
    """
    left, right = faces(loads)
    sizes = np.maximum(np.abs(left), np.abs(right))
    largest = float(sizes.max())
    k = int(np.argmax(sizes >= (1.0 - STRESS_TIE_RTOL) * largest))
    on_left = abs(left[k]) >= (1.0 - STRESS_TIE_RTOL) * abs(right[k])
    place = k + 1 if on_left else -(k + 1)
    return Stress(float(left[0]), float(left[-1]), largest, place, float(loads.position[k]))


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
