"""Checks of a mechanism as it is drawn, with the values of its file."""

import math
from collections.abc import Iterator

from ..base.errors import MechanismError
from ..mechanics.assembly import assemble
from ..mechanics.collection import Collection
from ..mechanics.flexures import check_drawn
from ..mechanics.independent import named_states
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.parts import GROUND, LENGTH_MAX, LENGTH_MIN, Point


def check_drawing(mechanism: Mechanism) -> None:
    """Reject a mechanism that cannot be drawn, or has expressions out of bounds, by default."""
    values = mechanism.values()
    for name, point in _places(mechanism):
        x, y = (affine(coordinate)(values) for coordinate in point)
        if not math.hypot(x, y) <= LENGTH_MAX:
            raise MechanismError(
                f"{name} is drawn at ({x:g} m, {y:g} m): draw the mechanism within "
                f"{LENGTH_MAX:g} m of the origin"
            )
    types = {kind.name: kind for kind in mechanism.flexure_types}
    drawn = Collection(mechanism, values)
    for flexure in mechanism.flexures:
        check_drawn(drawn, flexure, types[flexure.type])
    for joint in mechanism.joints:
        apart = abs(drawn.end(joint, joint.end) - drawn.end(joint, joint.start))
        if apart > LENGTH_MIN:
            raise MechanismError(
                f"joint {joint.name}: {joint.start} and {joint.end} are drawn {apart:g} m apart; "
                "draw them at the same position"
            )
    for spring in mechanism.springs:
        drawn.check_apart(spring)
    for guide in mechanism.guides:
        drawn.line(guide)
    if mechanism.states:
        named_states(assemble(mechanism, values))


def _places(mechanism: Mechanism) -> Iterator[tuple[str, Point]]:
    """Yield the names and coordinates of all drawn points."""
    yield from ((f"{GROUND}.{name}", point) for name, point in mechanism.ground.items())
    for part in mechanism.ground_parts:
        yield from (("ground_parts", corner) for corner in part.outline)
    for body in mechanism.bodies:
        yield f"{body.name}.centre", body.centre
        yield from ((f"{body.name}.{name}", point) for name, point in body.points.items())
        yield from ((f"{body.name}.outline", corner) for corner in body.outline)
