"""The modes of the contacts: the discrete state of a mechanism.

Contacts are numbered in one list, the stops first, then the friction points.
"""

from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property


class ContactMode(IntEnum):
    """The mode of a contact.  A friction point is never open."""

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


@dataclass(frozen=True)
class ContactState:
    """The modes of all contacts.

    Parameters
    ----------
    modes : (s + f,) tuple of ContactMode
        Modes of the s stops, then of the f friction points.
    stops : int
        Number of stops s.

    Examples
    --------
    >>> state = ContactState.free(stops=2, points=1).with_mode(1, ContactMode.STICK)
    >>> state.held, state.is_stop(2), state.without_friction().modes[1].name
    ((1,), False, 'FRICTIONLESS')
    """

    modes: tuple[ContactMode, ...]
    stops: int

    @classmethod
    def free(cls, stops: int, points: int) -> "ContactState":
        """Return the state with all stops open and no friction at the friction points."""
        return cls.holding((), stops, points)

    @classmethod
    def holding(
        cls, held: "tuple[int, ...] | list[int]", stops: int, points: int
    ) -> "ContactState":
        """Return the state in which some stops are closed, without friction anywhere."""
        modes = [ContactMode.OPEN] * stops + [ContactMode.FRICTIONLESS] * points
        for i in held:
            modes[i] = ContactMode.FRICTIONLESS
        return cls(tuple(modes), stops)

    @property
    def points(self) -> int:
        """Number of friction points f."""
        return len(self.modes) - self.stops

    @cached_property
    def held(self) -> tuple[int, ...]:
        """The closed stops in rising order."""
        return tuple(i for i in range(self.stops) if self.modes[i].closed)

    @cached_property
    def open_stops(self) -> tuple[int, ...]:
        """The open stops in rising order."""
        return tuple(i for i in range(self.stops) if not self.modes[i].closed)

    def is_stop(self, contact: int) -> bool:
        """Return whether a contact is a stop, not a friction point."""
        return contact < self.stops

    def with_mode(self, contact: int, mode: ContactMode) -> "ContactState":
        """Return the state in which one contact has another mode."""
        modes = list(self.modes)
        modes[contact] = mode
        return replace(self, modes=tuple(modes))

    def released(self, stop: int) -> "ContactState":
        """Return the state in which a stop is open."""
        return self.with_mode(stop, ContactMode.OPEN)

    def opened(self) -> "ContactState":
        """Return the state in which all stops are open; friction points keep their modes."""
        open_stops = (ContactMode.OPEN,) * self.stops
        return replace(self, modes=open_stops + self.modes[self.stops :])

    def without_friction(self) -> "ContactState":
        """Return the state in which sticking contacts are frictionless."""
        modes = (
            ContactMode.FRICTIONLESS if mode is ContactMode.STICK else mode for mode in self.modes
        )
        return replace(self, modes=tuple(modes))
