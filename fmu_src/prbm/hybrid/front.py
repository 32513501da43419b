"""The front: the state up to which the motion is computed, and the contact modes from there on."""

from dataclasses import dataclass, field, replace

from ..mechanics.arrays import Complex, Real
from ..mechanics.contact_problem import ContactProblem
from ..mechanics.contact_state import ContactState
from ..mechanics.dynamics import Equations, Evaluation
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
    """Sum of all impulses so far, including those of captures; not of compliant stops, for which a
    state of the motion is the integral of the force."""
    peak_force: float = 0.0
    indentation: float = 0.0
    contact_duration: float = 0.0
    """Outputs of compliant stops; the running maxima belong to a time in the motion."""


@dataclass(frozen=True)
class ContactStart:
    """The begin of a contact at a compliant stop, from which its outputs are computed.

    Parameters
    ----------
    time : float
        Time of first touch [s].
    counted : bool
        Whether the contact is an impact whose outputs are not yet latched.
    impulse, loss : float
        Integral of the force [N s] and dissipated energy [J] of the stop before the contact.
    q, v : (n,) tuple of float
        Coordinates and rates at first touch.
    momentum : (n,) tuple of float
        M phi of the fundamental mode phi at first touch.
    calm_since : float or None
        Time from which the contact has been calm enough to freeze [s].
    step : float
        Size of the integration steps before the contact, with which the next flight begins [s].
    """

    time: float
    counted: bool = False
    impulse: float = 0.0
    loss: float = 0.0
    q: tuple[float, ...] = ()
    v: tuple[float, ...] = ()
    momentum: tuple[float, ...] = ()
    calm_since: float | None = None
    step: float = 0.0


@dataclass(frozen=True)
class Front:
    """The state up to which the motion is computed.

    Parameters
    ----------
    time : float
        Time of the state [s].
    y : (2 n + 2 + 4 c,)
        Angles, rates, dissipated energy and work [rad], [rad/s], [J], [J]; then the states of the
        c compliant stops, see :mod:`prbm.mechanics.compliant_stops`.
    equations : Equations
        Equations of the motion from this time on: system, inputs with walls, contact modes.
    latched : (s,) tuple of Latched
        The last impact of each stop.
    touches : (s,) tuple of ContactStart or None
        The begin of the contacts at compliant stops that are closed; None for other stops.
    """

    time: float
    y: Real
    equations: Equations
    latched: tuple[Latched, ...]
    touches: tuple[ContactStart | None, ...]
    _at: ContactProblem | None = field(default=None, repr=False, compare=False)

    @property
    def at(self) -> ContactProblem:
        """What the contacts share at the position; also for later fronts at this position."""
        known = self._at
        if known is None or not known.is_at(self.equations.system, self.q):
            known = ContactProblem(self.equations.system, self.q)
            object.__setattr__(self, "_at", known)
        return known

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
    def extras(self) -> Real:
        """States of the compliant stops, (4 c,)."""
        return self.y[2 * self.equations.n + 2 :]

    @property
    def e(self) -> Complex:
        """Directions, (n,)."""
        return self.at.e

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
        t, e, equations, extras = self.time, self.e, self.equations, self.extras
        return equations.gaps(t, e, extras), equations.gap_rates(t, e, self.v, extras)

    def evaluate(self) -> Evaluation:
        """Return accelerations and forces."""
        return self.equations.at(self.time, self.y)

    def with_start(self, stop: int, touch: ContactStart | None) -> "Front":
        """Return the front with another begin of the contact at a compliant stop."""
        touches = list(self.touches)
        touches[stop] = touch
        return replace(self, touches=tuple(touches))

    def with_latched(self, stop: int, latched: Latched) -> "Front":
        """Return the front with other outputs of the last impact at a stop."""
        every = list(self.latched)
        every[stop] = latched
        return replace(self, latched=tuple(every))

    def projected(self) -> "Front":
        """Return the front with its state projected onto the constraints."""
        return replace(self, y=self.equations.project(self.time, self.y))
