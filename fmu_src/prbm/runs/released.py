"""Displacement and velocity of the released point, from the outputs of its body."""

import numpy as np

from ..mechanics.arrays import Complex, Real
from ..mechanics.assembly import assemble
from ..mechanics.system import System, unit
from ..mechanism.parts import Release
from .quantities import Table
from .result import Result


def system_of(result: Result) -> System:
    """Return the mechanism of a result with the values of its start."""
    own = {p.name for p in result.mechanism.parameters}
    return assemble(result.mechanism, {k: x for k, x in result.start_values.items() if k in own})


def displacement_outputs(release: Release) -> list[str]:
    """Return the outputs that :func:`released_displacement` needs.

    Examples
    --------
    >>> displacement_outputs(Release("shuttle"))
    ['shuttle.x', 'shuttle.y']
    >>> displacement_outputs(Release("shuttle", point=(0.01, 0.0)))
    ['shuttle.x', 'shuttle.y', 'shuttle.angle']
    """
    turning = () if release.point is None else ("angle",)
    return [f"{release.body}.{suffix}" for suffix in ("x", "y", *turning)]


def velocity_outputs(release: Release) -> list[str]:
    """Return the outputs that :func:`released_velocity` needs."""
    turning = () if release.point is None else ("angle", "omega")
    return [f"{release.body}.{suffix}" for suffix in ("vx", "vy", *turning)]


def released_label(release: Release) -> str:
    """Return what moves by the displacement or the angle of a release.

    Examples
    --------
    >>> released_label(Release("shuttle", point=(0.01, 0.0)))
    'the released point of shuttle'
    """
    own = release.turns or release.point is None
    return release.body if own else f"the released point of {release.body}"


def released_displacement(system: System, columns: Table) -> Real:
    """Return the displacement of the released point along the direction of the release [m].

    It is counted from the straight shape.

    Parameters
    ----------
    system : System
        The mechanism.
    columns : mapping or structured array
        The outputs of :func:`displacement_outputs`, (m,) each.

    Returns
    -------
    (m,)
        The displacements.
    """
    release = system.mechanism.release
    moved = columns[f"{release.body}.x"] + 1j * columns[f"{release.body}.y"]
    if release.point is not None:
        moved = moved + _lever(system) * (_turned(release, columns) - 1.0)
    along: Real = (unit(release.direction).conjugate() * moved).real
    return along


def released_velocity(system: System, columns: Table) -> Real:
    """Return the velocity of the released point along the direction of the release, (m,) [m/s].

    Parameters as for :func:`released_displacement`, with the outputs of :func:`velocity_outputs`.
    """
    release = system.mechanism.release
    v = columns[f"{release.body}.vx"] + 1j * columns[f"{release.body}.vy"]
    if release.point is not None:
        omega = columns[f"{release.body}.omega"]
        v = v + 1j * omega * _lever(system) * _turned(release, columns)
    along: Real = (unit(release.direction).conjugate() * v).real
    return along


def _lever(system: System) -> complex:
    """Return the released point from the centre of mass of its body, in the straight shape [m]."""
    return system.released.drawn - system.bodies[system.mechanism.release.body].drawn


def _turned(release: Release, columns: Table) -> Complex:
    """Return the rotation exp(i angle) of the released body, (m,)."""
    turned: Complex = np.exp(1j * columns[f"{release.body}.angle"])
    return turned
