r"""A beam whose bending moment is a polynomial: angles, positions, masses and stiffness.

The bending moment of a uniform beam of the length L is a sum of Legendre polynomials P_k(x), with
x = 2 s/L - 1 at the arc length s:

    M(s) = EI/L (q_end - q_start + sum_k a_k P_k(x)),      k = 1 ... n.

The curvature M/EI gives the rotation of the section from its direction in the drawing,

    theta(s) = (1 - S_0) q_start + S_0 q_end + sum_k a_k S_k(x),    S_k(x) = integral of P_k ds / L,

with the rotations q_start and q_end of both ends.  The coefficients a_k are angles.  P_k are
orthogonal, so that the bending energy is diagonal, and S_k vanishes at both ends for k >= 1:

    EI/(2 L) ((q_end - q_start)^2 + sum_k a_k^2/(2 k + 1)).

Positions are r(s) = r_start + integral of exp(i theta) ds, with theta at Gauss points, the *nodes*:
the direction between them is interpolated.  The mass is distributed to the nodes with the weights
of Gauss' quadrature; the rotary inertia of the sections is neglected.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from .arrays import Real


def integrals(order: int, x: Real) -> Real:
    """Return the integrals of the Legendre polynomials from -1 to x, divided by 2.

    Parameters
    ----------
    order : int
        Highest order of the polynomials.
    x : (m,)
        Points, from -1 to 1.

    Returns
    -------
    (m, order + 1)
        S_0 = (1 + x)/2, and S_k = (P_(k+1) - P_(k-1))/(2 (2 k + 1)).

    Examples
    --------
    >>> integrals(1, np.array([-1.0, 0.0, 1.0])).tolist()
    [[0.0, 0.0], [0.5, -0.25], [1.0, 0.0]]
    """
    P = legvander(x, order + 1)
    result = np.empty((len(x), order + 1))
    result[:, 0] = 0.5 * (1.0 + x)
    for k in range(1, order + 1):
        result[:, k] = 0.5 * (P[:, k + 1] - P[:, k - 1]) / (2 * k + 1)
    return result


@dataclass(frozen=True)
class Beam:
    """A uniform beam.

    Parameters
    ----------
    order : int
        Order n of the polynomial of the bending moment.
    nodes : int
        Number N of nodes.
    L, EI, mass : float
        Length [m], bending stiffness [N m^2] and mass [kg].
    EA : float
        Axial stiffness [N]; 0 for an inextensible beam.

    Examples
    --------
    The coefficients do not rotate the ends, and a beam at rest is straight:

    >>> beam = Beam(order=2, nodes=4, L=0.5, EI=3.0, mass=0.1)
    >>> beam.positions(np.array([1.0])).sum(axis=1).round(12).tolist()
    [0.5]
    >>> beam.rates.round(12).tolist()
    [6.0, 2.0, 1.2]
    """

    order: int
    nodes: int
    L: float
    EI: float
    mass: float
    EA: float = 0.0

    @cached_property
    def _quadrature(self) -> tuple[Real, Real]:
        """Nodes x, from -1 to 1, and their weights, with the sum 2."""
        x, weights = leggauss(self.nodes)
        return x, weights

    @property
    def turns(self) -> Real:
        """Rotations of the nodes with the end angles and the coefficients, (N, n + 2) [-]."""
        S = integrals(self.order, self._quadrature[0])
        return np.column_stack([1.0 - S[:, 0], S])

    @property
    def moments(self) -> Real:
        """Values of the polynomials of the bending moment at the nodes, (N, n + 1) [-]."""
        result: Real = np.asarray(legvander(self._quadrature[0], self.order), float)
        return result

    @property
    def places(self) -> Real:
        """Arc lengths of the nodes from the start, (N,) [m]."""
        return 0.5 * self.L * (1.0 + self._quadrature[0])

    @property
    def masses(self) -> Real:
        """Masses of the nodes, (N,) [kg]."""
        return self._quadrature[1] * (self.mass / 2)

    @property
    def rates(self) -> Real:
        """Rates of the rotation between the ends and of the coefficients, (n + 1,) [N m/rad]."""
        return self.EI / self.L / (2.0 * np.arange(self.order + 1.0) + 1.0)

    @property
    def axial_rate(self) -> float:
        """Rate of the stretch, EA L [N m]; 0 if the beam is inextensible."""
        return self.EA * self.L

    def positions(self, x: Real) -> Real:
        """Return the integrals of the interpolated directions from the start to points.

        Parameters
        ----------
        x : (m,)
            Points, from -1 at the start to 1 at the end.

        Returns
        -------
        (m, N)
            Lengths A [m]: the position relative to the start is A E with the directions E of the
            nodes.
        """
        nodes, weights = self._quadrature
        P = legvander(nodes, self.nodes - 1) * weights[:, None]
        factors = 2.0 * np.arange(self.nodes) + 1.0
        result: Real = (0.5 * self.L) * (integrals(self.nodes - 1, x) * factors) @ P.T
        return result

    @property
    def node_positions(self) -> Real:
        """The lengths A for the nodes, (N, N) [m]."""
        return self.positions(self._quadrature[0])
