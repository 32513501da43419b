r"""The one state machine: integrate, locate, impact, continue.

A :class:`Simulation` steps past the times at which it is asked and interpolates, so that its
trajectory does not depend on them.  It restarts only when an input or a tunable parameter
changes.  An event is the domain change z > 0 -> z <= 0 of

* the gap of an open stop, once it has been open (impact or capture),
* the force of a stop that holds (release),
* the sliding velocity in its own direction (stick, or slide back),
* the friction that is left to what sticks (slip),

located on the dense output.  Rest is a discrete state: a stop that holds is a constraint, not a
spring and not a series of small bounces.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np
from scipy.optimize import brentq

from ..base.errors import ParameterError, SimulationError
from ..base.names import unknown
from ..mechanics import constraints, contact, forces
from ..mechanics.arrays import Complex, Real
from ..mechanics.assembly import assemble, calculated
from ..mechanics.dynamics import IDLE, STICKS, Discrete, Equations
from ..mechanics.inputs import MOBILITY, Inputs, Wall, check_input, impulse_names, input_names
from ..mechanics.kinetics import inertia, kinetic_energy
from ..mechanics.modal import fundamental_at, modes, simulated_restitution
from ..mechanics.statics import equilibrium, release_velocity
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from .runge_kutta import BOGACKI_SHAMPINE as PAIR
from .runge_kutta import interpolate, powers, stages

TIME_RESOLUTION = 1e-13  # s; events are located to 1e-12 s, some of which the projection needs
TOUCHING = 1e-10  # of the size: gaps that close together with one that is being resolved
RELEASE_GAP = 1e-9  # m; a wall may be touched at release by no more than this
SHORTEST_FLIGHT = 5e-7  # of the period: the arc of a shorter bounce is lost in rounding
DEPENDENT = 1e-4  # share of a row's mobility that the stops leave; below, the stop carries all
MOST_AT_REST = 6  # things with friction whose combinations are tried
ALIGNED = 1e-9  # the same for stops among each other; below, one of them holds for all
AT_EASE = 1e-7  # of the highest frequency: a lower one is what rounding leaves of none
NO_SPRING = 2 * math.pi  # rad/s; the scale of rates of a linkage without springs
STILL = 1e-9  # of the velocity scale: a slower rate is what rounding leaves of none
SLACK = 1e-6  # of the limit of friction: what sticks may exceed it by this before it slips
CHATTER = 1000  # events ...
CHATTER_SPAN = 5e-3  # ... within so much of a period are a motion the model cannot follow
DOUBT = 0.5  # of the largest force of a stop within a step: below, its release is looked for
WATCHED = 8  # parts of a step at which the guards are looked at
SAFETY, SHRINK, GROW = 0.9, 0.2, 5.0  # of the step size control
MEMORY = 0.04  # exponent of the previous error: steps that swing less (Hairer, IV.2)
RETRY_EXPONENT = 1.0 / PAIR.order
STEP_EXPONENT = RETRY_EXPONENT - 0.75 * MEMORY
STRICTNESS = 0.6  # of the tolerance: what the dense output adds to the error has room too
LEAST_ERROR = 1e-4  # of the tolerance: what a step better than that is remembered as
LARGEST_STEP = 0.05  # of the fundamental period
SMALLEST_STEP = 1e-13  # s
MOST_STEPS = 1e9  # of the longest, to one time: more is a mistake of units


@dataclass(frozen=True)
class Latched:
    """What the last impact at a stop was like; zeros before the first."""

    impact_count: int = 0
    impact_time: float = 0.0
    approach_speed: float = 0.0
    rebound_speed: float = 0.0
    impulse: float = 0.0
    energy_lost: float = 0.0
    modal_restitution: float = 0.0
    impulse_sum: float = 0.0  # of all impulses so far, those that were captured too


@dataclass(frozen=True)
class Impact:
    """An impact, for those who keep a record: the stop, the time, the state around it."""

    stop: str
    time: float
    q: Real
    before: Real
    after: Real
    impulse: float
    latched: Latched


@dataclass(frozen=True)
class Event:
    """What happens next: at which time, to which stop or friction point."""

    time: float
    kind: str
    index: int


@dataclass(frozen=True)
class Arc:
    """A step that was taken: y(t) for start <= t <= end, with its stages.

    ``h`` is the whole step, ``end`` where it was cut by an event.
    """

    start: float
    h: float
    end: float
    y: Real
    k: Real
    event: Event | None

    def at(self, t: float) -> Real:
        """Return the state at time t, not projected."""
        return interpolate(PAIR, self.y, self.k, self.h, (t - self.start) / self.h)


GRID = powers(PAIR, np.linspace(0.0, 1.0, WATCHED + 1))
FRACTIONS = np.linspace(0.0, 1.0, WATCHED + 1)


class Simulation:
    """A mechanism in motion.

    Parameters
    ----------
    mechanism : Mechanism
        What moves.
    values : mapping
        Parameters and inputs that differ from their defaults.
    start_time : float
        [s].
    tolerance : float or None
        Relative tolerance of the integration; None: ``solver.tolerance``.
    step : float or None
        Fixed step size for studies of convergence [s]; None: adaptive.

    Raises
    ------
    ParameterError
        If a name is unknown, a value out of bounds, or the wall is penetrated at release.
    EquilibriumError
        If no equilibrium has the displacement of the release.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        values: Mapping[str, float] | None = None,
        *,
        start_time: float = 0.0,
        tolerance: float | None = None,
        step: float | None = None,
    ) -> None:
        changes = dict(values or {})
        self.mechanism = mechanism
        defaults = mechanism.values()
        self.values = mechanism.values({k: x for k, x in changes.items() if k in defaults})
        # the arrays that act, and those that a change has prepared for the next restart
        self.system = self.prepared = assemble(mechanism, self.values)
        self.calculated = calculated(mechanism, self.values)
        self.given = dict.fromkeys(input_names(mechanism), 0.0)
        for name in changes.keys() - defaults.keys():
            if name not in self.given:
                raise ParameterError(unknown(name, {**defaults, **self.given}))
            self.given[name] = check_input(name, changes[name], self.given)
        self.received = [self.given[name] for name in impulse_names(mechanism)]
        self.tolerance = _tolerance(
            self.values["solver.tolerance"] if tolerance is None else tolerance
        )
        self.step = step
        self.time = float(start_time)
        if not math.isfinite(self.time):
            raise ParameterError(f"start_time = {start_time} s must be a finite number")
        if step is not None and not (math.isfinite(step) and step > 0.0):
            raise ParameterError(f"step = {step} s must be positive")
        self.frequency = fundamental_frequency(self.system)
        self.omega = 2 * math.pi * self.frequency
        # scales of rates without a fundamental frequency, and of energies: one radian against the
        # stiffest torsion spring or, where nothing bends, a turn by one radian in a period [J]
        K, inertia_scale = np.abs(self.system.K), float(np.abs(self.system.H).max())
        turns = np.setdiff1d(np.arange(self.system.n), self.system.stretches)
        self._spring_rate = math.sqrt(float(K.max()) / inertia_scale) or NO_SPRING
        self._energy_scale = (
            float(K[np.ix_(turns, turns)].max()) or inertia_scale * self._omega_scale() ** 2
        )

        displacement, speed = (
            value(mechanism.release, name, self.values) for name in ("displacement", "velocity")
        )
        shape = equilibrium(self.system, displacement)
        velocity = release_velocity(self.system, shape.q, speed)
        walls = tuple(Wall(self._wall_target(i, 0.0)) for i in range(len(mechanism.stops)))
        self.discrete = Discrete(
            (False,) * len(walls), (IDLE,) * len(walls), (IDLE,) * len(mechanism.frictions)
        )
        self._set_equations(self._inputs(walls))
        self.latched = [Latched() for _ in walls]
        self.record: list[Impact] | None = None
        self._window = (self.time, 0)
        self._planned = self._due = self.time  # when walls were planned, by when they are there
        self._told = self._wall_velocities()
        self._swift = (False,) * len(walls)  # walls that were given a velocity
        self.arc: Arc | None = None
        self.h, self.last_error = 0.0, LEAST_ERROR
        self.changed = False
        y = np.concatenate([shape.q, velocity, np.zeros(2)])
        self.front_time, self.front = self.time, self.equations.project(self.time, y)
        self._check_walls()
        self._settle(resting=range(len(walls)))
        self.k1: Real | None = None
        self._output_cache: tuple[float, dict[str, Any]] | None = None

    # -- start --

    def _check_walls(self) -> None:
        """Refuse a penetrated wall, and begin with the impact if one is hit at once."""
        n = self.system.n
        e, v = self.system.directions(self.front[:n]), self.front[n : 2 * n]
        gaps = self.equations.gaps(self.front_time, e)
        rates = self.equations.gap_rates(e, v)
        for i, stop in enumerate(self.mechanism.stops):
            if gaps[i] < -RELEASE_GAP:
                wall = self.inputs.walls[i].position
                raise ParameterError(
                    f"the wall {stop.name} is penetrated by {-gaps[i]:.6g} m at release: "
                    f"{stop.name}.position = {wall:.6g} m, the hit point is at "
                    f"{wall - gaps[i]:.6g} m; move the stop or release further back"
                )
        for i in range(len(gaps)):
            if gaps[i] <= RELEASE_GAP and rates[i] < 0.0:
                self._impact(i)
                break

    # -- inputs and parameters --

    def set(self, changes: Mapping[str, float]) -> None:
        """Change inputs and tunable parameters from the present time on.

        Parameters
        ----------
        changes : mapping
            Names to values.  None is applied if one of them is refused.

        Raises
        ------
        ParameterError
            If a name is unknown or belongs to a fixed parameter, or a value is out of bounds.
        """
        parameters = {p.name: p for p in self.mechanism.parameters}
        values, given = dict(self.values), dict(self.given)
        for name, x in changes.items():
            if name in parameters:
                number = parameters[name].check(x)
                if not parameters[name].tunable and number != values[name]:
                    raise ParameterError(
                        f"{name} is fixed once the motion has started; set it before"
                    )
                values[name] = number
            elif name in given:
                given[name] = check_input(name, x, given)
            else:
                raise ParameterError(unknown(name, {**parameters, **given}))
        if values == self.values and given == self.given:
            return
        if values != self.values:
            self.prepared = assemble(self.mechanism, values)
        self.values, self.given, self.changed = values, given, True

    def _wall_target(self, i: int, h: float) -> float:
        """Return where the wall is to be a time h from now [m]."""
        stop = self.mechanism.stops[i]
        return (
            value(stop, "position", self.values)
            + self.given[f"{stop.name}.displacement"]
            + self.given[f"{stop.name}.velocity"] * h
        )

    def _wall_velocities(self) -> tuple[float, ...]:
        return tuple(self.given[f"{stop.name}.velocity"] for stop in self.mechanism.stops)

    def _inputs(self, walls: tuple[Wall, ...]) -> Inputs:
        given, mechanism = self.given, self.mechanism
        return Inputs(
            tuple(complex(given[f"{f.name}.x"], given[f"{f.name}.y"]) for f in mechanism.forces),
            tuple(given[f"{f.name}.moment"] for f in mechanism.forces),
            complex(given["base.acceleration.x"], given["base.acceleration.y"]),
            walls,
            tuple(given[f"{stop.name}.{MOBILITY}"] for stop in mechanism.stops),
        )

    def _set_equations(self, inputs: Inputs) -> None:
        self.inputs = inputs
        self.equations = self._equations(self.discrete)

    def _equations(self, discrete: Discrete) -> Equations:
        """Return the equations that hold in a discrete state."""
        return Equations(self.system, self.inputs, discrete, self.omega)

    # -- time --

    def advance(self, time: float) -> None:
        """Continue the motion to a time.

        The walls move uniformly from where they are to ``position + displacement + velocity *
        (time - now)``; in a step shorter than one before those with a velocity take longer to
        make good what they are off.

        Parameters
        ----------
        time : float
            Not before the present time [s].

        Raises
        ------
        SimulationError
            If time runs backwards, the step size vanishes or the events do not end.
        """
        if not math.isfinite(time) or time < self.time:
            raise SimulationError(
                f"cannot go from t = {self.time:.12g} s to t = {time:.12g} s: time only runs on"
            )
        if time - self.time > MOST_STEPS * self._largest_step():
            raise SimulationError(
                f"cannot go from t = {self.time:.12g} s to t = {time:.12g} s at once: that is more "
                f"than {MOST_STEPS:g} steps; times are in seconds"
            )
        if time == self.time:
            return
        before = dict(vars(self), latched=list(self.latched))
        recorded = len(self.record or ())
        try:
            self._advance(time)
        except Exception:
            vars(self).update(before)
            if self.record is not None:
                del self.record[recorded:]
            raise

    def _advance(self, time: float) -> None:
        self._move_walls(time)
        if self.changed:
            self._restart()
        while True:
            event = self.arc.event if self.arc else None
            if event is not None and event.time <= time:
                self.arc = None
                self._happen(event)
            if self.front_time >= time:
                break
            self._take_step()
        self.time = time
        self._output_cache = None

    def _move_walls(self, time: float) -> None:
        """Turn the inputs of the walls into uniform motions up to a time.

        A wall that is a little elsewhere than it is said to be gets there within the step.  One
        that was given a velocity does not hurry in a step that is shorter than one before: it
        takes as long as that, or goes by what its velocity has changed, or by half of
        ``rest_speed``.
        """
        now, span, velocities = self.time, time - self.time, self._wall_velocities()
        due, walls = max(self._due, 2 * now - self._planned), list(self.inputs.walls)
        for i, (wall, velocity) in enumerate(zip(walls, velocities, strict=True)):
            here = wall.at(now)
            off = self._wall_target(i, 0.0) - here
            mends = off / span
            if (velocity or self._swift[i]) and due > time:
                most = max(
                    abs(off) / (due - now), abs(velocity - self._told[i]),
                    0.5 * self._field(i, "rest_speed"),
                )  # fmt: skip
                mends = min(max(mends, -most), most)
            if abs(wall.at(time) - here - (velocity + mends) * span) > 1e-13 * self.system.length:
                walls[i] = Wall(here, velocity + mends, now)
        self._planned, self._due, self._told = now, due, velocities
        self._swift = tuple(
            swift or velocity != 0.0
            for swift, velocity in zip(self._swift, velocities, strict=True)
        )
        if tuple(walls) != self.inputs.walls:
            self.inputs = replace(self.inputs, walls=tuple(walls))
            self.changed = True

    def _restart(self) -> None:
        """Go on from the present state with the present inputs and parameters."""
        self.front = self.state()
        self.front_time = self.time
        self.arc, self.k1, self.changed = None, None, False
        self.system = self.prepared
        self._set_equations(self._inputs(self.inputs.walls))
        self._receive_impulses()
        struck = self._unsettled()
        if struck is not None:
            self._impact(struck)
        else:
            self.front = self.equations.project(self.time, self.front)
            self._settle()

    def _receive_impulses(self) -> None:
        """Change the velocities by what the impulses have grown by since the last restart.

        Each component P at the point of a force changes the rate u of the point along it, and its
        work is P (u- + u+)/2.  The loops take part, stops follow: see :meth:`_unsettled`.  Friction
        is finite and bears no impulse: what stuck is free, to slide or to stick again.
        """
        given = [self.given[name] for name in impulse_names(self.mechanism)]
        grown = np.array(given) - np.array(self.received)
        self.received = given
        if not grown.any():
            return
        n = self.system.n
        q, v = self.front[:n], self.front[n : 2 * n]
        e, M, loops = self._mass_and_loops(q)
        rows = np.vstack([forces.load_rows(self.system, frame, e) for frame in self.system.pushed])
        after = v + contact.response(M, loops, rows) @ grown
        self.front = self.front.copy()
        self.front[n : 2 * n] = after
        self.front[2 * n + 1] += float(grown @ (rows @ (v + after))) / 2
        slides, rubs = (
            tuple(IDLE if state == STICKS else state for state in states)
            for states in (self.discrete.slides, self.discrete.rubs)
        )
        self._set_discrete(replace(self.discrete, slides=slides, rubs=rubs))

    def _unsettled(self) -> int | None:
        """Let go of what rested on a wall and moves, by the wall's velocity or an impulse.

        A wall that retreats leaves the body behind; gravity or whatever pressed it closes the
        gap again and, below ``rest_speed``, captures it.  A wall that advances strikes, as does a
        body that is thrown against a wall that it touches: one such stop is returned.
        """
        n = self.system.n
        e, v = self.system.directions(self.front[:n]), self.front[n : 2 * n]
        gaps, rates = self.equations.gaps(self.time, e), self.equations.gap_rates(e, v)
        struck = None
        for i, holds in enumerate(self.discrete.holds):
            if holds and abs(rates[i]) > self._still():
                self._set_discrete(self.discrete.without_hold(i))
            elif holds or gaps[i] > TOUCHING * self.system.length:
                continue
            struck = i if rates[i] < -self._still() else struck
        return struck

    def state(self) -> Real:
        """Return y = (q, v, dissipated energy, work) at the present time, on the constraints."""
        if self.arc is None or self.time >= self.front_time:
            return self.front
        # the step that leads past the present time was taken under the present equations
        n, y = self.system.n, self.arc.at(self.time)
        self.equations.accelerations(y[:n], y[n : 2 * n])
        return self.equations.project_from_here(self.time, y)

    # -- steps --

    def _take_step(self) -> None:
        """Take one step from the front, cut it at the first event."""
        t, y = self.front_time, self.front
        if self.k1 is None:
            self.k1 = self.equations.rate(t, y)
        h = self.step or min(self.h or self._first_step(self.k1), self._largest_step())
        growth = GROW
        while True:
            if h < SMALLEST_STEP:
                raise SimulationError(
                    f"the step size fell below {SMALLEST_STEP:g} s at t = {t:.9g} s: the motion "
                    "is too violent for the model, or its links lie flat, where it ends; check the "
                    "inputs and parameters, or add damping.beta"
                )
            if t + h == t:
                raise SimulationError(
                    f"at t = {t:.9g} s a step of {h:.3g} s is lost in the rounding of the time: "
                    "start the simulation nearer to zero"
                )
            self.equations.trace.clear()
            k, y1, error = self._trial(t, y, h, self.k1)
            if self.step or error <= 1.0:
                break
            growth = 1.0  # a step that had to be repeated is not followed by a longer one
            h *= max(SHRINK, SAFETY * error**-RETRY_EXPONENT) if math.isfinite(error) else SHRINK
        if self.step and not error * STRICTNESS * self.tolerance <= 1.0:
            raise SimulationError(
                f"the fixed step of {h:g} s is too long at t = {t:.9g} s: the state it leads to "
                "is not even near; shorten it"
            )
        error = max(error, LEAST_ERROR)
        growth = min(growth, SAFETY * error**-STEP_EXPONENT * self.last_error**MEMORY)
        self.h, self.last_error = h * max(SHRINK, growth), error
        arc = Arc(t, h, t + h, y, k, None)
        projected = self.equations.project_from_here(arc.end, y1)  # the last stage was there
        event = self._first_event(arc)
        if event is None:
            self.front_time, self.k1, self.front = arc.end, k[-1], projected
        else:
            # a step cut short says little about the next one: keep its size
            self.h = h
            arc = replace(arc, end=event.time, event=event)
            self.front_time, self.k1 = event.time, None
            self.front = self.equations.project(event.time, arc.at(event.time))
        self.arc = arc

    def _trial(self, t: float, y: Real, h: float, k1: Real) -> tuple[Real, Real, float]:
        """Return the stages of a step, where it leads to, and its error.

        A step that is far too long may lead to where nothing can be computed: its error is
        infinite, unless the step is fixed.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                k, y1 = stages(PAIR, self.equations.rate, t, y, h, k1)
            except SimulationError:
                if self.step:
                    raise
                return np.zeros((PAIR.error.size, len(y))), y, math.inf
            return k, y1, self._error(h * (PAIR.error @ k), y, y1)

    def _scales(self, y: Real) -> Real:
        """Return the magnitudes against which errors of a state are measured.

        One radian for angles, whatever they are; for rates and energies at least what one
        radian means for them.
        """
        n = self.system.n
        angle, rate, energy = self.magnitudes()
        scale = np.abs(y)
        scale[:n] = angle
        np.maximum(scale[n : 2 * n], rate, out=scale[n : 2 * n])
        np.maximum(scale[2 * n :], energy, out=scale[2 * n :])
        return scale

    def magnitudes(self) -> tuple[float, float, float]:
        """Return an angle [rad], and the rate [rad/s] and energy [J] that it means."""
        return 1.0, self._omega_scale(), self._energy_scale

    def _omega_scale(self) -> float:
        """Return the angular frequency against which rates are measured [rad/s]."""
        return self.omega or self._spring_rate

    def _error(self, difference: Real, y: Real, y1: Real) -> float:
        """Return the root mean square of an error in units of what the tolerance allows."""
        ratio = difference / self._scales(np.maximum(np.abs(y), np.abs(y1)))
        return math.sqrt(float(ratio @ ratio) / len(ratio)) / (STRICTNESS * self.tolerance)

    def _first_step(self, k1: Real) -> float:
        """Return a first step size from the size of the rates (Hairer, II.4)."""
        rate = k1 / self._scales(self.front)
        size = math.sqrt(float(rate @ rate) / len(rate))
        return min(self._largest_step(), 0.1 * math.pow(self.tolerance, 0.2) / max(size, 1e-6))

    def _largest_step(self) -> float:
        return LARGEST_STEP * self._period()

    def _period(self) -> float:
        """Return the time scale of the motion [s]."""
        return 2 * math.pi / self._omega_scale()

    # -- locating events --

    def _first_event(self, arc: Arc) -> Event | None:
        """Return the first event within a step, or None."""
        found: list[Event] = []
        discrete, n = self.discrete, self.system.n
        looking = not all(discrete.holds) or bool(self.equations.rub_slides)
        if looking or self.equations.sliding:
            times = arc.start + arc.h * FRACTIONS
            Y = arc.y + arc.h * (GRID @ arc.k)
            e, v = self.system.directions(Y[:, :n]), Y[:, n : 2 * n]
            gaps = self.equations.gaps(times, e)
            rates = self.equations.gap_rates(e, v)
            for i, holds in enumerate(discrete.holds):
                if not holds:
                    t = self._closing(arc, i, times, gaps[:, i], rates[:, i])
                    if t is not None:
                        found.append(Event(t, "impact", i))
            for i in self.equations.rub_slides:
                found += self._turning(arc, "rub", i, times, e, v)
            for i in self.equations.sliding:
                found += self._turning(arc, "slide", i, times, e, v)
        if self._may_yield():
            found += self._yielding(arc)
        return min(found, key=lambda event: event.time) if found else None

    def _gap_at(self, arc: Arc, i: int) -> Callable[[float], float]:
        n = self.system.n
        return lambda t: float(self.equations.gaps(t, self.system.directions(arc.at(t)[:n]))[i])

    def _gap_rate_at(self, arc: Arc, i: int, sign: float = 1.0) -> Callable[[float], float]:
        n = self.system.n

        def rate(t: float) -> float:
            y = arc.at(t)
            e = self.system.directions(y[:n])
            return sign * float(self.equations.gap_rates(e, y[n : 2 * n])[i])

        return rate

    def _closing(self, arc: Arc, i: int, times: Real, gaps: Real, rates: Real) -> float | None:
        """Return when a gap closes: z > 0 -> z <= 0 at a closing rate.

        A gap that is opening at the start of a part of the step closes only after its apex: so
        the impact that has just been resolved, whose gap is zero up to a rounding of either
        sign, is not found again.  A dip below zero between two looks shows in the rates.
        """
        gap_at, near = self._gap_at(arc, i), TOUCHING * self.system.length
        still, closed = self._still(), constraints.CLOSED * self.system.length
        for j in range(WATCHED):
            a, b = float(times[j]), float(times[j + 1])
            dips = rates[j] < 0.0 < rates[j + 1]
            if gaps[j + 1] > 0.0 and not dips:
                continue
            if abs(rates[j]) <= still and abs(gaps[j]) <= closed:
                if gaps[j + 1] < -near:  # it has let go too early: a little later it is pressed
                    return _falls(lambda t: gap_at(t) + near, a, b)
                continue
            if rates[j] > 0.0:
                if rates[j + 1] >= 0.0:
                    continue  # still opening from zero
                a = _falls(self._gap_rate_at(arc, i), a, b)
                if gap_at(a) <= 0.0:
                    return a  # an arc below the resolution of a position
            elif gaps[j] <= 0.0:
                if gaps[j + 1] < -near:
                    return a
                continue  # touches without a rate of its own
            if dips:
                b = _falls(self._gap_rate_at(arc, i, sign=-1.0), a, b)
                if gap_at(b) > 0.0:
                    continue
            return self._polished(arc, i, _falls(gap_at, a, b), a)
        return None

    def _polished(self, arc: Arc, i: int, t: float, opens: float) -> float:
        """Move the time of a closing gap to where the projected state closes it.

        Not to where it still opens: there nothing would happen, again and again.
        """
        n = self.system.n
        for _ in range(3):
            y = self.equations.project(t, arc.at(t))
            e = self.system.directions(y[:n])
            gap = float(self.equations.gaps(t, e)[i])
            rate = float(self.equations.gap_rates(e, y[n : 2 * n])[i])
            if rate >= 0.0 or abs(gap) <= TIME_RESOLUTION * abs(rate):
                break
            change = -gap / rate
            if abs(change) > 1e-2 * arc.h:  # grazing: the dense output has the better root
                break
            t = max(opens, t + change)
        return t

    def _turning(
        self, arc: Arc, kind: str, i: int, times: Real, e: Complex, v: Real
    ) -> list[Event]:
        """Return when a sliding velocity changes its sign.

        What begins to slide is at rest up to a rounding of either sign: it goes the other way if
        it does so at the end.
        """
        sign, rows, n = self._sliding(kind, i), self._slide_rows(kind), self.system.n
        z = sign * rows.rates(e, v)[:, i]
        begins = z[0] <= self._still()
        for j in range(int(begins), WATCHED):
            if z[j] > 0.0 >= z[j + 1]:

                def speed(t: float) -> float:
                    y = arc.at(t)
                    e = self.system.directions(y[:n])
                    return sign * float(rows.rates(e, y[n : 2 * n])[i])

                return [Event(_falls(speed, times[j], times[j + 1]), kind, i)]
        if begins and z[-1] < 0.0:
            return [Event(float(times[1]), kind, i)]
        return []

    def _sliding(self, kind: str, i: int) -> int:
        return self.discrete.rubs[i] if kind == "rub" else self.discrete.slides[i]

    def _slide_rows(self, kind: str) -> constraints.Rows:
        return self.equations.rub_rows if kind == "rub" else self.equations.slide_rows

    def _may_yield(self) -> bool:
        """Tell whether the stages of the step come near to releasing or slipping."""
        equations = self.equations
        if equations.stuck or equations.rubbing:
            return True
        if not equations.held:
            return False
        forces_held = np.array(equations.trace)[:, equations.first_hold :]
        return bool((forces_held.min(axis=0) <= DOUBT * forces_held.max(axis=0)).any())

    def _yielding(self, arc: Arc) -> list[Event]:
        """Return when a hold releases or a stick slips: a margin that is used up."""
        n, equations = self.system.n, self.equations

        def margins(t: float) -> dict[tuple[str, int], float]:
            y = arc.at(t)
            _, lam, _ = equations.accelerations(y[:n], y[n : 2 * n])
            return self._margins(lam, self.system.directions(y[:n]))

        def margin(key: tuple[str, int]) -> Callable[[float], float]:
            return lambda t: margins(t)[key]

        found = []
        middle, end = arc.start + arc.h / 2, arc.start + arc.h
        looks = [(t, margins(t)) for t in (arc.start, middle, end)]
        for key in looks[0][1]:
            for (a, before), (b, after) in pairwise(looks):
                if after[key] <= 0.0:
                    t = _falls(margin(key), a, b) if before[key] > 0 else a
                    found.append(Event(t, *key))
                    break
        return found

    def _margins(self, lam: Real, e: Complex) -> dict[tuple[str, int], float]:
        """Return what is left before each hold releases and each stick slips [N]."""
        equations = self.equations
        result = {}
        for k, i in enumerate(equations.held):
            result["release", i] = float(lam[equations.first_hold + k])
        for k, i in enumerate(equations.stuck):
            normal = float(lam[equations.first_hold + equations.held.index(i)])
            friction = abs(float(lam[equations.first_stick + k]))
            limit = equations.stop_friction[i] * normal
            result["slip slide", i] = (1.0 + SLACK) * limit - friction
        for k, i in enumerate(equations.rubbing):
            friction = abs(float(lam[equations.first_rub + k]))
            result["slip rub", i] = (1.0 + SLACK) * equations.rub_limit(i, e) - friction
        return result

    # -- events --

    def _happen(self, event: Event) -> None:
        """Apply an event at the front and choose the discrete state that follows."""
        self._count(event)
        if event.kind == "impact":
            self._impact(event.index)
        elif event.kind == "release":
            self._set_discrete(self.discrete.without_hold(event.index))
            self._settle()
        elif event.kind.startswith("slip "):
            self._settle(yields=(event.kind.removeprefix("slip "), event.index))
        else:
            self._settle(turns=(event.kind, event.index))

    def _count(self, event: Event) -> None:
        """Stop a chatter that does not end."""
        since, count = self._window
        if event.time - since > CHATTER_SPAN * self._period():
            since, count = event.time, 0
        self._window = (since, count + 1)
        if count + 1 > CHATTER:
            raise SimulationError(
                f"more than {CHATTER} events ({event.kind} the last) within "
                f"{event.time - since:.3g} s at t = {event.time:.9g} s: the contact chatters; "
                "raise rest_speed or damping.beta, lower the restitution, or give the body room "
                "between its walls"
            )

    def _set_discrete(self, discrete: Discrete) -> None:
        self.discrete, self.k1 = discrete, None
        self._set_equations(self.inputs)

    def _impact(self, hit: int) -> None:
        """Resolve the impact of a stop and of all that touch with it."""
        t, n = self.front_time, self.system.n
        q, v = self.front[:n], self.front[n : 2 * n]
        e = self.system.directions(q)
        gaps, rates = self.equations.gaps(t, e), self.equations.gap_rates(e, v)
        near = TOUCHING * self.system.length
        struck = [
            i
            for i, holds in enumerate(self.discrete.holds)
            if not holds and rates[i] < 0.0 and (i == hit or gaps[i] <= near)
        ]
        if not struck:
            self._settle(resting=[hit] if abs(rates[hit]) <= self._still() else [])
            return
        held = [i for i, holds in enumerate(self.discrete.holds) if holds]
        soft = [i for i in struck if self._captured(i, held, q, v, float(-rates[i]))]
        restitution = np.array(
            [0.0 if i in soft else self._field(i, "restitution") for i in struck]
        )
        after, normal, tangential = self._impulse(q, v, struck, held, restitution)
        self._book([i for i in struck if i not in soft], q, v, after, normal, tangential)
        rates_after = self.equations.gap_rates(e, after)
        resting = [i for i in (*struck, *held) if rates_after[i] <= self._still()]
        self._set_discrete(replace(self.discrete, holds=(False,) * len(gaps)))
        self._settle(resting=resting)

    def _field(self, i: int, name: str) -> float:
        return value(self.mechanism.stops[i], name, self.values)

    def _still(self) -> float:
        return STILL * self._omega_scale() * self.system.length

    def _captured(self, i: int, held: list[int], q: Real, v: Real, speed: float) -> bool:
        """Tell whether a stop that is struck slowly comes to rest.

        It does if, after an impact without restitution, it is pressed, and it closes below
        ``rest_speed`` or comes from a bounce shorter than :data:`SHORTEST_FLIGHT`.  A speed that
        is none but rounding is neither counted nor returned.
        """
        if speed <= self._still():
            return True
        after, _, _ = self._impulse(q, v, [i], held, np.zeros(1))
        holding = self._holding([i, *held], q, after)
        if i not in holding:
            return False
        if speed < self._field(i, "rest_speed"):
            return True
        equations = self._equations_holding(holding, q, after)
        _, lam, _ = equations.accelerations(q, after)
        e, M, loops = self._mass_and_loops(q)
        G = self.equations.gap_rows.jacobian(e)[[i]]
        pressing = float(equations.stop_forces(lam)[i]) * _mobility(M, loops, G)
        return 2.0 * speed < pressing * SHORTEST_FLIGHT * self._period()

    def _impulse(
        self, q: Real, v: Real, struck: list[int], held: list[int], restitution: Real
    ) -> tuple[Real, dict[int, float], dict[int, float]]:
        """Return the velocities after an impact, the normal and the tangential impulses by stop.

        Stops that hold take part: without friction as partners of the complementarity problem,
        with friction as constraints that are let go if they would pull.  Their own friction, and
        that of friction points, is finite and has no impulse.
        """
        k = len(struck)
        e, M, loops = self._mass_and_loops(q)
        gaps = self.equations.gap_rows.jacobian(e)
        u = self.equations.gap_rates(e, v)
        mobilities = np.array(self.inputs.mobilities)
        mu = np.array([self._field(i, "friction") for i in struck])
        if not mu.any():
            partners = struck + held
            G = gaps[partners]
            X = contact.response(M, loops, G)
            W = G @ X + np.diag(mobilities[partners])
            eps = np.concatenate([restitution, np.zeros(len(held))])
            P = contact.newton(W, np.minimum(u[partners], 0.0), eps)
            return v + X @ P, dict(zip(partners, P.tolist(), strict=True)), {}
        kept = list(held)
        while True:
            rows = np.vstack([loops, gaps[kept]])
            G, T = gaps[struck], self.equations.slide_rows.jacobian(e)[struck]
            X = contact.response(M, rows, np.vstack([G, T]))
            W = np.vstack([G, T]) @ X
            W[range(k), range(k)] += mobilities[struck]
            rates = np.concatenate([u[struck], T @ v])
            if k == 1:
                P = np.array(contact.stronge(W, rates, float(mu[0]), float(restitution[0])))
            else:
                P = contact.several(W, rates, mu, restitution)
            after = v + X @ P
            left = M @ (after - v) - np.vstack([G, T]).T @ P
            reaction = np.linalg.lstsq(rows.T, left, rcond=1e-12)[0][len(loops) :]
            pulling = [i for i, p in zip(kept, reaction, strict=True) if p < 0.0]
            if not pulling:
                normal = dict(
                    zip(struck + kept, [*P[:k].tolist(), *reaction.tolist()], strict=True)
                )
                return after, normal, dict(zip(struck, P[k:].tolist(), strict=True))
            kept = [i for i in kept if i not in pulling]

    def _book(
        self,
        counted: list[int],
        q: Real,
        v: Real,
        after: Real,
        normal: Mapping[int, float],
        tangential: Mapping[int, float],
    ) -> None:
        """Put an impact into the state, the energies and the latched outputs.

        At each stop -P (u- + u+)/2 is lost, and as much along the wall; the wall does
        -P (w- + w+)/2, where an impulse changes the velocity w of a wall by its mobility times P.
        """
        n = self.system.n
        e = self.system.directions(q)
        before = [wall.rate for wall in self.inputs.walls]
        u = [self.equations.gap_rates(e, v)]
        self._push_walls(normal)
        u.append(self.equations.gap_rates(e, after))
        slides = self.equations.slide_rows.jacobian(e)
        lost = {i: -P * float(u[0][i] + u[1][i]) / 2 for i, P in normal.items()}
        for i, P in tangential.items():
            lost[i] -= P * float(slides[i] @ (v + after)) / 2
        walls = self.inputs.walls
        work = -sum(P * (before[i] + walls[i].rate) / 2 for i, P in normal.items())
        self.front = self.front.copy()
        self.front[n : 2 * n] = after
        self.front[2 * n] += sum(lost.values())
        self.front[2 * n + 1] += work
        for i, P in normal.items():
            total = self.latched[i].impulse_sum + P
            self.latched[i] = replace(self.latched[i], impulse_sum=total)
        if not counted:
            return
        phi, M = fundamental_at(self.system, q)
        modal = simulated_restitution(phi, M, v, after)
        for i in counted:
            self.latched[i] = Latched(
                self.latched[i].impact_count + 1,
                self.front_time,
                float(-u[0][i]),
                float(u[1][i]),
                normal[i],
                lost[i],
                modal,
                self.latched[i].impulse_sum,
            )
            if self.record is not None:
                stop = self.mechanism.stops[i].name
                self.record.append(
                    Impact(stop, self.front_time, q, v, after, normal[i], self.latched[i])
                )

    def _push_walls(self, normal: Mapping[int, float]) -> None:
        """Give the walls the velocities that impulses leave them with, until the next restart."""
        t, walls = self.front_time, list(self.inputs.walls)
        for i, P in normal.items():
            change = self.inputs.mobilities[i] * P
            if change:
                walls[i] = Wall(walls[i].at(t), walls[i].rate + change, t)
        if tuple(walls) != self.inputs.walls:
            self._set_equations(replace(self.inputs, walls=tuple(walls)))

    def _holding(self, candidates: list[int], q: Real, v: Real) -> list[int]:
        """Return which of the stops at rest hold: pressed together, while the others open.

        What slides rubs meanwhile.  Of stops that can move only together, one holds: the one
        that keeps the others from closing.
        """
        every = sorted(set(candidates))
        e, M, loops = self._mass_and_loops(q)
        G = self.equations.gap_rows.jacobian(e)
        bend = self.equations.gap_rows.convective(e, v)
        closes = -STILL * self._omega_scale() ** 2 * self.system.length
        pressed_only: list[int] = []
        for size in range(len(every), 0, -1):
            found: list[tuple[float, list[int]]] = []
            for members in combinations(every, size):
                holding = list(members)
                if not _independent(G[holding], M, loops):
                    continue
                equations = self._equations_holding(holding, q, v)
                a, lam, _ = equations.accelerations(q, v)
                if all(equations.stop_forces(lam)[i] > 0.0 for i in holding):
                    others = [float(G[i] @ a - bend[i]) for i in every if i not in holding]
                    found.append((min(others, default=0.0), holding))
            if found:
                opens, holding = max(found, key=lambda one: one[0])
                if opens >= closes:
                    return holding
                pressed_only = pressed_only or holding
        return pressed_only

    def _mass_and_loops(self, q: Real) -> tuple[Complex, Real, Real]:
        """Return e, the mass matrix and the Jacobian of the loops at a position."""
        e = self.system.directions(q)
        M, _ = inertia(self.system.H, self.equations.J, e)
        return e, M, constraints.jacobian(self.system.spread(self.system.loops), e)

    def _equations_holding(self, stops: list[int], q: Real, v: Real) -> Equations:
        """Return the equations in which these stops hold, and what slides rubs."""
        e = self.system.directions(q)
        slides, rubs = (
            rows.rates(e, v) for rows in (self.equations.slide_rows, self.equations.rub_rows)
        )
        discrete = Discrete(
            tuple(i in stops for i in range(len(slides))),
            tuple(self._sign(float(x)) if i in stops else IDLE for i, x in enumerate(slides)),
            tuple(self._sign(float(x)) for x in rubs),
        )
        return self._equations(discrete)

    def _sign(self, speed: float) -> int:
        """Return the sign of a sliding velocity, IDLE if it is none but rounding."""
        if abs(speed) <= self._still():
            return IDLE
        return 1 if speed > 0.0 else -1

    def _settle(
        self,
        resting: Sequence[int] = (),
        yields: tuple[str, int] | None = None,
        turns: tuple[str, int] | None = None,
    ) -> None:
        """Choose what holds, sticks and slides at the front, from its state alone.

        Parameters
        ----------
        resting : sequence of int
            Open stops that touch without closing or opening.
        yields : (str, int) or None
            What has just used up its friction and cannot stick.
        turns : (str, int) or None
            What has just stopped sliding, or turns back.
        """
        n, t = self.system.n, self.front_time
        q, v = self.front[:n], self.front[n : 2 * n]
        slow = self._speed_left(*turns, q, v) if turns else 0.0
        e = self.system.directions(q)
        gaps, rates = self.equations.gaps(t, e), self.equations.gap_rates(e, v)
        near, still = TOUCHING * self.system.length + RELEASE_GAP, self._still()
        candidates = [i for i, holds in enumerate(self.discrete.holds) if holds]
        candidates += [
            i for i in resting if i not in candidates and gaps[i] <= near and rates[i] <= still
        ]
        holding = self._holding(candidates, q, v)
        holds = tuple(i in holding for i in range(len(gaps)))
        self._set_discrete(Discrete(holds, (IDLE,) * len(gaps), (IDLE,) * len(self.discrete.rubs)))
        rubbing = [("slide", i) for i in holding if self._field(i, "friction") > 0.0]
        rubbing += [("rub", i) for i, law in enumerate(self.equations.rub_law) if law[0] > 0.0]
        for _ in range(len(rubbing) + 1):  # what one does may change what another must do
            before = self.discrete
            for kind, i in rubbing:
                stops = slow if turns == (kind, i) else 0.0
                state = self._slide_state(kind, i, q, v, yields == (kind, i), stops)
                self._set_discrete(self.discrete.with_slide(kind, i, state))
            if self.discrete == before:
                break
        else:
            at_rest = [
                (kind, i)
                for kind, i in rubbing
                if self._slides(kind, i, q, v, slow if turns == (kind, i) else 0.0) == IDLE
            ]
            self._settle_together(at_rest, q, v, yields)
        if holding:
            self.front = self.equations.project(t, self.front)

    def _speed_left(self, kind: str, i: int, q: Real, v: Real) -> float:
        """Return the sliding speed that the resolution of time leaves when sliding stops [m/s]."""
        a, _, _ = self.equations.accelerations(q, v)
        e, rows = self.system.directions(q), self._slide_rows(kind)
        rate = float(rows.jacobian(e)[i] @ a - rows.convective(e, v)[i])
        return abs(rate) * (2 * TIME_RESOLUTION + 8 * math.ulp(self.front_time))

    def _slide_state(
        self, kind: str, i: int, q: Real, v: Real, yields: bool, slow: float = 0.0
    ) -> int:
        """Return whether something slides (its sign), sticks, or is idle.

        What moves, faster than ``slow``, slides.  What is at rest is idle where the loops and the
        stops that hold leave it no mobility of its own: the stop carries everything and the
        friction nothing.  Else it sticks as far as Coulomb's law allows, and beyond slides in the
        direction in which sliding accelerates it.
        """
        moving = self._slides(kind, i, q, v, slow)
        if moving != IDLE:
            return moving
        if not self._mobile(self.discrete, kind, i, q):
            return IDLE
        e, rows = self.system.directions(q), self._slide_rows(kind)
        row = rows.jacobian(e)[i]
        equations = self._equations(self.discrete.with_slide(kind, i, STICKS))
        _, lam, _ = equations.accelerations(q, v)
        friction, limit = _stick_force(equations, kind, i, lam, e)
        if abs(friction) <= limit and not yields:
            return STICKS
        gives = -1 if friction > 0.0 else 1
        for sign in (gives, -gives):
            trial = self._equations(self.discrete.with_slide(kind, i, sign))
            a, _, _ = trial.accelerations(q, v)
            if sign * float(row @ a - rows.convective(e, v)[i]) > 0.0:
                return sign
        return STICKS if not yields else IDLE

    def _slides(self, kind: str, i: int, q: Real, v: Real, slow: float) -> int:
        """Return the direction in which something slides faster than ``slow``, or IDLE."""
        row = self._slide_rows(kind).jacobian(self.system.directions(q))[i]
        speed = float(row @ v)
        return self._sign(speed) if abs(speed) > slow else IDLE

    def _mobile(self, discrete: Discrete, kind: str, i: int, q: Real) -> bool:
        """Tell whether something has a mobility of its own beside what else holds and sticks."""
        e, M, loops = self._mass_and_loops(q)
        row = self._slide_rows(kind).jacobian(e)[[i]]
        held = self._equations(discrete.with_slide(kind, i, IDLE)).rows.jacobian(e)
        return _mobility(M, held, row) > DEPENDENT * _mobility(M, loops, row)

    def _settle_together(
        self, at_rest: Sequence[tuple[str, int]], q: Real, v: Real, yields: tuple[str, int] | None
    ) -> None:
        """Choose together what those at rest do, who one by one find no end.

        It is the first combination in which what sticks needs no more than its friction, what
        slides begins to slide in its direction, and what holds is pressed.  Without one, or with
        too many at rest, all stays as it is.
        """
        alone = self.discrete
        for kind, i in at_rest:
            alone = alone.with_slide(kind, i, IDLE)
        free = [one for one in at_rest if self._mobile(alone, *one, q)]
        if len(free) > MOST_AT_REST:
            return
        for states in product((STICKS, 1, -1), repeat=len(free)):
            together, chosen = alone, dict(zip(free, states, strict=True))
            for (kind, i), state in chosen.items():
                together = together.with_slide(kind, i, state)
            if (yields, STICKS) not in chosen.items() and self._agree(together, chosen, q, v):
                self._set_discrete(together)
                return

    def _agree(
        self, discrete: Discrete, chosen: Mapping[tuple[str, int], int], q: Real, v: Real
    ) -> bool:
        """Tell whether the forces and accelerations of a discrete state are what it says."""
        sticks = [one for one, state in chosen.items() if state == STICKS]
        if not all(self._mobile(discrete, *one, q) for one in sticks):
            return False
        e, equations = self.system.directions(q), self._equations(discrete)
        a, lam, _ = equations.accelerations(q, v)
        if not all(equations.stop_forces(lam)[i] > 0.0 for i in equations.held):
            return False
        for (kind, i), state in chosen.items():
            if state == STICKS:
                friction, limit = _stick_force(equations, kind, i, lam, e)
                if abs(friction) > limit:
                    return False
            else:
                rows = self._slide_rows(kind)
                if state * float(rows.jacobian(e)[i] @ a - rows.convective(e, v)[i]) <= 0.0:
                    return False
        return True

    # -- outputs --

    def outputs(self) -> dict[str, float | int | bool]:
        """Return all outputs, locals and calculated parameters at the present time, by name.

        Lengths in m, angles in rad, forces in N, energies in J; displacements and energies from
        the straight shape.
        """
        if self._output_cache is None or self._output_cache[0] != self.time:
            self._output_cache = (self.time, self._outputs())
        return dict(self._output_cache[1])

    def motions(self) -> dict[str, float]:
        """Return those of the outputs that tell where bodies and probes are and how they move.

        They cost a third to a half of what all :meth:`outputs` do.
        """
        n, y = self.system.n, self.state()
        q, v = y[:n], y[n : 2 * n]
        return self._motions(q, v, self.system.directions(q))

    def _motions(self, q: Real, v: Real, e: Complex) -> dict[str, float]:
        system = self.system
        out = {}
        for name, frame in system.bodies.items():
            place, velocity = system.motion(frame, e, v)
            out[f"{name}.x"], out[f"{name}.y"] = place.real, place.imag
            out[f"{name}.angle"] = float(q[frame.j])
            out[f"{name}.vx"], out[f"{name}.vy"] = velocity.real, velocity.imag
            out[f"{name}.omega"] = float(v[frame.j])
        for frame in system.probes:
            place, velocity = system.motion(frame, e, v)
            out[f"{frame.name}.x"], out[f"{frame.name}.y"] = place.real, place.imag
            out[f"{frame.name}.vx"], out[f"{frame.name}.vy"] = velocity.real, velocity.imag
        return out

    def _outputs(self) -> dict[str, float | int | bool]:
        system, equations, n, t = self.system, self.equations, self.system.n, self.time
        y = self.state()
        q, v = y[:n], y[n : 2 * n]
        e = system.directions(q)
        a, lam, M = equations.accelerations(q, v)
        out: dict[str, float | int | bool] = {**self._motions(q, v, e)}
        gaps, rates = equations.gaps(t, e), equations.gap_rates(e, v)
        places, speeds = equations.gap_rows.values(e), equations.gap_rows.rates(e, v)
        G, loops = equations.gap_rows.jacobian(e), equations.rows.jacobian(e)[: len(system.loops)]
        pressed = equations.stop_forces(lam)
        mobilities = np.diag(G @ contact.response(M, loops, G))
        for i, stop in enumerate(self.mechanism.stops):
            out[f"{stop.name}.gap"] = float(gaps[i])
            out[f"{stop.name}.gap_rate"] = float(rates[i])
            out[f"{stop.name}.force"] = float(pressed[i])
            drawn = value(stop, "position", system.values)
            out[f"{stop.name}.point.displacement"] = -float(places[i]) - drawn
            out[f"{stop.name}.point.velocity"] = -float(speeds[i])
            out[f"{stop.name}.point.mobility"] = float(mobilities[i])
        force, moment = equations.base_reaction(q, v, a)
        out["base.force.x"], out["base.force.y"] = force.real, force.imag
        out["base.moment"] = moment
        deflection = q - system.q0
        out["energy.kinetic"] = kinetic_energy(M, v)
        out["energy.elastic"] = forces.elastic_energy(system.K, deflection)
        out["energy.gravitational"] = forces.gravitational_energy(system, e)
        out["energy.dissipated"] = float(y[2 * n])
        out["energy.work"] = float(y[2 * n + 1])
        for i, stop in enumerate(self.mechanism.stops):
            out[f"{stop.name}.contact"] = self.discrete.holds[i]
            for name, x in vars(self.latched[i]).items():
                out[f"{stop.name}.{name}"] = x
        for number, j in enumerate(system.links, start=1):
            out[f"link[{number}].angle"] = float(q[j])
            out[f"link[{number}].omega"] = float(v[j])
        for j, link in zip(system.stretches, system.stretched, strict=True):
            number = system.links.index(link) + 1
            out[f"link[{number}].strain"] = float(q[j])
            out[f"link[{number}].strain_rate"] = float(v[j])
        out["mode.frequency"] = self.frequency
        out.update(self.calculated)
        return out

    # -- saving and restoring --

    def snapshot(self) -> dict[str, Any]:
        """Return the complete state as plain values that JSON keeps exactly."""
        arc = self.arc
        return {
            "values": dict(self.values),
            "given": dict(self.given),
            "acting": {
                "values": dict(self.system.values),
                "forces": [[f.real, f.imag] for f in self.inputs.forces],
                "moments": list(self.inputs.moments),
                "base": [self.inputs.base.real, self.inputs.base.imag],
                "mobilities": list(self.inputs.mobilities),
            },
            "tolerance": self.tolerance,
            "step": self.step,
            "time": self.time,
            "received": list(self.received),
            "walls": [asdict(wall) for wall in self.inputs.walls],
            "discrete": asdict(self.discrete),
            "latched": [asdict(latched) for latched in self.latched],
            "window": list(self._window),
            "planned": self._planned,
            "due": self._due,
            "told": list(self._told),
            "swift": list(self._swift),
            "h": self.h,
            "last_error": self.last_error,
            "changed": self.changed,
            "frequency": self.frequency,
            "front_time": self.front_time,
            "front": self.front.tolist(),
            "k1": None if self.k1 is None else self.k1.tolist(),
            "arc": None
            if arc is None
            else {
                "start": arc.start,
                "h": arc.h,
                "end": arc.end,
                "y": arc.y.tolist(),
                "k": arc.k.tolist(),
                "event": None if arc.event is None else asdict(arc.event),
            },
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Return to a state that :meth:`snapshot` gave; what follows is the same to the bit.

        Raises
        ------
        ParameterError
            If the snapshot is not one of this mechanism.
        """
        if snapshot["values"].keys() != self.values.keys() or len(snapshot["front"]) != len(
            self.front
        ):
            raise ParameterError("the saved state belongs to another mechanism")
        s = snapshot
        acting = s["acting"]
        if acting["values"] != self.system.values:
            self.system = assemble(self.mechanism, acting["values"])
            self.calculated = calculated(self.mechanism, acting["values"])
        self.values, self.given, self.prepared = dict(s["values"]), dict(s["given"]), self.system
        if self.values != acting["values"]:
            self.prepared = assemble(self.mechanism, self.values)
        self.tolerance, self.step, self.time = s["tolerance"], s["step"], s["time"]
        self.frequency = s["frequency"]
        self.omega = 2 * math.pi * self.frequency
        d = s["discrete"]
        self.discrete = Discrete(tuple(d["holds"]), tuple(d["slides"]), tuple(d["rubs"]))
        self._set_equations(
            Inputs(
                tuple(complex(*f) for f in acting["forces"]),
                tuple(acting["moments"]),
                complex(*acting["base"]),
                tuple(Wall(**wall) for wall in s["walls"]),
                tuple(acting["mobilities"]),
            )
        )
        self.latched = [Latched(**latched) for latched in s["latched"]]
        self.received = list(s["received"])
        self._window = (s["window"][0], s["window"][1])
        self._planned, self._due, self._told = s["planned"], s["due"], tuple(s["told"])
        self._swift = tuple(s["swift"])
        self.h, self.last_error, self.changed = s["h"], s["last_error"], s["changed"]
        self.front_time, self.front = s["front_time"], np.array(s["front"])
        self.k1 = None if s["k1"] is None else np.array(s["k1"])
        arc = s["arc"]
        self.arc = arc and Arc(
            arc["start"], arc["h"], arc["end"], np.array(arc["y"]), np.array(arc["k"]),
            arc["event"] and Event(**arc["event"]),
        )  # fmt: skip
        self._output_cache = None


def _falls(f: Callable[[float], float], a: float, b: float) -> float:
    """Return when f falls to zero between a, where it is positive, and b, where it is not.

    At the resolution of rounding either may already be otherwise; then it is there.
    """
    if f(a) <= 0.0:
        return float(a)
    if f(b) > 0.0:
        return float(b)
    return float(brentq(f, a, b, xtol=TIME_RESOLUTION))


def _stick_force(
    equations: Equations, kind: str, i: int, lam: Real, e: Complex
) -> tuple[float, float]:
    """Return the friction of what sticks, and its limit [N]."""
    if kind == "rub":
        friction = float(lam[equations.first_rub + equations.rubbing.index(i)])
        return friction, equations.rub_limit(i, e)
    friction = float(lam[equations.first_stick + equations.stuck.index(i)])
    normal = float(lam[equations.first_hold + equations.held.index(i)])
    return friction, equations.stop_friction[i] * normal


def _mobility(M: Real, held: Real, row: Real) -> float:
    """Return the inverse mass along a row (1, n) while others are held [1/kg]."""
    return float((row @ contact.response(M, held, row)).item())


def _independent(rows: Real, M: Real, loops: Real) -> bool:
    """Tell whether each of the rows keeps a mobility of its own beside those before it."""
    for k in range(1, len(rows)):
        row = rows[k : k + 1]
        left = _mobility(M, np.vstack([loops, rows[:k]]), row)
        if left <= ALIGNED * _mobility(M, loops, row):
            return False
    return True


def fundamental_frequency(system: System) -> float:
    """Return the fundamental frequency about the equilibrium under gravity [Hz].

    Zero if that equilibrium is unstable, or something swings without a spring.
    """
    frequency = modes(system, equilibrium(system)).frequency
    lowest = float(frequency[0])
    return lowest if lowest > AT_EASE * float(np.abs(frequency).max()) else 0.0


def _tolerance(x: float) -> float:
    if not (math.isfinite(x) and 1e-13 <= x <= 1e-2):
        raise ParameterError(f"tolerance = {x:g} must lie between 1e-13 and 1e-2")
    return float(x)
