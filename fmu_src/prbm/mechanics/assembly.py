"""Assembly of the constant arrays of a mechanism from its description.

A flexure starts at the ground or at a body that earlier parts have reached, and reaches the body at
its other end.  A flexure or joint whose two bodies have both been reached before closes a loop; the
links of such a flexure begin at the flexure's start.  If no part reaches a further body, the first
one that is left, in the order of the description, is free: it is reached by its own displacements.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.errors import MechanismError, ParameterError
from ..base.tolerances import (
    DEPENDENT_LOOP_RTOL,
    FLEXURE_INERTIA_RATIO_MIN,
    INERTIA_RATIO_MIN,
    JOINT_DISTANCE_RTOL,
    SINGULAR_RTOL,
)
from ..mechanism.description import Mechanism
from ..mechanism.flexure import stub
from ..mechanism.parts import (
    GROUND,
    Flexure,
    Guide,
    Joint,
    Probe,
    Stop,
    body_of,
    value,
)
from .arrays import Complex, Real
from .collection import Collection
from .flexures import add_flexure, coefficients
from .places import NO_THICKNESS, BodyFrame, GuideRows, Outline, Place
from .system import FIXED, System, stacked, unit

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
        If loops depend on each other.
    ParameterError
        If a value is missing, a flexure has no length or is as thick as long, or the links of a
        flexure are longer than the flexure.
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


class _Assembler(Collection):
    """Adds the parts of a mechanism from the ground to all bodies, and forms the arrays."""

    # -- from the ground to all bodies --

    def system(self) -> System:
        names: list[str] = []  # Of the parts that move with the coordinates.
        waiting: list[Flexure | Joint] = [*self.mechanism.flexures, *self.mechanism.joints]
        while waiting or len(self.origin) <= len(self.mechanism.bodies):
            part = next(
                (
                    part
                    for part in waiting
                    if body_of(part.start) in self.origin or body_of(part.end) in self.origin
                ),
                None,
            )
            if part is None:
                bodies = (body.name for body in self.mechanism.bodies)
                self.set_free(next(body for body in bodies if body not in self.origin))
            else:
                waiting.remove(part)
                if isinstance(part, Joint):
                    self.joint(part)
                else:
                    add_flexure(self, part)
            names += [
                f"body {owner}" if owner in self.index or part is None else f"flexure {part.name}"
                for owner in self.owners[len(names) :]
            ]
        for body in self.mechanism.bodies:
            self.body(body.name)
        for guide in self.mechanism.guides:
            self.guide(guide)
        self.guide_rows.sort(key=lambda row: row.floats)
        result = self.arrays()
        e = result.directions(result.q0)
        owners = [name for name, _ in self.loops for _ in range(2)]
        owners += [row.name for row in self.guide_rows]
        check_loops(result.loop_rows.jacobian(e), owners)
        check_masses(result.mass_matrix(e), names)
        return result

    def body(self, name: str) -> None:
        body = next(b for b in self.mechanism.bodies if b.name == name)
        centre = self.on(name, self.at(body.centre))
        self.body_masses[name] = len(self.masses)
        self.mass(centre, value(body, "mass", self.values))
        j = self.index[name]
        assert j is not None
        self.J[j] += value(body, "inertia", self.values)

    def joint(self, joint: Joint) -> None:
        start, end = joint.start, joint.end
        if body_of(start) not in self.origin:
            start, end = end, start
        z_start, z_end = self.end(joint, start), self.end(joint, end)
        if abs(z_end - z_start) > JOINT_DISTANCE_RTOL * self.size:
            raise MechanismError(
                f"the joint {joint.name} joins {start} and {end}, which are drawn "
                f"{abs(z_end - z_start):.4g} m apart: draw them at the same place"
            )
        place, far = self.on(body_of(start), z_start), body_of(end)
        known = far in self.origin
        if known:
            self.close(joint.name, place, self.on(far, z_end))
        else:
            self.reach(far, place, z_end, self.turn(far))
        self.connect(body_of(start), far, known)
        self.lines.append((joint.name, "joint", [place], NO_THICKNESS))

    # -- arrays --

    def arrays(self) -> System:
        """Return the arrays from the collected parts."""
        d, mechanism = len(self.arm), self.mechanism
        q0, Phi, arm = np.array(self.q0), self.map(), np.array(self.arm)
        A = stacked([place.row(d) for place, _ in self.masses], d)
        m = np.array([mass for _, mass in self.masses])
        # At zero stretch the directions e equal the arms E.  Rows of places are zero at stretches.
        e0 = np.exp(1j * Phi.of(q0))
        e0[self.floats] = 0.0
        repeated = A[:, arm]
        frames = {body.name: self.frame(body.name, body.name, None) for body in mechanism.bodies}
        self.lines += [(body, "body", self.corners(body), NO_THICKNESS) for body in frames]
        release, loops = mechanism.release, self.loop_arrays(d)
        released = self.frame(release.body, release.body, release.point)
        along_release, release_c = self.displaced(released, release.direction, e0)
        return System(
            mechanism=mechanism,
            values=dict(self.values),
            q0=q0,
            rest=np.array(self.rest),
            Phi=Phi,
            arm=arm,
            floats=np.array(self.floats, int),
            floating=np.array(self.floating, int),
            placed=np.array(self.placed, int),
            H=repeated.conj().T @ (m[:, None] * repeated),
            J=np.array(self.J),
            K=self.stiffness(),
            turns=self.turns(),
            A=A,
            c=np.array([place.c for place, _ in self.masses]),
            m=m,
            **loops,
            **self.span_arrays(d),
            **self.stop_arrays(d, e0),
            **self.rubbing_arrays(d, e0, loops),
            release=along_release,
            release_c=release_c,
            released=released,
            bodies=frames,
            pushed=tuple(self.frame(f.name, f.body, f.point) for f in mechanism.forces),
            probes=tuple(self.probe(probe) for probe in mechanism.probes),
            guided_points=tuple(self.probe(guide) for guide in mechanism.guides),
            links=tuple(self.links),
            owners=tuple(self.owners),
            connections=tuple(self.connections),
            body_masses=dict(self.body_masses),
            outlines=tuple(self.outline(*line) for line in self.lines),
            anchor=self.anchor(),
            length=self.size,
        )

    def loop_arrays(self, d: int) -> dict[str, Any]:
        """Return the rows of the loop closures and of the guides, and their constants."""
        rows, constants = components([place for _, place in self.loops], d)
        guides, closures = self.guide_rows, len(rows)
        carriers = [FIXED if row.carrier is None else row.carrier for row in guides]
        return {
            "loops": np.vstack([rows, stacked([row.place.row(d) for row in guides], d)]),
            "loops_c": np.append(constants, [row.c for row in guides]),
            "loops_z": np.array([0j] * closures + [row.place.c for row in guides], complex),
            "loops_on": np.array([FIXED] * closures + carriers, int),
            "guided": tuple(self.guided(guide, closures) for guide in self.mechanism.guides),
            "tied": closures + sum(not row.floats for row in guides),
        }

    def guided(self, guide: Guide, closures: int) -> GuideRows:
        """Return where the rows of a guide are, behind the closures, and draw its line."""
        k = [closures + i for i, row in enumerate(self.guide_rows) if row.name == guide.name]
        ends = [self.on(guide.on, self.end(guide, end)) for end in (guide.start, guide.end)]
        self.lines.append((guide.name, "guide", ends, NO_THICKNESS))
        return GuideRows(k[0], None if guide.turning else k[1], 1j * self.line(guide))

    def turns(self) -> Real:
        """Return the rotations at joints with torsion, the end relative to the start, (k, n)."""
        joints = [joint for joint in self.mechanism.joints if joint.elastic]
        rows = np.zeros((len(joints), len(self.q0)))
        for row, joint in zip(rows, joints, strict=True):
            for sign, end in ((-1.0, joint.start), (1.0, joint.end)):
                j = self.angle(self.index[body_of(end)])
                if j is not None:
                    row[j] += sign
        return rows

    def span_arrays(self, d: int) -> dict[str, Any]:
        """Return the rows of the vectors along the springs and their constants."""
        springs = self.mechanism.springs
        spans = [self.span(spring) for spring in springs]
        rows, constants = components(spans, d)
        for spring in springs:
            ends = [self.on(body_of(z), self.end(spring, z)) for z in (spring.start, spring.end)]
            self.lines.append((spring.name, "spring", ends, NO_THICKNESS))
        return {"spans": rows, "spans_c": constants}

    def stop_arrays(self, d: int, e0: Complex) -> dict[str, Any]:
        """Return the rows of gaps and of displacements along the walls, and their constants."""
        hits = [self.hit(stop, e0) for stop in self.mechanism.stops]
        return {
            "gaps": stacked([hit.B for hit in hits], d),
            "gaps_c": np.array([hit.c for hit in hits]),
            "gaps_z": np.array([hit.z for hit in hits], complex),
            "slides": stacked([1j * hit.B for hit in hits], d),
            "slides_z": np.array([1j * hit.z for hit in hits], complex),
            "on": np.array([hit.on for hit in hits], int),
        }

    def rubbing_arrays(self, d: int, e0: Complex, loops: dict[str, Any]) -> dict[str, Any]:
        """Return the displacements of friction points, and those along the guides with friction.

        A guide does not permit the displacement across its line, which has a row of the loops.
        """
        points = [
            (f.direction, self.frame(f.body, f.body, f.point)) for f in self.mechanism.frictions
        ]
        along = [self.displaced(frame, direction, e0) for direction, frame in points]
        across = [self.displaced(frame, direction + 90.0, e0) for direction, frame in points]
        guides = zip(self.mechanism.guides, loops["guided"], strict=True)
        normals = [rows.across for guide, rows in guides if guide.friction is not None]
        return {
            "rubs": stacked([*(B for B, _ in along), *(1j * loops["loops"][normals])], d),
            "rubs_z": np.append(np.zeros(len(points), complex), 1j * loops["loops_z"][normals]),
            "rubs_on": np.append(np.full(len(points), FIXED), loops["loops_on"][normals]),
            "normals": np.append(np.full(len(points), FIXED), np.array(normals, int)),
            "lifts": stacked([B for B, _ in across], d),
            "lifts_c": np.array([c for _, c in across]),
        }

    def outline(self, name: str, kind: str, places: list[Place], thickness: Real) -> Outline:
        """Return a line to draw."""
        d = len(self.arm)
        A = np.array([p.row(d) for p in places])
        return Outline(name, kind, np.array([p.c for p in places]), A, thickness)

    def displaced(self, frame: BodyFrame, direction: float, e0: Complex) -> tuple[Complex, float]:
        """Return B, c of the displacement Re(B E) + c of a point along a direction [m]."""
        B = unit(direction).conjugate() * frame.A
        return B, -float((B @ e0).real)

    def probe(self, probe: Probe | Guide) -> BodyFrame:
        point = self.mechanism.point(probe.point, probe.name)
        return self.frame(probe.name, body_of(probe.point), point)

    def hit(self, stop: Stop, e0: Complex) -> "Hit":
        """Return the gap of a stop without the position and displacement of its wall."""
        u = unit(stop.direction)
        drawn = self.at(stop.point) + value(stop, "offset", self.values) * 1j * u
        place, j = self.on(stop.body, drawn), self.index[stop.on]
        if j is None:
            B = -u.conjugate() * place.row(len(self.arm))
            return Hit(B, -float((B @ e0).real), 0j, FIXED)
        apart = place.minus(self.origin[stop.on])
        B = -u.conjugate() * apart.row(len(self.arm))
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


def components(places: Sequence[Place], d: int) -> tuple[Complex, Real]:
    """Return rows (2 k, d) and constants (2 k,) of the components along x and y of k vectors."""
    rows = np.array([r for p in places for r in (p.row(d), -1j * p.row(d))], complex)
    constants = np.array([x for p in places for x in (p.c.real, p.c.imag)])
    return rows.reshape(-1, d), constants


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


def check_masses(M: Real, names: Sequence[str]) -> None:
    """Reject a mechanism with moving parts that have no mass, or hardly any.

    Parameters
    ----------
    M : (n, n)
        Mass matrix at the straight shape [kg m^2].
    names : sequence of str
        Names of the parts that move with the n coordinates.

    Raises
    ------
    ParameterError
        If the mass matrix is singular, or the inertia of a body is less than
        ``INERTIA_RATIO_MIN`` of the largest one, or that of a flexure less than
        ``FLEXURE_INERTIA_RATIO_MIN``.
    """
    inertias = np.diag(M)
    limits = np.array(
        [
            INERTIA_RATIO_MIN if name.startswith("body ") else FLEXURE_INERTIA_RATIO_MIN
            for name in names
        ]
    )
    light, heavy = int(np.argmin(inertias / limits)), int(np.argmax(inertias))
    if 0.0 < inertias[light] < limits[light] * inertias[heavy]:
        raise ParameterError(
            f"the inertia of {names[light]}, {inertias[light]:.3g} kg m2, is less than "
            f"{limits[light]:g} of that of {names[heavy]}, {inertias[heavy]:.3g} kg m2, so "
            "that round-off would change the motion: check the units of masses, inertias, "
            "densities, lengths and coordinates (numbers without a unit are in SI), or make the "
            "light part heavier"
        )
    scale = np.sqrt(inertias)
    if np.all(scale > 0.0):
        scaled = M / np.outer(scale, scale)
        if np.linalg.eigvalsh(scaled)[0] > SINGULAR_RTOL:
            return
    raise ParameterError(
        "a part that can move has no mass: give the flexures a density and the bodies a mass and "
        "an inertia"
    )


def dependent_rows(rows: Real, tolerance: float) -> list[int]:
    """Return the rows that take part in linear dependences, by Gram-Schmidt orthogonalisation.

    Parameters
    ----------
    rows : (k, n)
        Vectors.
    tolerance : float
        Length of a remainder, without the components along the other rows, that is round-off.

    Examples
    --------
    >>> dependent_rows(np.array([[1.0, 0.0], [0.0, 3.0], [4.0, 0.0]]), 1e-9)
    [0, 2]
    """
    rest, left = rows.copy(), list(range(len(rows)))
    shares = np.eye(len(rows))  # Each remainder is a sum of shares of the rows.
    while left:
        lengths = np.linalg.norm(rest[left], axis=1)
        k = left[int(lengths.argmax())]
        if lengths.max() <= tolerance:
            break
        left.remove(k)
        part = rest[left] @ rest[k] / lengths.max() ** 2
        rest[left] -= np.outer(part, rest[k])
        shares[left] -= np.outer(part, shares[k])
    taking = np.abs(shares[left]) > DEPENDENT_LOOP_RTOL
    return [int(k) for k in np.flatnonzero(taking.any(axis=0))]


def check_loops(jacobian: Real, names: Sequence[str]) -> None:
    """Reject loops that are not independent of each other at the straight shape.

    Parameters
    ----------
    jacobian : (r, n)
        Jacobian of the loops and guides at the straight shape [m/rad].
    names : sequence of str
        Name of the part that each row belongs to.

    Raises
    ------
    MechanismError
        If the Jacobian of the loops does not have full rank, or if they prevent all motion.
    """
    rows, n = jacobian.shape
    if not rows:
        return
    tolerance = DEPENDENT_LOOP_RTOL * np.abs(jacobian).max()
    repeated = sorted({names[k] for k in dependent_rows(jacobian, tolerance)})
    every = ", ".join(repeated or dict.fromkeys(names))
    if repeated or rows > n:
        raise MechanismError(
            f"the constraints of {every} depend on each other at the straight shape: rigid links "
            "are over-constrained there; remove a part, move it out of line, or let flexures "
            "stretch (axial = true) or bodies turn in their guides (turning = true)"
        )
    if rows >= n:
        raise MechanismError(
            f"the loops closed by {every} prevent every motion of the mechanism: remove a part, or "
            "let flexures bend (clamp their ends) or stretch (axial = true), or bodies turn in "
            "their guides (turning = true)"
        )
