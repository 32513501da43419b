"""Mechanisms whose bodies have the mass of their outline, to compare with imported drawings."""

from dataclasses import replace

import numpy as np
import shapely

from prbm.cad.outline import outline
from prbm.files.outlines import Area, polygon
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.description import Mechanism
from prbm.mechanism.flexure import BEAM


def area(shape: shapely.Polygon) -> Area:
    """Return area, centroid and polar second moment of a polygon with holes."""
    rings = [np.array(r.coords)[:-1] @ [1, 1j] for r in (shape.exterior, *shape.interiors)]
    total = polygon(rings[0])
    for hole in map(polygon, rings[1:]):
        total = total.plus(Area(-hole.area, hole.centre, -hole.moment))
    return total


def cut(mechanism: Mechanism, thickness: float, density: float, modulus: float) -> Mechanism:
    """Return a mechanism of one material whose bodies and flexures are cut from one plate.

    Its flexures are beams, and its bodies have mass, inertia and centre of their outlines.
    """
    drawn = outline(mechanism)
    bodies = []
    for body in mechanism.bodies:
        found = area(drawn.bodies[body.name])
        mass = density * thickness
        bodies.append(
            replace(
                body,
                mass=mass * found.area,
                inertia=mass * found.moment,
                centre=(found.centre.real, found.centre.imag),
            )
        )
    kinds = [
        replace(
            kind,
            model=BEAM,
            n=0,
            coefficients={},
            axial=True,
            width=thickness,
            youngs_modulus=modulus,
            density=density,
            end_width=None,
        )
        for kind in mechanism.flexure_types
    ]
    return replace(
        mechanism,
        bodies=tuple(bodies),
        flexure_types=tuple(kinds),
        gravity=(0.0, 0.0),
        stops=(),
        frictions=(),
        forces=(),
        probes=(),
        release=replace(mechanism.release, displacement=0.0, velocity=0.0, point=None),
    )


def frequencies(mechanism: Mechanism) -> np.ndarray:
    """Return the natural frequencies at rest with stretching flexures [Hz]."""
    kinds = tuple(replace(kind, axial=True) for kind in mechanism.flexure_types)
    system = assemble(replace(mechanism, flexure_types=kinds), mechanism.values())
    return modes(system, equilibrium(system)).frequency
