"""A mechanism of finite elements: shapes, modes, gaps, impacts, transients."""

import cmath
import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np

from ...base.errors import ParameterError
from ...mechanics.arrays import Complex, Real
from ...mechanics.modal import Modes
from ...mechanics.positions import given_at_start
from ...mechanics.system import unit
from ...mechanism.description import Mechanism
from ...mechanism.parts import POSITIONS, VELOCITIES, value
from ...mechanism.supported import FREE_BODIES, SPRINGS, check_supported
from ...runs.result import Result
from . import statics
from .equations import Equations
from .model import ElementModel, FiniteElementError
from .statics import Shape
from .transient import Transient


class FiniteElements:
    """A mechanism of finite elements.

    Parameters
    ----------
    mechanism : Mechanism
        Bodies, flexures, joints, ground, gravity, stops.
    values : mapping
        Parameters and inputs (forces on bodies) that differ from their defaults.
    elements : int
        Number of cable elements per flexure.

    Attributes
    ----------
    model : ElementModel
        The assembled elements.
    equations : Equations
        Forces, stiffness, mass and constraints of the elements.

    Raises
    ------
    FiniteElementError
        If Exudyn is not installed, or the mechanism has friction, damping in proportion to mass,
        or a moving base or wall.
    ParameterError
        If a name is unknown or a value out of bounds.
    MechanismError
        If no flexures or joints connect a body to the ground.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        values: Mapping[str, float] | None = None,
        *,
        elements: int = 16,
    ) -> None:
        check_supported(mechanism, "a model of finite elements", SPRINGS, FREE_BODIES)
        self.model = ElementModel(mechanism, values, elements)
        self.equations = Equations(self.model)
        self.mechanism, self.values = mechanism, self.model.values
        self.n = self.equations.n

    @property
    def M(self) -> Real:
        """Mass matrix, (n, n)."""
        return self.equations.M

    # -- statics and modes --

    @cached_property
    def release_row(self) -> Real:
        """Derivatives of the displacement along the direction of the release, (n,).

        Raises
        ------
        FiniteElementError
            If the release is by an angle, or by a point other than the centre of mass.
        """
        release = self.mechanism.release
        if release.turns or release.point is not None:
            raise FiniteElementError(
                f"finite elements hold {release.body} by a force on its centre of mass: give "
                "release.displacement, and no release.angle or release.point"
            )
        u, row = unit(release.direction), np.zeros(self.n)
        first = self.model.rigid[release.body].first
        assert first is not None
        row[first : first + 2] = u.real, u.imag
        return row

    def equilibrium(self, displacement: float | None = None, near: Shape | None = None) -> Shape:
        """Return the shape under gravity and the forces, free or held at a displacement.

        Parameters
        ----------
        displacement : float or None
            Displacement of the released body's centre of mass along the direction of the release,
            kept by a force along it [m]; None: no holding force.
        near : Shape or None
            Start of the iteration: a shape under the same loads; None: loads and displacement are
            raised together from the straight shape.

        Raises
        ------
        EquilibriumError
            If the load steps do not reach a shape.
        """
        rigid = self.model.rigid.values()
        turns = [body.first + 2 for body in rigid if body.first is not None]
        return statics.equilibrium(self.equations, self.release_row, turns, displacement, near)

    def modes(self, shape: Shape) -> Modes:
        """Return all modes about a static shape, mass-normalised, tangent to the constraints.

        The holding force of the shape remains as a constant load.
        """
        return statics.modes(self.equations, shape)

    # -- geometry of a shape --

    def displacement(self, q: Real) -> float:
        """Return the displacement of the released body along the direction of the release [m]."""
        return float(self.release_row @ q)

    def body(self, name: str, q: Real) -> tuple[complex, float]:
        """Return the displacement [m] and the rotation [rad] of a body's centre of mass."""
        first = self.model.rigid[name].first
        if first is None:
            return 0j, 0.0
        return complex(q[first], q[first + 1]), float(q[first + 2])

    def curve(self, flexure: str, q: Real) -> Complex:
        """Return the places of the nodes of a flexure, from its start to its end [m]."""
        first = self.model.nodes[flexure]
        result: Complex = self.model.drawn[flexure] + q[first] + 1j * q[first + 1]
        return result

    def _place(self, name: str, drawn: complex, q: Real) -> tuple[complex, complex]:
        """Return the place of a drawn point of a body and its lever about the centre."""
        moved, angle = self.body(name, q)
        lever = (drawn - self.model.rigid[name].centre) * cmath.exp(1j * angle)
        return self.model.rigid[name].centre + moved + lever, lever

    def gap(self, stop: int, q: Real) -> float:
        """Return the gap of a stop [m]."""
        s = self.mechanism.stops[stop]
        drawn = self.model.hit_point(s)
        seen = self._place(s.body, drawn, q)[0]
        _, angle = self.body(s.on, q)
        origin = self.model.rigid[s.on].centre
        seen = (seen - origin - self.body(s.on, q)[0]) * cmath.exp(-1j * angle) + origin
        travelled = (unit(s.direction).conjugate() * (seen - drawn)).real
        return value(s, "position", self.values) - travelled

    def gap_row(self, stop: int, q: Real) -> Real:
        """Return G = d(gap)/dq, (n,)."""
        s, row = self.mechanism.stops[stop], np.zeros(self.n)
        place, lever = self._place(s.body, self.model.hit_point(s), q)
        moved, angle = self.body(s.on, q)
        u = unit(s.direction) * cmath.exp(1j * angle)  # The direction turns with the wall.
        lever_on = place - self.model.rigid[s.on].centre - moved
        for name, arm, sign in ((s.body, lever, -1.0), (s.on, lever_on, 1.0)):
            first = self.model.rigid[name].first
            if first is not None:
                turn = (u.conjugate() * 1j * arm).real
                row[first : first + 3] += sign * np.array([u.real, u.imag, turn])
        return row

    def modal_restitution(self, shape: Shape, stop: int, restitution: float) -> float:
        r"""Return the modal restitution if only the fundamental mode moves before the impact [-].

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
        """Integrate from the release through impacts by the generalised-alpha method.

        Impacts are located in time and follow Newton's law with the mass matrix of the elements.
        A stop that closes below ``rest_speed`` is held by a constraint as long as it pushes.

        Parameters
        ----------
        stop_time, step : float
            Duration and step size [s].
        spectral_radius : float
            Spectral radius of the method, below 1: smaller values damp unresolved frequencies more.
        impacts : int or None
            Number of impacts after which the run ends; None: no limit.

        Returns
        -------
        Result
            One row per step: ``time``, displacements, rotations and velocities of the bodies,
            gaps and contacts of the stops, with the names of the model; and the impacts, with
            states of the elements.

        Raises
        ------
        ParameterError
            If a wall is penetrated at release, or the times are invalid.
        EquilibriumError
            If the shape of the release cannot be held.
        SimulationError
            If Exudyn's integration fails or the impacts do not end.
        """
        if not (0.0 < step < stop_time < math.inf):
            raise ParameterError(
                f"step = {step:g} s must be positive and shorter than stop_time = {stop_time:g} s"
            )
        self.equations.scale_loads(1.0)
        return Transient(self, step, spectral_radius).run(stop_time, impacts)

    def release(self) -> tuple[Real, Real]:
        """Return displacements and velocities at the release, (n,), (n,)."""
        if self.mechanism.release.mode is not None:
            raise FiniteElementError(
                "finite elements are released from a held shape: give release.displacement, and "
                "no release.mode"
            )
        given = given_at_start(self.mechanism, self.values, (*POSITIONS, *VELOCITIES))
        if given:
            raise FiniteElementError(
                f"finite elements start from the release: remove {given[0].text}"
            )
        held = value(self.mechanism.release, "displacement", self.values)
        speed = value(self.mechanism.release, "velocity", self.values)
        q = self.equilibrium(held).q
        if speed == 0.0:
            return q, np.zeros(self.n)
        columns = np.hstack([self.equations.constraint_columns(q), self.release_row[:, None]])
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
            Index of the stop.
        restitution : float
            Newton's coefficient [-].
        held : tuple of int
            Indices of the stops that hold.
        """
        G = self.gap_row(struck, q)
        C = np.hstack(
            [self.equations.constraint_columns(q), *(self.gap_row(i, q)[:, None] for i in held)]
        )
        r = C.shape[1]
        saddle = np.block([[self.M, C], [C.T, np.zeros((r, r))]])
        unit_response = np.linalg.solve(saddle, np.concatenate([G, np.zeros(r)]))[: self.n]
        P = -(1.0 + restitution) * float(G @ v) / float(G @ unit_response)
        return v + P * unit_response, P
