"""One hit of finite elements on a compliant stop: the fundamental mode arrives alone."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.errors import SimulationError
from ...mechanics.arrays import Real
from ...mechanics.compliance import ComplianceLaw, damping_factor
from ...mechanics.contact_state import ContactPhase, Phase
from ...mechanics.modal import simulated_restitution
from ...mechanics.system import unit
from ...mechanism.parts import GROUND, value
from .elements import FiniteElements
from .model import FiniteElementError

SPECTRAL_RADIUS = 0.8


@dataclass(frozen=True)
class ElementHit:
    """A hit of finite elements on a compliant stop.

    Parameters
    ----------
    restitution : float
        Modal restitution, by the mode at first touch [-].
    force : float
        Largest contact force [N].
    duration : float
        Time from first touch to separation [s].
    """

    restitution: float
    force: float
    duration: float


class _Contact:
    """The contact force of a stop in Exudyn, and its record over the steps.

    Parameters
    ----------
    fe : FiniteElements
        The mechanism.
    stop : int
        Index of the stop.
    speed : float
        Closing speed at first touch [m/s].
    """

    def __init__(self, fe: FiniteElements, stop: int, speed: float) -> None:
        self.fe, self.stop = fe, stop
        s, values = fe.mechanism.stops[stop], fe.values
        if not s.compliant or s.on != GROUND:
            raise FiniteElementError(f"{s.name} must be a compliant stop on the ground")
        k, n, e = (value(s, name, values) for name in ("stiffness", "exponent", "restitution"))
        self.law, self.u = ComplianceLaw(k, n, damping_factor(e)), unit(s.direction)
        self.reference = max(speed, value(s, "rest_speed", values))
        self.path: list[tuple[float, float, float]] = []  # time, indentation, force
        self.states: list[Real] = []
        self.ended = False
        self._connect(s.body, fe.model.hit_point(s), value(s, "position", values))

    def _connect(self, body: str, drawn: complex, position: float) -> None:
        model = self.fe.model
        ends = (GROUND, drawn + position * self.u), (body, drawn)
        markers = []
        for name, place in ends:
            rigid = model.rigid[name]
            z = place - rigid.centre
            markers.append(int(model.mbs.AddMarker(model.items.MarkerBodyPosition(
                bodyNumber=rigid.object, localPosition=[z.real, z.imag, 0.0]
            ))))  # fmt: skip
        model.mbs.AddObject(model.items.ObjectConnectorCartesianSpringDamper(
            markerNumbers=markers, stiffness=[self.law.stiffness] * 3,
            springForceUserFunction=self._vector,
        ))  # fmt: skip
        model.mbs.Assemble()

    def force(self, d: float, rate: float) -> float:
        """Return the contact force at an indentation [m] and its rate [m/s]."""
        if d <= 0.0:
            return 0.0
        return max(0.0, self.law.force(ContactPhase(Phase.PRESSED, self.reference), d, rate))

    def _vector(self, mbs: Any, t: float, item: int, moved: Any, rate: Any, *_: Any) -> list[float]:
        d, u = (x[0] * self.u.real + x[1] * self.u.imag for x in (moved, rate))
        F = self.force(d, u)
        return [F * self.u.real, F * self.u.imag, 0.0]

    def after_step(self, mbs: Any, t: float) -> bool:
        """Record a step; return whether the contact continues."""
        data = mbs.systemData
        q, v = (np.array(x) for x in (data.GetODE2Coordinates(), data.GetODE2Coordinates_t()))
        d, rate = -self.fe.gap(self.stop, q), -float(self.fe.gap_row(self.stop, q) @ v)
        self.reference = max(self.reference, rate)
        self.path.append((float(t), d, self.force(d, rate)))
        self.states.append(v)
        self.ended = t > 0.0 and d <= 0.0
        return not self.ended


def compliant_hit(
    fe: FiniteElements, speed: float, duration: float, steps: int, *, stop: int = 0
) -> ElementHit:
    """Return the hit of a pure fundamental mode on a compliant stop whose gap is closed.

    The elements start in the static shape at the position of the wall.  Exudyn integrates with
    equal steps of the generalised-alpha method.  The contact force is that of compliant stops.

    Parameters
    ----------
    fe : FiniteElements
        The mechanism; the force of the contact is added to its elements.
    speed : float
        Closing speed [m/s].
    duration : float
        Estimate of the duration of the contact [s].
    steps : int
        Number of steps in this time.
    stop : int
        Index of the stop.

    Raises
    ------
    FiniteElementError
        If the stop is rigid or not on the ground.
    SimulationError
        If the contact lasts longer than twice the estimate.
    """
    shape = fe.equilibrium(value(fe.mechanism.stops[stop], "position", fe.values))
    phi, M = fe.modes(shape).shape[:, 0], fe.M
    before = phi * (-speed / float(fe.gap_row(stop, shape.q) @ phi))
    contact = _Contact(fe, stop, speed)
    mbs, exu = fe.model.mbs, fe.model.exu
    mbs.systemData.SetODE2Coordinates(shape.q.tolist(), exu.ConfigurationType.Initial)
    mbs.systemData.SetODE2Coordinates_t(before.tolist(), exu.ConfigurationType.Initial)
    settings = fe.equations.settings()
    settings.timeIntegration.endTime = 2.0 * duration
    settings.timeIntegration.numberOfSteps = 2 * steps
    settings.timeIntegration.generalizedAlpha.spectralRadius = SPECTRAL_RADIUS
    mbs.SetPostStepUserFunction(contact.after_step)
    mbs.SolveDynamic(settings)
    if not contact.ended:
        raise SimulationError(f"the contact lasts longer than {2.0 * duration:g} s")
    (t0, d0, _), (t1, d1, _) = contact.path[-2:]
    share = d0 / (d0 - d1)
    after = contact.states[-2] + share * (contact.states[-1] - contact.states[-2])
    return ElementHit(
        simulated_restitution(phi, M, before, after), _top([F for *_, F in contact.path]),
        t0 + share * (t1 - t0),
    )  # fmt: skip


def _top(forces: list[float]) -> float:
    """Return the maximum of the parabola through the largest of equidistant values."""
    k = int(np.argmax(forces))
    if not 0 < k < len(forces) - 1:
        return forces[k]
    a, b, c = forces[k - 1 : k + 2]
    return b + (a - c) ** 2 / (8.0 * (2.0 * b - a - c))
