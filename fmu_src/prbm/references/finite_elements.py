r"""A mechanism of finite elements, as a referee: the same file, and nothing of a pseudo-rigid body.

Every flexure becomes a line of planar cable elements (absolute nodal coordinates, bending and
stretching, large rotations) of Exudyn [1]_, clamped or pinned by constraints to rigid bodies with
their mass, inertia and points off the centre of mass.  A ``free`` end, which in a pseudo-rigid-body
model says that the last link carries the body, is a clamp here.  Exudyn gives forces, stiffness,
mass, constraints and their Jacobian, and integrates; the statics and modes are those of

    f(q) + C mu + r F = 0,    Phi(q) = 0,
    (K - d(C mu)/dq) phi = omega^2 M phi,    C^T phi = 0,

q displacements of the nodes from the drawn shape, f elastic forces and loads, K = -df/dq, C the
transposed Jacobian of the constraints Phi, and r F the holding force.

What it can be trusted to
-------------------------
* Shapes and modes converge with the elements: for the steel guide at rest, 16 a flexure are within
  2e-5 of 32 in the displacement and the fundamental frequency, within 2e-4 in the next two.
* The sections are thin: no shear, no rotary inertia, no anticlastic curvature.
* An impact is the same event as in the engine, Newton's law at an instant, with the masses of the
  elements.  The hit body carries only the mass of what is clamped to it at once, so that waves run
  along the flexures afterwards.  Modal restitution, and the motion up to the next hits, converge;
  what follows many hits is sensitive to everything, as reality is.  Nothing is said about
  force peaks or durations.
* Steps must resolve what one looks at: the times of the impacts of the steel guide move by 1e-5 s
  between steps of 1e-4 s and 1e-5 s.  A step that gains energy is taken again in shorter ones.
* What impacts leave in waves along the flexures can grow unnoticed, each step gaining a little less
  than is looked for, until the run is nonsense: compare runs of two steps.  ``spectral_radius``
  0.5 (the default) is sturdier than 0.9 there, at no loss for the slow motion.
* Resting contact is for soft captures: a ``rest_speed`` of the order of the impacts makes the
  waves in the flexures pull the body off the wall and push it back, again and again.

Sources
-------
.. [1] J. Gerstmayr, Exudyn - a C++-based Python package for flexible multibody systems,
   Multibody Syst. Dyn. 60 (2024) 533.
.. [2] J. Gerstmayr, H. Irschik, J. Sound Vib. 318 (2008) 461 (the cable element).
"""

import cmath
import importlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, null_space
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from ..base.errors import EquilibriumError, ParameterError, PrbmError, SimulationError
from ..hybrid.simulation import Impact, Latched
from ..mechanics.arrays import Complex, Real
from ..mechanics.inputs import check_input, input_names
from ..mechanics.modal import Modes, simulated_restitution
from ..mechanics.system import unit
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..mechanism.flexure import PIN
from ..mechanism.parts import GROUND, Body, Flexure, FlexureType, Joint, Point, Stop, body_of, value
from ..runs.result import Result, structured

NEWTON_STEPS = 25
CONVERGED = 1e-9  # m and rad of the last Newton step; what is left after it is its square
LARGEST_CHANGE = 1.0  # of slopes and angles in one step of the load: further is another shape
FIRST_FRACTION, SMALLEST_FRACTION = 1 / 8, 1 / 1024  # of the load
BALANCED = 1e-7  # of the force of one radian: what is left in a step of a transient, at most
DIFFERENCE = 1e-6  # m and rad, for the second derivatives of the constraints
LOCATED = 1e-10  # of the size: gap at which an impact counts as located
LOCATIONS = 12  # attempts to locate it
LOCATING_STEPS = (1, 4, 16, 64)  # into which a step that does not converge is divided
SHORT_STEPS = 8  # at a time, after one that failed
SMALLEST_STEP = 1 / 4096  # of the step asked for, before giving up
REACHED = 1e-6  # of the step: what Exudyn leaves to the end of an interval by rounding
MOST_HITS = 10_000
MOST_GAIN = 0.01  # of the largest kinetic energy, in one step: more is no solution of the equations

REMEDY = "install it with: python -m pip install 'prbm-impact[fe]', or: pip install exudyn"


class FiniteElementError(PrbmError, ValueError):
    """The finite elements are not installed, or cannot do what is asked."""


def _exudyn() -> tuple[Any, Any]:
    """Return Exudyn and its items."""
    try:
        return importlib.import_module("exudyn"), importlib.import_module("exudyn.itemInterface")
    except ImportError as error:
        raise FiniteElementError(
            f"the finite elements are Exudyn's, which is not installed ({error}); {REMEDY}"
        ) from None


@dataclass(frozen=True)
class Shape:
    """A static shape of the elements.

    Parameters
    ----------
    q : (n,)
        Displacements of all nodes from the drawn shape [m], of slopes [-], of bodies [rad].
    mu : (r,)
        Multipliers of the constraints [N], [N m].
    force : float
        Holding force on the released body along the direction of the release [N]; 0 if free.
    """

    q: Real
    mu: Real
    force: float = 0.0


@dataclass(frozen=True)
class _Rigid:
    """A body, or the ground: where its coordinates begin, where its centre is drawn."""

    object: int
    first: int | None
    centre: complex


@dataclass
class _Run:
    """What a transient has left behind so far."""

    times: list[float] = field(default_factory=list)
    q: list[Real] = field(default_factory=list)
    v: list[Real] = field(default_factory=list)
    held: list[tuple[bool, ...]] = field(default_factory=list)
    impacts: list[Impact] = field(default_factory=list)


class FiniteElements:
    """A mechanism of finite elements.

    Parameters
    ----------
    mechanism : Mechanism
        Bodies, flexures, joints, ground, gravity, stops.
    values : mapping
        Parameters and inputs (forces on bodies) that differ from their defaults.
    elements : int
        Cable elements a flexure.

    Raises
    ------
    FiniteElementError
        If Exudyn is not installed, or something is asked for that the elements do not have:
        friction, or damping in proportion to mass.
    ParameterError
        If a name is unknown or a value out of bounds.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        values: Mapping[str, float] | None = None,
        *,
        elements: int = 16,
    ) -> None:
        if elements < 1:
            raise FiniteElementError(f"elements = {elements} must be at least 1 a flexure")
        changes = dict(values or {})
        self.given = dict.fromkeys(input_names(mechanism), 0.0)
        for name in self.given:
            if name in changes:
                self.given[name] = check_input(name, changes.pop(name), self.given)
        self.mechanism, self.values = mechanism, mechanism.values(changes)
        self.elements = elements
        self._refuse()
        self.exu, self.items = _exudyn()
        self.mbs = self.exu.SystemContainer().AddSystem()
        self.rigid: dict[str, _Rigid] = {}
        self.nodes: dict[str, NDArray[np.int64]] = {}
        self.drawn: dict[str, Complex] = {}
        self.loads: list[tuple[int, str, list[float]]] = []
        self._build()
        self.mbs.Assemble()
        self._index()
        self.solver = self.exu.MainSolverStatic()
        self.solver.InitializeSolver(self.mbs, self._settings())
        self.n = len(self.mbs.systemData.GetODE2Coordinates())
        self._load = 1.0

    # -- building --

    def _refuse(self) -> None:
        rubbed = [f"{f.name}.coefficient" for f in self.mechanism.frictions
                  if value(f, "coefficient", self.values)]  # fmt: skip
        rubbed += [f"{s.name}.friction" for s in self.mechanism.stops
                   if value(s, "friction", self.values)]  # fmt: skip
        if self.values["damping.zeta"]:
            rubbed.append("damping.zeta")
        moving = [
            name for name, x in self.given.items()
            if x and name.split(".")[0] not in {f.name for f in self.mechanism.forces}
        ]  # fmt: skip
        for name in (*rubbed, *moving):
            raise FiniteElementError(
                f"{name} is not 0: the finite elements know neither friction nor damping in "
                "proportion to mass, and walls and base stand still; set it to 0"
            )

    def _at(self, point: Point) -> complex:
        x, y = (affine(coordinate)(self.values) for coordinate in point)
        return complex(x, y)

    def _build(self) -> None:
        item, add = self.items, self.mbs
        self.rigid[GROUND] = _Rigid(int(add.AddObject(item.ObjectGround())), None, 0j)
        self._body_nodes: dict[str, int] = {}
        self._cable_nodes: dict[str, list[int]] = {}
        self.energy = self.force = 0.0  # of one radian of all flexures [J], [N]
        for body in self.mechanism.bodies:
            self._body(body)
        kinds = {kind.name: kind for kind in self.mechanism.flexure_types}
        for flexure in self.mechanism.flexures:
            self._flexure(flexure, kinds[flexure.type])
        for joint in self.mechanism.joints:
            self._joint(joint)
        for force in self.mechanism.forces:
            at = self.rigid[force.body].centre if force.point is None else self._at(force.point)
            x, y, moment = (self.given[f"{force.name}.{what}"] for what in ("x", "y", "moment"))
            marker = self._marker(force.body, at)
            self._add_load(item.Force, marker, [x, y, 0.0])
            self._add_load(item.Torque, marker, [0.0, 0.0, moment])
        self.holds = [self._hold(stop) for stop in self.mechanism.stops]

    @property
    def gravity(self) -> complex:
        """Acceleration of gravity [m/s^2]."""
        return complex(self.values["gravity.x"], self.values["gravity.y"])

    def _add_load(self, kind: Callable[..., Any], marker: int, vector: list[float]) -> None:
        if any(vector):
            load = kind(markerNumber=marker, loadVector=vector)
            self.loads.append((int(self.mbs.AddLoad(load)), "loadVector", vector))

    def _body(self, body: Body) -> None:
        z = self._at(body.centre)
        node = self.mbs.AddNode(
            self.items.NodeRigidBody2D(referenceCoordinates=[z.real, z.imag, 0.0])
        )
        mass, inertia = (value(body, name, self.values) for name in ("mass", "inertia"))
        number = self.mbs.AddObject(
            self.items.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node)
        )
        self._body_nodes[body.name] = int(node)
        self.rigid[body.name] = _Rigid(int(number), 0, z)
        weight = mass * self.gravity
        self._add_load(
            self.items.Force, self._marker(body.name, z), [weight.real, weight.imag, 0.0]
        )

    def _marker(self, body: str, drawn: complex, along: complex = 1.0) -> int:
        """Return a marker at a drawn point of a body, its x along a direction."""
        z = drawn - self.rigid[body].centre
        turned = np.array(
            [[along.real, -along.imag, 0.0], [along.imag, along.real, 0.0], [0.0, 0.0, 1.0]]
        )
        place = self.exu.HT(rotation=turned, translation=[z.real, z.imag, 0.0])
        marker = self.items.MarkerBodyRigid(bodyNumber=self.rigid[body].object, localHT=place)
        return int(self.mbs.AddMarker(marker))

    def _join(self, one: int, other: int, *, turns: bool, active: bool = True) -> int:
        axes = [1, 1, 0, 0, 0, 0 if turns else 1]
        joint = self.items.GenericJoint(
            markerNumbers=[one, other], constrainedAxes=axes, activeConnector=active
        )
        return int(self.mbs.AddObject(joint))

    def _flexure(self, flexure: Flexure, kind: FlexureType) -> None:
        item, count = self.items, self.elements
        start, end = (
            self._at(self.mechanism.point(p, flexure.name)) for p in (flexure.start, flexure.end)
        )
        L = abs(end - start)
        if L < 1e-9:
            raise ParameterError(
                f"flexure {flexure.name} has the length {L:g} m: move its ends apart"
            )
        along = (end - start) / L
        h, b, E, rho = (
            value(kind, name, self.values)
            for name in ("thickness", "width", "youngs_modulus", "density")
        )
        EI, EA, beta = E * b * h**3 / 12, E * b * h, self.values["damping.beta"]
        places: Complex = start + (end - start) * np.linspace(0.0, 1.0, count + 1, dtype=complex)
        nodes = [
            int(self.mbs.AddNode(item.NodePoint2DSlope1(
                referenceCoordinates=[z.real, z.imag, along.real, along.imag]
            )))
            for z in places
        ]  # fmt: skip
        cables = [
            int(self.mbs.AddObject(item.ObjectANCFCable2D(
                nodeNumbers=list(pair), length=L / count, massPerLength=rho * b * h,
                bendingStiffness=EI, axialStiffness=EA,
                bendingDamping=beta * EI, axialDamping=beta * EA,
                useReducedOrderIntegration=2,  # else coarse cables lock
            )))
            for pair in pairwise(nodes)
        ]  # fmt: skip
        g = [self.gravity.real, self.gravity.imag, 0.0]
        for cable in cables:
            marker = int(self.mbs.AddMarker(item.MarkerBodyMass(bodyNumber=cable)))
            self._add_load(item.LoadMassProportional, marker, g)
        ends = zip(
            (flexure.start, flexure.end), (start, end), (cables[0], cables[-1]),
            (0.0, L / count), flexure.ends, strict=True,
        )  # fmt: skip
        for reference, z, cable, x, how in ends:
            tip = item.MarkerBodyRigid(bodyNumber=cable, localPosition=[x, 0.0, 0.0])
            place = self._marker(body_of(reference), z, along)
            self._join(int(self.mbs.AddMarker(tip)), place, turns=how == PIN)
        self._cable_nodes[flexure.name], self.drawn[flexure.name] = nodes, places
        self.energy += EI / L
        self.force += EI / L**2

    def _joint(self, joint: Joint) -> None:
        markers = [
            self._marker(body_of(p), self._at(self.mechanism.point(p, joint.name)))
            for p in (joint.start, joint.end)
        ]
        self._join(*markers, turns=True)

    def _hold(self, stop: Stop) -> int:
        """Return a constraint, off at first, that keeps the gap of a stop closed."""
        u, drawn = unit(stop.direction), self._hit_point(stop)
        wall = drawn + value(stop, "position", self.values) * u
        pair = [self._marker(stop.on, wall, u), self._marker(stop.body, drawn, u)]
        joint = self.items.GenericJoint(
            markerNumbers=pair, constrainedAxes=[1, 0, 0, 0, 0, 0], activeConnector=False
        )
        return int(self.mbs.AddObject(joint))

    def _hit_point(self, stop: Stop) -> complex:
        return self._at(stop.point) + value(stop, "offset", self.values) * 1j * unit(stop.direction)

    def _index(self) -> None:
        """Find the coordinates of nodes and bodies."""
        where = self.mbs.GetNodeODE2Index
        for name, node in self._body_nodes.items():
            body = self.rigid[name]
            self.rigid[name] = _Rigid(body.object, int(where(node)), body.centre)
        for name, nodes in self._cable_nodes.items():
            self.nodes[name] = np.array([int(where(node)) for node in nodes])

    def _settings(self) -> Any:
        settings = self.exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.active = False
        settings.staticSolver.verboseMode = 0
        settings.timeIntegration.verboseMode = 0
        # else it takes what Newton's method reached in steps that did not converge
        settings.timeIntegration.newton.adaptInitialResidual = False
        settings.timeIntegration.newton.relativeTolerance = 1e-12
        settings.timeIntegration.newton.absoluteTolerance = BALANCED * self.force
        settings.linearSolver.solverType = self.exu.LinearSolverType.EigenSparse
        return settings

    # -- what Exudyn evaluates --

    def _set(self, q: Real) -> None:
        current = self.exu.ConfigurationType.Current
        self.mbs.systemData.SetODE2Coordinates(q.tolist(), current)
        self.mbs.systemData.SetODE2Coordinates_t([0.0] * self.n, current)

    def _scale_loads(self, fraction: float) -> None:
        if fraction != self._load:
            for load, name, vector in self.loads:
                self.mbs.SetLoadParameter(load, name, [fraction * x for x in vector])
            self._load = fraction

    def forces(self, q: Real) -> Real:
        """Return f: loads less elastic forces, (n,) [N], [N m]; reactions not among them."""
        self._set(q)
        self.solver.ComputeODE2RHS(self.mbs)
        return np.array(self.solver.GetSystemResidual())[: self.n]

    def _tangents(self, q: Real) -> tuple[Real, Real]:
        """Return K = -df/dq (n, n) and all columns of C."""
        self._set(q)
        self.solver.ComputeJacobianODE2RHS(self.mbs, -1.0, 0.0, 0.0, 1)
        self.solver.ComputeJacobianAE(self.mbs, 1.0, 0.0, 0.0, False)
        jacobian = np.array(self.solver.GetSystemJacobian())
        return jacobian[: self.n, : self.n], jacobian[: self.n, self.n :]

    def stiffness(self, q: Real) -> Real:
        """Return K = -df/dq, (n, n)."""
        return self._tangents(q)[0]

    def constraint_columns(self, q: Real) -> Real:
        """Return C, the transposed Jacobian of the clamps, pins and joints, (n, r)."""
        return self._tangents(q)[1][:, self._active]

    def constraint_values(self, q: Real) -> Real:
        """Return Phi, by how much clamps, pins and joints are open, (r,) [m], [rad]."""
        self._set(q)
        self.solver.ComputeAlgebraicEquations(self.mbs, False)
        return np.array(self.solver.GetSystemResidual())[self.n :][self._active]

    @cached_property
    def _active(self) -> NDArray[np.bool_]:
        """Columns of C that are not those of stops, which are off, or of nothing at all."""
        active: NDArray[np.bool_] = np.any(self._tangents(np.zeros(self.n))[1] != 0.0, axis=0)
        return active

    @cached_property
    def M(self) -> Real:
        """Mass matrix, (n, n): constant, because the coordinates are absolute and planar."""
        self.solver.ComputeMassMatrix(self.mbs)
        M: Real = np.array(self.solver.GetSystemMassMatrix())[: self.n, : self.n]
        return M

    def _constraint_stiffness(self, q: Real, mu: Real) -> Real:
        """Return -d(C mu)/dq, which Exudyn leaves out of K, (n, n)."""
        touched = np.flatnonzero(np.any(self.constraint_columns(q) != 0.0, axis=1))
        result = self._bend(q, mu, touched.tolist())
        return (result + result.T) / 2

    def _bend(self, q: Real, mu: Real, touched: list[int]) -> Real:
        """Return columns of -d(C mu)/dq by central differences, the others zero."""
        result = np.zeros((self.n, self.n))
        for j in touched:
            step = np.zeros(self.n)
            step[j] = DIFFERENCE
            change = self.constraint_columns(q + step) - self.constraint_columns(q - step)
            result[:, j] = -change @ mu / (2 * DIFFERENCE)
        return result

    # -- statics --

    @cached_property
    def _release_row(self) -> Real:
        release = self.mechanism.release
        u, row = unit(release.direction), np.zeros(self.n)
        first = self.rigid[release.body].first
        assert first is not None
        row[first : first + 2] = u.real, u.imag
        return row

    def equilibrium(self, displacement: float | None = None, near: Shape | None = None) -> Shape:
        """Return the shape under gravity and the forces, free or held at a displacement.

        Parameters
        ----------
        displacement : float or None
            Of the released body's centre of mass along the direction of the release, held by a
            force along it [m]; None: no holding force.
        near : Shape or None
            A shape under the same loads from which to go on; None: loads and displacement are
            raised together from the drawn shape.

        Raises
        ------
        EquilibriumError
            If there is no such shape, or the loading does not lead there.
        """
        row = self._release_row
        if near is None:
            q, mu, force = np.zeros(self.n), np.zeros(int(self._active.sum())), 0.0
            begin = 0.0
        else:
            q, mu, force = near.q, near.mu, near.force
            begin = float(row @ q)
        held = displacement is not None
        target = displacement if displacement is not None else 0.0
        state = np.concatenate([q, mu, [force] if held else []])
        done, fraction = 0.0, FIRST_FRACTION if near is None else 1.0
        while done < 1.0:
            goal = min(1.0, done + fraction)
            self._scale_loads(goal if near is None else 1.0)
            found = self._newton(state, begin + goal * (target - begin) if held else None)
            far = found is not None and np.abs((found - state)[: self.n]).max() > LARGEST_CHANGE
            if found is not None and not far:
                state, done, fraction = found, goal, 2 * fraction
                continue
            fraction /= 2
            if fraction < SMALLEST_FRACTION:
                self._scale_loads(1.0)
                raise EquilibriumError(
                    f"the finite elements found no equilibrium beyond {done:.3g} of the load"
                    + (f" and of the displacement {target:g} m" if held else "")
                    + ": reduce them, or stiffen the flexures"
                )
        self._scale_loads(1.0)
        r = self.n + len(mu)
        return Shape(state[: self.n], state[self.n : r], float(state[r]) if held else 0.0)

    def _newton(self, start: Real, displacement: float | None) -> Real | None:
        """Solve f + C mu + r F = 0, Phi = 0, r q = displacement; None if it does not converge."""
        n, state = self.n, start.copy()
        turns = [b.first + 2 for b in self.rigid.values() if b.first is not None]
        row = self._release_row[:, None] if displacement is not None else np.zeros((n, 0))
        for _ in range(NEWTON_STEPS):
            q = state[:n]
            K, C = self._tangents(q)
            B = np.hstack([C[:, self._active], row])
            open_by = self.constraint_values(q)
            if displacement is not None:
                open_by = np.append(open_by, row[:, 0] @ q - displacement)
            right = np.concatenate([self.forces(q) + B @ state[n:], -open_by])
            K = K + self._bend(q, state[n : n + int(self._active.sum())], turns)
            matrix = np.block([[K, -B], [B.T, np.zeros((B.shape[1],) * 2)]])
            change = _solved(matrix, right)
            if change is None or np.abs(change[:n]).max() > 10.0:
                return None
            state = state + change
            if np.abs(change[:n]).max() <= CONVERGED:
                return state
        return None

    # -- modes --

    def modes(self, shape: Shape) -> Modes:
        """Return the modes about a static shape; its holding force stays as a dead load.

        All that the elements have, mass-normalised, on the tangent of the constraints.
        """
        K = self.stiffness(shape.q) + self._constraint_stiffness(shape.q, shape.mu)
        Z = null_space(self.constraint_columns(shape.q).T)
        _, reduced = eigh(Z.T @ ((K + K.T) / 2) @ Z, Z.T @ self.M @ Z)
        phi = Z @ reduced
        # Rayleigh's quotient: eigenvalues are rounded on the scale of the highest
        omega2 = np.einsum("ij,ij->j", phi, K @ phi)
        return Modes(np.sign(omega2) * np.sqrt(np.abs(omega2)) / (2 * np.pi), phi, self.M)

    # -- what a shape is like --

    def displacement(self, q: Real) -> float:
        """Return the displacement of the released body along the direction of the release [m]."""
        return float(self._release_row @ q)

    def body(self, name: str, q: Real) -> tuple[complex, float]:
        """Return the displacement [m] and the rotation [rad] of a body's centre of mass."""
        first = self.rigid[name].first
        if first is None:
            return 0j, 0.0
        return complex(q[first], q[first + 1]), float(q[first + 2])

    def curve(self, flexure: str, q: Real) -> Complex:
        """Return the places of the nodes of a flexure, from its start to its end [m]."""
        first = self.nodes[flexure]
        result: Complex = self.drawn[flexure] + q[first] + 1j * q[first + 1]
        return result

    def _place(self, name: str, drawn: complex, q: Real) -> tuple[complex, complex]:
        """Return the place of a drawn point of a body and its lever about the centre."""
        moved, angle = self.body(name, q)
        lever = (drawn - self.rigid[name].centre) * cmath.exp(1j * angle)
        return self.rigid[name].centre + moved + lever, lever

    def gap(self, stop: int, q: Real) -> float:
        """Return the gap of a stop [m]."""
        s = self.mechanism.stops[stop]
        drawn = self._hit_point(s)
        seen = self._place(s.body, drawn, q)[0]
        _, angle = self.body(s.on, q)
        origin = self.rigid[s.on].centre
        seen = (seen - origin - self.body(s.on, q)[0]) * cmath.exp(-1j * angle) + origin
        travelled = (unit(s.direction).conjugate() * (seen - drawn)).real
        return value(s, "position", self.values) - travelled

    def gap_row(self, stop: int, q: Real) -> Real:
        """Return G = d(gap)/dq, (n,)."""
        s, row = self.mechanism.stops[stop], np.zeros(self.n)
        place, lever = self._place(s.body, self._hit_point(s), q)
        moved, angle = self.body(s.on, q)
        u = unit(s.direction) * cmath.exp(1j * angle)  # as it points now
        lever_on = place - self.rigid[s.on].centre - moved
        for name, arm, sign in ((s.body, lever, -1.0), (s.on, lever_on, 1.0)):
            first = self.rigid[name].first
            if first is not None:
                turn = (u.conjugate() * 1j * arm).real
                row[first : first + 3] += sign * np.array([u.real, u.imag, turn])
        return row

    def modal_restitution(self, shape: Shape, stop: int, restitution: float) -> float:
        r"""Return the modal restitution of an arriving pure fundamental mode (algebraic) [-].

        C = (1 + eps) mu_1 - 1,  mu_1 = G_1^2 / sum_i G_i^2 over all modes of the elements,
        G_i = (d gap/dq) phi_i.
        """
        share = (self.gap_row(stop, shape.q) @ self.modes(shape).shape) ** 2
        return (1.0 + restitution) * float(share[0] / share.sum()) - 1.0

    # -- transients --

    def transient(
        self,
        stop_time: float,
        step: float = 2e-5,
        *,
        spectral_radius: float = 0.5,
        impacts: int | None = None,
    ) -> Result:
        """Integrate from the release, through impacts, by the generalised-alpha method.

        An impact is located in time, then follows Newton's law with the mass matrix of the
        elements; a stop that closes below ``rest_speed`` is held by a constraint as long as it
        pushes.

        Parameters
        ----------
        stop_time, step : float
            Duration and step size [s].
        spectral_radius : float
            Of the method, below 1: what the step does not resolve is damped more the less it is.
        impacts : int or None
            Number of impacts after which to end; None: no limit.

        Returns
        -------
        Result
            With a row every step: ``time``, displacements, rotations and velocities of the
            bodies, gaps and contacts of the stops, named as the model names them; and the
            impacts, whose states are those of the elements.

        Raises
        ------
        ParameterError
            If a wall is penetrated at release, or times make no sense.
        EquilibriumError
            If the shape of the release cannot be held.
        SimulationError
            If Exudyn's integration fails or the impacts do not end.
        """
        if not (0.0 < step < stop_time < math.inf):
            raise ParameterError(
                f"step = {step:g} s must be positive and shorter than stop_time = {stop_time:g} s"
            )
        self._scale_loads(1.0)
        return _Transient(self, step, spectral_radius).run(stop_time, impacts)

    def release(self) -> tuple[Real, Real]:
        """Return displacements and velocities at the release."""
        held = value(self.mechanism.release, "displacement", self.values)
        speed = value(self.mechanism.release, "velocity", self.values)
        q = self.equilibrium(held).q
        if speed == 0.0:
            return q, np.zeros(self.n)
        columns = np.hstack([self.constraint_columns(q), self._release_row[:, None]])
        rates = np.zeros(columns.shape[1])
        rates[-1] = speed
        return q, self.response(columns, rates)

    def response(self, columns: Real, rates: Real) -> Real:
        """Return the velocities of least kinetic energy with columns^T v = rates."""
        r = columns.shape[1]
        saddle = np.block([[self.M, columns], [columns.T, np.zeros((r, r))]])
        v: Real = np.linalg.solve(saddle, np.concatenate([np.zeros(self.n), rates]))[: self.n]
        return v

    def impact(
        self, q: Real, v: Real, struck: int, restitution: float, held: tuple[int, ...] = ()
    ) -> tuple[Real, float]:
        """Return the velocities after an impact at a stop, and its impulse [N s].

        Parameters
        ----------
        q, v : (n,)
            State before.
        struck : int
            The stop.
        restitution : float
            Newton's coefficient [-].
        held : tuple of int
            Stops that hold, and keep their gaps.
        """
        G = self.gap_row(struck, q)
        C = np.hstack([self.constraint_columns(q), *(self.gap_row(i, q)[:, None] for i in held)])
        r = C.shape[1]
        saddle = np.block([[self.M, C], [C.T, np.zeros((r, r))]])
        unit_response = np.linalg.solve(saddle, np.concatenate([G, np.zeros(r)]))[: self.n]
        P = -(1.0 + restitution) * float(G @ v) / float(G @ unit_response)
        return v + P * unit_response, P


def _solved(matrix: Real, right: Real) -> Real | None:
    """Solve; the least solution where what hangs in joints has no stiffness before it is loaded."""
    try:
        x: Real = splu(csc_array(matrix)).solve(right)
    except RuntimeError:  # singular
        x = np.array(np.linalg.lstsq(matrix, right, rcond=1e-13)[0], float)
    return x if np.all(np.isfinite(x)) else None


class _StepError(SimulationError):
    """A step did not converge."""


class _Transient:
    """Runs Exudyn from event to event."""

    def __init__(self, fe: FiniteElements, step: float, spectral_radius: float) -> None:
        self.fe, self.step, self.radius = fe, step, spectral_radius
        stops = fe.mechanism.stops
        self.held: set[int] = set()
        self.armed = [False] * len(stops)
        self.latched = [Latched() for _ in stops]
        self.run_ = _Run()
        self.largest = fe.energy  # kinetic energy so far, or what is little [J]

    def run(self, stop_time: float, most: int | None) -> Result:
        t = 0.0
        q, v = self.fe.release()
        for i, stop in enumerate(self.fe.mechanism.stops):
            gap = self.fe.gap(i, q)
            if gap < -1e-9:
                raise ParameterError(
                    f"the wall {stop.name} is penetrated by {-gap:.6g} m at release; move the "
                    "stop or release further back"
                )
            self.armed[i] = gap > 1e-9
        self._keep(t, q, v)
        try:
            while stop_time - t > REACHED * self.step and (
                most is None or len(self.run_.impacts) < most
            ):
                t, q, v, struck = self._fly(t, q, v, stop_time)
                if struck is not None:
                    v = self._strike(t, q, v, struck)
                    self._keep(t, q, v)
                if len(self.run_.impacts) > MOST_HITS:
                    raise SimulationError(
                        f"more than {MOST_HITS} impacts by t = {t:.6g} s: raise rest_speed, or "
                        "damping.beta"
                    )
        finally:
            for i in list(self.held):
                self._hold(i, False)
        return self._result()

    # -- flight --

    def _fly(self, t: float, q: Real, v: Real, end: float) -> tuple[float, Real, Real, int | None]:
        """Go on to the end or to the first event; return the state there, the stop if struck."""
        before = (t, q, v)
        found: list[tuple[float, Real, Real]] = []
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
        while end - after[0] > REACHED * self.step and not struck and not released:
            now = end if h == self.step else min(end, after[0] + SHORT_STEPS * h)
            steps = max(1, math.ceil((now - after[0]) / h - 1e-9))
            try:
                after = self._integrate(*after, now, steps, look)
                h = min(2 * h, self.step)
            except _StepError:
                after, h = before, h / 2
                if h < SMALLEST_STEP * self.step:
                    raise
        if struck:
            return self._locate(before, found[0], struck)
        for i in released:
            self._hold(i, False)
        return (*(before if released else after), None)

    def _open(self) -> list[int]:
        return [i for i in range(len(self.armed)) if i not in self.held]

    def _closes(self, i: int, q: Real, v: Real) -> bool:
        """Tell whether an open stop has just closed; arm it once it is open."""
        gap = self.fe.gap(i, q)
        if gap > 0.0:
            self.armed[i] = True
            return False
        if not self.armed[i]:  # left in contact by an impact, within what location leaves
            return gap < -1e-9 and float(self.fe.gap_row(i, q) @ v) < 0.0
        return True

    def _locate(
        self, a: tuple[float, Real, Real], b: tuple[float, Real, Real], struck: list[int]
    ) -> tuple[float, Real, Real, int]:
        """Return the state at which the first of the stops touches, by shorter steps."""
        small = LOCATED * max(np.abs(z).max() for z in self.fe.drawn.values())
        t, q, v = a
        i = struck[0]
        target = b[0] - t
        gap_a, gap_b = self.fe.gap(i, q), self.fe.gap(i, b[1])
        low, high, gap_low, gap_high = 0.0, target, gap_a, gap_b
        best = b
        for _ in range(LOCATIONS):
            if gap_low <= small:
                break
            h = low + (high - low) * gap_low / (gap_low - gap_high)
            best = self._reach(t, q, v, t + h)
            gap = self.fe.gap(i, best[1])
            if abs(gap) <= small:
                break
            low, gap_low, high, gap_high = (
                (h, gap, high, gap_high) if gap > 0.0 else (low, gap_low, h, gap)
            )
        return (*best, i)

    def _reach(self, t: float, q: Real, v: Real, end: float) -> tuple[float, Real, Real]:
        """Return the state at a time within a step, by one step if that converges, or by more."""
        for steps in LOCATING_STEPS[:-1]:
            try:
                return self._integrate(t, q, v, end, steps, lambda *_: True)
            except _StepError:
                continue
        return self._integrate(t, q, v, end, LOCATING_STEPS[-1], lambda *_: True)

    def _integrate(
        self, t: float, q: Real, v: Real, end: float, steps: int,
        look: Callable[[float, Real, Real], bool],
    ) -> tuple[float, Real, Real]:  # fmt: skip
        """Let Exudyn integrate; ``look`` sees every step and may end it."""
        fe, data = self.fe, self.fe.mbs.systemData
        initial = fe.exu.ConfigurationType.Initial
        data.SetODE2Coordinates(q.tolist(), initial)
        data.SetODE2Coordinates_t(v.tolist(), initial)
        settings = fe._settings()
        settings.timeIntegration.startTime = t
        settings.timeIntegration.endTime = end
        settings.timeIntegration.numberOfSteps = steps
        settings.timeIntegration.generalizedAlpha.spectralRadius = self.radius
        state = (t, q, v)
        force = fe.forces(q)
        gains = False

        def after_step(mbs: Any, now: float) -> bool:
            nonlocal state, force, gains
            fe.solver.ComputeODE2RHS(mbs)
            forces = np.array(fe.solver.GetSystemResidual())[: fe.n]
            q_now, v_now = (
                np.array(x) for x in (data.GetODE2Coordinates(), data.GetODE2Coordinates_t())
            )
            gains = self._gains(state, q_now, v_now, force + forces)
            if gains:
                return False
            state, force = (float(now), q_now, v_now), forces
            return look(*state)

        fe.mbs.SetPostStepUserFunction(after_step)
        talks, fe.exu.config.printToConsole = fe.exu.config.printToConsole, False
        try:
            fe.mbs.SolveDynamic(settings)
        except Exception as error:
            raise _StepError(
                f"Exudyn's integration failed at t = {state[0]:.6g} s ({error}): shorten the step"
            ) from None
        finally:
            fe.mbs.SetPostStepUserFunction(0)
            fe.exu.config.printToConsole = talks
        if gains:
            raise _StepError(
                f"a step of Exudyn's from t = {state[0]:.6g} s gained energy from nothing: it did "
                "not converge; shorten the step"
            )
        return state

    def _gains(self, before: tuple[float, Real, Real], q: Real, v: Real, twice_force: Real) -> bool:
        """Tell whether the kinetic energy grew by more than the work of the forces.

        By the trapezoidal rule, which is exact for linear forces.
        """
        kinetic = float(v @ self.fe.M @ v) / 2
        grown = kinetic - float(before[2] @ self.fe.M @ before[2]) / 2
        work = float(twice_force @ (q - before[1])) / 2
        if grown - work > MOST_GAIN * self.largest:
            return True
        self.largest = max(self.largest, kinetic)
        return False

    # -- contact --

    def _pulls(self, i: int) -> bool:
        """Tell whether a stop that holds would have to pull."""
        joint = self.fe.holds[i]
        force = self.fe.mbs.GetObjectOutput(joint, self.fe.exu.OutputVariableType.ForceLocal)
        return bool(force[0] < 0.0)

    def _hold(self, i: int, on: bool) -> None:
        self.fe.mbs.SetObjectParameter(self.fe.holds[i], "activeConnector", on)
        (self.held.add if on else self.held.discard)(i)
        self.armed[i] = False

    def _strike(self, t: float, q: Real, v: Real, i: int) -> Real:
        """Return the velocities after a stop is struck; hold it if it is struck softly."""
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
        self.run_.impacts.append(Impact(stop.name, t, q, v, after, P, self.latched[i]))
        return after

    def _static_near(self, q: Real) -> Shape:
        """Return the held shape with the released body where it is in a shape."""
        return self.fe.equilibrium(self.fe.displacement(q))

    # -- results --

    def _keep(self, t: float, q: Real, v: Real) -> None:
        run = self.run_
        run.times.append(t)
        run.q.append(np.array([q[j] for j in self._columns]))
        run.v.append(np.array([v[j] for j in self._columns]))
        run.held.append(tuple(i in self.held for i in range(len(self.armed))))

    @cached_property
    def _columns(self) -> list[int]:
        firsts = [self.fe.rigid[b.name].first for b in self.fe.mechanism.bodies]
        return [first + k for first in firsts if first is not None for k in range(3)]

    def _result(self) -> Result:
        fe, run = self.fe, self.run_
        rows = []
        full = np.zeros(fe.n)
        for t, q, v, held in zip(run.times, run.q, run.v, run.held, strict=True):
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
        return Result(fe.mechanism, fe.values, structured(rows), tuple(run.impacts))
