"""Shapes of a mechanism from recorded angles: closure of loops, stretches of flexures."""

from collections.abc import Mapping

import numpy as np

from ..base.errors import EquilibriumError
from ..mechanics.arrays import Complex, Real
from ..mechanics.constraints import project_positions
from ..mechanics.system import Rows, System

STRETCH_ITERATIONS_MAX = 20  # The convergence is quadratic: four iterations are usual.
STRETCH_RTOL = 1e-9  # Largest last change of a stretch, far below the resolution of a picture.


def closed(system: System, q: Real, stop: int | None = None, wall: float = 0.0) -> Real:
    """Return the nearest shape with closed loops; with ``stop``, it touches the wall.

    Parameters
    ----------
    system : System
        The mechanism.
    q : (n,)
        Coordinates near that shape.
    stop : int or None
        Index of the stop that touches its wall; None: no contact.
    wall : float
        Position of the wall [m].

    Returns
    -------
    (n,)
        Coordinates of the shape.
    """
    touching = [] if stop is None else [stop]
    rows = system.loop_rows.beside(system.gap_rows.some(touching))
    rows.c[len(system.loops) :] += wall
    return project_positions(system, rows, q)[0]


def stretched(system: System, q: Real, displacements: Mapping[str, Complex]) -> Real:
    """Return shapes with the stretches that close the loops and displace the bodies as given.

    Gauss-Newton with the pseudoinverse: if the stretches are not unique, the smallest are returned.

    Parameters
    ----------
    system : System
        The mechanism.
    q : (m, n)
        Angles [rad]; the entries of stretches are ignored.
    displacements : mapping of str to (m,) complex
        Displacements of bodies from the straight shape [m].

    Raises
    ------
    EquilibriumError
        If the iteration does not converge.
    """
    k = system.strains
    if not len(k):
        return q
    q = q.copy()
    q[:, k] = 0.0
    B, c = [], [np.tile(system.loops_c, (len(q), 1))]
    for name, displacement in displacements.items():
        frame = system.bodies[name]
        missing = frame.c - frame.drawn - displacement
        B += [frame.A[None], -1j * frame.A[None]]
        c += [missing.real[:, None], missing.imag[:, None]]
    placed = np.vstack(B) if B else np.zeros((0, system.d), complex)
    rows = system.loop_rows.beside(Rows(system, placed, np.zeros(len(placed))))
    constants = np.hstack(c)
    for _ in range(STRETCH_ITERATIONS_MAX):
        E = system.directions(q)
        x = rows.values(E, constants)
        slopes = rows.jacobian(E)[..., k]
        change = np.linalg.pinv(slopes) @ x[:, :, None]
        q[:, k] -= change[:, :, 0]
        if not np.abs(change).max() > STRETCH_RTOL:
            return q
    raise EquilibriumError(
        "no stretches of the flexures place the bodies where the result has them: check that the "
        "result is of this mechanism with these parameters"
    )


def angles(system: System) -> dict[str, int]:
    """Return the indices of the coordinates other than strains, by the names of their outputs.

    They are angles, and displacements of free bodies: the outputs have the units ``system.units``.
    """
    bodies = (frame.j for frame in system.bodies.values())
    return {system.variables[j][0]: j for j in (*system.links, *bodies, *system.floating)}
