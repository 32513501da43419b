"""Forces, stiffness, mass and constraints of the finite elements, evaluated by Exudyn."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mechanics.arrays import Real
from .model import ElementModel

RESIDUAL_RTOL = 1e-7  # Residual of a step of a transient, relative to the force of one radian.
DIFFERENCE_STEP = 1e-6  # Step of the differences of the constraint Jacobian [m], [rad].


class Equations:
    """The equations of an assembled model.

    Parameters
    ----------
    model : ElementModel
        The elements.

    Attributes
    ----------
    n : int
        Number of coordinates.
    """

    def __init__(self, model: ElementModel) -> None:
        self.model, self.exu, self.mbs = model, model.exu, model.mbs
        self.solver = self.exu.MainSolverStatic()
        self.solver.InitializeSolver(self.mbs, self.settings())
        self.n = len(self.mbs.systemData.GetODE2Coordinates())
        self._load = 1.0

    def settings(self) -> Any:
        """Return settings of Exudyn's solvers."""
        settings = self.exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.active = False
        settings.staticSolver.verboseMode = 0
        settings.timeIntegration.verboseMode = 0
        # With the initial residual, Exudyn would accept steps that did not converge.
        settings.timeIntegration.newton.adaptInitialResidual = False
        settings.timeIntegration.newton.relativeTolerance = 1e-12
        settings.timeIntegration.newton.absoluteTolerance = RESIDUAL_RTOL * self.model.force
        settings.linearSolver.solverType = self.exu.LinearSolverType.EigenSparse
        return settings

    def _set(self, q: Real) -> None:
        current = self.exu.ConfigurationType.Current
        self.mbs.systemData.SetODE2Coordinates(q.tolist(), current)
        self.mbs.systemData.SetODE2Coordinates_t([0.0] * self.n, current)

    def scale_loads(self, fraction: float) -> None:
        """Set all loads to a fraction of their values."""
        if fraction != self._load:
            for load, name, vector in self.model.loads:
                self.mbs.SetLoadParameter(load, name, [fraction * x for x in vector])
            self._load = fraction

    def forces(self, q: Real) -> Real:
        """Return f: loads less elastic forces without reactions, (n,) [N], [N m]."""
        self._set(q)
        self.solver.ComputeODE2RHS(self.mbs)
        return np.array(self.solver.GetSystemResidual())[: self.n]

    def tangents(self, q: Real) -> tuple[Real, Real]:
        """Return K = -df/dq (n, n) and all columns of C."""
        self._set(q)
        self.solver.ComputeJacobianODE2RHS(self.mbs, -1.0, 0.0, 0.0, 1)
        self.solver.ComputeJacobianAE(self.mbs, 1.0, 0.0, 0.0, False)
        jacobian = np.array(self.solver.GetSystemJacobian())
        return jacobian[: self.n, : self.n], jacobian[: self.n, self.n :]

    def stiffness(self, q: Real) -> Real:
        """Return K = -df/dq, (n, n)."""
        return self.tangents(q)[0]

    def constraint_columns(self, q: Real) -> Real:
        """Return C, the transposed Jacobian of the clamps, pins and joints, (n, r)."""
        return self.tangents(q)[1][:, self.active]

    def constraint_values(self, q: Real) -> Real:
        """Return Phi, the openings of clamps, pins and joints, (r,) [m], [rad]."""
        self._set(q)
        self.solver.ComputeAlgebraicEquations(self.mbs, False)
        return np.array(self.solver.GetSystemResidual())[self.n :][self.active]

    @cached_property
    def active(self) -> NDArray[np.bool_]:
        """Nonzero columns of C, (c,) bool: constraints of stops are inactive and have zeros."""
        active: NDArray[np.bool_] = np.any(self.tangents(np.zeros(self.n))[1] != 0.0, axis=0)
        return active

    @cached_property
    def M(self) -> Real:
        """Mass matrix, (n, n): constant, because the coordinates are absolute and planar."""
        self.solver.ComputeMassMatrix(self.mbs)
        M: Real = np.array(self.solver.GetSystemMassMatrix())[: self.n, : self.n]
        return M

    def constraint_stiffness(self, q: Real, mu: Real) -> Real:
        """Return -d(C mu)/dq, (n, n), which Exudyn's K does not include."""
        touched = np.flatnonzero(np.any(self.constraint_columns(q) != 0.0, axis=1))
        result = self.bend(q, mu, touched.tolist())
        return (result + result.T) / 2

    def bend(self, q: Real, mu: Real, touched: Sequence[int]) -> Real:
        """Return the touched columns of -d(C mu)/dq by central differences, the others zero."""
        result = np.zeros((self.n, self.n))
        for j in touched:
            step = np.zeros(self.n)
            step[j] = DIFFERENCE_STEP
            change = self.constraint_columns(q + step) - self.constraint_columns(q - step)
            result[:, j] = -change @ mu / (2 * DIFFERENCE_STEP)
        return result
