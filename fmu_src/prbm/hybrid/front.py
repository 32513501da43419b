"""The front: the state up to which the motion is computed, and the contact modes from there on."""

from dataclasses import dataclass, replace

from ..mechanics.arrays import Complex, Real
from ..mechanics.contact_state import ContactState
from ..mechanics.dynamics import Equations
from ..mechanics.inputs import Inputs, Wall


@dataclass(frozen=True)
class Latched:
    """Outputs of the last impact at a stop; zeros before the first impact."""

    impact_count: int = 0
    impact_time: float = 0.0
    approach_speed: float = 0.0
    rebound_speed: float = 0.0
    impulse: float = 0.0
    energy_lost: float = 0.0
    modal_restitution: float = 0.0
    impulse_sum: float = 0.0
    """Sum of all impulses so far, including those of captures."""


@dataclass(frozen=True)
class Front:
    """The state up to which the motion is computed.

    Parameters
    ----------
    time : float
        Time of the state [s].
    y : (2 n + 2,)
        Angles, rates, dissipated energy and work [rad], [rad/s], [J], [J].
    equations : Equations
        Equations of the motion from this time on: system, inputs with walls, contact modes.
    latched : (s,) tuple of Latched
        The last impact of each stop.
    """

    time: float
    y: Real
    equations: Equations
    latched: tuple[Latched, ...]

    @property
    def q(self) -> Real:
        """Angles [rad], (n,)."""
        return self.y[: self.equations.n]

    @property
    def v(self) -> Real:
        """Rates [rad/s], (n,)."""
        n = self.equations.n
        return self.y[n : 2 * n]

    @property
    def e(self) -> Complex:
        """Directions, (n,)."""
        return self.equations.system.directions(self.q)

    @property
    def contacts(self) -> ContactState:
        """The modes of the contacts."""
        return self.equations.contacts

    @property
    def inputs(self) -> Inputs:
        """Forces, walls and the acceleration of the base."""
        return self.equations.inputs

    def with_contacts(self, contacts: ContactState) -> "Front":
        """Return the front with other modes of the contacts."""
        return replace(self, equations=self.equations.with_contacts(contacts))

    def with_walls(self, walls: tuple[Wall, ...]) -> "Front":
        """Return the front with other motions of the walls."""
        inputs = replace(self.inputs, walls=walls)
        return replace(self, equations=self.equations.with_inputs(inputs))

    def with_velocities(self, v: Real, dissipated: float = 0.0, work: float = 0.0) -> "Front":
        """Return the front with other rates, and with energies added [J]."""
        n, y = self.equations.n, self.y.copy()
        y[n : 2 * n] = v
        y[2 * n] += dissipated
        y[2 * n + 1] += work
        return replace(self, y=y)

    def gaps_and_rates(self) -> tuple[Real, Real]:
        """Return the gaps of all stops [m] and their rates [m/s]."""
        e = self.e
        return self.equations.gaps(self.time, e), self.equations.gap_rates(self.time, e, self.v)

    def projected(self) -> "Front":
        """Return the front with its state projected onto the constraints."""
        return replace(self, y=self.equations.project(self.time, self.y))
