"""Drawings of mechanisms that are turned, mirrored or shifted."""

from dataclasses import replace

from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import POSITIONS, VELOCITIES


def moved(given: Mechanism, place, *, turn: float = 0.0, sign: float = 1.0) -> Mechanism:
    """Return a mechanism whose points are moved by ``place``, with a turn [deg] and a sign."""

    def point(z):
        if z is None:
            return None
        new = place(complex(*z))
        return (new.real, new.imag)

    def direction(part, **changes):
        return replace(
            part, point=point(part.point), direction=sign * part.direction + turn, **changes
        )

    def started(body):
        changes = {}
        for angle, *axes in (POSITIONS, VELOCITIES):
            rotation, vector = getattr(body, angle), [getattr(body, name) for name in axes]
            changes[angle] = None if rotation is None else sign * rotation
            if vector != [None, None]:
                new = place(complex(*vector)) - place(0j)
                changes |= dict(zip(axes, (new.real, new.imag), strict=True))
        return changes

    angle = given.release.angle
    turned_release = {} if angle is None else {"angle": sign * angle}
    along = place(complex(*given.gravity)) - place(0j)
    return replace(
        given,
        ground={name: point(z) for name, z in given.ground.items()},
        bodies=tuple(
            replace(
                body,
                centre=point(body.centre),
                **started(body),
                points={name: point(z) for name, z in body.points.items()},
            )
            for body in given.bodies
        ),
        flexure_types=tuple(
            replace(
                kind,
                curvature=None if kind.curvature is None else sign * kind.curvature,
                rise=None if kind.rise is None else sign * kind.rise,
            )
            for kind in given.flexure_types
        ),
        joints=tuple(
            replace(joint, free_angle=None if joint.free_angle is None else sign * joint.free_angle)
            for joint in given.joints
        ),
        stops=tuple(direction(stop, offset=sign * stop.offset) for stop in given.stops),
        frictions=tuple(
            direction(rub, normal_stiffness=sign * rub.normal_stiffness) for rub in given.frictions
        ),
        forces=tuple(replace(force, point=point(force.point)) for force in given.forces),
        release=direction(given.release, **turned_release),
        gravity=(along.real, along.imag),
    )
