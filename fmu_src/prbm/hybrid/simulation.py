r"""The event loop: integrate, locate the first event, apply it, continue.

A :class:`Simulation` steps past the communication points and interpolates, so that its
trajectory does not depend on them.  It restarts only when an input or a tunable parameter
changes.  An event is the change from z > 0 to z <= 0 of a guard z of
:data:`prbm.hybrid.events.TRANSITIONS`, located on the dense output.  Rest is a discrete state: a
stop that holds is a constraint, not a spring and not a series of small bounces.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ..base.errors import ParameterError, SimulationError
from ..base.names import unknown
from ..base.tolerances import (
    DENSE_FACTOR,
    INTERPOLATION_FACTOR,
    NODE_STEP_RTOL,
    REVERSAL_DELAY_RTOL,
    STABLE_STEP_WATCH_FACTOR,
    STEPS_MAX,
)
from ..mechanics.arrays import Real
from ..mechanics.contact_state import ContactState
from ..mechanics.dynamics import Equations, Evaluation
from ..mechanics.inputs import WALL_INPUTS, Inputs, Wall, impulse_names
from ..mechanics.start import Instability, instability
from ..mechanics.stress import SectionStresses, section_stresses
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parameters import number
from . import compliant, contact_modes, contact_peaks, events, impacts, snapshot, walls
from .arc import Arc, Node
from .configuration import Configuration, Magnitudes
from .effort import Effort
from .events import Event, EventKind, EventWindow
from .front import Front, Latched
from .given import changed_values, checked_times, start_values
from .guards import StepView
from .outputs import Outputs, all_outputs, motions
from .peaks import PeakRecord
from .records import Impact
from .release import released
from .stability import FastestMode
from .stepping import (
    StepSizeController,
    check_projection,
    closed,
    error_norm,
    take_step,
)


class Simulation:
    """A mechanism in motion.

    Parameters
    ----------
    mechanism : Mechanism
        Description.
    values : mapping
        Parameters and inputs that differ from their defaults.
    start_time : float
        Time at the start [s].
    tolerance : float or None
        Relative tolerance of the integration (default: ``solver.tolerance``).
    step : float or None
        Fixed step size for studies of convergence [s] (default: adaptive).

    Attributes
    ----------
    time : float
        Present time [s].
    given : dict
        Values of all inputs.
    record : list of Impact or None
        If a list, all impacts are appended to it.

    Raises
    ------
    TypeError
        If the mechanism is a name or a path: load it first.
    ParameterError
        If a name is unknown, a value out of bounds, or the wall is penetrated at release.
    EquilibriumError
        If no equilibrium has the displacement of the release.
    """

    engine = "python"
    """Name of the engine; :class:`prbm.kernel.simulation.KernelSimulation` is the other one."""

    def __init__(
        self,
        mechanism: Mechanism,
        values: Mapping[str, float] | None = None,
        *,
        start_time: float = 0.0,
        tolerance: float | None = None,
        step: float | None = None,
    ) -> None:
        known, self.given, self.time = start_values(mechanism, values, start_time)
        # The parameters in use, and those that are used from the next restart on.
        self.configuration = Configuration.of(mechanism, known, tolerance, step)
        self.prepared = self.configuration
        self.changed = False
        self.received = _impulses(self.mechanism, self.given)
        self.history, at_start = walls.start(self.configuration, self.given, self.time)
        inputs = Inputs.of(mechanism, self.given, at_start)
        self.front = released(self.configuration, inputs, self.time)
        self.peaks = PeakRecord.at(self.front)
        self.fastest = FastestMode.at(self.front.equations, self.time, self.front.y)
        # The step that leads to the front, the event at its end, and the rates at its end.
        self.arc: Arc | None = None
        self.pending: Event | None = None
        self.k1: Real | None = None
        self.controller = StepSizeController()
        self.window = EventWindow(self.time)
        self.record: list[Impact] | None = None
        self._beside: Callable[[float, float], None] | None = None  # Called beside events.
        self.step_count = 0  # Integration steps since the start, for limits of the effort.
        self._output_cache: tuple[float, Outputs] | None = None
        self._middle: tuple[Arc, Node] | None = None  # The middle of a step.

    # -- mechanism and equations --

    @property
    def mechanism(self) -> Mechanism:
        """Description of the mechanism."""
        return self.configuration.mechanism

    @property
    def values(self) -> Mapping[str, float]:
        """Values of all parameters, including changes that act from the next step on."""
        return self.prepared.values

    @property
    def system(self) -> System:
        """The constant arrays."""
        return self.configuration.system

    @property
    def frequency(self) -> float:
        """Fundamental frequency about the equilibrium under gravity at the start [Hz]; 0: none."""
        return self.configuration.frequency

    @property
    def tolerance(self) -> float:
        """Relative tolerance of the integration."""
        return self.configuration.tolerance

    @property
    def equations(self) -> Equations:
        """The equations of motion for the present contacts and inputs."""
        return self.front.equations

    @property
    def inputs(self) -> Inputs:
        """Forces, walls and the acceleration of the base as they act."""
        return self.front.inputs

    @property
    def contacts(self) -> ContactState:
        """The modes of stops and friction points."""
        return self.front.contacts

    @property
    def latched(self) -> tuple[Latched, ...]:
        """The last impact of each stop."""
        return self.front.latched

    # -- inputs and parameters --

    def set(self, changes: Mapping[str, float]) -> None:
        """Change inputs and tunable parameters from the present time on.

        Parameters
        ----------
        changes : mapping
            Values by name.  If one of them is rejected, no value is changed.

        Raises
        ------
        ParameterError
            If a name is unknown or belongs to a fixed parameter, or a value is out of bounds.
        """
        values, given = changed_values(self.mechanism, self.values, self.given, changes)
        # Inputs of walls act from the next step on, and need no restart.
        moving = {f"{stop.name}.{name}" for stop in self.mechanism.stops for name in WALL_INPUTS}
        others = any(given[name] != x for name, x in self.given.items() if name not in moving)
        self.changed = self.changed or others or values != self.values
        self.prepared = self.prepared.with_values(values)
        self.given = given

    # -- time --

    def advance(self, time: float) -> None:
        """Continue the motion to a time.

        The present time is a communication point: the walls join the lines that the inputs define
        at this time, see :mod:`prbm.hybrid.walls`.  An error leaves the simulation unchanged.

        Parameters
        ----------
        time : float
            Target time, not before the present time [s].

        Raises
        ------
        ParameterError
            If the time is not a number.
        SimulationError
            If the target time is invalid, the step size becomes too small, too many events
            occur, or too many integration steps are needed, see :mod:`prbm.hybrid.effort`.
        """
        time = number("time", time, "s")
        if not math.isfinite(time) or time < self.time:
            raise SimulationError(
                f"cannot simulate from t = {self.time:.12g} s to t = {time:.12g} s: the target "
                "time must be finite and not before the present time"
            )
        if time - self.time > STEPS_MAX * self.configuration.scales.step_max:
            raise SimulationError(
                f"cannot simulate from t = {self.time:.12g} s to t = {time:.12g} s at once: this "
                f"takes more than {STEPS_MAX:g} internal steps; check that both times are in "
                "seconds"
            )
        if time == self.time:
            return
        before, recorded = dict(vars(self)), len(self.record or ())
        try:
            self._advance(time)
        except BaseException:  # Ctrl-C, too.
            vars(self).update(before)
            if self.record is not None:
                del self.record[recorded:]
            raise

    def _advance(self, time: float) -> None:
        """Continue the motion to a later time."""
        present = compliant.present_walls(replace(self.front, time=self.time), self.state)
        self.history, moved = walls.join(
            self.configuration, self.prepared, self.given, self.history, present, self.time, time
        )
        if self.changed or moved != self.inputs.walls:
            self._restart(moved)
        effort = Effort(self.front.time)
        while True:
            if self.pending is not None and self.pending.time <= time:
                self._apply(self.pending)
            if self.front.time >= time:
                break
            effort = effort.counting(
                self.configuration, self.front, self.fastest, time, self.controller.h
            )
            self._take_step()
        self.time = time
        self._output_cache = None

    def _restart(self, moved: tuple[Wall, ...]) -> None:
        """Continue from the present state with the present inputs, walls and parameters."""
        given, configuration = _impulses(self.mechanism, self.given), self.prepared
        self.front = contact_peaks.latched_until(
            self.configuration, self.front, self.arc, self.time
        )
        pushed = not np.array_equal(given, self.received)
        y = self._end_of_step(shown=pushed)
        if configuration is not self.configuration:
            moved = walls.keeping_gaps(self.system, configuration.system, y, moved)
        inputs = Inputs.of(self.mechanism, self.given, moved)
        equations = configuration.equations(inputs, self.contacts)
        front = Front(self.time, y, equations, self.latched, self.front.touches)
        front, _ = compliant.fold_recoils(front, equations.compliant.stops)
        if pushed:
            front = impacts.receive(front, given - self.received)
        front, struck = contact_modes.release_moving(configuration, front)
        front = compliant.rephased(front)
        counted: list[Impact] = []
        if struck is None:
            front = contact_modes.choose_modes(configuration, front.projected())
        else:
            front, counted = impacts.impact(configuration, front, struck)
        self.configuration, self.changed, self.received = configuration, False, given
        self._set_front(front, counted)

    def _end_of_step(self, shown: bool) -> Real:
        """Return the present state as the end of a step, whose error is below that of the arc.

        Impulses act on the state that outputs show, so that they conserve the momentum of a
        coupling exactly.
        """
        arc, t = self.arc, self.time
        if shown or arc is None or not arc.start < t < self.front.time:
            return self.state()
        return closed(self.configuration, self.equations, t, arc.cut(self.equations.rate, t)[1])

    def _apply(self, event: Event) -> None:
        """Apply an event at the front."""
        beside = None if event.kind is EventKind.SWITCH else self._beside
        if beside is not None:
            beside(event.time, math.nextafter(event.time, -math.inf))
        self.window = self.window.counting(event, self.configuration)
        front = contact_peaks.latched_until(self.configuration, self.front, self.arc, event.time)
        self._set_front(*events.apply(self.configuration, front, event))
        if event.kind is EventKind.IMPACT:
            self.controller, self.front = compliant.shortened(
                self.controller, self.front, event.contact
            )
        elif event.kind is EventKind.SEPARATION:
            self.controller = compliant.lengthened(self.controller, front.touches[event.contact])
        if beside is not None:
            beside(event.time, event.time)

    def _set_front(self, front: Front, counted: list[Impact]) -> None:
        """Continue from a front without the step that led there."""
        self.peaks = self.peaks.continued(front, reached=front.time >= self.front.time)
        self.front, self.arc, self.pending, self.k1 = front, None, None, None
        if self.record is not None:
            self.record += counted

    def _take_step(self) -> None:
        """Take one step from the front, up to the first event within it."""
        self.step_count += 1
        front, counted, balances = compliant.frozen(
            self.configuration, walls.arrived(self.front), self.arc
        )
        if front.equations is not self.front.equations:
            for i in set(self.front.contacts.pressed) & set(front.contacts.held):
                self.controller = compliant.lengthened(self.controller, front.touches[i])
            self._set_front(front, counted)
        self.front = front
        configuration, equations = self.configuration, front.equations
        last = self.arc
        if self.k1 is None:
            self.k1 = equations.rate(front.time, front.y)
        step, controller = take_step(configuration, front, self.k1, self.controller, self.fastest)
        if step.h > STABLE_STEP_WATCH_FACTOR * self.fastest.longest_step(equations):
            self.fastest = self.fastest.refined(equations, step.last)
        n, before = equations.n, last.start_before(step.h) if last else None
        arc = Arc(front.time, step.h, front.time + step.h, front.y, step.k, n, before)
        view = StepView(configuration.scales, equations, arc, step.forces)
        event = events.first_event(view)
        balance = compliant.balance_time(view, balances) if event is None else None
        found: Evaluation | None = None
        if event is None and balance is None:
            y, self.k1, found = step.y, step.k[-1], step.last
        else:
            # The event does not shorten the next step.
            controller = StepSizeController(step.h, controller.last_error)
            if event is not None:
                event, arc, y = _cut(configuration, event, view)
            elif balance is not None:
                y = closed(configuration, equations, balance, arc.at(balance))
                arc = replace(arc, end=balance)
            self.k1 = None
        self.front = replace(front, time=arc.end, y=y)
        self.peaks = self.peaks.stepped(self.front, found)
        self.arc, self.pending, self.controller = arc, event, controller

    def instability(self) -> Instability:
        """Return the numbers of unstable directions at the start.

        Raises
        ------
        EquilibriumError
            As :func:`prbm.mechanics.start.instability`.
        """
        return instability(self.system, self.values)

    def check_effort(self, step: float) -> None:
        """Reject a communication step [s] of the default experiment that needs too many steps.

        Raises
        ------
        SimulationError
            As :meth:`prbm.hybrid.stability.FastestMode.check_effort`.
        """
        self.fastest.check_effort(self.equations, step)

    # -- state and outputs --

    def state(self) -> Real:
        """Return y = (q, v, dissipated energy, work) at the present time, on the constraints.

        The states of compliant stops follow, see :mod:`prbm.mechanics.compliant_stops`.
        """
        if self.arc is None or self.time >= self.front.time:
            return self.front.y
        # The present equations are those of the step that passes the present time.
        y = self._interpolated(self.arc)
        evaluation = self.equations.at(self.time, y)
        projected = self.equations.project_near(self.time, y, evaluation.factors)
        check_projection(self.configuration, self.time, y, projected)
        return projected

    def section_stresses(self) -> SectionStresses:
        """Return the stress of both faces in all sections at the present time, by flexure [Pa].

        The flexures are those whose stress is an output; their sections are at
        :func:`prbm.mechanics.stress.section_positions`.
        """
        y, n = self.state(), self.system.n
        q, v = y[:n], y[n : 2 * n]
        return section_stresses(self.equations, q, v, self.equations.at(self.time, y))

    def _interpolated(self, arc: Arc) -> Real:
        """Return the state at the present time in a step, not projected.

        The dense output, whose error is below that of the embedded solution, is used if that is
        small; not in fixed steps, which have no tolerance.  If the two interpolations differ too
        much, a step to the present time replaces them.
        """
        dense, scales = arc.at(self.time), self.configuration.scales
        core = 2 * self.system.n + 2
        embedded = error_norm(scales, arc.embedded_error[:core], arc.y[:core], arc.y[:core])
        exact = embedded <= DENSE_FACTOR * self.configuration.tolerance
        if (exact and not self.configuration.step) or arc.h < NODE_STEP_RTOL * scales.time:
            return dense
        y = arc.through(arc.before or self._middle_of(arc), self.time)
        difference = error_norm(scales, (y - dense)[:core], dense[:core], y[:core])
        if difference <= INTERPOLATION_FACTOR * self.configuration.tolerance:
            return y
        return arc.cut(self.equations.rate, self.time)[1]

    def _middle_of(self, arc: Arc) -> Node:
        """Return the state at half the time of a step, which is computed once."""
        if self._middle is None or self._middle[0] is not arc:
            self._middle = (arc, arc.middle(self.equations.rate))
        return self._middle[1]

    def magnitudes(self) -> Magnitudes:
        """Return typical magnitudes of a motion that starts with the present state."""
        return Magnitudes.of(self.system, self.configuration.scales, self.state())

    def outputs(self) -> Outputs:
        """Return all outputs, locals and calculated parameters at the present time, by name.

        They are in SI units and rad.  Displacements and energies are zero at the straight shape.
        """
        if self._output_cache is None or self._output_cache[0] != self.time:
            constant = {"mode.frequency": self.frequency, **self.configuration.calculated}
            peaks = self.peaks.passed() if self.time >= self.front.time else self.peaks
            front = contact_peaks.latched_until(self.configuration, self.front, self.arc, self.time)
            out = all_outputs(
                self.equations, front.latched, peaks, self.time, self.state(), constant
            )
            self._output_cache = (self.time, out)
        return dict(self._output_cache[1])

    def motions(self) -> dict[str, float]:
        """Return only the positions and velocities of bodies and probes, by name of the output.

        This takes a third to a half of the time of :meth:`outputs`.
        """
        n, y = self.system.n, self.state()
        q, v = y[:n], y[n : 2 * n]
        return motions(self.system, q, v, self.system.directions(q))

    def sample(
        self,
        times: Sequence[float] | Real,
        names: Sequence[str],
        events: list[list[float]] | None = None,
    ) -> Real:
        """Advance to each of several times and return outputs there, (m, k).

        Parameters
        ----------
        times : (m,)
            Times in ascending order, not before the present time [s].
        names : (k,)
            Names of outputs, in SI units and rad.
        events : list or None
            If a list, the time and the outputs directly before and after each event of the
            integration are appended to it; before an event, the time is the largest number below
            that of the event.  No such events are changes of phase of compliant stops, which cause
            no jump, the freezing of their contacts, and impacts by changed inputs.

        Raises
        ------
        ParameterError
            If there is no such output, or the times are not a list of numbers.
        SimulationError
            As :meth:`advance`; the simulation has then reached the times before.
        """
        times, outputs = checked_times(times), self.outputs()
        for name in names:
            if name not in outputs:
                raise ParameterError(unknown(name, outputs))
        moving, kept = self.motions().keys() >= set(names), list[list[float]]()

        def values() -> list[float]:
            out: Mapping[str, float] = self.motions() if moving else self.outputs()
            return [out[name] for name in names]

        def beside(time: float, label: float) -> None:
            now, self.time, self._output_cache = self.time, time, None
            kept.append([label, *values()])
            self.time, self._output_cache = now, None

        rows = np.empty((len(times), len(names)))
        for row, t in zip(rows, times, strict=True):
            kept.clear()
            self._beside = None if events is None else beside
            try:
                self.advance(t)
            finally:
                self._beside = None
            if events is not None:
                events += kept
            row[:] = values()
        return rows

    # -- saving and restoring --

    def snapshot(self) -> dict[str, Any]:
        """Return the complete state as plain values that JSON keeps exactly."""
        return {
            "engine": self.engine,
            "values": dict(self.values),
            "acting": dict(self.configuration.values),
            "given": dict(self.given),
            "received": self.received.tolist(),
            "changed": self.changed,
            "tolerance": self.configuration.tolerance,
            "step": self.configuration.step,
            "frequency": self.frequency,
            "time": self.time,
            "front": snapshot.plain_front(self.front),
            "history": asdict(self.history),
            "window": asdict(self.window),
            "controller": asdict(self.controller),
            "fastest": snapshot.plain_fastest(self.fastest),
            "arc": snapshot.plain_arc(self.arc),
            "pending": snapshot.plain_event(self.pending),
            "k1": snapshot.plain_array(self.k1),
            "peaks": asdict(self.peaks),
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore a state of :meth:`snapshot`; the motion then continues bit for bit.

        Raises
        ------
        ParameterError
            If the state belongs to another mechanism or engine, or is damaged.  The simulation is
            then unchanged.
        """
        snapshot.check_owner(saved, self.engine, self.values)
        try:
            snapshot.check_form("", {**saved, "engine": self.engine}, self.snapshot())
            changed_values(self.mechanism, self.values, self.given, saved["given"])
            restored = snapshot.restored(saved, self.configuration)
        except (AttributeError, LookupError, OverflowError, TypeError, ValueError) as error:
            raise ParameterError(f"the saved state is damaged: {error}") from None
        vars(self).update(restored)
        self._output_cache = None


CUT = (EventKind.IMPACT, EventKind.SEPARATION, EventKind.ACTION)
"""Events at which a step ends with the accuracy of the method, not of its dense output."""


def _cut(configuration: Configuration, event: Event, view: StepView) -> tuple[Event, Arc, Real]:
    """Return an event, the step up to it, and the state at its end.

    A reversal is delayed where the links of a loop form a straight line, because the motion is not
    unique there.
    """
    arc, equations = view.arc, view.equations
    if event.kind in CUT and event.time > arc.start:
        arc = view.cut(event.contact, event.time)
    try:
        y = closed(configuration, equations, event.time, arc.at(event.time))
    except SimulationError:
        if event.kind is not EventKind.REVERSAL:
            raise
        event = replace(event, time=event.time + REVERSAL_DELAY_RTOL * arc.h)
        y = closed(configuration, equations, event.time, arc.at(event.time))
    return event, replace(arc, end=event.time), y


def _impulses(mechanism: Mechanism, given: Mapping[str, float]) -> Real:
    """Return the inputs that are impulses [N s], [N m s]."""
    return np.array([given[name] for name in impulse_names(mechanism)])
