r"""Closed form of the modal restitution of a body on a path.

A free body of mass m and inertia J follows the path y(x) of a guide without turning.  An impact
with the restitution eps, at the distance d from the centre of mass, has the modal restitution

    C = (1 + eps) / ((1 + y'^2) (1 + m d^2/J)) - 1.

The formula is rejected for a body that turns on its path, and for a body that has less than
:data:`ENERGY_SHARE_MIN` of the kinetic energy of the fundamental mode.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...base.errors import ParameterError
from ...base.progress import Progress
from ...mechanics.assembly import assemble
from ...mechanics.modal import modes
from ...mechanics.statics import Equilibrium, equilibrium
from ...mechanics.system import System, unit
from ...mechanism.description import Mechanism
from ...mechanism.parts import GROUND, value
from ...mechanism.supported import COMPLIANT_STOPS, FREE_BODIES, check_supported
from ..touching import impact_shape, lever
from .maps import OFFSETS, WALLS, ImpactMap, MovedStop, point_counter

PATH_RTOL = 1e-9  # A path shorter than this fraction of the step is round-off.
PATH_STEP = 1e-4  # Half of the step along the path of a body, as a share of the size.
TURNING_MAX = 0.02  # Largest motion by turning at the hit point, as a share of the path.
ENERGY_SHARE_MIN = 0.95  # Least share of the body in the kinetic energy of the fundamental mode.
_UNFIT = "the closed form applies only to"
_OTHER_METHODS = "choose another method: algebraic, simulated or elements"


def closed_form(
    mechanism: Mechanism,
    walls: Sequence[float] = WALLS,
    offsets: Sequence[float] = OFFSETS,
    values: Mapping[str, float] | None = None,
    *,
    stop: str | None = None,
    label: str = "closed form",
    progress: Progress | None = None,
) -> ImpactMap:
    """Return the map of (1 + eps)/((1 + y'^2)(1 + m d^2/J)) - 1, with y(x) the path of the body.

    The path is that of the centre of mass along the held shapes, with x along the direction of the
    stop; d is the distance from the centre of mass to the line of the impact in the straight shape.
    Parameters as for :func:`prbm.analysis.impact_map.routes.algebraic`.

    Raises
    ------
    ParameterError
        If the formula does not apply:

        * the stop is on a moving body;
        * the body turns on its path: a point at the distance of the hit, or of the radius of
          gyration, moves by more than :data:`TURNING_MAX` of the path;
        * the body has less than :data:`ENERGY_SHARE_MIN` of the kinetic energy of the fundamental
          mode along the path.
    """
    check_supported(mechanism, "the closed form", COMPLIANT_STOPS, FREE_BODIES)
    which = MovedStop.of(mechanism, stop)
    s = mechanism.stops[which.index]
    if s.on != GROUND:
        raise ParameterError(
            f"{_UNFIT} a stop on the ground, but {s.name} is on {s.on}, which moves; "
            f"{_OTHER_METHODS}"
        )
    result = np.zeros((len(offsets), len(walls)))
    system = assemble(mechanism, mechanism.values(which.at(values, 0.0, 0.0)))
    eps = value(s, "restitution", system.values)
    body = next(b for b in mechanism.bodies if b.name == s.body)
    m, J = (value(body, name, system.values) for name in ("mass", "inertia"))
    levers = lever(system, which.index) + np.array(offsets)
    reach = max(float(np.abs(levers).max()), math.sqrt(J / m))
    count = point_counter(progress, len(walls))
    for j, h in enumerate(walls):
        shape = impact_shape(system, which.index, h)
        path, turning = _path(system, s.body, shape)
        _check_alone(system, s.body, shape, path, turning * reach, h)
        slope = math.tan(np.angle(path * unit(s.direction).conjugate()))
        result[:, j] = (1 + eps) / ((1 + slope**2) * (1 + m * levers**2 / J)) - 1
        count()
    return ImpactMap(label, np.array(walls), np.array(offsets), result)


def _path(system: System, body: str, shape: Equilibrium) -> tuple[complex, float]:
    """Return the unit direction of a body's path along held shapes, and its rotation [rad/m]."""
    frame, step = system.bodies[body], PATH_STEP * system.length
    held, turns = system.amount(shape.q), system.mechanism.release.turns
    change = PATH_STEP if turns else step
    behind, ahead = (equilibrium(system, held + k * change).q for k in (-1, 1))
    moved = complex(frame.A @ (system.directions(ahead) - system.directions(behind)))
    if abs(moved) <= PATH_RTOL * step:
        raise ParameterError(
            f"{_UNFIT} a body that moves along a path, but {body} does not move, or turns about "
            f"its centre of mass; {_OTHER_METHODS}"
        )
    return moved / abs(moved), float(ahead[frame.j] - behind[frame.j]) / abs(moved)


def _check_alone(
    system: System, body: str, shape: Equilibrium, path: complex, turns: float, wall: float
) -> None:
    """Reject a body that turns on its path, or has too little of the fundamental mode's energy.

    ``turns`` is the motion of the hit point by rotation, divided by the path [-].
    """
    where = f"with the wall at {1e3 * wall:g} mm"
    if abs(turns) > TURNING_MAX:
        raise ParameterError(
            f"{_UNFIT} a body that does not turn, but {where} {body} turns: this moves the hit "
            f"point, or a point at the radius of gyration, by {100 * abs(turns):.3g} % of the path "
            f"(at most {100 * TURNING_MAX:g} %); {_OTHER_METHODS}"
        )
    _, velocity = system.motion(
        system.bodies[body], system.directions(shape.q), modes(system, shape).shape[:, 0]
    )
    mass = next(value(b, "mass", system.values) for b in system.mechanism.bodies if b.name == body)
    share = mass * (velocity * path.conjugate()).real ** 2  # Modes have the mass 1.
    if share < ENERGY_SHARE_MIN:
        raise ParameterError(
            f"{_UNFIT} a body that moves alone, but {where} the motion of {body} along its path "
            f"has {100 * share:.3g} % of the fundamental mode's kinetic energy (at least "
            f"{100 * ENERGY_SHARE_MIN:g} %): other bodies or the flexures move with it; "
            f"{_OTHER_METHODS}"
        )
