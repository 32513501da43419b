"""The shape from which a mechanism is released."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..base.errors import EquilibriumError, ParameterError, SimulationError
from ..base.tolerances import REPEATED_MODE_RTOL, STATICS_CONSTRAINT_RTOL
from ..mechanism.parts import POSITIONS, value
from .arrays import Real
from .constraints import project_positions
from .modal import modes, moved_by, unstable_directions
from .positions import given_at_start, positioned
from .statics import equilibrium, held_rows, resting, with_bodies_placed
from .system import System


class Instability(NamedTuple):
    """Numbers of unstable directions at the start.

    Parameters
    ----------
    rest : int
        Of the equilibrium under gravity, without stops.
    release : int
        Of the shape that is held at the displacement or the angle of the release; 0 if the release
        is along a mode, or if bodies are given positions.
    """

    rest: int
    release: int

    @property
    def sentences(self) -> tuple[str, ...]:
        """What a user should know about the unstable shapes."""
        said = []
        if self.rest:
            said.append(
                f"the equilibrium under gravity, without stops, is unstable in {self.rest} of its "
                "directions: mode.frequency is 0"
            )
        if self.release:
            said.append(
                f"the shape at release is unstable in {self.release} of its directions while it "
                "is held: a small disturbance determines how the motion begins; release closer to "
                "a stable shape"
            )
        return tuple(said)


def instability(system: System, values: Mapping[str, float]) -> Instability:
    """Return the numbers of unstable directions at the start, for the values of all parameters.

    Raises
    ------
    EquilibriumError
        If no equilibrium under gravity, or with the displacement or the angle, is found.
    """
    release, (rest, balanced) = system.mechanism.release, resting(system)
    held = 0
    if not release.mode and not given_at_start(system.mechanism, values, POSITIONS):
        placed = with_bodies_placed(system)
        shape = equilibrium(placed, value(release, release.start, values))
        found = modes(placed, shape)
        held = unstable_directions(found.frequency, moved_by(placed, shape.q, found.shape))
    unstable = unstable_directions(modes(system, rest).frequency) if balanced else 0
    return Instability(unstable, held)


def start_shape(system: System, values: Mapping[str, float], fraction: float = 1.0) -> Real:
    """Return the coordinates of the released shape, (n,).

    Bodies without flexures and joints are placed, those on springs too.  Positions that bodies are
    given replace that of the release, see :mod:`prbm.mechanics.positions`.

    Parameters
    ----------
    system : System
        The mechanism.
    values : mapping
        Values of all parameters.
    fraction : float
        Share of the displacement, angle or amplitude, or of the positions of bodies [-].

    Raises
    ------
    EquilibriumError
        If no equilibrium has the displacement, the angle or the positions, or no shape the
        amplitude.
    ParameterError
        If positions contradict the constraints or the release, there is no such mode, or it does
        not move the released point.
    """
    release = system.mechanism.release
    if given := given_at_start(system.mechanism, values, POSITIONS):
        return positioned(system, given, fraction)
    amount = fraction * value(release, release.start, values)
    if release.mode:
        return mode_shape(system, release.mode, amount)
    q = equilibrium(with_bodies_placed(system), amount).q
    open_by = system.loop_rows.values(system.directions(q))
    if np.abs(open_by).max(initial=0.0) <= STATICS_CONSTRAINT_RTOL * system.length:
        return q
    try:  # The released body was placed beside the line of a guide.
        return project_positions(system, held_rows(system, amount), q)[0]
    except SimulationError:
        raise EquilibriumError(
            f"release.{release.start} = {amount:g} {'rad' if release.turns else 'm'}: the guides "
            f"do not let the body {release.body} move there; reduce it, or choose another "
            "release.point or direction"
        ) from None


def mode_shape(system: System, mode: int, amplitude: float) -> Real:
    """Return the rest position under gravity displaced along a mode, (n,).

    The change of the coordinates is the mode, plus the least mass-weighted change that closes the
    loops and gives the released point the displacement exactly.

    Parameters
    ----------
    system : System
        The mechanism.
    mode : int
        Number of the mode, from 1.
    amplitude : float
        Displacement of the released point along the direction of the release, from the rest
        position [m].

    Raises
    ------
    EquilibriumError
        If no rest position, or no shape with the amplitude, is found.
    ParameterError
        If there is no such mode, another one has its frequency, or it does not move the released
        point.
    """
    rest = equilibrium(system)
    found = modes(system, rest)
    count, name = found.shape.shape[1], system.mechanism.release.body
    if mode > count:
        raise ParameterError(
            f"release.mode = {mode}: the mechanism has {count} modes; choose one of them, or a "
            "flexure model with more pivots"
        )
    squares = found.frequency * np.abs(found.frequency)
    apart = np.abs(squares - squares[mode - 1]) > REPEATED_MODE_RTOL * np.abs(squares).max()
    if count - np.count_nonzero(apart) > 1:
        raise ParameterError(
            f"release.mode = {mode}: another mode has the same frequency, so that its shape is "
            "not unique; choose another mode, or release by a displacement or an angle"
        )
    phi = found.shape[:, mode - 1]
    moved = float(moved_by(system, rest.q, phi[:, None])[0])
    if moved == 0.0:
        raise ParameterError(
            f"release.mode = {mode}: this mode does not move the released point of {name} along "
            "the direction of the release; choose another mode, release.point or direction"
        )
    if amplitude == 0.0:
        return rest.q
    start = rest.q + phi * (amplitude / moved)
    try:
        rows = held_rows(system, system.amount(rest.q) + amplitude)
        return project_positions(system, rows, start)[0]
    except SimulationError:
        raise EquilibriumError(
            f"release.amplitude = {amplitude:g} m: no shape along mode {mode} has this amplitude; "
            "reduce it, or choose another mode, release.point or direction"
        ) from None
