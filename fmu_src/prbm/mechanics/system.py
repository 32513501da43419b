r"""The constant arrays of a mechanism, and the scalars that they define (gaps, loop closures).

A direction is the absolute angle theta of an arm, its stretch s, which is the logarithm of its
length divided by its drawn length, or a displacement u of an arm that floats.  Directions are a
constant linear map of the coordinates, see :mod:`prbm.mechanics.direction_map`.  Each link and body
has one arm; its directions are coordinates themselves.  An arm is

    E = exp(s + i theta),       E' = i w E,     w = theta' - i s',

with s = 0 for arms that do not stretch.  The arm of a body that nothing connects to the ground
floats: E = u_x + i u_y is the displacement of its centre of mass, so that it may vanish, and
E' = i p with p = u_y' - i u_x'; for other arms, p = w E.  Its displacements are coordinates times
the size of the mechanism, so that no coordinate has a unit.

Every position is z = c + A E with constant c, A.  Every scalar that is constrained, watched or
reported (loop closures, gaps, displacements) therefore has one form,

    x = Re(B E) + c,      x' = -Im(B p),      x'' = -Im(B p') = -Im(B E w') - Re(B E w^2).

An arm that floats adds to the part of p' with the accelerations only: its w is zero.

A scalar that is measured relative to a moving body, for example a gap to a wall on a body, is

    x = Re(f (B E + z)) + c,    f = conj(E of that body).

Arrays have a column for every direction.  The vector e contains E for the angle of an arm and
-i E for its stretch, and -i and 1 for the displacements along x and y of an arm that floats, so
that the derivative of E by its direction is i e for all.  (An arm that floats has no direction of
its own: its angle depends on no coordinate, and its element of e is E.)  The columns of A and B at
stretches and displacements are zero; :meth:`System.repeat_columns` replaces them by the columns of
the arms.  Then dx/dtheta = -Im(B e) with repeated columns, and dx/dq = dx/dtheta Phi.
"""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..mechanism.description import Mechanism
from .arrays import Complex, Real, Whole
from .direction_map import DirectionMap
from .free_body import Connection
from .kinetics import turned_moments
from .places import BodyFrame, GuideRows, Outline

ANGLE = ("angle", "omega")  # Names of the variables of a coordinate that is an angle.
STRAIN = ("strain", "strain_rate")  # Those of a coordinate that is a stretch.
SHIFTS = ("x", "vx"), ("y", "vy")  # Those of the coordinates of an arm that floats.
FIXED = -1  # In place of a direction: fixed to the ground.


def values(B: Complex, c: Real, e: Complex) -> Real:
    """Return x = Re(B E) + c [m], for rows B."""
    result: Real = (B @ e).real + c
    return result


def jacobian(B: Complex, e: Complex) -> Real:
    """Return dx/dtheta = -Im(B e) [m/rad], (r, d), of rows B with repeated columns."""
    return -(B * e).imag


def convective(B: Complex, e: Complex, w: Real | Complex) -> Real:
    """Return -(d/dt dx/dtheta) theta' = Re(B e w^2), which equals -(d/dt dx/dq) v."""
    result: Real = (B * e).dot(w * w).real
    return result


class Rows:
    """Scalars x = Re(f (B E + z)) + c of a mechanism, relative to the ground or to moving bodies.

    Parameters
    ----------
    system : System
        The mechanism.
    B, c : (r, d) complex, (r,)
        Coefficients of the arms, constants [m].
    z, on : (r,) complex, (r,) int, or None
        Fixed part [m] and direction of the body that a row is relative to.  With :data:`FIXED` or
        None it is relative to the ground, with f = 1 and z = 0.
    """

    def __init__(
        self,
        system: "System",
        B: Complex,
        c: Real,
        z: Complex | None = None,
        on: Whole | None = None,
    ) -> None:
        self.system, self.B, self.c = system, B, c
        self.repeated = system.repeat_columns(B)
        self.every_on: Whole = np.full(len(B), FIXED) if on is None else on
        self.every_z: Complex = np.zeros(len(B), complex) if z is None else z
        self.carried: Whole = np.flatnonzero(self.every_on != FIXED)
        self.on: Whole = self.every_on[self.carried]
        self.z: Complex = self.every_z[self.carried]

    def __len__(self) -> int:
        return len(self.B)

    def some(self, which: slice | Sequence[int]) -> "Rows":
        """Return some of the rows."""
        return Rows(
            self.system, self.B[which], self.c[which], self.every_z[which], self.every_on[which]
        )

    def first(self, r: int) -> "Rows":
        """Return the first r rows."""
        return self if r == len(self) else self.some(slice(r))

    def beside(self, *others: "Rows") -> "Rows":
        """Return these rows, followed by others."""
        every = (self, *others)
        return Rows(
            self.system,
            np.vstack([rows.B for rows in every]),
            np.concatenate([rows.c for rows in every]),
            np.concatenate([rows.every_z for rows in every]),
            np.concatenate([rows.every_on for rows in every]),
        )

    def values(self, e: Complex, c: Real | None = None) -> Real:
        """Return x [m], (..., r); e may be a stack (..., d); ``c`` replaces the constants."""
        x = e @ self.B.T
        if len(self.carried):
            x[..., self.carried] = self._carried_values(x, e)
        result: Real = x.real + (self.c if c is None else c)
        return result

    def _carried_values(self, x: Complex, e: Complex) -> Complex:
        """Return f (B E + z) of the carried rows."""
        result: Complex = e[..., self.on].conj() * (x[..., self.carried] + self.z)
        return result

    def jacobian(self, e: Complex) -> Real:
        """Return dx/dq [m/rad], (..., r, n); e may be a stack (..., d)."""
        return self.system.Phi.to_coordinates(self.by_direction(e))

    def by_direction(self, e: Complex) -> Real:
        """Return dx/dtheta [m/rad], (..., r, d); e may be a stack (..., d)."""
        result = jacobian(self.repeated, e[..., None, :])
        if len(self.carried):
            result[..., self.carried, :] = self._carried_by_direction(e)
        return result

    def _carried_by_direction(self, e: Complex) -> Real:
        """Return dx/dtheta of the carried rows [m/rad]."""
        f = e[..., self.on].conj()
        result: Real = -(f[..., None] * self.repeated[self.carried] * e[..., None, :]).imag
        turned = self._carried_values(e @ self.B.T, e).imag
        result[..., np.arange(len(self.on)), self.on] += turned
        return result

    def pull(self, lam: Real, e: Complex) -> Complex:
        """Return the pull lam^T (f B) e of forces lam (r,) along the rows on the arms [N m]."""
        pull: Complex = (lam @ self.B) * e
        if len(self.carried):
            turned = e[self.on].conj() - 1.0
            pull = pull + ((lam[self.carried] * turned) @ self.B[self.carried]) * e
        return pull

    def carrier_stiffness(self, lam: Real, e: Complex) -> Real:
        """Return the stiffness of the directions by forces lam, where bodies carry rows, (d, d).

        It is what the rotation of these bodies adds to -lam d^2x/dtheta^2 [N m/rad]: their
        directions have the second derivatives -Re(f (B E + z)), and Re(f B e) with all others.
        """
        D = np.zeros((self.system.d, self.system.d))
        values = self._carried_values(self.B @ e, e).real
        for k, on, value in zip(self.carried, self.on, values.tolist(), strict=True):
            across = lam[k] * (e[on].conj() * self.repeated[k] * e).real
            D[on] -= across
            D[:, on] -= across
            D[on, on] += lam[k] * value
        return D

    def reach(self) -> Real:
        """Return the largest |dx/dq| with arms of their drawn length, (r, n) [m/rad].

        That of arms that float is the size.
        """
        most, lengths = np.abs(self.repeated), np.ones(self.system.d)
        lengths[self.system.floats] = self.system.length
        most[self.carried, self.on] += (np.abs(self.B) @ lengths)[self.carried] + np.abs(self.z)
        return most @ np.abs(self.system.Phi.Phi)

    def rates(self, e: Complex, v: Real) -> Real:
        """Return x' [m/s], (..., r); e and v may be stacks (..., d), (..., n)."""
        y: Complex = self.system.swing(e, v) @ self.B.T
        if len(self.carried):
            f = e[..., self.on].conj()
            w = self.system.turning(v)
            turned = w[..., self.on].real * self._carried_values(e @ self.B.T, e)
            y[..., self.carried] = f * y[..., self.carried] - turned
        return -y.imag

    def convective(self, e: Complex, v: Real) -> Real:
        """Return -(d/dt dx/dq) v, the right side of (dx/dq) a = ... for x'' = 0 [m/s^2]."""
        w = self.system.turning(v)
        result = convective(self.B, e, w)
        if len(self.carried):
            result[self.carried] = self._carried_convective(e, v)
        return result

    def carried_terms(self, e: Complex, v: Real) -> tuple[Real, Real]:
        """Return the :meth:`jacobian` and the :meth:`convective` terms of the carried rows."""
        slopes = self.system.Phi.to_coordinates(self._carried_by_direction(e))
        return slopes, self._carried_convective(e, v)

    def _carried_convective(self, e: Complex, v: Real) -> Real:
        """Return the convective terms of the carried rows [m/s^2]."""
        w, p = self.system.turning(v), self.system.swing(e, v)
        f, turn = e[self.on].conj(), w[self.on].real[:, None]
        seen = e * w**2 - 2.0 * turn * p + turn**2 * e  # (w - turn)^2 E of arms that do not float.
        bent = (self.B[self.carried] * seen).sum(axis=1) + turn[:, 0] ** 2 * self.z
        result: Real = (f * bent).real
        return result


@dataclass(frozen=True)
class System:
    """The constant arrays of a mechanism: n coordinates, d directions, r loop rows.

    Parameters
    ----------
    q0 : (n,)
        Coordinates of the straight shape: absolute angles, counter-clockwise from +x [rad], and
        stretches and displacements over the size, which are zero there [-].
    rest : (n,)
        Coordinates at which no spring has a force: q0, but the initial strains [rad], [-].
    Phi : DirectionMap
        The map from coordinates to directions.
    arm : (d,) int
        Index of the arm that a direction turns, stretches or displaces.
    floats : (b,) int
        Arms that float.
    floating : (3 b,) int
        The coordinates of the bodies on these arms: displacements along x and y, and rotation.
    placed : (3 b,) int
        Those of the bodies that springs do not hold, either: no balance determines them.
    H : (d, d) complex
        A^H diag(m) A with the columns of A repeated, Hermitian [kg m^2].
    J : (d,)
        Rotary inertia of each body about the mass centres of its parts [kg m^2].
    K : (n, n)
        Flexures: elastic energy (q - rest)^T K (q - rest) / 2 [N m/rad], [N m].  All elements with
        energy are in :class:`prbm.mechanics.elements.Elements`.
    turns : (k, n)
        Rotations at joints with torsion, of the end's body relative to the start's [rad/rad].
    A, c, m : (p, d) complex, (p,) complex, (p,)
        Mass points z = c + A E [m] and their masses [kg].
    loops, loops_c, loops_z, loops_on : (r, d) complex, (r,), (r,) complex, (r,) int
        Loop closures, then guides: Phi = Re(f (loops E + loops_z)) + loops_c [m], with f = conj(E)
        of the body loops_on that carries a guide.  Those of guides that involve bodies without
        flexures and joints to the ground alone are the last ones.
    guided : tuple of GuideRows
        The rows of each guide.
    tied : int
        Number of the other rows.
    spans, spans_c : (2 c, d) complex, (2 c,)
        Components along x and y of the vectors from start to end of the c springs [m].
    gaps, gaps_c, gaps_z : (s, d) complex, (s,), (s,) complex
        Gaps of the stops, without the wall's position [m]: gap = wall + Re(f (gaps E + gaps_z)) +
        gaps_c, with f = 1 for a wall on the ground, and f = conj(E) for a wall on a body.
    slides, slides_z : (s, d) complex, (s,) complex
        Displacement of the hit points along their walls, to the left of the direction [m].
    on : (s,) int
        The direction of the body that a wall is fixed to; :data:`FIXED`: the ground.
    rubs, rubs_z, rubs_on : (f, d) complex, (f,) complex, (f,) int
        Displacement along the direction of each of the p friction points, then along the line of
        each guide with friction, Re(f (rubs E + rubs_z)) with f as that of ``loops`` [m].
    normals : (f,) int
        The row of the guide that carries the normal force; :data:`FIXED` at friction points.
    lifts, lifts_c : (p, d) complex, (p,)
        Displacement to the left of the direction of each friction point [m].
    release, release_c : (d,) complex, float
        Displacement of the released point along the direction of the release [m].
    released : BodyFrame
        The released point.
    bodies : dict of BodyFrame
        The bodies by name: their centres of mass.
    pushed : tuple of BodyFrame
        The points at which the forces act.
    probes : tuple of BodyFrame
        The points whose motion is reported.
    guided_points : tuple of BodyFrame
        The points that guides keep on their lines.
    links : tuple of int
        The coordinates that are angles of flexures, in the order of the interface.
    owners : (n,) tuple of str
        The link, body or other part of the mechanism that each coordinate belongs to, as in the
        names of its variables: link[1], link[2], ...
    connections : tuple of Connection
        Flexures and joints, in the order of the assembly.
    body_masses : dict of int
        Index of the mass point of each body.
    outlines : tuple of Outline
        Lines to draw.
    anchor : complex
        The first flexure end on the ground, or the origin if there is none: moments on the base
        are about this point [m].
    length : float
        Size of the mechanism, scale of all lengths [m].
    """

    mechanism: Mechanism
    values: Mapping[str, float]
    q0: Real
    rest: Real
    Phi: DirectionMap
    arm: Whole
    floats: Whole
    floating: Whole
    placed: Whole
    H: Complex
    J: Real
    K: Real
    turns: Real
    A: Complex
    c: Complex
    m: Real
    loops: Complex
    loops_c: Real
    loops_z: Complex
    loops_on: Whole
    guided: tuple[GuideRows, ...]
    tied: int
    spans: Complex
    spans_c: Real
    gaps: Complex
    gaps_c: Real
    gaps_z: Complex
    slides: Complex
    slides_z: Complex
    on: Whole
    rubs: Complex
    rubs_z: Complex
    rubs_on: Whole
    normals: Whole
    lifts: Complex
    lifts_c: Real
    release: Complex
    release_c: float
    released: BodyFrame
    bodies: Mapping[str, BodyFrame]
    pushed: tuple[BodyFrame, ...]
    probes: tuple[BodyFrame, ...]
    guided_points: tuple[BodyFrame, ...]
    links: tuple[int, ...]
    owners: tuple[str, ...]
    connections: tuple[Connection, ...]
    body_masses: Mapping[str, int]
    outlines: tuple[Outline, ...]
    anchor: complex
    length: float

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.q0)

    @property
    def d(self) -> int:
        """Number of directions."""
        return len(self.arm)

    @cached_property
    def S(self) -> Complex:
        """First mass moments m^T A, (d,) complex [kg m]."""
        result: Complex = self.m @ self.A
        return result

    @cached_property
    def inertia(self) -> Real:
        """Rotary inertia about the mass centres of the parts, Phi^T diag(J) Phi [kg m^2]."""
        return self.Phi.congruence(np.diag(self.J))

    @cached_property
    def straight_masses(self) -> Real:
        """Diagonal of the mass matrix in the straight shape, (n,) [kg m^2]."""
        return self.mass_matrix(self.directions(self.q0)).diagonal()

    @cached_property
    def gap_rows(self) -> Rows:
        """The gaps of all stops, without the positions of their walls [m]."""
        return Rows(self, self.gaps, self.gaps_c, self.gaps_z, self.on)

    @cached_property
    def slide_rows(self) -> Rows:
        """The displacements of all hit points along their walls, up to a constant [m]."""
        return Rows(self, self.slides, np.zeros(len(self.slides)), self.slides_z, self.on)

    @cached_property
    def rub_rows(self) -> Rows:
        """The displacements of friction points and along guides, up to a constant [m]."""
        return Rows(self, self.rubs, np.zeros(len(self.rubs)), self.rubs_z, self.rubs_on)

    @cached_property
    def loop_rows(self) -> Rows:
        """The closures of all loops, and the guides [m]."""
        return Rows(self, self.loops, self.loops_c, self.loops_z, self.loops_on)

    @cached_property
    def shared(self) -> Whole:
        """The directions that have no arm of their own: stretches and displacements."""
        result: Whole = np.flatnonzero(self.arm != np.arange(self.d))
        return result

    @cached_property
    def shifts(self) -> Whole:
        """The displacements of arms that float, along x and y in turn."""
        return self.shared[np.isin(self.arm[self.shared], self.floats)]

    @cached_property
    def stretches(self) -> Whole:
        """The directions that are stretches."""
        return self.shared[~np.isin(self.arm[self.shared], self.floats)]

    @cached_property
    def strains(self) -> Whole:
        """The coordinates that are stretches: those that stretch arms, and turn none."""
        result: Whole = np.flatnonzero(self.Phi.Phi[self.stretches].any(axis=0))
        return result

    @property
    def variables(self) -> tuple[tuple[str, str], ...]:
        """The names of each coordinate and its rate, such as link[1].angle and link[1].omega."""
        kinds = dict.fromkeys(self.strains.tolist(), STRAIN)
        for place in self.floating.reshape(-1, 3).tolist():
            kinds |= zip(place, SHIFTS, strict=False)
        return tuple(
            (f"{owner}.{x}", f"{owner}.{rate}")
            for j, owner in enumerate(self.owners)
            for x, rate in [kinds.get(j, ANGLE)]
        )

    @cached_property
    def units(self) -> Real:
        """What the variable of a coordinate is for each unit of the coordinate, (n,).

        It is the size for displacements [m], which are coordinates over the size, otherwise 1.
        """
        result = np.ones(self.n)
        result[self.floating.reshape(-1, 3)[:, :2]] = self.length
        return result

    @cached_property
    def _exponents(self) -> tuple[Complex, Complex]:
        """The map from coordinates to s + i theta of the arms, (d, n), and factors of the arms.

        Stretches have the row of their arm, and the factor -i.
        """
        exponents: Complex = self.Phi.Phi.astype(complex) * 1j
        factors: Complex = np.ones(self.d, complex)
        stretched = self.arm[self.stretches]
        exponents[stretched] += self.Phi.Phi[self.stretches]
        exponents[self.stretches] = exponents[stretched]
        factors[self.stretches] = -1j
        exponents[self.shifts] = 0.0
        factors[self.shifts[::2]] = -1j  # Along x; along y the factor is 1.
        return exponents.T.copy(), factors

    def _floating(self, x: Real) -> Complex:
        """Return displacements u_x + i u_y of the arms that float for coordinates or rates x."""
        u = x @ self.Phi.Phi[self.shifts].T
        result: Complex = u[..., ::2] + 1j * u[..., 1::2]
        return result

    @cached_property
    def _turns(self) -> Complex:
        """The map from rates to theta' - i s' of the arms, (n, d); zero for stretches."""
        turns = -1j * self._exponents[0]
        turns[:, self.shared] = 0.0
        return turns

    def directions(self, q: Real) -> Complex:
        """Return e: the arms exp(s + i theta) for angles, and -i times the arms for stretches.

        For displacements along x and y of an arm that floats they are -i and 1.

        Parameters
        ----------
        q : (..., n)
            Coordinates [rad], [-].

        Returns
        -------
        (..., d) complex

        Examples
        --------
        A link that stands up, stretched by 1 %:

        >>> bar = object.__new__(System)
        >>> none = np.zeros(0, int)
        >>> vars(bar).update(arm=np.array([0, 0]), floats=none, Phi=DirectionMap(np.eye(2)))
        >>> e = bar.directions(np.array([np.pi / 2, np.log(1.01)]))
        >>> bool(abs(e - [1.01j, 1.01]).max() < 1e-15)
        True
        """
        if len(self.shared):
            exponents, factors = self._exponents
            e: Complex = np.exp(q @ exponents)
            e *= factors
            if len(self.floats):
                e[..., self.floats] = self._floating(q)
            return e
        turned: Complex = np.exp(1j * self.Phi.of(q))
        return turned

    def turning(self, v: Real) -> Real | Complex:
        """Return the rates w = theta' - i s' of the arms (..., d) for rates v (..., n) [1/s].

        The entries of stretches, of displacements and of arms that float are zero.  Without these
        the result is real.
        """
        if len(self.shared):
            w: Complex = v @ self._turns
            return w
        return self.Phi.of(v)

    def swing(self, e: Complex, v: Real) -> Complex:
        """Return p (..., d) of the arms, whose velocities are E' = i p, for rates v (..., n).

        The same with accelerations a (n,) in place of v gives the part of E'' that depends on them.
        """
        p: Complex = e * self.turning(v)
        if len(self.floats):
            p[..., self.floats] = -1j * self._floating(v)
        return p

    def mass_matrix(self, e: Complex) -> Real:
        """Return the mass matrix M, (n, n) [kg m^2]."""
        return self.Phi.congruence(turned_moments(self.H, e).real) + self.inertia

    def gradient(self, B: Complex, e: Complex) -> Real:
        """Return dx/dq [m/rad], (..., n), of rows x = Re(B E) + c, (..., d)."""
        return self.Phi.to_coordinates(jacobian(self.repeat_columns(B), e))

    def motion(self, frame: BodyFrame, e: Complex, v: Real) -> tuple[complex, complex]:
        """Return the displacement from the straight shape [m] and the velocity [m/s] of a point."""
        displacement = complex(frame.A @ e) + frame.c - frame.drawn
        return displacement, complex(1j * (frame.A @ self.swing(e, v)))

    def repeat_columns(self, B: Complex) -> Complex:
        """Return rows with the column of each arm repeated for its stretch or displacements."""
        return B[..., self.arm] if len(self.shared) else B

    def holding(self, amount: float) -> tuple[Complex, float]:
        """Return B, c of the constraint Re(B E) + c = 0 that holds the released body.

        For a rotation the constraint is the sine of the remaining angle times the size.  Its
        derivative at the solution is the size, and its second derivative is zero, so that the
        multiplier is the holding moment over the size.

        Parameters
        ----------
        amount : float
            Displacement along the direction of the release [m]; rotation [rad] if the release is
            by an angle.
        """
        if not self.mechanism.release.turns:
            return self.release, self.release_c - amount
        j, arm = self.released.j, self.released.arm
        row = np.zeros(self.d, complex)
        row[arm] = -1j * self.length * np.exp(-1j * (self.q0[j] + amount))
        return row, 0.0

    @property
    def released_free(self) -> bool:
        """Whether the released body is one of those that are placed, not held by a force."""
        return self.released.j in self.placed

    def amount(self, q: Real) -> float:
        """Return the displacement [m] or, if the release is by an angle, the rotation [rad]."""
        j = self.released.j
        if self.mechanism.release.turns:
            return float(q[j] - self.q0[j])
        return float((self.release @ self.directions(q)).real) + self.release_c

    def holding_row(self, q: Real) -> Complex:
        """Return the row of the holding force or moment in a shape."""
        return self.holding(self.amount(q))[0]

    @property
    def gravity(self) -> complex:
        """Acceleration of gravity as a complex number [m/s^2]."""
        return complex(self.values["gravity.x"], self.values["gravity.y"])


def unit(degrees: float) -> complex:
    """Return the unit vector at an angle [deg], exact along the axes.

    Examples
    --------
    >>> unit(90.0)
    1j
    """
    quarter, rest = divmod(degrees, 90.0)
    return complex(1j ** int(quarter % 4)) * (cmath.exp(1j * math.radians(rest)) if rest else 1.0)


def stacked(rows: list[Complex], d: int) -> Complex:
    """Return rows of d columns as an array (k, d); k may be 0."""
    return np.array(rows, complex).reshape(-1, d)
