r"""From a mechanism and parameter values to the constant arrays of the equations of motion.

Every position is z = c + A e with e = exp(i q) and constant c, A.  Every scalar that the engine
constrains, watches or reports (loop closures, gaps, displacements) is therefore of one form,

    s = Re(B e) + c,      ds/dq = Re(i B e),      d2s/dq2 = -diag(Re(B e)),

so that a stack of rows B serves them all.
"""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .errors import MechanismError, ParameterError
from .flexure import Segments, segments, stub
from .mechanism import (
    GROUND,
    Flexure,
    FlexureType,
    Mechanism,
    Point,
    Stop,
    affine,
    body_of,
    value,
)

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Place:
    """A point of the mechanism, z = c + A e.

    Parameters
    ----------
    c : complex
        Fixed part [m].
    A : dict of int to complex
        Vectors that turn with the coordinates [m].
    """

    c: complex = 0j
    A: Mapping[int, complex] = field(default_factory=dict)

    def plus(self, j: int | None, vector: complex) -> "Place":
        """Return the place at the end of a vector fixed to coordinate j (None: the ground)."""
        if j is None:
            return Place(self.c + vector, self.A)
        return Place(self.c, {**self.A, j: self.A.get(j, 0j) + vector})

    def row(self, n: int) -> Complex:
        """Return A as a row of n columns."""
        row = np.zeros(n, complex)
        for j, vector in self.A.items():
            row[j] = vector
        return row


@dataclass(frozen=True)
class BodyFrame:
    """Where a body is: its coordinate and its centre of mass, z = c + A e."""

    name: str
    j: int
    c: complex
    A: Complex
    drawn: complex


@dataclass(frozen=True)
class Outline:
    """A line to draw: the places of its corners, z = c + A e."""

    name: str
    kind: str
    c: Complex
    A: Complex


@dataclass(frozen=True)
class System:
    """The constant arrays of a mechanism for given parameters: n coordinates, r loop rows.

    Parameters
    ----------
    q0 : (n,)
        Absolute angles of the straight shape, counter-clockwise from +x [rad].
    H : (n, n) complex
        A^H diag(m) A, Hermitian [kg m^2].
    J : (n,)
        Rotary inertia of each coordinate about the mass centres of its parts [kg m^2].
    K : (n, n)
        Torsion springs: elastic energy (q - q0)^T K (q - q0) / 2 [N m/rad].
    A, c, m : (p, n) complex, (p,) complex, (p,)
        Mass points z = c + A e [m] and their masses [kg].
    loops, loops_c : (r, n) complex, (r,)
        Loop closures Phi = Re(loops e) + loops_c [m].
    gaps, gaps_c : (s, n) complex, (s,)
        Gaps of the stops, without the wall's position: gap = wall + Re(gaps e) + gaps_c [m].
    slides : (s, n) complex
        Displacement of the hit points along their walls, to the left of the direction [m].
    rubs, lifts, lifts_c : (f, n) complex, (f, n) complex, (f,)
        Displacement along and to the left of the direction of each friction point [m].
    release, release_c : (n,) complex, float
        Displacement of the released body along the direction of the release [m].
    bodies : dict of BodyFrame
        The bodies by name.
    links : tuple of int
        The coordinates of the flexures' links, in the order of their names link[1], ...
    outlines : tuple of Outline
        What to draw.
    anchor : complex
        The first clamp, about which moments on the base are taken [m].
    length : float
        Size of the mechanism, scale of all lengths [m].
    """

    mechanism: Mechanism
    values: Mapping[str, float]
    q0: Real
    H: Complex
    J: Real
    K: Real
    A: Complex
    c: Complex
    m: Real
    loops: Complex
    loops_c: Real
    gaps: Complex
    gaps_c: Real
    slides: Complex
    rubs: Complex
    lifts: Complex
    lifts_c: Real
    release: Complex
    release_c: float
    bodies: Mapping[str, BodyFrame]
    links: tuple[int, ...]
    outlines: tuple[Outline, ...]
    anchor: complex
    length: float

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.q0)

    @property
    def S(self) -> Complex:
        """First mass moments m^T A, (n,) complex [kg m]."""
        result: Complex = self.m @ self.A
        return result

    @property
    def gravity(self) -> complex:
        """Acceleration of gravity as a complex number [m/s^2]."""
        return complex(self.values["gravity.x"], self.values["gravity.y"])


def assemble(mechanism: Mechanism, values: Mapping[str, float]) -> System:
    """Build the constant arrays of a mechanism.

    Every flexure becomes a chain of links.  Chains are rooted at ground or at a body already
    reached; a flexure between two bodies already reached is rooted at its start and closes a
    loop at its end.

    Parameters
    ----------
    mechanism : Mechanism
        Description.
    values : mapping
        All its parameters, as :meth:`Mechanism.values` gives them.

    Raises
    ------
    MechanismError
        If a body is not held by any flexure, or a loop closes over nothing.
    ParameterError
        If a flexure has no length, or its links are longer than itself.
    """
    return _Assembler(mechanism, values).system()


class _Assembler:
    """Collects coordinates, masses, springs and loops while it walks from the ground."""

    def __init__(self, mechanism: Mechanism, values: Mapping[str, float]) -> None:
        self.mechanism = mechanism
        self.values = values
        self.q0: list[float] = []
        self.J: list[float] = []
        self.masses: list[tuple[Place, float]] = []
        self.springs: list[tuple[float, int | None, int | None]] = []
        self.loops: list[Place] = []
        self.origin: dict[str, Place] = {GROUND: Place()}
        self.drawn: dict[str, complex] = {GROUND: 0j}
        self.index: dict[str, int | None] = {GROUND: None}
        self.links: list[int] = []
        self.lines: list[tuple[str, str, list[Place]]] = []

    # -- values and places --

    def number(self, quantity: float | str) -> float:
        return affine(quantity)(self.values)

    def at(self, point: Point) -> complex:
        return complex(self.number(point[0]), self.number(point[1]))

    def coordinate(self, angle: float) -> int:
        self.q0.append(angle)
        self.J.append(0.0)
        return len(self.q0) - 1

    def on(self, body: str, drawn: complex) -> Place:
        """Return the place of a drawn point of a body."""
        return self.origin[body].plus(self.index[body], drawn - self.drawn[body])

    # -- walking --

    def system(self) -> System:
        waiting = list(self.mechanism.flexures)
        while waiting:
            for flexure in waiting:
                if body_of(flexure.start) in self.origin or body_of(flexure.end) in self.origin:
                    break
            else:
                names = ", ".join(f.name for f in waiting)
                raise MechanismError(
                    f"the flexures {names} have no connection to the ground: the mechanism "
                    "falls apart"
                )
            waiting.remove(flexure)
            self.flexure(flexure)
        for body in self.mechanism.bodies:
            if body.name not in self.origin:
                raise MechanismError(f"the body {body.name} is not held by any flexure")
            self.body(body.name)
        return self.arrays()

    def body(self, name: str) -> None:
        body = next(b for b in self.mechanism.bodies if b.name == name)
        centre = self.on(name, self.at(body.centre))
        self.mass(centre, value(body, "mass", self.values))
        j = self.index[name]
        assert j is not None
        self.J[j] += value(body, "inertia", self.values)

    def flexure(self, flexure: Flexure) -> None:
        start, end = flexure.start, flexure.end
        pieces = self.segments(flexure)
        if body_of(start) not in self.origin:
            start, end = end, start
            pieces = Segments(*(tuple(reversed(part)) for part in vars(pieces).values()))
        root, far = body_of(start), body_of(end)
        z_start = self.at(self.mechanism.point(start, flexure.name))
        z_end = self.at(self.mechanism.point(end, flexure.name))
        direction = (z_end - z_start) / abs(z_end - z_start)

        place, owner = self.on(root, z_start), self.index[root]
        corners = [place]
        links = [self.coordinate(cmath.phase(direction)) for _ in pieces.lengths[1:-1]]
        self.links += links
        if far not in self.origin:
            far_index: int | None = self.coordinate(0.0)
        else:
            far_index = self.index[far]
        owners = [owner, *links, far_index]
        for i, (length, j) in enumerate(zip(pieces.lengths[:-1], owners[:-1], strict=True)):
            # links carry their angle in q, bodies are drawn with q = 0
            vector = length * (1.0 if j in links else direction)
            self.rod(pieces.rods[i], place, j, vector)
            place = place.plus(j, vector)
            corners.append(place)
            self.mass(place, pieces.lumps[i])
            self.springs.append((pieces.rates[i], owners[i], owners[i + 1]))
        last = pieces.lengths[-1] * direction
        if far not in self.origin:
            assert far_index is not None
            self.index[far] = far_index
            self.drawn[far] = z_end - last
            self.origin[far] = place
        else:
            pivot = self.on(far, z_end - last)
            gap = place
            for j, vector in pivot.A.items():
                gap = gap.plus(j, -vector)
            self.loops.append(Place(gap.c - pivot.c, gap.A))
            place = pivot  # the stub moves with its body: links and body share no mass
        self.rod(pieces.rods[-1], place, far_index, last)
        corners.append(self.on(far, z_end))
        self.lines.append((flexure.name, "flexure", corners))

    def rod(self, mass: float, start: Place, j: int | None, vector: complex) -> None:
        """Add a slender rod that is fixed to coordinate j (None: the ground)."""
        self.mass(start.plus(j, vector / 2), mass)
        if j is not None:
            self.J[j] += mass * abs(vector) ** 2 / 12

    def mass(self, place: Place, mass: float) -> None:
        """Add a point mass, unless it is part of the ground."""
        if mass > 0.0 and place.A:
            self.masses.append((place, mass))

    def segments(self, flexure: Flexure) -> Segments:
        kind = next(k for k in self.mechanism.flexure_types if k.name == flexure.type)
        z_start = self.at(self.mechanism.point(flexure.start, flexure.name))
        z_end = self.at(self.mechanism.point(flexure.end, flexure.name))
        L = abs(z_end - z_start)
        if L < 1e-9:
            raise ParameterError(
                f"flexure {flexure.name} from {flexure.start} to {flexure.end} has the length "
                f"{L:g} m: move its ends apart"
            )
        fields = ("thickness", "width", "youngs_modulus", "density")
        h, b, E, rho = (value(kind, name, self.values) for name in fields)
        gamma, K_theta = coefficients(self.mechanism, kind, self.values)
        model = self.mechanism.model(kind)
        EI, mass = E * b * h**3 / 12, rho * b * h * L
        return segments(model, gamma, K_theta, flexure.ends, L, EI, mass)

    # -- arrays --

    def arrays(self) -> System:
        n = len(self.q0)
        A = np.array([place.row(n) for place, _ in self.masses])
        m = np.array([mass for _, mass in self.masses])
        K = np.zeros((n, n))
        for rate, a, b in self.springs:
            s = np.zeros(n)
            if a is not None:
                s[a] -= 1.0
            if b is not None:
                s[b] += 1.0
            K += rate * np.outer(s, s)
        e0 = np.exp(1j * np.array(self.q0))
        loops = np.array([r for p in self.loops for r in (p.row(n), -1j * p.row(n))])
        loops_c = np.array([x for p in self.loops for x in (p.c.real, p.c.imag)])
        loops = loops.reshape(-1, n)
        check_loops(loops, e0)
        check_masses((e0.conj()[:, None] * (A.conj().T @ (m[:, None] * A)) * e0).real, self.J)

        frames = {}
        for body in self.mechanism.bodies:
            drawn = self.at(body.centre)
            place = self.on(body.name, drawn)
            j = self.index[body.name]
            assert j is not None
            frames[body.name] = BodyFrame(body.name, j, place.c, place.row(n), drawn)
            self.lines.append((body.name, "body", self.corners(body.name)))
        hits = [(stop, self.hit(stop)) for stop in self.mechanism.stops]
        d = [unit(s.direction) for s, _ in hits]
        gaps, gaps_c = rows([along(-u, p, e0) for u, (_, p) in zip(d, hits, strict=True)], n)
        slides, _ = rows([along(1j * u, p, e0) for u, (_, p) in zip(d, hits, strict=True)], n)
        for stop, place in hits:
            self.lines.append((stop.name, "stop", [place]))
        rubbed = [
            (unit(f.direction), self.on(f.body, frames[f.body].drawn))
            for f in self.mechanism.frictions
        ]
        rubs, _ = rows([along(u, p, e0) for u, p in rubbed], n)
        lifts, lifts_c = rows([along(1j * u, p, e0) for u, p in rubbed], n)
        held = self.mechanism.release.body
        release, release_c = along(
            unit(self.mechanism.release.direction), self.on(held, frames[held].drawn), e0
        )
        points = [self.at(p) for p in self.mechanism.ground.values()]
        points += [frame.drawn for frame in frames.values()]
        return System(
            mechanism=self.mechanism,
            values=dict(self.values),
            q0=np.array(self.q0),
            H=A.conj().T @ (m[:, None] * A),
            J=np.array(self.J),
            K=K,
            A=A,
            c=np.array([place.c for place, _ in self.masses]),
            m=m,
            loops=loops,
            loops_c=loops_c,
            gaps=gaps,
            gaps_c=gaps_c,
            slides=slides,
            rubs=rubs,
            lifts=lifts,
            lifts_c=lifts_c,
            release=release,
            release_c=release_c,
            bodies=frames,
            links=tuple(self.links),
            outlines=tuple(
                Outline(
                    name,
                    kind,
                    np.array([p.c for p in places]),
                    np.array([p.row(n) for p in places]),
                )
                for name, kind, places in self.lines
            ),
            anchor=self.anchor(),
            length=max(abs(a - b) for a in points for b in points),
        )

    def hit(self, stop: Stop) -> Place:
        shift = value(stop, "offset", self.values) * 1j * unit(stop.direction)
        return self.on(stop.body, self.at(stop.point) + shift)

    def corners(self, name: str) -> list[Place]:
        body = next(b for b in self.mechanism.bodies if b.name == name)
        return [self.on(name, self.at(point)) for point in body.points.values()]

    def anchor(self) -> complex:
        for flexure in self.mechanism.flexures:
            for end in (flexure.start, flexure.end):
                if body_of(end) == GROUND:
                    return self.at(self.mechanism.point(end, flexure.name))
        return 0j


def coefficients(
    mechanism: Mechanism, kind: FlexureType, values: Mapping[str, float]
) -> tuple[list[float], list[float]]:
    """Return the values of a flexure type's gammas and stiffness coefficients [-]."""
    model = mechanism.model(kind)

    def number(name: str) -> float:
        quantity = kind.coefficients.get(name, 0.0)
        if isinstance(quantity, str):
            return affine(quantity)(values)
        return values[f"{kind.name}.{name}"]

    return [number(c.name) for c in model.gamma], [number(c.name) for c in model.K_theta]


def calculated(mechanism: Mechanism, values: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters that follow from others: the stubs ``gamma0`` of the flexures [-].

    Raises
    ------
    ParameterError
        If a stub would have a negative length.
    """
    result = {}
    for kind in mechanism.flexure_types:
        gamma, _ = coefficients(mechanism, kind, values)
        if len(gamma) > 1:
            result[f"{kind.name}.gamma0"] = stub(gamma)
    return result


def unit(degrees: float) -> complex:
    """Return the unit vector at an angle [deg], exact along the axes.

    Examples
    --------
    >>> unit(90.0)
    1j
    """
    quarter, rest = divmod(degrees, 90.0)
    return complex(1j ** int(quarter % 4)) * (cmath.exp(1j * math.radians(rest)) if rest else 1.0)


def along(u: complex, place: Place, e0: Complex) -> tuple[Complex, float]:
    """Return B, c of the displacement of a place along u from the straight shape [m]."""
    row = place.row(len(e0))
    B = u.conjugate() * row
    return B, -float((B @ e0).real)


def rows(pairs: list[tuple[Complex, float]], n: int) -> tuple[Complex, Real]:
    """Stack pairs (B, c) into arrays of n columns, also when there are none."""
    B = np.array([b for b, _ in pairs], complex).reshape(-1, n)
    return B, np.array([c for _, c in pairs], float)


def check_masses(M: Real, J: Sequence[float]) -> None:
    """Refuse a motion that moves no mass.

    Parameters
    ----------
    M : (n, n)
        Mass matrix of the mass points at the straight shape [kg m^2].
    J : (n,)
        Rotary inertias [kg m^2].

    Raises
    ------
    ParameterError
        If the mass matrix is singular.
    """
    full = M + np.diag(J)
    scale = np.sqrt(np.diag(full))
    if np.all(scale > 0.0):
        scaled = full / np.outer(scale, scale)
        if np.linalg.eigvalsh(scaled)[0] > 1e-13:
            return
    raise ParameterError(
        "something that can move has no mass: give the flexures a density and the bodies a mass "
        "and an inertia"
    )


def check_loops(loops: Complex, e0: Complex) -> None:
    """Refuse loops that are not independent of each other at the straight shape.

    Raises
    ------
    MechanismError
        If the loops' Jacobian has not full rank, or leaves no motion.
    """
    if not len(loops):
        return
    jacobian = (1j * loops * e0).real
    scale = np.abs(jacobian).max()
    rank = int(np.linalg.matrix_rank(jacobian, tol=1e-9 * scale))
    if rank < len(loops):
        raise MechanismError(
            f"{len(loops) - rank} of the {len(loops)} loop closures follow from the others at "
            "the straight shape: the mechanism is over-constrained there; take away a flexure "
            "or move it out of line"
        )
    if len(loops) >= len(e0):
        raise MechanismError("the loops leave the mechanism no motion")
