"""The start of a motion: the released shape and velocity, and the contacts there."""

import numpy as np

from ..base.errors import ParameterError
from ..mechanics.contact_state import ContactState
from ..mechanics.inputs import Inputs
from ..mechanics.positions import start_velocity
from ..mechanics.start import start_shape
from . import spring_phases
from .compliant import preloaded, rephased
from .configuration import Configuration
from .contact_modes import choose_modes
from .front import Front, Latched
from .impacts import impact


class PenetrationError(ParameterError):
    """A rigid wall is penetrated at release.

    Parameters
    ----------
    stop : str
        Name of the stop.
    depth, wall : float
        Penetration, and position of the wall [m].
    """

    def __init__(self, stop: str, depth: float, wall: float) -> None:
        super().__init__(stop, depth, wall)
        self.stop, self.depth, self.wall = stop, depth, wall

    def __str__(self) -> str:
        return self.message("at release", "move the stop or release further back")

    def message(self, start: str, remedy: str) -> str:
        """Return the message with the name of the start and a remedy."""
        return (
            f"the wall {self.stop} is penetrated by {self.depth:.6g} m {start}: "
            f"{self.stop}.position = {self.wall:.6g} m, the hit point is at "
            f"{self.wall + self.depth:.6g} m; {remedy}"
        )


def released(configuration: Configuration, inputs: Inputs, time: float) -> Front:
    """Return the front at the release.

    Parameters
    ----------
    configuration : Configuration
        Mechanism and parameters.
    inputs : Inputs
        Forces, walls and the acceleration of the base.
    time : float
        Time of the release [s].

    Raises
    ------
    EquilibriumError
        If no equilibrium has the displacement or the angle of the release.
    ParameterError
        If a wall is penetrated, the loops do not allow the velocity of the release, or its mode
        does not move the released point.
    """
    mechanism, system = configuration.mechanism, configuration.system
    q = start_shape(system, configuration.values)
    velocity = start_velocity(system, q, configuration.values)
    stops = len(mechanism.stops)
    contacts = ContactState.free(stops, len(mechanism.rubbing))
    equations = configuration.equations(inputs, contacts)
    y = np.concatenate([q, velocity, np.zeros(2 + equations.compliant.size)])
    front = Front(time, y, equations, (Latched(),) * stops, (None,) * stops).projected()
    front = _on_frictionless_sides(spring_phases.begun(configuration, front))
    check_walls(configuration, front)
    gaps, rates = front.gaps_and_rates()
    for i in equations.compliant.stops:
        if gaps[i] < 0.0:
            front = preloaded(configuration, front, i)
    for i in contacts.open_stops:
        if (
            gaps[i] <= configuration.scales.penetration
            and rates[i] < 0.0
            and not front.contacts.touching[i]
        ):
            front, _ = impact(configuration, front, i)
            break
    rigid = [i for i in range(stops) if i not in equations.compliant.stops]
    return choose_modes(configuration, rephased(front), resting=rigid)


def _on_frictionless_sides(front: Front) -> Front:
    """Return the front with each rough guide on the side to which it would push without friction.

    With a large coefficient of friction several sides may satisfy the laws (Painleve's paradox).
    A motion begins with the one that the force has while the coefficient grows from zero.
    """
    contacts, equations = front.contacts, front.equations
    guides = [c for c in range(contacts.stops, len(contacts.modes)) if equations.is_guide(c)]
    lam = front.evaluate().lam if guides else np.zeros(0)
    for c in guides:
        contacts = contacts.with_side(c, -1 if lam[equations.normal_row(c)] < 0.0 else 1)
    return front.with_contacts(contacts)


def check_walls(configuration: Configuration, front: Front) -> None:
    """Reject a rigid wall that is penetrated; the penetration of a compliant one is a preload.

    Raises
    ------
    PenetrationError
        If a gap is negative by more than ``RELEASE_PENETRATION_RTOL`` of the size.
    """
    gaps, _ = front.gaps_and_rates()
    for i, stop in enumerate(configuration.mechanism.stops):
        if gaps[i] < -configuration.scales.penetration and not stop.compliant:
            raise PenetrationError(stop.name, -gaps[i], front.inputs.walls[i].position)
