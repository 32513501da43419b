"""Construction of the finite elements: bodies, cables, joints, loads and stops in Exudyn."""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.errors import PrbmError
from ...mechanics.arrays import Complex
from ...mechanics.flexures import check_slender
from ...mechanics.inputs import check_input, input_names
from ...mechanics.system import unit
from ...mechanism.description import Mechanism
from ...mechanism.expressions import affine
from ...mechanism.flexure import LEAF, PIN
from ...mechanism.parts import (
    GROUND,
    Body,
    Flexure,
    FlexureType,
    Joint,
    Point,
    Stop,
    body_of,
    value,
)

REMEDY = 'install it with: python -m pip install "prbm-impact[fe]"'


class FiniteElementError(PrbmError, ValueError):
    """Exudyn is not installed, or the elements do not support a feature."""


def _exudyn() -> tuple[Any, Any]:
    """Return Exudyn and its items."""
    try:
        return importlib.import_module("exudyn"), importlib.import_module("exudyn.itemInterface")
    except ImportError as error:
        raise FiniteElementError(
            f"the finite elements need Exudyn, which is not installed ({error}); {REMEDY}"
        ) from None


@dataclass(frozen=True)
class Rigid:
    """A body, or the ground.

    Parameters
    ----------
    object : int
        Number of the object in Exudyn.
    first : int or None
        Index of its first coordinate; None: the ground.
    centre : complex
        Drawn centre of mass [m].
    """

    object: int
    first: int | None
    centre: complex


class ElementModel:
    """The elements of a mechanism, assembled in Exudyn.

    Parameters are those of :class:`~prbm.references.finite_elements.FiniteElements`.

    Attributes
    ----------
    mbs : Any
        Multibody system of Exudyn.
    rigid : dict of str to Rigid
        Bodies and ground by name.
    nodes : dict of str to (m,) int
        Indices of the first coordinates of a flexure's nodes.
    drawn : dict of str to (m,) complex
        Drawn places of a flexure's nodes [m].
    loads : list
        Number, parameter and vector of each load.
    holds : list of int
        For each stop the constraint that keeps its gap closed; inactive at first.
    energy, force : float
        Bending energy [J] and force [N] of all flexures at a rotation of one radian.
    """

    def __init__(
        self, mechanism: Mechanism, values: Mapping[str, float] | None, elements: int
    ) -> None:
        if elements < 1:
            raise FiniteElementError(f"elements = {elements} must be at least 1 per flexure")
        changes = dict(values or {})
        self.given = dict.fromkeys(input_names(mechanism), 0.0)
        for name in self.given:
            if name in changes:
                self.given[name] = check_input(name, changes.pop(name), self.given)
        self.mechanism, self.values = mechanism, mechanism.values(changes)
        self.elements = elements
        _check_supported(mechanism, self.values, self.given)
        self.exu, self.items = _exudyn()
        self.mbs = self.exu.SystemContainer().AddSystem()
        self.rigid: dict[str, Rigid] = {}
        self.nodes: dict[str, NDArray[np.int64]] = {}
        self.drawn: dict[str, Complex] = {}
        self.loads: list[tuple[int, str, list[float]]] = []
        self._build()
        self.mbs.Assemble()
        self._index()

    @property
    def gravity(self) -> complex:
        """Acceleration of gravity [m/s^2]."""
        return complex(self.values["gravity.x"], self.values["gravity.y"])

    @property
    def size(self) -> float:
        """Largest distance of a node from the origin [m]."""
        return float(max(np.abs(z).max() for z in self.drawn.values()))

    def hit_point(self, stop: Stop) -> complex:
        """Return the drawn point of a body that hits a wall [m]."""
        return self._at(stop.point) + value(stop, "offset", self.values) * 1j * unit(stop.direction)

    def _at(self, point: Point) -> complex:
        x, y = (affine(coordinate)(self.values) for coordinate in point)
        return complex(x, y)

    def _build(self) -> None:
        item, add = self.items, self.mbs
        self.rigid[GROUND] = Rigid(int(add.AddObject(item.ObjectGround())), None, 0j)
        self._body_nodes: dict[str, int] = {}
        self._cable_nodes: dict[str, list[int]] = {}
        self.energy = self.force = 0.0
        for body in self.mechanism.bodies:
            self._body(body)
        for flexure in self.mechanism.flexures:
            self._flexure(flexure, self.mechanism.type_of(flexure))
        for joint in self.mechanism.joints:
            self._joint(joint)
        for force in self.mechanism.forces:
            at = self.rigid[force.body].centre if force.point is None else self._at(force.point)
            x, y, moment = (self.given[f"{force.name}.{axis}"] for axis in ("x", "y", "moment"))
            marker = self._marker(force.body, at)
            self._add_load(item.Force, marker, [x, y, 0.0])
            self._add_load(item.Torque, marker, [0.0, 0.0, moment])
        self.holds = [self._hold(stop) for stop in self.mechanism.stops]

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
        self.rigid[body.name] = Rigid(int(number), 0, z)
        weight = mass * self.gravity
        self._add_load(
            self.items.Force, self._marker(body.name, z), [weight.real, weight.imag, 0.0]
        )

    def _marker(self, body: str, drawn: complex, along: complex = 1.0) -> int:
        """Return a marker at a drawn point of a body, with its x axis along a direction."""
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
        check_slender(flexure, kind, L, self.values)
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
                useReducedOrderIntegration=2,  # Coarse cables lock without it.
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
        """Return an inactive constraint that keeps the gap of a stop closed."""
        u, drawn = unit(stop.direction), self.hit_point(stop)
        wall = drawn + value(stop, "position", self.values) * u
        pair = [self._marker(stop.on, wall, u), self._marker(stop.body, drawn, u)]
        joint = self.items.GenericJoint(
            markerNumbers=pair, constrainedAxes=[1, 0, 0, 0, 0, 0], activeConnector=False
        )
        return int(self.mbs.AddObject(joint))

    def _index(self) -> None:
        """Store the indices of the coordinates of nodes and bodies."""
        where = self.mbs.GetNodeODE2Index
        for name, node in self._body_nodes.items():
            body = self.rigid[name]
            self.rigid[name] = Rigid(body.object, int(where(node)), body.centre)
        for name, nodes in self._cable_nodes.items():
            self.nodes[name] = np.array([int(where(node)) for node in nodes])


def _check_supported(
    mechanism: Mechanism, values: Mapping[str, float], given: Mapping[str, float]
) -> None:
    """Reject friction, damping in proportion to mass, torsion, moving walls or bases."""
    unsupported = [f"{f.name}.coefficient" for f in mechanism.frictions
                   if value(f, "coefficient", values)]  # fmt: skip
    unsupported += [f"{s.name}.friction" for s in mechanism.stops if value(s, "friction", values)]
    for name in ("stiffness", "damping"):
        unsupported += [f"{j.name}.{name}" for j in mechanism.joints
                        if getattr(j, name) is not None and value(j, name, values)]  # fmt: skip
    if values["damping.zeta"]:
        unsupported.append("damping.zeta")
    forces = {f.name for f in mechanism.forces}
    unsupported += [name for name, x in given.items() if x and name.split(".")[0] not in forces]
    for kind in mechanism.flexure_types:
        if kind.profile != LEAF or kind.curvature is not None or kind.rise is not None:
            raise FiniteElementError(
                f"the flexures {kind.name} are not straight and uniform: the finite elements have "
                "no other flexures; remove profile, curvature and rise"
            )
    for name in unsupported:
        raise FiniteElementError(
            f"{name} is not 0: the finite elements have no friction, no torsion at joints, no "
            "damping in proportion to mass, no moving walls and no moving base; set it to 0"
        )
