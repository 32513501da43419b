"""The modes of the contacts: the discrete state of a mechanism.

Contacts are numbered in one list, the stops first, then the friction points, then the guides with
friction.  A closed stop is a constraint (it is held) or, if it is compliant and not frozen, a force
(it is pressed).  A guide pushes to either side of its line; the side is part of the state.
"""

from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property


class ContactMode(IntEnum):
    """The mode of a contact.  Friction points and guides are never open."""

    OPEN = 0
    FRICTIONLESS = 1
    """Closed without a friction force: it has no friction, or other contacts carry the load."""
    STICK = 2
    SLIP_POSITIVE = 3
    SLIP_NEGATIVE = 4

    @property
    def closed(self) -> bool:
        """Whether the contact is closed."""
        return self is not ContactMode.OPEN

    @property
    def slip(self) -> int:
        """Sign of the sliding velocity: 0 unless the contact slips."""
        return _SLIP_SIGNS[self]

    @staticmethod
    def slipping(sign: float) -> "ContactMode":
        """Return the mode in which a contact slips in the direction of a sign.

        Examples
        --------
        >>> ContactMode.slipping(-1).name
        'SLIP_NEGATIVE'
        """
        return ContactMode.SLIP_POSITIVE if sign > 0 else ContactMode.SLIP_NEGATIVE


_SLIP_SIGNS = (0, 0, 0, 1, -1)


class Phase(IntEnum):
    """The phase of a contact at a compliant stop; see :mod:`prbm.mechanics.compliance`."""

    PRESSED = 1
    """The force follows the law with a constant reference speed."""
    RISING = 2
    """The reference speed follows the closing speed, which exceeds it and grows."""
    FREE = 3
    """There is no force: the surfaces have separated while the indentation recovers."""
    FROZEN = 4
    """The indentation is constant: the stop is a constraint."""


@dataclass(frozen=True)
class ContactPhase:
    """A contact at a compliant stop.

    Parameters
    ----------
    phase : Phase
        Phase of the contact.
    reference_speed : float
        Largest closing speed so far in this contact, at least ``rest_speed`` [m/s].
    depth : float
        Indentation of a frozen stop [m]; 0 in other phases.
    """

    phase: Phase
    reference_speed: float
    depth: float = 0.0


class SpringPhase(IntEnum):
    """The phase of a spring, which changes only if it acts on one side; see :mod:`.elements`."""

    SLACK = 0
    """There is no force: the spring is on the other side of its free length."""
    ACTING = 1
    """The force follows the law."""
    LAGGING = 2
    """There is no force: the spring is strained, but its damper holds it back from its ends."""


@dataclass(frozen=True)
class ContactState:
    """The modes of all contacts, and the phases of springs.

    Parameters
    ----------
    modes : (s + f,) tuple of ContactMode
        Modes of the s stops, then of the f friction points and guides with friction.
    stops : int
        Number of stops s.
    touching : (s,) tuple of ContactPhase or None
        The contacts at compliant stops that are closed; None for all other stops.
    sides : (f,) tuple of int
        The side to which a guide pushes while it slips: 1 to the left of its line, -1 to the right.
        It is 1 at friction points.
    springs : (c,) tuple of SpringPhase
        Phases of all springs; empty if none acts on one side, or if they follow from the lengths.

    Examples
    --------
    >>> state = ContactState.free(stops=2, points=1).held_with(1, ContactMode.STICK)
    >>> state.held, state.is_stop(2), state.without_friction().modes[1].name
    ((1,), False, 'FRICTIONLESS')
    """

    modes: tuple[ContactMode, ...]
    stops: int
    touching: tuple[ContactPhase | None, ...] = ()
    sides: tuple[int, ...] = ()
    springs: tuple[SpringPhase, ...] = ()

    def __post_init__(self) -> None:
        if len(self.touching) != self.stops:
            object.__setattr__(self, "touching", (None,) * self.stops)
        if len(self.sides) != len(self.modes) - self.stops:
            object.__setattr__(self, "sides", (1,) * (len(self.modes) - self.stops))

    @classmethod
    def free(cls, stops: int, points: int) -> "ContactState":
        """Return the state with all stops open and no friction at the friction points."""
        return cls((ContactMode.OPEN,) * stops + (ContactMode.FRICTIONLESS,) * points, stops)

    @cached_property
    def held(self) -> tuple[int, ...]:
        """The closed stops that are constraints, in rising order."""
        return tuple(i for i in range(self.stops) if self.modes[i].closed and i not in self.pressed)

    @cached_property
    def pressed(self) -> tuple[int, ...]:
        """The closed stops that are forces, in rising order."""
        return tuple(
            i for i, one in enumerate(self.touching) if one and one.phase is not Phase.FROZEN
        )

    @cached_property
    def open_stops(self) -> tuple[int, ...]:
        """The open stops in rising order."""
        return tuple(i for i in range(self.stops) if not self.modes[i].closed)

    def is_stop(self, contact: int) -> bool:
        """Return whether a contact is a stop, not a friction point."""
        return contact < self.stops

    def is_free(self, stop: int) -> bool:
        """Return whether the contact at a compliant stop is free of force."""
        touching = self.touching[stop]
        return touching is not None and touching.phase is Phase.FREE

    def depth(self, stop: int) -> float:
        """Return the indentation at which a held stop is a constraint [m]."""
        touching = self.touching[stop]
        return touching.depth if touching else 0.0

    def side(self, contact: int) -> int:
        """Return the side to which a slipping contact is pushed; 1 at stops."""
        return 1 if self.is_stop(contact) else self.sides[contact - self.stops]

    def with_side(self, contact: int, side: int) -> "ContactState":
        """Return the state in which a guide pushes to a side."""
        sides = list(self.sides)
        sides[contact - self.stops] = side
        return replace(self, sides=tuple(sides))

    def with_mode(self, contact: int, mode: ContactMode) -> "ContactState":
        """Return the state in which one contact has another mode."""
        modes = list(self.modes)
        modes[contact] = mode
        return replace(self, modes=tuple(modes))

    def with_touching(self, stop: int, touching: ContactPhase | None) -> "ContactState":
        """Return the state in which a compliant stop has another contact; None: it is open."""
        every, mode = list(self.touching), self.modes[stop]
        every[stop] = touching
        if touching is None:
            mode = ContactMode.OPEN
        elif touching.phase is Phase.FREE or not mode.closed:
            mode = ContactMode.FRICTIONLESS
        return replace(self, touching=tuple(every)).with_mode(stop, mode)

    def with_spring(self, spring: int, phase: SpringPhase) -> "ContactState":
        """Return the state in which one spring has another phase."""
        springs = list(self.springs)
        springs[spring] = phase
        return replace(self, springs=tuple(springs))

    def held_with(self, stop: int, mode: ContactMode) -> "ContactState":
        """Return the state in which a stop that touches is a constraint with a mode."""
        touching, result = self.touching[stop], self
        if touching:
            result = self.with_touching(stop, replace(touching, phase=Phase.FROZEN))
        return result.with_mode(stop, mode)

    def released(self, stop: int) -> "ContactState":
        """Return the state in which a stop is no constraint: open, or pressed if compliant."""
        touching = self.touching[stop]
        if touching is None:
            return self.with_mode(stop, ContactMode.OPEN)
        return self.with_touching(stop, replace(touching, phase=Phase.PRESSED))

    def opened(self) -> "ContactState":
        """Return the state in which no stop is a constraint; other contacts keep their modes."""
        result = self
        for stop in self.held:
            result = result.released(stop)
        return result

    def unloaded(self) -> "ContactState":
        """Return the state in which stops that are constraints have no force."""
        result = self.opened()
        for stop in self.held:
            touching = self.touching[stop]
            if touching:
                result = result.with_touching(stop, replace(touching, phase=Phase.FREE))
        return result

    def holding(self, stops: "tuple[int, ...] | list[int]") -> "ContactState":
        """Return the state in which only these stops are constraints, without friction anywhere."""
        result = self.opened()
        for stop in stops:
            result = result.held_with(stop, ContactMode.FRICTIONLESS)
        modes = (m if m is ContactMode.OPEN else ContactMode.FRICTIONLESS for m in result.modes)
        return replace(result, modes=tuple(modes))

    def without_friction(self) -> "ContactState":
        """Return the state in which sticking contacts are frictionless."""
        modes = (
            ContactMode.FRICTIONLESS if mode is ContactMode.STICK else mode for mode in self.modes
        )
        return replace(self, modes=tuple(modes))
