r"""The constant linear map from coordinates to directions, theta = Phi q.

The kinematics are linear in the arms E = exp(s + i theta).  A *direction* is the angle theta or the
stretch s of an arm.  Equations are formed for the d directions; then they are pulled back to the n
coordinates:

    theta' = Phi v,     rows: X Phi,     loads: Phi^T Q,     matrices: Phi^T M Phi.

The directions of bodies and links are coordinates themselves.  If all directions are, Phi is the
identity, and nothing is multiplied.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from .arrays import Complex, Real

Row = TypeVar("Row", Real, Complex)


@dataclass(frozen=True)
class DirectionMap:
    """The map theta = Phi q from coordinates to directions.

    Parameters
    ----------
    Phi : (d, n)
        Changes of the directions with the coordinates [-].

    Examples
    --------
    Two directions that turn with the mean and the difference of two coordinates:

    >>> mean = DirectionMap(np.array([[0.5, 0.5], [1.0, -1.0]]))
    >>> mean.of(np.array([3.0, 1.0])).tolist(), mean.to_coordinates(np.array([1.0, 0.0])).tolist()
    ([2.0, 2.0], [0.5, 0.5])
    """

    Phi: Real

    @cached_property
    def identity(self) -> bool:
        """Whether each direction is the coordinate with its index."""
        d, n = self.Phi.shape
        return d == n and bool(np.array_equal(self.Phi, np.eye(n)))

    @cached_property
    def _transposed(self) -> Real:
        """Phi^T in the order of its own rows, whose products are faster."""
        return self.Phi.T.copy()

    def of(self, q: Real) -> Real:
        """Return the directions, or their rates, (..., d), of coordinates or rates (..., n)."""
        if self.identity:
            return q
        result: Real = q.dot(self._transposed)
        return result

    def to_coordinates(self, x: Row) -> Row:
        """Return the derivatives by coordinates (..., n) of derivatives by directions (..., d)."""
        if self.identity:
            return x
        result: Row = x @ self.Phi
        return result

    def congruence(self, M: Real) -> Real:
        """Return Phi^T M Phi, (n, n), of a matrix M (d, d) of the directions."""
        if self.identity:
            return M
        result: Real = self.Phi.T @ M @ self.Phi
        return result
