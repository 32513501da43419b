"""Mirror images and repeated copies of points, and the names of copies.

Coordinates are affine in parameters, and so are their images.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..base.errors import MechanismError
from ..mechanics.system import unit
from ..mechanism.expressions import Affine, Quantity, affine
from ..mechanism.parts import Point
from .units import quantity

WORDS = {"x": ("left right",), "y": ("upper lower", "top bottom")}
"""Pairs of words that a mirror line, x = ... or y = ..., exchanges in names."""
SAME_RTOL = 1e-9  # Coefficients of equal points may differ by this share of the largest one,
SAME_ATOL = 1e-12  # or by this number: round-off [m].
_LINE = re.compile(r"\s*([xy])\s*=(.*)", re.DOTALL)


@dataclass(frozen=True)
class Image:
    """A mirror image, or a displaced or rotated copy: the map z -> matrix z + shift.

    Parameters
    ----------
    columns : pair of complex
        Images of the unit vectors along x and y.
    shift : pair of Affine
        Image of the origin [m].
    suffix : str
        Suffix of the name of a copy.
    exchanged : mapping
        Words that the image exchanges in names; with one of them a name gets no suffix.
    turn : float
        Rotation of a copy that is no mirror image [deg].
    """

    columns: tuple[complex, complex]
    shift: tuple[Affine, Affine]
    suffix: str
    exchanged: Mapping[str, str] = field(default_factory=dict)
    turn: float = 0.0

    def direction(self, degrees: float) -> float:
        """Return the image of a direction, counter-clockwise from +x, within half a turn [deg].

        Examples
        --------
        >>> Line.read("x = 0").image.direction(30.0), rotated(2, 90.0, (0.0, 0.0)).direction(180.0)
        (150.0, -90.0)
        """
        if not self.exchanged:
            return math.remainder(degrees + self.turn, 360.0)
        return math.remainder((180.0 if self.columns[0] == -1.0 else 0.0) - degrees, 360.0)

    def point(self, point: Point) -> Point:
        """Return the image of a point [m]."""
        x, y = map(affine, point)
        along = zip(("real", "imag"), self.shift, strict=True)
        image = (
            x.scaled(getattr(self.columns[0], part))
            .plus(y.scaled(getattr(self.columns[1], part)))
            .plus(shift)
            for part, shift in along
        )
        a, b = map(written, image)
        return a, b

    def words(self, name: str) -> str:
        """Return a name with its words exchanged."""
        if not self.exchanged:
            return name
        pattern = rf"(?<![A-Za-z])({'|'.join(self.exchanged)})(?![A-Za-z])"
        return re.sub(pattern, lambda word: self.exchanged[word[0]], name)

    def name(self, name: str) -> str:
        """Return the name of the copy of a part.

        Examples
        --------
        >>> line = Line.read("x = 3 mm").image
        >>> line.name("upper_left"), line.name("leaf")
        ('upper_right', 'leaf_mirrored_x')
        """
        exchanged = self.words(name)
        return name + self.suffix if exchanged == name else exchanged


@dataclass(frozen=True)
class Line:
    """A line of symmetry, x = at or y = at."""

    axis: str
    at: Quantity

    @classmethod
    def read(cls, text: object) -> "Line":
        """Read a line of symmetry, for instance ``x = shuttle.width/2``.

        Raises
        ------
        MechanismError
            If the text is no such equation.
        """
        found = _LINE.fullmatch(text) if isinstance(text, str) else None
        if found is None:
            raise MechanismError('write the line of symmetry, "x = 0" or "y = 40 mm"')
        try:
            return cls(found[1], quantity(found[2], "m"))
        except MechanismError as error:  # There are no numbers outside the quotes.
            raise MechanismError(str(error).partition(", or a number in m without")[0]) from None

    @property
    def image(self) -> Image:
        """The mirror image."""
        twice, zero = affine(self.at).scaled(2.0), Affine()
        pairs = (pair.split() for pair in WORDS[self.axis])
        exchanged = {a: b for one, other in pairs for a, b in ((one, other), (other, one))}
        suffix = f"_mirrored_{self.axis}"
        if self.axis == "x":
            return Image((-1.0, 1j), (twice, zero), suffix, exchanged)
        return Image((1.0, -1j), (zero, twice), suffix, exchanged)


def displaced(k: int, step: Point) -> Image:
    """Return the copy number k of a part in a row, counted from 1 for the original."""
    x, y = (affine(c).scaled(k - 1.0) for c in step)
    return Image((1.0, 1j), (x, y), f"_{k}")


def rotated(k: int, angle: float, about: Point) -> Image:
    """Return the copy number k of a part on a circle, counted from 1 for the original.

    Parameters
    ----------
    k : int
        Number of the copy.
    angle : float
        Angle between two copies, counter-clockwise [deg].
    about : Point
        Centre of the circle [m].
    """
    degrees = math.fmod((k - 1) * angle, 360.0)
    turn = unit(degrees)
    linear = Image((turn, 1j * turn), (Affine(), Affine()), f"_{k}")
    centre, image = (tuple(map(affine, point)) for point in (about, linear.point(about)))
    x, y = (a.plus(b.scaled(-1.0)) for a, b in zip(centre, image, strict=True))
    return Image(linear.columns, (x, y), linear.suffix, turn=degrees)


def written(expression: Affine) -> Quantity:
    """Return an expression as a number or a text.

    Examples
    --------
    >>> written(affine("a - 2*b/2 - 3")), written(affine("a - a + 3"))
    ('a - b - 3.0', 3.0)
    """
    terms = [(c, name) for name, c in expression.terms.items() if c]
    if not terms:
        return expression.constant + 0.0  # without the sign of zero
    text = " ".join(
        f"{'-' if c < 0.0 else '+'} {name if abs(c) == 1.0 else f'{abs(c)!r}*{name}'}"
        for c, name in terms
    )
    constant = expression.constant
    if constant:
        text += f" {'-' if constant < 0.0 else '+'} {abs(constant)!r}"
    return text.removeprefix("+ ")


def same(one: Point, other: Point) -> bool:
    """Return whether two points are equal for all values of the parameters."""
    pairs = [(affine(a), affine(b)) for a, b in zip(one, other, strict=True)]
    terms = [
        (p.terms.get(name, 0.0), q.terms.get(name, 0.0))
        for p, q in pairs
        for name in {*p.terms, *q.terms}
    ]
    return _equal(terms) and _equal([(p.constant, q.constant) for p, q in pairs])


def _equal(pairs: Sequence[tuple[float, float]]) -> bool:
    """Return whether the numbers of each pair are equal except for round-off."""
    scale = max((abs(c) for pair in pairs for c in pair), default=0.0)
    return all(abs(a - b) <= SAME_RTOL * scale + SAME_ATOL for a, b in pairs)
