r"""The equations of motion for one state of the contacts.

    M a - R^T lam = Phi^T (Re(w e) + Im(Hq w^2)) + P,    R a = Re(B e w^2)

M is the mass matrix, a the accelerations, lam the multipliers, and P the forces of flexures, joints
and springs with their damping (:mod:`prbm.mechanics.elements`).  R has the rows of the loops, of
the held stops and of the sticking contacts.  Mass matrix, forces and rows are formed for the
directions e with the rates w of the arms (:mod:`prbm.mechanics.system`), and pulled back to the
coordinates by Phi (:mod:`prbm.mechanics.direction_map`).  Forces of friction, of inputs and of
pressed stops with the compliant law (:mod:`prbm.mechanics.compliant_stops`) are added to the loads.
The force of a held stop that slips acts along its gap and, by Coulomb's law, along its wall; its
column in R^T therefore differs from its row in R.  So does that of a guide that slips.
"""

from typing import NamedTuple

import numpy as np

from ..mechanism.parts import value
from . import constraints, forces
from .arrays import Complex, Real
from .compliant_stops import CompliantState, CompliantStops, Pressure
from .contact_state import ContactMode, ContactState
from .elements import Elements
from .inputs import Inputs
from .kinetics import mass_accelerations
from .system import FIXED, Rows, System


class Evaluation(NamedTuple):
    """The equations of motion, solved at one state.

    Parameters
    ----------
    a : (n,)
        Accelerations [rad/s^2].
    lam : (r,)
        Forces of the loops, then of the stops that hold (> 0 pushes), then of the contacts that
        stick [N].
    scaled, scale : (n, n), (n,)
        Scaled mass matrix, and its scales.
    factors : Factors
        Factors of the equations, for :meth:`Equations.project_near`.
    e : (d,) complex
        Directions.
    mass_loss : float
        Power that damping in proportion to mass dissipates [W].
    pressure : Pressure or None
        Forces of the pressed compliant stops, if there are any.
    """

    a: Real
    lam: Real
    scaled: Real
    scale: Real
    factors: constraints.Factors
    e: Complex
    mass_loss: float
    pressure: Pressure | None = None

    @property
    def M(self) -> Real:
        """Mass matrix, (n, n) [kg m^2]."""
        return self.scaled / self.scale / self.scale[:, None]


class FrictionLaw(NamedTuple):
    """Coulomb's law of a friction point: coefficient [-], normal force [N], stiffness [N/m]."""

    coefficient: float
    normal_force: float
    normal_stiffness: float


class Equations:
    """Accelerations, multipliers and powers of a system in one state of its contacts.

    No method changes the object: each result depends on its arguments alone.

    Parameters
    ----------
    system : System
        The constant arrays.
    inputs : Inputs
        Forces, walls and the acceleration of the base.
    contacts : ContactState
        The modes of stops and friction points.
    omega : float
        Angular frequency of the fundamental mode, for the damping ratio [rad/s].
    """

    def __init__(
        self, system: System, inputs: Inputs, contacts: ContactState, omega: float
    ) -> None:
        self.system, self.inputs, self.contacts, self.omega = system, inputs, contacts, omega
        values, mechanism = system.values, system.mechanism
        self.n = system.n
        self.elements = Elements(system, contacts.springs)
        self.element = self.elements.sole
        self.beta = values["damping.beta"]
        self.mass_damping = 2.0 * values["damping.zeta"] * omega
        self.stop_friction = [value(s, "friction", values) for s in mechanism.stops]
        self.guide_friction = [
            value(g, "friction", values) for g in mechanism.guides if g.friction is not None
        ]
        self.friction_laws = [
            FrictionLaw(*(value(f, name, values) for name in FrictionLaw._fields))
            for f in mechanism.frictions
        ]
        self.compliant = CompliantStops(mechanism, values, contacts)
        self._number_contacts()
        self._collect_loads()
        self._stack_rows()
        self._scale_terms()

    def _number_contacts(self) -> None:
        """Sort the contacts by their modes, and number their rows."""
        modes, stops = self.contacts.modes, self.contacts.stops
        self.held, self.pressed = list(self.contacts.held), list(self.contacts.pressed)
        self.sticking = [c for c, mode in enumerate(modes) if mode is ContactMode.STICK]
        self.first_hold = len(self.system.loops)
        self.first_stick = self.first_hold + len(self.held)
        guides = [stops + k for k in np.flatnonzero(self.system.normals != FIXED).tolist()]
        # The normal forces of these contacts are multipliers.
        self.slipping_rows = [c for c in [*self.held, *guides] if modes[c].slip]
        self.slipping_guides = [c for c in guides if modes[c].slip]
        self.slipping_points = [
            c for c in [*self.pressed, *range(stops, len(modes))]
            if modes[c].slip and c not in guides and self.friction_coefficient(c) > 0.0
        ]  # fmt: skip

    def _collect_loads(self) -> None:
        """Add up the rows of gravity, of the base and of the forces."""
        system, inputs = self.system, self.inputs
        w = forces.field_row(system.S, -inputs.base)
        self.moment = np.zeros(self.n)
        for frame, force, moment in zip(system.pushed, inputs.forces, inputs.moments, strict=True):
            w = w + forces.force_row(frame.A, force)
            self.moment[frame.j] += moment
        self.w_input = system.repeat_columns(w)
        self.w = self.w_input + system.repeat_columns(forces.field_row(system.S, system.gravity))
        self.driven = bool(np.any(self.w_input) or np.any(self.moment))
        held = [inputs.walls[i] for i in self.held]
        self.moving_walls = any(wall.rate or wall.span for wall in held)

    def _stack_rows(self) -> None:
        """Stack the rows of the active constraints: loops, held stops, sticking contacts."""
        system, held, stops = self.system, self.held, self.contacts.stops
        stuck = [c for c in self.sticking if c < stops]
        rubbing = [c - stops for c in self.sticking if c >= stops]
        self.rows = system.loop_rows.beside(
            system.gap_rows.some(held), system.slide_rows.some(stuck), system.rub_rows.some(rubbing)
        )
        for k, i in enumerate(held):
            self.rows.c[self.first_hold + k] += self.inputs.walls[i].position
            self.rows.c[self.first_hold + k] += self.contacts.depth(i)
        self.positions = self.rows.first(self.first_stick)

    def _scale_terms(self) -> None:
        """Collect the constant terms of the equations, scaled.

        The scales make the elements of the matrix at most near one.  They are powers of two, so
        that they change no digit.
        """
        system, n = self.system, self.n
        masses = np.sqrt(system.straight_masses)
        longest = (self.rows.reach() / masses).max(axis=1, initial=0.0)
        most = np.concatenate([masses, np.where(longest > 0.0, longest, 1.0)])
        self.scale: Real = np.ldexp(1.0, -np.frexp(most)[1])
        self.force_scale = self.scale[:n].copy()
        lines = 1j * self.rows.repeated * self.scale[n:, None]
        self.terms = np.vstack([system.H, lines, 1j * self.w])
        self.moves = np.hstack(
            [system.Phi.Phi * self.force_scale, np.zeros((len(self.w), 1))]
        ).astype(complex)
        self.saddle = np.zeros((len(self.scale),) * 2)
        self.saddle[:n, :n] = system.inertia * self.force_scale * self.force_scale[:, None]

    def with_contacts(self, contacts: ContactState) -> "Equations":
        """Return the equations for another state of the contacts."""
        if contacts == self.contacts:
            return self
        return Equations(self.system, self.inputs, contacts, self.omega)

    def with_inputs(self, inputs: Inputs) -> "Equations":
        """Return the equations with other inputs."""
        return Equations(self.system, inputs, self.contacts, self.omega)

    # -- motion --

    def at(self, t: float, y: Real) -> Evaluation:
        """Return the evaluation at a state y, as :meth:`evaluate`."""
        n = self.n
        return self.evaluate(t, y[:n], y[n : 2 * n], y[2 * n + 2 :])

    def evaluate(self, t: float, q: Real, v: Real, extras: Real | None = None) -> Evaluation:
        """Return accelerations, multipliers, mass matrix and factors.

        With F = diag(e) Phi, the products of H, of i B for the rows B and of i w for the loads w
        with [F, e w^2] contain all terms: M and the quadratic velocity terms are the real and
        imaginary part of F^H H [F, e w^2] (:func:`prbm.mechanics.kinetics.inertia`).

        Parameters
        ----------
        t : float
            Time, for the accelerations of walls [s].
        q, v : (n,)
            Angles and rates [rad], [rad/s].
        extras : (4 c,) or None
            States of the c compliant stops; None: zeros.

        Raises
        ------
        SimulationError
            If the equations are singular.
        """
        system, n, d = self.system, self.n, len(self.w)
        e, w = system.directions(q), system.turning(v)
        moved = self.moves * e[:, None]
        np.multiply(e, w * w, out=moved[:, n])
        terms = self.terms.dot(moved)
        moments = moved.conj().T.dot(terms[:d])
        kkt, right = self.saddle.copy(), np.empty(len(self.scale))
        kkt[:n, :n] += moments.real[:n, :n]
        if len(kkt) > n:
            self._set_rows(t, e, v, terms, kkt, right)
        Q = self.element.motion_force(q, e, v, self.beta)
        if self.driven:
            Q += self.moment
        pressure = None
        if self.pressed:
            gaps, rates = self.gaps(t, e, extras), self.gap_rates(t, e, v, extras)
            pressure = self.compliant.pressure(gaps, rates)
            Q += pressure.force @ system.gap_rows.jacobian(e)[self.pressed]
        for c in self.slipping_points:
            limit = self.friction_limit(c, e, pressure)
            Q -= self.contacts.modes[c].slip * limit * self.slip_row(c, e)
        Q *= self.force_scale
        mass_loss = 0.0
        if self.mass_damping:
            speed = v / self.force_scale
            drag = self.mass_damping * kkt[:n, :n].dot(speed)
            Q -= drag
            mass_loss = float(drag.dot(speed))
        Q += moments.imag[:n, n]
        np.add(Q, terms.imag[-1, :n], out=right[:n])
        for c in self.slipping_rows:
            share = self.friction_coefficient(c) * self.contacts.modes[c].slip
            share *= self.contacts.side(c) * self.scale[n + self.normal_row(c)]
            kkt[:n, n + self.normal_row(c)] -= share * self.slip_row(c, e) * self.force_scale
        x, factors = constraints.factor_and_solve(kkt, right, n, system.length, self.scale)
        M = kkt[:n, :n]
        return Evaluation(x[:n], -x[n:], M, self.force_scale, factors, e, mass_loss, pressure)

    def _set_rows(
        self, t: float, e: Complex, v: Real, terms: Complex, kkt: Real, right: Real
    ) -> None:
        """Set the scaled rows and their convective terms, from the products of :meth:`evaluate`."""
        n, d = self.n, len(self.w)
        R, bent = kkt[n:, :n], right[n:]
        R[:], bent[:] = terms.real[d:-1, :n], terms.imag[d:-1, n]
        if len(self.rows.carried):
            carried, unit = self.rows.carried, self.scale[n + self.rows.carried]
            slopes, convective = self.rows.carried_terms(e, v)
            R[carried] = unit[:, None] * slopes * self.force_scale
            bent[carried] = unit * convective
        kkt[:n, n:] = R.T
        if self.moving_walls:
            walls = slice(self.first_hold, self.first_stick)
            bent[walls] -= self.scale[n:][walls] * self.held_motions(t)[2]

    # -- rates of the state --

    def rate(self, t: float, y: Real) -> Real:
        """Return dy/dt for y = (q, v, dissipated energy, work, states of compliant stops)."""
        return self.rate_and_evaluation(t, y)[0]

    def rate_and_evaluation(self, t: float, y: Real) -> tuple[Real, Evaluation]:
        """Return dy/dt as :meth:`rate`, and the evaluation there."""
        n = self.n
        q, v, extras = y[:n], y[n : 2 * n], y[2 * n + 2 :]
        evaluation = self.evaluate(t, q, v, extras)
        loss, power = evaluation.mass_loss + self.element.loss(evaluation.e, v, self.beta), 0.0
        if self.slipping_points or self.slipping_rows:
            loss += friction_power(self, q, v, evaluation)
        if self.driven or self.moving_walls:
            power = input_power(self, t, q, v, evaluation.lam)
        result = np.empty(len(y))
        result[:n] = v
        result[n : 2 * n] = evaluation.a
        result[2 * n] = loss
        result[2 * n + 1] = power
        if len(extras):
            add_compliant_rates(self, t, extras, evaluation, result)
        return result, evaluation

    # -- constraints --

    def held_motions(self, t: float) -> Real:
        """Return positions, velocities and accelerations of the walls of held stops, (3, h)."""
        return np.array([self.inputs.walls[i].motion(t) for i in self.held]).T

    def offsets(self, t: float) -> Real:
        """Return the constant parts of the active constraints at time t [m]."""
        if not self.moving_walls:
            return self.rows.c
        c = self.rows.c.copy()
        depths = [self.contacts.depth(i) for i in self.held]
        c[self.first_hold : self.first_stick] = self.system.gaps_c[self.held] + depths
        c[self.first_hold : self.first_stick] += self.held_motions(t)[0]
        return c

    def project(self, t: float, y: Real) -> Real:
        """Return the state with positions and velocities projected onto the constraints.

        A contact that sticks is constrained by its velocity alone, not by its position.

        Raises
        ------
        SimulationError
            If the loops cannot be closed near the state.
        """
        n, r = self.n, self.first_stick
        q, e = constraints.project_positions(
            self.system, self.positions, y[:n], self.offsets(t)[:r]
        )
        rows = self.rows.jacobian(e)
        rates = np.zeros(len(rows))
        if self.moving_walls:
            rates[self.first_hold : r] = self.held_motions(t)[1]
        result = y.copy()
        result[:n] = q
        M = self.system.mass_matrix(e)
        v = constraints.project_velocities(M, rows, rates, y[n : 2 * n], self.system.length)
        result[n : 2 * n] = v
        return result

    def project_near(self, t: float, y: Real, factors: constraints.Factors) -> Real:
        """Return the projection of a state near the constraints, as at the end of a step.

        One correction of the positions and one of the velocities is usually enough.  Otherwise the
        result of :meth:`project` is returned.

        Parameters
        ----------
        t : float
            Time [s].
        y : (2 n + 2,)
            State.
        factors : Factors
            Factors of the evaluation at the state.
        """
        if self.slipping_rows:
            return self.project(t, y)
        system, n, r = self.system, self.n, self.first_stick
        c = self.offsets(t)
        right = np.zeros(n + len(c))
        right[n : n + r] = -self.positions.values(system.directions(y[:n]), c[:r])
        result = y.copy()
        result[:n] += constraints.solve_saddle(factors, right)[:n]
        e = system.directions(result[:n])
        residual = self.positions.values(e, c[:r])
        if not constraints.satisfied(residual, system.length):
            return self.project(t, y)
        rates = self.rows.rates(e, result[n : 2 * n])
        if self.moving_walls:
            rates[self.first_hold : r] += self.held_motions(t)[1]
        right[n:] = -rates
        result[n : 2 * n] += constraints.solve_saddle(factors, right)[:n]
        return result

    # -- stops --

    def gaps(self, t: float | Real, e: Complex, extras: Real | None = None) -> Real:
        """Return the gaps of all stops [m]; ``e`` may be a stack (m, d), one row per time t.

        Without the states ``extras`` (4 c,) of the compliant stops, their walls do not give way.
        """
        walls = np.array([wall.motion(t)[0] for wall in self.inputs.walls]).T
        result: Real = self.system.gap_rows.values(e) + walls
        self.compliant.add_recoils(extras, result, CompliantState.RECOIL)
        return result

    def gap_rates(self, t: float | Real, e: Complex, v: Real, extras: Real | None = None) -> Real:
        """Return the rates of all gaps [m/s]; arguments may be stacks, as for :meth:`gaps`."""
        walls = np.array([wall.motion(t)[1] for wall in self.inputs.walls]).T
        result: Real = self.system.gap_rows.rates(e, v) + walls
        self.compliant.add_recoils(extras, result, CompliantState.RECOIL_RATE)
        return result

    def gap_accelerations(
        self, t: float, e: Complex, v: Real, a: Real, pressure: Pressure | None = None
    ) -> Real:
        """Return the accelerations of all gaps [m/s^2] for accelerations a (n,) [rad/s^2].

        Walls give way to the forces of pressed stops.
        """
        rows = self.system.gap_rows
        walls = np.array([wall.motion(t)[2] for wall in self.inputs.walls])
        result: Real = rows.jacobian(e) @ a - rows.convective(e, v) + walls
        if pressure is not None:
            result[self.pressed] += np.array(self.inputs.mobilities)[self.pressed] * pressure.force
        return result

    def stop_forces(self, lam: Real, pressure: Pressure | None = None) -> Real:
        """Return the normal forces of all stops, (s,), zero where open [N]."""
        result = np.zeros(self.contacts.stops)
        result[self.held] = lam[self.first_hold : self.first_stick]
        if pressure is not None:
            result[self.pressed] = pressure.force
        return result

    def normal_row(self, contact: int) -> int:
        """Return the row whose multiplier is the normal force of a held stop or of a guide."""
        if self.contacts.is_stop(contact):
            return self.first_hold + self.held.index(contact)
        return int(self.system.normals[contact - self.contacts.stops])

    def is_guide(self, contact: int) -> bool:
        """Return whether a contact is a guide with friction."""
        stops = self.contacts.stops
        return contact >= stops and bool(self.system.normals[contact - stops] != FIXED)

    # -- friction --

    def slip_rows(self, contact: int) -> tuple[Rows, int]:
        """Return the rows of displacements that include that of a contact, and its index."""
        stops = self.contacts.stops
        if contact < stops:
            return self.system.slide_rows, contact
        return self.system.rub_rows, contact - stops

    def slip_row(self, contact: int, e: Complex) -> Real:
        """Return the gradient of the displacement along a contact, (n,) [m/rad]."""
        rows, i = self.slip_rows(contact)
        result: Real = rows.jacobian(e)[i]
        return result

    def slip_rate(self, contact: int, e: Complex, v: Real) -> float:
        """Return the sliding velocity of a contact [m/s]."""
        rows, i = self.slip_rows(contact)
        return float(rows.rates(e, v)[i])

    def slip_acceleration(self, contact: int, e: Complex, v: Real, a: Real) -> float:
        """Return the sliding acceleration of a contact [m/s^2]."""
        rows, i = self.slip_rows(contact)
        return float(rows.jacobian(e)[i] @ a - rows.convective(e, v)[i])

    def friction_coefficient(self, contact: int) -> float:
        """Return the coefficient of friction of a contact [-]."""
        stops, points = self.contacts.stops, len(self.friction_laws)
        if contact < stops:
            return self.stop_friction[contact]
        if contact < stops + points:
            return self.friction_laws[contact - stops].coefficient
        return self.guide_friction[contact - stops - points]

    def friction(
        self, contact: int, e: Complex, lam: Real, pressure: Pressure | None = None
    ) -> tuple[float, float]:
        """Return the friction force of a sticking contact, and its limit mu N [N]."""
        force = float(lam[self.first_stick + self.sticking.index(contact)])
        if contact in self.held:
            return force, self.stop_friction[contact] * float(lam[self.normal_row(contact)])
        if self.is_guide(contact):
            normal = abs(float(lam[self.normal_row(contact)]))
            return force, self.friction_coefficient(contact) * normal
        return force, self.friction_limit(contact, e, pressure)

    def side_force(self, contact: int, lam: Real) -> float:
        """Return the normal force of a held stop, or that of a guide to its side [N]."""
        return self.contacts.side(contact) * float(lam[self.normal_row(contact)])

    def friction_limit(self, contact: int, e: Complex, pressure: Pressure | None = None) -> float:
        """Return mu N of a friction point, or of a pressed stop [N]."""
        if self.contacts.is_stop(contact):
            assert pressure is not None
            force = float(pressure.force[self.pressed.index(contact)])
            return self.stop_friction[contact] * max(force, 0.0)
        point = contact - self.contacts.stops
        mu, preload, stiffness = self.friction_laws[point]
        lift = float((self.system.lifts[point] @ e).real) + self.system.lifts_c[point]
        return mu * forces.normal_force(lift, preload, stiffness)


def sliding_friction(
    equations: Equations, contact: int, e: Complex, evaluation: Evaluation
) -> float:
    """Return the friction force of a slipping contact against its motion [N]."""
    if contact in equations.slipping_rows:
        force = equations.side_force(contact, evaluation.lam)
        return equations.friction_coefficient(contact) * force
    return equations.friction_limit(contact, e, evaluation.pressure)


def friction_power(equations: Equations, q: Real, v: Real, evaluation: Evaluation) -> float:
    """Return the power that friction dissipates [W]."""
    e, modes, power = equations.system.directions(q), equations.contacts.modes, 0.0
    for c in (*equations.slipping_points, *equations.slipping_rows):
        force = sliding_friction(equations, c, e, evaluation)
        power += modes[c].slip * force * equations.slip_rate(c, e, v)
    return power


def input_power(equations: Equations, t: float, q: Real, v: Real, lam: Real) -> float:
    """Return the power of the inputs and of the moving walls of held stops [W]."""
    power, system = 0.0, equations.system
    if equations.driven:
        e = system.directions(q)
        load = system.Phi.to_coordinates(forces.generalised(equations.w_input, e))
        power += float((load + equations.moment) @ v)
    if equations.moving_walls:
        held = lam[equations.first_hold : equations.first_stick]
        power -= float(held @ equations.held_motions(t)[1])
    return power


def add_compliant_rates(
    equations: Equations, t: float, extras: Real, evaluation: Evaluation, result: Real
) -> None:
    """Add losses, the work of walls and the rates of the states of compliant stops to dy/dt.

    Parameters
    ----------
    equations : Equations
        Equations of motion.
    t : float
        Time [s].
    extras : (4 c,)
        States of the compliant stops.
    evaluation : Evaluation
        Evaluation at the state.
    result : (2 n + 2 + 4 c,)
        dy/dt, which is changed.
    """
    own, n, inputs = equations.compliant, equations.n, equations.inputs
    result[2 * n + 2 :] = own.rates(
        extras, inputs, equations.stop_forces(evaluation.lam, evaluation.pressure)
    )
    pressure = evaluation.pressure
    if pressure is None:
        return
    for i, force, loss in zip(equations.pressed, pressure.force, pressure.loss, strict=True):
        recoil_rate = extras[own.index(i, CompliantState.RECOIL_RATE)]
        result[2 * n] += loss
        result[2 * n + 1] -= force * (inputs.walls[i].motion(t)[1] + recoil_rate)
        result[2 * n + 2 + own.index(i, CompliantState.LOSS)] = loss


def base_reaction(equations: Equations, q: Real, v: Real, a: Real) -> tuple[complex, float]:
    """Return the force [N] and the moment [N m] of the mechanism on the ground.

    They follow from the balance of momentum of all moving parts: the forces of clamps, pins, stops
    and friction points on the ground balance gravity, inputs and inertia.  The moment is about the
    first flexure end on the ground, or about the origin if there is none.
    """
    system, inputs = equations.system, equations.inputs
    e = system.directions(q)
    z = system.A @ e + system.c - system.anchor
    field = system.gravity - inputs.base
    bent = mass_accelerations(system.A, e, system.turning(v), system.swing(e, a))
    load = system.m * (field - bent)
    force = complex(load.sum())
    moment = float((z.conj() * load).imag.sum() - system.J @ system.turning(a).real)
    for f, m, frame in zip(inputs.forces, inputs.moments, system.pushed, strict=True):
        place = complex(frame.A @ e) + frame.c - system.anchor
        force += f
        moment += (place.conjugate() * f).imag + m
    return force, moment
