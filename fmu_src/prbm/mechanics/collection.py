"""Collection of the parts of a mechanism: coordinates, directions, masses, springs and loops."""

import math
from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..base.errors import MechanismError, ParameterError
from ..base.tolerances import JOINT_DISTANCE_RTOL, SPRING_APART_RTOL
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.parts import GROUND, Body, Flexure, Guide, Joint, Point, Spring, body_of, value
from .arrays import Real
from .direction_map import DirectionMap
from .free_body import Connection, FreeBody
from .places import BodyFrame, Place
from .system import FIXED

ROD_POINTS = (0.5 - 0.5 / math.sqrt(3), 0.5 + 0.5 / math.sqrt(3))
"""Places of the two equal point masses of a uniform rod, in units of its length [-]."""


class GuideRow(NamedTuple):
    """A row Re(f (A E + z)) + c of a guide, with the place z + A E.

    Parameters
    ----------
    name : str
        Name of the guide.
    place : Place
        A and z [m].
    c : float
        Constant [m].
    carrier : int or None
        Direction of the body that carries the line, f = conj(E); None: the ground, f = 1 and no z.
    floats : bool
        Whether only bodies without flexures and joints to the ground, and the ground, move it.
    """

    name: str
    place: Place
    c: float
    carrier: int | None
    floats: bool


class Collection:
    """The parts of a mechanism that have been added, from the ground to each connected body.

    Parameters
    ----------
    mechanism : Mechanism
        Description.
    values : mapping
        Values of all parameters.
    """

    def __init__(self, mechanism: Mechanism, values: Mapping[str, float]) -> None:
        self.mechanism = mechanism
        self.values = values
        self.q0: list[float] = []
        self.rest: list[float] = []  # Coordinates at which no spring has a force.
        self.changes: list[dict[int, float]] = []  # The rows of Phi, one per direction.
        self.arm: list[int] = []
        self.J: list[float] = []
        self.masses: list[tuple[Place, float]] = []
        self.springs: list[tuple[float, int | None, int | None]] = []
        self.loops: list[tuple[str, Place]] = []
        self.guide_rows: list[GuideRow] = []
        self.origin: dict[str, Place] = {GROUND: Place()}
        self.drawn: dict[str, complex] = {GROUND: 0j}
        self.depth = {GROUND: 0}  # Flexures and joints between each body and the ground.
        self.root = {GROUND: GROUND}  # What floats, or the ground, at the begin of these parts.
        self.index: dict[str, int | None] = {GROUND: None}  # Directions of the bodies.
        self.links: list[int] = []
        self.floats: list[int] = []  # Arms that float.
        self.floating: list[int] = []  # Coordinates of the bodies on them.
        self.placed: list[int] = []  # Those of bodies that springs do not hold, either.
        self.link_count = 0
        self.owners: list[str] = []
        self.lines: list[tuple[str, str, list[Place], Real]] = []
        self.connections: list[Connection] = []
        self.body_masses: dict[str, int] = {}

    # -- values and places --

    def number(self, quantity: float | str) -> float:
        """Return the value of a quantity."""
        return affine(quantity)(self.values)

    def at(self, point: Point) -> complex:
        """Return the drawn position of a point [m]."""
        return complex(self.number(point[0]), self.number(point[1]))

    def end(self, part: Flexure | Joint | Spring | Guide, reference: str) -> complex:
        """Return the drawn position of an end of a part [m]."""
        return self.at(self.mechanism.point(reference, part.name))

    def length(self, flexure: Flexure) -> float:
        """Return the length of a flexure as drawn [m]."""
        return abs(self.end(flexure, flexure.end) - self.end(flexure, flexure.start))

    def check_apart(self, spring: Spring) -> None:
        """Reject a spring whose ends are drawn at the same place: it has no direction.

        Raises
        ------
        ParameterError
            If the ends coincide.
        """
        apart = abs(self.end(spring, spring.end) - self.end(spring, spring.start))
        if not apart > SPRING_APART_RTOL * self.size:
            raise ParameterError(
                f"spring {spring.name} from {spring.start} to {spring.end} has the length "
                f"{apart:.4g} m, so that its direction is undefined: draw its ends apart"
            )

    def line(self, guide: Guide) -> complex:
        """Return the direction of the line of a guide as drawn, a unit vector.

        Raises
        ------
        ParameterError
            If the points of the line coincide, or the guided point is not on it.
        """
        start, end = self.end(guide, guide.start), self.end(guide, guide.end)
        length = abs(end - start)
        if not length > SPRING_APART_RTOL * self.size:
            raise ParameterError(
                f"guide {guide.name} from {guide.start} to {guide.end} has the length "
                f"{length:.4g} m, so that its direction is undefined: draw these points apart"
            )
        along = (end - start) / length
        apart = ((self.end(guide, guide.point) - start) * along.conjugate()).imag
        if not abs(apart) <= JOINT_DISTANCE_RTOL * self.size:
            side = "left" if apart > 0.0 else "right"
            raise ParameterError(
                f"guide {guide.name}: {guide.point} is drawn {abs(apart):.4g} m to the {side} of "
                f"the line from {guide.start} to {guide.end}; draw it on the line"
            )
        return along

    @cached_property
    def size(self) -> float:
        """Size of the mechanism as drawn [m].

        It is the largest distance between any two ground points or centres of mass, or the length
        of the longest flexure if that is larger.  Without flexures, hit points count, too; if all
        points coincide, the size is the largest radius of gyration.
        """
        drawn = [self.at(p) for p in self.mechanism.ground.values()]
        drawn += [self.at(body.centre) for body in self.mechanism.bodies]
        lengths = [self.length(flexure) for flexure in self.mechanism.flexures]
        if not lengths:
            drawn += [self.at(stop.point) for stop in self.mechanism.stops]
        points = np.array(drawn)
        size = max(*lengths, *(float(np.abs(points - p).max()) for p in points), 0.0)
        return size or max(self.gyration(body) for body in self.mechanism.bodies)

    def gyration(self, body: Body) -> float:
        """Return the radius of gyration of a body about its centre of mass [m]."""
        mass, inertia = (value(body, name, self.values) for name in ("mass", "inertia"))
        return math.sqrt(inertia / mass)

    def on(self, body: str, drawn: complex) -> Place:
        """Return the place of a drawn point of a body."""
        return self.origin[body].plus(self.index[body], drawn - self.drawn[body])

    def frame(self, name: str, body: str, point: Point | None) -> BodyFrame:
        """Return the position of a point of a body (default: its centre of mass)."""
        if point is None:
            point = next(b for b in self.mechanism.bodies if b.name == body).centre
        drawn = self.at(point)
        place, arm = self.on(body, drawn), self.index[body]
        j = self.angle(arm)
        row = place.row(len(self.arm))
        if j is None or arm is None:
            return BodyFrame(name, FIXED, FIXED, place.c, row, drawn)
        return BodyFrame(name, j, arm, place.c, row, drawn)

    # -- additions --

    def coordinate(self, owner: str, start: float = 0.0) -> int:
        """Add a coordinate of a part and return its index."""
        self.q0.append(start)
        self.rest.append(start)
        self.owners.append(owner)
        return len(self.q0) - 1

    def angle_of_flexure(self, owner: str, start: float = 0.0) -> int:
        """Add a coordinate that is an angle of a flexure, and return its index."""
        self.links.append(self.coordinate(owner, start))
        return self.links[-1]

    def direction(self, changes: dict[int, float], arm: int | None = None) -> int:
        """Add the angle of an arm, or the stretch of the given arm, and return its index.

        Parameters
        ----------
        changes : dict of int to float
            Changes of the direction with the coordinates [-].
        arm : int or None
            Arm that the direction stretches or displaces; None: a new arm, which it turns.
        """
        j = len(self.arm)
        self.changes.append(changes)
        self.arm.append(j if arm is None else arm)
        self.J.append(0.0)
        return j

    def turn(self, owner: str) -> int:
        """Add the arm of a body, whose angle is a coordinate, and return its direction."""
        return self.direction({self.coordinate(owner): 1.0})

    def set_free(self, body: str) -> None:
        """Add a body without flexures or joints to the ground: its displacements, its rotation."""
        drawn = self.at(next(b for b in self.mechanism.bodies if b.name == body).centre)
        shifts = self.coordinate(body), self.coordinate(body)
        arm, size = self.direction({}), self.size
        for j in shifts:
            self.direction({j: size}, arm=arm)
        turn = self.turn(body)
        self.reach(body, Place(drawn, {arm: 1.0 + 0.0j}), drawn, turn)
        self.depth[body], self.root[body] = 0, body
        self.floats.append(arm)
        place = [*shifts, *self.changes[turn]]
        self.floating += place
        if body in self.mechanism.free_bodies:
            self.placed += place

    def angle(self, j: int | None) -> int | None:
        """Return the coordinate that is a direction of a body or a link; None: the ground."""
        return None if j is None else next(iter(self.changes[j]))

    def reach(self, body: str, place: Place, drawn: complex, j: int | None) -> None:
        """Register the place of a drawn point of a body that turns with a direction."""
        self.origin[body], self.drawn[body], self.index[body] = place, drawn, j

    def connect(self, near: str, far: str, known: bool, flexure: FreeBody | None = None) -> None:
        """Register a flexure or a joint; known: it has just closed a loop."""
        loop = len(self.loops) - 1 if known else None
        self.depth.setdefault(far, self.depth[near] + 1)
        self.root.setdefault(far, self.root[near])
        self.connections.append(Connection(near, far, loop, flexure))

    def span(self, spring: Spring) -> Place:
        """Return the vector from the start to the end of a spring."""
        self.check_apart(spring)
        start, end = (
            self.on(body_of(end), self.end(spring, end)) for end in (spring.start, spring.end)
        )
        return end.minus(start)

    def close(self, name: str, place: Place, other: Place) -> None:
        """Close a loop: require that two places coincide."""
        self.loops.append((name, place.minus(other)))

    def guide(self, guide: Guide) -> None:
        """Add the rows of a guide, seen from the carrier of its line.

        Raises
        ------
        MechanismError
            If both bodies fly freely and no flexures and joints connect them: where they are placed
            would have to satisfy the guide.
        ParameterError
            As :meth:`line`.
        """
        separate = self.root[guide.body] != self.root[guide.on]
        if separate and guide.body in self.mechanism.free_bodies:
            raise MechanismError(
                f"guide {guide.name} guides {guide.body} along {guide.on}, and both fly freely: "
                "connect one of them to the ground by a flexure, joint, spring or guide"
            )
        normal, carrier = 1j * self.line(guide), guide.on
        at = self.end(guide, guide.point)
        apart = self.on(guide.body, at).minus(self.origin[carrier])
        self._guide_row(guide, normal, apart, at - self.drawn[carrier])
        turn = self.index[guide.body]
        if not guide.turning and turn is not None:
            arm = Place(0j, {turn: complex(self.size)})
            self._guide_row(guide, 1j, arm, complex(self.size))

    def _guide_row(self, guide: Guide, normal: complex, apart: Place, drawn: complex) -> None:
        """Add the change of a vector along a normal, both in the frame of the carrier."""
        along, carrier = normal.conjugate(), self.index[guide.on]
        place = Place(along * apart.c, {j: along * vector for j, vector in apart.A.items()})
        c = -(along * drawn).real + (place.c.real if carrier is None else 0.0)
        self.guide_rows.append(GuideRow(guide.name, place, c, carrier, self._floats(guide)))

    def _floats(self, guide: Guide) -> bool:
        """Return whether only the ground and bodies without flexures and joints to it take part."""
        return all(self.depth[body] == 0 for body in (guide.body, guide.on))

    def spring(self, rate: float, a: int | None, b: int | None) -> None:
        """Add a spring between two coordinates; None: the ground."""
        self.springs.append((rate, a, b))

    def rod(self, mass: float, start: Place, j: int | None, vector: complex) -> None:
        """Add a uniform rod: two equal point masses with its centre and moment of inertia."""
        for fraction in ROD_POINTS:
            self.mass(start.plus(j, fraction * vector), mass / 2)

    def mass(self, place: Place, mass: float) -> None:
        """Add a point mass, unless it is part of the ground."""
        if mass > 0.0 and place.A:
            self.masses.append((place, mass))

    # -- arrays --

    def map(self) -> DirectionMap:
        """Return the map from coordinates to directions."""
        Phi = np.zeros((len(self.changes), len(self.q0)))
        for row, changes in zip(Phi, self.changes, strict=True):
            for j, change in changes.items():
                row[j] = change
        return DirectionMap(Phi)

    def stiffness(self) -> Real:
        """Return the matrix K of all springs, (n, n) [N m/rad], [N m]."""
        n = len(self.q0)
        K = np.zeros((n, n))
        for rate, a, b in self.springs:
            s = np.zeros(n)
            if a is not None:
                s[a] -= 1.0
            if b is not None:
                s[b] += 1.0
            K += rate * np.outer(s, s)
        return K
