r"""The equations of motion in one discrete state: which stops hold, what slides, what sticks.

    [ M    R^T ] [  a   ]   [ Q - C v^2 ]
    [ R     0  ] [ -lam ] = [ Re(B e) v^2 ]

(w^2 for v^2 where links stretch: see :mod:`prbm.mechanics.assembly`) with R the rows of the loops,
of the stops that hold and of what sticks.  A stop that holds and slides pushes along its gap and,
by Coulomb's law, along its wall: its column differs from its row.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..mechanism.parts import value
from . import constraints, forces
from .arrays import Complex, Real
from .constraints import Rows
from .inputs import Inputs
from .kinetics import inertia, kinetic_energy, mass_accelerations
from .system import FIXED, System

STICKS = 0  # and +1, -1: slides along, against the direction
IDLE = 2  # no friction acts: open, frictionless, or the stop carries everything


@dataclass(frozen=True)
class Discrete:
    """The discrete state.

    Parameters
    ----------
    holds : (s,) bools
        Whether each stop holds (resting contact).
    slides : (s,) of {-1, 0, 1, 2}
        Sliding of each stop along its wall: its sign, :data:`STICKS` or :data:`IDLE`.
    rubs : (f,) of {-1, 0, 1, 2}
        The same for each friction point.
    """

    holds: tuple[bool, ...]
    slides: tuple[int, ...]
    rubs: tuple[int, ...]

    def without_hold(self, stop: int) -> "Discrete":
        """Return the state in which a stop has let go."""
        changed = list(self.holds)
        changed[stop] = False
        return replace(self, holds=tuple(changed))

    def with_slide(self, kind: str, i: int, state: int) -> "Discrete":
        """Return the state in which a held stop ("slide") or a friction point ("rub") slides so."""
        states = list(self.rubs if kind == "rub" else self.slides)
        states[i] = state
        if kind == "rub":
            return replace(self, rubs=tuple(states))
        return replace(self, slides=tuple(states))


class Equations:
    """Accelerations, multipliers and powers of a system in one discrete state.

    Parameters
    ----------
    system : System
        The constant arrays.
    inputs : Inputs
        What acts from outside.
    discrete : Discrete
        What holds, sticks and slides.
    omega : float
        Angular frequency of the fundamental mode, for the damping ratio [rad/s].
    """

    def __init__(self, system: System, inputs: Inputs, discrete: Discrete, omega: float) -> None:
        self.system, self.inputs, self.discrete = system, inputs, discrete
        values, mechanism = system.values, system.mechanism
        self.n = system.n
        self.J = np.diag(system.J)
        self.beta = values["damping.beta"]
        self.mass_damping = 2.0 * values["damping.zeta"] * omega

        held = [i for i, holds in enumerate(discrete.holds) if holds]
        stuck = [i for i in held if discrete.slides[i] == STICKS]
        rubbing = [i for i, s in enumerate(discrete.rubs) if s == STICKS]
        self.held, self.stuck, self.rubbing = held, stuck, rubbing
        B = np.vstack([system.loops, system.gaps[held], system.slides[stuck], system.rubs[rubbing]])
        self.first_hold = len(system.loops)
        self.first_stick = self.first_hold + len(held)
        self.first_rub = self.first_stick + len(stuck)
        self.sliding = [i for i in held if abs(discrete.slides[i]) == 1]
        self.stop_friction = [value(s, "friction", values) for s in mechanism.stops]
        self.rub_law = [
            tuple(
                value(f, what, values)
                for what in ("coefficient", "normal_force", "normal_stiffness")
            )
            for f in mechanism.frictions
        ]
        self.rub_slides = [
            i for i, s in enumerate(discrete.rubs) if abs(s) == 1 and self.rub_law[i][0] > 0.0
        ]

        w = forces.field_row(system.S, -inputs.base)
        self.moment = np.zeros(self.n)
        for frame, force, moment in zip(system.pushed, inputs.forces, inputs.moments, strict=True):
            w = w + forces.force_row(frame.A, force)
            self.moment[frame.j] += moment
        self.w_input = system.spread(w)
        self.w = self.w_input + system.spread(forces.field_row(system.S, system.gravity))
        self.driven = bool(np.any(self.w_input) or np.any(self.moment))
        self.walls_push = any(inputs.walls[i].rate for i in held)

        loops, rubs = len(system.loops), len(rubbing)
        c = np.zeros(len(B))
        c[:loops] = system.loops_c
        for k, i in enumerate(held):
            c[self.first_hold + k] = system.gaps_c[i] + inputs.walls[i].position
        z = np.zeros(len(B), complex)
        on = np.full(len(B), FIXED)
        z[loops : len(B) - rubs] = [*system.gaps_z[held], *system.slides_z[stuck]]
        on[loops : len(B) - rubs] = [*system.on[held], *system.on[stuck]]
        self.rows = Rows(system, B, c, z, on)
        self.positions = self.rows.first(self.first_stick)
        self.gap_rows, self.slide_rows = system.watched.gaps, system.watched.slides
        self.rub_rows = system.watched.rubs

        # one product with e serves loads, inertia and constraints: see accelerations
        self.stack: Complex = np.vstack([self.w, system.H, 1j * self.rows.spread])
        self.J_stack = np.zeros((self.n + len(B), self.n))
        self.J_stack[: self.n] = self.J
        self.kkt = np.zeros((self.n + len(B),) * 2, order="F")
        # springs and their damping in one product with y = (q, v, ...): see torques
        self.K_y = np.block(
            [[system.K, self.beta * system.K], [0 * system.K, self.beta * system.K]]
        )
        self.straight = np.concatenate([system.K @ system.q0, np.zeros(self.n)])
        self.trace: list[Real] = []

    # -- motion --

    def accelerations(self, q: Real, v: Real) -> tuple[Real, Real, Real]:
        """Return accelerations, multipliers and the mass matrix.

        Parameters
        ----------
        q, v : (n,)
            Angles and rates [rad], [rad/s].

        Returns
        -------
        a : (n,)
            [rad/s^2].
        lam : (r,)
            Loops, then the forces of the stops that hold (> 0 pushes), of what sticks [N].
        M : (n, n)
            Mass matrix [kg m^2].
        """
        torques = self.torques(np.concatenate([q, v]))
        return self._solve(q, v, torques[: self.n])

    def torques(self, y: Real) -> Real:
        """Return what springs and their damping take up, and the share of the damping.

        Parameters
        ----------
        y : (2 n,)
            Angles, rates [rad], [rad/s].

        Returns
        -------
        (2 n,)
            K (q - q0) + beta K v, then beta K v [N m].
        """
        result: Real = self.K_y @ y
        result -= self.straight
        return result

    def _solve(self, q: Real, v: Real, torques: Real) -> tuple[Real, Real, Real]:
        """Return accelerations, multipliers and mass matrix for given torques of the springs.

        All that depends on e comes from one product, row by row:

            G = [w e;  diag(e)^H H diag(e);  i B e],

        whose real parts are the load, M - J and the constraint rows, and whose imaginary parts
        are -C (:func:`prbm.mechanics.kinetics.inertia`) and the convective terms Re(B e).
        """
        n, kkt = self.n, self.kkt
        e, w = self.system.directions(q), self.system.turning(v)
        G = self.stack * e
        G[1 : n + 1] *= e.conj()[:, None]
        carried = n + self.rows.carried
        if len(carried):
            G.real[1 + carried] = self.rows.jacobian(e)[self.rows.carried]
        np.add(G.real[1:], self.J_stack, out=kkt[:, :n])
        kkt[:n, n:] = kkt[n:, :n].T
        M = kkt[:n, :n]
        right: Real = (G[1:] @ (w * w)).imag if np.iscomplexobj(w) else G.imag[1:] @ (v * v)
        if len(carried):
            right[carried] = self.rows.carried_convective(e, v, w)
        Q = right[:n]
        Q += G.real[0]
        Q -= torques
        if self.driven:
            Q += self.moment
        if self.mass_damping:
            Q -= self.mass_damping * (M @ v)
        for i in self.rub_slides:
            Q += self._rub_force(i, e) * self.rub_rows.jacobian(e)[i]
        for i in self.sliding:
            share = -self.stop_friction[i] * self.discrete.slides[i]
            column = n + self.first_hold + self.held.index(i)
            kkt[:n, column] += share * self.slide_rows.jacobian(e)[i]
        x, self.factors = constraints.factor_and_solve(kkt, right)
        return x[:n], -x[n:], M

    def _rub_force(self, i: int, e: Complex) -> float:
        """Return the friction force of a sliding friction point along its direction [N]."""
        return -self.discrete.rubs[i] * self.rub_limit(i, e)

    def rub_limit(self, i: int, e: Complex) -> float:
        """Return mu N of a friction point [N]."""
        mu, preload, stiffness = self.rub_law[i]
        lift = float((self.system.lifts[i] @ e).real) + self.system.lifts_c[i]
        return mu * forces.normal_force(lift, preload, stiffness)

    def rate(self, t: float, y: Real) -> Real:
        """Return dy/dt for y = (q, v, dissipated energy, work)."""
        n = self.n
        q, v = y[:n], y[n : 2 * n]
        torques = self.torques(y[: 2 * n])
        a, lam, M = self._solve(q, v, torques[:n])
        self.trace.append(lam)
        result = np.empty(2 * n + 2)
        result[:n] = v
        result[n : 2 * n] = a
        result[2 * n] = v @ torques[n:]
        result[2 * n + 1] = 0.0
        if self.mass_damping:
            result[2 * n] += 2.0 * self.mass_damping * kinetic_energy(M, v)
        if self.rub_slides or self.sliding:
            result[2 * n] += self._rubbing_power(q, v, lam)
        if self.driven or self.walls_push:
            result[2 * n + 1] = self._input_power(q, v, lam)
        return result

    def _rubbing_power(self, q: Real, v: Real, lam: Real) -> float:
        """Return the power that friction takes out [W]."""
        e = self.system.directions(q)
        power = 0.0
        for i in self.rub_slides:
            power -= self._rub_force(i, e) * float(self.rub_rows.rates(e, v)[i])
        for i in self.sliding:
            rate = float(self.slide_rows.rates(e, v)[i])
            force = float(lam[self.first_hold + self.held.index(i)])
            power += self.stop_friction[i] * force * self.discrete.slides[i] * rate
        return power

    def _input_power(self, q: Real, v: Real, lam: Real) -> float:
        """Return the power of the inputs and of the moving walls that hold [W]."""
        power = 0.0
        if self.driven:
            e = self.system.directions(q)
            power += float((forces.generalised(self.w_input, e) + self.moment) @ v)
        for k, i in enumerate(self.held):
            power -= float(lam[self.first_hold + k]) * self.inputs.walls[i].rate
        return power

    # -- constraints --

    def offsets(self, t: float) -> Real:
        """Return the constant parts of the active constraints at time t [m]."""
        if not self.walls_push:
            return self.rows.c
        c = self.rows.c.copy()
        for k, i in enumerate(self.held):
            c[self.first_hold + k] = self.system.gaps_c[i] + self.inputs.walls[i].at(t)
        return c

    def project(self, t: float, y: Real) -> Real:
        """Return the state on the constraints, positions and velocities.

        What sticks is kept by its velocity alone: where it stuck is not a constraint.
        """
        n, r = self.n, self.first_stick
        q, e = constraints.project_positions(
            self.system, self.positions, y[:n], self.offsets(t)[:r]
        )
        rows = self.rows.jacobian(e)
        rates = np.zeros(len(rows))
        for k, i in enumerate(self.held):
            rates[self.first_hold + k] = self.inputs.walls[i].rate
        result = y.copy()
        result[:n] = q
        M, _ = inertia(self.system.H, self.J, e)
        result[n : 2 * n] = constraints.project_velocities(M, rows, rates, y[n : 2 * n])
        return result

    def project_from_here(self, t: float, y: Real) -> Real:
        """Return what :meth:`project` does, for the state that was evaluated last.

        Its matrix is at hand and the state is as close to the constraints as a step leaves it,
        so that one correction of the positions and one of the velocities are enough; if they
        are not, the iteration does the rest.
        """
        if self.sliding:
            return self.project(t, y)
        system, n, r = self.system, self.n, self.first_stick
        c = self.offsets(t)
        right = np.zeros(n + len(c))
        right[n : n + r] = -self.positions.values(system.directions(y[:n]), c[:r])
        result = y.copy()
        result[:n] += constraints.solve_again(self.factors, right)[:n]
        e = system.directions(result[:n])
        open_by = self.positions.values(e, c[:r])
        if len(open_by) and np.abs(open_by).max() > constraints.CLOSED * system.length:
            return self.project(t, y)
        rates = self.rows.rates(e, result[n : 2 * n])
        for k, i in enumerate(self.held):
            rates[self.first_hold + k] += self.inputs.walls[i].rate
        right[n:] = -rates
        result[n : 2 * n] += constraints.solve_again(self.factors, right)[:n]
        return result

    # -- stops --

    def gaps(self, t: float | Real, e: Complex) -> Real:
        """Return the gaps of all stops [m]; ``e`` may be a stack (m, n), one row a time t."""
        walls = np.array([wall.at(t) for wall in self.inputs.walls]).T
        result: Real = self.gap_rows.values(e) + walls
        return result

    def gap_rates(self, e: Complex, v: Real) -> Real:
        """Return the rates of all gaps [m/s]; ``e`` and ``v`` may be stacks (m, n)."""
        walls = np.array([wall.rate for wall in self.inputs.walls])
        result: Real = self.gap_rows.rates(e, v) + walls
        return result

    def stop_forces(self, lam: Real) -> Real:
        """Return the normal forces of all stops, zero where open [N]."""
        result = np.zeros(len(self.discrete.holds))
        result[self.held] = lam[self.first_hold : self.first_stick]
        return result

    # -- reactions --

    def base_reaction(self, q: Real, v: Real, a: Real) -> tuple[complex, float]:
        """Return the force [N] and the moment about the first clamp [N m] on the ground.

        From the balance of momentum of everything that moves: what the ground, its stops and
        its friction points put in is what gravity, the inputs and inertia leave.
        """
        system = self.system
        e = system.directions(q)
        z = system.A @ e + system.c - system.anchor
        field = system.gravity - self.inputs.base
        speed, change = system.turning(v), system.turning(a)
        load = system.m * (field - mass_accelerations(system.A, e, speed, change))
        force = complex(load.sum())
        moment = float((z.conj() * load).imag.sum() - system.J @ a)
        for f, m, frame in zip(self.inputs.forces, self.inputs.moments, system.pushed, strict=True):
            place = complex(frame.A @ e) + frame.c - system.anchor
            force += f
            moment += (place.conjugate() * f).imag + m
        return force, moment
