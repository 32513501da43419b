"""Assembly of the constant arrays of a mechanism from its description.

Every flexure becomes a chain of links.  A chain starts at the ground or at a body that earlier
parts have reached, and reaches the body at its other end.  A flexure or joint whose two bodies have
both been reached before closes a loop; the chain of such a flexure begins at the flexure's start.
"""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import qr

from ..base.errors import MechanismError, ParameterError
from ..base.tolerances import (
    DEPENDENT_LOOP_RTOL,
    INERTIA_RATIO_MIN,
    JOINT_DISTANCE_RTOL,
    MASSLESS_RTOL,
)
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.flexure import Segments, segments, stub
from ..mechanism.parts import (
    GROUND,
    LENGTH_MIN,
    Flexure,
    FlexureType,
    Joint,
    Point,
    Probe,
    Stop,
    body_of,
    value,
)
from .arrays import Complex, Real
from .system import FIXED, BodyFrame, Outline, Place, System, stacked, unit

NAMES_MAX = 5  # Parameters that a message names.


def assemble(mechanism: Mechanism, values: Mapping[str, float]) -> System:
    """Return the constant arrays of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        Description.
    values : mapping
        Values of all parameters, as :meth:`Mechanism.values` returns them.

    Raises
    ------
    MechanismError
        If a body is not connected to the ground, or loops depend on each other.
    ParameterError
        If a value is missing, a flexure has no length, or the links of a flexure are longer than
        the flexure.
    """
    missing = [p.name for p in mechanism.parameters if p.name not in values]
    if missing:
        raise ParameterError(
            f"values of {_some(missing)} are missing for {mechanism.name}: pass mechanism.values() "
            "for the defaults, or mechanism.values(changes)"
        )
    return _Assembler(mechanism, values).system()


def _some(names: Sequence[str]) -> str:
    """Return a list of names as text, cut after the first few."""
    rest = len(names) - NAMES_MAX
    return ", ".join(names[:NAMES_MAX]) + (f" and {rest} more" if rest > 0 else "")


@dataclass(frozen=True)
class Hit:
    """Coefficients of the gap Re(f (B E + z)) + c of a stop [m].

    f is conj(E) of the body ``on`` that carries the wall, or 1 for a wall on the ground.
    """

    B: Complex
    c: float
    z: complex
    on: int


class _Assembler:
    """Collects coordinates, masses, springs and loops, from the ground to each connected body."""

    def __init__(self, mechanism: Mechanism, values: Mapping[str, float]) -> None:
        self.mechanism = mechanism
        self.values = values
        self.q0: list[float] = []
        self.arm: list[int] = []
        self.J: list[float] = []
        self.masses: list[tuple[Place, float]] = []
        self.springs: list[tuple[float, int | None, int | None]] = []
        self.loops: list[tuple[str, Place]] = []
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

    def end(self, part: Flexure | Joint, reference: str) -> complex:
        """Return the drawn position of an end of a part [m]."""
        return self.at(self.mechanism.point(reference, part.name))

    def length(self, flexure: Flexure) -> float:
        """Return the length of a flexure as drawn [m]."""
        return abs(self.end(flexure, flexure.end) - self.end(flexure, flexure.start))

    def coordinate(self, start: float, arm: int | None = None) -> int:
        """Add an angle, or the stretch of the given arm, and return its index."""
        j = len(self.q0)
        self.q0.append(start)
        self.arm.append(j if arm is None else arm)
        self.J.append(0.0)
        return j

    def on(self, body: str, drawn: complex) -> Place:
        """Return the place of a drawn point of a body."""
        return self.origin[body].plus(self.index[body], drawn - self.drawn[body])

    def frame(self, name: str, body: str, point: Point | None) -> BodyFrame:
        """Return the position of a point of a body (default: its centre of mass)."""
        if point is None:
            point = next(b for b in self.mechanism.bodies if b.name == body).centre
        drawn = self.at(point)
        place, j = self.on(body, drawn), self.index[body]
        return BodyFrame(name, FIXED if j is None else j, place.c, place.row(len(self.q0)), drawn)

    # -- from the ground to all bodies --

    def system(self) -> System:
        waiting: list[Flexure | Joint] = [*self.mechanism.flexures, *self.mechanism.joints]
        while waiting:
            for part in waiting:
                if body_of(part.start) in self.origin or body_of(part.end) in self.origin:
                    break
            else:
                names = ", ".join(part.name for part in waiting)
                raise MechanismError(
                    f"nothing connects {names} to the ground: connect one of their bodies to it"
                )
            waiting.remove(part)
            if isinstance(part, Joint):
                self.joint(part)
            else:
                self.flexure(part)
        for body in self.mechanism.bodies:
            if body.name not in self.origin:
                raise MechanismError(f"the body {body.name} is not held by any flexure or joint")
            self.body(body.name)
        result = self.arrays()
        e = result.directions(result.q0)
        check_loops(result.spread(result.loops), e, [name for name, _ in self.loops])
        bodies = {j: f"body {name}" for name, j in self.index.items()}
        parts = [bodies.get(j, "a flexure link") for j in range(len(self.J))]
        check_masses((e.conj()[:, None] * result.H * e).real, self.J, parts)
        return result

    def body(self, name: str) -> None:
        body = next(b for b in self.mechanism.bodies if b.name == name)
        centre = self.on(name, self.at(body.centre))
        self.mass(centre, value(body, "mass", self.values))
        j = self.index[name]
        assert j is not None
        self.J[j] += value(body, "inertia", self.values)

    def joint(self, joint: Joint) -> None:
        start, end = joint.start, joint.end
        if body_of(start) not in self.origin:
            start, end = end, start
        z_start, z_end = self.end(joint, start), self.end(joint, end)
        if abs(z_end - z_start) > JOINT_DISTANCE_RTOL * self.size():
            raise MechanismError(
                f"the joint {joint.name} joins {start} and {end}, which are drawn "
                f"{abs(z_end - z_start):.4g} m apart: draw them at the same place"
            )
        place, far = self.on(body_of(start), z_start), body_of(end)
        if far in self.origin:
            self.close(joint.name, place, self.on(far, z_end))
        else:
            self.reach(far, place, z_end, self.coordinate(0.0))
        self.lines.append((joint.name, "joint", [place]))

    def reach(self, body: str, place: Place, drawn: complex, j: int | None) -> None:
        """Register the place of a drawn point of a body that turns with a coordinate."""
        self.origin[body], self.drawn[body], self.index[body] = place, drawn, j

    def close(self, name: str, place: Place, other: Place) -> None:
        """Close a loop: require that two places coincide."""
        self.loops.append((name, place.minus(other)))

    def flexure(self, flexure: Flexure) -> None:
        start, end = flexure.start, flexure.end
        pieces = self.segments(flexure)
        if body_of(start) not in self.origin:
            start, end, pieces = end, start, pieces.reversed()
        root, far = body_of(start), body_of(end)
        z_start, z_end = self.end(flexure, start), self.end(flexure, end)
        direction = (z_end - z_start) / abs(z_end - z_start)

        place, owner = self.on(root, z_start), self.index[root]
        corners = [place]
        links = [
            self.link(direction, length, axial)
            for length, axial in zip(pieces.lengths[1:-1], pieces.axial, strict=True)
        ]
        known = far in self.origin
        owners = [owner, *links, self.index[far] if known else self.coordinate(0.0)]
        for i, (length, j) in enumerate(zip(pieces.lengths[:-1], owners[:-1], strict=True)):
            # In the drawing the angle of a body is 0, that of a link its direction.
            vector = length * (1.0 if j in links else direction)
            self.rod(pieces.rods[i], place, j, vector)
            place = place.plus(j, vector)
            corners.append(place)
            self.mass(place, pieces.lumps[i])
            self.springs.append((pieces.rates[i], owners[i], owners[i + 1]))
        last = pieces.lengths[-1] * direction
        if known:
            pivot = self.on(far, z_end - last)
            self.close(flexure.name, place, pivot)
            place = pivot  # The last stub is part of the far body.
        else:
            self.reach(far, place, z_end - last, owners[-1])
        self.rod(pieces.rods[-1], place, owners[-1], last)
        corners.append(self.on(far, z_end))
        self.lines.append((flexure.name, "flexure", corners))

    def link(self, direction: complex, length: float, axial: float) -> int:
        """Add a link, and its stretch if it has an axial stiffness [N/m]."""
        j = self.coordinate(cmath.phase(direction))
        self.links.append(j)
        if axial > 0.0:
            self.springs.append((axial * length**2, None, self.coordinate(0.0, j)))
        return j

    def rod(self, mass: float, start: Place, j: int | None, vector: complex) -> None:
        """Add a uniform rod: two equal point masses with its centre and moment of inertia."""
        for fraction in (0.5 - 0.5 / math.sqrt(3), 0.5 + 0.5 / math.sqrt(3)):
            self.mass(start.plus(j, fraction * vector), mass / 2)

    def mass(self, place: Place, mass: float) -> None:
        """Add a point mass, unless it is part of the ground."""
        if mass > 0.0 and place.A:
            self.masses.append((place, mass))

    def segments(self, flexure: Flexure) -> Segments:
        kind = next(k for k in self.mechanism.flexure_types if k.name == flexure.type)
        L = self.length(flexure)
        if L < LENGTH_MIN:
            raise ParameterError(
                f"flexure {flexure.name} from {flexure.start} to {flexure.end} has the length "
                f"{L:g} m: move its ends apart"
            )
        fields = ("thickness", "width", "youngs_modulus", "density")
        h, b, E, rho = (value(kind, name, self.values) for name in fields)
        gamma, K_theta = coefficients(self.mechanism, kind, self.values)
        EI, EA, mass = E * b * h**3 / 12, E * b * h, rho * b * h * L
        model = self.mechanism.model(kind)
        return segments(model, gamma, K_theta, flexure.ends, L, EI, mass, EA if kind.axial else 0.0)

    def size(self) -> float:
        """Return the size of the mechanism as drawn [m].

        It is the largest distance between any two ground points or centres of mass, or the length
        of the longest flexure if that is larger.
        """
        points = [self.at(p) for p in self.mechanism.ground.values()]
        points += [self.at(body.centre) for body in self.mechanism.bodies]
        lengths = [self.length(flexure) for flexure in self.mechanism.flexures]
        return max(*lengths, *(abs(a - b) for a in points for b in points))

    # -- arrays --

    def arrays(self) -> System:
        """Return the arrays from the collected parts."""
        n, mechanism = len(self.q0), self.mechanism
        arm = np.array(self.arm)
        A = np.array([place.row(n) for place, _ in self.masses])
        m = np.array([mass for _, mass in self.masses])
        # At zero stretch the directions e equal the arms E.  Rows of places are zero at stretches.
        e0 = np.exp(1j * np.array(self.q0))
        spread = A[:, arm]
        frames = {body.name: self.frame(body.name, body.name, None) for body in mechanism.bodies}
        self.lines += [(body, "body", self.corners(body)) for body in frames]
        release = mechanism.release
        along_release, release_c = self.displaced(
            release.body, release.point, release.direction, e0
        )
        return System(
            mechanism=mechanism,
            values=dict(self.values),
            q0=np.array(self.q0),
            arm=arm,
            H=spread.conj().T @ (m[:, None] * spread),
            J=np.array(self.J),
            K=self.stiffness(),
            A=A,
            c=np.array([place.c for place, _ in self.masses]),
            m=m,
            **self.loop_arrays(n),
            **self.stop_arrays(n, e0),
            **self.friction_arrays(n, e0),
            release=along_release,
            release_c=release_c,
            bodies=frames,
            pushed=tuple(self.frame(f.name, f.body, f.point) for f in mechanism.forces),
            probes=tuple(self.probe(probe) for probe in mechanism.probes),
            links=tuple(self.links),
            outlines=tuple(self.outline(*line) for line in self.lines),
            anchor=self.anchor(),
            length=self.size(),
        )

    def loop_arrays(self, n: int) -> dict[str, Any]:
        """Return the rows of the loop closures and their constants."""
        closures = [place for _, place in self.loops]
        rows = np.array([r for p in closures for r in (p.row(n), -1j * p.row(n))])
        constants = np.array([x for p in closures for x in (p.c.real, p.c.imag)])
        return {"loops": rows.reshape(-1, n), "loops_c": constants}

    def stop_arrays(self, n: int, e0: Complex) -> dict[str, Any]:
        """Return the rows of gaps and of displacements along the walls, and their constants."""
        hits = [self.hit(stop, e0) for stop in self.mechanism.stops]
        return {
            "gaps": stacked([hit.B for hit in hits], n),
            "gaps_c": np.array([hit.c for hit in hits]),
            "gaps_z": np.array([hit.z for hit in hits], complex),
            "slides": stacked([1j * hit.B for hit in hits], n),
            "slides_z": np.array([1j * hit.z for hit in hits], complex),
            "on": np.array([hit.on for hit in hits], int),
        }

    def friction_arrays(self, n: int, e0: Complex) -> dict[str, Any]:
        """Return the displacements of friction points along and across their directions."""
        points = self.mechanism.frictions
        along = [self.displaced(f.body, f.point, f.direction, e0) for f in points]
        across = [self.displaced(f.body, f.point, f.direction + 90.0, e0) for f in points]
        return {
            "rubs": stacked([B for B, _ in along], n),
            "lifts": stacked([B for B, _ in across], n),
            "lifts_c": np.array([c for _, c in across]),
        }

    def outline(self, name: str, kind: str, places: list[Place]) -> Outline:
        """Return a line to draw."""
        n = len(self.q0)
        A = np.array([p.row(n) for p in places])
        return Outline(name, kind, np.array([p.c for p in places]), A)

    def stiffness(self) -> Real:
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

    def displaced(
        self, body: str, point: Point | None, direction: float, e0: Complex
    ) -> tuple[Complex, float]:
        """Return B, c of the displacement Re(B E) + c of a point along a direction [m]."""
        frame = self.frame(body, body, point)
        B = unit(direction).conjugate() * frame.A
        return B, -float((B @ e0).real)

    def probe(self, probe: Probe) -> BodyFrame:
        point = self.mechanism.point(probe.point, probe.name)
        return self.frame(probe.name, body_of(probe.point), point)

    def hit(self, stop: Stop, e0: Complex) -> "Hit":
        """Return the gap of a stop without the position and displacement of its wall."""
        u = unit(stop.direction)
        drawn = self.at(stop.point) + value(stop, "offset", self.values) * 1j * u
        place, j = self.on(stop.body, drawn), self.index[stop.on]
        if j is None:
            B = -u.conjugate() * place.row(len(self.q0))
            return Hit(B, -float((B @ e0).real), 0j, FIXED)
        apart = place.minus(self.origin[stop.on])
        B = -u.conjugate() * apart.row(len(self.q0))
        straight = (u.conjugate() * (drawn - self.drawn[stop.on])).real
        return Hit(B, straight, -u.conjugate() * apart.c, j)

    def corners(self, name: str) -> list[Place]:
        body = next(b for b in self.mechanism.bodies if b.name == name)
        return [self.on(name, self.at(point)) for point in body.points.values()]

    def anchor(self) -> complex:
        """Return the first flexure end on the ground, otherwise the origin [m]."""
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


def check_masses(M: Real, J: Sequence[float], names: Sequence[str]) -> None:
    """Reject a mechanism with moving parts that have no mass, or hardly any.

    Parameters
    ----------
    M : (n, n)
        Mass matrix of the mass points at the straight shape [kg m^2].
    J : (n,)
        Rotary inertias [kg m^2].
    names : sequence of str
        Names of the parts that move with the n coordinates.

    Raises
    ------
    ParameterError
        If the mass matrix is singular, or inertias differ by more than ``INERTIA_RATIO_MIN``.
    """
    full = M + np.diag(J)
    inertias = np.diag(full)
    light, heavy = int(np.argmin(inertias)), int(np.argmax(inertias))
    if 0.0 < inertias[light] < INERTIA_RATIO_MIN * inertias[heavy]:
        raise ParameterError(
            f"the inertia of {names[light]}, {inertias[light]:.3g} kg m2, is less than "
            f"{INERTIA_RATIO_MIN:g} of that of {names[heavy]}, {inertias[heavy]:.3g} kg m2, so "
            "that round-off would change the motion: check the units of masses, inertias, "
            "densities and lengths, and make the light part heavier"
        )
    scale = np.sqrt(inertias)
    if np.all(scale > 0.0):
        scaled = full / np.outer(scale, scale)
        if np.linalg.eigvalsh(scaled)[0] > MASSLESS_RTOL:
            return
    raise ParameterError(
        "a part that can move has no mass: give the flexures a density and the bodies a mass and "
        "an inertia"
    )


def check_loops(loops: Complex, e: Complex, names: Sequence[str]) -> None:
    """Reject loops that are not independent of each other at the straight shape.

    Parameters
    ----------
    loops : (2 k, n) complex
        Rows of the closures, spread [m].
    e : (n,) complex
        Directions of the straight shape.
    names : sequence of str
        Names of the parts that close the k loops.

    Raises
    ------
    MechanismError
        If the Jacobian of the loops does not have full rank, or if they prevent all motion.
    """
    if not len(loops):
        return
    jacobian = (1j * loops * e).real
    tolerance = DEPENDENT_LOOP_RTOL * np.abs(jacobian).max()
    _, R, order = qr(jacobian.T, mode="economic", pivoting=True)
    size = np.abs(np.diag(R))
    repeated = sorted({names[row // 2] for row in order[: len(size)][size <= tolerance]})
    if repeated or len(loops) > len(e):
        raise MechanismError(
            f"the constraints of the loops closed by {', '.join(repeated or names)} depend on "
            "those of other loops at the straight shape: rigid links are over-constrained there; "
            "remove a part, move it out of line, or let flexures stretch (axial = true)"
        )
    if len(loops) >= len(e):
        raise MechanismError(
            f"the loops closed by {', '.join(names)} prevent every motion of the mechanism: remove "
            "a part, or let flexures bend (clamp their ends) or stretch (axial = true)"
        )
