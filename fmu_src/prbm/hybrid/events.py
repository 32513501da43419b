"""Events: their kinds, the table of guards and resets, and the first event of a step."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum

from ..base.errors import SimulationError
from ..base.tolerances import EVENT_WINDOW_RTOL, EVENTS_MAX
from . import compliant, contact_modes, guards, impacts, spring_phases
from .configuration import Configuration, contact_names
from .front import Front
from .guards import Guard, StepView
from .records import Impact


class EventKind(IntEnum):
    """The kind of an event; in the C kernel, 0 is no event.

    Events at one time are applied in this order.  Impacts come last, because their resolution needs
    valid contact modes.
    """

    RELEASE = 1
    """The force of a held stop falls to zero."""
    SLIP = 2
    """A sticking contact reaches the limit of friction."""
    REVERSAL = 3
    """The sliding velocity of a contact falls to zero: it sticks or slips the other way."""
    SIDE = 4
    """The force of a guide that slips changes its side."""
    SWITCH = 5
    """The phase of a contact at a compliant stop changes, see :class:`.contact_state.Phase`."""
    SEPARATION = 6
    """The indentation of a compliant stop falls to zero: the contact ends."""
    ACTION = 7
    """A spring that acts on one side begins or ceases to act, see :mod:`.spring_phases`."""
    IMPACT = 8
    """The gap of an open stop closes: an impact or a capture, or the first touch of a contact."""


@dataclass(frozen=True)
class Event:
    """An event of a contact at a time [s]; see :mod:`prbm.mechanics.contact_state`.

    The springs are numbered after the contacts.
    """

    kind: EventKind
    contact: int
    time: float


Reset = Callable[[Configuration, Front, int], tuple[Front, list[Impact]]]


@dataclass(frozen=True)
class Transition:
    """A row of the table of events.

    The event is the fall of the guard, z > 0 -> z <= 0, at one of the contacts that are watched.

    Parameters
    ----------
    kind : EventKind
        Kind of the event.
    guard : Guard
        The scalar z, positive before the event.
    watched : callable
        Returns the contacts whose guard may fall in a step.
    detect : callable
        Returns when the guard of a contact falls in a step, or None.
    reset : Reset
        The change of state at the event.
    """

    kind: EventKind
    guard: Guard
    watched: Callable[[StepView], Sequence[int]]
    detect: Callable[[StepView, Guard, int], float | None]
    reset: Reset


def _choosing_modes(change: Callable[[Configuration, Front, int], Front]) -> Reset:
    """Return a change of the contact modes as a reset without impacts."""
    return lambda configuration, front, contact: (change(configuration, front, contact), [])


TRANSITIONS = (
    Transition(
        EventKind.RELEASE, guards.stop_force, guards.releasing_stops, guards.release_time,
        _choosing_modes(contact_modes.release),
    ),
    Transition(
        EventKind.SLIP, guards.friction_margin, guards.sticking_contacts, guards.slip_time,
        _choosing_modes(contact_modes.slip),
    ),
    Transition(
        EventKind.REVERSAL, guards.slip_speed, guards.slipping_contacts, guards.reversal_time,
        _choosing_modes(contact_modes.reverse),
    ),
    Transition(
        EventKind.SIDE, guards.guide_force, guards.slipping_guides, guards.side_time,
        _choosing_modes(contact_modes.change_side),
    ),
    Transition(
        EventKind.SWITCH, guards.switching, guards.pressed_stops, guards.switching_time,
        _choosing_modes(compliant.switch),
    ),
    Transition(
        EventKind.SEPARATION, guards.indentation, guards.pressed_stops, guards.closing_time,
        compliant.separate,
    ),
    Transition(
        EventKind.ACTION, spring_phases.action, spring_phases.watched, spring_phases.action_time,
        _choosing_modes(contact_modes.act),
    ),
    Transition(
        EventKind.IMPACT, guards.gap, guards.open_stops, guards.closing_time, impacts.impact,
    ),
)  # fmt: skip
"""Guards and resets of all events, in the order of their kinds."""

_RESETS = {row.kind: row.reset for row in TRANSITIONS}


def first_event(view: StepView) -> Event | None:
    """Return the first event within a step, or None.

    Raises
    ------
    SimulationError
        If an event cannot be located.
    """
    first: Event | None = None
    for row in TRANSITIONS:
        for contact in row.watched(view):
            t = _located(view, row, contact)
            if t is not None and (first is None or t < first.time):
                first = Event(row.kind, contact, t)
    return first


def _located(view: StepView, row: Transition, contact: int) -> float | None:
    """Return when an event of a contact occurs in a step, or None."""
    try:
        return row.detect(view, row.guard, contact)
    except SimulationError as error:
        mechanism = view.equations.system.mechanism
        raise SimulationError(
            f"no {row.kind.name.lower()} of {contact_names(mechanism, [contact])} could be located "
            f"within {view.arc.h:.3g} s from t = {view.arc.start:.9g} s: {error}"
        ) from None


def apply(configuration: Configuration, front: Front, event: Event) -> tuple[Front, list[Impact]]:
    """Return the front after an event at its time, and the impacts that were counted."""
    return _RESETS[event.kind](configuration, front, event.contact)


@dataclass(frozen=True)
class EventWindow:
    """The number of events since a time [s], by which a simulation that chatters is rejected.

    A change of the phase of a compliant stop or of a spring does not count: the motion is
    continuous there, and the steps are counted, see :mod:`prbm.hybrid.effort`.
    """

    since: float
    count: int = 0

    def counting(self, event: Event, configuration: Configuration) -> "EventWindow":
        """Return the window with one more event.

        Raises
        ------
        SimulationError
            If there are more than ``EVENTS_MAX`` within ``EVENT_WINDOW_RTOL`` of the period.
        """
        window = self
        if event.kind in (EventKind.SWITCH, EventKind.ACTION):
            return window
        if event.time - window.since > EVENT_WINDOW_RTOL * configuration.scales.time:
            window = EventWindow(event.time)
        window = EventWindow(window.since, window.count + 1)
        if window.count > EVENTS_MAX:
            raise SimulationError(
                f"more than {EVENTS_MAX} events (last: {event.kind.name.lower()}) within "
                f"{event.time - window.since:.3g} s at t = {event.time:.9g} s: the contact "
                "chatters; raise rest_speed or damping.beta, lower the restitution, or give "
                "the body room between its walls"
            )
        return window
