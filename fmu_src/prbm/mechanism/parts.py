"""Parts of a mechanism as frozen data, and the values of their fields."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from ..base.errors import MechanismError
from .expressions import Quantity, affine
from .flexure import CLAMP, LEAF, NOTCH, TAPER

Point = tuple[Quantity, Quantity]

GROUND = "ground"
LAWS = RIGID, COMPLIANT = ("rigid", "compliant")
KNEE_SHARE = 0.9  # Of the tensile strength: the amplitude that is survived for 1,000 cycles.


@dataclass(frozen=True)
class Body:
    """A rigid body.

    Parameters
    ----------
    name : str
        Prefix of its parameters, for instance ``shuttle``.
    mass : Quantity
        Mass [kg].
    inertia : Quantity
        Moment of inertia about the centre of mass [kg m^2].
    centre : Point
        Centre of mass as drawn [m].
    points : mapping
        Points as drawn, by name [m].
    outline : tuple of Point
        Corners of the outline as drawn, in order [m]; empty if pictures show the hull of the
        points.  The outline is drawn only: mass, inertia and contact do not depend on it.
    holes : tuple of tuples of Point
        Corners of the holes in the outline as drawn [m].
    start_angle, start_x, start_y : Quantity or None
        Rotation [rad] and displacement of the centre of mass [m] from the straight shape at the
        start; None: not given.
    start_omega, start_vx, start_vy : Quantity or None
        Angular velocity [rad/s] and velocity of the centre of mass [m/s] at the start.
    """

    name: str
    mass: Quantity
    inertia: Quantity
    centre: Point
    points: Mapping[str, Point] = field(default_factory=dict)
    outline: tuple[Point, ...] = ()
    holes: tuple[tuple[Point, ...], ...] = ()
    start_angle: Quantity | None = None
    start_x: Quantity | None = None
    start_y: Quantity | None = None
    start_omega: Quantity | None = None
    start_vx: Quantity | None = None
    start_vy: Quantity | None = None


@dataclass(frozen=True)
class GroundPart:
    """A fixed part, for pictures and drawings only.

    Parameters
    ----------
    outline : tuple of Point
        Corners of the outline, in order [m].
    holes : tuple of tuples of Point
        Corners of the holes in the outline [m].
    """

    outline: tuple[Point, ...]
    holes: tuple[tuple[Point, ...], ...] = ()


@dataclass(frozen=True)
class FlexureType:
    """Section, material and model of flexures.

    Parameters
    ----------
    name : str
        Prefix of the parameters, for instance ``flexure``.
    model : str
        Model, a key of :data:`prbm.mechanism.flexure.MODELS`.
    thickness, width : Quantity
        Dimensions of the section in the plane of motion and across it [m]: of a leaf, at the start
        of a taper, and at the waist of a notch.
    youngs_modulus : Quantity
        Young's modulus [Pa].
    density : Quantity
        Density [kg/m^3].
    coefficients : mapping
        Values that replace the published coefficients of the model, by name [-].
    n : int
        Number of links of the model nR; 0 for other models.
    order : int or None
        Order of the polynomial of the bending moment of a beam; None: the default.
    nodes : int or None
        Number of nodes of a beam, or of those in its notch or waist; None: the default.
    axial : bool
        Whether the flexures can stretch.
    profile : str
        Section along a beam: uniform (leaf), linear (taper), or with a notch in the middle.
    end_thickness : Quantity or None
        Thickness at the end of a taper; None: the same as at its start.  Thickness outside a notch;
        None: thickness + 2 notch_depth [m].
    end_width : Quantity or None
        Width at the end of a taper [m]; None: the same as at its start.
    notch_radius : Quantity or None
        Radius of a circular notch, or of the fillets of a waist [m].  Half axis along the flexure
        if they are elliptic.
    notch_depth : Quantity or None
        Half axis across the flexure [m]; None: notch_radius.
    waist_length : Quantity or None
        Length of the uniform waist of a notch between two fillets [m]; None: no waist.
    curvature : Quantity or None
        Curvature of a beam that is drawn as a circular arc [1/m].  A positive one turns left from
        the start to the end.
    rise : Quantity or None
        Distance of the parallel tangents at the ends of a beam that is drawn as half a period of a
        cosine [m].  It is positive if the end is to the left of the tangent at the start.
    initial_strain : Quantity or None
        Strain of flexures that stretch without a force, relative to the drawn shape [-].  Residual
        stress sigma is -sigma/E; a flexure that was made too long has a positive one.
    stress : bool
        Whether the stress of the flexures, and its peak, are outputs.
    yield_strength, tensile_strength : float or None
        Strengths of the material [Pa].
    fatigue_strength : float or None
        Amplitude of a fully reversed stress that the material survives for ``fatigue_cycles`` [Pa].
    fatigue_cycles : float or None
        This number of cycles [-].
    """

    name: str
    model: str
    thickness: Quantity
    width: Quantity
    youngs_modulus: Quantity
    density: Quantity
    coefficients: Mapping[str, Quantity] = field(default_factory=dict)
    n: int = 0
    order: int | None = None
    nodes: int | None = None
    axial: bool = False
    profile: str = LEAF
    end_thickness: Quantity | None = None
    end_width: Quantity | None = None
    notch_radius: Quantity | None = None
    notch_depth: Quantity | None = None
    waist_length: Quantity | None = None
    curvature: Quantity | None = None
    rise: Quantity | None = None
    initial_strain: Quantity | None = None
    stress: bool = False
    yield_strength: float | None = None
    tensile_strength: float | None = None
    fatigue_strength: float | None = None
    fatigue_cycles: float | None = None

    @property
    def hinge(self) -> bool:
        """Whether the flexure is a notch without a waist, which bends like a hinge."""
        return self.profile == NOTCH and self.waist_length is None

    def default(self, name: str) -> str | None:
        """Return the expression of a dimension of the profile that is not given; None: unused."""
        if self.profile == TAPER and name in ("end_thickness", "end_width"):
            return self._reference(name.removeprefix("end_"))
        if self.profile == NOTCH and name == "notch_depth":
            return self._reference("notch_radius")
        if self.profile == NOTCH and name == "end_thickness":
            return f"{self._reference('thickness')} + 2*({self._reference('notch_depth')})"
        return None

    def _reference(self, name: str) -> str:
        """Return the expression of a dimension, or the name of its parameter."""
        quantity = getattr(self, name)
        if quantity is None:
            quantity = self.default(name)
        return quantity if isinstance(quantity, str) else f"{self.name}.{name}"


@dataclass(frozen=True)
class Flexure:
    """A flexure between two points, each ``body.point``.

    Each of the ``ends`` has one of these types:

    * ``clamp``: fixed to the body;
    * ``pin``: free to rotate about the point;
    * ``free``: the tip of a cantilever; the body at this end is fixed to the last link of the model
      1R, 2R or 3R.  In a chain (nR) and a beam it is the same as a clamp.
    """

    name: str
    type: str
    start: str
    end: str
    ends: tuple[str, str] = (CLAMP, CLAMP)


@dataclass(frozen=True)
class Joint:
    """A pin between two points, each ``body.point``, that are drawn at the same position.

    With a ``stiffness`` or a ``damping``, torsion k (phi - phi0) + c phi' turns the bodies back.
    The angle phi is the rotation of the body of the end relative to that of the start since the
    drawn shape, counter-clockwise.

    Parameters
    ----------
    name, start, end : str
        Prefix of its parameters, for instance ``joint``, and the two points.
    stiffness : Quantity or None
        Torsional stiffness k [N m/rad]; None: no spring.
    free_angle : Quantity or None
        Angle phi0 without a moment of the spring [rad]; None: 0, as drawn.
    damping : Quantity or None
        Coefficient c of viscous damping [N m s/rad]; None: no damper.
    """

    name: str
    start: str
    end: str
    stiffness: Quantity | None = None
    free_angle: Quantity | None = None
    damping: Quantity | None = None

    def __post_init__(self) -> None:
        if self.free_angle is not None and self.stiffness is None:
            raise MechanismError(
                f"{self.name}.free_angle: the joint has no spring; add stiffness, or remove "
                "free_angle"
            )

    @property
    def elastic(self) -> bool:
        """Whether a spring or a damper joins the bodies."""
        return self.stiffness is not None or self.damping is not None


@dataclass(frozen=True)
class Spring:
    """A coil spring and a damper side by side between two points, each ``body.point``.

    The spring pulls both points together with the force k x + k3 x^3 + c l', positive in tension,
    for the elongation x = l - l0 of the distance l of the points.  A spring that acts on one side
    has no force on the other side of l0, and never one of the other sign.

    Parameters
    ----------
    name : str
        Prefix of its parameters and outputs, for instance ``spring``.
    start, end : str
        Its ends, on two bodies or on a body and the ground.
    stiffness : Quantity
        Stiffness k [N/m].
    free_length : Quantity or None
        Length l0 without a force [m]; None: the distance of the ends as drawn.
    cubic_stiffness : Quantity
        Coefficient k3 of the cube of the elongation [N/m^3]; negative if the spring softens.
    damping : Quantity
        Coefficient c of viscous damping [N s/m].
    acts : str
        A key of :data:`SIDES`: the sign of its force.
    """

    name: str
    start: str
    end: str
    stiffness: Quantity
    free_length: Quantity | None = None
    cubic_stiffness: Quantity = 0.0
    damping: Quantity = 0.0
    acts: str = "both"

    def __post_init__(self) -> None:
        if self.acts not in SIDES:
            raise MechanismError(f"{self.name}.acts = {self.acts!r} must be {', '.join(SIDES)}")

    @property
    def side(self) -> int:
        """Sign of the forces of a spring that acts on one side; 0: both."""
        return SIDES[self.acts]


SIDES = {"both": 0, "tension": 1, "compression": -1}


@dataclass(frozen=True)
class Guide:
    """A straight line that a point of a body stays on: a pin in a slot, or a slider.

    Parameters
    ----------
    name, point : str
        Prefix of its outputs and the guided point, ``body.point``.
    start, end : str
        Two points of the line, both on the ground or on one other body, which carries the line.
        The line is unlimited, and passes through the guided point as drawn.
    turning : bool
        Whether the guided body may turn; otherwise it keeps its angle relative to the carrier.
    friction : Quantity or None
        Coefficient of friction along the line, with the force of the guide as normal force [-].
    """

    name: str
    point: str
    start: str
    end: str
    turning: bool = True
    friction: Quantity | None = None

    @property
    def body(self) -> str:
        """Name of the guided body."""
        return body_of(self.point)

    @property
    def on(self) -> str:
        """Name of the body that carries the line, or ``ground``."""
        return body_of(self.start)


@dataclass(frozen=True)
class Stop:
    """A contact of a point of a body with a wall, fixed to the ground or to another body.

    Parameters
    ----------
    name : str
        Prefix of its parameters and outputs, for instance ``stop``.
    body : str
        Body that hits the wall.
    point : Point
        Hit point as drawn [m].
    direction : float
        Direction in which the body approaches the wall, counter-clockwise from +x [deg].  The wall
        is a line across this direction.
    position : Quantity
        Displacement of the hit point from the straight shape along the direction at which it
        touches the wall [m], measured in the frame of the body or ground that carries the wall.
    offset : Quantity
        Shift of the hit point along the wall, positive to the left of the direction [m].
    restitution : Quantity
        Coefficient of restitution, energetic if there is friction [-].
    friction : Quantity
        Coefficient of friction [-].
    rest_speed : Quantity
        Closing speed below which an impact ends in rest, if the body is then pressed against the
        wall [m/s].
    on : str
        Body that carries the wall, or ``ground``.
    law : str
        Law of impact, a member of :data:`LAWS`: ``rigid`` (Newton's or Stronge's law), or
        ``compliant`` (:mod:`prbm.mechanics.compliance`).
    stiffness : Quantity or None
        Stiffness of a compliant stop, force over indentation^exponent [N/m^exponent].
    exponent : Quantity or None
        Exponent of a compliant stop: 1 for a plate or a pad (default), 1.5 for a sphere.
    """

    name: str
    body: str
    point: Point
    direction: float = 0.0
    position: Quantity = 0.0
    offset: Quantity = 0.0
    restitution: Quantity = 0.6
    friction: Quantity = 0.0
    rest_speed: Quantity = 1e-3
    on: str = GROUND
    law: str = RIGID
    stiffness: Quantity | None = None
    exponent: Quantity | None = None

    def __post_init__(self) -> None:
        if self.compliant and self.exponent is None:
            object.__setattr__(self, "exponent", 1.0)

    @property
    def compliant(self) -> bool:
        """Whether the stop has the compliant law."""
        return self.law == COMPLIANT


@dataclass(frozen=True)
class Friction:
    """Coulomb friction against the motion of a body along a direction [deg].

    It acts at a point as drawn [m] (default: the centre of mass).  The normal force [N] is
    max(0, normal_force + normal_stiffness * s), where s [m] is the displacement of the point to
    the left of the direction (section 3.4.2 of the thesis).
    """

    name: str
    body: str
    direction: float = 0.0
    coefficient: Quantity = 0.0
    normal_force: Quantity = 0.0
    normal_stiffness: Quantity = 0.0
    point: Point | None = None


@dataclass(frozen=True)
class Force:
    """A force and a moment on a body: inputs ``name.x``, ``name.y`` [N], ``name.moment`` [N m].

    The force acts at a point as drawn [m] (default: the centre of mass).
    """

    name: str
    body: str
    point: Point | None = None


@dataclass(frozen=True)
class Probe:
    """A point, ``body.point``, whose motion is an output.

    The outputs are the displacement from the straight shape, ``name.x`` and ``name.y`` [m], and the
    velocity, ``name.vx`` and ``name.vy`` [m/s].
    """

    name: str
    point: str


@dataclass(frozen=True)
class Release:
    """Start of the motion, from one of three shapes.

    * ``displacement``: a force on a point of a body along a direction holds it (default).
    * ``angle``: a moment on the body holds it.
    * ``amplitude``: the mechanism is displaced from its rest position under gravity along a mode.

    Parameters
    ----------
    body : str
        Body that is released.
    direction : float
        Direction of displacement, amplitude and velocity, counter-clockwise from +x [deg].
    displacement : Quantity or None
        Displacement of the point from the straight shape along the direction [m].
    velocity : Quantity
        Velocity of the point along the direction [m/s]; the velocities of the other coordinates are
        those of least kinetic energy.
    point : Point or None
        Point of the body as drawn [m]; None: its centre of mass.
    angle : Quantity or None
        Rotation of the body from the straight shape [rad].
    mode : int or None
        Number of the mode, from 1.
    amplitude : Quantity or None
        Displacement of the point along the direction by the mode, from the rest position [m].
    """

    name: ClassVar[str] = "release"
    body: str
    direction: float = 0.0
    displacement: Quantity | None = None
    velocity: Quantity = 0.0
    point: Point | None = None
    angle: Quantity | None = None
    mode: int | None = None
    amplitude: Quantity | None = None

    def __post_init__(self) -> None:
        if self.angle is None and self.amplitude is None and self.mode is None:
            object.__setattr__(self, "displacement", self.displacement or 0.0)

    @property
    def start(self) -> str:
        """Name of the given start: ``displacement``, ``angle`` or ``amplitude``."""
        if self.angle is not None:
            return "angle"
        return "displacement" if self.mode is None else "amplitude"

    @property
    def turns(self) -> bool:
        """Whether a moment holds the body at a rotation, instead of a force at a displacement."""
        return self.angle is not None


Part = (
    Body
    | FlexureType
    | Flexure
    | Joint
    | Spring
    | Guide
    | Stop
    | Friction
    | Force
    | Probe
    | Release
)

LENGTH_MIN = 1e-9  # m; smallest dimension of a mechanism.
MASS_MIN = 1e-15  # kg; half the mass of a cubic micrometre of silicon.
LENGTH_MAX = 1e3  # m; largest dimension of a mechanism.
RESTITUTION_MIN = 0.01  # Smallest coefficient of restitution of a compliant stop.
ANGLE_MAX = 100.0  # rad; largest rotation of a release, at the start or of a free angle.
POSITIONS = ("start_angle", "start_x", "start_y")
VELOCITIES = ("start_omega", "start_vx", "start_vy")
"""Fields of bodies that are positions and velocities at the start."""
MODE_MAX = 512  # Largest number of the mode of a release.


def field_of(part: Part, name: str) -> Quantity | None:
    """Return a field, or the expression of its default; None if it is not given.

    Examples
    --------
    >>> kind = FlexureType("hinge", "beam", 1e-3, 1e-2, 2e11, 7800.0, profile="notch",
    ...                    notch_radius=4e-3)
    >>> field_of(kind, "end_thickness")
    'hinge.thickness + 2*(hinge.notch_radius)'
    """
    given: Quantity | None = getattr(part, name)
    if given is None and isinstance(part, FlexureType):
        return part.default(name)
    return given


def value(part: Part, name: str, values: Mapping[str, float]) -> float:
    """Return the value of a field: of the parameter ``part.field``, or of its expression."""
    quantity = field_of(part, name)
    if isinstance(quantity, str):
        return affine(quantity)(values)
    return values[f"{part.name}.{name}"]


def body_of(reference: str) -> str:
    """Return the name of the body in ``body.point``."""
    return reference.rpartition(".")[0]
