"""Static shapes of a mechanism under loads, free or held, with all that is asked about them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..base.counts import check_count
from ..base.errors import ParameterError
from ..files.settings import in_si, in_unit
from ..mechanics import modal, statics
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble
from ..mechanics.body_compliance import compliance_matrix, stiffness_matrix
from ..mechanics.modal import Modes
from ..mechanics.places import BodyFrame
from ..mechanics.statics import Equilibrium, holding_stiffness
from ..mechanics.stress import Stress, static_stresses
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parts import Probe
from .held import POINTS_MAX, check_held, held_unit
from .holding import Curve, curve


class Place(NamedTuple):
    """Displacement of a point from the straight shape [m], and rotation of its body [rad]."""

    x: float
    y: float
    angle: float


@dataclass(frozen=True, repr=False)
class StaticShape:
    """A static shape under loads.

    Parameters
    ----------
    system : System
        The assembled mechanism.
    shape : Equilibrium
        Coordinates and forces.
    held : bool
        Whether the released body is held at its displacement.
    loads : mapping
        Forces [N] and moments [N m] by name.
    """

    system: System
    shape: Equilibrium
    held: bool
    loads: Mapping[str, float]

    @property
    def displacement(self) -> float:
        """Displacement of the released point along its direction [m]; rotation [rad]."""
        return self.system.amount(self.shape.q)

    @property
    def force(self) -> float:
        """Holding force [N], or moment [N m] if the release is by an angle; 0 if free."""
        return self.shape.force

    @cached_property
    def stiffness(self) -> float:
        """Derivative of the holding force by the displacement [N/m], [N m/rad]."""
        return holding_stiffness(self.system, self.shape)

    @cached_property
    def modes(self) -> Modes:
        """Modes about the shape, with all loads and the holding force as dead loads."""
        return modal.modes(self.system, self.shape)

    @property
    def stable(self) -> bool:
        """Whether no direction is unstable under dead loads; motions without stiffness are not."""
        return modal.unstable_directions(self.modes.frequency) == 0

    @property
    def fundamental(self) -> float:
        """Frequency of the first mode that is not free [Hz]; negative if unstable, 0 without."""
        found = self.modes
        first = modal.first_acting(self.system, found)
        return float(found.frequency[first]) if len(found.frequency) else 0.0

    def __repr__(self) -> str:
        name, kind = self.system.mechanism.name, "held" if self.held else "free"
        unit = "rad" if self.system.mechanism.release.turns else "m"
        stability = "stable" if self.stable else "unstable"
        return f"<StaticShape of {name}: {kind} at {self.displacement:.6g} {unit}, {stability}>"

    @cached_property
    def positions(self) -> dict[str, Place]:
        """Displacements and rotations of all bodies (at their centres of mass) and probes."""
        system, e = self.system, self.system.directions(self.shape.q)
        return {
            frame.name: self._place(complex(frame.c + frame.A @ e - frame.drawn), frame.j)
            for frame in (*system.bodies.values(), *system.probes)
        }

    def _place(self, moved: complex, j: int) -> Place:
        turned = float(self.shape.q[j] - self.system.q0[j]) if j >= 0 else 0.0
        return Place(moved.real, moved.imag, turned)

    @cached_property
    def stress(self) -> dict[str, Stress]:
        """Bending and normal stress of each flexure by name; see ``docs/strength.md``."""
        return static_stresses(self.system, self.shape, self.loads)

    def compliance(self, body: str, at: str | None = None) -> Real:
        """Return the compliance matrix of a body, (3, 3): x [m], y [m], angle [rad] by N, N, N m.

        Parameters
        ----------
        body : str
            Name of the body.
        at : str or None
            Point of the body at which the loads act, ``body.point``; None: the centre of mass.

        Raises
        ------
        ParameterError
            If there is no such body, or the point is none of its points.
        EquilibriumError
            If a motion of the mechanism has no stiffness.
        """
        return compliance_matrix(self.system, self.shape, self._frame(body, at), self.held)

    def stiffness_matrix(self, body: str, at: str | None = None) -> Real | None:
        """Return the inverse of :meth:`compliance`, (3, 3) [N, N, N m by m, m, rad].

        None: the body is rigid in a direction.  Arguments and errors are those of
        :meth:`compliance`.
        """
        return stiffness_matrix(self.compliance(body, at), self.system.length)

    def _frame(self, body: str, at: str | None) -> BodyFrame:
        system = self.system
        if body not in system.bodies:
            bodies = ", ".join(system.bodies)
            raise ParameterError(f"there is no body {body}; the bodies are {bodies}")
        if at is None:
            return system.bodies[body]
        if not at.startswith(f"{body}."):
            raise ParameterError(f"{at} is no point of {body}; give {body}.point")
        probed = replace(system.mechanism, probes=(Probe("the load", at),))
        return assemble(probed, system.values).probes[0]


def equilibrium(
    mechanism: Mechanism,
    values: Mapping[str, float | str] | None = None,
    *,
    loads: Mapping[str, float | str] | None = None,
    held: float | str | None = None,
) -> StaticShape:
    """Return the static shape of a mechanism under gravity and loads, without stops.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism, as :func:`prbm.load` returns it.
    values : mapping or None
        Values of parameters by name: numbers in SI units, or texts with a unit, ``"0.2 mm"``; None:
        the defaults.
    loads : mapping or None
        Forces [N] and moments [N m] by the names of the inputs, such as ``force.y``.
    held : float, str or None
        Displacement at which the released body is held, along the direction of the release [m];
        its rotation [rad] if the release is by an angle.  None: it is free.

    Raises
    ------
    ParameterError
        If a parameter or a load is unknown or out of its bounds, or the held displacement is larger
        than the mechanism.
    UserMistake
        If a text is not a quantity of the right dimension.
    EquilibriumError
        If no static shape is found.

    Examples
    --------
    >>> import prbm
    >>> shape = prbm.equilibrium(prbm.load("CurvedBistable"), loads={"force.y": "-5 N"})
    >>> shape.stable, round(1e3 * shape.positions["shuttle"].y, 3)
    (True, -0.263)
    """
    system = assemble(mechanism, mechanism.values(in_si(mechanism, values, "values")))
    given = in_si(mechanism, loads, "loads")
    amount = None
    if held is not None:
        amount = check_held(in_unit("held", held, held_unit(mechanism).si), system, "held =")
    return StaticShape(system, statics.equilibrium(system, amount, given), held is not None, given)


def modes(
    mechanism: Mechanism,
    values: Mapping[str, float | str] | None = None,
    *,
    loads: Mapping[str, float | str] | None = None,
    held: float | str | None = None,
) -> Modes:
    """Return the modes of a mechanism about a static shape, without stops.

    Arguments and errors are those of :func:`equilibrium`.

    Examples
    --------
    >>> import prbm
    >>> prbm.modes(prbm.load("GuideBeam")).frequency[:2].round(2).tolist()  # Hz
    [4.91, 130.98]
    """
    return equilibrium(mechanism, values, loads=loads, held=held).modes


def holding_curve(
    mechanism: Mechanism,
    values: Mapping[str, float | str] | None = None,
    *,
    start: float | str,
    end: float | str,
    points: int = 101,
    branches: int = 0,
) -> Curve:
    """Return the holding force of the released body over its displacement, without stops.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism, as :func:`prbm.load` returns it.
    values : mapping or None
        As for :func:`equilibrium`.
    start, end : float or str
        First and last displacement [m]; rotations [rad] if the release is by an angle.
    points : int
        Number of displacements in equal distances, at which stiffness and frequency are computed.
    branches : int
        Number of branches at bifurcations that are followed.

    Returns
    -------
    Curve
        Displacements and forces along the path, rest positions, limit points, bifurcations and
        snap-throughs.

    Raises
    ------
    ParameterError
        If a parameter or a displacement is out of its bounds, the displacements are not ascending,
        or the number of points or branches is no integer or out of its bounds.
    UserMistake
        If a text is not a quantity of the right dimension.
    EquilibriumError
        If no shape is found at the displacement at which the path begins.

    Examples
    --------
    >>> import prbm
    >>> found = prbm.holding_curve(prbm.load("Bistable"), start=0.0, end="26 mm", points=27)
    >>> [rest.stable for rest in found.rests]
    [True, False, True]
    """
    system = assemble(mechanism, mechanism.values(in_si(mechanism, values, "values")))
    si = held_unit(mechanism).si
    low, high = (
        check_held(in_unit(name, x, si), system, f"{name} =")
        for name, x in (("start", start), ("end", end))
    )
    if not low < high:
        raise ParameterError(f"start = {low:g} {si} must be below end = {high:g} {si}")
    count = check_count("points", points, 2, POINTS_MAX)
    followed = check_count("branches", branches, 0, POINTS_MAX)
    return curve(system, np.linspace(low, high, count), branches=followed)
