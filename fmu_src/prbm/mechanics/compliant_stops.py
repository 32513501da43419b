"""The compliant stops of a system: their forces, and the states that they add to a motion.

Behind the energies, the state of a motion has four values of each compliant stop: the displacement
of the wall by the contact force [m], its rate [m/s], the integral of the force [N s], and the
energy that the contact has dissipated [J].  The displacement u of a wall with a mobility follows
from u'' = mobility F; it is part of the gap.
"""

from collections.abc import Mapping
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from .arrays import Real
from .compliance import ComplianceLaw, damping_factor
from .contact_state import ContactState
from .inputs import Inputs

COMPLIANT_STATES = 4


class CompliantState(IntEnum):
    """The index of each state of a compliant stop."""

    RECOIL = 0
    RECOIL_RATE = 1
    IMPULSE = 2
    LOSS = 3


class Pressure(NamedTuple):
    """Forces and indentations of the pressed stops, (p,).

    Parameters
    ----------
    force, elastic : (p,)
        Forces on the body, and their elastic parts [N].
    depth, rate : (p,)
        Indentations [m], and their rates [m/s].
    """

    force: Real
    elastic: Real
    depth: Real
    rate: Real

    @property
    def loss(self) -> Real:
        """Powers that the contacts dissipate, (p,) [W]."""
        return (self.force - self.elastic) * self.rate


_factor = lru_cache(maxsize=64)(damping_factor)


class CompliantStops:
    """The compliant stops of a mechanism in one state of the contacts.

    Parameters
    ----------
    mechanism : Mechanism
        Description.
    values : mapping
        Values of all parameters.
    contacts : ContactState
        The modes and contacts of all stops.
    """

    def __init__(
        self, mechanism: Mechanism, values: Mapping[str, float], contacts: ContactState
    ) -> None:
        self.stops = [i for i, stop in enumerate(mechanism.stops) if stop.compliant]
        self.pressed = list(contacts.pressed)
        self.contacts = contacts
        self.laws = {i: law_of(mechanism, values, i) for i in self.stops}
        self.size = COMPLIANT_STATES * len(self.stops)

    def index(self, stop: int, extra: CompliantState) -> int:
        """Return the index of a state of a compliant stop behind the energies."""
        return COMPLIANT_STATES * self.stops.index(stop) + extra

    def add_recoils(self, extras: Real | None, x: Real, extra: CompliantState) -> None:
        """Add the displacements of the walls by contact forces, or their rates, to x (..., s)."""
        if extras is not None and self.stops:
            x[..., self.stops] += extras[..., extra::COMPLIANT_STATES]

    def pressure(self, gaps: Real, rates: Real) -> Pressure:
        """Return the forces of the pressed stops for the gaps of all stops and their rates."""
        depth, rate = -gaps[self.pressed], -rates[self.pressed]
        both = list(zip(self.pressed, depth.tolist(), rate.tolist(), strict=True))
        elastic = np.array([self.laws[i].elastic_force(d) for i, d, _ in both])
        force = np.array([self.force(i, d, u) for i, d, u in both])
        return Pressure(force, elastic, depth, rate)

    def force(self, stop: int, depth: float, rate: float) -> float:
        """Return the force of a pressed stop [N]."""
        touching = self.contacts.touching[stop]
        assert touching is not None
        return self.laws[stop].force(touching, depth, rate)

    def rates(self, extras: Real, inputs: Inputs, normal: Real) -> Real:
        """Return the rates of the states of all compliant stops for normal forces (s,) [N].

        The walls of frozen stops do not give way.  Losses are added by the equations.
        """
        result = np.zeros(self.size)
        for k, i in enumerate(self.stops):
            at = COMPLIANT_STATES * k
            result[at + CompliantState.RECOIL] = extras[at + CompliantState.RECOIL_RATE]
            if i in self.pressed:
                result[at + CompliantState.RECOIL_RATE] = inputs.mobilities[i] * normal[i]
            result[at + CompliantState.IMPULSE] = normal[i]
        return result

    def energy(self, gaps: Real) -> float:
        """Return the elastic energy of the closed compliant stops for the gaps of all stops [J]."""
        closed = (i for i in self.stops if self.contacts.touching[i])
        return sum(self.laws[i].energy(float(gaps[i])) for i in closed)


def law_of(mechanism: Mechanism, values: Mapping[str, float], stop: int) -> ComplianceLaw:
    """Return the law of a compliant stop."""
    stiffness, exponent, restitution = (
        value(mechanism.stops[stop], name, values)
        for name in ("stiffness", "exponent", "restitution")
    )
    return ComplianceLaw(stiffness, exponent, _factor(restitution))
