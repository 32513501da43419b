r"""Elements with energy: flexures, torsion at joints, and springs between points.

All implement one interface, :class:`Element`: force, tangent stiffness, energy, damping, and bounds
of the fastest rate.  Equations of motion, statics, modes, linear models, scales and the stable step
read :class:`Elements`, the sum of all.

Torsion at a joint is a function of the rotation phi of one body relative to the other since the
drawn shape, with the moment k (phi - phi0) + (beta k + c) phi' that turns them back.

A spring is a function of the distance l of its ends, z = c + A E from its start to its end,

    l = sqrt(|z|^2 + least^2),      l' = Re(conj(z) z')/l,      g = dl/dq = Re(conj(z) dz/dq)/l,

with a length ``least`` far below round-off of all others, so that l has derivatives where the ends
coincide.  With the tension T = k x + k3 x^3, x = l - l0, the generalised forces are -(T + c l') g,
and the stiffness is

    dT/dl g g^T + T (Re(dz/dq^H dz/dq) - g g^T)/l + (second derivatives of z).

A spring that acts on the side s of its free length, s = 1 in tension and s = -1 in compression, has
the force F = s max(0, s (T + c l')) where s x > 0, and none where s x < 0.  The potential of T is
its energy; what does not act on its ends, (F - T) l' >= 0, is the loss of its damper.  In a motion,
its phase says which part of the law holds (:class:`.contact_state.SpringPhase`), so that the law is
smooth in every step: acting or slack, or lagging where s x > 0 and s (T + c l') < 0.
"""

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from ..base.tolerances import SPRING_FREE_RTOL, SPRING_LENGTH_RTOL
from ..mechanism.parts import value
from .arrays import Complex, Real, Whole
from .contact_state import SpringPhase
from .direction_map import DirectionMap
from .forces import elastic_energy, springs
from .system import Rows, System


class Element(Protocol):
    """An element, or several, with elastic energy and damping."""

    damped: bool
    """Whether there is damping that is not in proportion to stiffness."""

    def force(self, q: Real, e: Complex, share: float = 1.0) -> Real:
        """Return the elastic forces along the coordinates, (n,) [N m], [N].

        ``share`` is that of the difference between the shape without a force and the drawn one.
        """

    def motion_force(self, q: Real, e: Complex, v: Real, beta: float) -> Real:
        """Return the forces with those of damping, for rates v (n,), (n,) [N m], [N]."""

    def tangent(self, e: Complex, share: float = 1.0) -> Real:
        """Return minus the derivatives of the elastic forces, (n, n) [N m/rad], [N m]."""

    def energy(self, q: Real, e: Complex) -> float:
        """Return the elastic energy, zero without a force [J]."""

    def damping(self, e: Complex, beta: float) -> Real:
        """Return minus the derivatives of the forces by the rates, (n, n) [N m s]."""

    def loss(self, e: Complex, v: Real, beta: float) -> float:
        """Return the power that damping dissipates [W]."""

    def stiffness(self, e: Complex) -> Real:
        """Return a stiffness without negative parts, (n, n), for the fastest vibration."""

    def viscous(self, e: Complex) -> Real:
        """Return the part of the damping that is not in proportion to stiffness, (n, n)."""


class Bending:
    """Flexures: springs between coordinates, with the matrix K."""

    damped = False

    def __init__(self, system: System) -> None:
        self.K, self.q0, self.rest = system.K, system.q0, system.rest
        self._pull = -system.K

    def force(self, q: Real, e: Complex, share: float = 1.0) -> Real:
        """Return -K (q - rest), with a share of the initial strains."""
        rest = self.rest if share == 1.0 else self.q0 + share * (self.rest - self.q0)
        return springs(self.K, q - rest)

    def motion_force(self, q: Real, e: Complex, v: Real, beta: float) -> Real:
        """Return -K (q - rest + beta v)."""
        result: Real = self._pull.dot(q - self.rest + beta * v)
        return result

    def tangent(self, e: Complex, share: float = 1.0) -> Real:
        """Return K."""
        return self.K

    def energy(self, q: Real, e: Complex) -> float:
        """Return (q - rest)^T K (q - rest) / 2 [J]."""
        return elastic_energy(self.K, q - self.rest)

    def damping(self, e: Complex, beta: float) -> Real:
        """Return beta K."""
        return beta * self.K

    def loss(self, e: Complex, v: Real, beta: float) -> float:
        """Return beta v^T K v [W]."""
        return beta * float(v.dot(self.K.dot(v)))

    def stiffness(self, e: Complex) -> Real:
        """Return K."""
        return self.K

    def viscous(self, e: Complex) -> Real:
        """Return zeros: all damping is in proportion to stiffness."""
        return np.zeros_like(self.K)


class Torsion:
    """Torsion springs and dampers at joints: constant rows of rotations phi between two bodies."""

    def __init__(self, system: System) -> None:
        joints = [joint for joint in system.mechanism.joints if joint.elastic]
        self.rows, self.q0 = system.turns, system.q0
        self.rates, self.free, self.dampers = (
            np.array([value(j, name, system.values) if getattr(j, name) is not None else 0.0
                      for j in joints])
            for name in ("stiffness", "free_angle", "damping")
        )  # fmt: skip
        self.K: Real = (self.rows.T * self.rates) @ self.rows
        self.C: Real = (self.rows.T * self.dampers) @ self.rows
        self.damped = bool(np.any(self.dampers))

    def twists(self, q: Real, share: float = 1.0) -> Real:
        """Return phi - phi0, with a share of the free angles, (k,) [rad]."""
        result: Real = self.rows @ (q - self.q0) - share * self.free
        return result

    def force(self, q: Real, e: Complex, share: float = 1.0) -> Real:
        """Return -k (phi - phi0) dphi/dq."""
        result: Real = -(self.rates * self.twists(q, share)) @ self.rows
        return result

    def motion_force(self, q: Real, e: Complex, v: Real, beta: float) -> Real:
        """Return -(k (phi - phi0) + (beta k + c) phi') dphi/dq."""
        damping = beta * self.rates + self.dampers
        moment = self.rates * self.twists(q) + damping * (self.rows @ v)
        result: Real = -moment @ self.rows
        return result

    def tangent(self, e: Complex, share: float = 1.0) -> Real:
        """Return the sum of k dphi/dq dphi/dq^T."""
        return self.K

    def energy(self, q: Real, e: Complex) -> float:
        """Return the sum of k (phi - phi0)^2/2 [J]."""
        return 0.5 * float(self.rates @ self.twists(q) ** 2)

    def damping(self, e: Complex, beta: float) -> Real:
        """Return the sum of (beta k + c) dphi/dq dphi/dq^T."""
        return beta * self.K + self.C

    def loss(self, e: Complex, v: Real, beta: float) -> float:
        """Return the sum of (beta k + c) phi'^2 [W]."""
        return float((beta * self.rates + self.dampers) @ (self.rows @ v) ** 2)

    def stiffness(self, e: Complex) -> Real:
        """Return the sum of k dphi/dq dphi/dq^T."""
        return self.K

    def viscous(self, e: Complex) -> Real:
        """Return the sum of c dphi/dq dphi/dq^T."""
        return self.C


class SpringLaw(NamedTuple):
    """The law of a spring.

    Parameters
    ----------
    stiffness, cubic_stiffness : float
        Stiffness k [N/m] and coefficient k3 of the cube of the elongation [N/m^3].
    damping : float
        Coefficient c of viscous damping [N s/m].
    free_length, drawn_length : float
        Length without a force, and length as drawn [m].
    side : int
        Sign of the forces of a spring that acts on one side; 0: both.
    """

    stiffness: float
    cubic_stiffness: float
    damping: float
    free_length: float
    drawn_length: float
    side: int = 0

    def acts(self, x: float) -> bool:
        """Return whether a spring has stiffness at an elongation x [m].

        It has at its free length, although round-off may be on the other side.
        """
        return not self.side * x < -SPRING_FREE_RTOL * self.drawn_length

    def length_at(self, share: float) -> float:
        """Return the length without a force for a share of its difference from the drawing [m]."""
        if share == 1.0:
            return self.free_length
        return self.drawn_length + share * (self.free_length - self.drawn_length)


def spring_tension(law: SpringLaw, x: float) -> float:
    """Return the force k x + k3 x^3 for an elongation x [N].

    Examples
    --------
    >>> spring_tension(SpringLaw(3.0, 4.0, 0.0, 1.0, 1.0), 0.5)
    2.0
    >>> spring_tension(SpringLaw(3.0, 4.0, 0.0, 1.0, 1.0, side=-1), 0.5)
    0.0
    """
    if not law.acts(x):
        return 0.0
    return (law.stiffness + law.cubic_stiffness * (x * x)) * x


def spring_slope(law: SpringLaw, x: float) -> float:
    """Return the derivative k + 3 k3 x^2 of the force by the elongation [N/m].

    Examples
    --------
    >>> spring_slope(SpringLaw(3.0, 4.0, 0.0, 1.0, 1.0), 0.5)
    6.0
    """
    if not law.acts(x):
        return 0.0
    return law.stiffness + 3.0 * law.cubic_stiffness * (x * x)


def spring_energy(law: SpringLaw, x: float) -> float:
    """Return the energy k x^2/2 + k3 x^4/4 [J].

    Examples
    --------
    >>> spring_energy(SpringLaw(3.0, 4.0, 0.0, 1.0, 1.0), 1.0)
    2.5
    """
    if not law.acts(x):
        return 0.0
    return (0.5 * law.stiffness + 0.25 * law.cubic_stiffness * (x * x)) * (x * x)


class SpringState(NamedTuple):
    """The springs in one shape.

    Parameters
    ----------
    along : (c,) complex
        Vectors from start to end [m].
    length, elongation, tension : (c,)
        Distances of the ends and elongations [m], elastic forces, positive in tension [N].
    """

    along: Complex
    length: Real
    elongation: Real
    tension: Real


class Springs:
    """Coil springs and dampers between points.

    Parameters
    ----------
    system : System
        The constant arrays.
    phases : (c,) tuple of SpringPhase
        Phases of the springs; empty: those without rates, which follow from the lengths.
    """

    def __init__(self, system: System, phases: tuple[SpringPhase, ...] = ()) -> None:
        self.system, self.phases = system, phases
        self.rows = Rows(system, system.spans, system.spans_c)
        self.least = SPRING_LENGTH_RTOL * system.length
        drawn = self.lengths(system.directions(system.q0))[1].tolist()
        self.laws = [
            SpringLaw(
                value(s, "stiffness", system.values),
                value(s, "cubic_stiffness", system.values),
                value(s, "damping", system.values),
                length if s.free_length is None else value(s, "free_length", system.values),
                length,
                s.side,
            )
            for s, length in zip(system.mechanism.springs, drawn, strict=True)
        ]
        self.dampers: Real = np.array([law.damping for law in self.laws])
        self.damped = bool(np.any(self.dampers))
        self.one_sided = any(law.side for law in self.laws)
        self.two_sided_laws = [law._replace(side=0) for law in self.laws]

    def lengths(self, e: Complex) -> tuple[Complex, Real]:
        """Return the vectors from start to end and the distances of the ends, (c,) [m]."""
        x = self.rows.values(e)
        along = x[::2] + 1j * x[1::2]
        return along, np.sqrt(x[::2] ** 2 + x[1::2] ** 2 + self.least**2)

    def state(self, e: Complex, share: float = 1.0) -> SpringState:
        """Return lengths, elongations and forces in a shape, with a share of the pretension."""
        along, length = self.lengths(e)
        free = [law.length_at(share) for law in self.laws]
        elongation: Real = length - np.array(free)
        both = zip(self.laws, elongation.tolist(), strict=True)
        return SpringState(
            along, length, elongation, np.array([spring_tension(law, x) for law, x in both])
        )

    def _gradients(self, e: Complex) -> tuple[Complex, Real]:
        """Return dz/dq (c, n) complex [m], and g = dl/dq (c, n) [m]."""
        along, length = self.lengths(e)
        rows = self.rows.jacobian(e)
        moved: Complex = rows[::2] + 1j * rows[1::2]
        return moved, (along.conj()[:, None] * moved).real / length[:, None]

    def length_rates(self, e: Complex, v: Real) -> Real:
        """Return the rates l' of the distances for rates v (n,) of the coordinates, (c,) [m/s]."""
        along, length = self.lengths(e)
        x = self.rows.rates(e, v)
        result: Real = (along.real * x[::2] + along.imag * x[1::2]) / length
        return result

    def tensions(self, elongation: Real) -> Real:
        """Return the elastic forces of the laws without sides, (c,) [N]."""
        both = zip(self.two_sided_laws, elongation.tolist(), strict=True)
        return np.array([spring_tension(law, x) for law, x in both])

    def acting(self, elongation: Real) -> Real:
        """Return 1 for the springs that act and 0 for the others, (c,)."""
        if self.phases:
            return np.array([float(phase is SpringPhase.ACTING) for phase in self.phases])
        both = zip(self.laws, elongation.tolist(), strict=True)
        return np.array([float(law.acts(x)) for law, x in both])

    def forces(self, now: SpringState, rates: Real) -> Real:
        """Return the forces F with those of damping, positive in tension, (c,) [N]."""
        if not self.one_sided:
            return now.tension + self.dampers * rates
        forces = self.tensions(now.elongation) + self.dampers * rates
        result: Real = np.where(self.acting(now.elongation) > 0.0, forces, 0.0)
        return result

    def force(self, q: Real, e: Complex, share: float = 1.0) -> Real:
        """Return -T g."""
        result: Real = -self.state(e, share).tension @ self._gradients(e)[1]
        return result

    def motion_force(self, q: Real, e: Complex, v: Real, beta: float) -> Real:
        """Return -F g; F = T + c l' for springs that act on both sides."""
        slopes = self._gradients(e)[1]
        result: Real = -self.forces(self.state(e), slopes @ v) @ slopes
        return result

    def tangent(self, e: Complex, share: float = 1.0) -> Real:
        """Return the derivatives of T g."""
        now, (moved, slopes) = self.state(e, share), self._gradients(e)
        across = now.tension / now.length
        rise = np.array(self._rises(self.laws, now)) - across
        pulls = -across * now.along
        by_arms = np.column_stack([pulls.real, pulls.imag]).ravel() @ self.rows.B
        K: Real = (slopes.T * rise) @ slopes + ((moved.conj().T * across) @ moved).real
        return K + geometric_stiffness(by_arms * e, self.system.arm, self.system.Phi)

    @staticmethod
    def _rises(laws: list[SpringLaw], now: SpringState) -> list[float]:
        """Return dT/dl [N/m]."""
        both = zip(laws, now.elongation.tolist(), strict=True)
        return [spring_slope(law, x) for law, x in both]

    def energy(self, q: Real, e: Complex) -> float:
        """Return the sum of k x^2/2 + k3 x^4/4 [J]."""
        both = zip(self.laws, self.state(e).elongation.tolist(), strict=True)
        return sum(spring_energy(law, x) for law, x in both)

    def damping(self, e: Complex, beta: float) -> Real:
        """Return the sum of c g g^T; beta does not act on springs."""
        slopes = self._gradients(e)[1]
        dampers = self.dampers * self.acting(self.state(e).elongation)
        result: Real = (slopes.T * dampers) @ slopes
        return result

    def loss(self, e: Complex, v: Real, beta: float) -> float:
        """Return the sum of (F - T) l' [W]: c l'^2 of springs that act on both sides."""
        if self.one_sided:
            now, rates = self.state(e), self.length_rates(e, v)
            elastic = self.tensions(now.elongation) * self._strained(now.elongation)
            return float((self.forces(now, rates) - elastic) @ rates)
        return float(self.dampers @ self.length_rates(e, v) ** 2) if self.damped else 0.0

    def stiffness(self, e: Complex) -> Real:
        """Return the stiffness along and across the springs, as far as they are positive.

        Slack springs have that along them with which they would act.
        """
        now, (moved, slopes) = self.state(e), self._gradients(e)
        across = np.maximum(now.tension, 0.0) / now.length
        rise = np.maximum(self._rises(self.two_sided_laws, now), 0.0) - across
        result: Real = (slopes.T * rise) @ slopes + ((moved.conj().T * across) @ moved).real
        return result

    def viscous(self, e: Complex) -> Real:
        """Return the sum of c g g^T, as if all springs acted."""
        slopes = self._gradients(e)[1]
        result: Real = (slopes.T * self.dampers) @ slopes
        return result

    def _strained(self, elongation: Real) -> Real:
        """Return 1 for the springs that have elastic energy, (c,)."""
        if self.phases:
            return np.array([float(phase is not SpringPhase.SLACK) for phase in self.phases])
        return self.acting(elongation)

    def pulls(self, e: Complex, v: Real | None = None) -> Iterator[tuple[str, complex]]:
        """Yield the forces on the bodies and the ground by name, without rates or with them [N]."""
        now = self.state(e)
        force = now.tension if v is None else self.forces(now, self.length_rates(e, v))
        for spring, pull in zip(
            self.system.mechanism.springs, (force * now.along / now.length).tolist(), strict=True
        ):
            yield spring.start.rpartition(".")[0], pull
            yield spring.end.rpartition(".")[0], -pull


class Elements:
    """The sum of all elements of a mechanism; the methods are those of :class:`Element`.

    Parameters
    ----------
    system : System
        The constant arrays.
    phases : tuple of SpringPhase
        As for :class:`Springs`.
    """

    def __init__(self, system: System, phases: tuple[SpringPhase, ...] = ()) -> None:
        self.system = system
        self.springs = Springs(system, phases) if system.mechanism.springs else None
        torsion = Torsion(system) if len(system.turns) else None
        self.parts: list[Element] = [Bending(system)]
        self.parts += [part for part in (torsion, self.springs) if part is not None]
        self.damped = any(part.damped for part in self.parts)

    @property
    def sole(self) -> "Element | Elements":
        """The only element, whose calls cost less than those of a sum, or else the sum."""
        return self.parts[0] if len(self.parts) == 1 else self

    @cached_property
    def drawn(self) -> Real:
        """Stiffness of the drawn shape without negative parts, (n, n): the scale of torques."""
        return self.stiffness(self.system.directions(self.system.q0))

    def force(self, q: Real, e: Complex, share: float = 1.0) -> Real:
        """Return the elastic forces along the coordinates, (n,)."""
        return _sum([part.force(q, e, share) for part in self.parts])

    def motion_force(self, q: Real, e: Complex, v: Real, beta: float) -> Real:
        """Return the forces with those of damping, (n,)."""
        return _sum([part.motion_force(q, e, v, beta) for part in self.parts])

    def tangent(self, e: Complex, share: float = 1.0) -> Real:
        """Return the tangent stiffness, (n, n)."""
        return _sum([part.tangent(e, share) for part in self.parts])

    def energy(self, q: Real, e: Complex) -> float:
        """Return the elastic energy [J]."""
        return sum(part.energy(q, e) for part in self.parts)

    def damping(self, e: Complex, beta: float) -> Real:
        """Return the damping matrix, (n, n)."""
        return _sum([part.damping(e, beta) for part in self.parts])

    def loss(self, e: Complex, v: Real, beta: float) -> float:
        """Return the power that damping dissipates [W]."""
        return sum(part.loss(e, v, beta) for part in self.parts)

    def stiffness(self, e: Complex) -> Real:
        """Return a stiffness without negative parts, (n, n)."""
        return _sum([part.stiffness(e) for part in self.parts])

    def viscous(self, e: Complex) -> Real | None:
        """Return the damping that is not in proportion to stiffness, (n, n); None: none."""
        damped = [part for part in self.parts if part.damped]
        return _sum([part.viscous(e) for part in damped]) if damped else None


def _sum(parts: list[Real]) -> Real:
    """Return the sum of arrays; a single one is returned itself."""
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total


def geometric_stiffness(
    pull: Complex, arm: Whole | None = None, Phi: DirectionMap | None = None
) -> Real:
    """Return the stiffness by forces that act on arms, Phi^T D Phi with D = diag(Re(pull)).

    Parameters
    ----------
    pull : (d,) complex
        (lam^T B - i w) e for forces lam on rows B and dead loads w, see
        :func:`prbm.mechanics.statics.tangent_stiffness` [N m].
    arm : (d,) int or None
        Index of the arm that each direction turns or stretches; None: direction j turns arm j.
    Phi : DirectionMap or None
        Map from coordinates to directions; None: the directions are the coordinates.
    """
    D: Real = np.diag(pull.real)
    if arm is not None:
        k = np.flatnonzero(arm != np.arange(len(arm)))
        a = arm[k]
        turns = 1.0 if Phi is None else Phi.Phi[a].any(axis=1) * 1.0  # Not displacements.
        D[k, k] = -turns * pull[a].real
        D[k, a] = D[a, k] = turns * pull[a].imag
    return D if Phi is None else Phi.congruence(D)
