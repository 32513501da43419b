r"""A beam whose bending moment is a polynomial: angles, positions, masses and stiffness.

With the flexibility 1/EI of the sections, the bending moment of a beam is

    M = (q_end - q_start + sum_k a_k P_k)/C,      C = integral of ds/EI,      k = 1 ... n.

The polynomials P_k of the position v along the beam are orthogonal under the flexibility; they are
Legendre polynomials if the beam is uniform.  The curvature M/EI gives the rotation of the section
from its direction in the drawing,

    theta = (1 - S_0) q_start + S_0 q_end + sum_k a_k S_k,      S_k = integral of P_k ds/EI / C,

with the rotations q_start and q_end of both ends.  The coefficients a_k are angles.  S_k vanishes
at both ends for k >= 1, and the bending energy is diagonal:

    ((q_end - q_start)^2 + sum_k a_k^2/(2 k + 1))/(2 C).

Positions are r = r_start + integral of exp(i theta) dz, with the drawn line z and theta at Gauss
points of each panel, the *nodes*: exp(i theta) dz/dx is interpolated between them.  The values of
dz/dx at the nodes are changed slightly, so that the integrals of S_0 dz and S_1 dz are exact:

    integral of S_k dz = S_k(end) z(end) - (integral of z P_k ds/EI) / C.

They are the compliances of a straight beam, whose moment is linear under forces at its ends.  In
the peak of the flexibility of a thin notch Gauss' quadrature alone has errors of some percent.  The
mass is distributed to the nodes with the weights of Gauss' quadrature.

If the beam stretches, its axial force is uniform.  The strain of a section is the mean strain times
the axial flexibility 1/EA over its mean.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from ..base.tolerances import FINE_POINTS, SUMMIT_NODES_MIN
from .arrays import Complex, Real
from .profile import Line, Panel, Sections, Straight


@lru_cache
def gauss(points: int) -> tuple[Real, Real]:
    """Return the points and weights of Gauss' quadrature from -1 to 1, as read-only arrays."""
    x, weights = leggauss(points)
    x.setflags(write=False)
    weights.setflags(write=False)
    return x, weights


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


def interpolation(nodes: int, x: Real) -> Real:
    """Return the integrals of the interpolants of values at Gauss points, from -1 to x.

    Parameters
    ----------
    nodes : int
        Number of Gauss points.
    x : (m,)
        Ends of the integrals, from -1 to 1.

    Returns
    -------
    (m, nodes)
    """
    points, weights = gauss(nodes)
    P = legvander(points, nodes - 1) * weights[:, None]
    factors = np.arange(nodes) + 0.5
    result: Real = 2.0 * (integrals(nodes - 1, x) * factors) @ P.T
    return result


def orthogonal(order: int, u: Real, weights: Real) -> Real:
    """Return polynomials that are orthogonal under given weights.

    The recurrence u p_k = b_(k+1) p_(k+1) + a_k p_k + b_k p_(k-1) is that of Stieltjes.

    Parameters
    ----------
    order : int
        Highest order of the polynomials.
    u, weights : (m,)
        Points, and their weights with the sum 1.  Points of the weight 0 have no influence.

    Returns
    -------
    (m, order + 1)
        P_k at the points, with the mean square 1/(2 k + 1), and P_k > 0 for large u.

    Examples
    --------
    Legendre polynomials follow from the weights of Gauss' quadrature:

    >>> x, weights = gauss(4)
    >>> bool(abs(orthogonal(2, x, weights / 2) - legvander(x, 2)).max() < 1e-14)
    True
    """
    result = np.empty((len(u), order + 1))
    before, p, b = np.zeros_like(u), np.ones_like(u), 0.0
    for k in range(order + 1):
        result[:, k] = p / math.sqrt(2 * k + 1)
        a = float(weights @ (u * p * p))
        following = (u - a) * p - b * before
        b = math.sqrt(float(weights @ (following * following)))
        before, p = p, following / b
    return result


@dataclass(frozen=True)
class Material:
    """Young's modulus [Pa] and density [kg/m^3]."""

    youngs_modulus: float
    density: float


class Cuts(NamedTuple):
    """Sections in which a beam is cut: both ends, the nodes, and the waists of notches.

    Parameters
    ----------
    position : (m,)
        Arc lengths from the start of the beam [m].
    rank : (m,)
        Numbers of the nodes from 0, -1 at the start, N at the end; a half between two nodes.
    moments : (m, n + 1)
        The polynomials of the bending moment [-].
    tangent : (m,) complex
        Directions as drawn, in units of the direction of the chord.
    area, modulus : (m,)
        Area [m^2] and section modulus [m^3], at waists divided by the factors of the stress.
    smooth : range
        Nodes between which the stress is smooth: those of the straight panel, or of the waist
        between two fillets; empty for a notch without a waist.
    """

    position: Real
    rank: Real
    moments: Real
    tangent: Complex
    area: Real
    modulus: Real
    smooth: range


@dataclass(frozen=True)
class Beam:
    """A beam.

    Parameters
    ----------
    order : int
        Order n of the polynomial of the bending moment.
    panels : sequence of Panel
        Parts with smooth sections, with N nodes in all.
    line : Line
        The line as drawn.
    material : Material
        Young's modulus and density.

    Examples
    --------
    The coefficients do not rotate the ends, and a beam at rest is straight:

    >>> from prbm.mechanics.profile import Straight
    >>> leaf = Straight(4, 0.0, 0.5, (0.01, 0.01), (0.012, 0.012))
    >>> beam = Beam(2, (leaf,), Line(0.5), Material(3e9, 1e3))
    >>> beam.whole.sum().round(12).tolist()
    (0.5+0j)
    >>> beam.rates.round(12).tolist()
    [6.0, 2.0, 1.2]
    """

    order: int
    panels: Sequence[Panel]
    line: Line
    material: Material

    # -- sections --

    @cached_property
    def _nodes(self) -> tuple[Real, Sections]:
        """Weights of the nodes with the sum 2 in each panel, and their sections."""
        rules = [gauss(panel.nodes) for panel in self.panels]
        sections = [panel.at(x) for panel, (x, _) in zip(self.panels, rules, strict=True)]
        return np.concatenate([w for _, w in rules]), _joined(sections)

    @cached_property
    def _fine(self) -> tuple[Real, Sections]:
        """Weights times the arc length per x [m], and sections, at points between all nodes."""
        x, weights = gauss(FINE_POINTS)
        found, factors = [], []
        for panel in self.panels:
            edges = np.concatenate([[-1.0], gauss(panel.nodes)[0], [1.0]])
            half = 0.5 * np.diff(edges)
            middle = 0.5 * (edges[1:] + edges[:-1])
            found.append(panel.at((middle[:, None] + half[:, None] * x).ravel()))
            factors.append((half[:, None] * weights).ravel())
        sections = _joined(found)
        return np.concatenate(factors) * self._arc(sections), sections

    def _arc(self, sections: Sections) -> Real:
        """Return the arc length per x at sections [m]."""
        result: Real = sections.dv * abs(self.line.tangent(sections.v))
        return result

    def _flexibility(self) -> tuple[Real, float]:
        """Shares of the fine points in the integral of ds/EI, and this integral [rad/(N m)]."""
        ds, sections = self._fine
        shares = ds / (sections.width * sections.thickness**3 / 12)
        total = float(shares.sum())
        return shares / total, total / self.material.youngs_modulus

    # -- bending --

    @cached_property
    def _polynomials(self) -> tuple[Real, Real]:
        """The polynomials of the bending moment at the fine points and at the cuts."""
        shares, _ = self._flexibility()
        v = np.concatenate([self._fine[1].v, self._cut_sections[1].v])
        weights = np.concatenate([shares, np.zeros(len(v) - len(shares))])
        P = orthogonal(self.order, 2.0 * v / self.line.length - 1.0, weights)
        return P[: len(shares)], P[len(shares) :]

    def _up_to_nodes(self, steps: Real) -> Real:
        """Return the sums of steps (Q, k) at the fine points up to the nodes, (N, k)."""
        intervals = steps.reshape(-1, FINE_POINTS, steps.shape[1])
        sums = np.cumsum(intervals.sum(axis=1), axis=0)
        last, at_nodes = 0, []
        for panel in self.panels:  # Each panel has one interval more than nodes.
            at_nodes.append(sums[last : last + panel.nodes])
            last += panel.nodes + 1
        return np.concatenate(at_nodes)

    @cached_property
    def turns(self) -> Real:
        """Rotations of the nodes with the end angles and the coefficients, (N, n + 2) [-]."""
        shares, _ = self._flexibility()
        S = self._up_to_nodes(self._polynomials[0] * shares[:, None])
        return np.column_stack([1.0 - S[:, 0], S])

    @property
    def rates(self) -> Real:
        """Rates of the rotation between the ends and of the coefficients, (n + 1,) [N m/rad]."""
        return 1.0 / (self._flexibility()[1] * (2.0 * np.arange(self.order + 1.0) + 1.0))

    # -- stretch --

    def _axial(self) -> tuple[float, float]:
        """Return the arc length [m], and the integral of ds/EA [m/N]."""
        ds, sections = self._fine
        flexibility = float((ds / (sections.width * sections.thickness)).sum())
        return float(ds.sum()), flexibility / self.material.youngs_modulus

    @property
    def strains(self) -> Real:
        """Strains of the nodes with the mean strain, (N,) [-].

        The sum over the nodes is the elongation.
        """
        sections = self._nodes[1]
        flexibility = 1.0 / (sections.width * sections.thickness)
        return self._axial()[0] * flexibility / float(abs(self.whole) @ flexibility)

    @property
    def axial_rate(self) -> float:
        """Rate of the mean strain [N m]."""
        length, flexibility = self._axial()
        return length**2 / flexibility

    # -- masses and positions --

    @property
    def masses(self) -> Real:
        """Masses of the nodes, (N,) [kg]."""
        weights, sections = self._nodes
        ds = weights * self._arc(sections)
        return self.material.density * sections.width * sections.thickness * ds

    @property
    def radii(self) -> Real:
        """Radii of gyration of the sections at the nodes, (N,) [m]."""
        return 0.5 * self._nodes[1].thickness / math.sqrt(3.0)

    @cached_property
    def _scale(self) -> complex:
        """Factor on the tangents of the line: their unit is the direction of the chord."""
        end = self.line.position(np.array([self.line.length]))
        return complex(self.line.chord / end[0])

    @property
    def _integrals(self) -> Complex:
        """Integrals of dz, S_0 dz and S_1 dz over the beam as drawn, (3,) [m]."""
        shares, _ = self._flexibility()
        z = self.line.position(self._fine[1].v) * self._scale
        by_parts = -(shares * z) @ self._polynomials[0][:, :2]
        by_parts[0] += self.line.chord
        return np.append(self.line.chord, by_parts)

    @cached_property
    def _steps(self) -> Complex:
        """Changes dz/dx at the nodes as drawn, in units of the direction of the chord, (N,) [m].

        They differ from dz/dx by the least change, weighted by |dz|, with which the quadrature of
        dz, S_0 dz and S_1 dz is exact.
        """
        weights, sections = self._nodes
        drawn = sections.dv * self.line.tangent(sections.v) * self._scale
        size = abs(drawn)
        B = np.column_stack([np.ones(len(size)), self.turns[:, 1:3]])
        missing = self._integrals - (weights * drawn) @ B
        change = np.linalg.solve(B.T @ ((weights * size)[:, None] * B), missing)
        result: Complex = drawn + size * (B @ change)
        return result

    @cached_property
    def whole(self) -> Complex:
        """The lengths A for the end, (N,) [m]."""
        return self._nodes[0] * self._steps

    def positions(self, points: Sequence[Real]) -> Complex:
        """Return the integrals of the interpolated directions from the start to points.

        Parameters
        ----------
        points : sequence of (m,)
            Points x of each panel, from -1 to 1.

        Returns
        -------
        (m, N) complex
            Lengths A [m]: the position relative to the start is A E times the direction of the
            chord, with the rotations E of the nodes.
        """
        rows, first = [], 0
        for panel, x in zip(self.panels, points, strict=True):
            last = first + panel.nodes
            row = np.zeros((len(x), len(self.whole)), complex)
            row[:, :first] = self.whole[:first]
            row[:, first:last] = interpolation(panel.nodes, x) * self._steps[first:last]
            rows.append(row)
            first = last
        return np.concatenate(rows)

    def thickness(self, points: Sequence[Real]) -> Real:
        """Return the thickness at points x of each panel [m]."""
        at = zip(self.panels, points, strict=True)
        return np.concatenate([panel.at(x).thickness for panel, x in at])

    @property
    def node_positions(self) -> Complex:
        """The lengths A for the nodes, (N, N) [m]."""
        return self.positions([gauss(panel.nodes)[0] for panel in self.panels])

    # -- cuts --

    @cached_property
    def _cut_sections(self) -> tuple[Real, Sections, Real]:
        """Ranks and sections of the cuts, from the start, and the factors of the stress there."""
        ranks, found = [np.array([-1.0])], [self.panels[0].at(np.array([-1.0]))]
        factors = [np.ones((2, 1))]
        first = 0
        for panel in self.panels:
            nodes, waists = gauss(panel.nodes)[0], np.array(panel.waists)
            rank = np.append(np.arange(panel.nodes), np.searchsorted(nodes, waists) - 0.5)
            order = np.argsort(rank)
            x = np.append(nodes, waists)[order]
            ranks.append(first + rank[order])
            found.append(panel.at(x))
            factors.append(panel.concentrations(x))
            first += panel.nodes
        ranks.append(np.array([float(first)]))
        found.append(self.panels[-1].at(np.array([1.0])))
        factors.append(np.ones((2, 1)))
        return np.concatenate(ranks), _joined(found), np.concatenate(factors, axis=1)

    @property
    def cuts(self) -> Cuts:
        """The sections in which the beam is cut."""
        rank, sections, (pulled, bent) = self._cut_sections
        tangent = self.line.tangent(sections.v) * self._scale
        # A beam with waists is straight: v is the arc length.
        position, ds = sections.v.copy(), self._fine[0]
        position[np.isin(rank, np.arange(len(self.whole)))] = self._up_to_nodes(ds[:, None])[:, 0]
        position[-1] = ds.sum()
        area = sections.width * sections.thickness
        return Cuts(
            position, rank, self._polynomials[1], tangent / abs(tangent), area / pulled,
            area * sections.thickness / 6 / bent, self._smooth(rank),
        )  # fmt: skip

    def _smooth(self, rank: Real) -> range:
        """Return the indices of the cuts at the nodes of the straight panel, by their ranks."""
        first = 0
        for panel in self.panels:
            if isinstance(panel, Straight) and panel.nodes >= SUMMIT_NODES_MIN:
                start = int(np.searchsorted(rank, first))
                return range(start, start + panel.nodes)
            first += panel.nodes
        return range(0)


def _joined(parts: Sequence[Sections]) -> Sections:
    """Return the sections of all panels."""
    return Sections(*(np.concatenate(values) for values in zip(*parts, strict=True)))
