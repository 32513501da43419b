"""Equations that are nearly singular: both engines solve them or reject them, as the other does."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest

from kernel_library import KernelError, kernel
from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import ParameterError, SimulationError
from prbm.base.tolerances import SINGULAR_RTOL
from prbm.files.mechanism_file import read_mechanism
from prbm.hybrid.simulation import Simulation
from prbm.mechanics import constraints
from prbm.mechanism.parts import Release
from support import SUPPORT

PIVOT = read_mechanism(SUPPORT / "pivot.toml")
SYSTEMS = 600
# Condition of a scaled matrix that is accepted, times round-off, times the growth of a few pivots.
ERROR_MAX = 100 * np.finfo(float).eps / SINGULAR_RTOL


def drawn(rng):
    """Return a saddle-point problem (M, rows, right) with a size, in random units.

    The inertias differ by up to 8 orders of magnitude, and one of three things is small by a factor
    10^-k: the last row, its part that is independent of the others, or the mass of a motion.
    """
    n, kind, small = int(rng.integers(2, 8)), rng.integers(3), 10.0 ** -rng.integers(0, 18)
    r = int(rng.integers(1, n))
    mass, length = 10.0 ** rng.uniform(-20, 3), 10.0 ** rng.uniform(-6, 3)
    light = 10.0 ** rng.uniform(-4, 0, n)
    A = rng.normal(size=(n, n + 1))
    if kind == 0:
        A[:, :2] *= np.sqrt(small)
    rows = length * rng.normal(size=(r, n))
    if kind == 1:
        rows[-1] = rng.normal(size=r - 1) @ rows[:-1] + small * rows[-1]
    if kind == 2:
        rows[-1] *= small
    M = mass * length**2 * np.outer(light, light) * (A @ A.T)
    return M, rows, rng.normal(size=n + r) * np.append(M.diagonal(), rows.max(axis=1)), length


def solved(M, rows, right, length):
    """Return the solutions of both engines; None for one that rejects the problem."""
    n, r = len(M), len(rows)
    kkt, x = constraints.saddle(M, rows, rows), right.copy()
    try:
        ours = constraints.solve(kkt, right, n, length)
    except SimulationError:
        ours = None
    try:
        kernel().solve(n, r, np.ascontiguousarray(kkt), x, length)
    except KernelError:
        x = None
    return ours, x


def test_a_solution_is_right_or_an_error_in_both_engines():
    """The exact solution is computed with 80 digits."""
    rng, accepted = np.random.default_rng(0), 0
    for _ in range(SYSTEMS):
        M, rows, right, length = drawn(rng)
        kkt, n = constraints.saddle(M, rows, rows), len(M)
        found = solved(M, rows, right, length)
        assert (found[0] is None) == (found[1] is None)
        if found[0] is None:
            continue
        accepted += 1
        with mpmath.workdps(80):
            exact = mpmath.lu_solve(mpmath.matrix(kkt.tolist()), mpmath.matrix(right.tolist()))
        unit = constraints.scales(kkt, n, length)
        expected = np.array([float(x) for x in exact]) / unit
        for x in found:
            assert np.abs(x / unit - expected).max() <= ERROR_MAX * np.abs(expected).max()
    assert SYSTEMS / 4 < accepted < SYSTEMS


def velocity_of(simulation, distance, speed):
    """Return the angular velocity of a wheel with its centre that far from the pivot, or None."""
    geometry = tuple(
        replace(p, value=distance) if p.name == "eccentricity" else p for p in PIVOT.geometry
    )
    model = replace(PIVOT, geometry=geometry, release=Release("wheel", 90.0, velocity=speed))
    try:
        return simulation(model).outputs()["wheel.omega"]
    except (ParameterError, KernelMistake) as error:
        reason = str(error)
    assert "cannot move" in reason
    return None


@pytest.mark.parametrize("exponent", [-16, -13, -11, -10, -9, -8, -6, -3])
def test_a_point_near_the_pivot_has_a_velocity_or_none(exponent):
    """The body turns with u/h if a point at the distance h from the pivot has the velocity u.

    The least share of the mobility that is accepted is 1e-12, that of a distance of 1e-6 of the
    size.
    """
    distance, speed = 3.0 * 10.0**exponent, 1e-3
    found = [velocity_of(one, distance, speed) for one in (Simulation, KernelSimulation)]
    assert (found[0] is None) == (found[1] is None)
    if found[0] is None:
        assert distance < 1e-7
    else:
        assert found == pytest.approx([speed / distance] * 2, rel=1e-6)
