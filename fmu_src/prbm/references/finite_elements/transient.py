"""Transients of the finite elements: Exudyn integrates from event to event."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from ...base.errors import ParameterError, SimulationError
from ...hybrid.front import Latched
from ...hybrid.records import Impact
from ...mechanics.arrays import Real
from ...mechanics.modal import Modes, simulated_restitution
from ...mechanism.description import Mechanism
from ...mechanism.parts import value
from ...mechanism.supported import COMPLIANT_STOPS, check_supported
from ...runs.result import Result, structured
from .equations import Equations
from .model import ElementModel
from .statics import Shape

PENETRATION_ATOL = 1e-9  # Penetration of a wall that is round-off [m].
GAP_CLOSED_RTOL = 1e-10  # Gap at which an impact is located, relative to the size.
SECANTS_MAX = 12  # Secant steps of the location of an impact; bisection follows.
LOCATIONS_MAX = 60  # Secant steps and bisections of the location of an impact.
LOCATING_STEPS = (1, 4, 16, 64)  # Divisions of a step that does not converge.
SHORT_STEPS = 8  # Short steps in succession after a step that failed.
STEP_RATIO_MIN = 1 / 4096  # Shortest step, relative to the requested one.
END_TIME_RTOL = 1e-6  # Exudyn's rounding error at the end of an interval, relative to the step.
IMPACTS_MAX = 10_000
ENERGY_GAIN_RTOL = 0.01  # Largest gain of energy in a step, relative to the largest kinetic energy.

State = tuple[float, Real, Real]  # Time [s], displacements, velocities.


@dataclass
class _Log:
    """Rows and impacts of a transient so far."""

    times: list[float] = field(default_factory=list)
    q: list[Real] = field(default_factory=list)
    v: list[Real] = field(default_factory=list)
    held: list[tuple[bool, ...]] = field(default_factory=list)
    impacts: list[Impact] = field(default_factory=list)


class StepError(SimulationError):
    """A step of the integration did not converge."""


class Elements(Protocol):
    """What a transient needs of :class:`prbm.references.finite_elements.elements.FiniteElements`.

    Shapes q and velocities v are (n,).
    """

    mechanism: Mechanism
    model: ElementModel
    equations: Equations
    values: dict[str, float]
    n: int

    @property
    def M(self) -> Real:
        """Mass matrix, (n, n)."""

    def release(self) -> tuple[Real, Real]:
        """Return displacements and velocities at the release."""

    def equilibrium(self, displacement: float | None = None) -> Shape:
        """Return the equilibrium at a displacement along the release [m]."""

    def modes(self, shape: Shape) -> Modes:
        """Return the modes at an equilibrium."""

    def displacement(self, q: Real) -> float:
        """Return the displacement along the release [m]."""

    def gap(self, stop: int, q: Real) -> float:
        """Return the gap of a stop [m]."""

    def gap_row(self, stop: int, q: Real) -> Real:
        """Return the derivatives of a gap, (n,)."""

    def impact(
        self, q: Real, v: Real, struck: int, restitution: float, held: tuple[int, ...]
    ) -> tuple[Real, float]:
        """Return the velocities after an impact, and its impulse [N s]."""


class Transient:
    """One transient of finite elements.

    Parameters
    ----------
    fe : Elements
        The mechanism.
    step : float
        Step size [s].
    spectral_radius : float
        Spectral radius of the generalised-alpha method, below 1.
    """

    def __init__(self, fe: Elements, step: float, spectral_radius: float) -> None:
        self.fe, self.step, self.radius = fe, step, spectral_radius
        check_supported(fe.mechanism, "the transient of finite elements", COMPLIANT_STOPS)
        stops = fe.mechanism.stops
        self.held: set[int] = set()
        self.armed = [False] * len(stops)  # Whether the gap has opened since the last impact.
        self.latched = [Latched() for _ in stops]
        self.log = _Log()
        # Largest kinetic energy so far [J]; at first a small reference energy.
        self.kinetic_max = fe.model.energy

    def run(self, stop_time: float, impacts_max: int | None) -> Result:
        """Integrate from the release to the stop time [s], or until a number of impacts."""
        t = 0.0
        q, v = self.fe.release()
        for i, stop in enumerate(self.fe.mechanism.stops):
            gap = self.fe.gap(i, q)
            if gap < -PENETRATION_ATOL:
                raise ParameterError(
                    f"the wall {stop.name} is penetrated by {-gap:.6g} m at release; move the "
                    "stop or release further back"
                )
            self.armed[i] = gap > PENETRATION_ATOL
        self._keep(t, q, v)
        try:
            while stop_time - t > END_TIME_RTOL * self.step and (
                impacts_max is None or len(self.log.impacts) < impacts_max
            ):
                t, q, v, struck = self._fly(t, q, v, stop_time)
                if struck is not None:
                    v = self._strike(t, q, v, struck)
                    self._keep(t, q, v)
                if len(self.log.impacts) > IMPACTS_MAX:
                    raise SimulationError(
                        f"more than {IMPACTS_MAX} impacts by t = {t:.6g} s: raise rest_speed, or "
                        "damping.beta"
                    )
        finally:
            for i in list(self.held):
                self._hold(i, False)
        return self._result()

    # -- flight --

    def _fly(self, t: float, q: Real, v: Real, end: float) -> tuple[float, Real, Real, int | None]:
        """Integrate to the end or to the first event; return the state and the struck stop."""
        before = (t, q, v)
        found: list[State] = []
        struck: list[int] = []
        released: list[int] = []

        def look(now: float, q_now: Real, v_now: Real) -> bool:
            nonlocal before
            closing = [i for i in self._open() if self._closes(i, q_now, v_now)]
            if closing:
                struck.extend(closing)
                found.append((now, q_now, v_now))
                return False
            released.extend(i for i in self.held if self._pulls(i))
            self._keep(now, q_now, v_now)
            before = (now, q_now, v_now)
            return not released

        h, after = self.step, before
        while end - after[0] > END_TIME_RTOL * self.step and not struck and not released:
            now = end if h == self.step else min(end, after[0] + SHORT_STEPS * h)
            steps = max(1, math.ceil((now - after[0]) / h - 1e-9))
            try:
                after = self._integrate(*after, now, steps, look)
                h = min(2 * h, self.step)
            except StepError:
                after, h = before, h / 2
                if h < STEP_RATIO_MIN * self.step:
                    raise
        if struck:
            return self._locate(before, found[0], struck)
        for i in released:
            self._hold(i, False)
        return (*(before if released else after), None)

    def _open(self) -> list[int]:
        return [i for i in range(len(self.armed)) if i not in self.held]

    def _closes(self, i: int, q: Real, v: Real) -> bool:
        """Return whether an open stop has just closed; arm it when its gap is open."""
        gap = self.fe.gap(i, q)
        if gap > 0.0:
            self.armed[i] = True
            return False
        if not self.armed[i]:  # An impact left the gap closed within the tolerance.
            return gap < -PENETRATION_ATOL and float(self.fe.gap_row(i, q) @ v) < 0.0
        return True

    def _locate(self, a: State, b: State, struck: list[int]) -> tuple[float, Real, Real, int]:
        """Return the state at which the first struck stop touches, found by shorter steps.

        Raises
        ------
        SimulationError
            If the iteration does not converge.
        """
        small = GAP_CLOSED_RTOL * self.fe.model.size
        t, q, v = a
        i = struck[0]
        target = b[0] - t
        gap_a, gap_b = self.fe.gap(i, q), self.fe.gap(i, b[1])
        low, high, gap_low, gap_high = 0.0, target, gap_a, gap_b
        best, gap = b, gap_b
        for k in range(LOCATIONS_MAX):
            if gap_low <= small:
                return (*best, i)
            share = gap_low / (gap_low - gap_high) if k < SECANTS_MAX else 0.5
            h = low + (high - low) * share
            best = self._reach(t, q, v, t + h)
            gap = self.fe.gap(i, best[1])
            if abs(gap) <= small:
                return (*best, i)
            low, gap_low, high, gap_high = (
                (h, gap, high, gap_high) if gap > 0.0 else (low, gap_low, h, gap)
            )
        raise SimulationError(
            f"the impact at {self.fe.mechanism.stops[i].name} could not be located within "
            f"{target:.3g} s from t = {t:.6g} s: {LOCATIONS_MAX} iterations left a gap of "
            f"{gap:.3g} m; shorten the step"
        )

    def _reach(self, t: float, q: Real, v: Real, end: float) -> State:
        """Return the state at a time within a step; divide the step until it converges."""
        for steps in LOCATING_STEPS[:-1]:
            try:
                return self._integrate(t, q, v, end, steps, lambda *_: True)
            except StepError:
                continue
        return self._integrate(t, q, v, end, LOCATING_STEPS[-1], lambda *_: True)

    def _integrate(
        self, t: float, q: Real, v: Real, end: float, steps: int,
        look: Callable[[float, Real, Real], bool],
    ) -> State:  # fmt: skip
        """Integrate with Exudyn; ``look`` is called after every step and may end the run."""
        fe, data = self.fe, self.fe.model.mbs.systemData
        initial = fe.model.exu.ConfigurationType.Initial
        data.SetODE2Coordinates(q.tolist(), initial)
        data.SetODE2Coordinates_t(v.tolist(), initial)
        settings = fe.equations.settings()
        settings.timeIntegration.startTime = t
        settings.timeIntegration.endTime = end
        settings.timeIntegration.numberOfSteps = steps
        settings.timeIntegration.generalizedAlpha.spectralRadius = self.radius
        state = (t, q, v)
        force = fe.equations.forces(q)
        gains = False

        def after_step(mbs: Any, now: float) -> bool:
            nonlocal state, force, gains
            fe.equations.solver.ComputeODE2RHS(mbs)
            forces = np.array(fe.equations.solver.GetSystemResidual())[: fe.n]
            q_now, v_now = (
                np.array(x) for x in (data.GetODE2Coordinates(), data.GetODE2Coordinates_t())
            )
            gains = self._gains(state, q_now, v_now, force + forces)
            if gains:
                return False
            state, force = (float(now), q_now, v_now), forces
            return look(*state)

        fe.model.mbs.SetPostStepUserFunction(after_step)
        printing, fe.model.exu.config.printToConsole = fe.model.exu.config.printToConsole, False
        try:
            fe.model.mbs.SolveDynamic(settings)
        except Exception as error:
            raise StepError(
                f"Exudyn's integration failed at t = {state[0]:.6g} s ({error}): shorten the step"
            ) from None
        finally:
            fe.model.mbs.SetPostStepUserFunction(0)
            fe.model.exu.config.printToConsole = printing
        if gains:
            raise StepError(
                f"a step of Exudyn from t = {state[0]:.6g} s gained energy: it did not converge; "
                "shorten the step"
            )
        return state

    def _gains(self, before: State, q: Real, v: Real, twice_force: Real) -> bool:
        """Return whether the kinetic energy grew by more than the work of the forces.

        The work is that of the trapezoidal rule, which is exact for linear forces.
        """
        kinetic = float(v @ self.fe.M @ v) / 2
        grown = kinetic - float(before[2] @ self.fe.M @ before[2]) / 2
        work = float(twice_force @ (q - before[1])) / 2
        if grown - work > ENERGY_GAIN_RTOL * self.kinetic_max:
            return True
        self.kinetic_max = max(self.kinetic_max, kinetic)
        return False

    # -- contact --

    def _pulls(self, i: int) -> bool:
        """Return whether a stop that holds would have to pull."""
        joint = self.fe.model.holds[i]
        force = self.fe.model.mbs.GetObjectOutput(
            joint, self.fe.model.exu.OutputVariableType.ForceLocal
        )
        return bool(force[0] < 0.0)

    def _hold(self, i: int, on: bool) -> None:
        self.fe.model.mbs.SetObjectParameter(self.fe.model.holds[i], "activeConnector", on)
        (self.held.add if on else self.held.discard)(i)
        self.armed[i] = False

    def _strike(self, t: float, q: Real, v: Real, i: int) -> Real:
        """Return the velocities after an impact; hold the stop below ``rest_speed``."""
        fe, stop = self.fe, self.fe.mechanism.stops[i]
        G = fe.gap_row(i, q)
        speed = -float(G @ v)
        soft = speed < value(stop, "rest_speed", fe.values)
        restitution = 0.0 if soft else value(stop, "restitution", fe.values)
        held = tuple(sorted(self.held - {i}))
        after, P = fe.impact(q, v, i, restitution, held)
        self.armed[i] = False
        if soft:
            self._hold(i, True)
            return after
        rebound = float(G @ after)
        lost = P * (speed - rebound) / 2
        number = self.latched[i].impact_count + 1
        phi = fe.modes(self._static_near(q)).shape[:, 0]
        modal = simulated_restitution(phi, fe.M, v, after)
        self.latched[i] = Latched(number, t, speed, rebound, P, lost, modal)
        self.log.impacts.append(Impact(stop.name, t, q, v, after, P, self.latched[i]))
        return after

    def _static_near(self, q: Real) -> Shape:
        """Return the static shape with the same displacement of the released body."""
        return self.fe.equilibrium(self.fe.displacement(q))

    # -- results --

    def _keep(self, t: float, q: Real, v: Real) -> None:
        log = self.log
        log.times.append(t)
        log.q.append(np.array([q[j] for j in self._columns]))
        log.v.append(np.array([v[j] for j in self._columns]))
        log.held.append(tuple(i in self.held for i in range(len(self.armed))))

    @cached_property
    def _columns(self) -> list[int]:
        firsts = [self.fe.model.rigid[b.name].first for b in self.fe.mechanism.bodies]
        return [first + k for first in firsts if first is not None for k in range(3)]

    def _result(self) -> Result:
        fe, log = self.fe, self.log
        rows = []
        full = np.zeros(fe.n)
        for t, q, v, held in zip(log.times, log.q, log.v, log.held, strict=True):
            row: dict[str, float | int | bool] = {"time": t}
            for k, body in enumerate(fe.mechanism.bodies):
                for j, name in enumerate(("x", "y", "angle")):
                    row[f"{body.name}.{name}"] = float(q[3 * k + j])
                for j, name in enumerate(("vx", "vy", "omega")):
                    row[f"{body.name}.{name}"] = float(v[3 * k + j])
            full[self._columns] = q
            for i, stop in enumerate(fe.mechanism.stops):
                row[f"{stop.name}.gap"] = fe.gap(i, full)
                row[f"{stop.name}.contact"] = held[i]
            rows.append(row)
        return Result(fe.mechanism, fe.values, structured(rows), tuple(log.impacts))
