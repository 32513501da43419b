"""The FMI variables of a mechanism, which all its FMUs have in common.

The value reference of a variable depends on its name only: it is the CRC-32 of the name in UTF-8,
without the highest bit.  A variable therefore keeps its reference when others are added, removed or
moved, in Python and native FMUs and in every version of FMI.
"""

import math
import re
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from ..base.errors import MechanismError, ParameterError
from ..base.names import unknown
from ..base.tolerances import WALL_MOBILITY_MAX
from ..mechanics.inputs import MOBILITY, input_units
from ..mechanics.stress import stressed
from ..mechanism.description import Mechanism
from ..mechanism.parameters import Parameter
from ..mechanism.parts import GROUND, Force, Guide, Spring, Stop
from .scales import Scales, scales
from .units import QUANTITIES, Quantity

Number = float | int | bool

BASE = "base"
CLOCK = "Clock"

# Computed variables of each part, in the order of their slots in the C kernel.
BODY_OUTPUTS = ("x", "y", "angle", "vx", "vy", "omega")
PROBE_OUTPUTS = ("x", "y", "vx", "vy")
STOP_OUTPUTS = (
    "gap", "gap_rate", "force", "point.displacement", "point.velocity", "point.mobility",
)  # fmt: skip
SPRING_OUTPUTS = ("force", "length", "length_rate")
GUIDE_OUTPUTS = ("force", "moment")  # The moment only of guides in which bodies do not turn.
BASE_OUTPUTS = (f"{BASE}.force.x", f"{BASE}.force.y", f"{BASE}.moment")
STORED = ("energy.dissipated", "energy.work")  # Energies that are integrated, hence states.
ENERGIES = ("energy.kinetic", "energy.elastic", "energy.gravitational", *STORED)
LATCHED = (
    "contact", "impact_count", "impact_time", "approach_speed", "rebound_speed", "impulse",
    "energy_lost", "modal_restitution", "impulse_sum",
)  # fmt: skip
COMPLIANT_OUTPUTS = ("peak_force", "indentation", "contact_duration", "contact_loss")
"""Further outputs of compliant stops."""
COMPLIANT_STORED = ("impulse_sum", "contact_loss")  # Those that are integrated, hence states.
LINK_OUTPUTS = ("angle", "omega")
STRETCH_OUTPUTS = ("strain", "strain_rate")
FLEXURE_ANGLE = re.compile(r"^(link\[\d+\]|\w+\.(bend\[\d+\]|start|end))\.angle$")
FLEXURE_STRAIN = re.compile(r"^\w+(\[\d+\])?\.strain$")
STRESS_OUTPUTS = ("stress_start", "stress_end", "stress")
NOMINAL_STRESS = 1e8  # Pa
PEAK_OUTPUTS = ("peak_stress", "peak_stress_time", "peak_stress_position")
INDICATORS = ("impact", "release", "slip")  # Event indicators of a stop.


@dataclass(frozen=True)
class Variable:
    """A variable of the interface.

    Parameters
    ----------
    name : str
        Structured name.
    description : str
        One sentence or phrase.
    causality, variability, initial : str
        As in FMI 2.0; ``initial`` is empty for inputs.
    unit : str
        SI unit of a Real; empty for other types.
    type : {"Real", "Integer", "Boolean", "Clock"}
        Type in FMI 2.0, or a clock of FMI 3.0.
    start : number or None
        Start value of parameters and inputs.
    minimum, maximum : float
        Inclusive bounds; infinite if unbounded.
    nominal : float or None
        Typical magnitude.
    derivative_of : str or None
        Name of the variable whose time derivative this one is.
    display : str or None
        Display unit where it differs from the one of the quantity.
    reinit : bool
        Whether an event may change this state in model exchange.
    """

    name: str
    description: str
    causality: str
    variability: str
    initial: str
    unit: str = ""
    type: str = "Real"
    start: Number | None = None
    minimum: float = -math.inf
    maximum: float = math.inf
    nominal: float | None = None
    derivative_of: str | None = None
    display: str | None = None
    reinit: bool = False

    @property
    def reference(self) -> int:
        """The value reference: the CRC-32 of the name without its highest bit."""
        return zlib.crc32(self.name.encode()) & 0x7FFFFFFF

    @property
    def quantity(self) -> Quantity:
        """The physical quantity of a Real."""
        return QUANTITIES[self.unit]


def variables(mechanism: Mechanism, sample: Mapping[str, Number]) -> tuple[Variable, ...]:
    """Return all variables of a mechanism, in the order of the interface.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism to export.
    sample : mapping
        All outputs of a simulation at its start, by name.

    Raises
    ------
    MechanismError
        If two variables share a name or a value reference, a name is not ASCII, or a parameter has
        an unknown unit or an invalid nominal value.
    """
    nominal = scales(mechanism, sample)
    result = tuple(_variables(mechanism, sample, nominal))
    missing = sample.keys() - {v.name for v in result}
    if missing:
        raise MechanismError(f"no description for the outputs {', '.join(sorted(missing))}")
    check_names(result)
    return result


TIME = Variable("time", "Time", "independent", "continuous", "", "s")  # In FMI 3.0 only.


def check_names(variables: Sequence[Variable]) -> None:
    """Check that names are ASCII and that names and value references are unique.

    Raises
    ------
    MechanismError
        If a name is not ASCII, or is used twice, or two value references are equal.
    """
    seen: dict[int, str] = {}
    for variable in variables:
        if seen.get(variable.reference) == variable.name or (
            variable.name == TIME.name and variable is not TIME
        ):
            raise MechanismError(
                f"two variables of the FMU would have the name {variable.name}: rename the "
                "parameter or the part that it comes from"
            )
        if not variable.name.isascii():
            raise MechanismError(
                f"{variable.name}: variable names of FMI consist of the letters a to z without "
                "accents, digits and _; rename the part"
            )
        other = seen.setdefault(variable.reference, variable.name)
        if other != variable.name:
            raise MechanismError(
                f"{variable.name} and {other} have the same value reference "
                f"{variable.reference} by coincidence: rename one of them"
            )


def with_starts(
    variables: tuple[Variable, ...], changes: Mapping[str, float]
) -> tuple[Variable, ...]:
    """Return the variables with changed start values.

    Raises
    ------
    ParameterError
        If a name is not a parameter or input.
    """
    by_name = {v.name: v for v in variables}
    settable = {n: v for n, v in by_name.items() if v.causality in ("parameter", "input")}
    for name in changes:
        if name not in by_name:
            raise ParameterError(unknown(name, settable))
        if name not in settable:
            raise ParameterError(
                f"{name} is computed by the model and cannot be set; parameters and inputs can"
            )
    return tuple(
        replace(v, start=float(changes[v.name])) if v.name in changes else v for v in variables
    )


def _variables(
    mechanism: Mechanism, sample: Mapping[str, Number], nominal: Scales
) -> Iterator[Variable]:
    for parameter in mechanism.parameters:
        yield _parameter(_checked(parameter))
    for name in sample:
        if name.endswith(".gamma0"):
            yield Variable(
                name,
                "Length of the stubs at the clamps, as a fraction of the length of the cantilever: "
                "1 minus the other gammas",
                "calculatedParameter", "fixed", "calculated", "1", minimum=0.0, maximum=1.0,
            )  # fmt: skip
    yield from _inputs(mechanism, nominal)
    for body in mechanism.bodies:
        yield from _body(body.name, nominal)
    for probe in mechanism.probes:
        yield from _probe(probe.name, f"of {probe.point}", nominal)
    for stop in mechanism.stops:
        rigid = _stop(stop.name, nominal)
        yield from _of_compliant_stop(rigid, stop.name, nominal) if stop.compliant else rigid
    for spring in mechanism.springs:
        yield from _spring(spring, nominal)
    for guide in mechanism.guides:
        yield from _guide(guide, nominal)
    yield from _base(nominal)
    yield from _energies(nominal, -math.inf if mechanism.springs else 0.0)
    yield from _flexures(sample, nominal)
    for i in stressed(mechanism):
        yield from _stress(mechanism.flexures[i].name, nominal)
    yield Variable(
        "mode.frequency",
        "Fundamental frequency about the static equilibrium under gravity, without stops",
        "local", "fixed", "calculated", "Hz", minimum=0.0, nominal=nominal("Hz"),
    )  # fmt: skip


def _checked(parameter: Parameter) -> Parameter:
    """Return a parameter after a check of its unit and its nominal value.

    Raises
    ------
    MechanismError
        If the unit is unknown, or the nominal value is not positive and finite.
    """
    if (parameter.unit or "1") not in QUANTITIES:
        raise MechanismError(
            f"{parameter.name} has the unknown unit {parameter.unit!r}; give it in one of "
            f"{', '.join(QUANTITIES)}"
        )
    nominal_value = parameter.nominal
    if nominal_value is not None and not 0.0 < nominal_value < math.inf:
        raise MechanismError(
            f"{parameter.name}: nominal = {nominal_value} must be positive and finite"
        )
    return parameter


DISPLAY = {"thickness": "um", "beta": "us", "offset": "mm"}


def _parameter(p: Parameter) -> Variable:
    return Variable(
        p.name,
        p.description,
        "parameter",
        "tunable" if p.tunable else "fixed",
        "exact",
        p.unit or "1",
        start=p.value,
        minimum=p.minimum,
        maximum=p.maximum,
        nominal=p.nominal,
        display=DISPLAY.get(p.name.rpartition(".")[2]),
    )


def _inputs(mechanism: Mechanism, nominal: Scales) -> Iterator[Variable]:
    units = input_units(mechanism)

    def given(name: str, description: str) -> Variable:
        unit = units[name]
        return Variable(
            name, description, "input", "continuous", "", unit, start=0.0, nominal=nominal(unit)
        )

    for force in mechanism.forces:
        yield given(f"{force.name}.x", f"Force on {pushed(force)} along x")
        yield given(f"{force.name}.y", f"Force on {pushed(force)} along y")
        yield given(f"{force.name}.moment", f"Moment on the {force.body}")
    for stop in mechanism.stops:
        yield given(
            f"{stop.name}.displacement",
            f"Displacement of the {wall(stop)}, added to {stop.name}.position",
        )
        yield given(
            f"{stop.name}.velocity",
            f"Velocity of the {wall(stop)}, rate of {stop.name}.displacement",
        )
    for force in mechanism.forces:
        for axis, total_of in (
            ("x", "impulses along x"),
            ("y", "impulses along y"),
            ("moment", "angular impulses"),
        ):
            point = f"the {force.body}" if axis == "moment" else pushed(force)
            total = given(
                f"{force.name}.impulse.{axis}",
                f"Sum of all {total_of} on {point}; an increase acts as an impulse at once",
            )
            yield replace(total, variability="discrete")
    for stop in mechanism.stops:
        mobility = given(
            f"{stop.name}.{MOBILITY}",
            f"Inverse effective mass (0 if immovable) of the {wall(stop)}",
        )
        yield replace(mobility, minimum=0.0, maximum=WALL_MOBILITY_MAX)
    for axis in "xy":
        yield given(
            f"{BASE}.acceleration.{axis}",
            f"Acceleration of the base along {axis}; all motion is relative to the base",
        )  # fmt: skip


def pushed(force: Force) -> str:
    """Return the point of a force, in words."""
    return f"{'the centre of mass' if force.point is None else 'a point'} of the {force.body}"


def wall(stop: Stop) -> str:
    """Return the wall of a stop and the frame of its motion, in words."""
    return "wall" if stop.on == GROUND else f"wall on the {stop.on}, relative to this body"


def _output(
    name: str,
    unit: str,
    description: str,
    nominal: Scales,
    *,
    minimum: float = -math.inf,
    derivative_of: str | None = None,
) -> Variable:
    return Variable(
        name, description, "output", "continuous", "calculated", unit,
        minimum=minimum, nominal=nominal(unit), derivative_of=derivative_of,
    )  # fmt: skip


def _displacements(name: str, point: str, nominal: Scales) -> Iterator[Variable]:
    for axis in "xy":
        yield _output(
            f"{name}.{axis}", "m", f"Displacement {point} along {axis} from the straight shape",
            nominal,
        )  # fmt: skip


def _velocities(name: str, point: str, nominal: Scales) -> Iterator[Variable]:
    for axis in "xy":
        yield _output(
            f"{name}.v{axis}", "m/s", f"Velocity {point} along {axis}", nominal,
            derivative_of=f"{name}.{axis}",
        )  # fmt: skip


def _probe(name: str, point: str, nominal: Scales) -> Iterator[Variable]:
    yield from _displacements(name, point, nominal)
    yield from _velocities(name, point, nominal)


def _body(body: str, nominal: Scales) -> Iterator[Variable]:
    centre = f"of the centre of mass of the {body}"
    yield from _displacements(body, centre, nominal)
    yield _output(
        f"{body}.angle", "rad", f"Rotation of the {body} from the straight shape", nominal
    )
    yield from _velocities(body, centre, nominal)
    yield _output(
        f"{body}.omega", "rad/s", f"Angular velocity of the {body}", nominal,
        derivative_of=f"{body}.angle",
    )  # fmt: skip


def _stop(stop: str, nominal: Scales) -> Iterator[Variable]:
    yield _output(f"{stop}.gap", "m", "Distance of the hit point from the wall", nominal)
    yield _output(
        f"{stop}.gap_rate", "m/s", "Rate of the gap, negative while the gap closes", nominal,
        derivative_of=f"{stop}.gap",
    )  # fmt: skip
    yield _output(
        f"{stop}.force", "N", "Force of the wall on the body in resting contact; impacts are "
        "impulses and do not contribute", nominal, minimum=0.0,
    )  # fmt: skip
    yield _output(
        f"{stop}.point.displacement", "m", "Displacement of the hit point along the direction of "
        f"the stop, from its place at contact with the wall at rest; the gap is closed if it "
        f"equals {stop}.displacement", nominal,
    )  # fmt: skip
    yield _output(
        f"{stop}.point.velocity", "m/s", "Velocity of the hit point along the direction of the "
        "stop", nominal, derivative_of=f"{stop}.point.displacement",
    )  # fmt: skip
    yield _output(
        f"{stop}.point.mobility", "1/kg", "Inverse of the effective mass of the hit point along "
        "the direction of the stop, without resting contacts", nominal, minimum=0.0,
    )  # fmt: skip
    latched = Variable(
        f"{stop}.contact", "Whether the stop holds the body in resting contact",
        "output", "discrete", "calculated", type="Boolean",
    )  # fmt: skip
    yield latched
    yield replace(
        latched, name=f"{stop}.impact_count", type="Integer", minimum=0,
        description="Number of impacts so far; the outputs of the last impact are valid if it is "
        "positive",
    )  # fmt: skip

    def last(name: str, unit: str, description: str, minimum: float = -math.inf) -> Variable:
        return replace(
            latched, name=f"{stop}.{name}", type="Real", unit=unit, description=description,
            minimum=minimum, nominal=None if name == "impact_time" else nominal(unit),
        )  # fmt: skip

    yield last("impact_time", "s", "Time of the last impact")
    yield last("approach_speed", "m/s", "Closing speed before the last impact", 0.0)
    yield last("rebound_speed", "m/s", "Opening speed after the last impact")
    yield last("impulse", "N.s", "Impulse of the wall at the last impact", 0.0)
    yield last("energy_lost", "J", "Energy lost at the last impact")
    yield last(
        "modal_restitution", "1",
        "Ratio of the velocities of the fundamental mode after and before the last impact, with "
        "reversed sign; far below -1 or above 1 if this mode has little energy before the impact",
    )  # fmt: skip
    yield last("impulse_sum", "N.s", "Sum of all impulses of the wall, including captures", 0.0)


def _spring(spring: Spring, nominal: Scales) -> Iterator[Variable]:
    name, ends = spring.name, f"{spring.start} and {spring.end}"
    yield _output(
        f"{name}.force", "N", f"Force of the spring and its damper between {ends}, positive in "
        "tension", nominal,
    )  # fmt: skip
    yield _output(f"{name}.length", "m", f"Distance of {ends}", nominal, minimum=0.0)
    yield _output(
        f"{name}.length_rate", "m/s", f"Rate of the distance of {ends}", nominal,
        derivative_of=f"{name}.length",
    )  # fmt: skip


def guide_outputs(guide: Guide) -> tuple[str, ...]:
    """Return the names of the outputs of a guide."""
    return GUIDE_OUTPUTS[:1] if guide.turning else GUIDE_OUTPUTS


def _guide(guide: Guide, nominal: Scales) -> Iterator[Variable]:
    line = f"the line from {guide.start} to {guide.end}"
    yield _output(
        f"{guide.name}.force", "N", f"Force of the guide on {guide.point}, positive to the left of "
        f"{line}", nominal,
    )  # fmt: skip
    if not guide.turning:
        yield _output(
            f"{guide.name}.moment", "N.m", f"Moment of the guide on {guide.body} about "
            f"{guide.point}, counter-clockwise", nominal,
        )  # fmt: skip


COMPLIANT_DESCRIPTIONS = {
    "force": "Force of the wall on the body",
    "contact": "Whether the body touches the wall",
    "impact_time": "Time of the first touch of the last impact",
    "approach_speed": "Closing speed at the first touch of the last impact",
    "rebound_speed": "Opening speed at the end of the last impact; 0 until then",
    "impulse": "Impulse of the wall during the last impact; 0 until its end",
    "energy_lost": "Energy lost during the last impact; 0 until its end",
    "impulse_sum": "Integral of the force of the wall",
}
"""Descriptions of outputs that differ from those of a rigid stop."""


def _of_compliant_stop(rigid: Iterator[Variable], stop: str, nominal: Scales) -> Iterator[Variable]:
    """Yield the outputs of a compliant stop: those of a rigid stop, and further ones."""
    for variable in rigid:
        name = variable.name.removeprefix(f"{stop}.")
        described = COMPLIANT_DESCRIPTIONS.get(name, variable.description)
        changed = replace(variable, description=described)
        if name == "force":
            changed = replace(changed, minimum=-math.inf)  # Round-off at the end of a contact.
        yield replace(changed, variability="continuous") if name == "impulse_sum" else changed
    yield _output(
        f"{stop}.peak_force", "N", "Largest force since the first touch of the last impact, not "
        "of earlier impacts", nominal, minimum=0.0,
    )  # fmt: skip
    yield _output(
        f"{stop}.indentation", "m", "Largest indentation since the first touch of the last impact",
        nominal, minimum=0.0,
    )  # fmt: skip
    duration = _output(
        f"{stop}.contact_duration", "s", "Duration of the last impact until the body separates or "
        "settles; 0 until then", nominal, minimum=0.0,
    )  # fmt: skip
    yield replace(duration, variability="discrete")
    yield _output(
        f"{stop}.contact_loss", "J", "Energy lost in the contacts of the stop so far", nominal
    )


def compliant_states(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the outputs of compliant stops that are states of model exchange."""
    stops = (stop.name for stop in mechanism.stops if stop.compliant)
    return tuple(f"{stop}.{name}" for stop in stops for name in COMPLIANT_STORED)


def _base(nominal: Scales) -> Iterator[Variable]:
    for axis in "xy":
        yield _output(
            f"{BASE}.force.{axis}", "N", f"Force of the mechanism on the ground along {axis}",
            nominal,
        )  # fmt: skip
    yield _output(
        f"{BASE}.moment", "N.m", "Moment of the mechanism on the ground, about the first flexure "
        "end there (without one: the origin)",
        nominal,
    )  # fmt: skip


def _energies(nominal: Scales, least: float) -> Iterator[Variable]:
    """Yield the energies; ``least`` is the lower bound of the elastic energy [J]."""
    yield _output("energy.kinetic", "J", "Kinetic energy", nominal, minimum=0.0)
    yield _output(
        "energy.elastic", "J",
        "Elastic energy of flexures, joints, springs and compliant stops; 0 without a force",
        nominal, minimum=least,
    )  # fmt: skip
    yield _output(
        "energy.gravitational", "J", "Potential energy of gravity, 0 in the straight shape", nominal
    )
    yield _output(
        "energy.dissipated", "J", "Energy lost to damping, friction and impacts so far", nominal
    )
    yield _output("energy.work", "J", "Work of the inputs and of the moving walls so far", nominal)


def _flexures(sample: Mapping[str, Number], nominal: Scales) -> Iterator[Variable]:
    """Yield the angles and strains of the flexures."""
    for owner in (n.removesuffix(".angle") for n in sample if FLEXURE_ANGLE.search(n)):
        yield from _flexure_angle(owner, nominal)
        if f"{owner}.strain" in sample:
            yield from _strain(owner)
    for owner in (n.removesuffix(".strain") for n in sample if FLEXURE_STRAIN.search(n)):
        if f"{owner}.angle" not in sample:
            yield from _strain(owner)


def _number(owner: str) -> str:
    """Return the number in the name of a link or of a coefficient."""
    return owner.rpartition("[")[2].removesuffix("]")


def _flexure_angle(owner: str, nominal: Scales) -> Iterator[Variable]:
    """Yield the angle of a link, a coefficient of a beam or the rotation of a pinned end."""
    flexure, _, part = owner.rpartition(".")
    if not flexure:
        description = f"Angle of link {_number(owner)} of the flexures, counter-clockwise from +x"
        rate = f"Angular velocity of link {_number(owner)}"
    elif part in ("start", "end"):
        description = f"Rotation of the pinned {part} of the flexure {flexure} from the drawing"
        rate = f"Angular velocity of the pinned {part} of the flexure {flexure}"
    else:
        description = (
            f"Coefficient of the Legendre polynomial {_number(owner)} in the bending moment of the "
            f"flexure {flexure}, divided by EI/length"
        )
        rate = f"Rate of coefficient {_number(owner)} of the flexure {flexure}"
    angle = replace(
        _output(f"{owner}.angle", "rad", description, nominal),
        causality="local",
        nominal=1.0,  # The scale of absolute angles, not of a deflection.
    )
    yield angle
    yield replace(
        angle, name=f"{owner}.omega", description=rate,
        unit="rad/s", nominal=nominal("rad/s"), derivative_of=angle.name,
    )  # fmt: skip


def _strain(owner: str) -> Iterator[Variable]:
    """Yield the strain of a link or of a beam."""
    link = owner.startswith("link[")
    part = f"link {_number(owner)}" if link else f"the flexure {owner}"
    of = f"{part} of the flexures" if link else part
    strain = Variable(
        f"{owner}.strain",
        f"Logarithmic strain of {of}: ln(length / length when straight)",
        "local", "continuous", "calculated", "1",
    )  # fmt: skip
    yield strain
    yield replace(
        strain, name=f"{owner}.strain_rate", description=f"Rate of the strain of {part}",
        unit="1/s", derivative_of=strain.name,
    )  # fmt: skip


def _stress(flexure: str, nominal: Scales) -> Iterator[Variable]:
    """Yield the stress of a flexure and its peak."""

    def stress(name: str, description: str, minimum: float = -math.inf) -> Variable:
        found = _output(f"{flexure}.{name}", "Pa", description, nominal, minimum=minimum)
        return replace(found, nominal=NOMINAL_STRESS, display="MPa")

    for end in ("start", "end"):
        yield stress(
            f"stress_{end}",
            f"Stress at the {end} of the flexure {flexure}, on its left face, seen from start to "
            "end; positive in tension",
        )
    yield stress("stress", f"Largest magnitude of the stress in the flexure {flexure}", 0.0)
    yield stress(
        "peak_stress", f"Largest magnitude of the stress in the flexure {flexure} so far", 0.0
    )
    yield replace(
        _output(f"{flexure}.peak_stress_time", "s", f"Time of {flexure}.peak_stress", nominal),
        nominal=None,
    )
    yield _output(
        f"{flexure}.peak_stress_position", "m", f"Position of {flexure}.peak_stress along the "
        "flexure, from its start", nominal, minimum=0.0,
    )  # fmt: skip
