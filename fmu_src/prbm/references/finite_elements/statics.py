"""Static shapes of the finite elements, and modes about them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, null_space
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from ...base.errors import EquilibriumError
from ...mechanics.arrays import Real
from ...mechanics.modal import Modes
from .equations import Equations

NEWTON_STEPS_MAX = 25
NEWTON_STEP_ATOL = 1e-9  # Newton step that ends the iteration [m], [rad]; the error is its square.
NEWTON_STEP_MAX = 10.0  # A larger Newton step [m], [rad] ends the iteration.
STATE_CHANGE_MAX = 1.0  # Slopes and angles that change more in one load step reach another shape.
LOAD_STEP_START, LOAD_STEP_MIN = 1 / 8, 1 / 1024  # Steps of the load, as fractions of all loads.
SINGULAR_RTOL = 1e-13  # Singular values below this fraction of the largest are taken as zero.


@dataclass(frozen=True)
class Shape:
    """A static shape of the elements.

    Parameters
    ----------
    q : (n,)
        Changes from the straight shape: displacements [m], slopes [-], rotations of bodies [rad].
    mu : (r,)
        Multipliers of the constraints [N], [N m].
    force : float
        Holding force on the released body along the direction of the release [N]; 0 if free.
    """

    q: Real
    mu: Real
    force: float = 0.0


def equilibrium(
    equations: Equations,
    row: Real,
    turns: Sequence[int],
    displacement: float | None = None,
    near: Shape | None = None,
) -> Shape:
    """Return the shape under gravity and the forces, free or held at a displacement.

    Parameters
    ----------
    equations : Equations
        The elements.
    row : (n,)
        Derivatives of the displacement of the released body with respect to the coordinates.
    turns : sequence of int
        Indices of the rotations of bodies.
    displacement : float or None
        Displacement of the released body, kept by a holding force [m]; None: no holding force.
    near : Shape or None
        Start of the iteration: a shape under the same loads; None: loads and displacement are
        raised together from the straight shape.

    Raises
    ------
    EquilibriumError
        If the load steps do not reach a shape.
    """
    held = displacement is not None
    target = displacement if displacement is not None else 0.0
    if near is None:
        q, mu, force, begin = np.zeros(equations.n), np.zeros(int(equations.active.sum())), 0.0, 0.0
    else:
        q, mu, force, begin = near.q, near.mu, near.force, float(row @ near.q)
    state = np.concatenate([q, mu, [force] if held else []])
    done, step = 0.0, LOAD_STEP_START if near is None else 1.0
    while done < 1.0:
        goal = min(1.0, done + step)
        equations.scale_loads(goal if near is None else 1.0)
        place = begin + goal * (target - begin) if held else None
        found = _newton(equations, row, turns, state, place)
        far = found is not None and np.abs((found - state)[: equations.n]).max() > STATE_CHANGE_MAX
        if found is not None and not far:
            state, done, step = found, goal, 2 * step
            continue
        step /= 2
        if step < LOAD_STEP_MIN:
            equations.scale_loads(1.0)
            raise EquilibriumError(
                f"the finite elements found no equilibrium beyond {done:.3g} of the load"
                + (f" and of the displacement {target:g} m" if held else "")
                + ": reduce them, or stiffen the flexures"
            )
    equations.scale_loads(1.0)
    r = equations.n + len(mu)
    return Shape(state[: equations.n], state[equations.n : r], float(state[r]) if held else 0.0)


def _newton(
    equations: Equations, row: Real, turns: Sequence[int], start: Real, displacement: float | None
) -> Real | None:
    """Solve f + C mu + r F = 0, Phi = 0, r q = displacement; None without convergence."""
    n, active, state = equations.n, equations.active, start.copy()
    column = row[:, None] if displacement is not None else np.zeros((n, 0))
    for _ in range(NEWTON_STEPS_MAX):
        q = state[:n]
        K, C = equations.tangents(q)
        B = np.hstack([C[:, active], column])
        openings = equations.constraint_values(q)
        if displacement is not None:
            openings = np.append(openings, row @ q - displacement)
        right = np.concatenate([equations.forces(q) + B @ state[n:], -openings])
        K = K + equations.bend(q, state[n : n + int(active.sum())], turns)
        matrix = np.block([[K, -B], [B.T, np.zeros((B.shape[1],) * 2)]])
        change = _solved(matrix, right)
        if change is None or np.abs(change[:n]).max() > NEWTON_STEP_MAX:
            return None
        state = state + change
        if np.abs(change[:n]).max() <= NEWTON_STEP_ATOL:
            return state
    return None


def _solved(matrix: Real, right: Real) -> Real | None:
    """Return the solution of linear equations; None if it is not finite.

    A body that hangs in joints has no stiffness before it is loaded.  The matrix is singular then,
    and the solution of least norm is returned.
    """
    try:
        x: Real = splu(csc_array(matrix)).solve(right)
    except RuntimeError:  # The matrix is singular.
        x = np.array(np.linalg.lstsq(matrix, right, rcond=SINGULAR_RTOL)[0], float)
    return x if np.all(np.isfinite(x)) else None


def modes(equations: Equations, shape: Shape) -> Modes:
    """Return all modes about a static shape, mass-normalised, tangent to the constraints.

    The holding force of the shape remains as a constant load.
    """
    K = equations.stiffness(shape.q) + equations.constraint_stiffness(shape.q, shape.mu)
    Z = null_space(equations.constraint_columns(shape.q).T)
    _, reduced = eigh(Z.T @ ((K + K.T) / 2) @ Z, Z.T @ equations.M @ Z)
    phi = Z @ reduced
    # Rayleigh's quotient: the rounding errors of the eigenvalues scale with the highest one.
    omega2 = np.einsum("ij,ij->j", phi, K @ phi)
    return Modes(np.sign(omega2) * np.sqrt(np.abs(omega2)) / (2 * np.pi), phi, equations.M)
