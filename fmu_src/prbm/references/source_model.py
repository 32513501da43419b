r"""The algorithm of the thesis, derived again to show its errors and to compare with it.

The guide is *one* open chain of rigid links from the left clamp, over the shuttle, to the right
clamp, where the loop is closed::

            e_2 ---->            1R: links 1, 3 are flexures, 2 the shuttle
        o============o           2R: links 1-3, 5-7 are flexures, 4 the shuttle
        |  shuttle   |
    e_1 |            | e_3       y
        |            |           ^
        o            o           |
      ##|##        ##|##         o--> x    gravity along +x

The chain begins and ends at the pivots next to the clamps; the rigid stubs there only shift the
positions.  Time advances by a fixed step of Runge and Kutta's fourth-order method.  After each step
the positions, not the velocities, are projected onto the closed loop (unweighted).  Contact is
checked between steps, so that an impact is up to a step late.  While the body remains behind the
wall after an impact, no further impact is applied.

Two parameters reproduce errors of the thesis: `stiffness_factor` = True multiplies the rates of the
2R pivots by an extra factor gamma, and `convective` = False omits the right side of the
acceleration constraint.  One feature is not reproduced: in the thesis, time does not advance during
the steps behind the wall.

Source: S. Boersma, Modelling and Validation of the Impact Response in Compliant Mechanisms, MSc
thesis, TU Delft 2015, appendix A.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import SimulationError
from ..mechanics.arrays import Complex, Real

GRAVITY = 9.81  # along +x [m/s^2]
RESTITUTION = 0.6


@dataclass(frozen=True)
class Structure:
    """Dimensions and masses of a parallel guide.

    Parameters
    ----------
    length, thickness, width : float
        Dimensions of a flexure [m].
    youngs_modulus, density : float
        Young's modulus [Pa] and density [kg/m^3] of its material.
    shuttle_width, shuttle_mass : float
        Distance of the flexures [m], mass [kg]; the inertia is m W^2/12.
    com_height : float
        Height of the shuttle's centre of mass above the flexures' ends [m].
    """

    length: float
    thickness: float
    width: float
    youngs_modulus: float
    density: float
    shuttle_width: float
    shuttle_mass: float
    com_height: float

    @property
    def EI(self) -> float:
        """Bending stiffness of a flexure [N m^2]."""
        return self.youngs_modulus * self.width * self.thickness**3 / 12

    @property
    def flexure_mass(self) -> float:
        """Mass of a flexure [kg]."""
        return self.density * self.length * self.thickness * self.width


STEEL = Structure(40e-3, 0.1e-3, 8e-3, 181.5e9, 7800.0, 80e-3, 53.187e-3, 17.77e-3)
"""The steel guide of the experiment in the thesis."""
PMMA = Structure(0.2, 2e-3, 1e-2, 3.21e9, 1190.0, 0.2, 1190 * 0.2 * 0.02 * 0.01, 0.0)
"""The PMMA guide of chapter 4 and listing A.1 of the thesis."""

GAMMA_1R, K_THETA_1R = 0.8517, 2.65
GAMMA_2R = np.array([0.44, 0.46])
K_THETA_2R = np.array([3.4710, 2.0682])

PROJECTION_TOLERANCE = 1e-13  # Tolerance of the thesis for the loop's gap [m].
PROJECTION_STEPS = 10
PROJECTION_STALLED = 1e-11  # Gap at which round-off may end the iteration [m].


@dataclass(frozen=True)
class Link:
    """A rigid link of the chain.

    Parameters
    ----------
    length : float
        Distance of its two pivots [m].
    mass : float
        Mass [kg].
    centre : complex
        Centre of mass relative to the first pivot, the real axis along the link [m].
    inertia : float
        Inertia about its centre of mass [kg m^2].
    straight : float
        Absolute angle in the straight shape, where the springs are relaxed [rad].
    """

    length: float
    mass: float
    centre: complex
    inertia: float
    straight: float


class Chain:
    r"""Constant arrays of a chain of links with springs between them and at both clamps.

    With e = exp(i q), where q are the angles of the links, every position is linear in e: the gap
    of the loop is loop e - distance, the shuttle's centre of mass is com e, its hit point is hit e.

    Parameters
    ----------
    links : sequence of n Link
        Links from the left clamp to the right one.
    rates : sequence of n + 1 float
        Torsion springs: left clamp, between the links, right clamp [N m/rad].
    shuttle : int
        Index of the shuttle.
    gravity : float
        Gravity along +x [m/s^2].
    hit_offset : float
        Height of the hit point above the shuttle's centre of mass [m].
    """

    def __init__(
        self,
        links: Sequence[Link],
        rates: Sequence[float],
        shuttle: int,
        gravity: float = GRAVITY,
        hit_offset: float = 0.0,
    ) -> None:
        n = len(links)
        length = np.array([link.length for link in links])
        mass = np.array([link.mass for link in links])
        A = np.tril(np.tile(length, (n, 1)), -1) + np.diag([link.centre for link in links])
        stretch = np.vstack([np.eye(n), np.zeros(n)]) - np.vstack([np.zeros(n), np.eye(n)])
        self.straight = np.array([link.straight for link in links])
        self.loop = length.astype(complex)
        self.distance = complex(length @ np.exp(1j * self.straight))
        self.H = A.conj().T * mass @ A
        self.J: Real = np.diag(np.array([link.inertia for link in links], float))
        self.K = stretch.T * np.array(rates) @ stretch
        self.weight = gravity * mass @ A
        self.com = A[shuttle]
        self.hit = A[shuttle].copy()
        self.hit[shuttle] = length[shuttle] + 1j * (A[shuttle, shuttle].imag + hit_offset)

    def displacement(self, point: Complex, q: Real) -> Real:
        """Displacement along x of the point `point` e from the straight shape [m]."""
        shift: Complex = np.exp(1j * q) @ point - np.exp(1j * self.straight) @ point
        return shift.real

    def energy(self, q: Real, v: Real) -> float:
        """Kinetic, elastic and gravitational energy [J]; the latter two are 0 if straight."""
        bend = q - self.straight
        M, _ = self.inertia(np.exp(1j * q))
        fallen = self.displacement(self.weight, q)
        return float((v @ M @ v + bend @ self.K @ bend) / 2 - fallen)

    def inertia(self, e: Complex) -> tuple[Real, Real]:
        """Mass matrix M and quadratic-velocity matrix C of M a + C v^2 = Q [kg m^2]."""
        Hq: Complex = e.conj()[:, None] * self.H * e
        return Hq.real + self.J, -Hq.imag

    def force(self, e: Complex, q: Real) -> Real:
        """Generalised force of springs and gravity [N m]."""
        Q: Real = -(self.K @ (q - self.straight)) - (self.weight * e).imag
        return Q

    def acceleration(self, q: Real, v: Real, convective: bool) -> Real:
        r"""Accelerations of the links [rad/s^2].

            [ M      Phi_q^T ] [ a   ]   [ Q - C v^2         ]
            [ Phi_q  0       ] [ lam ] = [ -(d/dt Phi_q) v   ]

        The last entry is Re and Im of (loop e) v^2; the thesis has zeros there.
        """
        e = np.exp(1j * q)
        n = len(q)
        M, C = self.inertia(e)
        le = self.loop * e
        vv = v * v
        right = np.zeros(n + 2)
        right[:n] = self.force(e, q) - C @ vv
        if convective:
            closing = le @ vv
            right[n:] = closing.real, closing.imag
        a = np.linalg.solve(bordered(M, np.array([-le.imag, le.real])), right)
        return np.asarray(a, float)[:n]

    def project(self, q: Real) -> Real:
        """Close the loop: Gauss-Newton steps with the pseudo-inverse, q of shape (n,) [rad].

        Raises
        ------
        SimulationError
            If the loop stays open.
        """
        for _ in range(PROJECTION_STEPS):
            le = self.loop * np.exp(1j * q)
            gap = le.sum() - self.distance
            if abs(gap) <= PROJECTION_TOLERANCE:
                return q
            Phi_q = np.array([-le.imag, le.real])
            q = q - Phi_q.T @ np.linalg.solve(Phi_q @ Phi_q.T, np.array([gap.real, gap.imag]))
        le = self.loop * np.exp(1j * q)
        if not abs(le.sum() - self.distance) <= PROJECTION_STALLED:
            raise SimulationError(
                f"the loop of the chain cannot be closed here (by {abs(gap):.3g} m): shorten the "
                "step"
            )
        return q

    def impact(self, q: Real, v: Real, restitution: float) -> Real:
        """Velocities after an impact of the hit point on a wall normal to x [rad/s]."""
        e = np.exp(1j * q)
        n = len(q)
        M, _ = self.inertia(e)
        le = self.loop * e
        G = -(self.hit * e).imag
        right = np.concatenate([M @ v, np.zeros(2), [-restitution * (G @ v)]])
        return np.linalg.solve(bordered(M, np.array([-le.imag, le.real, G])), right)[:n]


def bordered(M: Real, rows: Real) -> Real:
    """Return [[M, rows^T], [rows, 0]]."""
    n, m = len(M), len(rows)
    K = np.zeros((n + m, n + m))
    K[:n, :n] = M
    K[n:, :n] = rows
    K[:n, n:] = rows.T
    return K


def guide_1R(
    K_theta: float = K_THETA_1R,
    gravity: float = GRAVITY,
    hit_offset: float = 0.0,
    of: Structure = STEEL,
) -> Chain:
    r"""Return a guide with one pivot per half flexure: k = 2 gamma K_theta EI/L.

    The mass of each flexure is lumped at its moving pivot: m/4 + (m L^2/12)/(gamma L)^2.
    """
    length, m = GAMMA_1R * of.length, of.flexure_mass
    lumped = m / 4 + m * of.length**2 / 12 / length**2
    links = [
        Link(length, lumped, length, 0.0, np.pi / 2),
        shuttle((of.length - length) / 2, of),
        Link(length, lumped, 0.0, 0.0, -np.pi / 2),
    ]
    rates = [2 * GAMMA_1R * K_theta * of.EI / of.length] * 4
    return Chain(links, rates, 1, gravity, hit_offset)


def guide_2R(
    stiffness_factor: bool = False,
    K_theta: Real = K_THETA_2R,
    gravity: float = GRAVITY,
    hit_offset: float = 0.0,
    of: Structure = STEEL,
) -> Chain:
    """Return a guide with two pivots per half flexure; `rates_2R` explains the switch.

    The links are slender rods.  The mass of the stubs, a tenth of the flexures', is omitted.
    """
    h = of.length / 2
    lengths = h * GAMMA_2R[[0, 1, 0]] * [1, 2, 1]
    masses = of.flexure_mass * lengths / of.length

    def rods(straight: float) -> list[Link]:
        rod = zip(lengths, masses, strict=True)
        return [Link(length, m, length / 2, m * length**2 / 12, straight) for length, m in rod]

    body = shuttle(h * (1 - float(GAMMA_2R.sum())), of)
    K1, K2 = of.EI / h * rates_2R(stiffness_factor, K_theta)
    links = [*rods(np.pi / 2), body, *rods(-np.pi / 2)]
    return Chain(links, [K1, K2, K2, K1] * 2, 3, gravity, hit_offset)


def shuttle(stub: float, of: Structure = STEEL) -> Link:
    """Return the shuttle between the upper pivots, `stub` [m] below the flexures' ends."""
    centre = of.shuttle_width / 2 + 1j * (stub + of.com_height)
    inertia = of.shuttle_mass * of.shuttle_width**2 / 12
    return Link(of.shuttle_width, of.shuttle_mass, centre, inertia, 0.0)


def rates_2R(stiffness_factor: bool, K_theta: Real = K_THETA_2R) -> Real:
    """Rates of the 2R pivots: gamma K_theta as in the thesis, or K_theta [EI/h]."""
    return GAMMA_2R * K_theta if stiffness_factor else K_theta


def cantilever_deflection(stiffness_factor: bool) -> float:
    """Tip deflection of the 2R cantilever under a small tip force F [F h^3/EI].

    A pivot at the distance s from the tip turns by F s/K and moves the tip by s times that.
    """
    s = np.array([GAMMA_2R.sum(), GAMMA_2R[1]])
    return float(np.sum(s**2 / rates_2R(stiffness_factor)))


def held_shape(chain: Chain, displacement: float) -> tuple[Real, float]:
    r"""Shape and horizontal force that hold the shuttle's centre of mass at rest.

    Newton's method solves Q = W^T lam: Q are the generalised forces, the rows of W are the
    gradients of the loop's gap and of the centre of mass, and lam are the constraint forces.  The
    `displacement` is applied in stages of at most 2 mm.

    Returns
    -------
    q : (n,)
        Angles [rad].
    force : float
        Force on the shuttle along +x [N].

    Raises
    ------
    ArithmeticError
        If Newton's method does not converge.
    """
    q, lam = chain.straight.copy(), np.zeros(3)
    n = len(q)
    stages = 1 + int(np.ceil(abs(displacement) / 2e-3))
    for x in np.linspace(0.0, displacement, stages)[1:]:
        for _ in range(20):
            e = np.exp(1j * q)
            points = np.array([chain.loop, -1j * chain.loop, chain.com]) * e
            gap = chain.loop @ e - chain.distance
            W = -points.imag
            residual = np.concatenate(
                [
                    chain.force(e, q) - lam @ W,
                    [-gap.real, -gap.imag, x - chain.displacement(chain.com, q)],
                ]
            )
            tangent = chain.K + np.diag((chain.weight * e - lam @ points).real)
            turn = np.linalg.solve(bordered(tangent, W), residual)
            q, lam = q + turn[:n], lam + turn[n:]
            if np.abs(turn[:n]).max() < 1e-12:  # rad; the error is the square of this step
                break
        else:
            raise ArithmeticError(f"no shape found that holds the shuttle at x = {x} m")
    return q, float(-lam[2])


def stiffness(chain: Chain, of: Structure = STEEL) -> float:
    """Force over displacement of the shuttle near the straight shape, without gravity [N/m]."""
    x = of.length / 1e5
    return held_shape(chain, x)[1] / x


@dataclass(frozen=True)
class Run:
    """Samples after every step, from the start to the end or to the last finite state.

    Parameters
    ----------
    t : (steps + 1,)
        Times [s].
    q, v : (steps + 1, n)
        Angles [rad] and rates [rad/s] of the links.
    x : (steps + 1,)
        Displacement of the shuttle's centre of mass [m].
    energy : (steps + 1,)
        Total energy [J].
    impact_times : (impacts,)
        Times of the steps at which contact was detected [s].
    finite : bool
        False if the run ended at a state that was not finite or whose loop could not be closed.
    """

    t: Real
    q: Real
    v: Real
    x: Real
    energy: Real
    impact_times: Real
    finite: bool


def simulate(
    chain: Chain,
    q: Real,
    v: Real,
    span: float,
    step: float,
    *,
    convective: bool = True,
    wall: float = np.inf,
    restitution: float = RESTITUTION,
) -> Run:
    """Simulate with a fixed step from the angles q [rad] and the rates v [rad/s].

    Parameters
    ----------
    chain : Chain
        The guide.
    q, v : (n,)
        Initial state, which must satisfy the loop closure.
    span, step : float
        Duration and step size [s].
    convective : bool
        Whether the acceleration constraint has its right side (in the thesis: False).
    wall : float
        Displacement of the hit point at which it touches the wall [m]; infinite: no wall.
    restitution : float
        Newton's coefficient [-].

    Returns
    -------
    Run
    """

    def rate(y: Real) -> Real:
        return np.array([y[1], chain.acceleration(y[0], y[1], convective)])

    y = np.array([q, v])
    states, impact_times = [y], []
    behind, finite = False, True
    with np.errstate(over="ignore", invalid="ignore"):  # The state is checked below.
        for k in range(round(span / step)):
            contact = chain.displacement(chain.hit, y[0]) > wall
            if contact and not behind:
                y = np.array([y[0], chain.impact(y[0], y[1], restitution)])
                impact_times.append(k * step)
            behind = bool(contact)
            k1 = rate(y)
            k2 = rate(y + step / 2 * k1)
            k3 = rate(y + step / 2 * k2)
            k4 = rate(y + step * k3)
            y = y + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            finite = bool(np.isfinite(y).all())
            if finite:
                try:
                    y = np.array([chain.project(y[0]), y[1]])
                except SimulationError:
                    finite = False
            if not finite:
                break
            states.append(y)
        trajectory = np.array(states)
        energy = np.array([chain.energy(*state) for state in states])
    return Run(
        t=step * np.arange(len(states), dtype=float),
        q=trajectory[:, 0],
        v=trajectory[:, 1],
        x=chain.displacement(chain.com, trajectory[:, 0]),
        energy=energy,
        impact_times=np.array(impact_times),
        finite=finite,
    )
