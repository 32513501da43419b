"""The section and the drawn shape of a beam along its length, in panels.

A *panel* is a part of a beam in which the section is smooth.  Its points have a coordinate x from
-1 to 1.  Their positions v are measured along the beam or, with a rise, along its end tangents.

A leaf and a taper have one panel.  A notch has the panels ::

    thick part, notch, thick part                              (circular, elliptic)
    thick part, fillet, waist, fillet, thick part              (filleted)

Notches and fillets are arcs of ellipses with the half axes a along the flexure and b across it.  At
the angle beta from the waist of the thickness t the thickness is

    h = t + 4 b sin^2(beta/2),      v = v_waist + a sin(beta),      beta = c w sinh(tau).

The flexibility 1/h^3 has a sharp peak at beta = 0, with poles at beta = +-i w, where h = 0.  Gauss
points in tau are dense in the peak, so that few nodes are enough, however thin the waist is.  The
factor c was chosen for the least error of the position of the end.

At a waist the stress exceeds that of the theory of beams.  The factors are those of deep hyperbolic
notches [1] with the same waist and the radius of curvature a^2/b there.

Sources
-------
.. [1] H. Neuber, Kerbspannungslehre, Springer, Berlin 1937.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..base.errors import ParameterError
from ..base.tolerances import (
    CONCENTRATION_SERIES_MAX,
    NOTCH_LENGTH_RTOL,
    NOTCH_PEAK_FACTOR,
    WAIST_ATOL,
)
from ..mechanism.flexure import FILLET_NODES, THICK_NODES
from .arrays import Complex, Real


class Sections(NamedTuple):
    """Sections at points: position v and dv/dx, thickness and width [m]."""

    v: Real
    dv: Real
    thickness: Real
    width: Real


def concentration(thickness: float, radius: float) -> tuple[float, float]:
    """Return the factors of the stress at a waist, under a normal force and under a moment [-].

    They refer to the stress of a beam with the section of the waist.

    Parameters
    ----------
    thickness : float
        Thickness of the waist [m].
    radius : float
        Radius of curvature of the notch at its waist [m].

    Examples
    --------
    >>> [round(factor, 3) for factor in concentration(1e-3, 2e-3)]
    [1.158, 1.095]
    """
    x = 0.5 * thickness / radius
    root = math.sqrt(x)
    angle = math.atan(root)
    pulled = 2.0 * (x + 1.0) * root / ((x + 1.0) * angle + root)
    if x < CONCENTRATION_SERIES_MAX:
        return pulled, 1.0 + 2.0 * x / 5
    return pulled, 4.0 * x * root / (3.0 * (root + (x - 1.0) * angle))


@dataclass(frozen=True)
class Straight:
    """A panel whose thickness and width vary linearly.

    Parameters
    ----------
    nodes : int
        Number of nodes.
    start, length : float
        Position of its start and its length [m].
    thickness, width : pair of float
        Thickness and width at its start and its end [m].

    Examples
    --------
    >>> Straight(3, 0.1, 0.2, (1e-3, 3e-3), (0.01, 0.01)).at(np.array([0.0])).thickness.tolist()
    [0.002]
    """

    nodes: int
    start: float
    length: float
    thickness: tuple[float, float]
    width: tuple[float, float]

    @property
    def waists(self) -> tuple[float, ...]:
        """Points x of waists: none."""
        return ()

    def concentrations(self, x: Real) -> Real:
        """Return the factors of the stress at points x (m,), as for :class:`Round`, (2, m) [-]."""
        return np.ones((2, len(x)))

    def at(self, x: Real) -> Sections:
        """Return the sections at points x (m,)."""
        part = 0.5 * (1.0 + x)
        (h, h_end), (b, b_end) = self.thickness, self.width
        return Sections(
            self.start + self.length * part,
            np.full(len(x), 0.5 * self.length),
            h + (h_end - h) * part,
            b + (b_end - b) * part,
        )


@dataclass(frozen=True)
class Round:
    """A panel that is an arc of an ellipse: a notch, or a fillet.

    Parameters
    ----------
    nodes : int
        Number of nodes.
    waist : float
        Position of the waist [m].
    axes : pair of float
        Half axes along the flexure and across it [m].
    thickness, width : float
        Thickness of the waist, and width [m].
    angles : pair of float
        Angles beta at its start and its end [rad].

    Examples
    --------
    A circular notch with the radius 4 mm and the waist 1 mm:

    >>> notch = Round(6, 0.01, (4e-3, 4e-3), 1e-3, 0.01, (-math.pi / 2, math.pi / 2))
    >>> notch.at(np.array([0.0, 1.0])).thickness.round(12).tolist()
    [0.001, 0.009]
    """

    nodes: int
    waist: float
    axes: tuple[float, float]
    thickness: float
    width: float
    angles: tuple[float, float]

    @property
    def waists(self) -> tuple[float, ...]:
        """The point x of the waist, unless it is a node."""
        x = self._waist
        return () if x == 0.0 and self.nodes % 2 == 1 else (x,)

    @property
    def _waist(self) -> float:
        """The point x of the waist."""
        _, first, last = self._range
        return -(first + last) / (last - first)

    def concentrations(self, x: Real) -> Real:
        """Return the factors of the stress at points x (m,), (2, m) [-].

        They are 1 except at the waist.  The first row is for a normal force, the second for a
        moment.
        """
        a, b = self.axes
        factors = np.array(concentration(self.thickness, a**2 / b))[:, None]
        at_waist = np.abs(x - self._waist) < WAIST_ATOL
        result: Real = np.where(at_waist, factors, 1.0)
        return result

    @property
    def _range(self) -> tuple[float, float, float]:
        """The factor c w, and tau at the start and at the end."""
        pole = 2.0 * math.asinh(math.sqrt(self.thickness / (4.0 * self.axes[1])))
        scale = NOTCH_PEAK_FACTOR * pole
        first, last = (math.asinh(angle / scale) for angle in self.angles)
        return scale, first, last

    def at(self, x: Real) -> Sections:
        """Return the sections at points x (m,)."""
        (a, b), (scale, first, last) = self.axes, self._range
        tau = first + 0.5 * (last - first) * (1.0 + x)
        beta = scale * np.sinh(tau)
        return Sections(
            self.waist + a * np.sin(beta),
            a * np.cos(beta) * scale * np.cosh(tau) * 0.5 * (last - first),
            self.thickness + 4.0 * b * np.sin(0.5 * beta) ** 2,
            np.full(len(x), self.width),
        )


Panel = Straight | Round


@dataclass(frozen=True)
class Notch:
    """Dimensions of a notch [m].

    Parameters
    ----------
    thickness, width : float
        Thickness of the waist, and width.
    axes : pair of float
        Half axes of the notch or its fillets, along the flexure and across it.
    end_thickness : float
        Thickness outside the notch.
    waist_length : float or None
        Length of the uniform waist between two fillets; None: no waist and no fillets.
    """

    thickness: float
    width: float
    axes: tuple[float, float]
    end_thickness: float
    waist_length: float | None

    @property
    def angle(self) -> float:
        """The largest angle beta, at the edges of the notch [rad]."""
        depth = 0.5 * (self.end_thickness - self.thickness)
        return math.acos(max(1.0 - depth / self.axes[1], 0.0))

    @property
    def length(self) -> float:
        """Length of the notch along the flexure [m]."""
        return 2.0 * self.axes[0] * math.sin(self.angle) + (self.waist_length or 0.0)


def notch_panels(name: str, notch: Notch, L: float, nodes: int) -> Sequence[Panel]:
    """Return the panels of a notch in the middle of a flexure.

    Parameters
    ----------
    name : str
        Name of the flexure, for messages.
    notch : Notch
        The notch.
    L : float
        Length of the flexure [m].
    nodes : int
        Number of nodes of the notch or, with fillets, of its waist.

    Raises
    ------
    ParameterError
        If the thickness outside the notch is not above that of its waist, or if the notch is longer
        than the flexure.
    """
    h, H, width = notch.thickness, notch.end_thickness, (notch.width, notch.width)
    if not h < H:
        raise ParameterError(
            f"flexure {name}: the thickness outside its notch, {H:g} m, must be above the "
            f"thickness of its waist, {h:g} m: increase end_thickness"
        )
    if not notch.length <= L * (1.0 + NOTCH_LENGTH_RTOL):
        raise ParameterError(
            f"flexure {name}: its notch of the length {notch.length:g} m is longer than the "
            f"flexure, {L:g} m: reduce notch_radius or waist_length, or move the ends apart"
        )
    rest, angle = max(0.5 * (L - notch.length), 0.0), notch.angle
    first = Straight(THICK_NODES, 0.0, rest, (H, H), width)
    last = Straight(THICK_NODES, L - rest, rest, (H, H), width)
    if notch.waist_length is None:
        arc = Round(nodes, 0.5 * L, notch.axes, h, notch.width, (-angle, angle))
        return first, arc, last
    start, end = 0.5 * (L - notch.waist_length), 0.5 * (L + notch.waist_length)
    return (
        first,
        Round(FILLET_NODES, start, notch.axes, h, notch.width, (-angle, 0.0)),
        Straight(nodes, start, notch.waist_length, (h, h), width),
        Round(FILLET_NODES, end, notch.axes, h, notch.width, (0.0, angle)),
        last,
    )


@dataclass(frozen=True)
class Line:
    """The line of a beam as drawn, from its start to its end.

    Parameters
    ----------
    chord : float
        Distance of its ends [m].
    curvature : float
        Curvature of a circular arc, positive if it turns counter-clockwise [1/m].
    rise : float
        Distance of the tangents at both ends, which are parallel, positive to the left [m].  The
        line is half a period of a cosine.

    Examples
    --------
    A quarter of a circle of the radius 1 m:

    >>> round(Line(math.sqrt(2.0), curvature=1.0).length - math.pi / 2, 12)
    0.0
    """

    chord: float
    curvature: float = 0.0
    rise: float = 0.0

    @property
    def length(self) -> float:
        """Range of the positions v [m]: the arc length, or that along the end tangents."""
        half = 0.5 * self.curvature * self.chord
        if half:
            return self.chord * math.asin(half) / half
        return math.sqrt(self.chord**2 - self.rise**2)

    def tangent(self, v: Real) -> Complex:
        """Return dz/dv at positions v (m,), turned by the same angle everywhere [-]."""
        L = self.length
        if self.curvature:
            arc: Complex = np.exp(1j * self.curvature * (v - 0.5 * L))
            return arc
        steepest = 0.5 * math.pi * self.rise / L
        wave: Complex = 1.0 + 1j * steepest * np.sin(math.pi / L * v)
        return wave

    def position(self, v: Real) -> Complex:
        """Return the integral of the tangent from the start to positions v, (m,) [m].

        Examples
        --------
        >>> Line(5.0, rise=3.0).position(np.array([0.0, 4.0])).round(12).tolist()
        [0j, (4+3j)]
        """
        L = self.length
        if self.curvature:
            half = 0.5 * self.curvature * v
            arc: Complex = np.sin(half) / (0.5 * self.curvature) * np.exp(1j * (half - self._half))
            return arc
        wave: Complex = v + 1j * self.rise * np.sin(0.5 * math.pi / L * v) ** 2
        return wave

    @property
    def _half(self) -> float:
        """Half of the angle of the arc [rad]."""
        return 0.5 * self.curvature * self.length
