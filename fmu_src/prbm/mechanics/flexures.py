"""Flexures as chains of links: their coordinates, masses, springs and loops."""

import cmath
from collections.abc import Mapping

from ..base.errors import ParameterError
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.flexure import Segments, segments
from ..mechanism.parts import LENGTH_MIN, Flexure, FlexureType, body_of, value
from .collection import Collection


def add_flexure(parts: Collection, flexure: Flexure) -> None:
    """Add a flexure of which at least one body has been reached.

    It reaches the body at its other end.  If this body has been reached before, it closes a loop.

    Raises
    ------
    ParameterError
        If the flexure has no length, or its links are longer than the flexure.
    """
    kind = next(k for k in parts.mechanism.flexure_types if k.name == flexure.type)
    if parts.length(flexure) < LENGTH_MIN:
        raise ParameterError(
            f"flexure {flexure.name} from {flexure.start} to {flexure.end} has the length "
            f"{parts.length(flexure):g} m: move its ends apart"
        )
    _add_links(parts, flexure, _segments(parts, flexure, kind))


def _segments(parts: Collection, flexure: Flexure, kind: FlexureType) -> Segments:
    """Return the segments of a flexure, from its start to its end."""
    L = parts.length(flexure)
    EI, EA, mass = _section(parts, kind)
    gamma, K_theta = coefficients(parts.mechanism, kind, parts.values)
    model = parts.mechanism.model(kind)
    return segments(model, gamma, K_theta, flexure.ends, L, EI, mass * L, EA if kind.axial else 0.0)


def _section(parts: Collection, kind: FlexureType) -> tuple[float, float, float]:
    """Return bending stiffness [N m^2], axial stiffness [N] and mass per length [kg/m]."""
    fields = ("thickness", "width", "youngs_modulus", "density")
    h, b, E, rho = (value(kind, name, parts.values) for name in fields)
    return E * b * h**3 / 12, E * b * h, rho * b * h


def _add_links(parts: Collection, flexure: Flexure, pieces: Segments) -> None:
    """Add a flexure of rigid segments."""
    start, end = flexure.start, flexure.end
    if body_of(start) not in parts.origin:
        start, end, pieces = end, start, pieces.reversed()
    root, far = body_of(start), body_of(end)
    z_start, z_end = parts.end(flexure, start), parts.end(flexure, end)
    direction = (z_end - z_start) / abs(z_end - z_start)

    place, owner = parts.on(root, z_start), parts.index[root]
    corners = [place]
    links = [
        _add_link(parts, direction, length, axial)
        for length, axial in zip(pieces.lengths[1:-1], pieces.axial, strict=True)
    ]
    known = far in parts.origin
    owners = [owner, *links, parts.index[far] if known else parts.turn(far)]
    for i, (length, j) in enumerate(zip(pieces.lengths[:-1], owners[:-1], strict=True)):
        # In the drawing the angle of a body is 0, that of a link its direction.
        vector = length * (1.0 if j in links else direction)
        parts.rod(pieces.rods[i], place, j, vector)
        place = place.plus(j, vector)
        corners.append(place)
        parts.mass(place, pieces.lumps[i])
        parts.spring(pieces.rates[i], parts.angle(owners[i]), parts.angle(owners[i + 1]))
    last = pieces.lengths[-1] * direction
    if known:
        pivot = parts.on(far, z_end - last)
        parts.close(flexure.name, place, pivot)
        place = pivot  # The last stub is part of the far body.
    else:
        parts.reach(far, place, z_end - last, owners[-1])
    parts.rod(pieces.rods[-1], place, owners[-1], last)
    corners.append(parts.on(far, z_end))
    parts.lines.append((flexure.name, "flexure", corners))


def _add_link(parts: Collection, direction: complex, length: float, axial: float) -> int:
    """Add a link, and its stretch if it has an axial stiffness [N/m]; return its direction."""
    parts.link_count += 1
    owner = f"link[{parts.link_count}]"
    angle = parts.coordinate(owner, cmath.phase(direction))
    j = parts.direction({angle: 1.0})
    parts.links.append(angle)
    if axial > 0.0:
        stretch = parts.coordinate(owner)
        parts.direction({stretch: 1.0}, arm=j)
        parts.spring(axial * length**2, None, stretch)
    return j


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
