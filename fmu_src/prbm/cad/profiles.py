"""The kind of a flexure and its dimensions, from a traced part of a plate."""

import itertools
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..mechanics.arrays import Complex, Real
from ..mechanism.flexure import LEAF, NOTCH, TAPER
from .tracing import Trace
from .walls import Walls

UNIFORM_RTOL = 4e-3  # Change of the thickness of a leaf.
FIT_RTOL = 0.01  # Largest distance of a wall from the fitted shape, over its depth or thickness.
BOW_RTOL = 0.02  # Bow of a curved leaf over its thickness,
THIN = 1.25  # Thickness of a thin part over the smallest one.
SHORT = 3.0  # Length of a thin part over its thickness, up to which it has no bow.
BOW_SHARE = 2e-4  # or over its length.
CURVE_RTOL = 0.02  # Largest distance of a curved line from the fitted one, over its bow.
ROUND_RTOL = 0.01  # Difference of the half axes of a circular notch.
WAIST_MIN = 0.05  # Length of the waist of a filleted leaf over the length of its fillets.
BETTER = 0.3  # Distance over that of a simpler shape, from which another one is chosen.
UPRIGHT = 12.0  # Change of the thickness over that of the position, above which walls are upright.
CUT_SHARE = 0.2  # Missing share of the depth of full arcs, above which a notch ends before them.


@dataclass(frozen=True)
class Shape:
    """A flexure as recognised.

    Parameters
    ----------
    profile : str
        Profile of its section: leaf, taper or notch.
    start, end : complex
        Its ends [m].
    dimensions : mapping
        Values of the keys of a flexure type, with thickness [m, or 1/m for the curvature].
    deviation : float
        Largest distance of the walls from this shape over the thickness or, for ``equivalent``,
        the error of the bending about the middle [-].
    equivalent : bool
        Whether it is a leaf with the same stiffness as a part of another shape.
    """

    profile: str
    start: complex
    end: complex
    dimensions: dict[str, float] = field(default_factory=dict)
    deviation: float = 0.0
    equivalent: bool = False

    @property
    def thickness(self) -> float:
        """Thickness of the leaf, at the start of the taper, or of the waist [m]."""
        return self.dimensions["thickness"]


@dataclass(frozen=True)
class Section:
    """Thickness along the axis of a straight part.

    Parameters
    ----------
    origin, along : complex
        Start of the axis [m] and its direction.
    s, width : (n,)
        Positions along the axis and thickness there [m].
    length : float
        Length of the part [m].
    """

    origin: complex
    along: complex
    s: Real
    width: Real
    length: float

    def at(self, s: float) -> complex:
        """Return the point of the axis at a position [m]."""
        return self.origin + s * self.along


def shape_of(walls: Walls, trace: Trace, noise: float) -> Shape | None:
    """Return the kind and the dimensions of a thin part; None if its walls are not opposite.

    Parameters
    ----------
    walls : Walls
        The walls of the plate.
    trace : Trace
        The part.
    noise : float
        Accuracy of coordinates of the drawing [m].
    """
    bow = _bow(trace)
    if bow > max(BOW_RTOL * trace.thinnest, BOW_SHARE * trace.length, 2.0 * noise):
        return _curved(trace, bow, noise)
    section = _section(walls, trace)
    if not (len(section.s) > 1 and section.width.min() > 0.0):
        return None
    tolerance = max(UNIFORM_RTOL * trace.thinnest, 2.0 * noise)
    if np.ptp(section.width) <= tolerance:
        thickness = _mean(section.s, section.width)
        deviation = float(np.abs(section.width - thickness).max()) / thickness
        return Shape(
            LEAF, section.at(0.0), section.at(section.length), {"thickness": thickness}, deviation
        )
    for fitted in (_taper(section, noise), _notch(section, tolerance, noise)):
        if fitted is not None:
            return fitted
    return _equivalent(section)


def _bow(trace: Trace) -> float:
    """Return the bow of the thin part of a line, 0 if this part is short [m]."""
    z = trace.z[trace.width <= THIN * trace.thinnest]
    chord = z[-1] - z[0]
    if abs(chord) < SHORT * trace.thinnest:
        return 0.0
    across = (np.conj(chord) * (z - z[0])).imag
    return float(np.abs(across).max() / abs(chord))


def _mean(s: Real, y: Real) -> float:
    """Return the mean of a function along its positions."""
    return float(np.trapezoid(y, s) / (s[-1] - s[0]))


def _section(walls: Walls, trace: Trace) -> Section:
    """Return the thickness at all corners of both walls, across the axis between the ends."""
    first, last = _ends(trace)
    along = (last - first) / abs(last - first)
    places, offsets = [], []
    for sign, edge in zip((1.0, -1.0), trace.edges(walls), strict=True):
        local = (edge - first) / along
        places.append(local.real)
        offsets.append(sign * local.imag)
    low = max(0.0, *(float(p.min()) for p in places))
    length = abs(last - first)
    high = min(length, *(float(p.max()) for p in places))
    s = np.unique(np.concatenate([*places, [low, high]]))
    s = s[(s >= low) & (s <= high)]
    width = sum(
        np.interp(s, np.maximum.accumulate(p), o) for p, o in zip(places, offsets, strict=True)
    )
    return Section(first, along, s, np.asarray(width), length)


def _ends(trace: Trace) -> tuple[complex, complex]:
    """Return the ends of a part; an oblique end is in the middle of both walls' ends [m]."""
    first = complex(trace.z[0] + 0.5 * trace.late[0] * trace.tangents[0])
    last = complex(trace.z[-1] + 0.5 * trace.late[1] * trace.tangents[1])
    return first, last


# --- straight parts -----------------------------------------------------------------------------


def _taper(section: Section, noise: float) -> Shape | None:
    """Return a taper if the thickness is linear."""
    slope, start = np.polyfit(section.s, section.width, 1)
    error = float(np.abs(start + slope * section.s - section.width).max())
    end = float(start + slope * section.length)
    if error > max(UNIFORM_RTOL * section.width.min(), 2.0 * noise):
        return None
    dimensions = {"thickness": float(start), "end_thickness": end}
    ends = section.at(0.0), section.at(section.length)
    if end < start:
        dimensions, ends = {"thickness": end, "end_thickness": float(start)}, ends[::-1]
    return Shape(TAPER, *ends, dimensions, error / min(start, end))


def _notch(section: Section, tolerance: float, noise: float) -> Shape | None:
    """Return a notch, or a leaf between two fillets; None if the walls are no such arcs."""
    s, width = section.s, section.width
    thickness = float(width.min())
    depth = 0.5 * (float(width.max()) - thickness)
    thin = s[width <= thickness + tolerance]
    low, high = float(thin.min()), float(thin.max())
    best: tuple[float, Shape] | None = None
    for free in (False, True):  # With one radius, then with two half axes.
        for waisted in (True, False):
            found = _fitted(section, (low, high), (thickness, depth), free, waisted, noise)
            better = best is None or (found is not None and found[0] < BETTER * best[0])
            needed = best is None or best[0] > 3.0 * noise
            if found is not None and better and needed:
                best = found
    return None if best is None else best[1]


def _fitted(
    section: Section,
    waist: tuple[float, float],
    depths: tuple[float, float],
    free: bool,
    waisted: bool,
    noise: float,
) -> tuple[float, Shape] | None:
    """Return the largest distance from arcs and the shape; None if it is too far from them."""
    unit = depths[0]  # Of lengths in the fit, which stops at an absolute gradient.
    s, width = (x / unit for x in _not_upright(section))
    length, thickness, depth = section.length / unit, 1.0, depths[1] / unit
    half = 0.5 * (waist[1] - waist[0]) / unit if waisted else 0.0
    centre = 0.5 * (waist[0] + waist[1]) / unit
    a = max(0.5 * length - half, 0.1 * length)
    unknowns = [thickness, centre, a, *([depth] if free else []), *([half] if waisted else [])]

    def residual(x: Real) -> Real:
        """Return the distances of the walls from the arcs, in units of the smaller half axis."""
        t, c, a = x[:3]
        b = x[3] if free else a
        ell = x[-1] if waisted else 0.0
        d = np.maximum(np.abs(s - c) - ell, 0.0) / a
        e = (b - 0.5 * (width - t)) / b
        inner: Real = np.where(e >= 0.0, np.hypot(d, e) - 1.0, d - 1.0 + np.abs(e))
        distances: Real = inner * min(a, b) / depth
        return distances

    lower = [0.0, 0.0, 1e-3 * length, *([0.5 * depth] if free else []), *([0.0] if waisted else [])]
    upper = [
        2 * thickness,
        length,
        50.0 * length,
        *([50.0 * depth] if free else []),
        *([0.5 * length] if waisted else []),
    ]
    start = np.clip(unknowns, np.array(lower) + 1e-9, np.array(upper) - 1e-9)
    fit = least_squares(residual, start, bounds=(lower, upper), x_scale=np.maximum(start, 1e-6))
    t, c, a = (unit * float(x) for x in fit.x[:3])
    b = unit * float(fit.x[3]) if free else a
    ell = 2.0 * unit * float(fit.x[-1]) if waisted else 0.0
    error = float(np.abs(fit.fun).max()) * depths[1]
    if error > max(FIT_RTOL * min(depths[1], 3.0 * t), 3.0 * noise):
        return None
    if waisted and ell < WAIST_MIN * (section.length - ell):
        return None
    return error, _notch_shape(section, t, c, (a, b), ell, error)


def _not_upright(section: Section) -> tuple[Real, Real]:
    """Return positions and thickness without both ends where walls are nearly across the axis."""
    s, width = section.s, section.width
    upright = np.abs(np.diff(width)) > UPRIGHT * np.diff(s)
    middle = int(np.argmin(width))
    first = np.flatnonzero(upright[:middle])
    last = np.flatnonzero(upright[middle:])
    kept = slice(
        int(first[-1]) + 1 if len(first) else 0, middle + int(last[0]) + 1 if len(last) else len(s)
    )
    return s[kept], width[kept]


def _notch_shape(
    section: Section, t: float, c: float, axes: tuple[float, float], waist: float, error: float
) -> Shape:
    """Return the shape of fitted arcs, which end where the part ends if they are cut there."""
    a, b = axes
    if abs(a - b) <= ROUND_RTOL * a:
        a = b = 0.5 * (a + b) if a != b else a
    depth = 0.5 * (float(section.width.max()) - t)
    dimensions = {"thickness": t, "notch_radius": a}
    if a != b:
        dimensions["notch_depth"] = b
    reach = a
    if depth < (1.0 - CUT_SHARE) * b:
        dimensions["end_thickness"] = t + 2.0 * depth
        reach = a * float(np.sqrt(1.0 - (1.0 - depth / b) ** 2))
    if waist:
        dimensions["waist_length"] = waist
    half = 0.5 * waist + reach
    return Shape(NOTCH, section.at(c - half), section.at(c + half), dimensions, error / t)


def _equivalent(section: Section) -> Shape:
    """Return the leaf with the compliance of a part under a moment, and its elastic centre."""
    s, width = section.s, section.width
    s = np.concatenate([np.linspace(a, b, 9)[:-1] for a, b in itertools.pairwise(s)])
    width = np.interp(s, section.s, width)
    thickness = float(width.min())
    share = (thickness / width) ** 3
    length = float(np.trapezoid(share, s))
    centre = float(np.trapezoid(s * share, s)) / length
    spread = float(np.trapezoid((s - centre) ** 2 * share, s))
    deviation = abs(spread / (length**3 / 12.0) - 1.0)
    ends = section.at(centre - 0.5 * length), section.at(centre + 0.5 * length)
    return Shape(LEAF, *ends, {"thickness": thickness}, deviation, equivalent=True)


# --- curved parts -------------------------------------------------------------------------------


def _curved(trace: Trace, bow: float, noise: float) -> Shape:
    """Return an arc or half a period of a cosine, the nearer of both to the centre line."""
    z, chord = trace.z, trace.z[-1] - trace.z[0]
    local = (z - z[0]) / chord * abs(chord)
    ends = _ends(trace)
    uniform = trace.width <= trace.thinnest * (1.0 + 5.0 * UNIFORM_RTOL) + 2.0 * noise
    dimensions = {"thickness": _mean_thickness(trace, uniform)}
    found = [("curvature", *_arc(local)), ("rise", *_wave(local))]
    key, value, error = min(found, key=lambda one: one[2])
    if error > max(CURVE_RTOL * bow, 2.0 * noise):
        return Shape(LEAF, *ends, dimensions, bow / abs(chord), equivalent=True)
    deviation = max(error / bow, float(np.ptp(trace.width)) / trace.thinnest)
    if not uniform.all() and np.ptp(trace.width) > 0.1 * trace.thinnest:
        return Shape(LEAF, *ends, dimensions | {key: value}, deviation, equivalent=True)
    return Shape(LEAF, *ends, dimensions | {key: value}, deviation)


def _mean_thickness(trace: Trace, uniform: NDArray[np.bool_]) -> float:
    """Return the mean thickness of the uniform part of a curved leaf [m]."""
    return float(np.median(trace.width[uniform]))


def _arc(local: Complex) -> tuple[float, float]:
    """Return the curvature of the circle through a line [1/m], and the distance from it [m]."""
    chord = float(local[-1].real)
    line = local / chord  # The fit stops at an absolute gradient.

    def circle(unknown: Real) -> Real:
        """Return the distances of points from the circle through both ends, to the left."""
        curvature = float(unknown[0])
        if abs(curvature) < 1e-9:
            return np.asarray(line.imag)
        radius = 1.0 / curvature
        height = np.sqrt(max(radius**2 - 0.25, 0.0)) * np.sign(radius)
        result: Real = np.sign(radius) * (abs(radius) - np.abs(line - complex(0.5, height)))
        return result

    lowest = float(line.imag[np.argmax(np.abs(line.imag))])
    guess = -8.0 * lowest / (1.0 + 4.0 * lowest**2)
    fit = least_squares(circle, [guess], x_scale=abs(guess) or 1.0)
    return float(fit.x[0]) / chord, float(np.abs(fit.fun).max()) * chord


def _wave(local: Complex) -> tuple[float, float]:
    """Return the rise of half a period of a cosine [m], and the distance of a line from it [m]."""
    chord = float(local[-1].real)
    line = local / chord  # The fit stops at an absolute gradient.

    def wave(unknown: Real) -> Real:
        """Return the distances across the tangents at the ends, which have an angle."""
        turned = line * np.exp(-1j * float(unknown[0]))
        span, rise = float(turned[-1].real), float(turned[-1].imag)
        result: Real = turned.imag - 0.5 * rise * (1.0 - np.cos(np.pi * turned.real / span))
        return result

    slope = line[1:][np.abs(line[1:]) > 0.0]
    guess = float(np.angle(slope[0]))
    fits = [least_squares(wave, [g]) for g in (guess, -2.0 * guess, 0.0)]
    fit = min(fits, key=lambda one: float(one.cost))
    angle = float(fit.x[0])
    return float(-chord * np.sin(angle)), float(np.abs(fit.fun).max()) * chord
