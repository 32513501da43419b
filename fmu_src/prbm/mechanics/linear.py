r"""The linear equations of small motions about a static shape, or a resting contact.

With the rows R of the loops, of the closed stops and of the sticking contacts, small changes obey

    M a + C v + K_t q - R^T l = F u,      R q = 0,      C = 2 zeta omega_1 M + beta K + C_s.

The tangent stiffness K_t has the dead loads and the forces of the rows; C_s is the damping of
springs.  Products of rates vanish at rest.  The columns Z of the modes on R q = 0 have
Z^T M Z = 1, so that q = Z x and

    x'' = -Z^T K_t Z x - Z^T C Z x' + Z^T F u.

The states are the modal coordinates x and their rates.  Outputs are linear in q, v, a, l and u.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import ParameterError
from ..base.names import unknown
from ..base.tolerances import ROW_RTOL, ZERO_RATE_RTOL
from ..mechanism.parts import Friction, Guide, value
from .arrays import Complex, Real
from .elements import Elements
from .forces import field_row, load_rows, normal_force
from .inputs import BASE_AXES, LOADS
from .modal import Modes, fundamental_frequency, vibrations
from .places import BodyFrame
from .resting import RestingShape
from .statics import tangent_stiffness
from .system import System

MOTIONS = {"x": "m", "y": "m", "angle": "rad", "vx": "m/s", "vy": "m/s", "omega": "rad/s"}
POINTS = ("x", "y", "vx", "vy")  # Motions of probes.
CONTACTS = {"gap": "m", "gap_rate": "m/s", "force": "N"}
REACTIONS = {"force.x": "N", "force.y": "N", "moment": "N.m"}


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B u, y = C x + D u of small changes.

    Parameters
    ----------
    A, B, C, D : (2 k, 2 k), (2 k, m), (p, 2 k), (p, m)
        Matrices, in SI units.
    modes : Modes
        The k modes; the first k states are their coordinates, the others the rates.
    contacts : tuple of (str, str)
        Names of the contacts that hold, with ``"held"`` or ``"sticking"``.
    """

    A: Real
    B: Real
    C: Real
    D: Real
    modes: Modes
    contacts: tuple[tuple[str, str], ...]


def input_units(system: System) -> dict[str, str]:
    """Return the inputs and their units: forces on bodies, acceleration of the base."""
    units = {
        f"{force.name}.{what}": unit
        for force in system.mechanism.forces
        for what, unit in LOADS.items()
    }
    return units | {f"base.acceleration.{axis}": "m/s2" for axis in BASE_AXES}


def output_units(system: System) -> dict[str, str]:
    """Return the outputs and their units: those of the FMU that are linear in small changes."""
    return {
        **{f"{name}.{what}": unit for name in system.bodies for what, unit in MOTIONS.items()},
        **{f"{probe.name}.{what}": MOTIONS[what] for probe in system.probes for what in POINTS},
        **{
            f"{stop.name}.{what}": unit
            for stop in system.mechanism.stops
            for what, unit in CONTACTS.items()
        },
        **{f"base.{what}": unit for what, unit in REACTIONS.items()},
    }


def state_space(
    system: System, shape: RestingShape, loads: Mapping[str, float], stops: Sequence[int],
    inputs: Sequence[str], outputs: Sequence[str],
) -> StateSpace:  # fmt: skip
    """Return the linear equations about a shape.

    Contacts with friction stick.

    Parameters
    ----------
    system : System
        The mechanism.
    shape : RestingShape
        The shape, with the closed stops.
    loads : mapping
        The dead loads of the shape by name [N], [N m].
    stops : sequence of int
        The stops that are closed.
    inputs, outputs : sequence of str
        Names, as :func:`input_units` and :func:`output_units` return them.

    Raises
    ------
    ParameterError
        If a name is unknown.
    SimulationError
        If the equations are singular.
    """
    small = _SmallMotions(system, shape, loads, stops)
    Z, M = small.modes.shape, small.modes.M
    k = Z.shape[1]
    F = np.array([small.input(name) for name in inputs]).reshape(-1, system.n).T
    Gamma, Omega2 = Z.T @ small.damping @ Z, Z.T @ small.K_t @ Z
    A = np.block([[np.zeros((k, k)), np.eye(k)], [-Omega2, -Gamma]])
    B = np.vstack([np.zeros((k, len(inputs))), Z.T @ F])
    # Changes of q, v, a and l by the states and the inputs, side by side.
    by = np.hstack([np.eye(2 * k), np.zeros((2 * k, len(inputs)))])
    q, v, a = Z @ by[:k], Z @ by[k:], Z @ np.hstack([A, B])[k:]
    pulled = M @ a + small.damping @ v + small.K_t @ q
    pulled[:, 2 * k :] -= F
    forces = np.linalg.lstsq(small.rows.T, pulled, rcond=None)[0]
    u = np.hstack([np.zeros((len(inputs), 2 * k)), np.eye(len(inputs))])
    found = np.array(
        [small.output(name, inputs, (q, v, a, forces, u)) for name in outputs]
    ).reshape(-1, 2 * k + len(inputs))
    return StateSpace(A, B, found[:, : 2 * k], found[:, 2 * k :], small.modes, small.contacts)


class _SmallMotions:
    """The matrices of the equations in coordinates, and the gradients of inputs and outputs."""

    def __init__(
        self, system: System, shape: RestingShape, loads: Mapping[str, float], stops: Sequence[int]
    ) -> None:
        self.system, self.shape, self.loads, self.stops = system, shape, loads, list(stops)
        self.e = system.directions(shape.q)
        elements = Elements(system)
        self.largest = float(np.abs(elements.drawn).max())
        self.rows, self.contacts = self._rows()
        self.K_t = tangent_stiffness(
            elements.tangent(self.e), shape.load, shape.rows, shape.lam, self.e
        )
        self.modes = vibrations(system.mass_matrix(self.e), self.K_t, self.rows)
        values = system.values
        share = 2.0 * values["damping.zeta"]
        omega = 2.0 * np.pi * fundamental_frequency(system) if share else 0.0
        own = elements.damping(self.e, values["damping.beta"])
        self.damping = share * omega * self.modes.M + own

    def _rows(self) -> tuple[Real, tuple[tuple[str, str], ...]]:
        """Return the rows that hold, and the contacts among them.

        A contact that other rows keep from sliding carries no friction force.
        """
        system, mechanism, values = self.system, self.system.mechanism, self.system.values
        rows = self.shape.rows.jacobian(self.e)
        contacts = {mechanism.stops[i].name: "held" for i in self.stops}
        slides, rubs = (x.jacobian(self.e) for x in (system.slide_rows, system.rub_rows))
        sticking = [
            (mechanism.stops[i].name, slides[[i]]) for i in self.stops
            if value(mechanism.stops[i], "friction", values) > 0.0
        ]  # fmt: skip
        sticking += [
            (part.name, rubs[[i]])
            for i, part in enumerate(mechanism.rubbing)
            if value(part, "friction" if isinstance(part, Guide) else "coefficient", values) > 0.0
            and self._pressing(i, part) > 0.0
        ]
        for name, row in sticking:
            left = row - (rows.T @ np.linalg.lstsq(rows.T, row.T, rcond=None)[0]).T
            if np.abs(left).max() > ROW_RTOL * system.length:
                rows = np.vstack([rows, row])
                contacts[name] = "sticking"
        return rows, tuple(contacts.items())

    def _pressing(self, i: int, friction: Friction | Guide) -> float:
        """Return the normal force of a friction point or guide; zero if it is round-off [N]."""
        system = self.system
        if isinstance(friction, Guide):
            least = ZERO_RATE_RTOL * self.largest / system.length
            force = abs(float(self.shape.lam[system.normals[i]]))
            return force if force > least else 0.0
        preload, stiffness = (
            value(friction, name, system.values) for name in ("normal_force", "normal_stiffness")
        )
        lift = float((system.lifts[i] @ self.e).real) + float(system.lifts_c[i])
        return normal_force(lift, preload, stiffness)

    def input(self, name: str) -> Real:
        """Return the generalised force of one unit of an input, (n,)."""
        system = self.system
        if name not in (known := input_units(system)):
            raise ParameterError(f"no input of a linear model: {unknown(name, known)}")
        owner, _, what = name.rpartition(".")
        if owner == "base.acceleration":
            w = system.repeat_columns(field_row(system.S, -complex(what == "x", what == "y")))
            return system.Phi.to_coordinates((w * self.e).real)
        index = [force.name for force in system.mechanism.forces].index(owner)
        row: Real = load_rows(system, system.pushed[index], self.e)[list(LOADS).index(what)]
        return row

    def output(self, name: str, inputs: Sequence[str], by: tuple[Real, ...]) -> Real:
        """Return the changes of an output by the states and the inputs."""
        system = self.system
        if name not in (known := output_units(system)):
            raise ParameterError(f"no output of a linear model: {unknown(name, known)}")
        owner, _, what = name.rpartition(".")
        if name.startswith("base."):
            return self._reaction(name.removeprefix("base."), inputs, by)
        frames = {**system.bodies, **{probe.name: probe for probe in system.probes}}
        q, v, _, forces, _ = by
        change: Real
        if owner in frames:
            k = list(MOTIONS).index(what)
            gradient = self._place(frames[owner])[k % 3]
            change = gradient @ (q if k < 3 else v)
            return change
        i = [stop.name for stop in system.mechanism.stops].index(owner)
        if what != "force":
            gap: Real = system.gap_rows.jacobian(self.e)[i]
            change = gap @ (q if what == "gap" else v)
        elif i in self.stops:
            change = forces[len(system.loops) + self.stops.index(i)]
        else:
            change = np.zeros(q.shape[1])
        return change

    def _place(self, frame: BodyFrame) -> Real:
        """Return the gradients of position and angle of a point, (3, n)."""
        if frame.j < 0:
            return np.zeros((3, self.system.n))
        return load_rows(self.system, frame, self.e)

    def _reaction(self, what: str, inputs: Sequence[str], by: tuple[Real, ...]) -> Real:
        """Return the changes of a reaction; see :func:`prbm.mechanics.dynamics.base_reaction`."""
        system, (q, _, a, _, u) = self.system, by
        T = self._gradients(system.A)  # Of the mass points.
        change = -system.m[:, None] * (T @ a)
        for name, row in zip(inputs, u, strict=True):
            if name.startswith("base.acceleration"):
                change -= np.outer(system.m * _along(name), row)
        load: Complex = (system.m * system.gravity).astype(complex)
        moment = self._moment(system.A, system.c, load, change, q)
        moment -= system.turning(a.T).real @ system.J
        force = change.sum(axis=0)
        for one, frame in zip(system.mechanism.forces, system.pushed, strict=True):
            dead = complex(*(self.loads.get(f"{one.name}.{axis}", 0.0) for axis in "xy"))
            pull = np.zeros((1, q.shape[1]), complex)
            for name, row in zip(inputs, u, strict=True):
                if name == f"{one.name}.moment":
                    moment += row
                elif name.startswith(f"{one.name}."):
                    pull += _along(name) * row
            moment += self._moment(frame.A[None], np.array([frame.c]), np.array([dead]), pull, q)
            force += pull[0]
        found: dict[str, Real] = {"force.x": force.real, "force.y": force.imag, "moment": moment}
        return found[what]

    def _moment(self, A: Complex, c: Complex, force: Complex, change: Complex, q: Real) -> Real:
        """Return the changes of the moment of forces (p,), which change by (p, k), at points."""
        z = A @ self.e + c - self.system.anchor
        moved = (self._gradients(A) @ q).conj()
        return np.asarray((force @ moved + z.conj() @ change).imag, float)

    def _gradients(self, A: Complex) -> Complex:
        """Return dz/dq of positions z = c + A E, (p, n) complex."""
        by_direction = 1j * self.system.repeat_columns(A) * self.e
        real, imaginary = (self.system.Phi.to_coordinates(part) for part in (
            by_direction.real, by_direction.imag))  # fmt: skip
        result: Complex = real + 1j * imaginary
        return result


def _along(name: str) -> complex:
    """Return the unit vector of an input along an axis."""
    return complex(name.endswith("x"), name.endswith("y"))
