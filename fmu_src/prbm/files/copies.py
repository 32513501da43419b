"""Mirror images and repeated copies of bodies and of parts that connect points as ordinary parts.

A copy is attached to the image of the body to which the original is attached, or to the same body
if there is no image.  The points of the copy are created unless they are defined.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from typing import Any, Protocol, TypeVar

import numpy as np

from ..base.errors import MechanismError
from ..mechanism.expressions import Affine, affine
from ..mechanism.fields import FIELDS
from ..mechanism.parts import (
    GROUND,
    POSITIONS,
    VELOCITIES,
    Body,
    Flexure,
    FlexureType,
    Force,
    Friction,
    Guide,
    Joint,
    Point,
    Probe,
    Spring,
    Stop,
)
from .images import SAME_ATOL, SAME_RTOL, Image, Line, displaced, rotated, same, written

POINTS = ("point", "start", "end")  # Fields of connections that are points.
COPIES_MAX = 10_000  # Copies in one file.
SIGNED = tuple(name for name in ("curvature", "rise") if name in FIELDS[FlexureType])
SUBJECT_WORDS = 2  # The subject of a message is among its first words: flexure NAME.

_NAME = re.compile(r"[\w\[\]]+(?:\.[\w\[\]]+)*")

Chain = tuple[Image, ...]
Connection = TypeVar("Connection", Flexure, Joint, Spring, Guide, Probe)
Attached = TypeVar("Attached", Stop, Friction, Force)
REVERSED = ("offset", "normal_stiffness")  # Fields whose sign a mirror image changes.


class Repeat(Protocol):
    """Table of equal parts in a row (step) or on a circle (angle, about)."""

    @property
    def count(self) -> int:
        """Number of equal parts."""

    @property
    def step(self) -> Point | None:
        """Displacement from one part to the next [m]."""

    @property
    def angle(self) -> float | None:
        """Rotation from one part to the next [deg]."""

    @property
    def about(self) -> Point:
        """Centre of the rotation [m]."""


class Copied(Protocol):
    """Table of a part with copies."""

    @property
    def name(self) -> str:
        """Name of the original."""

    @property
    def mirror(self) -> Line | tuple[Line, ...]:
        """Lines of symmetry."""

    @property
    def repeat(self) -> Repeat | None:
        """Copies in a row or on a circle."""


def origins(tables: Iterable[Copied]) -> dict[str, str]:
    """Return the names of all copies, with the keys that make them, for instance left.mirror."""
    chains = ((table.name, chain) for table in tables for chain in _chains(table) if chain)
    return {_name(name, chain): f"{name}.{_key(chain)}" for name, chain in chains}


def explained(message: str, made_by: Mapping[str, str]) -> str:
    """Return a message that begins with the key that made a copy, if a copy is its subject.

    Examples
    --------
    >>> explained("flexure right has the length 0 m", {"right": "left.mirror"})
    'left.mirror: flexure right has the length 0 m'
    """
    for subject in _NAME.findall(message)[:SUBJECT_WORDS]:
        for name in (subject, subject.rpartition(".")[0]):
            if name in made_by:
                return f"{made_by[name]}: {message}"
    return message


def check_names(tables: Iterable[Copied], taken: Collection[str], length: int) -> None:
    """Reject copies that are too many, or whose names are taken or too long.

    Parameters
    ----------
    tables : iterable of tables
        All tables of parts with copies.
    taken : collection of str
        Names of other parts.
    length : int
        Largest length of a name.
    """
    known, count = set(taken), 0
    for table in tables:
        for chain in _chains(table):
            name = _name(table.name, chain)
            count += bool(chain)
            if chain and (name in known or len(name) > length):
                problem = "is used twice or reserved" if name in known else "is too long"
                raise MechanismError(
                    f"{table.name}.{_key(chain)}: the name {name!r} of a copy {problem}; rename "
                    f"{table.name} or the other part"
                )
            if count > COPIES_MAX:
                raise MechanismError(
                    f"{table.name}.{_key(chain)}: the file has more than {COPIES_MAX} copies; "
                    "reduce the counts"
                )
            known.add(name)


def copied_bodies(tables: Sequence[Copied], bodies: Sequence[Body]) -> Iterator[Body]:
    """Yield bodies, each followed by its copies.

    Raises
    ------
    MechanismError
        If a copy is at the place of its original.
    """
    for table, body in zip(tables, bodies, strict=True):
        for chain in _chains(table):
            copy = reduce(_body_image, chain, body)
            if chain and same(copy.centre, body.centre):
                raise MechanismError(
                    f"{table.name}.{_key(chain)}: a copy of the body {table.name} is at the same "
                    f"place; remove {_key(chain)}, or change the line or the displacement"
                )
            yield copy


class Drawing:
    """The points of the ground and of all bodies, to which connections add theirs.

    Parameters
    ----------
    ground : mapping
        Points of the ground by name [m].
    bodies : iterable of Body
        All bodies, copies included.
    """

    def __init__(self, ground: Mapping[str, Point], bodies: Iterable[Body]) -> None:
        self._bodies = {body.name: body for body in bodies}
        self._points = {GROUND: dict(ground)}
        self._points |= {name: dict(body.points) for name, body in self._bodies.items()}
        self.made_by: dict[str, str] = {}  # Keys by the reference to a point that they created.
        centres = ([affine(c).constant for c in body.centre] for body in self._bodies.values())
        self._centres = np.array([complex(*centre) for centre in centres])

    @property
    def ground(self) -> dict[str, Point]:
        """Points of the ground by name [m]."""
        return self._points[GROUND]

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The bodies with all their points."""
        return tuple(replace(b, points=self._points[n]) for n, b in self._bodies.items())

    def connections(
        self, tables: Sequence[Copied], parts: Sequence[Connection]
    ) -> Iterator[Connection]:
        """Yield flexures, joints, springs, guides or probes, each followed by its copies.

        Raises
        ------
        MechanismError
            If a copy is at the place of its original, or a point with the name of an image is
            drawn elsewhere.
        """
        for table, part in zip(tables, parts, strict=True):
            for chain in _chains(table):
                if not chain:
                    yield part
                    continue
                user = f"{table.name}.{_key(chain)}"
                own = [key for key in POINTS if hasattr(part, key)]
                ends: dict[str, str] = {
                    key: self._image(getattr(part, key), chain, user) for key in own
                }
                if {*ends.values()} == {getattr(part, key) for key in own}:
                    raise MechanismError(
                        f"{user}: a copy of {table.name} joins the same points; remove "
                        f"{_key(chain)}, or change the line or the displacement"
                    )
                changed: dict[str, Any] = {"name": _name(table.name, chain), **ends}
                if isinstance(part, Joint) and part.free_angle is not None and _mirrored(chain):
                    changed["free_angle"] = written(affine(part.free_angle).scaled(-1.0))
                yield replace(part, **changed)

    def attached(self, tables: Sequence[Copied], parts: Sequence[Attached]) -> Iterator[Attached]:
        """Yield stops, friction points or forces, each followed by its copies.

        Raises
        ------
        MechanismError
            If a copy is at the place of its original.
        """
        for table, part in zip(tables, parts, strict=True):
            for chain in _chains(table):
                copy = reduce(self._attached_image, chain, part)
                if chain and copy == replace(part, name=copy.name):
                    raise MechanismError(
                        f"{table.name}.{_key(chain)}: a copy of {table.name} is at the same place; "
                        f"remove {_key(chain)}, or change the line or the displacement"
                    )
                yield copy

    def _attached_image(self, part: Attached, image: Image) -> Attached:
        """Return the image of a part at a point of a body."""
        body = self._body_image(part.body, image) or part.body
        changed: dict[str, Any] = {"name": image.name(part.name), "body": body}
        if part.point is not None:
            changed["point"] = image.point(part.point)
        if isinstance(part, Stop):
            changed["on"] = self._body_image(part.on, image) or part.on
        if not isinstance(part, Force):
            changed["direction"] = image.direction(part.direction)
        for key in REVERSED:
            if image.exchanged and hasattr(part, key):
                changed[key] = written(affine(getattr(part, key)).scaled(-1.0))
        return replace(part, **changed)

    def _image(self, reference: str, chain: Chain, user: str) -> str:
        """Return the reference to the image of a point; undefined ones are rejected later."""
        owner, _, name = reference.rpartition(".")
        if name not in self._points.get(owner, {}):
            return reference
        point = self._points[owner][name]
        for image in chain:
            moved = image.point(point)
            other = self._body_image(owner, image)
            if other is not None:
                owner, name = other, image.words(name)
            elif not same(moved, point):
                name = image.name(name)
            point = moved
        known = self._points[owner].get(name)
        if known is None:
            self._points[owner][name] = point
            self.made_by[f"{owner}.{name}"] = user
        elif not same(known, point):
            raise MechanismError(
                f"{user}: the image of {reference} is {owner}.{name} = {_text(point)}, but that "
                f"point is drawn at {_text(known)}; move or rename it, or remove it"
            )
        return f"{owner}.{name}"

    def _body_image(self, owner: str, image: Image) -> str | None:
        """Return the name of the body at the image of a body, None without such a body.

        It has the name of the image, or it is the only one with the centre of the image.
        """
        if owner == GROUND:
            return None
        own, other = self._bodies[owner].centre, image.name(owner)
        centre = image.point(own)
        if other in self._bodies and same(self._bodies[other].centre, centre):
            return other
        if same(own, centre):
            return None
        constant = complex(*(affine(c).constant for c in centre))
        most = 2.0 * (SAME_RTOL * abs(constant) + SAME_ATOL)
        near = np.abs(self._centres - constant) <= most
        names = (name for name, close in zip(self._bodies, near, strict=True) if close)
        found = [name for name in names if same(self._bodies[name].centre, centre)]
        return found[0] if len(found) == 1 else None


def mirrored_types(
    tables: Iterable[Copied], flexures: Iterable[Flexure], types: Sequence[FlexureType]
) -> tuple[tuple[Flexure, ...], tuple[FlexureType, ...]]:
    """Return flexures and types, with own types for the mirror images of curved flexures.

    The curvature of a mirror image has the opposite sign.  Its type shares all parameters of the
    type of the original, because its fields are expressions.
    """
    known = {kind.name: kind for kind in types}
    curved = {k.name for k in types if any(getattr(k, f) is not None for f in SIGNED)}
    added: dict[str, FlexureType] = {}
    mirrored = {
        _name(table.name, chain) for table in tables for chain in _chains(table) if _mirrored(chain)
    }
    result = []
    for flexure in flexures:
        if flexure.name in mirrored and flexure.type in curved:
            kind = _mirrored_type(known[flexure.type])
            added[kind.name] = kind
            flexure = replace(flexure, type=kind.name)
        result.append(flexure)
    return tuple(result), (*types, *added.values())


def _mirrored_type(kind: FlexureType) -> FlexureType:
    """Return a type with the parameters of another one, and the opposite curvature."""
    given = {name: getattr(kind, name) for name in FIELDS[FlexureType]}
    shared: dict[str, Any] = {
        name: value if isinstance(value, str) else f"{kind.name}.{name}"
        for name, value in given.items()
        if value is not None
    }
    shared |= {n: written(affine(shared[n]).scaled(-1.0)) for n in SIGNED if n in shared}
    return replace(kind, name=f"{kind.name}_mirrored", **shared)


def _chains(table: Copied) -> Iterator[Chain]:
    """Yield the images that make each copy, the empty chain of the original first."""
    lines = (table.mirror,) if isinstance(table.mirror, Line) else table.mirror
    chains: list[Chain] = [()]
    for line in lines:
        chains += [(*chain, line.image) for chain in chains]
    yield from chains
    for image in _repeated(table):
        yield from ((*chain, image) for chain in chains)


def _repeated(table: Copied) -> Iterator[Image]:
    """Yield the displaced or rotated copies of a part."""
    repeat = table.repeat
    if repeat is None:
        return
    if (repeat.step is None) == (repeat.angle is None):
        given = "neither step nor" if repeat.step is None else "step as well as"
        raise MechanismError(f"{table.name}.repeat has {given} angle: give one of them")
    for k in range(2, repeat.count + 1):
        if repeat.step is not None:
            yield displaced(k, repeat.step)
        elif repeat.angle is not None:
            yield rotated(k, repeat.angle, repeat.about)


def _name(name: str, chain: Chain) -> str:
    """Return the name of a copy."""
    return reduce(lambda text, image: image.name(text), chain, name)


def _mirrored(chain: Chain) -> bool:
    """Return whether a copy turns in the opposite direction."""
    return sum(bool(image.exchanged) for image in chain) % 2 == 1


def _key(chain: Chain) -> str:
    """Return the key that makes a copy."""
    return "mirror" if chain and chain[-1].exchanged else "repeat"


def _start_image(body: Body, image: Image) -> dict[str, Any]:
    """Return the positions and velocities at the start of the image of a body.

    Raises
    ------
    MechanismError
        If a component along an axis depends on one along the other, which is not given.
    """
    result: dict[str, Any] = {}
    for angle, *axes in (POSITIONS, VELOCITIES):
        turn = getattr(body, angle)
        if turn is not None:
            result[angle] = written(affine(turn).scaled(-1.0 if image.exchanged else 1.0))
        for axis, part in zip(axes, ("real", "imag"), strict=True):
            shares = [getattr(column, part) for column in image.columns]
            used = [(name, c) for name, c in zip(axes, shares, strict=True) if c]
            missing = [name for name, _ in used if getattr(body, name) is None]
            if missing and len(missing) < len(used):
                raise MechanismError(
                    f"{body.name}.{missing[0]} is missing: a copy that is turned by other than "
                    f"quarter turns needs {' and '.join(axes)}; add the key"
                )
            if not missing:
                terms = [affine(getattr(body, name)).scaled(c) for name, c in used]
                result[axis] = written(reduce(Affine.plus, terms))
            else:
                result[axis] = None
    return result


def _body_image(body: Body, image: Image) -> Body:
    """Return the image of a body."""
    return replace(
        body,
        name=image.name(body.name),
        centre=image.point(body.centre),
        points={image.words(name): image.point(point) for name, point in body.points.items()},
        outline=tuple(map(image.point, body.outline)),
        holes=tuple(tuple(map(image.point, hole)) for hole in body.holes),
        **_start_image(body, image),
    )


def _text(point: Point) -> str:
    """Return the coordinates of a point for a message."""
    return "[" + ", ".join(c if isinstance(c, str) else f"{c:g} m" for c in point) + "]"
