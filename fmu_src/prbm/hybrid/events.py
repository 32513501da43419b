"""Events: their kinds."""

from enum import IntEnum


class EventKind(IntEnum):
    """The kind of an event; 0 is that of none."""

    IMPACT = 1
    """The gap of an open stop closes: an impact or a capture."""
    RELEASE = 2
    """The force of a held stop falls to zero."""
    SLIP = 3
    """A sticking contact reaches the limit of friction."""
    REVERSAL = 4
    """The sliding velocity of a contact falls to zero: it sticks or slips back."""
