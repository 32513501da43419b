"""Names of the parts of a plate, and which of them are copies, before the file is written."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import shapely

from ..mechanism.flexure import NOTCH, TAPER
from .periodic import Row, rows
from .profiles import Shape
from .recognition import Found, Recognised
from .stops import FoundStop
from .symmetry import Mirror, alike, mirrors

SIDE_RTOL = 1e-6  # Parts nearer than this to a mirror line are on it [share of the size].
WORDS = {"x": ("left", "right"), "y": ("lower", "upper")}


@dataclass
class Kind:
    """A flexure type."""

    name: str
    members: list[int]
    dimensions: dict[str, float] = field(default_factory=dict)

    @property
    def curved(self) -> bool:
        """Whether it has a drawn curvature."""
        return bool({"curvature", "rise"} & self.dimensions.keys())


@dataclass(frozen=True)
class Copied:
    """A part with its copies.

    Parameters
    ----------
    index : int
        Index of the original.
    name : str
        Its name.
    mirrors : tuple of Mirror
        The lines of its copies.
    row : Row or None
        Its copies in a row or on a circle.
    """

    index: int
    name: str
    mirrors: tuple[Mirror, ...] = ()
    row: Row | None = None


@dataclass
class Draft:
    """A recognised plate with names.

    Parameters
    ----------
    found : Recognised
        The bodies and flexures.
    stops : list of FoundStop
        The stops.
    lines : list of Mirror
        Lines of symmetry.
    kinds : list of Kind
        Flexure types.
    bodies, flexures : list of Copied
        The originals in the order of the file.
    names : dict
        Name of each moving body, copies included, by its index.
    """

    found: Recognised
    stops: list[FoundStop]
    lines: list[Mirror] = field(default_factory=list)
    kinds: list[Kind] = field(default_factory=list)
    bodies: list[Copied] = field(default_factory=list)
    flexures: list[Copied] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)

    @property
    def stage(self) -> int:
        """Index of the first moving body, which is released."""
        return next(one.index for one in self.bodies if self.names[one.index].startswith("stage"))

    @staticmethod
    def orbit(original: "Copied") -> set[int]:
        """Return the indices of a flexure and its copies."""
        orbit = {original.index} if original.row is None else {*original.row.members}
        for mirror in original.mirrors:
            orbit |= {mirror.flexures[k] for k in orbit}
        return orbit

    def copy_name(self, original: "Copied", index: int) -> str:
        """Return the name of a flexure or of a copy of it."""
        if original.row is not None:
            number = original.row.members.index(index) + 1
            return original.name if number == 1 else f"{original.name}_{number}"
        places = [
            0.5 * (one.shape.start + one.shape.end)
            for one in (self.found.flexures[original.index], self.found.flexures[index])
        ]
        name = _renamed(original.name, *(_side(self, z) for z in places))
        if name == original.name and index != original.index:
            name += f"_mirrored_{original.mirrors[0].axis}"
        return name

    def kind_of(self, index: int) -> Kind:
        """Return the type of a flexure."""
        return next(kind for kind in self.kinds if index in kind.members)


def draft(found: Recognised, stops: Sequence[FoundStop], *, symmetric: bool = True) -> Draft:
    """Return a plate with names, types and copies.

    Parameters
    ----------
    found : Recognised
        The bodies and flexures.
    stops : sequence of FoundStop
        The stops.
    symmetric : bool
        Whether mirror images are written as copies.
    """
    result = Draft(found, [*stops], mirrors(found) if symmetric else [])
    _orient(found)
    _name_bodies(result)
    _name_flexures(result, rows(found) if symmetric and not result.lines else [])
    _sort_kinds(result)
    return result


def _orient(found: Recognised) -> None:
    """Let flexures begin at the ground, or else at their lower or left end; tapers at the thin."""
    for i, one in enumerate(found.flexures):
        shape = one.shape
        if shape.profile == TAPER:
            continue
        grounded = [body in found.ground for body in one.bodies]
        backwards = shape.end.imag + 1e-3 * shape.end.real < shape.start.imag + (
            1e-3 * shape.start.real
        )
        if grounded[1] or (not grounded[0] and backwards):
            found.flexures[i] = _reversed(one)


def _reversed(one: Found) -> Found:
    """Return a flexure from its end to its start."""
    shape = one.shape
    dimensions = dict(shape.dimensions)
    if "curvature" in dimensions:  # The rise is the same from both ends.
        dimensions["curvature"] = -dimensions["curvature"]
    turned = Shape(
        shape.profile, shape.end, shape.start, dimensions, shape.deviation, shape.equivalent
    )
    return Found(turned, one.trace, one.band, one.bodies[::-1])


# --- names --------------------------------------------------------------------------------------


def _place(polygon: shapely.Polygon | shapely.MultiPolygon) -> complex:
    return complex(polygon.centroid.x, polygon.centroid.y)


def _side(result: Draft, z: complex) -> tuple[str, ...]:
    """Return the words for the place of a part beside the lines of symmetry."""
    words = []
    bounds = result.found.plate.shape.bounds
    near = SIDE_RTOL * (bounds[2] - bounds[0] + bounds[3] - bounds[1]) + 4.0 * result.found.noise
    for mirror in reversed(result.lines):  # upper_left
        distance = (z.real if mirror.axis == "x" else z.imag) - mirror.at
        if abs(distance) > near:
            words.append(WORDS[mirror.axis][distance > 0.0])
    return tuple(words)


def _orbit(index: int, lines: Iterable[Mirror], which: str) -> tuple[set[int], tuple[Mirror, ...]]:
    """Return a part with its images, and the lines that make them."""
    orbit, needed = {index}, list[Mirror]()
    for mirror in lines:
        images = {getattr(mirror, which).get(k, k) for k in orbit}
        if not images <= orbit:
            orbit |= images
            needed.append(mirror)
    return orbit, tuple(needed)


def _first(result: Draft, members: Iterable[int], places: Mapping[int, complex]) -> int:
    """Return the part of an orbit that is lowest, then leftmost."""

    def order(k: int) -> tuple[bool, bool, float, float]:
        """Return first the words of a place, which do not depend on round-off."""
        words = _side(result, places[k])
        return "upper" in words, "right" in words, places[k].imag, places[k].real

    return min(members, key=order)


def _orbits(
    result: Draft, indices: Iterable[int], places: Mapping[int, complex], which: str
) -> list[tuple[int, tuple[Mirror, ...], set[int]]]:
    """Return the originals with their lines and images, from left to right, bottom to top."""
    left, found = [*indices], []
    while left:
        orbit, lines = _orbit(left[0], result.lines, which)
        first = _first(result, orbit, places)
        orbit, lines = _orbit(first, result.lines, which)
        found.append((first, lines, orbit))
        left = [k for k in left if k not in orbit]
    return sorted(found, key=lambda one: (round(places[one[0]].real, 9), places[one[0]].imag))


def _name_bodies(result: Draft) -> None:
    """Name the moving bodies: the stage is the largest one that is no copy."""
    found = result.found
    moving = sorted({k for one in found.flexures for k in one.bodies} - found.ground)
    places = {k: _place(found.bodies[k]) for k in moving}
    orbits = _orbits(result, moving, places, "bodies")
    single = [first for first, lines, _ in orbits if not lines] or [first for first, *_ in orbits]
    stage = max(single, key=lambda k: found.bodies[k].area)
    rest = [one for one in orbits if one[0] != stage]
    own = next(one for one in orbits if one[0] == stage)
    names = _numbered([(_side(result, places[k]) if lines else (), "bar") for k, lines, _ in rest])
    for (first, lines, orbit), name in [
        (own, "_".join((*(_side(result, places[stage]) if own[1] else ()), "stage"))),
        *zip(rest, names, strict=True),
    ]:
        if own[0] == first and lines:
            name = "stage_" + "_".join(_side(result, places[first]))
        result.bodies.append(Copied(first, name, lines))
        for k in orbit:
            result.names[k] = _renamed(name, _side(result, places[first]), _side(result, places[k]))


def _renamed(name: str, before: Sequence[str], after: Sequence[str]) -> str:
    """Return the name of a copy on another side."""
    exchange = {a: b for a, b in zip(before, after, strict=False) if a != b}
    return "_".join(exchange.get(word, word) for word in name.split("_"))


def _numbered(wanted: Sequence[tuple[tuple[str, ...], str]]) -> list[str]:
    """Return names from words and a noun, with numbers if several are equal."""
    joined = ["_".join((*words, noun)) for words, noun in wanted]
    names, count = [], dict.fromkeys(joined, 0)
    for name in joined:
        count[name] += 1
        names.append(f"{name}_{count[name]}" if joined.count(name) > 1 else name)
    return names


def _name_flexures(result: Draft, repeated: Sequence[Row]) -> None:
    """Name the flexures: by their side if there is one kind of place, with a number otherwise."""
    flexures = result.found.flexures
    places = {k: 0.5 * (one.shape.start + one.shape.end) for k, one in enumerate(flexures)}
    row_of = {row.members[0]: row for row in repeated}
    copies = {k for row in repeated for k in row.members[1:]}
    originals = [k for k in places if k not in copies]
    orbits = _orbits(result, originals, places, "flexures")
    wanted = []
    for first, lines, _ in orbits:
        axes = {mirror.axis for mirror in lines}
        words = tuple(
            word
            for word in _side(result, places[first])
            if any(word in WORDS[axis] for axis in axes)
        )
        wanted.append((words, noun(flexures[first].shape)))
    sides = ["_".join(words) for words, _ in wanted]
    unique = all(sides) and len({*sides}) == len(sides)
    names = sides if unique else _numbered(wanted)
    for (first, lines, _), name in zip(orbits, names, strict=True):
        result.flexures.append(Copied(first, name, lines, row_of.get(first)))


def noun(shape: Shape) -> str:
    """Return the word for a kind of flexure."""
    if shape.profile == NOTCH:
        return "notch" if "waist_length" not in shape.dimensions else "leaf"
    return "taper" if shape.profile == TAPER else "leaf"


def _sort_kinds(result: Draft) -> None:
    """Let equal flexures share a type, with the mean of their dimensions."""
    found = result.found
    for one in result.flexures:
        flexure = found.flexures[one.index]
        for kind in result.kinds:
            first = found.flexures[kind.members[0]]
            if alike(flexure, first, found.noise) and _same_sign(flexure.shape, first.shape):
                kind.members.append(one.index)
                break
        else:
            result.kinds.append(Kind("", [one.index]))
    nouns = [noun(found.flexures[kind.members[0]].shape) for kind in result.kinds]
    taken = {one.name for one in result.flexures}
    for kind, word in zip(result.kinds, nouns, strict=True):
        several = nouns.count(word) > 1
        kind.name = f"{word}_type" if word in taken else word
        if several:
            number = 1 + sum(k.name.startswith(f"{word}_kind") for k in result.kinds)
            kind.name = f"{word}_kind_{number}"
        shapes = [found.flexures[k].shape.dimensions for k in kind.members]
        kind.dimensions = {key: sum(d[key] for d in shapes) / len(shapes) for key in shapes[0]}


def _same_sign(one: Shape, other: Shape) -> bool:
    """Return whether two curved leaves are curved to the same side."""
    pairs = ((one.dimensions[key], other.dimensions[key]) for key in one.dimensions)
    return all(a * b > 0.0 for a, b in pairs)
